"""Many onsets: their density, and their quantiles along a sweep."""

from __future__ import annotations

from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from stiction.errors import InputError
from stiction.plot.axes import named, need, on_axes, scaled, shown_quantity
from stiction.plot.style import color, series
from stiction.results import DIRECTION
from stiction.statistics.densities import density
from stiction.statistics.quantiles import quantiles as estimate_quantiles

CURVES = 6
FEWEST = 20
"""Values from which on a density is estimated; fewer are marked one by one."""
LEVELS = (0.05, 0.25, 0.5, 0.75, 0.95)


def monte_carlo(
    result: Any, *, quantity: str | None = None, label: str | None = None, ax: Axes | None = None
) -> Axes:
    """Draw the density of an onset, of one ensemble, several, or along a sweep.

    Parameters
    ----------
    result : Dataset, or list or mapping of Dataset
        From `monte_carlo` or `Study.run`. Several are told apart by their names; of a sweep over
        one parameter up to six steps are drawn.
    quantity : str, optional
        A variable of the result. Left out: `friction_coefficient` where there is a pressure, else
        `critical_stress`. `critical_position` is drawn as a histogram.
    label : str, optional
        Of the curve, for a legend of several calls.
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

    Returns
    -------
    matplotlib.axes.Axes

    Raises
    ------
    InputError
        If a result lacks the quantity, or is swept over several parameters.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> method = st.LocalCriterion()
    >>> found = st.monte_carlo(problem, strength, method=method, samples=100, seed=0)
    >>> st.plot.monte_carlo(found).get_xlabel()
    'critical stress (MPa)'
    """
    results = named(result)
    if not results:
        raise InputError("result: there is none to draw")
    single = isinstance(result, xr.Dataset)
    quantity = shown_quantity(next(iter(results.values())), quantity)
    with on_axes(ax) as axes:
        for number, (name, one) in enumerate(results.items()):
            need(one, quantity)
            variable = one[quantity]
            along = swept(variable)
            if len(along) > 1:
                raise InputError(
                    f"result: is swept over {', '.join(along)}; choose steps of all but one with"
                    f" result.isel({along[0]}=0)"
                )
            if along:
                draw_sweep(axes, variable, along[0])
            else:
                text = label if single else name
                draw_values(axes, variable, text, number + len(axes.lines) * single)
        finish_density(axes, variable)
        if axes.get_legend_handles_labels()[1]:
            axes.legend(title=described(one[along[0]]) if along else None)
    return axes


def draw_sweep(axes: Axes, variable: xr.DataArray, along: str) -> None:
    """A curve for each of at most `CURVES` steps of a sweep."""
    steps = np.unique(np.linspace(0, variable.sizes[along] - 1, CURVES).round().astype(int))
    for number, step in enumerate(steps):
        draw_values(axes, variable.isel({along: step}), step_text(variable[along][step]), number)


def draw_values(axes: Axes, variable: xr.DataArray, label: str | None, number: int) -> None:
    """Density of what is finite of a variable; of positions a histogram, of few values marks."""
    values = finite(variable) * scaled(variable)[0]
    is_place = variable.attrs.get("units") == "m"
    if values.size == 0:
        return
    if is_place:
        cells = int(np.clip(values.size / 50, 5, 40))
        counts, edges = np.histogram(values, cells, density=True)
        axes.stairs(counts, edges, label=label, **series(number))
    elif values.size >= FEWEST and np.ptp(values) > 0.0:
        found = density(values)
        axes.plot(found.x, found.value, label=label, **series(number))
    else:
        zeros = np.zeros_like(values)
        axes.plot(values, zeros, "|", color=color(number), label=label, clip_on=False)


def finish_density(axes: Axes, variable: xr.DataArray, name: str | None = None) -> None:
    """Name the scales of densities."""
    _, unit, text = scaled(variable)
    axes.set_xlabel(f"{name} ({unit})" if name else text)
    axes.set_ylabel(f"density (1/{unit})" if unit else "density")
    axes.set_ylim(bottom=0.0)


def quantiles(
    result: xr.Dataset,
    *,
    quantity: str | None = None,
    along: str | None = None,
    ax: Axes | None = None,
) -> Axes:
    """Draw the median of an onset with its error, and quartiles, along a sweep.

    Parameters
    ----------
    result : Dataset
        From `Study.run` with a sweep, over one parameter or two; the second makes curves.
    quantity : str, optional
        As of `monte_carlo`.
    along : str, optional
        Dimension along the abscissa; the longest if left out.
    ax : matplotlib.axes.Axes, optional
        To draw on; new ones if left out.

    Returns
    -------
    matplotlib.axes.Axes
        Medians with their 95 % confidence intervals; bands between quartiles, and of a single
        curve between the 5 % and 95 % quantiles, paler.

    Raises
    ------
    InputError
        If the result is not swept, or over more than two parameters.
    """
    variable = result[shown_quantity(result, quantity)]
    dims = sorted(swept(variable), key=lambda dim: -variable.sizes[dim])
    if not 1 <= len(dims) <= 2 or (along is not None and along not in dims):
        raise InputError(
            f"result: quantiles are drawn along a sweep over one or two parameters, got"
            f" {', '.join(dims) or 'none'}" + (f" and along={along!r}" if along else "")
        )
    along = along or dims[0]
    within = [dim for dim in dims if dim != along]
    place, ticks = _places(variable[along])
    steps: list[int | None] = [None]
    if within:
        last = variable.sizes[within[0]] - 1
        steps = [int(s) for s in np.unique(np.linspace(0, last, CURVES).round().astype(int))]
    with on_axes(ax, height=3.2) as axes:
        for number, step in enumerate(steps):
            part = variable if step is None else variable.isel({within[0]: step})
            label = None if step is None else step_text(variable[within[0]][step])
            table = _table(part, along)
            if step is None:
                low, high = table[0], table[4]
                axes.fill_between(place, low, high, color=color(0), alpha=0.12, linewidth=0)
            band = 0.25 if step is None else 0.12
            style: dict[str, Any] = {"color": color(number), "alpha": band, "linewidth": 0}
            axes.fill_between(place, table[1], table[3], **style)
            errors = np.abs(table[5:] - table[2])
            axes.errorbar(
                place, table[2], yerr=errors, capsize=2, label=label, **series(number, marker=True)
            )
        axes.set_xlabel(described(variable[along]))
        axes.set_ylabel(scaled(variable)[2])
        if ticks is not None:
            axes.set_xticks(place, ticks)
        elif _is_log(place):
            axes.set_xscale("log")
            if place.size <= 8:  # powers of ten would not name the steps
                axes.set_xticks(place, [f"{value:.3g}" for value in place])
                axes.minorticks_off()
        if within:
            axes.legend(title=described(variable[within[0]]))
    return axes


def swept(variable: xr.DataArray) -> list[str]:
    """Its dimensions other than the sample and the direction of a component."""
    return [str(dim) for dim in variable.dims if dim not in ("sample", DIRECTION)]


def finite(values: Any) -> NDArray[np.float64]:
    """What is finite of an array, flat."""
    array = np.asarray(values, dtype=np.float64).ravel()
    return array[np.isfinite(array)]


def _table(part: xr.DataArray, along: str) -> NDArray[np.float64]:
    """Quantiles at `LEVELS` and the interval of the median, (7, steps), as shown."""
    columns = []
    for step in range(part.sizes[along]):
        values = finite(part.isel({along: step})) * scaled(part)[0]
        if values.size == 0:
            columns.append(np.full(7, np.nan))
            continue
        found = estimate_quantiles(values, LEVELS)
        low = max(found.lower[2], values.min())
        high = min(found.upper[2], values.max())
        columns.append(np.concatenate([found.value, [low, high]]))
    return np.array(columns).T


def _places(coordinate: xr.DataArray) -> tuple[NDArray[np.float64], list[str] | None]:
    """Where on the axis the steps are, and their names if they are no numbers."""
    values = coordinate.values
    if values.dtype.kind in "if" and np.unique(values).size == values.size:
        return values.astype(np.float64) * _unit(coordinate)[0], None
    return np.arange(values.size, dtype=np.float64), [
        step_text(coordinate[i]) for i in range(len(values))
    ]


def _is_log(place: NDArray[np.float64]) -> bool:
    """Whether the steps are more nearly geometric than arithmetic."""
    ordered = np.sort(place)
    if ordered.size < 3 or ordered[0] <= 0.0:
        return False
    linear, log = np.diff(ordered), np.diff(np.log(ordered))
    return bool(np.std(log) / np.mean(log) < np.std(linear) / np.mean(linear))


def _unit(coordinate: xr.DataArray) -> tuple[float, str]:
    """Factor and unit in which a swept quantity is shown."""
    unit = str(coordinate.attrs.get("units", "1"))
    if unit == "m" and np.max(np.abs(coordinate.values)) < 1.0:
        return 1e3, "mm"
    if unit == "Pa" and np.max(np.abs(coordinate.values)) >= 1e4:
        return 1e-6, "MPa"
    return 1.0, unit


def described(coordinate: xr.DataArray) -> str:
    """Name and unit of what is swept."""
    name = str(coordinate.name).replace("_", " ")
    unit = _unit(coordinate)[1]
    return name if unit == "1" else f"{name} ({unit})"


def step_text(step: xr.DataArray) -> str:
    """The value of one step of a sweep."""
    value = step.item()
    if isinstance(value, float):
        return f"{value * _unit(step)[0]:.4g}"
    text = str(value)
    return text if len(text) <= 40 else text[:37] + "..."
