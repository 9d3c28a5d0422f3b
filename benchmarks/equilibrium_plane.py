"""Onset of a plane to 1e-6, beside bisection from nothing on the same grid, and beside HiGHS.

Planes of 8 h_n by 8 h_n with the paper's strength at xi_0/h_n = 0.5, one core, process time.
Run: ``python benchmarks/equilibrium_plane.py [SAMPLES]``
"""

import statistics
import sys
import time

import numpy as np
from scipy.optimize import linprog
from scipy.special import ndtr
from scipy.stats import beta

from stiction.criterion.ellipse_windows import ellipse_window, local_onset
from stiction.equilibrium.follow_plane import follow_plane
from stiction.equilibrium.least_equilibrium import PlaneSample
from stiction.equilibrium.onset_bracket import bisect, make_bracket
from stiction.equilibrium.plane_onset import Plane, plane_onset, symbol_of

SHEAR_MODULUS, POISSON_RATIO, RATE = 1e9, 0.33, 0.5e12
NUCLEATION = 2.0 * 0.5788869418506 * SHEAR_MODULUS / (1.0 - POISSON_RATIO) / RATE
PLANE = Plane((8.0 * NUCLEATION, 8.0 * NUCLEATION), SHEAR_MODULUS, POISSON_RATIO)
GAP = 1e-6
TARGETS = {128: 0.15, 256: 1.2, 512: 8.0}


def paper_strength(nodes, ratio, seed):
    """Beta(1.5, 3) on [0.66, 1.66] MPa; (k^2 + lambda^2)^-4.5 up to 2.5 lambda; (nodes, nodes).

    The same modes have the same amplitudes on every grid that resolves them.
    """
    wavenumber = 2.0 * np.pi / (ratio * NUCLEATION)
    most = int(2.5 * wavenumber * PLANE.lengths[0] / (2.0 * np.pi)) + 1
    mode = np.arange(-most, most + 1)
    k = 2.0 * np.pi / PLANE.lengths[0] * np.hypot(mode[:, None], mode[None, :])
    amplitude = (k**2 + wavenumber**2) ** -2.25
    amplitude[(k > 2.5 * wavenumber) | (k == 0.0)] = 0.0
    amplitude /= np.sqrt((amplitude**2).sum())
    rng = np.random.default_rng(seed)
    draws = rng.standard_normal((2, *k.shape))
    kept = mode[np.abs(mode) < nodes // 2]
    inside = np.ix_(kept + most, kept + most)
    spectrum = np.zeros((nodes, nodes), dtype=complex)
    spectrum[np.ix_(kept % nodes, kept % nodes)] = (amplitude * (draws[0] + 1j * draws[1]))[inside]
    normal = np.fft.ifft2(spectrum).real * nodes**2
    return 0.66e6 + 1e6 * beta.ppf(ndtr(normal), 1.5, 3.0)


def timed(function, *arguments):
    """Process time of a call, s, and what it returns."""
    start = time.process_time()
    result = function(*arguments)
    return time.process_time() - start, result


def by_bisection(strength):
    """The plain algorithm: stable loads from below, eigenvectors from above, bisection between."""
    one = np.ones(strength.shape)
    bracket = make_bracket(symbol_of(PLANE, strength.shape), RATE, strength, one)
    bisect(bracket, GAP, 0.05 * GAP)
    return bracket


def by_highs(strength):
    """The programme as a dense one, by the dual simplex method."""
    column = np.fft.irfft2(symbol_of(PLANE, strength.shape), strength.shape)
    places = [np.unravel_index(i, strength.shape) for i in range(strength.size)]
    matrix = np.array([np.roll(column, place, (0, 1)).ravel() for place in places])
    matrix = matrix / RATE - np.eye(strength.size)
    result = linprog(
        np.r_[np.zeros(strength.size), -1.0],
        A_ub=np.c_[-matrix, np.ones(strength.size)],
        b_ub=strength.ravel() / 1e6,
        bounds=[(0, None)] * strength.size + [(None, None)],
        method="highs-ds",
    )
    return result.x[-1] * 1e6


def report(nodes, samples):
    """Print one line for a grid."""
    one = np.ones((nodes, nodes))
    strengths = [paper_strength(nodes, 0.5, seed) for seed in range(samples)]
    rate = RATE * one
    onsets = [timed(plane_onset, PLANE, s, one, rate, GAP) for s in strengths]
    ours = statistics.median(seconds for seconds, _ in onsets)
    widest = max((found.upper - found.lower) / found.upper for _, found in onsets)
    goal = f" (goal {TARGETS[nodes]})" if nodes in TARGETS else ""
    text = f"{nodes} x {nodes}  {ours:.4f} s{goal}, gap {widest:.1e}"
    several = strengths[: max(1, samples // 4)]
    plain = [timed(by_bisection, s) for s in several]
    seconds = statistics.median(spent for spent, _ in plain)
    gap = max(bracket.gap / bracket.upper for _, bracket in plain)
    text += f"  bisection: {seconds:.3f} ({seconds / ours:.1f}x, gap {gap:.1e})"
    followed = [
        timed(follow_plane, PLANE, PlaneSample(s, 0.0 * one, one, rate, s / RATE), GAP)[0]
        for s in several
    ]
    text += f"  with the jump: {statistics.median(followed):.3f}"
    if nodes <= 32:
        seconds, exact = timed(by_highs, strengths[0])
        error = abs(onsets[0][1].lower / exact - 1.0)
        text += f"  HiGHS: {seconds:.2f} ({seconds / ours:.0f}x, {error:.1e} apart)"
    print(text, flush=True)


def report_local(nodes):
    """Print the time of the local criterion."""
    shape = (nodes, nodes)
    symbol = symbol_of(PLANE, shape)
    make, windows = timed(
        lambda: [
            ellipse_window(symbol, shape, PLANE.lengths, RATE, aspect)
            for aspect in (1.0, 1.25, 1.0 / (1.0 - POISSON_RATIO))
        ]
    )
    strength = paper_strength(nodes, 0.5, 0)
    spent = statistics.median(
        timed(local_onset, windows, strength, np.ones(shape))[0] for _ in range(9)
    )
    print(
        f"local criterion, {nodes} x {nodes}, three shapes: {spent * 1e3:.1f} ms,"
        f" windows once {make:.2f} s",
        flush=True,
    )


def main():
    samples = int(sys.argv[1]) if len(sys.argv) > 1 else 12
    strength = paper_strength(32, 0.5, 0)
    one = np.ones(strength.shape)
    follow_plane(PLANE, PlaneSample(strength, 0.0 * one, one, RATE * one, strength / RATE))
    for nodes in (24, *TARGETS):
        report(nodes, max(2, samples * 128 // max(nodes, 128)))
    report_local(256)


if __name__ == "__main__":
    main()
