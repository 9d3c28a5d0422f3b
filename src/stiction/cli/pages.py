"""Results as self-contained HTML pages: a run, or a design for the files, which prints on A4."""

import base64
import io
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import date
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
import pandas as pd
import tomli_w
import xarray as xr
from matplotlib.figure import Figure

from stiction import plot
from stiction.base.errors import InputError
from stiction.base.files import write_whole
from stiction.base.model import to_plain
from stiction.base.units import in_words
from stiction.base.variables import UNITS
from stiction.ensemble.batches import versions
from stiction.ensemble.dataset import GridAxes
from stiction.plot.axes import scaled, shown_quantity, with_unit
from stiction.plot.style import PAGE, paper_style
from stiction.problem.problem import Problem
from stiction.reliability.answer import Answer, moves_of, unseen_batch
from stiction.study.run import StoredRun, components

MOST_ROWS = 200
QUANTILE_LEVELS = (0.05, 0.5, 0.95)
REPORTED = ("critical_stress", "first_instability", "friction_coefficient", "critical_force")
MAX_SHOWN_VALUES = 8
"""Number of values of an input that are listed at most."""
LIGHT = "positive entries"
"""Words in doubts that concern only the grid, and are listed last."""
CONTROLS = {
    code: "\N{REPLACEMENT CHARACTER}" for code in (*range(9), *range(11, 32), *range(127, 160))
}
"""Replacements for characters that control terminals, because a
terminal may print a page."""


@dataclass
class Page:
    r"""Text, figures, tables and listings in the order in which they are added.

    Examples
    --------
    >>> import tempfile
    >>> page = Page("Design of A & B")
    >>> page.text("Slip \x1b[2J, <b>.", warning=True)
    >>> page.table("Loads", ["name", "load"], [["first", 1234567], ["second", None]])
    >>> page.listing("Study", "samples = 3")
    >>> page.figure(Figure(figsize=(0.1, 0.1)), "No curve.")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page.write(Path(folder, "page.html"))
    ...     html = Path(folder, "page.html").read_text("utf-8")
    >>> print([part["kind"] for part in page.parts], ascii(page.parts[1]["rows"]), sep="\n")
    ['text', 'table', 'listing', 'figure']
    [['first', '1,234,567'], ['second', '\u2013']]
    >>> page.parts[0]["warning"]
    True
    >>> parts = "A &amp; B", "Slip \ufffd[2J, &lt;b&gt;", "1,234,567", "samples = 3"
    >>> [part in html for part in parts], "data:image/png;base64,iVBOR" in html, "\x1b" in html
    ([True, True, True, True], True, False)
    """

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

    def table(self, title: str, columns: Iterable[str], rows: Iterable[Iterable[Any]]) -> None:
        """Add a table, in which numbers are shown with five digits."""
        cells = [[shown(entry) for entry in row] for row in rows]
        self.parts.append({"kind": "table", "title": title, "columns": columns, "rows": cells})

    def listing(self, title: str, text: str) -> None:
        """Add the text of a file."""
        self.parts.append({"kind": "listing", "title": title, "text": text})

    def write(self, path: Path) -> None:
        """Write the page to a file, completely or not at all."""
        environment = jinja2.Environment(
            loader=jinja2.PackageLoader("stiction.cli"),
            autoescape=True,
            trim_blocks=True,
            lstrip_blocks=True,
            undefined=jinja2.StrictUndefined,
        )
        page = environment.get_template("page.html.j2").render(page=self)
        write_whole(path, page.translate(CONTROLS).encode())


def shown(entry: Any) -> str:
    r"""Return a table entry as text: numbers with five digits, or a dash for a missing value.

    >>> {shown(entry) for entry in (None, np.nan, np.float32("nan"))} == {"\N{EN DASH}"}
    True
    >>> [shown(entry) for entry in (1234567, np.int64(-1000), True, np.float32(0.5), "a")]
    ['1,234,567', '-1,000', 'True', '0.5', 'a']
    >>> print(ascii([shown(-1234.5678), shown(2e-7)]))
    ['\u22121234.6', '2e\u221207']
    """
    if entry is None or (isinstance(entry, float | np.floating) and np.isnan(entry)):
        return "\N{EN DASH}"
    if isinstance(entry, int | np.integer) and not isinstance(entry, bool):
        return f"{entry:,}"
    if isinstance(entry, float | np.floating):
        return f"{entry:.5g}".replace("-", "\N{MINUS SIGN}")
    return str(entry)


# -- runs ----------------------------------------------------------------------------------------


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
        elif not axes:  # profiles always contain the strength
            figure = Figure(figsize=(PAGE, 3.0))
            strength = np.array(profiles["strength"])
            plot.onset(result, strength, problem=run.study.problem, ax=figure.subplots())
            page.figure(figure, "Strength and position of the onset.")
    for title, frame in tables_of(result, axes):
        page.table(title, frame, frame.head(MOST_ROWS).itertuples(index=False))
    if state.failures:
        rows = [[failure] for failure in state.failures[:MOST_ROWS]]
        page.table(f"Samples that failed ({len(state.failures):,})", ["sample"], rows)
    page.listing(
        "The study, to run again to the same numbers", tomli_w.dumps(run.study.to_dict())
    )
    page.text(f"Computed with {'; '.join(state.versions)}.")
    page.write(path)


def densities(result: xr.Dataset) -> Figure:
    """Return a figure with densities of the onset and of its position.

    >>> rng = np.random.default_rng(7)
    >>> units = {"critical_stress": "Pa", "critical_position": "m"}
    >>> cells = {key: ("sample", rng.random(9), {"units": unit}) for key, unit in units.items()}
    >>> figure = densities(xr.Dataset(cells))
    >>> [axes.get_title(loc="left") for axes in figure.axes], figure.axes[0].get_legend() is None
    (['(a)', '(b)'], True)
    >>> [axes.get_xlabel().partition(" (")[0] for axes in figure.axes]
    ['critical stress', 'critical position']
    """
    parts = components(result[[shown_quantity(result), "critical_position"]])
    figure = Figure(figsize=(PAGE, 2.6))
    panels = figure.subplots(1, len(parts.data_vars))
    for letter, axes, name in zip("abc", panels, parts, strict=False):
        plot.monte_carlo(parts, quantity=str(name), ax=axes)
        if legend := axes.get_legend():
            legend.remove()
        axes.set_title(f"({letter})", loc="left", weight="bold")
    return figure


def tables_of(result: xr.Dataset, axes: GridAxes) -> Iterator[tuple[str, pd.DataFrame]]:
    r"""Yield tables of the onset at every point of a sweep: its statistics, or a single sample.

    >>> axes = {"seed": {"seed": ()}, "length": {"length": ()}}
    >>> def data(stresses, first):
    ...     dims, attributes = ("seed", "length", "sample"), {"units": "Pa", "long_name": "stress"}
    ...     cells = {"critical_stress": (dims, 1e6 * stresses, attributes)}
    ...     cells["first_instability"] = dims, 1e6 * first, attributes | {"long_name": "first"}
    ...     cells["critical_position"] = dims, first, {"units": "m"}
    ...     length = "length", [0.2, 0.4], {"units": "m"}
    ...     return xr.Dataset(cells, {"seed": [7], "length": length})
    >>> stresses = np.array([[[1.0, 3.0, np.inf], [5.0, 5.0, 8.0]]])
    >>> [title for title, frame in tables_of(data(stresses, stresses), axes)]
    ['Stress']
    >>> (title, frame), second = tables_of(data(stresses, 2.0 * stresses), axes)
    >>> print(frame.round(3).T.to_string(header=False))
    seed                        7.000    7.000
    length (mm)               200.000  400.000
    samples                     2.000    3.000
    mean (MPa)                  2.000    6.000
    standard error (MPa)        1.000    1.000
    standard deviation (MPa)    1.414    1.732
    5 % quantile (MPa)          1.100    5.000
    50 % quantile (MPa)         2.000    5.000
    95 % quantile (MPa)         2.900    7.700
    >>> title, second[0]
    ('Stress', 'First')
    >>> [(title, frame)] = tables_of(data(stresses[..., :1], stresses[..., :1]), axes)
    >>> print(title, *frame.columns, frame.values.tolist()[1], sep="\n")
    Onset
    seed
    length (mm)
    critical stress (MPa)
    first instability (MPa)
    critical position (m)
    [7.0, 400.0, 5.0, 5.0, 5.0]
    """
    dims, points = list(axes), {}
    flat = result.stack(point=dims) if dims else result.expand_dims("point")
    for key in (name for coordinates in axes.values() for name in coordinates):
        factor, _, label = scaled(result[key])
        values = flat[key].values
        points[label] = values * factor if values.dtype.kind == "f" else values
    known = [name for name in REPORTED if name in flat]
    if flat.sizes["sample"] == 1:
        columns = {}
        for part in components(flat[[*known, "critical_position"]]).values():
            factor, _, label = scaled(part)
            columns[label] = part.values.ravel() * factor
        yield "Onset", pd.DataFrame(points | columns)
        return
    if flat["first_instability"].equals(flat["critical_stress"]):  # of the local criterion
        known.remove("first_instability")
    for name in known:
        factor, unit, _ = scaled(flat[name])
        samples = factor * flat[name].transpose("point", "sample").values
        values = pd.DataFrame(np.where(np.isfinite(samples), samples, np.nan))
        statistics = {
            "mean": values.mean(axis=1),
            "standard error": values.sem(axis=1),
            "standard deviation": values.std(axis=1),
        }
        for level in QUANTILE_LEVELS:
            statistics[f"{100 * level:g} % quantile"] = values.quantile(level, axis=1)
        named = {with_unit(key, unit): column for key, column in statistics.items()}
        frame = pd.DataFrame({**points, "samples": values.count(axis=1), **named})
        yield flat[name].attrs["long_name"].capitalize(), frame


# -- designs -------------------------------------------------------------------------------------


def write_design(
    design: Answer, path: Path, evidence: Sequence[Any], sources: Mapping[str, str], title: str
) -> None:
    """Write a design as an HTML page. See `Answer.write_page`."""
    if not design.of_stress:
        raise InputError("design: must come from st.design_stress, got a failure probability")
    page = Page(title)
    page.text(f"{date.today().isoformat()}; {versions()}.")
    summary = design._summary()
    head, *rows = zip(*summary.columns, strict=True)
    page.table("Design", head, rows)
    page.text(f"Computed by {summary.notes[0]}.")
    page.text(
        "The interval covers errors of the computation: sampling, and the choice of equally likely"
        " interfaces. The force itself allows for uncertain parameters, because its probability is"
        " the mean over the interfaces. Assumed constants are listed below and not covered."
    )
    if moves := moves_of(design):
        with paper_style():
            height = 1.2 + 0.3 * len(moves)
            figure = Figure(figsize=(0.75 * PAGE, height), layout="constrained")
            plot.sensitivities(design, ax=figure.subplots())
            page.figure(figure, "Sensitivities. The band is the interval of the design.")
        columns = ["source", "from", "to", "design at 'from'", "design at 'to'"]
        page.table("Sensitivities", columns, moves)
    problem, source = design.experiment.problem, design.experiment.random.source
    page.table("Inputs", ["input", "value", "unit", "source"], _inputs(problem, sources))
    peaks = getattr(source, "peaks", None)
    basis = [source or design.experiment.given, getattr(source, "agreement", None), peaks]
    texts = {repr(item): item for item in (*basis, *evidence) if item is not None}
    for text, item in texts.items():
        page.listing(f"Evidence: {type(item).__name__}", text)
    if peaks is not None and peaks.unit == "1":
        columns = ["specimen", "clamping force", "slip load", "slip factor"]
        page.table("Slip tests", columns, _slip_tests(peaks.loads or peaks))
        values = [[name, value] for name, value in peaks.standards.items()]
        page.table("Slip factors by the standards", ["quantity", "value"], values)
    if assumptions := getattr(source, "assumptions", ()):
        page.table("Assumptions", ["assumption"], [[text] for text in assumptions])
    doubts = [*design.warnings, *design.doubts, *unseen_batch(design.specimens)]
    for item in evidence:
        doubts += [*getattr(item, "doubts", ()), *getattr(item, "notes", ())]
    doubts.sort(key=lambda text: LIGHT in text)
    page.table("Doubts", ["doubt"], [[text] for text in dict.fromkeys(doubts or ["none"])])
    method, seed = design.experiment.method, design.experiment.seed
    of_tests = f", seed of infer {source.seed}" if hasattr(source, "seed") else ""
    page.text(
        f"To repeat: {versions()}, method {method!r}, seed {seed}{of_tests}. The force acts"
        " on one friction surface of the interface above."
    )
    page.write(path)


def _slip_tests(peaks: Any) -> Iterator[list[str]]:
    """Yield the rows for the table of slip loads, in the words of EN 1090-2.

    >>> from types import SimpleNamespace
    >>> values = [np.array([0.5, 0.25]), np.array([0.4])]
    >>> peaks = SimpleNamespace(values=values, specimens=(), normal_forces=(), surfaces=2)
    >>> list(_slip_tests(peaks))[1:]
    [['2', 'nan N', 'nan N', '0.25'], ['1', 'nan N', 'nan N', '0.4']]
    >>> peaks.specimens, peaks.normal_forces = [["a", "b"], ["c"]], [[2e3, 8e3], [5e3]]
    >>> list(_slip_tests(peaks))
    [['a', '2 kN', '2 kN', '0.5'], ['b', '8 kN', '4 kN', '0.25'], ['c', '5 kN', '4 kN', '0.4']]
    """
    for kind, factors in enumerate(peaks.values):
        names = peaks.specimens[kind] if peaks.specimens else range(1, factors.size + 1)
        forces = peaks.normal_forces[kind] if peaks.normal_forces else np.nan * factors
        for name, factor, force in zip(names, factors, forces, strict=True):
            loads = [in_words("N", value) for value in (force, peaks.surfaces * factor * force)]
            yield [str(name), *loads, f"{factor:.4g}"]


def _inputs(problem: Problem, sources: Mapping[str, str]) -> Iterator[list[Any]]:
    """Yield the constants of a problem by dotted key, with units and sources.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=576)
    >>> sources = {"solid.shear_modulus": "tension test", "interface.length": "drawing"}
    >>> inputs = {key: rest for key, *rest in _inputs(problem, sources)}
    >>> moduli = inputs["solid.youngs_modulus"][0] / inputs["solid.shear_modulus"][0]
    >>> round(moduli, 9) == round(2.0 * (1.0 + problem.solid.poisson_ratio), 9)
    True
    >>> [inputs[key][1:] for key in ("solid.youngs_modulus", "solid.shear_modulus")]
    [['Pa', 'tension test'], ['Pa', 'tension test']]
    >>> [inputs[key][1:] for key in ("interface.length", "solid.poisson_ratio", "solid.density")]
    [['m', 'drawing'], ['', 'assumed'], ['kg m-3', 'assumed']]
    >>> import dataclasses
    >>> uneven = dataclasses.replace(problem, load=st.Load(normal_pressure=[2e6, 4e6] * 288))
    >>> [value for key, value, *_ in _inputs(uneven, {}) if key == "load.normal_pressure"]
    ['576 values, mean 3e+06']
    >>> list(_inputs(problem, {"solid.mass": "scale"}))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: sources: 'solid.mass' is not an input of this problem. The...
    """
    # Young's modulus is shown with the shear modulus, which is stored, and has the same source.
    plain = to_plain(problem)
    plain["solid"]["youngs_modulus"] = problem.solid.youngs_modulus
    moduli = "solid.shear_modulus", "solid.youngs_modulus"
    stated = [sources[key] for key in moduli if key in sources]
    sources = dict.fromkeys(moduli, (*stated, "assumed")[0]) | dict(sources)
    inputs = pd.json_normalize(plain).to_dict("records")[0]
    if unknown := [key for key in sources if key not in inputs]:
        raise InputError(
            f"sources: {unknown[0]!r} is not an input of this problem. The inputs are"
            f" {', '.join(map(str, inputs))}"
        )
    for key, value in inputs.items():
        if isinstance(value, list) and len(value) > MAX_SHOWN_VALUES:
            value = f"{len(value)} values, mean {np.mean(value):.5g}"
        unit = UNITS.get(str(key).rpartition(".")[2], "")
        yield [key, value, unit, sources.get(str(key), "assumed")]
