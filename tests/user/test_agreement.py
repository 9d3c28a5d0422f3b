"""Agreement of measured peaks with a prediction, and interfaces that are equally likely."""

import itertools

import numpy as np
import pytest
import scipy.stats
import xarray as xr
from refusals import refuses
from setups import LOCAL

import stiction as st

PEAKS = np.array([0.71, 0.69, 0.75, 0.68, 0.71]) * 1e6  # Pa, two of them equal


def predicted(values):
    return xr.Dataset({"critical_stress": ("sample", np.asarray(values, dtype=float))})


def test_p_values_are_those_of_all_permutations():
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
    found = st.statistics.agreement(predicted(others), own, replicates=8000)
    ((at, share),) = found.predicted
    assert share[[0, 3, -1]] == pytest.approx([1 / 6, 3 / 6, 1.0])  # up to 1, 4 and 9
    assert np.interp(6.0, at, share) == pytest.approx(4.5 / 6)  # 4 of 6 up to 5, and 5 up to 7
    assert (found.cramer_von_mises, found.largest_deviation) == pytest.approx(tuple(here))
    error = np.sqrt(exact * (1.0 - exact) / 8000)
    assert np.all(np.abs(np.array(list(found.p_values.values())) - exact) < 4.0 * error + 2e-4)


@pytest.fixture(scope="module")
def posterior():
    problem = st.paper.problem(nodes=256)
    strength = st.paper.strength(problem, correlation_ratio=0.5)
    prior = {"marginal.low": (0.5e6, 0.8e6)}
    return st.infer(problem, strength, PEAKS, prior=prior, method=LOCAL, samples=300)


def test_peaks_are_in_the_unit_of_those_of_the_posterior(posterior):
    refuses(
        "peaks in Pa, got ... in N", lambda: st.statistics.agreement(posterior, PEAKS, unit="N")
    )


def test_further_peaks_are_compared_with_what_the_posterior_leaves_open(posterior):
    refuses("was fitted to them", lambda: st.statistics.agreement(posterior, PEAKS[::-1]))
    further = st.statistics.agreement(posterior, PEAKS + 1.0, replicates=300)
    assert 0.2 < further.p_values["cramer_von_mises"] <= 1.0
    # A thousand draws predict what the posterior's 4,000 do: both are farther from their law than
    # 0.06 once in a thousand times.
    at, share = further.predicted[0]
    drawn = np.searchsorted(np.sort(posterior.predicted[0]), at, side="right") / 4000
    assert np.abs(drawn - share).max() < 0.06
    # As uncertain as a posterior of few peaks is, campaigns differ more than peaks of all draws.
    known = scipy.stats.kstwo(PEAKS.size).ppf(0.9) * PEAKS.size**0.5
    assert further.band > 1.05 * known
    far = st.statistics.agreement(posterior, 1.08 * PEAKS, replicates=300)
    assert max(far.p_values.values()) < 0.1


def test_likely_interfaces_scatter_as_the_posterior_does(posterior):
    lows = [one.strength.marginal.low for one in posterior.interfaces(400, seed=3)]
    low, high = posterior.interval("marginal.low")
    assert np.mean((np.array(lows) > low) & (np.array(lows) < high)) == pytest.approx(
        0.9, abs=0.06
    )
    assert posterior.interfaces(400, seed=4)[1].strength.marginal.low != lows[1]


def test_likely_interfaces_of_a_fit_scatter_as_its_intervals_do():
    truth = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3))
    interface = st.Interface(length=0.05, nodes=500)
    levels = np.array([[0.7], [1.0], [1.35], [1.1]])  # of specimens
    fit = st.fit_field(
        truth.sample(interface, seed=2, samples=4) * levels, interface, marginal="lognormal",
        spectrum="exponential", noise=0.0, bootstrap=40, between=True,
    )  # fmt: skip
    some = fit.interfaces(40, seed=1)
    means = np.array([one.strength.mean for one in some])
    low, high = fit.interval["marginal.cv"]
    cvs = np.array([one.strength.marginal.cv for one in some])
    assert 0.75 <= np.mean((cvs >= low) & (cvs <= high)) <= 1.0
    assert means.std() > 0.0
    factors = {round(one.between["strength"].cv, 6) for one in some}
    assert len(factors) > 10
