"""Figures of many onsets: density, quantiles along a sweep, and the tail over decades."""

from contextlib import suppress
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from numpy.typing import NDArray

from stiction.base.errors import InputError
from stiction.base.model import checked
from stiction.base.units import unit_for
from stiction.base.variables import DIRECTION
from stiction.inference.peaks import make_peaks
from stiction.plot.axes import (
    FigureAxes,
    add_friction_scale,
    add_scale,
    named,
    need,
    on_axes,
    problem_of,
    scaled,
    shown_quantity,
    with_unit,
)
from stiction.plot.style import BAND, INK, MARKERS, PALE, QUIET, color, series
from stiction.reliability.answer import Answer
from stiction.statistics import density
from stiction.statistics import quantiles as estimate_quantiles

MAX_CURVES = 6
FEWEST = 20
"""Fewest values for a density. Fewer values are marked separately."""
DRAWN_QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
TINY = 1e-300
"""Probability in place of zero on a logarithmic scale."""


def monte_carlo(
    result: Any, *, quantity: str | None = None, measured: Any = None, ax: Axes | None = None
) -> FigureAxes:
    """Draw the density of the onset, in one or more ensembles or along a sweep.

    Parameters
    ----------
    result : Dataset, or list or mapping of Dataset
        From `monte_carlo` or `Study.run`. Give several results as a
        list, or by name. Up to six steps of a sweep over a single
        parameter are drawn.
    quantity : str, optional
        A variable of the result. The default is `critical_force` if the
        area of a line or specimen is known, else `friction_coefficient`
        if there is a pressure, else `critical_stress`.
        `critical_position` is drawn as a histogram.
    measured : Peaks, Curves or array, optional
        Peaks from tests, in SI or with a unit, which are marked separately.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on. By default new axes are made.

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
    quantity = shown_quantity(next(iter(results.values())), quantity)
    curves: list[tuple[str | None, xr.DataArray]] = []
    along: list[str] = []
    for name, dataset in results.items():
        need(dataset, quantity)
        along = _swept(dataset[quantity])
        if len(along) > 1:
            raise InputError(
                f"result: is swept over {', '.join(along)}, but a plot shows one axis. Choose a"
                f" step of every axis but the last, for example with result.isel({along[0]}=0)"
            )
        curves += _steps(dataset[quantity], along[0]) if along else [(name, dataset[quantity])]
    single = isinstance(result, xr.Dataset) and not along
    peaks = None if measured is None else _peaks_of(measured, quantity, curves[0][1])
    factor, unit, text = scaled(*(variable for _, variable in curves))
    with on_axes(ax) as axes:
        for number, (label, variable) in enumerate(curves, len(axes.lines) * single):
            _draw_values(axes, variable, factor, None if single else label, number)
        if peaks is not None:
            style: Any = {"linestyle": "none", "marker": "|", "markersize": 14.0, "color": INK}
            label = f"{peaks.size} tests"
            axes.plot(peaks * factor, np.zeros(peaks.size), label=label, clip_on=False, **style)
        axes.set(xlabel=text, ylabel=f"density (1/{unit})" if unit else "density")
        axes.set_ylim(bottom=0.0)
        if axes.get_legend_handles_labels()[1]:
            axes.legend(title=scaled(dataset[along[0]])[2] if along else None)
    return axes


def _peaks_of(measured: Any, quantity: str, variable: xr.DataArray) -> NDArray[np.float64]:
    """Return measured peaks in SI, for the quantity that is drawn.

    >>> stress = xr.DataArray(1.0, attrs={"units": "Pa"})
    >>> _peaks_of({0.1: [3.0, 4.0], 0.2: [5.0]}, "critical_stress", stress).tolist()
    [3.0, 4.0, 5.0]
    >>> _peaks_of(make_peaks([3.0, 4.0, 5.0], "kN"), "critical_stress", stress)
    ... # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: measured: peaks are in N, but critical_stress in Pa. ...
    """
    peaks = make_peaks(measured, str(variable.attrs.get("units", "1")))
    if peaks.unit != variable.attrs.get("units", "1"):
        raise InputError(
            f"measured: peaks are in {peaks.unit}, but {quantity} in {variable.attrs.get('units')}."
            f" Pass quantity={peaks.variable!r}"
        )
    return np.concatenate(peaks.values)


def _draw_values(
    axes: Axes, variable: xr.DataArray, factor: float, label: str | None, number: int
) -> None:
    """Draw the density of a variable, a histogram of positions, or marks of a few values.

    Twenty different values have a density, and fewer are marked. Positions are
    counted in at least 5 cells, and values that are not finite are left out:

    >>> from stiction.plot.axes import new_figure
    >>> def drawn(values, units="Pa"):
    ...     axes = new_figure(3.0, 2.0).subplots()
    ...     variable = xr.DataArray(values, attrs={"units": units})
    ...     _draw_values(axes, variable, 2.0, "name", 1)
    ...     return axes
    >>> (line,) = drawn(np.arange(20.0)).lines
    >>> line.get_marker(), line.get_label(), line.get_color() == color(1)
    ('None', 'name', True)
    >>> peak = line.get_xdata()[line.get_ydata().argmax()]
    >>> bool(15.0 < peak < 23.0)  # twice 9.5
    True
    >>> for values in (np.arange(19.0), np.full(20, 3.0)):
    ...     (line,) = drawn([*values, np.nan]).lines
    ...     print(line.get_marker(), line.get_xdata()[-1], line.get_ydata().max())
    | 36.0 0.0
    | 6.0 0.0
    >>> (stairs,) = drawn(np.arange(500.0) / 499.0, "m").patches  # 10 cells up to 2
    >>> values, edges, _ = stairs.get_data()
    >>> values.size, edges[[0, -1]].tolist(), round(float(values @ np.diff(edges)), 9)
    (10, [0.0, 2.0], 1.0)
    >>> drawn(np.arange(60.0), "m").patches[0].get_data().values.size
    5
    """
    values, style = _finite(variable) * factor, {"label": label} | series(number)
    if variable.attrs.get("units") == "m" and values.size:
        cells = int(np.clip(values.size / 50, 5, 40))
        axes.stairs(*np.histogram(values, cells, density=True), **style)
    elif values.size >= FEWEST and np.ptp(values) > 0.0:
        estimate = density(values)
        axes.plot(estimate.x, estimate.value, **style)
    else:
        style |= {"linestyle": "none", "marker": "|", "clip_on": False}
        axes.plot(values, np.zeros_like(values), **style)


def quantiles(
    result: xr.Dataset, *, quantity: str | None = None, ax: Axes | None = None
) -> FigureAxes:
    """Draw the median onset with its error, and the quartiles, along a sweep.

    Parameters
    ----------
    result : Dataset
        From `Study.run` with a sweep over one or two parameters. The
        longer sweep is the abscissa. With two parameters, there is a
        curve for each value of the other. `xarray.concat` joins several
        results along a new dimension.
    quantity : str, optional
        As in `monte_carlo`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on. By default new axes are made.

    Returns
    -------
    matplotlib.axes.Axes
        Medians with their 90 % confidence intervals, and bands between
        quartiles. A single curve also has a paler band between the 5 %
        and 95 % quantiles.

    Raises
    ------
    InputError
        If the result has no sweep, or a sweep over more than two
        parameters.
    """
    need(result)
    variable = result[shown_quantity(result, quantity)]
    dims = sorted(_swept(variable), key=lambda dim: -variable.sizes[dim])
    if not 1 <= len(dims) <= 2:
        raise InputError(
            "result: quantiles need a sweep over one or two parameters, got"
            f" {', '.join(dims) or 'no sweep'}"
        )
    along, *others = dims
    curves = _steps(variable, others[0]) if others else [(None, variable)]
    factor, _, text = scaled(variable)
    scale, _, name = scaled(variable[along])
    place = variable[along].values
    by_name = place.dtype.kind not in "if" or np.unique(place).size < place.size
    place = np.arange(1.0 * place.size) if by_name else place * scale
    with on_axes(ax, height=3.2) as axes:
        for number, (label, part) in enumerate(curves):
            values, errors = _quantiles(part, factor, along)
            band: dict[str, Any] = {"color": color(number), "linewidth": 0}
            if not others:
                axes.fill_between(place, values[0], values[4], alpha=0.12, **band)
            alpha = 0.12 if others else 0.25
            axes.fill_between(place, values[1], values[3], alpha=alpha, **band)
            style = {"capsize": 2, "marker": MARKERS[number % len(MARKERS)], **series(number)}
            axes.errorbar(place, values[2], yerr=errors, label=label, **style)
        axes.set(xlabel=name, ylabel=text)
        if not by_name and place.min() > 0.0 and place.max() >= 4.0 * place.min():
            axes.set_xscale("log")
        if by_name or place.size <= 8:  # powers of ten would not name the steps
            axes.set_xticks(place, _step_texts(variable[along]))
            axes.minorticks_off()
        if others:
            axes.legend(title=scaled(variable[others[0]])[2])
    return axes


def _swept(variable: xr.DataArray) -> list[str]:
    """Return the dimensions of a sweep.

    >>> _swept(xr.DataArray(np.zeros((2, 3, 4, 5)), dims=("seed", "sample", "mode", DIRECTION)))
    ['seed', 'mode']
    """
    return [str(dim) for dim in variable.dims if dim not in ("sample", DIRECTION)]


def _steps(variable: xr.DataArray, along: str) -> list[tuple[str | None, xr.DataArray]]:
    """Return at most `MAX_CURVES` evenly spread steps of a sweep, each with its name.

    >>> values = xr.DataArray(np.zeros((3, 20)), {"L": np.arange(20.0)}, ("sample", "L"))
    >>> values["L"].attrs["units"] = "1"
    >>> [name for name, _ in _steps(values, "L")]
    ['0', '4', '8', '11', '15', '19']
    >>> [(name, part.shape) for name, part in _steps(values[:, 5:7], "L")]
    [('5', (3,)), ('6', (3,))]
    """
    last, names = variable.sizes[along] - 1, _step_texts(variable[along])
    steps = np.unique(np.linspace(0, last, min(MAX_CURVES, last + 1)).round().astype(int))
    return [(names[step], variable.isel({along: step})) for step in steps]


def _quantiles(
    part: xr.DataArray, factor: float, along: str
) -> tuple[NDArray[Any], NDArray[Any]]:
    """Return quantiles (levels, steps) and errors of the median (2, steps), as drawn.

    Seven values in thousands. The quartile has the rank 0.25 (7 + 1/3) + 1/3,
    2.17. The interval of the median, 4, cannot leave the values 1 to 9. The
    second step has no finite values:

    >>> values = np.full((2, 7), np.nan)
    >>> values[0] = [4e3, 1e3, 2e3, 9e3, 3e3, 5e3, 6e3]
    >>> levels, errors = _quantiles(xr.DataArray(values, dims=("L", "sample")), 1e-3, "L")
    >>> levels[1:4, 0].round(6).tolist(), bool(np.isnan(levels[:, 1]).all())
    ([2.166667, 4.0, 5.833333], True)
    >>> errors[:, 0].round(6).tolist()
    [3.0, 5.0]
    """
    values_at = np.full((len(DRAWN_QUANTILES), part.sizes[along]), np.nan)
    errors = values_at[:2].copy()
    for step in range(part.sizes[along]):
        values = _finite(part.isel({along: step})) * factor
        if values.size:
            estimate = estimate_quantiles(values, DRAWN_QUANTILES)
            values_at[:, step] = estimate.value
            ends = np.clip([estimate.lower[2], estimate.upper[2]], values.min(), values.max())
            errors[:, step] = np.abs(ends - estimate.value[2])
    return values_at, errors


def _finite(values: Any) -> NDArray[np.float64]:
    """Return the finite values as a flat array.

    >>> _finite(xr.DataArray([[1.0, np.nan], [np.inf, 2.0]])).tolist()
    [1.0, 2.0]
    """
    array = np.asarray(values, dtype=np.float64).ravel()
    return array[np.isfinite(array)]


def _step_texts(coordinate: xr.DataArray) -> list[str]:
    """Return the values at the steps of a sweep, in the unit of its name.

    >>> lengths = xr.DataArray([0.00123456, 0.05], name="length", attrs={"units": "m"})
    >>> _step_texts(lengths), _step_texts(xr.DataArray([3, 40]))
    (['1.235', '50'], ['3', '40'])
    >>> texts = _step_texts(xr.DataArray(["a" * 40, "b" * 41]))
    >>> texts[0] == "a" * 40, texts[1] == "b" * 37 + "..."
    (True, True)
    """
    if coordinate.dtype.kind == "f":
        return [f"{value:.4g}" for value in coordinate.values * scaled(coordinate)[0]]
    texts = map(str, coordinate.values)
    return [text if len(text) <= 40 else text[:37] + "..." for text in texts]


@checked
def failure_curve(curve: xr.Dataset, *, ax: Axes | None = None) -> FigureAxes:
    """Draw P(onset < s) over decades, with its interval.

    Parameters
    ----------
    curve : Dataset
        From `stiction.failure_curve`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on. By default new axes are made.

    Returns
    -------
    matplotlib.axes.Axes
        The scale at the top shows forces if the interface area
        is known, or else friction coefficients if there is a normal
        pressure. A dotted line marks the lower bound of the strength.
        For equally likely interfaces, the curve is their mean, and a
        wider band contains 90 % of them.

    Raises
    ------
    InputError
        If the dataset is not a failure curve.
    """
    need(curve, "stress", "probability", "probability_low", "probability_high")
    curve = curve.isel(point=np.isfinite(curve["stress"].values))
    bound, chance = float(curve.attrs["lower_bound"]), curve["probability"].values
    factor, unit = unit_for("Pa", curve["stress"].values)
    x = curve["stress"].values * factor
    with on_axes(ax) as axes:
        if 0.0 < bound < np.inf:
            axes.axvline(bound * factor, color=QUIET, linewidth=0.7, linestyle=":")
        text = "subset simulation, 90 % interval"
        if "members" in curve:
            ends = (np.maximum(curve[name].values, TINY) for name in ("band_low", "band_high"))
            label = f"90 % of {curve.sizes['member']} equally likely interfaces"
            axes.fill_between(x, *ends, color=BAND, linewidth=0.0, label=label)
            text = "their mean, 90 % interval"
        low, high = curve["probability_low"].values, curve["probability_high"].values
        axes.fill_between(x, low, high, color=PALE, linewidth=0.0)
        axes.plot(x, chance, "o-", color=INK, markersize=2.5, linewidth=0.9, label=text)
        axes.set_yscale("log")
        axes.set_ylim(0.5 * float(chance.min()), 1.0)
        axes.set(xlabel=f"stress $s$ ({unit})", ylabel=r"$P(\tau_{\mathrm{cr}} < s)$")
        if "force" in curve:
            scale, name = unit_for("N", curve["force"].values)
            ratio = scale * float(curve["force"][0]) / x[0]
            add_scale(axes, "x", ratio, with_unit("shear force", name))
        else:
            with suppress(InputError):  # a problem that exists in Python only: stresses alone
                add_friction_scale(axes, problem_of(curve), "x", factor)
        axes.legend(loc="lower right")
    return axes


@checked
def sensitivities(design: Answer, *, ax: Axes | None = None) -> FigureAxes:
    """Draw the sensitivities of a design, with the largest at the top.

    Parameters
    ----------
    design : Answer
        From `stiction.design_stress`, with `sensitivities`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on. By default new axes are made.

    Returns
    -------
    matplotlib.axes.Axes
        Each bar connects the designs at both ends of a range, and a dot
        marks the design at the second end. The line is the design, and
        the band is its interval.

    Raises
    ------
    InputError
        If the answer has no `sensitivities`.
    """
    table = design.sensitivities
    if not table.sizes.get("source"):
        raise InputError("design: has no sensitivities. Compute it with sensitivities=True")
    quantity = "force" if np.isfinite(design.area) else "stress"
    ends = np.stack([table[f"{quantity}_at_low"].values, table[f"{quantity}_at_high"].values])
    factor, unit = unit_for("N" if quantity == "force" else "Pa", ends.ravel())
    place = np.arange(ends.shape[1])[::-1]
    with on_axes(ax) as axes:
        first, last = (end * factor for end in design.interval[quantity])
        axes.axvspan(first, last, color=BAND, linewidth=0.0)
        axes.axvline(getattr(design, quantity) * factor, color=INK, linewidth=0.8)
        low, high = np.sort(ends, axis=0) * factor
        axes.barh(place, high - low, left=low, height=0.5, color=color(1))
        axes.plot(ends[1] * factor, place, "o", color=INK, markersize=3)
        names = [str(name).removeprefix("problem.") for name in table.source.values]
        pairs = zip(names, table.low.values, table.high.values, strict=True)
        axes.set_yticks(place, [f"{name}: {low} to {high}" for name, low, high in pairs])
        axes.set_xlabel(with_unit(f"design {quantity}", unit))
    return axes
