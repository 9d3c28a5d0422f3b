"""The paper's studies: what is computed before anything is drawn or judged, one module a study.

A study is a module with the names of `registry.Study`. To add one, write the module and list it
here.
"""

from __future__ import annotations

import time
from collections.abc import Iterable

import xarray as xr

from stiction.papers.albertini2020.registry import Study, by_name
from stiction.papers.albertini2020.studies import (
    arrest,
    convergence,
    correction,
    disorder,
    driving,
    dynamic,
    failure,
    free_end,
    griffith,
    growth,
    interaction,
    many_local_samples,
    mechanism,
    modes,
    modulus,
    monte_carlo,
    pressure,
    representative,
    ruptures,
    sequence,
    size,
    skewness,
    spectrum,
    theory,
    trend,
    window,
)
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.study_cache import keep, kept

STUDIES: dict[str, Study] = by_name(
    theory,
    monte_carlo,
    interaction,
    representative,
    ruptures,
    modulus,
    modes,
    griffith,
    mechanism,
    growth,
    arrest,
    driving,
    sequence,
    convergence,
    trend,
    window,
    correction,
    skewness,
    spectrum,
    size,
    pressure,
    failure,
    disorder,
    free_end,
    many_local_samples,
    dynamic,
)


def offered(context: Context) -> set[str]:
    """Names of the studies that this context asks for: the costliest only on demand."""
    dear = {many_local_samples.name, dynamic.name}
    return {name for name in STUDIES if name not in dear or context.dynamic}


def with_needs(names: Iterable[str]) -> set[str]:
    """The named studies and those whose results they use."""
    wanted = set(names)
    for name in reversed(STUDIES):
        if name in wanted:
            wanted.update(getattr(STUDIES[name], "needs", ()))
    return wanted


def cost(names: Iterable[str], context: Context) -> int:
    """Work of the named studies, for progress."""
    return sum(STUDIES[name].cost(context) for name in with_needs(names))


def compute(names: Iterable[str], context: Context) -> dict[str, xr.Dataset]:
    """The named studies, in the order of the registry, each with the time that it took.

    With a folder in the context, what is kept there from an earlier run is not computed again.
    """
    wanted = with_needs(names)
    for name, study in STUDIES.items():
        if name not in wanted:
            continue
        dataset = kept(study, context)
        if dataset is not None:
            context.report(study.cost(context))
        else:
            started = time.perf_counter()
            context.title = study.title
            dataset = study.compute(context)
            dataset.attrs["title"] = study.title
            dataset.attrs["seconds"] = time.perf_counter() - started
            keep(study, context, dataset)
        context.results[name] = dataset
    return {name: context.results[name] for name in STUDIES if name in wanted}
