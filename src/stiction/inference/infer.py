"""Parameters of a random interface from the peaks of repeated tests."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from stiction._checks import check_choice, check_count, check_progress, is_finite
from stiction.arrays import Array
from stiction.criterion.local import LocalCriterion
from stiction.errors import InputError, warn_accuracy
from stiction.inference.agreement import check_agreement, check_reach, piled_up
from stiction.inference.ensemble_sampler import by_walkers
from stiction.inference.grid import Grid, on_grid
from stiction.inference.likelihood import (
    Likelihood,
    Model,
    local_refused,
    make_likelihood,
    make_model,
    varies,
)
from stiction.inference.peaks import Peaks, make_peaks
from stiction.inference.posterior import BINS, Posterior, monte_carlo_errors
from stiction.inference.prior import Prior, make_prior
from stiction.methods import Method, check_method
from stiction.model import describe
from stiction.problem import Problem
from stiction.progress import Meter, Show
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface
from stiction.units import factor_to

DRAWS = 4000
TOLERABLE = 0.25
"""Monte Carlo error as a share of the posterior's standard deviation that goes without saying."""
EDGE = 1e-4
"""Mass of the first stage that may be lost on either side of the second."""
WIDEN = 0.3


def infer(
    problem: Problem,
    random: RandomInterface | RandomField,
    peaks: Any,
    *,
    prior: Mapping[str, Any],
    method: Method,
    load_cell_error: float = 0.0,
    positions: Any = None,
    unit: str = "Pa",
    sampler: Literal["grid", "emcee"] = "grid",
    samples: int | None = None,
    seed: int = 0,
    progress: Show = True,
) -> Posterior:
    """What do the peak stresses of repeated tests tell of the random strength?

    Parameters
    ----------
    problem : Problem
        One specimen.
    random : RandomInterface or RandomField
        What is random, with its known parameters; what it says of those in `prior` is not used.
    peaks : array, mapping of arrays, or Peaks
        Mean shear stress at which each specimen slid, in `unit`; for specimens of several lengths
        a mapping of each length (m) to its peaks, ``{0.1: [...], 0.2: [...]}``, with the node
        distance of the problem. Or from `read_peaks`.
    prior : mapping
        Parameters and what was thought of each before: a frozen continuous `scipy.stats`
        distribution, a range ``(low, high)``, or ``{"low": ..., "high": ..., "spacing": "log"}``;
        they are independent. Keys are those of a sweep. Of the strength, ``"correlation_length"``
        and ``"marginal.low"`` will do; others are ``"residual_strength.marginal.high"`` or
        ``"problem.friction.weakening_rate"``.
    method : LocalCriterion, Equilibrium or any other
        How the onset is found. For all but the local criterion that one, where it holds, first
        finds the part of the prior that matters.
    load_cell_error : float
        Standard deviation of the error of a peak, in `unit`; with `Peaks` in Pa, or as a
        coefficient.
    positions : array or mapping of arrays, optional
        Where slip began in each test, m; NaN where it was not seen. It tells something only where
        load or friction vary along the interface.
    unit : str
        Of peaks and load-cell error: that of a stress, or "1" for coefficients of friction, which
        need ``Load(normal_pressure=...)``.
    sampler : {"grid", "emcee"}
        Sums on a grid that closes in, for up to four parameters or so; or emcee's walkers.
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
        With `draws`, `mean`, `interval`, `information` (nats), `to_arviz()` and `plot()`.

    Raises
    ------
    InputError
        Naming all that does not fit; peaks that nothing in the prior can produce, with the bound
        that would have to move.

    Warns
    -----
    AccuracyWarning
        If affine scaling does not hold and every parameter is simulated; the posterior piles up at
        an end of the prior; the number of simulated samples matters; or the peaks fall into
        groups that one population does not show.

    Notes
    -----
    The likelihood is a kernel density of simulated onsets, joined with the error of the load cell.
    Parameters that only shift and stretch the strength need no simulation: see
    `stiction.inference.affine` for when the onset follows them exactly. The others are simulated
    on a grid with the same draws everywhere, and interpolated.

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
    check_progress(progress)
    check_method(method)
    check_choice("sampler", sampler, ("grid", "emcee"))
    seed = check_count("seed", seed, 0)
    if samples is not None:
        samples = check_count("samples", samples, 100)
    measured = make_peaks(peaks, positions, unit)
    error = _load_cell(load_cell_error, unit, measured, si=isinstance(peaks, Peaks))
    parameters = make_prior(problem, random, prior)
    check_pressure(parameters, measured)
    options: dict[str, Any] = {
        "lengths": measured.lengths,
        "error": error,
        "samples": samples,
        "seed": seed,
        "variable": measured.variable,
        "scaling": not (varies(problem) and any(p is not None for p in measured.positions)),
    }
    with Meter("infer", show=progress) as meter:
        _, middle = parameters.at(parameters.theta(np.full((1, parameters.dimension), 0.5))[0])
        problem.warn_of_units(middle.strength.mean)
        model, found = _modelled(parameters, method, measured, options, meter)
        likelihood = make_likelihood(model, measured.values, measured.positions)
        if found is None:
            check_reach(likelihood)
        return _posterior(likelihood, measured, sampler, seed, meter)


def _load_cell(given: Any, unit: str, peaks: Peaks, si: bool) -> float:
    """The load-cell error in the unit of the checked peaks."""
    if not (is_finite(given) and given >= 0.0):
        raise InputError(
            f"load_cell_error: must be a standard deviation >= 0 in {unit}, got {describe(given)}"
        )
    factor = 1.0 if si else factor_to("1" if peaks.coefficients else "Pa", unit)
    error = float(given) * factor
    values = np.concatenate(peaks.values)
    if error > values.max():
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


def _modelled(
    prior: Prior, method: Any, peaks: Peaks, options: dict[str, Any], meter: Meter
) -> tuple[Model, Grid | None]:
    """The model by a method; where it is dear, on the part of the prior that matters."""
    if method.type == "local_criterion" or local_refused(prior):
        return make_model(prior, method=method, meter=meter, **options), None
    first = make_model(prior, method=LocalCriterion(), meter=meter, **(options | {"samples": None}))
    likelihood = make_likelihood(first, peaks.values, [None] * len(peaks.values))
    check_reach(likelihood)
    grid = on_grid(likelihood, meter)
    low, high = region(grid)
    model = make_model(prior, method=method, meter=meter, low=low, high=high, **options)
    return model, grid


def region(grid: Grid) -> tuple[Array, Array]:
    """The box, as u, that holds a posterior with room for one that is a little elsewhere."""
    low, high = [], []
    for axis in range(grid.mass.ndim):
        mass = np.cumsum(grid.marginal(axis))
        centres = grid.centres(axis)
        first = float(centres[int(np.searchsorted(mass, EDGE))])
        last = float(centres[min(int(np.searchsorted(mass, 1.0 - EDGE)), centres.size - 1)])
        room = max(WIDEN * (last - first), 1e-3)
        low.append(max(0.0, first - room))
        high.append(min(1.0, last + room))
    return np.array(low), np.array(high)


def _posterior(
    likelihood: Likelihood, peaks: Peaks, sampler: str, seed: int, meter: Meter
) -> Posterior:
    model = likelihood.model
    prior = model.prior
    diagnostics: dict[str, float] = {}
    total = evidence = float("nan")
    meter.stage("posterior")
    if sampler == "grid":
        grid = on_grid(likelihood, meter)
        u = grid.draws(DRAWS, seed)[None]
        information = {name: grid.information(i) for i, name in enumerate(prior.names)}
        total, evidence = grid.gain, grid.log_evidence
    else:
        u, diagnostics = by_walkers(likelihood, meter, seed)
        information = {name: divergence(u[..., i].ravel()) for i, name in enumerate(prior.names)}
    meter.stage("Monte Carlo error")
    flat = u.reshape(-1, prior.dimension)
    few = flat[:: max(1, flat.shape[0] // 2000)]
    errors = dict(zip(prior.names, map(float, monte_carlo_errors(likelihood, few)), strict=True))
    theta = prior.theta(flat).reshape(u.shape)
    posterior = Posterior(
        names=prior.names,
        draws={name: theta[..., i] for i, name in enumerate(prior.names)},
        information=information,
        total_information=total,
        log_evidence=evidence,
        monte_carlo_error=errors,
        sampler=sampler,
        method=model.method.label,
        peaks=peaks,
        notes=_notes(likelihood, errors, flat),
        likelihood=likelihood,
        u=u,
        seed=seed,
        diagnostics=diagnostics,
    )
    check_agreement(peaks, posterior.predicted)
    return posterior


def _notes(likelihood: Likelihood, errors: Mapping[str, float], u: Array) -> tuple[str, ...]:
    """What has to be said of the posterior; what is serious is a warning as well."""
    model = likelihood.model
    notes = []
    worst = max(errors, key=lambda name: errors[name])
    serious = [piled_up(model, u)]
    if errors[worst] > TOLERABLE:
        samples = model.specimens[0].table.peaks.shape[1]
        serious.append(
            f"the mean of {worst} is uncertain by {errors[worst]:.0%} of its standard deviation"
            f" because only {samples} samples were simulated at each point; give more samples"
        )
    for text in filter(None, serious):
        warn_accuracy(text)
        notes.append(text)
    if model.affine.reason:
        notes.append(f"every parameter was simulated: {model.affine.reason}")
    return tuple(notes)


def divergence(u: Array) -> float:
    """Divergence of draws in [0, 1] from the uniform distribution, nats, by a histogram.

    With the correction of Miller and Madow for the number of draws.
    """
    counts = np.histogram(u, bins=BINS, range=(0.0, 1.0))[0]
    share = counts[counts > 0] / counts.sum()
    bias = (share.size - 1) / (2.0 * counts.sum())
    return max(0.0, float(np.sum(share * np.log(share * BINS))) - bias)
