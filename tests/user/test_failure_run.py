"""Failure probabilities as runs on disk: resumed, in parts, with more repetitions, and read."""

import re
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest
import xarray as xr
from refusals import refuses
from small_study import lengths, small_study

import stiction as st
from stiction.reliability.repetitions import SAMPLES

SWEPT = lengths(3e-3, 7e-3, 5e-3)
SMALLEST = 1e-3


def study(**tables):
    return st.Study.from_dict(small_study(64, **{"sweep": SWEPT, **tables}))


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
    assert one.lower_bound == 0.66e6
    np.testing.assert_allclose(one.stress_above_bound, one.stress - 0.66e6, atol=1e-6)
    # Errors fall as the square root of the repetitions, here two of a fifth of plain counting.
    assert one.cv.values[0] == pytest.approx(np.sqrt(0.5 / SAMPLES), rel=0.2)


def test_interrupted_in_parts_and_grown_it_has_the_same_bits(whole, tmp_path):
    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        computed(tmp_path / "broken", progress=stop)
    stored = st.open_run(tmp_path / "broken")
    assert (stored.status().done, stored.status().samples) == (2, 6)
    assert stored.missing_parts(3) == [1, 2, 3]
    # The first repetitions of two points are there: the third has no number yet.
    assert np.isnan(stored.dataset().stress.values).any(axis=1).tolist() == [False, False, True]
    xr.testing.assert_equal(computed(tmp_path / "broken"), whole)

    computed(tmp_path / "parts", 1, part="2/2")
    assert st.open_run(tmp_path / "parts").missing_parts(2) == [1]
    for part in ("1/2", "2/2"):
        with ThreadPoolExecutor(2) as pool:
            computed(tmp_path / "parts", part=part, executor=pool)
    found = st.open_run(tmp_path / "parts")
    assert found.missing_parts(2) == []
    xr.testing.assert_equal(found.dataset(), whole)


def test_a_folder_of_other_settings_and_what_cannot_be_sampled_are_refused(tmp_path):
    computed(tmp_path / "run", 1, study(sweep=[]))
    refuses(
        "failure_curve.smallest: 0.01 here, 0.001 there",
        lambda: study(sweep=[]).failure_curve(
            out=tmp_path / "run", smallest=0.01, repetitions=1
        ),
    )
    rupture = study(method={"type": "rupture", "loading_rate": 2e7}, sweep=[])
    refuses(
        "method: failures by rupture are counted", lambda: computed(tmp_path / "x", 1, rupture)
    )
    assert not (tmp_path / "x").exists()


def test_the_local_criterion_is_compared_with_equilibrium_once(tmp_path):
    """Where residual strengths are high, equilibrium finds other probabilities."""
    plain = small_study(correlation_length=8e-3)
    plain["problem"]["friction"]["residual_ratio"] = 0.8
    plain["random"]["strength"]["marginal"] = {"type": "lognormal", "mean": 1e6, "cv": 0.3}
    one = st.Study.from_dict(plain)
    with pytest.warns(st.AccuracyWarning, match="by equilibrium the probability"):
        computed(tmp_path / "run", 1, one)
    with warnings.catch_warnings():
        warnings.simplefilter("error", st.AccuracyWarning)
        computed(tmp_path / "run", 1, one)


def test_commands_print_export_and_report_its_numbers(runs, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    study().to_toml("study.toml")
    line = f"reliability study.toml --out RUN --smallest {SMALLEST}"
    runs(f"{line} --repetitions 1 --part 1/3", "part 1/3: 1 of 3 repetitions in RUN")
    runs("status RUN --parts 3", "1 of 3", "missing     parts 2/3, 3/3")
    printed = runs(f"{line} --repetitions 2", "6 of 6 repetitions in RUN")
    found = st.open_run("RUN").dataset()
    last = found.isel(correlation_length=2, point=-1)
    row = printed.splitlines()[-2].split()
    assert "stress (Pa)" in printed
    assert float(row[0]) == 5e-3
    assert float(row[2]) == pytest.approx(float(last.stress), rel=1e-6)
    assert float(row[4]) == pytest.approx(float(last.probability), rel=1e-6)
    runs("export RUN curve.csv")
    table = np.genfromtxt("curve.csv", delimiter=",", names=True)
    np.testing.assert_array_equal(table["stress_Pa"], found.stress.values.ravel())
    runs("report RUN")
    page = (tmp_path / "RUN" / "report.html").read_text(encoding="utf-8")
    assert "6 of 6 repetitions by local criterion" in page
    cells = re.findall(r"<td[^>]*>([^<]+)</td>", page)
    assert f"{float(last.stress):.5g}" in cells
    assert page.count("data:image/png") == 3
