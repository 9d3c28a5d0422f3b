"""Designs: factors between specimens, what moves a design, and its page."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest
from joint import FIELD, GIVEN, PROBLEM, RANDOM
from refusals import refuses
from scipy.stats import norm
from setups import LOCAL, ensemble

import stiction as st
from stiction.cli.commands import app

FACTOR = st.Lognormal(mean=1.0, cv=0.1)
PRESSED = dataclasses.replace(PROBLEM, load=st.Load(pressing_force=5e6 * PROBLEM.area))


def of_mean(mean):
    """The random interface of the joint with another mean."""
    field = dataclasses.replace(FIELD, marginal=st.Gamma(mean=mean, cv=0.15))
    return dataclasses.replace(RANDOM, strength=field)


def test_the_probability_of_a_coefficient_is_over_the_force_of_each_specimen():
    random = st.RandomInterface(
        strength=FIELD, between={"strength": FACTOR, "pressing_force": FACTOR}
    )
    found = st.failure_probability(PRESSED, random, friction_coefficient=0.14, **GIVEN)
    assert "specimens of each sample" in found.reason
    alone = st.RandomInterface(strength=FIELD, between={"strength": FACTOR})
    exact = st.failure_probability(PRESSED, alone, friction_coefficient=0.14, **GIVEN)
    error = 3.0 * np.hypot(found.cv, exact.cv)
    assert np.log(found.probability / exact.probability) == pytest.approx(0.0, abs=error)


def test_members_may_have_different_factors():
    likely = [
        st.RandomInterface(strength=FIELD),
        st.RandomInterface(strength=FIELD, between={"normal_pressure": FACTOR}),
    ]
    found = ensemble(PROBLEM, likely, 40, seed=3)
    alone = ensemble(PROBLEM, FIELD, 40, seed=3)
    ratios = (found.critical_stress / alone.critical_stress).values
    assert 5 < np.sum(ratios == 1.0) < 35


PRESSURE = "problem.load.normal_pressure"


def test_a_design_is_in_proportion_to_the_pressure():
    """Stated ends count, and common draws make the ratios exact."""
    given = GIVEN | {"probability": 1e-2, "sensitivities": {PRESSURE: (4e6, 8e6)}}
    wide = st.design_stress(PROBLEM, RANDOM, **given)
    ends = wide.sensitivities.sel(source=PRESSURE)
    assert float(ends.stress_at_high / ends.stress_at_low) == pytest.approx(2.0, rel=1e-6)
    assert wide.sensitivities.source.values[0] == PRESSURE  # the widest


def test_a_page_of_a_design(tmp_path):
    """Characteristic value and partial factor by hand, where interfaces differ in the mean."""
    design = st.design_stress(PROBLEM, RANDOM, probability=1e-3, sensitivities=True, **GIVEN)
    inner = ensemble(PROBLEM, RANDOM.strength, 5000).critical_stress.values
    law = RANDOM.between["strength"].distribution
    levels = np.linspace(0.6e6, 0.9e6, 301)
    below = [law.cdf(level / inner).mean() for level in levels]
    # A single interface: the confidence does not count.
    right = np.interp(0.05, below, levels)
    assert design.characteristic_stress == pytest.approx(right, rel=0.01)
    told = {"load.normal_pressure": "drawing 12", "solid.youngs_modulus": "certificate 8"}
    about = {
        "evidence": [st.Lognormal(mean=1.0, cv=0.1)],
        "sources": told,
        "title": "Lap joint 7",
    }
    path = design.write_page(tmp_path / "design.html", **about)
    text = path.read_text(encoding="utf-8")
    for words in (
        "Lap joint 7", "reliability index", f"{design.partial_factor:.6g}", "drawing 12",
        "assumed", "Evidence: Lognormal", PRESSURE, "size: A4", "data:image/png",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("certificate 8") == 2  # of both moduli
    assert f"{PROBLEM.solid.youngs_modulus:.5g}" in text
    # More confidence asks for less: where means differ by 5 %, 95 % of them exceed it.
    means = 0.2 * np.exp(0.05 * norm.ppf((np.arange(40) + 0.5) / 40))
    likely = [of_mean(mean) for mean in means]
    bold, careful = (
        st.design_stress(PROBLEM, likely, probability=1e-2, confidence=share, **GIVEN)
        for share in (0.5, 0.95)
    )
    ratio = careful.characteristic_stress / bold.characteristic_stress
    assert np.log(ratio) == pytest.approx(-0.05 * norm.ppf(0.95), abs=0.03)


def test_a_posterior_and_peaks_are_stored_with_a_study(tmp_path, capsys, monkeypatch):
    """The file beside the study holds the same interfaces, and a file of peaks is compared."""
    monkeypatch.setattr("stiction.study.study.FIRST_MEMBERS", 20)

    def interfaces(count, seed=0):
        return [of_mean(mean) for mean in np.linspace(0.19, 0.21, count)]

    study = st.Study(
        problem=PROBLEM, method=LOCAL, random=SimpleNamespace(interfaces=interfaces), samples=1,
        peaks={"unit": "MPa", "values": [[0.7, 0.72, 0.9]]},
        reliability={"probability": 1e-1, "target_cv": 0.3},
    )  # fmt: skip
    study.to_toml(tmp_path / "study.toml")
    text = (tmp_path / "study.toml").read_text()
    assert 'random = "study.random.json"' in text
    again = st.Study.from_toml(tmp_path / "study.toml")
    assert again.random == interfaces(20)
    np.testing.assert_array_equal(again.peaks.values[0], study.peaks.values[0])
    assert st.Study.from_dict(again.to_dict()).random == again.random
    # The same with a file of peaks, in other units, which lie far above the prediction.
    (tmp_path / "slip.csv").write_text("force [N]\n" + "\n".join(map(str, range(600, 640))))
    named = 'peaks = "slip.csv"\n' + text.partition("[peaks]")[0]
    (tmp_path / "named.toml").write_text(named)
    page = tmp_path / "page.html"
    options = ["reliability", str(tmp_path / "named.toml"), "--page", str(page)]
    app(options, standalone_mode=False)
    assert "40 peaks against the prediction" in capsys.readouterr().out
    assert "the peaks contradict the prediction, p = 0.001" in page.read_text("utf-8")
    (tmp_path / "study.random.json").write_text("[{")
    words = "random: ... is not valid JSON"
    refuses(words, lambda: st.Study.from_toml(tmp_path / "study.toml"))
