"""The figures of docs/line-and-plane.md; `line_and_plane.py` computes what they show."""

from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from PIL import Image

from stiction.methods.equilibrium.patches import critical_patch
from stiction.plot.style import ACCENT, INK, PAGE, QUIET, color, panel, paper_style, series

LEAST = 1e-3
"""Lowering in per cent from which on it is drawn: below, the grid of the line decides."""
LINE, PLANE = ({"color": color(1), "marker": "s"}, {"color": color(2), "marker": "o"})
SMALL = {"markerfacecolor": "white", "linestyle": "--"}
STYLES = {
    "line, small": LINE | SMALL,
    "line, large": LINE,
    "plane, small": PLANE | SMALL,
    "plane, large": PLANE,
}
NAMES = {
    "line, small": r"line, 16 $h_n$",
    "line, large": r"line, 64 $h_n$",
    "plane, small": r"plane, 4 $h_n$ by 4 $h_n$",
    "plane, large": r"plane, 8 $h_n$ by 8 $h_n$",
}


def draw(folder: Path, *shown: Any) -> None:
    """Write the figures of `shown`, the arguments of `figures`, into `folder`."""
    folder.mkdir(parents=True, exist_ok=True)
    with paper_style():
        for name, figure in figures(*shown).items():
            save(figure, folder / f"line_and_plane_{name}.png")


def figures(
    ratios: Any, lowered: dict, parts: dict, effects: dict, shown: dict
) -> dict[str, Figure]:
    """The three figures by name."""
    return {
        "interaction": interaction(ratios, lowered, parts),
        "summary": summary(ratios, parts, effects),
        "patches": patches(shown),
    }


def save(figure: Figure, path: Path) -> None:
    """With a palette instead of true colour, to keep it small."""
    figure.savefig(path, dpi=170)
    Image.open(path).convert("RGB").quantize(200, dither=Image.Dither.NONE).save(
        path, optimize=True
    )


def interaction(ratios: Any, lowered: dict, parts: dict) -> Figure:
    """Distributions of the lowering on the large line and plane; means of all cases."""
    figure = Figure(figsize=(PAGE, 3.1))
    panels = figure.subplots(1, 3, width_ratios=(1.0, 1.0, 1.05))
    for axes, name, letter in zip(panels, ("line, large", "plane, large"), "ab", strict=False):
        for i, ratio in enumerate(ratios):
            values = np.sort(lowered[name].isel(ratio=i).values)
            above = 100.0 * (1.0 - np.arange(values.size) / values.size)
            label = rf"$\xi_0/h_n = {ratio:g}$"
            axes.step(values, above, where="pre", label=label, **series(i))
        axes.set(xscale="log", xlabel="lowered by more than (%)")
        axes.set(xlim=(LEAST, 10.0), ylim=(0, 102))
        axes.set_title(NAMES[name], pad=10)
        panel(axes, letter)
    panels[0].set_ylabel("share of the samples (%)")
    _against_ratio(panels[2], ratios, {name: part["lowering"] for name, part in parts.items()})
    for name in ("line, large", "plane, large"):
        far = [estimate.value for estimate in parts[name]["far"]]
        panels[2].plot(ratios, far, color=STYLES[name]["color"], linestyle=":")
    panels[2].set(yscale="log", ylabel="mean lowering (%)", ylim=(1e-4, 6.0))
    panel(panels[2], "c")
    for axes, place in ((panels[0], 0.3), (panels[2], 0.8)):
        style = {"ncols": 2, "loc": "lower center", "bbox_to_anchor": (place, 0.0)}
        figure.legend(*axes.get_legend_handles_labels(), **style)
    figure.set_layout_engine("constrained", rect=(0.0, 0.17, 1.0, 0.83))
    return figure


def _against_ratio(axes: Axes, ratios: Any, cases: dict[str, list]) -> None:
    for name, estimates in cases.items():
        values, errors = ([getattr(e, key) for e in estimates] for key in ("value", "error"))
        style = {"label": NAMES[name], "capsize": 1.5} | STYLES[name]
        axes.errorbar(ratios, values, yerr=errors, **style)
    axes.set(xscale="log", xlabel=r"correlation length $\xi_0/h_n$")
    axes.set_xticks(ratios, [f"{ratio:g}" for ratio in ratios])
    axes.minorticks_off()


def summary(ratios: Any, parts: dict, effects: dict) -> Figure:
    """What slips, ranks, arrest and size effect against the correlation length."""
    figure = Figure(figsize=(PAGE, 4.6))
    panels = figure.subplots(2, 2)
    for axes, key, label, letter in (
        (panels[0, 0], "slipping", "slips at first instability (%)", "a"),
        (panels[0, 1], "disorder", "1 - rank correlation", "b"),
        (panels[1, 0], "arrested", "with an arrested event (%)", "c"),
    ):
        _against_ratio(axes, ratios, {name: part[key] for name, part in parts.items()})
        axes.set_ylabel(label)
        panel(axes, letter)
    panels[0, 0].set_ylim(0, None)
    panels[1, 0].set_ylim(0, None)
    panels[0, 0].legend()
    panels[0, 1].set_yscale("log")
    for kind, effect in effects.items():
        name = f"{kind}, large"
        _against_ratio(panels[1, 1], ratios, {name: effect["exact"]})
        values = [e.value for e in effect["exact, weakest of four"]]
        panels[1, 1].plot(ratios, values, color=STYLES[name]["color"], linestyle=":")
    panels[1, 1].set(ylabel="fall of the mean onset (%)", ylim=(0, None))
    handles = []
    for kind in effects:
        colour = STYLES[f"{kind}, large"]["color"]
        handles.append(Line2D([], [], color=colour, label=f"{kind}, four times as large"))
    handles.append(Line2D([], [], color=QUIET, linestyle=":", label="weakest of four"))
    panels[1, 1].legend(handles=handles)
    panel(panels[1, 1], "d")
    return figure


def patches(shown: dict) -> Figure:
    """Strength of one plane and one line, and what slips at the first instability."""
    figure = Figure(figsize=(PAGE, 3.9))
    left, right = figure.subfigures(1, 2, width_ratios=(1.0, 1.05))
    _plane(left, *shown["plane, large"])
    _line(right, *shown["line, large"])
    for axes, letter in zip((left.axes[0], *right.axes), "abc", strict=True):
        panel(axes, letter)
    return figure


def _plane(figure: Any, case: Any, tau_p: np.ndarray, onset: Any) -> None:
    axes = figure.subplots()
    ends = (-0.5 / case.nodes, case.size - 0.5 / case.nodes)
    style = {"origin": "lower", "cmap": "Greys_r", "vmin": 0.55}
    image = axes.imshow(tau_p.T * 1e-6, extent=ends * 2, **style)
    figure.colorbar(image, ax=axes, location="bottom", label="strength (MPa)", shrink=0.8)
    at = np.arange(case.size * case.nodes) / case.nodes
    moves = (onset.slip.values > 0.0).astype(float)
    inside, _ = critical_patch(onset.sensitivity.values, case.problem.interface)
    axes.contourf(at, at, moves.T, levels=[0.5, 2.0], colors=[color(1)], alpha=0.3)
    axes.contour(at, at, moves.T, levels=[0.5], colors=[color(1)], linewidths=0.7)
    axes.contour(at, at, inside.T.astype(float), levels=[0.5], colors=[ACCENT], linewidths=1.5)
    axes.set(xlabel="$x/h_n$, direction of slip", ylabel="$y/h_n$")
    handles = [
        Patch(facecolor=color(1), alpha=0.5, label="slips"),
        Line2D([], [], color=ACCENT, linewidth=1.5, label="critical patch"),
    ]
    axes.legend(handles=handles, loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=2)


def _line(figure: Any, case: Any, tau_p: np.ndarray, onset: Any) -> None:
    at = np.arange(-tau_p.size, 2 * tau_p.size) / case.nodes  # periodic
    tau_p = np.tile(tau_p * 1e-6, 3)
    moves = np.tile(onset.slip.values > 0.0, 3)
    share = onset.sensitivity.values
    critical = np.tile(share > 0.1 * share.max(), 3)
    centre = float(onset.critical_position) / (float(onset.x[1]) * case.nodes)
    load = float(onset.first_instability) * 1e-6
    low, high, bar = 0.6, 1.7, 1.63
    windows = ((0.0, case.size), (centre - 4.0, centre + 4.0))
    for axes, window in zip(figure.subplots(2, 1), windows, strict=True):
        axes.plot(at, tau_p, color=INK, linewidth=0.6)
        options = {"step": "mid", "linewidth": 0.0}
        axes.fill_between(at, low, bar, where=moves, color=color(1), alpha=0.45, **options)
        axes.fill_between(at, bar, high, where=critical, color=ACCENT, **options)
        axes.axhline(load, color=QUIET, linewidth=0.7)
        axes.set(xlim=window, xlabel="$x/h_n$", ylabel="strength (MPa)", ylim=(low, high))
    style = {"ha": "right", "va": "top", "color": QUIET, "fontsize": 7.5}
    axes.text(window[1], load - 0.01, "stress at onset ", **style)
