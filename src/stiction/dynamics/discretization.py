"""What all runs of one problem share: stiffness, memory kernel, explicit time step."""

from __future__ import annotations

import dataclasses
import functools

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics.arrays import Grid
from stiction.dynamics.courant_limit import courant_limit, plane_limit
from stiction.dynamics.memory_layout import places, step_table
from stiction.elasticity.exponential_sum import ExponentialSum
from stiction.elasticity.kernel_cache import kernel_sum
from stiction.elasticity.operator import make_transform
from stiction.errors import InputError
from stiction.friction.kernels import registered
from stiction.interface import Interface
from stiction.model import check_memory
from stiction.problem import Problem

Floats = NDArray[np.float64]

LARGEST_RATIO = 7.15  # of c_d to c_s: nu = 0.49 in plane strain
SMALLEST_RATIO = 1.002  # nu = -0.99 in plane stress
STEADY_TOLERANCE = 1e-4  # sums this good were stable for every Poisson's ratio


@dataclasses.dataclass(frozen=True, eq=False)
class Medium:
    """Elastic half-spaces on a grid, with a fixed explicit time step. Read-only, shared by threads.

    Attributes
    ----------
    interface : Interface
    grid : Grid
        Stiffness, impedance and memory kernel, as kernels take them.
    step : float
        Explicit time step, s.
    largest_step : float
        Limit of stability of the explicit step, s.
    shear_modulus, effective_modulus : float
        G and G*, Pa.
    """

    interface: Interface
    grid: Grid
    step: float
    largest_step: float
    shear_modulus: float
    effective_modulus: float

    @property
    def impedance(self) -> float:
        """Z = G/(2 c_s), Pa s/m."""
        return self.grid.impedance

    def step_table(self) -> tuple[Floats, Floats]:
        """Tables of the explicit step; runs share those of a line, a plane's are too large to keep.

        (Beside them a run on a plane would have no room for those of its implicit steps.)
        """
        return step_table(self.grid, self.step) if self.interface.is_plane else self._line_table

    @functools.cached_property
    def _line_table(self) -> tuple[Floats, Floats]:
        return step_table(self.grid, self.step)


def refused_laws(problem: Problem) -> list[str]:
    """Why the friction law of a problem cannot be followed; nothing if it can."""
    try:
        known = registered(problem.friction.parameters)
    except NotImplementedError:
        known = False
    if known:
        return []
    return [
        f"friction: {type(problem.friction).__name__} has no compiled strength; give its"
        " `parameters` a type that stiction.friction.kernels.register knows"
    ]


def prepare_medium(
    problem: Problem,
    *,
    tolerance: float,
    memory_range: float,
    courant: float,
    time_step: float | None,
) -> Medium:
    """Tables for a problem; raises `InputError` if the step is above the stability limit."""
    if refused := refused_laws(problem):
        raise InputError(refused)
    solid, interface, mode = problem.solid, problem.interface, problem.mode
    if mode == "II" and not SMALLEST_RATIO <= solid.wave_speed_ratio <= LARGEST_RATIO:
        valid = (
            "nu <= 0.49 in plane strain (the dilatational wave becomes infinitely fast at 0.5)"
            if solid.plane == "strain"
            else "nu >= -0.99 in plane stress (the solid loses its stiffness at -1)"
        )
        raise InputError(
            f"solid.poisson_ratio: elastodynamics in mode II needs {valid}, got "
            f"{solid.poisson_ratio}"
        )
    eta, speed = solid.wave_speed_ratio, solid.shear_wave_speed
    modes = ("II", "III") if interface.is_plane else (mode,)
    kernels = [kernel_sum(each, eta, tolerance, memory_range) for each in modes]
    check_memory(
        "interface.nodes",
        bytes_needed(interface, sum(kernel.poles.size for kernel in kernels)),
        "take fewer nodes, or a larger kernel_tolerance",
    )
    if interface.is_plane:
        dx, dy = interface.spacings
        limit = plane_limit(eta, tolerance, memory_range, (dx, dy)) / speed
    else:
        limit = courant_limit(mode, eta, kernels[0]) * interface.spacing / speed
    if limit == 0.0:
        error = max(kernel.error for kernel in kernels)
        raise InputError(
            f"kernel_tolerance: with an error of {error:.2g} in the memory kernel waves grow"
            f" at any time step; got {tolerance:g}, use {STEADY_TOLERANCE:g} or less"
        )
    step = courant * limit if time_step is None else time_step
    if step > limit:
        raise InputError(
            f"time_step: {step:.6g} s is above the stability limit {limit:.6g} s of this grid "
            f"and solid (c_s dt/dx = {limit * speed / interface.spacing:.3f}); use at most "
            f"{0.9 * limit:.6g} s"
        )
    return Medium(
        interface=interface,
        grid=_grid(problem, kernels),
        step=step,
        largest_step=limit,
        shear_modulus=solid.shear_modulus,
        effective_modulus=problem.effective_modulus,
    )


def _grid(problem: Problem, kernels: list[ExponentialSum]) -> Grid:
    """Stiffness and memory on the modes of the interface.

    On a plane a wave vector has a = (kx/k)² of mode II and b = 1 - a of mode III (Geubelle and Rice
    1995): K = (k/2)(G* a + G b), and the memory is (G k/2)[a C_II + b C_III] * V.
    """
    solid, interface = problem.solid, problem.interface
    k = interface.wavenumbers
    slot, place, copies = places(k.shape)
    share = interface.in_plane_share
    if share is None:
        modulus, pace, own = problem.effective_modulus * k, k[1:], np.ones(k.size - 1)
    else:
        modulus = (problem.effective_modulus * share + solid.shear_modulus * (1.0 - share)) * k
        quarter = slice(0, interface.shape[0] // 2 + 1)  # kx >= 0
        pace, own = k[quarter].ravel(), share[quarter].ravel()
    return Grid(
        transform=make_transform(interface.shape),
        impedance=solid.shear_modulus / (2.0 * solid.shear_wave_speed),
        cell=interface.cell,
        stiffness=0.5 * np.stack([modulus.ravel(), solid.shear_modulus * k.ravel()]),
        slot=slot,
        place=place,
        copies=copies,
        pace=pace * solid.shear_wave_speed,
        share=own,
        poles=np.concatenate([kernel.poles for kernel in kernels]),
        weights=np.concatenate([kernel.weights for kernel in kernels]),
        split=kernels[0].poles.size,
    )


def bytes_needed(interface: Interface, pairs: int) -> float:
    """Memory of one run at its largest, while it takes implicit steps; without frames.

    Memory variables and tables (see `memory_layout`), on a line those of explicit steps too, and
    some forty arrays of one value a node.
    """
    modes = interface.wavenumbers.size
    tables = 6 * modes / 2 if interface.is_plane else 10 * modes
    return 8.0 * (pairs * (4 * modes + tables) + 40 * interface.size)
