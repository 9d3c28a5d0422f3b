"""Failure probabilities as runs on disk: resumed, in parts, with more repetitions, and read."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr
from small_study import lengths, small_study

import stiction as st
from stiction.ensemble import batches
from stiction.study import failure

SMALLEST = 0.05


def study(*swept, **tables):
    return st.Study.from_dict(
        small_study(64, **{"sweep": lengths(*swept) if swept else []} | tables)
    )


def computed(folder, one, repetitions=2, **options):
    return one.failure_curve(out=folder, repetitions=repetitions, smallest=SMALLEST, **options)


def test_interrupted_in_parts_and_grown_it_has_the_same_bits(tmp_path):
    one = study(3e-3, 7e-3, 5e-3)
    whole = computed(tmp_path / "whole", one)
    assert whole.sizes["correlation_length"] == 3

    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        computed(tmp_path / "broken", one, progress=stop)
    stored = st.open_run(tmp_path / "broken")
    assert (stored.status().done, stored.status().samples) == (2, 6)
    # The first repetitions of two points are there: the third has no number yet.
    assert np.isnan(stored.dataset().stress.values).any(axis=1).tolist() == [False, False, True]
    told = []
    again = computed(tmp_path / "broken", one, progress=lambda *counts: told.append(counts))
    xr.testing.assert_equal(again, whole)
    assert told[-1] == (4, 4)  # repetitions that were missing

    with pytest.MonkeyPatch.context() as patch:
        for one_file in (batches, failure):
            patch.setattr(one_file, "versions", lambda: "stiction 99.0")
        computed(tmp_path / "parts", one, 1, part="2/2")
    for part in ("1/2", "2/2"):
        with (
            ThreadPoolExecutor(2) as pool,
            pytest.warns(UserWarning, match="begun with st.* 99"),
        ):
            computed(tmp_path / "parts", one, part=part, executor=pool)
    found = st.open_run(tmp_path / "parts")
    xr.testing.assert_equal(found.dataset(), whole)
    next((tmp_path / "parts" / "chunks").iterdir()).write_bytes(b"damaged")
    with pytest.warns(UserWarning, match="its repetitions are missing"):
        found.dataset()


def test_fewer_repetitions_after_the_study_was_lost_are_the_first_ones(tmp_path):
    one = study()
    computed(tmp_path / "run", one)
    (tmp_path / "run" / "study.json").unlink()
    with pytest.warns(UserWarning, match="study.json is damaged or missing"):
        fewer = computed(tmp_path / "run", one, 1)
    assert fewer.equals(computed(tmp_path / "one", one, 1))


def test_in_memory_it_is_the_same_curve(tmp_path):
    one = study(correlation_length=9e-3)
    (point,) = one.experiments
    given = {"method": point.method, "seed": point.seed, "smallest": SMALLEST}
    memory = st.failure_curve(point.problem, point.random, target_cv=0.07, **given)
    stored = computed(tmp_path / "run", one, memory.repetitions)
    assert memory.repetitions > 1
    assert memory.evaluations == stored.evaluations
    xr.testing.assert_equal(memory, stored)
