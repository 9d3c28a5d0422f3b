"""Dask's own scheduler and workers on loopback, one killed in mid-run; SLURM's job script."""

import copy
import os
import signal
import sys
import threading
import time

import pytest
from small_study import lengths, small_study

import stiction as st
from stiction.ensemble import distributed as dask_room
from stiction.ensemble import resume
from stiction.ensemble.distributed import Cluster, dask_executor
from stiction.ensemble.slurm import slurm_cluster, slurm_jobs
from stiction.ensemble.work import do_work
from stiction.errors import WorkerError
from stiction.stored_run import StoredRun
from stiction.study_run import run_into

STUDY = small_study(
    nodes=256,
    weakening_rate=0.4e12,
    correlation_length=3e-3,
    ensemble={"samples": 60_000, "seed": 3},
    sweep=lengths(3e-3, 4e-3),
)

# Dask warns of its own affairs (ports, garbage collection) in every version differently.
pytestmark = pytest.mark.filterwarnings("ignore")


def needs(module):
    return pytest.importorskip(
        module, reason=f'needs {module}: pip install "stiction[distributed]"'
    )


@pytest.fixture(scope="module")
def cluster():
    distributed = needs("distributed")
    with distributed.LocalCluster(
        n_workers=2,
        threads_per_worker=1,
        processes=True,
        host="127.0.0.1",
        dashboard_address=None,
        memory_limit=0,
    ) as cluster:
        yield cluster


@pytest.fixture(scope="module")
def reference():
    return st.Study.from_dict(STUDY).run(workers=1)


@pytest.mark.slow
def test_a_running_scheduler_gives_the_same_bits(cluster, tmp_path, reference):
    with dask_executor(cluster.scheduler_address) as executor:
        assert st.Study.from_dict(STUDY).run(executor=executor).identical(reference)
        result = st.Study.from_dict(STUDY).run(out=tmp_path / "run", executor=executor)
    assert result.identical(reference)


@pytest.mark.slow
def test_a_worker_killed_in_mid_run_loses_and_repeats_nothing(
    cluster, tmp_path, reference, monkeypatch
):
    monkeypatch.setattr(resume, "FLUSH_SECONDS", 0.05)
    victims, done = [], []

    def kill_one(count, total):
        done.append(count)
        if count > 5000 and not victims:
            victims.append(next(iter(cluster.workers.values())).pid)
            os.kill(victims[0], signal.SIGKILL)

    with dask_executor(cluster.scheduler_address) as executor:
        run = run_into(
            st.Study.from_dict(STUDY), tmp_path / "run", executor=executor, progress=kill_one
        )
    assert len(victims) == 1
    assert done[-1] == 120_000  # nothing twice, nothing lost
    assert run.status().complete
    assert run.dataset().identical(reference)


@pytest.mark.slow
def test_all_workers_gone_and_back(cluster, tmp_path, reference, monkeypatch):
    """While nobody works the run waits; what comes back goes on."""
    monkeypatch.setattr(resume, "FLUSH_SECONDS", 0.05)
    seen = []

    def lose_all(count, total):
        if count > 5000 and not seen:
            seen.append(count)
            cluster.scale(0)
            threading.Timer(3.0, cluster.scale, (2,)).start()

    with dask_executor(cluster.scheduler_address) as executor:
        result = st.Study.from_dict(STUDY).run(
            out=tmp_path / "run", executor=executor, progress=lose_all
        )
    assert seen
    assert result.identical(reference)


@pytest.mark.slow
def test_the_command_line_on_a_running_scheduler(cluster, tmp_path, reference, command):
    st.Study.from_dict(STUDY).to_toml(tmp_path / "study.toml")
    arguments = ["run", tmp_path / "study.toml", "--out", tmp_path / "run"]
    code, said, _ = command(*arguments, "--scheduler", cluster.scheduler_address)
    assert code == 0
    assert "120000 samples in" in said
    assert StoredRun(tmp_path / "run").dataset().identical(reference)


@pytest.mark.slow
def test_nobody_answers(tmp_path):
    needs("distributed")
    begin = time.monotonic()
    with (
        pytest.raises(st.InputError, match=r"no Dask scheduler answers at 'tcp://127\.0\.0\.1:9'"),
        dask_executor("tcp://127.0.0.1:9"),
    ):
        pass
    assert time.monotonic() - begin < 60.0


@pytest.mark.parametrize(
    ("arguments", "module", "option"),
    [
        ({"scheduler": "tcp://127.0.0.1:9"}, "distributed", "--scheduler"),
        ({"slurm": Cluster(jobs=1)}, "dask_jobqueue", "--slurm"),
    ],
)
def test_without_the_extra_a_message_says_how_to_get_it(monkeypatch, arguments, module, option):
    monkeypatch.setitem(sys.modules, module, None)
    words = rf"{option}.*pip install \"stiction\[distributed\]\""
    with pytest.raises(st.InputError, match=words), dask_executor(**arguments):
        pass


@pytest.mark.slow
def test_the_job_script_of_slurm(tmp_path, monkeypatch):
    needs("dask_jobqueue")
    study = copy.deepcopy(STUDY) | {
        "cluster": {
            "jobs": 4,
            "cores": 16,
            "processes": 8,
            "memory": "32GB",
            "walltime": "02:30:00",
            "queue": "short",
            "account": "friction",
            "interface": "lo",
            "options": {"job_extra_directives": ["--exclusive"]},
        }
    }
    settings = st.Study.from_dict(study).cluster
    needs("cryptography")
    monkeypatch.chdir(tmp_path)
    with slurm_cluster(settings) as (cluster, _):
        script = cluster.job_script()
        assert cluster.scheduler_address.startswith("tls://127.0.0.1:")
        assert cluster.scheduler.http_server.address == "127.0.0.1"
        (folder,) = tmp_path.iterdir()
        assert folder.stat().st_mode & 0o077 == 0  # the key is for its owner
    assert not list(tmp_path.iterdir())
    assert "--interface lo" in script
    assert "--protocol tls" in script
    assert "--dashboard-address 127.0.0.1:0" in script
    for line in (
        "#SBATCH -p short",
        "#SBATCH -A friction",
        "#SBATCH --cpus-per-task=16",
        "#SBATCH --mem=30G",  # 32 GB are 29.8 GiB, rounded up
        "#SBATCH -t 02:30:00",
        "#SBATCH --exclusive",
    ):
        assert line in script.splitlines()
    assert "--nworkers 8" in script
    assert "--nthreads 2" in script


@pytest.mark.slow
def test_settings_that_slurm_refuses():
    needs("dask_jobqueue")
    with (
        pytest.raises(st.InputError, match="cluster: dask-jobqueue refuses"),
        slurm_cluster(Cluster(jobs=1, interface="lo", tls=False)),
    ):
        pass
    with (
        pytest.raises(st.InputError, match="cluster.interface: missing; .* lo"),
        slurm_cluster(Cluster(jobs=1, cores=1, memory="1GB")),
    ):
        pass


@pytest.fixture
def fake_slurm(tmp_path, monkeypatch):
    """Commands of SLURM on PATH that say what a test tells them to."""

    def make(**commands):
        for name, script in commands.items():
            path = tmp_path / "bin" / name
            path.parent.mkdir(exist_ok=True)
            path.write_text(f"#!/bin/sh\n{script}\n")
            path.chmod(0o755)
        monkeypatch.setenv("PATH", str(tmp_path / "bin"))
        monkeypatch.chdir(tmp_path)

    return make


JOB = {"cores": 1, "memory": "1GB", "interface": "lo", "tls": False}


@pytest.mark.slow
def test_slurm_refuses_a_job_in_its_own_words(fake_slurm):
    needs("dask_jobqueue")
    fake_slurm(sbatch="echo 'sbatch: error: invalid partition specified: long' >&2; exit 1")
    with (
        pytest.raises(st.InputError, match="SLURM refuses the job.*invalid partition.*long"),
        slurm_jobs(Cluster(**JOB, queue="long")),
    ):
        pass


@pytest.mark.slow
def test_no_sbatch(fake_slurm):
    needs("dask_jobqueue")
    fake_slurm(true="")
    with pytest.raises(st.InputError, match="no `sbatch`"), slurm_jobs(Cluster(**JOB)):
        pass


@pytest.mark.slow
def test_jobs_that_end_at_once_and_jobs_that_never_begin(fake_slurm, tmp_path):
    needs("dask_jobqueue")
    (tmp_path / "log").write_text("no such python\n")
    ended = f"JobState=FAILED Reason=NonZeroExitCode ExitCode=127:0 StdErr={tmp_path / 'log'}"
    fake_slurm(
        sbatch="echo Submitted batch job 12", squeue="", scontrol=f"echo {ended}", scancel=""
    )
    words = "no worker is left.*job 12: JobState FAILED.*ExitCode 127:0; it wrote: no such python"
    with pytest.raises(WorkerError, match=words), dask_executor(slurm=Cluster(**JOB)):
        pass
    fake_slurm(squeue="echo 12 PENDING Resources")
    words = "no worker for 1.5 s: SLURM says: job 12 is PENDING .Resources."
    settings = Cluster(**JOB, start_timeout=1.5)
    with pytest.raises(WorkerError, match=words), dask_executor(slurm=settings):
        pass


@pytest.mark.parametrize("name", ["queue", "account", "memory", "walltime", "interface"])
def test_a_name_cannot_add_lines_to_the_job_script(name):
    with pytest.raises(st.InputError, match=f"{name}: must be one word"):
        Cluster(**{name: "short\n#SBATCH --wrap=x"})
    with pytest.raises(st.InputError, match="line ends"):
        Cluster(options={"job_extra_directives": ["--exclusive\n#SBATCH -p long"]})


def test_a_worker_with_other_versions_refuses_to_work():
    plan = st.Study.from_dict(STUDY).plans[0]
    with pytest.raises(WorkerError, match="numpy 1.0.*install the same versions"):
        do_work(plan, 0, 0, 1, "", "stiction 0, numpy 1.0, numba 0")


@pytest.mark.slow
def test_a_scheduler_without_workers(monkeypatch):
    distributed = needs("distributed")
    monkeypatch.setattr(dask_room, "SCHEDULER_SECONDS", 1.0)
    with (
        distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address=None) as cluster,
        pytest.raises(WorkerError, match="no worker for 1 s.*dask worker"),
        dask_executor(cluster.scheduler_address),
    ):
        pass


def test_mistakes_in_the_cluster_table_are_named():
    with pytest.raises(st.InputError) as caught:
        st.Study.from_dict(STUDY | {"cluster": {"job": 3, "cores": 0}})
    assert "did you mean 'jobs'" in str(caught.value)
    assert "cluster.cores" in str(caught.value)


def test_the_cluster_is_no_part_of_the_result():
    with_cluster = st.Study.from_dict(STUDY | {"cluster": {"jobs": 3}})
    assert with_cluster.attributes == st.Study.from_dict(STUDY).attributes
    assert with_cluster.to_dict()["cluster"]["jobs"] == 3
