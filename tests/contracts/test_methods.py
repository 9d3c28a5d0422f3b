"""Laws of every method: a method or an option without a line in a table fails."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any, ClassVar, Literal

import numpy as np
import pytest
import xarray as xr
from contracts.bodies import (
    BODIES,
    FIELD,
    PUSHER,
    WITH_ENDS,
    attempt,
    body,
    field_of,
    profiles_of,
)
from recording import stored

import stiction as st
from stiction import extensions
from stiction.base import kinds
from stiction.base.variables import FORCES, ONSET_VARIABLES
from stiction.ensemble.limit_state import scales_with_strength
from stiction.methods.protocol import METHODS, optional_member
from stiction.random.fields import as_random_interface

pytestmark = pytest.mark.filterwarnings("ignore")
FAST = {"loading_rate": 1e9}
QUICK = {"progress": False, "pilot": False}


@extensions.model
class Weakest:
    """A method from elsewhere: the load at which the first node slips."""

    node: Literal["first", "second"] = "first"
    type: Literal["weakest"] = "weakest"
    label: ClassVar[str] = "weakest node"
    scaling: ClassVar[str] = "affine"

    def variables(self, problem):
        return extensions.onset_variables(problem.interface)

    def seconds_per_sample(self, problem):
        return 1e-5

    def supports(self, problem):
        slider = isinstance(problem.specimen, st.Slider)
        return ["problem.specimen: use st.Equilibrium()"] if slider else []

    def bounded_by_strength(self, problem, event):
        return True, False

    def prepare(self, problem):
        places = np.meshgrid(*problem.interface.coordinates.values(), indexing="ij")
        places = np.stack([np.ravel(x) for x in places], axis=1)

        def solve(rows):
            load = (rows.strength - rows.initial_stress) / rows.load_profile
            load = load.reshape(rows.samples, -1)
            node = np.argsort(load, axis=1)[:, int(self.node == "second")]
            load = np.take_along_axis(load, node[:, None], axis=1)[:, 0]
            stress = rows.mean_stress(load)
            place = places[node] if problem.interface.is_plane else places[node, 0]
            values = load, stress, stress, place
            return dict(zip(ONSET_VARIABLES, values, strict=True))

        return solve


@pytest.fixture(autouse=True, scope="module")
def plugged():
    """The method from elsewhere is registered while these tests run."""
    extensions.register(Weakest)
    yield
    kinds._registered["methods"].pop("weakest")


CLASSES = {**METHODS, "weakest": Weakest}


def example(kind: str, problem: st.Problem, **options: Any) -> Any:
    """A method that fits a problem, with the options that it needs there."""
    return CLASSES[kind](**EXAMPLES[kind](problem) | options)


EXAMPLES: dict[str, Any] = {  # type: what it needs on a problem
    "local_criterion": lambda problem: {},
    "equilibrium": lambda problem: {},
    "rupture": lambda problem: {} if problem.specimen else FAST,
    "weakest": lambda problem: {},
}
UNFIT = {("local_criterion", "slider"), ("rupture", "slider"), ("weakest", "slider")}
"""Bodies that a method does not take; its `supports` says why."""
OPTIONS = stored("options")
"""By type: another value of each option, and a wrong one."""
SILENT = {"start": ["line with ends", "plane with ends"]}  # as its docstring says
CASES = [(kind, name) for kind in EXAMPLES for name in BODIES if (kind, name) not in UNFIT]
every = pytest.mark.parametrize(("kind", "name"), CASES)
every_option = pytest.mark.parametrize(
    ("kind", "option"), [(kind, option) for kind in OPTIONS for option in OPTIONS[kind]]
)
SAMPLES = {
    name: field_of(problem).sample(problem.interface, samples=4, seed=5)
    for name, problem in BODIES.items()
}


def method_of(kind: str, option: str, problem: st.Problem) -> Any:
    """The example, with another value of an option; a mapping also makes room for it."""
    value, _ = OPTIONS[kind].get(option, ({}, None))
    return example(kind, problem, **(value if isinstance(value, dict) else {option: value}))


def onset(name: str, method: Any, rows: Any = None, problem: Any = None) -> Any:
    problem = problem or BODIES[name]
    given = profiles_of(problem, SAMPLES[name] if rows is None else rows)
    return st.onset(problem, given, method=method, progress=False)


@cache
def plain(kind: str, name: str) -> Any:
    """The onsets by the example of a method."""
    return onset(name, example(kind, BODIES[name]))


def same(result: Any, expected: Any) -> bool:
    """Whether results are equal to the bit, names and units included."""
    return result.drop_attrs(deep=False).identical(expected.drop_attrs(deep=False))


def test_every_method_and_option_has_a_line():
    assert set(CLASSES) == EXAMPLES.keys() == OPTIONS.keys()
    for kind in CLASSES:
        names = {field.name for field in dataclasses.fields(CLASSES[kind])} - {"type"}
        assert names == OPTIONS[kind].keys()


@pytest.mark.parametrize(("kind", "name"), sorted(UNFIT))
def test_a_body_that_a_method_does_not_take_is_refused_with_its_reason(kind, name):
    method = example(kind, BODIES[name])
    (reason,) = method.supports(BODIES[name])
    for call in (lambda: onset(name, method), lambda: study_by(kind, "", BODIES[name])):
        with pytest.raises(st.InputError) as refused:
            call()
        assert reason in str(refused.value)


STEEPENING = st.PiecewiseWeakening(
    slip=[0.2, 0.6, 1.0], strength=[1.0, 0.9, 0.0], critical_slip=2e-6
)


def test_every_reason_against_a_problem_is_named_by_every_call():
    problem = dataclasses.replace(BODIES["line"], friction=STEEPENING)
    reasons = st.LocalCriterion().supports(problem)
    assert len(reasons) == 2
    given = {"method": st.LocalCriterion(), "progress": False}
    for call in (
        lambda: st.onset(problem, SAMPLES["line"], **given),
        lambda: st.monte_carlo(problem, FIELD, samples=2, **given),
        lambda: st.failure_probability(problem, FIELD, stress=7e5, **given),
        lambda: st.design_stress(problem, FIELD, probability=0.1, **given),
        lambda: st.Study(
            problem=problem, random=FIELD, method=given["method"], samples=2
        ).run(),
    ):
        with pytest.raises(st.InputError) as refused:
            call()
        assert all(reason in str(refused.value) for reason in reasons)


@every
def test_it_has_what_it_promises(kind, name):
    """Its variables, and the forces and the coefficient that any method gets."""
    problem, result = BODIES[name], plain(kind, name)
    method = example(kind, problem)
    assert method.supports(problem) == []
    assert 0.0 < method.seconds_per_sample(problem) < 60.0
    promised = method.variables(problem)
    assert promised.keys() >= ONSET_VARIABLES.keys()
    added = {FORCES[key][0] for key in promised if key in FORCES} | {"friction_coefficient"}
    assert set(result) == promised.keys() | added
    for key, variable in promised.items():
        assert (result[key].dims, result[key].units) == (variable.dims, variable.units), key
        assert result[key].long_name == variable.long_name


@every
def test_alone_equals_in_a_batch_in_any_order(kind, name):
    method, order = example(kind, BODIES[name]), [2, 0, 3, 1]
    batch = plain(kind, name)
    turned = onset(name, method, SAMPLES[name][order])
    assert same(batch.isel(sample=order).drop_vars("sample"), turned.drop_vars("sample"))
    ready = BODIES[name].sample(profiles_of(BODIES[name], SAMPLES[name]))
    assert same(st.onset(BODIES[name], ready, method=method, progress=False), batch)
    for number, strength in enumerate(SAMPLES[name]):
        alone = onset(name, method, strength[None])
        assert same(batch.isel(sample=[number]).drop_vars("sample"), alone.drop_vars("sample"))


@pytest.mark.parametrize("nodes", [(122, 120), (120, 122)])
def test_a_plane_may_have_any_even_numbers_of_nodes(nodes):
    """Also those that cannot be halved twice, in either direction."""
    problem = body(nodes, (0.023, 0.0164))
    strength = FIELD.sample(problem.interface, seed=5)
    found = st.onset(problem, strength, method=st.Equilibrium(), progress=False)
    weakest, mean = strength.min(), strength.mean()
    assert found.certified
    assert weakest < found.critical_stress < mean


@every
def test_it_comes_back_from_a_file(kind, name, tmp_path):
    """With each of its options, and a run of the returned study gives the same numbers."""
    problem = BODIES[name]
    for option in OPTIONS[kind] or [""]:
        study, refusal = attempt(lambda option=option: study_by(kind, option, problem))
        if refusal:
            assert option in refusal
            continue
        study.to_toml(tmp_path / "study.toml")
        back = st.Study.from_toml(tmp_path / "study.toml")
        assert back == study
        assert str(back.method) == str(method_of(kind, option, problem))
        if option in ("", "events", "node"):
            assert same(study.run(**QUICK), back.run(**QUICK))


def study_by(kind: str, option: str, problem: st.Problem) -> st.Study:
    method = method_of(kind, option, problem)
    return st.Study(problem=problem, random=field_of(problem), method=method)


@every_option
def test_a_wrong_option_is_refused_by_its_name(kind, option):
    with pytest.raises(st.InputError, match=rf"\b{option}\b"):
        example(kind, BODIES["line"], **{option: OPTIONS[kind][option][1]})


@every_option
def test_every_option_counts_or_is_refused(kind, option):
    """Another value of it changes the result, or the refusal names it; alone as in a batch."""
    counts = []
    for name in ("line", *WITH_ENDS):
        problem = BODIES[name]
        if name in SILENT.get(option, ()) or (kind, name) in UNFIT:
            continue
        method, refusal = attempt(lambda problem=problem: supported(kind, option, problem))
        if refusal:
            assert option in refusal, (name, refusal)
            continue
        counts.append(name)
        result, refusal = attempt(lambda name=name, method=method: onset(name, method))
        if refusal:  # a budget that ends
            assert option in refusal, (name, refusal)
        else:
            assert not same(plain(kind, name), result), f"{option} has no effect on {name}"
            alone = onset(name, method, SAMPLES[name][2:3])
            assert same(result.isel(sample=[2]).drop_vars("sample"), alone.drop_vars("sample"))
    assert counts, f"{option} is refused everywhere"


def supported(kind: str, option: str, problem: st.Problem) -> Any:
    method = method_of(kind, option, problem)
    if reasons := method.supports(problem):
        raise st.InputError(reasons)
    return method


AXIS, LAW = np.arange(64) / 64.0, st.LinearWeakening(weakening_rate=0.3e12)
SCALED = {  # laws and loads, most of which keep onsets from scaling
    "plain": (LAW, st.Load()), "uneven load": (LAW, st.Load(profile=1.0 + AXIS)),
    "critical slip": (st.LinearWeakening(critical_slip=4e-6), st.Load()),
    "residual": (st.LinearWeakening(weakening_rate=0.3e12, residual_strength=4e5), st.Load()),
    "initial": (LAW, st.Load(initial_stress=2e5)),
    "uneven initial": (LAW, st.Load(initial_stress=2e5 * AXIS)),
    "both": (LAW, st.Load(profile=1.0 + AXIS, initial_stress=2e5)),
}  # fmt: skip
SCALING = [(kind, "line", change) for kind in EXAMPLES for change in [*SCALED][1:]]


@pytest.mark.parametrize(
    ("kind", "name", "change"), SCALING + [(*case, "plain") for case in CASES]
)
def test_its_onsets_scale_with_strength_as_it_says(kind, name, change):
    """Where it says so; not if something else varies, which does not scale."""
    problem, strength, (law, load) = BODIES[name], SAMPLES[name], SCALED[change]
    if not isinstance(problem.specimen, st.Slider):
        problem = dataclasses.replace(problem, friction=law, load=load)
    method, random = example(kind, problem), as_random_interface(field_of(problem))
    for other in ("residual_strength", "initial_stress"):
        both = st.RandomInterface(**{"strength": field_of(problem), other: FIELD})
        assert not scales_with_strength(problem, both, method)
    if not scales_with_strength(problem, random, method):
        return
    uniform = np.ptp(problem.load_profile) == 0.0
    shift = {"stretch": 0.0, "affine": 1e5 * uniform}[optional_member(method, "scaling")]
    before = onset(name, method, strength, problem)
    after = onset(name, method, shift + 1.25 * strength, problem)
    stresses, loads = ["critical_stress", "first_instability"], ["critical_load"]
    for key in stresses + loads * (not np.any(problem.load.initial_stress)):
        np.testing.assert_allclose(
            after[key], shift + 1.25 * before[key], rtol=1e-5, err_msg=key
        )


@every
def test_strength_bounds_its_onsets_as_it_says(kind, name):
    """Also where the load is uneven, and where a node of a sample hardly holds."""
    problem, strength = BODIES[name], np.array(SAMPLES[name])
    strength[(slice(1, None), *np.array(strength.shape[1:]) // 2)] -= 3e5
    method = example(kind, problem)
    if isinstance(problem.specimen, st.Slider):
        assert method.bounded_by_strength(problem, "critical_stress") == (False, False)
        return
    rows = problem.sample(strength)
    found = onset(name, method, strength)
    free = np.broadcast_to(problem.interface.breakable, problem.interface.shape)
    profile = np.broadcast_to(problem.load_profile, problem.interface.shape)
    first = ((rows.strength - rows.initial_stress) / profile)[:, free].min(axis=1)
    initial, mean = rows.initial_stress[:, free].mean(axis=1), profile[free].mean()
    low, high = initial + mean * first, rows.strength[:, free].mean(axis=1)
    for event in ("critical_stress", "first_instability"):
        below, above = optional_member(method, "bounded_by_strength")(problem, event)
        stress = found[event].values
        assert not below or not (stress < low * (1.0 - 1e-9)).any(), event
        assert not above or not (stress > high * (1.0 + 1e-9)).any(), event


@pytest.mark.parametrize("kind", ["equilibrium", "rupture"])
def test_blocks_with_more_events_are_said_to_take_longer(kind):
    """Driven by a dead load, which hardly causes events, and by a pusher."""
    counts, seconds = [], []
    for drive in (st.Platen(), PUSHER):
        problem = dataclasses.replace(BODIES["blocks"], load=st.Load(normal_pressure=2.1e6))
        specimen = dataclasses.replace(problem.specimen, drive=drive)
        problem = dataclasses.replace(problem, specimen=specimen)
        found = onset("blocks", example(kind, problem, events=9), problem=problem)
        counts.append(found.event_load.notnull().sum().item())
        seconds.append(example(kind, problem).seconds_per_sample(problem))
    assert 10 * counts[0] < counts[1]
    assert seconds[0] < seconds[1]


def partly_firm(kind: str, name: str, kept: float) -> Any:
    """Onsets where a third of the nodes keep a share of their strength."""
    problem, rows = BODIES[name], SAMPLES[name][:2]
    on_slider = isinstance(problem.specimen, st.Slider)
    scale = {"critical_slip": 4e-5 if on_slider else 4e-6}
    law = st.LinearWeakening(
        **{"weakening_rate": 0.3e12} if kind == "local_criterion" else scale
    )
    problem = dataclasses.replace(problem, friction=law)
    firm = (np.arange(rows[0].size) % 9 < 3).reshape(problem.interface.shape)
    given = {"strength": rows, "residual_strength": rows * np.where(firm, kept, 0.4)}
    dims, unit = ("sample", *problem.interface.dims), {"units": "1" if on_slider else "Pa"}
    given = {key: xr.DataArray(values, dims=dims, attrs=unit) for key, values in given.items()}
    return st.onset(problem, given, method=example(kind, problem), progress=False)


@every
def test_a_node_below_its_residual_strength_never_weakens(kind, name):
    """As a node whose residual strength is its strength, and nearly as one that hardly weakens."""
    firm = partly_firm(kind, name, 1.0)
    assert same(partly_firm(kind, name, 1.3), firm)
    if kind in ("equilibrium", "rupture") and (name == "slider" or "ends" not in name):
        # But for what rests on a mean of weakening rates, or on the slip at the corner of the law.
        hardly = partly_firm(kind, name, 1.0 - 1e-7)
        for key in ("critical_stress", "first_instability"):
            np.testing.assert_allclose(hardly[key], firm[key], rtol=1e-5, err_msg=key)


@cache
def events_by(kind: str, name: str) -> dict[str, Any]:
    """The variables of the events of the first sample, by every call that returns events."""
    problem, strength = BODIES[name], SAMPLES[name]
    if "events" not in OPTIONS[kind]:
        return {}
    method, inertia = example(kind, problem, events=2), kind == "rupture"
    first = profiles_of(problem, strength[0])
    drawn = st.monte_carlo(
        problem, field_of(problem), method=method, samples=4, seed=5, **QUICK
    )
    calls = {"onset": onset(name, method), "monte_carlo": drawn}
    if inertia:
        calls["simulate_rupture"] = st.simulate_rupture(
            problem, first, method=method, progress=False
        )
    if problem.specimen or not inertia:
        how = {"method": method} if inertia else {}
        calls["equilibrium_path"] = st.equilibrium_path(problem, first, [1e5], **how)
    return {
        call: result.isel(sample=0, missing_dims="ignore").drop_vars(
            [key for key in result if "event" not in result[key].dims])
        for call, result in calls.items()
    }  # fmt: skip


@every
def test_an_event_has_the_same_variables_and_numbers_by_every_call(kind, name):
    for call, events in (tables := events_by(kind, name)).items():
        names, known = (
            {(key, each.dims, each.units, each.long_name) for key, each in table.items()}
            for table in (events, tables["onset"])
        )
        assert names == known, (call, names ^ known)
        for key in tables["onset"]:
            have, want = events[key].values[:2], tables["onset"][key].values
            np.testing.assert_allclose(
                have, want[: len(have)], rtol=1e-5, err_msg=f"{call} {key}"
            )
            assert np.isnan(want[len(have) :]).all(), (call, key)


@pytest.mark.parametrize("name", BODIES)
def test_an_onset_and_its_events_are_what_a_path_says_at_their_loads(name):
    """`event_q` is `q` just before each event. What it adds is the difference of two states."""
    problem, given = BODIES[name], profiles_of(BODIES[name], SAMPLES[name][0])
    found = onset(name, st.Equilibrium(slip=True, events=12), SAMPLES[name][:1]).isel(sample=0)
    count = np.isfinite(found.event_load.values).sum()
    loads = np.append(found.event_load[:count], found.critical_load)
    near = np.outer([1.0 - 1e-9, 1.0 + 1e-9], loads)
    path = st.equilibrium_path(problem, given, np.unique(near))
    before, after = (path.sel(load=side, method="nearest").drop_vars("load") for side in near)
    # Slip grows as the root of the distance from a load at which a path turns: of 1e-9, or on
    # planes of the tolerance.
    close, added = 1e-3 if problem.interface.is_plane else 1e-4, after - before.astype(float)
    largest = before.slip[0].values.max()
    np.testing.assert_allclose(found.slip, before.slip[0], rtol=0.0, atol=close * largest)
    assert [*before.sliding, after.sliding[-1]] == [False] * (count + 1) + [True]
    assert found.arrested_events == after.arrested_events[-1]
    stress = before.mean_stress.values
    assert found.first_instability.item() == pytest.approx(stress[0], rel=close)
    assert found.critical_stress.item() == pytest.approx(stress.max(), rel=close)
    nodes, cell = [*problem.interface.dims], problem.interface.cell
    expected = {f"event_{key}": before[key] for key in before} | {
        "event_stress": before.mean_stress, "event_stress_drop": -added.mean_stress,
        "event_force_drop": -added.force, "event_largest_slip": added.slip.max(nodes),
        "event_moment": problem.solid.shear_modulus * cell * added.slip.sum(nodes),
    }  # fmt: skip
    if "travel" in path:
        expected["event_travel_step"] = added.travel
    compared = expected.keys() & found.keys()
    assert len(compared) >= (8 if "travel" in path else 3)
    known = np.flatnonzero(
        np.isfinite(after.mean_stress[:count])
    )  # a slider slides after its last
    for key in sorted(compared):
        told, values = found[key][known], expected[key][known]
        np.testing.assert_allclose(told, values, rtol=close, err_msg=key)


@pytest.mark.parametrize("name", ["plane", "plane with ends"])
def test_bounds_of_any_tolerance_hold_the_load_of_the_first_instability(name):
    """Of samples in which no node is at its residual strength before. The lower one is told."""
    tolerances = (1e-10, 1e-7, 1e-4, 1e-2)
    tight, *found = (
        onset(name, st.Equilibrium(tolerance=tolerance, events=1)) for tolerance in tolerances
    )
    profile = BODIES[name].load_profile[BODIES[name].interface.breakable].mean()
    exact = tight.event_load[:, 0].fillna(tight.critical_load)
    assert tight.certified.sum() > 1
    for tolerance, rough in zip(tolerances[1:], found, strict=True):
        lower = rough.event_load[:, 0].fillna(rough.critical_load)
        upper = lower + rough.certificate_gap / profile
        assert (upper - lower <= tolerance * upper).all()
        inside = (lower <= exact * (1.0 + 1e-9)) & (exact <= upper * (1.0 + 1e-9))
        assert inside[tight.certified == 1.0].all()
