"""Designs of tests: what further tests would tell, before any test is made.

Problem. Two questions are answered. Given a prior of the parameters
theta: how much information about each parameter would a design, such as
ten tests, give? The information is the mean over campaigns of the
divergence of the posterior from the prior,

    I = E int p(theta_i | y) log (p(theta_i | y)/p(theta_i)) dtheta_i.

After measurements, given a fit or a posterior: how wide would the
intervals of mean and scatter be after further tests, and how large
would the design stress be?

Source. Lindley (1956), Annals of Mathematical Statistics 27, 986,
defined this information. It is computed by nested Monte Carlo. The
expected widths are means over the same kind of campaigns.

Steps for the information, for each design and each simulated campaign:

1. Draw the parameters from the prior.
2. Draw the peaks from the simulated onsets that also give the likelihood.
3. Compute the posterior for the unknown parameters on a grid
   (`stiction.inference.posterior`). Known parameters keep their drawn
   values. If the posterior lies between the points of a coarse grid,
   make the box smaller around the true parameters.
4. Compute the divergence of each marginal posterior. I is the mean over
   campaigns.

Steps for the widths, for each design and each simulated campaign:

5. Draw true values (field, family, scatter s between specimens, and
   mean) from the posterior given the present measurements.
6. Draw further peaks, and levels of further profiles, with these values.
7. Compute the posterior given all measurements
   (`stiction.inference.specimens`).
8. Compute the width of the 90 % interval for each parameter, and the
   design stress from the predictive distribution. The result holds
   their means over campaigns.

Departure. Steps 5 to 8 keep only the `MAX_FIELDS` fields with the
largest mass.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import Field

from stiction.base.arrays import Array
from stiction.base.errors import InputError, unknown_name
from stiction.base.model import (
    Count,
    Names,
    NotNegative,
    Number,
    Progress,
    check,
    checked,
    is_whole,
)
from stiction.base.progress import Meter
from stiction.ensemble.experiment import Experiment, method_of
from stiction.inference.infer import profiles_of
from stiction.inference.likelihood import Likelihood, Simulation, make_likelihood, variable_of
from stiction.inference.peaks import Peaks, factor_of, si_of
from stiction.inference.posterior import SpecimenPosterior, grid_of
from stiction.inference.prior import make_prior
from stiction.inference.specimens import (
    MEAN_KEY,
    SCATTER_KEY,
    FactorGrid,
    Prediction,
    Tables,
    factor_of_family,
    grid_of_profiles,
    tables_of,
)
from stiction.methods.protocol import MethodObject
from stiction.problem.problem import Problem
from stiction.random.spectra import Share

CAMPAIGN_GRID_POINTS = 8_000
"""Number of points in the grid of each posterior."""
MIN_BOX_WIDTH = 1e-12
"""Width of a box, as a fraction of the prior, below which rounding hides
the posterior."""
MAX_FIELDS = 12
"""Number of fields within a specimen that represent all fields."""
WIDTH_DRAWS = 2_000
"""Number of draws from a posterior for an interval."""
USUAL_DESIGNS = {f"{n} tests": n for n in (5, 10, 20, 40)} | {
    f"{n} profiles": {"profiles": n} for n in (2, 5, 10)
}
"""Further tests and profiles by default."""


@checked
def design_of_tests(
    problem: Problem,
    random: Any,
    *,
    prior: Any = None,
    designs: dict[str, Any] | None = None,
    probability: Share = 1e-3,
    method: MethodObject | None = None,
    load_cell_error: NotNegative = 0.0,
    unit: str = "Pa",
    repetitions: Annotated[Count, Field(ge=10)] = 60,
    samples: Annotated[Count, Field(ge=100)] | None = None,
    seed: Number = 0,
    progress: Progress = True,
) -> xr.Dataset:
    """Estimate how much each design of tests will tell, as information or as narrower intervals.

    If `random` is a fit or a posterior from `infer`, the result holds
    the expected widths of the intervals for the mean and the scatter
    between specimens, and the expected design stress. If a `prior` of
    other parameters is given, the result holds the expected information
    about each parameter.

    Parameters
    ----------
    problem, random, prior, method, samples, seed, progress
        As in `infer`. The method of a posterior is the default.
    designs : mapping
        Designs by name. A design is a number of tests, a mapping of
        lengths (m) to numbers of tests, or a table ``{"tests": ...,
        "known": [...]}``, in which ``known`` lists parameters of the
        prior that are known from other measurements. For a fit or a
        posterior, a design is ``{"tests": ..., "profiles": ...}``, with
        numbers of further tests and profiles. The default designs are
        5, 10, 20 or 40 tests, or, after profiles, 2, 5 or 10 profiles.
    probability : float
        Probability for the design stress. Used for a fit or a posterior.
    load_cell_error : float
        Standard error of a peak, in `unit`.
    unit : str
        Unit for the peaks, as in `infer`.
    repetitions : int
        Number of simulated campaigns for each design.

    Returns
    -------
    xarray.Dataset
        Over 'design' and 'parameter': `information` is the expected
        divergence of the posterior for a parameter from its prior (nats,
        NaN if the parameter is known), with its `standard_error`. For a
        fit or a posterior, `width` is instead the expected width of the
        90 % interval, with its `standard_error`. Over 'design',
        `design_stress` is then the expected design stress, Pa, and 90 %
        of the designs lie between `design_low` and `design_high`. The
        first design, 'now', has only the present measurements.

    Raises
    ------
    InputError
        If any argument is invalid.

    Notes
    -----
    The information is the expected information gain of Lindley (1956). See
    `stiction.inference.design` for the steps.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=0.5)
    >>> expected = st.design_of_tests(
    ...     problem,
    ...     strength,
    ...     prior={"marginal.low": (0.5e6, 0.8e6)},
    ...     designs={"few": 5, "many": 50},
    ...     method=st.LocalCriterion(),
    ...     samples=200,
    ... )
    >>> information = expected.information
    >>> bool(information.sel(design="many") > information.sel(design="few"))
    True
    """
    error = load_cell_error * factor_of(unit)
    method = method_of(random, method)
    with Meter("design of tests", show=progress) as meter:
        simulation = Simulation(method, samples, seed, None, meter)
        if prior is None:
            tables = _present(problem, random, simulation, unit, error)
            usual = {
                name: design
                for name, design in USUAL_DESIGNS.items()
                if tables.profiles.levels.size or not isinstance(design, dict)
            }
            further = _further(usual if designs is None else designs)
            # Peaks may be coefficients, and a design is a stress.
            scale = 1.0
            if getattr(random, "peaks", None) and random.peaks.unit == "1":
                scale = Experiment(problem, tables.profiles.fields[0], method).pressure
            return _widths(tables, further, probability, repetitions, simulation, scale)
        parameters = make_prior(problem, random, prior)
        variable = variable_of(*parameters.at(parameters.middle), unit)
        plans = _plans(designs or {}, parameters.names)
        lengths = list(dict.fromkeys(length for tests, _ in plans.values() for length in tests))
        simulated = make_likelihood(
            parameters, simulation, lengths=lengths, error=error, variable=variable
        )
        meter.stage("simulated campaigns", repetitions * len(plans))
        rows = []
        for tests, free in plans.values():
            likelihood = simulated.of((), [lengths.index(length) for length in tests])
            counts = list(tests.values())
            rows.append(_information(likelihood, counts, free, repetitions, simulation))
    dims, (information, errors) = ("design", "parameter"), np.stack(rows, axis=1)
    return xr.Dataset(
        {"information": (dims, information), "standard_error": (dims, errors)},
        {"design": list(plans), "parameter": list(parameters.names)},
        {"repetitions": repetitions},
    )


def _as_table(name: str, design: Any, second: str) -> dict[str, Any]:
    """Return a design as a table with tests and the key `second`.

    A number, or a mapping of lengths, states the tests.

    >>> _as_table("a", 7, "profiles"), _as_table("a", {"profiles": 2}, "profiles")
    ({'tests': 7}, {'tests': 0, 'profiles': 2})
    >>> _as_table("a", {0.1: 7, 0.2: 3}, "known")
    {'tests': {0.1: 7, 0.2: 3}}
    >>> _as_table("a", {"tests": 7, "knowns": 3}, "known")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: designs: a: unknown 'knowns'; did you mean 'known'? ...
    """
    is_table = isinstance(design, Mapping) and any(isinstance(key, str) for key in design)
    table, keys = dict(design) if is_table else {"tests": design}, ("tests", second)
    if unknown := [str(key) for key in table if key not in keys]:
        raise InputError([unknown_name(f"designs: {name}", key, keys) for key in unknown])
    return {"tests": 0} | table


def _plans(
    designs: dict[str, Any], names: tuple[str, ...]
) -> dict[str, tuple[dict[float | None, int], list[int]]]:
    """Return the numbers of tests by length (m), and the positions of the unknown parameters.

    >>> design = {"tests": {0.1: 4, 0.2: 1}, "known": ["y"]}
    >>> plans = _plans({"a": 7, "b": design}, ("x", "y", "z"))
    >>> plans["a"], plans["b"]
    (({None: 7}, [0, 1, 2]), ({0.1: 4, 0.2: 1}, [0, 2]))
    >>> def refused(design):
    ...     try:
    ...         _plans(design, ("x", "y"))
    ...     except InputError as error:
    ...         print(str(error).split(" (")[0].split(". ")[0])
    >>> refused({})
    designs: must not be empty
    >>> for design in ({}, {0.1: 4, 0.2: 0}, {"known": ["x"]}, 1.5):
    ...     refused({"a": 1, "b": design})
    designs: b: tests: must be a whole number >= 1 per length
    designs: b: tests: must be a whole number >= 1 per length
    designs: b: tests: must be a whole number >= 1 per length
    designs: b: tests: must be a whole number >= 1 per length
    >>> refused({"a": {"tests": 1, "known": ["x", "w"]}})
    designs: a: known: unknown 'w'
    >>> refused({"a": {"tests": 1, "known": ["y", "x"]}})
    designs: a: known: lists all parameters
    """
    if not designs:
        raise InputError("designs: must not be empty")
    plans = {}
    for name, design in designs.items():
        table, path = _as_table(name, design, "known"), f"designs: {name}: known"
        tests = table["tests"]
        tests = tests if isinstance(tests, Mapping) else {None: tests}
        if not tests or not all(is_whole(count, 1) for count in tests.values()):
            raise InputError(
                f"designs: {name}: tests: must be a whole number >= 1 per length (m)"
            )
        known = check("known", table.get("known", ()), Names)  # from other measurements
        if unknown := [unknown_name(path, key, names) for key in known if key not in names]:
            raise InputError(unknown)
        free = [place for place, parameter in enumerate(names) if parameter not in known]
        if not free:
            raise InputError(f"{path}: lists all parameters. Leave out at least one")
        plans[name] = dict(tests), free
    return plans


def _information(
    simulated: Likelihood, tests: list[int], free: list[int], repetitions: int,
    simulation: Simulation,
) -> Array:  # fmt: skip
    """Return the expected information about each parameter, and the standard error, as (2, ...).

    Two kinds of peaks are normal here, with the standard deviation
    s about a parameter. The entropy of the posterior is
    log(s/sqrt(n) (2 pi e)^(1/2)) for n peaks, and of the prior 0. A
    known parameter has NaN.

    >>> from types import SimpleNamespace
    >>> from stiction.base.progress import SILENT
    >>> class Exact:
    ...     def __init__(self, peaks=()):
    ...         self.peaks, self.box = peaks, np.array([[0.0, 0.0], [1.0, 1.0]])
    ...         self.prior = SimpleNamespace(dimension=2)
    ...     def predicted(self, kind, u, seed):
    ...         rng = np.random.default_rng(seed)
    ...         return kind + u[:, 1] + 0.01 * rng.standard_normal(len(u))
    ...     def of(self, peaks):
    ...         return Exact(peaks)
    ...     def __call__(self, u):
    ...         away = [p - kind - u[:, 1:] for kind, p in enumerate(self.peaks)]
    ...         return -0.5 * (np.concatenate(away, axis=1) ** 2).sum(axis=1) / 0.01**2
    >>> setting = SimpleNamespace(seed=0, meter=SILENT)
    >>> mean, error = _information(Exact(), [3, 1], [1], 40, setting)
    >>> expected = math.log(math.sqrt(4) / 0.01 / math.sqrt(2.0 * math.pi * math.e))
    >>> f"{mean[1] - expected:.1f} {mean[0]}", bool(0.0 < error[1] < 0.03)
    ('0.0 nan', True)
    """
    rng, dimension = np.random.default_rng([simulation.seed, 2]), simulated.prior.dimension
    gains = np.full((repetitions, dimension), np.nan)
    for row in range(repetitions):
        # 1. and 2.
        truth, start = rng.random(dimension), int(rng.integers(2**32))
        peaks = [
            simulated.predicted(kind, np.tile(truth, (count, 1)), start + kind)
            for kind, count in enumerate(tests)
        ]
        likelihood = simulated.of(peaks)
        box = simulated.box[:, free]

        def given(v: Array, known: Array = truth, of: Likelihood = likelihood) -> Array:
            u = np.tile(known, (v.shape[0], 1))
            u[:, free] = v
            return of(u)

        # 3. Many precise tests leave a posterior that
        # is narrower than a cell, and then no point
        # of the grid has a likelihood above zero.
        grid = grid_of(given, box, CAMPAIGN_GRID_POINTS)
        while grid is None and np.ptp(box, axis=0).min() > MIN_BOX_WIDTH:
            box = 0.75 * truth[free] + 0.25 * box
            grid = grid_of(given, box, CAMPAIGN_GRID_POINTS)
        # 4.
        if grid is not None:
            gains[row, free] = [grid.information(place) for place in range(len(free))]
        simulation.meter.advance()
    finite = gains[np.isfinite(gains).any(axis=1)]
    return np.stack([finite.mean(axis=0), finite.std(axis=0) / np.sqrt(len(finite))])


def _further(designs: dict[str, Any]) -> dict[str, tuple[int, int]]:
    """Return the numbers of further tests and profiles.

    The first design is the present.

    >>> _further({"a": 7, "b": {"tests": 1, "profiles": 2}, "c": {"profiles": 3}})
    {'now': (0, 0), 'a': (7, 0), 'b': (1, 2), 'c': (0, 3)}
    >>> for design in (0, {"tests": 1, "profiles": -1}):  # doctest: +ELLIPSIS
    ...     try:
    ...         _further({"a": design})
    ...     except InputError as error:
    ...         print(str(error).split(", ")[-1])
    got 0 and 0
    got 1 and -1
    """
    plans = {"now": (0, 0)}
    for name, design in designs.items():
        table = _as_table(name, design, "profiles")
        plans[name] = table["tests"], table.get("profiles", 0)
        if not all(is_whole(number, 0) for number in plans[name]) or not any(plans[name]):
            raise InputError(
                f"designs: {name}: tests and profiles must be whole numbers >= 0, and at least"
                f" one of them >= 1, got {' and '.join(map(str, plans[name]))}"
            )
    return plans


def _present(
    problem: Problem, random: Any, simulation: Simulation, unit: str, error: float
) -> Tables:
    """Return the present measurements, for the fields with the largest posterior mass.

    Specimens of the problem come first. Further tests and the design
    are for them.

    The fields with the largest mass stay, and specimens of the
    problem come first.

    >>> from types import SimpleNamespace
    >>> from stiction.inference.specimens import Onsets, Profiles
    >>> problem = SimpleNamespace(interface=SimpleNamespace(measure=0.1))
    >>> names, within = tuple(f"field {i}" for i in range(14)), np.arange(28.0).reshape(14, 2)
    >>> profiles = Profiles(names, 1e6, np.ones(2), within)
    >>> ratios = np.arange(14.0).reshape(14, 1, 1)
    >>> onsets = tuple(Onsets(np.zeros(1), k + ratios, ()) for k in (0, 50))
    >>> tables = Tables(profiles, None, onsets, 3.0, (np.array([6.0]), np.array([7.0])))
    >>> mass = np.r_[0.0, 3.0, np.ones(11), 2.0].reshape(14, 1, 1, 1)
    >>> posterior = SpecimenPosterior(
    ...     peaks=Peaks((0.2, 0.1), tables.peaks, "Pa"), draws={}, u=None, by_profiles=None,
    ...     monte_carlo_error=0.1, problem=problem, likelihood=tables,
    ...     grid=SimpleNamespace(mass=mass / mass.sum()))
    >>> fewer = _present(problem, posterior, None, "Pa", 0.0)
    >>> [name.split()[1] for name in fewer.profiles.fields]
    ['1', '13', '2', '3', '4', '5', '6', '7', '8', '9', '10', '11']
    >>> fewer.profiles.within[:2].tolist(), [peaks.tolist() for peaks in fewer.peaks]
    ([[2.0, 3.0], [26.0, 27.0]], [[7.0], [6.0]])
    >>> [kind.ratios[:2].ravel().tolist() for kind in fewer.onsets]
    [[51.0, 63.0], [1.0, 13.0]]
    >>> other = SimpleNamespace(interface=SimpleNamespace(measure=0.3))
    >>> for given, inferred in ((other, replace(posterior, problem=other)), (other, posterior)):
    ...     try:
    ...         _present(given, inferred, None, "Pa", 0.0)
    ...     except InputError as error:
    ...         print(error)
    random: no peak is from a specimen of the problem, 0.3 m
    problem: must be the problem of the posterior

    Given profiles, all fields are equally likely.

    >>> from unittest.mock import patch
    >>> setting = SimpleNamespace(seed=0)
    >>> def simulated(problem, profiles, simulation, peaks, error):
    ...     return replace(tables, error=error, peaks=peaks.values)
    >>> with patch("stiction.inference.design.tables_of", simulated):
    ...     fewer = _present(problem, profiles, setting, "kPa", 4.0)
    >>> fewer.profiles.fields == names[:12], fewer.error, fewer.peaks[0].size
    (True, 4.0, 0)
    >>> bare = profiles._replace(levels=np.zeros(0))
    >>> _present(problem, bare, setting, "kPa", 3.0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: random: must be a fit or a posterior ...
    """
    if isinstance(random, SpecimenPosterior):
        if problem != random.problem:
            raise InputError("problem: must be the problem of the posterior")
        size, tables = problem.interface.measure, random.likelihood
        same = [length is None or math.isclose(length, size) for length in random.peaks.lengths]
        order = np.argsort(np.logical_not(same), kind="stable")
        if not any(same):
            raise InputError(f"random: no peak is from a specimen of the problem, {size:g} m")
        tables = tables.of([tables.peaks[kind] for kind in order], order)
        mass = random.grid.mass.sum(axis=(1, 2, 3))
    else:
        profiles = profiles_of(random, None, None, simulation.seed)
        if not profiles.levels.size:
            raise InputError("random: must be a fit or a posterior of `infer` without a prior")
        no_peaks = Peaks((None,), (np.zeros(0),), si_of(unit))
        tables = tables_of(problem, profiles, simulation, no_peaks, error)
        mass = np.ones(len(profiles.fields))  # given the profiles, fields are equally likely
    # Each campaign needs a posterior, whose
    # cost grows with the number of fields.
    order = np.argsort(-mass, kind="stable")[:MAX_FIELDS]
    profiles = tables.profiles
    fields = tuple(profiles.fields[place] for place in order)
    fewer = profiles._replace(fields=fields, within=profiles.within[order])
    onsets = tuple(kind.of(order) for kind in tables.onsets)
    return replace(tables, profiles=fewer, onsets=onsets)


def _widths(
    tables: Tables, plans: dict[str, tuple[int, int]], probability: float, repetitions: int,
    simulation: Simulation, scale: float,
) -> xr.Dataset:  # fmt: skip
    """Return widths of intervals and design stresses after further measurements.

    Without further measurements, the first design describes the
    present posterior. (Predictions are replaced by numbers here.)

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> import stiction as st
    >>> from stiction.inference.specimens import Onsets, Profiles
    >>> field = st.RandomField(st.Lognormal(mean=2e6, cv=0.1), st.ExponentialSpectrum(1e-3))
    >>> levels, within = np.array([1.9e6, 2.3e6]), np.array([[0.01, 0.02]])
    >>> fields = (st.RandomInterface(strength=field),)
    >>> profiles = Profiles(fields, 2e6, levels, within, ("lognormal",))
    >>> onsets = (Onsets(np.zeros(1), np.full((1, 1, 1), 8e5), ()),)
    >>> tables = Tables(profiles, None, onsets, 0.0, (np.zeros(0),))
    >>> def prediction(both, grid):
    ...     levels = both.profiles.levels.size
    ...     return SimpleNamespace(quantile=lambda probability: levels * probability)
    >>> setting, plans = Simulation(None, None, 0), {"now": (0, 0), "more": (0, 5)}
    >>> with patch("stiction.inference.design.Prediction", prediction):
    ...     found = _widths(tables, plans, 0.25, 2, setting, 3.0)
    >>> names = "design_stress", "design_low", "design_high"
    >>> [found[name].values.tolist() for name in names]  # 2*0.25*3 and 7*0.25*3
    [[1.5, 5.25], [1.5, 5.25], [1.5, 5.25]]
    >>> now = grid_of_profiles(profiles)[0]
    >>> drawn = now.described(now.draws(20_000, np.random.default_rng(5)))
    >>> for name, width in zip(found.parameter.values, found.width[0].values, strict=True):
    ...     low, high = np.quantile(drawn[name], [0.05, 0.95])
    ...     print(name, 0.9 < width / (high - low) < 1.1)
    mean True
    between True
    >>> bool((found.width[1] < found.width[0]).all()), found.design.values.tolist()
    (True, ['now', 'more'])
    >>> bool((found.standard_error[0] < 0.1 * found.width[0]).all()), found.attrs
    (True, {'probability': 0.25, 'repetitions': 2})
    >>> bare = replace(tables, profiles=profiles._replace(levels=np.zeros(0)))
    >>> _widths(bare, {"a": (0, 0), "b": (0, 9)}, 0.01, 2, setting, 1.0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: designs: profiles: need a fit, ...
    """
    if any(levels for _, levels in plans.values()) and not tables.profiles.levels.size:
        raise InputError("designs: profiles: need a fit, which gives the length of profiles")
    _, now = grid_of_profiles(tables.profiles, tables)
    rng = np.random.default_rng([simulation.seed, 8])
    simulation.meter.stage("simulated campaigns", len(plans) * repetitions)
    widths = np.empty((len(plans), repetitions, 2))
    stresses = np.empty((len(plans), repetitions))
    for row, (tests, levels) in enumerate(plans.values()):
        for number in range(repetitions):
            # 5.
            truth = now.draws(1, rng)
            # 6. and 7.
            grid, both = _after(tables, truth, tests, levels, rng) if row else (now, tables)
            # 8.
            drawn = grid.described(grid.draws(WIDTH_DRAWS, rng))
            ends = [np.quantile(drawn[name], [0.05, 0.95]) for name in (MEAN_KEY, SCATTER_KEY)]
            widths[row, number] = np.ptp(ends, axis=1)
            stresses[row, number] = Prediction(both, grid).quantile(probability)
            simulation.meter.advance()
    low, high = np.quantile(stresses, [0.05, 0.95], axis=1) * scale
    both_dims, about = ("design", "parameter"), {"units": "Pa"}
    return xr.Dataset(
        {
            "width": (both_dims, widths.mean(axis=1)),
            "standard_error": (both_dims, widths.std(axis=1) / np.sqrt(repetitions)),
            "design_stress": ("design", stresses.mean(axis=1) * scale, about),
            "design_low": ("design", low, about),
            "design_high": ("design", high, about),
        },
        {"design": list(plans), "parameter": [MEAN_KEY, SCATTER_KEY]},
        {"probability": probability, "repetitions": repetitions},
    )


def _after(
    tables: Tables, truth: Array, tests: int, levels: int, rng: np.random.Generator
) -> tuple[FactorGrid, Tables]:
    """Return the posterior after further tests and profiles for a true draw (1, 4) (steps 6, 7).

    The true field is the first, with the mean 1.5 times the
    reference and almost no scatter. A further level has the mean
    variance of the present levels within each field.

    >>> from unittest.mock import patch
    >>> from stiction.inference.specimens import Onsets, Profiles
    >>> levels, within = np.array([1.9e6, 2.2e6]), np.array([[0.0, 0.0], [0.04, 0.08]])
    >>> profiles = Profiles(("first", "second"), 2e6, levels, within, ("lognormal", "normal"))
    >>> onsets = tuple(Onsets(np.zeros(1), np.full((2, 1, 1), r), ()) for r in (8e5, 9e5))
    >>> tables = Tables(profiles, None, onsets, 0.0, (np.array([7e5]), np.array([6e5])))
    >>> truth = np.array([[0.0, 0.0, 1e-6, math.log(1.5)]])
    >>> def after(truth, levels):
    ...     changed = {"grid_of_profiles": lambda *given: (None, given)}
    ...     with patch.multiple("stiction.inference.design", **changed):
    ...         return _after(tables, truth, 2, levels, np.random.default_rng(0))
    >>> given, both = after(truth, 3)
    >>> given[0] is both.profiles, given[1] is both
    (True, True)
    >>> (both.profiles.levels / 1e6).round(3).tolist()
    [1.9, 2.2, 3.0, 3.0, 3.0]
    >>> both.profiles.within.round(9).tolist()
    [[0.0, 0.0, 0.0, 0.0, 0.0], [0.04, 0.08, 0.06, 0.06, 0.06]]
    >>> [(peaks / 1e5).round(3).tolist() for peaks in both.peaks]
    [[7.0, 12.0, 12.0], [6.0]]

    In the second field, logarithms have the variance 0.06, and
    levels keep their mean. A factor adds the variance log(1 +
    0.3^2).

    >>> truth[:] = 1.0, 0.0, 1e-6, math.log(1.5)
    >>> levels = after(truth, 20_000)[1].profiles.levels[2:] / 3e6
    >>> f"{np.log(levels).var():.2f} {levels.mean():.2f}"
    '0.06 1.00'
    >>> truth[:] = 1.0, 0.0, 0.3, math.log(1.5)
    >>> levels = after(truth, 20_000)[1].profiles.levels[2:] / 3e6
    >>> f"{np.log(levels).var():.2f} {levels.mean():.1f}"
    '0.15 1.0'
    """
    profiles = tables.profiles
    peaks = tables.predicted(0, np.repeat(truth, tests, axis=0), int(rng.integers(2**31)))
    field, family, cv, log_mean = truth[0]
    law = factor_of_family(profiles.families[int(family)], float(cv)).distribution
    # A further profile is as long as the present profiles, so its level
    # scatters within the field as much as their levels do on average.
    scanned = max(profiles.within.shape[1], 1)
    within = profiles.within.sum(axis=1, keepdims=True) / scanned
    within = within.repeat(levels, axis=1)
    variance = within[int(field)]
    errors = np.sqrt(variance) * rng.standard_normal(levels) - 0.5 * variance
    new = profiles.reference * law.ppf(rng.random(levels)) * np.exp(log_mean + errors)
    both = profiles._replace(
        levels=np.concatenate([profiles.levels, new]),
        within=np.concatenate([profiles.within, within], axis=1),
    )
    further = (np.concatenate([tables.peaks[0], np.maximum(peaks, 1e-9)]), *tables.peaks[1:])
    updated = replace(tables, profiles=both, peaks=further)
    return grid_of_profiles(both, updated)[1], updated
