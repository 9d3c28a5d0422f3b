"""The paper's studies: what is computed before anything is drawn or judged, one module a study.

A study is a module with the names of `registry.Study`. To add one, write the module and list it
here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

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
from stiction.papers.albertini2020.studies.side_by_side import side_by_side
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
    """The named studies and those that they need, in the order of the registry."""
    found = dict(results(names, context))
    return {name: found[name] for name in STUDIES if name in found}


def results(names: Iterable[str], context: Context) -> Iterator[tuple[str, xr.Dataset]]:
    """The named studies and those that they need, as they are done.

    With a folder in the context, what is kept there from an earlier run is not computed again.
    """
    wanted = with_needs(names)
    missing = []
    for name, study in STUDIES.items():
        if name not in wanted:
            continue
        dataset = kept(study, context)
        if dataset is None:
            missing.append(study)
            continue
        context.report(study.cost(context))
        context.results[name] = dataset
        yield name, dataset
    for study, dataset in side_by_side(missing, context):
        keep(study, context, dataset)
        yield study.name, dataset
