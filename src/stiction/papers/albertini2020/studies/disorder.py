"""More disorder than the paper's: wide strength ranges, random load, random residual strength."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr

from stiction.equilibrium.method import Equilibrium
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.ruptures import METHOD
from stiction.random.marginals import Beta
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface

name = "disorder"
title = "More disorder: wide strength range, random load, random residual strength"

MOST = 250
WIDE = ("twice the range", "four times the range")
RUNS = 8
"""Ruptures of each of them."""
_NODES = 512  # of the ruptures: creep between many events takes thousands of steps
_EVENTS = 10  # cost of a sample with arrested events, in samples without


def ratio_of(context: Context) -> float:
    """The correlation length of this study: the second of the setting's."""
    return context.setting.correlation_ratios[1]


def widened(setting: Setting, factor: float) -> Beta:
    """The setting's strength with the same lower bound on a wider range, as a Beta."""
    own = setting.marginal
    if isinstance(own, Beta):
        return dataclasses.replace(own, high=own.low + factor * (own.high - own.low))
    low = 0.66 * setting.mean
    return Beta(alpha=1.5, beta=3.0, low=low, high=low + factor * setting.mean)


def noise(setting: Setting, ratio: float, deviation: float, centre: float) -> RandomField:
    """A symmetric field between bounds sqrt(5) standard deviations apart from its centre."""
    half = np.sqrt(5.0) * deviation
    return setting.field(
        ratio, marginal=Beta(alpha=2.0, beta=2.0, low=centre - half, high=centre + half)
    )


def _cases(context: Context) -> dict[str, RandomInterface]:
    setting, ratio = context.setting, ratio_of(context)
    own, unit = setting.field(ratio), setting.mean
    # Residual strength stays below the weakest strength.
    residual = float(np.mean(setting.problem.friction.residual_strength))
    spread = 0.45 * (max(setting.bounds[0], 0.0) - residual) / (2.0 * np.sqrt(5.0))
    cases: dict[str, RandomInterface] = {
        "as it is": RandomInterface(strength=own),
        "twice the range": RandomInterface(
            strength=setting.field(ratio, marginal=widened(setting, 2.0))
        ),
        "four times the range": RandomInterface(
            strength=setting.field(ratio, marginal=widened(setting, 4.0))
        ),
        "random load": RandomInterface(
            strength=own, initial_stress=noise(setting, ratio, 0.05 * unit, 0.0)
        ),
    }
    if spread > 0.0:
        for label, factor in (("random stress drop", 1.0), ("more random stress drop", 2.0)):
            deviation = factor * spread
            level = noise(setting, 4.0 * ratio, deviation, residual + 2.3 * deviation)
            cases[label] = RandomInterface(strength=own, residual_strength=level)
    return cases


def _count(context: Context) -> int:
    return min(MOST, max(context.samples // 8, 32))


def cost(context: Context) -> int:
    """Every case."""
    static = len(_cases(context)) * work(Equilibrium(), _count(context)) * _EVENTS
    return static + len(WIDE) * work(METHOD, RUNS)


def compute(context: Context) -> xr.Dataset:
    """First instability, critical stress and arrested events of the same draws, case by case."""
    parts = []
    cases = _cases(context)
    count = _count(context)
    for random in cases.values():
        found = context.monte_carlo(
            context.setting.problem, random, Equilibrium(), count, weight=_EVENTS
        )
        parts.append(found[["first_instability", "critical_stress", "arrested_events"]])
    dataset = xr.concat(parts, dim="case", combine_attrs="drop").assign_coords(case=list(cases))
    # With inertia, where arrests are common enough to be counted among few runs.
    problem = context.setting.problem
    interface = dataclasses.replace(problem.interface, nodes=min(problem.interface.size, _NODES))
    coarser = dataclasses.replace(problem, interface=interface)
    runs = [
        context.monte_carlo(coarser, cases[case], METHOD, RUNS)["arrested_events"] for case in WIDE
    ]
    dataset["dynamic_arrests"] = (("wide", "run"), np.array([each.values for each in runs]))
    dataset = dataset.assign_coords(wide=list(WIDE))
    dataset.attrs["correlation_ratio"] = ratio_of(context)
    return dataset
