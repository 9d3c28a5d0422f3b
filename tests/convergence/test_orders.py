"""Orders of accuracy of ruptures and of onsets: in time step, spacing and period."""

import numpy as np
import pytest
from checks import assert_second_order
from oracles import angle_rule
from ruptures import dip, radiated_energy, stepped
from setups import QUARTER, exact_onset, make_problem

from stiction.methods.criterion.windows import weight


def rupture(nodes, steps):
    """A weak spot that breaks a whole interface at constant load; slip and radiated energy."""
    friction = {"weakening_rate": 2e11, "residual_strength": 2e5}
    problem = make_problem(nodes, solid=QUARTER, **friction)
    strength = 1e6 - 0.35e6 * dip(problem.interface, 0.05, 0.012)
    run, state = stepped(problem, strength, 7.5e5, 40e-6, steps)
    return state, radiated_energy(run, state)


def test_slip_and_radiated_energy_converge_with_second_order_in_time():
    reference, energy = rupture(256, 8000)
    assert reference.now["step"]["weakened_nodes"] == 256
    slips, energies = [], []
    for steps in (500, 1000, 2000):
        state, radiated = rupture(256, steps)
        slips.append(np.abs(state.slip - reference.slip).max() / reference.slip.max())
        energies.append(abs(radiated / energy - 1.0))
    # The reference's own error (1/64 of the last) and nodes that stop and go between steps leave
    # the ratio between 3.7 and 4.4.
    assert_second_order(slips, 0.6)
    assert_second_order(energies, 0.6)
    assert slips[2] < 3e-4
    assert energies[2] < 1e-4


def test_slip_converges_with_second_order_in_space():
    reference, _ = rupture(2048, 3000)
    errors = []
    for nodes in (128, 256, 512):
        state, _ = rupture(nodes, 3000)
        fine = reference.slip[:: 2048 // nodes]
        errors.append(np.abs(state.slip - fine).max() / fine.max())
    assert_second_order(errors, 0.8)  # with the kink of the law at d_c between 3.4 and 4.6


DEPTH = 0.4e6


def relative_error(nodes_per_patch, periods):
    """Onset of a Gaussian dip two h_n wide against the weighted mean, as a share of its depth.

    The weights are those of Uenishi and Rice (2003).
    """
    patch = make_problem().nucleation_length
    problem = make_problem(periods * nodes_per_patch, periods * patch)
    interface = problem.interface
    # The dip lies off the nodes, so that they do not share its symmetry.
    offset = (interface.x - 0.5 * interface.length + 0.3 * interface.spacing) / patch
    onset = exact_onset(problem, 1e6 - DEPTH * np.exp(-((offset / 2.0) ** 2)))
    s, measure = angle_rule(4000)
    mean = np.sum(weight(s) * np.exp(-((s / 4.0) ** 2)) * measure)
    return abs(onset.first_instability.item() - (1e6 - DEPTH * mean)) / DEPTH


@pytest.mark.slow
def test_the_onset_of_a_smooth_strength_is_of_second_order_in_the_spacing():
    # At L = 512 h_n the periodic images add less than 1e-7. The window of a patch is a whole number
    # of nodes, hence the scatter about the ratio of 4 of a second-order method.
    errors = [relative_error(per_patch, 512) for per_patch in (16, 32, 64)]
    assert_second_order(errors, 0.5)
    assert errors[2] < 3e-6


@pytest.mark.slow
def test_images_fall_with_the_square_of_the_period():
    # On a grid fine enough, what is left is the images': they attract, and reduce the onset.
    assert_second_order([relative_error(128, periods) for periods in (8, 16)], 0.5)
