"""Bad arguments to everything public: is each refused with an `InputError`, and soon?

    python campaigns/arguments.py --count 3000 --seed 0

Every argument of every public call is replaced, one at a time, by values of wrong types, shapes,
signs and sizes; then two at a time at random. A call may also work: some of the values are valid.
"""

from __future__ import annotations

import random
import sys
import warnings
from collections.abc import Callable
from contextlib import suppress
from decimal import Decimal
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import scipy.stats

sys.path.insert(0, str(Path(__file__).parent))

from harness import Summary, command_line, finish, trial

import stiction as st
from stiction.sample import PROFILES

NODES = 64
Call = tuple[str, Callable[..., Any], dict[str, Any]]


class _Odd:
    """Compares with nothing but itself and has no hash."""

    def __eq__(self, other: object) -> bool:
        raise TypeError("compares with nothing")

    __hash__ = None  # type: ignore[assignment]  # on purpose


def _cycle() -> list[Any]:
    ring: list[Any] = []
    ring.append(ring)
    return ring


VALUES: dict[str, Any] = {
    "None": None,
    "True": True,
    "numpy bool": np.bool_(True),
    "text": "x",
    "empty text": "",
    "text of a number": "1",
    "text with an escape": "\x1b[2J",
    "text with a null": "a\0b",
    "surrogate": "\udcff",
    "long text": "x" * 100_000,
    "bytes": b"x",
    "zero": 0,
    "minus zero": -0.0,
    "one": 1,
    "minus one": -1,
    "half": 0.5,
    "one and a half": 1.5,
    "whole float": 4.0,
    "nan": float("nan"),
    "infinity": float("inf"),
    "minus infinity": float("-inf"),
    "huge": 1e308,
    "tiny": 1e-308,
    "denormal": 5e-324,
    "1e13": 10**13,
    "1e30": 10**30,
    "2**63": 2**63,
    "10**400": 10**400,
    "complex": 1j,
    "numpy complex": np.complex128(1j),
    "float16": np.float16(2.0),
    "int8": np.int8(-3),
    "uint64": np.uint64(2**63),
    "Decimal": Decimal("1.5"),
    "Fraction": Fraction(1, 3),
    "date": np.datetime64("2020-01-01"),
    "empty list": [],
    "list of one": [1],
    "list of text": ["x"],
    "list of None": [None],
    "ragged list": [[1.0], [1.0, 2.0]],
    "cycle": _cycle(),
    "tuple": (),
    "pair": (2.0, 1.0),
    "dict": {},
    "dict of one": {"a": 1},
    "dict with a type": {"type": "x"},
    "dict of lists": {"type": ["beta"]},
    "set": {1},
    "range": range(3),
    "generator": (i for i in ()),
    "empty array": np.zeros(0),
    "0-d array": np.array(1.0),
    "0-d text": np.array("x"),
    "row": np.ones(NODES),
    "row of nan": np.full(NODES, np.nan),
    "row of huge": np.full(NODES, 1e308),
    "row of zeros": np.zeros(NODES),
    "matrix": np.ones((2, NODES)),
    "cube": np.ones((2, 2, 2)),
    "no samples": np.ones((0, NODES)),
    "complex array": np.ones(NODES, dtype=complex),
    "object array": np.array([object()] * NODES),
    "text array": np.array(["x"] * NODES),
    "bool array": np.ones(NODES, dtype=bool),
    "masked array": np.ma.masked_array(np.ones(NODES), mask=[True] * NODES),
    "record array": np.zeros(3, dtype=[("a", "f8")]),
    "object": object(),
    "odd object": _Odd(),
    "class": _Odd,
    "function": lambda *args: None,
    "function that fails": lambda *args: 1 / 0,
    "module": np,
    "ellipsis": ...,
    "path": Path("/nonexistent/file"),
    "device": Path("/dev/null"),
    "scipy frozen": scipy.stats.norm(),
    "scipy discrete": scipy.stats.poisson(3),
    "other class": st.LocalCriterion,
    "other object": st.Load(),
}


def calls() -> list[Call]:
    """Everything public, each with arguments that work and take little time."""
    solid = {"shear_modulus": 1e9, "poisson_ratio": 0.33, "density": 1170.0}
    interface = st.Interface(length=0.1, nodes=NODES)
    friction = st.LinearWeakening(weakening_rate=0.1e12)
    problem = st.Problem(st.Solid(**solid), interface, friction)
    beta = {"alpha": 1.5, "beta": 3.0, "low": 0.66e6, "high": 1.66e6}
    spectrum = st.PowerLawSpectrum(correlation_length=0.02)
    strength = st.RandomField(st.Beta(**beta), spectrum)
    tau_p = strength.sample(interface, samples=2)
    local, rupture = st.LocalCriterion(), st.Rupture(loading_rate=1e9, max_steps=50_000)
    ensemble = st.Ensemble(samples=2)
    study = st.Study(problem=problem, random=strength, method=local, ensemble=ensemble)
    sizes = {"correlation_length": 0.02, "truncation": 3.0}
    rows = {"strength": tau_p, "residual_strength": 0.0, "initial_stress": 0.0,
            "weakening_rate": 0.1e12}  # fmt: skip
    row = rows | {"strength": tau_p[0]}
    of_problem = {"problem": problem, "strength": strength}
    ensemble_of = {"problem": problem, "random": strength}
    fields = {name: None for name in ("residual_strength", "initial_stress", "weakening_rate",
                                      "critical_slip", "fracture_energy", "normal_pressure",
                                      "correlation")}  # fmt: skip
    chance = {
        **ensemble_of, "method": local, "seed": 0, "target_cv": 0.5,
        "max_evaluations": 5000, "confidence": 0.9, "event": "critical_stress", "workers": 1,
    }  # fmt: skip
    values = np.linspace(0.7e6, 0.9e6, 50)
    return [
        ("Solid", st.Solid, {**solid, "plane": "strain"}),
        ("Interface", st.Interface, {"length": 0.1, "nodes": NODES}),
        ("LinearWeakening", st.LinearWeakening,
         {"weakening_rate": 1e11, "critical_slip": None, "residual_strength": 0.0}),
        ("LinearWeakening", st.LinearWeakening, {"critical_slip": 1e-6}),
        ("Load", st.Load, {"profile": 1.0, "initial_stress": 0.0, "normal_pressure": 1e6}),
        ("Problem", st.Problem,
         {"solid": problem.solid, "interface": interface, "friction": friction,
          "load": st.Load(), "mode": "II"}),
        ("Problem.sample", _by_name(problem.sample), rows),
        ("Problem.sample", problem.sample, {"profiles": tau_p, "accept": ()}),
        ("RandomInterface", st.RandomInterface, {"strength": strength, **fields}),
        ("Problem.nucleation_length_of", problem.nucleation_length_of, {"rate": 1e11}),
        ("Solid.effective_modulus", problem.solid.effective_modulus, {"mode": "II"}),
        ("Beta", st.Beta, beta),
        ("PowerLawSpectrum", st.PowerLawSpectrum, {**sizes, "exponent": 4.0}),
        ("PowerLawSpectrum", st.PowerLawSpectrum, {"correlation_length": 0.02, "power_kept": 0.9}),
        ("SquaredExponentialSpectrum", st.SquaredExponentialSpectrum, sizes),
        ("ExponentialSpectrum", st.ExponentialSpectrum, sizes),
        ("CustomSpectrum", st.CustomSpectrum,
         {"function": lambda k: np.exp(-k), "max_wavenumber": 500.0}),
        ("RandomField", st.RandomField,
         {"marginal": st.Beta(**beta), "spectrum": spectrum, "mean_mode": True}),
        ("RandomField.modes", strength.modes, {"interface": interface}),
        ("RandomField.draws", strength.draws,
         {"interface": interface, "samples": 2, "seed": 0, "first": 0, "stream": 0}),
        ("RandomField.gaussian", strength.gaussian,
         {"interface": interface, "draws": strength.draws(interface, 2, 0)}),
        ("RandomField.profiles", strength.profiles,
         {"interface": interface, "draws": strength.draws(interface, 2, 0)}),
        ("RandomField.sample", strength.sample,
         {"interface": interface, "samples": 2, "seed": 0, "first": 0, "stream": 0}),
        ("RandomField.correlation", strength.correlation, {"interface": interface, "of": "z"}),
        ("RandomField.efolding_length", strength.efolding_length, {"of": "strength"}),
        ("RandomField.with_efolding_length", strength.with_efolding_length,
         {"length": 0.02, "of": "z"}),
        ("LocalCriterion", st.LocalCriterion, {"weights": "exact"}),
        ("Equilibrium", st.Equilibrium, {"sensitivity": False, "slip": False}),
        ("Rupture", st.Rupture,
         {"loading_rate": 1e9, "kernel_tolerance": 1e-6, "memory_range": 1e5, "courant": 0.9,
          "time_step": None, "slip_step": 0.02, "load_step": 1e-3, "event_drop": 1e-4,
          "implicit": True, "max_steps": 1000}),
        ("onset", st.onset, {"problem": problem, "profiles": tau_p, "method": local}),
        ("onset", _by_name(st.onset), {"problem": problem, "method": st.Equilibrium(), **rows}),
        ("nucleation_stress", st.theory.nucleation_stress,
         {"problem": problem, "tau_p": tau_p, "weights": "exact"}),
        ("equilibrium_path", st.equilibrium_path,
         {"problem": problem, "profiles": tau_p[0], "loads": [1e5, 2e5]}),
        ("simulate_rupture", _by_name(st.simulate_rupture),
         {"problem": problem, **row, "method": rupture}),
        ("simulate_rupture", st.simulate_rupture,
         {"problem": problem, "profiles": tau_p[0], "method": rupture, "load": None,
          "initial_slip": None, "initial_load": None, "variables": ("slip",), "every": 10,
          "every_implicit": 1, "every_near_onset": None, "interval": None, "steps": True,
          "stop": "onset", "end_time": None, "store": None, "chunk": 64, "checkpoint": None,
          "checkpoint_every": 10_000, "restart": None, "progress": None}),
        ("open_rupture", st.open_rupture, {"folder": "x", "variables": None, "steps": True}),
        ("monte_carlo", st.monte_carlo,
         {**ensemble_of, "method": local, "samples": 2, "seed": 0, "first": 0,
          "keep": ("strength",), "keep_samples": (0,), "keep_limit": 1e9, "workers": 1,
          "executor": None, "progress": False}),
        ("nucleation_statistics", st.theory.nucleation_statistics,
         {**of_problem, "weights": "exact", "infinite": False}),
        ("nucleation_limits", st.nucleation_limits, of_problem),
        ("density", st.statistics.density, {"values": values, "bounds": (None, None)}),
        ("quantiles", st.statistics.quantiles,
         {"values": values, "probability": [0.1, 0.5], "confidence": 0.95}),
        ("rice_distribution", st.theory.rice_distribution,
         {**of_problem, "profiles": 64, "seed": 0, "stress": None}),
        ("failure_probability", st.failure_probability,
         {**chance, "stress": 0.8e6, "algorithm": "auto"}),
        ("design_stress", st.design_stress,
         {**chance, "probability": 0.1, "algorithm": "auto"}),
        ("failure_curve", st.failure_curve,
         {**chance, "smallest": 0.1, "points_per_decade": 2, "plain_samples": 0}),
        ("Ensemble", st.Ensemble,
         {"samples": 2, "seed": 0, "first": 0, "keep": ("strength",), "keep_samples": 1,
          "keep_limit": 1e9}),
        ("Study", st.Study,
         {**ensemble_of, "method": local, "ensemble": ensemble,
          "sweep": [{"problem.interface.length": [0.1, 0.2]}], "cluster": None, "title": ""}),
        ("Study.run", study.run,
         {"out": None, "workers": 1, "executor": None, "progress": False, "retry": False}),
        ("Study.from_dict", st.Study.from_dict, {"given": study.to_dict(), "folder": None}),
        ("Study.from_toml", st.Study.from_toml, {"path": "x"}),
        ("Study.from_result", st.Study.from_result, {"result": study.run()}),
        ("Study.to_toml", study.to_toml, {"path": "/nonexistent/x.toml"}),
        ("Cluster", st.Cluster,
         {"jobs": 1, "cores": 1, "processes": 1, "memory": "1GB", "walltime": "1", "queue": "q",
          "account": "a", "interface": "lo", "tls": True, "start_timeout": 1.0, "options": {}}),
        ("open_run", st.open_run, {"path": "/nonexistent"}),
        ("StoredRun", st.StoredRun, {"path": "/nonexistent"}),
        ("paper.problem", st.paper.problem, {"nodes": 256, "plane": "stress"}),
        ("paper.strength", st.paper.strength,
         {"problem": st.paper.problem(256), "correlation_ratio": 0.5}),
    ]  # fmt: skip


def _by_name(function: Callable[..., Any]) -> Callable[..., Any]:
    """The same function, its profiles given one by one."""

    def wrapped(**given: Any) -> Any:
        profiles = {name: given.pop(name) for name in list(given) if name in PROFILES}
        options = [given.pop("problem")] if "problem" in given else []
        return function(*options, profiles, **given)

    return wrapped


def campaign(count: int, seed: int = 0) -> Summary:
    """Every value for every argument, then pairs of them, until `count` trials are made."""
    chance, summary = random.Random(seed), Summary(seed)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        known = calls()
        for _, function, good in known:  # compiles kernels, which takes longer than a trial may
            with suppress(st.InputError, st.RunError):
                function(**good)
    singles = [
        (name, function, good, {argument: value})
        for name, function, good in known
        for argument in good
        for value in VALUES
    ]
    chance.shuffle(singles)
    for name, function, good, chosen in singles[:count]:
        _try(summary, name, function, good, chosen)
    while summary.trials < count:
        name, function, good = chance.choice(known)
        some = chance.sample(sorted(good), min(len(good), 2))
        _try(summary, name, function, good, {key: chance.choice(sorted(VALUES)) for key in some})
    return summary


def _try(
    summary: Summary,
    name: str,
    function: Callable[..., Any],
    good: dict[str, Any],
    chosen: dict[str, str],
) -> None:
    given = good | {key: VALUES[value] for key, value in chosen.items()}
    outcome, detail = trial(lambda: function(**given))
    changed = ", ".join(f"{key} = {value}" for key, value in chosen.items())
    summary.note(f"{name}({changed})", outcome, detail)


if __name__ == "__main__":
    options = command_line(__doc__, 8000)
    finish(campaign(options.count, options.seed))
