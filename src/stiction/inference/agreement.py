"""Whether measured peaks agree with a prediction: tests whose p-values hold for few peaks.

A prediction that did not see the peaks is one more sample of theirs: under it every choice of as
many values from all of them together is equally likely (a permutation test, exact for any number
of either and where values are equal). The peaks of one campaign share the parameters, which a
posterior leaves open: each simulated campaign is drawn from one point of it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np
import xarray as xr

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import Number, at_least, checked
from stiction.base.representation import Result, Row, Summary
from stiction.inference.curves import Curves, summary_of
from stiction.inference.peaks import Peaks, factor_of, make_peaks
from stiction.inference.posterior import Posterior
from stiction.problem.load import NotNegative

POSTERIOR_POINTS, LAW_VALUES = 1000, 400
"""Parameters that stand for a posterior, and values at which the law of a peak is kept."""
RANGE_MARGIN = 0.25
"""What is added on either side to the range of the predicted peaks, as a share of it."""
OUTLYING_SHARE = 1e-3
"""Share of the predicted peaks on either side that does not count for this range: it may have
heavy tails."""
BAND_LEVEL = 0.9
PRECURSORS = {"number": "number", "size": "largest", "first_load": "load of the first"}
"""What is compared of precursors, in words."""


class Predicted(NamedTuple):
    """Distribution function of the predicted peaks of one kind of specimen."""

    values: Array  # rising, in the unit of the peaks
    share: Array  # of peaks up to each


@dataclass(frozen=True, eq=False, repr=False)
class Agreement(Result):
    """Distances between measured and predicted peaks, and how often chance exceeds them.

    Attributes
    ----------
    peaks : Peaks
        The measured peaks.
    cramer_von_mises, largest_deviation : float
        Sum over tests of the squared difference between the measured and the predicted share of
        peaks, and the largest of these differences times the square root of the number of tests.
    p_values : dict of str to float
        By these two names: probability of a distance at least as large if the prediction is right.
    predicted : tuple of (values, share)
        Predicted distribution function of each kind of specimen.
    band : float
        Largest deviation that 90 % of campaigns do not exceed.
    precursors : dict of str to (measured, predicted) arrays
        If curves were compared: ``number`` of precursors of each test, ``size`` of the
        largest (N or Pa, 0 without any), and ``first_load``, the force at the first (the peak
        without any). `p_values` has these names too.
    """

    peaks: Peaks
    cramer_von_mises: float
    largest_deviation: float
    p_values: dict[str, float]
    predicted: tuple[Predicted, ...]
    band: float
    precursors: Mapping[str, tuple[Array, Array]] = field(default_factory=dict)

    def _summary(self) -> Summary:
        rows = [Row(f"p-value, {name}", p) for name, p in self.p_values.items()]
        return Summary(f"{self.peaks} against the prediction", rows)

    def __str__(self) -> str:
        squares_p, deviation_p, *_ = self.p_values.values()
        text = (
            f"{self.peaks} against the prediction: p = {squares_p:.3g} (Cramer-von Mises),"
            f" {deviation_p:.3g} (largest deviation)"
        )
        shown = [f"{self.p_values[name]:.3g} ({PRECURSORS[name]})" for name in self.precursors]
        return text + f"; precursors: p = {', '.join(shown)}" * bool(shown)


@checked
def agreement(
    prediction: xr.Dataset | Posterior,
    peaks: Any,
    *,
    unit: str = "Pa",
    load_cell_error: NotNegative = 0.0,
    replicates: at_least(100) = 999,  # type: ignore[valid-type]
    seed: Number = 0,
) -> Agreement:
    """Test whether measured peaks agree with a prediction.

    Distributions are compared: the order of the tests does not count. Take off a trend first,
    ``peaks - np.polyval(np.polyfit(time, peaks, 1), time) + peaks.mean()``, and say so.

    Parameters
    ----------
    prediction : Dataset or Posterior
        From `stiction.monte_carlo`, or from `stiction.infer`, of whose parameters it takes the
        uncertainty into account; in either case with parameters not fitted to these peaks.
    peaks : array, mapping of arrays, Peaks or Curves
        As in `stiction.infer`. With `Curves` and a prediction that has events, as by
        ``Equilibrium(events=20)``, precursors are compared too.
    unit : str
        Unit of the peaks and the load-cell error.
    load_cell_error : float
        Standard deviation of the error of a peak, for a dataset; a posterior has its own.
    replicates : int
        Number of simulated campaigns; p-values are at least 1/(replicates + 1).
    seed : int
        Not negative.

    Returns
    -------
    Agreement
        `stiction.plot.agreement` draws it.

    Raises
    ------
    InputError
        If the prediction lacks the quantity that was measured, is swept, or is of one kind
        of specimen where several were tested; peaks are fifty times those predicted, or a
        fiftieth; or the posterior was fitted to them, near which it then lies.

    Warns
    -----
    AccuracyWarning
        If samples of the prediction have no peak; they are left out.

    Notes
    -----
    A p-value of 0.3 says that three of ten campaigns of as many tests would lie as far from a right
    prediction; it does not say that the prediction is right. A few tests find gross errors only.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=0.5)
    >>> predicted = st.monte_carlo(
    ...     problem, strength, method=st.LocalCriterion(), samples=500, seed=0
    ... )
    >>> found = st.statistics.agreement(predicted, [0.725, 0.732, 0.751, 0.718, 0.735], unit="MPa")
    >>> found.p_values["cramer_von_mises"] > 0.05
    True
    """
    rng = np.random.default_rng([seed, 3])
    measured = make_peaks(peaks, unit)
    if isinstance(prediction, Posterior):
        if load_cell_error:
            raise InputError("load_cell_error: the posterior has its own; leave it out")
        return _with_posterior(prediction, measured, replicates, rng)
    values = _values(prediction, measured)
    factor = 1.0 if isinstance(peaks, Peaks | Curves) else factor_of(unit)
    values = values + factor * load_cell_error * rng.standard_normal(values.size)
    result = _with_sample(values, measured, replicates, rng)
    if isinstance(peaks, Curves) and "event" in prediction.dims:
        precursors = _precursors(prediction, peaks)
        for name, pair in precursors.items():
            distances = _permuted(*pair, replicates, rng)
            result.p_values[name] = _p_values(distances)[0]
        result = replace(result, precursors=precursors)
    return result


def _precursors(prediction: xr.Dataset, curves: Curves) -> dict[str, tuple[Array, Array]]:
    """Return number, largest size and first load of precursors, measured and predicted.

    Both are found in the same way, in the force before and after each predicted event, with the
    largest threshold of the tests: drops that a load cell does not tell from noise do not count.
    """
    names = {"N": ("event_force", "critical_force"), "Pa": ("event_stress", "critical_stress")}
    event, peak = names.get(curves.unit, ("", ""))
    if event not in prediction:
        raise InputError(
            f"prediction: has no events in {curves.unit}, in which the curves are; give curves of"
            " force, and the thickness of the specimen"
        )
    if int(prediction["arrested_events"].max()) > prediction.sizes["event"]:
        raise InputError(
            f"prediction: keeps {prediction.sizes['event']} of up to"
            f" {int(prediction['arrested_events'].max())} events; predict with at least so many"
        )
    high = prediction[event].transpose("sample", "event").values
    low = high - prediction[f"{event}_drop"].transpose("sample", "event").values
    peaks = prediction[peak].values
    threshold = max(curve.threshold for curve in curves)
    predicted = []
    for row in np.flatnonzero(np.isfinite(peaks)):
        force = np.stack([high[row], low[row]], axis=1).ravel()
        force = np.append(force[np.isfinite(force)], peaks[row])
        # The peak is where sliding begins, or an earlier event.
        predicted.append(summary_of(force, threshold))
    measured = [summary_of(curve.force, threshold) for curve in curves]
    pairs = zip(np.transpose(measured), np.transpose(predicted), strict=True)
    return dict(zip(PRECURSORS, pairs, strict=True))


def _values(prediction: xr.Dataset, measured: Peaks) -> Array:
    name = measured.variable
    if name not in prediction:
        raise InputError(
            f"prediction: has no {name}, which was measured; it holds"
            f" {', '.join(map(str, prediction.data_vars))}"
        )
    if prediction[name].ndim != 1 or len(measured.values) > 1:
        raise InputError(
            f"prediction: must be of one kind of specimen, got {name} over"
            f" {', '.join(map(str, prediction[name].dims))} for {len(measured.values)} kinds;"
            " choose a step of a sweep with isel, and compare kinds one by one"
        )
    values = np.asarray(prediction[name].values, dtype=np.float64)
    if missing := int(np.isnan(values).sum()):
        warn_accuracy(f"{missing} of {values.size} predicted samples have no peak: left out")
    if missing == values.size:
        raise InputError("prediction: no sample has a peak")
    return values[np.isfinite(values)]


def _with_sample(values: Array, measured: Peaks, replicates: int, rng: Any) -> Agreement:
    """Permutation test: which of all values are the measured ones?"""
    (peaks,) = measured.values
    measured.refuse_far([values])
    distances = _permuted(peaks, values, replicates, rng)
    at = np.unique(np.concatenate([peaks, values]))
    share = np.searchsorted(np.sort(values), at, side="right") / values.size
    return _summary(measured, distances, (Predicted(at, share),))


def _permuted(peaks: Array, values: Array, replicates: int, rng: Any) -> Array:
    """Return both distances, (1 + replicates, 2), of which the first are the measured ones."""
    at, place, counts = np.unique(
        np.concatenate([peaks, values]), return_inverse=True, return_counts=True
    )
    share = counts / place.size
    distances = np.empty((replicates + 1, 2))
    for row in range(replicates + 1):
        chosen = (
            rng.choice(place.size, peaks.size, replace=False) if row else np.arange(peaks.size)
        )
        reached = np.cumsum(np.bincount(place[chosen], minlength=at.size)) / peaks.size
        # The others' share follows from that of all.
        away = (reached - np.cumsum(share)) * place.size / values.size
        distances[row] = (
            peaks.size * (share @ away**2),
            np.sqrt(peaks.size) * np.abs(away).max(),
        )
    return distances


def _with_posterior(
    posterior: Posterior, measured: Peaks, replicates: int, rng: Any
) -> Agreement:
    """Compare with campaigns drawn from the posterior, each at one point of it."""
    fitted = posterior.peaks
    if measured.unit != fitted.unit or not {*measured.lengths} <= {*fitted.lengths}:
        raise InputError(
            f"peaks: the posterior predicts {fitted} in {fitted.unit}, got {measured} in"
            f" {measured.unit}"
        )
    seen = np.concatenate(fitted.values)
    if np.isin(np.concatenate(measured.values), seen).all():
        raise InputError(
            "peaks: the posterior was fitted to them, near which it lies; compare those of"
            " further tests, or leave some out of the fit"
        )
    kinds = [fitted.lengths.index(length) for length in measured.lengths]
    measured.refuse_far([posterior.predicted[kind] for kind in kinds])
    u = posterior.u[rng.choice(len(posterior.u), POSTERIOR_POINTS)]
    chosen = rng.integers(POSTERIOR_POINTS, size=replicates)
    distances, predicted = np.zeros((replicates + 1, 2)), []
    for kind, peaks in zip(kinds, measured.values, strict=True):
        at, shares = _law(posterior, kind, u, peaks)
        uniform = rng.random((replicates, peaks.size))
        drawn = [np.interp(p, shares[i], at) for p, i in zip(uniform, chosen, strict=True)]
        law = Predicted(at, shares.mean(axis=0))
        squares, most = _distances(np.interp(np.sort([peaks, *drawn]), *law))
        distances[:, 0] += squares
        distances[:, 1] = np.maximum(distances[:, 1], most)
        predicted.append(law)
    return _summary(measured, distances, tuple(predicted))


def _law(posterior: Posterior, kind: int, u: Array, peaks: Array) -> tuple[Array, Array]:
    """Return peaks, and the shares up to each at parameters u, (points, LAW_VALUES)."""
    ends = np.quantile(posterior.predicted[kind], [OUTLYING_SHARE, 1.0 - OUTLYING_SHARE])
    low, high = min(ends[0], peaks.min()), max(ends[1], peaks.max())
    margin = RANGE_MARGIN * (high - low)
    at = np.linspace(max(low - margin, 0.5 * low), high + margin, LAW_VALUES)
    density = np.exp(posterior.likelihood.of([at], [kind]).parts(u))
    between = 0.5 * (density[:, 1:] + density[:, :-1])
    share = np.cumsum(np.pad(between, ((0, 0), (1, 0))), axis=1)
    return at, share / np.maximum(share[:, -1:], 1e-300)


def _distances(share: Array) -> tuple[Array, Array]:
    """Return both distances of predicted shares at sorted peaks from a uniform distribution."""
    size = share.shape[1]
    steps = np.arange(size + 1) / size
    squares = np.sum((0.5 * (steps[1:] + steps[:-1]) - share) ** 2, axis=1) + 1.0 / (
        12.0 * size
    )
    most = np.maximum((steps[1:] - share).max(axis=1), (share - steps[:-1]).max(axis=1))
    return squares, np.sqrt(size) * most


def _p_values(distances: Array) -> list[float]:
    """Return the shares of replicates whose distances are at least those of the first row."""
    as_far = np.sum(distances[1:] >= distances[0] * (1.0 - 1e-9), axis=0)
    return ((1 + as_far) / len(distances)).tolist()


def _summary(measured: Peaks, distances: Array, predicted: Any) -> Agreement:
    """Summarise distances (1 + replicates, 2), of which the first are the measured ones."""
    observed, replicates = distances[0], distances[1:]
    names = ("cramer_von_mises", "largest_deviation")
    return Agreement(
        peaks=measured,
        cramer_von_mises=float(observed[0]),
        largest_deviation=float(observed[1]),
        p_values=dict(zip(names, _p_values(distances), strict=True)),
        predicted=predicted,
        band=float(np.quantile(replicates[:, 1], BAND_LEVEL, method="higher")),
    )
