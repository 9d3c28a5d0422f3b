"""What any rupture on a plane must obey: symmetry, energy, order in time, restarts."""

import numpy as np
import pytest
from checks import assert_second_order
from ruptures import BREAKING_PLANE, BREAKING_STRENGTH, dip, radiated_energy, stepped

import stiction as st
from stiction.methods.dynamics.simulate import simulate_rupture

pytestmark = pytest.mark.filterwarnings("ignore::stiction.AccuracyWarning")

PLANE = BREAKING_PLANE.interface
METHOD = st.Rupture(loading_rate=1e8)


def break_plane(strength=BREAKING_STRENGTH, method=METHOD, **options):
    return simulate_rupture(BREAKING_PLANE, strength, method=method, progress=False, **options)


def mirrored(field, axis):
    """x -> -x on the periodic grid."""
    return np.roll(np.flip(field, axis), 1, axis)


@pytest.fixture(scope="module")
def whole():
    return break_plane()


@pytest.mark.parametrize("axis", [0, 1])
def test_a_mirrored_strength_breaks_mirrored(whole, axis):
    two = break_plane(mirrored(BREAKING_STRENGTH, axis))
    assert int(whole.implicit_steps) > 20
    assert int(whole.explicit_steps) > 50
    assert float(two.critical_stress) == pytest.approx(float(whole.critical_stress), rel=1e-9)
    slip = mirrored(whole.slip.values[-1], axis)
    # Implicit steps solve to 1e-9 of the stress scale, which round-off reaches by another way.
    assert two.slip.values[-1] == pytest.approx(slip, abs=1e-7 * slip.max())
    same = float(whole.critical_position[1 - axis])
    assert two.critical_position[1 - axis] == pytest.approx(same)


def ruptured(steps):
    """Slip and radiated energy at a constant load that breaks the weak spot and runs on."""
    run, state = stepped(BREAKING_PLANE, BREAKING_STRENGTH, 7.5e5, 2.4e-5, steps)
    return state.slip, radiated_energy(run, state)


def test_slip_and_energy_converge_with_second_order_in_time():
    slip, energy = ruptured(3840)
    results = [ruptured(steps) for steps in (120, 240, 480)]
    slips = [np.abs(one - slip).max() / slip.max() for one, _ in results]
    energies = [abs(one / energy - 1.0) for _, one in results]
    # With the reference's own error, and nodes that stop and go between steps.
    assert_second_order(slips, 0.6)
    assert_second_order(energies, 0.6)
    assert slips[2] < 2e-3
    assert energy > 0.0


def test_an_arrested_rupture_radiates_no_more():
    """A strong frame stops it; then work, friction and strain energy balance for good."""
    x, y = np.meshgrid(*PLANE.coordinates.values(), indexing="ij")
    inside = (np.abs(x - 0.02) < 0.011) & (np.abs(y - 0.015) < 0.009)
    tau_p = np.where(inside, 8e5 - 2e5 * dip(PLANE, (0.018, 0.014), 0.007), np.inf)
    method = st.Rupture(load=([0.0, 6e-3, 1.0], [0.0, 6.2e5, 6.2e5]), stop="time", end_time=0.5)
    run = break_plane(tau_p, method, save=st.Save(every=20))
    slip = run.slip.values[-1]
    assert np.all(slip[~inside] == 0.0)
    assert np.all(slip[inside] > 0.0)
    radiated = run.radiated_energy.values
    settled = run.time.values > 6.4e-3
    assert radiated[-1] > 0.0
    assert np.ptp(radiated[settled]) < 1e-6 * radiated[-1]
    # The strain energy is the work of the stress change on the slip.
    change = run.shear_stress.values[-1] - 6.2e5
    strain = -0.5 * float(np.sum(change * slip)) * PLANE.cell
    # Waves along the interface fade like the square root of time only.
    assert run.strain_energy.values[-1] == pytest.approx(strain, rel=1e-3)
    moment = BREAKING_PLANE.solid.shear_modulus * float(slip.sum()) * PLANE.cell
    assert run.seismic_moment.values[-1] == pytest.approx(moment, rel=1e-12)
