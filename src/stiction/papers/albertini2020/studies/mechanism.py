"""How interaction works: one dip of the strength, two dips, and the samples that are misplaced."""

from __future__ import annotations

import dataclasses

import numpy as np
import xarray as xr

from stiction._typing import Array
from stiction.criterion.nucleation import nucleation_stress
from stiction.equilibrium.method import Equilibrium
from stiction.equilibrium.path import equilibrium_path
from stiction.evaluation import onset
from stiction.load import Load
from stiction.papers.albertini2020.derived import apart
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.statistics.estimates import mean

name = "mechanism"
title = "How patches act on each other"
needs = ("monte_carlo", "interaction")

DISTANCES = (1.25, 1.5, 2.0, 3.0, 5.0, 8.0)
"""Of the centres of two dips, in h_n."""
MOST = 100
_SAMPLES = 16
_DEEP, _SHALLOWER, _PARTNER = 0.30, 0.298, 0.28
"""Depths of dips over the mean strength: one alone, one a little less deep, and its neighbour."""


def cost(context: Context) -> int:
    """The dips, and two groups of samples."""
    return (2 * MOST + 2 * _SAMPLES + 20) * work(Equilibrium(), 1)


def dips(setting: Setting, *places: tuple[float, float]) -> Array:
    """Mean strength with smooth dips half a nucleation length wide.

    Parameters
    ----------
    setting : Setting
    *places : (centre in h_n from the middle, depth over the mean strength)
    """
    interface, length = setting.problem.interface, setting.problem.nucleation_length
    x = (interface.x - 0.5 * interface.extent) / length
    shape = np.zeros_like(x)
    for centre, depth in places:
        shape += depth * np.exp(-2.0 * ((x - centre) / 0.8) ** 2)
    result: Array = setting.mean * (1.0 - shape)
    return result


def compute(context: Context) -> xr.Dataset:
    """Stress around one patch; lowering by a neighbour; a pair; misplaced samples; load and
    strength exchanged."""
    setting = context.setting
    dataset = xr.Dataset()
    _one_patch(setting, dataset)
    _two_patches(setting, dataset)
    _pair(setting, dataset)
    _misplaced(context, dataset)
    _exchanged(context, dataset)
    context.report(cost(context))
    return dataset


def _onset(setting: Setting, profiles: Array) -> xr.Dataset:
    return onset(setting.problem, profiles, method=Equilibrium(), progress=False)


def _one_patch(setting: Setting, dataset: xr.Dataset) -> None:
    profile = dips(setting, (0.0, _DEEP))
    load = 0.999 * float(_onset(setting, profile)["first_instability"][0])
    path = equilibrium_path(setting.problem, profile, [load]).isel(load=0)
    change = path["stress"].values / load - 1.0
    slipping = path["slip"].values > 0.0
    interface, unit = setting.problem.interface, setting.problem.nucleation_length
    x = interface.x - 0.5 * interface.extent
    edge = float(np.abs(x[slipping]).max())

    def beside(distance: float) -> float:
        return float(np.interp(edge + distance * unit, x, change))

    dataset["stress_inside"] = ((), float(change[slipping].mean()))
    dataset["stress_beside"] = ((), beside(0.25))
    dataset["stress_far"] = ((), beside(1.0))
    dataset["one_stress"] = ("x", path["stress"].values, {"units": "Pa"})
    dataset["one_strength"] = ("x", profile, {"units": "Pa"})
    dataset.attrs["one_load"] = load
    dataset.coords["x"] = ("x", interface.x, {"units": "m"})


def _two_patches(setting: Setting, dataset: xr.Dataset) -> None:
    profiles = np.array([dips(setting, (-0.5 * d, _DEEP), (0.5 * d, _DEEP)) for d in DISTANCES])
    exact = _onset(setting, profiles)["first_instability"].values
    local = nucleation_stress(setting.problem, profiles).min(axis=1)
    alone = dips(setting, (0.0, _DEEP))
    single = float(_onset(setting, alone)["first_instability"][0])
    own = float(nucleation_stress(setting.problem, alone).min())
    # What a single dip misses is no interaction; where dips overlap both methods see it.
    dataset["lowering"] = ("distance", (local - exact) / exact - (own - single) / single)
    dataset.coords["distance"] = ("distance", list(DISTANCES), {"long_name": "distance over h_n"})


def _pair(setting: Setting, dataset: xr.Dataset) -> None:
    profile = dips(setting, (-8.0, _DEEP), (6.0, _SHALLOWER), (7.5, _PARTNER))
    tau_n = nucleation_stress(setting.problem, profile)
    exact = _onset(setting, profile)
    spacing = setting.problem.interface.spacing
    dataset["pair_strength"] = ("x", profile, {"units": "Pa"})
    dataset["pair_nucleation_stress"] = ("x", np.ravel(tau_n), {"units": "Pa"})
    dataset["pair_local"] = ((), float(np.ravel(tau_n).argmin() * spacing), {"units": "m"})
    dataset["pair_exact"] = ((), float(exact["critical_position"][0]), {"units": "m"})
    dataset["pair_stress"] = ((), float(exact["first_instability"][0]), {"units": "Pa"})


def _misplaced(context: Context, dataset: xr.Dataset) -> None:
    setting = context.setting
    problem, ratio = setting.problem, setting.correlation_ratios[0]
    local = context.results["monte_carlo"].sel(correlation_ratio=ratio)
    exact = context.results["interaction"].sel(correlation_ratio=ratio)
    place, stress = exact["critical_position"].values, exact["first_instability"].values
    wrong = apart(problem, local["critical_position"].values, place)
    for key, numbers in (("wrong", np.flatnonzero(wrong)), ("right", np.flatnonzero(~wrong))):
        contest, help_ = [], []
        for number in numbers[:MOST]:
            profile = setting.field(ratio).sample(
                problem.interface, samples=1, seed=context.seed, first=int(number)
            )
            tau_n = np.ravel(nucleation_stress(problem, profile))
            nodes = np.arange(tau_n.size) * problem.interface.spacing
            there = tau_n[~apart(problem, nodes, np.full(nodes.size, place[number]))].min()
            contest.append(there / tau_n.min() - 1.0)
            help_.append(there / stress[number] - 1.0)
        for label, values in (("contest", contest), ("helped", help_)):
            found = mean(values) if len(values) > 2 else None
            dataset[f"{label}_{key}"] = ((), np.nan if found is None else found.value)
            dataset[f"{label}_{key}_error"] = ((), np.nan if found is None else found.error)


def _exchanged(context: Context, dataset: xr.Dataset) -> None:
    """Strength tau_p(x) under a uniform load, and its largest value less what the stress adds."""
    setting = context.setting
    problem, field = setting.problem, setting.field(setting.correlation_ratios[1])
    profiles = field.sample(problem.interface, samples=_SAMPLES, seed=context.seed)
    differences = []
    for profile in profiles:
        highest = float(profile.max())
        loaded = dataclasses.replace(problem, load=Load(initial_stress=highest - profile))
        level = np.full(profile.size, highest)
        usual = onset(problem, profile, method=Equilibrium(), progress=False)
        other = onset(loaded, level, method=Equilibrium(), progress=False)
        shift = float((highest - profile).mean())
        one = float(usual["first_instability"][0])
        differences.append((float(other["first_instability"][0]) - shift) / one - 1.0)
    dataset["equivalence"] = ("sample", np.array(differences), {"units": "1"})
