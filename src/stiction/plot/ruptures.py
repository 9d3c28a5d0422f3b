"""Figures of ruptures: slip rate in space and time, front, and film."""

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, LogNorm
from matplotlib.figure import Figure
from PIL import Image

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.files import write_whole
from stiction.base.model import Count, FilePath, check
from stiction.base.progress import Meter, Show
from stiction.base.units import unit_for
from stiction.plot.axes import FigureAxes, need, on_axes, problem_of, with_unit
from stiction.plot.fields import draw_map, map_height, name_line
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, SLIP_RATE, paper_style
from stiction.problem.problem import Problem

Moving = list[tuple[Any, str, Any]]
"""Moving parts of a figure: an artist, the name of its data, and the
data by frame."""

FRAME_TIME = 50
"""Milliseconds that a film shows each frame."""
DECADES = 7.0
"""Number of decades below the largest slip rate that are drawn."""
BEFORE = 0.11
"""Time before the onset that is drawn, in units of L/c_s."""
FILMED_RATE = 1e-3
"""Slip rate above which a frame is in a film, over the largest slip
rate of the run."""
FRONT_SHARE = 0.9
"""Fraction of the nodes that the front has reached at the last of its
contours."""
STRENGTH = LinearSegmentedColormap.from_list("strength", ["0.85", "0.25"])
"""Greys of strength. Nodes that cannot break are white."""
KEEP = ". Keep them with simulate_rupture(save=st.Save(['slip_rate', 'shear_stress']))"


def rupture(
    run: xr.Dataset, *, problem: Problem | None = None, ax: Axes | None = None
) -> FigureAxes:
    """Draw the slip rate in space and time, or the advance of the front on a plane.

    Parameters
    ----------
    run : Dataset
        From `simulate_rupture`, on a line with `slip_rate`.
    problem : Problem, optional
        Needed only if the run does not hold it.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on. By default new axes are made.

    Returns
    -------
    matplotlib.axes.Axes
        If a patch became unstable, a dot marks the onset, at time zero.
        On a line, time begins shortly before the onset and ends shortly
        after the last slip, and points that slip seven decades slower
        than the fastest point are white. On a plane, the front is drawn
        at equal intervals of time on a map of the strength.

    Raises
    ------
    InputError
        If a variable was not kept.
    """
    need(run, "onset_time", "critical_position")
    problem = problem_of(run, problem)
    if problem.interface.is_plane:
        need(run, "peak_strength", "arrival_time")
        with on_axes(ax, height=map_height(problem.interface, 1.6)) as axes:
            _draw_front(axes, run, problem)
        return axes
    need(run, "slip_rate", hint=KEEP)
    with on_axes(ax, width=PAGE, height=3.4) as axes:
        _draw_space_time(axes, run, problem)
    return axes


def film(
    run: xr.Dataset, path: str | Path, *, frames: int = 160, progress: Show = True
) -> Path:
    """Write a film of the stress and the slip rate in a rupture.

    Parameters
    ----------
    run : Dataset
        From `simulate_rupture`, with `slip_rate` and `shear_stress`.
    path : path
        Ends in .gif.
    frames : int
        Maximum number of frames. The frames are evenly spaced between
        the first and the last slip that is faster than a thousandth of
        the fastest, so that creep is left out.
    progress : bool or callable
        As in `stiction.monte_carlo`.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If a variable was not kept, or the path does not end in .gif.
    StoreError
        If the file cannot be written.
    """
    need(run, "slip_rate", "shear_stress", "peak_strength", hint=KEEP)
    check("frames", frames, Count)
    target = check("path", path, FilePath)
    if target.suffix != ".gif":
        raise InputError(f"path: must end in .gif, got {target.name!r}")
    top = run["top_slip_rate"].values
    fast = np.flatnonzero(top >= FILMED_RATE * top.max())
    first, last = max(fast[0] - 1, 0), min(fast[-1] + 1, top.size - 1)
    shown = np.unique(np.linspace(first, last, frames).round().astype(int))
    images, still = [], Image.Dither.NONE  # with dithering, parts at rest would flicker
    with paper_style(), Meter("film", shown.size, progress, unit="frames") as meter:
        figure, moving = (_plane_film if "y" in run.dims else _line_film)(run)
        canvas = FigureCanvasAgg(figure)
        canvas.draw()
        figure.set_layout_engine("none")  # the panels must not move between frames
        for artist, _, _ in moving:  # to draw only these for each frame is 40 times as fast
            artist.set_animated(True)
        canvas.draw()
        background = canvas.copy_from_bbox(figure.bbox)
        for i in shown:
            canvas.restore_region(background)
            for artist, name, values in moving:
                artist.set(**{name: values[i]})
                figure.draw_artist(artist)
            frame = Image.fromarray(np.asarray(canvas.buffer_rgba()).copy()).convert("RGB")
            images.append(frame.quantize(128, Image.Quantize.FASTOCTREE, dither=still))
            meter.advance()
    save = partial(
        images[0].save, format="GIF", save_all=True, append_images=images[1:],
        duration=FRAME_TIME, loop=0,
    )  # fmt: skip
    write_whole(target, save)
    return target


def _since_onset(run: xr.Dataset, times: str = "time") -> tuple[Array, str]:
    """Return the times of a run, s, and the name of the event at time zero, such as the onset.

    >>> run = xr.Dataset(
    ...     {"onset_time": 2.0, "time": ("time", [1.0, 5.0]), "arrival_time": ("x", [3.0])})
    >>> since, name = _since_onset(run)
    >>> since.tolist(), name, _since_onset(run, "arrival_time")[0].tolist()
    ([-1.0, 3.0], ' since the onset', [1.0])
    >>> since, name = _since_onset(run.assign(onset_time=np.inf))
    >>> since.tolist(), name
    ([1.0, 5.0], '')
    """
    onset = float(run["onset_time"])
    if np.isfinite(onset):
        return run[times].values - onset, " since the onset"
    return run[times].values, ""


def _masked_by_decade(slip_rate: Array, decades: float) -> tuple[Any, LogNorm]:
    """Return slip rates and their colours.

    Rates many decades below the largest are masked.

    >>> rates, norm = _masked_by_decade(np.array([0.0, 0.019, 0.021, 2.0]), 2.0)
    >>> rates.mask.tolist(), round(norm.vmin, 9), norm.vmax
    ([True, True, False, False], 0.02, 2.0)
    >>> _masked_by_decade(np.zeros(3), 2.0)[1].vmax
    1e-12
    """
    top = max(float(slip_rate.max()), 1e-12)
    low = top * 10.0**-decades
    return np.ma.masked_less(slip_rate, low), LogNorm(low, top)


def _strength(run: xr.Dataset) -> tuple[Array, float, str]:
    """Return the peak strength, Pa (NaN if infinite), and the factor and unit of a scale.

    >>> strength, factor, unit = _strength(xr.Dataset({"peak_strength": ("x", [2e6, np.inf, 4e6])}))
    >>> strength.tolist(), round(factor * 1e6, 9), unit
    ([2000000.0, nan, 4000000.0], 1.0, 'MPa')
    """
    strength = run["peak_strength"].where(np.isfinite(run["peak_strength"])).values
    return strength, *unit_for("Pa", strength)


def _draw_space_time(axes: Axes, run: xr.Dataset, problem: Problem) -> None:
    """Draw the slip rate of a line over x and time.

    >>> import stiction as st
    >>> from stiction.plot.axes import new_figure
    >>> problem = st.paper.problem(nodes=256)
    >>> times, rates = np.arange(9.0) * 1e-5 + 1e-3, np.zeros((9, 256))
    >>> rates[3:6, 10:20] = 2.0
    >>> run = xr.Dataset({"onset_time": 1.02e-3, "critical_position": 0.03, "time": ("time", times),
    ...                   "slip_rate": (("time", "x"), rates)})
    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> _draw_space_time(axes, run, problem)

    The time begins 0.11 x 0.1 m / 924 m/s = 11.9 µs before the onset, and ends as
    long after the last slip, at 30 µs:

    >>> (mesh,) = axes.collections
    >>> edges = mesh.get_coordinates()
    >>> edges[[0, 1, -1], 0, 1].round(6).tolist(), axes.get_ylabel()
    ([-10.0, -5.0, 40.0], 'time since the onset (µs)')
    >>> edges[0, [0, 1, -1], 0].round(6).tolist()  # cells of 0.390625 mm around nodes
    [-0.195312, 0.195312, 99.804688]
    >>> axes.lines[0].get_xydata().tolist()
    [[30.0, 0.0]]
    """
    interface = problem.interface
    since, begin = _since_onset(run)
    slip_rate, norm = _masked_by_decade(run["slip_rate"].values, DECADES)
    beside = BEFORE * interface.measure / problem.solid.shear_wave_speed
    slips = since[np.ma.getdata(slip_rate).any(axis=1)]  # and a little before and after
    near = (since >= -beside) & (since <= slips.max(initial=-np.inf) + beside)
    if near.sum() > 2:
        since, slip_rate = since[near], slip_rate[near]
    factor, unit = unit_for("s", since)
    length, _ = unit_for("m", interface.lengths)
    along = interface.x[0] + (np.arange(interface.size + 1) - 0.5) * interface.spacing
    edges = np.concatenate([since[:1], 0.5 * (since[1:] + since[:-1]), since[-1:]])
    mesh = axes.pcolormesh(
        along * length, edges * factor, slip_rate, norm=norm, cmap=SLIP_RATE, rasterized=True
    )
    if begin:
        place = float(run["critical_position"]) * length
        axes.plot(
            [place], [0.0], "o", color=INK, markeredgecolor="white", markersize=4.5,
            clip_on=False, zorder=5,
        )  # fmt: skip
    name_line(axes, interface, with_unit(f"time{begin}", unit))
    axes.figure.colorbar(mesh, ax=axes, extend="min", label="slip rate (m/s)")


def _draw_front(axes: Axes, run: xr.Dataset, problem: Problem) -> None:
    """Draw the strength of a plane, and the front at equal intervals of time.

    >>> import stiction as st
    >>> from stiction.plot.axes import new_figure
    >>> from types import SimpleNamespace
    >>> interface = st.Interface((0.2, 0.1), (8, 10))
    >>> x, y = np.meshgrid(*interface.coordinates.values(), indexing="ij")
    >>> run = xr.Dataset({"onset_time": 0.0, "critical_position": ("direction", [0.05, 0.02]),
    ...                   "peak_strength": (("x", "y"), 2e6 + 1e6 * x),
    ...                   "arrival_time": (("x", "y"), 1e-3 * (x + 2 * y))})
    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> _draw_front(axes, run, SimpleNamespace(interface=interface))
    >>> axes.lines[0].get_xydata().round(9).tolist()
    [[50.0, 20.0]]
    >>> contours = axes.collections[-1]
    >>> latest = 1e6 * np.quantile((1e-3 * (x + 2 * y))[x + y > 0.0], FRONT_SHARE)
    >>> (contours.levels / latest * 9.0).round(6).tolist()
    [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0]
    >>> at = contours.get_paths()[3].vertices
    >>> bool(np.allclose(at[:, 0] + 2.0 * at[:, 1], contours.levels[3], rtol=1e-6))
    True
    """
    interface, (strength, factor, unit) = problem.interface, _strength(run)
    text = rf"strength $\tau_p$ ({unit})"
    draw_map(axes, interface, strength * factor, text, cmap=STRENGTH)
    since, begin = _since_onset(run, "arrival_time")
    scale, time_unit = unit_for("s", since)
    # Next to the ends of an interface, nodes
    # creep long after the front has passed.
    after = since[since > 0.0]
    latest = scale * float(np.quantile(after, FRONT_SHARE)) if after.size else 0.0
    length, _ = unit_for("m", interface.lengths)
    if latest > 0.0:
        x, y = (length * place for place in interface.coordinates.values())
        levels = np.linspace(0.0, latest, 10)[1:-1]
        since = scale * since.T
        lines = axes.contour(x, y, since, levels=levels, cmap="viridis", linewidths=0.9)
        bar = ScalarMappable(lines.norm, lines.cmap)
        text = f"front ({time_unit}{begin})"
        axes.figure.colorbar(bar, ax=axes, label=text, shrink=0.8)
    place = length * run["critical_position"].values
    axes.plot(*place, "o", color=ACCENT, markersize=4.0, markeredgecolor="white")


def _clock(figure: Figure, run: xr.Dataset) -> tuple[Any, str, list[str]]:
    """Return the text at the top of a figure, and its content by frame: time and mean stress.

    >>> figure = Figure()
    >>> run = xr.Dataset({"onset_time": 1e-2, "time": ("time", [8e-3, 1e-2, 1.0025e-2]),
    ...                   "mean_stress": ("time", [2e6, 1.5e6, -0.1])})
    >>> title, name, texts = _clock(figure, run)
    >>> for text in texts:
    ...     print(text)
    -2,000.0 µs since the onset,  mean stress 2.000 MPa
    0.0 µs since the onset,  mean stress 1.500 MPa
    25.0 µs since the onset,  mean stress 0.000 MPa
    >>> name, title.get_text() == texts[0]
    ('text', True)
    """
    since, begin = _since_onset(run)
    late = since[since > 0.0]
    factor, unit = unit_for("s", late if late.size else since)
    stress, stress_unit = unit_for("Pa", run["mean_stress"].values)
    mean = (run["mean_stress"].values * stress).round(3) + 0.0  # no minus before a zero
    texts = [
        f"{time:,.1f} {unit}{begin},  mean stress {stress:.3f} {stress_unit}"
        for time, stress in zip(factor * since, mean, strict=True)
    ]
    # The layout leaves room for the text that is there when a film begins.
    title = figure.suptitle(texts[0], x=0.07, ha="left", color=QUIET, fontsize="medium")
    return title, "text", texts


def _line_film(run: xr.Dataset) -> tuple[Figure, Moving]:
    """Return the figure of a line, and what moves.

    >>> run = xr.Dataset(
    ...     {"slip_rate": (("time", "x"), [[0.0, 1.0, 2.0], [0.0, 3.0, 0.5]]), "onset_time": 0.0,
    ...      "shear_stress": (("time", "x"), [[9e6, 2e6, 3e6], [2e6, 1e6, 4e6]]),
    ...      "peak_strength": ("x", [np.inf, 3e6, 5e6]), "mean_stress": ("time", [2e6, 2.1e6])},
    ...     {"time": [0.0, 1e-3], "x": [0.0, 0.1, 0.2]})
    >>> figure, moving = _line_film(run)
    >>> [name for _, name, _ in moving], moving[0][2].tolist()
    (['ydata', 'ydata', 'text'], [[9.0, 2.0, 3.0], [2.0, 1.0, 4.0]])
    >>> moving[1][2].tolist()  # zero on a logarithmic scale
    [[3e-10, 1.0, 2.0], [3e-10, 3.0, 0.5]]
    >>> above, below = figure.axes

    The first node cannot break. Stresses range from 1 to 5 MPa, with a margin of
    6 %, and the nodes that break from 100 to 300 mm, with a margin of 5 %:

    >>> np.round(above.get_ylim(), 6).tolist(), np.round(below.get_xlim(), 6).tolist()
    ([-0.24, 5.24], [90.0, 310.0])
    >>> np.log10(below.get_ylim()).round(6).tolist() == np.log10([3e-7, 9.0]).round(6).tolist()
    True
    """
    length, length_unit = unit_for("m", run["x"].values)
    x, (strength, factor, unit) = run["x"].values * length, _strength(run)
    strength, stress = strength * factor, run["shear_stress"].values * factor
    top = max(float(run["slip_rate"].max()), 1e-12)
    slip_rate = np.maximum(run["slip_rate"].values, 1e-10 * top)
    figure = Figure(figsize=(PAGE * 0.9, 3.8))
    above, below = figure.subplots(2, 1, sharex=True)
    above.plot(x, strength, color=PALE, linewidth=1.0, label=r"$\tau_p$")
    (line,) = above.plot(x, stress[0], color=INK, label=r"$\tau$")
    above.set_ylabel(f"stress ({unit})")
    breaks = np.flatnonzero(np.isfinite(strength))  # barriers carry far more than what breaks
    highest, broken = np.nanmax(strength), stress[:, breaks]
    margin = 0.06 * (highest - min(np.nanmin(strength), broken.min()))
    above.set_ylim(min(0.0, broken.min()) - margin, max(highest, broken.max()) + margin)
    above.legend(loc="upper right", ncols=2)
    (slip,) = below.semilogy(x, slip_rate[0], color=ACCENT)
    below.set_ylim(10.0**-DECADES * top, 3.0 * top)
    first, last = x[breaks[0]], x[breaks[-1]] + x[1] - x[0]
    beside = 0.05 * (last - first) * (breaks.size < x.size)
    below.set_xlim(first - beside, last + beside)
    below.set(xlabel=f"position $x$ ({length_unit})", ylabel="slip rate (m/s)")
    return figure, [(line, "ydata", stress), (slip, "ydata", slip_rate), _clock(figure, run)]


def _plane_film(run: xr.Dataset) -> tuple[Figure, Moving]:
    interface = problem_of(run).interface
    slip_rate, norm = _masked_by_decade(run["slip_rate"].values, 4.0)
    stress = run["shear_stress"].values
    factor, unit = unit_for("Pa", stress)
    stress = stress * factor
    breaks = np.isfinite(run["peak_strength"].values)
    low, high = np.quantile(stress[:, breaks], [0.001, 0.999])
    figure = Figure(figsize=(PAGE * 1.15, 3.4))
    left, right = figure.subplots(1, 2, sharey=True)
    slip = draw_map(left, interface, slip_rate[0], "slip rate (m/s)", norm=norm, cmap=SLIP_RATE)
    text, ends = f"shear stress ({unit})", {"vmin": low, "vmax": high}
    load = draw_map(right, interface, stress[0], text, cmap="cividis", **ends)
    right.label_outer()
    moving = [(slip, "data", slip_rate.swapaxes(1, 2)), (load, "data", stress.swapaxes(1, 2))]
    return figure, [*moving, _clock(figure, run)]
