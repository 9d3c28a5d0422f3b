"""How slip patches appear, grow and merge while the load rises to the onset."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stiction._typing import Array
from stiction.criterion.method import LocalCriterion
from stiction.equilibrium.method import Equilibrium
from stiction.equilibrium.path import equilibrium_path
from stiction.evaluation import onset
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.summary import stack
from stiction.problem import Problem

name = "growth"
title = "Slip patches on the way to the onset"

LEVELS = np.array([0.88, 0.90, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99, 0.995, 0.999])
"""Loads in units of that of the first instability."""
MOST = 40


def _count(context: Context) -> int:
    return min(MOST, context.samples // 8)


def cost(context: Context) -> int:
    """An equilibrium at each load of each sample."""
    ratios = len(context.setting.correlation_ratios)
    return ratios * _count(context) * work(Equilibrium(), LEVELS.size)


def patches(slipping: Array) -> Array:
    """Number of the patch that each node of a periodic interface belongs to, -1 where it sticks.

    Parameters
    ----------
    slipping : (nodes,) array of bool

    Returns
    -------
    (nodes,) array of int
    """
    starts = slipping & ~np.roll(slipping, 1)
    count = int(starts.sum())
    if count == 0:
        return np.where(slipping, 0, -1)
    # Nodes before the first start belong to the last patch, round the corner.
    return np.where(slipping, (np.cumsum(starts) - 1) % count, -1)


def _follow(slip: Array) -> tuple[list[int], list[int]]:
    """At each load, the patches and how many of those before have been swallowed by merging."""
    counts, merged, swallowed = [], [], 0
    before: Array | None = None
    for row in slip:
        now = patches(row > 0.0)
        if before is not None:
            for patch in range(now.max() + 1):
                inside = np.unique(before[now == patch])
                swallowed += max(int((inside >= 0).sum()) - 1, 0)
        counts.append(int(now.max()) + 1)
        merged.append(swallowed)
        before = now
    return counts, merged


def compute(context: Context) -> xr.Dataset:
    """Patches and mergers so far at each load, and whether the critical patch has merged."""
    setting = context.setting
    problem, count = setting.problem, _count(context)
    parts = {}
    for ratio in setting.correlation_ratios:
        profiles = setting.field(ratio).sample(problem.interface, samples=count, seed=context.seed)
        exact = onset(problem, profiles, method=Equilibrium())
        local = onset(problem, profiles, method=LocalCriterion())
        numbers, mergers = [], []
        critical = np.zeros(count, dtype=np.int64)
        first = np.zeros(count, dtype=np.int64)
        for i in range(count):
            load = float(exact["first_instability"].values[i])
            path = equilibrium_path(problem, profiles[i], load * LEVELS)
            slip = np.nan_to_num(path["slip"].values)
            counts, merged = _follow(slip)
            numbers.append(counts)
            mergers.append(merged)
            critical[i], first[i] = _history(problem, slip, exact, profiles, i)
            context.report(work(Equilibrium(), LEVELS.size))
        parts[ratio] = xr.Dataset(
            {
                "patches": (("sample", "level"), np.array(numbers), {"units": "1"}),
                "mergers": (("sample", "level"), np.array(mergers), {"units": "1"}),
                "critical_merged": ("sample", critical, {"units": "1"}),
                "critical_first": ("sample", first, {"units": "1"}),
                "local_stress": ("sample", local["critical_stress"].values, {"units": "Pa"}),
            }
        )
    dataset = stack(parts, "correlation_ratio", "xi_0/h_n")
    return dataset.assign_coords(
        level=("level", LEVELS, {"units": "1", "long_name": "load over that of the onset"})
    )


def _history(
    problem: Problem, slip: Array, exact: xr.Dataset, profiles: Array, sample: int
) -> tuple[int, int]:
    """Whether the critical patch has swallowed others, and whether it holds the weakest node."""
    spacing = problem.interface.spacing
    node = round(float(exact["critical_position"].values[sample]) / spacing) % slip.shape[1]
    last = patches(slip[-1] > 0.0)
    where = np.flatnonzero(last >= 0)
    if where.size == 0:
        return 0, 0
    away = np.abs(where - node)
    nearest = where[np.minimum(away, slip.shape[1] - away).argmin()]
    inside = last == last[nearest]
    merged = any(np.unique(patches(row > 0.0)[inside & (row > 0.0)]).size > 1 for row in slip[:-1])
    return int(merged), int(inside[int(profiles[sample].argmin())])
