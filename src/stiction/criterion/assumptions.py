"""What the local criterion takes for granted: laws, rates, strength and grids it holds for."""

from __future__ import annotations

import numpy as np

from stiction.arrays import Array
from stiction.errors import InputError, warn_accuracy
from stiction.problem import Problem
from stiction.sample import Sample


def refused_laws(problem: Problem) -> list[str]:
    """Why the criterion of the initial slope says nothing on a friction law; nothing if it does."""
    friction = problem.friction
    if not friction.steepens:
        return []
    times = friction.steepest_slope / friction.initial_slope
    return [
        f"friction: the local criterion takes the weakening rate at zero slip, and this law falls"
        f" up to {times:.3g} times as steeply later, so that patches become unstable at lower"
        " loads than it says; use st.Equilibrium() or st.Rupture()"
    ]


def check_law(problem: Problem) -> None:
    """Refuse a law that steepens; warn of one that is not linear, with the error to expect."""
    if reasons := refused_laws(problem):
        raise InputError(reasons)
    if not problem.friction.linear:
        warn_accuracy(
            "friction: the local criterion takes the weakening rate at zero slip for that at any;"
            " as strength falls ever less steeply, patches become unstable later than it says: for"
            " an exponential law and strength from 0.66 to 1.66 MPa by 2 % (at most 7 %) at a"
            " correlation length of a quarter of h_n, by 0.6 % (at most 3 %) at one of h_n;"
            " st.Equilibrium() follows polygons exactly"
        )


def warn_if_coarse(problem: Problem, rows: Sample) -> None:
    """Warn where the moving average is a coarse sum."""
    if problem.interface.is_plane:
        problem.warn_if_coarse(
            rows,
            8.0,
            "the local criterion takes the lowest node and critical patches of whole nodes, which"
            " makes it about 0.15 % too high at 8 nodes, 0.4 % at 5 and 0.7 % at 4",
        )
        return
    problem.warn_if_coarse(
        rows,
        12.0,
        "where the strength varies within a quarter of it, the local criterion is off by about"
        " 0.8 % (rms) at 8 nodes and 3 % at 4; for smoother strength by far less",
    )


def excess_of(rows: Sample) -> Array:
    """tau_p - tau_i, Pa; `InputError` where the strength is not finite."""
    if not np.isfinite(rows.strength).all():
        raise InputError(
            "strength: the local criterion averages the strength over the nucleation length, so it"
            " must be finite everywhere; where some of it cannot break, give a large finite"
            " strength, or use st.Equilibrium() or st.Rupture()"
        )
    return np.ascontiguousarray(rows.strength - rows.initial_stress)


def uniform_rates(rows: Sample) -> Array:
    """W of each sample, shape (samples,); `InputError` where it varies along the interface."""
    if not rows.uniform_weakening:
        raise InputError(
            "weakening_rate: varies along the interface, so there is no single nucleation length;"
            " the local criterion does not hold, use st.Equilibrium() or st.Rupture()"
        )
    return np.ascontiguousarray(rows.weakening_rate.reshape(rows.samples, -1)[:, 0])
