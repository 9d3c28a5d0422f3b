"""The limit state: the stress at which an interface slides as a function of standard normal
draws."""

import math
import time
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from scipy.special import ndtri

from stiction.base.arrays import Array, one_blas_thread
from stiction.base.errors import InputError, collect_warnings, merged
from stiction.base.model import checked
from stiction.base.progress import SILENT, Meter
from stiction.ensemble.batches import (
    Table,
    in_threads,
    on_executor,
    usable_cores,
    versions,
    workers_of,
)
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.monte_carlo import check_fields
from stiction.methods.protocol import METHODS, MethodObject, optional_member
from stiction.problem.problem import Problem
from stiction.problem.specimen import Slider
from stiction.random.equally_likely import AnyRandom
from stiction.random.fields import RandomInterface
from stiction.random.stresses import support_in_stress

MAX_RANKED, RANKINGS, LOW_QUANTILE_SIGMAS = 32, 4_000, 3.0
"""Most samples of each interface, and about the number of all samples,
by which interfaces are ordered, and the standard deviations below the
mean that are compared."""
MAX_FACTORS = 8
"""Most random factors of the strength at a node, which together have a
negligible probability."""
MIN_THREAD_SECONDS = 2e-3
"""Seconds of work that justify a thread."""


@dataclass(frozen=True, eq=False)
class LimitState:
    """Stress at onset as a function of draws.

    See `stiction.external.limit_state`.

    Stresses may be taken relative to the normal pressure. If the
    pressure is random, each stress is multiplied by the mean pressure
    over the pressure of its sample. A given stress then corresponds to
    a given friction coefficient.

    Examples
    --------
    >>> from types import SimpleNamespace as Named
    >>> random = Named(
    ...     varying={"strength"}, several=True, member=lambda draws: draws[:, 0] > 0.0
    ... )
    >>> experiment = Named(
    ...     method=Named(type="mine", label="my method"),
    ...     dimension=7,
    ...     random=random,
    ...     with_seed=lambda seed: Named(draws=lambda first, samples: (seed, first, samples)),
    ... )
    >>> state = LimitState(experiment)
    >>> state, state.several
    (LimitState(critical_stress by my method, of 7 draws), True)
    >>> state.guide
    "'mine' has no less expensive first stage"
    >>> state.draws(5, 2, 3), state.member(np.array([[-1.0], [2.0]])).tolist()
    ((5, 2, 3), [0, 1])
    """

    experiment: Experiment
    per_pressure: bool = False
    workers: int = 1  # threads, on which results do not depend
    meter: Meter = SILENT  # counts the samples
    executor: Executor | None = None  # instead of threads, as in `monte_carlo`

    def __repr__(self) -> str:
        text = f"critical_stress by {self.experiment.method.label}"
        return f"LimitState({text}, of {self.dimension} draws)"

    @property
    def dimension(self) -> int:
        """Number of draws in a sample."""
        return self.experiment.dimension

    @property
    def _random_pressure(self) -> bool:
        """Whether stresses are divided by a pressure that differs between samples."""
        return self.per_pressure and "normal_pressure" in self.experiment.random.varying

    def by(self, method: Any) -> Self:
        """Return the same limit state with a different method."""
        return replace(self, experiment=self.experiment.by(method))

    @cached_property
    def guide(self) -> Self | str:
        """The same limit state by the first stage of the method, or the reason against it."""
        experiment, method = self.experiment, self.experiment.method
        name = optional_member(method, "first_stage")
        if name is None:
            return f"{method.type!r} has no less expensive first stage"
        guide = METHODS[name]()
        unfit = optional_member(guide, "unfit_as_guide")
        reason: str | None = unfit(experiment.problem, experiment.random.varying)
        return reason or self.by(guide)

    def draws(self, seed: int, first: int, samples: int) -> Array:
        """Return the draws (samples, dimension) that `stiction.monte_carlo` uses."""
        return self.experiment.with_seed(seed).draws(first, samples)

    def member(self, draws: Array) -> NDArray[np.int64]:
        """Return, for each sample, the number of its equally likely interface."""
        return np.asarray(self.experiment.random.member(draws), np.int64)

    def profiles(self, draws: Array) -> dict[str, Array]:
        """Return sampled profiles by name, each with shape (samples, *shape)."""
        return self.experiment.profiles(draws)

    def __call__(self, draws: Array) -> Array:
        """Return the stress at onset, Pa, for draws (samples, dimension) or (dimension,).

        The stress is infinite if the event does not happen, because
        such a sample survives any stress.

        The first draw below is the stress, and the second the pressure, whose
        mean is 6. No sample slides below 2.

        >>> from types import SimpleNamespace as Named
        >>> from concurrent.futures import ThreadPoolExecutor
        >>> def solve(draws):
        ...     return {"normal_pressure": draws[:, 1:]}, {"critical_stress": draws[:, 0]}
        >>> def state(executor=None, seconds=1.0, batch=2, workers=1, **options):
        ...     counts, problem = [], Named(interface=Named(mean=lambda rows: rows.mean(-1)))
        ...     experiment = Named(
        ...         solve=solve,
        ...         seconds=seconds,
        ...         batch=batch,
        ...         pressure=6.0,
        ...         problem=problem,
        ...         random=Named(varying={"normal_pressure"}),
        ...         method=Named(label="mine"),
        ...     )
        ...     meter = Named(advance=counts.append)
        ...     made = LimitState(
        ...         experiment, meter=meter, workers=workers, executor=executor, **options
        ...     )
        ...     vars(made)["bounds"] = 2.0, 9.0
        ...     return made, counts
        >>> draws = np.array([[5.0, 3.0], [np.nan, 3.0], [1.5, 3.0], [7.0, 2.0], [8.0, 4.0]])
        >>> one, counts = state()
        >>> one(draws).tolist(), counts
        ([5.0, inf, 2.0, 7.0, 8.0], [2, 2, 1])
        >>> float(one(draws[3]))
        7.0
        >>> state(per_pressure=True)[0](draws).tolist()  # times 6 over the pressure
        [10.0, inf, 3.0, 21.0, 12.0]
        >>> with ThreadPoolExecutor(2) as executor:
        ...     state(executor, batch=9)[0](draws).tolist()
        [5.0, inf, 2.0, 7.0, 8.0]

        Two threads get 3 and 2 samples, unless a part would take less than 2
        ms.

        >>> two, counts = state(seconds=1e-3, batch=9, workers=2)
        >>> two(draws).tolist(), sorted(counts)
        ([5.0, inf, 2.0, 7.0, 8.0], [2, 3])
        >>> two, counts = state(seconds=4.9e-4, batch=9, workers=2)
        >>> two(draws).tolist(), sorted(counts)
        ([5.0, inf, 2.0, 7.0, 8.0], [1, 4])
        >>> one(-np.inf * draws)  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: method: mine returned an onset at minus infinity. ...
        """
        rows, experiment = np.atleast_2d(draws), self.experiment
        # Parts of at least `MIN_THREAD_SECONDS`, one for each thread,
        # and at most a batch.
        workers = self.workers if self.executor is None else workers_of(self.executor, 1)
        size = max(int(MIN_THREAD_SECONDS / experiment.seconds), -(-len(rows) // workers))
        size = max(1, min(size, experiment.batch))
        parts = np.split(rows, range(size, len(rows), size))
        if self.executor is not None:
            here = replace(self, workers=1, meter=SILENT, executor=None)
            solved = on_executor(partial(solve_part, here), parts, self.executor, self.meter)
            stress = np.concatenate([columns["stress"] for columns in solved])
        elif len(parts) == 1:
            stress = self._stress(rows)
        else:
            stress = np.concatenate(in_threads(self._stress, parts, self.workers))
        if np.any(stress == -np.inf):
            raise InputError(
                f"method: {experiment.method.label} returned an onset at minus infinity. It must"
                " return a stress, Pa, or NaN if the event does not happen"
            )
        # NaN means that the event does not happen at any stress.
        stress = np.where(np.isnan(stress), np.inf, stress)
        stress = np.maximum(stress, self.bounds[0])  # rounding may be slightly below
        return stress if np.ndim(draws) != 1 else stress[0]

    def _stress(self, draws: Array) -> Array:
        profiles, values = self.experiment.solve(draws)
        stress: Array = values["critical_stress"]
        if self._random_pressure:
            pressures = self.experiment.problem.interface.mean(profiles["normal_pressure"])
            stress = stress * self.experiment.pressure / pressures
        self.meter.advance(draws.shape[0])
        return stress

    @property
    def several(self) -> bool:
        """Whether there are several equally likely interfaces."""
        return bool(self.experiment.random.several)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Bounds, Pa, of the stress at which any sample slides, infinite if unknown."""
        return self.likely_bounds(0.0)

    def likely_bounds(self, negligible: float) -> tuple[float, float]:
        """Return bounds that hold for all samples except a negligible fraction.

        >>> from types import SimpleNamespace as Named
        >>> state = LimitState(Named(random=Named(members=[(2.0, 5.0), (1.0, 4.0)])))
        >>> class Bounded(LimitState):
        ...     def _bounds_of(self, random, negligible):
        ...         return random[0] + negligible, random[1] - negligible
        >>> Bounded(state.experiment).likely_bounds(0.25), Bounded(state.experiment).bounds
        ((1.25, 4.75), (1.0, 5.0))
        >>> Bounded(state.experiment).bounds_of_members(0.5)
        [(2.5, 4.5), (1.5, 3.5)]
        """
        lows, highs = zip(*self.bounds_of_members(negligible), strict=True)
        return min(lows), max(highs)

    def bounds_of_members(self, negligible: float = 0.0) -> list[tuple[float, float]]:
        """Return bounds for each of the equally likely interfaces."""
        members = self.experiment.random.members
        return [self._bounds_of(member, negligible) for member in members]

    def _bounds_of(self, random: RandomInterface, negligible: float) -> tuple[float, float]:
        """Return bounds for one interface.

        With the load profile p, the strength tau_p and the initial
        stress tau_0, the first node fails at the load min((tau_p -
        tau_0)/p). The lower bound is the mean stress at this load.

        A strength from 1 MPa and the load profile up to 1.5 give at least 0.2 +
        (1 - 0.2) / 1.5 MPa, if the initial stress is 0.2 MPa.

        >>> from types import SimpleNamespace as Named
        >>> import stiction as st
        >>> def between(low, high):
        ...     law = st.Beta(alpha=1.0, beta=1.0, low=low, high=high)
        ...     return st.RandomField(law, st.SquaredExponentialSpectrum(0.016))
        >>> load = st.Load(
        ...     profile=np.linspace(0.5, 1.5, 16), initial_stress=0.2e6, normal_pressure=2e6
        ... )
        >>> solid, friction = (
        ...     st.Solid(2e9, 0.2, 1200.0),
        ...     st.LinearWeakening(weakening_rate=1e11),
        ... )
        >>> problem = st.Problem(solid, st.Interface(0.1, 16), friction, load)
        >>> def bounds(strength, negligible=0.0, method=st.LocalCriterion(), **fields):
        ...     random = RandomInterface(strength=strength, **fields)
        ...     members = Named(members=(random,), varying=random.varying)
        ...     experiment = Named(problem=problem, random=members, method=method, pressure=3e6)
        ...     state = LimitState(experiment, per_pressure="normal_pressure" in fields)
        ...     return [round(end / 1e3, 3) for end in state.likely_bounds(negligible)]
        >>> strength = between(1e6, 2e6)
        >>> bounds(strength)
        [733.333, 2000.0]
        >>> bounds(strength, initial_stress=between(0.1e6, 0.3e6))  # 0.1 + (1 - 0.3) / 1.5
        [566.667, 2000.0]
        >>> bounds(strength, normal_pressure=between(2e6, 4e6))  # times 3/4, and 3/2
        [550.0, 3000.0]
        >>> bounds(
        ...     between(-2e6, 2e6), normal_pressure=between(2e6, 4e6)
        ... )  # 0.2 - 2.2 / 0.5, times 3/2
        [-6300.0, 3000.0]
        >>> bounds(strength, normal_pressure=between(0.0, 6e6))  # times 1/2, and infinity
        [366.667, inf]
        >>> bounds(strength, 1.28)  # 0.01 for each of 8 factors at 16 nodes
        [740.0, 1990.0]
        >>> bounds(strength.given({"x": [0.03], "values": [1.5e6]}, noise=1e5), 1.28)
        [733.333, 2000.0]
        >>> bounds(strength, method=Named())
        [-inf, inf]
        >>> bounds(strength, method=Named(bounded_by_strength=lambda *given: (True, False)))
        [733.333, inf]
        """
        problem = self.experiment.problem
        if any(field.conditions is not None for field in random.properties.values()):
            negligible = 0.0  # measured values may be rarer
        # Each factor at each node takes an equal part of the negligible
        # probability.
        chance = negligible / (MAX_FACTORS * problem.interface.size)
        low, high = support_in_stress(problem, random, "strength", chance)
        profile = np.broadcast_to(problem.load_profile, problem.interface.shape)
        least: Any = problem.load.initial_stress
        most: Any = least
        if "initial_stress" in random.varying:
            least, most = support_in_stress(problem, random, "initial_stress", chance)
        # The mean of a random initial stress is random itself. Take its
        # lowest value.
        initial = np.mean(np.broadcast_to(least, profile.shape))
        low = float(initial + np.min((low - most) / profile) * np.mean(profile))
        if self._random_pressure:
            ends = support_in_stress(problem, random, "normal_pressure", chance)
            mean = self.experiment.pressure
            # Stresses are multiplied by the mean pressure over the
            # pressure of the sample.
            ratios = mean / ends[1], mean / ends[0] if ends[0] > 0.0 else math.inf
            low, high = low * ratios[low < 0.0], high * ratios[1]
        bounded = optional_member(self.experiment.method, "bounded_by_strength")
        below, above = bounded(problem, "critical_stress")
        return low if below else -math.inf, high if above else math.inf


def weakest_first(state: LimitState) -> LimitState:
    """Return the same limit state, with its equally likely interfaces sorted, the weakest first.

    Neighbours are then alike, and a chain moves from one interface to
    the next as it goes down. The order is the order of a low quantile
    of a few samples, which are the same for each interface. The first
    stage solves them if it applies.

    >>> import stiction as st
    >>> solid, friction = st.Solid(2e9, 0.2, 1200.0), st.LinearWeakening(weakening_rate=1e11)
    >>> problem = st.Problem(solid, st.Interface(0.1, 16), friction)
    >>> def field(mean, cv):  # so smooth that each sample is uniform
    ...     spectrum = st.SquaredExponentialSpectrum(9.0)
    ...     return st.RandomField(st.Lognormal(mean=mean, cv=cv), spectrum, mean_mode=True)
    >>> def order(*fields):
    ...     state = LimitState(Experiment(problem, list(fields), st.LocalCriterion()))
    ...     return weakest_first(state).experiment.random.order
    >>> order(field(3e6, 0.1), field(1e6, 0.1), field(2e6, 0.1)), order(field(3e6, 0.1))
    ((1, 2, 0), ())
    >>> order(field(2e6, 0.05), field(2.6e6, 0.3))  # the low quantile counts, not the mean
    (1, 0)
    """
    experiment, random = state.experiment, state.experiment.random
    count = len(random.members)
    if count == 1:
        return state
    by = state if isinstance(state.guide, str) else state.guide
    ranked = int(np.clip(RANKINGS // count, 4, MAX_RANKED))
    # Each sample once for each member, selected by the middle of its
    # interval of the first draw.
    draws = np.repeat(state.draws(0, 0, ranked), count, axis=0)
    draws[:, 0] = np.tile(ndtri((np.arange(count) + 0.5) / count), ranked)
    onset = by(draws).reshape(ranked, count)
    # A sample that survives counts as the
    # strongest, so that means are finite.
    onset = np.minimum(onset, onset.max(where=np.isfinite(onset), initial=0.0))
    lowest = np.array(state.bounds_of_members())[:, 0]
    weak = np.maximum(onset.mean(axis=0) - LOW_QUANTILE_SIGMAS * onset.std(axis=0), lowest)
    order = replace(random, order=tuple(np.argsort(weak, kind="stable").tolist()))
    return replace(state, experiment=replace(experiment, random=order))


def scales_with_strength(problem: Any, random: Any, method: Any) -> bool:
    """Return whether the onset is proportional to the strength. See `inference.prior`.

    >>> from types import SimpleNamespace as Named
    >>> def scales(
    ...     scaling="affine",
    ...     varying=("strength",),
    ...     names=("strength",),
    ...     rate=1e11,
    ...     residual=0.0,
    ...     initial=0.0,
    ...     profile=1.0,
    ...     specimen=None,
    ... ):
    ...     friction = Named(weakening_rate=rate, residual_strength=residual)
    ...     load = Named(initial_stress=initial)
    ...     problem = Named(
    ...         friction=friction, load=load, load_profile=profile, specimen=specimen
    ...     )
    ...     random = Named(varying={*varying}, names=names)
    ...     return scales_with_strength(problem, random, Named(scaling=scaling))
    >>> slope = np.array([1.0, 2.0])
    >>> scales(), scales(initial=3.0, residual=2.0), scales(profile=slope), scales("stretch")
    (True, True, True, True)
    >>> scales("stretch", initial=3.0), scales("stretch", residual=slope)
    (False, False)
    >>> (
    ...     scales("none"),
    ...     scales(rate=None),
    ...     scales(initial=slope),
    ...     scales(initial=3.0, profile=slope),
    ... )
    (False, False, False, False)
    >>> scales(varying=("strength", "normal_pressure"))  # the pressure has a factor
    True
    >>> both = ("strength", "normal_pressure")
    >>> scales(varying=both, names=both), scales(varying=("strength", "initial_stress"))
    (False, False)
    """
    friction, initial = problem.friction, np.asarray(problem.load.initial_stress)
    scaling = optional_member(method, "scaling")
    if isinstance(problem.specimen, Slider):  # its shear and pressure do not scale
        return False
    # See the derivation in `inference.prior`: the weakening rate is
    # given, and the initial stress is uniform. It must be zero if the
    # load varies.
    zero = scaling == "stretch"  # neither residual strength nor initial stress scales
    return bool(
        scaling != "none"
        and random.varying <= {"strength", *({"normal_pressure"} - {*random.names})}
        and friction.weakening_rate is not None
        and np.ptp(initial) == 0.0
        and not (np.any(initial) and np.ptp(problem.load_profile))
        and not (zero and (np.any(np.asarray(friction.residual_strength)) or np.any(initial)))
    )


def solve_part(state: LimitState, draws: Array) -> Table:
    """Return the stresses of draws as a table that comes back from an executor.

    >>> from types import SimpleNamespace as Named
    >>> from stiction.base.errors import warn_accuracy
    >>> def stress(draws):
    ...     warn_accuracy("a doubt")
    ...     return draws[:, 0] + draws[:, 1]
    >>> table = solve_part(Named(_stress=stress), np.array([[1.0, 2.0], [3.0, 5.0]]))
    >>> table.columns["stress"].tolist(), [warning.text for warning in table.warned]
    ([3.0, 8.0], ['a doubt'])
    >>> table.failures, table.versions == versions(), table.seconds >= 0.0
    ((), True, True)
    """
    begin = time.perf_counter()
    with one_blas_thread(), collect_warnings() as warned:
        stress = state._stress(draws)
    columns = {"stress": stress}
    return Table(columns, (), time.perf_counter() - begin, versions(), tuple(merged(warned)))


@checked
def limit_state(problem: Problem, random: AnyRandom, method: MethodObject) -> LimitState:
    """Make a function that maps standard normal draws to the stress at onset.

    External reliability codes can call this function. Failure below a
    stress s is ``limit_state(draws) < s``.

    Parameters
    ----------
    problem, random
        As in `monte_carlo`.
    method
        As in `failure_probability`.

    Returns
    -------
    LimitState
        A callable that maps independent standard normal draws with
        shape (samples, `dimension`) to stresses, Pa, with shape
        (samples,). `draws(seed, first, samples)` returns the draws that
        `monte_carlo` uses. `profiles(draws)` returns their profiles.

    Raises
    ------
    InputError
        If any argument is invalid. The message lists every problem.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=1.0)
    >>> method = st.LocalCriterion()
    >>> stress = st.external.limit_state(problem, strength, method)
    >>> draws = stress.draws(seed=0, first=0, samples=3)
    >>> ensemble = st.monte_carlo(problem, strength, method=method, samples=3, seed=0)
    >>> bool((stress(draws) == ensemble.critical_stress.values).all())
    True
    """
    experiment = Experiment(problem, random, method)
    check_fields([experiment])
    return LimitState(experiment, workers=usable_cores())
