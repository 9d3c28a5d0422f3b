"""What is shown is what the dataset holds, in the unit that stands beside it: reports, exports,
commands and plots."""

import html
import re
from collections import namedtuple

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from crooked import LINE, LINE_GAP, LINE_STRENGTH, PLANE, PLANE_STRENGTH
from refusals import refuses
from setups import LOCAL, local_onset
from small_study import small_study

import stiction as st
from stiction.base.errors import StoreError
from stiction.cli import commands, report
from stiction.ensemble import batches
from stiction.ensemble.experiment import Experiment
from stiction.study import export

SCALES = {"": 1.0, "mm": 1e3, "kPa": 1e-3, "MPa": 1e-6}
AXES = ("correlation_length", "low")


def swept():
    """A study over a length and a stress, under a pressure, some samples of which have events."""
    field = {
        "marginal": {"type": "beta", "alpha": 1.5, "beta": 3.0, "high": 1.66e6},
        "spectrum": {"type": "power_law"},
    }
    plain = small_study(
        length=0.037,
        nodes=96,
        weakening_rate=0.28e12,
        random={"strength": field},
        method={"type": "equilibrium", "events": 2},
        ensemble={"samples": 30, "seed": 3, "first": 5},
        sweep=[
            {"random.strength.spectrum.correlation_length": [1.5e-3, 3.5e-3]},
            {"random.strength.marginal.low": [20_000, 660_000]},  # of whole Pa, too
        ],
    )
    plain["problem"]["load"] = {"normal_pressure": 3e6}
    return st.Study.from_dict(plain)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Where the study ran."""
    path = tmp_path_factory.mktemp("shown") / "run"
    swept().run(out=path)
    return path


def tables(page):
    """The tables of a page by title, as rows of texts."""
    found = {}
    pattern = r"<h2>([^<]*)</h2>\s*<div[^>]*><table>(.*?)</table>"
    for title, body in re.findall(pattern, page, re.DOTALL):
        rows = re.findall(r"<tr>(.*?)</tr>", body, re.DOTALL)
        cells = [re.findall(r"<t[hd]>(.*?)</t[hd]>", row, re.DOTALL) for row in rows]
        found[html.unescape(title)] = [[html.unescape(cell) for cell in row] for row in cells]
    return found


def in_si(heading, text):
    """The name of a column, its number in SI by the unit of the heading, and its last digit."""
    name, unit = re.fullmatch(r"(.*?)(?: \((\w+)\))?", heading).groups()
    shown = text.partition(" ")[0].replace("\N{MINUS SIGN}", "-")
    digits = len(shown.partition(".")[2])
    return name, float(shown) / SCALES[unit or ""], 10.0**-digits / SCALES[unit or ""]


def test_tables_of_a_report_are_the_dataset_in_the_units_of_their_headings(folder, runs):
    runs(f"report {folder}")
    found = tables((folder / "report.html").read_text("utf-8"))
    data, levels = st.open_run(folder).dataset(), (5, 50, 95)
    for variable in ("critical_stress", "first_instability", "friction_coefficient"):
        head, *rows = found[data[variable].long_name.capitalize()]
        assert len(rows) == 4
        for row in rows:
            numbers = {name: (value, digit) for name, value, digit in map(in_si, head, row)}
            at = {axis: numbers[axis.replace("_", " ")][0] for axis in AXES}
            values = data[variable].sel(at, method="nearest").values
            found_levels = np.percentile(values, levels, method="median_unbiased")
            expected = {
                "samples": values.size,
                "mean \N{PLUS-MINUS SIGN} standard error": values.mean(),
                "standard deviation \N{PLUS-MINUS SIGN} standard error": values.std(ddof=1),
            }
            expected |= {
                f"{p} % quantile": q for p, q in zip(levels, found_levels, strict=True)
            }
            for name, value in expected.items():
                shown, digit = numbers[name]
                assert abs(shown - value) <= 0.501 * digit, (name, row)
                assert digit <= 0.1 * values.std() or name == "samples", (name, row)
            scale = numbers[head[3].partition(" (")[0]][0] / float(row[3].split()[0])
            error = float(row[3].split()[2]) * scale
            assert error == pytest.approx(values.std(ddof=1) / 30**0.5, rel=0.06)
    head, *rows = found["Arrested events"]
    events = (data.arrested_events > 0).sum("sample").values.ravel()
    assert events.max() > 0
    assert [int(row[-1]) for row in rows] == events.tolist()
    assert [row[-2] for row in rows] == ["30"] * 4


class Shown(report.Page):
    """A page that keeps its figures, with their captions."""

    def figure(self, figure, caption):
        self.parts.append((figure, caption))


def test_figures_of_a_report_are_the_dataset_in_the_units_of_their_axes(folder):
    data, page = st.open_run(folder).dataset(), Shown("")
    report.add_figures(page, data, [*AXES])
    (densities, text), (medians, _) = page.parts
    assert text.endswith("critical position at low = 20 kPa.")
    first, second = densities.axes
    assert (first.get_xlabel(), second.get_xlabel()) == (
        "static friction coefficient", "critical position (mm)",
    )  # fmt: skip
    assert len(first.lines) == len(second.patches) == 2
    for line, step, part in zip(first.lines, second.patches, (0, 1), strict=True):
        x, y = line.get_data()
        values = data.friction_coefficient[part, 0]
        assert np.trapezoid(y, x) == pytest.approx(1.0, abs=0.05)
        assert np.trapezoid(x * y, x) == pytest.approx(values.mean().item(), rel=0.05)
        places = data.critical_position[part, 0].values * 1e3
        expected = np.histogram(places, 5, density=True)
        for found, value in zip(step.get_data()[:2], expected, strict=True):
            assert found == pytest.approx(value)
    (axes,) = medians.axes[:1]
    assert axes.get_xlabel() == "correlation length (mm)"
    curves = zip(axes.containers, axes.collections[::2], (0, 1), strict=True)
    for bars, band, low in curves:
        values = data.friction_coefficient[:, low].values
        levels = {"q": (25, 50, 75), "axis": 1, "method": "median_unbiased"}
        low, middle, high = np.percentile(values, **levels)
        x, y = bars.lines[0].get_data()
        assert x == pytest.approx([1.5, 3.5])
        assert y == pytest.approx(middle)
        x, y = band.get_paths()[0].vertices.T
        for at, least, most in zip((1.5, 3.5), low, high, strict=True):
            assert {*y[np.isclose(x, at)].round(9)} == {least.round(9), most.round(9)}


def test_bands_of_a_single_curve_are_its_quantiles(folder):
    data = st.open_run(folder).dataset().isel(low=1)
    axes = st.plot.quantiles(data, quantity="critical_stress")
    assert axes.get_ylabel() == "critical stress (MPa)"
    values = data.critical_stress.values * 1e-6
    for band, share in zip(axes.collections[:2], (5, 25), strict=True):
        x, y = band.get_paths()[0].vertices.T
        for at, row in zip((1.5, 3.5), values, strict=True):
            ends = np.percentile(row, (share, 100 - share), method="median_unbiased")
            assert {*y[np.isclose(x, at)].round(9)} == {*ends.round(9)}


def test_three_axes_are_along_within_and_over_the_figures(folder):
    data, page = st.open_run(folder).dataset(), Shown("")
    grown = xr.concat([data, data, data], "length").assign_coords(length=[0.1, 0.2, 0.3])
    report.add_figures(page, grown, ["low", "length", "correlation_length"])
    texts = [text for _, text in page.parts]
    assert len(texts) == 4
    for text, over in zip(texts, ("1.5", "1.5", "3.5", "3.5"), strict=True):
        assert f"correlation length = {over} mm" in text
    assert page.parts[1][0].axes[0].get_xlabel() == "length"
    legend = page.parts[1][0].axes[0].get_legend()
    assert [text.get_text() for text in legend.get_texts()] == ["0.02", "0.66"]
    assert legend.get_title().get_text() == "low (MPa)"


def test_a_report_without_a_sweep_of_a_run_with_failures(tmp_path, monkeypatch, runs):
    original = Experiment.results

    def results(self, first, count):
        if first <= 9 < first + count:
            raise FloatingPointError("not finite")
        return original(self, first, count)

    plain = swept().to_dict() | {"sweep": []}
    plain["random"]["strength"]["spectrum"]["correlation_length"] = 2e-3
    plain["random"]["strength"]["marginal"]["low"] = 0.5e6
    study, path = st.Study.from_dict(plain), tmp_path / "run"
    with monkeypatch.context() as patch:
        patch.setattr(Experiment, "results", results)
        study.run(out=path, workers=1, progress=False)
    runs(f"report {path}", "it is of ", code=1)
    page = (path / "report.html").read_text("utf-8")
    assert "29 of 30 samples by equilibrium." in page
    assert "The run is not complete." in page
    (_, failure) = tables(page)["Samples that failed (1)"]
    assert failure == ["sample 9 (seed 3): FloatingPointError: not finite"]
    shown, data = Shown(""), st.open_run(path).dataset()
    report.add_figures(shown, data, [])
    ((figure, text),) = shown.parts
    assert text == "Static friction coefficient and critical position."
    places = data.critical_position.values[~np.isnan(data.critical_position)] * 1e3
    assert figure.axes[1].patches[0].get_data()[1] == pytest.approx(np.histogram(places, 5)[1])
    assert tables(page)["Static friction coefficient"][1][0] == "29"


Cost = namedtuple("Cost", "seconds failures")


def test_the_description_of_a_study_and_its_time(monkeypatch):
    study = swept()
    lines = commands.description(study)
    h_n = study.experiments[0].problem.nucleation_length
    assert lines["nucleation length"] == f"{h_n:.5g} m"
    assert lines["nodes in h_n"] == f"{h_n / (0.037 / 96):.5g}"
    assert lines["L / h_n along x"] == f"{0.037 / h_n:.5g}"
    assert lines["xi_0 / h_n"] == f"{1.5e-3 / h_n:.5g} to {3.5e-3 / h_n:.5g}"
    fields = [point.random.strength for point in study.experiments]
    for title, values in {
        "mean strength": [field.mean for field in fields],
        "standard deviation": [field.standard_deviation for field in fields],
    }.items():
        assert lines[title] == f"{min(values):.5g} to {max(values):.5g} Pa"
    assert lines["correlation length"].endswith(" m (to 1/e)")

    # Points take 1, 2, 3 and 4 s a sample.
    def solved(point, span):
        return Cost((1.0 + span.point) * span.samples, ())

    monkeypatch.setattr(batches, "solve_span", solved)
    monkeypatch.setattr(batches, "usable_cores", lambda: 4)
    cost, _, _ = commands._cost(study)
    words = "about 5 min on one core, 75 s on the 4 here (1 s to 4 s a sample"
    assert cost["time"].startswith(words)
    size = sum(point.sample_bytes for point in study.experiments) * 30
    assert cost["size"] == f"about {size / 1e6:.3g} MB"


@pytest.mark.parametrize("kind", ["sweep", "gaps", "plane"])
def test_columns_of_a_table_are_the_variables_in_their_units(kind, folder, tmp_path):
    """A gap brings a coordinate along x, a plane a column for each component."""
    if kind == "sweep":
        result = st.open_run(folder).dataset()
    else:
        problem, strength = (PLANE, PLANE_STRENGTH)
        if kind == "gaps":
            problem, strength = LINE, np.where(LINE_GAP, np.nan, LINE_STRENGTH)
        strengths = np.stack([strength, 1.1 * strength])
        result = st.onset(problem, strengths, method=st.Equilibrium(slip=True), gaps="fill")
    export.export(result, tmp_path / "out.csv")
    export.export(result, tmp_path / "out.nc")
    table = pd.read_csv(tmp_path / "out.csv", dtype=str)
    expected = {}
    for name in ("sample", *result.data_vars, *(AXES if kind == "sweep" else ())):
        variable = result[name]
        parts = {name: variable} if not {"x", "y", "event"} & {*variable.dims} else {}
        if parts and "direction" in variable.dims:
            parts = {f"{name}_{c}": variable.sel(direction=c) for c in ("x", "y")}
        expected |= {f"{one} ({part.units})": part for one, part in parts.items()}
    assert {*table.columns} == {*expected}
    whole = result["critical_load"]
    for column, variable in expected.items():
        rows = variable.broadcast_like(whole).transpose(*whole.dims).values.ravel()
        found = table[column] == "True" if rows.dtype == bool else table[column].astype(float)
        np.testing.assert_array_equal(found, rows, err_msg=column)
    with xr.open_dataset(tmp_path / "out.nc") as read:
        xr.testing.assert_identical(read.load(), result)
        for name, variable in result.variables.items():
            assert "units" in variable.attrs or variable.dtype.kind in "Ub", name


def test_a_report_of_failures_has_forces_and_no_number_twice(tmp_path, runs, monkeypatch):
    """Of a strength without a bound, on an interface of known width."""
    plain = small_study(64, correlation_length=9e-3)
    plain["problem"]["interface"]["width"] = 0.013
    plain["random"]["strength"]["marginal"] = {"type": "lognormal", "mean": 1e6, "cv": 0.2}
    st.Study.from_dict(plain).failure_curve(out=tmp_path / "run", repetitions=1, smallest=0.1)
    run, page = st.open_run(tmp_path / "run"), Shown("")
    report.add_curves(page, run)
    (figure, _), table = page.parts
    top = figure.axes[0].child_axes[0]
    assert top.get_xlabel() == "shear force (N)"
    figure.savefig(tmp_path / "drawn.png")  # which sets the limits of the second axis
    shown = np.divide(top.get_xlim(), figure.axes[0].get_xlim())
    np.testing.assert_allclose(shown, 1e6 * 0.1 * 0.013, rtol=1e-9)
    assert "stress above bound (MPa)" not in table["columns"]
    columns = np.transpose([row[:4] for row in table["rows"]]).tolist()
    assert len({tuple(column) for column in columns}) == 4
    st.Study.from_dict(plain).run(out=tmp_path / "samples")
    runs(f"report {tmp_path / 'samples'}")
    found = tables((tmp_path / "samples" / "report.html").read_text("utf-8"))
    assert [*found] == [  # the first instability is the onset itself
        "Largest mean interface stress on the way to sliding",
        "Largest shear force on the way to sliding",
    ]


def test_a_disk_without_room_for_a_result_is_left_as_it_was(tmp_path, monkeypatch):
    """The NetCDF library itself would report nothing."""
    result = local_onset(LINE, LINE_STRENGTH)
    Usage = namedtuple("Usage", "free")
    room = {"free": result.nbytes + 2**16}
    monkeypatch.setattr(export.shutil, "disk_usage", lambda _: Usage(**room))
    words = "cannot be written: No space left on device"
    refuses(words, lambda: export.write_result(result, tmp_path / "out.nc"), StoreError)
    assert not list(tmp_path.iterdir())
    room["free"] *= 2
    export.write_result(result, tmp_path / "out.nc")


def test_a_limit_state_says_in_a_line_what_it_is():
    state = st.external.limit_state(LINE, st.paper.strength(LINE), method=LOCAL)
    expected = f"LimitState(critical_stress by local criterion, of {state.dimension} draws)"
    assert repr(state) == expected
