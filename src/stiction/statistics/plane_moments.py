"""Variance ratios of the nucleation stress on planes beyond that of the discrete problem itself."""

from __future__ import annotations

import math

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.interface import Interface
from stiction.problem import Problem
from stiction.random.mapping import correlation_of_mapped, hermite_coefficients
from stiction.random.random_field import RandomField
from stiction.random.spectra import CustomSpectrum


def plane_infinite_ratio(interface: Interface, strength: RandomField, weight: Array) -> float:
    """Var[tau_n]/Var[tau_p] on an infinite plane, with an untruncated spectrum.

    Parameters
    ----------
    interface : Interface
        Whose nodes the weight is on; only the distances between them matter.
    strength : RandomField
    weight : (nx, ny) array
        Of unit sum, around node (0, 0).

    Notes
    -----
    The double sum of weights and correlations over pairs of nodes, by the autocorrelation of the
    weight on a grid twice as large, on which it does not meet its images.
    """
    if isinstance(strength.spectrum, CustomSpectrum):
        raise InputError(
            "infinite: the correlation of a spectrum of your own is not known on an infinite plane"
        )
    lengths, shape = interface.lengths, interface.shape
    alone = Interface((2.0 * lengths[0], 2.0 * lengths[1]), (2 * shape[0], 2 * shape[1]))
    padded = np.zeros(alone.shape)
    places = np.ix_(*(np.rint(np.fft.fftfreq(n) * n).astype(np.int64) % (2 * n) for n in shape))
    padded[places] = weight
    shared = alone.inverse_transform(np.abs(alone.transform(padded)) ** 2)
    x, y = (
        np.fft.fftfreq(n) * length for n, length in zip(alone.shape, alone.lengths, strict=True)
    )
    apart = np.hypot(x[:, None], y[None, :] / (strength.anisotropy or 1.0))
    rho = strength.spectrum.untruncated_correlation(apart)
    correlation = correlation_of_mapped(rho, hermite_coefficients(strength.marginal))
    return float(np.sum(shared * correlation))


def plane_longest_ratio(problem: Problem, strength: RandomField, window: Array) -> float:
    """Var[tau_n]/Var[tau_p] where only the longest waves of the plane are left.

    Parameters
    ----------
    problem : Problem
    strength : RandomField
        Without the mean mode.
    window : (nx, ny//2 + 1) array
        Transform of the weight.
    """
    interface = problem.interface
    stretched = np.array([1.0, strength.anisotropy or 1.0])
    waves = 2.0 * math.pi / np.array(interface.lengths) * stretched
    left = waves <= waves.min() * (1.0 + 1e-9)
    x, y = interface.coordinates.values()
    rho = np.zeros(interface.shape)
    for places, length, counts in zip(
        (x[:, None], y[None, :]), interface.lengths, left, strict=True
    ):
        if counts:
            rho = rho + np.cos(2.0 * math.pi * places / length) / left.sum()
    correlation = correlation_of_mapped(rho, hermite_coefficients(strength.marginal))
    power = interface.transform(correlation).real / interface.size
    power[..., 1 : interface.shape[-1] // 2] *= 2.0
    return float(np.sum(power * np.abs(window) ** 2))
