"""Laws of interfaces with ends and of events, over every variable of a result."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import numpy as np
import pytest

import stiction as st
from stiction.methods.dynamics.method import make_run
from stiction.problem.checks import nodes_in_nucleation_length

pytestmark = pytest.mark.filterwarnings("ignore")
SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.3, density=1200.0)


def rough(nodes: int, seed: int = 5) -> Any:
    """A strength between .3 and 2 MPa, correlated over seven of 128 nodes."""
    z = np.random.default_rng(seed).normal(size=128)
    z = np.convolve(np.r_[z, z], np.ones(7) / 7)[6:134]
    z = np.interp(np.arange(nodes) * 128 / nodes, np.arange(129), np.r_[z, z[0]])
    return np.maximum(1e6 * (1.0 + 0.8 * z), 3e5)


def line(period: float = 0.1, nodes: int = 256, **load: Any) -> st.Problem:
    """A fault of 60 mm in a period, whose load and initial stress vary on it."""
    mask = np.arange(nodes) * period / nodes < 0.06
    along = np.where(mask, np.arange(nodes) * period / nodes / 0.06, 0.5)
    profile, initial = 1.0 + 0.2 * along, 5e4 * np.cos(5.0 * along)
    profile[~mask] = load.get("profile", profile[~mask])
    initial[~mask] = load.get("initial", initial[~mask])
    return st.Problem(
        SOLID, st.Interface(period, nodes, width=0.01, extent=mask),
        st.LinearWeakening(weakening_rate=3e11, residual_strength=2e5),
        st.Load(profile=profile, initial_stress=initial, normal_pressure=2e6), mode="III",
    )  # fmt: skip


def blocks(extent: Any = None, drive: Any = None, **load: Any) -> st.Problem:
    """Two blocks, of which a part may be welded."""
    return st.Problem(
        SOLID, st.Interface(0.1, 64, extent=extent),
        st.LinearWeakening(weakening_rate=2e11, residual_strength=2e5),
        load=st.Load(initial_stress=5e4 * np.cos(np.arange(64) / 9.0), **load),
        specimen=st.Blocks(height=0.05, thickness=0.02, drive=drive or st.Platen(stiffness=3e7)),
    )  # fmt: skip


PUSHER = st.Pusher(height=0.01, width=0.01, stiffness=6e7)
BODIES = {
    "line": (line(), st.Rupture(loading_rate=1e8, events=4)),
    "blocks": (blocks(None, PUSHER), st.Rupture(events=4)),
    "blocks, partly bonded": (blocks((0.03, 0.065)), st.Rupture(events=4)),
}


@cache
def results(name: str) -> dict[str, Any]:
    """What every call says about one sample."""
    problem, method = BODIES[name]
    strength = rough(problem.interface.size)
    asked = {"method": method, "progress": False}
    how = {"method": method} if problem.specimen else {}
    found = {
        "simulate_rupture": st.simulate_rupture(problem, strength, **asked),
        "onset": st.onset(problem, strength, **asked).isel(sample=0),
        "equilibrium_path": st.equilibrium_path(problem, strength, [2e5, 4e5], **how),
    }
    if problem.specimen is not None:
        found["first event"] = st.simulate_rupture(problem, strength, event=0, **asked)
    return found


@pytest.mark.parametrize("name", BODIES)
def test_means_and_forces_are_those_of_the_stress_at_the_nodes(name):
    """At rest, before the first frame of an event and at each load of a path."""
    problem = BODIES[name][0]
    interface = problem.interface
    for call, result in results(name).items():
        field = next((key for key in ("stress", "shear_stress") if key in result), None)
        if field is None:
            continue
        nodes = result[field].values
        inside = nodes[:, interface.breakable].mean(axis=1)
        np.testing.assert_allclose(result.mean_stress, inside, rtol=1e-6, err_msg=call)
        if "machine_force" in result:
            whole = nodes[0].sum() * interface.spacing * problem.specimen.thickness
            assert result.machine_force[0] == pytest.approx(whole, rel=1e-4)
        if "crosshead_travel" in result:
            whole = nodes.sum(axis=1) * interface.spacing * problem.specimen.thickness
            travel = result.travel + whole / problem.specimen.drive.stiffness
            np.testing.assert_allclose(result.crosshead_travel, travel, rtol=1e-9)


METHODS = {
    "equilibrium": st.Equilibrium(events=6),
    "rupture": st.Rupture(loading_rate=1e8, events=6),
}


@pytest.mark.parametrize("method", METHODS)
def test_nothing_beyond_the_ends_has_an_effect(method):
    """On no number of a result: neither stress, nor load, nor more of a period."""
    method = METHODS[method]
    strength = rough(256)
    ask = {"method": method, "progress": False}
    plain = st.onset(line(), strength, **ask)
    for change in ({"initial": 2e7}, {"initial": -3e6}, {"profile": 5.0}, {"profile": 0.01}):
        other = st.onset(line(**change), strength, **ask)
        for key in plain:
            np.testing.assert_allclose(
                other[key], plain[key], rtol=1e-9, err_msg=f"{change} {key}"
            )
    # Images act on each other by the square of extent over period.
    eight, sixteen = (
        st.onset(line(0.1 * n, 256 * n), np.tile(strength, n), **ask) for n in (8, 16)
    )
    for key, values in plain.items():
        if values.attrs["units"] in {"Pa", "N", "N m", "J/m"}:
            scale = np.nanmax(np.abs(eight[key]), initial=1e-300)
            near = 0.02 * scale + 1e-6  # (1/8)² of the stress, and round-off of gaps, Pa
            np.testing.assert_allclose(sixteen[key], eight[key], atol=near, err_msg=key)


LEFT, RIGHT = (st.Ellipse(centre=(x, 0.03), semi_axes=(0.03, 0.02)) for x in (0.03, 0.07))
MIRRORED = [((0.0, 0.05), (0.05, 0.1)), (LEFT, RIGHT),
            (((0.0, 0.05), (0.02, 0.06)), ((0.05, 0.1), (0.02, 0.06)))]  # fmt: skip


@pytest.mark.parametrize(("extent", "mirrored"), MIRRORED)
def test_an_extent_and_its_mirror_image_have_mirrored_nodes(extent, mirrored):
    """x -> -x maps node i to node n - i, so the end of a period is its first node."""
    flat = np.ndim(extent) == 1
    shape, lengths = (64, 0.1) if flat else ((64, 40), (0.1, 0.06))
    one, other = (
        st.Interface(lengths, shape, extent=ends).breakable for ends in (extent, mirrored)
    )
    np.testing.assert_array_equal(other, np.roll(one[::-1], 1, axis=0))


def fault(mode: str = "III") -> tuple[st.Problem, Any]:
    """A fault of 30 km that is stressed above its strength in the middle."""
    interface = st.Interface(6e4, 384, extent=(1.5e4, 4.5e4))
    patch = np.abs(interface.x - 3e4) <= 3e3
    problem = st.Problem(
        st.Solid(shear_modulus=32e9, poisson_ratio=0.25, density=2670.0), interface,
        st.LinearWeakening(critical_slip=0.9, residual_strength=3e7),
        st.Load(initial_stress=np.where(patch, 6e7, 3.5e7)), mode=mode,
    )  # fmt: skip
    return problem, 3.7e7 + 4e6 * (rough(384) / 1e6 - 1.0)


HELD = ([0.0, 200.0], [0.0, 0.0])
CREEPING = ([0.0, 1000.0], [0.0, 5e6])
"""A load that stays, and one that drives creep after the event: a thousandth of it in 2 s."""


def event_of(load: Any = HELD, **options: Any) -> dict[str, float]:
    """The variables of the one event on the fault."""
    problem, strength = fault()
    method = st.Rupture(
        load_history=load, events=1, **{"stop": "rest", "end_time": 60.0} | options
    )
    found = st.onset(problem, strength, method=method, progress=False)
    return {
        key: float(values.squeeze()) for key, values in found.items() if "event" in values.dims
    }


CHANGES = [
    {"courant": 0.45}, {"courant": 0.3}, {"end_time": 30.0}, {"end_time": 120.0},
    {"stop": "time"}, {"load": CREEPING, "stop": "time"},
    {"load": CREEPING, "stop": "time", "end_time": 150.0},
]  # fmt: skip


@pytest.mark.parametrize("change", CHANGES)
def test_an_event_ends_wherever_a_run_and_its_steps_end(change):
    """No number of an event moves by 1 %, whatever happens after it."""
    expected, found = event_of(), event_of(**change)
    for key, value in expected.items():
        assert found[key] == pytest.approx(value, rel=0.01), key


def test_an_event_that_the_run_cuts_short_is_marked_and_counted():
    problem, strength = fault()
    rows = np.stack([strength, 1.02 * strength])
    for end_time, cut in ((5.0, True), (40.0, False)):
        method = st.Rupture(load_history=HELD, stop="rest", end_time=end_time, events=1)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = st.onset(problem, rows, method=method, progress=False)
            run = st.simulate_rupture(problem, strength, method=method, progress=False)
        told = [str(one.message) for one in caught if "during the last" in str(one.message)]
        counts = [("2 of 2 samples" in text, "1 of 1 sample" in text) for text in told]
        assert counts == ([(True, False), (False, True)] if cut else [])
        for result in (found, run):
            np.testing.assert_array_equal(result.event_settled, float(not cut))
            assert np.isfinite(result.event_moment).all()
            assert len(st.external.event_table(result)) == result.event_settled.size


def test_an_event_lies_between_its_ends_and_holds_its_hypocentre():
    """On lines and planes, also around the end of a period."""
    for name in BODIES:
        for result in results(name).values():
            if "event_start" not in result:
                continue
            length = BODIES[name][0].interface.lengths[0]
            done = np.isfinite(result.event_load.values)
            start, end, place = (
                result[f"event_{key}"].values[done] for key in ("start", "end", "hypocentre")
            )
            extent = np.mod(end - start - 1e-12, length) + 1e-12
            np.testing.assert_allclose(extent, result.event_length.values[done], rtol=1e-9)
            assert np.all(np.mod(place - start, length) <= extent)


@pytest.mark.parametrize("name", ["line", "blocks"])
def test_frames_thin_no_record_of_steps(name):
    """Every variable that has no frames is the same for any `Save.every`."""
    problem, method = BODIES[name]
    often, rarely = (
        st.simulate_rupture(
            problem, rough(problem.interface.size), method=method, progress=False,
            save=st.Save(["slip", "slip_rate"], every=every),
        )
        for every in (5, 20)
    )  # fmt: skip
    # What a step says is what the frame at its end says.
    rows = np.searchsorted(often.step_time, often.time[1:-1])
    for key in (key for key in often if key.removeprefix("step_") in often if "step_" in key):
        frames = often[key.removeprefix("step_")][1:-1]
        np.testing.assert_allclose(often[key][rows], frames, rtol=1e-9, err_msg=key)
    if name == "line":
        mean = often.slip_rate.values[1:-1, problem.interface.breakable].mean(axis=1)
        np.testing.assert_allclose(often.step_mean_slip_rate[rows], mean, rtol=1e-9)
        np.testing.assert_allclose(often.step_size[1:], np.diff(often.step_time), rtol=1e-9)
    for key, values in often.items():
        if not {"time", "snapshot"} & {*values.dims}:
            count = rarely[key].shape[0] if "step" in values.dims else None
            size = min(values.shape[0], count) if count else None
            if key == "moment_rate_spectrum" and name == "blocks":
                continue  # the last frame is up to `every` steps late
            np.testing.assert_allclose(
                rarely[key][:size] if size else rarely[key],
                values[:size] if size else values,
                rtol=1e-9, err_msg=key,
            )  # fmt: skip


def test_the_steepest_weakening_rate_is_at_any_slip_wherever_it_is_used():
    """A law that begins gently has the lengths, and the warnings, of its steepest part."""
    gentle = st.PiecewiseWeakening(
        slip=[0.5, 1.0], strength=[0.9, 0.0], weakening_rate=2e10, residual_strength=2e5
    )
    problem = st.Problem(SOLID, st.Interface(0.2, 256), gentle, mode="III")
    sample = problem.sample(rough(256)[None])
    steepest = 2e10 * gentle.steepening
    assert gentle.steepening > 5.0
    assert sample.steepest_weakening_rate == pytest.approx(steepest)
    length = problem.nucleation_lengths(sample.steepest_weakening_rate)
    assert problem.nucleation_length == pytest.approx(length[0])
    nodes = nodes_in_nucleation_length(problem, sample.steepest_weakening_rate)
    np.testing.assert_allclose(np.multiply(nodes, problem.interface.spacings), length)
    method = st.Rupture(loading_rate=1e8)
    run = make_run(method, method.medium(problem), sample, 0)
    assert run.steepest_weakening_rate == sample.steepest_weakening_rate
