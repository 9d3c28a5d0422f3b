"""Ruptures with inertia on specimens, as a user asks for them."""

import numpy as np
import pytest
from specimens import crooked, rough

import stiction as st
from stiction.methods.dynamics.specimens import RuptureSearch
from stiction.methods.equilibrium.solver import follow_to_sliding, make_search, sample_of
from stiction.methods.equilibrium.state import Outcome
from stiction.methods.equilibrium.strength import present_pieces

LOW = st.Pusher(height=0.006, width=0.004, stiffness=3e7)
SPECIMEN = crooked(nodes=64, drive=LOW)
STRENGTH = rough(SPECIMEN, 3)
DRIVES = [
    LOW,
    st.Pusher(height=0.012, width=0.005),
    st.Platen(stiffness=2e7, mass=0.1),
    st.Pusher(height=0.01, width=0.004, side="both", stiffness=float("inf")),
]


@pytest.fixture(scope="module")
def run():
    """An event that comes to rest, at every tenth step."""
    save = st.Save(["slip", "slip_rate", "shear_stress", "strength"])
    return st.simulate_rupture(SPECIMEN, STRENGTH, method=st.Rupture(), event=0, save=save)


@pytest.mark.parametrize("drive", DRIVES)
def test_no_event_is_shorter_than_without_inertia_and_each_ends_in_equilibrium(drive):
    problem = crooked(nodes=64, drive=drive)
    search, overdamped = RuptureSearch(problem, st.Rupture()), make_search(problem)
    for strength in rough(problem, 5, samples=4):
        sample = sample_of(problem.sample(strength), search.pieces, 0)
        for before, after, _ in follow_to_sliding(search, sample).events:
            least = overdamped.jump(sample, before)
            assert least.outcome == Outcome.ARRESTED
            assert np.all(after.slip >= least.state.slip - 1e-6 * after.slip.max())
            pieces = present_pieces(sample, after.slip)
            load = before.load * sample.profile - problem.blocks.stiffness @ after.slip
            over = load - (pieces.strength - pieces.weakening_rate * after.slip)
            assert over.max() < 1e-9 * sample.excess.max()


def test_one_event_in_space_and_time(run):
    energies = (f"{name}_energy" for name in ("friction", "strain", "kinetic", "attenuated"))
    assert sum(run[name] for name in energies).values == pytest.approx(run["work"].values)
    assert run.attrs["stopped"] == "rest"
    assert run["attenuated_energy"].values[-1] > 0.0
    assert np.all(np.diff(run["slip"].values, axis=0) >= 0.0)
    added = (run["slip"][-1] - run["slip"][0]).values.sum() * SPECIMEN.interface.cell
    moment = SPECIMEN.solid.shear_modulus * added  # the frames begin just after the event
    assert st.external.event_table(run)["event_moment (N)"][0] == pytest.approx(
        moment, rel=0.02
    )
    over = run["shear_stress"] - run["strength"]
    assert over.values[1:].max() < 0.02 * float(run["peak_strength"].mean())
    assert run["machine_force"].values[0] == pytest.approx(run["force"].values[0], rel=1e-3)
    assert run["block_velocity"].dims == ("snapshot", "height", "x")
