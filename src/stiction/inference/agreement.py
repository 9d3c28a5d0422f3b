"""Can the prior produce these peaks, does the posterior pile up, do the peaks look alike?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.inference.likelihood import Likelihood, Model
from stiction.inference.peaks import Peaks

BEYOND = 2.0
"""Spreads beyond the extremes of all simulated peaks from which on a peak is out of reach."""
SHARE = 0.1
"""Share of the prior's range of peaks from which on a parameter matters to its extremes."""
RARE = 1e-3
EDGE = 0.02
PILED = 4.0
_FACTORS = {"kPa": 1e3, "MPa": 1e6, "GPa": 1e9}


def extremes(model: Model, number: int) -> tuple[Array, Array, Array]:
    """Points of the prior, and the least and greatest simulated peak at each.

    The points are the nodes with all corners of the parameters that are not simulated.
    """
    specimen = model.specimens[number]
    axes = specimen.table.axes
    ends = model.prior.theta(np.stack([model.low, model.high]))
    sides = [axis.values for axis in axes]
    order = [axis.parameter for axis in axes]
    for i in range(model.prior.dimension):
        if i not in order:
            sides.append(ends[:, i])
            order.append(i)
    mesh = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, len(sides))
    theta = mesh[:, np.argsort(order)]
    shift, stretch = model.affine.of(theta)
    per_node = np.repeat(
        np.arange(specimen.table.peaks.shape[0]), mesh.shape[0] // specimen.table.peaks.shape[0]
    )
    spread = BEYOND * specimen.table.peaks.std(axis=1)[per_node]
    least = specimen.table.peaks.min(axis=1)[per_node] - spread
    least = np.maximum(least, specimen.densities.bound[per_node])
    most = specimen.table.peaks.max(axis=1)[per_node] + spread
    margin = 5.0 * model.error
    return theta, shift + stretch * least - margin, shift + stretch * most + margin


def check_reach(likelihood: Likelihood) -> None:
    """Refuse peaks that nothing in the prior can produce, and say which bound would have to move.

    Raises
    ------
    InputError
    """
    problems = []
    for number, peaks in enumerate(likelihood.peaks):
        theta, least, most = extremes(likelihood.model, number)
        low, high = float(least.min()), float(most.max())
        for value, side in ((float(peaks.min()), "below"), (float(peaks.max()), "above")):
            beyond = value < low if side == "below" else value > high
            if not beyond:
                continue
            best = int(least.argmin() if side == "below" else most.argmax())
            count = int(np.sum(peaks < low if side == "below" else peaks > high))
            bounds = _bounds(likelihood.model, theta, least if side == "below" else most, best)
            limit = low if side == "below" else high
            problems.append(
                f"peaks: {value:g} lies {side} all that the prior can produce, {low:g} to {high:g}"
                f"{f' (and {count - 1} more do)' if count > 1 else ''}; {side} {limit:g} it takes"
                f" {' or '.join(bounds)} in the prior{_unit(likelihood, peaks, low, high)}, or"
                " this peak is of another kind of specimen"
            )
    if problems:
        raise InputError(problems)


def _bounds(model: Model, theta: Array, value: Array, best: int) -> list[str]:
    """Ends of the prior at which the extreme is, of the parameters that matter to it."""
    whole = np.ptp(value)
    found = []
    for i, name in enumerate(model.prior.names):
        same = np.all(np.delete(theta, i, 1) == np.delete(theta[best], i), axis=1)
        matters = np.ptp(value[same]) > SHARE * whole
        own = theta[:, i]
        if matters and theta[best, i] in (own.min(), own.max()):
            lower = theta[best, i] == own.min()
            found.append(f"a {'lower' if lower else 'higher'} {name} than {theta[best, i]:g}")
    return found or ["other values"]


def _unit(likelihood: Likelihood, peaks: Array, low: float, high: float) -> str:
    """Whether another unit would bring the peaks to where the prior has them."""
    middle = float(np.median(peaks))
    for unit, factor in _FACTORS.items():
        if low <= middle * factor <= high:
            return f", or unit = {unit!r}"
    pressure = likelihood.model.prior.problem.load.normal_pressure
    if pressure is not None and low <= middle * float(np.mean(pressure)) <= high:
        return ", or unit = '1' if these are coefficients of friction"
    return ""


def piled_up(model: Model, u: Array) -> str:
    """Where the posterior stands against an end of the prior, or nothing."""
    texts = []
    ends = model.prior.theta(np.array([[0.0] * u.shape[1], [1.0] * u.shape[1]]))
    for i, name in enumerate(model.prior.names):
        for side, near in (("lower", u[:, i] < EDGE), ("upper", u[:, i] > 1.0 - EDGE)):
            if near.mean() > PILED * EDGE:
                end = ends[0 if side == "lower" else 1, i]
                texts.append(f"the {side} end of {name}, {end:g}, holds {near.mean():.0%} of it")
    if not texts:
        return ""
    return (
        f"the posterior stands against the prior: {'; '.join(texts)} within {EDGE:.0%} of the"
        " prior; where such an end is a guess, so is the result"
    )


def check_agreement(peaks: Peaks, predicted: Sequence[Array]) -> None:
    """Warn of peaks with a gap among them that one population would hardly show.

    The largest gap between neighbours, in terms of the predicted distribution; the chance of one
    so large among n uniform numbers is at most (n - 1) (1 - gap)^n.
    """
    for length, values, own in zip(peaks.lengths, peaks.values, predicted, strict=True):
        count = values.size
        share = np.searchsorted(np.sort(own), np.sort(values)) / own.size
        gaps = np.diff(share)
        if not gaps.size:
            continue
        chance = (count - 1) * (1.0 - float(gaps.max())) ** count
        if chance < RARE:
            place = int(gaps.argmax())
            ordered = np.sort(values)
            at = "" if length is None else f" at {length:g} m"
            warn_accuracy(
                f"peaks{at}: none lies between {ordered[place]:g} and {ordered[place + 1]:g},"
                f" where {gaps.max():.0%} are expected (probability {chance:.1g}): are two kinds"
                " of specimens mixed?"
            )
