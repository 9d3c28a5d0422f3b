"""Where studies are run and kept: a folder that a second call only completes.

A `st.Study` keeps its samples in a folder of its own. Any other study is a function with the
decorator `kept`: its result is a file, and each part that it maps is a file until it is done.
"""

import collections
import contextlib
import copy
import functools
import hashlib
import inspect
import itertools
import json
import shutil
import threading
import time
from collections.abc import Mapping
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import xarray as xr

import stiction as st
from reproduction import PARAMETERS, setting

with contextlib.suppress(ImportError):  # xarray would import it in several threads at once
    import dask.base  # noqa: F401


_KINDS = "samples ruptures readings few driven vanishing what_if arrests dynamic"
Size = collections.namedtuple("Size", _KINDS)
"""How much of each kind is computed. The last three belong to `--full` alone."""
QUICK = Size(500, 4, 200, 6, 4, 300, 40, 2, 4)
USUAL = Size(10_000, 20, 300, 10, 6, 1500, 400, 60, 1000)
FULL = USUAL._replace(readings=1000, few=60, driven=16, vanishing=10_000)


class LeftOut(Exception):
    """A study is not computed in this run, or not yet."""


class Data:
    """The studies by name, as futures, with short ways to their numbers.

    With `wait=False` a study that is still being computed counts as left out.
    """

    def __init__(self, studies: Mapping[str, Future], size: Size, *, wait: bool = True) -> None:
        self.studies, self.size, self.wait = studies, size, wait

    def __contains__(self, name: str) -> bool:
        return name in self.studies and (self.wait or self.studies[name].done())

    def __getitem__(self, name: str) -> xr.Dataset:
        if name not in self:
            raise LeftOut(name)
        return self.studies[name].result()

    def at(self, study: str, name: str, ratio: float, **chosen) -> np.ndarray:
        """Return a variable of a study at one xi_0/h_n."""
        return self[study][name].sel(correlation_ratio=ratio, **chosen).values

    def reading(self, key: str, name: str, ratio: float) -> np.ndarray:
        """Return a variable of a reading of the modulus at one xi_0/h_n."""
        return self.at("readings", name, ratio, reading=key)

    def stress(self, ratio: float, study: str = "local") -> np.ndarray:
        """Return tau_cr of every sample, Pa."""
        return self.at(study, "critical_stress", ratio)

    def excess(self, ratio: float) -> np.ndarray:
        """Return how far the first instability by the local criterion is above the exact one.

        Relative to tau_cr - tau_r.
        """
        name = "first_instability"
        local, exact = self.at("local", name, ratio), self.at("exact", name, ratio)
        return (local - exact) / (exact - setting.RESIDUAL)


class Runner:
    """Runs studies of a size into a folder, side by side on so many threads."""

    def __init__(self, out: Path, size: Size, seed: int, workers: int) -> None:
        self.folder = out / "studies"
        self.folder.mkdir(parents=True, exist_ok=True)
        self.size, self.seed, self.workers = size, seed, workers
        self.began = time.monotonic()
        self.locks = collections.defaultdict(threading.Lock)

    @contextlib.contextmanager
    def started(self, jobs):
        """Compute studies, given as (name, text, function); yield their futures by name.

        They share the threads of `pool`. One study more than these is under way, so that no
        thread waits for the last samples of a study.
        """

        def compute(text, function):
            self.say(text)
            return function(self)

        with (
            ThreadPoolExecutor(self.workers) as self.pool,
            ThreadPoolExecutor(self.workers + 1) as studies,
        ):
            try:
                futures = {name: studies.submit(compute, *job) for name, *job in jobs}
                yield futures
                for future in futures.values():
                    future.result()
            except BaseException:
                # A run waits for the futures of its batches. Cancelled, they would never end.
                self.pool.shutdown(wait=False)
                studies.shutdown(wait=False, cancel_futures=True)
                raise

    def say(self, text: str) -> None:
        """Print a line of progress."""
        print(f"{time.monotonic() - self.began:5.0f} s  {text}", flush=True)

    def study(self, name: str, study: st.Study) -> xr.Dataset:
        """Run a study into its folder, or what is missing of it."""
        plain = study.to_dict()
        del plain["samples"]
        plain.pop("title", None)
        place = self.folder / f"{name}-{_digest(plain)}"
        with self.locks[place]:
            return study.run(out=place, executor=self.pool, progress=False, pilot=False)

    def sweep(self, name: str, problem, field_of, method, samples: int, ratios=setting.RATIOS):
        """Run one study at each xi_0/h_n, with draws of its own, along 'correlation_ratio'."""
        parts = []
        for ratio in ratios:
            random = field_of(ratio)
            study = st.Study(
                problem=problem, random=random, method=method, samples=samples,
                seed=self.seed_of(ratio),
            )  # fmt: skip
            parts.append(self.study(f"{name}-{ratio:g}", study))
        return along("correlation_ratio", ratios, parts)

    def seed_of(self, ratio: float) -> int:
        """Return the seed of a correlation length: each has draws of its own, as in the paper."""
        return self.seed * 1000 + round(100 * ratio)

    def map(self, function, items) -> list:
        """Return the datasets function(*item) for item in items, computed by all threads.

        Each is written as soon as it is computed, so that an interrupted study repeats none.
        """
        items = list(items)
        places = [self.parts / f"{number}.nc" for number in range(len(items))]
        compute = [functools.partial(function, *item) for item in items]
        return list(self.pool.map(self.stored, places, compute))

    def stored(self, place: Path, compute) -> xr.Dataset:
        """Return a stored dataset, or compute and store it."""
        result = None if place.exists() else compute()
        with self.locks["netCDF"]:  # its library is for one thread at a time
            if result is not None:
                place.parent.mkdir(parents=True, exist_ok=True)
                result.to_netcdf(place.with_suffix(".unfinished"))
                place.with_suffix(".unfinished").replace(place)
            return xr.load_dataset(place)

    def grid(self, function, **axes) -> xr.Dataset:
        """Return the datasets function(*point) of all points of a grid, along its axes."""
        parts = self.map(function, itertools.product(*axes.values()))
        for name, values in reversed(axes.items()):
            starts = range(0, len(parts), len(values))
            parts = [along(name, values, parts[i : i + len(values)]) for i in starts]
        return parts[0]

    def batches(self, function, dim: str, values, samples: int) -> xr.Dataset:
        """Return function(value, first, count) of all samples at each value, by equal batches.

        Variables along 'draw' are joined along 'sample', others are added.
        """
        count = min(samples, 1000)
        axes = {dim: values, "first": range(0, samples, count)}
        parts = self.grid(lambda value, first: function(value, first, count), **axes)
        added = parts.drop_dims("draw").sum("first")
        joined = parts.drop_vars(added.data_vars).stack(
            sample=("first", "draw"), create_index=False
        )
        return (
            joined.drop_vars("first", errors="ignore")
            .transpose(dim, "sample", ...)
            .merge(added)
        )


def kept(**inputs):
    """Make a function of a runner a study: its result is kept with a digest of inputs and source.

    `inputs` are functions of a `Size` for its further arguments.
    """

    def decorate(function):
        @functools.wraps(function)
        def study(run: Runner) -> xr.Dataset:
            values = {name: choose(run.size) for name, choose in inputs.items()}
            source = inspect.getsource(function)
            mark = _digest([run.seed, st.__version__, source, values, PARAMETERS])
            place = run.folder / f"{function.__name__}-{mark}.nc"
            within = copy.copy(run)
            within.parts = place.with_suffix("")
            with run.locks[place]:
                result = run.stored(place, lambda: function(within, **values))
                shutil.rmtree(within.parts, ignore_errors=True)
                return result

        return study

    return decorate


def along(dim: str, values, parts) -> xr.Dataset:
    """Join datasets along a new dimension."""
    joined = xr.concat(parts, dim=dim, combine_attrs="drop")
    return joined.assign_coords({dim: list(values)})


def _digest(plain) -> str:
    text = json.dumps(plain, sort_keys=True, default=str)
    return hashlib.sha256(text.encode()).hexdigest()[:10]
