"""Executors on many machines: a running Dask scheduler, or jobs of a SLURM cluster."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from typing import Annotated, Any

from pydantic import PlainSerializer

from stiction._model import Count, model
from stiction.errors import InputError

INSTALL = 'python -m pip install "stiction[distributed]"'


@model(kw_only=True)
class Cluster:
    """Jobs of a SLURM cluster; what is left out comes from dask-jobqueue's own configuration.

    Parameters
    ----------
    jobs : int
        Jobs to ask for.
    cores : int, optional
        Cores of a job.
    processes : int, optional
        Worker processes of a job; each has cores/processes threads.
    memory : str, optional
        Memory of a job, such as ``"8GB"``.
    walltime : str, optional
        Such as ``"02:00:00"``.
    queue, account : str, optional
    options : dict
        Anything else that `dask_jobqueue.SLURMCluster` takes.

    Raises
    ------
    InputError
        If a number is not positive or a key unknown.
    """

    jobs: Count = 1
    cores: Count | None = None
    processes: Count | None = None
    memory: str | None = None
    walltime: str | None = None
    queue: str | None = None
    account: str | None = None
    options: Annotated[dict[str, Any] | None, PlainSerializer(lambda value: value)] = None

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of `dask_jobqueue.SLURMCluster`."""
        names = ("cores", "processes", "memory", "walltime", "queue", "account")
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        return given | (self.options or {})


def slurm_cluster(settings: Cluster) -> Any:
    """A `dask_jobqueue.SLURMCluster`; no job is submitted yet.

    Raises
    ------
    InputError
        If dask-jobqueue is not installed, or does not accept the settings.
    """
    try:
        from dask_jobqueue import SLURMCluster
    except ImportError:
        raise InputError(f"--slurm: needs dask-jobqueue; install it with: {INSTALL}") from None
    try:
        return SLURMCluster(**settings.arguments())
    except (TypeError, ValueError) as error:
        raise InputError(
            f"cluster: dask-jobqueue refuses the settings {settings.arguments()}: {error}"
        ) from None


def worker_version() -> str:
    """Version of the package where this runs."""
    from stiction import __version__

    return __version__


@contextmanager
def dask_executor(scheduler: str | None = None, slurm: Cluster | None = None) -> Iterator[Executor]:
    """An executor on a running Dask scheduler, or on SLURM jobs that end with it.

    Parameters
    ----------
    scheduler : str
        Address of a running scheduler, such as ``"tcp://host:8786"``.
    slurm : Cluster
        Or: what to ask a SLURM cluster for.

    Raises
    ------
    InputError
        If Dask is not installed, nobody answers, or workers have another version of the package.
    """
    try:
        from distributed import Client
    except ImportError:
        option = "--slurm" if scheduler is None else "--scheduler"
        raise InputError(f"{option}: needs dask.distributed; install it with: {INSTALL}") from None
    cluster = None
    if scheduler is None:
        cluster = slurm_cluster(slurm or Cluster())
        cluster.scale(jobs=(slurm or Cluster()).jobs)
    try:
        try:
            client = Client(cluster if scheduler is None else scheduler, timeout="10s")
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError(
                f"--scheduler: no Dask scheduler answers at {scheduler!r}: {error}"
            ) from None
        with client:
            _check_workers(client)
            yield client.get_executor(pure=False)
    finally:
        if cluster is not None:
            cluster.close()


def _check_workers(client: Any) -> None:
    own = worker_version()
    problems = []
    try:
        versions = client.run(worker_version)
    except Exception as error:
        raise InputError(
            "--scheduler: its workers cannot import stiction; install the same version there"
            f" ({type(error).__name__}: {error})"
        ) from None
    for address, version in versions.items():
        if version != own:
            problems.append(f"--scheduler: the worker {address} has version {version}, here {own}")
    if problems:
        raise InputError(problems)
