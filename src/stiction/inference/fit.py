"""A random field from measured profiles: the public function and its checks."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo
from scipy.stats import t as student

from stiction.arrays import Array
from stiction.ensemble.batches import usable_cores
from stiction.errors import InputError, unknown_name, warn_accuracy
from stiction.inference.between import scatter_between, variances_within
from stiction.inference.bootstrap import Repetitions, at_ends, intervals, repeat
from stiction.inference.estimate import Estimate, Setting, estimate, observe
from stiction.inference.field_fit import Details, Doubt, FieldFit, Goodness
from stiction.inference.marginal_fit import Family, family_of, mean_log_likelihood
from stiction.inference.records import Record, records_of
from stiction.inference.spectrum_fit import back, spectrum_family
from stiction.inference.whittle import Observed
from stiction.inference.window import Window, make_window
from stiction.interface import Interface
from stiction.model import Flag, Progress, Real, at_least, checked, is_finite
from stiction.profiles import UNITS
from stiction.progress import Meter

MARGINALS = ("lognormal", "weibull", "gamma", "beta")
ENOUGH_LENGTHS = 10.0
"""Correlation lengths below which a record says little of any parameter."""
FAR = 0.01
"""p-value below which a family does not suit."""
AT_LIMIT = 1e-3
FEWEST = 20
"""Repetitions that determine a tail of errors."""


def _known_or_estimated(value: Any, info: ValidationInfo) -> bool | float:
    """A number, or whether it is estimated."""
    least = 0.0 if info.field_name == "noise" else 1e-300
    if not (isinstance(value, bool) or (is_finite(value) and value >= least)):
        number = "number >= 0" if info.field_name == "noise" else "positive number"
        raise ValueError(f"must be True, False or a {number}")
    return value if isinstance(value, bool) else float(value)


KnownOrEstimated = Annotated[bool | float, BeforeValidator(_known_or_estimated)]
Share = Annotated[Real, Field(gt=0.0, lt=1.0)]


@checked
def fit_field(
    profiles: Any,
    interface: Interface | None = None,
    *,
    marginal: Any = MARGINALS,
    spectrum: Any = "power_law",
    detrend: Literal[0, 1, 2, 3] = 0,
    noise: KnownOrEstimated = True,
    anisotropy: KnownOrEstimated = False,
    between: Flag = False,
    quantity: str = "strength",
    bootstrap: at_least(FEWEST) = 200,  # type: ignore[valid-type]
    confidence: Share = 0.9,
    seed: at_least(0) = 0,  # type: ignore[valid-type]
    workers: at_least(1) | None = None,  # type: ignore[valid-type]
    progress: Progress = True,
) -> FieldFit:
    """Fit a random field to measured profiles, with an interval of every parameter.

    Parameters
    ----------
    profiles : DataArray, array, or list of them
        Lines over 'x' or maps over 'x' and 'y' (m), such as `stiction.read_profile` returns, with
        equally spaced points. Missing values (NaN, missing points, values that were filled in) are
        left out. Plain arrays, of shape (nodes,) or (samples, nodes), on a plane (nx, ny) or
        (samples, nx, ny), in SI, have a value at each node of `interface`. Several profiles, also
        of different length, are of one field.
    interface : Interface, optional
        Needed for arrays without coordinates. A warning says if it is too short, or its nodes too
        coarse, for the fitted field.
    marginal : str, dict or sequence of str
        Family: 'beta', 'lognormal', 'weibull', 'gamma', 'truncated_normal', 'normal' or any
        continuous distribution of `scipy.stats`. Of several the best is taken, and `families` in
        the result compares them. A table keeps parameters: ``{"type": "beta", "low": 0,
        "high": 2e6}``. Both bounds of 'beta' are estimated unless they are given; the lower bound
        of the others is 0 unless it is given.
    spectrum : str or dict
        'power_law', 'squared_exponential' or 'exponential'; a table keeps parameters, such as
        ``{"type": "power_law", "exponent": 4.0}`` or ``"power_kept": 0.999``.
    detrend : int
        Degree of the polynomial trend that is taken off, 0 to 3. The mean stays in any case.
    noise : bool or float
        Whether measurement noise, white and normal, is estimated along with the field; or its
        standard deviation, where it is known (SI).
    anisotropy : bool or float
        Of maps: ratio of correlation lengths along y and x. False: 1; True: estimated.
    between : bool
        Whether records are of different specimens, each with a factor of its own: the coefficient
        of variation ``between`` of this factor is estimated, for `RandomInterface`.
    quantity : str
        What was measured, for its unit: 'strength', 'normal_pressure', 'friction_coefficient',
        ... A field of friction coefficients says so itself.
    bootstrap : int
        Repetitions, at least 20: as many from the fitted field, and from fields with correlation
        lengths at either end of a first interval of it.
    confidence : float
        Of the intervals.
    seed : int
        Of the repetitions, not negative.
    workers : int, optional
        Threads; all cores by default. The numbers do not depend on it.
    progress : bool or callable
        As in `stiction.monte_carlo`.

    Returns
    -------
    FieldFit
        With `field`, `parameters` and `interval`; `stiction.plot.fit` draws it.

    Raises
    ------
    InputError
        Naming all that does not fit: unknown units, points that repeat or are not equally spaced,
        constant or short records, values outside the bounds of the marginal.

    Warns
    -----
    AccuracyWarning
        If the records hold fewer than ten correlation lengths, the p-value of the marginal or of
        the spectrum is below 1 %, the noise hides the cut-off of the spectrum, a parameter lies at
        the end of the range that is searched, or values are outliers.

    Notes
    -----
    The marginal is found by maximum likelihood, of values and noise together. The spectrum comes
    from a Whittle likelihood whose expectation is exact for the window: taper, gaps, the removal of
    the trend and aliasing are in it, as is a truncation of the spectrum if one is given (Sykulski
    et al., 2019; Guillaumin et al., 2022). Correlations of values follow from those of the Gaussian
    field z by Hermite expansion (Grigoriu, 1995).

    A likelihood's own curvature understates the error. The intervals come from a studentised
    bootstrap (Davison and Hinkley, 1997, section 5.2), and their upper and lower ends from fields
    of longer and shorter correlation (Carpenter, 1999), which matters for short records. An
    interval of the noise may begin at zero, one of a bound of the marginal ends outside the values,
    and those of an exponent and of an anisotropy end at the ranges that are searched, 0.65 to 16
    and 0.05 to 20.

    Examples
    --------
    >>> import stiction as st
    >>> truth = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3))
    >>> interface = st.Interface(length=0.1, nodes=1000)
    >>> fit = st.fit_field(truth.sample(interface, seed=2), interface, marginal="lognormal",
    ...                    spectrum="exponential", noise=0.0, bootstrap=40)
    >>> low, high = fit.interval["spectrum.correlation_length"]
    >>> bool(low < 1e-3 < high)
    True
    """
    families, spectral = _families(marginal, spectrum, anisotropy, noise)
    if quantity not in UNITS:
        raise InputError(unknown_name("quantity", quantity, UNITS))
    records = records_of(profiles, interface, quantity)
    if anisotropy is not False and records[0].values.ndim == 1:
        raise InputError("anisotropy: is of maps; the profiles are lines, leave it out")
    spacing = max(max(record.spacings) for record in records)
    longest = max(max(np.multiply(one.values.shape, one.spacings)) for one in records)
    spectral = replace(spectral, lengths=(spacing, 2.0 * float(longest)))
    windows = _windows(records, detrend)
    rows = [
        window.without_trend(record.values[record.measured])
        for window, record in zip(windows, records, strict=True)
    ]
    levels = np.array([row.mean() for row in rows])
    if between and (len(rows) < 2 or levels.min() <= 0.0):
        raise InputError(
            f"between: needs several records of positive mean, got {len(rows)} with means from"
            f" {levels.min():g} to {levels.max():g}"
        )
    if between:
        rows = [row * levels.mean() / level for row, level in zip(rows, levels, strict=True)]
    options = (bootstrap, seed, usable_cores() if workers is None else workers)
    fields = 3 if "correlation_length" in spectral.free else 1
    with Meter("fit_field", fields * bootstrap, progress) as meter:
        settings = [Setting(windows, family, spectral) for family in families]
        found, setting, compared = _best(settings, rows)
        repeated = [repeat(found, setting, *options, meter)]
        if fields == 3 and len(repeated[0].fits) >= FEWEST:
            for field in at_ends(repeated[0], setting, confidence):
                repeated.append(repeat(field, setting, *options, meter))
    done, asked = sum(len(one.fits) for one in repeated), fields * bootstrap
    if min(len(one.fits) for one in repeated) < FEWEST:
        raise InputError(
            f"marginal: {setting.marginal.name!r} could be fitted to only {done} of {asked}"
            " repetitions; take another marginal"
        )
    fit = _result(repeated, setting, compared, records, rows, confidence, quantity)
    if between:
        fit = _with_between(fit, levels, windows)
    if done < asked:
        fit = replace(fit, doubts=(*fit.doubts, Doubt("repetitions", done, asked)))
    for doubt in fit.doubts:
        warn_accuracy(str(doubt))
    if interface is not None:
        fit.field.modes(interface)
        fit.field.warn_if_inaccurate(interface)
    return fit


def _with_between(fit: FieldFit, levels: Array, windows: Sequence[Window]) -> FieldFit:
    """Add the scatter between records, and what it adds to the interval of the mean."""
    within = variances_within(fit.field, windows)
    cv, interval, error = scatter_between(np.log(levels), within, fit.confidence)
    width = float(student.ppf(0.5 + 0.5 * fit.confidence, levels.size - 1)) * error
    parameters = {**fit.parameters, "between": cv}
    ends = {
        name: (parameters[name] * math.exp(-width), parameters[name] * math.exp(width))
        for name in ("mean", "marginal.mean")
        if name in fit.interval
    }
    return replace(
        fit, parameters=parameters, interval={**fit.interval, **ends, "between": interval}
    )


def _result(
    repeated: Sequence[Repetitions],
    setting: Setting,
    compared: dict[str, Goodness],
    records: Sequence[Record],
    rows: Sequence[Array],
    confidence: float,
    quantity: str,
) -> FieldFit:
    found, fits = repeated[0]
    values, observed = np.concatenate(rows), tuple(observe(rows, setting.windows))
    p_values = {
        "marginal": _p_value(found.distance, [one.distance for one in fits]),
        "spectrum": _p_value(found.roughness, [one.roughness for one in fits]),
    }
    held = _lengths_held(found, setting.windows)
    doubts = _doubts(found, setting, observed, held)
    doubts += [Doubt(name, p, FAR) for name, p in p_values.items() if p <= FAR]
    points = sum(record.values.size for record in records)
    return FieldFit(
        field=found.field(quantity),
        parameters=found.parameters,
        interval=intervals(repeated, setting, confidence, values),
        confidence=confidence,
        repetitions=tuple(one.field(quantity) for one in fits),
        families=compared,
        p_values=p_values,
        lengths_held=held,
        missing=(points - values.size, points),
        quantity=quantity,
        doubts=tuple(doubts),
        _details=Details(values, found, setting, observed, tuple(fits)),
    )


def _families(
    marginal: Any, spectrum: Any, anisotropy: bool | float, noise: bool | float
) -> tuple[list[Family], Any]:
    """The families to fit, or everything that is wrong with them."""
    several = marginal if isinstance(marginal, list | tuple) else [marginal]
    # True is estimated; False is none.
    ratio = None if anisotropy is True else anisotropy or 1.0
    deviation = None if noise is True else float(noise)
    calls: list[Any] = [lambda one=one: family_of(one) for one in several]
    calls.append(lambda: spectrum_family(spectrum, ratio, deviation, (0.0, 0.0)))
    found, problems = [], [] if several else ["marginal: names no family"]
    for call in calls:
        try:
            found.append(call())
        except InputError as error:
            problems += error.problems
    if problems:
        raise InputError(problems)
    return found[:-1], found[-1]


def _windows(records: Sequence[Record], degree: int) -> tuple[Window, ...]:
    """A window for each record; those of one geometry share it."""
    made: dict[Any, Window] = {}
    keys = []
    for values, spacings in records:
        measured = np.isfinite(values)
        keys.append((values.shape, spacings, measured.tobytes()))
        if keys[-1] not in made:
            made[keys[-1]] = make_window(values.shape, spacings, measured, degree)
    return tuple(made[key] for key in keys)


def _best(
    settings: Sequence[Setting], rows: Sequence[Array]
) -> tuple[Estimate, Setting, dict[str, Goodness]]:
    """The family that describes the values best, and how well each does."""
    values = np.concatenate(rows)
    fitted: list[tuple[float, Estimate, Setting]] = []
    problems: list[str] = []
    for setting in settings:
        family = setting.marginal
        try:
            if setting.spectrum.noise == 0.0:
                family.check(values)
            found = estimate(rows, setting)
        except InputError as error:
            problems += error.problems
            continue
        independent = min(_lengths_held(found, setting.windows), values.size)
        score = independent * mean_log_likelihood(found.marginal, values, found.model.noise)
        fitted.append((score - len(family.parameters(found.marginal)), found, setting))
    if not fitted:
        raise InputError(problems)
    top, best, chosen = max(fitted, key=lambda one: one[0])
    compared = {
        setting.marginal.name: Goodness(found.marginal, found.distance, score - top)
        for score, found, setting in fitted
    }
    return best, chosen, compared


def _lengths_held(found: Estimate, windows: Sequence[Window]) -> float:
    """Correlation lengths, or on a plane areas, that windows hold together."""
    area = sum(float(one.measured.sum()) * math.prod(one.spacings) for one in windows)
    length, ratio = found.model.spectrum.correlation_length, found.model.anisotropy
    return area / (length if len(windows[0].shape) == 1 else length * length * ratio)


def _p_value(own: float, others: Sequence[float]) -> float:
    """Of data that are a record of their model (Barnard's test; Davison and Hinkley, 1997)."""
    return (sum(one >= own for one in others) + 1) / (len(others) + 1)


def _doubts(
    found: Estimate, setting: Setting, observed: Sequence[Observed], held: float
) -> list[Doubt]:
    """What stands in the way of trusting a fit."""
    doubts = []
    if held < ENOUGH_LENGTHS:
        doubts.append(Doubt("lengths_held", held, ENOUGH_LENGTHS))
    left = max(_power_at_cutoff(found, one) for one in observed)
    if left <= found.model.noise**2:
        doubts.append(Doubt("noise", found.model.noise, math.sqrt(left)))
    family = setting.spectrum
    for name, at, limits in zip(
        family.free, family.vector(found.model), family.limits, strict=True
    ):
        near = np.abs(limits - at) < AT_LIMIT * (limits[1] - limits[0])
        if name in ("correlation_length", "exponent", "anisotropy") and near.any():
            doubts.append(Doubt(name, back(name, at), back(name, limits[near.argmax()])))
    return doubts


def _power_at_cutoff(found: Estimate, observed: Observed) -> float:
    """What is left of the field's power where it has fallen to a quarter, as the noise counts it.

    The noise is white: each ordinate expects its variance, the taper being normalised.
    """
    model = found.model
    if model.noise_share <= 0.0:
        return math.inf
    power = model.variance * (1.0 - model.noise_share) * model.signal(observed)
    power = power[observed.weights > 0.0]
    return float(power[power >= 0.25 * power.max()].min())
