"""Recorded refusals and doubts: objects, units, laws, methods, answers, pictures.

The calls stand in mistakes.json, each beside the arguments that its refusal names.
"""

# ruff: noqa: F401

import dataclasses
import os
from functools import partial
from importlib import import_module
from unittest import mock

import astropy.units as u
import joint
import numpy as np
import pandas as pd
import setups
import xarray as xr
from crooked import LINE as CROOKED
from crooked import LINE_STRENGTH
from recording import inside, mistakes, refusals
from ruptures import BREAKING_PLANE
from scipy import stats
from setups import EXACT, LENGTH, LOCAL, RATE, beta_strength, ensemble, make_problem
from specimens import crooked, rough

import stiction as st
from stiction.ensemble import monte_carlo
from stiction.ensemble.dataset import Gathered
from stiction.ensemble.experiment import Experiment
from stiction.inference.peaks import make_peaks
from stiction.problem.checks import doubt_strengths
from stiction.problem.sample import own_sample

LINE, PROBLEM = st.Interface(0.1, 256), make_problem()
SCALELESS = make_problem(weakening_rate=None)
ONE, NODE = np.full(256, 1e6), np.arange(256)
FIELD = beta_strength(2e-3)
PRESSED = make_problem(load=st.Load(normal_pressure=2e6))
OTHER = make_problem(weakening_rate=0.9 * RATE, load=st.Load(initial_stress=3e4))
PAIR = ("strength", "residual_strength")


def of(module):
    """A module of the package whose names are not public."""
    return import_module(f"stiction.{module}")


def field(marginal=FIELD.marginal, spectrum=FIELD.spectrum, **options):
    return st.RandomField(marginal, spectrum, **options)


COEFFICIENT = field(st.Lognormal(mean=0.5, cv=0.15), quantity="friction_coefficient")
LOGNORMAL = field(st.Lognormal(mean=1.1e6, cv=0.2))


def several(*names, **options):
    return st.RandomInterface(**dict.fromkeys(names, FIELD), **options)


def correlated(correlation):
    return several(*PAIR, "initial_stress", correlation=correlation)


def sampled(problem=PROBLEM, random=FIELD, samples=1, **options):
    return ensemble(problem, random, samples, **{"workers": 1} | options)


def with_factor(*names, problem=joint.PROBLEM):
    factors = dict.fromkeys(names, st.Lognormal(mean=1.0, cv=0.1))
    return sampled(problem, st.RandomInterface(strength=joint.FIELD, between=factors))


def failure(problem=PROBLEM, random=FIELD, **options):
    given = {"method": LOCAL, "algorithm": "plain", "max_evaluations": 100}
    return st.failure_probability(problem, random, **given | options)


def designed(**options):
    given = joint.GIVEN | {"probability": 0.1, "sensitivities": False} | options
    return st.design_stress(joint.PROBLEM, joint.RANDOM, **given)


def onset(strength=ONE, problem=PROBLEM, method=LOCAL, **profiles):
    given = {"strength": strength} | profiles if profiles else strength
    return st.onset(problem, given, method=method, progress=False)


def ready(accept=(), method=LOCAL, profiles=ONE, **changes):
    return onset(PROBLEM.sample(profiles, accept=accept)._replace(**changes), method=method)


def loaded(**load):
    return dataclasses.replace(PROBLEM, load=st.Load(**load))


def on_plane(lengths, weakening_rate=RATE):
    problem = make_problem((48, 48), lengths, weakening_rate=weakening_rate)
    return sampled(problem, beta_strength(1e-3))


def scanned(values, places=(0.01, 0.02), units="Pa", x_units="m"):
    coords = {"x": ("x", [*places], {"units": x_units})}
    return FIELD.given(xr.DataArray(values, coords, "x", attrs={"units": units}), noise=1e4)


def study(**options):
    given = {"method": LOCAL, "samples": 2} | options
    return st.Study(problem=PROBLEM, random=FIELD, **given)


def exported(name, part=None, method=LOCAL, **options):
    """A run on disk, or a part of it, as a file of its own."""
    with inside():
        study(samples=24, method=method).run(out="run", part=part, pilot=False, progress=False)
        st.open_run("run").export(name, **options)


def gathered(share):
    """Two points, the kept profiles of each of which take a share of the memory of the machine."""
    there = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    kept = Experiment(PROBLEM, FIELD, LOCAL, keep=("strength",))
    return Gathered([kept, kept], share * there // (8 * 256))


def scaled(modulus=1e9, density=1170.0, length=0.1, pressure=None, **weakening):
    solid, load = st.Solid(modulus, 0.33, density), st.Load(normal_pressure=pressure)
    return make_problem(256, length, solid=solid, load=load, **weakening)


def judged(mean=1e6, **given):
    doubt_strengths(scaled(**given), mean)


KNOWN = xr.DataArray(FIELD.sample(LINE, seed=9)[0][:90], {"x": LINE.x[:90]}, "x")
LAP = dataclasses.replace(
    loaded(), interface=st.Interface(0.1, 256, width=0.03), load=st.Load(pressing_force=6e3)
)
STEEPENING = st.PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.7, 0.0], weakening_rate=0.25e12)
EXPONENTIAL = st.ExponentialWeakening(weakening_rate=RATE)
TAU_P = beta_strength(0.25 * LENGTH).sample(st.Interface(0.05, 512), seed=1)
SPECIMEN = crooked(load=st.Load())
EVENTS = crooked(nodes=64, drive=st.Pusher(height=0.006, width=0.004, stiffness=3e7))
STRONG = rough(EVENTS, 3)
FAULT = setups.within(make_problem(residual_strength=2e5), (0.02, 0.08))
SHORT = make_problem(64, 0.04)


def with_law(law):
    return make_problem(512, 0.05, friction=law)


def of_specimen(**given):
    return dataclasses.replace(SPECIMEN, **given)


def ruptured(problem=PROBLEM, strength=TAU_P[:, ::2], **method):
    return onset(strength, problem, st.Rupture(**method))


def event(problem=EVENTS, profiles=STRONG, save=None, event=None, **method):
    given = {"method": st.Rupture(**method), "save": save, "event": event}
    return st.simulate_rupture(problem, profiles, **{k: v for k, v in given.items() if v})


def station(place, problem=SHORT):
    return st.Save(stations={"a": place}).nodes(problem.interface)


def announced(samples, workers):
    """An ensemble of which nothing is computed."""
    given = {"method": st.Rupture(loading_rate=1e6), "workers": workers, "pilot": False}
    with mock.patch.object(monte_carlo, "complete"):
        return st.monte_carlo(make_problem(4096, 0.7), FIELD, samples=samples, **given)


def steep(critical_slip):
    problem = make_problem(critical_slip=critical_slip, residual_strength=3e5)
    return onset(1.1e6 + 2e5 * np.sin(NODE / 7.0), problem, EXACT)


def with_residual(residual, method=EXACT):
    profiles = {"strength": LINE_STRENGTH, "residual_strength": residual}
    law = dataclasses.replace(CROOKED.friction, residual_strength=0.0)
    problem = dataclasses.replace(CROOKED, friction=law)
    return st.onset(problem, profiles, method=method)


def inferred(peaks=(7e5, 7.1e5, 7.3e5), problem=PROBLEM, random=FIELD, prior=None, **options):
    prior = {"marginal.low": (0.4e6, 0.9e6)} if prior is None else prior
    given = {"method": LOCAL, "unit": "Pa", "samples": 100, "progress": False}
    return st.infer(problem, random, peaks, prior=prior, **given | options)


def fitted(profiles, interface=None, **options):
    given = {"marginal": "lognormal", "spectrum": "exponential", "noise": 0.0, "bootstrap": 20}
    return st.fit_field(profiles, interface, progress=False, **given | options)


def weighed(random, peaks=None, **options):
    """Peaks of interfaces that need no prior."""
    given = {"method": LOCAL, "unit": "Pa", "samples": 100, "progress": False} | options
    return st.infer(PROBLEM, random, SEVEN if peaks is None else peaks, **given)


def planned(designs):
    """Further tests of a single parameter."""
    given = {"prior": {"marginal.low": (0.5e6, 0.7e6)}, "method": LOCAL, "progress": False}
    return st.design_of_tests(PROBLEM, FIELD, designs=designs, **given)


EVEN = st.RandomField(st.Lognormal(mean=1e6, cv=1e-4), st.PowerLawSpectrum(4e-3))
SLOW = st.Rupture(loading_rate=9e8)
SEVEN = 0.7e6 + 1e4 * np.arange(7.0)
MEAN = "marginal.mean"
PREDICTED = xr.Dataset({"critical_stress": ("sample", 7e5 + 1e4 * np.sin(np.arange(90.0)))})
ONSET = st.onset(CROOKED, LINE_STRENGTH, method=LOCAL)
FIELDS = FIELD.sample(LINE, samples=3, seed=1)
TRAVEL = np.linspace(0.0, 1e-3, 50)
CURVE = pd.DataFrame({"travel (mm)": TRAVEL * 1e3, "force (N)": 2e5 * TRAVEL})
simulator = partial(st.external.simulator, PROBLEM, FIELD, method=LOCAL, samples=3)
test_each_mistake_is_refused_as_recorded = mistakes(__file__, vars(setups) | globals())
test_a_refusal_or_a_doubt_holds_the_numbers_that_it_names = refusals(
    "told", vars(setups) | globals()
)
