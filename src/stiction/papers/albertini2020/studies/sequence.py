"""Sequences of events where strength has a wide range: sizes, cascades, and what they leave."""

from __future__ import annotations

import numpy as np
import xarray as xr

from stiction.equilibrium.method import Equilibrium
from stiction.equilibrium.path import equilibrium_path
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.disorder import noise, ratio_of, widened
from stiction.random.random_interface import RandomInterface

name = "sequence"
title = "Event sequences: sizes, cascades and the stress they leave"

MOST = 200
EVENTS = 24
FACTOR = 4.0
_SMOOTHED = 24
_COST = 20


def interfaces(setting: Setting, ratio: float) -> dict[str, RandomInterface]:
    """A wide range of strength, without and with a random initial stress."""
    wide = setting.field(ratio, marginal=widened(setting, FACTOR))
    deviation = 0.15 * setting.mean
    return {
        "wide strength": RandomInterface(strength=wide),
        "and random stress": RandomInterface(
            strength=wide, initial_stress=noise(setting, ratio, deviation, 0.0)
        ),
    }


def _count(context: Context) -> int:
    return min(MOST, max(context.samples // 8, 32))


def cost(context: Context) -> int:
    """Both interfaces."""
    return 2 * _count(context) * work(Equilibrium(), _COST)


def compute(context: Context) -> xr.Dataset:
    """Arrested events of every sample in their order, and how they change the stress."""
    setting, ratio = context.setting, ratio_of(context)
    problem = setting.problem
    parts = []
    for random in interfaces(setting, ratio).values():
        found = context.monte_carlo(
            problem, random, Equilibrium(events=EVENTS), _count(context), weight=_COST
        )
        kept = found[["critical_stress", "first_instability", "arrested_events", "event_length",
                      "event_stress", "event_position", "event_moment",
                      "sliding_position"]]  # fmt: skip
        # Spread of the stress over the interface before and after the first event.
        change = np.full(_SMOOTHED, np.nan)
        some = np.flatnonzero(found["arrested_events"].values > 0)[:_SMOOTHED]
        for i, number in enumerate(some):
            profiles = random.profiles(
                problem.interface, samples=1, seed=context.seed, first=int(number)
            )
            initial = profiles.get("initial_stress", np.zeros((1, 1)))
            load = float(found["event_stress"].values[number, 0]) - float(initial.mean())
            path = equilibrium_path(
                problem, {k: v[0] for k, v in profiles.items()}, load * np.array([0.9999, 1.0001])
            )
            before, after = path["stress"].values.std(axis=1)
            change[i] = after / before - 1.0
        kept["roughening"] = ("smoothed", change, {"units": "1"})
        parts.append(kept)
    dataset = xr.concat(parts, dim="case", combine_attrs="drop").assign_coords(
        case=list(interfaces(setting, ratio))
    )
    dataset.attrs["correlation_ratio"] = ratio
    return dataset
