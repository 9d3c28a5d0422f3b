"""Data shared by all runs for a problem: stiffness, memory kernel and explicit time step.

Problem of the time step (`largest_step`)
-----------------------------------------
An interface that slides freely carries undamped Rayleigh waves. The
shortest waves limit the explicit step h. Let the state of a mode be |k|
slip, V/c_s and the memory variables. A step in `explicit` is then a
matrix that depends only on kappa = |k| c_s h (`amplification`). Find
the largest kappa up to which no eigenvalue of the matrix is larger than
1.

Algorithm: our own
------------------
1. Raise kappa in steps of 0.1 until an eigenvalue is larger than 1
   (`_largest_kappa`). If it is larger after the first step, the error
   of the memory kernel makes long waves grow, and no step is stable.
2. Bisect between the last two values of kappa.
3. On a line the largest |k| is pi/dx. On a plane the shortest waves lie
   on the rim of the rectangle |kx| <= pi/dx, |ky| <= pi/dy, and differ
   in length and in their fraction of mode II. The waves on the axes and in
   the corner grow first, so take the smallest of their steps.
"""

import dataclasses
import functools

import numpy as np

from stiction.base.errors import InputError
from stiction.base.model import check_memory
from stiction.elasticity.memory_kernels import ExponentialSum, kernel_sum, static_stiffness
from stiction.elasticity.operator import make_transform
from stiction.methods.dynamics.memory import offsets, phi, step_table
from stiction.methods.dynamics.state import Floats, Grid
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem

LARGEST_RATIO = 7.15  # largest c_d/c_s: nu = 0.49 in plane strain
SMALLEST_RATIO = 1.002  # smallest c_d/c_s: nu = -0.99 in plane stress
STEADY_TOLERANCE = 1e-4  # sums with this error were stable for every Poisson's ratio
_MAX_WAVE_GROWTH = 1e-5  # in a step; a rupture takes thousands of steps
_KAPPA_STEP, _MAX_KAPPA, _BISECTIONS = 0.1, 6.0, 12


@dataclasses.dataclass(frozen=True, eq=False)
class Medium:
    """Read-only elastic half-spaces on a grid, with a fixed explicit step, shared by threads."""

    problem: Problem
    grid: Grid
    step: float  # explicit time step, s
    largest_step: float  # limit of stability of the explicit step, s
    # Kept for lines only: on a plane it would leave no memory for the
    # tables of implicit steps.
    step_table: tuple[Floats, Floats] | None

    @property
    def interface(self) -> Interface:
        """The interface of the problem."""
        return self.problem.interface

    @property
    def impedance(self) -> float:
        """Z = G/(2 c_s), Pa s/m."""
        return self.grid.impedance


def prepare_medium(problem: Problem, tolerance: float, courant: float) -> Medium:
    """Return the tables for a problem, or raise an `InputError` if no step is stable.

    The error names the solid or the tolerance of the memory kernel.

    The error names the solid in mode II.

    >>> import dataclasses, stiction as st
    >>> problem = st.paper.problem(nodes=256, plane="strain")
    >>> solid = dataclasses.replace(problem.solid, poisson_ratio=0.495)
    >>> problem = dataclasses.replace(problem, solid=solid)
    >>> prepare_medium(problem, 1e-2, 0.5)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: solid.poisson_ratio: elastodynamics in mode II needs nu <= ...
    """
    solid, interface, mode = problem.solid, problem.interface, problem.mode
    if mode == "II" and not SMALLEST_RATIO <= solid.wave_speed_ratio <= LARGEST_RATIO:
        valid = "nu <= 0.49" if solid.plane == "strain" else "nu >= -0.99"
        raise InputError(
            f"solid.poisson_ratio: elastodynamics in mode II needs {valid} in plane {solid.plane}, "
            f"got {solid.poisson_ratio}"
        )
    eta, speed = solid.wave_speed_ratio, solid.shear_wave_speed
    names = ("II", "III") if interface.is_plane else (mode,)
    kernels = [kernel_sum(name, eta, tolerance) for name in names]
    # A run needs most memory in implicit steps: memory variables and
    # tables (on a line also the tables of explicit steps), and forty
    # arrays of nodes.
    modes, pairs = interface.wavenumbers.size, sum(kernel.poles.size for kernel in kernels)
    tables = 6 * modes / 2 if interface.is_plane else 10 * modes
    size = 8.0 * (pairs * (4 * modes + tables) + 40 * interface.size)
    check_memory("interface.nodes", size, "Use fewer nodes, or a larger kernel_tolerance")
    limit = largest_step(names, eta, tolerance, interface.spacings) / speed
    if limit == 0.0:
        error = max(kernel.error for kernel in kernels)
        raise InputError(
            f"kernel_tolerance: with an error of {error:.2g} in the memory kernel, waves"
            f" grow at any time step. Got {tolerance:g}. Use {STEADY_TOLERANCE:g} or less"
        )
    grid, step = _grid(problem, kernels), courant * limit
    table = None if interface.is_plane else step_table(grid, step)
    return Medium(problem, grid, step, limit, table)


def _grid(problem: Problem, kernels: list[ExponentialSum]) -> Grid:
    """Return stiffness and memory on the modes of the interface.

    On a plane a wave vector has the fraction a = (kx/k)² of mode II and b
    = 1 - a of mode III (P. Geubelle and J. Rice, 1995), in K and in the
    memory (G k/2)[a C_II + b C_III] * V.

    On a line all modes weigh with the single kernel. On a plane there are two
    kernels, and the first split pairs belong to mode II.

    >>> from types import SimpleNamespace
    >>> kernels = [
    ...     ExponentialSum(np.array([p]), np.array([2.0 * p]), 0.0)
    ...     for p in (1.0, 2.0)
    ... ]
    >>> solid = SimpleNamespace(shear_modulus=6.0, shear_wave_speed=1.5)
    >>> for interface in (
    ...     Interface(np.pi, 8),
    ...     Interface((np.pi, 2.0 * np.pi), (8, 8)),
    ... ):
    ...     symbol = lambda shape: 5.0 * interface.wavenumbers
    ...     problem = SimpleNamespace(solid=solid, interface=interface)
    ...     problem.half_spaces = SimpleNamespace(symbol=symbol)
    ...     grid = _grid(problem, kernels[: 1 + interface.is_plane])
    ...     print(
    ...         grid.impedance,
    ...         round(grid.cell, 6),
    ...         grid.multiplicity,
    ...         grid.split,
    ...         end=" ",
    ...     )
    ...     print(grid.weights.tolist(), grid.stiffness[:, 1].tolist())
    ...     print(grid.frequency[:3].tolist(), grid.mode_two[:3].tolist())
    2.0 0.392699 1 1 [2.0] [10.0, 6.0]
    [3.0, 6.0, 9.0] [1.0, 1.0, 1.0]
    2.0 0.308425 2 1 [2.0, 4.0] [5.0, 3.0]
    [0.0, 1.5, 3.0] [1.0, 0.0, 0.0]
    >>> grid.frequency.size, grid.stiffness.shape  # kx >= 0: five rows
    (25, (2, 40))
    """
    solid, interface = problem.solid, problem.interface
    k, share = interface.wavenumbers, interface.in_plane_share
    entry, offset, multiplicity = offsets(k.shape)
    stiffness = problem.half_spaces.symbol(interface.shape)
    # Modes with entries in the tables: on a plane kx >= 0, on a line k > 0.
    tabulated = slice(0, interface.shape[0] // 2 + 1) if interface.is_plane else slice(1, None)
    return Grid(
        transform=make_transform(interface.shape),
        impedance=solid.shear_modulus / (2.0 * solid.shear_wave_speed),
        cell=interface.cell,
        stiffness=np.stack([stiffness.ravel(), 0.5 * solid.shear_modulus * k.ravel()]),
        entry=entry,
        offset=offset,
        multiplicity=multiplicity,
        frequency=k[tabulated].ravel() * solid.shear_wave_speed,
        mode_two=share[tabulated].ravel(),
        poles=np.concatenate([kernel.poles for kernel in kernels]),
        weights=np.concatenate([kernel.weights for kernel in kernels]),
        split=kernels[0].poles.size,
    )


@functools.lru_cache(maxsize=64)
def largest_step(
    modes: tuple[str, ...], eta: float, tolerance: float, spacings: tuple[float, ...]
) -> float:
    """Return the largest stable c_s dt, m, of the explicit predictor-corrector.

    The result is 0 if the error of the kernel makes waves grow at every
    step.
    """
    kernels = [kernel_sum(mode, eta, tolerance) for mode in modes]
    static = static_stiffness(modes[0], eta)
    if len(modes) == 1:
        return _largest_kappa(kernels[0], static) / np.pi * spacings[0]
    limits = []  # 3. The axes and the corner.
    for a, b in ((1.0, 0.0), (1.0, 1.0), (0.0, 1.0)):
        kx, ky = a * np.pi / spacings[0], b * np.pi / spacings[1]
        share = float(kx**2 / (kx**2 + ky**2))
        stiffness = share * static + 1.0 - share
        kappa = _largest_kappa(_mixed(kernels, share), stiffness)
        limits.append(kappa / float(np.hypot(kx, ky)))
    return min(limits)


def amplification(kappa: float, kernel: ExponentialSum, stiffness: float) -> Floats:
    """Return the matrix of an explicit step for a frictionless mode with kappa = |k| c_s dt.

    Without memory, V* is -K (d + kappa V), the mean rate is (V + V*)/2, and V
    becomes -K (d + kappa mean).

    >>> absent = ExponentialSum(np.array([-1.0 + 0j]), np.zeros(1) + 0j, 0.0)
    >>> amplification(0.25, absent, 2.0)[:2, :2].tolist()
    [[-0.125, -1.5], [0.0625, 0.75]]

    With s = -1 and w = 1 the memory decays by E = exp(-kappa), and a unit rate
    adds R = 1 - E to it.

    >>> kernel = ExponentialSum(np.array([-1.0 + 0j]), np.ones(1) + 0j, 0.0)
    >>> E, K = np.exp(-0.25), 2.0
    >>> R, columns = 1.0 - E, []
    >>> for V, d, psi in np.eye(3):
    ...     mean = 0.5 * (V - K * (d + 0.25 * V) + E * psi + R * V)
    ...     d = d + 0.25 * mean
    ...     columns.append([-K * d + E * psi + R * mean, d, E * psi + R * mean])
    >>> np.allclose(amplification(0.25, kernel, K)[:3, :3], np.transpose(columns))
    True
    """
    pairs = kernel.poles.size
    z = kernel.poles * kappa
    decay, gain = np.exp(z), kappa * phi(z)
    response = float(np.sum(kernel.weights * gain).real)
    state = np.eye(2 + 2 * pairs)
    slip_rate, slip = state[0], state[1]
    memory = state[2 : 2 + pairs] + 1j * state[2 + pairs :]
    memory_sum = ((kernel.weights * decay) @ memory).real
    predicted = -stiffness * (slip + kappa * slip_rate) + memory_sum + response * slip_rate
    mean = 0.5 * (slip_rate + predicted)
    slip = slip + kappa * mean
    memory = decay[:, None] * memory + gain[:, None] * mean
    slip_rate = -stiffness * slip + memory_sum + response * mean
    return np.vstack([slip_rate, slip, memory.real, memory.imag])


def _stable(kappa: float, kernel: ExponentialSum, stiffness: float) -> bool:
    """Return whether no mode grows in an explicit step.

    >>> absent = ExponentialSum(np.array([-1.0 + 0j]), np.zeros(1) + 0j, 0.0)
    >>> _stable(0.99, absent, 2.0), _stable(1.01, absent, 2.0)
    (True, False)
    """
    matrix = amplification(kappa, kernel, stiffness)
    growth = np.abs(np.linalg.eigvals(matrix)).max() - 1.0
    return bool(growth < _MAX_WAVE_GROWTH)


def _largest_kappa(kernel: ExponentialSum, stiffness: float) -> float:
    """Steps 1 and 2: return the largest |k| c_s dt up to which no wave grows.

    Without memory d is multiplied by 1 - x + x²/2 in a step, with x = kappa K,
    which is at most 1 for x = 2. A growing memory is never stable.

    >>> absent, growing = (
    ...     ExponentialSum(np.array([pole + 0j]), np.zeros(1) + 0j, 0.0)
    ...     for pole in (-1.0, 1.0)
    ... )
    >>> print(
    ...     f"{_largest_kappa(absent, 2.0):.3f} {_largest_kappa(absent, 0.8):.3f}"
    ... )
    1.000 2.500
    >>> _largest_kappa(growing, 2.0)
    0.0
    """
    # 1. Raise kappa.
    low, high = 0.0, _KAPPA_STEP
    while high < _MAX_KAPPA and _stable(high, kernel, stiffness):
        low, high = high, high + _KAPPA_STEP
    if low == 0.0:  # a smaller step cannot mend an error of the kernel
        return 0.0
    # 2. Bisect.
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _stable(middle, kernel, stiffness) else (low, middle)
    return low


def _mixed(kernels: list[ExponentialSum], share: float) -> ExponentialSum:
    """Return the kernel for a wave vector on a plane, with the fraction (kx/k)² of mode II.

    >>> kernels = [ExponentialSum(np.array([-1.0]), np.array([8.0]), 0.1)]
    >>> kernels.append(
    ...     ExponentialSum(np.array([-2.0, -3.0]), np.array([4.0, 12.0]), 0.3)
    ... )
    >>> mixed = _mixed(kernels, 0.25)
    >>> mixed.poles.tolist(), mixed.weights.tolist(), mixed.error
    ([-1.0, -2.0, -3.0], [2.0, 3.0, 9.0], 0.3)
    """
    weights = share * kernels[0].weights, (1.0 - share) * kernels[1].weights
    poles = np.concatenate([kernel.poles for kernel in kernels])
    error = max(kernel.error for kernel in kernels)
    return ExponentialSum(poles, np.concatenate(weights), error)
