"""Figures that check a fit to profiles, and predicted peaks against measured peaks."""

from typing import Any

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray
from scipy import fft

from stiction.base.arrays import Array
from stiction.base.model import checked
from stiction.base.units import unit_for
from stiction.base.variables import QUANTITIES
from stiction.inference.agreement import Agreement
from stiction.inference.fit import FieldFit
from stiction.inference.whittle import Observed, periodograms_of
from stiction.plot.axes import FigureAxes, new_figure, on_axes, with_unit
from stiction.plot.style import ACCENT, INK, PAGE, PALE, QUIET, color, paper_style

SHOWN = 100
"""Number of repetitions, or simulated records, from which a 90 % band
is drawn."""
LAGS = 2.5
"""Number of correlation lengths in the panel of the correlation."""
PER_OCTAVE = 4
"""Number of bands of wavenumbers in an octave."""


@checked
def fit(result: FieldFit) -> NDArray[Any]:
    """Draw a fitted random field with all of its records.

    Parameters
    ----------
    result : FieldFit
        From `stiction.fit_field`.

    Returns
    -------
    (4,) array of matplotlib.axes.Axes
        Panels for all records together: (a) values and the fitted
        marginal, (b) quantiles of the data against quantiles of the
        fit, (c) correlation, with the effect of the window, and (d)
        spectrum. The bands come from records that were simulated from
        the fitted field. In (a) and (b) they contain 90 % of the fits
        to such records. In (c) and (d) they contain the curves of 90 %
        of the simulated sets of records.
    """
    rng = np.random.default_rng(0)
    estimate = result._estimate
    windows = estimate.setting.windows
    observed = periodograms_of(result._rows, windows)
    simulated = [periodograms_of(estimate.simulate(rng), windows) for _ in range(SHOWN)]
    figure = new_figure(PAGE, 5.4)
    with paper_style():
        panels: NDArray[Any] = figure.subplots(2, 2).ravel()
        _histogram(panels[0], result)
        _quantiles(panels[1], result)
        _correlation(panels[2], result, observed, simulated)
        _spectrum(panels[3], result, observed, simulated)
        for letter, axes in zip("abcd", panels, strict=True):
            axes.set_title(f"({letter})", loc="left", weight="bold")
    return panels


def _histogram(axes: Axes, field_fit: FieldFit) -> None:
    values = np.concatenate(field_fit._rows)
    factor, unit = unit_for(QUANTITIES[field_fit.quantity].units, values)
    counts, *_ = axes.hist(values * factor, bins=40, density=True, color=PALE, label="measured")
    at = np.linspace(values.min(), values.max(), 400)
    density, *spread = (
        field.marginal.distribution.pdf(at) / factor
        for field in (field_fit.field, *field_fit.repetitions[:SHOWN])
    )
    _band(axes, at * factor, spread)
    noisy = field_fit._estimate.model.noise > 0.05 * field_fit.parameters["standard_deviation"]
    name = "fitted, without the noise" if noisy else "fitted"
    axes.plot(at * factor, density, color=color(1), label=name)
    # A density that is infinite at a bound
    # must not set the scale of the panel.
    axes.set_ylim(0.0, 1.6 * np.max(counts))
    axes.set_xlabel(with_unit(field_fit.quantity.replace("_", " "), unit))
    axes.set_ylabel(f"density (1/{unit})" if unit else "density")
    axes.legend()


def _quantiles(axes: Axes, field_fit: FieldFit) -> None:
    estimate = field_fit._estimate
    measured, noise = np.concatenate(field_fit._rows), estimate.model.noise
    values = estimate.setting.marginal.quiet(measured, noise)
    factor, unit = unit_for(QUANTITIES[field_fit.quantity].units, values)
    share = (np.arange(200) + 0.5) / 200
    expected, *spread = (
        field.marginal.distribution.ppf(share) * factor
        for field in (field_fit.field, *field_fit.repetitions[:SHOWN])
    )
    _compare(axes, expected, np.quantile(values, share) * factor, expected, spread)
    axes.set_xlabel(with_unit("quantile of the fit", unit))
    axes.set_ylabel(with_unit("quantile of the data", unit))


def _powers(observed: list[Observed]) -> list[Array]:
    """Return the average periodogram of each window.

    >>> _powers([Observed(None, 1, "first", 0.0), Observed(None, 1, "second", 0.0)])
    ['first', 'second']
    """
    return [of_window.average for of_window in observed]


def _pooled_correlation(lag: Array, observed: list[Observed], powers: list[Array]) -> Array:
    """Return the correlation in the windows at lags (m).

    Records are weighted by their size.

    A record counts at lags up to half its length, because a periodic
    record repeats longer lags.

    Without a taper, the power of a wave cos(2 pi 2 m/8) is 16 at both of its
    wavenumbers, and its correlation is the same wave:

    >>> from types import SimpleNamespace
    >>> window = SimpleNamespace(shape=(8,), spacings=(0.5,), measured=np.ones(8, dtype=bool))
    >>> lag, power = np.array([0.0, 0.5, 1.0, 1.25, 2.0, 2.5]), np.array([0.0, 0.0, 16.0, 0.0, 0.0])
    >>> observed = [Observed(window, 3, None, 0.0)]
    >>> with np.errstate(invalid="ignore"):
    ...     _pooled_correlation(lag, observed, [power]).round(9).tolist()  # up to half of 8 points
    [1.0, 0.0, -1.0, -0.5, 1.0, nan]

    A second window of 16 points, each 0.5 m, with white noise, counts by its
    numbers of records and points, and by its variance:

    >>> white = SimpleNamespace(shape=(16,), spacings=(0.5,), measured=np.arange(16) < 12)
    >>> observed.append(Observed(white, 2, None, 0.0))
    >>> found = _pooled_correlation(lag, observed, [power, np.full(9, 8.0)])
    >>> wave = np.array([1.0, 0.0, -1.0, -0.5, 1.0, 0.0])  # variances 4 and 8
    >>> first, second = 3 * 8 * 4.0, 2 * 12 * 8.0
    >>> expected = (first * wave + second * (lag == 0)) / (first * (lag <= 2.0) + second)
    >>> bool(np.allclose(found, expected))
    True
    """
    total, variance = np.zeros(lag.size), np.zeros(lag.size)
    for (window, records, *_), power in zip(observed, powers, strict=True):
        length, spacing = window.shape[0], window.spacings[0]
        covariance = fft.irfftn(power, window.shape).reshape(length, -1)[:, 0]
        reached = lag <= (length // 2) * spacing * (1.0 + 1e-9)
        weight = records * int(window.measured.sum()) * reached
        total += weight * np.interp(lag, np.arange(length) * spacing, covariance)
        variance += weight * covariance[0]
    return total / variance


def _correlation(
    axes: Axes, field_fit: FieldFit, observed: list[Observed], simulated: list[list[Observed]]
) -> None:
    model, windows = field_fit._estimate.model, [of_window.window for of_window in observed]
    spacing = min(window.spacings[0] for window in windows)
    longest = max(window.shape[0] * window.spacings[0] for window in windows)
    most = LAGS * model.spectrum.correlation_length
    count = int(np.clip(round(most / spacing), 12, 0.5 * longest / spacing))
    factor, unit = unit_for("m", count * spacing)
    lag: Any = np.arange(count) * spacing
    measured = _pooled_correlation(lag, observed, _powers(observed))
    fitted = _pooled_correlation(lag, observed, [model.expectation(w) for w in windows])
    spread = [_pooled_correlation(lag, some, _powers(some)) for some in simulated]
    _compare(axes, lag * factor, measured, fitted, spread, "measured", "fitted")
    axes.axhline(0.0, color=QUIET, linewidth=0.6)
    axes.set(xlabel=with_unit("lag along x", unit), ylabel="correlation in the window")
    axes.legend()


def _pooled_spectrum(observed: list[Observed], powers: list[Array]) -> Array:
    """Return band averages (2, bands) of wavenumber (rad/m) and spectral density.

    Wavenumbers 2 and 2.1 (rad/m) lie in the same quarter of an octave, and 2.3
    in the next. Records weight a band. The density is the power times the
    spacing:

    >>> from types import SimpleNamespace
    >>> def window(k, spacing):
    ...     k = np.array(k)
    ...     return SimpleNamespace(weights=1.0 * (k > 0.0), wave_vectors=(k,), spacings=(spacing,))
    >>> first, second = window([0.0, 1.0, 2.0], 0.5), window([0.0, 2.1, 2.3], 0.25)
    >>> observed = [Observed(first, 3, None, 0.0), Observed(second, 1, None, 0.0)]
    >>> powers = [np.array([99.0, 8.0, 4.0]), np.array([99.0, 4.0, 2.0])]
    >>> k, density = _pooled_spectrum(observed, powers)
    >>> k.round(9).tolist(), density.round(9).tolist()  # (3 x 2 + 2.1)/4, (3 x 2 + 1)/4
    ([1.0, 2.025, 2.3], [4.0, 1.75, 0.5])

    On a plane the length of the wave vector counts:

    >>> plane = SimpleNamespace(weights=np.ones((2, 1)), spacings=(0.5, 2.0),
    ...                         wave_vectors=(np.array([[3.0], [6.0]]), np.array([[4.0]])))
    >>> k, density = _pooled_spectrum([Observed(plane, 1, None, 0.0)], [np.array([[3.0], [7.0]])])
    >>> k.round(4).tolist(), density.tolist()
    ([5.0, 7.2111], [3.0, 7.0])
    """
    rows: list[tuple[Array, Array, Array]] = []
    for (window, records, *_), power in zip(observed, powers, strict=True):
        kept = window.weights > 0.0
        squares: Any = sum(vector**2 for vector in window.wave_vectors)
        k = np.broadcast_to(np.sqrt(squares), kept.shape)[kept]
        density = power[kept] * np.prod(window.spacings)
        rows.append((k, density, np.full(k.size, records)))
    k, density, counts = (np.concatenate(column) for column in zip(*rows, strict=True))
    octaves = np.round(PER_OCTAVE * np.log2(k / k.min()))
    band = np.unique(octaves, return_inverse=True)[1]
    sums = [np.bincount(band, weights=counts * values) for values in (k, density)]
    return np.array(sums) / np.bincount(band, weights=counts)


def _spectrum(
    axes: Axes, field_fit: FieldFit, observed: list[Observed], simulated: list[list[Observed]]
) -> None:
    values = np.concatenate(field_fit._rows)
    scale, unit = unit_for(QUANTITIES[field_fit.quantity].units, values)
    model, windows = field_fit._estimate.model, [of_window.window for of_window in observed]
    k, measured = _pooled_spectrum(observed, _powers(observed))
    fitted = _pooled_spectrum(observed, [model.expectation(w) for w in windows])[1]
    spread = [scale**2 * _pooled_spectrum(some, _powers(some))[1] for some in simulated]
    labels = "measured, averaged", "fitted, with the window"
    _compare(axes, k, scale**2 * measured, scale**2 * fitted, spread, *labels)
    cell = float(np.prod(windows[0].spacings))
    if model.noise**2 > 1e-6 * fitted.max() / cell:
        level = cell * scale**2 * model.noise**2
        axes.axhline(level, label="noise", color=ACCENT, linewidth=0.8, linestyle="--")
    axes.set(xscale="log", yscale="log")
    axes.set_ylim(bottom=0.1 * scale**2 * min(measured.min(), fitted.min()))
    dimension = "m" if len(windows[0].shape) == 1 else "m²"
    axes.set_xlabel("wavenumber (rad/m)")
    axes.set_ylabel(f"spectral density ({f'{unit}² ' if unit else ''}{dimension})")
    axes.legend(loc="lower left")  # spectra fall to the right


def _compare(
    axes: Axes, at: Any, measured: Any, fitted: Any, spread: Any, *labels: str
) -> None:
    """Draw data as points, the fit as a line, and a band with 90 % of the repetitions.

    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> rows = np.outer(np.arange(101.0), [1.0, 2.0])
    >>> _compare(axes, [5.0, 6.0], [1.0, 2.0], [3.0, 4.0], rows, "measured", "fitted")
    >>> for line in axes.lines:
    ...     print(line.get_label(), line.get_ydata().tolist(), line.get_linestyle())
    fitted [3.0, 4.0] -
    measured [1.0, 2.0] None
    """
    of_data, of_fit = labels or (None, None)
    _band(axes, at, spread)
    axes.plot(at, fitted, color=color(1), label=of_fit)
    axes.plot(at, measured, ".", color=INK, markersize=3, label=of_data)


def _band(axes: Axes, at: Any, rows: Any) -> None:
    """Fill between the 5 % and 95 % quantiles of rows. A row of NaN does not count.

    >>> axes = new_figure(3.0, 2.0).subplots()
    >>> rows = np.append(np.outer(np.arange(101.0), [1.0, 2.0]), [[np.nan, np.nan]], axis=0)
    >>> _band(axes, [5.0, 6.0], rows)
    >>> (path,) = axes.collections[0].get_paths()
    >>> sorted({(float(x), round(float(y), 6)) for x, y in path.vertices})
    [(5.0, 5.0), (5.0, 95.0), (6.0, 10.0), (6.0, 190.0)]
    """
    low, high = np.nanquantile(rows, [0.05, 0.95], axis=0)
    axes.fill_between(at, low, high, color=color(1), alpha=0.25, linewidth=0.0)


@checked
def agreement(result: Agreement, *, ax: Axes | None = None) -> FigureAxes:
    """Draw measured peaks as steps on the predicted distribution.

    Parameters
    ----------
    result : Agreement
        From `stiction.statistics.agreement`.
    ax : matplotlib.axes.Axes, optional
        Axes to draw on. By default new axes are made.

    Returns
    -------
    matplotlib.axes.Axes
        If the prediction is right, the steps lie completely in the
        shaded band for 90 % of campaigns with as many tests. Each
        specimen length has a colour.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=0.5)
    >>> predicted = st.monte_carlo(
    ...     problem, strength, method=st.LocalCriterion(), samples=200, seed=0
    ... )
    >>> found = st.statistics.agreement(predicted, [0.695, 0.702, 0.731, 0.688], unit="MPa")
    >>> st.plot.agreement(found).get_xlabel()
    'peak (MPa)'
    """
    peaks = result.peaks
    factor, unit = unit_for(peaks.unit, np.concatenate(peaks.values))
    ends: list[float] = []
    with on_axes(ax) as axes:
        for number, (length, values, (at, share)) in enumerate(
            zip(peaks.lengths, peaks.values, result.predicted, strict=True)
        ):
            of = "" if length is None else f", {length:g} m"
            paint = color(number + 1)
            away = result.band / np.sqrt(values.size)
            band = (np.clip(share + sign * away, 0.0, 1.0) for sign in (-1.0, 1.0))
            name = f"90 % of {values.size} tests each{of}"
            x, style = at * factor, {"color": paint, "alpha": 0.2, "linewidth": 0.0}
            axes.fill_between(x, *band, label=name, **style)
            axes.plot(x, share, color=paint, label=f"predicted{of}")
            seen = at[np.searchsorted(share, [0.001, 0.999]).clip(max=at.size - 1)]
            low, high = min(seen[0], values.min()), max(seen[1], values.max())
            margin = 0.05 * (high - low)
            ends += [(low - margin) * factor, (high + margin) * factor]
            steps = np.concatenate(([low - margin], np.sort(values), [high + margin])) * factor
            shares = np.minimum(np.arange(steps.size) / values.size, 1.0)
            style = {"color": INK if number == 0 else paint, "where": "post"}
            axes.step(steps, shares, label=f"{values.size} tests{of}", **style)
        axes.set(xlim=(min(ends), max(ends)), ylim=(0.0, 1.02))
        name = "coefficient of friction" if peaks.unit == "1" else "peak"
        axes.set(xlabel=with_unit(name, unit), ylabel="fraction of tests up to it")
        axes.legend()
        p = result.p_values["cramer_von_mises"]
        axes.set_title(f"p = {p:.2g}", fontsize=8, loc="left", color=QUIET)
    return axes
