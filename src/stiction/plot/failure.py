"""Failure probability: the curve over decades, and what weak interfaces have in common."""

from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from stiction.errors import InputError
from stiction.plot.axes import add_friction_scale, need, on_axes, problem_of, unit_for
from stiction.plot.style import ACCENT, COLUMN, INK, PALE, QUIET
from stiction.problem import Problem
from stiction.reliability.answer import FailureProbability, bounded

NEAR = 4.0
"""Nucleation lengths on either side of a weak spot that are drawn on a line."""
NEAR_ON_A_PLANE = 2.0


def failure_curve(
    curve: xr.Dataset, *, above_bound: bool = False, ax: Axes | None = None
) -> Axes:
    """Draw P(onset < s) over decades, with its interval.

    Parameters
    ----------
    curve : Dataset
        From `stiction.failure_curve`.
    above_bound : bool
        Draw against the stress above the lower bound of the strength, logarithmic, instead of the
        stress: the lower tail is a straight line there.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    matplotlib.axes.Axes
        With friction coefficients above, if there is a pressure.

    Raises
    ------
    InputError
        If this is no failure curve, or the strength has no lower bound.
    """
    need(curve, "stress", "stress_above_bound", "probability", "probability_low")
    bound = float(curve.attrs["lower_bound"])
    if above_bound and not bounded(bound):
        raise InputError("above_bound: this strength has no lower bound; leave it out")
    stress = curve["stress_above_bound" if above_bound else "stress"].values
    factor, unit = unit_for("Pa", stress)
    x = stress * factor
    with on_axes(ax) as axes:
        if above_bound:
            axes.set_xscale("log")
            axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
            axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
            axes.xaxis.set_minor_formatter(NullFormatter())
            axes.set_xlabel(f"stress above the lower bound ({unit})")
        else:
            axes.set_xlabel(f"stress $s$ ({unit})")
            if bounded(bound):
                axes.axvline(bound * factor, color=QUIET, linewidth=0.7, linestyle=":")
        low, high = curve["probability_low"].values, curve["probability_high"].values
        percent = 100.0 * float(curve.attrs["confidence"])
        axes.fill_between(x, low, high, color=PALE, linewidth=0.0)
        text = f"subset simulation, {percent:g} % interval"
        style: dict[str, Any] = {"marker": "o", "markersize": 2.5, "linewidth": 0.9}
        axes.plot(x, curve["probability"].values, color=INK, label=text, **style)
        axes.set_yscale("log")
        axes.set_ylim(0.5 * float(curve["probability"].min()), 1.0)
        axes.set_ylabel(r"$P(\tau_{\mathrm{cr}} < s)$")
        if not above_bound:
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
    """Draw failing interfaces, each moved so that it begins to slide in the middle.

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
    length = problem_of(failing, problem).nucleation_length
    is_plane = "y" in failing.dims
    dims = ("x", "y") if is_plane else ("x",)
    spacings = [float(failing[dim][1] - failing[dim][0]) for dim in dims]
    middle = [failing.sizes[dim] // 2 for dim in dims]
    centred = np.stack(
        [
            np.roll(
                strength,
                [
                    m - round(float(a) / h)
                    for m, a, h in zip(middle, place, spacings, strict=True)
                ],
                range(len(dims)),
            )
            for strength, place in zip(
                failing["strength"].values,
                failing["critical_position"].values.reshape(-1, len(dims)),
                strict=True,
            )
        ]
    )
    offsets = [
        (np.arange(failing.sizes[dim]) - m) * h / length
        for dim, m, h in zip(dims, middle, spacings, strict=True)
    ]
    factor, unit = unit_for("Pa", centred)
    with on_axes(ax, COLUMN * 1.2, 2.7 if is_plane else 2.5) as axes:
        if is_plane:
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
