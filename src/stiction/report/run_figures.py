"""Figures of any run: densities of the onset, and its quantiles against what is swept."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from stiction.errors import InputError
from stiction.plot.axes import scaled, shown_quantity
from stiction.plot.distributions import (
    described,
    draw_sweep,
    draw_values,
    finish_density,
    quantiles,
    step_text,
)
from stiction.plot.style import PAGE, new_figure, panel, paper_style, save_figure
from stiction.results import DIRECTION
from stiction.stored_run import StoredRun

MOST_FIGURES = 12


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
    names = ["critical_stress", "friction_coefficient", "critical_position"]
    result = stored.dataset(only=names)
    what = scaled(result[shown_quantity(result)])[2].partition(" (")[0]
    dims = [axis.dim for axis in stored.study.axes]
    if not dims:
        yield Drawn("onset", _single(result), f"{what.capitalize()} and critical position.")
        return
    # The longest axis runs along the page, the next one over the curves, the others over figures.
    order = sorted(dims, key=lambda dim: -result.sizes[dim])
    along, others = order[0], order[1:]
    within = others[:1]
    ranges = [range(result.sizes[dim]) for dim in others[1:]]
    for number, steps in enumerate(itertools.islice(itertools.product(*ranges), MOST_FIGURES)):
        chosen = dict(zip(others[1:], steps, strict=True))
        part = result.isel(chosen)
        suffix = f"-{number}" if chosen else ""
        fixed = ", ".join(f"{described(part[dim])} {step_text(part[dim])}" for dim in chosen)
        note = f" Held fixed: {fixed}." if fixed else ""
        densities = part if not within else part.isel({within[0]: 0})
        if within:
            first = f"{described(part[within[0]])} {step_text(part[within[0]][0])}"
            held = f" At {first}." + note
        else:
            held = note
        yield Drawn(
            f"densities{suffix}",
            _densities(densities, along),
            f"Densities of the {what} and of the critical position." + held,
        )
        yield Drawn(
            f"quantiles{suffix}",
            _quantiles(part, along),
            f"Median of the {what} with its 95 % confidence interval; band: between"
            " quartiles"
            + (". " if within else ", pale band: between the 5 % and 95 % quantiles.")
            + note,
        )


def _single(result: xr.Dataset) -> Figure:
    figure = new_figure(PAGE, 2.6)
    places = _components(result)
    left, *rest = figure.subplots(1, 1 + len(places))
    draw_values(left, result[shown_quantity(result)], None, 0)
    for right, values in zip(rest, places.values(), strict=True):
        draw_values(right, values, None, 0)
    _finish(result, left, rest)
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
    places = _components(result)
    left, *rest = figure.subplots(1, 1 + len(places))
    draw_sweep(left, result[shown_quantity(result)], along)
    for right, values in zip(rest, places.values(), strict=True):
        draw_sweep(right, values, along)
    _finish(result, left, rest)
    handles, labels = left.get_legend_handles_labels()
    title = described(result[along])
    figure.legend(handles, labels, loc="outside lower center", ncols=3, title=title)
    return figure


def _finish(result: xr.Dataset, left: Axes, rest: list[Axes]) -> None:
    finish_density(left, result[shown_quantity(result)])
    panel(left, "a")
    for letter, axes, (name, values) in zip("bc", rest, _components(result).items(), strict=False):
        finish_density(axes, values, name)
        panel(axes, letter)


def _quantiles(result: xr.Dataset, along: str) -> Figure:
    figure = new_figure(PAGE * 0.75, 3.2)
    quantiles(result, along=along, ax=figure.subplots())
    return figure


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
