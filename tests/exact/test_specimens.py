"""Specimens: exact statements, and the path against one by brute force."""

import dataclasses
import itertools
import json

import numpy as np
import pytest
from brute_force import BruteForce, along
from refusals import warning_texts
from scipy.linalg import eigvalsh
from setups import EXACT, exact_onset, examples, without
from specimens import crooked, rough

import stiction as st
from stiction.elasticity.driven import shortest_runs
from stiction.elasticity.protocol import DenseEntries
from stiction.methods.equilibrium.dense.cholesky import SlipState, make_workspace
from stiction.methods.equilibrium.dense.search import DenseSearch
from stiction.methods.equilibrium.dense.stable_path import follow_stable_path
from stiction.methods.equilibrium.state import PathStatus
from stiction.methods.equilibrium.strength import make_sample, pieces_of

INF = float("inf")
DRIVES = examples("drives of specimens")


def follow(problem, strength):
    """Onset, largest stress, sliding, every event with its drop, and every state by brute force.

    Work at the grips is stored or dissipated, and lost only in jumps, to round-off.
    """
    brute = BruteForce(problem, strength).run()
    found = exact_onset(problem, strength, events=60).isel(sample=0)
    assert float(found.critical_load) == pytest.approx(brute.load, rel=1e-9)
    assert float(found.critical_stress) == pytest.approx(brute.peak, rel=1e-9)
    if brute.first is not None:
        assert float(found.first_instability) == pytest.approx(brute.first, rel=1e-9)
    assert int(found.arrested_events) == len(brute.drops)
    drops = found.event_stress_drop.values[: len(brute.drops)]
    np.testing.assert_allclose(drops, brute.drops, rtol=1e-5, atol=1e-4)
    ends = brute.load * (1.0 - 1e-9), brute.load * (1.0 + 1e-9)
    path = st.equilibrium_path(problem, strength, ends)
    assert path.sliding.values.tolist() == [False, True]
    states = along(problem, strength, brute.kinks)
    assert max(states.stress, states.over, states.off, states.back) < 1e-9
    assert states.imbalance < 1e-9
    assert (states.lost[states.jumps] > 0.0).all()
    return brute, states


@pytest.mark.parametrize(
    ("name", "mode"),
    [*zip(DRIVES, itertools.cycle(("II", "III")), strict=False), ("platen", "III")],
)
def test_path_against_brute_force(name, mode):
    problem = crooked(nodes=56, weakening_rate=0.12e12, drive=DRIVES[name], mode=mode)
    follow(problem, rough(problem, 3))


def test_a_stiff_machine_on_a_short_specimen_slides_stably():
    """No patch is unstable; the largest stress is that under dead load."""
    soft, stiff = (
        crooked(
            height=0.004, weakening_rate=0.02e12, drive=st.Platen(stiffness=k), mode="III",
            load=st.Load(),
        )
        for k in (0.0, INF)
    )  # fmt: skip
    strength = rough(soft, 5, 1, 0.02)
    free = exact_onset(soft, strength)
    with pytest.warns(st.AccuracyWarning, match="slides stably") as caught:
        held = exact_onset(stiff, strength, sensitivity=True)
    assert not any("derivative" in str(one.message) for one in caught)
    for name in ("sensitivity", "first_instability", "critical_position"):
        assert np.isnan(held[name]).all()
    assert held.critical_stress.item() == pytest.approx(free.critical_stress.item(), rel=1e-9)
    assert held.critical_load.item() > free.critical_load.item()


LAWS = examples("laws of lap joints")


@pytest.mark.parametrize("name", LAWS)
def test_nodes_stop_rest_and_slip_again(name):
    """Two pushers behind a rigid machine, as by brute force.

    Nodes stop between events, within one, and where another passes a corner.
    """
    drive = st.Pusher(height=0.004, width=0.003, side="both", stiffness=INF)
    nodes, mode = 48 if "pieces" in name else 64, "III" if name == "out of plane" else "II"
    problem = crooked(drive=drive, height=0.009, nodes=nodes, mode=mode)
    problem = dataclasses.replace(problem, friction=LAWS[name])
    strength = rough(problem, 3)
    brute, states = follow(problem, strength)
    assert min(brute.stops, brute.stops_in_jumps, states.jumps.sum(), states.rests) > 0
    assert brute.stops_at_corners > 0 or name != "two pieces, steeper"
    assert states.again > 0 or name == "two pieces"


UNLOADING = np.array([[1.0, 0.35, 0.0], [0.35, 1.0, 0.0], [0.0, 0.0, 1.0]])
"""Stiffness with which the first two of three nodes unload each other."""


def slip_state(law, slip, relief=0.0, max_slipping=3):
    """Three nodes, the last of which never slips; each weakens at a rate of 0.425 at first."""
    strength, profile, weakening_rate = np.array([1.0, 1.1, 9.0]), np.ones(3), np.full(3, 0.425)
    sample = make_sample(strength, np.zeros(3), profile, weakening_rate, pieces_of(law))
    workspace = make_workspace(DenseEntries(UNLOADING.flatten(), 3, relief), 3, max_slipping)
    return SlipState(sample, slip, UNLOADING @ slip, workspace, True)


def test_a_node_that_rests_once_another_weakens_more_steeply_has_stopped():
    """Both slip until the first is at its corner, from where it weakens twice as steeply."""
    law = st.PiecewiseWeakening(
        slip=(0.4, 1.0), strength=(0.75, 0.0), weakening_rate=1.0, residual_strength=0.0
    )
    corner = 0.4 * 0.625 / 0.425
    first_alone = 0.1 / (1.0 - 0.35 / 0.575)  # rise of the load until the second slips, too
    together = corner - first_alone / 0.575  # slip of either until the corner
    load = 1.0 + first_alone + (0.575 + 0.35) * together
    state = slip_state(law, np.zeros(3))
    end = follow_stable_path(state, 1.0, load + 0.015, np.empty(3))
    assert end.status == PathStatus.STABLE
    assert state.slip == pytest.approx([corner + 0.015 / 0.15, together, 0.0], rel=1e-9)
    assert end.stopped


def test_a_path_that_is_given_up_at_once_knows_the_largest_stress():
    """Behind a machine it is the stress of the interface, which slip lowers, not the drive."""
    law = st.LinearWeakening(weakening_rate=1.0, residual_strength=0.0)
    slip = np.append(np.linalg.solve(UNLOADING[:2, :2] - 0.425 * np.eye(2), [0.4, 0.3]), 0.0)
    state = slip_state(law, slip, relief=0.5, max_slipping=1)
    end = follow_stable_path(state, 1.4, 1.5, np.empty(3))
    assert end.status == PathStatus.GIVEN_UP
    assert end.peak == pytest.approx(1.4 - 0.5 * slip.mean(), rel=1e-14)


@pytest.mark.parametrize("rate", [0.9e12, 0.025e12, 0.017e12])
def test_shortest_runs_are_just_unstable_from_one_end_to_the_other(rate):
    """By trying every first node; of wide runs, as many as a run has thirty-seconds."""
    matrix, ends, end = crooked(nodes=256).blocks.stiffness, {}, 1
    for begin in range(256):
        end = max(end, begin + 1)
        while end <= 256 and eigvalsh(matrix[begin:end, begin:end])[0] >= rate:
            end += 1
        ends |= {begin: end} if end <= 256 else {}
    runs = dict(shortest_runs(matrix, rate))
    assert runs.items() <= ends.items()
    assert [min(runs), max(runs)] == [min(ends), max(ends)]
    width = max(end - begin for begin, end in ends.items())
    assert width > (64 if rate < 1e11 else 3)
    assert np.diff([*runs]).max() <= max(1, width // 32)


def test_a_drive_that_dies_away_is_not_reversed():
    """A pusher as high as the block: far from it nothing is left but the error of the fit."""
    high = 0.083 / 20.0
    problem = crooked(nodes=128, height=high, drive=st.Pusher(height=0.5 * high, width=high))
    assert 0.0 < problem.load_profile.min() < 1e-4 < problem.load_profile[20]
    assert problem.load_profile.mean() == pytest.approx(1.0)


def test_the_peak_is_said_to_be_residual_and_gaps_are_shares_of_the_first_instability(
    monkeypatch,
):
    """A pusher near the interface: of three samples, those closer than a fiftieth of the fall."""
    monkeypatch.setattr(DenseSearch, "widest_gap", -1.0)
    problem = crooked(
        nodes=128, residual=0.61e6, weakening_rate=0.25e12,
        drive=st.Pusher(height=0.004, width=0.003),
    )  # fmt: skip
    strength, found = rough(problem, 3, 4), []
    texts = warning_texts(lambda: found.append(exact_onset(problem, strength)))
    above = (found[0].critical_stress.values - 0.61e6) / np.median(strength - 0.61e6, axis=1)
    low = np.flatnonzero(above < 0.02)
    assert 0 < low.size < 4
    named = f"{low.size} of 4 samples ({', '.join(map(str, low))})"
    assert any(
        f"residual strength before the peak in {named}" in text
        and f"to within {above[low].max():.2g} of the strength drop" in text
        for text in texts
    )
    share = (found[0].certificate_gap / found[0].first_instability).max().item()
    assert any(f"up to {share:.2g} of the load apart" in text for text in texts)


def test_pressure():
    """Coefficients times p(x), in every place that it enters."""
    pressed = dataclasses.replace(
        crooked(load=st.Load(normal_pressure=2e6)),
        specimen=st.Blocks(height=0.031, pressing="glued"),
    )
    spectrum = st.PowerLawSpectrum(correlation_length=4e-3)
    marginal, of_what = st.Lognormal(mean=0.5, cv=0.1), {"quantity": "friction_coefficient"}
    pressures = st.Beta(alpha=1.3, beta=1.95, low=1.5e6, high=2.4e6)
    drawn = st.RandomInterface(
        strength=st.RandomField(marginal, spectrum, **of_what),
        normal_pressure=st.RandomField(pressures, spectrum),
    )
    bare = without(pressed, "load.normal_pressure")
    given = {"method": EXACT, "samples": 3, "keep": ("strength", "normal_pressure")}
    found = st.monte_carlo(bare, drawn, progress=False, **given)
    field = drawn.profiles(pressed.interface, samples=3, seed=0)
    p = field["normal_pressure"] * pressed.normal_pressure / 2e6
    assert p[0, 0] < 0.95 * p[0, 48]
    np.testing.assert_allclose(found.normal_pressure, p)
    np.testing.assert_allclose(found.strength, field["strength"] * p)
    coefficient = found.critical_stress / p.mean(axis=1)
    np.testing.assert_allclose(found.friction_coefficient, coefficient, rtol=1e-12)


def test_a_swept_rigid_machine_is_stored():
    """Infinity has no number in JSON: it is written as text, and read again."""
    problem = crooked(drive=DRIVES["right pusher, rigid"], nodes=64, load=st.Load())
    endless = dataclasses.replace(problem.specimen, quality_factor=INF)
    problem = dataclasses.replace(problem, specimen=endless)
    study = st.Study(
        problem=problem,
        random=st.RandomField(st.Lognormal(mean=1.0e6, cv=0.2), st.PowerLawSpectrum(9e-3)),
        method=EXACT, samples=2, sweep=[{"problem.specimen.drive.stiffness": [0.0, INF]}],
    )  # fmt: skip
    again = json.loads(json.dumps(study.to_dict(), allow_nan=False))
    assert st.Study.from_dict(again) == study
