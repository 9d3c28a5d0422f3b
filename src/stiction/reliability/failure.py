"""Failure probability, design stress and failure curve, estimated by counting or from the tail.

Problem. The onset T of a random interface has the distribution P(T < s). Estimate
the probability at a stress s, or the stress at a probability, with a given
coefficient of variation.

Sources. Each algorithm has its own file: `counting`, `factors`, `subset`,
`two_level`, `tail`.

Steps:

1. Answer at once if the stress lies outside the bounds of the onset.
2. Count many specimens for each solved field, if this costs less (`factors`).
3. Otherwise solve a pilot of plain samples. Count if failures are frequent, or if the
   method is too slow for chains (`counting`). Sample the tail if they are rare
   (`tail`).
4. If interfaces are drawn from a fit or a posterior, draw more interfaces until the
   error due to their number is small enough. Repeat steps 1 to 3.
5. If the method is approximate, solve some samples near the stress exactly. Warn if
   more or fewer of them fail (`answer.exact_doubts`).
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Literal, TypeVar

import numpy as np
import xarray as xr

from stiction.base.arrays import Array
from stiction.base.errors import InputError, Warned, merge_warnings, texts_of, warn_accuracy
from stiction.base.model import Count, Flag, Number, Positive, Progress, Real, checked
from stiction.base.progress import Meter, Show
from stiction.base.units import Doubt, doubt_units, in_words
from stiction.base.variables import ONSET_VARIABLES, PROFILES, Variable
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState, StressName, weakest_first
from stiction.methods.protocol import MethodObject, label
from stiction.problem.problem import Problem
from stiction.problem.results import along, study_attributes, to_dataset
from stiction.random.equally_likely import AnyRandom, as_random, origin
from stiction.random.spectra import Share
from stiction.reliability.answer import (
    Answer,
    Budget,
    Estimate,
    Probability,
    TargetCv,
    band_of,
    different,
    exact_doubts,
    few_members,
    imprecise,
    prepare,
    sampling_target,
    too_slow,
    wanted_members,
)
from stiction.reliability.counting import count_failures
from stiction.reliability.factors import Counts, count_tail
from stiction.reliability.sensitivities import sensitivities as sensitivities_of
from stiction.reliability.tail import Goal, Tail, sample_curve, sample_tail
from stiction.reliability.uncertainty import binomial_interval, generator, lognormal_interval

F = TypeVar("F", Answer, Estimate)

PILOT_SAMPLES = 1_000
"""Number of plain samples that decide about the algorithm."""
FREQUENT = 0.01
"""Probability above which counting needs no more evaluations than subset simulation."""
FRESH = 1.5
"""Least ratio of different members that makes a longer list worthwhile."""
CURVE_CV = 0.3
"""Coefficient of variation at the end of a curve by default."""
COMMONEST, PER_DECADE = 0.5, 3
"""Probability at the beginning of a curve, and points per decade."""
NEGLIGIBLE_PROBABILITY = 1e-15
"""Probability of failing, or of holding, below which no sample is drawn."""
DOUBTFUL = 0.02
"""Share of the mean strength below which a stress is probably in another unit."""
THOUSAND = 1e3
"""Ratio to the mean strength that means another unit, such as kN for N or MPa for Pa."""
SHOWN_PROFILES = 20
"""Number of failing profiles in an answer."""
CHECKED_FAILURES = 32
"""Number of failures among the samples that equilibrium solves, too."""
COVERED = 0.8
"""Share of the failures below which the first stage leads to a warning."""

CURVE: dict[str, Variable] = {
    name: Variable(unit, text, ("point",))
    for name, unit, text in (
        ("stress", "Pa", "stress"),
        ("stress_above_bound", "Pa", "stress above its lower bound"),
        ("friction_coefficient", "1", "stress over the mean normal pressure"),
        ("force", "N", "stress times the area of the interface"),
        ("probability", "1", "probability of an onset below the stress"),
        ("probability_low", "1", "lower end of the interval of the probability"),
        ("probability_high", "1", "upper end of the 95 % interval of the probability"),
        ("cv", "1", "coefficient of variation of the probability"),
        ("stress_low", "Pa", "lower end of the interval of the stress"),
        ("stress_high", "Pa", "upper end of the interval of the stress"),
        ("band_low", "1", "probability that 5 % of the interfaces do not exceed"),
        ("band_high", "1", "probability that 95 % of the interfaces do not exceed"),
        ("members_cv", "1", "part of the coefficient of variation by the list of interfaces"),
    )
}
CURVE["members"] = Variable("1", "probability of each interface", ("point", "member"))
OF_A_LIST = ("band_low", "band_high", "members_cv", "members")


@checked
def failure_probability(
    problem: Problem,
    random: AnyRandom,
    stress: Real | None = None,
    *,
    method: MethodObject,
    friction_coefficient: Positive | None = None,
    force: Positive | None = None,
    algorithm: Literal["auto", "plain", "subset", "two_level"] = "auto",
    target_cv: TargetCv = 0.1,
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    event: StressName = "critical_stress",
    mixture: Flag = False,
    workers: Count | None = None,
    progress: Progress = True,
) -> Answer:
    """Estimate the probability that an interface of random strength slides below a stress.

    Parameters
    ----------
    problem, seed, workers, progress
        As in `monte_carlo`. The total number of samples that `progress` shows is an
        estimate.
    random : RandomInterface, RandomField, list of them, FieldFit or Posterior
        The members of a list are equally likely. A fit, a posterior, or any object
        with a method ``interfaces(count, seed)`` provides as many interfaces as the
        target needs, from 1,000 to 8,000. The answer is then their mean, the
        predictive probability, and has a `band`.
    stress : float, optional
        Mean shear stress to carry, Pa. Failure is an onset strictly below it.
    method : LocalCriterion, Equilibrium or Rupture
        `Rupture` and other methods that are too slow for subset simulation use
        plain Monte Carlo, unless `max_evaluations` is 20,000 or more.
    friction_coefficient : float, optional
        Instead of `stress`: ratio of the mean shear stress to carry to the mean
        normal pressure. If the pressure is random, the pressure of each sample is
        used.
    force : float, optional
        Instead of `stress`: shear force to carry, N. The area of the interface
        must be known.
    algorithm : {"auto", "plain", "subset", "two_level"}
        Plain Monte Carlo, subset simulation, or subset simulation by the local
        criterion with equilibrium as the last level. See the page 'Failure
        probability' of the documentation. `reason` in the result explains the
        choice of 'auto'.
    target_cv : float
        Coefficient of variation to reach, including the part due to the list of
        interfaces.
    max_evaluations : int, optional
        Largest number of samples to solve. The default takes about a quarter of an
        hour on one core, but is at most 2,000,000 samples. For ruptures it is 1,000.
    event : {"critical_stress", "first_instability"}
        Whether failure is sliding of the whole interface, or the first instability of
        a patch, which may be arrested. By the local criterion both are the same.
    mixture : bool
        Whether a list of interfaces is complete, for example three equally common
        batches. The interval then contains only the sampling error. By default the
        list is a sample of the interfaces that may be true, and a short list makes
        the interval wide.

    Returns
    -------
    Answer
        With `probability`, `cv`, `interval` (95 %), `evaluations` and more.

    Raises
    ------
    InputError
        If any argument is invalid. The message lists every problem.

    Warns
    -----
    AccuracyWarning
        If the estimate is unreliable. The result has the same text in `warnings`. If
        the method is the local criterion, equilibrium also solves some samples near
        the stress.
    UnitWarning
        If the stress is below a fiftieth of the mean strength, or above fifty times
        the mean strength. A factor of a thousand raises an `InputError`.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> found = st.failure_probability(problem, strength, 0.68e6, method=st.LocalCriterion())
    >>> low, high = found.interval
    >>> bool(0.0 < low < found.probability < high < 1.0)
    True
    """
    given = {"stress": stress, "force": force, "friction_coefficient": friction_coefficient}
    asked = [name for name, value in given.items() if value is not None]
    if len(asked) != 1:
        raise InputError(
            "stress: give exactly one of stress (Pa), force (N) and friction_coefficient. Got"
            f" {' and '.join(asked) or 'no value'}"
        )
    [name] = asked
    if force is not None:
        stress = problem.stress_of("force", force)

    def solve(experiment: Experiment, meter: Meter) -> Answer:
        state, budget = prepare(
            experiment, event, workers, meter, max_evaluations,
            algorithm=algorithm, per_pressure=stress is None,
        )  # fmt: skip
        wanted = stress
        if wanted is None:
            wanted = (friction_coefficient or 0.0) * experiment.pressure
        _check_unit(state, name, given[name] or 0.0, wanted)
        answer = _probability(state, wanted, algorithm, target_cv, budget, max_evaluations)
        return replace(answer, quantity=name)

    experiment = Experiment(problem, as_random(random, seed, mixture), method, seed=seed)
    return _answered(experiment, target_cv, "failure_probability", progress, solve)


def _answered(
    experiment: Experiment,
    target_cv: float,
    name: str,
    progress: Show,
    solve: Callable[[Experiment, Meter], Answer],
) -> Answer:
    """Return an answer, and its warnings, from as many members as the target needs."""
    with Meter(name, show=progress) as meter, merge_warnings() as warned:
        experiment, answer = _of_enough_members(experiment, target_cv, meter, warned, solve)
        for text in few_members(experiment.random, answer, target_cv):
            warn_accuracy(text)
    source = origin(experiment.random)
    return replace(
        answer,
        warnings=tuple(texts_of(warned)),
        doubts=(*getattr(source, "doubts", ()), *getattr(source, "notes", ())),
        specimens=getattr(source, "specimens", 0),
    )


def _of_enough_members(
    experiment: Experiment,
    target_cv: float,
    meter: Meter,
    warned: list[Warned],
    solve: Callable[[Experiment, Meter], F],
) -> tuple[Experiment, F]:
    """Return a solution with enough members for the error due to the list (step 4)."""
    while True:
        solution, known = solve(experiment, meter), experiment.random
        if not (count := wanted_members(known, solution.members_cv, target_cv)):
            return experiment, solution
        meter.note = f"{count:,} interfaces, c.o.v. by the list {solution.members_cv:.2g}"
        larger = known.larger(count, experiment.seed)
        # The list of a posterior over a list has few more different members.
        if larger.kinds.max() + 1 < FRESH * (known.kinds.max() + 1):
            return experiment, solution
        experiment = replace(experiment, random=larger)
        warned.clear()


def _check_unit(state: LimitState, name: str, given: float, stress: float) -> None:
    """Warn about a stress far from the mean strength. Refuse it if the ratio is a thousand."""
    ratio = stress / state.experiment.mean_strength
    unit = f" {CURVE[name].units}".removesuffix(" 1")
    possible = 1.0 / THOUSAND, THOUSAND
    least = possible[0] if stress <= state.bounds[0] else DOUBTFUL
    if ratio > 0.0:
        text = (
            f"{name}: {given:g}{unit} is {ratio:.2g} times the mean strength,"
            f" {in_words(CURVE[name].units, given / ratio)}. Check the unit (Pa, N or none)"
        )
        doubt_units([Doubt(text, ratio, (least, 1.0 / DOUBTFUL), possible)])


def _probability(
    state: LimitState, stress: float, algorithm: str, target_cv: float, budget: int,
    allowed: int | None,
) -> Answer:  # fmt: skip
    """Return the answer from the chosen algorithm (steps 1 to 3)."""
    # 1.
    likely = state.likely_bounds(NEGLIGIBLE_PROBABILITY)
    if not likely[0] < stress < likely[1]:
        return _certain(state, stress, likely)
    reason, pilot, least = "as requested", None, min(PILOT_SAMPLES, max(budget // 5, 50))
    goal = Goal(sampling_target(state, target_cv), stress)
    if algorithm == "auto" and (slow := too_slow(state.experiment, allowed)):
        algorithm, reason = "plain", slow
    elif algorithm == "auto":
        # 2.
        if counted := count_tail(state, goal, budget):
            return _by_tail(Estimate(state, counted[1], stress), goal.cv, counted[0])
        # 3.
        state = weakest_first(state)
        draws = state.draws(state.experiment.seed, 0, least)
        pilot = draws, state(draws)
        failures = int(np.sum(pilot[1] < stress))
        rare = failures < FREQUENT * least
        algorithm = "auto" if rare else "plain"
        reason = f"{failures} failure{'s' * (failures != 1)} of {least} plain samples: "
        reason += "rare" if rare else "frequent enough to count"
    if algorithm == "plain":
        begun = 0 if pilot is None else least
        return _by_counting(state, goal, budget, least, begun, reason)
    if algorithm != "auto":
        state = weakest_first(state)
    tail = sample_tail(
        state, goal, algorithm=algorithm, budget=budget, reason=reason, pilot=pilot
    )
    return _by_tail(Estimate(state, tail, stress), goal.cv)


def _certain(state: LimitState, stress: float, likely: tuple[float, float]) -> Answer:
    """Return an answer that needs no samples (step 1)."""
    certain = not state.bounds[0] < stress < state.bounds[1]
    low, high = state.bounds if certain else likely
    doubt = 0.0 if certain else NEGLIGIBLE_PROBABILITY
    chance = float(stress >= high)
    reason = f"no interface slides at or below {low:.7g} Pa"
    if chance:
        reason = f"no interface carries more than {high:.7g} Pa"
    reason += "" if certain else f", but for a probability below {doubt:g}"
    members = len(state.experiment.random.members)
    if state.is_sample:  # another list might have other bounds
        doubt = max(doubt, binomial_interval(0, members)[1])
    return Answer.of(
        Estimate(state, Tail((), "exact", reason), stress),
        probability=chance,
        interval=(chance - doubt, 1.0) if chance else (0.0, doubt),
        cv=0.0,
        members_cv=0.0,
        members=np.full(members if state.several else 0, chance),
    )


def _by_counting(
    state: LimitState, goal: Goal, budget: int, least: int, start: int, reason: str
) -> Answer:
    """Return the answer from plain Monte Carlo that begins with sample `start`.

    Samples of a pilot are not used, because their failures decide whether to count.
    """
    seed, stress = state.experiment.seed, goal.stress

    def drawn(numbers: Any) -> Array:
        rows = [state.draws(seed, start + int(one), 1) for one in numbers]
        return np.concatenate([np.empty((0, state.dimension)), *rows])

    count, counted = count_failures(
        state, seed, stress, target_cv=goal.cv, least=least, max_evaluations=budget - start,
        start=start,
    )  # fmt: skip
    stresses = counted.populations[0].values
    failed = np.flatnonzero(stresses < stress)
    # The weakest samples, with failures and others in their true shares.
    some = failed[:CHECKED_FAILURES]
    near = np.argsort(stresses[: some.max(initial=-1) + 1], kind="stable")[: 2 * some.size]
    estimate = Estimate(state, Tail([counted], "plain", reason, start + stresses.size), stress)
    cv, interval = math.hypot(count.cv, estimate.members_cv), count.interval()
    if estimate.members_cv:
        interval = lognormal_interval(count.probability, cv)
    doubts = imprecise(count.cv, goal.cv, estimate.tail.spent)
    doubts += exact_doubts(state, (drawn(near), stresses[near]), stress, count.probability)
    return Answer.of(
        estimate, doubts, probability=count.probability, cv=cv, interval=interval,
        failing_profiles=_profiles(state, drawn(failed[:SHOWN_PROFILES])),
    )  # fmt: skip


def _by_tail(estimate: Estimate, target_cv: float, counts: Counts | None = None) -> Answer:
    """Return the answer from a tail, or from counts of specimens."""
    state, tail, stress = estimate.state, estimate.tail, estimate.stress
    probability, last = estimate.probability, tail.repetitions[-1]
    interval = lognormal_interval(probability, estimate.cv)
    doubts = imprecise(estimate.sampling_cv, target_cv, tail.spent)
    if tail.algorithm == "two_level" and probability == 0.0:
        interval = 0.0, math.exp(last.populations[-1].log_probability)
        doubts = [
            f"{tail.short_of('a failure')}. The interval ends at the last level of the first stage"
        ]
    elif tail.algorithm == "two_level":
        covered = min(one.last for one in tail.repetitions)
        if covered < COVERED:
            doubts.append(
                f"the local criterion misses {1.0 - covered:.0%} of the failures, so that the"
                " estimate may be too low. Compare with algorithm='subset'"
            )
    elif counts:
        near = counts.lowest(stress, 2 * CHECKED_FAILURES)
        doubts += exact_doubts(state, near, stress, probability)
    elif tail.complete:
        doubts += exact_doubts(state, last.around(stress), stress, probability)
    else:
        there = tail.probability(tail.reached), tail.cv(tail.reached)
        interval = 0.0, lognormal_interval(*there)[1]
        doubts = [f"{tail.short_of(f'{stress:.7g} Pa')}. The interval ends there"]
    if counts:
        draws = counts.failing(stress, SHOWN_PROFILES)
    else:
        draws, stresses = last.failing(stress)
        draws = draws[different(stresses, SHOWN_PROFILES, generator(state.experiment.seed, 2))]
    profiles = _profiles(state, draws)
    return Answer.of(estimate, doubts, interval=interval, failing_profiles=profiles)


def _profiles(state: LimitState, draws: Array) -> xr.Dataset:
    """Return labelled profiles and onsets for draws."""
    if not draws.shape[0]:
        return xr.Dataset()
    problem, method = state.experiment.problem, state.experiment.method
    profiles = state.profiles(draws)
    onset = state.experiment.onset(profiles)
    values = profiles | {name: onset[name] for name in ONSET_VARIABLES}
    meaning = {name: along(problem.interface, PROFILES[name]) for name in profiles}
    attributes = study_attributes(problem=problem, method=method)
    return label(problem, method, values, np.arange(len(draws)), attributes, meaning)


@checked
def design_stress(
    problem: Problem,
    random: AnyRandom,
    *,
    probability: Probability,
    method: MethodObject,
    target_cv: TargetCv = 0.1,
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    event: StressName = "critical_stress",
    mixture: Flag = False,
    confidence: Share = 0.75,
    sensitivities: Flag | dict[str, tuple[Real, Real]] | None = None,
    workers: Count | None = None,
    progress: Progress = True,
) -> Answer:
    """Estimate the stress below which the interface slides with a given probability.

    The design stress is a quantile of the onset stress. One set of repetitions gives
    the quantile.

    Parameters
    ----------
    probability : float
        Between 0 and 1, such as 1e-6.
    method : LocalCriterion or Equilibrium
        `Rupture`, or a method that would take more than a quarter of an hour on
        one core, is refused unless `max_evaluations` is 20,000 or more.
    target_cv : float
        Coefficient of variation to reach for the failure probability at the design
        stress.
    confidence : float
        Confidence of the `characteristic_stress`.
    sensitivities : bool or mapping, optional
        Whether to compute how families and constants affect the design. By default
        this is done if `random` is a fit, a posterior or `uncertain`. A mapping from
        dotted keys in the problem to ranges, such as
        ``{"problem.friction.residual_ratio": (0.6, 0.8)}``, replaces the usual 10 %
        on either side.
    problem, random, seed, max_evaluations, event, mixture, workers, progress
        As in `failure_probability`.

    Returns
    -------
    Answer
        With `stress`, its 95 % `interval` due to the error of the computation (Pa),
        and `sensitivities`.

    Raises
    ------
    InputError
        If any argument is invalid. The message lists every problem.

    Warns
    -----
    AccuracyWarning
        As in `failure_probability`, and if onsets accumulate at the bound.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> method = st.LocalCriterion()
    >>> found = st.design_stress(problem, strength, probability=1e-3, method=method, target_cv=0.3)
    >>> bool(found.stress > found.lower_bound)
    True
    """

    def solve(experiment: Experiment, meter: Meter) -> Answer:
        state, budget = prepare(experiment, event, workers, meter, max_evaluations)
        answer = _quantile(state, probability, target_cv, budget, confidence)
        source = getattr(experiment.random, "source", None)
        wanted = source is not None if sensitivities is None else bool(sensitivities)
        if wanted and math.isfinite(answer.stress):
            stated = sensitivities if isinstance(sensitivities, dict) else {}
            moved = sensitivities_of(state, probability, answer.stress, stated)
            answer = replace(answer, sensitivities=moved)
        return replace(answer, quantity="stress" if math.isnan(answer.area) else "force")

    experiment = Experiment(problem, as_random(random, seed, mixture), method, seed=seed)
    return _answered(experiment, target_cv, "design_stress", progress, solve)


def _quantile(
    state: LimitState, probability: float, target_cv: float, budget: int, confidence: float
) -> Answer:
    """Return the design stress, by counting or from the tail."""
    lowest = state.bounds[0]
    target_cv = sampling_target(state, target_cv)
    goal = Goal(target_cv, probability=probability)
    counted = count_tail(state, goal, budget)
    if counted:
        tail = counted[1]
    else:
        often = probability >= FREQUENT
        tail = sample_tail(
            weakest_first(state), goal, budget=budget, algorithm="subset" if often else "auto",
            reason="frequent" if often else "rare",
        )  # fmt: skip
    asked: dict[str, Any] = {"probability": probability, "of_stress": True}
    if not tail.complete:  # the tail ends at its lowest sample
        estimate = Estimate(state, tail, tail.extent[0])
        interval = (lowest, estimate.stress) if estimate.stress > lowest else state.bounds
        doubts = [tail.short_of(f"P = {probability:g}")]
        return Answer.of(
            estimate, doubts, interval=interval, cv=math.inf, members_cv=0.0, **asked
        )
    estimate, doubts = Estimate(state, tail, tail.quantile(probability)), []
    if math.isinf(estimate.stress):
        doubts.append(
            f"the event happens in {1.0 - tail.survived:.3g} of all samples, less than"
            f" P = {probability:g}. No stress has that probability"
        )
    bound = Estimate(state, tail, math.nextafter(lowest, math.inf))
    if bound.probability >= probability:
        estimate, asked["stress"] = bound, lowest
        doubts.append(
            f"{bound.probability:.2g} of all samples slide at the bound of {lowest:.7g} Pa, within"
            f" the accuracy of the method. The stress at P = {probability:g} is the bound itself"
        )
    doubts += imprecise(estimate.sampling_cv, target_cv, tail.spent)
    if tail.algorithm != "two_level":
        near = tail.repetitions[-1].around(estimate.stress)
        if counted:
            near = counted[0].lowest(estimate.stress, 2 * CHECKED_FAILURES)
        doubts += exact_doubts(state, near, estimate.stress, probability)
    interval = tail.stress_interval(probability, estimate.cv, lowest)
    if math.isinf(estimate.stress):
        interval = interval[0], math.inf
    if counted:
        asked["characteristic_stress"] = counted[0].characteristic(confidence)
        asked["confidence"] = confidence
    return Answer.of(estimate, doubts, interval=interval, **asked)


@checked
def failure_curve(
    problem: Problem,
    random: AnyRandom,
    *,
    method: MethodObject,
    smallest: Probability = 1e-9,
    target_cv: TargetCv = CURVE_CV,
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    event: StressName = "critical_stress",
    mixture: Flag = False,
    workers: Count | None = None,
    progress: Progress = True,
) -> xr.Dataset:
    """Estimate P(onset < s) from 0.5 down to a smallest probability, with three points per decade.

    Parameters
    ----------
    smallest : float
        Smallest probability of the curve.
    target_cv : float
        Coefficient of variation to reach at the smallest probability. It is lower at
        other points. Repetitions are added until it is reached. They are the same as
        in `Study.failure_curve` with the same numbers.
    problem, random, method, seed, max_evaluations, event, mixture, workers, progress
        As in `design_stress`.

    Returns
    -------
    xarray.Dataset
        Over 'point': `stress` and `stress_above_bound` (Pa), `probability` with
        `probability_low`, `probability_high` and `cv`, and `stress_low` and
        `stress_high` (Pa). If there is a normal pressure, `friction_coefficient` is
        the stress over the mean pressure. If the area is known, there is `force` (N).
        `stress_above_bound` has no meaning if the attribute `lower_bound` is zero or
        less. For a list of interfaces, `probability` is their mean, and `members`,
        over 'point' and 'member', holds the curve of each interface. The
        probabilities of 5 % and 95 % of the interfaces are at most `band_low` and
        `band_high`.

    Raises
    ------
    InputError
        If any argument is invalid. The message lists every problem.

    Warns
    -----
    AccuracyWarning
        As in `failure_probability`, for the end of the curve.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> curve = st.failure_curve(problem, strength, method=st.LocalCriterion(), smallest=1e-3)
    >>> bool((curve.stress.diff("point") < 0.0).all())
    True
    """
    experiment = Experiment(problem, as_random(random, seed, mixture), method, seed=seed)
    with Meter("failure_curve", show=progress) as meter, merge_warnings() as warned:

        def solve(experiment: Experiment, meter: Meter) -> Estimate:
            state, budget = prepare(experiment, event, workers, meter, max_evaluations)
            state = weakest_first(state)
            aim = sampling_target(state, target_cv)
            tail = sample_curve(state, Goal(aim, probability=smallest), budget)
            reached = tail.quantile(smallest) if tail.complete else tail.reached
            return Estimate(state, tail, reached)

        _, end = _of_enough_members(experiment, target_cv, meter, warned, solve)
        for text in curve_doubts(end, smallest, target_cv):
            warn_accuracy(text)
    attributes = study_attributes(problem=problem, random=experiment.given, method=method)
    attributes |= {"seed": seed} | ({"mixture": 1} if mixture else {})
    smallest = smallest if end.tail.complete else end.probability
    return curve_of(end.tail, end.state, chances(smallest), attributes)


def curve_doubts(end: Estimate, smallest: float, target_cv: float = CURVE_CV) -> list[str]:
    """Return the reasons not to trust the end of a curve."""
    if not end.tail.complete:
        return [f"{end.tail.short_of(f'P = {smallest:g}')}. The curve ends there"]
    doubts = few_members(end.state.experiment.random, end, target_cv)
    near = end.tail.repetitions[-1].around(end.stress)
    return doubts + exact_doubts(end.state, near, end.stress, smallest)


def chances(smallest: float) -> Array:
    """Return the probabilities of the points on a curve."""
    decades = max(np.log10(COMMONEST / smallest), 0.0)
    count = int(np.ceil(decades * PER_DECADE)) + 1
    probabilities: Array = COMMONEST * 10.0 ** -np.linspace(0.0, decades, count)
    return probabilities


def curve_of(
    tail: Tail, state: LimitState, wanted: Array, attributes: Mapping[str, Any]
) -> xr.Dataset:
    """Return the labelled curve of a tail at given probabilities."""
    lowest, pressure = state.bounds[0], state.experiment.pressure
    area = state.experiment.problem.area or np.nan
    rows, members = [], []
    for chance in wanted.tolist():
        estimate = Estimate(state, tail, stress := tail.quantile(chance))
        members.append(estimate.members)
        values = stress, stress - lowest, stress / pressure, stress * area, estimate.probability
        ends = lognormal_interval(estimate.probability, estimate.cv)
        sides = tail.stress_interval(chance, estimate.cv, lowest)
        rows.append(
            (*values, *ends, estimate.cv, *sides, *band_of(members[-1]), estimate.members_cv)
        )
    table: dict[str, Any] = dict(zip(CURVE, np.array(rows).T, strict=False))
    table["members"] = np.array(members)
    # So many samples survive that no stress has this chance.
    survive = np.isinf(table["stress"])
    for values in table.values():
        values[survive] = np.nan
    known = {
        "friction_coefficient": np.isfinite(pressure),
        "force": np.isfinite(area),
        **dict.fromkeys(OF_A_LIST, state.several),
    }
    table = {name: values for name, values in table.items() if known.get(name, True)}
    about = {
        "evaluations": tail.spent,
        "repetitions": len(tail.repetitions),
        "lower_bound": lowest,
        "event": state.event,
        "method": state.experiment.method.type,
        "survived": tail.survived,
    }
    return to_dataset(table, CURVE, {}, {**attributes, **about})
