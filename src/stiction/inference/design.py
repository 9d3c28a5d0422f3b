"""Designs of tests: the expected information, before any test is made.

Problem. Parameters theta have a prior. Compute how much information about each
parameter a design, such as ten tests, is expected to give. It is the mean over
campaigns of the divergence of the posterior from the prior,

    I = E int p(theta_i | y) log (p(theta_i | y)/p(theta_i)) dtheta_i.

Source. Lindley (1956), Annals of Mathematical Statistics 27, 986, defined this
information. It is computed by nested Monte Carlo.

Steps, for each design and each simulated campaign:

1. Draw the parameters from the prior.
2. Draw the peaks from the simulated onsets that also give the likelihood.
3. Compute the posterior of the unknown parameters on a grid (`stiction.inference.grid`).
   Known parameters keep their drawn values. If the posterior lies between the points of
   a coarse grid, make the box smaller around the true parameters.
4. Compute the divergence of each marginal posterior. I is the mean over campaigns.

`stiction.inference.widths` answers the same question for a fit or a posterior.
"""

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import Field

from stiction.base.arrays import Array
from stiction.base.errors import InputError, unknown_name
from stiction.base.model import Count, Names, Number, Progress, check, checked, is_whole
from stiction.base.progress import Meter
from stiction.base.variables import Variable
from stiction.inference.grid import grid_of
from stiction.inference.likelihood import Likelihood, Simulation, make_likelihood, variable_of
from stiction.inference.peaks import factor_of
from stiction.inference.prior import make_prior
from stiction.inference.widths import expected_widths
from stiction.methods.protocol import MethodObject
from stiction.problem.load import NotNegative
from stiction.problem.problem import Problem
from stiction.problem.results import to_dataset
from stiction.random.spectra import Share

CAMPAIGN_GRID_POINTS = 8_000
"""Points of the grid of each posterior."""
MIN_BOX_WIDTH = 1e-12
"""Width of a box, as a share of the prior, below which rounding hides the posterior."""
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
    method: MethodObject,
    load_cell_error: NotNegative = 0.0,
    unit: str = "Pa",
    repetitions: Annotated[Count, Field(ge=10)] = 60,
    samples: Annotated[Count, Field(ge=100)] | None = None,
    seed: Number = 0,
    workers: Count | None = None,
    progress: Progress = True,
) -> xr.Dataset:
    """Estimate how much each design of tests will tell, as information or as narrower intervals.

    If `random` is a fit or a posterior from `infer`, the result holds the expected
    widths of the intervals for the mean and the scatter between specimens, and the
    expected design stress. If a `prior` of other parameters is given, the result
    holds the expected information about each parameter.

    Parameters
    ----------
    problem, random, prior, method, samples, seed, workers, progress
        As in `infer`.
    designs : mapping
        Designs by name. A design is a number of tests, a mapping of lengths (m)
        to numbers of tests, or a table ``{"tests": ..., "known": [...]}``, in
        which ``known`` lists parameters of the prior that are known from other
        measurements. For a fit or a posterior, a design is ``{"tests": ...,
        "profiles": ...}``, with numbers of further tests and profiles. The default
        designs are 5, 10, 20 or 40 tests, or 2, 5 or 10 profiles.
    probability : float
        Probability for the design stress. Used for a fit or a posterior.
    load_cell_error : float
        Standard deviation of the error of a peak, in `unit`.
    unit : str
        Unit of the peaks, as in `infer`. Use "N" if the prior varies the area.
    repetitions : int
        Number of simulated campaigns for each design.

    Returns
    -------
    xarray.Dataset
        Over 'design' and 'parameter': `information` is the expected divergence of the
        posterior of a parameter from its prior (nats, NaN if the parameter is known),
        with its `standard_error`. For a fit or a posterior, `width` is instead the
        expected width of the 90 % interval, with its `standard_error`. Over 'design',
        `design_stress` is then the expected design stress, Pa, and 90 % of the
        designs lie between `design_low` and `design_high`. The first design, 'now',
        stands for the present measurements.

    Raises
    ------
    InputError
        If any argument is invalid. The message lists every problem.

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
    if prior is None:
        with Meter("design of tests", show=progress) as meter:
            simulation = Simulation(method, samples, seed, workers, meter)
            return expected_widths(
                problem, random, USUAL_DESIGNS if designs is None else designs, simulation,
                probability, error, unit, repetitions,
            )  # fmt: skip
    parameters = make_prior(problem, random, prior)
    designs = designs or {}
    variable = variable_of(*parameters.at(parameters.middle), unit)
    plans = _plans(designs, parameters.names)
    lengths = list(dict.fromkeys(length for tests, _ in plans for length in tests))
    with Meter("design of tests", show=progress) as meter:
        simulation = Simulation(method, samples, seed, workers, meter)
        simulated = make_likelihood(
            parameters, simulation, lengths=lengths, error=error, variable=variable
        )
        meter.stage("simulated campaigns", repetitions * len(plans))
        rows = []
        for tests, free in plans:
            kinds = [lengths.index(length) for length in tests]
            likelihood = simulated.of((), kinds)
            rows.append(
                _expected(likelihood, list(tests.values()), free, repetitions, seed, meter)
            )
    dims = ("design", "parameter")
    variables = {
        "information": Variable("1", "expected information about a parameter, nats", dims),
        "standard_error": Variable("1", "standard error of the information, nats", dims),
    }
    values = dict(zip(variables, np.stack(rows, axis=1), strict=True))
    coordinates = {
        "design": (np.array(list(designs)), Variable("", "design of tests", ("design",))),
        "parameter": (np.array(parameters.names), Variable("", "parameter", ("parameter",))),
    }
    return to_dataset(values, variables, coordinates, {"repetitions": repetitions})


def _plans(
    designs: dict[str, Any], names: tuple[str, ...]
) -> list[tuple[dict[float | None, int], list[int]]]:
    """Return the numbers of tests by length (m), and the positions of the unknown parameters."""
    problems = [] if designs else ["designs: must not be empty"]
    plans = []
    for name, design in designs.items():
        # A table has names as keys, numbers of tests by length have lengths.
        named = isinstance(design, Mapping) and any(isinstance(key, str) for key in design)
        table: Any = design if named else {"tests": design}
        given = table.get("tests", {})
        tests = dict(given) if isinstance(given, Mapping) else {None: given}
        known = check("known", table.get("known", ()), Names)
        if not tests or not all(is_whole(count, 1) for count in tests.values()):
            problems.append(
                f"designs: {name}: tests: must be whole numbers >= 1, by length (m)"
            )
        for path, keys, valid in (
            (f"designs: {name}", table, ("tests", "known")),
            (f"designs: {name}: known", known, names),
        ):
            problems += [unknown_name(path, str(k), valid) for k in keys if k not in valid]
        if set(known) >= set(names):
            problems.append(f"designs: {name}: known: every parameter would be known")
        plans.append((tests, [i for i, own in enumerate(names) if own not in known]))
    if problems:
        raise InputError(problems)
    return plans


def _expected(
    simulated: Likelihood,
    tests: list[int],
    free: list[int],
    repetitions: int,
    seed: int,
    meter: Meter,
) -> Array:
    """Return the expected information about each parameter, and the standard error, as (2, ...)."""
    rng, dimension = np.random.default_rng([seed, 2]), simulated.prior.dimension
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

        # 3.
        grid = grid_of(given, box, CAMPAIGN_GRID_POINTS)
        while grid is None and np.ptp(box, axis=0).min() > MIN_BOX_WIDTH:
            box = 0.75 * truth[free] + 0.25 * box
            grid = grid_of(given, box, CAMPAIGN_GRID_POINTS)
        # 4.
        if grid is not None:
            gains[row, free] = [grid.information(place) for place in range(len(free))]
        meter.advance()
    finite = gains[np.isfinite(gains).any(axis=1)]
    return np.stack([finite.mean(axis=0), finite.std(axis=0) / np.sqrt(len(finite))])
