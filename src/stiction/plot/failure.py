"""Failure probability: the curve over decades, and what weak interfaces have in common."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullFormatter, StrMethodFormatter

from stiction._typing import Array
from stiction.errors import InputError
from stiction.plot.axes import MEGA, add_friction_scale, need, on_axes, problem_of
from stiction.plot.style import ACCENT, COLUMN, INK, PALE, QUIET, series
from stiction.problem import Problem
from stiction.reliability.result import FailureProbability, bounded

NEAR = 4.0
"""Nucleation lengths on either side that are shown of weak spots on a line."""
NEAR_PLANE = 2.0


def failure_curve(curve: xr.Dataset, *, above_bound: bool = False, ax: Axes | None = None) -> Axes:
    """Draw P(onset < s) over decades.

    Parameters
    ----------
    curve : Dataset
        From `stiction.failure_curve`.
    above_bound : bool
        Against the stress above the least possible one (kPa, logarithmic) instead of the stress
        (MPa): the lower tail is a straight line there.
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

    Returns
    -------
    matplotlib.axes.Axes
        With friction coefficients above, where there is a pressure.

    Raises
    ------
    InputError
        If this is no failure curve, or the strength has no lower bound to measure from.
    """
    need(curve, "stress", "stress_above_bound", "probability", "probability_low")
    if above_bound and not has_bound(curve):
        raise InputError("above_bound: this strength has no lower bound; leave it out")
    with on_axes(ax) as axes:
        draw_curve(axes, curve, above_bound)
        if not above_bound:
            with suppress(InputError):  # a problem that exists in Python only: stresses alone
                add_friction_scale(axes, problem_of(curve), "x")
        axes.set_ylabel(r"$P(\tau_{\mathrm{cr}} < s)$")
        axes.legend(loc="lower right")
    return axes


def draw_curve(axes: Axes, curve: xr.Dataset, above_bound: bool) -> None:
    """The curve with its interval, Rice's formula and plain Monte Carlo, without a legend."""
    if above_bound:
        x = curve["stress_above_bound"].values * 1e-3
        axes.set_xscale("log")
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.set_xlabel("stress above the least strength (kPa)")
    else:
        x = curve["stress"].values * MEGA
        axes.set_xlabel(r"stress $s$ (MPa)")
        if has_bound(curve):
            _mark_bound(axes, float(curve.attrs["lower_bound"]) * MEGA)
    low, high = curve["probability_low"].values, curve["probability_high"].values
    confidence = 100.0 * float(curve.attrs["confidence"])
    axes.fill_between(x, low, high, color=PALE, linewidth=0.0)
    axes.plot(
        x,
        curve["probability"].values,
        marker="o",
        markersize=2.5,
        color=INK,
        linewidth=0.9,
        label=f"subset simulation, {confidence:g} % interval",
    )
    if "rice_probability" in curve:
        style = series(2)
        axes.plot(x, curve["rice_probability"].values, **style, label="Rice's formula (local)")
    draw_plain(
        axes,
        x,
        curve,
        color=series(1)["color"],
        marker="s",
        markersize=3.0,
        label=f"plain Monte Carlo, {int(curve.attrs['plain_samples']):,} samples",
        zorder=3,
    )
    decades(axes, curve)


def _mark_bound(axes: Axes, bound: float) -> None:
    axes.axvline(bound, color=QUIET, linewidth=0.7, linestyle=":")
    axes.annotate(
        "least strength",
        (bound, 0.97),
        xycoords=("data", "axes fraction"),
        xytext=(3, 0),
        textcoords="offset points",
        color=QUIET,
        fontsize=7.0,
        va="top",
    )


def draw_plain(axes: Axes, x: Array, curve: xr.Dataset, **style: Any) -> None:
    """Plain Monte Carlo with its interval, where the curve has it."""
    if "plain_probability" not in curve:
        return
    middle = curve["plain_probability"].values
    sides = np.abs(np.stack([curve["plain_low"].values, curve["plain_high"].values]) - middle)
    axes.errorbar(x, middle, yerr=sides, linestyle="none", elinewidth=0.8, **style)


def decades(axes: Axes, curve: xr.Dataset) -> None:
    """A logarithmic scale of probability."""
    axes.set_yscale("log")
    axes.set_ylim(0.5 * float(curve["probability"].min()), 1.0)


def has_bound(curve: xr.Dataset) -> bool:
    """Whether there is a least possible onset to measure stresses from."""
    return bounded(float(curve.attrs["lower_bound"]))


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
        Needed only where the profiles do not hold it; gives the nucleation length.
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

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
    stress = found.stress if isinstance(found, FailureProbability) else None
    length = problem_of(failing, problem).nucleation_length
    with on_axes(ax, COLUMN * 1.2, 2.7 if "y" in failing.dims else 2.5) as axes:
        draw_weak_spots(axes, failing, length, stress)
    return axes


def draw_weak_spots(
    axes: Axes, failing: xr.Dataset, nucleation_length: float, stress: float | None
) -> None:
    """Weak spots over (x - x_cr)/h_n, with the stress (Pa) if it is given."""
    if "y" in failing.dims:
        _draw_weak_map(axes, failing, nucleation_length)
        return
    x = failing["x"].values
    spacing = float(x[1] - x[0])
    middle = x.size // 2
    shown = np.stack(
        [
            np.roll(row, middle - round(float(at) / spacing))
            for row, at in zip(
                failing["strength"].values, failing["critical_position"].values, strict=True
            )
        ]
    )
    s = (np.arange(x.size) - middle) * spacing / nucleation_length
    near = np.abs(s) <= NEAR
    axes.axvspan(-0.5, 0.5, color=PALE, linewidth=0.0)
    axes.plot(s[near], shown.T[near] * MEGA, color=QUIET, linewidth=0.4, alpha=0.7)
    axes.plot(s[near], shown.mean(axis=0)[near] * MEGA, color=INK, label="mean of these")
    if stress is not None:
        axes.axhline(stress * MEGA, color=ACCENT, linewidth=0.9, label="stress")
    axes.set_xlabel(r"$(x - x_{\mathrm{cr}})/h_n$")
    axes.set_ylabel("peak strength (MPa)")
    axes.set_xlim(-NEAR, NEAR)
    axes.legend(loc="upper right", frameon=True, framealpha=0.9, edgecolor="none")


def _draw_weak_map(axes: Axes, failing: xr.Dataset, nucleation_length: float) -> None:
    places = [failing[dim].values for dim in ("x", "y")]
    spacings = [float(place[1] - place[0]) for place in places]
    middle = [place.size // 2 for place in places]
    positions = failing["critical_position"].values
    total: Any = 0.0
    for strength, at in zip(failing["strength"].values, positions, strict=True):
        shift = [m - round(float(a) / h) for m, a, h in zip(middle, at, spacings, strict=True)]
        total = total + np.roll(strength, shift, (0, 1)) / positions.shape[0]
    reach = [
        min(m, max(1, int(NEAR_PLANE * nucleation_length / h)))
        for m, h in zip(middle, spacings, strict=True)
    ]
    near = total[
        middle[0] - reach[0] : middle[0] + reach[0] + 1,
        middle[1] - reach[1] : middle[1] + reach[1] + 1,
    ]
    ends = [(r + 0.5) * h / nucleation_length for r, h in zip(reach, spacings, strict=True)]
    drawn = axes.imshow(
        near.T * MEGA, origin="lower", extent=(-ends[0], ends[0], -ends[1], ends[1]),
        cmap="cividis",
    )  # fmt: skip
    axes.figure.colorbar(drawn, ax=axes, label="mean strength (MPa)", shrink=0.75)
    axes.set_xlabel(r"$(x - x_{\mathrm{cr}})/h_n$")
    axes.set_ylabel(r"$(y - y_{\mathrm{cr}})/h_n$")
