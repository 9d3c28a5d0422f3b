"""Interfaces with free ends, exactly: in mode III a mirrored field has free mirror planes."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr

from stiction.criterion.nucleation import nucleation_stress
from stiction.equilibrium.method import Equilibrium
from stiction.evaluation import onset
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.problem import Problem
from stiction.statistics.estimates import Estimate, mean

name = "free_end"
title = "Free ends in mode III"

MOST = 400
FACTORS = (0.25, 0.5)
"""Shorter interfaces, over the setting's length, at the shortest correlation length."""
_PART = 50


def _count(context: Context) -> int:
    return min(MOST, max(context.samples // 8, 32))


def cost(context: Context) -> int:
    """Both interfaces, the mirrored one twice as long."""
    ratios = len(context.setting.correlation_ratios)
    return (3 * ratios + 4) * work(Equilibrium(), _count(context))


def compute(context: Context) -> xr.Dataset:
    """Critical stress of the same strength on a periodic interface and on one with free ends.

    A field mirrored at x = 0 and L makes antiplane displacement even in x there: no stress acts
    on these planes, as if the solids ended.
    """
    setting, count = context.setting, _count(context)
    problem = dataclasses.replace(setting.problem, mode="III")
    interface, double = problem.interface, _longer(problem, 2.0)
    numbers: dict[str, list[np.ndarray]] = {key: [] for key in ("periodic", "free", "end", "rule")}
    length = problem.nucleation_length
    for ratio in setting.correlation_ratios:
        field = setting.field(ratio, nucleation_length=length)
        found: dict[str, list[np.ndarray]] = {key: [] for key in numbers}
        for first in range(0, count, _PART):
            part = min(_PART, count - first)
            profiles = field.sample(interface, samples=part, seed=context.seed, first=first)
            mirrored = np.concatenate([profiles, profiles[:, ::-1]], axis=1)
            periodic = onset(problem, profiles, method=Equilibrium())
            free = onset(double, mirrored, method=Equilibrium())
            found["periodic"].append(periodic["first_instability"].values)
            found["free"].append(free["first_instability"].values)
            found["rule"].append(nucleation_stress(double, mirrored).min(axis=1))
            # Nodes are half a spacing from the mirror planes.
            place = free["critical_position"].values + 0.5 * interface.spacing
            place = np.mod(place, interface.extent)
            found["end"].append(np.minimum(place, interface.extent - place) / length)
            context.report(3 * work(Equilibrium(), part))
        for key, values in found.items():
            numbers[key].append(np.concatenate(values))
    dims = ("correlation_ratio", "sample")
    texts = {
        "periodic": ("Pa", "first instability, periodic"),
        "free": ("Pa", "first instability, free ends"),
        "end": ("1", "distance of the onset from the nearer end over h_n"),
        "rule": ("Pa", "local criterion on the mirrored interface"),
    }
    dataset = xr.Dataset(
        {
            key: (dims, np.array(values), {"units": texts[key][0], "long_name": texts[key][1]})
            for key, values in numbers.items()
        },
        coords={"correlation_ratio": list(setting.correlation_ratios)},
    )
    changes = [_change(_longer(problem, factor), context) for factor in FACTORS]
    whole = dataset["free"] / dataset["periodic"] - 1.0
    changes.append(mean(whole.isel(correlation_ratio=0).values))
    dataset["finite_change"] = ("length_factor", [each.value for each in changes])
    dataset["finite_change_error"] = ("length_factor", [each.error for each in changes])
    return dataset.assign_coords(length_factor=[*FACTORS, 1.0])


def _longer(problem: Problem, factor: float) -> Problem:
    grid = problem.interface
    longer = dataclasses.replace(
        grid, length=factor * grid.extent, nodes=2 * round(0.5 * factor * grid.size)
    )
    return dataclasses.replace(problem, interface=longer)


def _change(problem: Problem, context: Context) -> Estimate:
    """Relative change of the mean of tau_cr by free ends at the shortest correlation length."""
    setting, count = context.setting, _count(context)
    field = setting.field(
        setting.correlation_ratios[0], nucleation_length=problem.nucleation_length
    )
    profiles = field.sample(problem.interface, samples=count, seed=context.seed)
    mirrored = np.concatenate([profiles, profiles[:, ::-1]], axis=1)
    periodic = onset(problem, profiles, method=Equilibrium(), progress=False)
    free = onset(_longer(problem, 2.0), mirrored, method=Equilibrium(), progress=False)
    context.report(2 * work(Equilibrium(), count))
    return mean(free["first_instability"].values / periodic["first_instability"].values - 1.0)
