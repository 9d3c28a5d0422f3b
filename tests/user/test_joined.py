"""Mean and scatter between specimens from profiles and peaks: what users give, and get."""

import dataclasses

import numpy as np
import pytest
import scipy.stats
from refusals import refuses
from setups import make_problem
from stand_ins import StandIn

import stiction as st
from stiction.inference.specimens import PRIOR_SCALE

PROBLEM = make_problem(64, 0.05, width=0.013, weakening_rate=0.25e12)
RNG = np.random.default_rng(8)
PEAKS = 1.05e6 * np.exp(0.05 * RNG.standard_normal(9))
LOCAL = {"method": st.LocalCriterion(), "progress": False, "samples": 100}
SPECTRUM = st.PowerLawSpectrum(4e-3)
EVEN = st.RandomField(st.Lognormal(mean=1e6, cv=1e-4), SPECTRUM)
"""Strength that hardly varies within a specimen: the onset is the factor times its mean."""
ROUGH = st.RandomField(st.Gamma(mean=1e6, cv=0.2), SPECTRUM, mean_mode=True)
RECORDS = [
    ROUGH.sample(PROBLEM.interface, seed=number)[0] * factor
    for number, factor in enumerate((1.0, 0.93, 1.08, 1.02, 0.96))
]
QUICK = {"marginal": "gamma", "noise": False, "bootstrap": 20, "progress": False}


def by_hand(peaks, error):
    """Mean and deviation of mean and scatter of log-normal factors, by sums over a fine grid.

    Peaks are known to within an error, Pa.
    """
    cvs = PRIOR_SCALE * np.tan((np.arange(100) + 0.5) / 100 * np.arctan(0.9 / PRIOR_SCALE))
    sigma, m = np.sqrt(np.log1p(cvs**2))[:, None], 1e6 * np.exp(np.linspace(-0.8, 0.8, 161))
    total = np.zeros((cvs.size, m.size))
    z = np.linspace(-6.0, 6.0, 121)
    for peak in peaks:
        onset = m[:, None] * np.exp(sigma[..., None] * z - 0.5 * sigma[..., None] ** 2)
        density = scipy.stats.norm(onset, error).pdf(peak) * scipy.stats.norm.pdf(z)
        total += np.log(np.maximum(np.trapezoid(density, z), 1e-300))
    mass = np.exp(total - total.max())
    mass /= mass.sum()
    found = []
    for values, of in ((m, mass.sum(axis=0)), (cvs, mass.sum(axis=1))):
        mean = of @ values
        found += [mean, np.sqrt(of @ (values - mean) ** 2)]
    return found


def test_tests_alone_give_what_a_sum_by_hand_gives():
    """Within four errors of 4,000 draws; in newtons they are the same as in pascals."""
    error, groups = 3e4, {0.05: PEAKS[:4], 0.075: PEAKS[4:]}
    given = LOCAL | {"between": "lognormal", "load_cell_error": error}
    found = st.infer(PROBLEM, EVEN, groups, unit="Pa", **given)
    mean, spread, scatter, of_scatter = by_hand(PEAKS, error)
    own = found.draws["mean"], found.draws["between"]
    assert own[0].mean() == pytest.approx(mean, abs=0.07 * spread)
    assert own[0].std() == pytest.approx(spread, rel=0.1)  # heavy tails
    assert own[1].mean() == pytest.approx(scatter, abs=0.07 * of_scatter)
    assert own[1].std() == pytest.approx(of_scatter, rel=0.1)
    assert found.families == {"lognormal": pytest.approx(1.0)}
    assert found.agreement is None
    assert "mean" not in found.information  # its prior is flat


@pytest.mark.parametrize("prior", [None, {"marginal.mean": (0.9e6, 1.2e6)}])
def test_forces_say_what_stresses_say(prior):
    """Of specimens of two lengths, alone or with a prior of their field."""
    groups = {0.05: PEAKS[:4], 0.075: PEAKS[4:]}
    forces = {one: 1e-3 * own * one * 0.013 for one, own in groups.items()}
    in_newtons, in_pascals = (
        st.infer(PROBLEM, ROUGH, given, unit=unit, prior=prior, **LOCAL)
        for given, unit in ((forces, "kN"), (groups, "Pa"))
    )
    np.testing.assert_allclose(in_newtons.u, in_pascals.u, rtol=1e-6)
    if prior:  # three tests of a length, whose error is as large as that of stresses
        area, more = 0.075 * 0.013, LOCAL | {"prior": prior, "repetitions": 10}
        more |= {"designs": {"short": {0.05: 2}, "long": {0.075: 3}}}
        long = [
            st.design_of_tests(PROBLEM, ROUGH, unit=unit, load_cell_error=error, **more)
            .information.sel(design="long")
            for unit, error in (("kN", 1e-3 * 3e4 * area), ("Pa", 3e4))
        ]  # fmt: skip
        np.testing.assert_allclose(*long, rtol=1e-6)


def test_five_strengths_give_what_proportion_gives(monkeypatch):
    """The longer way, on a problem where both are possible; onsets by samples of the same draws."""
    given = LOCAL | {"samples": 200}
    short = st.infer(PROBLEM, ROUGH, 0.8 * PEAKS, unit="Pa", **given)
    monkeypatch.setattr("stiction.inference.specimens.scales_with_strength", lambda *_: False)
    long = st.infer(PROBLEM, ROUGH, 0.8 * PEAKS, unit="Pa", **given)
    assert long.likelihood.onsets[0].ratios.shape == (1, 5, 200)
    for name in ("mean", "between"):
        assert long.mean[name] == pytest.approx(short.mean[name], rel=5e-3)
    np.testing.assert_allclose(np.mean(long.predicted), np.mean(short.predicted), rtol=5e-3)


def test_an_onset_that_is_not_in_proportion_is_interpolated():
    """With a critical slip the weakening rate grows with the strength: R falls with c."""
    friction = st.LinearWeakening(critical_slip=4e-6)
    problem = dataclasses.replace(PROBLEM, friction=friction)
    given = LOCAL | {"method": st.Equilibrium(), "samples": 100}
    found = st.infer(problem, ROUGH, 0.8 * PEAKS, unit="Pa", **given)
    onsets = found.likelihood.onsets[0]
    x = 0.5 * (onsets.at[1] + onsets.at[2])
    between = np.exp(0.5 * np.log(onsets.ratios[0, 1:3]).sum(axis=0))
    strength = dataclasses.replace(ROUGH, marginal=st.Gamma(mean=1e6 * np.exp(x), cv=0.2))
    exact = st.monte_carlo(problem, strength, **given).critical_stress / np.exp(x)
    assert np.ptp(onsets.ratios.mean(axis=2)) > 1e3
    # Five strengths over more than a factor of three: sample by sample, and on average.
    np.testing.assert_allclose(between, exact, rtol=2e-2)
    assert between.mean() == pytest.approx(float(exact.mean()), rel=2e-3)


def test_profiles_and_peaks_are_joined():
    fit = st.fit_field(RECORDS, PROBLEM.interface, between=True, **QUICK)
    onsets = st.monte_carlo(PROBLEM, ROUGH, seed=3, **LOCAL | {"samples": 9})
    peaks = onsets.critical_stress.values * (PEAKS / 1.05e6)
    both = st.infer(PROBLEM, fit, peaks, unit="Pa", **LOCAL)
    alone = st.infer(PROBLEM, ROUGH, peaks, unit="Pa", between="lognormal", **LOCAL)
    assert np.ptp(both.interval["mean"]) < np.ptp(alone.interval["mean"])
    assert np.ptp(both.interval["mean"]) < np.ptp(fit.interval["mean"])
    assert min(both.agreement.p_values.values()) > 0.05
    assert not both.notes
    assert sum(both.families.values()) == pytest.approx(1.0)
    assert f"p = {min(both.agreement.p_values.values()):.2g}" in str(both)
    families = [one.between["strength"].type for one in both.interfaces(200)]
    assert {*families} == {"lognormal", "weibull", "truncated_normal"}
    assert families.count("lognormal") == pytest.approx(
        200 * both.families["lognormal"], abs=28
    )
    with pytest.warns(st.AccuracyWarning, match="contradict the prediction, p = 0.0"):
        apart = st.infer(PROBLEM, fit, 1.5 * peaks, unit="Pa", between="lognormal", **LOCAL)
    assert any("contradict" in note for note in apart.notes)
    # A design repeats the doubts.
    design = st.design_stress(
        PROBLEM, apart, probability=0.1, method=st.LocalCriterion(), target_cv=0.5,
        sensitivities=False, progress=False,
    )  # fmt: skip
    assert design.doubts == apart.notes
    assert apart.notes[0] in str(design)
    assert design.specimens == len(RECORDS) + len(peaks)
    # The prior of the scatter decides where it is narrow, and that of the mean.
    prior = {"between": (0.2, 0.21), "mean": scipy.stats.norm(1.2e6, 1e3)}
    more = {"prior": prior, "between": ["weibull"], "seed": 3}
    told = st.infer(PROBLEM, fit, peaks, unit="Pa", **more, **LOCAL)
    assert told.grid.profiles.fields == fit.profiles(60, 3).fields
    assert 0.2 < told.mean["between"] < 0.21
    assert told.mean["mean"] == pytest.approx(1.2e6, rel=3e-3)
    assert {*told.families} == {"weibull"}
    refuses("State the unit", lambda: st.infer(PROBLEM, fit, 1e-6 * peaks, unit="Pa", **LOCAL))


def test_a_single_specimen_leaves_the_scatter_to_its_prior():
    with pytest.warns(st.AccuracyWarning, match="mostly from the prior.* not 1"):
        fit = st.fit_field(RECORDS[:1], PROBLEM.interface, between=True, **QUICK)
    # The median of a half-Cauchy prior below 0.9.
    median = PRIOR_SCALE * np.tan(0.5 * np.arctan(0.9 / PRIOR_SCALE))
    assert fit.parameters["between"] == pytest.approx(median, rel=0.1)
    with pytest.warns(st.AccuracyWarning, match="profiles come from one specimen"):
        both = st.infer(PROBLEM, fit, PEAKS, unit="Pa", **LOCAL)
    assert len(both.notes) == 1  # nine tests say more about the scatter than three
    with pytest.warns(st.AccuracyWarning, match="say little about the scatter"):
        st.infer(PROBLEM, ROUGH, PEAKS[:3], unit="Pa", between="lognormal", **LOCAL)


@pytest.mark.parametrize("share", [0.2, 0.45])
def test_a_guide_that_hardly_correlates_is_not_used(share, monkeypatch):
    """Correlations of 0.1 to 0.8: the onsets are those of a simulation at every node."""

    def mixed(rows, stress):
        """A share of the local onset, and the strength at one node for the rest."""
        return share * stress + (1.0 - share) * 0.8 * rows.strength[:, 5]

    peaks = np.array([0.78e6, 0.83e6, 0.8e6, 0.86e6])
    given = LOCAL | {"prior": {"correlation_length": (2e-3, 6e-3)}, "method": StandIn(mixed)}
    guided = st.infer(PROBLEM, ROUGH, peaks, unit="Pa", **given)
    options = {"samples": 300, "progress": False, "pilot": False}
    onsets = [
        st.monte_carlo(PROBLEM, ROUGH, method=method, **options).critical_stress.values
        for method in (StandIn(mixed), st.LocalCriterion())
    ]
    alike = np.corrcoef(*onsets)[0, 1]
    assert 0.1 < alike < 0.8
    monkeypatch.setattr(st.LocalCriterion, "unfit_as_guide", lambda *_: "no guide")
    alone = st.infer(PROBLEM, ROUGH, peaks, unit="Pa", **given)
    for one, other in zip(guided.likelihood.densities, alone.likelihood.densities, strict=True):
        assert one.onsets.shape == other.onsets.shape
    length = alone.mean["correlation_length"]
    assert guided.mean["correlation_length"] == pytest.approx(length, rel=1e-6)
