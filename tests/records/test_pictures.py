"""Recorded outputs: every line, point, label and legend of the figures."""

import dataclasses

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr
from crooked import LINE, PLANE, PLANE_STRENGTH, TWO, of_width
from recording import Calls, compared, filmed
from setups import EXACT, LOCAL, beta_strength, make_problem
from small_study import lengths, small_study
from specimens import crooked, rough

import stiction as st

calls = Calls()
DRAWN = "the same numbers in the records of what is drawn; looked at"
FIELD = beta_strength(2.3e-3, truncation=2.5)
EXACTLY = st.Equilibrium(slip=True, sensitivity=True)
JOINT = crooked(nodes=64, drive=st.Pusher(height=0.008, width=0.004))


def plain(problem):
    """The problem without profiles of its own."""
    friction = st.LinearWeakening(weakening_rate=0.28e12, residual_strength=1.9e5)
    return dataclasses.replace(problem, friction=friction, load=st.Load(normal_pressure=2.9e6))


@calls(DRAWN)
def coefficients_measured_and_drawn():
    x = LINE.interface.x
    measured = xr.DataArray(TWO[0] / 2.9e6, {"x": x}, "x", name="mu")
    mu = st.read_profile(measured, quantity="friction_coefficient")
    field = st.RandomField(
        st.Lognormal(mean=0.4, cv=0.2), FIELD.spectrum, of="friction_coefficient"
    ).given(mu[40:60], noise=5e-3)
    problem = plain(LINE)
    found = st.onset(problem, mu, method=LOCAL)
    return {
        "measured": st.plot.field(problem, mu),
        "drawn": st.plot.field(problem, field),
        "bare": st.plot.field(problem, mu.values, quantity="friction_coefficient"),
        "onset": st.plot.onset(found, mu, problem=problem),
    }


@calls(DRAWN)
def onsets_on_a_line_and_a_plane():
    both = [st.onset(LINE, TWO, method=method) for method in (LOCAL, EXACT)]
    plane = st.onset(PLANE, PLANE_STRENGTH, method=LOCAL)
    exact = st.onset(PLANE, PLANE_STRENGTH, method=EXACTLY)
    return {
        "line": st.plot.onset(both, TWO, problem=LINE, sample=1),
        "plane": st.plot.onset(plane, PLANE_STRENGTH, problem=PLANE),
        "two": st.plot.onset([plane, exact], PLANE_STRENGTH),
        "weak": st.plot.onset([0.1 * one for one in both], TWO, problem=LINE, sample=0),
        "field": st.plot.field(LINE, TWO[1]),
        "field of a plane": st.plot.field(PLANE.interface, PLANE_STRENGTH),
    }


@calls(DRAWN)
def densities_and_quantiles():
    sweep = [
        *lengths(1.7e-3, 2.9e-3, 4.1e-3),
        {"problem.friction.residual_strength": [4e4, 1.5e5]},
    ]
    study = small_study(
        nodes=96, length=0.047, weakening_rate=0.31e12, ensemble={"samples": 40}, sweep=sweep
    )
    swept = st.Study.from_dict(study).run(progress=False)
    many = {"method": LOCAL, "samples": 60, "seed": 2, "pilot": False}
    one = st.monte_carlo(plain(LINE), FIELD, **many)
    wide = st.monte_carlo(
        of_width(dataclasses.replace(LINE, load=st.Load()), 0.012), FIELD, **many
    )
    weak = one.map(lambda values: 0.01 * values, keep_attrs=True)
    return {
        "one": st.plot.monte_carlo(one),
        "several": st.plot.monte_carlo(
            {"a": one, "b": one.isel(sample=slice(7, None))}, quantity="critical_position"
        ),
        "swept": st.plot.monte_carlo(swept.isel(residual_strength=1)),
        "weak": st.plot.monte_carlo([weak, one], quantity="critical_stress"),
        "forces": st.plot.monte_carlo(wide),
        "quantiles": st.plot.quantiles(
            swept.isel(residual_strength=0), along="correlation_length"
        ),
    }


@calls(DRAWN)
def specimens_and_their_events():
    strength = rough(JOINT, 6)[0]
    found = st.onset(JOINT, strength, method=st.Equilibrium(events=5))
    path = st.equilibrium_path(JOINT, strength, np.linspace(2e5, 1.5e6, 9))
    event = st.simulate_rupture(JOINT, strength, method=st.Rupture(), event=0)
    return {
        "block": st.plot.block(event),
        "specimen": st.plot.specimen(JOINT, strength, found),
        "precursors": st.plot.precursors(path, problem=JOINT),
        "force": st.plot.force_travel(path),
    }


@calls(DRAWN, close=1e-4)
def failure_curves():
    options = {"method": LOCAL, "smallest": 1e-2, "target_cv": 0.4, "seed": 3}
    curve = st.failure_curve(of_width(plain(LINE), 0.012), FIELD, **options)
    without = curve.drop_vars("force")
    return {
        "curve": st.plot.failure_curve(curve),
        "asked": st.plot.failure_curve(curve, stress=7.4e5),
        "force": st.plot.failure_curve(curve, force=310.0),
        "coefficient": st.plot.failure_curve(without, stress=7.2e5),
    }


@calls(DRAWN, close=1e-4)
def agreement_with_a_posterior():
    problem = plain(LINE)
    peaks = np.array([7.1e5, 7.4e5, 6.9e5, 7.7e5, 7.3e5])
    prior = {
        "correlation_length": {"low": 8e-4, "high": 6e-3, "spacing": "log"},
        "marginal.low": (5.2e5, 7.2e5),
    }
    found = st.infer(problem, FIELD, peaks, prior=prior, method=LOCAL, samples=200)
    agreed = st.statistics.agreement(found, 1.01 * peaks, replicates=199)
    return st.plot.agreement(agreed)


@calls(DRAWN, close=1e-3)
def a_fit_of_two_records():
    grid = st.Interface(0.03, 140)
    rows = FIELD.sample(grid, samples=2, seed=9)
    found = st.fit_field(rows, grid, marginal="beta", bootstrap=20, seed=1)
    return st.plot.fit(found)


@calls(DRAWN, close=1e-4)
def a_rupture_and_its_film():
    save = st.Save(["slip", "slip_rate", "shear_stress"], every=30)
    method = st.Rupture(loading_rate=9e8, kernel_tolerance=1e-5)
    run = st.simulate_rupture(LINE, TWO[0], method=method, save=save)
    at_once = run.assign(onset_time=run.onset_time * 0.0)  # it begins with the run
    slow = run.assign_coords(time=run.time * 1e6).assign(onset_time=run.onset_time * 1e6)
    large = make_problem(96, 5e4, weakening_rate=0.2e6)
    return {
        "rupture": st.plot.rupture(run, problem=LINE),
        "at once": st.plot.rupture(at_once),
        "large": st.plot.rupture(slow.drop_attrs(), problem=large),
        "film": filmed(run),
    }


test_outputs_are_as_recorded = compared(calls, __file__)
plt.rcParams["figure.max_open_warning"] = 0
