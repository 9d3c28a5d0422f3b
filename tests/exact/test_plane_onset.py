"""Planes where the answer is known: the line in modes II and III, the critical disc, uniform."""

from __future__ import annotations

import numpy as np
import pytest
from planes import WAVENUMBERS, Lattice
from setups import RATE, make_problem

import stiction as st
from stiction.criterion.windows import ellipse_window
from stiction.elasticity.operator import make_operator, product
from stiction.equilibrium.method import Equilibrium
from stiction.equilibrium.transforms import Plane, doubled, halved, plane_onset


@pytest.mark.parametrize("mode", ["II", "III"])
@pytest.mark.parametrize("across", [8, 12])
def test_strength_along_one_axis_equals_the_line(mode, across):
    problem = make_problem(128, 0.04, mode=mode)
    strength = st.paper.strength(problem, correlation_ratio=1.0)
    tau_p = strength.sample(problem.interface, samples=3, seed=1)
    line = st.onset(problem, tau_p, method=Equilibrium())["first_instability"].values
    lengths = (0.04, 0.04 / 128 * across)
    plane = Plane(lengths if mode == "II" else lengths[::-1], 1e9, 0.33)
    for profile, exact in zip(tau_p, line, strict=True):
        field = np.repeat(profile[:, None], across, axis=1)
        field = field if mode == "II" else np.ascontiguousarray(field.T)
        one = np.ones(field.shape)
        found = plane_onset(plane, field, one, RATE * one, gap=1e-10)
        assert found.lower == pytest.approx(exact, rel=1e-9)
        assert found.upper == pytest.approx(exact, rel=1e-9)


def test_critical_disc_at_zero_poisson_ratio():
    # First eigenvalue of the square root of the Laplacian on the unit disc: 2.0061.
    radius = 2.0061 * 1e9 / (2.0 * RATE)
    length = 24.0 * radius  # images change the eigenvalue by some (radius/length)^3
    errors = []
    for nodes in (96, 192, 384):
        symbol = Lattice((length, length), 1e9, 0.0).symbol((nodes, nodes))
        window = ellipse_window(symbol, (nodes, nodes), (length, length), RATE, 1.0)
        effective = np.sqrt(window.area / np.pi)
        errors.append(1.0 - effective * window.eigenvalue / RATE / radius)
    # Of first order, since where a disc ends on the grid is uncertain by a share of the spacing.
    assert 0.0 < errors[2] < 0.015
    assert errors[2] < 0.6 * errors[1] < 0.36 * errors[0]


@pytest.mark.parametrize("wavenumbers", ["spectral", "lattice"])
def test_symbol_of_single_waves(wavenumbers):
    shape, lengths = (32, 24), (2.0, 3.0)
    symbol = WAVENUMBERS[wavenumbers](lengths, 1e9, 0.25).symbol(shape)
    operator = make_operator(symbol, 1e8, shape)
    x = np.arange(32)[:, None] / 32 * 2.0 + np.zeros(shape)
    y = np.arange(24)[None, :] / 24 * 3.0 + np.zeros(shape)
    for kx, ky, wave in ((2, 0, np.cos(2 * np.pi * x)), (0, 1, np.sin(2 * np.pi * y / 3.0))):
        k = 2.0 * np.pi * np.hypot(kx / 2.0, ky / 3.0)
        if wavenumbers == "lattice":
            spacing = 2.0 / 32 if kx else 3.0 / 24
            k = 2.0 / spacing * np.sin(0.5 * k * spacing)
        expected = 0.5e9 * k / (0.75 if kx else 1.0) - 1e8
        out = np.empty(wave.size)
        product(operator, wave.flatten(), out)
        assert np.abs(out - expected * wave.flatten()).max() < 1e-12 * expected


@pytest.mark.parametrize("poisson_ratio", [0.0, 0.33, 0.45])
def test_lattice_stiffness_is_a_z_matrix(poisson_ratio):
    column = np.fft.irfft2(Lattice((1.0, 1.0), 1.0, poisson_ratio).symbol((64, 64)))
    assert column.flat[1:].max() <= 1e-12 * column[0, 0]


def test_uniform_strength_slides_at_it():
    one = np.ones((16, 16))
    found = plane_onset(Plane((0.02, 0.02), 1e9, 0.33), 0.7e6 * one, one, RATE * one)
    assert found.lower == found.upper == 0.7e6


def test_plane_too_small_for_a_patch_slides_near_the_mean():
    # Stiffness evens out the stress of a plane much smaller than the critical patch.
    one = np.ones((16, 16))
    strength = np.random.default_rng(0).uniform(0.9e6, 1.1e6, one.shape)
    found = plane_onset(Plane((2e-4, 2e-4), 1e9, 0.33), strength, one, RATE * one)
    assert found.closed
    assert found.upper == pytest.approx(strength.mean(), rel=1e-3)
    assert found.upper <= strength.mean() * (1.0 + 1e-9)


def test_grid_transfer_keeps_linear_and_uniform_fields():
    x = np.arange(16.0)[:, None] + np.zeros((16, 12))
    assert np.allclose(halved(x)[1:-1], x[2:-2:2, ::2], rtol=0, atol=1e-12)
    assert np.allclose(doubled(x)[:-2, 0], 0.5 * np.arange(30), rtol=0, atol=1e-12)
    assert np.all(halved(np.ones((8, 6))) == 1.0)


@pytest.mark.parametrize("nodes", [16, 32, 128])
def test_onset_close_to_the_weakest_node_or_to_the_mean(nodes):
    one = np.ones((nodes, nodes))
    plane = Plane((0.03, 0.03), 1e9, 0.33)
    uniform = plane_onset(plane, 0.9e6 * one, one, RATE * one)
    assert uniform.lower == uniform.upper == 0.9e6
    # So wide a weak strip that the first node to slip is nearly unstable.
    wave = 1e6 + 1e5 * np.cos(2.0 * np.pi * np.arange(nodes) / nodes)[:, None] * one
    # Views of any layout are taken.
    view = np.broadcast_to(1.0, one.shape)
    found = plane_onset(plane, np.asfortranarray(wave), view, RATE * one)
    assert found.closed
    assert 0.9e6 < found.lower < 1e6
