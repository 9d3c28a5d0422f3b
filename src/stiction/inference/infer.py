"""Parameters of a random interface from the peaks of repeated tests."""

import itertools
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import Count, Progress, at_least, checked
from stiction.base.progress import Meter, Show
from stiction.ensemble.limit_state import no_single_length
from stiction.ensemble.pilot import compare, pilot_doubt
from stiction.inference.curves import Curves
from stiction.inference.grid import grid_of
from stiction.inference.joined import join
from stiction.inference.likelihood import (
    Likelihood,
    Simulation,
    bounds_of,
    experiments_at,
    make_likelihood,
    out_of_reach,
    variable_of,
)
from stiction.inference.peaks import Peaks, factor_of, make_peaks
from stiction.inference.posterior import POSTERIOR_DRAWS, Posterior
from stiction.inference.prior import Prior, make_prior
from stiction.inference.specimens import MEAN_KEY, SCATTER_KEY
from stiction.methods.criterion.local import LocalCriterion
from stiction.methods.protocol import MethodObject, optional_member
from stiction.problem.load import NotNegative
from stiction.problem.problem import Problem
from stiction.random.equally_likely import AnyRandom
from stiction.random.stresses import mean_in_stress

TOLERABLE = 0.25
"""Monte Carlo error over the posterior's standard deviation above which it is reported."""
NEVER = 1e-9
"""Probability of a peak beyond the strengths that are thought possible."""
WIDEN = 0.1
"""Width of the first posterior that is added to the box of the second on either side."""
BOX_END_SHARE, HELD = 0.05, 1e-3
"""Share of the box at either end, and mass of the posterior there above which the box grows."""
PRIOR_END, PILED = 0.02, 4.0
"""Share of a prior at its ends, and its multiple at which the posterior piles up there."""

UNFINISHED: dict[Any, Array] = {}
"""Onsets of a call that was interrupted; an equal one takes them up."""


@contextmanager
def _simulating(
    method: Any, samples: int | None, seed: int, workers: int | None, progress: Show
) -> Iterator[Simulation]:
    with Meter("infer", show=progress) as meter:
        try:
            yield Simulation(method, samples, seed, workers, meter, UNFINISHED)
        except Exception:  # after Ctrl-C the next call goes on with these onsets
            UNFINISHED.clear()
            raise
        UNFINISHED.clear()


@checked
def infer(
    problem: Problem,
    random: AnyRandom,
    peaks: Any,
    *,
    prior: Any = None,
    between: Any = None,
    method: MethodObject,
    load_cell_error: NotNegative = 0.0,
    unit: str = "Pa",
    samples: at_least(100) | None = None,  # type: ignore[valid-type]
    seed: at_least(0) = 0,  # type: ignore[valid-type]
    workers: Count | None = None,
    progress: Progress = True,
) -> Posterior:
    """Infer parameters of the random strength from the peak stresses of repeated tests.

    Parameters
    ----------
    problem : Problem
        One specimen.
    random : RandomInterface, RandomField, a fit, or a list of interfaces
        The random properties. With priors of other parameters than the two of specimens
        below, one interface with known parameters, of which `prior` replaces some. Otherwise
        a fit, whose records are joined with the peaks, or one or several equally likely
        interfaces, of which only the field within a specimen counts: mean and scatter between
        specimens are inferred.
    peaks : array, mapping of arrays, or Peaks
        Mean shear stress, or force, at which each specimen slid, in `unit`; for specimens
        of several lengths a mapping of each length (m) to its peaks,
        ``{0.1: [...], 0.2: [...]}``, with the node spacing of the problem. Or the result of
        `read_peaks`.
    prior : mapping, optional
        Of specimens: ``"strength.mean"``, by default flat in its logarithm, and
        ``"between.strength"``, the coefficient of variation between specimens, by default
        half-Cauchy of scale 0.1. Or other parameters and the prior of each: a frozen
        continuous `scipy.stats` distribution, a range ``(low, high)``, or
        ``{"low": ..., "high": ..., "spacing": "log"}``. Priors are independent. Keys are those
        of a sweep: for the strength, ``"correlation_length"`` or ``"marginal.low"``; for others,
        ``"residual_strength.marginal.high"`` or ``"problem.friction.weakening_rate"``.
    between : str or sequence of str, optional
        Families of the factor between specimens, as in `fit_field`; those of the fit, or all,
        by default, with equal prior weights.
    method : LocalCriterion, Equilibrium or any other
        The method that finds the onset. For all but the local criterion, that one, if applicable,
        first finds the relevant part of the prior, which grows until it contains the posterior.
    load_cell_error : float
        Standard deviation of the error of a peak, in `unit`; with `Peaks` in Pa, in N, or
        as a coefficient.
    unit : str
        Unit of peaks and load-cell error: a unit of stress; of force, which needs a
        specimen's ``thickness``, a line's ``width`` or a plane; or "1" for friction
        coefficients, which need ``Load(normal_pressure=...)``.
    samples : int, optional
        Simulated specimens at each point: by default 2000 by the local criterion, 500 by
        equilibrium. Of each field within a specimen: 200 by the local criterion, 100 by others.
    seed : int
        Not negative. The same samples are used at every point, so that the likelihood is smooth.
    workers, progress
        As in `monte_carlo`.

    Returns
    -------
    Posterior
        With `draws`, `mean`, `interval` and `information` (nats); ArviZ draws and compares
        `to_arviz()`.

    Raises
    ------
    InputError
        If any argument is invalid, or no parameters in the prior can produce the peaks; the
        message then names the bound that must move.

    Warns
    -----
    AccuracyWarning
        If the posterior piles up at an end of the prior, the method is not accurate there,
        or few samples are simulated for the number of peaks. If profiles and peaks contradict
        each other, with the p-value of `stiction.statistics.agreement`.
    UserWarning
        Beforehand, if the simulation will take more than a minute: how long, and what takes less.

    Notes
    -----
    The likelihood is a kernel density of simulated onsets, combined with the error of the
    load cell. Parameters that only shift and stretch the strength need no simulation: see
    `stiction.inference.scaling` for when the onset follows them exactly. The others are
    simulated on a grid with the same draws everywhere, and interpolated. The posterior is summed
    on a grid, for up to about four parameters; for more, give `log_likelihood` and
    `prior_transform` of the result to emcee or dynesty. After an interruption, or an error in one
    sample, an equal call in the same session goes on with the onsets that are there.

    Mean and scatter between specimens are integrated on a grid, with sixty fields within a
    specimen from the repetitions of the fit: see `stiction.inference.specimens`. The families
    of the factor between specimens are averaged; `families` of the result has their
    probabilities, and `agreement` the comparison of the peaks with the profiles alone.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=0.5)
    >>> peaks = [0.695, 0.702, 0.731, 0.688, 0.715]
    >>> prior = {"marginal.low": (0.5e6, 0.8e6), "marginal.high": (1.2e6, 2.0e6)}
    >>> posterior = st.infer(
    ...     problem, strength, peaks, unit="MPa", prior=prior, method=st.LocalCriterion()
    ... )
    >>> low, high = posterior.interval("marginal.low")
    >>> 0.5e6 < low < high < 0.75e6
    True

    Profiles and peaks of one kind of surface, joined:

    >>> records = strength.sample(problem.interface, samples=3, seed=2)
    >>> fit = st.fit_field(records, problem.interface, marginal="beta", noise=0.0, bootstrap=20)
    >>> both = st.infer(
    ...     problem, fit, peaks, unit="MPa", method=st.LocalCriterion(), samples=100
    ... )
    >>> low, high = both.interval("strength.mean", confidence=0.99)
    >>> 0.9e6 < low < high < 1.1e6
    True
    """
    measured = make_peaks(peaks, unit)
    error = load_cell_error * (1.0 if isinstance(peaks, Peaks | Curves) else factor_of(unit))
    if error > np.concatenate(measured.values).max():
        raise InputError(
            f"load_cell_error: {load_cell_error:g} {unit} is more than the largest peak; it is a"
            " standard deviation in the unit of the peaks"
        )
    if not (prior and {*prior} - {MEAN_KEY, SCATTER_KEY}):
        with _simulating(method, samples, seed, workers, progress) as simulation:
            return join(
                problem, random, measured, simulation, prior=prior, between=between, error=error
            )
    parameters = make_prior(problem, random, prior)
    variable = variable_of(*parameters.at(parameters.middle), measured.unit)
    (experiment,) = experiments_at(parameters, parameters.middle, method)
    experiment.problem.warn_of_units(
        mean_in_stress(experiment.problem, experiment.random, "strength")
    )
    _check_reach(parameters, method, measured, error)
    with _simulating(method, samples, seed, workers, progress) as simulation:

        def likelihood_of(simulation: Simulation, box: Array) -> Likelihood:
            given: Any = {"lengths": measured.lengths, "error": error, "variable": variable}
            return make_likelihood(parameters, simulation, box, **given).of(measured.values)

        whole = box = parameters.whole
        approximate = optional_member(method, "exact_method") is not None
        if not approximate and not no_single_length(experiment.problem, experiment.random):
            local = simulation._replace(method=LocalCriterion(), samples=None)
            box = _first_box(likelihood_of(local, whole))
        while True:
            likelihood = likelihood_of(simulation, box)
            grid = grid_of(likelihood, box)
            u = None if grid is None else grid.draws(POSTERIOR_DRAWS, seed)
            wider = _grown(box, u)
            if np.array_equal(wider, box):
                break
            box = wider
    if np.all(likelihood.box == whole) and (refused := likelihood.refusals()):
        raise InputError(refused)
    if grid is None or u is None:
        raise InputError(
            "peaks: no point of the prior can produce all of them; widen the prior, or give the"
            " load-cell error if they are not exact"
        )
    error = math.sqrt(sum(map(np.size, measured.values)) / likelihood.samples)
    return Posterior(
        peaks=measured,
        draws=dict(zip(parameters.names, parameters.theta(u).T, strict=True)),
        information={name: grid.information(i) for i, name in enumerate(parameters.names)},
        log_evidence=grid.log_evidence,
        monte_carlo_error=error,
        notes=tuple(_notes(likelihood, error, u)),
        likelihood=likelihood,
        u=u,
        seed=seed,
    )


def _check_reach(prior: Prior, method: Any, measured: Peaks, error: float) -> None:
    """Refuse peaks that no method can find anywhere in the prior, such as those in another unit."""
    points = np.array(list(itertools.product(*prior.ends.T)))
    problems = []
    for length, peaks in zip(measured.lengths, measured.values, strict=True):
        experiments = experiments_at(prior, points, method, length)
        reach = [bounds_of(own, measured.variable, NEVER) for own in experiments]
        problems += out_of_reach(prior, points, np.transpose(reach), error, peaks)
    if problems:
        raise InputError(problems)


def _first_box(likelihood: Likelihood) -> Array:
    """Return the box in which the local criterion finds the posterior.

    All of the prior if it cannot produce the peaks: where nodes reach their residual
    strength before the onset, the other methods may.
    """
    grid = None if likelihood.refusals() else grid_of(likelihood, likelihood.box)
    if grid is None:
        return likelihood.box
    room = np.maximum(WIDEN * np.diff(grid.box, axis=0), 1e-3)
    return np.clip(grid.box + room * np.array([[-1.0], [1.0]]), 0.0, 1.0)


def _grown(box: Array, u: Array | None) -> Array:
    """Return the box, wider by its width where draws (draws, parameters) reach its end."""
    width, touched = np.ptp(box, axis=0), np.ones(box.shape, dtype=np.bool_)
    if u is not None:
        low, high = box[0] + BOX_END_SHARE * width, box[1] - BOX_END_SHARE * width
        touched = np.stack([np.mean(u < low, axis=0), np.mean(u > high, axis=0)]) > HELD
    return np.clip(box + width * touched * np.array([[-1.0], [1.0]]), 0.0, 1.0)


def _notes(likelihood: Likelihood, error: float, u: Array) -> list[str]:
    """Return the limitations of the posterior, and issue them as warnings."""
    prior = likelihood.prior
    notes = _piled_up(prior, u)
    middle = prior.theta(u.mean(axis=0, keepdims=True))
    (experiment,) = experiments_at(prior, middle, likelihood.method)
    if text := pilot_doubt(experiment, compare([experiment])):
        notes.append(text)
    if error > TOLERABLE:
        notes.append(
            f"the means are uncertain by about {error:.0%} of their standard deviations because"
            " few samples were simulated at each point; give more samples"
        )
    for text in notes:
        warn_accuracy(text)
    return notes


def _piled_up(prior: Prior, u: Array) -> list[str]:
    """Return the ends of the prior at which draws (draws, parameters) of the posterior pile up."""
    texts = [
        f"the {side} end of {name}, {end:g}, holds {np.mean(near):.0%} of the draws"
        for name, draws, ends in zip(prior.names, u.T, prior.ends.T, strict=True)
        for side, near, end in (
            ("lower", draws < PRIOR_END, ends[0]),
            ("upper", draws > 1.0 - PRIOR_END, ends[1]),
        )
        if np.mean(near) > PILED * PRIOR_END
    ]
    if not texts:
        return []
    return [
        f"the posterior piles up at the ends of the prior: {'; '.join(texts)} within"
        f" {PRIOR_END:.0%} of the prior; check the unit of the peaks, and widen the prior"
        " where its end is a guess"
    ]
