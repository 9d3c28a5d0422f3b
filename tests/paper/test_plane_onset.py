"""The paper's strength on a plane of 8 h_n: mean onset, local over exact, and the slipping share.

The expected figures are means of 12 other samples from an independent bisection in plain numpy on
96 x 96 nodes, rounded as printed; their standard deviations give the errors allowed here.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import beta

import stiction as st
from stiction.criterion.average import least_average
from stiction.criterion.windows import ellipse_window
from stiction.equilibrium.transforms import Plane, plane_onset

RATE = 0.5e12
NUCLEATION = 2.0 * 0.5788869418506 * 1e9 / 0.67 / RATE
SHAPE = (96, 96)
PLANE = Plane((8.0 * NUCLEATION, 8.0 * NUCLEATION), 1e9, 0.33)
INTERFACE = st.Interface(PLANE.lengths, SHAPE)
SAMPLES = 6


def paper_strength(ratio, rng):
    """Beta(1.5, 3) on [0.66, 1.66] MPa; (k^2 + lambda^2)^-4.5 up to 2.5 lambda."""
    wavenumber = 2.0 * np.pi / (ratio * NUCLEATION)
    mode = np.fft.fftfreq(SHAPE[0]) * SHAPE[0]
    k = 2.0 * np.pi / PLANE.lengths[0] * np.hypot(mode[:, None], mode[None, :])
    amplitude = (k**2 + wavenumber**2) ** -2.25
    amplitude[(k > 2.5 * wavenumber) | (k == 0.0)] = 0.0
    amplitude /= np.sqrt((amplitude**2).sum())
    draws = rng.standard_normal(SHAPE) + 1j * rng.standard_normal(SHAPE)
    normal = np.fft.ifft2(amplitude * draws).real * amplitude.size
    return 0.66e6 + 1e6 * beta.ppf(ndtr(normal), 1.5, 3.0)


@pytest.fixture(scope="module")
def windows():
    symbol = PLANE.symbol(SHAPE)
    aspects = (1.0, 1.25, 1.0 / 0.67)
    return [ellipse_window(symbol, SHAPE, PLANE.lengths, RATE, aspect) for aspect in aspects]


@pytest.mark.parametrize(
    ("ratio", "onset", "deviation", "excess", "slipping"),
    [
        (0.25, 0.838e6, 0.012e6, 0.036, 0.43),
        (0.5, 0.765e6, 0.018e6, 0.028, 0.21),
        (1.0, 0.707e6, 0.018e6, 0.011, 0.07),
        (2.0, 0.686e6, 0.016e6, 0.003, 0.03),
    ],
)
def test_figures_of_planes(windows, ratio, onset, deviation, excess, slipping):
    rng = np.random.default_rng(int(100 * ratio))
    one = np.ones(SHAPE)
    loads, over, share = [], [], []
    for _ in range(SAMPLES):
        strength = paper_strength(ratio, rng)
        found = plane_onset(PLANE, strength, one, RATE * one)
        assert found.closed
        loads.append(found.lower)
        least = least_average(INTERFACE, windows, strength[None], one).load[0]
        over.append(least / found.lower - 1.0)
        share.append((found.slip > 0.0).mean())
    # Three standard errors of the difference of the two means.
    error = 3.0 * deviation * np.sqrt(1.0 / 12.0 + 1.0 / SAMPLES)
    assert np.mean(loads) == pytest.approx(onset, abs=error)
    # Without their deviations, those of these samples.
    for values, expected in ((over, excess), (share, slipping)):
        error = 3.0 * np.std(values, ddof=1) * np.sqrt(1.0 / 12.0 + 1.0 / SAMPLES)
        assert np.mean(values) == pytest.approx(expected, abs=max(error, 0.1 * expected))
