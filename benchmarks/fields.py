"""Sampling a field, beside a direct sum of cosines with scipy's quantile, and beside GSTools.

Floor: 2J normal draws, one real transform of n points and n look-ups a sample.
Run: ``python benchmarks/fields.py`` (GSTools is in the extra ``test``).
"""

import gstools
import numpy as np
from scipy.special import ndtr
from timing import median_time, row

import stiction as st

NODES, BATCH = 1024, 1024


def direct_sum(strength, interface, draws):
    """z by its definition, the marginal by scipy."""
    sigma = strength.modes(interface).sigma[1:]
    phase = 2.0 * np.pi * np.outer(np.arange(1, sigma.size + 1), interface.x) / interface.length
    z = (draws[:, 0::2] * sigma) @ np.cos(phase) + (draws[:, 1::2] * sigma) @ np.sin(phase)
    return strength.marginal.distribution.ppf(ndtr(z))


def main():
    problem = st.paper.problem(nodes=NODES)
    interface = problem.interface
    print("field samples, n = 1024, one core; us a sample")
    for ratio in (0.25, 0.5, 1.0, 2.0):
        strength = st.paper.strength(problem, correlation_ratio=ratio)
        ours = median_time(lambda s=strength: s.sample(interface, samples=BATCH, seed=0)) / BATCH
        draws = strength.draws(interface, 32, seed=0)
        plain = median_time(lambda s=strength, d=draws: direct_sum(s, interface, d), 3) / 32
        # GSTools samples the Gaussian field only; its Fourier method is its fastest.
        lam = 2.0 * np.pi / strength.spectrum.correlation_length
        model = gstools.Matern(dim=1, nu=3.5, len_scale=np.sqrt(3.5) / lam)
        other = gstools.SRF(model, generator="Fourier", period=[0.1], mode_no=[2 * 300])
        seeds = iter(range(10_000))
        gs = median_time(lambda o=other, q=seeds: o.structured([interface.x], seed=next(q)), 5)
        row(f"xi_0/h_n = {ratio}", ours, {"direct sum + ppf": plain, "GSTools (z only)": gs})


if __name__ == "__main__":
    main()
