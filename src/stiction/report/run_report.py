"""One self-contained HTML page about a run."""

from __future__ import annotations

import base64
import io
import platform
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import tomli_w
import xarray as xr

from stiction import __version__
from stiction.ensemble.files import write_whole
from stiction.errors import InputError
from stiction.plot.style import paper_style
from stiction.report.run_figures import run_figures
from stiction.report.tables import Table
from stiction.statistics.estimates import mean, standard_deviation
from stiction.statistics.quantiles import quantiles
from stiction.stored_run import Status, StoredRun

MOST_ROWS = 200
LEVELS = (0.05, 0.5, 0.95)

_PAGE = jinja2.Template(
    """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{{ title }}</title>
<style>
body { font: 16px/1.5 Georgia, serif; color: #1a1a1a; max-width: 62rem; margin: 2rem auto;
       padding: 0 1rem; }
h1, h2 { font-weight: normal; line-height: 1.2; }
h2 { margin-top: 2.2rem; border-bottom: 1px solid #d9d9d9; }
figure { margin: 1.2rem 0; }
figure img { max-width: 100%; }
figcaption { color: #555; font-size: 0.9rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-size: 0.9rem; }
th, td { padding: 0.15rem 0.7rem; text-align: right; border-bottom: 1px solid #e5e5e5;
         white-space: nowrap; }
th { text-align: right; font-weight: normal; color: #555; }
th:first-child, td:first-child { text-align: left; }
pre { background: #f6f6f4; padding: 0.8rem; overflow-x: auto; font-size: 0.8rem; }
.bad { color: #b5322a; }
</style>
</head>
<body>
<h1>{{ title }}</h1>
<p>{{ state.done }} of {{ state.samples }} samples by {{ methods }}{% if not state.complete %}
<span class="bad">: the run is not complete</span>{% endif %}.
{% if state.seconds %}Computed in {{ "%.4g"|format(state.seconds) }} s of one core.{% endif %}</p>
{% for figure in figures %}
<figure>
<img alt="{{ figure.caption }}" src="data:image/png;base64,{{ figure.data }}">
<figcaption>{{ figure.caption }}</figcaption>
</figure>
{% endfor %}
{% for table in tables %}
<h2>{{ table.title }}</h2>
<div class="wide"><table>
<tr>{% for column in table.columns %}<th>{{ column }}</th>{% endfor %}</tr>
{% for row in table.cells() %}
<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{% endfor %}
</table></div>
{% endfor %}
{% if state.failures %}
<h2>Samples that failed</h2>
<ul>{% for failure in failures %}<li>{{ failure }}</li>{% endfor %}</ul>
{% if more %}<p>and {{ more }} more.</p>{% endif %}
{% endif %}
<h2>The study</h2>
<p>Written to a file, this runs again to the same numbers with
<code>stiction run STUDY.toml --out RUN</code>.</p>
<pre>{{ study }}</pre>
<h2>Versions</h2>
<p>{{ versions }}</p>
</body>
</html>
""",
    autoescape=True,
)


def onset_tables(stored: StoredRun) -> list[Table]:
    """Mean, spread and quantiles of the onset at every point, with errors."""
    names = ["critical_stress", "first_instability", "friction_coefficient", "arrested_events"]
    result = stored.dataset(only=names)
    dims = [axis.dim for axis in stored.study.axes]
    flat = result.stack(point=dims) if dims else result.expand_dims("point")
    keys = [name for axis in stored.study.axes for name in axis.coordinates]
    tables = []
    for name, scale, unit in (
        ("critical_stress", 1e-6, "MPa"),
        ("first_instability", 1e-6, "MPa"),
        ("friction_coefficient", 1.0, "1"),
    ):
        if name in flat:
            title = f"{flat[name].attrs['long_name']} ({unit})"
            tables.append(_table(name, title, flat, keys, scale))
    if "arrested_events" in flat:
        rows = [
            (*_values(flat, keys, point), *_shares(flat["arrested_events"].isel(point=point)))
            for point in range(min(flat.sizes["point"], MOST_ROWS))
        ]
        columns = (*keys, "samples", "share of samples with an arrested event")
        tables.append(Table.of("arrest", "Arrested events", columns, rows))
    return tables


def _shares(events: xr.DataArray) -> tuple[int, float]:
    values = events.values[np.isfinite(events.values)]
    return values.size, float(np.mean(values > 0)) if values.size else np.nan


def _values(flat: xr.Dataset, keys: list[str], point: int) -> list[Any]:
    return [flat[key].values[point] for key in keys]


def _table(name: str, title: str, flat: xr.Dataset, keys: list[str], scale: float) -> Table:
    columns = (
        *keys,
        "samples",
        "mean",
        "\N{PLUS-MINUS SIGN}",
        "standard deviation",
        "\N{PLUS-MINUS SIGN}",
        *(f"{100 * level:g} %" for level in LEVELS),
    )
    rows = []
    for point in range(min(flat.sizes["point"], MOST_ROWS)):
        values = flat[name].isel(point=point).values.astype(np.float64)
        values = values[np.isfinite(values)] * scale
        row = [*_values(flat, keys, point), values.size]
        if values.size >= 4:
            for estimate in (mean(values), standard_deviation(values)):
                row += [estimate.value, estimate.error]
            row += list(quantiles(values, LEVELS).value)
        else:
            row += [None] * (4 + len(LEVELS))
        rows.append(row)
    title = title[0].upper() + title[1:]
    return Table.of(name, title, columns, rows)


def _versions(stored: StoredRun) -> str:
    import netCDF4
    import numba
    import scipy

    modules = {"numpy": np, "scipy": scipy, "numba": numba, "xarray": xr, "netCDF4": netCDF4}
    others = ", ".join(f"{name} {module.__version__}" for name, module in modules.items())
    computed = ", ".join(stored.versions)
    return (
        f"Computed with stiction {computed}; this page with stiction {__version__},"
        f" Python {platform.python_version()}, {others}."
    )


def write_report(stored: StoredRun, path: Path) -> None:
    """Write the page, whole or not at all.

    Raises
    ------
    InputError
        If nothing is stored yet.
    StoreError
        If it cannot be written.
    """
    state: Status = stored.status()
    if not state.done:
        raise InputError(f"{stored.path}: no sample is stored yet")
    figures = []
    with paper_style():
        for drawn in run_figures(stored):
            buffer = io.BytesIO()
            drawn.figure.savefig(buffer, format="png", dpi=150)
            data = base64.b64encode(buffer.getvalue()).decode()
            figures.append({"data": data, "caption": drawn.caption})
    page = _PAGE.render(
        title=stored.study.title or "Onset of sliding: a Monte Carlo study",
        state=state,
        methods=" and ".join(dict.fromkeys(plan.method.label for plan in stored.study.plans)),
        figures=figures,
        tables=onset_tables(stored),
        failures=[str(failure) for failure in state.failures[:MOST_ROWS]],
        more=max(0, len(state.failures) - MOST_ROWS),
        study=tomli_w.dumps(stored.study.to_dict()),
        versions=_versions(stored),
    )
    write_whole(path, page.encode())
