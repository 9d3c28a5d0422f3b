"""The limit state: from standard normal draws to the stress at which the interface slides."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal, get_args

import numpy as np

from stiction.arrays import Array
from stiction.criterion.windows import windows_of
from stiction.ensemble.batches import usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.errors import InputError
from stiction.friction import SCALES
from stiction.model import Numbers, check, describe, is_whole
from stiction.problem import Problem
from stiction.progress import SILENT, Meter, Portions, TimeUp
from stiction.random.checks import check_residual, warn_if_unresolved
from stiction.random.pressure import (
    coefficients_of,
    mean_in_stress,
    profiles_in_stress,
    support_in_stress,
)
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface

Event = Literal["critical_stress", "first_instability"]

PIECE = 16
"""Fewest rows worth a thread of their own."""


@dataclass(frozen=True)
class LimitState:
    """Stress at onset as a function of standard normal draws; see `stiction.external.limit_state`.

    Attributes
    ----------
    problem : Problem
    random : RandomInterface
    method : LocalCriterion, Equilibrium or Rupture
    event : {"critical_stress", "first_instability"}
        Which of the method's stresses.
    per_pressure : bool
        Whether stresses are taken per normal pressure: where that is random, each is multiplied by
        the mean pressure over that of its sample, so that one number stands for a coefficient.
    workers : int
        Threads. Rows do not depend on their batch, so the numbers do not depend on this.
    meter : Meter
        Told of every sample; says when the time is over.
    """

    problem: Problem
    random: RandomInterface
    method: Any
    event: Event = "critical_stress"
    workers: int = 1
    per_pressure: bool = False
    meter: Meter = dataclasses.field(default=SILENT, compare=False, repr=False)

    @cached_property
    def _portions(self) -> Portions:
        return Portions(self.workers)

    @property
    def dimension(self) -> int:
        """Number of draws of a sample."""
        return self.random.dimension(self.problem.interface)

    @cached_property
    def _solver(self) -> Callable[..., Any]:
        solver: Callable[..., Any] = self.method.prepare(self.problem)
        return solver

    @property
    def random_pressure(self) -> bool:
        """Whether stresses are divided by a pressure that differs between samples."""
        return self.per_pressure and "normal_pressure" in self.random.names

    @property
    def pressure(self) -> float:
        """Mean normal pressure, Pa; NaN if there is none."""
        return mean_pressure(self.problem, self.random)

    def by(self, method: Any) -> LimitState:
        """The same by another method."""
        return replace(self, method=method)

    def draws(self, seed: int, first: int, samples: int) -> Array:
        """Draws of samples first .. first + samples - 1 of the ensemble of this seed.

        The same samples as `stiction.monte_carlo` takes, shape (samples, dimension).
        """
        return self.random.draws(self.problem.interface, samples, seed, first)

    def profiles(self, draws: Array) -> dict[str, Array]:
        """Sampled profiles by name, each of shape (samples, *shape)."""
        found = self.random.from_draws(self.problem.interface, draws)
        return profiles_in_stress(self.problem, self.random, found)

    def onset(self, profiles: dict[str, Array]) -> dict[str, Any]:
        """All that the method says of some profiles."""
        sample = Experiment(self.problem, self.random, self.method).sample(profiles)
        return dict(self._solver(sample))

    def _stress(self, draws: Array) -> Array:
        # Rounding may leave a stress a hair below the bound.
        profiles = self.profiles(draws)
        found = self.onset(profiles)[self.event]
        if self.random_pressure:
            pressure = profiles["normal_pressure"]
            found = found * self.pressure / pressure.reshape(pressure.shape[0], -1).mean(axis=1)
        result: Array = np.maximum(found, self.bounds[0])
        return result

    def __call__(self, draws: Array) -> Array:
        """Stress at onset, Pa.

        Parameters
        ----------
        draws : (samples, dimension) or (dimension,) array

        Returns
        -------
        (samples,) array, or a number

        Raises
        ------
        InputError
            If the draws are not finite numbers of this shape.
        TimeUp
            With the stresses of the first draws, if the time allowed is over before the last.
        """
        draws = self._checked(draws)
        if draws.ndim == 1:
            return self(draws[None, :])[0]
        found = np.empty(draws.shape[0])
        for rows in self._portions(draws.shape[0]):
            if self.meter.over:
                raise TimeUp(found[: rows.start])
            found[rows] = self._shared_out(draws[rows])
            self.meter.advance(rows.stop - rows.start)
        return found

    def _checked(self, draws: Any) -> Array:
        given = check("draws", draws, Numbers)
        if given.ndim not in (1, 2) or given.shape[-1] != self.dimension:
            raise InputError(
                f"draws: must have shape (samples, {self.dimension}), got {given.shape}"
            )
        if not np.isfinite(given).all():
            raise InputError("draws: must be finite")
        return given

    def _shared_out(self, draws: Array) -> Array:
        fewest = 1 if self._portions.slow else PIECE
        pieces = min(self.workers, max(1, draws.shape[0] // fewest))
        if pieces == 1:
            return self._stress(draws)
        _ = self._solver, self.bounds  # prepared before the threads need them
        with ThreadPoolExecutor(pieces) as pool:
            return np.concatenate(list(pool.map(self._stress, np.array_split(draws, pieces))))

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Stresses below and above which no sample can slide, Pa.

        Nothing slips, and so nothing can become unstable, while the stress is below the strength at
        every node; and the mean stress of an interface whose slip sums to no net force is at most
        the mean of its strength. Both hold for every method and every sample.
        """
        if self.random_pressure:  # the stress per pressure has no other bounds
            return 0.0, math.inf
        fields = self.random.properties
        low, high = support_in_stress(self.problem, fields, "strength")
        load = self.problem.load
        profile = np.asarray(self.problem.load_profile, dtype=np.float64)
        least: Any = np.asarray(load.initial_stress, dtype=np.float64)
        most: Any = least
        if "initial_stress" in fields:
            least, most = support_in_stress(self.problem, fields, "initial_stress")
        lowest_load = float(np.min((low - most) / profile))
        shape = self.problem.interface.shape
        mean = float(np.mean(np.broadcast_to(profile, shape)))
        # The mean of the initial stress is itself random where it is a field: take its lowest.
        initial = float(np.mean(np.broadcast_to(least, shape)))
        # The rounded weight of the local criterion integrates to a little more than one: it takes
        # tau_p - tau_i for that much higher.
        rounded = getattr(self.method, "weights", "exact") == "rounded"
        slack = 1e-3 * (high - float(np.min(least))) if rounded else 0.0
        return initial + lowest_load * mean, high + slack

    def no_single_length(self) -> str | None:
        """Why the local criterion cannot serve as a first stage, or None if it can."""
        if not self.problem.friction.linear:
            return "strength does not fall linearly with slip"
        rate = self.problem.uniform_rate
        if rate is None or set(SCALES) & set(self.random.names):
            return "the weakening rate is not uniform"
        if self.problem.interface.is_plane:
            try:
                windows_of(self.problem, rate)
            except InputError:
                return "a critical patch does not fit on the plane"
        elif self.problem.nucleation_length > self.problem.interface.extent:
            return "the nucleation length is longer than the interface"
        return None

    def not_alike_everywhere(self) -> str | None:
        """Why a shifted sample would not slide at the same stress, or None if it would."""
        if len(self.random.names) > 1:
            return "more than the strength is random"
        if coefficients_of(self.random) and np.ndim(self.problem.load.normal_pressure) > 0:
            return "the normal pressure, and so the strength, varies along the interface"
        load, friction = self.problem.load, self.problem.friction
        parts = {
            "the load profile": self.problem.load_profile,
            "the initial stress": load.initial_stress,
            "the residual strength": friction.residual_strength,
            "the residual ratio": friction.residual_ratio,
            "the weakening rate": friction.weakening_rate,
        }
        for name, value in parts.items():
            if value is not None and np.ptp(value) > 0.0:
                return f"{name} varies along the interface"
        return self.no_single_length()


def limit_state(
    problem: Problem,
    random: RandomInterface | RandomField,
    method: Any,
    *,
    event: Event = "critical_stress",
    workers: int | None = None,
) -> LimitState:
    """Stress at onset as a function of standard normal draws, for other reliability codes.

    Failure below a stress s is ``limit_state(draws) < s``.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random; a field alone is the peak strength, Pa.
    method : LocalCriterion, Equilibrium or Rupture
    event : {"critical_stress", "first_instability"}
        Which stress.
    workers : int, optional
        Threads; all cores by default.

    Returns
    -------
    LimitState
        Call it with independent standard normal draws of shape (samples, `dimension`) for the
        stresses, Pa, of shape (samples,). Its `draws(seed, first, samples)` are those of the
        samples of `monte_carlo`, and `profiles(draws)` the profiles.

    Raises
    ------
    InputError
        Naming all that does not fit.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=1.0)
    >>> stress = st.external.limit_state(problem, strength, st.LocalCriterion())
    >>> draws = stress.draws(seed=0, first=0, samples=3)
    >>> draws.shape == (3, stress.dimension)
    True
    >>> ensemble = st.monte_carlo(
    ...     problem, strength, method=st.LocalCriterion(), samples=3, seed=0
    ... )
    >>> bool((stress(draws) == ensemble.critical_stress.values).all())
    True
    """
    return make_limit_state(problem, random, method, 0, event, workers)


def mean_pressure(problem: Problem, random: RandomInterface) -> float:
    """Mean normal pressure, Pa; NaN if there is none."""
    if "normal_pressure" in random.names:
        return random.properties["normal_pressure"].mean
    given = problem.load.normal_pressure
    return math.nan if given is None else float(np.mean(given))


def make_limit_state(
    problem: Problem,
    random: RandomInterface | RandomField,
    method: Any,
    seed: int,
    event: str,
    workers: int | None,
    *,
    meter: Meter = SILENT,
    per_pressure: bool = False,
    problems: Sequence[str] = (),
    check: Callable[[LimitState], list[str]] | None = None,
) -> LimitState:
    """The limit state of these arguments, or one `InputError` with all that is wrong with them.

    Parameters
    ----------
    problem, random, method, seed, event, workers
        As in `failure_probability`.
    meter : Meter
        Told of every sample; says when the time is over.
    per_pressure : bool
        See `LimitState`.
    problems : sequence of str
        What is wrong with other arguments; reported with the rest.
    check : callable, optional
        What else is wrong, once there is a limit state.
    """
    found = list(problems)
    if not isinstance(event, str) or event not in get_args(Event):
        given = describe(event)
        found.append(f"event: must be 'critical_stress' or 'first_instability', got {given}")
    if workers is not None and not is_whole(workers, 1):
        found.append(f"workers: must be a whole number >= 1, got {describe(workers)}")
    state = None
    try:
        interface = Experiment(problem, random, method, seed=seed).random
        first = isinstance(event, str) and event == "first_instability"
        kind: Event = "first_instability" if first else "critical_stress"
        state = LimitState(problem, interface, method, kind, per_pressure=per_pressure)
        if per_pressure and not state.pressure > 0.0:
            found.append("friction_coefficient: needs a normal pressure (load.normal_pressure, Pa)")
        found += check(state) if check else []
    except InputError as error:
        found += error.problems
    if found or state is None:
        raise InputError(found)
    state.random.warn_if_inaccurate(problem.interface)
    problem.warn_of_units(mean_in_stress(problem, state.random.properties, "strength"))
    check_residual(problem, state.random.properties)
    warn_if_unresolved(problem, state.random)
    return replace(state, workers=usable_cores() if workers is None else int(workers), meter=meter)
