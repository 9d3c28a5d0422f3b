"""Jobs of a SLURM cluster as Dask workers, and what SLURM says of them."""

from __future__ import annotations

import re
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from stiction.ensemble.distributed import INSTALL, Cluster
from stiction.errors import InputError, RunError

SECONDS = 60.0
LINES = 5
WORKER_WEB = ("--no-dashboard", "--dashboard-address", "127.0.0.1:0")
ENDED = (
    "BOOT_FAIL", "CANCELLED", "COMPLETED", "DEADLINE", "FAILED", "NODE_FAIL", "OUT_OF_MEMORY",
    "PREEMPTED", "TIMEOUT",
)  # fmt: skip


@dataclass
class Jobs:
    """What became of the jobs of a run: Dask itself forgets those that end or were refused.

    Attributes
    ----------
    numbers : list of str
        SLURM's numbers of the jobs that it took.
    refusals : list of str
        What `sbatch` said of the others.
    expected : int
        Jobs that were asked for.
    """

    expected: int = 0
    numbers: list[str] = field(default_factory=list)
    refusals: list[str] = field(default_factory=list)

    def words(self) -> tuple[str, bool]:
        """What SLURM says of the jobs, and whether one of them may still begin or is running."""
        if len(self.numbers) + len(self.refusals) < self.expected:
            return "jobs are being submitted", True
        if not self.numbers:
            return f"SLURM takes no job: {self.refusals[0]}", False
        try:
            queue = _call(["squeue", "-h", "-j", ",".join(self.numbers), "-o", "%i %T %r"])
        except RunError as error:
            if "Invalid job id" not in str(error):  # it does not answer now; it may later
                return str(error), True
            queue = ""
        lines = [line.split(maxsplit=2) for line in queue.splitlines()]
        alive = [line for line in lines if len(line) == 3 and line[1] not in ENDED]
        if alive:
            some = "; ".join(f"job {job} is {state} ({why})" for job, state, why in alive[:LINES])
            return f"SLURM says: {some}", True
        return f"no job is left in the queue; {_end_of_job(self.numbers[-1])}", False


@contextmanager
def slurm_jobs(settings: Cluster) -> Iterator[tuple[Any, Jobs]]:
    """Submit jobs, and end them with the context.

    Raises
    ------
    InputError
        If dask-jobqueue is not installed or refuses the settings, or SLURM refuses the job.
    """
    with slurm_cluster(settings) as (cluster, jobs):
        _try(cluster.job_script())
        jobs.expected = settings.jobs
        cluster.scale(jobs=settings.jobs)
        yield cluster, jobs


@contextmanager
def slurm_cluster(settings: Cluster) -> Iterator[tuple[Any, Jobs]]:
    """A `dask_jobqueue.SLURMCluster` and what becomes of its jobs; none is submitted yet.

    Its scheduler listens on the chosen interface only, with TLS, and its web pages on loopback.

    Raises
    ------
    InputError
        If dask-jobqueue is not installed, does not accept the settings, or no interface is chosen.
    """
    try:
        import dask
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise InputError(f"--slurm: needs dask-jobqueue; install it with: {INSTALL}") from None
    jobs = Jobs()
    given = settings.arguments()
    given["scheduler_options"] = _scheduler_options(given)
    extra = given.get("worker_extra_args")
    if extra is None:
        extra = dask.config.get("jobqueue.slurm.worker-extra-args", None) or []
    given["worker_extra_args"] = [*extra, *WORKER_WEB]
    given["job_cls"] = _job_class(jobs)
    # Compute nodes read the certificate from a folder that only its owner can read, in the one
    # where the jobs run unless another is given.
    place = given.pop("shared_temp_directory", None) or Path.cwd()
    with tempfile.TemporaryDirectory(prefix=".stiction-tls-", dir=place) as folder:
        if settings.tls:
            given["security"] = _certificates(Path(folder))
        try:
            cluster = SLURMCluster(**given)
        except (TypeError, ValueError, RuntimeError, OSError) as error:
            raise InputError(
                f"cluster: dask-jobqueue refuses the settings {settings.arguments()}: {error}"
            ) from None
        try:
            yield cluster, jobs
        finally:
            cluster.close()


def _certificates(folder: Path) -> Any:
    """A certificate for this run alone, in files that workers can read."""
    from distributed import Security

    try:
        made = Security.temporary().get_tls_config_for_role("worker")
    except ImportError:
        raise InputError(
            f"--slurm: TLS needs the package cryptography; install it with: {INSTALL}"
        ) from None
    files = {}
    for name in ("ca_file", "cert", "key"):
        files[name] = str(folder / f"{name}.pem")
        Path(files[name]).write_text(made[name], encoding="ascii")
    roles = {
        f"tls_{role}_{name}": files[name]
        for role in ("scheduler", "worker", "client")
        for name in ("cert", "key")
    }
    return Security(require_encryption=True, tls_ca_file=files["ca_file"], **roles)


def _scheduler_options(given: dict[str, Any]) -> dict[str, Any]:
    """Where the scheduler listens: a chosen interface, and loopback for its web page."""
    import dask
    import psutil

    options = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}
    options |= dask.config.get("jobqueue.slurm.scheduler-options", None) or {}
    options |= given.get("scheduler_options") or {}
    if "host" in options:
        return options
    interface = options.get("interface") or given.get("interface")
    interface = interface or dask.config.get("jobqueue.slurm.interface", None)
    here = sorted(psutil.net_if_addrs())
    if interface is None:
        raise InputError(
            "cluster.interface: missing; name the network interface by which compute nodes and"
            f" this machine reach each other (here are {', '.join(here)})"
        )
    if interface not in here:
        raise InputError(
            f"cluster.interface: this machine has no {interface!r} (it has {', '.join(here)});"
            " where compute nodes call theirs otherwise, give this machine's as"
            " cluster.options.scheduler_options.interface"
        )
    return options


def _job_class(jobs: Jobs) -> Any:
    from dask_jobqueue.slurm import SLURMJob

    class Job(SLURMJob):
        """One that notes what SLURM said of it."""

        async def start(self) -> None:
            try:
                await super().start()
            except Exception as error:
                said = str(error).rpartition("stderr:\n")[2].split()
                jobs.refusals.append(" ".join(said))
                raise
            jobs.numbers.append(self.job_id)

    return Job


def _try(script: str) -> None:
    """Let SLURM judge the job without submitting it."""
    try:
        _call(["sbatch", "--test-only"], script)
    except RunError as error:
        raise InputError(f"cluster: SLURM refuses the job: {error}") from None


def _call(command: Sequence[str], text: str = "") -> str:
    """What a command of SLURM prints.

    Raises
    ------
    InputError
        If there is no such command.
    RunError
        With its own words, if it fails.
    """
    try:
        done = subprocess.run(
            command, input=text, capture_output=True, text=True, errors="replace", timeout=SECONDS
        )
    except FileNotFoundError:
        raise InputError(
            f"--slurm: there is no `{command[0]}` on this machine; run it where SLURM jobs are"
            " submitted, or use --workers"
        ) from None
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RunError(f"`{command[0]}` does not answer: {error}") from None
    if done.returncode:
        raise RunError(" ".join((done.stderr or done.stdout).split()) or f"exit {done.returncode}")
    return done.stdout


def _end_of_job(number: str) -> str:
    """How a job ended, and the last lines that it wrote."""
    try:
        shown = _call(["scontrol", "show", "job", number])
    except (RunError, InputError) as error:
        return f"the last was job {number} ({error})"
    found = dict(re.findall(r"(JobState|Reason|ExitCode|StdErr)=(\S+)", shown))
    text = ", ".join(f"{name} {found[name]}" for name in list(found)[:3])
    try:
        log = Path(found["StdErr"]).read_text(encoding="utf-8", errors="replace").split("\n")
    except (OSError, KeyError):
        return f"the last was job {number}: {text}"
    tail = " / ".join([line.strip() for line in log if line.strip()][-LINES:])
    return f"the last was job {number}: {text}; it wrote: {tail}"
