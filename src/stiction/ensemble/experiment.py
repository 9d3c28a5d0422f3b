"""An experiment: a problem, its random properties, and the method that computes onsets."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import chain, pairwise
from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import (
    InputError,
    UnitWarning,
    Warned,
    collect_warnings,
    issue,
    prefixed,
    unknown_name,
    warn_user,
)
from stiction.base.variables import PROFILES, Variable
from stiction.methods.protocol import (
    Solver,
    Values,
    batch_size,
    optional_member,
    prepared,
    seconds_per_sample,
    variables_of,
)
from stiction.problem.checks import doubt_strengths
from stiction.problem.friction import SCALES
from stiction.problem.problem import Problem, refusals
from stiction.problem.results import along
from stiction.problem.sample import Sample, given_twice, own_sample
from stiction.random.equally_likely import as_random
from stiction.random.stresses import (
    check_pressure,
    check_residual,
    mean_in_stress,
    profiles_in_stress,
)

CHECKED_NODES = 1 << 14
"""Approximate number of sampled nodes whose strength is compared with
the residual strength."""
MOST_NUMBERS = 1 << 20
"""Most nodes or draws of samples of a plane that are solved at once: 8
MiB per profile."""


@dataclass(frozen=True)
class Experiment:
    """A problem, its random properties and a method, checked together once.

    Sample i depends only on the experiment and i, not on the batch. An
    `InputError` lists all mistakes.

    Examples
    --------
    The strength has the modes 1 to 5 of a line with 16 nodes, and two draws
    for each.

    >>> import stiction as st
    >>> solid, friction = st.Solid(2e9, 0.2, 1200.0), st.LinearWeakening(weakening_rate=1e11)
    >>> load = st.Load(normal_pressure=np.linspace(1e6, 4e6, 16))
    >>> problem = st.Problem(solid, st.Interface(0.1, 16), friction, load)
    >>> def field(mean, **options):
    ...     spectrum = st.SquaredExponentialSpectrum(0.016)
    ...     return st.RandomField(st.Lognormal(mean=mean, cv=0.1), spectrum, **options)
    >>> method = st.LocalCriterion()
    >>> experiment = Experiment(problem, field(2e6), method, keep=("strength",), seed=5)
    >>> experiment.dimension, experiment.pressure, round(experiment.mean_strength)
    (10, 2500000.0, 2000000)
    >>> experiment.given.names, len(Experiment(problem, [field(2e6), field(3e6)], method).given)
    (('strength',), 2)
    >>> round(Experiment(problem, [field(2e6), field(3e6)], method).mean_strength)
    2500000
    >>> without = Experiment(problem, field(2e6), method)
    >>> experiment.variables.keys() - without.variables.keys()
    {'strength'}
    >>> experiment.sample_bytes - without.sample_bytes  # 16 numbers of 8 bytes
    128.0
    >>> values = experiment.results(3, 2)
    >>> draws = experiment.draws(3, 2)
    >>> bool((values["strength"] == experiment.profiles(draws)["strength"]).all())
    True
    >>> values.keys() == experiment.variables.keys(), values["critical_stress"].shape
    (True, (2,))
    >>> bool((experiment.with_seed(6).draws(3, 2) == draws).any()), experiment.seed
    (False, 5)
    >>> experiment.by(st.Equilibrium()).method.type, experiment.by(st.Equilibrium()).seed
    ('equilibrium', 5)

    A random pressure replaces the pressure of the problem, and coefficients
    are multiplied by it.

    >>> bare = st.Problem(solid, st.Interface(0.1, 16), friction)
    >>> Experiment(bare, field(2e6), method).pressure
    nan
    >>> coefficient = field(0.5, quantity="friction_coefficient")
    >>> random = st.RandomInterface(strength=coefficient, normal_pressure=field(3e6))
    >>> experiment = Experiment(bare, random, method)
    >>> round(experiment.pressure), round(experiment.mean_strength)
    (3000000, 1500000)
    >>> experiment = Experiment(problem, coefficient, method)
    >>> round(experiment.mean_strength)
    1250000
    >>> draws = experiment.draws(0, 2)
    >>> coefficients = experiment.random.from_draws(problem.interface, draws)["strength"]
    >>> np.allclose(experiment.profiles(draws)["strength"], coefficients * load.normal_pressure)
    True
    """

    problem: Problem
    random: Any  # EquallyLikely, or an object that becomes one
    method: Any
    keep: Sequence[str] = ()  # names of random fields that `results` contains
    seed: int = 0

    def __post_init__(self) -> None:
        """>>> import stiction as st
        >>> solid, friction = (
        ...     st.Solid(2e9, 0.2, 1200.0),
        ...     st.LinearWeakening(weakening_rate=1e11),
        ... )
        >>> problem = st.Problem(
        ...     solid, st.Interface(0.2, 64), friction, st.Load(initial_stress=1e5)
        ... )
        >>> def mistakes(*lengths, keep=(), **options):
        ...     marginal = st.Lognormal(mean=2e6, cv=0.1)
        ...     fields = [
        ...         st.RandomField(marginal, st.SquaredExponentialSpectrum(length))
        ...         for length in lengths
        ...     ]
        ...     members = [
        ...         st.RandomInterface(strength=field, **{name: field for name in options})
        ...         for field in fields
        ...     ]
        ...     try:
        ...         Experiment(problem, members, st.LocalCriterion(), keep)
        ...     except InputError as error:
        ...         for text in error.problems:
        ...             print(text[:70].strip())
        >>> mistakes(0.016, 0.02, keep=["strength"])
        >>> mistakes(0.016, 9.0, 9.0, keep=["strength", "slip"], initial_stress=True)
        problem.load.initial_stress: has no effect together with random.initia
        strength: spectrum: is truncated at 0.568 rad/m, below the first mode
        initial_stress: spectrum: is truncated at 0.568 rad/m, below the first
        keep: unknown 'slip' (valid: strength, initial_stress)
        """
        random = as_random(self.random, self.seed)
        mistakes: dict[str, None] = {}  # equally likely interfaces repeat them
        for member in random.members:
            mistakes |= dict.fromkeys(given_twice(self.problem, member.names, "random"))
            try:
                check_pressure(self.problem, member)
            except InputError as error:
                mistakes |= dict.fromkeys(error.problems)
            for name, field in member.properties.items():
                try:
                    field.modes(self.problem.interface)
                except InputError as error:
                    mistakes |= dict.fromkeys(f"{name}: {text}" for text in error.problems)
        problems = list(mistakes)
        problems += refusals(self.problem, self.method)
        unknown = [name for name in self.keep if name not in random.names]
        problems += [unknown_name("keep", name, random.names) for name in unknown]
        if problems:
            raise InputError(problems)
        object.__setattr__(self, "random", random)

    def by(self, method: Any) -> Experiment:
        """Return the same experiment with a different method."""
        return dataclasses.replace(self, method=method)

    def with_seed(self, seed: int) -> Experiment:
        """Return the same experiment with a different seed."""
        other = copy.copy(self)  # checks are not repeated
        vars(other)["seed"] = seed
        return other

    @property
    def given(self) -> Any:
        """The random interface, or a list of equally likely interfaces."""
        members = self.random.members
        return list(members) if self.random.several else members[0]

    @property
    def dimension(self) -> int:
        """Number of standard normal draws in a sample."""
        return self.random.dimension(self.problem.interface)

    @property
    def variables(self) -> dict[str, Variable]:
        """Variables of `results` by name."""
        interface, pressed = self.problem.interface, "normal_pressure" in self.random.varying
        kept = {name: along(interface, PROFILES[name]) for name in self.keep}
        return variables_of(self.problem, self.method, pressed) | kept

    @property
    def sample_bytes(self) -> float:
        """Size of the `results` for one sample, in bytes."""
        nodes = self.problem.interface.size
        return 8.0 * sum(nodes if variable.wide else 1 for variable in self.variables.values())

    @property
    def seconds(self) -> float:
        """Approximate time for a sample on one core, s."""
        return seconds_per_sample(self.problem, self.method)

    @property
    def pressure(self) -> float:
        """Mean normal pressure, Pa, or NaN without a pressure."""
        if "normal_pressure" in self.random.names:
            return self._mean("normal_pressure")
        given = self.problem.given_pressure
        if given is None:
            return float("nan")
        return float(self.problem.interface.mean(given) if np.ndim(given) else given)

    @property
    def mean_strength(self) -> float:
        """Mean strength, Pa."""
        return self._mean("strength")

    def _mean(self, name: str) -> float:
        members = self.random.members
        means = [mean_in_stress(self.problem, member, name) for member in members]
        return float(np.mean(means))

    def check_fields(self) -> None:
        """Warn about fields that do not suit the grid, the interface or their units.

        >>> import stiction as st
        >>> solid, friction = (
        ...     st.Solid(2e9, 0.2, 1200.0),
        ...     st.LinearWeakening(weakening_rate=1e11),
        ... )
        >>> problem = st.Problem(solid, st.Interface(0.2, 64), friction)
        >>> def texts(mean, length, **fields):
        ...     def field(mean, length):
        ...         marginal, spectrum = (
        ...             st.Lognormal(mean=mean, cv=0.1),
        ...             st.SquaredExponentialSpectrum(length),
        ...         )
        ...         return st.RandomField(marginal, spectrum, mean_mode=True)
        ...
        ...     fields = {name: field(other, 0.016) for name, other in fields.items()}
        ...     random = st.RandomInterface(strength=field(mean, length), **fields)
        ...     with collect_warnings() as warned:
        ...         Experiment(problem, random, st.LocalCriterion()).check_fields()
        ...     return [str(text)[:64] for text in warned]
        >>> texts(2e6, 0.016), texts(2e6, 0.016, residual_strength=1e6)
        ([], [])
        >>> texts(2e6, 9.0)
        ['strength: its correlation length is so long that each sample is ']
        >>> texts(2e6, 0.016, residual_strength=1.9e6)[0][-49:]
        'of the nodes lie at or below the residual strengt'
        """
        for member in self.random.members:
            member.warn_if_inaccurate(self.problem.interface)
            for name, field in member.properties.items():
                if not field.modes(self.problem.interface).ranks.size:
                    warn_user(
                        f"{name}: its correlation length is so long that each sample is uniform."
                        " Check its unit. If specimens scatter, pass RandomInterface(between=...)",
                        UnitWarning,
                    )
            # Stresses and slips of a solid lie in known ranges. Others
            # are in another unit.
            means = {name: mean_in_stress(self.problem, member, name) for name in member.names}
            friction = self.problem.friction
            residual = float(friction.residual(np.array(means["strength"])).mean())
            scales = {name: means[name] for name in SCALES if name in means}
            doubt_strengths(
                self.problem,
                means["strength"], means.get("residual_strength", residual), scales,
                initial=abs(means["initial_stress"]) if "initial_stress" in means else None,
            )  # fmt: skip
        count = max(1, CHECKED_NODES // self.problem.interface.size)
        check_residual(self.problem, self.profiles(self.draws(0, count)))

    def draws(self, first: int, count: int) -> Array:
        """Return standard normal draws (count, dimension), beginning with sample `first`."""
        return self.random.draws(self.problem.interface, count, self.seed, first)

    def profiles(self, draws: Array) -> dict[str, Array]:
        """Return the profiles (samples, *shape) of draws by name, in SI."""
        profiles = self.random.from_draws(self.problem.interface, draws)
        return profiles_in_stress(self.problem, self.random, profiles)

    def sample(self, profiles: Mapping[str, Array]) -> Sample:
        """Return profiles by name as a sample, or raise an `InputError` if it does not fit.

        The resolution, and nodes that do not weaken, are checked
        before, by `check_fields`.
        """
        return own_sample(self.problem, profiles, optional_member(self.method, "accepts"))

    def solve(self, draws: Array) -> tuple[dict[str, Array], Values]:
        """Return profiles and results of draws."""
        profiles = self.profiles(draws)
        return profiles, dict(self.prepare()(self.sample(profiles)))

    def prepare(self) -> Solver:
        """Return the prepared solver of the method. The next call reuses the solver."""
        return _solver(self.problem, self.method)

    def results(self, first: int, count: int) -> Values:
        """Return all `variables` for samples that begin with `first`, solved without threads."""
        profiles, values = self.solve(self.draws(first, count))
        return values | {name: profiles[name] for name in self.keep}

    @property
    def batch(self) -> int:
        """Number of samples to solve at once.

        The method sets it. On planes, memory limits it.
        """
        interface, size = self.problem.interface, batch_size(self.problem, self.method)
        if not interface.is_plane:  # a part of a block of draws costs as much as the block
            return size
        # A rough field has hundreds of draws for each node.
        return min(size, max(1, MOST_NUMBERS // max(interface.size, self.dimension)))

    def batches(self, first: int, count: int, size: int = 0) -> Iterator[tuple[int, int]]:
        """Divide samples, beginning with `first`, into (first, count) at multiples of a size.

        >>> list(Experiment.batches(None, 5, 12, 4)), list(Experiment.batches(None, 8, 3, 4))
        ([(5, 3), (8, 4), (12, 4), (16, 1)], [(8, 3)])
        >>> from types import SimpleNamespace as Named
        >>> list(Experiment.batches(Named(batch=10), 8, 3))
        [(8, 2), (10, 1)]
        """
        size, end = size or self.batch, first + count
        # Batches begin at multiples of the size, so that blocks of
        # draws are whole.
        edges = chain((first,), range(first - first % size + size, end, size), (end,))
        return ((start, stop - start) for start, stop in pairwise(edges))


class Measured(Experiment):
    """An experiment with the given profiles of a single sample in place of random properties.

    Examples
    --------
    >>> import stiction as st
    >>> solid, friction = st.Solid(2e9, 0.2, 1200.0), st.LinearWeakening(weakening_rate=1e11)
    >>> problem = st.Problem(solid, st.Interface(0.1, 16), friction)
    >>> profiles = {"strength": np.linspace(1e6, 2e6, 16)}
    >>> measured = Measured(problem, profiles, st.LocalCriterion())
    >>> measured.dimension, measured.draws(3, 2).shape, measured.given is profiles
    (0, (2, 0), True)
    >>> measured.sample({}).strength.shape, measured.results(0, 1)["critical_stress"].shape
    ((1, 16), (1,))
    >>> measured.results(0, 1).keys() == measured.variables.keys()
    True
    >>> try:
    ...     Measured(problem, {"strength": np.ones((2, 16)) * 1e6}, st.LocalCriterion())
    ... except InputError as error:
    ...     print(error)
    profiles: must be a single sample, got 2
    """

    def __post_init__(self) -> None:
        problems = refusals(self.problem, self.method)
        if self.keep:
            problems.append("keep: has no effect, because the profiles are given")
        if problems:
            raise InputError(problems)
        with prefixed("profiles"):
            if (count := len(self.placed[0].strength)) != 1:
                raise InputError(f"must be a single sample, got {count}")

    @cached_property
    def placed(self) -> tuple[Sample, list[Warned]]:
        """The sample, and the doubts about its profiles, which `check_fields` issues."""
        with collect_warnings() as doubts:
            sample = self.problem.sample(
                self.random, accept=optional_member(self.method, "accepts")
            )
        return sample, doubts

    @property
    def given(self) -> Any:
        """The given profiles."""
        return self.random

    @property
    def dimension(self) -> int:
        """Number of draws in a sample, counted without drawing."""
        return 0

    @property
    def variables(self) -> dict[str, Variable]:
        """Variables of `results` by name."""
        return variables_of(self.problem, self.method, "normal_pressure" in self.random)

    def check_fields(self) -> None:
        """Warn about profiles that do not suit the grid or their units."""
        for doubt in self.placed[1]:
            issue(doubt)

    def draws(self, first: int, count: int) -> Array:
        """Return an array (count, 0), because given profiles need no draws."""
        return np.zeros((count, 0))

    def profiles(self, draws: Array) -> dict[str, Array]:
        """Return no random profiles."""
        return {}

    def sample(self, profiles: Mapping[str, Array]) -> Sample:
        """Return the given profiles as a sample."""
        return self.placed[0]


def method_of(random: Any, method: Any) -> Any:
    """Return the method, by default the method of a posterior.

    >>> from types import SimpleNamespace as Named
    >>> posterior = Named(likelihood=Named(method="of the posterior"))
    >>> method_of(posterior, "given"), method_of(posterior, None), method_of(None, "given")
    ('given', 'of the posterior', 'given')
    >>> method_of(Named(likelihood=None), None)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: method: is needed without a posterior. Give st.Equilibrium()
    """
    known = method or getattr(getattr(random, "likelihood", None), "method", None)
    if known is None:
        raise InputError("method: is needed without a posterior. Give st.Equilibrium()")
    return known


_solver = lru_cache(maxsize=8)(prepared)
