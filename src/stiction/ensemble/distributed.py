"""Executors on many machines: a running Dask scheduler, or jobs of a SLURM cluster.

Who can reach a Dask scheduler or worker can run code there. So both listen on one interface that
was chosen, speak TLS with certificates made for this run alone, and keep their web pages to the
machine itself.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from contextlib import ExitStack, contextmanager
from typing import Annotated, Any

from pydantic import AfterValidator, PlainSerializer

from stiction.ensemble.versions import versions
from stiction.errors import InputError, WorkerError
from stiction.model import Count, Flag, Positive, model
from stiction.progress import Meter

INSTALL = 'python -m pip install "stiction[distributed]"'
SCHEDULER_SECONDS = 60.0
ALONE_SECONDS = 600.0
TICK = 1.0


def _word(text: str) -> str:
    """A name in a job script: anything after a blank or a line's end would be read as more."""
    if not text or not text.isprintable() or any(char.isspace() for char in text):
        raise ValueError("must be one word: no blanks, no line ends")
    return text


def _lines(value: Any) -> Any:
    """What goes into a job script may not end its line and begin another."""
    if isinstance(value, str) and not value.isprintable():
        raise ValueError(f"must not hold line ends or control characters, got {value!r}")
    if isinstance(value, dict):
        return {_lines(key): _lines(inner) for key, inner in value.items()}
    if isinstance(value, list | tuple):
        return [_lines(inner) for inner in value]
    return value


Word = Annotated[str, AfterValidator(_word)]


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
    interface : str, optional
        Network interface on which scheduler and workers listen, such as ``"ib0"``: the one by which
        compute nodes and this machine reach each other. Needed here or in dask-jobqueue's
        configuration.
    tls : bool
        Encrypt, and let in only who has the certificate made for this run. It lies in a folder
        beside the job's output, readable by its owner, until the run ends.
    start_timeout : float
        Seconds to wait for the first worker, and for another when none is left while jobs wait in
        the queue.
    options : dict
        Anything else that `dask_jobqueue.SLURMCluster` takes.

    Raises
    ------
    InputError
        If a number is not positive, a name has blanks or line ends in it, or a key is unknown.
    """

    jobs: Count = 1
    cores: Count | None = None
    processes: Count | None = None
    memory: Word | None = None
    walltime: Word | None = None
    queue: Word | None = None
    account: Word | None = None
    interface: Word | None = None
    tls: Flag = True
    start_timeout: Positive = 43_200.0
    options: Annotated[
        dict[str, Any] | None, AfterValidator(_lines), PlainSerializer(lambda value: value)
    ] = None

    def arguments(self) -> dict[str, Any]:
        """Keyword arguments of `dask_jobqueue.SLURMCluster` that were given."""
        names = ("cores", "processes", "memory", "walltime", "queue", "account", "interface")
        given = {name: getattr(self, name) for name in names if getattr(self, name) is not None}
        return given | (self.options or {})


@contextmanager
def dask_executor(scheduler: str | None = None, slurm: Cluster | None = None) -> Iterator[Executor]:
    """An executor on a running Dask scheduler, or on SLURM jobs that end with it.

    Parameters
    ----------
    scheduler : str
        Address of a running scheduler, such as ``"tls://host:8786"``.
    slurm : Cluster
        Or: what to ask a SLURM cluster for.

    Raises
    ------
    InputError
        If Dask is not installed, nobody answers, SLURM refuses the jobs, or workers have other
        versions of stiction, numpy or numba.
    WorkerError
        If no worker comes; in SLURM's words where it has any. The executor's `watch` raises it
        when none is left later on.
    """
    try:
        from distributed import Client
    except ImportError:
        option = "--slurm" if scheduler is None else "--scheduler"
        raise InputError(f"{option}: needs dask.distributed; install it with: {INSTALL}") from None
    with ExitStack() as stack:
        stack.enter_context(_quiet())
        if scheduler is None:
            from stiction.ensemble.slurm import slurm_jobs

            settings = slurm or Cluster()
            cluster, jobs = stack.enter_context(slurm_jobs(settings))
            words = jobs.words
            client = stack.enter_context(Client(cluster, timeout="10s"))
            patience, first = settings.start_timeout, settings.start_timeout
        else:
            words = _no_words
            client = stack.enter_context(_client_of(scheduler))
            patience, first = ALONE_SECONDS, SCHEDULER_SECONDS
        _wait_for_worker(client, Watch(client, first, words))
        _check_workers(client, "--slurm" if scheduler is None else "--scheduler")
        executor = client.get_executor(pure=False)
        executor.watch = Watch(client, patience, words)
        yield executor


@contextmanager
def _quiet() -> Iterator[None]:
    """Dask's loggers tell of every connection; what matters is said here."""
    logger = logging.getLogger("distributed")
    before = logger.level
    logger.setLevel(logging.ERROR)
    try:
        yield
    finally:
        logger.setLevel(before)


def _no_words() -> tuple[str, bool]:
    """What a queue says of its jobs, and whether one may still begin; here there is no queue."""
    return "its scheduler has none; start some with `dask worker ADDRESS`", True


class Watch:
    """Called while nothing is done: raises a `WorkerError` when there is nobody left to wait for.

    Parameters
    ----------
    client : distributed.Client
    patience : float
        Seconds without a worker until it gives up.
    words : callable
        Returns what the queue says of its jobs, and whether one of them may still begin.
    """

    def __init__(self, client: Any, patience: float, words: Callable[[], tuple[str, bool]]) -> None:
        self.client, self.patience, self.words = client, patience, words
        self.alone_since: float | None = None
        self.text = ""

    def __call__(self) -> bool:
        """Whether there is a worker."""
        try:
            if self.client.nthreads():
                self.alone_since = None
                return True
        except Exception as error:  # Dask raises errors of its own, of tornado and of the system
            raise WorkerError(f"the Dask scheduler is gone ({type(error).__name__})") from None
        now = time.monotonic()
        self.alone_since = self.alone_since or now
        self.text, may_begin = self.words()
        if not may_begin:
            raise WorkerError(f"no worker is left: {self.text}")
        if now - self.alone_since > self.patience:
            raise WorkerError(f"no worker for {self.patience:g} s: {self.text}")
        return False


def _wait_for_worker(client: Any, watch: Watch) -> None:
    with Meter("waiting for workers") as meter:
        while not watch():
            meter.note = watch.text
            time.sleep(TICK)


def _client_of(address: str) -> Any:
    from distributed import Client

    try:
        return Client(address, timeout="10s")
    except Exception as error:  # refused connections, unknown schemes, certificates that do not fit
        raise InputError(
            f"--scheduler: no Dask scheduler answers at {address!r}:"
            f" {error or type(error).__name__}"
        ) from None


def _check_workers(client: Any, option: str) -> None:
    try:
        found = client.run(versions)
    except Exception as error:
        raise InputError(
            f"{option}: its workers cannot import stiction; install the same version there"
            f" ({type(error).__name__}: {error})"
        ) from None
    problems = [
        f"{option}: the worker {address} has {theirs}, here {versions()}"
        for address, theirs in found.items()
        if theirs != versions()
    ]
    if problems:
        raise InputError(problems)
