"""Recorded refusals and doubts, one call each: objects, units, laws, methods and answers."""

import dataclasses
from functools import partial

import numpy as np
import scipy.stats
import xarray as xr
from recording import Calls, compared
from refusals import table_of
from setups import (
    EXACT,
    LENGTH,
    LOCAL,
    RATE,
    SOLID,
    beta_strength,
    local_onset,
    make_problem,
)
from specimens import crooked, rough

import stiction as st
from stiction.methods.criterion.local import excess_of
from stiction.statistics import density, quantiles
from stiction.theory import energy_release_rate, griffith_length, nucleation_statistics

calls = Calls()
LINE, PROBLEM = st.Interface(0.1, 256), make_problem()
ONE, INF = np.full(256, 1e6), float("inf")
FIELD = beta_strength(2e-3)
PRESSED = make_problem(load=st.Load(normal_pressure=2e6))
OTHER = make_problem(weakening_rate=0.9 * RATE, load=st.Load(initial_stress=3e4))
COEFFICIENT = st.RandomField(
    st.Lognormal(mean=0.5, cv=0.15), FIELD.spectrum, of="friction_coefficient"
)
PAIR = ("strength", "residual_strength")
THREE = {PAIR: 0.9, ("strength", "initial_stress"): 0.9, (PAIR[1], "initial_stress"): -0.9}


def field(**options):
    return dataclasses.replace(FIELD, **options)


def several(*names, **options):
    return st.RandomInterface(**dict.fromkeys(names, FIELD), **options)


def correlated(correlation):
    return several(*PAIR, "initial_stress", correlation=correlation)


def monte_carlo(problem=PROBLEM, random=FIELD, samples=1, **options):
    given = {
        "method": LOCAL,
        "samples": samples,
        "pilot": False,
        "progress": False,
        "workers": 1,
    }
    return st.monte_carlo(problem, random, **given | options)


def failure(problem=PROBLEM, random=FIELD, **options):
    given = {"method": LOCAL, "algorithm": "plain", "max_evaluations": 100}
    return st.failure_probability(problem, random, **given | options)


def onset(strength=ONE, problem=PROBLEM, method=LOCAL, **profiles):
    given = {"strength": strength} | profiles if profiles else strength
    return st.onset(problem, given, method=method, progress=False)


def sampled(**changes):
    return onset(PROBLEM.sample(ONE)._replace(**changes))


def loaded(**load):
    return dataclasses.replace(PROBLEM, load=st.Load(**load))


def on_plane(lengths, rate=RATE):
    problem = make_problem((48, 48), lengths, weakening_rate=rate)
    return monte_carlo(problem, beta_strength(1e-3))


def scanned(values, places=(0.01, 0.02), units="Pa", x_units="m"):
    coords = {"x": ("x", [*places], {"units": x_units})}
    return FIELD.given(xr.DataArray(values, coords, "x", attrs={"units": units}), noise=1e4)


def study(**options):
    given = {"method": LOCAL, "ensemble": st.Ensemble(samples=2)} | options
    return st.Study(problem=PROBLEM, random=FIELD, **given)


def scaled(modulus=1e9, density=1170.0, length=0.1, pressure=None, **weakening):
    solid, load = st.Solid(modulus, 0.33, density), st.Load(normal_pressure=pressure)
    return make_problem(256, length, solid=solid, load=load, **weakening)


KNOWN = xr.DataArray(FIELD.sample(LINE, seed=9)[0][:90], {"x": LINE.x[:90]}, "x")
LAID = dataclasses.replace(
    make_problem(residual_ratio=0.7, load=st.Load(normal_pressure=4000.0)),
    interface=st.Interface(0.1, 256, width=0.006),
)
LAP = dataclasses.replace(
    PROBLEM,
    interface=st.Interface(0.1, 256, width=0.03),
    load=st.Load(pressing_force=6e3),
)
STEEPENING = st.PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.7, 0.0], weakening_rate=0.25e12)
EXPONENTIAL = st.ExponentialWeakening(weakening_rate=RATE)
TAU_P = beta_strength(0.25 * LENGTH).sample(st.Interface(0.05, 512), seed=1)
VARYING = make_problem(weakening_rate=RATE * (1.0 + 0.1 * np.cos(np.arange(256) / 41.0)))
SPECIMEN = crooked(load=st.Load())
ROUGH = rough(SPECIMEN, 1)
EVENTS = crooked(nodes=64, drive=st.Pusher(height=0.006, width=0.004, stiffness=3e7))
EVENT_STRENGTH = rough(EVENTS, 3)
FALLING = dataclasses.replace(
    EVENTS,
    friction=st.ExponentialWeakening(weakening_rate=1e11, residual_strength=5e5),
)


def with_law(law):
    return make_problem(512, 0.05, friction=law)


def of_specimen(**given):
    return dataclasses.replace(SPECIMEN, **given)


def ruptured(problem=PROBLEM, strength=TAU_P[:, ::2], **method):
    return onset(strength, problem, st.Rupture(**method))


def event(problem=EVENTS, profiles=EVENT_STRENGTH, method=None, **more):
    return st.simulate_rupture(problem, profiles, method=method or st.Rupture(), **more)


def inferred(peaks=(7e5, 7.1e5, 7.3e5), problem=PROBLEM, random=FIELD, prior=None, **options):
    prior = prior or {"marginal.low": (0.4e6, 0.9e6)}
    given = {"method": LOCAL, "samples": 100, "progress": False}
    return st.infer(problem, random, peaks, prior=prior, **given | options)


SEVEN = 0.7e6 + 1e4 * np.arange(7.0)
FIVE = [f"marginal.{name}" for name in ("alpha", "beta")] + ["exponent", "truncation"]
FIVE = {key: (1.0, 2.0) for key in FIVE} | {"problem.friction.weakening_rate": (4e11, 6e11)}
WIDE = st.Solid(shear_modulus=1e9, poisson_ratio=0.495, density=1170.0)
# fmt: off
table_of(calls, {
    "problems": [
        lambda: st.Interface(length=0.1, nodes=65),
        lambda: st.Interface(length=1e-308, nodes=64),
        lambda: st.Load(profile=[1.0, np.nan]),
        lambda: st.Load(profile=[1.0, 0.0], normal_pressure=[1.0, -1.0]),
        lambda: st.Load(normal_pressure=5e6, pressing_force=4e3),
        lambda: loaded(pressing_force=4e3),
        lambda: loaded(profile=np.ones((2, 2))),
        lambda: dataclasses.replace(PROBLEM, solid=3),
        lambda: st.Solid(1e9, 0.33, 1170.0, plan="stress"),
        lambda: st.Solid(youngs_modulus=1e9, shear_modulus=1e9, poisson_ratio=0.3, density=1.0),
        lambda: make_problem((48, 48), (0.02, 0.02),
                             solid=dataclasses.replace(SOLID, plane="stress")),
        lambda: make_problem(64),
        lambda: make_problem(critical_slip=1e-6).nucleation_length,
        lambda: onset(problem=make_problem(weakening_rate=1e10)),
    ],
    "laws": [
        lambda: st.LinearWeakening(),
        lambda: st.LinearWeakening(1.0, critical_slip=1.0),
        lambda: st.PiecewiseWeakening(slip=np.array(0.5), strength=[0.5, 0.0], critical_slip=1e-6),
        lambda: st.PiecewiseWeakening(slip=[0.5, 0.8, 1.0], strength=[0.5, 0.5, 0.0],
                                      critical_slip=1e-6),
        lambda: st.PiecewiseWeakening.from_law(EXPONENTIAL, 1),
        lambda: st.PiecewiseWeakening.from_law("exponential", 4),
        lambda: with_law(0.2),
        lambda: onset(TAU_P, with_law(EXPONENTIAL), EXACT),
        lambda: st.equilibrium_path(with_law(EXPONENTIAL), TAU_P, [0.6e6]),
        lambda: onset(TAU_P, with_law(STEEPENING)),
        lambda: st.theory.nucleation_stress(with_law(STEEPENING), TAU_P),
        lambda: onset(TAU_P, with_law(EXPONENTIAL)),
        lambda: st.theory.nucleation_stress(with_law(EXPONENTIAL), TAU_P),
        lambda: onset(TAU_P, with_law(STEEPENING), EXACT),
    ],
    "fields": [
        lambda: st.Beta(alpha=1.0, beta=1.0, low=2.0, high=1.0),
        lambda: st.TruncatedNormal(mean=1e6, cv=0.1, high=0.5e6),
        lambda: st.PowerLawSpectrum(1.0, truncation=2.0, power_kept=0.9),
        lambda: st.CustomSpectrum(function=np.exp, max_wavenumber=1e307),
        lambda: st.CustomSpectrum(np.cos, max_wavenumber=9.0),
        lambda: field(spectrum=st.CustomSpectrum(lambda k: 0.0 * k, 1e3)).modes(LINE),
        lambda: field(spectrum=np.cos),
        lambda: field(spectrum=st.PowerLawSpectrum),
        lambda: field(marginal=scipy.stats.lognorm),
        lambda: field(marginal={"type": "lognrm", "s": 1.0}),
        lambda: field(marginal={"type": "lognorm", "sigma": 0.3}),
        lambda: field(marginal={"type": "lognormal", "mean": 1.0}),
        lambda: field(anisotropy=2.0).sample(LINE),
        lambda: beta_strength(1.0).sample(LINE),
        lambda: beta_strength(1e-8).sample(LINE),
        lambda: FIELD.correlation(LINE, of="tau"),
        lambda: several("strength").from_draws(LINE, np.zeros((1, 251))),
        lambda: several("strength").from_draws(LINE, np.full((1, 250), np.nan)),
        lambda: beta_strength(8e-4).sample(st.Interface(0.1, 64)),
        lambda: beta_strength(8e-4).sample(st.Interface(0.1, 328)),
        lambda: beta_strength(8e-4).sample(st.Interface(0.1, 330)),
        lambda: beta_strength(0.05).sample(LINE),
        lambda: beta_strength(0.05, mean_mode=True).sample(LINE),
        lambda: beta_strength(1.6e-3, anisotropy=16.0).sample(
            st.Interface((0.01, 0.03), (128, 32))),
    ],
    "interfaces": [
        lambda: correlated({("strength", "residual"): 0.5}),
        lambda: correlated({("strength", "strength"): 0.5}),
        lambda: correlated({PAIR: 0.5, PAIR[::-1]: 0.4}),
        lambda: correlated(THREE),
        lambda: several("strength", "weakening_rate", "critical_slip"),
        lambda: st.RandomInterface(strength=FIELD, critical_slip=COEFFICIENT),
        lambda: monte_carlo(random=COEFFICIENT),
        lambda: study(ensemble=st.Ensemble(samples=2, keep="x" * 10_000)),
        lambda: study(method=st.Equilibrium(slip=True),
                      sweep=[{"problem.interface.nodes": [128, 256]}]),
        lambda: study().run("folder"),
        lambda: st.monte_carlo(problem=3, random=4, seed="x", method=LOCAL, samples=1),
        lambda: monte_carlo(progress=int),
    ],
    "scans": [
        lambda: FIELD.given(np.stack([ONE, ONE, ONE]), noise=1e4),
        lambda: scanned([1e6, np.inf]),
        lambda: scanned([1e6, 1.1e6], places=(0.01, np.nan)),
        lambda: scanned([1e6, 1.1e6], x_units="s"),
        lambda: scanned([1e3, 1.1e3], units="kN"),
        lambda: FIELD.given(3.0 * KNOWN, noise=1e3).sample(LINE),
        lambda: FIELD.given(KNOWN.assign_coords(x=KNOWN.x + 0.09), noise=1e3).sample(LINE),
        lambda: FIELD.given(KNOWN, noise=1e3).given(KNOWN, noise=1e3),
        lambda: nucleation_statistics(PROBLEM, FIELD.given(KNOWN, noise=1e3)),
        lambda: inferred(random=FIELD.given(KNOWN, noise=1e3)),
        lambda: FIELD.given(KNOWN[::-1].assign_coords(x=KNOWN.x), noise=1e3).sample(LINE),
    ],
    "theory": [
        lambda: energy_release_rate(make_problem(residual_ratio=0.5), 1e6, 0.01),
        lambda: griffith_length(make_problem(residual_ratio=0.5), 1e6, 1.0),
        lambda: energy_release_rate(PROBLEM, 1e6, 0.2),
        lambda: nucleation_statistics(loaded(profile=np.linspace(0.9, 1.1, 256)), FIELD),
        lambda: quantiles(np.arange(10.0), 1.0),
        lambda: quantiles([1.0, np.nan], 0.5),
        lambda: density(np.ones(50)),
        lambda: density(np.linspace(-1, 1, 50), bounds=(0.0, None)),
    ],
    "profiles": [
        lambda: excess_of(PROBLEM.sample(ONE)._replace(
            strength=np.where(np.arange(256) == 3, np.inf, [ONE]))),
        lambda: on_plane((1.6 * LENGTH, 4.0 * LENGTH)),
        lambda: on_plane((5.0 * LENGTH, 4.0 * LENGTH),
                         RATE * np.linspace(0.9, 1.0, 48 * 48).reshape(48, 48)),
        lambda: onset(np.ones(100)),
        lambda: onset(np.full(256, 1e308)),
        lambda: onset(make_problem(512).sample(np.full(512, 1e6))),
        lambda: onset(np.ma.masked_less(np.arange(256.0), 3)),
        lambda: onset(residual_strength=2e6),
        lambda: onset(np.ones((3, 256)), initial_stress=np.zeros((2, 256))),
        lambda: onset(np.stack([3.0 * ONE, ONE]),
                      initial_stress=2e6 * (abs(np.arange(256) - 78) < 2)),
        lambda: onset(np.stack([ONE, np.where(np.arange(256) == 30, 1e90, ONE)])),
        lambda: onset(OTHER.sample(ONE)),
        lambda: sampled(problem=None, load_profile=np.linspace(0.9, 1.1, 256)),
        lambda: sampled(residual_strength=-ONE[None]),
        lambda: onset(PROBLEM.sample(
            np.where(np.arange(256) == 3, np.inf, ONE), accept=("barriers",)), method=EXACT),
        lambda: onset(PROBLEM.sample(
            {"strength": ONE, "initial_stress": 2e6 * (np.arange(256) < 2)},
            accept=("overstress",))),
        lambda: onset(method=EXACT, weakening_rate=np.nan),
        lambda: onset(np.stack([ONE, ONE]), normal_pressure=np.array([[5e6], [-5e6]])),
        lambda: onset(np.full(256, np.nan), residual_strength=-1.0, initial_stress="x",
                      weakening_rate=-1.0),
        lambda: onset(method=st.LocalCriterion),
        lambda: st.equilibrium_path(PROBLEM, 0.9 * ONE, [2e5, 1e5]),
        lambda: st.equilibrium_path(PROBLEM, 0.9 * ONE, [np.nan]),
        lambda: st.equilibrium_path(make_problem((32, 32), (0.01, 0.01)),
                                    np.ones((2, 32, 32)), [1e5]),
        lambda: onset(np.full(128, 1e6), make_problem(128)),
        lambda: onset(initial_stress=np.where(np.arange(256) > 230, -2e6, 0.0)),
    ],
    "specimens": [
        lambda: of_specimen(load=st.Load(profile=st.GradientLoad(amplitude=0.2))),
        lambda: crooked(height=1e-3),
        lambda: crooked(height=31.0),
        lambda: crooked(drive=st.Pusher(height=0.0295, width=0.001)),
        lambda: crooked(drive=st.Platen(stiffness=20.0)),
        lambda: crooked(height=0.01, rate=0.01e12),
        lambda: st.Blocks(height=0.05, drive=st.Platen(stiffness=2e7)),
        lambda: st.Blocks(height=0.05, drive=st.Platen(mass=1.0)),
        lambda: st.Blocks(height=0.05, drive={"type": "platen", "mass": -1.0}),
        lambda: st.Blocks(height=0.05, quality_factor=0.0),
        lambda: of_specimen(interface=st.Interface((0.1, 0.1), (32, 32))),
        lambda: st.Interface((0.1, 0.1), (32, 32), width=0.1),
        lambda: SPECIMEN.sample(of_specimen(specimen=st.Blocks(height=0.02)).sample(ROUGH)),
        lambda: onset(ROUGH, SPECIMEN, st.Rupture(loading_rate=1e9)),
        lambda: event(method=st.Rupture(start="rest")),
        lambda: event(method=st.Rupture(stop="rest")),
        lambda: event(problem=FALLING),
        lambda: event(save=st.Save(to="run")),
        lambda: event(event=1000),
        lambda: event(method=st.Rupture(max_steps=1)),
        lambda: event(profiles=np.where(EVENT_STRENGTH > 1.2e6, np.inf, EVENT_STRENGTH)),
        lambda: event(profiles={"strength": EVENT_STRENGTH,
                                "initial_stress": EVENT_STRENGTH + 1.0}),
        lambda: event(problem=crooked(nodes=64, rate=0.01e12, height=0.02,
                                      drive=st.Platen(stiffness=float("inf")))),
    ],
    "ruptures": [
        lambda: st.Rupture(loading_rate=1e7, load=([0.0, 1.0], [0.0, 1e7])),
        lambda: st.Rupture(loading_rate=1e7, stop="time"),
        lambda: st.Rupture(load=([0.0, 1.0, 0.5], [0.0, 1e5, 2e6])),
        lambda: st.Rupture(load=3.0),
        lambda: st.Save(to=3),
        lambda: st.Save(fields=None),
        lambda: st.Save(fields=["slip_rat"]),
        lambda: ruptured(),
        lambda: ruptured(loading_rate=1e8, events=1),
        lambda: ruptured(loading_rate=1e-2),
        lambda: ruptured(loading_rate=1e8, end_time=1e-9),
        lambda: ruptured(load=([0.0, 1.0], [1e5, 1e5])),
        lambda: ruptured(loading_rate=1e8, max_steps=20),
        lambda: ruptured(loading_rate=1e15),
        lambda: ruptured(loading_rate=1e7, kernel_tolerance=1e-2),
        lambda: ruptured(make_problem(weakening_rate=5e-324), loading_rate=1e7),
        lambda: ruptured(make_problem(residual_strength=2e6), loading_rate=1e7),
        lambda: ruptured(strength=np.full(256, np.inf), loading_rate=1e7),
        lambda: onset(np.where(np.arange(256) == 3, np.inf, ONE)),
        lambda: st.simulate_rupture(PROBLEM, np.stack([ONE] * 2),
                                    method=st.Rupture(loading_rate=1e8)),
        lambda: st.Rupture(loading_rate=1e8).prepare(
            make_problem((72, 64), (0.0208, 0.0156), solid=WIDE)),
        lambda: ruptured(loading_rate=1e12, stop="onset"),
        lambda: ruptured(make_problem(128), 0.5 * (TAU_P[:, ::4] + 1e6), loading_rate=1e9,
                         stop="onset"),
    ],
    "units": [
        lambda: st.Solid(1e9, 0.33, 1.17),
        lambda: st.Solid(1.0, 0.33, 1170.0),
        lambda: scaled(modulus=1e3),
        lambda: scaled(critical_slip=2.0).warn_of_units(1e6),
        lambda: scaled(critical_slip=2.0).warn_of_units(1e12),
        lambda: onset(np.full(256, 6.0), scaled(weakening_rate=2e9, length=10.0)),
        lambda: scaled(length=4e-4, weakening_rate=2e14).warn_of_units(1e6),
        *(partial(lambda p: scaled(pressure=p).warn_of_units(1e6), p)
          for p in (5e11, 5e9, 2e6, 5e4, 4000.0)),
        lambda: onset(normal_pressure=5e4),
        lambda: st.Lognormal(mean=1e6, cv=2),
        lambda: st.Weibull(mean=1e6, cv=15),
        lambda: monte_carlo(random=field(spectrum=st.PowerLawSpectrum(4.0), mean_mode=True)),
        lambda: failure(scaled(pressure=2e6), friction_coefficient=40),
        lambda: PROBLEM.warn_of_units(1e6, 0.45),
        lambda: PROBLEM.warn_of_units(30.0),
        lambda: monte_carlo(random=field(marginal=scipy.stats.uniform(0.3, 0.2))),
        lambda: local_onset(LAID, np.full(256, 0.9e6)),
        lambda: monte_carlo(LAID, dataclasses.replace(
            COEFFICIENT, marginal=st.Gamma(mean=0.6, cv=0.1))),
        lambda: failure(LAP, COEFFICIENT, force=1.2),
        lambda: failure(PRESSED, stress=700.0),
        lambda: local_onset(scaled(length=2.1 * PROBLEM.nucleation_length),
                            np.linspace(1e6, 1.1e6, 256)),
        lambda: scaled(length=4.1 * PROBLEM.nucleation_length),
        lambda: make_problem((64, 64), (0.01, 0.01)),
    ],
    "answers": [
        lambda: failure(stress="low", method=st.LocalCriterion, target_cv=0.0,
                        max_evaluations=3),
        lambda: failure(stress=0.67e6, event="collapse"),
        lambda: failure(stress=0.67e6, workers=1.5),
        lambda: failure(stress=np.nan),
        lambda: failure(VARYING, stress=0.67e6, method=EXACT, algorithm="two_level"),
        lambda: failure(stress=0.67e6, algorithm="two_level"),
        lambda: failure(with_law(STEEPENING), stress=0.7e6, method=EXACT, algorithm="two_level"),
        lambda: st.design_stress(PROBLEM, FIELD, probability=1e-3,
                                 method=st.Rupture(loading_rate=1e9)),
        *(partial(failure, stress=0.67e6, method=st.Rupture(loading_rate=1e9),
                  algorithm=one, max_evaluations=None) for one in ("subset", "two_level")),
        lambda: st.failure_curve(PROBLEM, FIELD, smallest=1e-40, method=LOCAL),
        lambda: failure(make_problem(residual_strength=1e6), stress=1e6),
        lambda: monte_carlo(make_problem(residual_strength=1e6)),
        lambda: monte_carlo(make_problem(residual_strength=0.73e6), samples=16, method=EXACT),
    ],
    "inference": [
        lambda: inferred(unit="kN"),
        lambda: inferred(SEVEN / 1e6),
        lambda: inferred(np.append(SEVEN, 0.2e6)),
        lambda: inferred(SEVEN + 1e6),
        lambda: inferred(SEVEN[:2]),
        lambda: inferred({"short": SEVEN}),
        lambda: inferred({0.1: SEVEN, 1e-3: SEVEN}),
        lambda: inferred(SEVEN / 2e6, unit="1"),
        lambda: inferred(SEVEN / 1e6, unit="MPa", load_cell_error=5e3),
        lambda: inferred(prior={"corelation_length": (1.0, 2.0)}),
        lambda: inferred(prior={"mean": (1.0, 2.0)}),
        lambda: inferred(prior={"marginal.low": {"low": 0.0, "high": 1e6, "spacing": "log"}}),
        lambda: inferred(prior={"marginal.low": (1e6, 2e6)}),
        lambda: inferred(prior={"correlation_length": (1e-3, 1.0)}),
        lambda: inferred(method="local"),
        lambda: inferred(prior=FIVE),
        lambda: inferred(problem=LAP, random=COEFFICIENT, peaks={0.2: [0.4, 0.41, 0.42]},
                         unit="1", prior={"marginal.mean": (0.3, 0.6)}),
        lambda: inferred(np.append(SEVEN, 0.6e6), prior={"correlation_length": (1e-3, 0.01)}),
        lambda: inferred(SEVEN, prior={"marginal.low": (0.4e6, 0.64e6)}),
        lambda: st.infer(PROBLEM, FIELD, SEVEN, method=LOCAL),
        lambda: st.infer(PROBLEM, [FIELD] * 2, SEVEN, method=LOCAL),
        lambda: inferred(SEVEN, random=[FIELD, beta_strength(3e-3)]),
        lambda: st.infer(PROBLEM, [FIELD.given(KNOWN, noise=k * 1e4) for k in (1, 2)], SEVEN,
                         method=LOCAL),
        lambda: st.external.limit_state(PROBLEM, FIELD, LOCAL)(np.zeros((2, 3))),
        lambda: st.external.simulator(PROBLEM, FIELD, "marginal.lo", method=LOCAL, samples=3),
        lambda: st.external.simulator(PROBLEM, FIELD, ("mean", "corr"), method=LOCAL, samples=3),
        lambda: st.external.simulator(PROBLEM, FIELD, ("marginal.low",), method=LOCAL,
                                      samples=3)([]),
    ],
})
# fmt: on

test_outputs_are_as_recorded = compared(calls, __file__)
