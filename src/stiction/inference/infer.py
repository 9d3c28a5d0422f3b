"""Parameters of a random interface from the peaks of repeated tests."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.criterion.local import LocalCriterion
from stiction.ensemble.limit_state import no_single_length
from stiction.ensemble.pilot import compare, doubt
from stiction.errors import InputError, warn_accuracy
from stiction.inference.grid import Grid, grid_of
from stiction.inference.likelihood import Likelihood, make_model
from stiction.inference.onset_table import experiments_at
from stiction.inference.peaks import Peaks, make_peaks
from stiction.inference.posterior import Posterior, monte_carlo_errors
from stiction.inference.prior import Prior, make_prior
from stiction.load import NotNegative
from stiction.methods import MethodObject
from stiction.model import Progress, at_least, checked
from stiction.problem import Problem
from stiction.profiles.units import factor_to
from stiction.progress import Meter
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.random.stresses import mean_in_stress

DRAWS = 4000
TOLERABLE = 0.25
"""Monte Carlo error over the posterior's standard deviation above which it is reported."""
LOST = 1e-4
"""Mass of the first stage that may be lost on either side of the second."""
WIDEN = 0.3
"""Width of the first posterior that is added to the box of the second on either side."""
NEAR, HELD = 0.05, 1e-3
"""Share of the box at either end, and mass of the posterior there above which the box grows."""
EDGE, PILED = 0.02, 4.0
"""Share of a prior at its ends, and its multiple at which the posterior piles up there."""
RARE = 1e-3
"""Probability of a gap between peaks below which they are probably of two kinds."""


@checked
def infer(
    problem: Problem,
    random: RandomInterface | RandomField,
    peaks: Any,
    *,
    prior: Any,
    method: MethodObject,
    load_cell_error: NotNegative = 0.0,
    unit: str = "Pa",
    samples: at_least(100) | None = None,  # type: ignore[valid-type]
    seed: at_least(0) = 0,  # type: ignore[valid-type]
    progress: Progress = True,
) -> Posterior:
    """Infer parameters of the random strength from the peak stresses of repeated tests.

    Parameters
    ----------
    problem : Problem
        One specimen.
    random : RandomInterface or RandomField
        The random properties with known parameters; `prior` replaces their values.
    peaks : array, mapping of arrays, or Peaks
        Mean shear stress at which each specimen slid, in `unit`; for specimens of several
        lengths a mapping of each length (m) to its peaks, ``{0.1: [...], 0.2: [...]}``,
        with the node spacing of the problem. Or the result of `read_peaks`.
    prior : mapping
        Parameters and the prior of each: a frozen continuous `scipy.stats` distribution, a
        range ``(low, high)``, or ``{"low": ..., "high": ..., "spacing": "log"}``. Priors
        are independent. Keys are those of a sweep: for the strength,
        ``"correlation_length"`` or ``"marginal.low"``; for others,
        ``"residual_strength.marginal.high"`` or ``"problem.friction.weakening_rate"``.
    method : LocalCriterion, Equilibrium or any other
        The method that finds the onset. For all but the local criterion, that one, if applicable,
        first finds the relevant part of the prior, which grows until it contains the posterior.
    load_cell_error : float
        Standard deviation of the error of a peak, in `unit`; with `Peaks` in Pa, or as a
        coefficient.
    unit : str
        Unit of peaks and load-cell error: a unit of stress, or "1" for friction
        coefficients, which need ``Load(normal_pressure=...)``.
    samples : int, optional
        Simulated specimens at each point: by default 2000 by the local criterion, 500 by
        equilibrium.
    seed : int
        Not negative. The same samples are used at every point, so that the likelihood is smooth.
    progress : bool or callable
        As in `monte_carlo`.

    Returns
    -------
    Posterior
        With `draws`, `mean`, `interval`, `information` (nats) and `to_arviz()`;
        `stiction.plot.posterior` draws it.

    Raises
    ------
    InputError
        If any argument is invalid, or no parameters in the prior can produce the peaks; the
        message then names the bound that must move.

    Warns
    -----
    AccuracyWarning
        If the posterior piles up at an end of the prior, the number of simulated samples
        matters, or the peaks fall into groups that one population does not show.

    Notes
    -----
    The likelihood is a kernel density of simulated onsets, combined with the error of the
    load cell. Parameters that only shift and stretch the strength need no simulation: see
    `stiction.inference.scaling` for when the onset follows them exactly. The others are
    simulated on a grid with the same draws everywhere, and interpolated. The posterior is
    summed on a grid that closes in on it, for up to four parameters or so; for more, give
    `log_likelihood` and `prior_transform` of the result to emcee or dynesty.

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
    """
    measured = make_peaks(peaks, unit)
    parameters = make_prior(problem, random, prior)
    pressed = problem.load.normal_pressure is not None
    pressed = pressed or "normal_pressure" in parameters.random.names
    if measured.coefficients and not pressed:
        raise InputError(
            "peaks: are coefficients of friction, which need a normal pressure: give"
            " Load(normal_pressure=...) in Pa, or peaks as stresses with their unit"
        )
    si = "1" if measured.coefficients else "Pa"
    error = load_cell_error * (1.0 if isinstance(peaks, Peaks) else factor_to(si, unit))
    if error > np.concatenate(measured.values).max():
        raise InputError(
            f"load_cell_error: {load_cell_error:g} {unit} is more than the largest peak; it is a"
            " standard deviation in the unit of the peaks"
        )
    options: dict[str, Any] = {"lengths": measured.lengths, "variable": measured.variable}
    with Meter("infer", show=progress) as meter:
        options |= {"error": error, "seed": seed, "meter": meter}
        (own,) = experiments_at(parameters, parameters.middle[None], method)
        own.problem.warn_of_units(mean_in_stress(own.problem, own.random, "strength"))
        likelihood, grid = _located(parameters, method, measured, samples, options)
        return _posterior(likelihood, grid, measured, seed, meter)


def _located(
    prior: Prior, method: Any, peaks: Peaks, samples: int | None, options: Mapping[str, Any]
) -> tuple[Likelihood, Grid]:
    """Return the likelihood in a box of the prior that holds the posterior, and the posterior."""
    zero, one = np.zeros(prior.dimension), np.ones(prior.dimension)
    low, high = zero, one
    if method.type != "local_criterion" and not no_single_length(*prior.at(prior.middle)):
        low, high = _first_box(prior, peaks, options)
    while True:
        model = make_model(prior, method=method, samples=samples, low=low, high=high, **options)
        likelihood = Likelihood(model, peaks.values)
        whole = bool(np.all(low == 0.0) and np.all(high == 1.0))
        if whole and (refused := _out_of_reach(likelihood)[1]):
            raise InputError(refused)
        options["meter"].stage("posterior")
        grid = grid_of(likelihood.__call__, low, high, options["meter"])
        if grid is None and whole:
            raise InputError(
                "peaks: no point of the prior can produce all of them; widen the prior, or give"
                " the load-cell error if they are not exact"
            )
        if grid is None:
            low, high = zero, one
            continue
        old, (low, high) = (low, high), grown(grid, low, high)
        if np.array_equal(old, (low, high)):
            return likelihood, grid


def _first_box(prior: Prior, peaks: Peaks, options: Mapping[str, Any]) -> tuple[Array, Array]:
    """Return corners, as u, between which the local criterion finds the posterior.

    All of the prior if it cannot produce the peaks: where nodes reach their residual strength
    before the onset, the other methods may.
    """
    low, high = np.zeros(prior.dimension), np.ones(prior.dimension)
    model = make_model(prior, method=LocalCriterion(), samples=None, **options)
    likelihood = Likelihood(model, peaks.values)
    outside, refused = _out_of_reach(likelihood)
    if outside.all():  # their unit is wrong, say
        raise InputError(refused)
    grid = None if refused else grid_of(likelihood.__call__, low, high, options["meter"])
    if grid is None:
        return low, high
    for axis in range(prior.dimension):
        mass, centres = np.cumsum(grid.marginal(axis)), grid.centres(axis)
        ends = np.searchsorted(mass, [LOST, 1.0 - LOST])
        first, last = centres[np.minimum(ends, centres.size - 1)]
        room = max(WIDEN * (last - first), 1e-3)
        low[axis], high[axis] = max(0.0, first - room), min(1.0, last + room)
    return low, high


def _out_of_reach(likelihood: Likelihood) -> tuple[NDArray[np.bool_], list[str]]:
    """Return the peaks that no parameters in the prior can produce, with the error messages."""
    masks, texts = [], []
    for number, peaks in enumerate(likelihood.peaks):
        low, high, places = likelihood.model.reach(number)
        far = (peaks < low) | (peaks > high)
        masks.append(far)
        for value in peaks[far][:1]:
            texts.append(
                f"peaks: {far.sum()} of {far.size} are out of reach, such as {value:g}, which lies"
                f" {'below' if value < low else 'above'} all that the prior can produce, {low:g} to"
                f" {high:g} ({places}); widen the prior, check the unit, or leave out tests of"
                " another kind of specimen"
            )
    return np.concatenate(masks), texts


def grown(grid: Grid, low: Array, high: Array) -> tuple[Array, Array]:
    """Return the box, wider by its width on each side where the posterior reaches its end."""
    new_low, new_high = low.copy(), high.copy()
    for axis, width in enumerate(high - low):
        mass, centres = grid.marginal(axis), grid.centres(axis)
        if mass[centres < low[axis] + NEAR * width].sum() > HELD:
            new_low[axis] = max(0.0, low[axis] - width)
        if mass[centres > high[axis] - NEAR * width].sum() > HELD:
            new_high[axis] = min(1.0, high[axis] + width)
    return new_low, new_high


def _posterior(
    likelihood: Likelihood, grid: Grid, peaks: Peaks, seed: int, meter: Meter
) -> Posterior:
    prior = likelihood.model.prior
    u = grid.draws(DRAWS, seed)
    meter.stage("Monte Carlo error")
    errors = monte_carlo_errors(likelihood, u[::2]).tolist()
    theta = prior.theta(u)
    posterior = Posterior(
        peaks=peaks,
        draws={name: theta[:, i] for i, name in enumerate(prior.names)},
        information={name: grid.information(i) for i, name in enumerate(prior.names)},
        total_information=grid.gain,
        log_evidence=grid.log_evidence,
        monte_carlo_error=dict(zip(prior.names, errors, strict=True)),
        notes=_notes(likelihood, errors, u),
        likelihood=likelihood,
        u=u,
        seed=seed,
    )
    _check_agreement(peaks, posterior.predicted)
    return posterior


def _notes(likelihood: Likelihood, errors: Sequence[float], u: Array) -> tuple[str, ...]:
    """Return the limitations of the posterior; serious ones are also issued as warnings."""
    model = likelihood.model
    notes = _piled_up(model.prior, u)
    middle = model.prior.theta(u.mean(axis=0, keepdims=True))
    (experiment,) = experiments_at(model.prior, middle, model.method)
    pilot = compare(experiment)
    if pilot and (text := doubt(pilot)):
        notes.append(text)
    if max(errors) > TOLERABLE:
        worst = model.prior.names[np.argmax(errors)]
        samples = model.specimens[0].onsets.shape[1]
        notes.append(
            f"the mean of {worst} is uncertain by {max(errors):.0%} of its standard deviation"
            f" because only {samples} samples were simulated at each point; give more samples"
        )
    for text in notes:
        warn_accuracy(text)
    if model.scaling.reason:
        notes.append(f"every parameter was simulated: {model.scaling.reason}")
    return tuple(notes)


def _piled_up(prior: Prior, u: Array) -> list[str]:
    """Return the ends of the prior at which draws (draws, parameters) of the posterior pile up.

    The simulated box needs no such check: it grew until it held the posterior.
    """
    texts = [
        f"the {side} end of {name}, {end:g}, holds {np.mean(near):.0%} of the draws"
        for name, own, ends in zip(prior.names, u.T, prior.ends.T, strict=True)
        for side, near, end in (
            ("lower", own < EDGE, ends[0]),
            ("upper", own > 1.0 - EDGE, ends[1]),
        )
        if np.mean(near) > PILED * EDGE
    ]
    if not texts:
        return []
    return [
        f"the posterior piles up at the ends of the prior: {'; '.join(texts)} within {EDGE:.0%} of"
        " the prior; check the unit of the peaks, and widen the prior where its end is a guess"
    ]


def _check_agreement(peaks: Peaks, predicted: Sequence[Array]) -> None:
    """Warn of a gap between peaks that is unlikely for one population.

    The largest gap between neighbours, in terms of the predicted distribution; the chance of one
    so large among n uniform numbers is at most (n - 1) (1 - gap)^n.
    """
    for values, own in zip(peaks.values, predicted, strict=True):
        ordered = np.sort(values)
        gaps = np.diff(np.searchsorted(np.sort(own), ordered) / own.size)
        widest = float(gaps.max(initial=0.0))
        chance = (ordered.size - 1) * (1.0 - widest) ** ordered.size
        if gaps.size and chance < RARE:
            first, second = ordered[gaps.argmax() :][:2]
            warn_accuracy(
                f"peaks: none lies between {first:g} and {second:g}, where {widest:.0%} are"
                f" expected (probability {chance:.1g}): are two kinds of specimens mixed?"
            )
