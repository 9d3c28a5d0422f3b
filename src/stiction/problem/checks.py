"""Checks that profiles, units and nodes fit a problem.

Each check takes values in SI. The steps of a sample are:

1. Check that profiles with valid values fit together
   (`contradictions_of`).
2. Check that the nodes resolve the nucleation length h_n, and that h_n
   fits the interface (`check_resolution`). Methods warn with the error
   that they expect (`warn_if_coarse`).
3. Check that strengths and stresses are in the assumed units
   (`doubt_sample`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, UnitWarning, warn_accuracy, warn_user
from stiction.base.units import Doubt, doubt_units
from stiction.problem.interface import Interface
from stiction.problem.specimen import Blocks

MAX_STRENGTH_RATIO = 1e8
"""Strength of a node over the median above which other strengths are
lost in round-off."""
BARRIER = 10.0
"""Factor by which tau_p - tau_r of a barrier exceeds the lower
quartile, by rank, of nodes that weaken."""
MIN_NODES_IN_NUCLEATION = 4
"""Fewest nodes in a nucleation length."""
HARDLY_RESOLVED = 0.04
"""Nodes in a nucleation length below which a unit is doubted. At least
4 are needed."""
MIN_LENGTHS_IN_LINE = 4.0
"""Nucleation lengths in a line below which free ends change the mean
onset by over 1 %."""
AT_END = {"II": 0.445 / 1.158, "III": 0.5}
"""Nucleation length at a free end of two equal blocks over the length
in the middle."""
FRICTION = (1e-3, 10.0), (1e-4, 100.0)
"""Usual and possible mean strengths over normal pressure, from
superlubricity to adhesive gels."""
RIGIDITY = (1e-8, 1.0), (0.0, math.inf)
"""Usual and possible ratios of strength and shear modulus. Steel (8e10
Pa) under 10 kPa at a coefficient of 0.1 has 1e-8."""
STIFF, STRONG = 1e8, 0.05
"""Shear modulus above which a solid is no rubber or gel, Pa, and the largest usual strength over
it. The ideal strength of a crystal is about a tenth of its modulus."""
INITIAL = (1e-5, math.inf), (0.0, math.inf)
"""Usual and possible sizes of an initial stress, if there is any, over
the strength."""
SLIP = (1e-8, math.inf), (1e-10, math.inf)
"""Usual and possible slips over which strength falls, m. An atom
measures 1e-10 m."""


# -- profiles that fit together -----------------------------------------------------------------


def contradictions_of(
    interface: Interface, strength: Array, residual: Array, initial: Array, overstress: bool
) -> list[str]:
    """Return messages about profiles (samples, *shape), Pa, that contradict each other.

    With `overstress`, the initial stress may exceed the strength.

    >>> line = Interface(8.0, 8)
    >>> strength, residual = np.full((3, 8), 5.0), np.ones((3, 8))
    >>> initial = np.full((3, 8), 2.0)
    >>> initial[1, 5:7] = 5.0, 6.0
    >>> initial[2, 7] = 9.0
    >>> print(contradictions_of(line, strength, residual, initial, False)[0][:87])
    strength: must be above initial_stress. At x = 5 m of sample 1 they are 5 and 5 Pa (nod
    >>> print(contradictions_of(line, strength, residual, initial, False)[0][83:])
    (nodes: 2, further samples: 1). Only st.Rupture() accepts this
    >>> contradictions_of(line, strength, residual, initial, True)
    []

    Nodes that never break have an infinite strength. A finite strength may
    be 1e8 times the median:

    >>> strength[1, 3], strength[1, 2], strength[1, 0] = 5e8, np.inf, 4.0
    >>> contradictions_of(line, strength, residual, 0.0 * initial, False)
    []
    >>> strength[1, 3] = 6e8
    >>> print(contradictions_of(line, strength, residual, 0.0 * initial, False)[0][:83])
    strength: 6e+08 Pa at x = 3 m of sample 1 is more than 1e+08 times the median, 5 Pa

    A sample whose strength is nowhere above the residual strength:

    >>> strength[1], residual[2], strength[2, 3] = 6.0, np.linspace(5.0, 7.0, 8), np.inf
    >>> text = contradictions_of(line, strength, residual, 0.0 * initial, False)[0]
    >>> print(text.partition(". ")[2])
    In sample 2 strength is 5 to 5 Pa, and residual_strength is 5 to 7 Pa. Check both units
    """
    problems = []
    over = (strength <= initial).reshape(len(strength), -1)
    if not overstress and over.any():
        number = int(over.any(axis=1).argmax())
        node = int(over[number].argmax())
        most, least = initial[number].flat[node], strength[number].flat[node]
        further = int(over.any(axis=1).sum()) - 1
        problems.append(
            f"strength: must be above initial_stress. At {interface.describe_node(node)} of sample"
            f" {number} they are {least:g} and {most:g} Pa (nodes: {over[number].sum()}"
            f"{f', further samples: {further}' * (further > 0)}). Only st.Rupture() accepts this"
        )
    finite = np.isfinite(strength)
    if np.max(strength, where=finite, initial=0.0) > MAX_STRENGTH_RATIO * strength.min():
        middle = np.median(strength, axis=interface.axes, keepdims=True)
        if (huge := finite & (strength > MAX_STRENGTH_RATIO * middle)).any():
            number, node = np.argwhere(huge.reshape(len(strength), -1))[0].tolist()
            problems.append(
                f"strength: {strength[number].flat[node]:g} Pa at {interface.describe_node(node)}"
                f" of sample {number} is more than {MAX_STRENGTH_RATIO:g} times the median,"
                f" {middle[number].item():g} Pa. Check its sign, and give a smaller strength to"
                " nodes that never break"
            )
    weakens = ((strength > residual) & finite).reshape(len(strength), -1).any(axis=1)
    if not weakens.all():
        number = int(np.argmin(weakens))
        known = strength[number][finite[number]]
        problems.append(
            "strength: must be above residual_strength at one node or more. In sample"
            f" {number} strength is {known.min():g} to {known.max():g} Pa, and residual_strength is"
            f" {residual[number].min():g} to {residual[number].max():g} Pa. Check both units"
        )
    return problems


def steepest_weakening_rate(strength: Array, residual: Array, weakening_rate: Array) -> float:
    """Return the largest weakening rate, Pa/m, among nodes that may break.

    Arrays have shape (samples, *shape). Barriers do not count: with a
    uniform critical slip they weaken steeply but never slip.

    The drops have the lower quartiles 3 and 4, so barriers have drops above
    30 and 40:

    >>> strength = np.array([[2.0, 3.0, 4.0, 25.0, 60.0], [9.0, 41.0, 5.0, np.inf, 1.0]])
    >>> residual = np.array([[0.0], [1.0]]) * np.ones(5)
    >>> rates = np.array([[7.0, 8.0, 9.0, 20.0, 90.0], [3.0, 30.0, 5.0, 95.0, 1.0]])
    >>> steepest_weakening_rate(strength, residual, rates)
    30.0
    >>> steepest_weakening_rate(strength[:1], residual[:1], rates[:1])
    20.0
    >>> steepest_weakening_rate(strength[:1, 1:4], residual[:1, 1:4], rates[:1, 1:4])
    20.0
    >>> steepest_weakening_rate(strength[:1, :4], residual[:1, :4], rates[:1, :4])
    9.0

    The lower quartile by rank is the first and smallest of four drops, 4:

    >>> strength[1] = 9.0, 43.0, 5.0, np.inf, 5.5
    >>> steepest_weakening_rate(strength, residual, rates)
    20.0
    """
    drop = strength - residual
    if drop.max() <= BARRIER * drop.min() or weakening_rate.max() == weakening_rate.min():
        return float(weakening_rate.max())
    drop = drop.reshape(drop.shape[0], -1)
    weakens = np.isfinite(drop) & (drop > 0.0)
    count = weakens.sum(axis=1, keepdims=True)
    # numpy's quantile takes 20 times as long.
    ordered = np.sort(np.where(weakens, drop, -np.inf), axis=1)
    typical = np.take_along_axis(ordered, drop.shape[1] - count + (count - 1) // 4, axis=1)
    return float(weakening_rate.reshape(drop.shape)[drop <= BARRIER * typical].max())


# -- resolution --------------------------------------------------------------------------------


def nodes_in_nucleation_length(problem: Any, weakening_rate: float) -> tuple[float, ...]:
    """Count the nodes of a `Problem` that span h_n, in each direction.

    The weakening rate (Pa/m) is the steepest at any slip, as everywhere
    in this file.

    >>> from types import SimpleNamespace
    >>> plane = SimpleNamespace(spacings=(0.5, 0.25))
    >>> problem = SimpleNamespace(nucleation_lengths=lambda W: (3 / W, 8 / W), interface=plane)
    >>> nodes_in_nucleation_length(problem, 2.0)
    (3.0, 16.0)
    """
    lengths = problem.nucleation_lengths(weakening_rate)
    return tuple(np.divide(lengths, problem.interface.spacings).tolist())


def check_resolution(problem: Any, weakening_rate: float) -> None:
    """Refuse a grid that does not resolve h_n at the highest weakening rate (Pa/m).

    A nucleation length of 4 m may span 4 nodes, and no fewer:

    >>> from types import SimpleNamespace
    >>> def resolution(spacing):
    ...     problem = SimpleNamespace(solid=SimpleNamespace(shear_modulus=3e9))
    ...     problem.half_spaces = SimpleNamespace(nucleation_lengths=lambda W: (8.0 / W,))
    ...     problem.interface = SimpleNamespace(spacings=(spacing,), shape=(64,), is_held=False)
    ...     problem.interface.spacing = spacing
    ...     try:
    ...         check_resolution(problem, 2.0)
    ...     except InputError as error:
    ...         print(str(error)[:88])
    >>> resolution(1.0)
    >>> resolution(2.0)
    interface.nodes: must be 128 or more. The nucleation length, 4 m, spans 2 nodes, but mus
    >>> resolution(100.0)
    interface.nodes: must be 6400 or more. The nucleation length, 4 m, spans 0.04 nodes, but
    >>> resolution(101.0)
    solid.shear_modulus, interface.length, friction: the nucleation length is 4 m, and the n
    """
    lengths = problem.half_spaces.nucleation_lengths(weakening_rate)
    resolution = np.divide(lengths, problem.interface.spacings)
    if min(resolution) >= MIN_NODES_IN_NUCLEATION:
        # Blocks have no single length.
        if problem.interface.is_held and problem.specimen is None:
            _check_extent(problem.interface, resolution)
        return
    length = lengths[int(np.argmin(resolution))]
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
        f" length, {length:.3g} m, spans {min(*resolution, least - 0.01):.3g} nodes, but must span"
        f" at least {least}. Check the unit of interface.length (m)"
    )


def _check_extent(interface: Interface, resolution: Array) -> None:
    """Refuse an extent narrower than the nucleation length, which is given in nodes.

    >>> line = Interface(8.0, 8, extent=(2.0, 5.0))
    >>> plane = Interface((8.0, 16.0), (8, 8), extent=((2.0, 5.0), (4.0, 12.0)))
    >>> pairs = (line, [4.0]), (line, [4.1]), (plane, [4.0, 5.0]), (plane, [4.0, 5.5])
    >>> for interface, nodes in pairs:
    ...     try:
    ...         _check_extent(interface, nodes)
    ...     except InputError as error:
    ...         print(str(error).partition(". ")[0])
    interface.extent: is 4 m wide along x, less than the nucleation length, 4.1 m
    interface.extent: is 10 m wide along y, less than the nucleation length, 11 m
    """
    breakable = interface.breakable
    for axis, dim in enumerate(interface.dims):
        across = tuple({0, 1} - {axis})[: breakable.ndim - 1]
        width = np.count_nonzero(breakable.any(axis=across))
        if width < (1.0 - 1e-9) * resolution[axis]:
            spacing = interface.spacings[axis]
            raise InputError(
                f"interface.extent: is {width * spacing:.3g} m wide along {dim}, less than"
                f" the nucleation length, {resolution[axis] * spacing:.3g} m. Widen the extent"
            )


def _finer(problem: Any, resolution: Any, wanted: int) -> str:
    """Return the number of nodes for which the nucleation length spans `wanted` nodes.

    >>> from types import SimpleNamespace
    >>> problem = SimpleNamespace(interface=SimpleNamespace(shape=(64, 10)))
    >>> _finer(problem, [4.0, 6.0], 8)  # 64 x 2, and 10 x 4/3 = 13.3
    '128 x 14'
    """
    growth = wanted / np.maximum(resolution, 1e-300)
    halves = np.ceil(0.5 * np.array(problem.interface.shape) * growth)
    return " x ".join(f"{2 * n:.10g}" for n in halves)


def warn_if_coarse(problem: Any, weakening_rate: float, enough: float, cost: str) -> None:
    """Warn with the error `cost` if h_n spans fewer than `enough` nodes at a rate (Pa/m).

    >>> import warnings
    >>> from types import SimpleNamespace
    >>> plane = SimpleNamespace(spacings=(0.5, 0.25), shape=(64, 32), is_plane=True)
    >>> plane = SimpleNamespace(
    ...     nucleation_lengths=lambda W: (12 / W, 9 / W), interface=plane, specimen=None
    ... )
    >>> line = SimpleNamespace(nucleation_lengths=lambda W: (12 / W,), mode="II")
    >>> line.interface, line.specimen = Interface(32.0, 64), Blocks(height=1.0)
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     for problem, enough in ((plane, 12.0), (line, 8.0), (line, 12.0), (line, 13.0)):
    ...         warn_if_coarse(problem, 3.0, enough, "about 3 %")
    >>> for warning in told:
    ...     print(*str(warning.message).split(" spans ")[1].split(" are recommended "))
    8.0 nodes along x and, in mode III, 12.0 along y, and 16 (interface.nodes = 128 x 44): about 3 %
    8.0 nodes, 3.1 at a free end, and 16 (interface.nodes = 128): about 3 %
    8.0 nodes, 3.1 at a free end, and 32 (interface.nodes = 256): about 3 %
    """
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
    """Warn about an interface that h_n fills, or on which free ends would count.

    >>> import warnings
    >>> from types import SimpleNamespace
    >>> line = SimpleNamespace(lengths=(8.0,), is_plane=False)
    >>> plane = SimpleNamespace(lengths=(9.0, 8.0), is_plane=True)
    >>> def warning(patch, interface=line, specimen=None):
    ...     problem = SimpleNamespace(interface=interface, specimen=specimen)
    ...     problem.nucleation_lengths = lambda W: (patch / W, 99.0)
    ...     with warnings.catch_warnings(record=True) as told:
    ...         warnings.simplefilter("always")
    ...         warn_if_short(problem, 2.0)
    ...     return [(warning.category.__name__, str(warning.message)[:62]) for warning in told]
    >>> warning(4.0), warning(6.4, plane), warning(17.0, specimen="blocks")
    ([], [], [])
    >>> warning(5.0)
    [('AccuracyWarning', 'the interface is 3.2 nucleation lengths long and continues per')]
    >>> warning(16.0, plane)
    [('UnitWarning', 'the critical patch (nucleation length 8 m) fills the interface')]
    """
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


# -- doubts about units -----------------------------------------------------------------------


def doubt_sample(problem: Any, sample: Any) -> None:
    """Warn about the units of given profiles, as `doubt_strengths` does.

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> sample = SimpleNamespace(
    ...     mean=lambda rows: rows.mean(-1), normal_pressure=np.array([[2.0, 4.0], [6.0, 8.0]]),
    ...     mean_strength=7.0, residual_strength=np.array([1.0, 2.0]),
    ...     initial_stress=np.array([-9.0, 3.0]),
    ... )
    >>> with patch(f"{__name__}.doubt_strengths") as doubts:
    ...     doubt_sample("problem", sample)
    >>> doubts.call_args
    call('problem', 7.0, 1.5, pressure=5.0, initial=9.0)
    """
    pressure = float(sample.mean(sample.normal_pressure).mean())
    doubt_strengths(
        problem,
        sample.mean_strength,
        float(sample.residual_strength.mean()),
        pressure=None if math.isnan(pressure) else pressure,
        initial=float(np.abs(sample.initial_stress).max()),
    )


def doubt_strengths(
    problem: Any,
    strength: float,
    residual: float = 0.0,
    scales: Mapping[str, Any] | None = None,
    pressure: float | None = None,
    initial: float | None = None,
) -> None:
    """Warn about mean peak and residual strengths (Pa) that do not fit the rest of the problem.

    Raise an `InputError` for strengths that cannot fit, and for
    scales of slip, given by name, that the grid does not resolve at
    these strengths. By default, `pressure` and `initial`, the size
    of the initial stress, come from the problem.

    A problem that fits, and strengths that do not fit the modulus, the
    pressure, the slip over which they fall, or the initial stress:

    >>> import warnings
    >>> import stiction as st
    >>> def doubts(strength, residual=0.0, initial=0.0, pressure=None, rate=1e9):
    ...     problem = st.Problem(
    ...         st.Solid(1e9, 0.25, 1200.0), st.Interface(9e9 / rate, 64),
    ...         st.LinearWeakening(weakening_rate=rate),
    ...         st.Load(initial_stress=initial, normal_pressure=pressure),
    ...     )
    ...     with warnings.catch_warnings(record=True) as told:
    ...         warnings.simplefilter("always")
    ...         doubt_strengths(problem, strength, residual)
    ...     return [str(warning.message).split(", ", 1)[1][:32] for warning in told]
    >>> doubts(4e7, 3e7, -1e7, 4.1e6)
    []
    >>> doubts(6e7)
    ['6e+07 Pa, is 0.06 times the shea']
    >>> doubts(4e7, 6e7)
    ['6e+07 Pa, is 0.06 times the shea']
    >>> doubts(4e7, pressure=3.9e6), doubts(4e7, pressure=4.1e10)
    (['4e+07 Pa, is 10 times the normal'], ['4e+07 Pa, is 0.00098 times the n'])
    >>> doubts(4e7, rate=5e15), doubts(4e7, initial=-380.0)
    (['4e+07 Pa, falls within a slip of'], ['380 Pa, is 9.5e-06 times the str'])
    """
    friction, modulus = problem.friction, problem.solid.shear_modulus
    pressure = problem.given_pressure if pressure is None else pressure
    rigidity = (RIGIDITY[0][0], STRONG if modulus > STIFF else RIGIDITY[0][1]), RIGIDITY[1]
    compared = [("strength", strength, "shear modulus", modulus, rigidity)]
    if pressure is not None:
        mean = float(np.mean(pressure))
        compared.append(("strength", strength, "normal pressure", mean, FRICTION))
    if residual:
        compared.append(("residual_strength", residual, "shear modulus", modulus, rigidity))
    doubts = [
        Doubt(
            f"{name}: its mean, {mean:.4g} Pa, is {mean / of:.2g} times the {what}. Check the"
            " units of both (Pa). Friction coefficients need quantity='friction_coefficient'",
            mean / of,
            *limits,
        )
        for name, mean, what, of, limits in compared
    ]
    drop = strength - float(np.mean(friction.residual(np.array(strength))))
    if friction.weakening_rate is not None and drop > 0.0:
        slip = drop / float(np.median(friction.weakening_rate))
        text = (
            f"strength: its mean, {strength:.4g} Pa, falls within a slip of {slip:.2g} m, the"
            " size of a few atoms. Check the units of strength, pressure and weakening_rate"
        )
        doubts.append(Doubt(text, slip, *SLIP))
    if initial is None:
        initial = float(np.max(np.abs(problem.load.initial_stress)))
    if initial:
        text = (
            f"initial_stress: its largest magnitude, {initial:.4g} Pa, is"
            f" {initial / strength:.2g} times the strength. Check its unit (Pa)"
        )
        doubts.append(Doubt(text, initial / strength, *INITIAL))
    if doubt_units(doubts):
        return
    given = friction.scale if friction.weakening_rate is None else None
    fixed = {} if given is None else dict([given])
    for scale, value in (scales or fixed).items():
        fall = np.array(strength - residual)
        W = max(float(friction.weakening_rate_of(fall, scale, np.median(value))), 1e-300)
        W *= friction.steepening
        warn_if_short(problem, W)
        check_resolution(problem, W)
