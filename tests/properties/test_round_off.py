"""Round-off of heights moves no stiffness of blocks. tests/contracts moves profiles."""

import numpy as np
import pytest
from checks import assert_close
from specimens import crooked

import stiction as st


def moved(values, seed=8):
    """Values that change by up to 1e-12 of themselves."""
    change = np.random.default_rng(seed).uniform(-1e-12, 1e-12, np.shape(values))
    return values * (1.0 + change)


@pytest.mark.parametrize(
    ("centre", "width", "more"),
    [(0.9, 0.2, {}), (0.04, 0.08, {"stiffness": 2e7}), (0.5, 1.0, {"side": "both"})],
    ids=["at the top", "at the interface", "all of both sides"],
)
def test_round_off_of_heights_moves_no_block(centre, width, more):
    """Of blocks and of pushers that end together."""
    blocks = []
    for exact in (True, False):
        height, at, wide = 0.025 * np.array([1.0, centre, width])
        height, at, wide = (height, at, wide) if exact else moved(np.array([height, at, wide]))
        drive = st.Pusher(height=float(at), width=float(wide), **more)
        found = crooked(height=float(height), drive=drive).blocks
        names = "stiffness", "shear", "pressure", "drive_stiffness"
        blocks.append({name: getattr(found, name) for name in names})
    assert_close(*blocks, 1e-7)
