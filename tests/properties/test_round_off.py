"""Inputs that change by 1e-12 move every kind of result by less than 1e-7.

What may move more is listed with its bound and its reason.
"""

import dataclasses
from functools import partial

import numpy as np
import pytest
import xarray as xr
from setups import EXACT, LOCAL

import stiction as st

CHANGE, MAX_MOVE = 1e-12, 1e-7
INF = float("inf")


class Inputs:
    """Inputs of a call, each of them changed by up to `change` of itself."""

    def __init__(self, change):
        self.change, self.rng = change, np.random.default_rng(8)

    def __call__(self, value):
        value = np.asarray(value, dtype=float)
        moved = value * (1.0 + self.change * self.rng.uniform(-1.0, 1.0, value.shape))
        return moved if moved.ndim else float(moved)

    def problem(self, nodes=128, length=0.05, weakening_rate=0.5e12, residual=0.5e6, **given):
        solid = {"shear_modulus": 1e9, "poisson_ratio": 0.33, "density": 1170.0}
        lengths = tuple(map(self, length)) if isinstance(length, tuple) else self(length)
        friction = given.pop("friction", None) or st.LinearWeakening(
            weakening_rate=self(weakening_rate), residual_strength=self(residual)
        )
        return st.Problem(
            solid=st.Solid(**{name: self(value) for name, value in solid.items()}),
            interface=st.Interface(lengths, nodes),
            friction=friction,
            load=given.pop("load", st.Load(normal_pressure=self(2e6))),
            **given,
        )

    def field(self, length=2e-3, **given):
        beta = {"alpha": 1.5, "beta": 3.0, "low": 0.66e6, "high": 1.66e6}
        marginal = st.Beta(**{name: self(value) for name, value in beta.items()})
        return st.RandomField(marginal, st.PowerLawSpectrum(self(length)), **given)

    def strength(self, problem, samples=2, length=2e-3):
        field = self.field(length)
        return self(field.sample(problem.interface, samples=samples, seed=3))

    def blocks(self, drive=None, height=0.025, nodes=96, **given):
        for name in ("height", "width"):
            if hasattr(drive, name):
                drive = dataclasses.replace(drive, **{name: self(getattr(drive, name))})
        blocks = st.Blocks(
            height=self(height), thickness=self(0.006), drive=drive or st.Platen(), **given
        )
        return self.problem(nodes, weakening_rate=0.2e12, specimen=blocks, mode="II")


def onset(problem, strength, method):
    result = st.onset(problem, strength, method=method, progress=False)
    # These are round-off, the second one behind a rigid machine.
    return result.drop_vars(["certificate_gap", "event_travel_step"], errors="ignore")


MAX_MOVES = {}
"""Functions of `Inputs`, and by how much their results may move."""


def call(function=None, *, moves=MAX_MOVE):
    if function is None:
        return partial(call, moves=moves)
    MAX_MOVES[function] = moves
    return function


def leaves(value, name=""):
    """Arrays of numbers in a result, by name."""
    if isinstance(value, xr.Dataset):
        value = dict(value.data_vars)
    elif dataclasses.is_dataclass(value):
        value = {field.name: getattr(value, field.name) for field in dataclasses.fields(value)}
    elif isinstance(value, tuple | list):
        value = dict(enumerate(value))
    if isinstance(value, dict):
        for key, part in value.items():
            yield from leaves(part, f"{name}.{key}")
    elif np.asarray(value).dtype.kind in "biuf":
        yield name, np.asarray(value, dtype=float)


@call
def lines(inputs):
    problem = inputs.problem()
    strength = inputs.strength(problem, 8)
    exact = onset(problem, strength, st.Equilibrium(events=4, sensitivity=True))
    return {"local": onset(problem, strength, LOCAL), "exact": exact}


@call
def path(inputs):
    problem = inputs.blocks(st.Platen(stiffness=2e7))
    loads = inputs(np.linspace(0.2e6, 1.0e6, 5))
    return st.equilibrium_path(problem, inputs.strength(problem, 1)[0], loads)


@call
def rupture(inputs):
    problem = inputs.problem()
    method = st.Rupture(loading_rate=inputs(2e8))
    return st.simulate_rupture(
        problem, inputs.strength(problem)[0], method=method, progress=False
    )


@call
def planes(inputs):
    problem = inputs.problem((48, 40), (0.02, 0.016))
    strength = inputs.strength(problem)
    return {
        "local": onset(problem, strength, LOCAL),
        "exact": onset(problem, strength, EXACT),
    }


@call
def rupture_on_a_plane(inputs):
    problem = inputs.problem((48, 40), (0.02, 0.016), residual=0.1e6)
    return onset(problem, inputs.strength(problem)[:1], st.Rupture(loading_rate=inputs(2e9)))


@call
def specimens(inputs):
    found = {}
    for name, drive, pressing in (
        ("glued", st.Platen(), "glued"),
        ("rigid", st.Platen(stiffness=INF), "frictionless"),
        ("high", st.Pusher(height=0.0225, width=0.005), "glued"),
        ("low", st.Pusher(height=0.001, width=0.002, stiffness=2e7), "frictionless"),
        ("both", st.Pusher(height=0.0125, width=0.025, side="both", stiffness=INF), "glued"),
    ):
        problem = inputs.blocks(drive, pressing=pressing)
        found[name] = onset(problem, inputs.strength(problem, 4), st.Equilibrium(events=4))
        found[f"{name} blocks"] = {
            key: getattr(problem.blocks, key)
            for key in ("stiffness", "shear", "pressure", "drive_stiffness")
        }
        found[f"{name} local"] = onset(problem, inputs.strength(problem), LOCAL)
    return found


# Waves in blocks are followed in single precision.
@call(moves=1e-5)
def ruptures_of_specimens(inputs):
    problem = inputs.blocks(st.Pusher(height=0.02, width=0.01, stiffness=2e7), nodes=64)
    return onset(problem, inputs.strength(problem, 2, 8e-3), st.Rupture(events=4))


@call
def probabilities(inputs):
    problem = inputs.problem(96, 0.031)
    curve = st.failure_curve(
        problem, inputs.field(), method=LOCAL, smallest=inputs(1e-2), seed=2, workers=1,
        target_cv=0.4, progress=False,
    )  # fmt: skip
    exact = st.failure_probability(
        problem, inputs.field(), inputs(0.75e6), method=EXACT, seed=2, workers=1, target_cv=0.5,
        progress=False,
    )  # fmt: skip
    design = st.design_stress(
        problem,
        inputs.field(),
        probability=inputs(1e-3),
        method=LOCAL,
        seed=2,
        workers=1,
        progress=False,
    )
    return {"curve": curve, "exact": exact, "design": design}


# Optimisers stop where the likelihood is flat.
@call(moves=1e-5)
def fits(inputs):
    problem = inputs.problem(256)
    rows = inputs.strength(problem, 3)
    x = inputs(problem.interface.x)
    records = [xr.DataArray(row, {"x": x}, ("x",), attrs={"units": "Pa"}) for row in rows]
    fit = st.fit_field(records, marginal=["beta", "lognormal"], bootstrap=20, seed=1)
    return {"fit": fit, "interval": fit.interval}


@call
def inferred(inputs):
    problem = inputs.problem(96, 0.031)
    peaks = inputs(np.array([7.31e5, 7.55e5, 7.02e5, 7.74e5]))
    prior = {"correlation_length": inputs((1e-3, 6e-3)), "marginal.low": inputs((5.6e5, 7.2e5))}
    prior = {name: tuple(bounds) for name, bounds in prior.items()}
    posterior = st.infer(
        problem, inputs.field(), peaks, prior=prior, method=LOCAL, samples=200, seed=3
    )
    return {
        "draws": posterior.draws,
        "mean": [posterior.mean(name) for name in posterior.names],
        "interval": [posterior.interval(name) for name in posterior.names],
        "information": posterior.information,
    }


@call
def designs(inputs):
    return st.design_of_tests(
        inputs.problem(96, 0.031), inputs.field(), prior={"marginal.low": (5e5, 8e5)},
        designs={"few": 4}, method=LOCAL, repetitions=10, samples=100, seed=2,
    )  # fmt: skip


@call
def theory(inputs):
    problem = inputs.problem()
    strength = inputs.strength(problem)
    return {
        "nucleation": st.theory.nucleation_statistics(problem, inputs.field()),
        "stress": st.theory.nucleation_stress(problem, strength),
        "energy": st.theory.energy_release_rate(problem, inputs(1e6), inputs([2e-3, 5e-3])),
    }


@pytest.mark.parametrize("function", MAX_MOVES, ids=lambda function: function.__name__)
def test_round_off_of_inputs_moves_no_result(function):
    before, after = (dict(leaves(function(Inputs(change)))) for change in (0.0, CHANGE))
    assert before
    assert before.keys() == after.keys()
    for name, values in before.items():
        size = np.abs(values[np.isfinite(values)]).max(initial=0.0)
        np.testing.assert_allclose(
            after[name], values, rtol=0.0, atol=MAX_MOVES[function] * size, err_msg=name
        )
