"""The elastodynamic memory kernel of a half-space, as a quadrature over arcs and as a short sum.

With T = |k| c_s t, the stress that a Fourier mode of slip D and slip rate V transfers along
the interface between two identical half-spaces is (velocity form, Breitenfeld and Geubelle
1998)

    F(k, t) = -(G*|k|/2) D(k, t) + (G|k|/2) int_0^t C(|k| c_s t') V(k, t - t') dt'.

Everything follows from the Laplace symbol D(s) of the traction per slip, in units of G|k|/2
with s in units of |k| c_s (Geubelle and Rice 1995): in mode III sqrt(1 + s^2), in mode II

    [(2 + s^2)^2 - 4 sqrt(1 + s^2) sqrt(1 + s^2/eta^2)] / (s^2 sqrt(1 + s^2)), eta = c_d/c_s.

Its inverse transform is taken along arcs in Re s < 0 that join the branch points, where the
integrand is smooth and decays, so that one set of nodes is accurate for every T. The closed
forms by Bessel functions cancel badly beyond T of 7.

A short sum C(T) ~ Re sum_p w_p exp(s_p T) turns the convolution with the whole history into one
recursion a pair. The arc quadrature already is such a sum, of some 280 terms; balanced
truncation shortens it (Moore 1981; its Gramians are Cauchy matrices, factorised to high
relative accuracy as in Demmel 1999), variable projection polishes the poles (Golub and
Pereyra 1973), and reweighting in the way of Lawson (1961) levels the error. A fit counts
only if its error on another, denser set of times is below the tolerance.
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

_STEP = 0.025  # of the tanh-sinh rule; at 0.05 the kernel is off by 6e-11 at T = 1e5
_RANGE = (
    4.4  # the outermost node lies 1e-55 from the branch point: its weight underflows any sum
)
_CHUNK = 2048
T_MAX = 1e5  # the error holds on 0 <= T <= T_MAX; beyond, the sum decays
MAX_WEIGHT = 10.0  # larger ones cancel, and lose digits in the recursion
MAX_PAIRS = 60  # enough for 1e-9 in mode II
ROUNDS = 14  # of levelling; what is not level by then is tried with one pair more
_DAMPING = 0.3  # that each pole has over T_MAX at least, so that sums decay beyond
_FLOOR = _DAMPING / T_MAX  # every pole decays at least as fast
# Decay over T_MAX for balanced truncation, in the order tried: found to be good starts
# for polishing at loose and at tight tolerances.
_LOOSE, _TIGHT = (10.0, 1.0), (1.0, 0.3)
_FORMAT = 2  # raise when the fit or the file layout changes, so that old files are left alone


def static_stiffness(mode: str, eta: float) -> float:
    """D(0) = G*/G (1): 2 (1 - 1/eta^2) in mode II, 1 in mode III."""
    return 1.0 if mode == "III" else 2.0 * (1.0 - 1.0 / eta**2)


def _half_arc() -> tuple[Floats, Floats]:
    """Angles from the upper branch point and weights, tanh-sinh, of the upper half of an arc."""
    t = np.arange(0.0, _RANGE, _STEP)
    angle = np.pi / (1.0 + np.exp(np.pi * np.sinh(t)))
    weight = (np.pi**2 / 4.0) * _STEP * np.cosh(t) / np.cosh(0.5 * np.pi * np.sinh(t)) ** 2
    weight[0] *= 0.5
    return angle, weight


def arc_quadrature(mode: str, eta: float) -> tuple[Complex, Complex]:
    """Nodes s, Re s < 0, and weights w, some 140 an arc, with C(T) = Re sum w exp(s T), T >= 0.

    The transform of C is (D(0) + s - D(s))/s; only its parts that are odd across the arc
    |s| = 1 (the shear root) and |s| = eta (the dilatational root) contribute.
    """
    angle, weight = _half_arc()
    turn = np.exp(1j * angle)
    # sqrt(1 + s^2) at s = i turn, without cancellation beside the branch point.
    root = np.sqrt(2.0 * np.sin(angle)) * np.exp(1j * (0.5 * angle - 0.25 * np.pi))
    factor = turn * weight * (2.0 / (np.pi * 1j))
    s = 1j * turn
    if mode == "III":
        nodes, weights = s, -root / s * factor
    else:
        fast = eta * s
        nodes = np.concatenate([s, fast])
        weights = np.concatenate(
            [
                -((2.0 + s * s) ** 2) / (s**3 * root) * factor,
                4.0 * root / fast**3 * eta * factor,
            ]
        )
    kept = np.abs(weights) > 1e-18
    return nodes[kept], weights[kept]


def exponential_sum(time: ArrayLike, nodes: Complex, weights: Complex) -> Floats:
    """Re sum_p w_p exp(s_p T) at the dimensionless times T (any shape)."""
    t = np.asarray(time, dtype=np.float64)
    flat, result = t.ravel(), np.empty(t.size)
    for start in range(0, t.size, _CHUNK):  # bounded memory for long lists of times
        part = slice(start, start + _CHUNK)
        result[part] = (np.exp(np.multiply.outer(flat[part], nodes)) @ weights).real
    return result.reshape(t.shape)


def memory_kernel(time: ArrayLike, mode: str, eta: float) -> Floats:
    """The kernel C(T) of the velocity form at times T, any shape, to about 2e-15 for all T >= 0.

    C(0) = G*/G; it falls like T^-1/2 (mode II) or T^-3/2 (mode III), so never truncate it.
    """
    return exponential_sum(time, *arc_quadrature(mode, eta))


@dataclasses.dataclass(frozen=True)
class ExponentialSum:
    """Poles and weights of a fit, with the errors that its validation measured.

    `poles` (Re s < 0) and `weights`, (pairs,) each, in units of |k| c_s; `error` is the
    largest |C - sum| found on 0 <= T = |k| c_s t <= T_MAX.
    """

    poles: Complex
    weights: Complex
    error: float

    def __call__(self, time: Floats) -> Floats:
        """The sum at the dimensionless times T."""
        return exponential_sum(time, self.poles, self.weights)


def _sample_times(per_decade: int, cluster: int, seed: int) -> Floats:
    """Return times on [0, T_MAX]: dense at first, with random phases at every later scale."""
    rng = np.random.default_rng(seed)
    scale = np.geomspace(0.3, T_MAX, round(per_decade * np.log10(T_MAX / 0.3)))
    late = scale[:, None] + 2.0 * np.pi * rng.random((scale.size, cluster))
    times = np.concatenate([np.linspace(0.0, 8.0, 8 * per_decade + 1), late.ravel(), [T_MAX]])
    return np.unique(np.minimum(times, T_MAX))


def _cauchy_cholesky(s: Complex, b: Complex, stop: float) -> Complex:
    """Pivoted Cholesky factor of b_i conj(b_j) / -(s_i + conj(s_j)), without subtractions."""
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
    """Poles of the best short model (in the Hankel sense) of sum w exp(s T), shape (pairs,)."""
    b = np.sqrt(w)
    factor = _cauchy_cholesky(s, b, 1e-24)
    left, sigma, right = np.linalg.svd(factor.T @ factor)
    scale = np.sqrt(sigma[:pairs])
    lift = factor @ (right.conj().T[:, :pairs] / scale)
    drop = np.conj(factor) @ (left[:, :pairs] / scale)
    return np.linalg.eigvals(drop.conj().T @ (s[:, None] * lift))


class _Polish:
    """Separable least squares: the poles move by Levenberg-Marquardt, the weights follow."""

    def __init__(self, times: Floats, values: Floats) -> None:
        self.times, self.values = times, values

    def poles(self, parameters: Floats) -> Complex:
        real, imaginary = np.split(parameters, 2)
        return -np.exp(real) - _FLOOR + 1j * imaginary

    def project(
        self, poles: Complex, emphasis: Floats
    ) -> tuple[Complex, Floats, Complex, Floats]:
        modes = np.exp(np.multiply.outer(self.times, poles))
        basis = np.hstack([modes.real, -modes.imag]) * emphasis[:, None]
        q, r = np.linalg.qr(basis)
        target = q.T @ (self.values * emphasis)
        try:
            solution = np.linalg.solve(r, target)
        except np.linalg.LinAlgError:  # two poles met: leave one of them without weight
            solution = np.linalg.lstsq(r, target, rcond=1e-14)[0]
        real, imaginary = np.split(solution, 2)
        weights = real + 1j * imaginary
        return modes, q, weights, emphasis * (self.values - (modes @ weights).real)

    def run(self, poles: Complex, emphasis: Floats, iterations: int) -> tuple[Complex, Complex]:
        parameters = np.concatenate(
            [np.log(np.maximum(-poles.real - _FLOOR, 1e-9)), poles.imag]
        )
        modes, q, weights, residual = self.project(self.poles(parameters), emphasis)
        cost, damping = float(residual @ residual), 1e-3
        for _ in range(iterations):
            slope = modes * (self.times[:, None] * weights)
            decay = -np.exp(parameters[: weights.size])
            jacobian = np.hstack([slope.real * decay, -slope.imag]) * emphasis[:, None]
            jacobian -= q @ (q.T @ jacobian)
            normal, gradient = jacobian.T @ jacobian, jacobian.T @ residual
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
    """Return whether no weight is large, no pole grows and no two terms nearly cancel."""
    if np.abs(weights).max() > MAX_WEIGHT or poles.real.max() >= 0.0:
        return False
    gap = np.abs(poles[:, None] - poles[None, :]) / np.abs(poles)[:, None]
    near = (gap < 1e-3) & ~np.eye(poles.size, dtype=bool)
    return not np.any(near & (np.abs(weights)[:, None] > 1.0))


def _attempt(
    arcs: tuple[Complex, Complex], pairs: int, fit: _Polish, tolerance: float, decay: float
) -> tuple[Complex, Complex]:
    """Return the best fit with this number of pairs; polishing levels its error."""
    shift = _FLOOR * decay / _DAMPING
    poles = balanced_truncation(arcs[0] - shift, arcs[1], pairs) + shift
    emphasis = np.ones(fit.times.size)
    poles, weights = fit.run(poles, emphasis, 60)
    best, kept = np.inf, (poles, weights)
    for _ in range(ROUNDS):
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
    """Return the shortest sum of exponentials found whose validated error is below the tolerance.

    `eta` is c_d/c_s, not used in mode III; the tolerance is absolute, and C(0) = G*/G.
    """
    if not 1e-9 <= tolerance <= 1e-2:
        raise InputError(f"kernel tolerance: must lie in [1e-09, 0.01], got {tolerance!r}")
    arcs = arc_quadrature(mode, eta)
    fit_times = _sample_times(40 if tolerance > 3e-8 else 80, 8, seed=0)
    fit = _Polish(fit_times, exponential_sum(fit_times, *arcs))
    check_times = _sample_times(150, 12, seed=1)
    check = exponential_sum(check_times, *arcs)
    # First number of pairs tried: found to be just below the need, for every Poisson's ratio.
    digits = -np.log10(tolerance)
    pairs = max(3, round(1.7 * digits - 2.0 if mode == "III" else 5.3 * digits - 9.7))
    starts = _LOOSE if tolerance > 1e-7 else _TIGHT
    with one_blas_thread():  # the matrices are small: more threads only wait for each other
        for count, decay in itertools.product(range(pairs, MAX_PAIRS + 1), starts):
            poles, weights = _attempt(arcs, count, fit, tolerance, decay)
            error = float(np.abs(check - exponential_sum(check_times, poles, weights)).max())
            if error < tolerance and _acceptable(poles, weights):
                order = np.argsort(-poles.real)
                return ExponentialSum(poles[order], weights[order], error)
    raise InputError(
        f"kernel tolerance: {tolerance!r} was not reached with {MAX_PAIRS} pairs of exponentials"
        f" (mode {mode}, c_d/c_s = {eta:.6g}); use a larger tolerance"
    )


@cache
def kernel_sum(mode: str, eta: float, tolerance: float = 1e-6) -> ExponentialSum:
    """Return the sum of `fit_exponentials`, from memory, from disk, or built now (about 1 s)."""
    eta = 1.0 if mode == "III" else float(eta)
    text = f"{_FORMAT} {mode} {eta.hex()} {float(tolerance).hex()} {T_MAX.hex()}"
    folder = private_folder(cache_folder() / "fitted")
    path = folder / f"kernel-{hashlib.sha256(text.encode()).hexdigest()[:20]}.npz"
    with contextlib.suppress(
        *UNREADABLE
    ):  # not there, or damaged: it is built and written again
        data = read_arrays(path)
        return ExponentialSum(data["poles"], data["weights"], float(data["error"]))
    kernel = fit_exponentials(mode, eta, tolerance)
    with contextlib.suppress(StoreError):  # where nothing can be written, it stays in memory
        write_arrays(path, vars(kernel))
    return kernel
