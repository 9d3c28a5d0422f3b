"""Onset of a plane of smooth strength against the spacing of the nodes."""

from __future__ import annotations

import numpy as np
import pytest
from planes import WAVENUMBERS

from stiction.equilibrium.transforms import plane_onset

RATE = 0.5e12
LENGTH = 8.0 * 3.46e-3


def smooth_onset(nodes, wavenumbers):
    x = np.arange(nodes)[:, None] / nodes * 2.0 * np.pi
    y = np.arange(nodes)[None, :] / nodes * 2.0 * np.pi
    strength = 1e6 - 1.5e5 * np.cos(x) * np.cos(y) - 1e5 * np.cos(2.0 * x + y + 0.3)
    one = np.ones((nodes, nodes))
    plane = WAVENUMBERS[wavenumbers]((LENGTH, LENGTH), 1e9, 0.33)
    found = plane_onset(plane, strength, one, RATE * one, 1e-8)
    assert found.closed
    return found.upper


@pytest.mark.slow
def test_lattice_converges_at_second_order_to_the_spectral_onset():
    reference = smooth_onset(256, "spectral")
    errors = [abs(smooth_onset(nodes, "lattice") / reference - 1.0) for nodes in (48, 96, 192)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    # Not exactly two: nodes join one by one, and the reference is not exact.
    assert 1.6 < orders.mean() < 2.4
    assert errors[-1] < 2e-4


@pytest.mark.slow
def test_spectral_converges_faster():
    reference = smooth_onset(256, "spectral")
    for nodes in (48, 96):
        spectral = abs(smooth_onset(nodes, "spectral") / reference - 1.0)
        assert spectral < 0.5 * abs(smooth_onset(nodes, "lattice") / reference - 1.0)
