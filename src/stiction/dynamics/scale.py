"""The stress scale of a run: what its tolerances are measured in, at the load that is reached."""

from __future__ import annotations

from typing import Any

import numpy as np

from stiction.arrays import Array
from stiction.dynamics import monitor
from stiction.dynamics.arrays import Nodes
from stiction.dynamics.loading import History, load_at
from stiction.jit import jit

REACH = 3.0  # a node counts with at most so many times the stress drop that the load provides


def stress_scale(nodes: Nodes) -> History:
    """The stress scale as a function of the load: (loads, scales), Pa, straight between them.

    The mean over nodes of tau_p - tau_r, no node counting for more than `REACH` times
    tau_0 p + tau_i - tau_r, the drop that the load provides there. Where strengths are alike it
    is the mean of tau_p - tau_r; barriers that the load is far from breaking, infinite ones among
    them, do not raise it, and it grows with the load that comes to break them.

    Parameters
    ----------
    nodes : Nodes
    """
    strength, residual = nodes.strength, nodes.residual
    profile, initial = nodes.profile, nodes.initial
    begin = (residual - initial) / profile
    end = begin + (strength - residual) / (REACH * profile)
    slope = REACH * profile / profile.size
    stops = np.isfinite(end)
    loads, at = np.unique(np.concatenate([begin, end[stops]]), return_inverse=True)
    bends = np.bincount(at, np.concatenate([slope, -slope[stops]]))
    # The last slope goes on beyond the last load, so one more load shows it.
    loads = np.append(loads, loads[-1] + max(1.0, abs(loads[-1])))
    scales = np.concatenate([[0.0], np.cumsum(np.cumsum(bends) * np.diff(loads))])
    return loads, scales


@jit
def follow_scale(watch: Array, control: Array, loads: Array, scales: Array, load: float) -> Any:
    """The stress scale of the largest load so far, Pa; sizes of events follow it."""
    scale = max(watch[monitor.SCALE], load_at(loads, scales, load))
    watch[monitor.SCALE] = scale
    watch[monitor.EVENT_DROP] = control[monitor.EVENT_DROP_SIZE] * scale
    watch[monitor.PEAK_WIDTH] = control[monitor.PEAK_WIDTH_SIZE] * scale
    return scale
