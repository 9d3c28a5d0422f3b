"""Whether a prior can produce the peaks, and whether posterior and peaks look as they should."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from stiction.arrays import Array
from stiction.errors import warn_accuracy
from stiction.inference.likelihood import Likelihood, Model
from stiction.inference.onset_table import nodes_of
from stiction.inference.peaks import Peaks

BEYOND = 2.0
"""Spreads beyond the extremes of all simulated peaks from which on a peak is out of reach."""
ERRORS = 5.0
"""Standard deviations of the load cell beyond that."""
EDGE, PILED = 0.02, 4.0
"""Share of a prior at its ends, and how many times that of the posterior is piled up there."""
RARE = 1e-3
_FACTORS = {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9}


def reach(model: Model, number: int) -> tuple[Array, Array, Array]:
    """Points of the prior, and the least and greatest peak of specimen `number` at each.

    The points are the nodes with all corners of the parameters that scale.
    """
    own, keys = model.specimens[number], list(model.scaling.keys)
    ends = model.prior.theta(np.stack([model.low, model.high]))[:, keys]
    nodes = nodes_of(model.axes, model.scaling.reference)
    spread = BEYOND * own.peaks.std(axis=1)
    lowest = np.maximum(own.peaks.min(axis=1) - spread, own.densities.bound)
    highest = own.peaks.max(axis=1) + spread
    points, least, most = [], [], []
    for corner in itertools.product(*ends.T):
        theta = nodes.copy()
        theta[:, keys] = corner
        shift, stretch = model.scaling.of(theta)
        points.append(theta)
        least.append(shift + stretch * lowest - ERRORS * model.error)
        most.append(shift + stretch * highest + ERRORS * model.error)
    return np.concatenate(points), np.concatenate(least), np.concatenate(most)


def none_within_reach(likelihood: Likelihood) -> bool:
    """Whether the prior can produce not a single one of the peaks: their unit is wrong, say."""
    for number, peaks in enumerate(likelihood.peaks):
        _, least, most = reach(likelihood.model, number)
        if np.any((peaks >= least.min()) & (peaks <= most.max())):
            return False
    return True


def out_of_reach(likelihood: Likelihood) -> list[str]:
    """Errors about peaks that nothing in the prior can produce."""
    model = likelihood.model
    problems = []
    for number, peaks in enumerate(likelihood.peaks):
        theta, least, most = reach(model, number)
        low, high = float(least.min()), float(most.max())
        for value, side, outside, at in (
            (peaks.min(), "below", peaks < low, least.argmin()),
            (peaks.max(), "above", peaks > high, most.argmax()),
        ):
            if outside.any():
                more = f" (and {outside.sum() - 1} more do)" if outside.sum() > 1 else ""
                end = "lowest" if side == "below" else "highest"
                problems.append(
                    f"peaks: {value:g} lies {side} all that the prior can produce, {low:g} to"
                    f" {high:g}{more}; the {end} come from {model.prior.text(theta[at])}: widen"
                    f" the prior there{_unit(model, peaks, low, high)}, or this peak comes from"
                    " another kind of specimen"
                )
    return problems


def _unit(model: Model, peaks: Array, low: float, high: float) -> str:
    """Whether another unit would bring the peaks to where the prior has them."""
    middle = float(np.median(peaks))
    for unit, factor in _FACTORS.items():
        if low <= middle * factor <= high:
            return f", or give unit = {unit!r}"
    pressure = model.prior.problem.load.normal_pressure
    if pressure is not None and low <= middle * float(np.mean(pressure)) <= high:
        return ", or give unit = '1' if these are coefficients of friction"
    return ""


def piled_up(model: Model, u: Array) -> str:
    """Where draws (draws, parameters) of the posterior pile up at an end of the prior, or nothing.

    The box that was simulated needs no such look: it grew until it held the posterior.
    """
    texts = []
    ends = model.prior.theta(np.array([[0.0] * u.shape[1], [1.0] * u.shape[1]]))
    for i, name in enumerate(model.prior.names):
        for side, near, end in (
            ("lower", u[:, i] < EDGE, ends[0, i]),
            ("upper", u[:, i] > 1.0 - EDGE, ends[1, i]),
        ):
            if near.mean() > PILED * EDGE:
                texts.append(f"the {side} end of {name}, {end:g}, holds {near.mean():.0%} of it")
    if not texts:
        return ""
    return (
        f"the posterior piles up at the ends of the prior: {'; '.join(texts)} within {EDGE:.0%} of"
        " the prior; where such an end is a guess, so is the result"
    )


def check_agreement(peaks: Peaks, predicted: Sequence[Array]) -> None:
    """Warn of peaks with a gap among them that one population would hardly show.

    The largest gap between neighbours, in terms of the predicted distribution; the chance of one
    so large among n uniform numbers is at most (n - 1) (1 - gap)^n.
    """
    for length, values, own in zip(peaks.lengths, peaks.values, predicted, strict=True):
        ordered = np.sort(values)
        gaps = np.diff(np.searchsorted(np.sort(own), ordered) / own.size)
        widest = float(gaps.max(initial=0.0))
        chance = (ordered.size - 1) * (1.0 - widest) ** ordered.size
        if gaps.size and chance < RARE:
            place = int(gaps.argmax())
            at = "" if length is None else f" at {length:g} m"
            warn_accuracy(
                f"peaks{at}: none lies between {ordered[place]:g} and {ordered[place + 1]:g},"
                f" where {widest:.0%} are expected (probability {chance:.1g}): are two kinds of"
                " specimens mixed?"
            )
