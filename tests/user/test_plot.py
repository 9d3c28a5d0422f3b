"""The public plots: what they draw, on whose axes, in which units, and what they refuse."""

import dataclasses

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr
from PIL import Image
from refusals import refuses
from setups import EXACT, LOCAL, exact_onset, local_onset, make_problem
from small_study import lengths, small_study

import stiction as st

PRESSURE = 5e6
PROBLEM = make_problem(solid=st.paper.problem().solid, load=st.Load(normal_pressure=PRESSURE))
FIELD = st.paper.strength(PROBLEM, correlation_ratio=0.5)
TAU_P = FIELD.sample(PROBLEM.interface, samples=3, seed=1)
ONE = TAU_P[0]


@pytest.fixture(autouse=True)
def quiet_figures():
    with mpl.rc_context({"backend": "agg"}):
        yield
        plt.close("all")


@pytest.fixture(scope="module")
def run():
    """A rupture."""
    method = st.Rupture(loading_rate=1e8)
    return st.simulate_rupture(PROBLEM, TAU_P[0], method=method, save=st.Save(every=20))


@pytest.fixture(scope="module")
def swept():
    sweep = [*lengths(1e-3, 2e-3, 4e-3), {"problem.friction.residual_strength": [0.0, 1e5]}]
    return st.Study.from_dict(small_study(ensemble={"samples": 50}, sweep=sweep)).run()


def coefficients(axes, scale, limits):
    """The second scale shows the stresses, MPa, of the first as coefficients."""
    axes.figure.canvas.draw()
    return np.array(getattr(scale, limits)()) * PRESSURE * 1e-6


def test_an_onset_is_drawn_where_the_result_says():
    """Of the sample asked for, by each method, with coefficients beside the stresses.

    The loads are weak, so that the legend states them in a unit of their own.
    """
    results = [0.1 * st.onset(PROBLEM, TAU_P, method=m) for m in (LOCAL, EXACT)]
    axes = st.plot.onset(results, TAU_P, problem=PROBLEM, sample=2)
    marked = [line for line in axes.lines if line.get_marker() != "None"]
    marks = {line.get_label(): line.get_xydata() for line in marked}
    assert len(marks) == 2
    for result, (label, place) in zip(results, marks.items(), strict=True):
        assert place[0, 0] == pytest.approx(result.critical_position[2].item() * 1e3)
        assert place[0, 1] == pytest.approx(result.critical_load[2].item() * 1e-6)
        assert f"{result.friction_coefficient[2].item():.4f}" in label
        assert f": {result.critical_load[2].item() * 1e-3:.4f} kPa" in label
    (scale,) = axes.child_axes
    assert coefficients(axes, scale, "get_ylim") == pytest.approx(axes.get_ylim())


def test_plots_take_axes_and_leave_the_others_alone():
    _, (left, right) = plt.subplots(1, 2)
    assert st.plot.field(PROBLEM, TAU_P, ax=right) is right
    assert not left.lines
    assert right.lines[0].get_ydata() == pytest.approx(TAU_P[0] * 1e-6)


def test_monte_carlo_shows_coefficients_where_there_is_a_pressure(swept):
    found = st.monte_carlo(PROBLEM, FIELD, method=LOCAL, samples=200, seed=0)
    axes = st.plot.monte_carlo(found)
    assert axes.get_xlabel() == "static friction coefficient"
    both = st.plot.monte_carlo({"one": found, "other": found})
    assert [text.get_text() for text in both.get_legend().get_texts()] == ["one", "other"]
    assert len(st.plot.monte_carlo(swept.isel(residual_strength=0)).lines) == 3
    weak = found.map(lambda values: 0.01 * values, keep_attrs=True)
    axes = st.plot.monte_carlo([weak, found], quantity="critical_stress")
    assert axes.get_xlabel().endswith("(MPa)")
    tops = [curve.get_xdata()[curve.get_ydata().argmax()] for curve in axes.lines]
    assert tops[0] == pytest.approx(0.01 * tops[1])  # both in MPa


def test_coefficients_and_forces_have_their_own_axes():
    """A measured profile, the field that it conditions, its onset, and the force of many."""
    mu = st.read_profile(
        xr.DataArray(ONE / PRESSURE, {"x": PROBLEM.interface.x}, "x", name="mu"),
        quantity="friction_coefficient",
    )
    field = st.RandomField(
        st.Lognormal(mean=0.2, cv=0.2), FIELD.spectrum, of="friction_coefficient"
    ).given(mu[40:60], noise=5e-3)
    for profile in (mu, field):
        axes = st.plot.field(PROBLEM, profile)
        assert axes.get_ylabel() == "friction coefficient"
        assert not axes.child_axes
        assert np.median(axes.lines[0].get_ydata()) == pytest.approx(0.18, rel=0.15)
    assert (
        st.plot.field(PROBLEM, ONE / PRESSURE, quantity="friction_coefficient").get_ylim()[1]
        < 1
    )
    refuses("unit 1", lambda: FIELD.given(mu, noise=5e-3))
    refuses(
        "unit Pa",
        lambda: field.__class__(
            field.marginal, field.spectrum, of="friction_coefficient"
        ).given((mu * PRESSURE).assign_attrs(units="Pa"), noise=5e-3),
    )
    drawn, same = (
        st.plot.onset(local_onset(PROBLEM, one), one, problem=PROBLEM) for one in (mu, ONE)
    )
    for line, other in zip(drawn.lines, same.lines, strict=True):
        np.testing.assert_allclose(line.get_xydata(), other.get_xydata(), rtol=1e-12)
    wide = dataclasses.replace(PROBLEM, interface=st.Interface(0.1, 256, width=0.3))
    many = st.monte_carlo(wide, FIELD, method=LOCAL, samples=30, seed=0)
    assert st.plot.monte_carlo(many).get_xlabel() == "critical force (kN)"
    large = make_problem((64, 32), (0.02, 0.01), load=wide.load)
    onsets = st.monte_carlo(large, FIELD, method=LOCAL, samples=30, seed=0)
    assert st.plot.monte_carlo(onsets).get_xlabel() == "static friction coefficient"


def test_failure_curve():
    curve = st.failure_curve(PROBLEM, FIELD, method=LOCAL, smallest=1e-2)
    axes = st.plot.failure_curve(curve)
    assert axes.get_yscale() == "log"
    (above,) = axes.child_axes
    assert coefficients(axes, above, "get_xlim") == pytest.approx(axes.get_xlim())
    axes = st.plot.failure_curve(curve, stress=0.7e6, area=2e-3)
    assert axes.get_legend_handles_labels()[1][-1].startswith("demand: 0.7 MPa, P = 0.1")
    axes.figure.canvas.draw()
    (above,) = axes.child_axes
    assert above.get_xlabel() == "shear force (kN)"
    assert np.array(above.get_xlim()) / 2.0 == pytest.approx(axes.get_xlim())
    known = curve.assign(force=curve.stress * 2e-3)  # as of a problem with an area
    drawn = st.plot.failure_curve(known, force=1.4e3)
    assert drawn.get_legend_handles_labels()[1][-1].startswith("demand: 1.4 kN, P = 0.1")
    assert drawn.child_axes[0].get_xlabel() == "shear force (kN)"
    assert drawn.lines[-1].get_xdata()[0] == pytest.approx(0.7)
    refuses("area=...", lambda: st.plot.failure_curve(curve, force=1.4e3))
    refuses("force or stress", lambda: st.plot.failure_curve(known, force=1.4e3, stress=7e5))


def test_a_rupture_in_the_units_of_its_size(run, tmp_path):
    axes = st.plot.rupture(run)
    onset = axes.lines[0].get_xydata()[0]
    assert onset == pytest.approx([run.critical_position.item() * 1e3, 0.0])
    assert axes.get_xlabel() == "position $x$ (mm)"
    assert axes.get_ylabel() == "time since the onset (µs)"
    assert st.plot.rupture(run.drop_attrs(), problem=PROBLEM).lines
    at_once = run.assign(onset_time=run.onset_time * 0.0)  # it begins with the run
    st.plot.rupture(at_once).figure.savefig(tmp_path / "rupture.png")
    large = make_problem(256, 5e4, weakening_rate=0.2e6)
    later = run.assign_coords(time=run.time * 1e6).assign(onset_time=run.onset_time * 1e6)
    axes = st.plot.rupture(later, problem=large)
    assert axes.get_xlabel() == "position $x$ (km)"
    assert axes.get_ylabel() == "time since the onset (s)"


def test_film_moves(run, tmp_path):
    moving = Image.open(st.plot.film(run, tmp_path / "film.gif", frames=6))
    assert moving.n_frames == 6
    first = np.asarray(moving.convert("RGB")).astype(int)
    moving.seek(5)
    assert np.abs(np.asarray(moving.convert("RGB")) - first).max() > 50


def test_planes():
    problem = make_problem((64, 32), (0.02, 0.01))
    tau_p = st.paper.strength(problem, correlation_ratio=1.0).sample(problem.interface, seed=0)
    assert st.plot.field(problem, tau_p).images
    local = local_onset(problem, tau_p)
    axes = st.plot.onset(local, tau_p)
    place = local.critical_position.values[0] * 1e3
    assert axes.lines[0].get_xydata()[0] == pytest.approx(place)
    assert len(axes.patches) == 9  # the ellipse and its periodic images
    exact = exact_onset(problem, tau_p, slip=True, sensitivity=True)
    assert len(st.plot.onset([local, exact], tau_p).collections) == 2  # two outlines


def test_what_does_not_fit_is_refused(run, swept):
    found = local_onset(PROBLEM, TAU_P)
    one = swept.isel(residual_strength=0, correlation_length=0)
    plot = st.plot
    for words, call in {
        "must have shape (256) or (samples, 256)": lambda: plot.onset(found, TAU_P[:, :100]),
        "sample: 3 of results and strength": lambda: plot.onset(found, TAU_P, sample=3),
        "with 1, 3 samples": lambda: plot.onset(found, TAU_P[0]),
        "quantity: must be one of strength": lambda: plot.field(PROBLEM, ONE, quantity="rough"),
        "ax: must be matplotlib axes, got ndarray": lambda: plot.field(PROBLEM, ONE, ax=ONE),
        "has no slip_patches; it holds": lambda: plot.monte_carlo(one, quantity="slip_patches"),
        "result.isel(": lambda: plot.monte_carlo(swept),
        "one or two parameters, got none": lambda: plot.quantiles(one),
        "give problem=": lambda: plot.rupture(run.drop_attrs()),
        "has no slip_rate": lambda: plot.rupture(run.drop_vars("slip_rate")),
        ".gif, got 'film.avi'": lambda: plot.film(run, "film.avi"),
    }.items():
        refuses(words, call)
