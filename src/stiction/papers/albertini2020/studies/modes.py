"""Equations 11 to 13: what pre-computing modal terms saves, and what higher modes matter."""

from __future__ import annotations

import time

import numpy as np
import xarray as xr

from stiction._typing import Array
from stiction.criterion.eigenproblem import rounded_weight
from stiction.criterion.nucleation import nucleation_stress
from stiction.papers.albertini2020.studies.context import Context
from stiction.papers.albertini2020.studies.summary import stack
from stiction.problem import Problem

name = "modes"
title = "Pre-computed modal terms, and higher modes"
depends = ("seed",)

MOST = 200
POWER_KEPT = 1.0 - 1e-7
_POINTS = 64
_REPEATS = 5


def cost(context: Context) -> int:
    """Three times the samples at each correlation length."""
    return 3 * MOST * len(context.setting.correlation_ratios)


def compute(context: Context) -> xr.Dataset:
    """Changes of tau_cr with more modes, and the time of Eq. 9 over that of Eq. 13."""
    setting = context.setting
    problem, interface = setting.problem, setting.problem.interface
    parts = {}
    for ratio in setting.correlation_ratios:
        field = setting.field(ratio)
        profiles = field.sample(interface, samples=MOST, seed=context.seed)
        more = setting.field(ratio, power_kept=POWER_KEPT)
        usual = nucleation_stress(problem, profiles).min(axis=1)
        kept = 2.0 * setting.spectrum(ratio).cutoff
        numbers = {}
        for key, other in (
            ("untruncated", more.sample(interface, samples=MOST, seed=context.seed)),
            ("cut", _cut(profiles, kept, interface.spacing)),
        ):
            change = nucleation_stress(problem, other).min(axis=1) / usual - 1.0
            root = float(np.sqrt(np.mean(change**2)))
            numbers[f"{key}_change"] = root
            numbers[f"{key}_change_error"] = float(np.std(change**2) / (2 * root * MOST**0.5))
        parts[ratio] = xr.Dataset(numbers)
        context.report(3 * MOST)
    dataset = stack(parts, "correlation_ratio", "xi_0/h_n")
    slow, direct = _timed(lambda: quadrature(problem, profiles[0]))
    fast, modal = _timed(lambda: nucleation_stress(problem, profiles[:1], weights="rounded")[0])
    dataset["saving"] = ((), slow / fast, {"units": "1"})
    dataset["difference"] = ((), float(np.abs(direct / modal - 1.0).max()), {"units": "1"})
    return dataset


def _cut(profiles: Array, wavenumber: float, spacing: float) -> Array:
    """The profiles with the modes up to a wavenumber only."""
    modes = np.fft.rfft(profiles, axis=1)
    modes[:, 2.0 * np.pi * np.fft.rfftfreq(profiles.shape[1], spacing) > wavenumber] = 0.0
    return np.fft.irfft(modes, profiles.shape[1], axis=1)


def quadrature(problem: Problem, profile: Array) -> Array:
    """Eq. 9 as it stands, at every node: the plain reference of the modal form."""
    interface = problem.interface
    t = (np.arange(_POINTS) + 0.5) * np.pi / _POINTS
    s, weight = np.cos(t), rounded_weight().at(np.cos(t)) * np.sin(t) * np.pi / _POINTS
    found = np.empty(interface.size)
    for i, x in enumerate(interface.x):
        place = x + 0.5 * problem.nucleation_length * s
        found[i] = weight @ np.interp(place, interface.x, profile, period=interface.extent)
    return found


def _timed(work: object) -> tuple[float, Array]:
    """The shortest time of several, s, and the result."""
    assert callable(work)
    times = []
    for _ in range(_REPEATS):
        started = time.thread_time()
        result = work()
        times.append(time.thread_time() - started)
    return max(min(times), 1e-9), result
