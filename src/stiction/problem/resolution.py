"""Whether the nodes resolve the nucleation length h_n, and whether h_n fits the interface.

`Problem` and samples ask for the checks, which raise an `InputError`.
Methods ask for warnings with the error that they expect.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction.base.errors import InputError, UnitWarning, warn_accuracy, warn_user
from stiction.problem.specimen import Blocks

MIN_NODES_IN_NUCLEATION = 4
"""Nodes in a nucleation length."""
HARDLY_RESOLVED = 0.04
"""Nodes in a nucleation length below which a unit is doubted. Hundred times more are needed."""
MIN_LENGTHS_IN_LINE = 4.0
"""Nucleation lengths: on shorter lines free ends change the mean onset by more than about 1 %."""
AT_END = {"II": 0.445 / 1.158, "III": 0.5}
"""Nucleation length at a free end of two equal blocks over the length in the middle."""


def nodes_in_nucleation_length(problem: Any, weakening_rate: float) -> tuple[float, ...]:
    """Return how many nodes of a `Problem` span h_n, in each direction.

    The weakening rate (Pa/m) is the steepest at any slip, as everywhere
    in this file.
    """
    lengths = problem.nucleation_lengths(weakening_rate)
    return tuple(np.divide(lengths, problem.interface.spacings).tolist())


def check_resolution(problem: Any, weakening_rate: float) -> None:
    """Refuse a grid that does not resolve h_n at the highest weakening rate (Pa/m)."""
    resolution = nodes_in_nucleation_length(problem, weakening_rate)
    if min(resolution) >= MIN_NODES_IN_NUCLEATION:
        return _check_extent(problem, resolution)
    length = problem.nucleation_lengths(weakening_rate)[int(np.argmin(resolution))]
    if min(resolution) < HARDLY_RESOLVED:
        modulus = problem.solid.shear_modulus
        raise InputError(
            "solid.shear_modulus, interface.length, friction: the nucleation length is"
            f" {length:.3g} m, and the nodes are {problem.interface.spacing:.3g} m apart. Check"
            f" the units of the modulus, {modulus:g} Pa, of lengths, strengths"
            f" and the weakening rate, {weakening_rate:.3g} Pa/m"
        )
    least = MIN_NODES_IN_NUCLEATION
    raise InputError(
        f"interface.nodes: must be {_finer(problem, resolution, least)} or more. The nucleation"
        f" length {length:.3g} m spans {min(*resolution, least - 0.01):.3g} of {least} nodes."
        " Check the unit of interface.length (m)"
    )


def _check_extent(problem: Any, resolution: tuple[float, ...]) -> None:
    """Refuse an extent narrower than the nucleation length, which is given in nodes."""
    interface, breakable = problem.interface, problem.interface.breakable
    if not interface.is_held or problem.specimen is not None:  # blocks have no single length
        return
    for axis, dim in enumerate(interface.dims):
        across = tuple({0, 1} - {axis})[: breakable.ndim - 1]
        width = np.count_nonzero(breakable.any(axis=across))
        if width < (1.0 - 1e-9) * resolution[axis]:
            spacing = interface.spacings[axis]
            raise InputError(
                f"interface.extent: its {width * spacing:.3g} m along {dim} are narrower than"
                f" the nucleation length, {resolution[axis] * spacing:.3g} m. Widen it"
            )


def _finer(problem: Any, resolution: tuple[float, ...], wanted: int) -> str:
    """Return the number of nodes for which the nucleation length spans `wanted` nodes."""
    growth = wanted / np.maximum(resolution, 1e-300)
    halves = np.ceil(0.5 * np.array(problem.interface.shape) * growth)
    return " x ".join(f"{2 * n:.10g}" for n in halves)


def warn_if_coarse(problem: Any, weakening_rate: float, enough: float, cost: str) -> None:
    """Warn with the error `cost` if h_n spans fewer than `enough` nodes at a rate (Pa/m)."""
    resolution = nodes_in_nucleation_length(problem, weakening_rate)
    if min(resolution) < enough:
        spanned = f"{resolution[0]:.1f} nodes"
        if problem.interface.is_plane:
            spanned += f" along x and, in mode III, {resolution[1]:.1f} along y"
        if isinstance(problem.specimen, Blocks):
            spanned += f", {AT_END[problem.mode] * resolution[0]:.1f} at a free end"
        wanted = 16 if enough <= 12.0 else 32
        warn_accuracy(
            f"the nucleation length spans {spanned}, and {wanted} are recommended"
            f" (interface.nodes = {_finer(problem, resolution, wanted)}): {cost}"
        )


def warn_if_short(problem: Any, weakening_rate: float) -> None:
    """Warn about an interface that h_n fills, or on which free ends would count."""
    interface = problem.interface
    patch = problem.nucleation_lengths(weakening_rate)[0]
    length = min(interface.lengths)
    if problem.specimen is not None:
        return
    if patch >= length:
        warn_user(
            f"the critical patch (nucleation length {patch:.3g} m) fills the interface"
            f" ({length:.3g} m). Check the units of length, shear modulus and weakening rate",
            UnitWarning,
        )
    elif length < MIN_LENGTHS_IN_LINE * patch and not interface.is_plane:
        warn_accuracy(
            f"the interface is {length / patch:.2g} nucleation lengths long and continues"
            " periodically. Under an antiplane load, free ends would lower its onset by about"
            f" {min(3.0, 5.0 * patch / length):.1g} % on average and up to 17 % in single cases"
        )
