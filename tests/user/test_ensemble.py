"""Ensembles: samples that cannot be solved, the pilot by the exact method, Dask and MPI."""

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
import scipy.stats
from small_study import lengths, small_study

import stiction as st
from stiction.ensemble.experiment import Experiment

SOLID = st.Solid(shear_modulus=5e9, poisson_ratio=0.4, density=1170.0)


def field(marginal, length):
    spectrum = st.PowerLawSpectrum(correlation_length=length, exponent=2.0)
    return st.RandomField(marginal, spectrum, mean_mode=True)


def test_one_sample_that_the_grid_does_not_resolve_does_not_end_an_ensemble():
    """Sample 12,584 has a nucleation length of fewer than four nodes somewhere."""
    rate = 2.0 * 0.5788869418506 * SOLID.effective_modulus() / (0.35 * 0.2)
    problem = st.Problem(
        SOLID, st.Interface(length=0.2, nodes=96), st.LinearWeakening(weakening_rate=rate)
    )
    random = st.RandomInterface(
        strength=field(scipy.stats.lognorm(0.25, scale=2e6), 0.04),
        residual_strength=field(scipy.stats.beta(2, 2, loc=2e5, scale=4e5), 0.04),
        fracture_energy=field(scipy.stats.gamma(9, scale=2e12 / rate / 9), 0.05),
        correlation={
            ("strength", "residual_strength"): 0.8,
            ("strength", "fracture_energy"): 0.5,
        },
    )
    given = {"method": st.Equilibrium(), "seed": 991, "samples": 10, "first": 12_580}
    with pytest.warns(st.AccuracyWarning, match=r"1 of 10 samples could not be solved.*12584"):
        found = st.monte_carlo(problem, random, **given)
    failed = np.flatnonzero(found.critical_stress.isnull()) + 12_580
    assert failed.tolist() == [12_584]
    ((_, sample, seed, text, own),) = json.loads(found.attrs["failed_samples"])
    assert (sample, seed, own) == (12_584, 991, True)
    assert "nodes" in text


def far_from_the_criterion():
    """Strengths so scattered that nodes reach their residual strength before the onset."""
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
    rate = 2.0 * 0.5788869418506 * solid.effective_modulus() / 0.025
    problem = st.Problem(
        solid, st.Interface(length=0.1, nodes=128), st.LinearWeakening(weakening_rate=rate)
    )
    return problem, st.RandomField(
        scipy.stats.lognorm(0.5, scale=1e6),
        st.PowerLawSpectrum(correlation_length=0.0075),
        mean_mode=True,
    )


def test_the_pilot_says_how_far_the_local_criterion_is_from_the_exact_onset():
    problem, strength = far_from_the_criterion()
    given = {"method": st.LocalCriterion(), "samples": 200, "seed": 11}
    with pytest.warns(
        st.AccuracyWarning, match=r"differs from the exact onset by .*a pilot of 32"
    ):
        found = st.monte_carlo(problem, strength, **given)
    alone = st.monte_carlo(problem, strength, **given, pilot=False)
    np.testing.assert_array_equal(found.critical_stress, alone.critical_stress)
    assert "pilot_bias" not in alone.attrs
    exact = st.monte_carlo(
        problem, strength, method=st.Equilibrium(), samples=32, seed=11
    ).critical_stress.values
    difference = (found.critical_stress.values[:32] - exact) / exact.mean()
    assert found.attrs["pilot_samples"] == 32
    assert found.attrs["pilot_bias"] == pytest.approx(difference.mean(), rel=1e-9)
    assert found.attrs["pilot_scatter"] == pytest.approx(difference.std(ddof=1), rel=1e-9)


def test_coefficients_are_stresses_times_the_pressure():
    problem, strength = far_from_the_criterion()
    pressure = 5e6 * (1.0 + 0.1 * np.cos(2.0 * np.pi * problem.interface.x / 0.1))
    pressed = st.Problem(
        problem.solid, problem.interface, problem.friction, st.Load(normal_pressure=pressure)
    )
    share = st.RandomField(
        scipy.stats.lognorm(0.5, scale=0.2), strength.spectrum, True, of="friction_coefficient"
    )
    experiment = Experiment(pressed, share, st.LocalCriterion())
    draws = experiment.draws(0, 4)
    found = experiment.profiles(draws)["strength"]
    ratio = (
        found / Experiment(problem, strength, st.LocalCriterion()).profiles(draws)["strength"]
    )
    # lognorm(0.5, scale=0.2) is lognorm(0.5, scale=1e6) times 2e-7, to round-off.
    np.testing.assert_allclose(ratio, np.broadcast_to(2e-7 * pressure, ratio.shape), rtol=1e-9)


@pytest.mark.slow
def test_a_dask_scheduler():
    """By the executor of a client."""
    distributed = pytest.importorskip("distributed")
    study = st.Study.from_dict(small_study(sweep=lengths(4e-3, 6e-3)))
    reference = study.run(workers=1)
    with (
        distributed.LocalCluster(
            n_workers=2, threads_per_worker=1, dashboard_address=None
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        assert study.run(executor=client.get_executor(pure=False)).identical(reference)


MPI = """
import sys
from mpi4py.futures import MPIPoolExecutor
import stiction as st

if __name__ == "__main__":
    with MPIPoolExecutor() as executor:
        assert executor.num_workers == 2
        st.Study.from_toml("study.toml").run(out="run", executor=executor, progress=False)
"""


@pytest.mark.slow
def test_an_mpi_pool(tmp_path):
    """As docs/clusters.md starts it."""
    pytest.importorskip("mpi4py")
    if shutil.which("mpiexec") is None:
        pytest.skip("there is no mpiexec")
    study = st.Study.from_dict(small_study(sweep=lengths(4e-3, 6e-3)))
    study.to_toml(tmp_path / "study.toml")
    (tmp_path / "script.py").write_text(MPI)
    open_mpi = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    done = subprocess.run(
        ["mpiexec", "-n", "3", sys.executable, "-m", "mpi4py.futures", "script.py"],
        cwd=tmp_path,
        env=os.environ | open_mpi | {"OMPI_MCA_rmaps_base_oversubscribe": "1"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert st.open_run(tmp_path / "run").dataset().identical(study.run(workers=1))
