"""Profiles along a line, and maps of a plane: x to the right, nodes at the centres of cells."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from stiction.base.errors import InputError
from stiction.base.model import check
from stiction.base.units import unit_for
from stiction.base.variables import PROFILES, QUANTITIES
from stiction.plot.axes import add_friction_scale, on_axes, with_unit
from stiction.plot.style import INK, PAGE, color, series
from stiction.problem.interface import Interface
from stiction.problem.problem import Problem
from stiction.problem.profiles.reading import is_coefficient
from stiction.random.fields import RandomField

MOST_LINES = 6


def field(
    where: Problem | Interface,
    profile: Any,
    *,
    quantity: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw a profile or a partly measured field: lines along x, on a plane a map.

    Parameters
    ----------
    where : Problem or Interface
    profile : array or RandomField
        Shape (nodes,) or (samples, nodes); the first six samples are drawn. On a plane,
        (nx, ny) or (samples, nx, ny); the first is drawn. For a field, its median, on a
        line its central 90 % band, and the measured values (`RandomField.given`) are drawn.
    quantity : str, optional
        Name of the property, as `RandomInterface` uses it, or 'friction_coefficient'. By default
        'friction_coefficient' of a field of such, or a DataArray in the unit 1, else 'strength'.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on; new ones by default.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If the profile does not fit the interface, or the quantity is unknown.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> st.plot.field(problem, tau_p).get_ylabel()
    'strength (MPa)'
    """
    check("where", where, Problem | Interface)
    interface = where.interface if isinstance(where, Problem) else where
    of_field = isinstance(profile, RandomField)
    if quantity is None:
        pure = profile.of if of_field else is_coefficient(profile)
        quantity = "friction_coefficient" if pure else "strength"
    if quantity not in (known := (*PROFILES, "friction_coefficient")):
        raise InputError(f"quantity: must be one of {', '.join(known)}, got {quantity!r}")
    si = QUANTITIES[quantity].units
    rows = rows_of(interface, profile.quantile(interface, 0.5) if of_field else profile)
    factor, unit = unit_for(si, rows)
    text = with_unit(quantity.replace("_", " "), unit)
    scale, _ = unit_for("m", interface.lengths)
    conditions = profile.conditions if of_field else None
    if interface.is_plane:
        with on_axes(ax, height=map_height(interface)) as axes:
            draw_map(axes, interface, rows[0] * factor, text, cmap="cividis")
            if conditions is not None:
                axes.plot(*(scale * conditions.places), ".", color="w", markersize=2.0)
        return axes
    x = interface.x * scale
    with on_axes(ax, width=PAGE, height=2.4) as axes:
        for number, row in enumerate(rows[:MOST_LINES]):
            style = {"color": INK} if rows.shape[0] == 1 else series(number)
            axes.plot(x, row * factor, linewidth=0.9, label=str(number), **style)
        if of_field:
            low, high = (profile.quantile(interface, share) * factor for share in (0.05, 0.95))
            axes.fill_between(x, low, high, color=INK, alpha=0.15, linewidth=0.0, label="90 %")
        if conditions is not None:
            place, values = scale * conditions.places[0], conditions.values * factor
            axes.plot(place, values, ".", color=color(1), markersize=3.0)
        name_line(axes, interface, text)
        if isinstance(where, Problem) and si == "Pa":
            add_friction_scale(axes, where, "y", factor)
    return axes


def rows_of(interface: Interface, profile: Any) -> NDArray[np.float64]:
    """Return a profile as (samples, *shape); one of another shape is an `InputError`."""
    values = np.asarray(getattr(profile, "values", profile), dtype=np.float64)
    shape = interface.shape
    if values.shape[-len(shape) :] != shape or values.ndim > len(shape) + 1 or values.size == 0:
        wanted = ", ".join(map(str, shape))
        raise InputError(
            f"profile: must have shape ({wanted}) or (samples, {wanted}), got {values.shape}"
        )
    return values.reshape(-1, *shape)


def name_line(axes: Axes, interface: Interface, text: str) -> None:
    """Name the scales of profiles along a line."""
    factor, unit = unit_for("m", interface.lengths)
    axes.set_xlim(0.0, interface.extent * factor)
    axes.set_xlabel(f"position $x$ ({unit})")
    axes.set_ylabel(text)


def draw_map(
    axes: Axes, interface: Interface, values: NDArray[Any], text: str, **options: Any
) -> Any:
    """Draw values (nx, ny) of a plane with their scale and names of the directions."""
    factor, unit = unit_for("m", interface.lengths)
    (x, y), (dx, dy) = interface.lengths, interface.spacings
    ends: Any = factor * np.array([-0.5 * dx, x - 0.5 * dx, -0.5 * dy, y - 0.5 * dy])
    options |= {"origin": "lower", "extent": ends, "interpolation": "nearest"}
    drawn = axes.imshow(values.T, aspect="equal", **options)
    axes.figure.colorbar(
        drawn, ax=axes, label=text, location="bottom", shrink=0.8, pad=0.02, aspect=40
    )
    axes.set_xlabel(f"$x$ ({unit}), direction of slip")
    axes.set_ylabel(f"$y$ ({unit})")
    axes.autoscale(False)  # whatever is drawn beyond it
    return drawn


def map_height(interface: Interface, more: float = 1.0) -> float:
    """Return the height of a figure, inches, with one map and `more` for the rest."""
    x, y = interface.lengths
    return more + 4.0 * float(np.clip(y / x, 0.2, 2.0))
