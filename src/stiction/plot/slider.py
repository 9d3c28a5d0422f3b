"""The figure of a slider on a base, to scale, with stresses and slip at its first instability."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from stiction.base.units import unit_for
from stiction.elasticity.rig import on_cells
from stiction.methods.equilibrium.contact.solver import SliderSolver
from stiction.plot.axes import new_figure, with_unit
from stiction.plot.style import ACCENT, COLUMN, INK, PALE, QUIET, paper_style, series
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample
from stiction.problem.specimen import Pusher, Slider

N_ARROWS = 7
"""Arrows of a pressure on the top."""


def draw(problem: Problem, sample: Sample | None) -> NDArray[Any]:
    """Draw a rig, and stresses and slip of a sample at its first instability.

    Without a sample, the stresses of the pressing alone are drawn, as if the interface were glued.
    """
    interface, n, rig = problem.interface, problem.interface.size, problem.rig
    scale, unit = unit_for("m", interface.lengths)
    x, lines, moved = interface.x * scale, {}, {}
    if sample is None:
        mean = n * (problem.given_pressure or 1.0)
        lines["shear stress"] = mean * rig.T_p[:n]
        lines["pressure"] = -mean * on_cells(rig.T_p[n:])
    else:
        solver = SliderSolver(problem)
        push = solver.path(sample, 0).follow()
        profiles = solver.profiles(push.first or push.last)
        lines["shear stress"], lines["pressure"] = profiles["stress"], profiles["pressure"]
        coefficient = sample.strength[0] / sample.normal_pressure[0]
        lines["peak strength"] = coefficient * lines["pressure"]
        moved = {"slip": profiles["slip"], "opening": profiles["opening"]}
    panels = [("m", "slip", moved)] if moved else []
    figure = new_figure(1.35 * COLUMN, (1.5 + 0.5 * len(panels)) * COLUMN)
    with paper_style():
        top, *below = figure.subplots(2 + len(panels), sharex=True)
        _draw_bodies(top, problem, scale)
        top.set_ylabel(f"height ({unit})")
        for axes, (si, name, profiles) in zip(
            below, [("Pa", "stress", lines), *panels], strict=True
        ):
            factor, shown = unit_for(si, np.concatenate([*profiles.values()]))
            for number, (label, values) in enumerate(profiles.items()):
                axes.plot(x, factor * values, label=label, **series(number))
            axes.set_ylabel(with_unit(name, shown))
            axes.legend()
        below[-1].set_xlabel(f"position $x$ ({unit})")
    return np.array([top, *below])


def _draw_bodies(axes: Axes, problem: Problem, scale: float) -> None:
    """Draw a slider, its base and arrows for the drive and the pressing, to scale."""
    slider = problem.specimen
    assert isinstance(slider, Slider)  # `problem.rig` has refused other specimens
    length, height, base = problem.interface.measure * scale, slider.height * scale, slider.base
    left, right = (scale * part for part in (base.behind, base.ahead)[:: slider.towards])
    low, end = -scale * base.height, 0.0 if slider.towards > 0 else length
    bodies = ((0.0, height, length, PALE), (-left, low, length + left + right, "white"))
    for x, tall, width, colour in bodies:
        axes.add_patch(Rectangle((x, 0.0), width, tall, facecolor=colour, edgecolor=QUIET))
    axes.plot([0.0, length], [0.0, 0.0], color=INK, linewidth=1.2)
    if base.bottom == "fixed":
        axes.plot([-left, length + right], [low, low], color=INK, linewidth=2.5)
    arrow: dict[str, Any] = {"width": 0.006 * length, "head_width": 0.03 * length}
    arrow["length_includes_head"] = True
    reach, at, start = 0.2 * length * slider.towards, 1.05 * height, 0.5 * length
    if isinstance(slider.drive, Pusher):
        at, half = slider.drive.height * scale, 0.5 * slider.drive.width * scale
        start = end - reach
        axes.plot([end, end], [at - half, at + half], color=ACCENT, linewidth=3.0)
    axes.arrow(start, at, reach, 0.0, color=ACCENT, **arrow)
    if slider.pressing == "plate":
        axes.plot([0.0, length], [height, height], color=QUIET, linewidth=3.0)
    for share in np.linspace(-1.0, 1.0, N_ARROWS):
        x, size = 0.5 * length * (1.0 + slider.towards * share), 1.0 + slider.tilt * share
        if size > 0.3:
            size *= 0.1 * length
            axes.arrow(x, 1.1 * height + size, 0.0, -size, color=QUIET, **arrow)
    room = 0.25 * length
    axes.set(xlim=(-max(left, room), length + max(right, room)), aspect="equal")
    axes.set_ylim(1.1 * low, 1.15 * height + room)
