"""Posteriors: draws, intervals, information gain and accuracy.

`Posterior` holds parameters with a prior, which `PosteriorGrid`
computes. `SpecimenPosterior` holds the mean, the scatter between
specimens, and the field within a specimen.

Problem. The prior is uniform in the unit cube. Compute the posterior
density L(u)/Z of the parameters u from the likelihood L, with the
evidence Z = int L du. L may be narrow.

Source. Gelman and others, Bayesian Data Analysis (2013), section 10.1,
describe posteriors on a grid. Closing in is our own.

Steps:

1. Divide a box into equal cells, and
   compute log L at the centre of each cell.
2. Divide L by the sum of L to find the mass of a cell. Compute Z, the
   sum of L times the volume of a cell (midpoint rule). Neglect the part
   outside the box.
3. Shrink the box. For each parameter, cut off cells with a mass up to
   `OUTSIDE_MASS` on either side, but keep one more cell on either side.
4. Repeat, at most `MAX_GRID_ZOOMS` times, until no side of the box
   shrinks by a tenth.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.stats import entropy

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import Count, Number, checked
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import as_texts
from stiction.base.variables import unit_of_key
from stiction.inference.likelihood import Simulation
from stiction.inference.peaks import Peaks, title_of
from stiction.inference.specimens import (
    FEW_FIELDS,
    PRIOR_SCALE,
    FactorGrid,
    FactorPrior,
    Prediction,
    Profiles,
    grid_of_profiles,
    tables_of,
)
from stiction.problem.problem import Problem
from stiction.random.dotted_keys import full_key, value_at, with_values
from stiction.random.equally_likely import WithFactors
from stiction.random.fields import RandomInterface

POSTERIOR_DRAWS = 4000
GRID_POINTS = 100_000
"""Approximate number of points of a grid."""
MOST_ALONG = 512
"""Most points along a parameter."""
MAX_GRID_ZOOMS = 6
OUTSIDE_MASS = 1e-6
"""Posterior mass outside on either side of a parameter when the grid
closes in."""
MAX_BATCH = 5_000
"""Points at which the likelihood is computed at once."""


@dataclass(frozen=True, eq=False)
class PosteriorGrid:
    """Posterior probabilities of the cells of a box. All cells have the same prior mass."""

    box: Array  # corners, as u, (2, parameters)
    mass: Array  # of the cells, (n_1, ..., n_parameters); sums to 1
    log_evidence: float  # logarithm of the mean likelihood over the whole prior

    def marginal(self, axis: int) -> Array:
        """Return the mass of cells along one parameter.

        >>> grid = PosteriorGrid(None, np.array([[0.1, 0.2, 0.0], [0.3, 0.1, 0.3]]), 0.0)
        >>> grid.marginal(0).round(9).tolist(), grid.marginal(1).round(9).tolist()
        ([0.3, 0.7], [0.4, 0.3, 0.3])
        """
        axes = tuple(i for i in range(self.mass.ndim) if i != axis)
        return self.mass.sum(axis=axes)

    def information(self, axis: int) -> float:
        """Return the divergence of one parameter's marginal posterior from its prior, nats.

        A uniform posterior in a quarter of the prior gains ln 4, and in half of it,
        of which only one of two cells has mass, as well:

        >>> box = np.array([[0.5, 0.25], [0.75, 0.75]])
        >>> grid = PosteriorGrid(box, np.array([[0.5, 0.0], [0.5, 0.0]]), 0.0)
        >>> [round(grid.information(axis) / math.log(4.0), 9) for axis in (0, 1)]
        [1.0, 1.0]
        """
        mass = self.marginal(axis)
        return float(np.log(mass.size / np.ptp(self.box[:, axis])) - entropy(mass))

    def draws(self, count: int, seed: int) -> Array:
        """Draw u (count, parameters) from the posterior.

        Draws are uniform within cells.

        >>> box = np.array([[0.5, 0.2], [0.7, 0.8]])
        >>> grid = PosteriorGrid(box, np.array([[0.0, 0.75, 0.0], [0.25, 0.0, 0.0]]), 0.0)
        >>> u = grid.draws(4000, seed=1)
        >>> first = u[:, 0] < 0.6
        >>> bool(0.72 < first.mean() < 0.78)
        True
        >>> [np.round([part.min(), part.max()], 2).tolist() for part in (*u[first].T, *u[~first].T)]
        [[0.5, 0.6], [0.4, 0.6], [0.6, 0.7], [0.2, 0.4]]
        """
        rng = np.random.default_rng(seed)
        cells = rng.choice(self.mass.size, size=count, p=self.mass.ravel())
        places = np.stack(np.unravel_index(cells, self.mass.shape), axis=1)
        share = (places + rng.random(places.shape)) / np.array(self.mass.shape)
        return self.box[0] + np.ptp(self.box, axis=0) * share


def grid_of(
    function: Callable[[Array], Array], box: Array, points: int = GRID_POINTS
) -> PosteriorGrid | None:
    """Return the posterior from a log density at points (points, parameters) in a box, or None.

    The result is `None` if the density is zero at all points. If a cell
    is narrower than the density, the midpoint rule converges faster
    than any power of the step.

    A normal density around (0.3, 0.6) with deviations 0.01 and 0.002 has the
    mass 1 in the unit square:

    >>> def density(u):
    ...     z = (u - [0.3, 0.6]) / [0.01, 0.002]
    ...     return -0.5 * np.sum(z**2, axis=1) - math.log(2.0 * math.pi * 0.01 * 0.002)
    >>> grid = grid_of(density, np.array([[0.0, 0.0], [1.0, 1.0]]), 900)
    >>> grid.mass.shape, round(grid.log_evidence, 4) + 0.0
    ((30, 30), 0.0)
    >>> centres = [low + (high - low) * (np.arange(30) + 0.5) / 30 for low, high in grid.box.T]
    >>> means = [float(grid.marginal(axis) @ at) for axis, at in enumerate(centres)]
    >>> [round(mean, 5) for mean in means]
    [0.3, 0.6]
    >>> bool(np.all(np.abs(grid.box - [0.3, 0.6]) / [0.01, 0.002] > 4.5))  # the tails are inside
    True
    >>> grid_of(lambda u: np.full(len(u), -np.inf), np.array([[0.0], [1.0]])) is None
    True
    >>> grid_of(lambda u: 0.0 * u[:, 0], np.array([[0.0], [1.0]])).mass.size  # at most 512
    512
    >>> grid_of(lambda u: 0.0 * u[:, 0], np.repeat([[0.0], [1.0]], 3, axis=1), 27).mass.shape
    (8, 8, 8)
    """
    dimension = box.shape[1]
    along = int(min(MOST_ALONG, max(8, points ** (1.0 / dimension))))
    steps = [(np.arange(along) + 0.5) / along] * dimension
    unit = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)
    for _ in range(MAX_GRID_ZOOMS):
        low, high = box  # 1.
        u = (low + (high - low) * unit).reshape(-1, dimension)
        parts = [function(u[k : k + MAX_BATCH]) for k in range(0, u.shape[0], MAX_BATCH)]
        values = np.concatenate(parts).reshape(unit.shape[:-1])
        top = float(values.max())
        if top == -np.inf:
            return None
        mass, cell = np.exp(values - top), (high - low) / along  # 2.
        evidence = top + float(np.log(mass.sum() * np.prod(cell)))
        grid = PosteriorGrid(box, mass / mass.sum(), evidence)
        # 3. Leave one cell of almost no mass as a margin.
        rows = [grid.marginal(axis) for axis in range(dimension)]
        empty = [[np.sum(np.cumsum(r) <= OUTSIDE_MASS) - 1 for r in (o, o[::-1])] for o in rows]
        below, above = np.maximum(empty, 0).T * cell
        box = np.stack([low + below, high - above])
        if np.all(box[1] - box[0] > 0.9 * (high - low)):  # 4.
            break
    return grid


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Posterior(WithFactors, Result):
    """Posterior of the parameters, with their prior.

    Attributes
    ----------
    names : tuple of str
        Keys of the prior.
    draws : dict of (draws,) arrays
        Draws of each parameter, in the unit of the parameter.
    information : dict of float
        Kullback-Leibler divergence between the marginal
        posterior for a parameter and its prior, nats.
        Halving a uniform range gives ln 2 = 0.69.
    log_evidence : float
        Logarithm of the density of the peaks under the prior, for the
        comparison of models.
    monte_carlo_error : float
        Standard error of a posterior mean due to the finite number of
        simulated samples, over the posterior standard deviation. The
        ratio is about the square root of the ratio of measured to
        simulated peaks.
    method : str
        Method that computed the onset.
    peaks : Peaks
        The measured peaks.
    notes : tuple of str
        Limitations of the result.

    A posterior with three draws of two parameters:

    >>> from types import SimpleNamespace
    >>> from scipy.stats import uniform
    >>> from stiction.inference.prior import Prior
    >>> prior = Prior(None, None, {"a": uniform(2, 3), "b": uniform(0, 1)})
    >>> likelihood = SimpleNamespace(
    ...     prior=prior, method=SimpleNamespace(label="LocalCriterion()"),
    ...     predicted=lambda kind, u, seed: (kind, len(u), seed))
    >>> peaks = Peaks((0.1, 0.2), (np.array([3.0, 4.0, 8.0]), np.array([5.0])), "N")
    >>> draws = {"a": np.array([2.0, 4.0, 4.5]), "b": np.array([0.2, 0.1, 0.9])}
    >>> posterior = Posterior(peaks=peaks, draws=draws, monte_carlo_error=0.1, seed=7,
    ...                       likelihood=likelihood, u=np.zeros((3, 2)))
    >>> posterior.names, posterior.method, posterior.families
    (('a', 'b'), 'LocalCriterion()', {})
    >>> {key: round(mean, 9) for key, mean in posterior.mean.items()}
    {'a': 3.5, 'b': 0.4}
    >>> [round(end, 9) for end in posterior.interval["a"]]
    [2.2, 4.45]
    >>> posterior.predicted  # of each kind of specimen
    ((0, 3, 7), (1, 3, 7))
    >>> before = posterior.before  # as many draws from the prior
    >>> before["a"].size, bool(before["a"].min() > 2.0), bool(before["b"].max() < 1.0)
    (3, True, True)
    """

    peaks: Peaks
    draws: Mapping[str, Array]
    information: Mapping[str, float] = field(default_factory=dict)
    log_evidence: float = math.nan
    monte_carlo_error: float
    notes: tuple[str, ...] = ()
    likelihood: Any = field(repr=False, compare=False)
    u: Array = field(repr=False, compare=False)
    problem: Any = field(default=None, repr=False, compare=False)
    seed: int = 0
    _between: Mapping[str, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Keys of the prior."""
        return tuple(self.draws)

    @property
    def method(self) -> str:
        """Method that computed the onset."""
        return str(self.likelihood.method.label)

    @property
    def families(self) -> dict[str, float]:
        """Posterior probability for each distribution between specimens, if inferred."""
        return {}

    @cached_property
    def before(self) -> dict[str, Array]:
        """Draws from the prior."""
        u = np.random.default_rng(self.seed).random(self.u.shape)
        return dict(zip(self.names, self.likelihood.prior.theta(u).T, strict=True))

    @cached_property
    def mean(self) -> dict[str, float]:
        """Posterior mean of each parameter."""
        return {name: float(draws.mean()) for name, draws in self.draws.items()}

    @cached_property
    def interval(self) -> dict[str, tuple[float, float]]:
        """Central 90 % credible interval of each parameter."""
        ends = {name: np.quantile(draws, [0.05, 0.95]) for name, draws in self.draws.items()}
        return {name: (float(low), float(high)) for name, (low, high) in ends.items()}

    def at(self, draw: int) -> tuple[Problem, RandomInterface]:
        """Return the problem and the random interface at a draw.

        >>> from types import SimpleNamespace
        >>> likelihood = SimpleNamespace(prior=SimpleNamespace(at=lambda theta: theta.tolist()))
        >>> draws = {"a": np.array([2.0, 4.0]), "b": np.array([0.2, 0.1])}
        >>> parts = {"peaks": None, "monte_carlo_error": 0.1, "u": None}
        >>> Posterior(draws=draws, likelihood=likelihood, **parts).at(1)
        [4.0, 0.1]
        """
        return self.likelihood.prior.at(np.array([own[draw] for own in self.draws.values()]))

    @checked
    def interfaces(self, count: Count, seed: Number = 0) -> list[RandomInterface]:
        """Return equally likely random interfaces, over which failure probabilities are averaged.

        Parameters
        ----------
        count : int
            Number of interfaces. A 90 % band needs about 30 interfaces.
        seed : int
            Not negative.

        Raises
        ------
        InputError
            If a parameter belongs to the
            problem, not to the random interface.

        Examples
        --------
        >>> import stiction as st
        >>> problem = st.paper.problem(nodes=256)
        >>> strength = st.paper.strength(problem, correlation_ratio=0.5)
        >>> posterior = st.infer(
        ...     problem, strength, [0.69, 0.70, 0.73, 0.68, 0.71], unit="MPa",
        ...     prior={"marginal.low": (0.5e6, 0.8e6)}, method=st.LocalCriterion(), samples=200,
        ... )
        >>> len({one.strength.marginal.low for one in posterior.interfaces(10)})
        10
        """
        of_problem = [name for name in self.names if full_key(name).startswith("problem.")]
        if of_problem:
            raise InputError(
                f"interfaces: {', '.join(of_problem)} belong to the problem, not to an interface."
                " Use `at(draw)`, which returns a problem and an interface for each draw"
            )
        # Each draw counts once, unless more interfaces than draws are
        # wanted.
        total = self.u.shape[0]
        draws = np.random.default_rng([seed, 4]).choice(total, count, replace=count > total)
        return self._scattered([self.at(int(draw))[1] for draw in draws])

    @cached_property
    def predicted(self) -> tuple[Array, ...]:
        """Peaks of further tests: for each specimen type, one peak for each draw."""
        kinds = range(len(self.peaks.values))
        return tuple(self.likelihood.predicted(i, self.u, self.seed) for i in kinds)

    def _summary(self) -> Summary:
        strength, rows = self.at(0)[1].strength, []
        of_field = "Pa" if strength is None or strength.quantity is None else "1"
        for name in self.names:
            unit = unit_of_key(name, of_field)
            before = np.quantile(self.before[name], [0.05, 0.95]).tolist()
            ends, shown_unit = as_texts(unit, before)
            remark = f"{' to '.join(ends)} {shown_unit} before the tests".replace("  ", " ")
            if name in self.information:
                remark += f", {self.information[name]:.2f} nats"
            rows.append(Row(name, self.mean[name], self.interval[name], unit, remark))
        title = f"{title_of(self.peaks)}; onset by {self.method}, posterior means"
        return Summary(title, rows, "90 % interval", self.notes)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SpecimenPosterior(Posterior):
    """Posterior of the mean, the scatter between specimens and the field within a specimen.

    The draws describe the field within a specimen only if it was
    measured. A field that you stated is listed in `assumptions`.

    Attributes
    ----------
    families : dict from str to float
        Posterior probability for each distribution between specimens.
    agreement : Agreement or None
        Agreement of the peaks with the prediction from the profiles
        alone, or `None` without profiles.

    >>> import stiction as st
    >>> spectrum = st.PowerLawSpectrum(correlation_length=2e-3)
    >>> field = st.RandomField(st.Lognormal(mean=2e6, cv=0.3), spectrum)
    >>> fields = (st.RandomInterface(strength=field),)
    >>> def posterior(levels, fields=fields, loads=None, **more):
    ...     families = "lognormal", "weibull"
    ...     profiles = Profiles(fields, 2e6, np.array(levels), None, families, **more)
    ...     mass = np.zeros((len(fields), 2, 40, 2))
    ...     mass[0, :, 3, 0] = 0.4, 0.6
    ...     grid = FactorGrid(profiles, np.array([0.0, 1e-6]), mass)
    ...     from types import SimpleNamespace
    ...     likelihood = SimpleNamespace(error=0.3, method=SimpleNamespace(label="Rupture()"))
    ...     values = np.array([3.0, 4.0, 8.0]), np.array([5.0])
    ...     peaks = Peaks((0.1, 0.2), values, "N", loads=loads)
    ...     u = np.array([[0.0, 0.0, 0.2, 0.0], [0.0, 1.0, 0.1, math.log(1.5)]])
    ...     return SpecimenPosterior(peaks=peaks, draws={}, monte_carlo_error=0.1, u=u, problem="p",
    ...                              likelihood=likelihood, grid=grid, by_profiles=grid)

    Two scanned and four tested specimens:

    >>> posterior([1.9e6, 2.2e6]).specimens, posterior([1.9e6]).families
    (6, {'lognormal': 0.4, 'weibull': 0.6})

    A field that was stated, and not measured, is an assumption:

    >>> posterior([]).assumed, posterior([1.9e6]).assumed, posterior([], whole=True).assumed
    ({'marginal.cv': 0.3, 'correlation_length': 0.002}, {}, {})
    >>> [text[:22] for text in posterior([], loads="loads").assumptions]
    ['the variation along a ', 'the unit is a specimen', 'prior of the scatter b']
    >>> posterior([], loads="loads").assumptions[1][-13:]  # 0.3 over the mean, 5
    'error of 6.0%'
    >>> [text[:22] for text in posterior([], fields=2 * fields, whole=True).assumptions]
    ['specimens differ only ', 'prior of the scatter b']
    >>> posterior([], fields=3 * fields).assumptions[0][-31:]
    ' 2 more. Its mean has no effect'
    >>> other = FactorPrior(st.Lognormal(mean=0.1, cv=0.3).distribution)
    >>> posterior([1.9e6], prior=other).assumptions
    ('prior of the scatter between specimens: as stated',)


    The draws before the tests, and random interfaces at a draw and of the
    posterior:

    >>> found = posterior([1.9e6])
    >>> found.before["mean"].size, round(float(found.before["mean"].mean()), -2)
    (4000, 2000000.0)
    >>> problem, random = found.at(1)
    >>> problem, round(random.strength.mean, 3), random.between["strength"].cv
    ('p', 3000000.0, 0.1)
    >>> drawn = found.interfaces(50, seed=1)
    >>> sorted({type(random.between["strength"]).__name__ for random in drawn})
    ['Lognormal', 'Weibull']
    """

    grid: FactorGrid = field(repr=False, compare=False)
    by_profiles: FactorGrid = field(repr=False, compare=False)
    agreement: Any = field(default=None, repr=False)

    @property
    def specimens(self) -> int:
        """Number of specimens that were scanned or tested."""
        return self.grid.profiles.levels.size + sum(map(len, self.peaks.values))

    @property
    def families(self) -> dict[str, float]:
        """Posterior probability for each distribution between specimens."""
        return self.grid.families

    @cached_property
    def before(self) -> dict[str, Array]:
        """Draws from the posterior given the profiles alone, or from the prior without profiles."""
        rng = np.random.default_rng([self.seed, 7])
        return self.by_profiles.described(self.by_profiles.draws(POSTERIOR_DRAWS, rng))

    def at(self, draw: int) -> tuple[Problem, RandomInterface]:
        """Return the problem and the random interface at a draw."""
        return self.problem, self.grid.interface(self.u[draw])

    @checked
    def interfaces(self, count: Count, seed: Number = 0) -> list[RandomInterface]:
        """Return equally likely random interfaces, drawn from the posterior.

        Parameters
        ----------
        count : int
            Number of interfaces. A longer list does not begin with a
            shorter list.
        seed : int
            Not negative.
        """
        drawn = self.grid.draws(count, np.random.default_rng([seed, 4]))
        return self._scattered([self.grid.interface(row) for row in drawn])

    @property
    def assumed(self) -> dict[str, float]:
        """Parameters of a field within a specimen that was stated and not measured, by key."""
        profiles = self.grid.profiles
        if profiles.whole or not profiles.stated:
            return {}
        keys = ("marginal.cv", "correlation_length")
        values = {key: value_at(profiles.fields[0], full_key(key)[7:]) for key in keys}
        return {key: value for key, value in values.items() if value is not None}

    @property
    def assumptions(self) -> tuple[str, ...]:
        """Sentences about assumptions that were stated and not measured."""
        profiles, texts = self.grid.profiles, []
        if profiles.whole:
            texts.append(
                "specimens differ only as a whole: strength does not vary along a specimen. A"
                " joint is a new specimen with its own factor"
            )
        elif not profiles.levels.size:
            field = profiles.fields[0].strength
            more = f" and {len(profiles.fields) - 1} more" * (len(profiles.fields) > 1)
            texts.append(
                f"the variation along a specimen is stated, not measured: {field.marginal!r},"
                f" {field.spectrum!r}{more}. Its mean has no effect"
            )
        if self.peaks.loads is not None:
            texts.append(
                "the unit is a specimen: the mean of its slip loads, which has an error of"
                f" {self.likelihood.error / np.mean(self.peaks.values[0]):.1%}"
            )
        usual = profiles.prior.scatter is FactorPrior().scatter
        law = f"half-Cauchy with scale {PRIOR_SCALE:g}" if usual else "as stated"
        return (*texts, f"prior of the scatter between specimens: {law}")

    def prediction(
        self, problem: Problem, method: Any, changes: Mapping[str, float], workers: int | None
    ) -> Prediction:
        """Return the prediction for a problem in which some constants are changed.

        `changes` names the constants by full key. The strength is
        inferred again with the changed constants. A constant of the
        tests changes too if it has the same value there as in the
        problem.
        """
        of_problem = {key[8:]: v for key, v in changes.items() if key[:8] == "problem."}
        of_field = {full_key(key)[7:]: v for key, v in changes.items() if key[:8] != "problem."}
        profiles = self.grid.profiles
        fields = tuple(with_values(one, of_field) for one in profiles.fields[:FEW_FIELDS])
        profiles = profiles._replace(fields=fields, within=profiles.within[:FEW_FIELDS])
        alike = [
            key for key in of_problem if value_at(self.problem, key) == value_at(problem, key)
        ]
        tested = with_values(self.problem, {key: of_problem[key] for key in alike}, "problem")
        joint = with_values(problem, of_problem, "problem")
        tests = self._again(tested, profiles, workers)
        same = joint == tested and method == self.likelihood.method
        if same and self.peaks.lengths == (None,) and self.peaks.unit != "1":
            return tests
        return Prediction.of(tests.grid, joint, Simulation(method, None, self.seed, workers))

    def _again(self, problem: Problem, profiles: Profiles, workers: int | None) -> Prediction:
        """Return the prediction for the tests, inferred again from the same peaks."""
        simulation = Simulation(self.likelihood.method, None, self.seed, workers)
        tables = tables_of(problem, profiles, simulation, self.peaks, self.likelihood.error)
        return Prediction(tables, grid_of_profiles(profiles, tables)[1])

    def without_field(self, problem: Problem, method: Any) -> Prediction:
        """Return the prediction from the same tests if specimens differ only as a whole."""
        own = self.grid.profiles
        more = {"families": own.families, "prior": own.prior}
        profiles = Profiles.without_field(self.problem, self.peaks, **more)
        grid = self._again(self.problem, profiles, None).grid
        return Prediction.of(grid, problem, Simulation(method, None, self.seed, None))

    def law(self, problem: Problem, method: Any) -> Prediction | None:
        """Return the prediction if it needs no samples: specimens differ only as a whole."""
        exact = self.grid.profiles.whole and not self._between
        return self.prediction(problem, method, {}, None) if exact else None

    def _summary(self) -> Summary:
        summary = super()._summary()
        shares = ", ".join(f"{name} {share:.0%}" for name, share in self.families.items())
        notes = [*summary.notes, *self.assumptions]
        notes.append(f"distributions between specimens: {shares}")
        if self.agreement is not None:
            p = min(self.agreement.p_values.values())
            notes.append(f"agreement of peaks and profiles: p = {p:.2g}")
        return summary._replace(notes=notes)
