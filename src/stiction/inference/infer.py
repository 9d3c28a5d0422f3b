"""Parameters of a random interface from the peaks of repeated tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.criterion.local import LocalCriterion
from stiction.ensemble.pilot import ON_A_LINE, compare, doubt
from stiction.errors import InputError, warn_accuracy
from stiction.inference.grid import Grid, on_grid
from stiction.inference.likelihood import Likelihood, local_refused, make_model
from stiction.inference.onset_table import experiments_at
from stiction.inference.peaks import Peaks, make_peaks
from stiction.inference.plausibility import (
    check_agreement,
    none_within_reach,
    out_of_reach,
    piled_up,
)
from stiction.inference.posterior import Posterior, monte_carlo_errors
from stiction.inference.prior import Prior, make_prior
from stiction.load import NotNegative
from stiction.methods import MethodObject
from stiction.model import Progress, at_least, checked
from stiction.problem import Problem
from stiction.progress import Meter
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.units import factor_to

DRAWS = 4000
TOLERABLE = 0.25
"""Monte Carlo error over the posterior's standard deviation above which it is reported."""
LOST = 1e-4
"""Mass of the first stage that may be lost on either side of the second."""
WIDEN = 0.3
"""Width of the first posterior that is added to the box of the second on either side."""
NEAR, HELD = 0.05, 1e-3
"""Share of the box at either end, and mass of the posterior there above which the box grows."""


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
        What is random, with its known parameters; its values of those in `prior` are not used.
    peaks : array, mapping of arrays, or Peaks
        Mean shear stress at which each specimen slid, in `unit`; for specimens of several lengths
        a mapping of each length (m) to its peaks, ``{0.1: [...], 0.2: [...]}``, with the node
        distance of the problem. Or from `read_peaks`.
    prior : mapping
        Parameters and the prior of each: a frozen continuous `scipy.stats` distribution, a range
        ``(low, high)``, or ``{"low": ..., "high": ..., "spacing": "log"}``; they are independent.
        Keys are those of a sweep. Of the strength, ``"correlation_length"`` and
        ``"marginal.low"`` will do; others are ``"residual_strength.marginal.high"`` or
        ``"problem.friction.weakening_rate"``.
    method : LocalCriterion, Equilibrium or any other
        How the onset is found. For all but the local criterion that one, where it holds, first
        finds the part of the prior that matters, which grows until it holds the posterior.
    load_cell_error : float
        Standard deviation of the error of a peak, in `unit`; with `Peaks` in Pa, or as a
        coefficient.
    unit : str
        Of peaks and load-cell error: that of a stress, or "1" for coefficients of friction, which
        need ``Load(normal_pressure=...)``.
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
        Naming all that does not fit; peaks that nothing in the prior can produce, with the bound
        that would have to move.

    Warns
    -----
    AccuracyWarning
        If the posterior piles up at an end of the prior; the number of simulated samples matters;
        or the peaks fall into groups that one population does not show.

    Notes
    -----
    The likelihood is a kernel density of simulated onsets, joined with the error of the load cell.
    Parameters that only shift and stretch the strength need no simulation: see
    `stiction.inference.scaling` for when the onset follows them exactly. The others are simulated
    on a grid with the same draws everywhere, and interpolated. The posterior is summed on a grid
    that closes in on it, for up to four parameters or so; for more, give `log_likelihood` and
    `prior_transform` of the result to emcee or dynesty.

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
    check_pressure(parameters, measured)
    options: dict[str, Any] = {
        "lengths": measured.lengths,
        "error": _load_cell(load_cell_error, unit, measured, si=isinstance(peaks, Peaks)),
        "seed": seed,
        "variable": measured.variable,
    }
    with Meter("infer", show=progress) as meter:
        middle = parameters.theta(np.full((1, parameters.dimension), 0.5))
        (own,) = experiments_at(parameters, middle, method)
        own.problem.warn_of_units(own.mean("strength"))
        likelihood, grid = _located(parameters, method, measured, samples, options, meter)
        return _posterior(likelihood, grid, measured, seed, method, meter)


def _load_cell(given: float, unit: str, peaks: Peaks, si: bool) -> float:
    """The load-cell error in the unit of the checked peaks."""
    factor = 1.0 if si else factor_to("1" if peaks.coefficients else "Pa", unit)
    error = given * factor
    if error > np.concatenate(peaks.values).max():
        raise InputError(
            f"load_cell_error: {given:g} {unit} is more than the largest peak; it is a standard"
            " deviation in the unit of the peaks"
        )
    return error


def check_pressure(prior: Prior, peaks: Peaks) -> None:
    """Refuse coefficients of friction where no normal pressure is known."""
    known = prior.problem.load.normal_pressure is not None
    if peaks.coefficients and not known and "normal_pressure" not in prior.random.names:
        raise InputError(
            "peaks: are coefficients of friction, which need a normal pressure: give"
            " Load(normal_pressure=...) in Pa, or peaks as stresses with their unit"
        )


def _located(
    prior: Prior,
    method: Any,
    peaks: Peaks,
    samples: int | None,
    options: Mapping[str, Any],
    meter: Meter,
) -> tuple[Likelihood, Grid]:
    """The likelihood in a box of the prior that holds the posterior, and the posterior."""
    low, high = np.zeros(prior.dimension), np.ones(prior.dimension)
    if method.type != "local_criterion" and not local_refused(prior):
        low, high = _first_box(prior, peaks, options, meter)
    while True:
        model = make_model(
            prior, method=method, samples=samples, low=low, high=high, meter=meter, **options
        )
        likelihood = Likelihood(model, peaks.values)
        whole = bool(np.all(low == 0.0) and np.all(high == 1.0))
        if whole and (problems := out_of_reach(likelihood)):
            raise InputError(problems)
        meter.stage("posterior")
        grid = on_grid(likelihood, meter)
        if grid is None and whole:
            raise InputError(
                "peaks: no point of the prior can produce all of them; widen the prior, or give"
                " the load-cell error if they are not exact"
            )
        new_low, new_high = (0.0 * low, 0.0 * low + 1.0) if grid is None else grown(grid, low, high)
        if grid is not None and np.all(new_low == low) and np.all(new_high == high):
            return likelihood, grid
        low, high = new_low, new_high


def _first_box(
    prior: Prior, peaks: Peaks, options: Mapping[str, Any], meter: Meter
) -> tuple[Array, Array]:
    """Corners, as u, between which the local criterion finds the posterior.

    All of the prior if it cannot produce the peaks: where nodes reach their residual strength
    before the onset, the other methods may.
    """
    model = make_model(prior, method=LocalCriterion(), samples=None, meter=meter, **options)
    likelihood = Likelihood(model, peaks.values)
    problems = out_of_reach(likelihood)
    if none_within_reach(likelihood):
        raise InputError(problems)
    grid = None if problems else on_grid(likelihood, meter)
    if grid is None:
        return np.zeros(prior.dimension), np.ones(prior.dimension)
    low, high = [], []
    for axis in range(prior.dimension):
        mass, centres = np.cumsum(grid.marginal(axis)), grid.centres(axis)
        first = float(centres[np.searchsorted(mass, LOST)])
        end = min(int(np.searchsorted(mass, 1.0 - LOST)), centres.size - 1)
        last = float(centres[end])
        room = max(WIDEN * (last - first), 1e-3)
        low.append(max(0.0, first - room))
        high.append(min(1.0, last + room))
    return np.array(low), np.array(high)


def grown(grid: Grid, low: Array, high: Array) -> tuple[Array, Array]:
    """The box, wider by its width on each side where the posterior reaches its end."""
    new_low, new_high = low.copy(), high.copy()
    for axis, width in enumerate(high - low):
        mass, centres = grid.marginal(axis), grid.centres(axis)
        if mass[centres < low[axis] + NEAR * width].sum() > HELD:
            new_low[axis] = max(0.0, low[axis] - width)
        if mass[centres > high[axis] - NEAR * width].sum() > HELD:
            new_high[axis] = min(1.0, high[axis] + width)
    return new_low, new_high


def _posterior(
    likelihood: Likelihood, grid: Grid, peaks: Peaks, seed: int, method: Any, meter: Meter
) -> Posterior:
    model = likelihood.model
    prior = model.prior
    u = grid.draws(DRAWS, seed)
    meter.stage("Monte Carlo error")
    errors = dict(zip(prior.names, monte_carlo_errors(likelihood, u[::2]).tolist(), strict=True))
    theta = prior.theta(u)
    posterior = Posterior(
        names=prior.names,
        draws={name: theta[:, i] for i, name in enumerate(prior.names)},
        information={name: grid.information(i) for i, name in enumerate(prior.names)},
        total_information=grid.gain,
        log_evidence=grid.log_evidence,
        monte_carlo_error=errors,
        method=model.method.label,
        peaks=peaks,
        notes=_notes(likelihood, errors, u, method),
        likelihood=likelihood,
        u=u,
        seed=seed,
    )
    check_agreement(peaks, posterior.predicted)
    return posterior


def _notes(
    likelihood: Likelihood, errors: Mapping[str, float], u: Array, method: Any
) -> tuple[str, ...]:
    """What limits the posterior; what is serious is a warning as well."""
    model = likelihood.model
    worst = max(errors, key=lambda name: errors[name])
    serious: list[str | None] = [piled_up(model, u)]
    middle = model.prior.theta(u.mean(axis=0, keepdims=True))
    (experiment,) = experiments_at(model.prior, middle, method)
    if pilot := compare(experiment, experiment.draws(0, 0, ON_A_LINE)):
        serious.append(doubt(pilot))
    if errors[worst] > TOLERABLE:
        samples = model.specimens[0].onsets.shape[1]
        serious.append(
            f"the mean of {worst} is uncertain by {errors[worst]:.0%} of its standard deviation"
            f" because only {samples} samples were simulated at each point; give more samples"
        )
    notes = [text for text in serious if text]
    for text in notes:
        warn_accuracy(text)
    if model.scaling.reason:
        notes.append(f"every parameter was simulated: {model.scaling.reason}")
    return tuple(notes)
