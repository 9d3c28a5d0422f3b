"""Figures of any run: densities of the onset, and its quantiles against what is swept."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from stiction.errors import InputError
from stiction.report.style import PAGE, color, new_figure, panel, paper_style, save_figure, series
from stiction.results import DIRECTION
from stiction.statistics.densities import density
from stiction.statistics.quantiles import quantiles
from stiction.stored_run import StoredRun

CURVES = 6
MOST_FIGURES = 12
FEWEST = 20
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True)
class Drawn:
    """A figure and what it shows.

    Attributes
    ----------
    name : str
        File name without ending.
    figure : Figure
    caption : str
    """

    name: str
    figure: Figure
    caption: str


def run_figures(stored: StoredRun) -> Iterator[Drawn]:
    """The figures of a run, one after the other; draw them inside `paper_style`."""
    result = stored.dataset(only=["critical_stress", "critical_position"])
    dims = [axis.dim for axis in stored.study.axes]
    if not dims:
        yield Drawn("onset", _single(result), "Critical stress and critical position.")
        return
    # The longest axis runs along the page, the next one over the curves, the others over figures.
    order = sorted(dims, key=lambda dim: -result.sizes[dim])
    along, others = order[0], order[1:]
    within = others[:1]
    names = [range(result.sizes[dim]) for dim in others[1:]]
    for number, steps in enumerate(itertools.islice(itertools.product(*names), MOST_FIGURES)):
        chosen = dict(zip(others[1:], steps, strict=True))
        part = result.isel(chosen)
        suffix = f"-{number}" if chosen else ""
        fixed = ", ".join(f"{_label(part[dim])} {_shown(part[dim])}" for dim in chosen)
        note = f" Held fixed: {fixed}." if fixed else ""
        densities = part if not within else part.isel({within[0]: 0})
        if within:
            first = f"{_label(part[within[0]])} {_shown(part[within[0]][0])}"
            held = f" At {first}." + note
        else:
            held = note
        yield Drawn(
            f"densities{suffix}",
            _densities(densities, along),
            "Densities of the critical stress and of the critical position." + held,
        )
        yield Drawn(
            f"quantiles{suffix}",
            _quantiles(part, along, within),
            "Median of the critical stress with its 95 % confidence interval; band: between"
            " quartiles"
            + (". " if within else ", pale band: between the 5 % and 95 % quantiles.")
            + note,
        )


def _finite(values: Any) -> NDArray[np.float64]:
    array = np.asarray(values, dtype=np.float64).ravel()
    return array[np.isfinite(array)]


def _single(result: xr.Dataset) -> Figure:
    figure = new_figure(PAGE, 2.6)
    places = _components(result)
    left, *rest = figure.subplots(1, 1 + len(places))
    _density_curve(left, _finite(result["critical_stress"]) * 1e-6, None, 0)
    for right, values in zip(rest, places.values(), strict=True):
        _histogram(right, _finite(values) * 1e3, None, 0)
    _finish(left, dict(zip(places, rest, strict=True)))
    return figure


def _components(result: xr.Dataset) -> dict[str, xr.DataArray]:
    """The critical position by what it is called; on a plane along each direction."""
    place = result["critical_position"]
    if DIRECTION not in place.dims:
        return {"critical position": place}
    return {
        f"critical position, {direction.item()}": place.sel({DIRECTION: direction})
        for direction in place[DIRECTION]
    }


def _densities(result: xr.Dataset, along: str) -> Figure:
    figure = new_figure(PAGE, 3.0)
    left, *rest = figure.subplots(1, 1 + len(_components(result)))
    steps = np.unique(np.linspace(0, result.sizes[along] - 1, CURVES).round().astype(int))
    for number, step in enumerate(steps):
        part = result.isel({along: step})
        label = _shown(result[along][step])
        _density_curve(left, _finite(part["critical_stress"]) * 1e-6, label, number)
        for right, values in zip(rest, _components(part).values(), strict=True):
            _histogram(right, _finite(values) * 1e3, label, number)
    _finish(left, dict(zip(_components(result), rest, strict=True)))
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3, title=_label(result[along]))
    return figure


def _density_curve(axes: Axes, values: NDArray[np.float64], label: str | None, number: int) -> None:
    if values.size >= FEWEST and np.ptp(values) > 0.0:
        found = density(values)
        axes.plot(found.x, found.value, label=label, **series(number))
    elif values.size:
        axes.plot(
            values, np.zeros_like(values), "|", color=color(number), label=label, clip_on=False
        )


def _histogram(axes: Axes, values: NDArray[np.float64], label: str | None, number: int) -> None:
    if values.size:
        cells = int(np.clip(values.size / 50, 5, 40))
        counts, edges = np.histogram(values, cells, density=True)
        axes.stairs(counts, edges, label=label, **series(number))


def _finish(left: Axes, places: dict[str, Axes]) -> None:
    left.set_xlabel("critical stress (MPa)")
    left.set_ylabel("density (1/MPa)")
    left.set_ylim(bottom=0.0)
    panel(left, "a")
    for letter, (name, right) in zip("bc", places.items(), strict=False):
        right.set_xlabel(f"{name} (mm)")
        right.set_ylabel("density (1/mm)")
        right.set_ylim(bottom=0.0)
        panel(right, letter)


def _quantiles(result: xr.Dataset, along: str, within: list[str]) -> Figure:
    figure = new_figure(PAGE * 0.75, 3.2)
    axes = figure.subplots()
    place, ticks = _places(result[along])
    steps: list[int | None] = [None]
    if within:
        last = result.sizes[within[0]] - 1
        steps = [int(s) for s in np.unique(np.linspace(0, last, CURVES).round().astype(int))]
    for number, step in enumerate(steps):
        part = result["critical_stress"]
        label = None
        if step is not None:
            part = part.isel({within[0]: step})
            label = _shown(result[within[0]][step])
        table = _table(part, along)
        if step is None:
            axes.fill_between(place, table[0], table[4], color=color(0), alpha=0.12, linewidth=0)
        band = 0.25 if step is None else 0.12
        axes.fill_between(place, table[1], table[3], color=color(number), alpha=band, linewidth=0)
        errors = np.abs(table[5:] - table[2])
        axes.errorbar(
            place, table[2], yerr=errors, capsize=2, label=label, **series(number, marker=True)
        )
    axes.set_xlabel(_label(result[along]))
    axes.set_ylabel("critical stress (MPa)")
    if ticks is not None:
        axes.set_xticks(place, ticks)
    elif _is_log(place):
        axes.set_xscale("log")
        if place.size <= 8:  # powers of ten would not name the steps
            axes.set_xticks(place, [f"{value:.3g}" for value in place])
            axes.minorticks_off()
    if within:
        axes.legend(title=_label(result[within[0]]))
    return figure


def _table(part: xr.DataArray, along: str) -> NDArray[np.float64]:
    """Quantiles at `LEVELS` and the interval of the median, (7, steps), MPa."""
    columns = []
    for step in range(part.sizes[along]):
        values = _finite(part.isel({along: step})) * 1e-6
        if values.size == 0:
            columns.append(np.full(7, np.nan))
            continue
        found = quantiles(values, LEVELS)
        low = max(found.lower[2], values.min())
        high = min(found.upper[2], values.max())
        columns.append(np.concatenate([found.value, [low, high]]))
    return np.array(columns).T


def _places(coordinate: xr.DataArray) -> tuple[NDArray[np.float64], list[str] | None]:
    """Where on the axis the steps are, and their names if they are no numbers."""
    values = coordinate.values
    if values.dtype.kind in "if" and np.unique(values).size == values.size:
        return values.astype(np.float64) * _unit(coordinate)[0], None
    return np.arange(values.size, dtype=np.float64), [
        _shown(coordinate[i]) for i in range(len(values))
    ]


def _is_log(place: NDArray[np.float64]) -> bool:
    """Whether the steps are more nearly geometric than arithmetic."""
    ordered = np.sort(place)
    if ordered.size < 3 or ordered[0] <= 0.0:
        return False
    linear, log = np.diff(ordered), np.diff(np.log(ordered))
    return bool(np.std(log) / np.mean(log) < np.std(linear) / np.mean(linear))


def _unit(coordinate: xr.DataArray) -> tuple[float, str]:
    """Factor and unit in which a swept quantity is shown."""
    unit = str(coordinate.attrs.get("units", "1"))
    if unit == "m" and np.max(np.abs(coordinate.values)) < 1.0:
        return 1e3, "mm"
    if unit == "Pa" and np.max(np.abs(coordinate.values)) >= 1e4:
        return 1e-6, "MPa"
    return 1.0, unit


def _label(coordinate: xr.DataArray) -> str:
    name = str(coordinate.name).replace("_", " ")
    unit = _unit(coordinate)[1]
    return name if unit == "1" else f"{name} ({unit})"


def _shown(step: xr.DataArray) -> str:
    """The value of one step of a sweep."""
    value = step.item()
    if isinstance(value, float):
        return f"{value * _unit(step)[0]:.4g}"
    text = str(value)
    return text if len(text) <= 40 else text[:37] + "..."


def write_figures(stored: StoredRun, folder: Path) -> Iterator[Path]:
    """Write every figure as PNG and PDF, and say where.

    Raises
    ------
    InputError
        If nothing is stored yet.
    StoreError
        If one cannot be written.
    """
    if not stored.status().done:
        raise InputError(f"{stored.path}: no sample is stored yet")
    with paper_style():
        for drawn in run_figures(stored):
            for ending in ("png", "pdf"):
                path = folder / f"{drawn.name}.{ending}"
                save_figure(drawn.figure, path)
                yield path
