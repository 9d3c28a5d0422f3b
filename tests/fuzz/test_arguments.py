"""Bad arguments to everything public are refused with an `InputError`, and soon.

Every argument of every public call is replaced, one at a time, by values of wrong types, shapes,
signs and sizes. A call may also work: some of the values are valid. More of them:
pytest tests/fuzz -m slow --fuzz-count 8000 --fuzz-seed 771.
"""

import inspect
import random
import warnings
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
import scipy.stats
from harness import trial
from setups import LOCAL, SOLID, beta_strength, make_problem

import stiction as st

NODES = 64
LEFT_ALONE = {"self", "store", "checkpoint", "to", "type"}
"""Arguments that say where to write, or are constants."""


class _Odd:
    """Compares with nothing but itself and has no hash."""

    def __eq__(self, other):
        raise TypeError("compares with nothing")

    __hash__ = None


def _cycle():
    ring = []
    ring.append(ring)
    return ring


VALUES = (
    None, True, np.bool_(True), "x", "", "1", "\x1b[2J", "a\0b", "\udcff", "x" * 100_000, b"x",
    0, -0.0, 1, -1, 0.5, 1.5, 4.0, float("nan"), float("inf"), float("-inf"), 1e308, 1e-308,
    5e-324, 10**13, 10**30, 2**63, 10**400, 1j, np.complex128(1j), np.float16(2.0), np.int8(-3),
    np.uint64(2**63), Decimal("1.5"), Fraction(1, 3), np.datetime64("2020-01-01"),
    [], [1], ["x"], [None], [[1.0], [1.0, 2.0]], _cycle(), (), (2.0, 1.0), {1}, range(3),
    {}, {"a": 1}, {"type": "x"}, {"type": ["beta"]}, (i for i in ()),
    np.zeros(0), np.array(1.0), np.array("x"), np.ones(NODES), np.full(NODES, np.nan),
    np.full(NODES, 1e308), np.zeros(NODES), np.ones((2, NODES)), np.ones((2, 2, 2)),
    np.ones((0, NODES)), np.ones(NODES, dtype=complex), np.array([object()] * NODES),
    np.array(["x"] * NODES), np.ones(NODES, dtype=bool), np.zeros(3, dtype=[("a", "f8")]),
    np.ma.masked_array(np.ones(NODES), mask=[True] * NODES), object(), _Odd(), _Odd,
    lambda *args: None, lambda *args: 1 / 0, np, ..., Path("/nonexistent/file"),
    Path("/dev/null"), scipy.stats.norm(), scipy.stats.poisson(3), st.LocalCriterion, st.Load(),
)  # fmt: skip


def calls():
    """Functions and classes with arguments that work and take little time."""
    problem, strength = make_problem(NODES, weakening_rate=0.1e12), beta_strength(0.02)
    interface, friction = problem.interface, problem.friction
    tau_p = strength.sample(interface, samples=2)
    beta = {"alpha": 1.5, "beta": 3.0, "low": 0.66e6, "high": 1.66e6}
    rupture = st.Rupture(loading_rate=1e9, max_steps=50_000)
    ensemble = st.Ensemble(samples=2)
    given = {"problem": problem, "random": strength, "method": LOCAL}
    study = st.Study(**given, ensemble=ensemble)
    tail = {**given, "target_cv": 0.5, "max_evaluations": 5000, "workers": 1}
    mean, length = {"mean": 1e6, "cv": 0.2}, {"correlation_length": 0.02}
    one = {"problem": problem, "profiles": tau_p[0]}
    moments = {"problem": problem, "strength": strength}
    return [
        (st.Solid, {"shear_modulus": 1e9, "poisson_ratio": 0.33, "density": 1170.0}),
        (st.Interface, {"length": 0.1, "nodes": NODES}),
        (st.LinearWeakening, {"weakening_rate": 1e11}),
        (st.ExponentialWeakening, {"critical_slip": 1e-6}),
        (st.Load, {"normal_pressure": 1e6}),
        (st.GradientLoad, {"amplitude": 0.1}),
        (st.Problem, {"solid": SOLID, "interface": interface, "friction": friction}),
        (problem.sample, {"profiles": tau_p}),
        (st.Beta, beta),
        (st.Lognormal, mean),
        (st.Weibull, mean),
        (st.PowerLawSpectrum, {**length, "power_kept": 0.9}),
        (st.SquaredExponentialSpectrum, length),
        (st.ExponentialSpectrum, {**length, "truncation": 3.0}),
        (st.CustomSpectrum, {"function": lambda k: np.exp(-k), "max_wavenumber": 500.0}),
        (st.RandomField, {"marginal": st.Beta(**beta), "spectrum": strength.spectrum}),
        (st.RandomInterface, {"strength": strength}),
        (strength.sample, {"interface": interface}),
        (strength.correlation, {"interface": interface}),
        (st.LocalCriterion, {}),
        (st.Equilibrium, {}),
        (st.Rupture, {"loading_rate": 1e9}),
        (st.onset, {"problem": problem, "profiles": tau_p, "method": LOCAL}),
        (st.equilibrium_path, {**one, "loads": [1e5, 2e5]}),
        (st.simulate_rupture, {**one, "method": rupture, "stop": "onset"}),
        (st.monte_carlo, {**given, "samples": 2, "workers": 1, "progress": False}),
        (st.theory.nucleation_stress, {"problem": problem, "tau_p": tau_p}),
        (st.theory.nucleation_statistics, moments),
        (st.theory.rice_distribution, {**moments, "profiles": 64}),
        (st.statistics.density, {"values": np.linspace(0.7e6, 0.9e6, 50)}),
        (st.failure_probability, {**tail, "stress": 0.8e6}),
        (st.design_stress, {**tail, "probability": 0.1}),
        (st.Ensemble, {"samples": 2, "keep": ("strength",)}),
        (st.Study, {**given, "ensemble": ensemble}),
        (study.run, {"workers": 1, "progress": False}),
        (st.Study.from_dict, {"given": study.to_dict()}),
        (st.Study.from_toml, {"path": "/nonexistent/x.toml"}),
        (st.Study.from_result, {"result": study.run()}),
        (study.to_toml, {"path": "/nonexistent/x.toml"}),
        (st.open_run, {"path": "/nonexistent"}),
        (st.paper.strength, {"problem": problem}),
    ]


@pytest.mark.slow
def test_bad_arguments_are_refused(fuzz, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    chance, faults, refused = random.Random(fuzz.seed), [], 0
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        known = calls()
        for function, good in known:  # compiles kernels, which takes longer than a trial may
            with suppress(st.InputError, st.RunError):
                function(**good)
    trials = [
        (function, good, name, value)
        for function, good in known
        for name in inspect.signature(function).parameters
        if name not in LEFT_ALONE
        for value in range(len(VALUES))
    ]
    for function, good, name, value in chance.sample(trials, min(fuzz.count, len(trials))):
        given = good | {name: VALUES[value]}
        outcome, detail = trial(lambda function=function, given=given: function(**given))
        refused += outcome == "refused"
        if outcome.startswith("FAULT"):
            call = f"{function.__qualname__}({name} = VALUES[{value}])"
            faults.append(f"{call}: {outcome}: {detail}")
    assert refused > fuzz.count // 2
    assert not faults, "\n".join(faults)
