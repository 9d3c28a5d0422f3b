"""Onset of smooth strengths: to the criterion of Uenishi and Rice (2003)."""

import numpy as np
import pytest
from checks import assert_second_order
from oracles import angle_rule
from planes import WAVENUMBERS, moduli
from setups import LENGTH, RATE, exact_onset, make_problem, turns

from stiction.methods.criterion import eigenfunction
from stiction.methods.equilibrium.transforms.plane import plane_onset

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
    mean = np.sum(eigenfunction.weight(s) * np.exp(-((s / 4.0) ** 2)) * measure)
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


def plane_errors(nodes, wavenumbers):
    """Relative errors of the onset of a smooth plane, by numbers of nodes."""

    def onset(count, name):
        x, y = turns(count)[:, None], turns(count)[None, :]
        strength = 1e6 - 1.5e5 * np.cos(x) * np.cos(y) - 1e5 * np.cos(2.0 * x + y + 0.3)
        one = np.ones((count, count))
        plane = WAVENUMBERS[name]((8.0 * LENGTH, 8.0 * LENGTH), moduli(1e9, 0.33))
        found = plane_onset(plane, strength, one, RATE * one, 1e-8)
        assert found.closed
        return found.upper

    reference = onset(256, "spectral")
    return np.array([abs(onset(count, wavenumbers) / reference - 1.0) for count in nodes])


def test_lattice_converges_at_second_order_to_the_spectral_onset_which_is_faster():
    errors = plane_errors((48, 96, 192), "lattice")
    # Not exactly two: nodes join one by one, and the reference is not exact.
    assert 1.6 < np.log2(errors[:-1] / errors[1:]).mean() < 2.4
    assert errors[-1] < 2e-4
    assert np.all(plane_errors((48, 96), "spectral") < 0.5 * errors[:2])
