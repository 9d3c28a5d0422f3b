"""The elastodynamic memory kernel of half-spaces, as a quadrature and as a sum of exponentials.

Problem
-------
Let T = |k| c_s t. A Fourier mode with slip D and slip rate V transfers
this stress along the interface between two identical half-spaces
(velocity form, M. S. Breitenfeld and P. H. Geubelle, International
Journal of Fracture 93, 1998):

    F(k, t) = -(G*|k|/2) D(k, t) + (G|k|/2) int_0^t C(|k| c_s t') V(k, t - t') dt'.  (1)

The kernel C follows from the Laplace symbol D(s) of the traction per
slip, in units of G|k|/2, with s in units of |k| c_s (P. H. Geubelle and
J. R. Rice, Journal of the Mechanics and Physics of Solids 43, 1995):
its transform is (D(0) + s - D(s))/s, with D(s) = sqrt(1 + s^2) in mode
III, in mode II

    [(2 + s^2)^2 - 4 sqrt(1 + s^2) sqrt(1 + s^2/eta^2)] / (s^2 sqrt(1 +
    s^2)), eta = c_d/c_s. (2)

Find few pairs of poles s_p and weights w_p with C(T) = Re sum_p w_p
exp(s_p T) to a tolerance on 0 <= T <= `T_MAX`. The pairs turn the
convolution with the whole history into a recursion for each pair.

Algorithm (`fit_exponentials`)
------------------------------
1. Compute the inverse transform along arcs in Re s < 0 that join the
   branch points -i a and i a, a = 1 and eta. The integrand is smooth
   there and decays, so that the same tanh-sinh nodes (H. Takahasi and
   M. Mori, Publications of RIMS 9, 1974) are accurate for every T
   (`arc_quadrature`). The result is a sum of some 280 exponentials.
   (The closed forms with Bessel functions lose digits by cancellation
   above T = 7.)
2. Shorten the sum by balanced truncation (B. C. Moore, IEEE
   Transactions on Automatic Control 26, 1981). The Gramians are Cauchy
   matrices, which are factorised to high relative accuracy (J. Demmel,
   Accurate Singular Value Decompositions of Structured Matrices, 1999).
   First, all poles are damped by a common decay, which is removed
   afterwards (`balanced_truncation`).
3. Polish the poles by variable projection: the poles
   move by Levenberg-Marquardt, and the weights follow
   by linear least squares (G. H. Golub and V. Pereyra,
   SIAM Journal on Numerical Analysis 10, 1973).
4. Level the error: increase the weight of times with a large error, as
   in Lawson's algorithm (J. R. Rice and K. H. Usow, The Lawson
   Algorithm and Extensions, 1968), and polish again (`_attempt`).
5. Accept the fit only if its error at a denser set of times is below
   the tolerance, and its terms do not cancel (`_acceptable`). Otherwise
   try a different common decay, and then one more pair.
"""

import contextlib
import dataclasses
import hashlib
import itertools
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from stiction.base.arrays import one_blas_thread
from stiction.base.errors import InputError, StoreError
from stiction.base.files import (
    UNREADABLE,
    cache_folder,
    private_folder,
    read_arrays,
    write_arrays,
)

Complex = NDArray[np.complex128]
Floats = NDArray[np.float64]

_RULE_STEP = 0.025  # of the tanh-sinh rule; with 0.05 the kernel is off by 6e-11 at T = 1e5
# End of the rule: the outermost node lies 1e-55 from the branch point,
# and its weight underflows.
_RULE_END = 4.4
_TIMES_PER_CHUNK = 2048
T_MAX = 1e5  # the error holds on 0 <= T <= T_MAX; after T_MAX the sum decays
MAX_WEIGHT = 10.0  # larger weights cancel, and lose digits in the recursion
MAX_PAIRS = 60  # enough for 1e-9 in mode II
MAX_LEVELLINGS = 14  # a fit that is not level by then gets a further pair
# Smallest exponent by which each pole decays over T_MAX, so that sums
# decay after T_MAX.
_MIN_DECAY = 0.3
_MIN_DECAY_RATE = _MIN_DECAY / T_MAX
# Common decays over T_MAX for balanced truncation,
# in the order of trials. They are good starts for
# polishing at loose and at tight tolerances.
_LOOSE_DECAYS, _TIGHT_DECAYS = (10.0, 1.0), (1.0, 0.3)
_FILE_FORMAT = 2  # raise it when the fit or the file layout changes, to ignore old files


def static_stiffness(mode: str, eta: float) -> float:
    """Return D(0) = G*/G: 2 (1 - 1/eta^2) in mode II, and 1 in mode III.

    >>> static_stiffness("II", 2.0), static_stiffness("III", 2.0)
    (1.5, 1.0)
    """
    return 1.0 if mode == "III" else 2.0 * (1.0 - 1.0 / eta**2)


def arc_quadrature(mode: str, eta: float) -> tuple[Complex, Complex]:
    """Step 1: return nodes s, Re s < 0, and weights w with C(T) = Re sum w exp(s T).

    An arc has about 140 nodes. Only the parts of the transform that are
    odd across an arc contribute: the shear root at |s| = 1 and the
    dilatational root at |s| = eta.

    The Laplace transform of the sum at a real s, sum w/(s - s_p), is (D(0) + s -
    D(s))/s:

    >>> s, eta = 0.7, 1.8
    >>> for mode, shear in ("III", np.sqrt(1 + s**2)), ("II", np.sqrt(1 + s**2)):
    ...     nodes, weights = arc_quadrature(mode, eta)
    ...     D = shear
    ...     if mode == "II":
    ...         D = (2 + s**2) ** 2 - 4 * shear * np.sqrt(1 + s**2 / eta**2)
    ...         D /= s**2 * shear
    ...     exact = (static_stiffness(mode, eta) + s - D) / s
    ...     print(abs((weights / (s - nodes)).real.sum() - exact) < 1e-12, nodes.real.max() < 0.0)
    True True
    True True
    """
    # Angles from the upper branch point, and weights, for half an arc.
    t = np.arange(0.0, _RULE_END, _RULE_STEP)
    angle = np.pi / (1.0 + np.exp(np.pi * np.sinh(t)))
    weight = (np.pi**2 / 4.0) * _RULE_STEP * np.cosh(t) / np.cosh(0.5 * np.pi * np.sinh(t)) ** 2
    weight[0] *= 0.5
    rotation = np.exp(1j * angle)
    # sqrt(1 + s^2) at s = i rotation, in a form without cancellation
    # next to the branch point.
    root = np.sqrt(2.0 * np.sin(angle)) * np.exp(1j * (0.5 * angle - 0.25 * np.pi))
    factor = rotation * weight * (2.0 / (np.pi * 1j))
    s = 1j * rotation
    if mode == "III":
        nodes, weights = s, -root / s * factor
    else:
        fast = eta * s
        nodes = np.concatenate([s, fast])
        slow_weights = -((2.0 + s * s) ** 2) / (s**3 * root) * factor
        weights = np.concatenate([slow_weights, 4.0 * root / fast**3 * eta * factor])
    kept = np.abs(weights) > 1e-18
    return nodes[kept], weights[kept]


def exponential_sum(time: ArrayLike, nodes: Complex, weights: Complex) -> Floats:
    """Return Re sum_p w_p exp(s_p T) at dimensionless times T with any shape.

    >>> nodes, weights = np.array([-1.0 + 2.0j, -0.5]), np.array([3.0 - 1.0j, 2.0])
    >>> T = 0.8
    >>> decay = np.exp(-T) * (3.0 * np.cos(2.0 * T) + np.sin(2.0 * T)) + 2.0 * np.exp(-0.4)
    >>> sums = exponential_sum(np.full((2, 1100), T), nodes, weights)  # more than one chunk
    >>> sums.shape, np.allclose(sums, decay), round(float(exponential_sum(0.0, nodes, weights)), 9)
    ((2, 1100), True, 5.0)
    """
    t = np.asarray(time, dtype=np.float64)
    flat, result = t.ravel(), np.empty(t.size)
    for start in range(0, t.size, _TIMES_PER_CHUNK):  # in chunks, to bound memory
        chunk = slice(start, start + _TIMES_PER_CHUNK)
        result[chunk] = (np.exp(np.multiply.outer(flat[chunk], nodes)) @ weights).real
    return result.reshape(t.shape)


def memory_kernel(time: ArrayLike, mode: str, eta: float) -> Floats:
    """Return the kernel C(T) of the velocity form at times T >= 0 (any shape), to about 2e-15.

    C(0) = G*/G. The kernel falls so slowly, like T^-1/2 in mode II and
    T^-3/2 in mode III, that it must not be truncated.

    In mode III, C(T) is 1 minus the integral of J1(t)/t:

    >>> from scipy.integrate import quad
    >>> from scipy.special import j1
    >>> for T in 0.5, 1.7, 6.0:
    ...     exact = 1.0 - quad(lambda t: j1(t) / t, 0.0, T)[0]
    ...     print(abs(float(memory_kernel(T, "III", 1.0)) - exact) < 1e-12)
    True
    True
    True
    >>> round(float(memory_kernel(0.0, "II", 2.0)), 9)  # C(0) = G*/G
    1.5
    """
    return exponential_sum(time, *arc_quadrature(mode, eta))


@dataclasses.dataclass(frozen=True)
class ExponentialSum:
    """Poles and weights of a fit, with the measured error.

    `poles` (Re s < 0) and `weights` are (pairs,)
    arrays in units of |k| c_s. `error` is the largest
    measured |C - sum| for 0 <= T = |k| c_s t <= T_MAX.
    """

    poles: Complex
    weights: Complex
    error: float

    def __call__(self, time: Floats) -> Floats:
        """Return the sum at the dimensionless times T."""
        return exponential_sum(time, self.poles, self.weights)


def _sample_times(per_decade: int, cluster: int, seed: int) -> Floats:
    """Return times on [0, T_MAX], dense at first, with random phases on later scales.

    >>> times = _sample_times(5, 3, seed=1)
    >>> float(times[0]), float(times[-1]), bool((np.diff(times) > 0.0).all())
    (0.0, 100000.0, True)
    >>> bool(np.isin(np.linspace(0.0, 8.0, 41), times).all())
    True
    >>> bool(np.histogram(times, [9e2, 9e3, 9e4])[0].min() >= 12)  # 5 clusters of 3 in a decade
    True
    """
    rng = np.random.default_rng(seed)
    # The kernel oscillates with periods of up to 2 pi, so scatter the
    # times over a period.
    scale = np.geomspace(0.3, T_MAX, round(per_decade * np.log10(T_MAX / 0.3)))
    late = scale[:, None] + 2.0 * np.pi * rng.random((scale.size, cluster))
    times = np.concatenate([np.linspace(0.0, 8.0, 8 * per_decade + 1), late.ravel(), [T_MAX]])
    return np.unique(np.minimum(times, T_MAX))


def _cauchy_cholesky(s: Complex, b: Complex, stop: float) -> Complex:
    """Step 2: return the pivoted Cholesky factor of b_i conj(b_j) / -(s_i + conj(s_j)).

    Updates consist only of products, so that small pivots keep their
    relative accuracy.

    >>> s, b = np.array([-1.0 + 2.0j, -0.5, -3.0 + 1.0j]), np.array([1.0 + 1.0j, 2.0, 0.5j])
    >>> matrix = np.outer(b, b.conj()) / -(s[:, None] + s.conj())
    >>> factor = _cauchy_cholesky(s, b, 1e-24)
    >>> np.allclose(factor @ factor.conj().T, matrix), factor.shape
    (True, (3, 3))
    >>> _cauchy_cholesky(s, b, 0.5).shape  # the diagonal is 1, 4 and 1/24
    (3, 1)
    """
    a, columns = b.copy(), []
    diagonal = np.abs(a) ** 2 / (-2.0 * s.real)
    largest = diagonal.max()
    for _ in range(s.size):
        p = int(np.argmax(diagonal))
        if diagonal[p] <= stop * largest:
            break
        column = a * np.conj(a[p]) / (-(s + np.conj(s[p])))
        columns.append(column / np.sqrt(column[p].real))
        a = a * (s - s[p]) / (s + np.conj(s[p]))
        a[p] = 0.0
        diagonal = np.abs(a) ** 2 / (-2.0 * s.real)
    return np.array(columns).T


def balanced_truncation(s: Complex, w: Complex, pairs: int) -> Complex:
    """Step 2: return the poles of a short model for sum w exp(s T), from balanced truncation.

    A sum of two terms has a short model of two terms, the sum itself. Of a
    third term with a small weight, little is left.

    >>> s, w = np.array([-1.0 + 2.0j, -0.5 + 0.0j]), np.array([3.0 - 1.0j, 2.0 + 0.0j])
    >>> poles = balanced_truncation(s, w, 2)
    >>> np.allclose(np.sort_complex(poles), s)
    True
    >>> poles = balanced_truncation(np.append(s, -2.0), np.append(w, 1e-9), 2)
    >>> np.allclose(np.sort_complex(poles), s, atol=1e-6)
    True
    """
    # Equal input and output vectors make both Gramians equal up to
    # conjugation.
    b = np.sqrt(w)
    factor = _cauchy_cholesky(s, b, 1e-24)
    left, sigma, right = np.linalg.svd(factor.T @ factor)
    scale = np.sqrt(sigma[:pairs])
    lift = factor @ (right.conj().T[:, :pairs] / scale)
    drop = np.conj(factor) @ (left[:, :pairs] / scale)
    return np.linalg.eigvals(drop.conj().T @ (s[:, None] * lift))


class _Polish:
    """Step 3: variable projection. Poles are -exp(a) - `_MIN_DECAY_RATE` + i b.

    Values of a known sum: its weights follow from its poles, and its poles from starts
    nearby.

    >>> times = np.linspace(0.0, 8.0, 60)
    >>> poles, weights = np.array([-1.0 + 2.0j, -0.5 + 0.3j]), np.array([3.0 - 1.0j, 2.0 + 0.5j])
    >>> fit = _Polish(times, exponential_sum(times, poles, weights))
    >>> _, _, found, residual = fit.project(poles, np.linspace(1.0, 2.0, 60))
    >>> np.allclose(found, weights), bool(np.abs(residual).max() < 1e-12)
    (True, True)
    >>> moved, found = fit.run(poles + [0.1, -0.1 + 0.1j], np.ones(60), 60)
    >>> np.allclose(moved, poles, atol=1e-6), np.allclose(found, weights, atol=1e-5)
    (True, True)
    >>> parameters = np.array([0.0, np.log(0.5), 2.0, 0.3])
    >>> np.allclose(fit.poles(parameters), poles - _MIN_DECAY / T_MAX)
    True
    """

    def __init__(self, times: Floats, values: Floats) -> None:
        self.times, self.values = times, values

    def poles(self, parameters: Floats) -> Complex:
        real, imaginary = np.split(parameters, 2)
        return -np.exp(real) - _MIN_DECAY_RATE + 1j * imaginary

    def project(
        self, poles: Complex, emphasis: Floats
    ) -> tuple[Complex, Floats, Complex, Floats]:
        # Re(w exp(s T)) is linear in the real and the imaginary part of w.
        modes = np.exp(np.multiply.outer(self.times, poles))
        basis = np.hstack([modes.real, -modes.imag]) * emphasis[:, None]
        q, r = np.linalg.qr(basis)
        target = q.T @ (self.values * emphasis)
        try:
            solution = np.linalg.solve(r, target)
        except np.linalg.LinAlgError:  # two poles have met: the least norm divides them
            solution = np.linalg.lstsq(r, target, rcond=1e-14)[0]
        real, imaginary = np.split(solution, 2)
        weights = real + 1j * imaginary
        return modes, q, weights, emphasis * (self.values - (modes @ weights).real)

    def run(self, poles: Complex, emphasis: Floats, iterations: int) -> tuple[Complex, Complex]:
        decay_rate = np.maximum(-poles.real - _MIN_DECAY_RATE, 1e-9)
        parameters = np.concatenate([np.log(decay_rate), poles.imag])
        modes, q, weights, residual = self.project(self.poles(parameters), emphasis)
        cost, damping = float(residual @ residual), 1e-3
        for _ in range(iterations):
            slope = modes * (self.times[:, None] * weights)
            decay = -np.exp(parameters[: weights.size])
            jacobian = np.hstack([slope.real * decay, -slope.imag]) * emphasis[:, None]
            # Weights follow the poles, so only the part outside the
            # span of the basis counts.
            jacobian -= q @ (q.T @ jacobian)
            normal, gradient = jacobian.T @ jacobian, jacobian.T @ residual
            # Raise the damping until the step lowers the cost.
            for _ in range(8):
                lifted = normal + damping * np.diag(np.diag(normal) + 1e-30)
                trial = parameters + np.clip(np.linalg.solve(lifted, gradient), -1.0, 1.0)
                state = self.project(self.poles(trial), emphasis)
                fresh = float(state[3] @ state[3])
                if fresh < cost:
                    break
                damping *= 4.0
            else:
                break
            gain = 1.0 - fresh / cost
            parameters, cost, (modes, q, weights, residual) = trial, fresh, state
            damping = max(damping / 5.0, 1e-12)
            if gain < 1e-3:
                break
        return self.poles(parameters), weights


def _acceptable(poles: Complex, weights: Complex) -> bool:
    """Step 5: return whether weights are small, poles decay, and no two terms nearly cancel.

    >>> poles, weights = np.array([-1.0 + 2.0j, -0.5]), np.array([3.0, 2.0])
    >>> _acceptable(poles, weights), _acceptable(poles, 4.0 * weights), _acceptable(-poles, weights)
    (True, False, False)
    >>> close = np.array([-1.0 + 2.0j, -1.001 + 2.0j])  # two poles 0.001 apart nearly cancel
    >>> _acceptable(close, weights), _acceptable(close, 0.3 * weights)
    (False, True)
    >>> _acceptable(np.array([-1.0, -1.003]), weights), _acceptable(np.array([-1.0, 0.5]), weights)
    (True, False)
    """
    if np.abs(weights).max() > MAX_WEIGHT or poles.real.max() >= 0.0:
        return False
    # Two close poles with large weights of opposite signs would cancel.
    gap = np.abs(poles[:, None] - poles[None, :]) / np.abs(poles)[:, None]
    near = (gap < 1e-3) & ~np.eye(poles.size, dtype=bool)
    return not np.any(near & (np.abs(weights)[:, None] > 1.0))


def _attempt(
    arcs: tuple[Complex, Complex], pairs: int, fit: _Polish, tolerance: float, decay: float
) -> tuple[Complex, Complex]:
    """Steps 2 to 4: return the best fit with a given number of pairs and a common decay."""
    # 2. The first poles.
    shift = _MIN_DECAY_RATE * decay / _MIN_DECAY
    poles = balanced_truncation(arcs[0] - shift, arcs[1], pairs) + shift
    # 3. Polish them.
    emphasis = np.ones(fit.times.size)
    poles, weights = fit.run(poles, emphasis, 60)
    best, kept = np.inf, (poles, weights)
    # 4. Level the error, and keep the best fit on the way.
    for _ in range(MAX_LEVELLINGS):
        error = np.abs(fit.values - exponential_sum(fit.times, poles, weights))
        worst = error.max()
        if worst < best:
            best, kept = worst, (poles, weights)
        if best < 0.9 * tolerance or worst > 30.0 * tolerance:
            break
        emphasis = emphasis * np.maximum(error / worst, 1e-3) ** 0.35
        emphasis /= np.sqrt(np.mean(emphasis**2))
        poles, weights = fit.run(poles, emphasis, 15)
    return kept


def fit_exponentials(mode: str, eta: float, tolerance: float) -> ExponentialSum:
    """Return a short sum of exponentials with a measured error below the tolerance.

    `eta` is c_d/c_s. Mode III does not use it. The tolerance is
    absolute, and C(0) = G*/G.

    >>> fit = fit_exponentials("III", 1.0, 1e-2)
    >>> times = np.linspace(0.0, 30.0, 301)
    >>> error = np.abs(fit(times) - memory_kernel(times, "III", 1.0)).max()
    >>> bool(0.0 < error < 1.2 * fit.error < 1.2e-2), bool((np.diff(fit.poles.real) <= 0.0).all())
    (True, True)
    """
    if not 1e-9 <= tolerance <= 1e-2:
        raise InputError(f"kernel_tolerance: must be between 1e-9 and 0.01, got {tolerance!r}")
    # 1. The long sum, and the times at which
    # short sums are fitted and checked.
    arcs = arc_quadrature(mode, eta)
    fit_times = _sample_times(40 if tolerance > 3e-8 else 80, 8, seed=0)
    fit = _Polish(fit_times, exponential_sum(fit_times, *arcs))
    check_times = _sample_times(150, 12, seed=1)
    check = exponential_sum(check_times, *arcs)
    # The first number of pairs, which proved to be just too small for
    # every Poisson's ratio.
    digits = -np.log10(tolerance)
    pairs = max(3, round(1.7 * digits - 2.0 if mode == "III" else 5.3 * digits - 9.7))
    starts = _LOOSE_DECAYS if tolerance > 1e-7 else _TIGHT_DECAYS
    with one_blas_thread():  # the matrices are so small that threads would only wait
        for count, decay in itertools.product(range(pairs, MAX_PAIRS + 1), starts):
            poles, weights = _attempt(arcs, count, fit, tolerance, decay)
            # 5. Accept the fit, or try again.
            error = float(np.abs(check - exponential_sum(check_times, poles, weights)).max())
            if error < tolerance and _acceptable(poles, weights):
                order = np.argsort(-poles.real)
                return ExponentialSum(poles[order], weights[order], error)
    raise InputError(
        f"kernel_tolerance: {tolerance!r} was not reached with {MAX_PAIRS} pairs of exponentials"
        f" (mode {mode}, c_d/c_s = {eta:.6g}). Use a larger tolerance"
    )


@cache
def kernel_sum(mode: str, eta: float, tolerance: float = 1e-6) -> ExponentialSum:
    """Return the sum from `fit_exponentials`: from memory, from disk, or from a fit (about 1 s)."""
    eta = 1.0 if mode == "III" else float(eta)
    text = f"{_FILE_FORMAT} {mode} {eta.hex()} {float(tolerance).hex()} {T_MAX.hex()}"
    folder = private_folder(cache_folder() / "fitted")
    path = folder / f"kernel-{hashlib.sha256(text.encode()).hexdigest()[:20]}.npz"
    with contextlib.suppress(*UNREADABLE):  # a missing or damaged file is written again
        data = read_arrays(path)
        return ExponentialSum(data["poles"], data["weights"], float(data["error"]))
    kernel = fit_exponentials(mode, eta, tolerance)
    with contextlib.suppress(StoreError):  # without a writable folder it stays in memory
        write_arrays(path, vars(kernel))
    return kernel
