"""Figure 3: a representative rupture in space and time, on the axes of the paper."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from stiction._typing import Array
from stiction.papers.albertini2020.data import Data
from stiction.plot.style import ACCENT, INK, PAGE, new_figure, panel
from stiction.report.tables import Table

name = "rupture"
number = "3"
title = "A representative rupture"
needs: tuple[str, ...] = ("representative",)

_SLOWEST, _FASTEST, _COLORS = 1e-6, 10.0, "inferno_r"
_BEFORE = 0.11  # creep before the onset that is enlarged, in units of L/c_s
_ENLARGED = 1e4
"""(t/T - 1) is told in units of 1e-4 around the onset: the rupture is that short."""


def caption(data: Data) -> str:
    """What is seen."""
    run = data["representative"]
    peak, place = float(run["critical_stress"]), float(run["critical_position"])
    length = data.setting.problem.interface.extent
    return (
        "(a) Slip rate along the interface around the onset at T, in units of 1e-4 T; what sticks"
        f" is white, the dot marks the onset at x/L = {place / length:.3f}. (b) Mean stress on the"
        " interface at the same times: it falls within the time that the front needs to cross."
        " (c, d) The same from the first slip on, where the fall is too short to be seen; while the"
        " interface creeps the mean stress is the load, and its maximum is tau_cr ="
        f" {peak / data.setting.mean:.4f} <tau_p>. (e) Peak strength at xi_0/h_n ="
        f" {run.attrs['correlation_ratio']:g}, and the nucleation length."
    )


def tables(data: Data) -> list[Table]:
    """Mean stress against time, and the numbers of the run."""
    run = data["representative"]
    record = zip(
        run["step_time"].values.tolist(), run["step_mean_stress"].values.tolist(), strict=True
    )
    scalars = [
        (str(run[key].attrs.get("long_name", key)), float(run[key]), str(run[key].attrs["units"]))
        for key in run.data_vars
        if run[key].ndim == 0 and "units" in run[key].attrs
    ]
    return [
        Table.of("figure-3-run", "The run in numbers", ("what", "value", "unit"), scalars),
        Table.of(
            "figure-3-history", "Mean stress against time", ("t (s)", "mean stress (Pa)"), record
        ),
    ]


def draw(data: Data) -> Figure:
    """Around the onset, the whole run, and the strength."""
    run, problem = data["representative"], data.setting.problem
    length, onset = problem.interface.extent, float(run["onset_time"])
    place = float(run["critical_position"]) / length
    figure = new_figure(PAGE, 5.6)
    grid = figure.add_gridspec(3, 3, height_ratios=[2, 2, 1], width_ratios=[1.0, 4, 0.1])
    near, whole, strength = (figure.add_subplot(grid[row, 1]) for row in range(3))
    fall, load = (
        figure.add_subplot(grid[0, 0], sharey=near),
        figure.add_subplot(grid[1, 0], sharey=whole),
    )
    bar = figure.add_subplot(grid[:2, 2])
    times, rate = run["time"].values / onset, run["slip_rate"].values
    before = _BEFORE * length / problem.solid.shear_wave_speed / onset
    late = np.flatnonzero(times >= 1.0 - before)
    _mesh(near, data, _ENLARGED * (times[late] - 1.0), rate[late])
    _mesh(whole, data, times, rate)
    steps = run["step_time"].values / onset
    stress = run["step_mean_stress"].values / float(run["critical_stress"])
    inside = steps >= 1.0 - before
    fall.plot(stress[inside], _ENLARGED * (steps[inside] - 1.0), color=INK)
    load.plot(stress, steps, color=INK)
    for beside, moment in ((fall, 0.0), (load, 1.0)):
        beside.plot([1.0], [moment], "o", color=INK, markersize=3.5, clip_on=False)
    for axes, moment in ((near, 0.0), (whole, 1.0)):
        axes.plot([place], [moment], "o", color=INK, markersize=3.5, clip_on=False, zorder=5)
        axes.tick_params(labelleft=False, labelbottom=False)
        axes.set_xlim(0.0, 1.0)
    near.set_ylim(*(_ENLARGED * (times[late][[0, -1]] - 1.0)))
    whole.set_ylim(times[0], times[-1])
    fall.set_xlim(min(float(stress[inside].min()), 0.0) - 0.03, 1.08)
    load.set_xlim(float(stress.min()) if stress.min() > 0.5 else -0.03, 1.04)
    fall.set_ylabel(r"$(t/T-1)\times 10^{4}$")
    load.set_ylabel("$t/T$")
    load.set_xlabel(r"$\langle\tau\rangle/\tau_\mathrm{cr}$")
    for beside in (fall, load):
        beside.yaxis.set_major_locator(MaxNLocator(5))
    _strength(strength, data)
    figure.colorbar(
        ScalarMappable(LogNorm(_SLOWEST, _FASTEST), _COLORS), cax=bar, extend="both",
        label="slip rate (m/s)",
    )  # fmt: skip
    for axes, letter in zip((near, fall, whole, load, strength), "abcde", strict=True):
        panel(axes, letter)
    return figure


def _mesh(axes: Axes, data: Data, times: Array, rate: Array) -> Any:
    """Slip rate on a logarithmic scale; what sticks stays white."""
    interface = data.setting.problem.interface
    along = np.append(interface.x, interface.extent) / interface.extent
    middle = 0.5 * (times[1:] + times[:-1])
    edges = np.concatenate([times[:1], middle, times[-1:]])
    return axes.pcolormesh(
        along, edges, np.ma.masked_less(rate, _SLOWEST), norm=LogNorm(_SLOWEST, _FASTEST),
        cmap=_COLORS, rasterized=True,
    )  # fmt: skip


def _strength(axes: Axes, data: Data) -> None:
    run, problem = data["representative"], data.setting.problem
    length = problem.interface.extent
    values = data.relative(run["peak_strength"].values)
    axes.plot(problem.interface.x / length, values, color=INK, linewidth=0.9)
    half = 0.5 * problem.nucleation_length / length
    place, height = float(run["critical_position"]) / length, float(values.max()) + 0.12
    axes.annotate(
        "", (place - half, height), (place + half, height),
        arrowprops={"arrowstyle": "<->", "color": ACCENT, "lw": 0.9, "shrinkA": 0, "shrinkB": 0},
    )  # fmt: skip
    axes.text(place + 1.4 * half, height, r"$h_\mathrm{n}$", color=ACCENT, ha="left", va="center")
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(float(values.min()) - 0.05, height + 0.12)
    axes.set_xlabel("position $x/L$")
    axes.set_ylabel(r"$\tau_\mathrm{p}/\langle\tau_\mathrm{p}\rangle$")
