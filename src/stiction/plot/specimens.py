"""Figures of specimens: the blocks and their drive, and the curve that a machine records."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.patches import Rectangle
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import check
from stiction.base.units import unit_for
from stiction.inference.curves import Curves
from stiction.methods.equilibrium.slider import SliderSolver
from stiction.plot.axes import named, need, new_figure, problem_of, with_unit
from stiction.plot.fields import chosen_row, strength_of
from stiction.plot.style import ACCENT, COLUMN, INK, PALE, QUIET, paper_style, series
from stiction.problem.problem import Problem
from stiction.problem.sample import Sample
from stiction.problem.specimen import Pusher, Slider

N_ARROWS = 7
"""Number of arrows for the pressure on top of a slider."""


def specimen(
    problem: Problem, strength: Any = None, result: xr.Dataset | None = None, *, sample: int = 0
) -> NDArray[Any]:
    """Draw a specimen and its drive, and the shear and pressure on the interface.

    Parameters
    ----------
    problem : Problem
        A problem with a specimen.
    strength : array, optional
        tau_p, Pa, with shape (nodes,) or (samples, nodes), or with
        labels and units.
    result : Dataset, optional
        From `stiction.onset` with this strength. The critical patch
        between blocks is marked.
    sample : int
        Number of the sample, counted from 0.

    Returns
    -------
    (2,) or (3,) array of matplotlib.axes.Axes
        The specimen, and below it the profiles along the interface. For
        blocks, the profiles are the shear and the pressure of the drive. A
        slider, which needs a strength (friction coefficients), is drawn to
        scale, with its shear, pressure and slip at the first instability.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.Problem(
    ...     solid=st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
    ...     interface=st.Interface(length=0.1, nodes=128),
    ...     friction=st.LinearWeakening(weakening_rate=0.2e12),
    ...     specimen=st.Blocks(height=0.05, drive=st.Pusher(height=0.01, width=0.005)),
    ... )
    >>> len(st.plot.specimen(problem))
    2
    """
    check("problem", problem, Problem)
    if isinstance(problem.specimen, Slider):
        if strength is None:
            raise InputError("strength: is missing. The pressure of a slider depends on it")
        given = problem.sample(strength)
        chosen_row(given.strength, {} if result is None else {"onset": result}, sample)
        return _draw_slider(problem, given.part(slice(int(sample), int(sample) + 1)))
    blocks, interface = problem.blocks, problem.interface
    rows = None if strength is None else strength_of(problem, strength)
    if result is not None:
        need(result, "critical_position", "critical_patch_length")
    onset = chosen_row(rows, {} if result is None else {"onset": result}, sample).get("onset")
    figure = new_figure(1.35 * COLUMN, 1.5 * COLUMN)
    with paper_style():
        top, below = figure.subplots(2, sharex=True, height_ratios=(1.0, 1.2))
    scale, unit = unit_for("m", interface.lengths)
    _draw_blocks(top, problem, scale)
    top.set_ylabel(f"height ({unit})")
    x = interface.x * scale
    if rows is not None:
        tau_p = rows[int(sample)]
        below.plot(x, tau_p / np.nanmean(tau_p), color=QUIET, linewidth=0.7, label="strength")
    below.plot(x, blocks.shear, label="shear of the drive $q$", **series(0))
    below.plot(x, blocks.pressure, label="pressure $p$", **series(1))
    if onset is not None:
        middle = float(onset["critical_position"].item()) * scale
        half = 0.5 * float(onset["critical_patch_length"].item()) * scale
        for axes in (top, below):
            axes.axvspan(middle - half, middle + half, color=ACCENT, alpha=0.3, linewidth=0.0)
        below.plot([], [], color=ACCENT, alpha=0.3, linewidth=6.0, label="critical patch")
    below.set(xlabel=f"position $x$ ({unit})", ylabel="over the mean", ylim=(0.0, None))
    with paper_style():
        figure.legend(loc="outside lower center", ncols=2)
    return np.array([top, below])


def _draw_blocks(axes: Axes, problem: Problem, scale: float) -> None:
    """Draw two blocks, and arrows for the drive. The heights have a separate scale.

    Blocks 40 mm high and 100 mm long. The upper block is pushed to the right at
    its left end, at a height of 10 mm, and the lower block to the left:

    >>> import stiction as st
    >>> from types import SimpleNamespace
    >>> def drawn(drive):
    ...     specimen = SimpleNamespace(height=0.04, drive=drive)
    ...     problem = SimpleNamespace(specimen=specimen, interface=st.Interface(0.1, 8))
    ...     axes = new_figure(3.0, 2.0).subplots()
    ...     _draw_blocks(axes, problem, 1e3)
    ...     return axes
    >>> def arrows(patches):
    ...     rows = []
    ...     for xy in [patch.get_xy() for patch in patches]:
    ...         low, high, head = xy[:, 0].min(), xy[:, 0].max(), xy[xy[:, 1].argmax(), 0]
    ...         height = f"{xy[:, 1].mean():.0f}"
    ...         ends = f"{low:.0f}", f"{high:.0f}"
    ...         rows.append(("-->" if 2.0 * head > low + high else "<--", *ends, height))
    ...     return rows
    >>> axes = drawn(st.Pusher(height=0.01, width=0.005))
    >>> [(part.get_xy(), part.get_width(), part.get_height()) for part in axes.patches[:2]]
    [((0.0, -40.0), 100.0, 40.0), ((0.0, 0.0), 100.0, 40.0)]
    >>> arrows(axes.patches[2:])
    [('-->', '-14', '0', '10'), ('<--', '-14', '0', '-10')]
    >>> [line.get_xydata().round(6).tolist() for line in axes.lines[1:]]
    [[[0.0, 7.5], [0.0, 12.5]], [[0.0, -12.5], [0.0, -7.5]]]

    A pusher at the right pushes the upper block to the left, and pushers on both
    sides drive it to the right. The last drive is shear at both faces:

    >>> arrows(drawn(st.Pusher(height=0.01, width=0.005, side="right")).patches[2:])
    [('<--', '100', '114', '10'), ('-->', '100', '114', '-10')]
    >>> arrows(drawn(st.Pusher(height=0.01, width=0.005, side="both")).patches[2:4])
    [('-->', '-14', '0', '10'), ('-->', '100', '114', '10')]
    >>> axes = drawn(st.TopShear())
    >>> arrows(axes.patches[2:])
    [('-->', '36', '64', '46'), ('<--', '36', '64', '-46')]
    >>> [line.get_ydata().round(6).tolist() for line in axes.lines[1:]]
    [[40.0, 40.0], [-40.0, -40.0]]
    >>> [round(float(end), 6) for end in (*axes.get_xlim(), *axes.get_ylim())]
    [-20.0, 120.0, -52.0, 52.0]
    """
    blocks, length = problem.specimen, problem.interface.measure * scale
    assert blocks is not None  # `problem.blocks` has refused it
    height, drive = blocks.height * scale, blocks.drive
    for low in (-height, 0.0):
        axes.add_patch(Rectangle((0.0, low), length, height, facecolor=PALE, edgecolor=QUIET))
    axes.plot([0.0, length], [0.0, 0.0], color="black", linewidth=1.2)
    arrow = {"color": ACCENT, "width": 0.004 * length, "length_includes_head": True}
    reach, head = 0.14 * length, {"head_width": 0.03 * length}
    for up in (1.0, -1.0):
        if isinstance(drive, Pusher):
            at, half = up * drive.height * scale, 0.5 * drive.width * scale
            sides = ("left", "right") if drive.side == "both" else (drive.side,)
            for side in sides:
                end = 0.0 if side == "left" else length
                # Upper block: pushed at the left, or pulled if driven
                # to the left.
                pushed = up if side == "left" or drive.side == "both" else -up
                outside = -1.0 if side == "left" else 1.0
                start = end + outside * reach if pushed * outside < 0.0 else end
                axes.arrow(start, at, pushed * reach, 0.0, **arrow, **head)
                axes.plot([end, end], [at - half, at + half], color=ACCENT, linewidth=3.0)
        else:
            axes.plot([0.0, length], [up * height] * 2, color=ACCENT, linewidth=3.0)
            axes.arrow(
                0.5 * (length - up * 2.0 * reach), up * 1.15 * height, 2.0 * up * reach, 0.0,
                **arrow, **head,
            )  # fmt: skip
    axes.set(xlim=(-0.2 * length, 1.2 * length), ylim=(-1.3 * height, 1.3 * height))


def _draw_slider(problem: Problem, sample: Sample) -> NDArray[Any]:
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
        _draw_slider_and_base(top, problem, scale)
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


def _draw_slider_and_base(axes: Axes, problem: Problem, scale: float) -> None:
    """Draw a slider, its base and arrows for the drive and the pressing, to scale.

    A slider 100 mm long on a base with 60 mm behind it and 90 mm ahead, which
    is glued at its bottom:

    >>> import stiction as st
    >>> from types import SimpleNamespace
    >>> def drawn(bottom="fixed", **slider):
    ...     base = st.Base(height=0.03, behind=0.06, ahead=0.09, bottom=bottom)
    ...     slider = {"height": 0.05, "drive": st.Pusher(height=0.02, width=0.01)} | slider
    ...     problem = SimpleNamespace(interface=st.Interface(0.1, 8, ends="free"),
    ...                               specimen=st.Slider(base=base, **slider))
    ...     axes = new_figure(3.0, 2.0).subplots()
    ...     _draw_slider_and_base(axes, problem, 1e3)
    ...     return axes
    >>> def rounded(*values):
    ...     return [round(float(value), 6) for value in values]
    >>> axes = drawn()
    >>> [rounded(*part.get_xy(), part.get_width(), part.get_height()) for part in axes.patches[:2]]
    [[0.0, 0.0, 100.0, 50.0], [-60.0, 0.0, 250.0, -30.0]]
    >>> [line.get_xydata().round(6).tolist() for line in axes.lines]
    [[[0.0, 0.0], [100.0, 0.0]], [[-60.0, -30.0], [190.0, -30.0]], [[0.0, 15.0], [0.0, 25.0]]]
    >>> def arrow(patch):  # from, to, height
    ...     x, y = patch.get_xy().T
    ...     ends = sorted([x.min(), x.max()], key=lambda end: -abs(end - x[y.argmax()]))
    ...     return rounded(*ends, 0.5 * (y.min() + y.max()))
    >>> arrow(axes.patches[2])
    [-20.0, 0.0, 20.0]
    >>> rounded(*axes.get_xlim(), *axes.get_ylim())
    [-60.0, 190.0, -33.0, 80.0]

    Pushed at the right, the base ahead of the slider lies to its left. Arrows of
    a tilted pressure are long at the leading end:

    >>> axes = drawn("rollers", drive=st.Pusher(height=0.02, width=0.01, side="right"), tilt=0.5)
    >>> rounded(*axes.patches[1].get_xy()), [rounded(*line.get_ydata()) for line in axes.lines]
    ([-90.0, 0.0], [[0.0, 0.0], [15.0, 25.0]])
    >>> arrow(axes.patches[2])
    [120.0, 100.0, 20.0]
    >>> [rounded(xy[:, 0].mean(), np.ptp(xy[:, 1]), xy[:, 1].min())
    ...  for xy in (axes.patches[3].get_xy(), axes.patches[-1].get_xy())]
    [[100.0, 5.0, 55.0], [0.0, 10.0, 55.0]]

    Shear at the top, and a plate:

    >>> axes = drawn(drive=st.TopShear(), pressing="plate")
    >>> arrow(axes.patches[2]), [rounded(*line.get_ydata()) for line in axes.lines]
    ([50.0, 70.0, 52.5], [[0.0, 0.0], [-30.0, -30.0], [50.0, 50.0]])
    """
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


def precursors(
    result: xr.Dataset | Sequence[xr.Dataset],
    *,
    problem: Problem | None = None,
    measured: Curves | None = None,
) -> NDArray[Any]:
    """Draw the curve of a machine, and the places that slip in arrested events.

    Parameters
    ----------
    result : Dataset, or sequence of Dataset
        From `stiction.equilibrium_path` for a specimen, at many loads.
        Several paths, for samples from the same field, are drawn as a
        median, with a band that contains 90 % of them at each travel.
    problem : Problem, optional
        Needed only if the result does not hold it.
    measured : Curves, optional
        From `stiction.read_curve`. The curves are drawn over the
        prediction, with their precursors. Marks at the upper edge of the
        lower panel show the travel at which these precursors begin.

    Returns
    -------
    (2,) array of matplotlib.axes.Axes
        The upper panel shows force over travel of the drives, or mean
        stress if the blocks have no thickness. The lower panel shows
        the extent of each event at its travel.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> problem = st.Problem(
    ...     solid=st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
    ...     interface=st.Interface(length=0.1, nodes=128),
    ...     friction=st.LinearWeakening(weakening_rate=0.2e12, residual_ratio=0.5),
    ...     specimen=st.Blocks(height=0.05, drive=st.Pusher(height=0.008, width=0.005)),
    ... )
    >>> strength = 1e6 + 3e8 * (problem.interface.x - 0.02) ** 2
    >>> path = st.equilibrium_path(problem, strength, np.linspace(0.0, 1.3e6, 50))
    >>> st.plot.precursors(path)[1].get_ylabel()
    'position $x$ (mm)'
    """
    results = [*named(result).values()]
    tests = () if measured is None else check("measured", measured, Curves)
    paths = [curve_of(path) for path in results]
    _, _, name, event = paths[0]
    if any(path[2] != name for path in paths):
        raise InputError("result: some paths hold forces, and some stresses. Draw two figures")
    si = str(results[0][name].attrs["units"])
    if tests and (tests.unit, tests[0].travel_unit) != (si, "m"):
        raise InputError(
            f"measured: curves are {tests.unit} over {tests[0].travel_unit}, but the prediction"
            f" is {si} over m. Pass speed= to st.read_curve to turn time into travel"
        )
    interface = problem_of(results[0], problem).interface
    scale, unit = unit_for("m", interface.lengths)
    length, length_unit = unit_for("m", np.concatenate([path[0] for path in paths]))
    factor, force_unit = unit_for(si, np.concatenate([path[1] for path in paths]))
    figure = new_figure(1.35 * COLUMN, 1.45 * COLUMN)
    with paper_style():
        above, below = figure.subplots(2, sharex=True, height_ratios=(1.3, 1.0))
        if len(paths) > 1:
            _draw_band(above, paths, length, factor)
        else:
            travel, force, _, _ = paths[0]
            above.plot(travel * length, force * factor, **series(0), label="predicted")
            start, high = results[0]["event_travel"].values, results[0][event].values
            style: dict[str, Any] = {"color": ACCENT, "markersize": 3.5}
            above.plot(start * length, high * factor, "o", label="arrested events", **style)
        width, edge = 2.0 / len(results) ** 0.5, interface.measure * scale
        for path in results:
            start = path["event_start"].values * scale
            end = start + path["event_length"].values * scale
            at = path["event_travel"].values * length
            events = below.vlines(at, start, end, color=ACCENT, linewidth=width)
        events.set_label("slips in an arrested event")
        for test in tests:
            travel, force = test.travel * length, test.force * factor
            (curve,) = above.plot(travel, force, color=INK, linewidth=0.5, alpha=0.7)
            at = test.drops.travel * length
            (drops,) = above.plot(at, test.drops.force * factor, "v", color=INK, markersize=3.0)
            top = np.full(at.size, edge)
            (marks,) = below.plot(at, top, "|", color=INK, markersize=5.0, clip_on=False)
        if tests:
            curve.set_label(f"{len(tests)} tests")
            drops.set_label("measured precursors")
            marks.set_label("measured precursors")
        above.set_ylabel(with_unit("force" if name == "force" else "mean stress", force_unit))
        below.set(xlabel=with_unit("travel of the drive", length_unit), ylim=(0.0, edge))
        below.set_ylabel(f"position $x$ ({unit})")
        above.legend()
        below.legend(loc="upper left", bbox_to_anchor=(0.0, 0.95))
    return np.array([above, below])


def curve_of(result: xr.Dataset) -> tuple[Array, Array, str, str]:
    """Return travel (m), force (N), the name of the force, and the name of the force at events.

    If the thickness is unknown, the force is the mean stress (Pa).

    An event at the load 2 begins at the travel 0.3 and the force 20, and ends at
    the travel 0.35 and the force 13. The curve holds both between the loads:

    >>> path = xr.Dataset({
    ...     "travel": ("load", [0.1, 0.2, 0.5]), "force": ("load", [10.0, 15.0, 18.0]),
    ...     "mean_stress": ("load", [1.0, 1.5, 1.8]), "event_load": ("event", [2.0]),
    ...     "event_start": ("event", [0.0]), "event_travel": ("event", [0.3]),
    ...     "event_travel_step": ("event", [0.05]), "event_force": ("event", [20.0]),
    ...     "event_force_drop": ("event", [7.0]), "event_stress": ("event", [2.0]),
    ...     "event_stress_drop": ("event", [0.75])}, {"load": [1.0, 2.0, 3.0]})
    >>> travel, force, name, event = curve_of(path)
    >>> travel.round(6).tolist(), force.tolist(), name, event
    ([0.1, 0.2, 0.3, 0.35, 0.5], [10.0, 15.0, 20.0, 13.0, 18.0], 'force', 'event_force')
    >>> _, force, name, event = curve_of(path.drop_vars("force"))
    >>> force.tolist(), name, event
    ([1.0, 1.5, 2.0, 1.25, 1.8], 'mean_stress', 'event_stress')
    """
    need(result, "travel", "event_start", hint=". Give the path of a specimen")
    name = "force" if "force" in result else "mean_stress"
    event = "event_force" if name == "force" else "event_stress"
    high, drop = result[event].values, result[f"{event}_drop"].values
    start, step = result["event_travel"].values, result["event_travel_step"].values
    load, before = result["load"].values, result["event_load"].values
    order = np.argsort(np.concatenate([load, before, before]), kind="stable")
    travel = np.concatenate([result["travel"].values, start, start + step])[order]
    force = np.concatenate([result[name].values, high, high - drop])[order]
    return travel, force, name, event


def _draw_band(axes: Axes, paths: Sequence[Any], length: float, factor: float) -> None:
    """Draw a band with 90 % of several curves, up to the travel at which half have slid.

    Curves rise by 1, 2, ... 101 over their travel 1, and by less than a half of
    them are longer. At the travel 0.5 a load is not known:

    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> travel = np.array([0.0, 0.5, 1.0, 3.0])
    >>> force = np.array([0.0, np.nan, 1.0, 3.0])
    >>> sizes = {k: 4 if k > 60 else 3 for k in range(1, 102)}
    >>> paths = [(travel[:size], k * force[:size], "", "") for k, size in sizes.items()]
    >>> _draw_band(axes, paths, 1e3, 0.1)
    >>> (middle,) = axes.lines
    >>> middle.get_xdata()[[0, -1]].tolist(), round(float(middle.get_ydata()[-1]), 6)
    ([0.0, 1000.0], 5.1)
    >>> (band,) = axes.collections
    >>> ends = band.get_paths()[0].vertices
    >>> ends[ends[:, 0] == 1000.0, 1].min().round(6).tolist(), ends[:, 1].max().round(6).tolist()
    (0.6, 9.6)
    >>> band.get_label()
    '90 % of 101 predicted'
    """
    known = [np.isfinite(travel) & np.isfinite(force) for travel, force, *_ in paths]
    ends = [travel[there].max() for (travel, *_), there in zip(paths, known, strict=True)]
    grid = np.linspace(0.0, float(np.median(ends)), 400)
    rows = np.stack([
        np.interp(grid, travel[there], force[there], right=np.nan)
        for (travel, force, *_), there in zip(paths, known, strict=True)
    ])  # fmt: skip
    low, middle, high = np.nanquantile(rows, [0.05, 0.5, 0.95], axis=0) * factor
    style = series(0)
    axes.fill_between(
        grid * length, low, high, color=style["color"], alpha=0.25, linewidth=0.0,
        label=f"90 % of {len(paths)} predicted",
    )  # fmt: skip
    axes.plot(grid * length, middle, **style, label="median of predicted")
