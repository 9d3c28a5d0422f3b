"""A result as a self-contained HTML page: text, figures and tables."""

import base64
import io
import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import tomli_w
import xarray as xr
from matplotlib.figure import Figure

from stiction import plot
from stiction.base.errors import InputError
from stiction.base.files import write_whole
from stiction.base.variables import DIRECTION
from stiction.ensemble.dataset import GridAxes
from stiction.plot.axes import scaled, shown_quantity, with_unit
from stiction.plot.style import PAGE, paper_style
from stiction.statistics.estimates import mean, quantiles, standard_deviation
from stiction.study.run import StoredRun

MOST_ROWS = 200
QUANTILE_LEVELS = (0.05, 0.5, 0.95)
REPORTED = ("critical_stress", "first_instability", "friction_coefficient", "critical_force")
SPREAD = ("mean", "standard deviation")


CONTROLS = {
    code: "\N{REPLACEMENT CHARACTER}" for code in (*range(9), *range(11, 32), *range(127, 160))
}
"""Letters that steer terminals, because a terminal may print a page."""


@dataclass
class Page:
    """Text, figures, tables and listings in the order in which they are added."""

    title: str
    parts: list[dict[str, Any]] = field(default_factory=list)

    def text(self, text: str, *, warning: bool = False) -> None:
        """Add a paragraph."""
        self.parts.append({"kind": "text", "text": text, "warning": warning})

    def figure(self, figure: Figure, caption: str) -> None:
        """Add a figure as a picture."""
        buffer = io.BytesIO()
        figure.savefig(buffer, format="png", dpi=150)
        data = base64.b64encode(buffer.getvalue()).decode("ascii")
        self.parts.append({"kind": "figure", "caption": caption, "data": data})

    def table(self, title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
        """Add a table. Its numbers are shown with five digits."""
        cells = [[shown(entry) for entry in row] for row in rows]
        self.parts.append({"kind": "table", "title": title, "columns": columns, "rows": cells})

    def listing(self, title: str, text: str) -> None:
        """Add the text of a file."""
        self.parts.append({"kind": "listing", "title": title, "text": text})

    def html(self) -> str:
        """Return the page."""
        environment = jinja2.Environment(
            loader=jinja2.PackageLoader("stiction.cli"),
            autoescape=True,
            trim_blocks=True,
            lstrip_blocks=True,
            undefined=jinja2.StrictUndefined,
        )
        page = environment.get_template("report.html.j2").render(page=self)
        return page.translate(CONTROLS)


def shown(entry: Any) -> str:
    """Return a table entry as text: numbers with five digits, or a dash for a missing value."""
    if entry is None or (isinstance(entry, float | np.floating) and np.isnan(entry)):
        return "\N{EN DASH}"
    if isinstance(entry, int | np.integer) and not isinstance(entry, bool):
        return f"{entry:,}"
    if isinstance(entry, float | np.floating):
        return f"{entry:.5g}".replace("-", "\N{MINUS SIGN}")
    return str(entry)


def write_report(run: StoredRun, path: Path) -> None:
    """Write a page about a run with figures, tables, failed samples, the study and versions."""
    state = run.status()
    if not state.done:
        reasons = state.damaged or ("no sample is stored yet",)
        raise InputError(f"{run.path}: {reason}" for reason in reasons)
    page = Page(run.study.title or "Onset of sliding: a Monte Carlo study")
    page.text(f"{state.done:,} of {state.samples:,} samples by {run.methods}.")
    if not state.complete:
        page.text("The run is not complete.", warning=True)
    axes, profiles = run.study.axes, run.study.profiles
    result = run.dataset(only=[*REPORTED, "critical_position", "critical_load"])
    with paper_style():
        if not axes and profiles is None:
            page.figure(densities(result), "Densities of the onset and of its position.")
        elif not axes and "strength" in profiles:
            figure = Figure(figsize=(PAGE, 3.0))
            strength = np.array(profiles["strength"])
            plot.onset(result, strength, problem=run.study.problem, ax=figure.subplots())
            page.figure(figure, "Strength and position of the onset.")
    add_tables(page, result, axes)
    if state.failures:
        rows = [[str(failure)] for failure in state.failures[:MOST_ROWS]]
        page.table(f"Samples that failed ({len(state.failures):,})", ["sample"], rows)
    page.listing(
        "The study, to run again to the same numbers", tomli_w.dumps(run.study.to_dict())
    )
    page.text(f"Computed with {'; '.join(state.versions)}.")
    write_whole(path, page.html().encode())


def densities(result: xr.Dataset) -> Figure:
    """Return a figure with densities of the onset and of its position."""
    parts = [result[[shown_quantity(result)]]]
    if DIRECTION in result["critical_position"].dims:
        place = result[["critical_position"]]
        parts += [place.sel({DIRECTION: direction}) for direction in result[DIRECTION].values]
    else:
        parts.append(result[["critical_position"]])
    figure = Figure(figsize=(PAGE, 2.6))
    panels = figure.subplots(1, len(parts))
    for letter, axes, part in zip("abc", panels, parts, strict=False):
        (name,) = part.data_vars
        plot.monte_carlo(part, quantity=str(name), ax=axes)
        if DIRECTION in part.coords:
            axes.set_xlabel(f"{axes.get_xlabel()}, {part[DIRECTION].item()}")
        if legend := axes.get_legend():
            legend.remove()
        axes.set_title(f"({letter})", loc="left", weight="bold")
    return figure


def add_tables(page: Page, result: xr.Dataset, axes: GridAxes) -> None:
    """Add mean, spread and quantiles of the onset at every point, with errors."""
    dims, keys = list(axes), [name for coordinates in axes.values() for name in coordinates]
    flat = result.stack(point=dims) if dims else result.expand_dims("point")
    scales = [scaled(result[key]) for key in keys]
    swept = [*(label for _, _, label in scales), "samples"]
    values = [flat[key].values for key in keys]
    pairs = zip(values, scales, strict=True)
    places = [key * scale[0] if key.dtype.kind == "f" else key for key, scale in pairs]
    count = min(flat.sizes["point"], MOST_ROWS)
    labels = list(itertools.islice(zip(*places, strict=True), count)) if keys else [()]
    if flat.sizes["sample"] == 1:
        onsets = [
            part for name in (*REPORTED, "critical_position") for part in _parts(flat, name)
        ]
        factors, _, titles = zip(*map(scaled, onsets), strict=True)
        columns = [
            part.values.reshape(-1) * by for part, by in zip(onsets, factors, strict=True)
        ]
        rows = [[*at, *row] for at, *row in zip(labels, *columns, strict=False)]
        page.table("Onset", [*swept[:-1], *titles], rows)
        return
    quantities = [f"{what} \N{PLUS-MINUS SIGN} standard error" for what in SPREAD]
    quantities += [f"{100 * level:g} % quantile" for level in QUANTILE_LEVELS]
    if flat["first_instability"].equals(flat["critical_stress"]):  # of the local criterion
        flat = flat.drop_vars("first_instability")
    for name in REPORTED:
        if name in flat:
            factor, unit, _ = scaled(flat[name])
            columns = [*swept, *(with_unit(quantity, unit) for quantity in quantities)]
            samples = flat[name].transpose("point", ...).values * factor
            rows = [[*at, *_estimates(row)] for at, row in zip(labels, samples, strict=False)]
            page.table(flat[name].attrs["long_name"].capitalize(), columns, rows)


def _parts(flat: xr.Dataset, name: str) -> list[xr.DataArray]:
    """Return a variable, or each of its components, or no part if the result lacks it."""
    if name not in flat:
        return []
    values = flat[name]
    if DIRECTION not in values.dims:
        return [values]
    return [
        part.assign_attrs(long_name=f"{part.attrs['long_name']}, {part[DIRECTION].item()}")
        for part in values.transpose(DIRECTION, ...)
    ]


def _estimates(samples: Any) -> list[Any]:
    """Return as text the number, mean, standard deviation and quantiles of samples."""
    values = samples[np.isfinite(samples)]
    if values.size < 4:
        return [values.size, *[None] * (2 + len(QUANTILE_LEVELS))]
    levels = quantiles(values, QUANTILE_LEVELS)
    errors = (levels.upper - levels.lower) / 3.29  # 90 % lie within 1.645 errors
    estimates = [
        f"{rounded(part.value, part.error)} \N{PLUS-MINUS SIGN} {rounded(part.error, part.error)}"
        for part in (mean(values), standard_deviation(values))
    ]
    return [values.size, *estimates, *map(rounded, levels.value, errors)]


def rounded(value: float, error: float) -> str:
    """Return a number, rounded to the second digit of its error."""
    if not 0.0 < error < math.inf:  # too few samples beyond the quantile
        return shown(float(value))
    digits = 1 - math.floor(math.log10(error))
    return f"{value:.{max(digits, 0)}f}".replace("-", "\N{MINUS SIGN}")
