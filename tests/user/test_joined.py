"""Equally likely interfaces, such as those of a fit, weighed by the peaks of tests."""

import dataclasses

import numpy as np
import pytest
import scipy.stats
from refusals import refuses

import stiction as st
from stiction.inference import joined as joining

PROBLEM = st.Problem(
    st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    st.Interface(0.05, 64, width=0.013),
    st.LinearWeakening(weakening_rate=0.25e12),
)
RNG = np.random.default_rng(8)
MEANS, SCATTER = RNG.normal(1.03e6, 4e4, 20), RNG.uniform(0.03, 0.09, 20)
PEAKS = 1.05e6 * np.exp(0.05 * RNG.standard_normal(9))
LOCAL = {"method": st.LocalCriterion(), "progress": False}


def even(mean, cv):
    """Strength that hardly varies within a specimen: the onset is that of the factor."""
    marginal = st.Lognormal(mean=mean, cv=1e-4)
    field = st.RandomField(marginal, st.PowerLawSpectrum(4e-3))
    return st.RandomInterface(
        strength=field, between={"strength": st.Lognormal(mean=1.0, cv=cv)}
    )


LIST = [even(*pair) for pair in zip(MEANS, SCATTER, strict=True)]


def chances(peaks, error):
    """Return the closed logarithm of the likelihood for each interface of the list."""
    z = np.linspace(-7.0, 7.0, 1401)
    found = []
    for mean, cv in zip(MEANS, SCATTER, strict=True):
        sigma = np.sqrt(np.log1p(cv**2))
        if error:
            onset = mean * np.exp(sigma * z - 0.5 * sigma**2)
            density = scipy.stats.norm(onset, error).pdf(peaks[:, None])
            found.append(np.log(np.trapezoid(density * scipy.stats.norm.pdf(z), z)).sum())
        else:
            law = scipy.stats.lognorm(sigma, scale=mean * np.exp(-0.5 * sigma**2))
            found.append(law.logpdf(peaks).sum())
    return np.array(found)


@pytest.mark.parametrize(("lengths", "error"), [((0.05,), 0.0), ((0.05, 0.075), 3e4)])
def test_weights_are_those_of_closed_likelihoods(lengths, error):
    """Within three errors of 1000 samples; in newtons they are the same as in pascals."""
    groups = dict(zip(lengths, np.split(PEAKS, [4] if len(lengths) > 1 else []), strict=True))
    options = LOCAL | {"samples": 1000}
    found = st.infer(PROBLEM, LIST, groups, load_cell_error=error, **options)
    exact = chances(PEAKS, error)
    own = found.likelihood(found.prior.u(np.arange(20.0)[:, None]))
    near = exact > exact.max() - 4.0
    assert near.sum() > 4
    assert np.abs(own - exact)[near].max() < 0.7
    weight = np.exp(exact - exact.max())
    shift = found.log_evidence - (exact.max() + np.log(weight.mean()))
    weight /= weight.sum()
    names = "strength.mean", "between.strength"
    for name, values in zip(names, (MEANS, SCATTER), strict=True):
        mean = weight @ values
        spread = np.sqrt(weight @ (values - mean) ** 2)
        assert abs(found.mean(name) - mean) < 0.3 * spread
        assert found.draws[name].std() == pytest.approx(spread, rel=0.15)
        assert found.mean(name) == pytest.approx(found.draws[name].mean())
    assert abs(shift) < 0.3
    assert found.information["member"] == pytest.approx(
        np.log(20.0) + weight @ np.log(weight), abs=0.15
    )
    assert 0.0 < found.information["strength.mean"] < found.information["member"] + 1e-9
    if len(lengths) > 1:
        forces = {one: 1e-3 * own * one * 0.013 for one, own in groups.items()}
        quick = LOCAL | {"samples": 100}
        exact_forces = st.infer(PROBLEM, LIST, forces, unit="kN", **quick)
        again = st.infer(PROBLEM, LIST, groups, **quick)
        np.testing.assert_array_equal(exact_forces.u, again.u)


def test_members_are_solved_by_the_method_itself():
    """Not moved from the local criterion by what others need, which differs by five per cent."""
    friction = st.LinearWeakening(weakening_rate=0.25e12, residual_ratio=0.7)
    problem = dataclasses.replace(PROBLEM, friction=friction)
    many = [
        st.RandomInterface(
            strength=st.RandomField(st.Gamma(mean=1e6, cv=cv), st.PowerLawSpectrum(4e-3), True),
            between={"strength": st.Lognormal(mean=1.0, cv=scatter)},
        )
        for cv, scatter in zip((0.1, 0.2, 0.3, 0.1, 0.3, 0.2, 0.1), SCATTER, strict=False)
    ]
    exact = st.Equilibrium()
    found = st.infer(problem, many, 0.8 * PEAKS, method=exact, samples=100, progress=False)
    for one, onsets in zip(many, found.likelihood.densities[0].onsets, strict=True):
        own = st.monte_carlo(problem, one, method=exact, samples=100, progress=False)
        np.testing.assert_allclose(onsets, own.critical_stress, rtol=1e-9)


def test_peaks_that_contradict_the_list():
    refuses(
        "contradict the interfaces ... p = 0.001",
        lambda: st.infer(PROBLEM, LIST, 1.3 * PEAKS, samples=200, **LOCAL),
    )
    with pytest.warns(st.AccuracyWarning, match="the peaks contradict .* p = 0.0"):
        found = st.infer(PROBLEM, LIST, 1.12 * PEAKS, samples=200, **LOCAL)
    assert any("contradict" in note for note in found.notes)
    refuses(
        "about 1.05 Pa, predictions",
        lambda: st.infer(PROBLEM, LIST, 1e-6 * PEAKS, samples=200, **LOCAL),
    )


class Source:
    """Draws interfaces like those of the list, perhaps no more than some, and counts them."""

    def __init__(self, some=None):
        self.some = some

    def interfaces(self, count, seed=0):
        self.count = count
        if self.some:
            return [self.some[number % len(self.some)] for number in range(count)]
        rng = np.random.default_rng(seed)
        return [even(mean, 0.02) for mean in rng.normal(1.03e6, 6e4, count)]


def test_more_are_drawn_from_a_source_where_few_keep_weight(monkeypatch):
    monkeypatch.setattr(joining, "FIRST", 20)
    monkeypatch.setattr(joining, "MOST", 70)
    source = Source()
    with pytest.warns(st.AccuracyWarning, match="weight of only .* give more `bootstrap`"):
        found = st.infer(PROBLEM, source, 1.04 * PEAKS, samples=100, **LOCAL)
    assert source.count == 70
    assert found.prior.cells == source.count
    # Those that are drawn again and again are worth one.
    source = Source(LIST[:6])
    with pytest.warns(st.AccuracyWarning, match="weight of only .* of 6 interfaces; give more"):
        many = st.infer(PROBLEM, source, PEAKS, samples=100, **LOCAL)
    assert source.count <= 10 * joining.FIRST
    assert many.prior.cells == joining.FIRST
    once = st.infer(PROBLEM, LIST[:6], PEAKS, samples=100, **LOCAL)
    assert many.notes[0] == once.notes[0]
