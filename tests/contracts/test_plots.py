"""Laws of figures: each function of st.plot draws the numbers of a result in their units."""

from __future__ import annotations

import dataclasses
import inspect
import re
from functools import cache
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from contracts.bodies import COEFFICIENTS, World, world
from contracts.test_results import CALLS, LOCAL, QUIET, SHAKEN, design

import stiction as st

pytestmark = pytest.mark.filterwarnings("ignore")
PEAKS = np.array([5.9e5, 6.2e5, 6.6e5])
LENGTH = "random.strength.spectrum.correlation_length"
COEFFICIENT = "friction_coefficient"


RESULTS: dict[tuple[str, World], Any] = {}


def of(call: str, w: World) -> Any:
    """The result of a call, which is kept."""
    if (call, w) not in RESULTS:
        RESULTS[call, w] = computed(call, w)
    return RESULTS[call, w]


def computed(call: str, w: World) -> Any:
    """The result of a call, or of a sweep over the correlation length."""
    if call == "sweep":
        length = w.random.strength.spectrum.correlation_length
        sweep = [{LENGTH: [length, 2.0 * length]}]
        swept = dataclasses.replace(w.study, sweep=sweep, samples=20)
        return swept.run(pilot=False, **QUIET)
    return design(w, sensitivities=True) if call == "sensitive" else CALLS[call][1](w)


def drawn_by(name: str, call: str, *more: str) -> Any:
    """What draws the result of a call, with its profiles and its problem where it takes them."""

    def draw(w: World, **options: Any) -> Any:
        given = [w.profiles()] if "profiles" in more else []
        options = ({"problem": w.problem} if "problem" in more else {}) | options
        return getattr(st.plot, name)(of(call, w), *given, **options)

    return draw


def uniform(w: World) -> st.Problem:
    """A problem of uniform parameters in the units of a world."""
    line = st.Interface(0.05 * w.units["m"], 128)
    law = st.LinearWeakening(weakening_rate=0.3e12 * w.factor("Pa m-1"))
    load = st.Load(initial_stress=1e4 * w.Pa, normal_pressure=2e6 * w.Pa)
    return st.Problem(w.problem.solid, line, law, load)


def coefficients(w: World) -> st.RandomField:
    return st.RandomField(
        COEFFICIENTS.marginal, st.PowerLawSpectrum(9e-3 * w.units["m"]), quantity=COEFFICIENT
    )


def fit(w: World, unit: float = 1.0, quantity: str = COEFFICIENT) -> Any:
    line, spectrum = uniform(w).interface, {"type": "power_law", "exponent": 4.0}
    rows = coefficients(w).sample(line, samples=4, seed=1) * unit
    given = {"marginal": "lognormal", "spectrum": spectrum, "bootstrap": 20, **QUIET}
    return st.fit_field(rows, line, quantity=quantity, **given)


DRAWN: dict[str, Any] = {  # the first word is the function: the world, its body, what draws
    "onset": (world, "line with ends", drawn_by("onset", "onset", "profiles", "problem")),
    "onset of a plane": (world, "plane", drawn_by("onset", "onset", "profiles", "problem")),
    "specimen": (world, "blocks", lambda w, **options: st.plot.specimen(
        w.problem, w.profiles(), of("onset", w), **options)),
    "specimen on a base": (world, "slider", lambda w, **options: st.plot.specimen(
        w.problem, w.profiles(), of("onset", w), **options)),
    "field": (world, "line", lambda w, ax=None: st.plot.field(w.problem, w.profiles(0), ax=ax)),
    "monte_carlo": (world, "line", drawn_by("monte_carlo", "monte_carlo")),
    "quantiles": (LOCAL, "line", drawn_by("quantiles", "sweep")),
    "failure_curve": (LOCAL, "line", drawn_by("failure_curve", "failure_curve")),
    "sensitivities": (LOCAL, "line with ends", drawn_by("sensitivities", "sensitive")),
    "agreement": (LOCAL, "line", lambda w, **options: st.plot.agreement(
        st.statistics.agreement(of("monte_carlo", w), PEAKS * w.Pa, unit="Pa"), **options)),
    "rupture": (SHAKEN, "line", drawn_by("rupture", "simulate_rupture", "problem")),
    "precursors": (world, "blocks", drawn_by("precursors", "equilibrium_path", "problem")),
    "precursors of two": (world, "blocks", lambda w, **options: st.plot.precursors(
        two_paths(w), measured=pushed(w), **options)),
}  # fmt: skip
ELSEWHERE = {"film", "fit"}
"""A film is a file, see test_files, and a fit has no units of a world, see tests/records."""
TAKE_A_PROBLEM = {
    name for name in st.plot.__all__
    if "problem" in [*inspect.signature(getattr(st.plot, name)).parameters][1:]
}  # fmt: skip
SAMPLES = [name for name in DRAWN if name.split()[0] in ("onset", "specimen")]


def test_every_figure_has_a_line():
    assert {name.split()[0] for name in DRAWN} | ELSEWHERE == {*st.plot.__all__}


def drawn(panels: Any) -> list[Any]:
    """All that a figure draws: pairs of numbers in SI and their unit, by axis."""
    figure = np.ravel(panels)[0].figure
    figure.canvas.draw()
    parts: list[Any] = []
    for axes in figure.axes:
        bar, last = axes.get_label() == "<colorbar>", np.ravel(panels)[-1]
        labels = axes.get_xlabel() or last.get_xlabel() * (not bar), axes.get_ylabel()
        across = axes.get_xaxis_transform(), axes.get_yaxis_transform()
        shapes = [(line.get_xydata(), line.get_transform()) for line in axes.lines]
        for lines in axes.collections:
            outlines = [path.vertices for path in lines.get_paths()]
            outlines = outlines if lines.get_array() is None else [np.concatenate(outlines)]
            shapes += [(outline, axes.transData) for outline in outlines]
        shapes += [
            (patch.get_patch_transform().transform(patch.get_path().vertices), own)
            for patch in axes.patches
            if (own := patch.get_data_transform()) != axes.transAxes
        ]
        shapes *= not bar
        shapes.append((np.transpose([axes.get_xlim(), axes.get_ylim()]), axes.transData))
        for points, transform in shapes:
            for column, label in enumerate(labels):
                if transform != across[1 - column]:  # else a share of the height or width
                    parts.append(in_si(np.asarray(points, dtype=float)[:, column], label))
        for scale in axes.child_axes:
            label = scale.get_xlabel() or scale.get_ylabel()
            limits = scale.get_xlim() if scale.get_xlabel() else scale.get_ylim()
            parts.append(in_si(np.array(limits), label))
        for coloured in [*axes.images, *axes.collections]:
            if coloured.get_array() is not None and coloured.colorbar is not None:
                bar = coloured.colorbar.ax
                label = bar.get_xlabel() or bar.get_ylabel()
                parts.append(in_si(np.ma.filled(coloured.get_array(), np.nan), label))
    plt.close(figure)
    return parts


NOUNS = {
    "force": "N", "stress|strength": "Pa", "coefficient|rangle": "1", "slip rate": "m/s",
    "position|length|height|travel|slip(?! rate)": "m", "time": "s",
}  # fmt: skip


def in_si(values: Any, label: str) -> tuple[Any, str]:
    """Numbers of an axis in SI, by the unit of its label, which suits the noun in it."""
    unit = (re.findall(r"\(([^()]*)\)(?:,|$)", label) or ["1"])[0].replace("\xb5", "u")
    parts = re.fullmatch(r"([GMkmu])((?:Pa|N|m|s|Hz|J)\b.*)", unit)
    prefix, base = parts.groups() if parts else ("", unit)
    assert all(base == of_noun for noun, of_noun in NOUNS.items() if re.search(noun, label)), (
        label
    )
    return values * {"G": 1e9, "M": 1e6, "k": 1e3, "m": 1e-3, "u": 1e-6, "": 1.0}[prefix], base


def assert_drawn_alike(drawing: Any, reference: Any, close: float, factor: Any = None) -> None:
    assert len(drawing) == len(reference) > 0
    for (values, unit), (expected, known) in zip(drawing, reference, strict=True):
        right = expected * (factor(known) if factor else 1.0)
        assert unit == known
        largest = np.abs(right[np.isfinite(right)]).max(initial=0.0)
        np.testing.assert_allclose(values, right, rtol=close, atol=close * largest)


@pytest.mark.parametrize("name", DRAWN)
def test_a_figure_draws_the_numbers_of_its_result_in_their_units(name):
    """In other units each number changes as its unit says."""
    make, body, draw = DRAWN[name]
    shown = drawn(draw(make(body)))
    # With 64 m a force of 1 N becomes 1.024 kN. The round ends of a histogram have no such factor.
    length = 2.0 if name == "monte_carlo" else 64.0
    other = make(body).in_units(Pa=0.25, m=length, s=8.0)
    assert_drawn_alike(drawn(draw(other)), shown, 1e-3, other.factor)


@cache
def two_paths(w: World) -> list[Any]:
    loads = np.linspace(0.0, 8e5, 9) * w.Pa
    return [st.equilibrium_path(w.problem, w.profiles(i), loads) for i in (0, 1)]


@cache
def pushed(w: World) -> Any:
    """Curves of two tests, each with a precursor."""
    force = np.r_[np.linspace(0.0, 100.0, 200), np.linspace(80.0, 160.0, 200), [90.0] * 50]
    force = force + 0.1 * np.random.default_rng(0).normal(size=force.size)
    travel = np.linspace(0.0, 3e-4, force.size) * w.units["m"]
    return st.read_curve((travel, force * w.factor("N")), unit="N", travel_unit="m")


@pytest.mark.parametrize("name", SAMPLES)
def test_a_figure_of_a_sample_is_the_figure_of_its_row_alone(name):
    make, body, draw = DRAWN[name]
    w = make(body)
    alone = World(w.plain, w.strength[1:2])
    panels = draw(w, sample=1), draw(alone)
    texts = [np.ravel(each)[0].figure.findobj(plt.Text) for each in panels]
    one, other = (sorted(text.get_text() for text in each) for each in texts)
    assert one == other
    second, reference = map(drawn, panels)
    assert_drawn_alike(second, reference, 1e-9)
    with pytest.raises(AssertionError):
        assert_drawn_alike(second, drawn(draw(w)), 1e-9)
    for sample in (3, -1, 0.5, "a"):
        with pytest.raises(st.InputError, match="sample: "):
            draw(w, sample=sample)
    assert not plt.get_fignums()


@pytest.mark.parametrize("name", [n for n in DRAWN if n.split()[0] in TAKE_A_PROBLEM])
def test_a_figure_refuses_a_problem_on_another_grid(name):
    make, body, draw = DRAWN[name]
    w = make(body)
    nodes = np.add(w.interface.shape, 8).tolist()
    nodes = nodes if w.interface.is_plane else nodes[0]
    interface = st.Interface(w.interface.length, nodes, width=w.interface.width)
    law = st.LinearWeakening(weakening_rate=0.3e12)
    other = st.Problem(w.problem.solid, interface, law, specimen=w.problem.specimen)
    with pytest.raises(st.InputError, match="problem|nodes|shape"):
        draw(w, problem=other)
    assert not plt.get_fignums()


@pytest.mark.parametrize("name", DRAWN)
def test_a_figure_is_of_pyplot_once_and_on_the_axes_that_are_given(name):
    make, body, draw = DRAWN[name]
    panels = draw(make(body))
    assert plt.get_fignums() == [np.ravel(panels)[0].figure.number]
    plt.close("all")
    if not isinstance(panels, np.ndarray):
        _, given = plt.subplots()
        assert draw(make(body), ax=given) is given
        assert given.has_data()
        assert len(plt.get_fignums()) == 1


@pytest.mark.parametrize("wrong", [3, "result", None, [3], xr.Dataset()])
@pytest.mark.parametrize("name", sorted({*st.plot.__all__} - {"film"}))
def test_a_figure_refuses_what_it_cannot_draw(name, wrong):
    more = {"field": [LOCAL("line").strength[0]], "onset": [LOCAL("line").strength]}
    with pytest.raises(st.InputError):
        getattr(st.plot, name)(wrong, *more.get(name, []))
    assert not plt.get_fignums()


def test_the_band_of_a_field_holds_the_fraction_that_its_label_names():
    """At each node of a field with measured values, by samples."""
    line = st.Interface(0.05, 64)
    known = xr.DataArray([0.8e6, 1.1e6], {"x": line.x[[9, 40]]}, ("x",))
    field = st.RandomField(
        st.Lognormal(mean=1e6, cv=0.2), st.PowerLawSpectrum(6e-3), mean_mode=True
    ).given(known, noise=2e4)
    axes = st.plot.field(line, field)
    (band,) = [shape for shape in axes.collections if shape.get_label() == "90 %"]
    edge = band.get_paths()[0].vertices[:, 1] * 1e6  # Pa
    samples = field.sample(line, samples=400, seed=1)
    for node in (0, 9, 25, 63):
        x = 1e3 * line.x[node]
        ends = edge[np.isclose(band.get_paths()[0].vertices[:, 0], x)]
        inside = (samples[:, node] >= ends.min()) & (samples[:, node] <= ends.max())
        assert inside.mean() == pytest.approx(0.9, abs=4.0 * (0.9 * 0.1 / 400) ** 0.5)


def test_curves_and_ticks_have_the_names_of_their_numbers():
    """Of few samples, each is marked."""
    swept = of("sweep", LOCAL("line")).isel(sample=slice(5))
    axes = st.plot.monte_carlo(swept)
    title = axes.get_legend().get_title().get_text()
    for line, step in zip(axes.lines, swept.correlation_length, strict=True):
        assert in_si(float(line.get_label()), title) == (pytest.approx(step.item()), "m")
        shown, _ = in_si(line.get_xdata(), axes.get_xlabel())
        np.testing.assert_allclose(shown, swept.critical_force.sel(correlation_length=step))
    axes = st.plot.quantiles(swept)
    names = [float(tick.get_text()) for tick in axes.get_xticklabels()]
    np.testing.assert_allclose(axes.get_xticks(), names)
    table = of("sensitive", LOCAL("line with ends")).sensitivities
    axes = st.plot.sensitivities(of("sensitive", LOCAL("line with ends")))
    named = dict(zip(axes.get_yticks(), axes.get_yticklabels(), strict=True))
    for place, source in zip(axes.lines[-1].get_ydata(), table.source.values, strict=True):
        low, high = table.sel(source=source).low.item(), table.sel(source=source).high.item()
        assert named[place].get_text() == f"{source.removeprefix('problem.')}: {low} to {high}"
