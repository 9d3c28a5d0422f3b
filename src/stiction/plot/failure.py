"""Failure probability: the curve over decades, and the weak spots of failing interfaces."""

from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from stiction.errors import InputError
from stiction.plot.axes import add_friction_scale, need, node_of, on_axes, problem_of, unit_for
from stiction.plot.style import ACCENT, COLUMN, INK, PALE, QUIET
from stiction.problem import Problem
from stiction.reliability.answer import FailureProbability, bounded

NEAR = 4.0
"""Nucleation lengths on either side of a weak spot that are drawn on a line."""
NEAR_ON_A_PLANE = 2.0


def failure_curve(curve: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw P(onset < s) over decades, with its interval.

    Parameters
    ----------
    curve : Dataset
        From `stiction.failure_curve`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    matplotlib.axes.Axes
        With friction coefficients at the top if there is a normal pressure. A dotted line
        marks the lower bound of the strength.

    Raises
    ------
    InputError
        If the dataset is not a failure curve.
    """
    need(curve, "stress", "probability", "probability_low", "probability_high")
    bound, probability = float(curve.attrs["lower_bound"]), curve["probability"].values
    factor, unit = unit_for("Pa", curve["stress"].values)
    x = curve["stress"].values * factor
    with on_axes(ax) as axes:
        if bounded(bound):
            axes.axvline(bound * factor, color=QUIET, linewidth=0.7, linestyle=":")
        low, high = curve["probability_low"].values, curve["probability_high"].values
        axes.fill_between(x, low, high, color=PALE, linewidth=0.0)
        text = "subset simulation, 95 % interval"
        axes.plot(x, probability, "o-", color=INK, markersize=2.5, linewidth=0.9, label=text)
        axes.set_yscale("log")
        axes.set_ylim(0.5 * float(probability.min()), 1.0)
        axes.set_xlabel(f"stress $s$ ({unit})")
        axes.set_ylabel(r"$P(\tau_{\mathrm{cr}} < s)$")
        with suppress(InputError):  # a problem that exists in Python only: stresses alone
            add_friction_scale(axes, problem_of(curve), "x", factor)
        axes.legend(loc="lower right")
    return axes


def weak_spots(
    found: FailureProbability | xr.Dataset,
    *,
    problem: Problem | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw failing interfaces, each shifted so that sliding begins in the middle.

    Parameters
    ----------
    found : FailureProbability or Dataset
        From `failure_probability`, or its `failing_profiles`.
    problem : Problem, optional
        Needed only if the profiles do not hold it; gives the nucleation length.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    matplotlib.axes.Axes
        On a line all profiles and their mean; on a plane a map of the mean. Lengths over h_n.

    Raises
    ------
    InputError
        If no failing profile was kept, or there is no single nucleation length.
    """
    failing = found.failing_profiles if isinstance(found, FailureProbability) else found
    if isinstance(failing, xr.Dataset) and not failing:
        raise InputError("found: holds no failing profile")
    need(failing, "strength", "critical_position")
    problem = problem_of(failing, problem)
    interface, length = problem.interface, problem.nucleation_length
    middle = np.array(interface.shape) // 2
    shifts = [middle - node_of(at, interface) for at in failing["critical_position"].values]
    dims = tuple(range(middle.size))
    pairs = zip(failing["strength"].values, shifts, strict=True)
    centred = np.stack([np.roll(strength, shift, dims) for strength, shift in pairs])
    offsets = [
        (np.arange(n) - m) * h / length
        for n, m, h in zip(interface.shape, middle, interface.spacings, strict=True)
    ]
    factor, unit = unit_for("Pa", centred)
    with on_axes(ax, COLUMN * 1.2, 2.6) as axes:
        if interface.is_plane:
            _draw_weak_map(axes, offsets, centred.mean(axis=0) * factor, unit)
            return axes
        near = np.abs(offsets[0]) <= NEAR
        s, shown = offsets[0][near], centred[:, near] * factor
        axes.axvspan(-0.5, 0.5, color=PALE, linewidth=0.0)
        axes.plot(s, shown.T, color=QUIET, linewidth=0.4, alpha=0.7)
        axes.plot(s, shown.mean(axis=0), color=INK, label="mean of these")
        if isinstance(found, FailureProbability):
            axes.axhline(found.stress * factor, color=ACCENT, linewidth=0.9, label="stress")
        axes.set_xlabel(r"$(x - x_{\mathrm{cr}})/h_n$")
        axes.set_ylabel(f"peak strength ({unit})")
        axes.set_xlim(-NEAR, NEAR)
        axes.legend(loc="upper right", frameon=True, framealpha=0.9, edgecolor="none")
    return axes


def _draw_weak_map(axes: Axes, offsets: list[Any], mean: Any, unit: str) -> None:
    near = [np.flatnonzero(np.abs(offset) <= NEAR_ON_A_PLANE) for offset in offsets]
    shown = mean[np.ix_(*near)]
    x, y = (offset[inside] for offset, inside in zip(offsets, near, strict=True))
    drawn = axes.pcolormesh(x, y, shown.T, cmap="cividis", shading="nearest", rasterized=True)
    axes.set_aspect("equal")
    axes.figure.colorbar(drawn, ax=axes, label=f"mean strength ({unit})", shrink=0.75)
    axes.set_xlabel(r"$(x - x_{\mathrm{cr}})/h_n$")
    axes.set_ylabel(r"$(y - y_{\mathrm{cr}})/h_n$")
