"""The figure of a slider on a base, drawn to scale, with stresses and slip at its onset."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from stiction.base.units import unit_for
from stiction.elasticity.rig import on_cells
from stiction.methods.equilibrium.path import equilibrium_path
from stiction.plot.axes import new_figure, with_unit
from stiction.plot.style import ACCENT, COLUMN, INK, PALE, QUIET, paper_style, series
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample
from stiction.problem.specimen import Pusher, Slider

N_ARROWS = 7
"""Arrows of a pressure on the top."""
JUST_BEFORE = 1.0 - 1e-9
"""Load at which the state before an event is drawn, over the load of the event."""


def draw(problem: Problem, sample: Sample | None) -> NDArray[Any]:
    """Draw a rig, and stresses and slip of a sample before its first event.

    Without a sample, the stresses of the pressing alone are drawn, as if the interface were glued.
    """
    interface, n = problem.interface, problem.interface.size
    figure = new_figure(1.35 * COLUMN, (1.5 if sample is None else 2.0) * COLUMN)
    with paper_style():
        panels = figure.subplots(2 if sample is None else 3, sharex=True)
    scale, unit = unit_for("m", interface.lengths)
    _draw_bodies(panels[0], problem, scale)
    panels[0].set_ylabel(f"height ({unit})")
    if sample is None:
        mean = problem.given_pressure or 1.0
        shear, pressure = (
            n * mean * part for part in (problem.rig.T_p[:n], -on_cells(problem.rig.T_p[n:]))
        )
    else:
        first = equilibrium_path(problem, sample, [sample.strength.mean()]).event_load.values[0]
        path = equilibrium_path(problem, sample, [first * JUST_BEFORE])
        shear, pressure = path.stress.values[0], path.pressure.values[0]
    with paper_style():
        factor, of_stress = unit_for("Pa", pressure)
        x, (_, stresses, *more) = interface.x * scale, panels
        if sample is not None:
            coefficient = sample.strength[0] / sample.normal_pressure[0]
            peak = factor * coefficient * pressure
            stresses.plot(x, peak, color=QUIET, linewidth=0.7, label="peak strength")
        stresses.plot(x, factor * shear, label="shear stress", **series(0))
        stresses.plot(x, factor * pressure, label="pressure", **series(1))
        stresses.set_ylabel(with_unit("stress", of_stress))
        stresses.legend()
        for axes in more:
            moved = {"slip": path.slip.values[0], "opening": path.opening.values[0]}
            size, of_slip = unit_for("m", np.concatenate([*moved.values()]))
            for number, (name, values) in enumerate(moved.items()):
                axes.plot(x, size * values, label=name, **series(number))
            axes.set_ylabel(with_unit("slip", of_slip))
            axes.legend()
    panels[-1].set_xlabel(f"position $x$ ({unit})")
    return np.asarray(panels)


def _draw_bodies(axes: Axes, problem: Problem, scale: float) -> None:
    """Draw a slider, its base and arrows for the drive and the pressing. Both axes have a scale."""
    slider = problem.specimen
    assert isinstance(slider, Slider)
    length, height, base = problem.interface.measure * scale, slider.height * scale, slider.base
    behind, ahead = scale * base.behind, scale * base.ahead
    left, right = (behind, ahead) if slider.towards > 0 else (ahead, behind)
    low = -scale * base.height
    bodies = (
        (0.0, 0.0, length, height, PALE),
        (-left, low, length + left + right, -low, "white"),
    )
    for x, y, width, tall, colour in bodies:
        axes.add_patch(Rectangle((x, y), width, tall, facecolor=colour, edgecolor=QUIET))
    if base.bottom == "fixed":
        axes.plot([-left, length + right], [low, low], color=INK, linewidth=2.5)
    axes.plot([0.0, length], [0.0, 0.0], color=INK, linewidth=1.2)
    arrow: dict[str, Any] = {"width": 0.006 * length, "head_width": 0.03 * length}
    arrow |= {"color": ACCENT, "length_includes_head": True}
    reach, end = 0.2 * length * slider.towards, 0.0 if slider.towards > 0 else length
    if isinstance(slider.drive, Pusher):
        at, half = slider.drive.height * scale, 0.5 * slider.drive.width * scale
        axes.plot([end, end], [at - half, at + half], color=ACCENT, linewidth=3.0)
        axes.arrow(end - reach, at, reach, 0.0, **arrow)
    else:
        axes.arrow(0.5 * (length - reach), 1.05 * height, reach, 0.0, **arrow)
    arrow["color"] = QUIET
    if slider.pressing == "plate":
        axes.plot([0.0, length], [height, height], color=QUIET, linewidth=3.0)
    for share in np.linspace(-1.0, 1.0, N_ARROWS):
        size = 0.1 * length * (1.0 + slider.tilt * share)
        if size > 0.03 * length:
            x = 0.5 * length * (1.0 + slider.towards * share)
            axes.arrow(x, 1.1 * height + size, 0.0, -size, **arrow)
    axes.set(
        xlim=(-max(left, abs(reach)) - 0.05 * length, length * 1.05 + max(right, abs(reach)))
    )
    axes.set(ylim=(1.1 * low, 1.15 * height + 0.22 * length), aspect="equal")
