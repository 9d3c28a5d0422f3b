"""Failure probabilities as runs on disk: resumed, in parts, with more repetitions, and read."""

import dataclasses
import json
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr
from small_study import lengths, small_study

import stiction as st
from stiction.ensemble import batches
from stiction.reliability.tail import OF_CURVES
from stiction.study import failure

SWEPT = lengths(3e-3, 7e-3, 5e-3)
SMALLEST = 1e-3


def study(**tables):
    return st.Study.from_dict(small_study(64, **{"sweep": SWEPT, **tables}))


UNCERTAIN = {
    "count": 4,
    "random.strength.marginal.low": [0.58e6, 0.7e6],
    "random.strength.marginal.high": {"type": "truncated_normal", "mean": 1.6e6, "cv": 0.1},
}


def computed(folder, repetitions=2, one=None, **options):
    one = one or study()
    return one.failure_curve(out=folder, repetitions=repetitions, smallest=SMALLEST, **options)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A run that was left alone."""
    return computed(tmp_path_factory.mktemp("runs") / "whole")


def test_a_curve_is_that_of_samples_of_its_point(whole):
    """Quantiles by counting, within four standard errors, at a point that is neither end."""
    assert whole.sizes == {"correlation_length": 3, "point": whole.sizes["point"]}
    one = whole.sel(correlation_length=7e-3)
    field = study().experiments[1]
    counted = st.monte_carlo(
        field.problem, field.random, method=field.method, samples=4_000, seed=8
    ).critical_stress.values
    for stress, chance, cv in zip(
        one.stress.values, one.probability.values, one.cv.values, strict=True
    ):
        if chance > 0.02:
            share = (counted < stress).mean()
            error = np.hypot(cv * chance, np.sqrt(chance * (1.0 - chance) / counted.size))
            assert abs(share - chance) < 4.0 * error
    assert whole.attrs["repetitions"] == 2
    assert json.loads(whole.attrs["study"])["ensemble"]["seed"] == 3
    assert one.lower_bound == 0.66e6
    np.testing.assert_allclose(one.stress_above_bound, one.stress - 0.66e6, atol=1e-6)
    # Errors fall as the square root of the repetitions, here two of a fifth of plain counting.
    assert one.cv.values[0] == pytest.approx(np.sqrt(0.5 / OF_CURVES[1]), rel=0.2)


def test_interrupted_in_parts_and_grown_it_has_the_same_bits(whole, tmp_path):
    one = study()

    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        computed(tmp_path / "broken", one=one, progress=stop)
    stored = st.open_run(tmp_path / "broken")
    assert (stored.status().done, stored.status().samples) == (2, 6)
    # The first repetitions of two points are there: the third has no number yet.
    assert np.isnan(stored.dataset().stress.values).any(axis=1).tolist() == [False, False, True]
    xr.testing.assert_equal(computed(tmp_path / "broken", one=one), whole)

    with pytest.MonkeyPatch.context() as patch:
        for one_file in (batches, failure):
            patch.setattr(one_file, "versions", lambda: "stiction 99.0")
        computed(tmp_path / "parts", 1, one, part="2/2")
    for part in ("1/2", "2/2"):
        with (
            ThreadPoolExecutor(2) as pool,
            pytest.warns(UserWarning, match="begun with st.* 99"),
        ):
            computed(tmp_path / "parts", one=one, part=part, executor=pool)
    found = st.open_run(tmp_path / "parts")
    xr.testing.assert_equal(found.dataset(), whole)
    next((tmp_path / "parts" / "chunks").iterdir()).write_bytes(b"damaged")
    with pytest.warns(UserWarning, match="its repetitions are missing"):
        found.dataset()


def test_uncertain_parameters_are_interfaces_that_are_equally_likely(
    runs, tmp_path, monkeypatch
):
    """A study file, the list it stands for, and each interface of that list alone."""
    monkeypatch.chdir(tmp_path)
    one = study(uncertain=UNCERTAIN, sweep=[])
    one.to_toml("study.toml")
    assert st.Study.from_toml("study.toml") == one
    likely = one.experiments[0].given
    lows = sorted(member.strength.marginal.low for member in likely)
    assert np.floor((np.array(lows) - 0.58e6) / 0.03e6).tolist() == [0, 1, 2, 3]
    again = study(random=st.Study(
        problem=one.problem, random=likely, method=one.method, ensemble=one.ensemble
    ).to_dict()["random"], sweep=[])  # fmt: skip
    printed = runs(
        f"reliability study.toml --out RUN --smallest {SMALLEST} --repetitions 2", ""
    )
    assert "the mean over 4 equally likely interfaces" in printed
    assert "band_high (1)" in printed
    runs("report RUN")
    page = (tmp_path / "RUN" / "report.html").read_text(encoding="utf-8")
    assert "mean over 4 equally likely interfaces" in page
    found = st.open_run("RUN").dataset()
    xr.testing.assert_equal(computed(tmp_path / "list", one=again), found)
    for number, member in enumerate(likely):
        onsets = st.monte_carlo(
            one.problem, member, method=one.method, samples=3000, seed=6
        ).critical_stress.values
        for stress, chance in zip(found.stress.values, found.members.values, strict=True):
            share = (onsets < stress).mean()
            assert share == pytest.approx(np.nan_to_num(chance[number]), rel=0.25, abs=0.012)
    # A band is of some; samples of a plain run are of all.
    assert (found.band_low < found.probability)[found.band_low.notnull()][1:].all()
    assert found.band_low.isnull().any()  # the strongest has few samples so low
    assert (found.probability < found.band_high)[1:].all()
    onsets = dataclasses.replace(one, ensemble=st.Ensemble(samples=4000, seed=3)).run(
        pilot=False
    )
    share = (onsets.critical_stress.values < float(found.stress[2])).mean()
    assert share == pytest.approx(float(found.probability[2]), rel=0.2)


def test_fewer_repetitions_after_the_study_was_lost_are_the_first_ones(tmp_path):
    one = study(sweep=lengths(3e-3, 7e-3))
    one.failure_curve(out=tmp_path / "run", repetitions=3, smallest=0.1)
    (tmp_path / "run" / "study.json").unlink()
    with pytest.warns(UserWarning, match="study.json is damaged or missing"):
        fewer = one.failure_curve(out=tmp_path / "run", repetitions=2, smallest=0.1)
    assert fewer.equals(one.failure_curve(out=tmp_path / "two", repetitions=2, smallest=0.1))


@pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")
def test_in_memory_it_is_the_same_curve(tmp_path):
    one = st.Study.from_dict(small_study(64, correlation_length=9e-3))
    (point,) = one.experiments
    memory = st.failure_curve(
        point.problem, point.random, method=point.method, seed=point.seed, smallest=SMALLEST,
        target_cv=0.13,
    )  # fmt: skip
    stored = computed(tmp_path / "run", memory.repetitions, one)
    assert memory.repetitions > 1
    assert memory.evaluations == stored.evaluations
    xr.testing.assert_equal(memory, stored)
