"""Follow slip and opening of a slider on a base, from event to event.

Problem
-------
The interface has n cells, which slip by d >= 0 (m), and n + 1 edges,
which open by w >= 0 (m). With x = (d, w), stiffness K (Pa), a load that
has risen by D (N/m) and its forces T at rest, the shear force of a cell
is (D T - K x)_a, and the force that presses an edge is P_b = -(D T - K
x)_b. N_a is the normal force on a cell: half P at both its edges, but
the whole P at the two ends of the slider. Written N = Q P, the law of a
cell is

    strength_a = mu_a N_a - W_a d_a,                                 (1)

with mu_a = mu_p at first. When the strength meets mu_r N_a, it is mu_r
N_a from then on: mu_a is mu_r, and W_a is 0. Slip is irreversible,
opening is reversible. The overstress o (N/m) of a cell is its shear
force minus its strength, and the overstress of an edge is -P.
Equilibrium is

    o <= 0,   o = 0 where a cell slips or an edge is open.           (2)

o changes at the rate do = p dD - M dx. Row a of M is K_a + mu_a (Q
K_w)_a with -W_a on the diagonal, and p_a = T_a + mu_a (Q T_w)_a. Row b
of an edge is K_b, and p_b = T_b. M is not symmetric, but its entries
off the diagonal are nearly never positive, so that the least
equilibrium above the present slip is the one which the slider reaches.

A set S of slipping cells and open edges moves at the rate v = M_SS^-1
p_S. If a cell or an edge starts whose pivot M_ee - M_eS M_SS^-1 M_Se is
not positive, slip jumps at this load.

Algorithm
---------
The algorithm is our own. It keeps S, the inverse of M_SS, and a stack E
of cells and edges that could not start.

1. If E is empty, the load rises and v = M_SS^-1 p_S. Otherwise the load
   is held. e, the top of E, moves at the rate 1, and v = -M_SS^-1 M_Se.
2. Find the nearest kink: a resting cell or a closed edge has lost its
   margin (a start), e has lost its overstress, a cell meets mu_r N (a
   corner; a resting cell may meet it while N falls), or an open edge
   closes. A slipping cell stops at once if its rate is negative. e is
   released at once if others have taken its overstress away. Without a
   kink the slider slides.
3. Move to the kink. Start: border the inverse if the pivot is positive.
   Otherwise push the node on E. e has lost its overstress: take e from
   E, and start it. Released: take e from E. Corner: change one row of
   M. If the cell slips, remove it from the inverse, and border again.
   Close or stop: remove a row and a column from the inverse. If the
   diagonal of the inverse is not positive there, the rest of S is
   unstable: border all of S again, open edges first and cells in the
   order in which they started, and push each node whose pivot is not
   positive on E.
4. Return if E has become empty or has ceased to be empty, or if the
   load is at its target. Otherwise go to 1.

A machine of stiffness k' (Pa) lowers the force F = D - k' T'x. It adds
k' T T' to K.

Example by hand: one cell without coupled edges, K = 3, T = 1, mu_p
N = 2, mu_r N = 1, W = 1. The cell starts at D = 2 with the pivot 3 - 1
= 2, and slips at the rate 1/2. At d = 1 (D = 4) it meets its corner,
and slips at the rate 1/3 from then on. With W = 4 the pivot is -1: the
cell jumps at D = 2, passes its corner at d = 1/4 with the overstress
1/4, and rests at d = 1/3.

>>> from stiction.methods.equilibrium.slider import Friction, make_contact
>>> K, T, rest = np.diag([3.0, 1, 1]), np.array([1.0, 0, 0]), np.array([-2.0, -1, -1])
>>> slow, fast = (Friction(*np.array([[1.0], [0.5], [W]])) for W in (1.0, 4.0))
>>> state = make_contact(K, T, slow, rest.copy(), np.zeros(3))
>>> for load in (1.5, 3.0, 4.0, 7.0):
...     print(Status(follow(state, load)).name, round(float(state.moved[0]), 6))
AT_TARGET 0.0
AT_TARGET 0.5
AT_TARGET 1.0
AT_TARGET 2.0
>>> state = make_contact(K, T, fast, rest.copy(), np.zeros(3))
>>> for _ in range(3):
...     print(Status(follow(state, 5.0)).name, state.loads[LOAD], state.moved[:1].round(6))
UNSTABLE 2.0 [0.]
ARRESTED 2.0 [0.333333]
AT_TARGET 5.0 [1.333333]

With W = 3.5 and a machine of 1 Pa, the pivot is 0.5. The cell slips by
2/7 m while the load rises by 1/7 N/m, and the force falls. At D = 2.2,
slip is 2/7 + (2.2 - 15/7)/4 = 0.3 m:

>>> soft = slow._replace(weakening=np.array([3.5]))
>>> state = make_contact(K, T, soft, rest, np.zeros(3), 1.0)
>>> Status(follow(state, 2.2)).name
'AT_TARGET'
>>> round(float(state.moved[0]), 6)
0.3
>>> state.loads.round(6).tolist()
[2.2, 1.9, 2.0]
"""

from enum import IntEnum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.jit import jit, jit_inside

Integers = NDArray[np.int64]

RATE_RTOL = 1e-10
"""A rate below this fraction of its scale is round-off."""
CONTACT_PIVOT_RTOL = 1e-9
"""Smallest positive pivot, as a fraction of the diagonal of M."""
CONTACT_OVERSTRESS_RTOL = 1e-12
"""Overstress that is round-off, as a fraction of the largest force."""
MAX_EVENTS_PER_NODE = 64
"""Average number of events per cell and edge after which a path is given up."""


class Status(IntEnum):
    """Reasons why a path stops. After the first three, the path can go on."""

    AT_TARGET = 0  # the load is the target
    UNSTABLE = 1  # E was empty, and is not
    ARRESTED = 2  # E was not empty, and is
    SLIDING = 3  # there is no kink ahead
    GIVEN_UP = 4  # too many events


class Motion(IntEnum):
    """Motions of a cell or an edge."""

    REST = 0  # a cell at rest, or a closed edge
    STABLE = 1  # in S
    UNSTABLE = 2  # in E


class Kind(IntEnum):
    """Events of a node at a kink."""

    TARGET = 0  # nothing, but the load is at its target
    START = 1
    AT_STRENGTH = 2  # e has lost its overstress
    RELEASE = 3  # e has less than no overstress
    CORNER = 4
    CLOSE = 5
    STOP = 6


class Kink(NamedTuple):
    """The nearest kink, at a `step` that is the rise of the load or of the slip of e."""

    step: float
    node: int
    kind: int


class Contact(NamedTuple):
    """State of a slider on its path of equilibria.

    Nodes are cells 0 to n-1 and edges n to 2n. Functions change the
    arrays in place.

    `columns` is M transposed. `difference` is mu_p - mu_r, and
    `weakening` is W. Both are 0 from the corner on. `loads` holds the
    load D, the force F and the largest F so far. `counts` holds the
    sizes of S and E, the number of events, and the number of times that
    all of S was bordered again.
    """

    columns: Array  # (m, m): row s is column s of M, Pa
    load: Array  # (m,): p
    relief: Array  # (m,): k' T, Pa
    normal_stiffness: Array  # (n, m): Q K_w, Pa
    normal_load: Array  # (n,): Q T_w
    difference: Array  # (n,)
    weakening: Array  # (n,): Pa
    overstress: Array  # (m,): o, N/m
    moved: Array  # (m,): slip in either direction so far, and opening, m
    inverse: Array  # (m, m): of M_SS in its first rows and columns
    inside: Integers  # (m,): nodes in S, in the order of their starts
    stack: Integers  # (m,): nodes in E
    motion: Integers  # (m,): `Motion`
    counts: Integers  # (4,)
    loads: Array  # (3,): N/m
    rate: Array  # (m,): of slip and opening
    change: Array  # (m,): rate of o
    left: Array  # (m,): M_eS M_SS^-1
    right: Array  # (m,): M_SS^-1 M_Se


N_INSIDE, N_STACKED, N_EVENTS, N_BORDERED_AGAIN = range(4)
LOAD, FORCE, PEAK = range(3)


@jit_inside
def normal(edges: Array, n: int, a: int) -> float:
    """Return (Q P)_a from values (m,), of which the last n + 1 belong to edges.

    Each cell carries half the force on an edge, but the whole force at the ends:

    >>> values = np.array([9.0, 9.0, 9.0, 1.0, 2.0, 6.0, 16.0])
    >>> [float(normal.py_func(values, 3, a)) for a in range(3)]
    [2.0, 4.0, 19.0]
    """
    first = edges[n + a] * (1.0 if a == 0 else 0.5)
    return first + edges[n + a + 1] * (1.0 if a == n - 1 else 0.5)


@jit_inside
def _largest(values: Array) -> float:
    """Return the largest absolute value.

    >>> float(_largest.py_func(np.array([2.0, -5.0, 3.0])))
    5.0
    >>> _largest.py_func(np.zeros(0))
    0.0
    """
    largest = 0.0
    for value in values:
        largest = max(largest, abs(value))
    return largest


@jit_inside
def _multiply_inverse(state: Contact, k: int) -> None:
    """Write M_SS^-1 b (in S) to `right`, for b (k,) in `left`.

    >>> from types import SimpleNamespace
    >>> inverse, left = np.arange(49.0).reshape(7, 7) % 5, np.arange(1.0, 8.0)
    >>> for k in (3, 6):
    ...     state = SimpleNamespace(left=left, right=np.full(7, -1.0), inverse=inverse)
    ...     _multiply_inverse.py_func(state, k)
    ...     print((state.right[:k] - inverse[:k, :k] @ left[:k]).tolist(), state.right[k])
    [0.0, 0.0, 0.0] -1.0
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0] -1.0
    """
    left = state.left
    for t in range(k):
        row, a, b, c, d = state.inverse[t], 0.0, 0.0, 0.0, 0.0
        for r in range(0, k - 3, 4):  # four sums at once, which takes a third of the time
            a += row[r] * left[r]
            b += row[r + 1] * left[r + 1]
            c += row[r + 2] * left[r + 2]
            d += row[r + 3] * left[r + 3]
        for r in range(k - k % 4, k):
            a += row[r] * left[r]
        state.right[t] = (a + b) + (c + d)


@jit_inside
def _start(state: Contact, node: int) -> None:
    """Step 3: put a node into S if its pivot is positive, otherwise on E."""
    k, columns, inverse = state.counts[N_INSIDE], state.columns, state.inverse
    left, right = state.left, state.right
    for t in range(k):
        left[t] = columns[node, state.inside[t]]
    _multiply_inverse(state, k)
    pivot = columns[node, node]
    left[:k] = 0.0
    for t in range(k):
        entry = columns[state.inside[t], node]
        pivot -= entry * right[t]
        for r in range(k):
            left[r] += entry * inverse[t, r]
    if not pivot > CONTACT_PIVOT_RTOL * abs(columns[node, node]):
        state.stack[state.counts[N_STACKED]], state.motion[node] = node, Motion.UNSTABLE
        state.counts[N_STACKED] += 1
        return
    for t in range(k):
        factor = right[t] / pivot
        for r in range(k):
            inverse[t, r] += factor * left[r]
        inverse[t, k], inverse[k, t] = -factor, -left[t] / pivot
    inverse[k, k] = 1.0 / pivot
    state.inside[k], state.motion[node] = node, Motion.STABLE
    state.counts[N_INSIDE] += 1


@jit_inside
def _remove(state: Contact, node: int) -> None:
    """Step 3: take a node out of S."""
    k, n, left = state.counts[N_INSIDE], state.difference.shape[0], state.left
    inverse, inside, t = state.inverse, state.inside, 0
    while inside[t] != node:
        t += 1
    for r in range(k):
        left[r] = inverse[t, r]
        inside[r - (r > t)] = inside[r]
    state.motion[node] = Motion.REST
    if left[t] > 0.0:
        for r in range(k):
            if r != t:
                row, factor = inverse[r], inverse[r, t] / left[t]
                target = inverse[r - 1] if r > t else row
                for c in range(t):
                    target[c] = row[c] - factor * left[c]
                for c in range(t + 1, k):
                    target[c - 1] = row[c] - factor * left[c]
        state.counts[N_INSIDE] = k - 1
        return
    state.counts[N_BORDERED_AGAIN] += 1
    state.counts[N_INSIDE] = 0
    for r in range(k - 1):
        state.change[r] = inside[r]  # before the next rates are written there
    for of_edges in (True, False):
        for r in range(k - 1):
            if (state.change[r] >= n) == of_edges:
                _start(state, int(state.change[r]))


@jit_inside
def _pass_corner(state: Contact, a: int) -> None:
    """Step 3: the friction coefficient of a cell is mu_r, and its strength no longer falls."""
    slips, drop, columns = state.motion[a] == Motion.STABLE, state.difference[a], state.columns
    if slips:
        _remove(state, a)
    columns[a, a] += state.weakening[a]
    for s in range(columns.shape[0]):
        columns[s, a] -= drop * state.normal_stiffness[a, s]
    state.load[a] -= drop * state.normal_load[a]
    state.difference[a] = state.weakening[a] = 0.0
    if slips:
        _start(state, a)


@jit_inside
def _find_rates(state: Contact) -> None:
    """Step 1: write the rates of x and o."""
    columns, rate, change = state.columns, state.rate, state.change
    k, held, inside = state.counts[N_INSIDE], state.counts[N_STACKED], state.inside
    e, m = state.stack[held - 1], rate.shape[0]  # without E, e is not read
    rate[:] = 0.0
    for i in range(m):
        change[i] = -columns[e, i] if held else state.load[i]
    for t in range(k):
        state.left[t] = change[inside[t]]
    _multiply_inverse(state, k)
    for t in range(k):
        speed, column = state.right[t], columns[inside[t]]
        rate[inside[t]] = speed
        for i in range(m):
            change[i] -= speed * column[i]
    for t in range(k):
        change[inside[t]] = 0.0
    if held:
        rate[e] = 1.0


@jit_inside
def _nearer(kink: Kink, gap: float, speed: float, least: float, node: int, kind: int) -> Kink:
    """Return the earlier of a kink and the place at which a gap closes at a speed.

    A gap of 3 closes at the speed 2 after 1.5. A negative gap closes at once, and a speed
    at the least speed does not count:

    >>> kink = Kink(2.0, 5, Kind.TARGET)
    >>> _nearer.py_func(kink, 3.0, 2.0, 0.5, 7, Kind.CORNER)
    Kink(step=1.5, node=7, kind=<Kind.CORNER: 4>)
    >>> _nearer.py_func(kink, -3.0, 2.0, 0.5, 7, Kind.STOP)
    Kink(step=0.0, node=7, kind=<Kind.STOP: 6>)
    >>> [_nearer.py_func(kink, gap, speed, 0.5, 7, 1).node for gap, speed in ((4, 2), (1, 0.5))]
    [5, 5]
    """
    if speed > least and max(gap, 0.0) < kink.step * speed:
        return Kink(max(gap, 0.0) / speed, node, kind)
    return kink


@jit_inside
def _nearest_kink(state: Contact, target: float) -> Kink:
    """Step 2: return the nearest kink before the load reaches its target."""
    rate, change, overstress, moved = state.rate, state.change, state.overstress, state.moved
    n, difference, weakening = state.difference.shape[0], state.difference, state.weakening
    held, fastest = state.counts[N_STACKED], _largest(rate)
    e, slowest = state.stack[held - 1], int(np.argmin(rate[:n]))  # without E, e is not read
    if rate[slowest] < -RATE_RTOL * fastest:
        return Kink(0.0, slowest, Kind.STOP)
    if held and overstress[e] < -CONTACT_OVERSTRESS_RTOL * _largest(overstress):
        return Kink(0.0, e, Kind.RELEASE)
    forces = 0.0 if held else _largest(state.load)
    kink = Kink(np.inf if held else target - state.loads[LOAD], 0, Kind.TARGET)
    for i in range(rate.shape[0]):
        stiffness = abs(state.columns[i, i])
        least = RATE_RTOL * (stiffness * fastest + forces)
        if held and i == e:
            least_pivot = max(least, CONTACT_PIVOT_RTOL * stiffness)
            kink = _nearer(kink, overstress[i], -change[i], least_pivot, i, Kind.AT_STRENGTH)
        elif state.motion[i] == Motion.REST:
            kink = _nearer(kink, -overstress[i], change[i], least, i, Kind.START)
        elif i >= n and state.motion[i] == Motion.STABLE:
            kink = _nearer(kink, moved[i], -rate[i], RATE_RTOL * fastest, i, Kind.CLOSE)
        # Also cells that rest after slip.
        if i < n and difference[i] > 0.0 and (rate[i] != 0.0 or moved[i] > 0.0):
            above = -difference[i] * normal(overstress, n, i) - weakening[i] * moved[i]
            falls = difference[i] * normal(change, n, i) + weakening[i] * rate[i]
            kink = _nearer(kink, above, falls, least, i, Kind.CORNER)
    return kink


@jit
def follow(state: Contact, target: float) -> int:
    """Follow the path to a load (N/m), an instability or an arrest.

    Return the `Status`.

    Two sliders with three cells jump once, come to rest, stop cells, close edges and
    pass corners. At every stop, (1) gives the overstress, (2) holds, and no cell has
    missed its corner. In the second slider, S has to be bordered again:

    >>> from stiction.elasticity.rig import on_cells
    >>> from stiction.methods.equilibrium.slider import Friction, make_contact
    >>> def check(K_upper, T, P, W):
    ...     K, T, P, worst = np.zeros((7, 7)), np.array(T), np.array(P), 0.0
    ...     K[np.triu_indices(7)] = K_upper
    ...     K = K + np.triu(K, 1).T
    ...     law = Friction(np.array([0.75, 1, 0.5]), np.array([0.25, 0.5, 0.25]), np.array(W))
    ...     rest, stops = np.append(-law.peak * on_cells(P), -P), []
    ...     state = make_contact(K, T, law, rest, np.zeros(7))
    ...     while state.loads[LOAD] < 8.0 and len(stops) < 40:
    ...         stops.append(follow(state, (np.floor(4.0 * state.loads[LOAD]) + 1.0) / 4.0))
    ...         o = state.loads[LOAD] * T - K @ state.moved - np.append(np.zeros(3), P)
    ...         N, falls = on_cells(-o[3:]), state.weakening * state.moved[:3]
    ...         o[:3] += falls - (law.residual + state.difference) * N
    ...         missed, calm = falls - state.difference * N, state.motion < Motion.UNSTABLE
    ...         in_S = state.motion == Motion.STABLE
    ...         worst = max(worst, *abs(o - state.overstress), *o[calm], *abs(o[in_S]))
    ...         worst = max(worst, *missed, *-state.moved)
    ...     again = int(state.counts[N_BORDERED_AGAIN])
    ...     print(bool(worst < 1e-11), stops.index(Status.UNSTABLE), len(stops), again)
    >>> check([10, 1, -2, -1, -2, 1, -2, 6, 0, -1, 0, 1, 0, 6, 2, -1, 0, -1,
    ...        7, -1, 1, -1, 5, 0, -1, 5, 0, 6],
    ...       [1.0, 2, 1, 2, 2, 2, 0], [2.0, 1, 3, 2], [7.0, 0, 6])
    True 3 34 0
    >>> check([6, 1, 0, 0, 1, 1, -1, 8, -1, -2, 0, -2, -1, 6, -2, 0, 0, -2,
    ...        11, -1, -2, -2, 5, -2, 0, 11, 1, 9],
    ...       [1.0, 1, 3, 0, 1, -1, -1], [4.0, 2, 2, 4], [6.0, 1, 0])
    True 8 34 1
    """
    counts, loads, overstress, moved = state.counts, state.loads, state.overstress, state.moved
    while counts[N_EVENTS] < MAX_EVENTS_PER_NODE * moved.shape[0]:
        counts[N_EVENTS] += 1
        held = counts[N_STACKED] > 0
        # 1.
        _find_rates(state)
        # 2.
        kink = _nearest_kink(state, target)
        if kink.step == np.inf:
            return Status.SLIDING
        # 3.
        if not held:
            loads[LOAD] += kink.step
            loads[FORCE] += kink.step
        for i in range(moved.shape[0]):
            overstress[i] += kink.step * state.change[i]
            moved[i] += kink.step * state.rate[i]
            loads[FORCE] -= kink.step * state.relief[i] * state.rate[i]
        loads[PEAK] = max(loads[PEAK], loads[FORCE])
        node, kind = kink.node, kink.kind
        if kind == Kind.TARGET:
            loads[LOAD] = target
            return Status.AT_TARGET
        if kind == Kind.AT_STRENGTH or kind == Kind.RELEASE:
            state.motion[node] = Motion.REST
            counts[N_STACKED] -= 1
        if kind == Kind.START or kind == Kind.AT_STRENGTH:
            overstress[node] = 0.0
            _start(state, node)
        elif kind == Kind.CORNER:
            _pass_corner(state, node)
        elif kind == Kind.CLOSE or kind == Kind.STOP:
            if kind == Kind.CLOSE:
                moved[node] = 0.0
            _remove(state, node)
        # 4.
        if held and counts[N_STACKED] == 0:
            return Status.ARRESTED
        if not held and counts[N_STACKED] > 0:
            _find_rates(state)  # where slip jumps
            return Status.UNSTABLE
    return Status.GIVEN_UP
