"""What the scalars of a run mean, from its own fields, where everything varies along x."""

import dataclasses
from types import SimpleNamespace

import numpy as np
import pytest

import stiction as st
from stiction import InputError
from stiction.dynamics.energies import strain_energy
from stiction.dynamics.simulate import simulate_rupture
from stiction.dynamics.summary import rupture_speed

NODES, LENGTH = 128, 0.05
SPACING = LENGTH / NODES
ANGLE = 2 * np.pi * np.arange(NODES) / NODES
PROBLEM = st.Problem(
    st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress"),
    st.Interface(length=LENGTH, nodes=NODES),
    st.LinearWeakening(
        weakening_rate=0.2e12 + 2e10 * np.sin(ANGLE),
        residual_strength=3e5 + 5e4 * np.cos(ANGLE),
    ),
    st.Load(profile=1.2 + 0.2 * np.cos(ANGLE), initial_stress=5e4 + 3e4 * np.sin(2 * ANGLE)),
)
TAU_P = 1.3e6 - 2e5 * np.cos(ANGLE) + 5e4 * np.sin(5 * ANGLE)


@pytest.fixture(scope="module")
def run():
    return simulate_rupture(
        PROBLEM, TAU_P, method=st.Rupture(loading_rate=1e7),
        save=st.Save(["slip", "shear_stress", "strength"], every=1),
    )  # fmt: skip


def test_loads(run):
    profile, initial = PROBLEM.load.profile.mean(), PROBLEM.load.initial_stress.mean()
    critical = float(run["critical_stress"])
    assert critical == run["step_mean_stress"].values.max()
    assert float(run["critical_load"]) == pytest.approx(
        (critical - initial) / profile, rel=1e-12
    )
    assert float(run["applied_load"]) > float(run["critical_load"])
    stress = run["shear_stress"].values.mean(axis=1)
    # Explicit steps know the mean stress to round-off, implicit ones to 1e-9 of the drop.
    np.testing.assert_allclose(run["mean_stress"].values, stress, rtol=1e-6)


def test_moment_and_energies(run):
    slip, stress = run["slip"].values, run["shear_stress"].values
    assert run["seismic_moment"].values == pytest.approx(1e9 * slip.sum(axis=1) * SPACING)
    excess = TAU_P - PROBLEM.friction.residual_strength
    gamma = excess**2 / (2 * PROBLEM.friction.weakening_rate)
    assert run["fracture_energy"].values[-1] == pytest.approx(gamma.sum() * SPACING)
    # Friction and work as integrals over the stored steps, by the trapezoidal rule.
    increments = np.diff(slip, axis=0)
    friction = np.sum(0.5 * (stress[1:] + stress[:-1]) * increments) * SPACING
    load = run["load"].values
    mean_load = 0.5 * (load[1:] + load[:-1])[:, None]
    work = np.sum((mean_load * PROBLEM.load.profile + PROBLEM.load.initial_stress) * increments)
    symbol = 0.5 * PROBLEM.effective_modulus * PROBLEM.interface.wavenumbers
    pull = np.fft.irfft(symbol * np.fft.rfft(slip[-1]), NODES)
    strain = 0.5 * np.sum(pull * slip[-1]) * SPACING
    assert run["work"].values[-1] == pytest.approx(work * SPACING, rel=1e-10)
    assert run["strain_energy"].values[-1] == pytest.approx(strain, rel=1e-10)
    # d_c is passed within a step: 1e-3 of friction is seen.
    radiated = work * SPACING - friction - strain
    assert run["radiated_energy"].values[-1] == pytest.approx(radiated, rel=1e-2)
    found = st.onset(PROBLEM, TAU_P, method=st.Rupture(loading_rate=1e7, start="rest"))
    for name in ("radiated_energy", "fracture_energy", "seismic_moment"):
        assert float(found[name][0]) == pytest.approx(float(run[name].values[-1]), rel=1e-12)


def test_strain_energy_counts_the_shortest_wave_once():
    slip = np.cos(np.pi * np.arange(8))
    grid = SimpleNamespace(
        transform=SimpleNamespace(shape=(8,), half=(5,)),
        stiffness=np.array([np.arange(5.0), np.zeros(5)]),
        cell=0.5,
    )
    assert strain_energy(np.fft.rfft(slip), grid) == pytest.approx(0.5 * 4.0 * 8 * 0.5)


def test_front_speed_is_that_of_a_front_and_not_where_fronts_meet():
    x = np.arange(64.0)
    away = np.abs((x - 10.0 + 32.0) % 64.0 - 32.0)  # both ways from node 10, around the period
    speed = rupture_speed(away / 3.0, [1.0], [8.0])
    assert np.isnan(speed[[8, 10, 12, 40, 42, 44]]).all()
    known = speed[np.isfinite(speed)]
    assert known.size == 64 - 2 * 7
    assert known == pytest.approx(3.0)


def test_a_folder_with_another_run_is_refused(tmp_path):
    save = st.Save(to=tmp_path / "run")
    method = st.Rupture(loading_rate=1e7, stop="onset")
    simulate_rupture(PROBLEM, TAU_P, method=method, save=save)
    for change in (
        {"load": dataclasses.replace(PROBLEM.load, profile=1.2)},
        {"load": dataclasses.replace(PROBLEM.load, initial_stress=5e4)},
        {"friction": dataclasses.replace(PROBLEM.friction, residual_strength=3e5)},
        {"friction": dataclasses.replace(PROBLEM.friction, weakening_rate=2e11)},
        {"profiles": TAU_P + 1.0},
        {"method": st.Rupture(loading_rate=2e7)},
    ):
        profiles, other = change.pop("profiles", TAU_P), change.pop("method", method)
        problem = dataclasses.replace(PROBLEM, **change)
        with pytest.raises(InputError, match="holds another run"):
            simulate_rupture(problem, profiles, method=other, save=save)
