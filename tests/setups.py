"""Problems, strengths and onsets that many tests begin with."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from recording import stored

import stiction as st

SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="strain")
QUARTER = st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0, plane="strain")
RATE = 0.5e12
LENGTH = 3.46e-3
"""Nucleation length h_n of the paper's solid at that rate, along x."""
ROUND_OFF = 1e-12
"""Of sums of thousands of terms, in any order and by any processor."""
LOCAL, EXACT = st.LocalCriterion(), st.Equilibrium()


def make_problem(
    nodes: Any = 256, length: Any = 0.1, *, solid: st.Solid = SOLID, friction: Any = None,
    load: st.Load | None = None, mode: Any = "II", width: float | None = None, **weakening: Any,
) -> st.Problem:  # fmt: skip
    """The paper's system in plane strain but for what is given; pairs make it a plane."""
    if not {"weakening_rate", "critical_slip"} & set(weakening):
        weakening["weakening_rate"] = RATE  # None leaves it to profiles
    law = st.LinearWeakening(**weakening) if friction is None else friction
    interface = st.Interface(length, nodes, width=width)
    return st.Problem(solid, interface, law, load or st.Load(), mode)


def examples(name: str) -> dict[str, Any]:
    """Objects of the package by name, from a table of their classes and arguments."""
    table = stored("examples")[name]
    return {key: getattr(st, kind)(**given) for key, (kind, given) in table.items()}


def load_of(interface: st.Interface, place: float, shape: Any, **more: Any) -> st.Load:
    """A profile of mean 1, a function of the distance (m) from a share of the length along x."""
    length = interface.lengths[0]
    x = np.arange(interface.shape[0]) * length / interface.shape[0]
    away = np.abs(np.mod(x - place * length + 0.5 * length, length) - 0.5 * length)
    profile = shape(away.reshape(-1, *(1 for _ in interface.shape[1:])))
    profile = np.broadcast_to(profile / profile.mean(), interface.shape)
    return st.Load(profile=profile, **more)


def edge_load(
    interface: st.Interface, excess: float, decay: float, place: float = 0.0
) -> st.Load:
    """Higher near an edge, by a share of the load far away."""
    return load_of(interface, place, lambda away: 1.0 + excess * np.exp(-away / decay))


def gradient_load(
    interface: st.Interface, amplitude: float, place: float = 0.0, **more: Any
) -> st.Load:
    """From 1 + amplitude down to 1 - amplitude, half a period away."""
    length = interface.lengths[0]
    return load_of(
        interface, place, lambda away: 1.0 + amplitude * (1.0 - 4.0 * away / length), **more
    )


def without(problem: st.Problem, *keys: str) -> st.Problem:
    """The problem without values, such as 'load.initial_stress', that profiles give instead."""
    for key in keys:
        owner, name = key.split(".")
        part = getattr(problem, owner)
        none = 0.0 if name in ("initial_stress", "residual_strength") else None
        part = dataclasses.replace(part, **{name: none})
        problem = dataclasses.replace(problem, **{owner: part})
    return problem


def within(problem: st.Problem, extent: Any) -> st.Problem:
    """The problem on an interface that breaks within an extent only."""
    interface = dataclasses.replace(problem.interface, extent=extent)
    return dataclasses.replace(problem, interface=interface)


def beta_strength(
    correlation_length: float, low: float = 0.66e6, high: float = 1.66e6,
    power_kept: float | None = None, **options: Any,
) -> st.RandomField:  # fmt: skip
    """The paper's marginal, on other bounds perhaps, with its spectrum of another length."""
    marginal = st.Beta(alpha=1.5, beta=3.0, low=low, high=high)
    spectrum = st.PowerLawSpectrum(correlation_length, power_kept=power_kept)
    return st.RandomField(marginal, spectrum, **options)


def smooth_noise(correlation: float, rng: np.random.Generator, shape: Any) -> Any:
    """A field on a plane between 0 and 1, with a correlation length given in nodes."""
    k = np.hypot(np.fft.fftfreq(shape[0])[:, None], np.fft.rfftfreq(shape[1])[None, :])
    waves = np.fft.rfft2(rng.standard_normal(shape)) * np.exp(-((correlation * k) ** 2))
    field = np.fft.irfft2(waves, shape)
    return (field - field.min()) / np.ptp(field)


def local_onset(problem: st.Problem, profiles: Any) -> Any:
    """Onsets by the local criterion."""
    return st.onset(problem, profiles, method=LOCAL, progress=False)


def exact_onset(problem: st.Problem, profiles: Any, **options: Any) -> Any:
    """Onsets by equilibrium, with options of the method."""
    return st.onset(problem, profiles, method=st.Equilibrium(**options), progress=False)


def ensemble(problem: st.Problem, random: Any, samples: int, **options: Any) -> Any:
    """An ensemble by the local criterion, or by another method."""
    given = {"method": LOCAL, "pilot": False, "progress": False} | options
    return st.monte_carlo(problem, random, samples=samples, **given)


def turns(nodes: int) -> Any:
    """Angles 2 pi x/L at the nodes of a line."""
    return 2.0 * np.pi * np.arange(nodes) / nodes


def repeated(profile: Any, across: int, axis: int = 0) -> Any:
    """Profiles along one axis of a plane (0 for x) of so many nodes along the other."""
    wide = np.repeat(np.asarray(profile)[..., None], across, axis=-1)
    return wide if axis == 0 else np.ascontiguousarray(np.swapaxes(wide, -1, -2))
