"""Monte Carlo study by elastodynamics: thousands of ruptures at each correlation length."""

from __future__ import annotations

import dataclasses
import sys

import xarray as xr

from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.ruptures import METHOD as WHOLE
from stiction.papers.albertini2020.studies.study_cache import place_of
from stiction.study.ensemble import Ensemble
from stiction.study.study import Study

METHOD = dataclasses.replace(WHOLE, stop="runaway")
"""Loads and arrested events are what is asked for; the rest of each rupture would take as long."""
_COST = 500
"""Of such a run, in samples by the local criterion."""

name = "dynamic"
title = "Monte Carlo study by elastodynamics"
depends = ("seed", "dynamic")


def cost(context: Context) -> int:
    """Every run."""
    return len(context.setting.correlation_ratios) * context.dynamic * _COST


def compute(context: Context) -> xr.Dataset:
    """Onset of samples 0, 1, ... of the Monte Carlo study, with inertia.

    With a folder, runs are stored as they are done: an interrupted study goes on, and more of them
    later cost only what is new.
    """
    setting = context.setting
    place = place_of(sys.modules[__name__], context, depends=("seed",))
    parts = []
    for ratio in setting.correlation_ratios:
        study = Study(
            problem=setting.problem,
            random=setting.field(ratio),
            method=METHOD,
            ensemble=Ensemble(samples=context.dynamic, seed=context.seed),
            title=f"elastodynamics at xi_0/h_n = {ratio:g}",
        )
        out = None if place is None else place.with_name(f"{place.name}-{ratio:g}")
        if out is not None:
            out.parent.mkdir(parents=True, exist_ok=True)
        parts.append(
            context.listen(
                lambda tell, study=study, out=out: study.run(  # type: ignore[misc]  # bound now
                    out=out,
                    workers=context.workers,
                    executor=context.executor,
                    progress=tell,
                ),
                _COST,
            )
        )
    dataset = xr.concat(parts, dim="correlation_ratio", combine_attrs="drop")
    return dataset.assign_coords(
        correlation_ratio=(
            "correlation_ratio",
            list(setting.correlation_ratios),
            {"units": "1", "long_name": "xi_0/h_n"},
        )
    )
