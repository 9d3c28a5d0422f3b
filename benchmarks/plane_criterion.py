"""A random field of a plane and its local criterion, beside the same in plain numpy and scipy.

The plain way takes the same modes and critical ellipses, with complex transforms, scipy's quantile
of the marginal, and one convolution a shape. Planes of 8 h_n by 8 h_n with the paper's strength at
xi_0/h_n = 0.5, one core, process time; the goal at 256 x 256 is 25 ms for both together.
Run: ``python benchmarks/plane_criterion.py [SAMPLES]``
"""

import sys
import time
import warnings

import numpy as np
from scipy.special import ndtr

import stiction as st
from stiction.criterion.plane import windows_of

RATE, GOAL = 0.5e12, {256: 25.0}


def system(nodes):
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
    length = 2.0 * 0.5788869418506 * solid.effective_modulus() / RATE
    plane = st.Interface(length=(8.0 * length, 8.0 * length), nodes=(nodes, nodes))
    field = st.RandomField(
        marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        spectrum=st.PowerLawSpectrum(correlation_length=0.5 * length),
    )
    return st.Problem(solid, plane, st.LinearWeakening(weakening_rate=RATE)), field


def plain_field(field, modes, shape, draws):
    """The strength of one sample, (nx, ny)."""
    spectrum = np.zeros(shape, dtype=complex)
    places = modes.numbers[0, 1:] % shape[0], modes.numbers[1, 1:] % shape[1]
    np.add.at(spectrum, places, modes.sigma[1:] * (draws[0::2] - 1j * draws[1::2]))
    z = np.fft.ifft2(spectrum).real * spectrum.size
    return field.marginal.distribution.ppf(ndtr(z))


def plain_onset(weights, strength):
    """Least moving average over the shapes."""
    spectrum = np.fft.fft2(strength)
    return min(np.fft.ifft2(spectrum * np.conj(np.fft.fft2(w))).real.min() for w in weights)


def best(function, repeats):
    """Least process time of a call, ms."""
    spent = []
    for _ in range(repeats):
        start = time.process_time()
        function()
        spent.append(time.process_time() - start)
    return 1e3 * min(spent)


def report(nodes, samples):
    """Print one line for a grid."""
    problem, field = system(nodes)
    plane, modes = problem.interface, field.modes(problem.interface)
    begin = time.process_time()
    weights = [window.weight for window in windows_of(problem, RATE)]
    once = time.process_time() - begin
    solver = st.LocalCriterion().prepare(problem)
    strength = field.sample(plane, samples=1, seed=1)
    sample = problem.sample(strength)
    draws = field.draws(plane, 1, seed=1)[0]
    ours = solver(sample)["critical_load"][0]
    theirs = plain_onset(weights, plain_field(field, modes, plane.shape, draws))
    times = [
        best(lambda: field.sample(plane, samples=1, seed=1), samples),
        best(lambda: solver(sample), samples),
        best(lambda: plain_field(field, modes, plane.shape, draws), max(2, samples // 5)),
        best(lambda: plain_onset(weights, strength[0]), max(2, samples // 5)),
    ]
    both, plain = times[0] + times[1], times[2] + times[3]
    goal = f" (goal {GOAL[nodes]:g})" if nodes in GOAL else ""
    print(
        f"{nodes} x {nodes}  field {times[0]:.2f} + criterion {times[1]:.2f} = {both:.2f} ms{goal};"
        f" plain {times[2]:.1f} + {times[3]:.1f} = {plain:.1f} ms, {plain / both:.1f}x,"
        f" {abs(ours / theirs - 1.0):.0e} apart; ellipses once {once:.2f} s",
        flush=True,
    )


def main():
    samples = int(sys.argv[1]) if len(sys.argv) > 1 else 20
    warnings.simplefilter("ignore", st.AccuracyWarning)
    problem, field = system(64)
    st.onset(problem, field.sample(problem.interface), method=st.LocalCriterion())
    for nodes in (96, 128, 256, 512):
        report(nodes, samples)


if __name__ == "__main__":
    main()
