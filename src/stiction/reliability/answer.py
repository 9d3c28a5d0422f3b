"""Answers on failure probability, and the checks that all of them share."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, Self, TypeAlias

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import ndtri

from stiction.base.arrays import Array
from stiction.base.errors import InputError, collect_warnings, warn_accuracy
from stiction.base.model import Count, Real
from stiction.base.progress import Meter
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import in_words
from stiction.ensemble.batches import usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState, StressName
from stiction.ensemble.monte_carlo import check_fields
from stiction.methods.onset import exact_counterpart
from stiction.methods.protocol import optional_member, seconds_per_sample
from stiction.random.equally_likely import MAX_MEMBERS
from stiction.reliability.tail import Tail, two_levels_refused

TargetCv: TypeAlias = Annotated[Real, Field(ge=1e-6, le=1)]
"""A smaller one would take more than 1e12 failures; a larger is no answer."""
Probability: TypeAlias = Annotated[Real, Field(ge=1e-30, lt=1)]
Budget: TypeAlias = Annotated[Count, Field(ge=100)]

COUNTING_SECONDS, FEWEST_EVALUATIONS, MOST_EVALUATIONS = 100.0, 1_000, 2_000_000
"""Computing time of counting by a slow method, fewest and most evaluations, by default."""
CHAIN_EVALUATIONS, PATIENCE_SECONDS = 20_000, 900.0
"""Evaluations of subset simulation for about P = 1e-4 with a cv of 0.1, and seconds on one core
that evaluations take at most if `max_evaluations` does not allow more."""
LIST_SHARE, SAMPLING_SHARE = 0.6, 0.8
"""Parts of the target for the errors by the list of interfaces and by sampling, in squares."""
REQUEST_MARGIN, CARRIED_SHARE = 1.2, 0.9
"""Margin on the number of members wanted; share of the mean whose carriers are counted."""
EXACT_CHECKS = (8, 64)
"""Fewest and most samples that are solved exactly to check those of an approximate method."""
CHECK_SECONDS = 10.0
"""Seconds of one core for these."""
ESTIMATED = ("stress", "probability", "cv", "members_cv", "members")


@dataclass(frozen=True, eq=False)
class Estimate:
    """A tail at a stress."""

    state: LimitState
    tail: Tail
    stress: float

    @cached_property
    def probability(self) -> float:
        """Probability of an onset below the stress."""
        return self.tail.probability(self.stress)

    @cached_property
    def sampling_cv(self) -> float:
        """Coefficient of variation of the probability by sampling."""
        return self.tail.cv(self.stress)

    @cached_property
    def members_cv(self) -> float:
        """Part of `cv` by the list of interfaces, 0 of a single interface and of a mixture."""
        if not self.state.is_sample:
            return 0.0
        return self.tail.members_cv(self.stress, self.state.experiment.random.kinds)

    @cached_property
    def cv(self) -> float:
        """Coefficient of variation of the probability by both."""
        return math.hypot(self.sampling_cv, self.members_cv)

    @cached_property
    def members(self) -> Array:
        """Probability of each of equally likely interfaces; none of a single one."""
        if not self.state.several:
            return np.zeros(0)
        lows, highs = np.array(self.state.bounds_of_members()).T
        probabilities = self.tail.of_members(self.stress, lows.size)
        return np.select([self.stress <= lows, self.stress >= highs], [0.0, 1.0], probabilities)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Answer(Result):
    """A stress, and the probability that an interface slides below it.

    Attributes
    ----------
    stress, probability : float
        Pa, and the probability of an onset below it; one is given, the other estimated.
    interval : tuple of float
        95 % confidence interval of the one that is estimated.
    cv : float
        Coefficient of variation of the probability: estimated standard error over the
        estimate; infinite without a failure, zero if exact.
    members_cv : float
        Part of `cv` that is due to a list of equally likely interfaces being a sample of those
        that may be true; the rest, with which it adds in squares, is that of sampling. 0 of a
        mixture.
    evaluations, first_stage_evaluations : int
        Samples solved by the method, and by its less expensive first stage only.
    lower_bound, stress_above_bound : float
        Pa; no sample slides below `lower_bound`, which is minus infinity where none is known.
    algorithm, reason : str
        'plain', 'subset', 'two_level' or 'exact' (nothing had to be sampled), and why.
    members : (members,) array
        Of a list of equally likely interfaces: the probability of each; NaN where fewer
        than three samples of an interface slide below the stress. `probability` is the mean
        over all, the predictive probability: the one to decide with.
    survived : float
        Share of plain samples in which the event does not happen, at any stress: behind a stiff
        machine nothing need become unstable, and a load that holds need not break anything.
    warnings : tuple of str
        Reasons not to trust the answer; empty if there are none.
    normal_pressure, friction_coefficient : float
        Mean pressure, Pa, and `stress` over it; NaN without a normal pressure.
    area, force : float
        Area of the interface, m², and `stress` times it, N; NaN if it is unknown: give
        ``Blocks(thickness=...)``, or ``Interface(width=...)`` of a line.
    failing_profiles : xarray.Dataset
        From `failure_probability`: some samples of the failure set over ('sample', 'x'),
        drawn with its distribution: `strength` (and what else is random),
        `critical_stress`, `critical_position`, ...
    sensitivities : xarray.Dataset
        Of `design_stress`: what moves the design, over 'source', the widest first: the setting
        at either end (`low`, `high`) and `force_at_low`, `force_at_high`, N, and the same of the
        stress, Pa. Attributes ``stress by ...`` are of each family of the factor between
        specimens. ``sensitivities.to_dataframe().to_csv(path)`` writes a file, and
        `stiction.plot.sensitivities` draws it.
    characteristic_stress, confidence : float
        Of `design_stress`, where specimens were counted: the stress below which 5 % of the
        specimens slide, with this confidence (EN 1990: 75 %), Pa; NaN otherwise. It is a quantile
        over equally likely interfaces.
    partial_factor, reliability_index : float
        `characteristic_stress` over `stress`, and the quantile of the normal distribution for the
        probability, with its sign changed.
    of_stress : bool
        Whether the stress is estimated, as by `design_stress`, or the probability.
    quantity : str
        What the text of the answer begins with: 'stress', 'force' or 'friction_coefficient', as was
        asked; of `design_stress` the force where the area is known.
    """

    stress: float
    probability: float
    interval: tuple[float, float]
    cv: float
    members_cv: float = 0.0
    evaluations: int
    first_stage_evaluations: int = 0
    lower_bound: float
    algorithm: str
    reason: str
    survived: float = 0.0
    warnings: tuple[str, ...]
    normal_pressure: float
    area: float = math.nan
    members: Array = field(default_factory=lambda: np.zeros(0), repr=False)
    failing_profiles: xr.Dataset = field(default_factory=xr.Dataset, repr=False)
    sensitivities: xr.Dataset = field(default_factory=xr.Dataset, repr=False)
    characteristic_stress: float = math.nan
    confidence: float = 0.75
    of_stress: bool = False
    quantity: str = "stress"

    @classmethod
    def of(cls, estimate: Estimate, doubts: Sequence[str] = (), **more: Any) -> Self:
        """Return the answer from an estimate and what is given; issue doubts as warnings."""
        for text in doubts:
            warn_accuracy(text)
        state, tail = estimate.state, estimate.tail
        known = {name: getattr(estimate, name) for name in ESTIMATED if name not in more}
        return cls(
            lower_bound=state.bounds[0],
            normal_pressure=state.experiment.pressure,
            area=state.experiment.problem.area or math.nan,
            evaluations=tail.spent,
            first_stage_evaluations=sum(o.first_stage_evaluations for o in tail.repetitions),
            algorithm=tail.algorithm,
            reason=tail.reason,
            survived=tail.survived,
            warnings=(),
            **known,
            **more,
        )

    @property
    def friction_coefficient(self) -> float:
        """`stress` over the mean normal pressure; NaN without one."""
        return self.stress / self.normal_pressure

    @property
    def force(self) -> float:
        """`stress` times the area of the interface, N; NaN where that is unknown."""
        return self.stress * self.area

    @property
    def partial_factor(self) -> float:
        """Characteristic value over the design value."""
        return self.characteristic_stress / self.stress

    @property
    def reliability_index(self) -> float:
        """Index beta, for which the normal distribution has the probability below -beta."""
        return -float(ndtri(self.probability))

    @property
    def band(self) -> tuple[float, float]:
        """90 % band of the probability over equally likely interfaces; NaN of a single one.

        5 % of them have at most the one, 95 % at most the other. More tests make it
        narrower. It is too wide by the sampling error of each interface, which a smaller
        `target_cv` lowers. An end is NaN if `members` is so at its rank, above the interfaces of
        probability 0, as of lists of thousands: take one of tens. The error of the mean is
        `interval`.
        """
        return band_of(self.members)

    @property
    def stress_above_bound(self) -> float:
        """`stress` less `lower_bound`, Pa."""
        return self.stress - self.lower_bound

    def _summary(self) -> Summary:
        ends = self.interval if self.of_stress else ()

        def over(name: str, scale: float, unit: str) -> Row:
            return Row(name, self.stress * scale, [end * scale for end in ends], unit)

        rows = [
            over("stress", 1.0, "Pa"),
            over("force", self.area, "N"),
            over("friction coefficient", 1.0 / self.normal_pressure, "1"),
        ]
        rows.sort(key=lambda row: row.name != self.quantity.replace("_", " "))
        chance = Row("probability", self.probability, () if ends else self.interval)
        rows.insert(len(rows) if ends else 0, chance)
        rows += [
            Row("reliability index", self.reliability_index),
            Row("lower bound of the stress", self.lower_bound or math.nan, (), "Pa"),
            Row("characteristic stress", self.characteristic_stress, (), "Pa"),
            Row("partial factor", self.partial_factor),
        ]
        known = [row for row in rows if math.isfinite(row.value)]
        title = "Design value" if self.of_stress else "Probability of sliding"
        basis = f"{self.algorithm}, {self.evaluations} evaluations: {self.reason}"
        return Summary(title, known, "95 % interval", [basis, *self.warnings])

    def __str__(self) -> str:
        if self.of_stress and math.isinf(self.stress):
            return (
                f"no stress has P = {self.probability:g}: the event happens in"
                f" {1.0 - self.survived:.3g} of {self.evaluations} samples"
            )
        low, high = self.interval
        known = {
            "stress": f"{self.stress / 1e6:.7g} MPa",
            "force": f"force {in_words('N', self.force)}",
            "friction_coefficient": f"friction coefficient {self.friction_coefficient:.4g}",
        }
        result = known.pop(self.quantity)
        if self.of_stress:
            ends = f"{low / 1e6:.7g} to {high / 1e6:.7g}"
            if self.quantity == "force":
                ends = " to ".join(in_words("N", end * self.area) for end in (low, high))
            result += f" (95 %: {ends}) at P = {self.probability:g}"
        else:
            chance = f"P = {self.probability:.3g} (95 %: {low:.3g} to {high:.3g},"
            result = f"{chance} c.o.v. {self.cv:.2g}) below {result}"
        equivalents = [
            text for name, text in known.items() if math.isfinite(getattr(self, name))
        ]
        result += f" ({', '.join(equivalents)})" if equivalents else ""
        if bounded(self.lower_bound):
            above = self.stress_above_bound / 1e3
            result += f", {abs(above):.4g} kPa {'above' if above >= 0.0 else 'below'} the bound"
        if self.survived:
            result += f"; {self.survived:.3g} of plain samples survive any stress"
        if self.members.size:
            result += f"; the mean over {self.members.size} equally likely interfaces"
            band = zip(("5 %", "95 %"), self.band, strict=True)
            parts = [f"{share} have at most P = {p:.2g}" for share, p in band if p >= 0.0]
            result += f", of which {' and '.join(parts)}" if parts else ""
        if self.members_cv:
            sampled = math.sqrt(max(self.cv**2 - self.members_cv**2, 0.0))
            result += f" (c.o.v. by the list {self.members_cv:.2g}, by sampling {sampled:.2g})"
        if self.algorithm == "exact":
            return f"{result}; {self.reason}"
        result += f"; {self.algorithm}, {self.evaluations} evaluations"
        return "\n".join([result, *self._moved()])

    def _moved(self) -> list[str]:
        """Return what moves a design, as lines."""
        effects = self.sensitivities
        if not effects.sizes.get("source"):
            return []
        unit = "Pa" if math.isnan(self.area) else "N"
        area = 1.0 if math.isnan(self.area) else self.area
        lines = [
            "  the interval holds the error of the computation only; what moves the design:",
            *(
                f"    {name}: {low} to {high}: {in_words(unit, area * at_low)} to"
                f" {in_words(unit, area * at_high)}"
                for name, low, high, at_low, at_high in zip(
                    effects.source.values, effects.low.values, effects.high.values,
                    effects.stress_at_low.values, effects.stress_at_high.values, strict=True,
                )
            ),
        ]  # fmt: skip
        families = [
            f"{name.removeprefix('stress by ')} {in_words(unit, area * value)}"
            for name, value in effects.attrs.items()
            if name.startswith("stress by ")
        ]
        if len(families) > 1:
            lines.append(
                f"    by family of the factor between specimens: {', '.join(families)}"
            )
        return lines


def band_of(members: Array) -> tuple[float, float]:
    """Return the 90 % band over equally likely interfaces; NaN where its rank is not known."""
    if not members.size:
        return math.nan, math.nan
    # Unknown probabilities are small, but above those that are exactly zero.
    shares = np.array([0.05, 0.95])
    ends = np.quantile(np.nan_to_num(members), shares)
    zeros, known_from = np.sum(members == 0.0), np.sum(~(members > 0.0))
    ranks = shares * (members.size - 1)
    hidden = (zeros < known_from) & (np.ceil(ranks) >= zeros) & (np.floor(ranks) < known_from)
    low, high = np.where(hidden, math.nan, ends).tolist()
    return low, high


def prepare(
    experiment: Experiment,
    event: StressName,
    workers: int | None,
    meter: Meter,
    max_evaluations: int | None,
    *,
    algorithm: str = "subset",
    per_pressure: bool = False,
) -> tuple[LimitState, int]:
    """Return the limit state and the evaluations allowed; refuse what takes too long."""
    state = LimitState(experiment, event, per_pressure, workers or usable_cores(), meter)
    problems = []
    if per_pressure and not experiment.pressure > 0.0:
        problems.append(
            "friction_coefficient: needs a normal pressure (load.normal_pressure, Pa, or"
            " load.pressing_force, N)"
        )
    if algorithm in ("subset", "two_level") and (slow := too_slow(experiment, max_evaluations)):
        problems.append(f"method: {slow}")
    elif algorithm == "two_level" and (reason := two_levels_refused(state)):
        problems.append(f"algorithm: 'two_level' is not possible: {reason}")
    if problems:
        raise InputError(problems)
    check_fields([experiment])
    seconds = COUNTING_SECONDS if too_slow(experiment, max_evaluations) else PATIENCE_SECONDS
    return state, max_evaluations or int(
        min(MOST_EVALUATIONS, max(FEWEST_EVALUATIONS, seconds / experiment.seconds))
    )


def too_slow(experiment: Experiment, max_evaluations: int | None) -> str | None:
    """Return why chains of samples take too long by this method; None if allowed."""
    seconds, kind = CHAIN_EVALUATIONS * experiment.seconds, experiment.method.type
    fast = seconds <= PATIENCE_SECONDS and not optional_member(
        experiment.method, "counted_only"
    )
    if fast or (max_evaluations or 0) >= CHAIN_EVALUATIONS:
        return None
    return (
        f"{CHAIN_EVALUATIONS:,} evaluations of subset simulation by {kind!r} would take about"
        f" {seconds / 3600.0:.1g} h on one core; allow them with max_evaluations, or use plain"
        " Monte Carlo (algorithm='plain' of failure_probability, or st.monte_carlo)"
    )


def bounded(lowest: float) -> bool:
    """Return whether a least possible stress is a bound: zero and infinity are not."""
    return bool(np.isfinite(lowest) and lowest > 0.0)


def wanted_members(random: Any, cv: float, target_cv: float) -> int:
    """Return how many members to draw from a source instead, 0 for no more."""
    least = cv / (LIST_SHARE * target_cv)
    count = len(random.members)
    if getattr(random, "source", None) is None or least <= 1.0 or count >= MAX_MEMBERS:
        return 0
    return int(min(max(REQUEST_MARGIN * count * least * least, 2 * count), MAX_MEMBERS))


def few_members(random: Any, estimate: Answer | Estimate, target_cv: float) -> list[str]:
    """Return a warning if the list makes the estimate less precise than `target_cv`."""
    by_list = estimate.members_cv
    if not (estimate.cv > target_cv and by_list > LIST_SHARE * target_cv):
        return []
    members = np.nan_to_num(estimate.members)
    shares = np.cumsum(np.sort(np.bincount(random.kinds, members))[::-1])
    count = 1 + int(np.searchsorted(shares, CARRIED_SHARE * shares[-1]))
    advice = (
        "give what it was drawn from, a fit or a posterior, in its place: more are then drawn; or"
        " a longer list (count of [uncertain])"
    )
    if random.source is not None:
        advice = (
            "no more differ, or no more are drawn: take more repetitions of a fit (bootstrap=), or"
            " give infer a longer list"
        )
    return [
        f"the list of interfaces is a sample, and {count} of its {shares.size} different ones carry"
        f" {CARRIED_SHARE:.0%} of the mean: by this alone the coefficient of variation is"
        f" {by_list:.2g} (target {target_cv:g}); {advice}; more profiles or tests make them"
        " more alike"
    ]


def imprecise(cv: float, target_cv: float, evaluations: int) -> list[str]:
    """Return a warning if the estimate is less precise than `target_cv`."""
    advice = "raise max_evaluations"
    if math.isfinite(cv):
        advice += f" to about {REQUEST_MARGIN * evaluations * (cv / target_cv) ** 2:.1g}"
    text = (
        f"the coefficient of variation by sampling is {cv:.3g}, not {target_cv:.3g}: {evaluations}"
        f" evaluations do not suffice; {advice}, or target_cv"
    )
    return [text] if cv > target_cv else []


def different(values: Array, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return up to `count` positions with different values, in random order."""
    _, first = np.unique(values, return_index=True)  # chains repeat states
    chosen: NDArray[np.int64] = rng.permutation(first)[:count]
    return chosen


def exact_doubts(
    state: LimitState, near: tuple[Array, Array], stress: float, probability: float
) -> list[str]:
    """Solve some samples of an approximate method exactly; warn if more or fewer fail.

    `near` holds draws and stresses on both sides of the stress, the lowest there are. In a tail a
    difference that is negligible in stress may multiply a probability, so failures are counted.
    """
    experiment, (draws, values) = state.experiment, near
    exact = exact_counterpart(experiment.problem, experiment.method)
    if exact is None or not values.size:
        return []
    seconds = seconds_per_sample(experiment.problem, exact)
    count = int(np.clip(CHECK_SECONDS / seconds, *EXACT_CHECKS))
    chosen = different(values, count, np.random.default_rng(0))
    state.meter.note = f"checking by {exact.label}"
    with collect_warnings():
        fails_exactly = state.by(exact)(draws[chosen]) < stress
    fails = values[chosen] < stress
    failed, failed_exactly, differing = (
        int(np.sum(which)) for which in (fails, fails_exactly, fails != fails_exactly)
    )
    if abs(failed_exactly - failed) <= 2.0 * math.sqrt(max(differing, 1)):
        return []
    there = min(probability * max(failed_exactly, 1) / max(failed, 1), 1.0)
    return [
        f"of {chosen.size} samples in the tail {failed} fail by the {experiment.method.label} and"
        f" {failed_exactly} by {exact.label}: by {exact.label} the probability of failure is"
        f" {'about' if failed_exactly else 'below'} {there:.2g} instead of {probability:.2g}; use"
        " method=st.Equilibrium()"
    ]
