"""Load shapes and event sequences: in Python, in study files, and swept."""

import numpy as np
import pytest
from setups import beta_strength

import stiction as st

PLAIN = st.paper.problem(nodes=256)
STRENGTH = st.paper.strength(PLAIN)


def loaded(profile):
    return st.Problem(PLAIN.solid, PLAIN.interface, PLAIN.friction, st.Load(profile=profile))


def test_shapes_have_mean_one_and_their_ends():
    gradient = loaded(st.GradientLoad(amplitude=0.5, centre=0.25)).load_profile
    assert gradient.mean() == pytest.approx(1.0, abs=1e-14)
    assert (gradient.max(), gradient.min()) == (pytest.approx(1.5), pytest.approx(0.5))
    assert gradient.argmax() == 64
    edge = loaded(st.EdgeLoad(excess=4.0, decay=0.005)).load_profile
    assert edge.mean() == pytest.approx(1.0, abs=1e-14)
    # Half a period away exp(-10) of the excess is left, 2e-4.
    assert edge[0] / edge[128] == pytest.approx(5.0, rel=2e-4)
    plane = st.Interface(length=(0.1, 0.05), nodes=(64, 32))
    assert np.ptp(st.EdgeLoad(excess=1.0, decay=0.01).on(plane), axis=1).max() == 0.0


def test_a_shape_is_its_array():
    shape = st.EdgeLoad(excess=2.0, decay=0.01, edge=0.5)
    tau_p = STRENGTH.sample(PLAIN.interface, samples=3, seed=0)
    one, other = (
        st.onset(loaded(profile), tau_p, method=st.Equilibrium())
        for profile in (shape, shape.on(PLAIN.interface))
    )
    np.testing.assert_array_equal(one["critical_stress"], other["critical_stress"])


def test_in_a_study_file_and_swept(tmp_path):
    study = st.Study(
        problem=loaded(st.EdgeLoad(excess=2.0, decay=0.01)),
        random=STRENGTH,
        method=st.Equilibrium(events=3),
        ensemble=st.Ensemble(samples=2),
        sweep=({"problem.load.profile.excess": [0.5, 4.0]},),
    )
    study.to_toml(tmp_path / "study.toml")
    again = st.Study.from_toml(tmp_path / "study.toml")
    assert again.problem == study.problem
    result = again.run()
    assert result["event_length"].dims == ("excess", "sample", "event")
    assert result["critical_stress"][0].mean() > result["critical_stress"][1].mean()


def test_events_are_those_of_the_path():
    strength = beta_strength(1.5e-3, high=4.66e6)
    tau_p = strength.sample(PLAIN.interface, samples=6, seed=0)
    found = st.onset(PLAIN, tau_p, method=st.Equilibrium(events=4))
    kept = found["event_moment"].values
    assert np.isfinite(kept).sum() > 2
    for sample in range(6):
        own = st.equilibrium_path(PLAIN, tau_p[sample], [0.0])["event_moment"].values[:4]
        np.testing.assert_array_equal(kept[sample, : own.size], own)
        assert np.isnan(kept[sample, own.size :]).all()
