"""Samples whose first instability comes to rest by equilibrium: how long it gets, and inertia."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stiction.equilibrium.events import equilibrium_events
from stiction.evaluation import onset
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.ruptures import METHOD

name = "arrest"
title = "Arrested events by equilibrium, run again with inertia"
needs = ("interaction",)

MOST = 8
"""Samples run again at each correlation length."""


def cost(context: Context) -> int:
    """At most so many runs."""
    return len(context.setting.correlation_ratios) * work(METHOD, MOST)


def compute(context: Context) -> xr.Dataset:
    """Over 'event': length of the first arrested patch, and arrests in the dynamic run."""
    setting = context.setting
    problem = setting.problem
    found = context.results["interaction"]["arrested_events"]
    chosen = [
        (ratio, int(number))
        for ratio in setting.correlation_ratios
        for number in np.flatnonzero(found.sel(correlation_ratio=ratio).values > 0)[:MOST]
    ]

    def again(which: tuple[float, int]) -> tuple[float, int, float, float, float]:
        ratio, number = which
        profile = setting.field(ratio).sample(
            problem.interface, samples=1, seed=context.seed, first=number
        )
        events = equilibrium_events(problem, profile)
        run = onset(problem, profile, method=METHOD, progress=False)
        return (
            ratio,
            number,
            float(events["length"].values.max(initial=0.0)),
            float(events["load"].values.min(initial=np.inf)),
            float(run["arrested_events"].values[0]),
        )

    rows = context.map(again, chosen, work(METHOD, 1))
    context.report(cost(context) - work(METHOD, len(chosen)))
    columns = np.array(rows, dtype=np.float64).reshape(-1, 5)
    return xr.Dataset(
        {
            key: ("event", columns[:, i], {"units": unit, "long_name": text})
            for i, (key, unit, text) in enumerate(
                (
                    ("ratio", "1", "xi_0/h_n"),
                    ("number", "1", "sample number"),
                    ("length", "m", "longest arrested patch by equilibrium"),
                    ("load", "Pa", "load at the first arrested event"),
                    ("dynamic_arrests", "1", "arrested events with inertia"),
                )
            )
        }
    )
