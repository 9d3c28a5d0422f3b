"""Inference as a user meets it: what is handed to libraries of others, forces, interruptions."""

import dataclasses
import itertools
import runpy
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from refusals import refuses, warning_texts
from setups import LOCAL, make_problem

import stiction as st

PROBLEM = st.paper.problem(nodes=256)
H_N = PROBLEM.nucleation_length
STRENGTH = st.paper.strength(PROBLEM, correlation_ratio=0.6)
PRIOR = {
    "correlation_length": {"low": 0.25 * H_N, "high": 4.0 * H_N, "spacing": "log"},
    "marginal.low": (0.4e6, 0.9e6),
    "marginal.high": (1.2e6, 2.2e6),
}
LOW = {"marginal.low": (0.4e6, 0.9e6)}
THIRTY = {"method": LOCAL, "samples": 30, "seed": 99}
PEAKS = st.monte_carlo(PROBLEM, STRENGTH, **THIRTY, pilot=False).critical_stress.values


def infer(peaks=PEAKS, problem=PROBLEM, random=STRENGTH, prior=LOW, **options):
    options = {"method": LOCAL, "samples": 400, "unit": "Pa"} | options
    return st.infer(problem, random, peaks, prior=prior, **options)


def test_doubts_are_named_where_the_caller_stands():
    with pytest.warns(st.AccuracyWarning, match="upper end of marginal.low, 640000") as caught:
        infer(prior={"marginal.low": (0.4e6, 0.64e6)})
    assert {one.filename for one in caught} == {__file__}


def test_p_values_of_agreement_are_those_of_all_permutations():
    """Of three peaks and six predicted ones, by hand: Cramer-von Mises over all 84 choices."""
    own, others = np.array([3.0, 8.0, 9.0]), np.array([1.0, 2.0, 4.0, 5.0, 8.0, 7.0])
    every = np.concatenate([own, others])

    def distance(chosen):
        rest = np.setdiff1d(np.arange(9), chosen)
        steps = [
            np.mean(every[list(some)][:, None] <= every, axis=0) for some in (chosen, rest)
        ]
        away = steps[0] - steps[1]
        return np.mean(away**2) * 3, np.abs(away).max() * np.sqrt(3)

    all_of_them = np.array([distance(np.array(c)) for c in itertools.combinations(range(9), 3)])
    here = np.array(distance(np.arange(3)))
    exact = np.mean(all_of_them >= here * (1 - 1e-9), axis=0)
    predicted = xr.Dataset({"critical_stress": ("sample", others)})
    found = st.statistics.agreement(predicted, own, unit="Pa", replicates=8000)
    ((at, share),) = found.predicted
    assert share[[0, 3, -1]] == pytest.approx([1 / 6, 3 / 6, 1.0])  # up to 1, 4 and 9
    assert np.interp(6.0, at, share) == pytest.approx(4.5 / 6)  # 4 of 6 up to 5, and 5 up to 7
    assert (found.cramer_von_mises, found.largest_deviation) == pytest.approx(tuple(here))
    error = np.sqrt(exact * (1.0 - exact) / 8000)
    assert np.all(np.abs(np.array(list(found.p_values.values())) - exact) < 4.0 * error + 2e-4)


def test_forces_need_an_area_that_the_prior_leaves_alone():
    interface = dataclasses.replace(PROBLEM.interface, width=0.01)
    wide = dataclasses.replace(PROBLEM, interface=interface)
    prior = {"problem.interface.width": (0.008, 0.012)}
    forces = PEAKS * wide.area
    refuses(
        "the area varies over the prior, 0.0008 to 0.0012 m2",
        lambda: infer(forces, wide, prior=prior, unit="N"),
    )
    found = infer(forces, wide, unit="N")
    low, high = found.interval["marginal.low"]
    assert low < 0.66e6 < high


EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture
def example(monkeypatch, tmp_path):
    """Run an example in a folder of its own."""
    monkeypatch.chdir(tmp_path)
    return lambda name: runpy.run_path(str(EXAMPLES / f"{name}.py"))


def test_openturns_works_on_the_limit_state(example, capsys):
    pytest.importorskip("openturns")
    found = example("outside_openturns")
    theirs, own = found["found"], found["own"]
    error = np.hypot(theirs.getCoefficientOfVariation(), own.cv)
    ratio = theirs.getProbabilityEstimate() / own.probability
    assert abs(np.log(ratio)) < 4.0 * error  # joint standard errors
    assert "OpenTURNS" in capsys.readouterr().out


@pytest.mark.slow
def test_dynesty_finds_the_same_posterior(example):
    """Another sampler, likelihood and no scaling: 60 live points, two minutes."""
    pytest.importorskip("dynesty")
    found = example("outside_dynesty")
    for i, name in enumerate(found["names"]):
        own = found["posterior"].draws[name].ravel()
        # Sixty live points leave a tenth of the width; two seeds gave 0.04 to 0.11.
        assert abs(found["draws"][:, i].mean() - own.mean()) < 0.3 * own.std(), name
    # Silverman's kernel widens the variance of 1000 peaks by 750^-0.4, which each of the 25 pays.
    # Nested sampling adds sqrt(information / live points), 0.22 here: three of them.
    smoothing = 0.5 * 25 * np.log1p(750.0**-0.4)
    expected = found["posterior"].log_evidence - smoothing
    assert found["evidence"] == pytest.approx(expected, abs=0.66)


@pytest.mark.parametrize(
    ("unit", "force", "refused"),
    [("N", 117e3, False), ("MN", 117e3, True), ("kN", 117.0, True)],
)
def test_peaks_of_whole_specimens_in_a_wrong_unit_are_doubted(unit, force, refused):
    problem = make_problem(
        256, 0.173, width=0.023, load=st.Load(pressing_force=force), weakening_rate=1e11
    )
    options = {"unit": unit, "between": "normal", "progress": False}
    raised = pytest.raises(st.InputError, match="times the normal pressure")
    doubted = pytest.warns(st.UnitWarning, match="times the normal pressure")
    with raised if refused else doubted:
        st.infer(problem, None, [27.3, 29.1, 25.8, 31.4], **options)


def test_forces_on_a_part_that_breaks_are_doubted_once():
    solid = st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0)
    problem = st.Problem(
        solid, st.Interface(0.1, 256, extent=(0.02, 0.09)),
        st.LinearWeakening(weakening_rate=0.2e12), st.Load(normal_pressure=2e6),
        specimen=st.Blocks(height=0.05, thickness=0.01),
    )  # fmt: skip
    peaks, options = [810.0, 850.0, 790.0], {"unit": "N", "between": "normal"}
    texts = warning_texts(lambda: st.infer(problem, None, peaks, progress=False, **options))
    assert sum("force on the part that can break" in text for text in texts) == 1
