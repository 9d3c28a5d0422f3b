"""Ensembles: samples that cannot be solved, the pilot by the exact method, Dask and MPI."""

import json
import os
import shutil
import subprocess
import sys

import numpy as np
import pytest
import scipy.stats
from setups import make_problem
from small_study import lengths, small_study

import stiction as st

STUDY = st.Study.from_dict(small_study(sweep=lengths(4e-3, 6e-3)))


def test_one_sample_that_the_grid_does_not_resolve_does_not_end_an_ensemble():
    """Sample 12,584 has a nucleation length of fewer than four nodes somewhere."""
    solid = st.Solid(shear_modulus=5e9, poisson_ratio=0.4, density=1170.0)
    rate = 2.0 * 0.5788869418506 * solid.effective_modulus() / (0.35 * 0.2)
    problem = make_problem(96, 0.2, solid=solid, weakening_rate=rate)

    def field(marginal, length):
        return st.RandomField(marginal, st.PowerLawSpectrum(length, exponent=2.0), True)

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


def test_the_pilot_says_how_far_the_local_criterion_is_from_the_exact_onset():
    """Of strengths so scattered that nodes reach their residual strength before the onset."""
    problem = make_problem(128, weakening_rate=0.69e11)
    marginal = scipy.stats.lognorm(0.5, scale=1e6)
    strength = st.RandomField(marginal, st.PowerLawSpectrum(0.0075), mean_mode=True)
    given = {"method": st.LocalCriterion(), "samples": 200, "seed": 11}
    words = r"differs from the exact onset by .*a pilot of 32"
    with pytest.warns(st.AccuracyWarning, match=words):
        found = st.monte_carlo(problem, strength, **given)
    alone = st.monte_carlo(problem, strength, **given, pilot=False)
    np.testing.assert_array_equal(found.critical_stress, alone.critical_stress)
    assert "pilot_bias" not in alone.attrs
    options = {"method": st.Equilibrium(), "samples": 32, "seed": 11}
    exact = st.monte_carlo(problem, strength, **options).critical_stress.values
    difference = (found.critical_stress.values[:32] - exact) / exact.mean()
    assert found.attrs["pilot_samples"] == 32
    assert found.attrs["pilot_bias"] == pytest.approx(difference.mean(), rel=1e-9)
    assert found.attrs["pilot_scatter"] == pytest.approx(difference.std(ddof=1), rel=1e-9)


@pytest.mark.slow
def test_a_dask_scheduler():
    """By the executor of a client."""
    distributed = pytest.importorskip("distributed")
    reference = STUDY.run(workers=1)
    options = {"n_workers": 2, "threads_per_worker": 1, "dashboard_address": None}
    with distributed.LocalCluster(**options) as cluster, distributed.Client(cluster) as client:
        assert STUDY.run(executor=client.get_executor(pure=False)).identical(reference)


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
    STUDY.to_toml(tmp_path / "study.toml")
    (tmp_path / "script.py").write_text(MPI)
    names = "OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"
    open_mpi = dict.fromkeys((*names, "OMPI_MCA_rmaps_base_oversubscribe"), "1")
    command = ["mpiexec", "-n", "3", sys.executable, "-m", "mpi4py.futures", "script.py"]
    subprocess.run(command, cwd=tmp_path, env=os.environ | open_mpi, timeout=300, check=True)
    assert st.open_run(tmp_path / "run").dataset().identical(STUDY.run(workers=1))
