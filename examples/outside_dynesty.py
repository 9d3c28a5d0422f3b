"""What do twenty-five peaks reveal, with the nested sampler dynesty?

`st.external.simulator` gives the peaks of tests at given parameters; prior, likelihood and sampler
are the user's own. Nothing of `st.infer` is used, so that the two check each other.
"""

import dataclasses
import functools

import dynesty
import numpy as np
import scipy.stats
from scipy.special import logsumexp

import stiction as st

problem = dataclasses.replace(
    st.paper.problem(nodes=512), interface=st.Interface(length=0.05, nodes=256)
)
strength = st.paper.strength(problem, correlation_ratio=1.0)
h_n = problem.nucleation_length
names = ("correlation_length", "marginal.low")
prior = {names[0]: {"low": 0.5 * h_n, "high": 2.0 * h_n, "spacing": "log"},
         names[1]: (0.5e6, 0.8e6)}  # fmt: skip
method, error = st.LocalCriterion(), 1e4
simulator = functools.partial(st.external.simulator, problem, strength, names, method=method)
peaks = simulator(samples=25, seed=7, load_cell_error=error)((h_n, 0.66e6))
simulate = simulator(samples=1000, seed=0)


def transform(u: np.ndarray) -> np.ndarray:
    """From the unit square to the parameters."""
    return np.array([0.5 * h_n * 4.0 ** u[0], 0.5e6 + 0.3e6 * u[1]])


def log_likelihood(theta: np.ndarray) -> float:
    """A kernel density of simulated peaks with the load cell's error."""
    onsets = simulate(theta)
    density = scipy.stats.gaussian_kde(onsets, "silverman")
    width = np.hypot(np.sqrt(density.covariance[0, 0]), error)
    each = scipy.stats.norm.logpdf(peaks[:, None], onsets, width)
    return float(np.sum(logsumexp(each, axis=1) - np.log(onsets.size)))


sampler = dynesty.NestedSampler(
    log_likelihood, transform, 2, nlive=60, rstate=np.random.default_rng(1)
)
sampler.run_nested(dlogz=0.5, print_progress=False)
draws = sampler.results.samples_equal(np.random.default_rng(2))
posterior = st.infer(
    problem, strength, peaks, unit="Pa", prior=prior, method=method, load_cell_error=error
)
for i, name in enumerate(names):
    low, high = np.quantile(draws[:, i], [0.05, 0.95])
    own = posterior.interval[name]
    print(f"{name}: dynesty {low:.4g} to {high:.4g}, infer {own[0]:.4g} to {own[1]:.4g}")
evidence = float(sampler.results.logz[-1])
print(f"log-evidence: dynesty {evidence:.2f}, infer {posterior.log_evidence:.2f}")
