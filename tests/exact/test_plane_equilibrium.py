"""Equilibrium of planes where the answer is known: the line in both modes, patches, uniform."""

import numpy as np
import pytest
from planes import Lattice, moduli
from setups import RATE, exact_onset, make_problem, repeated, turns

import stiction as st
from stiction.elasticity.protocol import HalfSpaces
from stiction.methods.criterion.windows import ellipse_window
from stiction.methods.equilibrium.patches import labelled_patches, patch_of
from stiction.methods.equilibrium.transforms.plane import doubled, halved, plane_onset

NODES, LENGTH = 128, 0.04
UNEVEN = {
    "initial_stress": np.linspace(0.0, 2e5, NODES),
    "profile": np.linspace(1.0, 1.2, NODES),
}


@pytest.mark.parametrize(
    ("mode", "across", "load"), [("II", 8, UNEVEN), ("III", 12, UNEVEN), ("III", 8, {})]
)
def test_strength_along_one_axis_equals_the_line(mode, across, load):
    axis, turn = (0, 1) if mode == "II" else (1, -1)
    line = make_problem(NODES, LENGTH, load=st.Load(**load), mode=mode)
    short = LENGTH / NODES * across
    wide = st.Load(**{name: repeated(profile, across, axis) for name, profile in load.items()})
    plane = make_problem((NODES, across)[::turn], (LENGTH, short)[::turn], load=wide)
    strength = st.paper.strength(line, correlation_ratio=1.0)
    tau_p = strength.sample(line.interface, samples=3, seed=1)
    exact = exact_onset(line, tau_p)
    options = {"tolerance": 1e-10, "slip": True}
    found = exact_onset(plane, repeated(tau_p, across, axis), **options)
    # 1e-10 is the gap that was asked for, and about that of the line.
    for name in ("first_instability", "critical_load", "critical_stress"):
        assert found[name].values == pytest.approx(exact[name].values, rel=1e-9)
    upper = found["first_instability"] + found["certificate_gap"]
    assert upper.values == pytest.approx(exact["first_instability"].values, rel=1e-9)
    along, still = "xy"[::turn]
    assert float(found["slip"].std(still).max()) < 1e-6 * float(found["slip"].max())
    # The line's patch is all of a run, the plane's where y is above a tenth of its largest value.
    place = found["critical_position"].sel(direction=along).values
    assert np.abs(place - exact["critical_position"].values).max() < 2.0 * LENGTH / NODES
    extent = found["critical_patch_extent"]
    assert extent.sel(direction=still).values == pytest.approx(short, rel=1e-12)
    reach = np.abs(extent.sel(direction=along).values - exact["critical_patch_length"].values)
    assert reach.max() <= 4.0 * LENGTH / NODES


def test_patches_are_connected_by_edges_and_across_the_borders():
    mask = np.zeros((8, 10), dtype=bool)
    mask[0, 0] = mask[7, 0] = mask[7, 9] = True  # one patch around a corner of the map
    mask[3, 3] = mask[4, 4] = True  # two that share no edge
    mask[5, 7:9] = True
    numbers, count = labelled_patches(mask)
    assert count == 4
    assert numbers[0, 0] == numbers[7, 0] == numbers[7, 9] > 0
    assert numbers[3, 3] != numbers[4, 4]
    assert set(np.unique(numbers)) == {0, 1, 2, 3, 4}
    assert labelled_patches(np.zeros((4, 4), dtype=bool))[1] == 0
    assert labelled_patches(np.ones((4, 4), dtype=bool))[1] == 1
    spiral = np.zeros((6, 6), dtype=bool)
    spiral[::2] = True  # three stripes, each closed along y
    assert labelled_patches(spiral)[1] == 3


def test_extents_and_centre_of_a_patch_across_the_borders():
    mask = np.zeros((8, 10), dtype=bool)
    for i in (7, 0, 1):
        mask[i, [8, 9, 0]] = True
    patch = patch_of(mask, mask.astype(float), (0.5, 2.0))
    assert patch.centre == pytest.approx((0.0, 18.0))
    assert patch.extents == (1.5, 6.0)
    assert patch.area == 9.0
    ring = np.zeros((8, 10), dtype=bool)
    ring[:, 4] = True
    patch = patch_of(ring, ring.astype(float), (0.5, 2.0))
    assert patch.extents == (4.0, 2.0)
    assert patch.centre[1] == 8.0


def test_critical_disc_at_zero_poisson_ratio():
    # First eigenvalue of the square root of the Laplacian on the unit disc: 2.0061.
    radius = 2.0061 * 1e9 / (2.0 * RATE)
    length = 24.0 * radius  # images change the eigenvalue by some (radius/length)^3
    errors = []
    for nodes in (96, 192, 384):
        plane = Lattice((length, length), moduli(1e9, 0.0))
        window = ellipse_window(plane, (nodes, nodes), RATE, 1.0)
        effective = np.sqrt(window.area / np.pi)
        errors.append(1.0 - effective * window.eigenvalue / RATE / radius)
    # Of first order, since where a disc ends on the grid is uncertain by a share of the spacing.
    assert 0.0 < errors[2] < 0.015
    assert errors[2] < 0.6 * errors[1] < 0.36 * errors[0]


def test_grid_transfer_keeps_linear_and_uniform_fields():
    x = np.arange(16.0)[:, None] + np.zeros((16, 12))
    assert np.allclose(halved(x)[1:-1], x[2:-2:2, ::2], rtol=0, atol=1e-12)
    assert np.allclose(doubled(x)[:-2, 0], 0.5 * np.arange(30), rtol=0, atol=1e-12)
    assert np.all(halved(np.ones((8, 6))) == 1.0)


@pytest.mark.parametrize("nodes", [16, 128])
def test_onset_close_to_the_weakest_node(nodes):
    one, plane = np.ones((nodes, nodes)), HalfSpaces((0.03, 0.03), moduli(1e9, 0.33))
    # So wide a weak strip that the first node to slip is nearly unstable; views of any layout.
    wave = np.asfortranarray(1e6 + 1e5 * np.cos(turns(nodes))[:, None] * one)
    found = plane_onset(plane, wave, np.broadcast_to(1.0, one.shape), RATE * one)
    assert found.closed(1e-6)
    assert 0.9e6 < found.lower < 1e6
