"""A random field from measured profiles: the public function and its checks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo

from stiction.arrays import Array
from stiction.ensemble.batches import usable_cores
from stiction.errors import InputError, unknown_name, warn_accuracy
from stiction.inference.bootstrap import Repetitions, at_ends, intervals, parameters_of, repeat
from stiction.inference.estimate import (
    Estimate,
    Setting,
    detrended,
    estimate,
    make_windows,
    observe,
)
from stiction.inference.field_fit import Details, Doubt, FieldFit, Goodness
from stiction.inference.marginal_fit import Family, family_of, mean_log_likelihood
from stiction.inference.records import Record, records_of
from stiction.inference.spectrum_fit import SpectrumFamily, back, spectrum_family
from stiction.inference.whittle import Observed
from stiction.interface import Interface
from stiction.model import Progress, Real, at_least, checked, is_finite
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
        Lines over 'x' or maps over 'x' and 'y' (m), such as `stiction.read_profile` returns; units
        that are stated are converted, points may come in any order, and must be equally spaced.
        Missing values (NaN, missing points, values that were filled in) are left out.
        Plain arrays, of shape (nodes,) or (samples, nodes), on a plane (nx, ny) or (samples, nx,
        ny), in SI, have a value at each node of `interface`. Several profiles are of one field.
    interface : Interface, optional
        Needed for arrays without coordinates. The fitted field is looked at on it: a warning says
        if it is too short, or its nodes too coarse, for that field.
    marginal : str, dict or sequence of str
        Family: 'beta', 'lognormal', 'weibull', 'gamma', 'truncated_normal', 'normal', 'uniform' or
        any continuous distribution of `scipy.stats`. Of several the best is taken, and `families`
        in the result compares them. A table keeps parameters: ``{"type": "beta", "low": 0,
        "high": 2e6}``. The lower bound of those above a bound is 0 if it is not given; it is never
        estimated. Both bounds of 'beta' are, unless they are given.
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
    the trend and aliasing are in it, as is a truncation of the spectrum that is given; otherwise it
    is whole (Sykulski et al., 2019;
    Guillaumin et al., 2022). Correlations of values follow from those of the Gaussian field z by
    Hermite expansion (Grigoriu, 1995). A likelihood's own curvature understates the error; the
    intervals come from fits to records simulated from the fitted field, reflected about the
    estimate on the scale on which a parameter's error is about normal and measured in units of the
    error that a record of its correlation length has (the studentised bootstrap; Davison and
    Hinkley, 1997, section 5.2), so that a bias of the estimate is allowed for. Upper and lower ends
    come from fields that belong there, of longer and shorter correlation (one step of a test
    inversion; Carpenter, 1999), which matters for short records. That of the noise is
    of its variance, by estimates that may be negative, and is cut off at zero last; those of a
    marginal's bounds are of the logarithm of their distance from the mean. Likewise cut
    off are those of a marginal's bounds where values lie beyond (drawn together by the greatest
    noise of its interval), and those of an exponent and of an anisotropy at the ends of the ranges
    that are searched, 0.65 to 16 and 0.05 to 20, which is said where they reach one; of a parameter
    that the data do not tell the interval is all of its range.

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
    if spectral.anisotropy != 1.0 and records[0].values.ndim == 1:
        raise InputError("anisotropy: is of maps; the profiles are lines, leave it out")
    spacing = max(max(record.spacings) for record in records)
    longest = max(max(record.lengths) for record in records)
    spectral = replace(spectral, lengths=(spacing, 2.0 * longest))
    windows = make_windows(records, detrend)
    rows = [record.values[record.measured] for record in records]
    count = usable_cores() if workers is None else workers
    times = 3 if "correlation_length" in spectral.free else 1
    with Meter("fit_field", times * bootstrap, progress) as meter:
        found, setting, compared = _best(families, spectral, rows, windows, detrend)
        options = (setting, bootstrap, seed, count, meter)
        repeated = [repeat(found, *options)]
        fields = None
        if times == 3 and len(repeated[0].fits) >= FEWEST:
            fields = at_ends(repeated[0], setting, confidence)
        if fields:
            repeated += [repeat(field, *options) for field in fields]
    done = [len(one.fits) for one in repeated]
    if min(done) < FEWEST:
        raise InputError(
            f"marginal: {setting.marginal.name!r} could be fitted to only {sum(done)} of"
            f" {times * bootstrap} repetitions; take another marginal"
        )
    values = np.concatenate(
        [detrended(r, w, setting.degree) for r, w in zip(rows, windows, strict=True)]
    )
    return _result(
        setting, compared, repeated, records, values, rows, interface, confidence, quantity,
        times * bootstrap,
    )  # fmt: skip


def _families(
    marginal: Any, spectrum: Any, anisotropy: Any, noise: Any
) -> tuple[list[Family], SpectrumFamily]:
    """The families to fit, or everything that is wrong with them."""
    problems: list[str] = []

    def collect(function: Any, *given: Any) -> Any:
        try:
            return function(*given)
        except InputError as error:
            problems.extend(error.problems)
            return None

    several = isinstance(marginal, list | tuple)
    families = [collect(family_of, one) for one in (marginal if several else [marginal])]
    if not families:
        problems.append("marginal: names no family")
    ratio = None if anisotropy is True else 1.0 if anisotropy is False else anisotropy
    deviation = None if noise is True else 0.0 if noise is False else noise
    spectral = collect(spectrum_family, spectrum, ratio, deviation, (0.0, 0.0))
    if problems:
        raise InputError(problems)
    return families, spectral


def _best(
    families: Sequence[Family],
    spectral: SpectrumFamily,
    rows: Sequence[Array],
    windows: Sequence[Any],
    degree: int,
) -> tuple[Estimate, Setting, dict[str, Goodness]]:
    """The family that describes the values best, and what is to be said of each."""
    compared: dict[str, Goodness] = {}
    best, chosen, highest = None, None, -math.inf
    problems: list[str] = []
    for family in families:
        setting = Setting(tuple(windows), family, spectral, degree)
        values = np.concatenate(
            [detrended(r, w, degree) for r, w in zip(rows, windows, strict=True)]
        )
        try:
            if spectral.noise == 0.0:
                family.check(values)
            found = estimate(rows, setting)
        except InputError as error:
            problems += error.problems
            continue
        independent = lengths_held(found, windows)
        fitted = mean_log_likelihood(found.marginal, values, found.model.noise)
        parameters = len(family.parameters(found.marginal))
        score = fitted * min(independent, values.size) - parameters
        compared[family.name] = Goodness(found.marginal, found.distance, score)
        if best is None or score > highest:
            best, chosen, highest = found, setting, score
    if best is None or chosen is None:
        raise InputError(problems)
    top = max(one.score for one in compared.values())
    compared = {name: replace(one, score=one.score - top) for name, one in compared.items()}
    return best, chosen, compared


def lengths_held(found: Estimate, windows: Sequence[Any]) -> float:
    """Correlation lengths, or on a plane areas, that windows hold together."""
    length, ratio = found.model.spectrum.correlation_length, found.model.anisotropy
    total = 0.0
    for window in windows:
        sizes = [d / length for d in window.spacings]
        if len(sizes) == 2:
            sizes[1] /= ratio
        total += float(window.measured.sum()) * math.prod(sizes)
    return total


def _result(
    setting: Setting,
    compared: dict[str, Goodness],
    repeated: Sequence[Repetitions],
    records: Sequence[Record],
    values: Array,
    rows: Sequence[Array],
    interface: Interface | None,
    confidence: float,
    quantity: str,
    asked: int,
) -> FieldFit:
    around = repeated[0]
    found, fits = around.truth, [one.estimate for one in around.fits]
    ends = (repeated[1], repeated[2]) if len(repeated) == 3 else None
    rows = [detrended(r, w, setting.degree) for r, w in zip(rows, setting.windows, strict=True)]
    observed = tuple(observe(rows, setting.windows))
    p_values = {
        "marginal": _p_value(found.distance, [one.distance for one in fits]),
        "spectrum": _p_value(found.roughness, [one.roughness for one in fits]),
    }
    held = lengths_held(found, setting.windows)
    doubts = _doubts(found, setting, observed, held)
    doubts += [Doubt(name, p, FAR) for name, p in p_values.items() if p <= FAR]
    used = sum(len(one.fits) for one in repeated)
    if used < asked:
        doubts.append(Doubt("repetitions", used, asked))
    for doubt in doubts:
        warn_accuracy(str(doubt))
    field = found.field(quantity)
    if interface is not None:
        field.modes(interface)
        field.warn_if_inaccurate(interface)
    points = sum(record.values.size for record in records)
    return FieldFit(
        field=field,
        parameters=parameters_of(found, setting),
        interval=intervals(around, ends, setting, confidence, values),
        confidence=confidence,
        repetitions=tuple(one.field(quantity) for one in fits),
        families=compared,
        p_values=p_values,
        lengths_held=held,
        missing=(points - values.size, points),
        quantity=quantity,
        doubts=tuple(doubts),
        _details=Details(values, tuple(records), found, setting, observed, tuple(fits)),
    )


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
            ends = back(name, at), back(name, limits[near.argmax()])
            doubts.append(Doubt(name, *ends))
    return doubts


def _power_at_cutoff(found: Estimate, observed: Observed) -> float:
    """What is left of the field's power where it has fallen to a quarter, as the noise counts it.

    The noise is white: each ordinate expects its variance, the taper being normalised.
    """
    model = found.model
    if model.noise_share <= 0.0:
        return math.inf
    quiet = replace(model, noise_share=0.0, variance=model.variance * (1.0 - model.noise_share))
    power = quiet.expectation(observed)[observed.weights > 0.0]
    return float(power[power >= 0.25 * power.max()].min())
