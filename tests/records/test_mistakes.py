"""Recorded refusals and doubts, one call each: objects, units, laws, methods, answers, pictures."""

import dataclasses
from functools import partial
from unittest import mock

import numpy as np
import scipy.stats
import xarray as xr
from crooked import LINE as CROOKED
from crooked import LINE_STRENGTH
from recording import Calls, compared, each, table_of
from setups import (
    EXACT,
    LENGTH,
    LOCAL,
    RATE,
    SOLID,
    beta_strength,
    ensemble,
    local_onset,
    make_problem,
    within,
)
from specimens import crooked, rough

import stiction as st
from stiction.ensemble import monte_carlo
from stiction.statistics import density, quantiles
from stiction.theory import energy_release_rate, nucleation_statistics, nucleation_stress

calls = Calls()
LINE, PROBLEM = st.Interface(0.1, 256), make_problem()
SCALELESS = make_problem(weakening_rate=None)
ONE, NODE = np.full(256, 1e6), np.arange(256)
FIELD = beta_strength(2e-3)
PRESSED = make_problem(load=st.Load(normal_pressure=2e6))
OTHER = make_problem(weakening_rate=0.9 * RATE, load=st.Load(initial_stress=3e4))
PAIR = ("strength", "residual_strength")
THREE = {PAIR: 0.9, ("strength", "initial_stress"): 0.9, (PAIR[1], "initial_stress"): -0.9}


def field(marginal=FIELD.marginal, spectrum=FIELD.spectrum, **options):
    return st.RandomField(marginal, spectrum, **options)


COEFFICIENT = field(st.Lognormal(mean=0.5, cv=0.15), of="friction_coefficient")
LOGNORMAL = field(st.Lognormal(mean=1.1e6, cv=0.2))
FINE = field(LOGNORMAL.marginal, st.PowerLawSpectrum(2e-9))


def several(*names, **options):
    return st.RandomInterface(**dict.fromkeys(names, FIELD), **options)


def correlated(correlation):
    return several(*PAIR, "initial_stress", correlation=correlation)


def sampled(problem=PROBLEM, random=FIELD, samples=1, **options):
    return ensemble(problem, random, samples, **{"workers": 1} | options)


def failure(problem=PROBLEM, random=FIELD, **options):
    given = {"method": LOCAL, "algorithm": "plain", "max_evaluations": 100}
    return st.failure_probability(problem, random, **given | options)


def onset(strength=ONE, problem=PROBLEM, method=LOCAL, **profiles):
    given = {"strength": strength} | profiles if profiles else strength
    return st.onset(problem, given, method=method, progress=False)


def ready(accept=(), method=LOCAL, profiles=ONE, **changes):
    return onset(PROBLEM.sample(profiles, accept=accept)._replace(**changes), method=method)


def loaded(**load):
    return dataclasses.replace(PROBLEM, load=st.Load(**load))


def on_plane(lengths, rate=RATE):
    problem = make_problem((48, 48), lengths, weakening_rate=rate)
    return sampled(problem, beta_strength(1e-3))


def scanned(values, places=(0.01, 0.02), units="Pa", x_units="m"):
    coords = {"x": ("x", [*places], {"units": x_units})}
    return FIELD.given(xr.DataArray(values, coords, "x", attrs={"units": units}), noise=1e4)


def study(**options):
    given = {"method": LOCAL, "ensemble": st.Ensemble(samples=2)} | options
    return st.Study(problem=PROBLEM, random=FIELD, **given)


def scaled(modulus=1e9, density=1170.0, length=0.1, pressure=None, **weakening):
    solid, load = st.Solid(modulus, 0.33, density), st.Load(normal_pressure=pressure)
    return make_problem(256, length, solid=solid, load=load, **weakening)


def judged(mean=1e6, **given):
    scaled(**given).warn_of_units(mean)


KNOWN = xr.DataArray(FIELD.sample(LINE, seed=9)[0][:90], {"x": LINE.x[:90]}, "x")
LAID = dataclasses.replace(
    make_problem(residual_ratio=0.7, load=st.Load(normal_pressure=4000.0)),
    interface=st.Interface(0.1, 256, width=0.006),
)
LAP = dataclasses.replace(
    loaded(), interface=st.Interface(0.1, 256, width=0.03), load=st.Load(pressing_force=6e3)
)
STEEPENING = st.PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.7, 0.0], weakening_rate=0.25e12)
EXPONENTIAL = st.ExponentialWeakening(weakening_rate=RATE)
TAU_P = beta_strength(0.25 * LENGTH).sample(st.Interface(0.05, 512), seed=1)
VARYING = make_problem(weakening_rate=RATE * (1.0 + 0.1 * np.cos(NODE / 41.0)))
RISING = np.linspace(1e11, 2e11, 256)
SPECIMEN = crooked(load=st.Load())
ROUGH = rough(SPECIMEN, 1)
EVENTS = crooked(nodes=64, drive=st.Pusher(height=0.006, width=0.004, stiffness=3e7))
STRONG = rough(EVENTS, 3)
FALLING = st.ExponentialWeakening(weakening_rate=1e11, residual_strength=5e5)
STIFF = st.Platen(stiffness=float("inf"))


def with_law(law):
    return make_problem(512, 0.05, friction=law)


def of_specimen(**given):
    return dataclasses.replace(SPECIMEN, **given)


def ruptured(problem=PROBLEM, strength=TAU_P[:, ::2], **method):
    return onset(strength, problem, st.Rupture(**method))


def event(problem=EVENTS, profiles=STRONG, save=None, event=None, **method):
    given = {"method": st.Rupture(**method), "save": save, "event": event}
    return st.simulate_rupture(problem, profiles, **{k: v for k, v in given.items() if v})


def announced(samples, workers):
    """An ensemble of which nothing is computed."""
    given = {"method": st.Rupture(loading_rate=1e6), "workers": workers, "pilot": False}
    with mock.patch.object(monte_carlo, "complete"):
        return st.monte_carlo(make_problem(4096, 0.7), FIELD, samples=samples, **given)


def steep(critical_slip):
    problem = make_problem(critical_slip=critical_slip, residual_strength=3e5)
    return onset(1.1e6 + 2e5 * np.sin(NODE / 7.0), problem, EXACT).critical_stress


def with_residual(residual, method=EXACT):
    profiles = {"strength": LINE_STRENGTH, "residual_strength": residual}
    law = dataclasses.replace(CROOKED.friction, residual_strength=0.0)
    problem = dataclasses.replace(CROOKED, friction=law)
    return st.onset(problem, profiles, method=method).critical_stress


def inferred(peaks=(7e5, 7.1e5, 7.3e5), problem=PROBLEM, random=FIELD, prior=None, **options):
    prior = {"marginal.low": (0.4e6, 0.9e6)} if prior is None else prior
    given = {"method": LOCAL, "samples": 100, "progress": False}
    return st.infer(problem, random, peaks, prior=prior, **given | options)


def weighed(random):
    """Peaks of interfaces that need no prior."""
    return st.infer(PROBLEM, random, SEVEN, method=LOCAL, samples=100, progress=False)


SLOW = st.Rupture(loading_rate=9e8)
SEVEN = 0.7e6 + 1e4 * np.arange(7.0)
FIVE = [f"marginal.{name}" for name in ("alpha", "beta")] + ["exponent", "truncation"]
FIVE = {key: (1.0, 2.0) for key in FIVE} | {"problem.friction.weakening_rate": (4e11, 6e11)}
MEAN = "marginal.mean"
PREDICTED = xr.Dataset({"critical_stress": ("sample", 7e5 + 1e4 * np.sin(np.arange(90.0)))})
ONSET = st.onset(CROOKED, LINE_STRENGTH, method=LOCAL)
simulator = partial(st.external.simulator, PROBLEM, FIELD, method=LOCAL, samples=3)
# fmt: off
table_of(calls, {
    "problems": [
        *each(st.Interface, {"length": 0.1, "nodes": 65}, {"length": 1e-308, "nodes": 64}),
        lambda: st.Load(normal_pressure=5e6, pressing_force=4e3),
        lambda: loaded(pressing_force=4e3),
        lambda: dataclasses.replace(PROBLEM, solid=3),
        lambda: st.Solid(youngs_modulus=1e9, shear_modulus=1e9, poisson_ratio=0.3, density=1.0),
        lambda: make_problem((48, 48), (0.02, 0.02),
                             solid=dataclasses.replace(SOLID, plane="stress")),
        *each(make_problem, 64, {"mode": "i" * 58}, {"weakening_rate": RISING * 60.0}),
        lambda: make_problem(critical_slip=1e-6).nucleation_length,
        lambda: onset(problem=make_problem(weakening_rate=1e10)),
    ],
    "laws": [
        *each(st.LinearWeakening, {}, {"weakening_rate": 1.0, "critical_slip": 1.0}),
        *(partial(st.PiecewiseWeakening, slip=slip, strength=[*strength, 0.0], critical_slip=1e-6)
          for slip, strength in ((np.array(0.5), [0.5]), ([0.5, 0.8, 1.0], [0.5, 0.5]),
                                 ([0.6, 0.4, 1.0], [0.5, 0.3]), ([0.4, 0.9], [0.5]))),
        lambda: st.PiecewiseWeakening.from_law(EXPONENTIAL, 1),
        lambda: st.PiecewiseWeakening.from_law("exponential", 4),
        lambda: with_law(0.2),
        *(partial(onset, TAU_P, with_law(law), method) for law, method in (
            (EXPONENTIAL, EXACT), (STEEPENING, LOCAL), (EXPONENTIAL, LOCAL), (STEEPENING, EXACT))),
        lambda: st.equilibrium_path(with_law(EXPONENTIAL), TAU_P, [0.6e6]),
        lambda: nucleation_stress(with_law(STEEPENING), TAU_P),
    ],
    "fields": [
        *each(st.TruncatedNormal, {"mean": 1e6, "cv": 0.1, "high": 0.5e6},
              {"mean": 1e6, "cv": 0.4, "low": 8e5}),
        lambda: st.PowerLawSpectrum(1.0, truncation=2.0, power_kept=0.9),
        lambda: st.CustomSpectrum(function=np.exp, max_wavenumber=1e307),
        lambda: st.CustomSpectrum(np.cos, max_wavenumber=9.0),
        lambda: field(spectrum=st.CustomSpectrum(lambda k: 0.0 * k, 1e3)).modes(LINE),
        lambda: field(spectrum=st.PowerLawSpectrum),
        *each(field, scipy.stats.lognorm, scipy.stats.lognorm(-0.3)),
        *each(field, *({"marginal": one} for one in (
            {"type": "lognrm", "s": 1.0}, {"type": "lognorm", "sigma": 0.3},
            {"type": "gamma", "a": 2.0, "cv": 0.2}, {"type": "lognormal", "mean": 1.0}))),
        lambda: field(anisotropy=2.0).sample(LINE),
        lambda: sampled(random=st.RandomInterface(strength=FINE, residual_strength=FINE)),
        lambda: FIELD.correlation(LINE, of="tau"),
        lambda: several("strength").from_draws(LINE, np.zeros((1, 251))),
        lambda: several("strength").from_draws(LINE, np.full((1, 250), np.nan)),
        *(partial(beta_strength(8e-4).sample, st.Interface(0.1, nodes)) for nodes in (328, 330)),
        *(partial(beta_strength(length, mean_mode=mean).sample, LINE)
          for length, mean in ((1.0, False), (0.05, False), (0.05, True))),
        lambda: beta_strength(1.6e-3, anisotropy=16.0).sample(
            st.Interface((0.01, 0.03), (128, 32))),
    ],
    "extents": [
        *(partial(st.Interface, 0.1, 256, extent=one) for one in (
            (0.02, 0.11), (0.06, 0.02), (0.02, 0.0203), ("2 cm", "5 kg"), 3.0, (0.1,), NODE < 1,
            np.ones(255, dtype=bool), [[0.01, 0.02], [0.03, 0.04]], st.Ellipse(
                centre=(0.05, 0.05), semi_axes=(0.01, 0.01)))),
        lambda: st.Interface((0.1, 0.1), (32, 32), extent=(0.02, 0.05)),
        lambda: st.Interface((0.1, 0.1), (32, 32), extent={"centre": [0.05, 0.05]}),
        lambda: st.Ellipse(centre=(0.05, 0.05), semi_axes=(0.01, 0.0)),
        lambda: within(PROBLEM, (0.02, 0.022)),
        lambda: within(make_problem((48, 48), (0.02, 0.02)), ((0.0, 0.01), (0.01, 0.012))),
    ],
    "interfaces": [
        *each(correlated, *({"correlation": one} for one in (
            {("strength", "residual"): 0.5}, {("strength", "strength"): 0.5},
            {PAIR: 0.5, PAIR[::-1]: 0.4}, THREE))),
        lambda: several("strength", "weakening_rate", "critical_slip"),
        lambda: st.RandomInterface(strength=FIELD, critical_slip=COEFFICIENT),
        *each(sampled, {"random": COEFFICIENT}, {"keep": ("residual_strength", "strenght")},
              {"progress": int}),
        lambda: study(ensemble=st.Ensemble(samples=2, keep="x" * 10_000)),
        lambda: study(method=st.Equilibrium(slip=True),
                      sweep=[{"problem.interface.nodes": [128, 256]}]),
        lambda: study().run("folder"),
        lambda: st.monte_carlo(problem=3, random=4, seed="x", method=LOCAL, samples=1),
        *(partial(announced, *one) for one in ((2_100, 1), (47_000, 3))),
    ],
    "scans": [
        lambda: FIELD.given(np.stack([ONE, ONE, ONE]), noise=1e4),
        lambda: scanned([1e6, 1.1e6], places=(0.01, np.nan)),
        lambda: scanned([1e6, 1.1e6], x_units="s"),
        lambda: scanned([1e3, 1.1e3], units="kN"),
        lambda: FIELD.given(3.0 * KNOWN, noise=1e3).sample(LINE),
        lambda: FIELD.given(KNOWN.assign_coords(x=KNOWN.x + 0.09), noise=1e3).sample(LINE),
        lambda: FIELD.given(KNOWN, noise=1e3).given(KNOWN, noise=1e3),
        lambda: nucleation_statistics(PROBLEM, FIELD.given(KNOWN, noise=1e3)),
        lambda: inferred(random=FIELD.given(KNOWN, noise=1e3)),
        lambda: weighed([FIELD.given(KNOWN, noise=k * 1e4) for k in (1, 2)]),
        lambda: FIELD.given(KNOWN[::-1].assign_coords(x=KNOWN.x), noise=1e3).sample(LINE),
    ],
    "theory": [
        lambda: energy_release_rate(make_problem(residual_ratio=0.5), 1e6, 0.01),
        lambda: energy_release_rate(PROBLEM, 1e6, 0.2),
        lambda: nucleation_statistics(loaded(profile=np.linspace(0.9, 1.1, 256)), FIELD),
        lambda: quantiles(np.arange(10.0), 1.0),
        lambda: quantiles([1.0, np.nan], 0.5),
        lambda: density(np.ones(50)),
        lambda: density(np.linspace(-1, 1, 50), bounds=(0.0, None)),
    ],
    "profiles": [
        lambda: on_plane((1.6 * LENGTH, 4.0 * LENGTH)),
        lambda: on_plane((5.0 * LENGTH, 4.0 * LENGTH),
                         RATE * np.linspace(0.9, 1.0, 48 * 48).reshape(48, 48)),
        *each(onset, np.ones(100), np.full(256, 1e308), np.ma.masked_less(np.arange(256.0), 3),
              np.where(NODE == 3, np.inf, ONE),
              np.stack([ONE, np.where(NODE == 30, 1e90, ONE)]),
              make_problem(512).sample(np.full(512, 1e6)), OTHER.sample(ONE)),
        *each(onset, {"residual_strength": 2e6}, {"problem": SCALELESS, "weakening_rate": np.nan},
              {"method": st.LocalCriterion},
              {"strength": np.ones((3, 256)), "initial_stress": np.zeros((2, 256))},
              {"strength": np.stack([3.0 * ONE, ONE]),
               "initial_stress": 2e6 * (abs(NODE - 78) < 2)},
              {"strength": np.stack([ONE, ONE]), "normal_pressure": np.array([[5e6], [-5e6]])},
              {"strength": np.full(256, np.nan), "residual_strength": -1.0, "initial_stress": "x",
               "weakening_rate": -1.0},
              {"initial_stress": np.where(NODE > 230, -2e6, 0.0)}),
        *each(ready, {"problem": None, "load_profile": np.linspace(0.9, 1.1, 256)},
              {"residual_strength": -ONE[None]},
              {"profiles": {"strength": ONE, "initial_stress": 2e6 * (NODE < 2)},
               "accept": ("overstress",)}),
        *(partial(st.equilibrium_path, PROBLEM, 0.9 * ONE, one) for one in ([2e5, 1e5], [np.nan])),
        lambda: st.equilibrium_path(make_problem((32, 32), (0.01, 0.01)),
                                    np.ones((2, 32, 32)), [1e5]),
        lambda: onset(np.full(128, 1e6), make_problem(128)),
        *each(steep, 4e-7, 2.1e-6),
        *each(with_residual, -1.0, 1.02e6, {"residual": 1.02e6, "method": SLOW}),
    ],
    "specimens": [
        *each(of_specimen, {"load": st.Load(profile=st.GradientLoad(amplitude=0.2))},
              {"interface": st.Interface((0.1, 0.1), (32, 32))}),
        *each(crooked, {"height": 1e-3}, {"height": 31.0}, {"height": 0.01, "rate": 0.01e12},
              {"drive": st.Platen(stiffness=20.0)}),
        *(partial(st.Blocks, height=0.05, drive=one)
          for one in (st.Platen(stiffness=2e7), st.Platen(mass=1.0))),
        lambda: st.Interface((0.1, 0.1), (32, 32), width=0.1),
        lambda: SPECIMEN.sample(of_specimen(specimen=st.Blocks(height=0.02)).sample(ROUGH)),
        *each(event, {"max_steps": 1}, {"event": 1000}, {"save": st.Save(to="run")},
              {"problem": dataclasses.replace(EVENTS, friction=FALLING)},
              {"problem": dataclasses.replace(EVENTS, load=st.Load()),
               "profiles": {"strength": STRONG, "initial_stress": STRONG + 1.0}},
              {"problem": crooked(nodes=64, rate=0.01e12, height=0.02, drive=STIFF)}),
    ],
    "ruptures": [
        *each(st.Rupture, {"loading_rate": 1e7, "load": ([0.0, 1.0], [0.0, 1e7])},
              {"loading_rate": 1e7, "stop": "time"}, {"load": 3.0},
              {"load": ([0.0, 1.0, 0.5], [0.0, 1e5, 2e6])}),
        *each(st.Save, {"to": 3}, {"fields": None}, {"fields": ["slip_rat"]}),
        *each(ruptured, {}, {"loading_rate": 1e8, "events": 1}, {"loading_rate": 1e-2},
              {"loading_rate": 1e8, "end_time": 1e-9}, {"loading_rate": 1e8, "max_steps": 20},
              {"loading_rate": 1e15}, {"loading_rate": 1e12, "stop": "onset"},
              {"loading_rate": 1e7, "kernel_tolerance": 1e-2},
              {"strength": np.full(256, np.inf), "loading_rate": 1e7},
              {"problem": make_problem(128), "strength": 0.5 * (TAU_P[:, ::4] + 1e6),
               "loading_rate": 1e9, "stop": "onset"}),
        lambda: ruptured(make_problem(weakening_rate=5e-324), loading_rate=1e7),
        lambda: st.simulate_rupture(PROBLEM, np.stack([ONE] * 2),
                                    method=st.Rupture(loading_rate=1e8)),
        lambda: st.Rupture(loading_rate=1e8).prepare(make_problem(
            (72, 64), (0.0208, 0.0156), solid=dataclasses.replace(SOLID, poisson_ratio=0.495))),
    ],
    "units": [
        *(partial(st.Solid, *one) for one in ((1e9, 0.33, 1.17), (1.0, 0.33, 1170.0))),
        *each(scaled, {"modulus": 1e3}, {"length": 4.1 * PROBLEM.nucleation_length}),
        *each(judged, {"critical_slip": 2.0}, {"critical_slip": 2.0, "mean": 1e12},
              {"length": 4e-4, "weakening_rate": 2e14}),
        *(partial(judged, pressure=one) for one in (5e11, 5e9, 2e6, 5e4, 4000.0)),
        lambda: onset(np.full(256, 6.0), scaled(weakening_rate=2e9, length=10.0)),
        lambda: onset(normal_pressure=5e4),
        lambda: st.Lognormal(mean=1e6, cv=2),
        lambda: PROBLEM.warn_of_units(1e6, 0.45),
        lambda: PROBLEM.warn_of_units(30.0),
        *each(sampled, {"random": field(spectrum=st.PowerLawSpectrum(4.0), mean_mode=True)},
              {"random": field(scipy.stats.uniform(0.3, 0.2))},
              {"problem": LAID, "random": dataclasses.replace(
                  COEFFICIENT, marginal=st.Gamma(mean=0.6, cv=0.1))}),
        lambda: local_onset(LAID, np.full(256, 0.9e6)),
        *each(failure, {"problem": PRESSED, "stress": 700.0},
              {"problem": PRESSED, "friction_coefficient": 40},
              {"problem": LAP, "random": COEFFICIENT, "force": 1.2}),
        lambda: local_onset(scaled(length=2.1 * PROBLEM.nucleation_length),
                            np.linspace(1e6, 1.1e6, 256)),
        lambda: make_problem((64, 64), (0.01, 0.01)),
    ],
    "answers": [
        lambda: failure(stress="low", method=st.LocalCriterion, target_cv=0.0, max_evaluations=3),
        *(partial(failure, **{"stress": 0.67e6} | one) for one in (
            {"event": "collapse"}, {"workers": 1.5}, {"stress": np.nan}, {"algorithm": "two_level"},
            {"problem": VARYING, "method": EXACT, "algorithm": "two_level"},
            {"problem": with_law(STEEPENING), "method": EXACT, "algorithm": "two_level"},
            {"method": SLOW, "algorithm": "subset", "max_evaluations": None},
            {"problem": make_problem(residual_strength=1e6), "stress": 1e6})),
        lambda: st.design_stress(PROBLEM, FIELD, probability=1e-3, method=SLOW),
        lambda: st.failure_curve(PROBLEM, FIELD, smallest=1e-40, method=LOCAL),
        lambda: sampled(make_problem(residual_strength=0.73e6), samples=16, method=EXACT),
    ],
    "inference": [
        *each(inferred, {"unit": "kN"}, {"unit": "Mstone"}, {"prior": {}}, {"prior": FIVE},
              {"peaks": SEVEN / 1e6}, {"peaks": SEVEN + 1e6},
              {"peaks": np.append(SEVEN, 0.6e6), "prior": {"correlation_length": (1e-3, 0.01)}},
              {"peaks": SEVEN / 2e6, "unit": "1"},
              {"peaks": SEVEN / 1e6, "unit": "MPa", "load_cell_error": 5e3},
              {"peaks": SEVEN, "prior": {"marginal.low": (0.4e6, 0.64e6)}},
              {"load_cell_error": -1.0, "method": "local"}),
        *each(inferred, *({"peaks": one} for one in (
            SEVEN[:2], [7e5, np.nan, 7.1e5], ["0.7", "0.8"], [[7e5, 7.1e5], [6.9e5, 7e5]],
            {"short": SEVEN}, {0.1: SEVEN, 1e-3: SEVEN}))),
        *each(inferred, *({"prior": one} for one in (
            {"corelation_length": (1.0, 2.0)}, {"mean": (1.0, 2.0)}, {"marginal.low": (1e6, 2e6)},
            {"marginal.low": {"low": 0.0, "high": 1e6, "spacing": "log"}},
            {"correlation_length": (1e-3, 1.0)}))),
        *each(inferred, *({"random": LOGNORMAL, "prior": {MEAN: one}} for one in (
            (1.3e6, 1e6), scipy.stats.uniform, scipy.stats.poisson(3)))),
        lambda: inferred(random=LOGNORMAL, prior={"marginl.mean": (1e6, 1.3e6),
                                                  "corelation_length": (1.0, 2.0)}),
        lambda: inferred(problem=LAP, random=COEFFICIENT, unit="1", prior={MEAN: (0.3, 0.6)},
                         peaks={LAP.interface.length: [0.4], 0.2: [0.41, 0.42]}),
        lambda: inferred(SEVEN, random=[FIELD, beta_strength(3e-3)]),
        *each(weighed, FIELD, [FIELD] * 2),
        lambda: st.external.limit_state(PROBLEM, FIELD, LOCAL)(np.zeros((2, 3))),
        *each(simulator, "marginal.lo", ("mean", "corr")),
        lambda: simulator(("marginal.low",))([]),
    ],
    "agreement": [
        *each(partial(st.statistics.agreement, PREDICTED), [1015.0, 998.0, 1031.0],
              {"peaks": SEVEN, "unit": "N"}),
        *(partial(st.statistics.agreement, one, SEVEN)
          for one in (xr.Dataset({"load": 1.0}), np.nan * PREDICTED,
                      PREDICTED.where(np.arange(90) > 2))),
        lambda: st.statistics.agreement(inferred(SEVEN), 1.01 * SEVEN, unit="N"),
        lambda: st.statistics.agreement(inferred(SEVEN), SEVEN[::-1]),
    ],
    "pictures": [
        *(partial(st.plot.onset, ONSET, one) for one in (
            LINE_STRENGTH[:50], np.stack([LINE_STRENGTH] * 3))),
        lambda: st.plot.onset(ONSET, LINE_STRENGTH, sample=3),
        lambda: st.plot.field(CROOKED, LINE_STRENGTH, quantity="rough"),
        lambda: st.plot.field(CROOKED, LINE_STRENGTH, ax=LINE_STRENGTH),
        lambda: st.plot.monte_carlo(ONSET, quantity="slip_patches"),
        lambda: st.plot.quantiles(PREDICTED),
        lambda: st.plot.rupture(ONSET.drop_attrs()),
        lambda: st.plot.rupture(ONSET, problem=CROOKED),
        lambda: st.plot.film(ONSET, "film.avi"),
    ],
})
# fmt: on


@calls("read beside the rule that refuses what is a little beyond")
def what_is_just_taken():
    return {
        "weibull": st.Weibull(mean=2.1e5, cv=0.1, low=2e5),
        "nodes": make_problem(weakening_rate=RISING).nodes_in_nucleation_length(2e11),
        "steep": steep(2.1e-6),
        "no residual": with_residual(0.0),
        "residual": with_residual(1.02e6),
    }


test_outputs_are_as_recorded = compared(calls, __file__)
