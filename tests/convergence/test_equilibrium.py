"""Onset of smooth strengths: to the criterion of Uenishi and Rice (2003)."""

import numpy as np
import pytest
from checks import assert_second_order
from oracles import angle_rule
from setups import exact_onset, make_problem

from stiction.methods.criterion import windows

pytestmark = pytest.mark.slow
DEPTH = 0.4e6


def relative_error(nodes_per_patch, periods):
    """Onset of a Gaussian dip two h_n wide against the weighted mean, as a share of its depth."""
    patch = make_problem().nucleation_length
    problem = make_problem(periods * nodes_per_patch, periods * patch)
    interface = problem.interface
    # The dip lies off the nodes, so that they do not share its symmetry.
    offset = (interface.x - 0.5 * interface.length + 0.3 * interface.spacing) / patch
    onset = exact_onset(problem, 1e6 - DEPTH * np.exp(-((offset / 2.0) ** 2)))
    s, measure = angle_rule(4000)
    mean = np.sum(windows.weight(s) * np.exp(-((s / 4.0) ** 2)) * measure)
    return abs(onset.first_instability.item() - (1e6 - DEPTH * mean)) / DEPTH


def test_second_order_in_the_spacing():
    # At L = 512 h_n the periodic images add less than 1e-7. The window of a patch is a whole number
    # of nodes, hence the scatter about the ratio of 4 of a second-order method.
    errors = [relative_error(per_patch, 512) for per_patch in (16, 32, 64)]
    assert_second_order(errors, 0.5)
    assert errors[2] < 3e-6


def test_images_fall_with_the_square_of_the_period():
    # On a grid fine enough, what is left is the images': they attract, and reduce the onset.
    assert_second_order([relative_error(128, periods) for periods in (8, 16)], 0.5)
