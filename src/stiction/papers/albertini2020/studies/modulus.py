"""Three readings of the paper's modulus, each with all that depends on it."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import numpy as np
import xarray as xr

from stiction.criterion.method import LocalCriterion
from stiction.equilibrium.method import Equilibrium
from stiction.papers.albertini2020.derived import apart
from stiction.papers.albertini2020.setting import Setting
from stiction.papers.albertini2020.studies.context import Context, work
from stiction.papers.albertini2020.studies.ruptures import printed_problem
from stiction.problem import Problem
from stiction.statistics.estimates import Estimate, mean, share

name = "modulus"
title = "Plane stress, plane strain, or one for the other"
needs = ("monte_carlo", "interaction")

MOST = 2000
READINGS = {
    "a": "plane stress throughout",
    "b": "plane strain throughout",
    "c": "plane-stress simulations, predicted with the printed modulus, xi_0 by the printed h_n",
    "c'": "the same, xi_0 by the true h_n",
}
"""The text says plane stress and prints G/(1 - nu), the modulus of plane strain."""


def _plane(problem: Problem, plane: Literal["stress", "strain"]) -> Problem:
    return dataclasses.replace(problem, solid=dataclasses.replace(problem.solid, plane=plane))


def cases(setting: Setting) -> dict[str, tuple[Problem, Problem, float]]:
    """Of each reading: what is simulated, what predicts it, and the h_n that xi_0 is told in."""
    stress, strain = _plane(setting.problem, "stress"), _plane(setting.problem, "strain")
    true, printed = stress.nucleation_length, strain.nucleation_length
    return {
        "a": (stress, stress, true),
        "b": (strain, strain, printed),
        "c": (stress, strain, printed),
        "c'": (stress, strain, true),
    }


def _count(context: Context) -> int:
    return min(MOST, context.fewer)


def cost(context: Context) -> int:
    """Both methods for each reading."""
    each = work(Equilibrium(), 1) + 2 * work(LocalCriterion(), 1)
    return len(READINGS) * each * _count(context) * len(context.setting.correlation_ratios)


def _key(problem: Problem, unit: float, ratio: float, method: Any) -> Any:
    return problem.solid.plane, unit, ratio, method.type


def _from_other_studies(context: Context) -> dict[Any, xr.Dataset]:
    """Onsets of the setting's own reading, which other studies have."""
    setting, local, exact = context.setting, LocalCriterion(), Equilibrium()
    own, strain = setting.problem, printed_problem(setting.problem)
    known = {}
    for ratio in setting.correlation_ratios:
        first = {"correlation_ratio": ratio, "sample": slice(0, _count(context) - 1)}
        many, every = (context.results[study].sel(first) for study in needs)
        told = every[["printed_first_instability", "printed_critical_position"]]
        told = told.rename({str(name): str(name).removeprefix("printed_") for name in told})
        unit = own.nucleation_length
        known[_key(strain, unit, ratio, local)] = told
        known[_key(own, unit, ratio, local)] = many
        known[_key(own, unit, ratio, exact)] = every
    return known


def compute(context: Context) -> xr.Dataset:
    """Bias and misplaced onsets of the prediction, its share of interaction, and patches."""
    setting, count = context.setting, _count(context)
    known = _from_other_studies(context)

    def onsets(problem: Problem, unit: float, ratio: float, method: Any) -> xr.Dataset:
        """What two readings have in common is computed once."""
        key = _key(problem, unit, ratio, method)
        if key in known:
            context.report(work(method, count))
        else:
            field = setting.field(ratio, nucleation_length=unit)
            known[key] = context.monte_carlo(problem, field, method, count)
        return known[key]

    rows: dict[str, list[list[Estimate]]] = {}
    lengths = []
    for simulated, predicting, unit in cases(setting).values():
        row: dict[str, list[Estimate]] = {}
        for ratio in setting.correlation_ratios:
            exact = onsets(simulated, unit, ratio, Equilibrium())
            told = onsets(predicting, unit, ratio, LocalCriterion())
            own = onsets(simulated, unit, ratio, LocalCriterion())
            stress = exact["first_instability"].values
            gap = 100.0 * (told["first_instability"].values - stress) / stress.mean()
            part = 100.0 * (own["first_instability"].values - stress) / stress.mean()
            quotient = float(part.mean() / gap.mean())
            wrong = apart(
                predicting, told["critical_position"].values, exact["critical_position"].values
            )
            square = mean(gap**2)
            root = float(np.sqrt(square.value))
            for key, found in {
                "bias": mean(gap),
                "error": Estimate(root, square.error / (2.0 * root)),
                "interaction": Estimate(
                    quotient, mean(part - quotient * gap).error / abs(float(gap.mean()))
                ),
                "misplaced": share(wrong),
                "patches": mean(exact["slip_patches"].values),
            }.items():
                row.setdefault(key, []).append(found)
        for key, series in row.items():
            rows.setdefault(key, []).append(series)
        lengths.append(predicting.nucleation_length / predicting.interface.extent)
    texts = {
        "bias": ("%", "predicted less exact onset, mean"),
        "error": ("%", "predicted less exact onset, root mean square"),
        "interaction": ("1", "share of interaction in that"),
        "misplaced": ("1", "share of onsets more than h_n/2 from the prediction"),
        "patches": ("1", "slipping patches at the onset, mean"),
    }
    dims = ("reading", "correlation_ratio")
    numbers: dict[str, Any] = {}
    for key, table in rows.items():
        unit_text, text = texts[key]
        attributes = {"units": unit_text, "long_name": text}
        numbers[key] = (dims, np.array([[e.value for e in row] for row in table]), attributes)
        numbers[f"{key}_error"] = (dims, np.array([[e.error for e in row] for row in table]))
    numbers["length"] = ("reading", np.array(lengths), {"units": "1", "long_name": "h_n/L"})
    coordinates = {
        "reading": list(READINGS), "correlation_ratio": list(setting.correlation_ratios)
    }  # fmt: skip
    return xr.Dataset(numbers, coords=coordinates)
