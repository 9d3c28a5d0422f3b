"""Mean and variance of the nucleation stress, exact, and their limits."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import simpson

from stiction._checks import check_flag, check_instance
from stiction.criterion.assumptions import check_law
from stiction.criterion.eigenproblem import Weight
from stiction.criterion.ellipse_windows import EllipseWindow
from stiction.criterion.nucleation import Weights, check_aspect, multiplier_of, weight_of
from stiction.criterion.plane import middle_aspect, too_small, window_of
from stiction.errors import InputError
from stiction.problem import Problem
from stiction.random.mapping import correlation_of_mapped, hermite_coefficients
from stiction.random.random_field import RandomField
from stiction.statistics.plane_moments import plane_infinite_ratio, plane_longest_ratio

Array = NDArray[np.float64]

QUADRATURE = 256
PANELS, POINTS = 24, 16
REACH = 40.0  # correlation lengths; beyond, even the exponential correlation is round-off


@dataclass(frozen=True)
class NucleationStatistics:
    """Mean and variance of the nucleation stress tau_n at a point.

    Attributes
    ----------
    mean : float
        E[tau_n], Pa.
    variance : float
        Var[tau_n], Pa^2.
    strength_mean : float
        E[tau_p], Pa.
    strength_variance : float
        Var[tau_p], Pa^2.
    """

    mean: float
    variance: float
    strength_mean: float
    strength_variance: float

    @property
    def standard_deviation(self) -> float:
        """Square root of the variance, Pa."""
        return math.sqrt(self.variance)

    @property
    def variance_ratio(self) -> float:
        """Var[tau_n]/Var[tau_p]."""
        return self.variance / self.strength_variance


@dataclass(frozen=True)
class NucleationLimits:
    """What Var[tau_n]/Var[tau_p] and the critical stress tend to; no limit is a mean value.

    Attributes
    ----------
    short_slope : float
        For xi_0 << h_n the variance ratio is `short_slope` times xi_0/h_n (L >> h_n); on a plane
        times its square.
    short_stress : float
        tau_n and tau_cr for xi_0 -> 0 at fixed L: the mean strength, Pa. At fixed L/xi_0 there is
        no such limit: L would fall below h_n, where the local criterion ends.
    long_ratio_fixed_length : float
        Variance ratio for xi_0 -> infinity at fixed L: the interface then holds the longest modes
        only. 1 with the mean mode, |g(2 pi/L)|^2 averaged over the harmonics without it. On a
        plane two waves are left where the lengths along x and y are the same.
    long_ratio_fixed_share : float
        Variance ratio for xi_0 -> infinity with L/xi_0 fixed, that is h_n -> 0: 1.
    long_stress_fixed_share : str
        What tau_cr tends to then, in words: a distribution, not a number.
    long_stress_fixed_length : str
        The same for L fixed.
    """

    short_slope: float
    short_stress: float
    long_ratio_fixed_length: float
    long_ratio_fixed_share: float
    long_stress_fixed_share: str
    long_stress_fixed_length: str


def nucleation_statistics(
    problem: Problem,
    strength: RandomField,
    *,
    weights: Weights = "exact",
    infinite: bool = False,
    aspect: float | None = None,
) -> NucleationStatistics:
    """Exact mean and variance of the nucleation stress.

    Parameters
    ----------
    problem : Problem
        With uniform weakening rate, load and initial stress.
    strength : RandomField
    weights : {"exact", "rounded"}
        As in `nucleation_stress`.
    infinite : bool
        For an infinitely long interface and an untruncated spectrum instead of the problem's own.
    aspect : float, optional
        On a plane, the extent along x over that along y of the critical ellipse over which tau_n
        is the average; the middle one of `LocalCriterion` if left out. The least over several
        shapes, which `LocalCriterion` takes, has no moments in closed form.

    Returns
    -------
    NucleationStatistics

    Raises
    ------
    InputError
        If the weakening rate, the load or the initial stress varies along the interface, or a
        critical patch is larger than the interface.

    Notes
    -----
    Albertini et al. (2020, Eqs. B.2 and B.3): E[tau_n] = E[tau_p] and Var[tau_n] is the double
    integral of the correlation of tau_p against the weights. On a periodic interface it is a sum
    over wavenumbers of the spectrum of tau_p times the squared transform of the weight; on an
    infinite one quadrature of the correlation against the autocorrelation of the weight. The
    correlation is that of tau_p itself, by Hermite expansion (Grigoriu, 1995), not that of the
    Gaussian field.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> found = st.nucleation_statistics(problem, st.paper.strength(problem, correlation_ratio=2.0))
    >>> bool(0.0 < found.variance_ratio < 1.0)  # averaging lowers the variance
    True
    """
    load, initial = _uniform_load(problem, strength)
    check_flag("infinite", infinite)
    weight = weight_of(weights)
    total = math.pi / 2.0 * float(weight.sine[0])
    check_aspect(problem, weights, aspect)
    if problem.interface.is_plane:
        window = _window(problem, aspect)
        if infinite:
            ratio = plane_infinite_ratio(problem.interface, strength, window.weight)
        else:
            power = np.abs(window.spectrum) ** 2
            ratio = float(np.sum(strength_spectrum(problem, strength) * power))
        total = 1.0
    elif infinite:
        ratio = _infinite_ratio(problem, strength, weights)
    else:
        multiplier = multiplier_of(problem, problem.nucleation_length, weights)
        ratio = float(np.sum(strength_spectrum(problem, strength) * multiplier**2))
    variance = strength.standard_deviation**2
    return NucleationStatistics(
        mean=(strength.mean - initial) * total / load,
        variance=ratio * variance / load**2,
        strength_mean=strength.mean,
        strength_variance=variance,
    )


def strength_spectrum(problem: Problem, strength: RandomField) -> Array:
    """Share of Var[tau_p] at each wave of `Interface.transform`; it sums to 1."""
    interface = problem.interface
    power = interface.transform(strength.correlation(interface)).real / interface.size
    power[..., 1 : interface.shape[-1] // 2] *= 2.0
    return np.maximum(power, 0.0)


def nucleation_limits(problem: Problem, strength: RandomField) -> NucleationLimits:
    """Limits of short and long correlation length, with L and with L/xi_0 held fixed.

    Parameters
    ----------
    problem : Problem
    strength : RandomField
        With a spectrum that has a `correlation_length`.

    Returns
    -------
    NucleationLimits

    Raises
    ------
    InputError
        As `nucleation_statistics`, and if the spectrum has no correlation length.

    Notes
    -----
    For xi_0 << h_n the correlation acts as a delta function, and the double integral becomes
    (2/h_n) int g^2 ds int C dx (Albertini et al., 2020, Eq. B.5, with its constant).
    """
    load, initial = _uniform_load(problem, strength)
    xi = getattr(strength.spectrum, "correlation_length", None)
    if xi is None:
        raise InputError("strength.spectrum: a spectrum of your own has no correlation length")
    weight = weight_of("exact")
    plane = problem.interface.is_plane
    lags = np.linspace(0.0, REACH * xi, 16385)
    correlation = _strength_correlation(strength, lags)
    if plane:
        cell = problem.interface.cell
        stretched = strength.anisotropy or 1.0
        area = 2.0 * math.pi * stretched * float(simpson(correlation * lags, x=lags))
        square = float(np.sum(_window(problem, None).weight ** 2)) / cell
        slope = square * area * (problem.nucleation_length / xi) ** 2
    else:
        area = 2.0 * float(simpson(correlation, x=lags))
        slope = 2.0 * _square_integral(weight) * area / xi
    if strength.mean_mode:
        long_ratio = 1.0
        long_text = "the distribution of tau_p at a point: the interface is uniform"
    elif plane:
        long_ratio = plane_longest_ratio(problem, strength, _window(problem, None).spectrum)
        long_text = (
            "the minimum of one or two mapped sine waves of random amplitude: it no longer falls"
        )
    else:
        # One wave is left, of unit variance: its harmonics m carry c_m^2 through the map.
        h = problem.nucleation_length
        wave = 2.0 * math.pi / problem.interface.extent
        x = np.linspace(0.0, 1.0, 4096, endpoint=False)
        wave_correlation = np.cos(2.0 * math.pi * x)
        c = correlation_of_mapped(wave_correlation, hermite_coefficients(strength.marginal))
        power = np.abs(np.fft.rfft(c)) / x.size
        power[1:-1] *= 2.0
        multiplier = weight.multiplier(np.arange(64) * wave * h / 2.0)
        long_ratio = float(np.sum(power[:64] * multiplier**2))
        long_text = "the minimum of one mapped sine wave of random amplitude: it no longer falls"
    return NucleationLimits(
        short_slope=slope,
        short_stress=(strength.mean - initial) / load,
        long_ratio_fixed_length=long_ratio,
        long_ratio_fixed_share=1.0,
        long_stress_fixed_share="the distribution of min tau_p of the same field",
        long_stress_fixed_length=long_text,
    )


def _window(problem: Problem, aspect: float | None) -> EllipseWindow:
    """The critical ellipse of one aspect, by default the middle one."""
    rate = problem.uniform_rate
    if rate is None:
        raise InputError(
            "friction.weakening_rate: varies along the interface or with the strength, so there is"
            " no one critical patch"
        )
    aspect = middle_aspect(problem) if aspect is None else aspect
    window = window_of(problem, rate, aspect)
    if window is None:
        raise too_small(problem, rate, aspect)
    return window


def _uniform_load(problem: Problem, strength: RandomField) -> tuple[float, float]:
    check_instance("problem", problem, Problem)
    check_instance("strength", strength, RandomField)
    check_law(problem)
    problems = [
        f"load.{name}: varies along the interface, so tau_n is not stationary; sample it with"
        " st.monte_carlo instead"
        for name, value in (
            ("profile", problem.load_profile),
            ("initial_stress", problem.load.initial_stress),
        )
        if np.ptp(value) > 0.0
    ]
    if problems:
        raise InputError(problems)
    return float(np.max(problem.load_profile)), float(np.max(problem.load.initial_stress))


def _strength_correlation(strength: RandomField, lags: Array) -> Array:
    rho = strength.spectrum.untruncated_correlation(lags)
    return correlation_of_mapped(rho, hermite_coefficients(strength.marginal))


def _infinite_ratio(problem: Problem, strength: RandomField, weights: Weights) -> float:
    u, share = _autocorrelation(weights)
    lags = 0.5 * problem.nucleation_length * u
    return float(2.0 * np.sum(share * _strength_correlation(strength, lags)))


@lru_cache(maxsize=2)
def _autocorrelation(weights: Weights) -> tuple[Array, Array]:
    """Nodes u on [0, 2] and quadrature weights times int g(s) g(s + u) ds.

    Panels halve towards u = 0, where the correlation of a rough field has a kink and that of a
    short one all its content. The inner integrand falls like a root at both ends of the overlap,
    which Chebyshev's second rule takes exactly.
    """
    weight = weight_of(weights)
    x, w = np.polynomial.legendre.leggauss(POINTS)
    ends = np.concatenate(([0.0], 2.0 ** np.arange(2.0 - PANELS, 2.0)))
    width = np.diff(ends)[:, None]
    u = (ends[:-1, None] + 0.5 * width * (x + 1.0)).ravel()
    measure = (0.5 * width * w).ravel()
    t = np.arange(1, QUADRATURE + 1) * math.pi / (QUADRATURE + 1)
    half = (1.0 - 0.5 * u)[:, None]  # of the overlap
    s = half * np.cos(t)
    product = weight.at(s - 0.5 * u[:, None]) * weight.at(s + 0.5 * u[:, None])
    overlap = np.sum(product * np.sin(t), axis=1) * half[:, 0] * math.pi / (QUADRATURE + 1)
    return u, measure * overlap


def _square_integral(weight: Weight) -> float:
    """Integral of g^2 over [-1, 1]; g is a root times a polynomial, so Gauss is exact."""
    s, share = np.polynomial.legendre.leggauss(128)
    return float(np.sum(share * weight.at(s) ** 2))
