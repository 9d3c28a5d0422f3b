"""st.Equilibrium on planes where the answer is known: the line in both modes, and patches."""

from __future__ import annotations

import numpy as np
import pytest
from setups import make_problem

import stiction as st
from stiction.equilibrium.patches import labelled_patches, patch_of


@pytest.mark.filterwarnings("ignore::stiction.UnitWarning")
@pytest.mark.parametrize("mode", ["II", "III"])
def test_strength_along_one_axis_equals_the_line(mode):
    nodes, across, length = 128, 8, 0.04
    load = {
        "initial_stress": np.linspace(0.0, 2e5, nodes),
        "profile": np.linspace(1.0, 1.2, nodes),
    }
    line = make_problem(nodes, length, load=st.Load(**load), mode=mode)
    short = length / nodes * across

    def spread(profile):
        wide = np.repeat(profile[..., None], across, axis=-1)
        return wide if mode == "II" else np.swapaxes(wide, -1, -2)

    turn = 1 if mode == "II" else -1
    wide = st.Load(**{name: spread(profile) for name, profile in load.items()})
    plane = make_problem((nodes, across)[::turn], (length, short)[::turn], load=wide)
    tau_p = st.paper.strength(line, correlation_ratio=1.0).sample(
        line.interface, samples=3, seed=1
    )
    exact = st.onset(line, tau_p, method=st.Equilibrium(sensitivity=True))
    found = st.onset(
        plane, spread(tau_p), method=st.Equilibrium(gap=1e-10, sensitivity=True, slip=True)
    )
    # 1e-10 is the gap that was asked for, and about that of the line.
    for name in ("first_instability", "critical_load", "critical_stress"):
        assert found[name].values == pytest.approx(exact[name].values, rel=1e-9)
    along, still = ("x", "y") if mode == "II" else ("y", "x")
    summed = found["sensitivity"].sum(still).values
    # The multiplier is that of a load 1e-10 off; its own error goes with the root of the gap.
    assert summed == pytest.approx(exact["sensitivity"].values, abs=1e-4 * summed.max())
    assert float(found["slip"].std(still).max()) < 1e-6 * float(found["slip"].max())
    # The line's patch is all of a run, the plane's where y is above a tenth of its largest value.
    place = found["critical_position"].sel(direction=along).values
    assert np.abs(place - exact["critical_position"].values).max() < 2.0 * length / nodes
    extent = found["critical_patch_extent"]
    assert extent.sel(direction=still).values == pytest.approx(short, rel=1e-12)
    reach = np.abs(extent.sel(direction=along).values - exact["critical_patch_length"].values)
    assert reach.max() <= 4.0 * length / nodes


def test_uniform_strength_slides_at_it():
    plane = make_problem((64, 128), (0.02, 0.03))
    found = st.onset(plane, np.full((64, 128), 0.9e6), method=st.Equilibrium())
    assert found["critical_load"].item() == 0.9e6
    assert found["certificate_gap"].item() == 0.0
    assert found["critical_patch_area"].item() == pytest.approx(0.02 * 0.03)
    assert found["critical_patch_extent"].values[0] == pytest.approx((0.02, 0.03))


def test_a_single_dip_is_where_the_onset_is():
    lengths = (0.03, 0.02)
    plane = make_problem((128, 96), lengths)
    centre = 0.029, 0.004  # near a border, so that the patch lies on both sides of it
    x, y = (
        (plane.interface.coordinates[dim] - c + 0.5 * length) % length - 0.5 * length
        for dim, c, length in zip("xy", centre, lengths, strict=True)
    )
    strength = 1e6 - 3e5 * np.exp(-(x[:, None] ** 2 + y[None, :] ** 2) / 4e-3**2)
    found = st.onset(plane, strength, method=st.Equilibrium(slip=True))
    # A tenth of a spacing.
    assert found["critical_position"].values[0] == pytest.approx(centre, abs=2e-5)
    assert found["slip_patches"].item() == 1
    slips = found["slip"].values[0] > 0.0
    whole = patch_of(slips, found["slip"].values[0], plane.interface.spacings)
    # y is below a tenth of its largest value in the outermost nodes only: one or two on each side.
    shorter = np.array(whole.extents) - found["critical_patch_extent"].values[0]
    assert (shorter >= 0.0).all()
    assert (shorter <= 4.0 * np.array(plane.interface.spacings)).all()
    assert 0.8 * whole.area < found["critical_patch_area"].item() <= whole.area
    # Mode II along x is the stiffer one: the patch is longer there.
    assert np.diff(found["critical_patch_extent"].values[0]).item() < 0.0


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
