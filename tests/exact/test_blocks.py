"""Closed forms and limits of the response of finite blocks."""

import numpy as np
import pytest

import stiction as st
from stiction.elasticity.blocks import Pushes, block_response, glued_pressure

KAPPA = (3.0 - 0.35) / (1.0 + 0.35)  # plane stress, nu = 0.35
MODULUS = 1.3e9  # Pa
EFFECTIVE = 4.0 * MODULUS / (KAPPA + 1.0)


@pytest.mark.parametrize(("kappa", "published"), [(KAPPA, 0.445), (None, 0.579)])
def test_the_smallest_unstable_patch_at_a_free_end(kappa, published):
    """a W/G* in the limit of many nodes: half of the middle's in mode III, less in mode II."""
    nodes, modulus = 1200, EFFECTIVE if kappa else MODULUS
    response = block_response(3.0, nodes, 3.0, MODULUS, kappa, None)
    lengths = {}
    for members in (15, 30):
        least = np.linalg.eigvalsh(response.stiffness[:members, :members])[0]
        lengths[members] = members * 3.0 / nodes * least / modulus
    assert 2.0 * lengths[30] - lengths[15] == pytest.approx(published, rel=1e-3)


@pytest.mark.parametrize("kappa", [3.0 - 4.0 * 0.45, None])
@pytest.mark.parametrize("pushes", [None, Pushes(("right",), 0.03, 0.02)])
def test_a_uniform_slip_is_free_and_stiffness_is_symmetric(kappa, pushes):
    stiffness, shear, *_ = block_response(0.1, 96, 0.07, MODULUS, kappa, pushes)
    scale = stiffness[0, 0]
    assert np.abs(stiffness.sum(axis=1)).max() < 1e-12 * scale
    assert np.abs(stiffness - stiffness.T).max() < 1e-12 * scale
    assert np.linalg.eigvalsh(stiffness)[1] > 0.0
    assert shear.mean() == pytest.approx(1.0, rel=1e-12)


def test_a_clamped_strip_in_mode_three():
    """K(x) = -pi G/(8 H²)/sinh²(pi x/2H) below a platen that is held."""
    length, height, nodes = 1.0, 0.11, 1000
    dx = length / nodes
    stiffness, shear, drive, _ = block_response(length, nodes, height, MODULUS, None, None)
    held = stiffness + 0.5 * dx * drive / length**2 * np.outer(shear, shear)
    away = np.array([0.05, 0.1, 0.2])
    kernel = -np.pi * MODULUS / (8.0 * height**2) / np.sinh(0.5 * np.pi * away / height) ** 2
    steps = np.rint(away / dx).astype(int)
    np.testing.assert_allclose(held[500, 500 + steps] / dx, kernel, rtol=1e-3)


def test_a_push_in_mode_three_carries_its_force_and_decays():
    """Laplace's equation in the block by a sum of sines; far away the least one is left."""
    height = 0.04
    _, shear, *_ = block_response(
        0.2, 400, height, MODULUS, None, Pushes(("left",), 0.015, 0.01)
    )
    k, dx = 0.5 * np.pi / height, 0.2 / 400
    cosh = np.cosh(k * (0.2 - (np.array([200, 240]) + 0.5) * dx))
    assert shear[200] / shear[240] == pytest.approx(cosh[0] / cosh[1], rel=1e-3)
    assert shear[0] > 3.0


def test_flat_blocks_of_rubber_open_below_glue():
    """Finite elements agree: the least pressure is -0.12 of the mean, at the ends."""
    pressure = glued_pressure(1.0, 80, 0.0973, 3.0 - 4.0 * 0.4999)
    assert pressure[[0, -1]] == pytest.approx(-0.1192, abs=1e-4)
    with pytest.raises(st.InputError, match=r"opens the interface at .*-0\.119"):
        st.Problem(
            st.Solid(youngs_modulus=1e7, poisson_ratio=0.4999, density=1100.0),
            st.Interface(1.0, 80), st.LinearWeakening(weakening_rate=1e7),
            st.Load(normal_pressure=1e5), specimen=st.Blocks(height=0.0973, pressing="glued"),
        )  # fmt: skip


@pytest.mark.parametrize("mode", [KAPPA, None])
def test_a_push_of_any_size_at_any_place(mode):
    """No slip is pushed back, and the mean of two halves of a push is the whole push."""
    response = {}
    for low, high in ((0.0, 1.0), (0.0, 0.5), (0.5, 1.0), (1.0 - 1e-4, 1.0), (0.0, 1e-4)):
        pushes = Pushes(("left",), 0.5 * (low + high) * 0.04, (high - low) * 0.04)
        response[low, high] = block_response(0.1, 50, 0.04, MODULUS, mode, pushes)
        assert response[low, high].shear.min() > 0.0
    halves = response[0.0, 0.5].shear, response[0.5, 1.0].shear
    # Each is over its own mean at the nodes, which misses a part of the peak of the lower half.
    share = np.linalg.lstsq(np.transpose(halves), response[0.0, 1.0].shear, rcond=None)
    assert share[1] < 1e-20
    assert share[0] == pytest.approx(0.5, abs=1e-2)
