"""The public plots: what they draw, on whose axes, and what they refuse."""

import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
import xarray as xr

import stiction as st

PRESSURE = 5e6


@pytest.fixture(autouse=True)
def quiet_figures():
    with mpl.rc_context({"backend": "agg"}):
        yield
        plt.close("all")


def make(nodes=256, pressure=None):
    plain = st.paper.problem(nodes=nodes)
    load = st.Load(normal_pressure=pressure)
    return st.Problem(plain.solid, plain.interface, plain.friction, load)


@pytest.fixture(scope="module")
def system():
    problem = make(pressure=PRESSURE)
    strength = st.paper.strength(problem, correlation_ratio=0.5)
    tau_p = strength.sample(problem.interface, samples=3, seed=1)
    return problem, strength, tau_p


@pytest.fixture(scope="module")
def plane():
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
    interface = st.Interface(length=(0.02, 0.01), nodes=(64, 32))
    problem = st.Problem(solid, interface, st.LinearWeakening(weakening_rate=5e11))
    strength = st.paper.strength(problem, correlation_ratio=1.0)
    return problem, strength.sample(interface, seed=0)


def test_an_onset_is_drawn_where_the_result_says(system):
    """Of the sample asked for, by each method, with coefficients beside the stresses."""
    problem, _, tau_p = system
    results = [
        st.onset(problem, tau_p, method=m) for m in (st.LocalCriterion(), st.Equilibrium())
    ]
    axes = st.plot.onset(results, tau_p, sample=2)
    marked = [line for line in axes.lines if line.get_marker() != "None"]
    marks = {line.get_label(): line.get_xydata() for line in marked}
    assert len(marks) == 2
    for result, (label, place) in zip(results, marks.items(), strict=True):
        assert place[0, 0] == pytest.approx(result.critical_position[2].item() * 1e3)
        assert place[0, 1] == pytest.approx(result.critical_load[2].item() * 1e-6)
        assert f"{result.friction_coefficient[2].item():.4f}" in label
    (scale,) = axes.child_axes
    axes.figure.canvas.draw()
    assert np.array(scale.get_ylim()) * PRESSURE * 1e-6 == pytest.approx(axes.get_ylim())


def test_plots_take_axes_and_leave_the_others_alone(system):
    problem, _, tau_p = system
    figure, (left, right) = plt.subplots(1, 2)
    assert st.plot.field(problem, tau_p, ax=right) is right
    assert not left.lines
    assert right.lines[0].get_ydata() == pytest.approx(tau_p[0] * 1e-6)
    with pytest.raises(st.InputError, match=r"ax: must be matplotlib axes, got ndarray"):
        st.plot.field(problem, tau_p, ax=np.array(figure.axes))


def test_monte_carlo_shows_coefficients_where_there_is_a_pressure(system):
    problem, strength, _ = system
    method = st.LocalCriterion()
    found = st.monte_carlo(problem, strength, method=method, samples=200, seed=0)
    axes = st.plot.monte_carlo(found)
    assert axes.get_xlabel() == "static friction coefficient"
    curve = axes.lines[0].get_xydata()
    assert np.trapezoid(curve[:, 1], curve[:, 0]) == pytest.approx(1.0, abs=0.02)
    mean = np.trapezoid(curve[:, 0] * curve[:, 1], curve[:, 0])
    assert mean == pytest.approx(found.critical_stress.mean().item() / PRESSURE, rel=0.01)
    assert st.plot.monte_carlo(found, quantity="critical_stress").get_xlabel().endswith("(MPa)")
    both = st.plot.monte_carlo({"one": found, "other": found})
    assert [text.get_text() for text in both.get_legend().get_texts()] == ["one", "other"]
    with pytest.raises(st.InputError, match="has no slip_patches; it holds"):
        st.plot.monte_carlo(found, quantity="slip_patches")


def test_sweeps(system):
    _, strength, _ = system
    study = st.Study(
        problem=make(),
        random=strength,
        method=st.LocalCriterion(),
        ensemble=st.Ensemble(samples=50),
        sweep=[
            {"random.strength.spectrum.correlation_length": [1e-3, 2e-3, 4e-3]},
            {"problem.friction.residual_strength": [0.0, 1e5]},
        ],
    )
    result = study.run()
    axes = st.plot.quantiles(result)
    assert axes.get_xlabel() == "correlation length (mm)"
    medians = axes.containers[0].lines[0].get_ydata()
    expected = result.critical_stress[:, 0].median("sample").values * 1e-6
    assert medians == pytest.approx(expected, rel=2e-3)  # the estimator smooths a little
    with pytest.raises(st.InputError, match=r"result\.isel\("):
        st.plot.monte_carlo(result)
    curves = st.plot.monte_carlo(result.isel(residual_strength=0))
    assert len(curves.lines) == 3
    with pytest.raises(st.InputError, match="one or two parameters, got none"):
        st.plot.quantiles(result.isel(residual_strength=0, correlation_length=0))


def test_failure_curve_and_weak_spots(system):
    problem, strength, _ = system
    method = st.LocalCriterion()
    curve = st.failure_curve(problem, strength, method=method, smallest=1e-3)
    axes = st.plot.failure_curve(curve)
    assert axes.get_yscale() == "log"
    axes.figure.canvas.draw()
    (above,) = axes.child_axes
    assert np.array(above.get_xlim()) * PRESSURE * 1e-6 == pytest.approx(axes.get_xlim())
    assert st.plot.failure_curve(curve, above_bound=True).get_xscale() == "log"
    found = st.failure_probability(problem, strength, stress=0.7e6, method=method)
    spots = st.plot.weak_spots(found)
    mean = spots.lines[-2].get_xydata()
    assert abs(mean[mean[:, 1].argmin(), 0]) < 0.5  # weakest within the critical patch
    with pytest.raises(st.InputError, match="holds no failing profile"):
        st.plot.weak_spots(xr.Dataset())


def test_path_and_rupture(system):
    problem, _, tau_p = system
    path = st.equilibrium_path(problem, tau_p[0], [0.66e6, 0.7e6, 1.6e6])
    assert len(st.plot.equilibrium_path(path).lines) == 2  # it slides at the last
    with pytest.raises(st.InputError, match="slides at every load"):
        st.plot.equilibrium_path(path.isel(load=[2]))
    method = st.Rupture(loading_rate=1e8)
    run = st.simulate_rupture(problem, tau_p[0], method=method, save=st.Save(every=20))
    for axes in (st.plot.rupture(run), st.plot.rupture(run, whole=True)):
        onset = axes.lines[0].get_xydata()[0]
        assert onset == pytest.approx([run.critical_position.item() * 1e3, 0.0])
    assert {text.get_text() for text in st.plot.front(run).texts} == {"$c_R$", "$c_s$", "$c_d$"}
    with pytest.raises(st.InputError, match="give problem="):
        st.plot.rupture(run.drop_attrs())
    assert st.plot.rupture(run.drop_attrs(), problem=problem).lines


def test_planes(plane):
    problem, tau_p = plane
    assert st.plot.field(problem, tau_p).images
    local = st.onset(problem, tau_p, method=st.LocalCriterion())
    place = local.critical_position.values[0] * 1e3
    axes = st.plot.onset(local, tau_p)
    assert axes.lines[0].get_xydata()[0] == pytest.approx(place)
    assert len(axes.patches) == 9  # the ellipse and its periodic images
    exact = st.onset(problem, tau_p, method=st.Equilibrium(slip=True, sensitivity=True))
    assert len(st.plot.onset([local, exact], tau_p).collections) == 2  # two outlines
    loads = exact.critical_load.item() * np.array([0.98, 0.999])
    assert st.plot.equilibrium_path(st.equilibrium_path(problem, tau_p[0], loads)).images


def test_what_does_not_fit_is_refused(system, plane):
    problem, _, tau_p = system
    found = st.onset(problem, tau_p, method=st.LocalCriterion())
    with pytest.raises(st.InputError, match=r"must have shape \(256\) or \(samples, 256\)"):
        st.plot.onset(found, tau_p[:, :100])
    with pytest.raises(st.InputError, match="sample: 3 of results and strength with 3 samples"):
        st.plot.onset(found, tau_p, sample=3)
    with pytest.raises(st.InputError, match="with 1, 3 samples"):
        st.plot.onset(found, tau_p[0])
    with pytest.raises(st.InputError, match="quantity: must be one of strength"):
        st.plot.field(problem, tau_p, quantity="roughness")
