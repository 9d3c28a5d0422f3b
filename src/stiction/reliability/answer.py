"""Answers on failure probability, and the checks that they share."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, Self, TypeAlias, TypeVar

import numpy as np
import xarray as xr
from numpy.typing import NDArray
from pydantic import Field
from scipy.special import ndtri

from stiction.base.arrays import Array
from stiction.base.errors import (
    InputError,
    Warned,
    collect_warnings,
    merge_warnings,
    texts_of,
    warn_accuracy,
)
from stiction.base.model import Count, FilePath, Real, Text, checked
from stiction.base.progress import Meter, Show
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import in_words
from stiction.ensemble.batches import usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState, StressName
from stiction.ensemble.monte_carlo import check_fields
from stiction.methods.onset import exact_counterpart
from stiction.methods.protocol import optional_member, seconds_per_sample
from stiction.problem.problem import Problem
from stiction.random.equally_likely import MAX_MEMBERS, specimens_of_fit
from stiction.reliability.counting import CONFIDENCE
from stiction.reliability.tail import TailPoint, guide_of

TargetCv: TypeAlias = Annotated[Real, Field(ge=1e-6, le=1)]
"""A smaller one would take more than 1e12 failures. A larger one is not an estimate."""
Probability: TypeAlias = Annotated[Real, Field(ge=1e-30, lt=1)]
Budget: TypeAlias = Annotated[Count, Field(ge=100)]

COUNTING_SECONDS, FEWEST_EVALUATIONS, MOST_EVALUATIONS = 100.0, 1_000, 2_000_000
"""Computing time of counting by a slow method, and fewest and most evaluations by default."""
CHAIN_EVALUATIONS, PATIENCE_SECONDS = 20_000, 900.0
"""Evaluations of subset simulation for about P = 1e-4 with a cv of 0.1, and longest time of
evaluations on one core, s, unless `max_evaluations` allows more."""
LIST_SHARE, SAMPLING_SHARE = 0.6, 0.8
"""Parts of the target for the errors by the list of interfaces and by sampling. Squares add up."""
REQUEST_MARGIN, CARRIED_SHARE = 1.2, 0.9
"""Margin on the wanted number of members, and share of the mean that a warning reports."""
FRESH = 1.5
"""Least ratio of different members that makes a longer list worthwhile."""
EXACT_CHECKS = (8, 64)
"""Fewest and most samples of an approximate method that are solved exactly as a check."""
CHECK_SECONDS = 10.0
"""Seconds of one core for this check."""
ESTIMATED = ("stress", "probability", "cv", "members_cv", "members")
"""Attributes of an answer that a `TailPoint` has."""


F = TypeVar("F", "Answer", TailPoint)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Answer(Result):
    """A stress, and the probability that an interface slides below it.

    Attributes
    ----------
    stress, probability : float
        Stress, Pa, and probability of an onset below this stress. One
        is given, and the other is estimated.
    interval : tuple of float
        95 % confidence interval of the estimated number.
    cv : float
        Coefficient of variation of the probability: estimated standard
        error over the estimate. It is infinite without a failure, and
        zero if the answer is exact.
    members_cv : float
        Part of `cv` that arises because a list of equally
        likely interfaces is only a sample of the interfaces
        that may be true. The squares of this part and the
        sampling error add up. 0 for a single interface.
    evaluations, first_stage_evaluations : int
        Samples solved by the method, and samples solved only by its
        less expensive first stage.
    lower_bound, stress_above_bound : float
        No sample slides below `lower_bound`, Pa, which is
        minus infinity if unknown. `stress_above_bound` is
        `stress` minus this bound.
    algorithm, reason : str
        'plain', 'subset', 'two_level' or 'exact' (without samples), and
        the reason for this choice.
    members : (members,) array
        For a list of equally likely interfaces, the probability for
        each interface. NaN if fewer than three samples of an interface
        slide below the stress. Their mean is `probability`, the
        predictive probability, on which a decision should rest.
    survived : float
        Share of plain samples in which the event does not happen at any
        stress. With a stiff machine, an interface may stay stable and
        carry any load.
    warnings : tuple of str
        Reasons not to trust the answer. Empty if there are no such reasons.
    doubts : tuple of str
        Doubts of the fit or posterior behind the answer.
    normal_pressure, friction_coefficient : float
        Mean pressure, Pa, and `stress` over
        it. NaN without a normal pressure.
    area, force : float
        Area of the interface, m², and `stress` times the area, N. NaN
        if the area is unknown: give ``Blocks(thickness=...)``, or
        ``Interface(width=...)`` for a line.
    failing_profiles : xarray.Dataset
        Given by `failure_probability`: some samples over ('sample',
        'x'), drawn from the distribution of failing samples. Variables
        are `strength` and other random properties, `critical_stress`,
        `critical_position`, ...
    sensitivities : xarray.Dataset
        Given by `design_stress`: effects on the design over 'source',
        the largest first. `low` and `high` are the settings at both
        ends. `force_at_low` and `force_at_high`, N, and `stress_at_low`
        and `stress_at_high`, Pa, are the designs there. Attributes
        ``stress by ...`` hold the stress for each family of the factor
        between specimens. ``sensitivities.to_dataframe().to_csv(path)``
        writes a file, and `stiction.plot.sensitivities` draws it.
    characteristic_stress, confidence : float
        Given by `design_stress` if specimens were counted: stress, Pa,
        below which 5 % of the specimens slide, with this confidence (EN
        1990: 75 %). It is a quantile over equally likely interfaces.
        NaN if specimens were not counted.
    partial_factor, reliability_index : float
        `characteristic_stress` over `stress`, and minus the quantile of
        the normal distribution at the probability.
    of_stress : bool
        True if the stress is estimated, as in `design_stress`. False if
        the probability is.
    quantity : str
        First quantity of the printed answer: 'stress', 'force' or
        'friction_coefficient', as requested. For `design_stress` it is
        the force if the area is known.
    specimens : int
        Number of measured specimens behind the scatter between
        specimens, or 0.
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
    specimens: int = 0
    doubts: tuple[str, ...] = ()

    @classmethod
    def at(cls, point: TailPoint, doubts: Sequence[str] = (), **more: Any) -> Self:
        """Return the answer at a point of a tail, and issue doubts as warnings.

        `more` contains further attributes, or replaces the attributes
        of the point.
        """
        for text in doubts:
            warn_accuracy(text)
        state, tail = point.state, point.tail
        known = {name: getattr(point, name) for name in ESTIMATED if name not in more}
        return cls(
            lower_bound=state.bounds[0],
            normal_pressure=state.experiment.pressure,
            area=state.experiment.problem.area or math.nan,
            evaluations=tail.spent,
            first_stage_evaluations=sum(d.first_stage_evaluations for d in tail.repetitions),
            algorithm=tail.algorithm,
            reason=tail.reason,
            survived=tail.survived,
            warnings=(),
            **known,
            **more,
        )

    @property
    def friction_coefficient(self) -> float:
        """`stress` over the mean normal pressure, or NaN without a pressure."""
        return self.stress / self.normal_pressure

    @property
    def force(self) -> float:
        """`stress` times the area of the interface, N, or NaN if the area is unknown."""
        return self.stress * self.area

    @property
    def partial_factor(self) -> float:
        """Characteristic value over the design value."""
        return self.characteristic_stress / self.stress

    @property
    def reliability_index(self) -> float:
        """Index beta: a standard normal variable is below -beta with this probability."""
        return -float(ndtri(self.probability))

    @property
    def band(self) -> tuple[float, float]:
        """90 % band of the probability over equally likely interfaces, NaN for a single interface.

        The probability is at most the first number for 5 % of the
        interfaces, and at most the second number for 95 %. More tests
        make the band narrower. The sampling error of each interface
        makes the band too wide, and a smaller `target_cv` reduces this
        error. An end is NaN if `members` is NaN at its rank, which is
        usual for lists of thousands. Use a list of tens in this case.
        `interval` shows the error of the mean.
        """
        return band_of(self.members)

    @property
    def stress_above_bound(self) -> float:
        """`stress` minus `lower_bound`, Pa."""
        return self.stress - self.lower_bound

    @checked
    def write_page(
        self,
        path: FilePath,
        *,
        problem: Problem,
        evidence: Sequence[Any] = (),
        sources: Mapping[str, str] | None = None,
        title: Text = "Design of a joint",
    ) -> Path:
        """Write a design as an HTML page: force, inputs, evidence, doubts and sensitivities.

        Parameters
        ----------
        path : path
            HTML file.
        problem : Problem
            The problem for which the design was computed. Its constants are the inputs.
        evidence : sequence
            Results on which the design rests, such as a fit, a posterior or an agreement.
            They are printed on the page. Their doubts and notes are listed as doubts.
        sources : mapping, optional
            The sources of inputs by dotted key, such as ``{"load.pressing_force":
            "drawing 12"}``. An input without a source is called 'assumed'.
        title : str

        Returns
        -------
        path
            The file.

        Raises
        ------
        InputError
            If the answer is not a design.
        StoreError
            If the file cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> import stiction as st
        >>> problem = st.paper.problem(nodes=256)
        >>> strength = st.paper.strength(problem, correlation_ratio=1.0)
        >>> design = st.design_stress(
        ...     problem, strength, probability=1e-2, method=st.LocalCriterion(), target_cv=0.3
        ... )
        >>> page = design.write_page(
        ...     Path(tempfile.mkdtemp()) / "design.html", problem=problem
        ... )
        >>> "reliability index" in page.read_text()
        True
        """
        # The page is drawn by an upper layer, which is imported when it is needed.
        pages = import_module("stiction.cli.design_page")
        place = Path(path)
        pages.write_page(self, place, problem, evidence, sources or {}, title)
        return place

    def _summary(self) -> Summary:
        ends = self.interval if self.of_stress else ()

        def over(name: str, scale: float, unit: str) -> Row:
            return Row(name, self.stress * scale, [end * scale for end in ends], unit)

        rows = [
            over("stress", 1.0, "Pa"),
            over("force", self.area, "N"),
            over("friction coefficient", 1.0 / self.normal_pressure, "1"),
        ]
        # The requested quantity comes first, and the other number of
        # the answer beside it.
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
        return Summary(title, known, "95 % interval", [basis, *self.warnings, *self.doubts])

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
            result = f"{chance} cv {self.cv:.2g}) below {result}"
        finite = [name for name in known if math.isfinite(getattr(self, name))]
        equivalents = [known[name] for name in finite]
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
            result += f" (cv by the list {self.members_cv:.2g}, by sampling {sampled:.2g})"
        if self.algorithm == "exact":
            result += f"; {self.reason}"
        else:
            result += f"; {self.algorithm}, {self.evaluations} evaluations"
        return "\n".join([result, *self._moved(), *(f"  ! {text}" for text in self.doubts)])

    def _moved(self) -> list[str]:
        """Return lines of text that show how each assumption changes the design."""
        effects = self.sensitivities
        if not effects.sizes.get("source"):
            return []
        unit, area = ("Pa", 1.0) if math.isnan(self.area) else ("N", self.area)
        lines = [
            "  the interval holds the error of the computation only; what moves the design:"
        ]
        for row in effects.to_dataframe().itertuples():
            ends = [
                in_words(unit, area * end) for end in (row.stress_at_low, row.stress_at_high)
            ]
            lines.append(f"    {row.Index}: {row.low} to {row.high}: {' to '.join(ends)}")
        families = [
            f"{name.removeprefix('stress by ')} {in_words(unit, area * value)}"
            for name, value in effects.attrs.items()
            if name.startswith("stress by ")
        ]
        if len(families) > 1:
            lines.append(
                f"    by family of the factor between specimens: {', '.join(families)}"
            )
        return lines + [f"    {text}" for text in unseen_batch(self.specimens)]


def unseen_batch(specimens: int) -> list[str]:
    """Return a sentence on the batch that so many specimens cannot exclude with 95 % confidence."""
    if not specimens:
        return []
    unseen = 1.0 - (1.0 - CONFIDENCE) ** (1.0 / specimens)
    return [
        f"{specimens} specimens cannot exclude a weaker batch with a share of up to"
        f" {unseen:.0%} of all specimens"
    ]


def band_of(members: Array) -> tuple[float, float]:
    """Return the 90 % band over equally likely interfaces. An end is NaN if its value is NaN."""
    if not members.size:
        return math.nan, math.nan
    # Unknown probabilities are small, but above those that are exactly zero.
    shares = np.array([0.05, 0.95])
    ends = np.quantile(np.nan_to_num(members), shares)
    zeros, known_from = np.sum(members == 0.0), np.sum(~(members > 0.0))
    # A quantile lies between the two ranks around it. It is unknown if
    # either is unknown.
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
    executor: Executor | None = None,
) -> tuple[LimitState, int]:
    """Return the limit state and the allowed evaluations, or refuse a method that is too slow."""
    threads = workers or usable_cores()
    state = LimitState(experiment, event, per_pressure, threads, meter, executor)
    problems = []
    if per_pressure and not experiment.pressure > 0.0:
        problems.append("friction_coefficient: needs load.normal_pressure or pressing_force")
    if algorithm in ("subset", "two_level") and (slow := too_slow(experiment, max_evaluations)):
        problems.append(f"method: {slow}")
    elif algorithm == "two_level" and isinstance(reason := guide_of(state), str):
        problems.append(f"algorithm: 'two_level' is not possible: {reason}")
    if problems:
        raise InputError(problems)
    # Warnings come after errors: nobody needs a warning about a call
    # that is refused.
    check_fields([experiment])
    seconds = COUNTING_SECONDS if too_slow(experiment, max_evaluations) else PATIENCE_SECONDS
    return state, max_evaluations or int(
        min(MOST_EVALUATIONS, max(FEWEST_EVALUATIONS, seconds / experiment.seconds))
    )


def too_slow(experiment: Experiment, max_evaluations: int | None) -> str | None:
    """Return why chains of samples take too long with this method, or None."""
    seconds, method = CHAIN_EVALUATIONS * experiment.seconds, experiment.method
    fast = seconds <= PATIENCE_SECONDS and not optional_member(method, "counted_only")
    if fast or (max_evaluations or 0) >= CHAIN_EVALUATIONS:
        return None
    return (
        f"{CHAIN_EVALUATIONS:,} evaluations of subset simulation by {method.type!r} take about"
        f" {seconds / 3600.0:.1g} h. Allow them with max_evaluations, or count: algorithm='plain'"
    )


def bounded(lowest: float) -> bool:
    """Return whether the least stress is a useful bound: finite and above zero."""
    return bool(np.isfinite(lowest) and lowest > 0.0)


def sampling_target(state: LimitState, target_cv: float) -> float:
    """Return the part of the target that is left for the sampling error."""
    return target_cv * (SAMPLING_SHARE if state.several else 1.0)


def wanted_members(random: Any, cv: float, target_cv: float) -> int:
    """Return the number of members to draw from a source, 0 if there are enough."""
    least = cv / (LIST_SHARE * target_cv)  # the error falls with the root of the number
    count = len(random.members)
    if random.source is None or least <= 1.0 or count >= MAX_MEMBERS:
        return 0
    return int(min(max(REQUEST_MARGIN * count * least * least, 2 * count), MAX_MEMBERS))


def answered(
    experiment: Experiment,
    target_cv: float,
    name: str,
    progress: Show,
    solve: Callable[[Experiment, Meter], Answer],
) -> Answer:
    """Return an answer, and its warnings, from as many members as the target needs."""
    with Meter(name, show=progress) as meter, merge_warnings() as warned:
        warn_of_field(experiment)
        experiment, answer = with_enough_members(experiment, target_cv, meter, warned, solve)
        for text in few_members(experiment.random, answer, target_cv):
            warn_accuracy(text)
    source = experiment.random.source
    return replace(
        answer,
        warnings=tuple(texts_of(warned)),
        doubts=(*getattr(source, "doubts", ()), *getattr(source, "notes", ())),
        specimens=getattr(source, "specimens", 0),
    )


def warn_of_field(experiment: Experiment) -> None:
    """Warn about the field of a fit in place of a fit with scatter between specimens."""
    if specimens_of_fit(experiment.random):
        warn_accuracy(
            "random: is the field of a fit, without the scatter between specimens, so that failures"
            " are too rare. Pass the fit itself"
        )


def with_enough_members(
    experiment: Experiment,
    target_cv: float,
    meter: Meter,
    warned: list[Warned],
    solve: Callable[[Experiment, Meter], F],
) -> tuple[Experiment, F]:
    """Return a solution with enough members for the error due to the list.

    A source draws more members until the error is small enough.
    """
    while True:
        solution, known = solve(experiment, meter), experiment.random
        if not (count := wanted_members(known, solution.members_cv, target_cv)):
            return experiment, solution
        meter.note = f"{count:,} interfaces, cv by the list {solution.members_cv:.2g}"
        larger = known.larger(count, experiment.seed)
        # A posterior over a list has hardly more different members,
        # however many are drawn.
        if larger.kinds.max() + 1 < FRESH * (known.kinds.max() + 1):
            return experiment, solution
        experiment = replace(experiment, random=larger)
        warned.clear()  # the new solution warns again where it must


def few_members(random: Any, estimate: Answer | TailPoint, target_cv: float) -> list[str]:
    """Return a warning if the list makes the estimate less precise than `target_cv`."""
    by_list = estimate.members_cv
    if not (estimate.cv > target_cv and by_list > LIST_SHARE * target_cv):
        return []
    # Add up the probabilities of equal interfaces, the largest first.
    # None may be known.
    members = np.nan_to_num(estimate.members)
    shares = np.cumsum(np.sort(np.bincount(random.kinds, members))[::-1])
    count = 1 + int(np.searchsorted(shares, CARRIED_SHARE * shares[-1]))
    carried = f", and {count} of its {shares.size} different ones carry {CARRIED_SHARE:.0%}"
    advice = "Give the fit or posterior itself, from which more are drawn, or a longer list"
    if random.source is not None:
        advice = "Take more repetitions of the fit (bootstrap=), or give infer a longer list"
    return [
        f"the list of interfaces is a sample{f'{carried} of the mean' * bool(shares[-1])}. By this"
        f" alone the coefficient of variation is {by_list:.2g} (target {target_cv:g}). {advice}, or"
        " measure more"
    ]


def imprecise(cv: float, target_cv: float, evaluations: int) -> list[str]:
    """Return a warning if the estimate is less precise than `target_cv`."""
    advice = "raise max_evaluations"
    if math.isfinite(cv):
        advice += f" to about {REQUEST_MARGIN * evaluations * (cv / target_cv) ** 2:.1g}"
    text = (
        f"the coefficient of variation by sampling is {cv:.3g} after {evaluations} evaluations, but"
        f" {target_cv:.3g} was wanted. To reach it, {advice}, or accept a larger target_cv"
    )
    return [text] if cv > target_cv else []


def different(values: Array, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return up to `count` positions of distinct values, in random order."""
    _, first = np.unique(values, return_index=True)  # chains repeat states
    chosen: NDArray[np.int64] = rng.permutation(first)[:count]
    return chosen


def exact_doubts(point: TailPoint) -> list[str]:
    """Solve some samples exactly if the method is approximate. Warn if more or fewer samples fail.

    These are some of the lowest samples on both sides of the stress.
    Failures are counted, because in a tail a small change of stress may
    multiply the probability.
    """
    state, stress = point.state, point.stress
    experiment, (population, near) = state.experiment, point.tail.repetitions[-1].around(stress)
    exact = exact_counterpart(experiment.problem, experiment.method)
    if exact is None or not near.size:
        return []
    seconds = seconds_per_sample(experiment.problem, exact)
    # Different values, because samples of a chain repeat.
    count = int(np.clip(CHECK_SECONDS / seconds, *EXACT_CHECKS))
    chosen = near[different(population.values[near], count, np.random.default_rng(0))]
    state.meter.note = f"checking by {exact.label}"
    with collect_warnings():
        fails_exactly = state.by(exact)(population.draws[chosen]) < stress
    fails = population.values[chosen] < stress
    failed, failed_exactly = int(fails.sum()), int(fails_exactly.sum())
    # If both methods are right on average, the samples that change
    # sides go both ways, and the difference of the counts has the
    # square root of their number as standard deviation.
    differing = int(np.sum(fails != fails_exactly))
    if abs(failed_exactly - failed) <= 2.0 * math.sqrt(max(differing, 1)):
        return []
    there = min(point.probability * max(failed_exactly, 1) / max(failed, 1), 1.0)
    return [
        f"of {chosen.size} samples in the tail {failed} fail by the {experiment.method.label} and"
        f" {failed_exactly} by {exact.label}. The probability by st.{type(exact).__name__}() is"
        f" {'about' if failed_exactly else 'below'} {there:.2g}, not {point.probability:.2g}."
        " Use it"
    ]
