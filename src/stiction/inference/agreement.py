"""Test whether measured peaks agree with a prediction.

The p-values also hold for few peaks.

Problem. n peaks have the empirical distribution F_n. The prediction has
the distribution F, given by a sample or by a posterior. Find the
probability that n peaks drawn from F are at least as far from F as the
measured peaks, for two distances:

    Cramer-von Mises    W^2 = n int (F_n - F)^2 dF
    Kolmogorov          D = sqrt(n) max |F_n - F|

Sources. Permutation tests, and their p-value (1 + number as
far)/(1 + replicates), are described by Davison and Hinkley,
Bootstrap Methods and their Application (1997), sections 4.2
and 4.3. The sum for W^2 is given by Anderson and Darling
(1952), Annals of Mathematical Statistics 23, 193.

Steps for a predicted sample:

1. Under the hypothesis, each choice of n values from all measured and
   predicted values together is equally likely. This is exact for any
   numbers of values, and for equal values. F is then the distribution
   of the remaining values, and the integral is over all values.
2. Choose n values at random, and compute both distances between these
   and the remaining values.
3. Compute the p-value: the fraction of choices whose distance is at
   least the distance of the measured values.

Steps for a posterior. All peaks of a campaign have the same unknown
parameters.

4. Tabulate the distribution of a peak at `POSTERIOR_POINTS` draws of
   the posterior.
5. Draw each simulated campaign from one of these distributions, and
   compute its distances from their mean. If a campaign has several
   kinds of specimens, add W^2 over the kinds and take the largest D.
6. Compute the p-value: the fraction of campaigns whose distance is at
   least the distance of the measured campaign.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
import xarray as xr
from pydantic import Field

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import Count, NotNegative, Number, checked
from stiction.base.representation import Result, Row, Summary
from stiction.inference.curves import Curves, precursors
from stiction.inference.peaks import Peaks, peaks_and_error, title_of
from stiction.inference.posterior import Posterior

POSTERIOR_POINTS, LAW_VALUES = 1000, 400
"""Number of draws that represent a posterior, and of values in the table of
a distribution."""
RANGE_MARGIN = 0.25
"""Fraction of the range of predicted peaks that is added to it on either
side."""
OUTLYING_SHARE = 1e-3
"""Fraction of the predicted peaks on either side that is left out of
this range, because their distribution may have heavy tails."""
DOUBTFUL_P_VALUE = 0.05
"""P-value below which measured and predicted peaks contradict each
other."""
BAND_LEVEL = 0.9
PRECURSORS = ("number", "size", "first_load")
"""Compared properties of precursors."""


@dataclass(frozen=True, eq=False, repr=False)
class Agreement(Result):
    """Distances between measured and predicted peaks, with their p-values.

    Attributes
    ----------
    peaks : Peaks
        The measured peaks.
    cramer_von_mises, largest_deviation : float
        The two distances. W^2 is the sum over the tests of
        the squared differences between measured and
        predicted fractions. The largest difference is
        multiplied by the square root of the number of tests.
    p_values : dict from str to float
        For each distance, by name: the probability of a distance at
        least as large if the prediction is right. If curves were
        compared, also the p-values of the ``number`` of precursors of a
        test, of the ``size`` of its largest precursor, or 0, and of
        ``first_load``, the force at its first precursor, or else the
        peak.
    predicted : tuple of (values, fraction)
        Predicted distribution function for each specimen type:
        rising values in the unit of the peaks, and the fraction of peaks
        up to each value.
    band : float
        The largest deviation stays below this value in 90 % of campaigns.
    """

    peaks: Peaks
    cramer_von_mises: float
    largest_deviation: float
    p_values: dict[str, float]
    predicted: tuple[tuple[Array, Array], ...]
    band: float

    @property
    def notes(self) -> tuple[str, ...]:
        """Doubts, if the peaks contradict the prediction.

        >>> peaks = Peaks((None,), (np.ones(3),), "Pa")
        >>> Agreement(peaks, 1.0, 2.0, {"a": 0.9, "size": 0.05}, (), 1.0).notes
        ()
        >>> doubted = Agreement(peaks, 1.0, 2.0, {"a": 0.9, "size": 0.04}, (), 1.0)
        >>> doubted.notes  # doctest: +ELLIPSIS
        ('the peaks contradict the prediction, p = 0.04. Check ...',)
        """
        p = min(self.p_values.values())
        text = f"the peaks contradict the prediction, p = {p:.2g}. Check units, method and surfaces"
        return (text,) if p < DOUBTFUL_P_VALUE else ()

    def _summary(self) -> Summary:
        """Return the summary, with a row for each p-value.

        >>> peaks = Peaks((None,), (np.ones(3),), "Pa")
        >>> print(Agreement(peaks, 1.0, 2.0, {"size": 0.25, "number": 0.5}, (), 3.0))
        3 peaks against the prediction
                           value
          p-value, size    0.25
          p-value, number  0.5
        """
        rows = [Row(f"p-value, {name}", p) for name, p in self.p_values.items()]
        return Summary(f"{title_of(self.peaks)} against the prediction", rows)


@checked
def agreement(
    prediction: xr.Dataset | Posterior,
    peaks: Any,
    *,
    unit: str | None = None,
    load_cell_error: NotNegative = 0.0,
    replicates: Annotated[Count, Field(ge=100)] = 999,
    seed: Number = 0,
) -> Agreement:
    """Test whether measured peaks agree with a prediction.

    The test compares distributions, so the order of the tests does not
    count. If peaks drift, first remove the trend, ``peaks -
    np.polyval(np.polyfit(time, peaks, 1), time) + peaks.mean()``, and
    report this correction.

    Parameters
    ----------
    prediction : Dataset or Posterior
        Result of `stiction.monte_carlo` or `stiction.infer`. The test
        includes the uncertainty of a posterior. The prediction must not
        have been fitted to these peaks.
    peaks : array, mapping of arrays, Peaks or Curves
        As in `stiction.infer`. If curves are given and the prediction
        has events, for example from ``Equilibrium(events=20)``,
        precursors are also compared.
    unit : str, optional
        Unit of the peaks and the load-cell error. Numbers without a
        unit need it.
    load_cell_error : float
        Standard error of a peak. Needed for a dataset
        only, because a posterior contains its load-cell error.
    replicates : int
        Number of simulated campaigns. A p-value is at least
        1/(replicates + 1).
    seed : int
        Not negative.

    Returns
    -------
    Agreement
        `stiction.plot.agreement` draws it.

    Raises
    ------
    InputError
        If the prediction lacks the measured quantity, is a sweep, or
        has one specimen type although several kinds were tested.
        Also if peaks differ from the prediction by a factor of fifty,
        or if the posterior was fitted to these peaks.

    Warns
    -----
    AccuracyWarning
        If samples of the prediction have no peak, and are left out.

    Notes
    -----
    A p-value of 0.3 means: if the prediction is right, three of ten
    campaigns with as many tests differ from the prediction at least as
    much. A large p-value does not prove the prediction. With few tests,
    only large errors are found.

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
    measured, error = peaks_and_error(peaks, unit, load_cell_error)
    if isinstance(prediction, Posterior):
        if load_cell_error:
            raise InputError("load_cell_error: is part of the posterior. Leave it out")
        return _with_posterior(prediction, measured, replicates, rng)
    values = _predicted_peaks(prediction, measured)
    values = values + error * rng.standard_normal(values.size)
    measured.refuse_far([values])
    # 1. to 3.
    distances = _permuted(measured.values[0], values, replicates, rng)
    at = np.unique(np.concatenate([measured.values[0], values]))
    share = np.searchsorted(np.sort(values), at, side="right") / values.size
    result = _agreement(measured, distances, ((at, share),))
    if isinstance(peaks, Curves) and "event" in prediction.dims:
        for name, pair in zip(PRECURSORS, _precursors(prediction, peaks), strict=True):
            result.p_values[name] = _p_values(_permuted(*pair, replicates, rng))[0]
    return result


def _precursors(prediction: xr.Dataset, curves: Curves) -> Iterable[tuple[Array, Array]]:
    """Return the number, largest size and first load of precursors, measured and predicted.

    Predicted drops follow from the force before and after each event.
    Drops below the largest threshold of the tests do not count, because
    a load cell could not distinguish them from noise.

    Sample 0 has drops from 5 to 2 and from 8 to 7.5, and the second
    one is below the larger threshold. Sample 1 has one event, and
    sample 2 has no peak.

    >>> from types import SimpleNamespace
    >>> data = xr.Dataset({
    ...     "event_force": (("event", "sample"), [[5, 4, 6], [8, np.nan, 7]]),
    ...     "event_force_drop": (("event", "sample"), [[3, 2, 1], [0.5, np.nan, 1]]),
    ...     "critical_force": ("sample", [9, 7, np.nan]),
    ...     "arrested_events": ("sample", [2, 1, 2]),
    ... })
    >>> first = SimpleNamespace(unit="N", threshold=1.2, force=np.array([0, 5, 3, 8, 9.0]))
    >>> second = SimpleNamespace(unit="N", threshold=0.2, force=np.array([0, 4, 3, 6.0]))
    >>> for measured, predicted in _precursors(data, Curves((first, second))):
    ...     measured.tolist(), predicted.tolist()
    ([1.0, 0.0], [1.0, 1.0])
    ([2.0, 0.0], [3.0, 2.0])
    ([5.0, 6.0], [5.0, 4.0])

    >>> def refused(data, unit):
    ...     try:
    ...         _precursors(data, Curves((SimpleNamespace(unit=unit),)))
    ...     except InputError as error:
    ...         return str(error).split(". ")[0]
    >>> refused(data, "Pa"), refused(data, "1")
    ('prediction: has no events in Pa', 'prediction: has no events in 1')
    >>> refused(data.assign(arrested_events=("sample", [2, 3, 2])), "N")
    'prediction: keeps 2 of up to 3 events'
    >>> of_stress = {name: name.replace("force", "stress") for name in data.data_vars}
    >>> first.unit = second.unit = "Pa"
    >>> number, *_ = _precursors(data.rename(of_stress), Curves((first, second)))
    >>> [values.tolist() for values in number]
    [[1.0, 0.0], [1.0, 1.0]]
    """
    quantity = {"N": "force", "Pa": "stress"}.get(curves.unit, "coefficient")
    event, drop = (f"event_{name}" for name in (quantity, f"{quantity}_drop"))
    if drop not in prediction:
        raise InputError(
            f"prediction: has no events in {curves.unit}. Give curves of force, and a thickness"
        )
    if int(prediction["arrested_events"].max()) > prediction.sizes["event"]:
        raise InputError(
            f"prediction: keeps {prediction.sizes['event']} of up to"
            f" {int(prediction['arrested_events'].max())} events. Predict with a larger events="
        )
    high = prediction[event].transpose("sample", "event").values
    low = high - prediction[drop].transpose("sample", "event").values
    peaks = prediction[f"critical_{quantity}"].values
    threshold = max(curve.threshold for curve in curves)
    predicted = []
    for row in np.flatnonzero(np.isfinite(peaks)):
        force = np.stack([high[row], low[row]], axis=1).ravel()
        force = np.append(force[np.isfinite(force)], peaks[row])
        # The peak is the force at the onset, or at an earlier event.
        # Between an event and the next event the force rises, so the
        # two forces of each event give the turning points.
        predicted.append(summary_of(force, threshold))
    measured = [summary_of(curve.force, threshold) for curve in curves]
    return zip(np.transpose(measured), np.transpose(predicted), strict=True)


def summary_of(force: Array, threshold: float) -> tuple[float, float, float]:
    """Return number and largest size of precursors, and force at the first, or else the peak.

    Examples
    --------
    >>> summary_of(np.array([0, 5, 2, 8, 6, 9.0]), 1.0)
    (2.0, 3.0, 5.0)
    >>> summary_of(np.array([0, 4, 7, 6.0]), 1.0)
    (0.0, 0.0, 7.0)
    """
    starts, ends = precursors(force, threshold)
    sizes = force[starts] - force[ends]
    first = force[starts[0]] if sizes.size else force.max()
    return float(sizes.size), float(sizes.max(initial=0.0)), float(first)


def _predicted_peaks(prediction: xr.Dataset, measured: Peaks) -> Array:
    """Return the predicted peaks, without samples that have no peak.

    >>> from types import SimpleNamespace
    >>> from stiction.base.errors import collect_warnings
    >>> measured = SimpleNamespace(variable="critical_force", values=(np.ones(3),))
    >>> peaks = ("sample", [2, np.nan, 3])
    >>> data = xr.Dataset({"critical_stress": 9.0, "critical_force": peaks})
    >>> with collect_warnings() as caught:
    ...     print(_predicted_peaks(data, measured).tolist(), *caught)
    [2.0, 3.0] 1 of 3 predictions have no peak and are left out
    >>> def refused(data, **changes):
    ...     try:
    ...         _predicted_peaks(data, SimpleNamespace(**(vars(measured) | changes)))
    ...     except InputError as error:
    ...         print(error)
    >>> refused(data, variable="friction_coefficient")  # doctest: +ELLIPSIS
    prediction: lacks the measured quantity, friction_coefficient. It holds critical_stress, ...
    >>> refused(data, values=(np.ones(3), np.ones(2)))  # doctest: +ELLIPSIS
    prediction: must be for one kind of specimen. Choose a step ...
    >>> refused(data.expand_dims("step"))  # doctest: +ELLIPSIS
    prediction: must be for one kind of specimen. Choose a step ...
    >>> refused(data.isel(sample=[1]).drop_vars("critical_stress"))
    prediction: no sample has a peak
    """
    name = measured.variable
    if name not in prediction:
        known = ", ".join(map(str, prediction.data_vars))
        raise InputError(f"prediction: lacks the measured quantity, {name}. It holds {known}")
    if prediction[name].ndim != 1 or len(measured.values) > 1:
        raise InputError(
            "prediction: must be for one kind of specimen. Choose a step of a sweep by isel"
        )
    values = np.asarray(prediction[name].values, dtype=np.float64)
    if missing := int(np.isnan(values).sum()):
        warn_accuracy(f"{missing} of {values.size} predictions have no peak and are left out")
    if missing == values.size:
        raise InputError("prediction: no sample has a peak")
    return values[np.isfinite(values)]


def _permuted(peaks: Array, values: Array, replicates: int, rng: Any) -> Array:
    """Return both distances, for the measured choice and random choices (1 + replicates, 2).

    The distances by their definition, for the measured values and
    for each other choice:

    >>> from itertools import combinations
    >>> def distances(chosen, rest):
    ...     away = [np.mean(chosen <= v) - np.mean(rest <= v) for v in (*chosen, *rest)]
    ...     size = chosen.size
    ...     return size * np.mean(np.square(away)), np.sqrt(size) * np.max(np.abs(away))
    >>> values = np.array([1, 4, 4, 2, 3.0])
    >>> found = _permuted(values[:2], values[2:], 200, np.random.default_rng(0))
    >>> found.shape, bool(np.allclose(found[0], distances(values[:2], values[2:])))
    ((201, 2), True)
    >>> pairs = [np.array(pair) for pair in combinations(range(5), 2)]
    >>> possible = [distances(values[pair], np.delete(values, pair)) for pair in pairs]
    >>> {*map(tuple, found.round(6).tolist())} == {*map(tuple, np.round(possible, 6).tolist())}
    True
    """
    at, place, counts = np.unique(
        np.concatenate([peaks, values]), return_inverse=True, return_counts=True
    )
    total, size, share = place.size, peaks.size, counts / place.size
    distances = np.empty((replicates + 1, 2))
    for row in range(replicates + 1):
        # 2.
        chosen = rng.choice(total, size, replace=False) if row else np.arange(size)
        reached = np.cumsum(np.bincount(place[chosen], minlength=at.size)) / size
        # The remaining values have the distribution of all values less
        # the chosen ones.
        away = (reached - np.cumsum(share)) * total / values.size
        distances[row] = size * (share @ away**2), np.sqrt(size) * np.abs(away).max()
    return distances


def _with_posterior(
    posterior: Posterior, measured: Peaks, replicates: int, rng: Any
) -> Agreement:
    """Compare with campaigns drawn from the posterior (steps 4 to 6).

    Peaks are uniform in this posterior for all parameters. The
    measured kinds of specimens are in another order than the fitted
    kinds.

    >>> from types import SimpleNamespace
    >>> flat = SimpleNamespace(parts=lambda u: np.zeros((len(u), LAW_VALUES)))
    >>> posterior = SimpleNamespace(
    ...     peaks=Peaks((0.1, 0.2), (np.array([4, 5.0]), np.array([40, 50.0])), "Pa"),
    ...     predicted=(np.linspace(2, 12, 1001), np.linspace(20, 120, 1001)),
    ...     u=np.zeros((5, 1)), likelihood=SimpleNamespace(of=lambda peaks, kinds: flat))
    >>> measured = Peaks((0.2, 0.1), (np.array([15.0]), np.array([6.0, 5.0])), "Pa")
    >>> found = _with_posterior(posterior, measured, 99, np.random.default_rng(0))
    >>> laws = found.predicted
    >>> [[float(at[0].round(2)), float(at[-1].round(2))] for at, share in laws]
    [[7.5, 146.12], [1.0, 14.48]]
    >>> shares = map(np.interp, measured.values, *zip(*laws, strict=True))
    >>> pairs = [_distances(np.sort([share])) for share in shares]
    >>> bool(np.isclose(found.cramer_von_mises, sum(w[0] for w, _ in pairs)))
    True
    >>> bool(np.isclose(found.largest_deviation, max(d[0] for _, d in pairs)))
    True

    Both deviations are below q with the probability 0.9 if q is
    about 1.1, the quantile of two campaigns with one and two tests.

    >>> 0.9 < found.band < 1.25, found.p_values["cramer_von_mises"] > 0.05
    (True, True)
    >>> def refused(*peaks):
    ...     try:
    ...         _with_posterior(posterior, Peaks(*peaks), 99, np.random.default_rng(0))
    ...     except InputError as error:
    ...         print(str(error).split(". ")[0])
    >>> refused((0.1,), (np.ones(3),), "N")  # doctest: +ELLIPSIS
    peaks: the posterior has 2 peaks at 0.1 m, ... in Pa, not 3 peaks at 0.1 m in N
    >>> refused((0.3,), (np.ones(3),), "Pa")  # doctest: +ELLIPSIS
    peaks: the posterior has 2 peaks at 0.1 m, ... in Pa, not 3 peaks at 0.3 m in Pa
    >>> refused((0.2,), (np.array([50, 40.0]),), "Pa")
    peaks: the posterior was fitted to these peaks
    >>> refused((0.2,), (np.array([0.5, 0.6]),), "Pa")
    peaks: are about 0.55 Pa, but predictions are about 70 Pa
    """
    fitted = posterior.peaks
    if measured.unit != fitted.unit or not {*measured.lengths} <= {*fitted.lengths}:
        raise InputError(
            f"peaks: the posterior has {title_of(fitted)} in {fitted.unit}, not"
            f" {title_of(measured)} in {measured.unit}"
        )
    seen = np.concatenate(fitted.values)
    if np.isin(np.concatenate(measured.values), seen).all():
        raise InputError(
            "peaks: the posterior was fitted to these peaks. Compare peaks of further tests"
        )
    kinds = [fitted.lengths.index(length) for length in measured.lengths]
    measured.refuse_far([posterior.predicted[kind] for kind in kinds])
    # All kinds of a campaign use the same draw, because they have the same
    # unknown parameters.
    u = posterior.u[rng.choice(len(posterior.u), POSTERIOR_POINTS)]
    chosen = rng.integers(POSTERIOR_POINTS, size=replicates)
    distances, predicted = np.zeros((replicates + 1, 2)), []
    for kind, peaks in zip(kinds, measured.values, strict=True):
        # 4.
        at, shares = _peaks_at(posterior, kind, u, peaks)
        # 5.
        uniform = rng.random((replicates, peaks.size))
        drawn = [np.interp(p, shares[i], at) for p, i in zip(uniform, chosen, strict=True)]
        law = at, shares.mean(axis=0)
        # Values of the mean distribution are
        # uniform if the peaks come from it.
        squares, most = _distances(np.interp(np.sort([peaks, *drawn]), *law))
        distances[:, 0] += squares
        distances[:, 1] = np.maximum(distances[:, 1], most)
        predicted.append(law)
    return _agreement(measured, distances, tuple(predicted))


def _peaks_at(posterior: Posterior, kind: int, u: Array, peaks: Array) -> tuple[Array, Array]:
    """Return peaks (points, LAW_VALUES) at parameters u, and the fraction of peaks up to each.

    The density of a peak y is y^u here: uniform for u = 0 and
    linear for u = 1.

    >>> from types import SimpleNamespace
    >>> def of(peaks, kinds):
    ...     return SimpleNamespace(parts=lambda u: kinds[0] * u * np.log(peaks[0]))
    >>> predicted = np.zeros(3), np.linspace(2, 12, 1001)
    >>> posterior = SimpleNamespace(predicted=predicted, likelihood=SimpleNamespace(of=of))
    >>> at, share = _peaks_at(posterior, 1, np.array([[0], [1]]), np.array([5, 1.5]))
    >>> at.size, share.shape, at[[0, -1]].round(4).tolist()  # half of 1.5, and 11.99 + 10.49/4
    (400, (2, 400), [0.75, 14.6125])
    >>> bool(np.allclose(share[0], (at - at[0]) / np.ptp(at)))
    True
    >>> bool(np.allclose(share[1], (at**2 - at[0] ** 2) / (at[-1] ** 2 - at[0] ** 2)))
    True
    >>> at, share = _peaks_at(posterior, 1, np.array([[0]]), np.array([5, 20.0]))
    >>> at[[0, -1]].round(4).tolist()  # half of 2.01, and 20 + 17.99/4
    [1.005, 24.4975]
    >>> posterior.predicted = (predicted[0], np.linspace(102, 112, 1001))
    >>> at, share = _peaks_at(posterior, 1, np.array([[0]]), np.array([105.0]))
    >>> at[[0, -1]].round(4).tolist()  # 102.01 and 111.99, with 9.98/4 on either side
    [99.515, 114.485]
    """
    ends = np.quantile(posterior.predicted[kind], [OUTLYING_SHARE, 1.0 - OUTLYING_SHARE])
    low, high = min(ends[0], peaks.min()), max(ends[1], peaks.max())
    margin = RANGE_MARGIN * (high - low)
    at = np.linspace(max(low - margin, 0.5 * low), high + margin, LAW_VALUES)
    density = np.exp(posterior.likelihood.of([at], [kind]).parts(u))
    # The distribution is the integral of the density, by the
    # trapezoidal rule.
    between = 0.5 * (density[:, 1:] + density[:, :-1])
    share = np.cumsum(np.pad(between, ((0, 0), (1, 0))), axis=1)
    return at, share / np.maximum(share[:, -1:], 1e-300)


def _distances(share: Array) -> tuple[Array, Array]:
    """Return W^2 and D for sorted uniform numbers (campaigns, tests).

    >>> squares, most = _distances(np.array([[0.1, 0.8], [0.5, 0.9]]))
    >>> (squares - 1 / 24).round(9).tolist()  # 0.15^2 + 0.05^2, and 0.25^2 + 0.15^2
    [0.025, 0.085]
    >>> (most / np.sqrt(2)).round(9).tolist()
    [0.4, 0.5]
    """
    size = share.shape[1]
    steps = np.arange(size + 1) / size
    squares = np.sum((0.5 * (steps[1:] + steps[:-1]) - share) ** 2, axis=1) + 1 / (12 * size)
    most = np.maximum((steps[1:] - share).max(axis=1), (share - steps[:-1]).max(axis=1))
    return squares, np.sqrt(size) * most


def _p_values(distances: Array) -> list[float]:
    """Return the fraction of rows whose distances are at least the distances of the first row.

    >>> _p_values(np.array([[2, 3], [2, 4], [1, 3 - 1e-12], [3, 1], [1, 5]]))
    [0.6, 0.8]
    """
    # Equal distances may differ by round-off.
    as_far = np.sum(distances[1:] >= distances[0] * (1.0 - 1e-9), axis=0)
    return ((1 + as_far) / len(distances)).tolist()


def _agreement(measured: Peaks, distances: Array, predicted: Any) -> Agreement:
    """Return the agreement from distances (1 + replicates, 2).

    Measured distances come first.

    >>> squares, most = np.r_[3, np.arange(12.0)], np.r_[21, 2 * np.arange(12.0)]
    >>> distances = np.stack([squares, most], axis=1)
    >>> found = _agreement("peaks", distances, "laws")
    >>> found.peaks, found.predicted
    ('peaks', 'laws')
    >>> found.cramer_von_mises, found.largest_deviation, found.band
    (3.0, 21.0, 20.0)
    >>> found.p_values == {"cramer_von_mises": 10 / 13, "largest_deviation": 2 / 13}
    True
    """
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
