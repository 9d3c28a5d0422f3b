"""Griffith's criterion for non-uniform loads: energy release rate and critical crack length.

Problem
-------
A crack of half-length a lies on a periodic line (period L, modulus G*)
between two identical half-spaces, with the stress drop D(x) (Pa). With
U = tan(pi a/L) and tan(pi (x - centre)/L) = U cos t, the stress
intensity factors at both tips (H. Bueckner, Zeitschrift fuer Angewandte
Mathematik und Mechanik 50, 1970; W. Koiter, Ingenieur-Archiv 28, 1959)
are

    K = ((L/pi^2) (1 + U^2) U)^(1/2) int_0^pi D (1 +- cos t)/(1 + U^2 cos^2 t) dt,  (1)

and the energy release rate is G = K |K|/(2 G*). A crack runs if G
exceeds the fracture energy (A. Griffith, Phil. Trans. A 221, 1921).

Algorithm
---------
1. Evaluate (1) with Gauss and Chebyshev's rule, with D linear between
   the nodes (`_intensity_factors`). K is linear in D, so one evaluation
   serves all loads.
2. Bracket the lengths at which G crosses the fracture energy. Test
   lengths are one node apart, and closer near zero. Bisect the brackets
   (`griffith_length`).
"""

from typing import Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.model import Flag, Positive, Real, RealArray, checked, describe
from stiction.problem.problem import Problem, refuse_specimen

MIN_POINTS = 512  # Gauss-Chebyshev points along a crack, exact to round-off for smooth drops
SHORT_LENGTHS = np.geomspace(1e-6, 1.0, 40, endpoint=False)  # below one node spacing
POINTS_AT_ONCE = 1 << 20
N_HALVINGS = 30


@checked
def griffith_length(
    problem: Problem,
    load: RealArray,
    fracture_energy: Positive,
    *,
    centre: Real = 0.0,
    arrest: Flag = False,
) -> Any:
    """Return the length at which a crack begins to run or is arrested, by Griffith's criterion.

    Parameters
    ----------
    problem : Problem
        A line. Its load profile, initial stress and residual strength
        give the stress drop tau_i + tau_0 p - tau_r.
    load : float or (k,) array
        tau_0, Pa. Many loads at once cost little more than a single load.
    fracture_energy : float
        Gamma, J/m², positive. Use the mean for random strength.
    centre : float
        Centre of the crack, m, at equal distances from both tips.
    arrest : bool
        If false, return the shortest length above which the smaller of
        the two release rates exceeds Gamma. If true, return the next
        length at which it falls below Gamma again.

    Returns
    -------
    float or (k,) array
        Length, m, infinite if there is no such length.

    Raises
    ------
    InputError
        On a plane, or with `residual_ratio`.

    Notes
    -----
    Between identical half-spaces G = K|K|/(2 G*), where K is the
    integral of the stress drop times the weight of Bueckner (1970). The
    interface is periodic: u = tan(pi x/L) maps the row of collinear
    cracks to a single crack, so that a uniform drop gives K = drop (L
    tan(pi a/L))^(1/2) for the half-length a (Koiter, 1959). Kammer et
    al. (2015) and Ke et al. (2018) predict the length of confined
    ruptures in this way. The drop is linear between the nodes. G is
    negative at a tip at which the stress drop acts against the crack.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> st.theory.griffith_length(problem, 1e6, 0.5) > st.theory.griffith_length(
    ...     problem, 2e6, 0.5
    ... )
    True

    A uniform stress drop D gives G = D² L tan(pi a/L)/(2 G*), and a crack
    never stops. If the load falls away from x = 0.05 m, it stops, and its
    release rate equals the fracture energy at both lengths.

    >>> import dataclasses, numpy as np
    >>> L, loads = problem.interface.measure, np.array([1e6, 2e6])
    >>> tangent = 0.5 * problem.effective_modulus * 4.0 / (loads**2 * L)
    >>> length = griffith_length(problem, loads, 1.0)
    >>> np.allclose(length, 2.0 * L / np.pi * np.arctan(tangent), rtol=1e-6)
    True
    >>> griffith_length(problem, 1e6, 1.0, arrest=True)
    inf
    >>> away = np.abs(problem.interface.x - 0.05)
    >>> load = st.Load(profile=np.exp(-away / 0.003), initial_stress=-1e5)
    >>> falling = dataclasses.replace(problem, load=load)
    >>> ends = [
    ...     griffith_length(falling, 2e6, 1.0, centre=0.051, arrest=arrest)
    ...     for arrest in (False, True)
    ... ]
    >>> rates = [
    ...     release_rates(
    ...         falling,
    ...         2e6,
    ...         np.array([end * (1.0 + d) for d in (-1e-6, 1e-6)]),
    ...         0.051,
    ...     )
    ...     for end in ends
    ... ]
    >>> [(rate.min(axis=1) > 1.0).tolist() for rate in rates], ends[0] < ends[1]
    ([[False, True], [True, False]], True)
    """
    if load.ndim > 1 or not np.all(np.isfinite(load)):
        raise InputError(f"load: must be finite, a number or a list, got {describe(load)}")
    tau = load.reshape(-1, 1, 1)

    def runs(lengths: Array, tau: Array) -> Any:
        return release_rates(problem, tau, lengths, centre).min(axis=-1) > fracture_energy

    # 2. The lengths at which a crack is tested, and whether it runs
    # there under each load.
    interface = problem.interface
    lengths = interface.spacing * np.append(SHORT_LENGTHS, np.arange(1, interface.size))
    above = runs(lengths, tau)
    # A crack can be arrested only after it has begun to run.
    if arrest:
        above = ~above & np.maximum.accumulate(above, axis=1)
    # Bisect between the first such length and the length before it.
    crosses, first = above.any(axis=1), above.argmax(axis=1)
    low, high = np.append(0.0, lengths)[first[crosses]], lengths[first[crosses]]
    for _ in range(N_HALVINGS if crosses.any() else 0):
        middle = 0.5 * (low + high)
        beyond = runs(middle, tau[crosses, 0]) != arrest
        low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
    critical = np.full(tau.size, np.inf)
    critical[crosses] = high
    return critical if load.ndim else float(critical[0])


def release_rates(problem: Problem, load: Any, lengths: Array, centre: float) -> Array:
    """Return G = K|K|/(2 G*) at both tips of cracks, J/m², with the shape (..., lengths, 2).

    Uniform drops of 3 and -1 MPa remain at loads of 4 and 0 MPa: K² =
    D² L tan(pi a/L), and G has the sign of K.

    >>> import dataclasses, stiction as st
    >>> problem = st.paper.problem(nodes=144)
    >>> friction = st.LinearWeakening(weakening_rate=5e11, residual_strength=1e6)
    >>> problem = dataclasses.replace(problem, friction=friction)
    >>> rates = release_rates(
    ...     problem, np.array([4e6, 0.0])[:, None, None], np.array([0.02]), 0.03
    ... )
    >>> unit = (
    ...     1e12
    ...     * 0.1
    ...     * np.tan(np.pi * 0.01 / 0.1)
    ...     / (2.0 * problem.effective_modulus)
    ... )
    >>> (rates / unit).round(6).tolist()
    [[[9.0, 9.0]], [[-1.0, -1.0]]]
    """
    # The factors without load and by a unit load serve every load.
    resting, unit = _intensity_factors(problem, _stress_drops(problem), lengths, centre)
    factor: Array = resting + load * unit
    return factor * np.abs(factor) / (2.0 * problem.effective_modulus)


def _stress_drops(problem: Problem) -> Array:
    """Return stress drops (2, nodes) at the nodes, Pa: without a load, and by a unit load.

    >>> import stiction as st
    >>> problem = st.Problem(
    ...     solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0),
    ...     interface=st.Interface(0.1, 8),
    ...     friction=st.LinearWeakening(critical_slip=1e-5, residual_strength=5.0),
    ...     load=st.Load(profile=np.linspace(0.5, 1.5, 8), initial_stress=2.0),
    ... )
    >>> _stress_drops(problem)[:, [0, 7]].tolist()
    [[-3.0, -3.0], [0.5, 1.5]]
    """
    if problem.interface.is_plane:
        raise InputError("problem: must have a line interface")
    refuse_specimen(problem, "the theory of cracks between half-spaces", "Use st.Equilibrium()")
    if problem.friction.residual_ratio is not None:
        raise InputError(
            "problem.friction.residual_ratio: the stress drop needs the residual strength in Pa."
            " Give friction.residual_strength (for random strength, the ratio times its mean)"
        )
    resting = problem.load.initial_stress - problem.friction.residual_strength
    drops = np.empty((2, problem.interface.size))
    drops[0], drops[1] = resting, problem.load_profile
    return drops


def _intensity_factors(problem: Problem, drops: Array, lengths: Array, centre: float) -> Array:
    """Step 1: return K (drops, m, 2), Pa m^(1/2), at both tips of cracks with given lengths.

    A uniform drop of 2 Pa gives 2 (L tan(pi a/L))^(1/2). A short crack at
    0.95 m lies between node 7, without a drop, and node 0 with a drop of 5
    Pa. There D is 3 Pa and grows by 40 Pa/m, so that K over (pi a)^(1/2) is 3
    -+ 40 a/2.

    >>> from types import SimpleNamespace
    >>> import stiction as st
    >>> line, drops = (
    ...     SimpleNamespace(interface=st.Interface(1.0, 8)),
    ...     np.full((2, 8), 2.0),
    ... )
    >>> drops[1] = np.eye(8)[0] * 5.0
    >>> lengths = np.array([2e-4, 0.5])
    >>> K = _intensity_factors(line, drops, lengths, 0.95)
    >>> (K[0] / np.sqrt(np.tan(0.5 * np.pi * lengths))[:, None]).round(6).tolist()
    [[2.0, 2.0], [2.0, 2.0]]
    >>> (K[1, 0] / np.sqrt(np.pi * 1e-4)).round(5).tolist()
    [2.998, 3.002]
    >>> _intensity_factors(
    ...     line, drops, np.full(2100, 0.5), 0.95
    ... ).shape  # more than fit at once
    (2, 2100, 2)
    """
    interface, period = problem.interface, problem.interface.measure
    points = max(MIN_POINTS, interface.size)
    cosine = np.cos((np.arange(points) + 0.5) * np.pi / points)
    factors = []
    # A part of the lengths at a time, so that memory stays small.
    for part in np.array_split(lengths, 1 + lengths.size * points // POINTS_AT_ONCE):
        # 1. The substitution of (1) turns the crack into -1 < cos t < 1.
        U = np.tan(0.5 * np.pi * part / period)
        u = U[:, None] * cosine
        # D is linear between the nodes to the left and the right of a place.
        place = (centre + np.arctan(u) * period / np.pi) / interface.spacing
        left = np.floor(place)
        share, left = place - left, left.astype(np.int64) % interface.size
        right = (left + 1) % interface.size
        scale = np.sqrt(period * (1.0 + U**2) * U)
        D = np.take(drops, left, axis=1) * (1.0 - share) + np.take(drops, right, axis=1) * share
        weighted = D / (1.0 + u * u)
        left_tip, right_tip = (weighted * (1.0 + side * cosine) for side in (-1.0, 1.0))
        both = np.stack((left_tip.mean(axis=-1), right_tip.mean(axis=-1)), axis=-1)
        factors.append(scale[:, None] * both)
    return np.concatenate(factors, axis=1)
