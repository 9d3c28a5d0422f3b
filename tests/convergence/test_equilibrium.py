"""Equilibrium of one smooth dip in strength tends to the criterion of Uenishi and Rice (2003)."""

from __future__ import annotations

import numpy as np
import pytest

import stiction as st
from stiction.criterion import eigenfunction
from stiction.equilibrium.method import Equilibrium

DEPTH = 0.4e6


def relative_error(nodes_per_patch, periods):
    """Onset of a Gaussian dip two h_n wide against the weighted mean, as a share of its depth."""
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
    friction = st.LinearWeakening(weakening_rate=0.5e12)
    patch = 2.0 * 0.5788869418506 * solid.effective_modulus() / 0.5e12
    interface = st.Interface(length=periods * patch, nodes=periods * nodes_per_patch)
    problem = st.Problem(solid, interface, friction)
    # The dip lies off the nodes, so that they do not share its symmetry.
    offset = (interface.x - 0.5 * interface.length + 0.3 * interface.spacing) / patch
    onset = st.onset(
        problem, 1e6 - DEPTH * np.exp(-((offset / 2.0) ** 2)), method=Equilibrium()
    )
    t = (np.arange(4000) + 0.5) * np.pi / 4000.0
    measure = np.sin(t) * np.pi / 4000.0
    mean = np.sum(eigenfunction.weight(np.cos(t)) * np.exp(-((np.cos(t) / 4.0) ** 2)) * measure)
    return abs(onset.first_instability.item() - (1e6 - DEPTH * mean)) / DEPTH


@pytest.mark.slow
def test_second_order_in_the_spacing():
    # At L = 512 h_n the periodic images add less than 1e-7. The window of a patch is a whole number
    # of nodes, hence the scatter about the ratio of 4 of a second-order method.
    errors = [relative_error(per_patch, 512) for per_patch in (16, 32, 64)]
    assert 3.5 < errors[0] / errors[1] < 4.5
    assert 3.5 < errors[1] / errors[2] < 4.5
    assert errors[2] < 3e-6


@pytest.mark.slow
def test_images_fall_with_the_square_of_the_period():
    # On a grid fine enough, what is left is the images': they attract, and reduce the onset.
    errors = [relative_error(128, periods) for periods in (8, 16)]
    assert 3.5 < errors[0] / errors[1] < 4.5
