"""Profiles along an interface, and their moving average over the nucleation length."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from stiction._typing import Array
from stiction.criterion.nucleation import nucleation_stress as local_average
from stiction.errors import InputError
from stiction.interface import Interface
from stiction.plot import maps
from stiction.plot.axes import MEGA, MILLI, add_friction_scale, add_legend, on_axes
from stiction.plot.style import INK, PAGE, QUIET, series
from stiction.problem import Problem
from stiction.sample import PROFILES

MOST_LINES = 6
_SYMBOLS = {
    "strength": r"$\tau_p$",
    "residual_strength": r"$\tau_r$",
    "initial_stress": r"$\tau_i$",
}


def field(
    where: Problem | Interface, profile: Any, *, quantity: str = "strength", ax: Axes | None = None
) -> Axes:
    """Draw a random or measured profile: lines along x, on a plane a map.

    Parameters
    ----------
    where : Problem or Interface
    profile : array
        Of shape (nodes,) or (samples, nodes), of which the first six are drawn; on a plane (nx,
        ny).
    quantity : str
        What it is, 'strength' (Pa) unless said otherwise; a name that `RandomInterface` knows.
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If the profile does not fit the interface, or the quantity is not known.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> st.plot.field(problem, tau_p).get_ylabel()
    'strength $\\\\tau_p$ (MPa)'
    """
    interface = where.interface if isinstance(where, Problem) else where
    if not isinstance(interface, Interface):
        raise InputError(f"where: must be a Problem or an Interface, got {type(where).__name__}")
    factor, text = _shown(quantity)
    if interface.is_plane:
        values = rows_of(interface, profile)[0] * factor
        with on_axes(ax, height=1.0 + 4.0 * maps.relative_height(interface)) as axes:
            bar = maps.image(axes, interface, values, cmap="cividis")
            axes.figure.colorbar(bar, ax=axes, label=text, **maps.BAR)
            maps.label(axes)
        return axes
    rows = rows_of(interface, profile)
    with on_axes(ax, width=PAGE, height=2.4) as axes:
        for number, row in enumerate(rows[:MOST_LINES]):
            style = {"color": INK} if rows.shape[0] == 1 else series(number)
            axes.plot(interface.x * MILLI, row * factor, linewidth=0.9, label=str(number), **style)
        finish_line(axes, interface, text)
        if isinstance(where, Problem) and PROFILES[quantity].units == "Pa":
            add_friction_scale(axes, where, "y")
    return axes


def nucleation_stress(problem: Problem, strength: Any, *, ax: Axes | None = None) -> Axes:
    """Draw the strength, its average over the nucleation length, and where that is least.

    Parameters
    ----------
    problem : Problem
        With one weakening rate.
    strength : array
        tau_p, Pa, of shape (nodes,), on a plane (nx, ny).
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If the strength does not fit the interface or there is no single nucleation length.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> st.plot.nucleation_stress(problem, tau_p).get_ylabel()
    'stress (MPa)'
    """
    interface = problem.interface
    tau_p = rows_of(interface, strength)[0]
    tau_n = local_average(problem, tau_p)
    text = r"nucleation stress $\tau_n$ (MPa)"
    if interface.is_plane:
        with on_axes(ax, height=1.0 + 4.0 * maps.relative_height(interface)) as axes:
            bar = maps.image(axes, interface, tau_n * MEGA, cmap="cividis")
            axes.figure.colorbar(bar, ax=axes, label=text, **maps.BAR)
            i, j = np.unravel_index(int(tau_n.argmin()), tau_n.shape)
            dx, dy = interface.spacings
            axes.plot(
                i * dx * MILLI, j * dy * MILLI, "o", markerfacecolor="white", markeredgecolor=INK
            )
            maps.label(axes)
        return axes
    with on_axes(ax, width=PAGE, height=2.6) as axes:
        x = interface.x * MILLI
        axes.plot(x, tau_p * MEGA, color=QUIET, linewidth=0.8, label=r"strength $\tau_p$")
        axes.plot(x, tau_n * MEGA, label=r"nucleation stress $\tau_n$", **series(0))
        lowest = int(tau_n.argmin())
        axes.plot(
            x[lowest], tau_n[lowest] * MEGA, "o", color=series(2)["color"],
            label=rf"minimum {tau_n[lowest] * MEGA:.4f} MPa",
        )  # fmt: skip
        finish_line(axes, interface, "stress (MPa)")
        add_friction_scale(axes, problem, "y")
        add_legend(axes, ax)
    return axes


def rows_of(interface: Interface, profile: Any) -> Array:
    """A profile as (samples, *shape).

    Raises
    ------
    InputError
        If it does not fit the interface.
    """
    values = np.asarray(getattr(profile, "values", profile), dtype=np.float64)
    shape = interface.shape
    if values.shape[-len(shape) :] != shape or values.ndim > len(shape) + 1 or values.size == 0:
        wanted = ", ".join(map(str, shape))
        raise InputError(
            f"profile: must have shape ({wanted}) or (samples, {wanted}), got {values.shape}"
        )
    return values.reshape(-1, *shape)


def finish_line(axes: Axes, interface: Interface, text: str) -> None:
    """Name the scales of profiles along a line."""
    axes.set_xlim(0.0, interface.extent * MILLI)
    axes.set_xlabel("position $x$ (mm)")
    axes.set_ylabel(text)


def _shown(quantity: str) -> tuple[float, str]:
    if quantity not in PROFILES:
        raise InputError(f"quantity: must be one of {', '.join(PROFILES)}, got {quantity!r}")
    unit = PROFILES[quantity].units
    factor, unit = {"Pa": (MEGA, "MPa"), "m": (1e6, "um")}.get(unit, (1.0, unit))
    name = " ".join(filter(None, (quantity.replace("_", " "), _SYMBOLS.get(quantity))))
    return factor, f"{name} ({unit})" if unit != "1" else name
