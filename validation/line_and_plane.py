"""How much does the interaction of slip patches lower the onset, on a line and on a plane?

Prints the table of docs/guide/planes-and-ends.md, a cell as soon as it is computed: by how much the
exact onset lies below the local criterion, and in brackets the part of slip farther away than
1.25 h_n, by an onset with slip allowed near the critical patch only.

Run: ``python validation/line_and_plane.py [SAMPLES]``: at most so many at each point; all take
about a quarter of an hour on one core.
"""

import sys

import numpy as np

import stiction as st

RATIOS = (0.25, 0.5, 1.0, 2.0)  # xi_0/h_n
SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
FRICTION = st.LinearWeakening(weakening_rate=0.5e12)
LENGTH = st.Problem(SOLID, st.Interface(length=0.1, nodes=512), FRICTION).nucleation_length
CASES = {  # size in h_n, nodes in h_n, samples; those of one kind and size have the same draws
    "line, 16 h_n": (16, 32, 10_000),
    "line, 64 h_n": (64, 32, 10_000),
    "plane, 4 h_n": (4, 16, 1000),
    "plane, 8 h_n": (8, 16, 500),
}
NEAR, FAR_SAMPLES = 1.25 * LENGTH, 100  # m; samples
OUT_OF_REACH = 5e6  # Pa, which nothing reaches


def problem_of(name):
    """Return a line, or a plane as long along y."""
    size, nodes, _ = CASES[name]
    length, count = size * LENGTH, size * nodes
    if name.startswith("plane"):
        length, count = (length, length), (count, count)
    return st.Problem(SOLID, st.Interface(length, count), FRICTION)


def strength(ratio):
    """Return the paper's, with the mean of the interface random: no plane is long beside 2 h_n."""
    return st.RandomField(
        marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        spectrum=st.PowerLawSpectrum(correlation_length=ratio * LENGTH),
        mean_mode=True,
    )


def lowering(name, ratio, samples, seed):
    """Return by how much interaction lowers each onset, and the part of slip far away, in %."""
    problem = problem_of(name)
    options = {"samples": samples, "seed": seed, "pilot": False, "progress": False}
    local, exact = (
        st.monte_carlo(problem, strength(ratio), method=method, **options)
        for method in (st.LocalCriterion(), st.Equilibrium())
    )
    low, high = exact.first_instability.values, local.first_instability.values
    few = min(samples, FAR_SAMPLES)
    tau_p = strength(ratio).sample(problem.interface, samples=few, seed=seed)
    places = problem.interface.coordinates.values()
    centres = exact.critical_position.values.reshape(samples, -1)[:few]
    whole = CASES[name][0] * LENGTH
    for row, centre in zip(tau_p, centres, strict=True):
        away = [
            (x - c + 0.5 * whole) % whole - 0.5 * whole
            for x, c in zip(places, centre, strict=True)
        ]
        row[sum(each**2 for each in np.meshgrid(*away, indexing="ij")) > NEAR**2] = OUT_OF_REACH
    near = st.onset(problem, tau_p, method=st.Equilibrium(), progress=False)
    far = near.first_instability.values - low[:few]
    return 100.0 * (1.0 - low / high), 100.0 * far / high[:few]


def main(most=10**6):
    """Print each cell: means with standard errors."""
    for seed, name in enumerate(CASES, start=1):
        for ratio in RATIOS:
            samples = min(CASES[name][2], most)
            both = lowering(name, ratio, samples, seed)
            cells = [f"{x.mean():.4f} ± {x.std(ddof=1) / len(x) ** 0.5:.4f}" for x in both]
            print(f"{name}, xi_0/h_n = {ratio:g}: {cells[0]} % ({cells[1]} %)", flush=True)


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
