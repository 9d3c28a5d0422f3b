"""The page of a design: its numbers, inputs, evidence and doubts, from Python and a command."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from joint import GIVEN, PROBLEM, RANDOM
from refusals import refuses
from scipy.stats import norm
from setups import ensemble

import stiction as st
from stiction.cli.commands import app

KEY = "problem.load.normal_pressure"


def make(**tables):
    return st.Study(
        problem=PROBLEM, method=GIVEN["method"], ensemble=st.Ensemble(samples=1),
        reliability={"probability": 1e-1, "target_cv": 0.3}, **tables,
    )  # fmt: skip


def test_a_page_of_a_design(tmp_path):
    """Characteristic value and partial factor by hand, where interfaces differ in the mean."""
    design = st.design_stress(PROBLEM, RANDOM, probability=1e-3, sensitivities=True, **GIVEN)
    assert design.reliability_index == pytest.approx(-norm.ppf(1e-3))
    inner = ensemble(
        PROBLEM, RANDOM.strength, 5000, method=GIVEN["method"]
    ).critical_stress.values
    law = RANDOM.between["strength"].distribution
    levels = np.linspace(0.6e6, 0.9e6, 301)
    below = [law.cdf(level / inner).mean() for level in levels]
    # A single interface: the confidence does not count.
    right = np.interp(0.05, below, levels)
    assert design.characteristic_stress == pytest.approx(right, rel=0.01)
    assert design.partial_factor == design.characteristic_stress / design.stress > 1.0
    source = {"load.normal_pressure": "drawing 12", "solid.youngs_modulus": "certificate 8"}
    evidence = [st.Lognormal(mean=1.0, cv=0.1)]
    path = st.write_design_page(
        design, tmp_path / "design.html", problem=PROBLEM, evidence=evidence, sources=source,
        title="Lap joint 7",
    )  # fmt: skip
    text = path.read_text(encoding="utf-8")
    for words in (
        "Lap joint 7", "reliability index", f"{design.partial_factor:.3g}", "drawing 12",
        "assumed", "Evidence: Lognormal", KEY, "size: A4", "data:image/png",
    ):  # fmt: skip
        assert words in text, words
    assert text.count("certificate 8") == 2  # of both moduli
    assert f"{PROBLEM.solid.youngs_modulus:.5g}" in text
    refuses(
        "sources: ... load.weight ... is not an input",
        lambda: st.write_design_page(
            design, path, problem=PROBLEM, sources={"load.weight": "scales"}
        ),
    )
    demand = st.failure_probability(PROBLEM, RANDOM, 0.7e6, **GIVEN)
    refuses(
        "design: must come from st.design_stress",
        lambda: st.write_design_page(demand, path, problem=PROBLEM),
    )
    # More confidence asks for less: where means differ by 5 %, 95 % of them exceed it.
    means = 0.2 * np.exp(0.05 * norm.ppf((np.arange(40) + 0.5) / 40))
    likely = [
        st.RandomInterface(
            strength=st.RandomField(
                st.Gamma(mean=mean, cv=0.15), RANDOM.strength.spectrum, of="friction_coefficient",
                mean_mode=True,
            ),
            between=RANDOM.between,
        )
        for mean in means
    ]  # fmt: skip
    bold, careful = (
        st.design_stress(PROBLEM, likely, probability=1e-2, confidence=share, **GIVEN)
        for share in (0.5, 0.95)
    )
    ratio = careful.characteristic_stress / bold.characteristic_stress
    assert np.log(ratio) == pytest.approx(-0.05 * norm.ppf(0.95), abs=0.03)


def test_the_command_writes_the_page(tmp_path):
    study = make(random=RANDOM, title="Joint A")
    study.to_toml(tmp_path / "study.toml")
    page = tmp_path / "out.html"
    app(
        ["reliability", str(tmp_path / "study.toml"), "--page", str(page)],
        standalone_mode=False,
    )
    assert "Joint A" in page.read_text(encoding="utf-8")


def test_the_command_makes_constants_uncertain(tmp_path, capsys):
    """As the table of a study does, to the digit."""
    table = {KEY: {"low": 4e6, "high": 6e6}, "count": 40}
    study = make(random=RANDOM)
    path = tmp_path / "study.toml"
    study.to_toml(path)

    def command(*lines):
        options = [word for line in lines for word in ("--uncertain", line)]
        app(["reliability", str(path), *options], standalone_mode=False)
        return capsys.readouterr().out

    printed = command(f"{KEY} = [4e6, 6e6]", "count = 40")
    wanted = replace(study, uncertain=table)
    assert printed.startswith(str(wanted.reliability.answer(wanted.experiments[0])))
    refuses("--uncertain: must be a line of TOML", lambda: command(KEY))
    refuses(
        "uncertain: problem.load: unknown 'weight'",
        lambda: command("problem.load.weight = [1, 2]"),
    )


def test_a_posterior_and_peaks_are_stored_with_a_study(tmp_path, capsys, monkeypatch):
    """The file beside the study holds the same interfaces, and a file of peaks is compared."""
    monkeypatch.setattr("stiction.study.study.FIRST_MEMBERS", 20)
    source = st.uncertain(RANDOM, {"strength.marginal.mean": (0.19, 0.21)})
    refuses("give them as uncertain=", lambda: make(random=source))
    plain = SimpleNamespace(interfaces=source.interfaces)

    study = make(random=plain, peaks=np.array([0.7, 0.72, 0.9]) * 1e6)
    study.to_toml(tmp_path / "study.toml")
    text = (tmp_path / "study.toml").read_text()
    assert 'random = "study.random.json"' in text
    again = st.Study.from_toml(tmp_path / "study.toml")
    assert again.random == source.interfaces(20)
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
    refuses(
        "random: ... is not valid JSON", lambda: st.Study.from_toml(tmp_path / "study.toml")
    )
