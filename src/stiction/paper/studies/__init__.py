"""The paper's studies: what is computed before anything is drawn or judged, one module a study.

A study is a module with `name`, `title`, `cost(context)` (samples it will compute, for progress)
and `compute(context)`, which returns a labelled dataset. To add one, write the module and list it
here.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from typing import Any

import xarray as xr

from stiction.paper.studies import (
    correction,
    interaction,
    interface_length,
    monte_carlo,
    skewness,
    spectrum,
    theory,
    trend,
    window,
)
from stiction.paper.studies.context import Context

STUDIES: dict[str, Any] = {
    study.name: study
    for study in (
        theory,
        monte_carlo,
        interaction,
        trend,
        window,
        correction,
        skewness,
        spectrum,
        interface_length,
    )
}


def cost(names: Iterable[str], context: Context) -> int:
    """Samples that the named studies compute, for progress."""
    return sum(STUDIES[name].cost(context) for name in set(names))


def compute(names: Iterable[str], context: Context) -> dict[str, xr.Dataset]:
    """The named studies, in the order of the registry, each with the time that it took."""
    wanted = set(names)
    results = {}
    for name, study in STUDIES.items():
        if name not in wanted:
            continue
        started = time.perf_counter()
        context.title = study.title
        dataset: xr.Dataset = study.compute(context)
        dataset.attrs["title"] = study.title
        dataset.attrs["seconds"] = time.perf_counter() - started
        results[name] = dataset
    return results
