"""Planes as a user meets them: results, warnings, refusals, study files, commands, figures."""

import dataclasses
import warnings

import numpy as np
import pytest
from setups import RATE, make_problem, smooth_noise
from small_study import lengths, small_study

import stiction as st
from stiction.methods.equilibrium import solver
from stiction.methods.equilibrium.sample import Jump, Outcome
from stiction.methods.equilibrium.transforms import plane as program
from stiction.methods.equilibrium.transforms.relaxation import Relaxed


def smooth(shape, seed=0):
    return 0.7e6 + 1e6 * smooth_noise(4.0, np.random.default_rng(seed), shape)


def plane_of(nodes=(72, 64), **friction):
    return make_problem(nodes, (0.0208, 0.0156), weakening_rate=RATE, **friction)


PLANE = plane_of()
SAMPLES = np.array([smooth((72, 64), seed) for seed in (0, 1)])
STRENGTH = SAMPLES[0]


def onset(strength=SAMPLES, plane=PLANE, **options):
    return st.onset(plane, strength, method=st.Equilibrium(**options))


@pytest.fixture(scope="module")
def found():
    """Two samples with everything that can be asked for; a fine grid, certified: no warning."""
    with warnings.catch_warnings(action="error"):
        return onset(slip=True, sensitivity=True)


def test_bounds_that_do_not_close_are_warned_of_with_their_distance(monkeypatch):
    # As if Newton's method and bisection had got nowhere.
    monkeypatch.setattr(program, "close", lambda *a, **k: (False, 0.0))
    monkeypatch.setattr(program, "_narrow", lambda *a, **k: 0.0)
    with pytest.warns(st.AccuracyWarning, match=r"2 of 2 samples \(0, 1\).*apart"):
        found = onset()
    assert (found["certificate_gap"] > 1e-3 * found["first_instability"]).all()


def test_no_certificate_where_the_residual_strength_is_reached_first():
    plane = plane_of(residual_strength=0.69e6)
    with pytest.warns(st.AccuracyWarning, match="residual strength before.*no certificate"):
        found = onset(STRENGTH, plane, sensitivity=True, slip=True)
    assert not found["certified"].item()
    assert found["residual_reached"].item()
    assert np.isfinite(found["critical_position"].values).all()
    # Where the residual strength is reached, the peak strength is of no consequence any more.
    residual = found["slip"].values >= (STRENGTH - 0.69e6) / RATE
    assert residual.any()
    assert (found["sensitivity"].values[residual] == 0.0).all()


def test_a_path_that_is_lost_is_warned_of(monkeypatch, found):
    """In its first jump, before it, or after a jump that came to rest."""
    follow_on = program.PlaneProgram.next

    def path_lost(*given):
        return dataclasses.replace(follow_on(*given), unstable=False, known=False)

    def at_rest(own, sample, state):
        monkeypatch.setattr(program.PlaneProgram, "next", path_lost)
        return Jump(True, True, state)

    for owner, name, lost in (
        (program, "least_equilibrium", lambda *given: Relaxed(Outcome.UNDECIDED, given[3])),
        (program.PlaneProgram, "next", path_lost),
        (program.PlaneProgram, "jump", at_rest),
    ):
        monkeypatch.setattr(owner, name, lost)
        text = r"not followed .* in 1 of 1 samples \(0\): .* a lower bound"
        with pytest.warns(st.AccuracyWarning, match=text):
            ends = onset(STRENGTH)
        monkeypatch.undo()
        assert ends["critical_load"].item() >= found["critical_load"].values[0]


def test_nodes_of_constant_strength(found):
    residual = np.zeros((72, 64))
    residual[10:14, 20:30] = 2e6
    with pytest.warns(st.AccuracyWarning, match="strength is constant"):
        held = onset({"strength": STRENGTH, "residual_strength": residual})
    # Constant strength is more than what weakens from the same peak.
    weaker = found["first_instability"].values[0]
    assert held["first_instability"].item() >= weaker * (1.0 - 2e-6)
    assert held["arrested_events"].item() == 0
    assert held["certified"].item()


def test_the_sample_that_fails_is_named(monkeypatch):
    real, seen = solver.follow, []

    def second_fails(*arguments):
        seen.append(arguments)
        if len(seen) == 2:
            raise FloatingPointError("singular")
        return real(*arguments)

    monkeypatch.setattr(solver, "follow", second_fails)
    with pytest.raises(FloatingPointError) as caught:
        onset(SAMPLES[[0, 1, 0]])
    assert caught.value.__notes__ == ["in sample 1 of the 3 that were solved together"]


STUDY = small_study(
    nodes=[72, 60],
    length=[0.02, 0.014],
    weakening_rate=RATE,
    ensemble={"samples": 30, "seed": 3, "keep": ["strength"]},
    sweep=lengths(2e-3, 4e-3),
)
STUDY["random"]["strength"] |= {"anisotropy": 1.5, "mean_mode": True}


def test_failing_profiles_are_kept():
    plan = st.Study.from_dict(STUDY).experiments[0]
    found = st.failure_probability(
        plan.problem, plan.random, 0.72e6, method=plan.method, algorithm="plain",
        target_cv=0.5, max_evaluations=300,
    )  # fmt: skip
    assert found.failing_profiles.sizes["sample"] >= 2
