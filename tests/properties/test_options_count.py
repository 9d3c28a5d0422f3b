"""Every input counts: another value of it changes the result, or is refused by its name.

A property of the bodies may have no effect in one method (the density in equilibrium); it is tried
with the method in which it counts.
"""

from __future__ import annotations

import dataclasses
import operator
from functools import partial
from typing import Any

import numpy as np
import pytest
from setups import EXACT, LOCAL, beta_strength, ensemble, make_problem
from specimens import crooked, rough

import stiction as st
from stiction.study.sweep import SELECTION_KEYWORDS, grid_axes

WAVES = st.Rupture(loading_rate=3e8)
LINE = dataclasses.replace(
    make_problem(128, 0.05, residual_strength=0.45e6, load=st.Load(normal_pressure=2e6)),
    interface=st.Interface(0.05, 128, width=0.01),
)
STRENGTH = beta_strength(4e-3).sample(LINE.interface, seed=2)
PLANE = make_problem((40, 48), (0.02, 0.016), residual_ratio=0.3)
PLANE_STRENGTH = beta_strength(4e-3).sample(PLANE.interface, seed=2)
PUSHER = st.Pusher(height=0.008, width=0.004, stiffness=3e7)
JOINT = crooked(nodes=64, drive=PUSHER, load=st.Load(normal_pressure=2e6))
JOINT_STRENGTH = rough(JOINT, 1)
PLATEN = crooked(nodes=64, load=st.Load())  # the front of its last event has a speed
SLOW = st.Rupture(loading_rate=1e7)

INPUTS: dict[str, dict[str, Any]] = {  # owner: other values of its fields
    "solid": {
        "shear_modulus": 1.1e9, "poisson_ratio": 0.3, "density": (WAVES, 1200.0),
        "plane": "stress",
    },
    "interface": {"length": 0.06, "nodes": 160, "width": 0.02, "ends": "free",
                  "extent": (WAVES, (0.01, 0.04))},
    "friction": {
        "weakening_rate": 0.4e12, "critical_slip": 2e-6, "fracture_energy": 1.0,
        "residual_strength": 0.5e6, "residual_ratio": 0.4,
    },
    "load": {
        "profile": 2.0, "initial_stress": 1e5, "normal_pressure": 3e6, "pressing_force": 1e3,
    },
    "": {
        "solid": st.Solid(2e9, 0.33, 1170.0), "interface": st.Interface(0.06, 128),
        "friction": st.LinearWeakening(critical_slip=2e-6), "load": st.Load(initial_stress=1e5),
        "mode": "III", "specimen": st.Blocks(height=0.02),
    },
}  # fmt: skip
OF_SPECIMENS: dict[str, dict[str, Any]] = {
    "specimen": {
        "height": 0.03, "thickness": 0.02, "drive": st.Platen(stiffness=3e7),
        "pressing": "glued", "quality_factor": (st.Rupture(), 3.0),
    },
    "specimen.drive": {
        "height": 0.01, "width": 0.006, "side": "both", "stiffness": 6e7,
        "mass": (st.Rupture(), 5.0),
    },
    "interface": {"width": 0.02},
    "load": {"profile": np.linspace(0.5, 1.5, 64)},
}  # fmt: skip
COEFFICIENTS = {"friction_coefficient": 0.5 + 1e-7 * JOINT_STRENGTH}
OPTIONS: list[tuple[Any, dict[str, Any]]] = [
    (EXACT, {"sensitivity": True, "slip": True, "events": 1, "tolerance": 1e-4}),
    (SLOW, {
        "loading_rate": 3e7, "load_history": ([0.0, 1.0], [0.0, 2e6]), "end_time": 0.02,
        "kernel_tolerance": 1e-5, "courant": 0.5,
        "implicit": False, "arrival": 0.2, "start": "rest", "stop": "onset", "max_steps": 3,
        "events": 1,
    }),
]  # fmt: skip


SYSTEMS = ("line", "specimen", "plane")


def rows(call: Any) -> Any:
    """All numbers of a result with their units, or why there is none."""
    try:
        result = call()
    except st.InputError as error:
        return error.problems
    return {name: (values.values, values.attrs) for name, values in result.items()}


def assert_counts(name: str, before: Any, after: Any) -> None:
    """The result has changed, or the input is refused by its name."""
    assert isinstance(before, dict), before
    if isinstance(after, tuple):
        assert any(name in text for text in after), after
        return
    assert before.keys() != after.keys() or any(
        before[key][1] != after[key][1]
        or not np.array_equal(before[key][0], after[key][0], equal_nan=True)
        for key in before
    ), f"{name} has no effect"


def with_value(problem: st.Problem, owner: str, name: str, value: Any) -> st.Problem:
    *above, _ = names = [*filter(None, owner.split(".")), name]
    for depth in range(len(names) - 1, -1, -1):
        part = operator.attrgetter(".".join(above[:depth]))(problem) if depth else problem
        value = dataclasses.replace(part, **{names[depth]: value})
    return value


CASES = [
    (LINE, STRENGTH, owner, name, value)
    for owner, fields in INPUTS.items()
    for name, value in fields.items()
] + [
    (JOINT, COEFFICIENTS, owner, name, value)
    for owner, fields in OF_SPECIMENS.items()
    for name, value in fields.items()
]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(("problem", "profiles", "owner", "name", "value"), CASES)
def test_each_field_of_a_problem_counts(problem, profiles, owner, name, value):
    method, value = value if isinstance(value, tuple) else (EXACT, value)

    def onset(value: Any) -> Any:
        changed = problem if value is None else with_value(problem, owner, name, value)
        given = profiles
        if changed.interface.shape != problem.interface.shape:
            given = beta_strength(4e-3).sample(changed.interface, seed=2)
        return st.onset(changed, given, method=method)

    assert_counts(name, rows(partial(onset, None)), rows(partial(onset, value)))


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    ("system", "method", "name", "value"),
    [
        (system, method, name, value)
        for method, some in OPTIONS
        for name, value in some.items()
        for system in SYSTEMS[: 3 if method is EXACT else 2]
    ],
)
def test_each_option_of_a_method_counts(system, method, name, value):
    problem, profiles = {
        "line": (LINE, STRENGTH),
        "plane": (PLANE, PLANE_STRENGTH),
        "specimen": (PLATEN, JOINT_STRENGTH),
    }[system]
    if system == "specimen" and method is SLOW:
        method = st.Rupture(events=2)

    def onset(**options: Any) -> Any:
        return st.onset(problem, profiles, method=dataclasses.replace(method, **options))

    assert_counts(name, rows(onset), rows(partial(onset, **{name: value})))


def test_the_tables_hold_every_field():
    """A new field of a problem or a method is tried here, too."""
    parts = {"": LINE} | {
        name: operator.attrgetter(name)(LINE)
        for name in ("solid", "interface", "friction", "load")
    }
    for owner, part in parts.items():
        names = {field.name for field in dataclasses.fields(part)} - {"type"}
        assert names == INPUTS[owner].keys(), owner
    for owner in ("specimen", "specimen.drive"):
        part = operator.attrgetter(owner)(JOINT)
        names = {field.name for field in dataclasses.fields(part)} - {"type"}
        assert names == OF_SPECIMENS[owner].keys(), owner
    for method, some in OPTIONS:
        assert {field.name for field in dataclasses.fields(method)} - {"type"} == some.keys()
    assert [field.name for field in dataclasses.fields(LOCAL)] == ["type"]


FIELD = beta_strength(4e-3)


def test_a_law_without_a_scale_takes_it_from_profiles_only():
    problem = make_problem(128, 0.05, weakening_rate=None)
    given = {"strength": STRENGTH[0], "weakening_rate": 0.5e12}
    whole = make_problem(128, 0.05)
    for method in (LOCAL, EXACT):
        lent, own = (
            st.onset(*pair, method=method) for pair in ((problem, given), (whole, STRENGTH))
        )
        assert lent.critical_stress.item() == own.critical_stress.item()


def test_no_dimension_of_a_sweep_is_a_keyword_of_sel():
    problem = make_problem(128, 0.05)
    study = st.Study(
        problem=problem, random=FIELD, method=LOCAL, samples=4,
        sweep=[{"method": [LOCAL, EXACT]}],
    )  # fmt: skip
    stress = study.run(progress=False).critical_stress
    exact = stress.sel(onset_method="equilibrium")
    assert exact.sizes == {"sample": 4}
    alone = ensemble(problem, FIELD, 4, method=EXACT)
    np.testing.assert_array_equal(exact, alone.critical_stress)
    for keyword in SELECTION_KEYWORDS:
        (dimension,) = grid_axes([{f"method.{keyword}": [1.0, 2.0]}], (), ())
        assert dimension == f"method_{keyword}"
