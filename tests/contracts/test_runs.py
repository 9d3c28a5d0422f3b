"""Laws of every step of a rupture between half-spaces: all that a result says of its own slip."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from contracts.bodies import BODIES, FIELD
from ruptures import run_of as run_at_rest
from setups import make_problem

import stiction as st
from stiction.methods.dynamics import medium
from stiction.methods.dynamics.memory import implicit_tables

pytestmark = pytest.mark.filterwarnings("ignore")
TIMES, LOADS = np.array([[0.0, 6e-4, 8e-4, 9e-4, 1e-3], [0.0, 6.3e5, 6.3e5, 2e5, 6e5]])
"""A load that rises, waits while waves go off, falls, and rises again beyond its last time."""
END = 1.05e-3
USUAL = {"load_history": (TIMES, LOADS), "stop": "time", "end_time": END}
RUNS = {"implicit": {"arrival": 0.2}, "explicit": {"implicit": False, "courant": 0.7}}
CASES = [(name, "implicit") for name in ("line", "plane", "line with ends", "plane with ends")]
CASES += [(name, "explicit") for name in ("line with ends", "plane with ends")]
every = pytest.mark.parametrize(("name", "kind"), CASES)


@cache
def run_of(name: str, kind: str, **options: Any) -> Any:
    """A run with a frame after each step."""
    strength = FIELD.sample(BODIES[name].interface, seed=5)
    method = st.Rupture(**USUAL | RUNS[kind] | options)
    save = st.Save(["slip", "slip_rate", "shear_stress", "strength"], every=1)
    return st.simulate_rupture(BODIES[name], strength, method=method, save=save, progress=False)


def load_at(time: Any) -> Any:
    """The load, whose last slope continues."""
    slope = (LOADS[-1] - LOADS[-2]) / (TIMES[-1] - TIMES[-2])
    return np.interp(time, TIMES, LOADS) + slope * np.maximum(time - TIMES[-1], 0.0)


def assert_close(found: Any, expected: Any, name: str = "") -> None:
    """Equal to round-off of sums whose terms are as large as the largest value."""
    atol = 1e-9 * np.nanmax(np.abs(expected), initial=1e-300)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=atol, err_msg=name)


@every
def test_each_step_is_at_its_load_and_as_long_as_its_method_allows(name, kind):
    run, method = run_of(name, kind), st.Rupture(loading_rate=1.0, **RUNS[kind])
    time, size = run.step_time.values, run.step_size.values
    assert_close(run.step_load, load_at(time), "step_load")
    assert_close(run["load"], load_at(run.time), "load")
    assert_close(run.applied_load, load_at(run.onset_time), "applied_load")
    np.testing.assert_allclose(np.diff(run.time), size, rtol=1e-6)
    assert time.size == run.implicit_steps + run.explicit_steps
    assert time[-2] < END <= time[-1] < END + size[-1]
    explicit = np.isclose(size, method.medium(BODIES[name]).largest_step * method.courant)
    assert explicit.sum() == run.explicit_steps > 0
    assert (run.implicit_steps > 0) == method.implicit


def assert_of_slip(run: Any, rows: Any, problem: st.Problem, share: float) -> Any:
    """Means, moment rate and arrivals are those of the nodes. Return their strength, Pa."""
    free, cell = problem.interface.breakable, problem.interface.cell
    slip, rate, stress = (run[key].values for key in ("slip", "slip_rate", "shear_stress"))
    drop = rows.strength[0] - rows.residual_strength[0]
    critical, time = drop / rows.weakening_rate[0], run.time.values
    rates = rate[:, free]
    assert min(rate.min(), np.diff(slip, axis=0).min()) >= 0.0
    for key, values in {
        "mean_slip": slip[:, free].mean(axis=1), "mean_stress": stress[:, free].mean(axis=1),
        "top_slip_rate": rates.max(axis=1),
        "weakened_fraction": (slip >= critical)[:, free].mean(axis=1),
        "moment_rate": problem.solid.shear_modulus * cell * rates[1:].sum(axis=1),
    }.items():  # fmt: skip
        assert_close(run[key], values, key)
    # The front arrives in the step after which a node has lost its share of the drop.
    reached, arrival = slip >= share * critical, run.arrival_time.values
    came, first = reached[-1] & ~reached[0], reached.argmax(axis=0)
    np.testing.assert_array_equal(np.isfinite(arrival), came)
    assert (arrival[came] <= time[first[came]] * (1.0 + 1e-12)).all()
    assert (arrival[came] >= time[first[came] - 1] * (1.0 - 1e-12)).all()
    strength = rows.strength[0] - rows.weakening_rate[0] * np.minimum(slip, critical)
    assert_close(run.strength.values[:, free], strength[:, free], "strength")
    return strength


@every
def test_each_frame_follows_from_its_slip_and_load(name, kind):
    """By sums over the nodes, for linear weakening."""
    run, problem = run_of(name, kind), BODIES[name]
    rows = problem.sample(FIELD.sample(problem.interface, seed=5))
    strength = assert_of_slip(run, rows, problem, RUNS[kind].get("arrival", 0.5))
    free, cell = problem.interface.breakable, problem.interface.cell
    slip, rate, stress = (run[key].values for key in ("slip", "slip_rate", "shear_stress"))
    residual, load = rows.residual_strength[0], run["load"].values
    load = np.expand_dims(0.5 * (load[1:] + load[:-1]), tuple(range(1, slip.ndim)))
    pushed = load * rows.load_profile + rows.initial_stress[0]
    drop, left = rows.strength[0] - residual, strength - residual

    def total(field: Any) -> Any:
        return cell * field[:, free].sum(axis=1)

    work = np.append(0.0, np.cumsum(total(pushed * np.diff(slip, axis=0))))
    strain = [0.5 * cell * (d * problem.released_stress(d)).sum() for d in slip]
    with np.errstate(invalid="ignore"):
        fracture = total((drop + left) * (drop - left) / (2.0 * rows.weakening_rate[0]))
    for key, values in {
        "work": work, "strain_energy": strain, "fracture_energy": fracture,
        "radiated_energy": work - strain - fracture - total(residual * slip),
        "seismic_moment": problem.solid.shear_modulus * total(slip),
    }.items():  # fmt: skip
        assert_close(run[key], values, key)
    for key in ("mean_slip", "mean_stress", "top_slip_rate", "work"):
        assert_close(run[f"step_{key}"], run[key][1:], key)
    assert_close(run.step_mean_slip_rate, rate[1:, free].mean(axis=1), "step_mean_slip_rate")
    # A node slips at its strength, or rests below it, to within the solver's 1e-8 of the drop.
    below, accuracy = (strength - stress)[:, free], 1e-8 * drop[free].max()
    assert below.min() > -accuracy
    assert below[rate[:, free] > 0.0].max() < accuracy
    gone = run.weakened_fraction.values == 1.0
    kinetic = run.mean_stress[gone.argmax()] if gone.any() else np.nan
    assert_close(run.kinetic_stress, kinetic, "kinetic_stress")
    assert_close(run.stress_drop, run.critical_stress - kinetic, "stress_drop")


@pytest.mark.parametrize(("name", "kind"), [case for case in CASES if case[0] != "plane"])
def test_each_event_is_the_difference_of_two_frames(name, kind):
    """Also the events after the first: what the run released between the ends of each."""
    run, problem = run_of(name, kind), BODIES[name]
    rows, free = (
        problem.sample(FIELD.sample(problem.interface, seed=5)),
        problem.interface.breakable,
    )
    typical = np.median((rows.strength - rows.residual_strength)[0, free])
    impedance = problem.solid.shear_modulus / (2.0 * problem.solid.shear_wave_speed)
    fast = run.step_top_slip_rate.values > 0.075 * typical / impedance
    assert run.event_time.size > 1 or name == "line"
    for number in range(run.event_time.size):
        event = run.isel(event=number)
        (since,) = np.flatnonzero(run.time.values == event.event_time.item())
        released = run.seismic_moment.values - run.seismic_moment.values[since]
        end = np.abs(released - event.event_moment.item()).argmin()
        added = run.isel(time=end) - run.isel(time=since)
        assert_close(event.event_load, run["load"].values[since], "event_load")
        assert_close(event.event_largest_slip, added.slip.max(), "event_largest_slip")
        for key in ("fracture_energy", "radiated_energy"):
            assert_close(event[f"event_{key}"], added[key], key)
        assert_close(event.event_moment, added.seismic_moment, "event_moment")
        # Twice the energy over the slip, both per area.
        energy = added.fracture_energy + added.radiated_energy
        slipped = added.seismic_moment / problem.solid.shear_modulus
        assert_close(event.event_energy_stress_drop, 2.0 * energy / slipped, "stress drop")
        assert event.event_settled == (end + 1 < run.time.size)
        # An event is noticed, and its fast slip counts, from a few steps on.
        during = slice(since, end)
        mean_rate = np.where(fast, run.step_mean_slip_rate, 0.0)[during]
        time = run.step_time.values[during][mean_rate > 0.1 * mean_rate.max()]
        assert event.event_duration == pytest.approx(np.ptp(time), rel=0.06)


@pytest.mark.parametrize("number", [1, None], ids=["arrested", "sliding"])
def test_each_frame_of_an_event_in_blocks_follows_from_its_slip_and_travel(number):
    """Not of the first event: nodes have slipped before."""
    problem, ask = BODIES["blocks"], {"method": st.Rupture(arrival=0.2, events=12)}
    strength = FIELD.sample(problem.interface, seed=5)
    save = st.Save(["slip", "slip_rate", "shear_stress", "strength"], every=1)
    run = st.simulate_rupture(problem, strength, event=number, save=save, **ask)
    rows, onset = problem.sample(strength), st.onset(problem, strength, **ask).isel(sample=0)
    law = assert_of_slip(run, rows, problem, 0.2)
    slip, rate, stress = (run[key].values for key in ("slip", "slip_rate", "shear_stress"))
    cell, initial, step = problem.interface.cell, rows.initial_stress[0], run.time[1].item()
    assert run.stopped == ("sliding" if number is None else "rest")
    # A step takes the strength before it.
    assert (stress[1:] <= law[:-1] + 1e-9 * law.max()).all()
    assert_close(stress[1:][rate[1:] > 0.0], law[:-1][rate[1:] > 0.0], "strength")
    assert_close(np.diff(slip, axis=0), step * rate[1:], "slip")
    area = problem.interface.measure * problem.specimen.thickness
    force = area * (run.machine_stress[0] - run.machine_stress)
    assert_close(problem.specimen.drive.stiffness * run.drive_travel, force, "drive_travel")
    rubbed = (0.5 * (rate[1:] + rate[:-1]) * (stress - initial)[1:]).sum(axis=1)
    middle = slip - slip[0] - 0.5 * step * rate
    energies = [f"{name}_energy" for name in ("friction", "strain", "kinetic", "attenuated")]
    for found, values in (
        (run.friction_energy[1:], step * cell * np.cumsum(rubbed)),
        (run.work, cell * middle @ (stress[0] - initial)),
        (run.work, sum(run[key] for key in energies)),
        (run.critical_load, onset.critical_load if number is None else onset.event_load[number]),
        (run.onset_time, run.arrival_time.min()),
        (run.onset_time, run.arrival_time.sel(x=run.critical_position)),
    ):  # fmt: skip
        assert_close(found, values)
    if number is not None:  # waves that go off and the end in equilibrium move it little
        added = problem.solid.shear_modulus * cell * (slip[-1] - slip[0]).sum()
        assert onset.event_moment[number] == pytest.approx(added, rel=1e-3)
    # Pictures of the upper block: its interface moves at half the slip rate.
    taken = np.searchsorted(run.time, run.snapshot)
    share = (slip[taken] - slip[0]).mean(axis=1) / (slip[-1] - slip[0]).mean()
    np.testing.assert_allclose(share, [0.02, 0.1, 0.2, 0.35, 0.5, 0.65, 0.8, 0.95], atol=0.04)
    np.testing.assert_allclose(2.0 * run.block_velocity[:, 0], rate[taken], rtol=1e-6)


ENDS = [("plane", "stop", "sliding"), ("line with ends", "stop", "onset")]
ENDS += [("plane", "max_steps", 300), ("line with ends", "stop", "rest")]


@pytest.mark.parametrize(("name", "option", "value"), ENDS)
def test_a_run_that_ends_earlier_is_the_beginning_of_a_longer_run(name, option, value):
    """To the bit, up to the first step after which there is what the option waits for."""
    whole, part = run_of(name, "implicit"), run_of(name, "implicit", **{option: value})
    for key, values in part.items():
        if {"step", "time"} & {*values.dims}:
            np.testing.assert_array_equal(values, whole[key][: len(values)], err_msg=key)
    assert part.stopped == (value if option == "stop" else option)
    assert {
        "sliding": (part.weakened_fraction[-2:] == 1.0).values.tolist() == [False, True],
        "onset": part.first_instability == whole.first_instability,
        "rest": part.top_slip_rate[-1] == 0.0 < part.first_instability,
        "max_steps": part.step_time.size == value,
    }[part.stopped]


@pytest.mark.parametrize("name", sorted({name for name, _ in CASES}))
def test_a_run_takes_as_many_steps_as_it_may(name):
    """More than a thousand; one step less is refused."""
    strength, run = FIELD.sample(BODIES[name].interface, seed=5), run_of(name, "implicit")

    def onset(steps: int) -> Any:
        method = st.Rupture(**USUAL | RUNS["implicit"], max_steps=steps)
        return st.onset(BODIES[name], strength, method=method, progress=False)

    needed = run.step_time.size
    assert needed > 1100
    assert_close(onset(needed).radiated_energy, run.radiated_energy[-1:])
    with pytest.raises(st.InputError, match=f"max_steps: {needed - 1} steps"):
        onset(needed - 1)


def bytes_in(part: Any) -> int:
    """Memory of the arrays in a tuple."""
    return sum(map(bytes_in, part)) if isinstance(part, tuple) else getattr(part, "nbytes", 0)


@pytest.mark.parametrize(("nodes", "length"), [(4096, 0.1), ((180, 248), (0.1, 0.12))])
def test_a_run_takes_the_memory_that_it_asks_for(nodes, length, monkeypatch):
    asked, problem = [], make_problem(nodes, length, weakening_rate=5e10)
    monkeypatch.setattr(medium, "check_memory", lambda _, size, __: asked.append(size))
    monkeypatch.setattr(medium, "largest_step", lambda *_: 1e-6)
    run = run_at_rest(problem, 1e6 * np.ones(nodes), st.Rupture(loading_rate=1e7))
    tables = implicit_tables(run.medium.grid), run.medium.step_table
    assert bytes_in((run.start(0.0), run.setting, *tables)) == pytest.approx(asked[0], rel=0.05)
