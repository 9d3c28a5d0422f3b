"""The posterior by emcee's ensemble of walkers: for more parameters than a grid can hold."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.inference.likelihood import Likelihood
from stiction.progress import Meter

WALKERS = 32
STEPS = 3000
SEARCH = 4096
"""Points of the prior among which the walkers begin, by their likelihood."""
ENOUGH = 50.0
"""Steps over autocorrelation time from which on emcee calls a chain long enough."""


def by_walkers(likelihood: Likelihood, meter: Meter, seed: int) -> tuple[Array, dict[str, float]]:
    """Draws from the posterior as u, (walkers, steps, parameters), and what to judge them by.

    Foreman-Mackey et al. (2013), emcee; half of its moves are differential evolution (ter Braak,
    2006), which follows ridges better than the stretch move alone.

    Raises
    ------
    InputError
        If emcee is not installed.
    """
    try:
        import emcee
    except ImportError:
        raise InputError(
            "sampler: 'emcee' needs the package emcee; pip install 'stiction[inference]', or use"
            " sampler = 'grid'"
        ) from None
    model = likelihood.model
    dimension = model.prior.dimension
    rng = np.random.default_rng(seed)
    search = model.low + (model.high - model.low) * rng.random((SEARCH, dimension))
    values = likelihood(search)
    weights = np.exp(values - values.max())
    walkers = max(WALKERS, 4 * dimension)
    chosen = rng.choice(SEARCH, walkers, p=weights / weights.sum())
    spread = 0.01 * (model.high - model.low)
    start = search[chosen] + spread * rng.standard_normal((walkers, dimension))
    start = np.clip(start, model.low + 1e-3 * spread, model.high - 1e-3 * spread)

    moves = [(emcee.moves.StretchMove(), 0.5), (emcee.moves.DEMove(), 0.5)]
    sampler: Any = emcee.EnsembleSampler(
        walkers, dimension, likelihood, vectorize=True, moves=moves
    )
    sampler._random = np.random.RandomState(int(rng.integers(2**32)))  # its only way to seed
    meter.stage("emcee", STEPS)
    for _ in sampler.sample(start, iterations=STEPS):
        meter.advance()
    time = sampler.get_autocorr_time(tol=0)
    slowest = float(np.max(time)) if np.isfinite(time).all() else STEPS / 2.0
    if ENOUGH * slowest > STEPS:
        warn_accuracy(
            f"emcee: {STEPS} steps are only {STEPS / slowest:.0f} autocorrelation times; quantiles"
            f" are uncertain by about {1.0 / np.sqrt(walkers * STEPS / slowest):.1%} of their rank"
        )
    begin = min(STEPS // 2, round(5.0 * slowest))
    thin = max(1, round(0.5 * slowest))
    chain = sampler.get_chain(discard=begin, thin=thin)
    diagnostics = {
        "autocorrelation_time": slowest,
        "acceptance": float(np.mean(sampler.acceptance_fraction)),
    }
    return np.swapaxes(chain, 0, 1), diagnostics
