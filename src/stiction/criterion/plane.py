"""The local criterion on planes: critical ellipses of several shapes."""

from __future__ import annotations

import json
from functools import lru_cache

import numpy as np

from stiction.arrays import Array
from stiction.criterion.assumptions import check_law, excess_of, uniform_rates, warn_if_coarse
from stiction.criterion.ellipse_windows import (
    EllipseWindow,
    LocalOnset,
    ellipse_window,
    local_onset,
)
from stiction.elasticity.transform_operator import stiffness_symbol
from stiction.errors import InputError
from stiction.problem import Problem
from stiction.results import Variable, position
from stiction.sample import Sample

STRETCHES = (2.0 / 3.0, 5.0 / 6.0, 1.0, 6.0 / 5.0, 3.0 / 2.0)
"""Aspects of the ellipses over that of the middle one. With the paper's strength nine shapes from
0.8 to 2 lower the bound by less than 0.05 % more."""

OWN_VARIABLES = {
    "critical_aspect": Variable("1", "extent of the critical ellipse along x over that along y"),
    "critical_patch_extent": Variable("m", "extents of the critical ellipse"),
    "critical_patch_area": Variable("m2", "area of the critical ellipse"),
}


def middle_aspect(problem: Problem) -> float:
    """Aspect about which those of critical ellipses lie, 1/sqrt(1 - nu).

    A line of mode II is critical at a length that is 1/(1 - nu) times that of mode III.
    """
    return float(1.0 / np.sqrt(1.0 - problem.solid.poisson_ratio))


def own_variables(problem: Problem) -> dict[str, Variable]:
    """What the criterion says of each sample of a plane besides its onset."""
    extent = position(problem.interface, OWN_VARIABLES["critical_patch_extent"])
    return OWN_VARIABLES | {"critical_patch_extent": extent}


@lru_cache(maxsize=64)
def _window(solid_and_grid: str, rate: float, aspect: float) -> EllipseWindow | None:
    shape, lengths, modulus, ratio = json.loads(solid_and_grid)
    symbol = stiffness_symbol(tuple(shape), tuple(lengths), modulus, ratio)
    return ellipse_window(symbol, tuple(shape), tuple(lengths), rate, aspect)


def window_of(problem: Problem, rate: float, aspect: float) -> EllipseWindow | None:
    """Smallest unstable ellipse of one aspect, or None if the plane is too small for it."""
    grid, solid = problem.interface, problem.solid
    key = json.dumps([grid.shape, grid.lengths, solid.shear_modulus, solid.poisson_ratio])
    return _window(key, rate, aspect)


def windows_of(problem: Problem, rate: float) -> list[EllipseWindow]:
    """The critical ellipses of a weakening rate (Pa/m), by rising aspect.

    Raises
    ------
    InputError
        If one of the shapes does not fit on the plane.
    """
    middle = middle_aspect(problem)
    found = []
    for stretch in STRETCHES:
        window = window_of(problem, rate, middle * stretch)
        if window is None:
            raise too_small(problem, rate, middle * stretch)
        found.append(window)
    return found


def too_small(problem: Problem, rate: float, aspect: float) -> InputError:
    """That no critical ellipse of an aspect fits on the plane."""
    grid = problem.interface
    length = problem.nucleation_length_of(rate)
    size = " x ".join(f"{one:.4g}" for one in grid.lengths)
    return InputError(
        f"interface.length: a critical patch of aspect {aspect:.3g} does not fit on a plane of"
        f" {size} m (in each direction nearly twice the nucleation length, {length:.4g} m, is"
        " needed); the local criterion does not hold there, use st.Equilibrium()"
    )


def _place(found: LocalOnset) -> Array:
    """Where a parabola through the nodes around the lowest has its minimum, in nodes, (2,).

    Places at nodes would show as stripes in a histogram. The load is that of the node, which is
    exact for the discrete problem.
    """
    shape = found.average.shape
    place = np.array(found.node, dtype=np.float64)
    for axis in (0, 1):
        step = [0, 0]
        step[axis] = 1
        before, here, after = (
            found.average[(found.node[0] + s * step[0]) % shape[0],
                          (found.node[1] + s * step[1]) % shape[1]]
            for s in (-1, 0, 1)
        )  # fmt: skip
        bend = before - 2.0 * here + after
        if bend > 0.0:
            place[axis] += 0.5 * (before - after) / bend
    return np.mod(place, shape)


class PlaneSolver:
    """Onset of samples of a plane, each at the least average over place and shape."""

    def __init__(self, problem: Problem) -> None:
        check_law(problem)
        self.problem = problem

    def __call__(self, samples: Sample) -> dict[str, Array]:
        problem = self.problem
        warn_if_coarse(problem, samples)
        rates, excess = uniform_rates(samples), excess_of(samples)
        load, aspect, area = (np.empty(samples.samples) for _ in range(3))
        place, extent = np.empty((samples.samples, 2)), np.empty((samples.samples, 2))
        for rate in np.unique(rates):
            windows = windows_of(problem, float(rate))
            for number in np.flatnonzero(rates == rate):
                found = local_onset(windows, excess[number], samples.load_profile)
                # The weights keep to this bound; only the rounding of the transforms may not.
                least = float((excess[number] / samples.load_profile).min())
                load[number] = max(found.load, least)
                place[number] = _place(found) * np.array(problem.interface.spacings)
                window = windows[found.window]
                aspect[number], area[number] = window.aspect, window.area
                extent[number] = window.extents
        stress = samples.mean_stress(load)
        return {
            "critical_load": load,
            "critical_stress": stress,
            "first_instability": stress.copy(),
            "critical_position": place,
            "critical_aspect": aspect,
            "critical_patch_extent": extent,
            "critical_patch_area": area,
        }


def plane_nucleation_stress(problem: Problem, sample: Sample, aspect: float | None) -> Array:
    """Nucleation stress of every node, (samples, nx, ny), Pa, of the weakest or of one shape."""
    check_law(problem)
    rate = float(uniform_rates(sample)[0])
    if aspect is None:
        windows = windows_of(problem, rate)
    else:
        window = window_of(problem, rate, aspect)
        if window is None:
            raise too_small(problem, rate, aspect)
        windows = [window]
    grid, excess = problem.interface, excess_of(sample)
    result = np.full(excess.shape, np.inf)
    loads = [grid.inverse_transform(grid.transform(sample.load_profile) * window.spectrum)
             for window in windows]  # fmt: skip
    for own, strength in zip(result, excess, strict=True):
        spectrum = grid.transform(strength)
        for window, load in zip(windows, loads, strict=True):
            np.minimum(own, grid.inverse_transform(spectrum * window.spectrum) / load, out=own)
    # The weights keep to these bounds; only the rounding of the transforms may not.
    ratio = excess / sample.load_profile
    low, high = (end(axis=(1, 2), keepdims=True) for end in (ratio.min, ratio.max))
    return np.clip(result, low, high, out=result)
