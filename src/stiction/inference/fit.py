"""A random field from measured profiles: the public function and its checks."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from stiction.arrays import Array
from stiction.ensemble.batches import usable_cores
from stiction.errors import InputError, warn_accuracy
from stiction.inference.bootstrap import Repetitions, at_ends, intervals, parameters_of, repeat
from stiction.inference.estimate import (
    Estimate,
    Setting,
    detrended,
    estimate,
    make_windows,
    observe,
)
from stiction.inference.field_fit import Details, FieldFit, Goodness
from stiction.inference.marginal_fit import Family, family_of
from stiction.inference.noisy_marginal import mean_log_likelihood
from stiction.inference.records import Record, check_quantity, records_of
from stiction.inference.spectrum_fit import SpectrumFamily, spectrum_family
from stiction.inference.whittle import Observed
from stiction.interface import Interface
from stiction.model import Progress, check, describe, is_finite, is_real, is_whole
from stiction.progress import Meter, Show, check_time_limit

if TYPE_CHECKING:
    pass

MARGINALS = ("lognormal", "weibull", "gamma", "beta")
ENOUGH_LENGTHS = 10.0
"""Correlation lengths below which a record says little of any parameter."""
FAR = 0.01
"""Share of simulated records that are as far from their model as the data are from theirs, below
which a family does not suit."""
AT_LIMIT = 1e-3
FEWEST = 20
"""Repetitions that tell a tail of errors."""
HIGHEST_DEGREE = 3


def fit_field(
    profiles: Any,
    interface: Interface | None = None,
    *,
    marginal: str | Mapping[str, Any] | Sequence[str] = MARGINALS,
    spectrum: str | Mapping[str, Any] = "power_law",
    detrend: int = 0,
    noise: bool | float = True,
    anisotropy: bool | float = False,
    gaps: Literal["refuse", "skip"] = "refuse",
    quantity: str = "strength",
    bootstrap: int = 200,
    confidence: float = 0.9,
    seed: int = 0,
    workers: int | None = None,
    time_limit: float | None = None,
    progress: Show = True,
) -> FieldFit:
    """Fit a random field to measured profiles, with an interval of every parameter.

    Parameters
    ----------
    profiles : DataArray, array, or list of them
        Lines over 'x' or maps over 'x' and 'y' (m), such as `stiction.read_profile` returns; units
        that are stated are converted, points may come in any order, and must be equally spaced.
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
    gaps : {"refuse", "skip"}
        Whether missing values (NaN, missing points, values that were filled in) are an error or
        are left out. Nothing is filled in.
    quantity : str
        What it is, for its unit: 'strength', 'normal_pressure', 'friction_coefficient', ...
    bootstrap : int
        Repetitions, at least 20: as many from the fitted field, and from fields with correlation
        lengths at either end of a first interval of it.
    confidence : float
        Of the intervals.
    seed : int
        Of the repetitions, not negative.
    workers : int, optional
        Threads; all cores by default. The numbers do not depend on it.
    time_limit : float, optional
        Seconds; the intervals then come from the repetitions that are done, and it is an error if
        these are fewer than 20.
    progress : bool or callable
        As in `stiction.monte_carlo`.

    Returns
    -------
    FieldFit
        With `field`, `parameters`, `interval` and `plot()`.

    Raises
    ------
    InputError
        Naming all that does not fit: unknown units, points that repeat or are not equally spaced,
        gaps, constant or short records, values outside the bounds of the marginal.

    Warns
    -----
    AccuracyWarning
        If the records hold fewer than ten correlation lengths, the marginal or the spectrum is far
        from what its family can do, the noise hides the cut-off of the spectrum, a parameter lies
        at the end of what is looked for, or values are outliers.

    Notes
    -----
    The marginal is found by maximum likelihood, of values and noise together. The spectrum comes
    from a Whittle likelihood whose expectation is exact for the window: taper, gaps, the removal of
    the trend and aliasing are in it, as is the truncation of the spectrum (Sykulski et al., 2019;
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
    families, spectral = _checked(
        interface, marginal, spectrum, detrend, noise, anisotropy, gaps, quantity, bootstrap,
        confidence, seed, workers, time_limit, progress,
    )  # fmt: skip
    records = records_of(profiles, interface, quantity, gaps == "skip")
    if spectral.anisotropy != 1.0 and records[0].values.ndim == 1:
        raise InputError("anisotropy: is of maps; the profiles are lines, leave it out")
    spacing = max(max(record.spacings) for record in records)
    spectral = replace(
        spectral, lengths=(spacing, 2.0 * max(max(record.lengths) for record in records))
    )
    windows = make_windows(records, int(detrend))
    rows = [record.values[record.measured] for record in records]
    count = usable_cores() if workers is None else int(workers)
    times = 3 if "correlation_length" in spectral.free else 1
    with Meter("fit_field", times * int(bootstrap), progress, time_limit=time_limit) as meter:
        found, setting, compared = _best(families, spectral, rows, windows, int(detrend))
        options = (setting, int(bootstrap), int(seed), count, meter)
        around = repeat(found, *options)
        ends = None
        if len(around.fits) >= FEWEST:
            fields = at_ends(around, setting, float(confidence))
            ends = fields and (repeat(fields[0], *options), repeat(fields[1], *options))
        cut_short = meter.over
    asked = times * int(bootstrap)
    if len(around.fits) < FEWEST:
        why = (
            "time_limit: the time was over after"
            if cut_short
            else f"marginal: {setting.marginal.name!r} could be fitted to only"
        )
        advice = "allow more time" if cut_short else "take another marginal"
        raise InputError(
            f"{why} {len(around.fits)} of {asked} repetitions, and intervals take at least"
            f" {FEWEST}; {advice}"
        )
    return _result(
        setting, compared, around, ends, records, rows, interface,
        confidence=float(confidence), quantity=quantity, asked=asked,
        cut_short=cut_short,
    )  # fmt: skip


def _checked(
    interface: Any, marginal: Any, spectrum: Any, detrend: Any, noise: Any, anisotropy: Any,
    gaps: Any, quantity: Any, bootstrap: Any, confidence: Any, seed: Any, workers: Any,
    time_limit: Any, progress: Any,
) -> tuple[list[Family], SpectrumFamily]:  # fmt: skip
    """The families to fit, or everything that is wrong with the arguments."""
    problems = check_time_limit(time_limit)

    def collect(function: Any, *given: Any) -> Any:
        try:
            return function(*given)
        except InputError as error:
            problems.extend(error.problems)
            return None

    if interface is not None:
        collect(check, "interface", interface, Interface)
    collect(check, "gaps", gaps, Literal["refuse", "skip"])
    collect(check_quantity, quantity)
    collect(check, "progress", progress, Progress)
    if not (is_whole(detrend, 0) and detrend <= HIGHEST_DEGREE):
        problems.append(f"detrend: must be a degree from 0 to 3, got {describe(detrend)}")
    if not (isinstance(noise, bool) or (is_finite(noise) and noise >= 0.0)):
        problems.append(
            f"noise: must be True, False or a standard deviation >= 0, got {describe(noise)}"
        )
    if not (isinstance(anisotropy, bool) or (is_finite(anisotropy) and anisotropy > 0.0)):
        problems.append(
            f"anisotropy: must be True, False or a positive ratio, got {describe(anisotropy)}"
        )
    if not is_whole(bootstrap, FEWEST):
        problems.append(f"bootstrap: must be a whole number >= {FEWEST}, got {describe(bootstrap)}")
    if not (is_real(confidence) and 0.0 < confidence < 1.0):
        problems.append(f"confidence: must lie between 0 and 1, got {describe(confidence)}")
    if not is_whole(seed, 0):
        problems.append(f"seed: must be a whole number >= 0, got {describe(seed)}")
    if workers is not None and not is_whole(workers, 1):
        problems.append(f"workers: must be a whole number >= 1, got {describe(workers)}")
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
    around: Repetitions,
    ends: tuple[Repetitions, Repetitions] | None,
    records: Sequence[Record],
    rows: Sequence[Array],
    interface: Interface | None,
    *,
    confidence: float,
    quantity: str,
    asked: int,
    cut_short: bool,
) -> FieldFit:
    found, repeated = around.world, around.fits
    parameters = parameters_of(found, setting)
    if ends is not None and min(len(one.fits) for one in ends) < FEWEST:
        ends = None
    used = len(repeated) + sum(len(one.fits) for one in ends or ())
    rows = [detrended(r, w, setting.degree) for r, w in zip(rows, setting.windows, strict=True)]
    values = np.concatenate(rows)
    interval = intervals(around, ends, setting, confidence, values)
    further = {
        "marginal": sum(one.estimate.distance >= found.distance for one in repeated),
        "spectrum": sum(one.estimate.roughness >= found.roughness for one in repeated),
    }
    observed = tuple(observe(rows, setting.windows))
    held = lengths_held(found, setting.windows)
    texts = _doubts(found, setting, observed, held) + _misfits(
        found, setting, further, len(repeated)
    )
    if used < asked:
        why = "the time was over" if cut_short else "the family could not be fitted to the others"
        texts.append(f"intervals are from {used} of {asked} repetitions: {why}")
    for text in texts:
        warn_accuracy(text)
    if interface is not None:
        found.field.modes(interface)
        found.field.warn_if_inaccurate(interface)
    details = Details(
        values, tuple(records), found, setting, observed,
        tuple(one.estimate for one in repeated),
    )  # fmt: skip
    return FieldFit(
        field=found.field,
        parameters=parameters,
        interval=interval,
        confidence=confidence,
        repetitions=tuple(one.estimate.field for one in repeated),
        families=compared,
        misfit={name: count / len(repeated) for name, count in further.items()},
        lengths_held=held,
        quantity=quantity,
        warnings=tuple(texts),
        cut_short=cut_short,
        _details=details,
    )


def _doubts(
    found: Estimate,
    setting: Setting,
    observed: Sequence[Observed],
    held: float,
) -> list[str]:
    """What stands in the way of trusting a fit."""
    texts = []
    length = found.model.spectrum.correlation_length
    if held < ENOUGH_LENGTHS:
        texts.append(
            f"the records hold only {held:.2g} correlation lengths ({length:.3g} m), too few for"
            " intervals to be trusted; about ten are needed: measure a longer piece, or several"
        )
    if noise_hides_cutoff(found, observed):
        texts.append(
            f"the noise ({found.model.noise:.3g}) hides the cut-off of the spectrum: where its"
            " density has fallen to a quarter it lies below the noise; the correlation length"
            " rests on the family of the spectrum, not on the data"
        )
    family, vector = setting.spectrum, setting.spectrum.vector(found.model)
    for name, at, (low, high) in zip(family.free, vector, family.limits, strict=True):
        if name in ("variance", "noise_share"):
            continue
        if min(at - low, high - at) < AT_LIMIT * (high - low):
            texts.append(
                f"{name} lies at the end of the range that was searched: the data do not tell it;"
                f" give it (spectrum={{'type': {family.name!r}, {name!r}: ...}}) or another"
                " spectrum"
            )
    return texts


def _misfits(
    found: Estimate, setting: Setting, further: Mapping[str, int], count: int
) -> list[str]:
    """Whether marginal and spectrum are far from the data, as far as the repetitions can tell.

    Of data that are a record of their model, at most k of n repetitions are further from theirs
    with a probability of (k + 1) / (n + 1) (Barnard's test; Davison and Hinkley, 1997, section
    4.2): fewer than 99 cannot show that a share is below 1 %.
    """
    differences = {
        "marginal": (
            f"the values are far from any {setting.marginal.name} marginal: the distribution"
            f" functions differ by {found.distance:.2g}, ",
            "; compare families (marginal=['beta', 'lognormal', 'weibull', ...]) or look at plot()",
        ),
        "spectrum": (
            f"the periodogram is far from any {setting.spectrum.name} spectrum, ",
            "; take another spectrum or a higher detrend, or look at plot()",
        ),
    }
    enough = math.ceil(1.0 / FAR) - 1
    texts = []
    for name, (difference, advice) in differences.items():
        if further[name] + 1 <= FAR * (count + 1):
            texts.append(f"{difference}more than in 99 % of simulated records{advice}")
        elif further[name] == 0:
            family = getattr(setting, name).name
            texts.append(
                f"none of {count} simulated records is as far from its {name} as the data from"
                f" {family!r}: too few to tell whether it suits; {enough} repetitions can"
            )
    return texts


def noise_hides_cutoff(found: Estimate, observed: Sequence[Observed]) -> bool:
    """Whether the field's power lies below that of the noise where it has fallen to a quarter."""
    model = found.model
    if model.noise_share <= 0.0:
        return False
    for one in observed:
        quiet = replace(model, noise_share=0.0, variance=model.variance * (1.0 - model.noise_share))
        power = quiet.expectation(one)
        visible = (one.weights > 0.0) & (power >= 0.25 * power[one.weights > 0.0].max())
        # The noise is white: each ordinate expects its variance, the taper being normalised.
        if power[visible].min() >= model.noise**2:
            return False
    return True
