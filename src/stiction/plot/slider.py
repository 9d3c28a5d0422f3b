"""The figure of a slider on a base, to scale, with stresses and slip at its first instability."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from stiction.base.units import unit_for
from stiction.methods.equilibrium.contact.solver import SliderSolver
from stiction.plot.axes import new_figure, with_unit
from stiction.plot.style import ACCENT, COLUMN, INK, PALE, QUIET, paper_style, series
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample
from stiction.problem.specimen import Pusher, Slider

N_ARROWS = 7
"""Arrows of a pressure on the top."""


def draw(problem: Problem, sample: Sample) -> NDArray[Any]:
    """Draw a rig, and stresses and slip of a sample at its first instability."""
    solver = SliderSolver(problem)
    push = solver.path(sample, 0).follow()
    profiles = solver.values_at(push.first or push.last)
    coefficient = sample.strength[0] / sample.normal_pressure[0]
    profiles["peak strength"] = coefficient * profiles["pressure"]
    profiles["shear stress"] = profiles["stress"]
    rows = {"Pa": ("shear stress", "pressure", "peak strength"), "m": ("slip", "opening")}
    scale, unit = unit_for("m", problem.interface.lengths)
    figure = new_figure(1.35 * COLUMN, 2.0 * COLUMN)
    with paper_style():
        top, *below = figure.subplots(3, sharex=True)
        _draw_bodies(top, problem, scale)
        top.set_ylabel(f"height ({unit})")
        for axes, (si, names) in zip(below, rows.items(), strict=True):
            factor, shown = unit_for(si, np.concatenate([profiles[name] for name in names]))
            for number, name in enumerate(names):
                values = factor * profiles[name]
                axes.plot(problem.interface.x * scale, values, label=name, **series(number))
            axes.set_ylabel(with_unit(names[0].split()[-1], shown))
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
    lines = [(0.0, length, 0.0, INK)]
    lines += [(-left, length + right, low, INK)] * (base.bottom == "fixed")
    lines += [(0.0, length, height, QUIET)] * (slider.pressing == "plate")
    for start, stop, y, colour in lines:
        axes.plot([start, stop], [y, y], color=colour, linewidth=2.5)
    arrow: dict[str, Any] = {"width": 0.006 * length, "head_width": 0.03 * length}
    arrow["length_includes_head"] = True
    reach, at, start = 0.2 * length * slider.towards, 1.05 * height, 0.5 * length
    if isinstance(slider.drive, Pusher):
        at, half = slider.drive.height * scale, 0.5 * slider.drive.width * scale
        start = end - reach
        axes.plot([end, end], [at - half, at + half], color=ACCENT, linewidth=3.0)
    axes.arrow(start, at, reach, 0.0, color=ACCENT, **arrow)
    for share in np.linspace(-1.0, 1.0, N_ARROWS):
        x = 0.5 * length * (1.0 + slider.towards * share)
        size = 0.05 * length * (1.5 + slider.tilt * share)
        axes.arrow(x, 1.1 * height + size, 0.0, -size, color=QUIET, **arrow)
    room = 0.25 * length
    axes.set(xlim=(-max(left, room), length + max(right, room)), aspect="equal")
    axes.set_ylim(1.1 * low, 1.1 * height + room)
