"""Designs of tests: what would each be expected to tell, before any is made?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import xarray as xr

from stiction._checks import check_count, check_progress, is_finite, is_whole
from stiction.arrays import Array
from stiction.errors import InputError
from stiction.inference.grid import grid_of
from stiction.inference.likelihood import Likelihood, Model, make_likelihood, make_model, varies
from stiction.inference.posterior import predicted
from stiction.inference.prior import Prior, make_prior
from stiction.methods import Method, check_method
from stiction.model import describe
from stiction.problem import Problem
from stiction.progress import SILENT, Meter, Show
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.results import Variable, to_dataset

OPTIONS = ("tests", "known", "positions", "load_cell_error")
REPETITIONS = 60
POINTS = 8_000
"""Of the grid of each posterior."""
UNIFORM = 12.0**-0.5
"""Standard deviation of u before any test."""


@dataclass(frozen=True)
class Design:
    """One way to spend the tests.

    Attributes
    ----------
    tests : dict
        Number of tests by length, m; None for the problem's own.
    known : tuple of str
        Parameters that would be known from elsewhere.
    positions : bool
        Whether it is seen where slip begins.
    load_cell_error : float
        Pa.
    """

    tests: Mapping[float | None, int]
    known: tuple[str, ...]
    positions: bool
    load_cell_error: float


def design_of_tests(
    problem: Problem,
    random: RandomInterface | RandomField,
    *,
    prior: Mapping[str, Any],
    designs: Mapping[str, Any],
    method: Method,
    load_cell_error: float = 0.0,
    repetitions: int = REPETITIONS,
    samples: int | None = None,
    seed: int = 0,
    progress: Show = True,
) -> xr.Dataset:
    """How much is each design of tests expected to tell of each parameter?

    Parameters
    ----------
    problem, random, prior, method, samples, seed, progress
        As in `infer`.
    designs : mapping
        Of names to what would be done: a number of tests, a mapping of lengths (m) to numbers of
        tests, or a table ``{"tests": ..., "known": [...], "positions": True,
        "load_cell_error": ...}`` in which ``known`` lists parameters of the prior that would be
        known from elsewhere, such as a marginal that was measured.
    load_cell_error : float
        Pa, where a design does not say otherwise.
    repetitions : int
        Imagined campaigns of each design.

    Returns
    -------
    xarray.Dataset
        Over 'design' and 'parameter': `information`, the expected divergence of the posterior of
        a parameter from its prior (nats; NaN where it is known), `standard_error` of it, and
        `spread_left`, the expected standard deviation of the posterior over that of the prior.

    Raises
    ------
    InputError
        Naming all that does not fit.

    Notes
    -----
    Expected information gain (Lindley, 1956) by nested Monte Carlo: parameters are drawn from the
    prior, peaks from the same onsets that serve the likelihood, and the posterior is that of
    `infer` on a coarser grid. Known parameters are drawn and then held
    at what was drawn.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=0.5)
    >>> told = st.design_of_tests(
    ...     problem,
    ...     strength,
    ...     prior={"marginal.low": (0.5e6, 0.8e6)},
    ...     designs={"few": 5, "many": 50},
    ...     method=st.LocalCriterion(),
    ...     samples=200,
    ... )
    >>> bool(told.information.sel(design="many") > told.information.sel(design="few"))
    True
    """
    check_progress(progress)
    check_method(method)
    parameters = make_prior(problem, random, prior)
    repetitions = check_count("repetitions", repetitions, 10)
    seed = check_count("seed", seed, 0)
    found = _designs(designs, parameters, load_cell_error)
    lengths = list(dict.fromkeys(length for design in found.values() for length in design.tests))
    with Meter("design of tests", show=progress) as meter:
        model = make_model(
            parameters,
            method=method,
            lengths=lengths,
            error=0.0,
            samples=samples,
            seed=seed,
            variable="critical_stress",
            meter=meter,
            scaling=not (varies(problem) and any(d.positions for d in found.values())),
        )
        meter.stage("imagined campaigns", repetitions * len(found))
        told = [
            _told(model, lengths, design, repetitions, seed, meter) for design in found.values()
        ]
    names = ("information", "standard_error", "spread_left")
    values = dict(zip(names, np.stack(told, axis=1), strict=True))
    dims = ("design", "parameter")
    variables = {
        "information": Variable("1", "expected information about a parameter, nats", dims),
        "standard_error": Variable("1", "standard error of the information, nats", dims),
        "spread_left": Variable("1", "posterior over prior standard deviation, expected", dims),
    }
    coordinates = {
        "design": (np.array(list(found)), Variable("", "design of tests", ("design",))),
        "parameter": (np.array(parameters.names), Variable("", "parameter", ("parameter",))),
    }
    return to_dataset(values, variables, coordinates, {"repetitions": repetitions})


def _designs(given: Any, prior: Prior, error: Any) -> dict[str, Design]:
    if not isinstance(given, Mapping) or not given:
        raise InputError(
            "designs: must map names to designs, such as {'25 tests': 25, 'two lengths':"
            f" {{0.1: 15, 0.05: 15}}}}, got {describe(given)}"
        )
    problems: list[str] = []
    found = {}
    for name, value in given.items():
        try:
            found[str(name)] = _design(value, prior, error)
        except InputError as mistake:
            problems += [f"designs: {name}: {text}" for text in mistake.problems]
    if problems:
        raise InputError(problems)
    return found


def _design(given: Any, prior: Prior, error: Any) -> Design:
    table = given if isinstance(given, Mapping) and "tests" in given else {"tests": given}
    unknown = [key for key in table if key not in OPTIONS]
    if unknown:
        raise InputError(f"unknown {unknown[0]!r} (valid: {', '.join(OPTIONS)})")
    tests = table["tests"]
    tests = dict(tests) if isinstance(tests, Mapping) else {None: tests}
    problems = [
        f"tests: must be whole numbers >= 1, got {describe(count)}"
        for count in tests.values()
        if not is_whole(count, 1)
    ]
    problems += [
        f"tests: lengths must be positive numbers in m, got {describe(length)}"
        for length in tests
        if length is not None and not (is_finite(length) and length > 0.0)
    ]
    known = table.get("known", ())
    known = (known,) if isinstance(known, str) else tuple(known)
    problems += [
        f"known: {name!r} is no parameter of the prior ({', '.join(prior.names)})"
        for name in known
        if name not in prior.names
    ]
    error = table.get("load_cell_error", error)
    if not (is_finite(error) and error >= 0.0):
        problems.append(f"load_cell_error: must be a number >= 0 in Pa, got {describe(error)}")
    if problems or len(set(known)) == prior.dimension:
        raise InputError(problems or "known: every parameter would be known")
    counts = {length: int(count) for length, count in tests.items()}
    return Design(counts, known, bool(table.get("positions", False)), float(error))


def _told(
    model: Model,
    lengths: list[float | None],
    design: Design,
    repetitions: int,
    seed: int,
    meter: Meter,
) -> Array:
    """Information, its standard error and the spread left, of every parameter, (3, parameters)."""
    prior = model.prior
    rng = np.random.default_rng([seed, 2])
    specimens = tuple(model.specimens[lengths.index(length)] for length in design.tests)
    own = replace(model, error=design.load_cell_error, specimens=specimens)
    free = [i for i, name in enumerate(prior.names) if name not in design.known]
    gains = np.full((repetitions, prior.dimension), np.nan)
    left = np.full((repetitions, prior.dimension), np.nan)
    for number in range(repetitions):
        truth = rng.random(prior.dimension)
        likelihood = make_likelihood(own, *_campaign(own, design, truth, rng), quiet=True)

        def given_what_is_known(
            v: Array, floor: float, truth: Array = truth, likelihood: Likelihood = likelihood
        ) -> Array:
            u = np.tile(truth, (v.shape[0], 1))
            u[:, free] = v
            return likelihood(u, floor)

        grid = grid_of(given_what_is_known, own.low[free], own.high[free], SILENT, POINTS)
        for place, i in enumerate(free):
            gains[number, i] = grid.information(place)
            left[number, i] = grid.spread(place) / UNIFORM
        meter.advance()
    error = gains.std(axis=0) / np.sqrt(repetitions)
    return np.stack([gains.mean(axis=0), error, left.mean(axis=0)])


def _campaign(
    model: Model, design: Design, truth: Array, rng: np.random.Generator
) -> tuple[list[Array], list[Array | None]]:
    """Peaks of one imagined campaign, and positions where they would be seen."""
    peaks: list[Array] = []
    places: list[Array | None] = []
    seed = int(rng.integers(2**32))
    for number, count in enumerate(design.tests.values()):
        own, where = predicted(model, number, np.tile(truth, (count, 1)), seed + number)
        peaks.append(own)
        places.append(where if design.positions else None)
    return peaks, places
