"""Figures of failure probability: the curve, weak interfaces, what the tail hangs on."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

from stiction._typing import Array
from stiction.plot.failure import (
    decades,
    draw_curve,
    draw_plain,
    draw_weak_spots,
    failure_curve,
    has_bound,
)
from stiction.plot.style import (
    ACCENT,
    COLUMN,
    PAGE,
    new_figure,
    panel,
    paper_style,
    series,
)
from stiction.reliability.tails import LONGER, TailStudy, weakest_link
from stiction.report.tables import Table


def _tail_stress(curve: xr.Dataset) -> tuple[Array, str]:
    """The stress as the tail is best drawn against: above the bound, where there is one."""
    if has_bound(curve):
        return curve["stress_above_bound"].values * 1e-3, "stress above the\nleast strength (kPa)"
    return curve["stress"].values * 1e-3, "stress (kPa)\n"


def curve_figure(curve: xr.Dataset) -> Figure:
    """P(onset < s) over decades, against the stress and against the stress above the bound.

    Parameters
    ----------
    curve : Dataset
        From `stiction.failure_curve`.
    """
    bounded = has_bound(curve)
    with paper_style():
        figure = new_figure(PAGE if bounded else COLUMN * 1.2, 2.7)
        axes = figure.subplots(1, 2 if bounded else 1, sharey=True, squeeze=False)[0]
        failure_curve(curve, ax=axes[0])
        if bounded:
            draw_curve(axes[1], curve, above_bound=True)
            panel(axes[0], "a")
            panel(axes[1], "b")
    return figure


def weak_spot_figure(failing: xr.Dataset, nucleation_length: float, stress: float) -> Figure:
    """Profiles of failing samples, moved so that each begins to slide at the middle.

    Parameters
    ----------
    failing : Dataset
        `failing_profiles` of a `FailureProbability`.
    nucleation_length : float
        h_n, m; the unit of length.
    stress : float
        Pa.
    """
    with paper_style():
        figure = new_figure(COLUMN * 1.2, 2.7 if "y" in failing.dims else 2.5)
        draw_weak_spots(figure.subplots(), failing, nucleation_length, stress)
    return figure


def tail_figure(study: TailStudy) -> Figure:
    """Failure curves by correlation length, by interface length and by the strength's lower end.

    Parameters
    ----------
    study : TailStudy
    """
    with paper_style():
        figure = new_figure(PAGE, 2.7)
        first, second, third = figure.subplots(1, 3, sharey=True)
        for i, (ratio, curve) in enumerate(study.correlation.items()):
            x, label = _tail_stress(curve)
            first.plot(x, curve["probability"].values, **series(i), label=f"{ratio:g}")
        first.set_xscale("log")
        first.set_xlabel(label)
        first.set_ylabel(r"$P(\tau_{\mathrm{cr}} < s)$")
        first.legend(title=r"$\xi_0/h_n$", title_fontsize=7.5)
        short, long = study.length[1], study.length[LONGER]
        for i, (curve, name) in enumerate(((short, "$L$"), (long, f"${LONGER} L$"))):
            x, _ = _tail_stress(curve)
            second.plot(x, curve["probability"].values, **series(i), label=name)
            style = {"color": series(i)["color"], "marker": "os"[i], "markersize": 2.5}
            draw_plain(second, x, curve, **style)
        second.plot(
            _tail_stress(short)[0],
            weakest_link(short["probability"].values, LONGER),
            color=ACCENT,
            linewidth=0.8,
            linestyle=":",
            label="weakest link",
        )
        second.set_xscale("log")
        second.set_xlabel(label)
        second.legend()
        for i, (name, curve) in enumerate(study.lower_end.items()):
            x = curve["stress"].values * 1e-6
            third.plot(x, curve["probability"].values, **series(i), label=name)
        third.set_xlabel("stress (MPa)\n")
        third.legend(loc="upper left", fontsize=6.5, handlelength=1.6, borderaxespad=0.1)
        decades(first, short)
        for axes, letter in zip((first, second, third), "abc", strict=True):
            panel(axes, letter)
    return figure


def curve_table(curve: xr.Dataset) -> Table:
    """The failure curve as a table.

    Parameters
    ----------
    curve : Dataset
        From `stiction.failure_curve`.
    """
    names = [
        ("stress", "stress (Pa)"),
        ("stress_above_bound", "above the bound (Pa)"),
        ("friction_coefficient", "coefficient"),
        ("probability", "P"),
        ("probability_low", "low"),
        ("probability_high", "high"),
        ("coefficient_of_variation", "c.o.v."),
        ("plain_probability", "plain Monte Carlo"),
        ("rice_probability", "Rice's formula"),
    ]
    if not has_bound(curve):  # then it says the stress again
        del names[1]
    present = [(name, title) for name, title in names if name in curve]
    rows = zip(*(curve[name].values.tolist() for name, _ in present), strict=True)
    titles = tuple(title for _, title in present)
    return Table.of("failure_curve", "Failure probability", titles, rows)


def tail_table(study: TailStudy) -> Table:
    """Stress above the bound at which each curve of a tail study reaches some probabilities."""
    wanted = np.array([1e-3, 1e-6, 1e-9])
    rows = []
    groups: tuple[tuple[str, Any], ...] = (
        ("xi_0/h_n = {:g}", study.correlation),
        ("length x {:g}", study.length),
        ("{}", study.lower_end),
    )
    for text, curves in groups:
        for key, curve in curves.items():
            chances = curve["probability"].values[::-1]
            found = np.interp(np.log(wanted), np.log(chances), curve["stress"].values[::-1])
            # The curve ends within a sample of the probability asked for; further is not known.
            found[wanted < 0.9 * chances[0]] = np.nan
            bound = float(curve.attrs["lower_bound"])
            rows.append((text.format(key), bound, *found.tolist()))
    columns = ("system", "bound (Pa)", *(f"stress at P = {p:g} (Pa)" for p in wanted))
    return Table.of("failure_tails", "Stress at small failure probabilities", columns, rows)
