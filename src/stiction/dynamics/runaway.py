"""Whether a rupture has grown so long that nothing on the interface can stop it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiction.dynamics import monitor
from stiction.dynamics.integrator import Run, State
from stiction.problem import Problem

_MARGIN = 1.5  # on that length: the same as equilibrium's


def refused_stop(problem: Problem, stop: str) -> list[str]:
    """Why a run cannot stop there; nothing if it can."""
    if stop == "runaway" and problem.interface.is_plane:
        return ["stop: 'runaway' is known of lines only; on a plane stop at 'sliding' or 'onset'"]
    return []


def runs_away(run: Run, state: State) -> bool:
    """Whether so many nodes in a row are at their residual strength that the rest must follow.

    A crack of half-length a with the stress drop D releases pi a D²/(2 G*) at each tip (Griffith),
    and more as it grows or the load rises; the largest fracture energy of the interface is what
    it has to pay. Barriers that never break pay any price.
    """
    nodes, medium, slid = run.setting.nodes, run.medium, state.watch[monitor.SLID]
    if not (slid > 0.0 and state.watch[monitor.IN_EVENT] > 0.0):
        return False
    drop = float((state.load * nodes.profile + nodes.initial - nodes.residual).min())
    if drop <= 0.0:
        return False
    length = 4.0 * medium.effective_modulus * run.toughest / (np.pi * drop**2)
    needed = _MARGIN * length / medium.grid.cell
    return slid >= needed and longest_run(state.slip >= nodes.critical) >= needed


def longest_run(marked: NDArray[np.bool_]) -> int:
    """Length of the longest row of marked nodes on a circle, (nodes,) bool."""
    others = np.flatnonzero(~marked)
    if others.size == 0:
        return int(marked.size)
    return int(np.diff(others, append=others[0] + marked.size).max()) - 1
