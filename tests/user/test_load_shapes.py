"""Load shapes and event sequences: in Python, in study files, swept, and refused by name."""

from typing import Literal

import numpy as np
import pydantic
import pytest
from refusals import refuses

import stiction as st
from stiction.load import LoadShape, distance, register
from stiction.model import Positive, model, to_plain

PLAIN = st.paper.problem(nodes=256)


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
    tau_p = st.paper.strength(PLAIN).sample(PLAIN.interface, samples=3, seed=0)
    for method in (st.LocalCriterion(), st.Equilibrium()):
        one = st.onset(loaded(shape), tau_p, method=method, progress=False)
        other = st.onset(
            loaded(shape.on(PLAIN.interface)), tau_p, method=method, progress=False
        )
        np.testing.assert_array_equal(one["critical_stress"], other["critical_stress"])


def test_in_a_study_file_and_swept(tmp_path):
    study = st.Study(
        problem=loaded(st.EdgeLoad(excess=2.0, decay=0.01)),
        random=st.paper.strength(PLAIN),
        method=st.Equilibrium(events=3),
        ensemble=st.Ensemble(samples=2),
        sweep=({"problem.load.profile.excess": [0.5, 4.0]},),
    )
    path = tmp_path / "study.toml"
    study.to_toml(path)
    again = st.Study.from_toml(path)
    assert again.problem == study.problem
    result = again.run(progress=False)
    assert result["event_length"].dims == ("excess", "sample", "event")
    assert result["critical_stress"][0].mean() > result["critical_stress"][1].mean()


def test_events_are_those_of_the_path(tmp_path):
    strength = st.RandomField(
        marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=4.66e6),
        spectrum=st.PowerLawSpectrum(correlation_length=1.5e-3),
    )
    tau_p = strength.sample(PLAIN.interface, samples=6, seed=0)
    found = st.onset(PLAIN, tau_p, method=st.Equilibrium(events=4), progress=False)
    kept = found["event_moment"].values
    assert np.isfinite(kept).sum() > 2
    for sample in range(6):
        own = st.equilibrium_path(PLAIN, tau_p[sample], [0.0])["event_moment"].values[:4]
        np.testing.assert_array_equal(kept[sample, : own.size], own)
        assert np.isnan(kept[sample, own.size :]).all()
    study = st.Study(
        problem=PLAIN, random=strength, method=st.Equilibrium(events=4),
        ensemble=st.Ensemble(samples=6),
    )  # fmt: skip
    stored = study.run(out=tmp_path / "run", progress=False)
    np.testing.assert_array_equal(stored["event_moment"].values, kept)


MISTAKES = {
    "amplitude": lambda: st.GradientLoad(amplitude=1.0),
    "excess": lambda: st.EdgeLoad(excess=-1.0, decay=0.01),
    "decay": lambda: st.EdgeLoad(excess=1.0, decay=0.0),
    "did you mean 'edge'": lambda: st.Load(profile={"type": "egde", "excess": 1.0}),
    "exces": lambda: st.Load(profile={"type": "edge", "exces": 1.0, "decay": 0.01}),
    "events": lambda: st.Equilibrium(events=-1),
    "load.profile": lambda: st.theory.nucleation_statistics(
        loaded(st.EdgeLoad(excess=1.0, decay=0.01)), st.paper.strength(PLAIN)
    ),
}


@pytest.mark.parametrize("words", MISTAKES)
def test_mistakes(words):
    refuses(words, MISTAKES[words])


@register
@model(kw_only=True)
class BumpLoad(LoadShape):
    """A load of one's own: higher within `width` (m) of the middle."""

    width: Positive
    type: Literal["hump"] = "hump"

    def values(self, interface):
        return 1.0 + (distance(interface, 0.5) < self.width)


def test_a_load_of_ones_own():
    problem = loaded(BumpLoad(width=0.02))
    assert problem.load_profile.mean() == pytest.approx(1.0, abs=1e-14)
    plain = to_plain(problem)
    assert plain["load"]["profile"] == {"type": "hump", "width": 0.02}
    from_file = pydantic.TypeAdapter(st.Problem).validate_python(plain)
    assert from_file == problem
    tau_p = st.paper.strength(PLAIN).sample(PLAIN.interface, samples=2, seed=0)
    for sample in (tau_p, from_file.sample(tau_p)):
        found = st.onset(from_file, sample, method=st.LocalCriterion())
        assert np.all(np.abs(found.critical_position - 0.05) < 0.02)
    with pytest.raises(st.InputError, match=r"BumpLoad.width: must be greater than 0"):
        st.Load(profile={"type": "hump", "width": 0.0})
    with pytest.raises(st.InputError, match=r"Bump.* must be positive everywhere"):
        loaded(NegativeBump(width=0.02))


@model(kw_only=True)
class NegativeBump(BumpLoad):
    def values(self, interface):
        return super().values(interface) - 1.5
