"""Failure probability, estimated by counting or from the tail.

Problem. The onset T of a random interface has the
distribution P(T < s). Estimate the probability at
a stress s with a given coefficient of variation.

Sources. Each algorithm has its own file: `counting`, `subset`,
`two_level`, `tail`.

Steps:

1. Answer at once if the stress lies outside the bounds of the onset.
2. Count many specimens for each solved field, if this costs less
   (`counting`).
3. Otherwise solve a pilot of plain samples. Count if failures are
   frequent, or if the method is too slow for chains (`counting`).
   Sample the tail if they are rare (`tail`).
4. If the method is approximate, solve some samples near the stress
   exactly. Warn if more or fewer of them fail (`solving.exact_doubts`).
5. If interfaces are drawn from a fit or a posterior, draw more
   interfaces until the error due to their number is small enough.
   Repeat steps 1 to 4 (`solving.with_enough_members`).
"""

import math
from dataclasses import replace
from typing import Literal

import numpy as np
import xarray as xr

from stiction.base.errors import InputError
from stiction.base.model import Count, Number, Positive, Progress, checked
from stiction.base.progress import Meter
from stiction.base.units import Doubt, doubt_units, in_words
from stiction.base.variables import ONSET_VARIABLES, PROFILES
from stiction.ensemble.experiment import Experiment, method_of
from stiction.ensemble.limit_state import LimitState, weakest_first
from stiction.methods.protocol import MethodObject, label
from stiction.problem.problem import Problem, stress_of
from stiction.problem.results import along, study_attributes
from stiction.problem.sample import GIVE_PRESSURE
from stiction.random.equally_likely import AnyRandom, as_random
from stiction.reliability.answer import Answer
from stiction.reliability.counting import binomial_interval, count_failures, count_tail
from stiction.reliability.solving import (
    Budget,
    TargetCv,
    answered,
    different,
    exact_doubts,
    exact_law,
    exact_tail,
    imprecise,
    prepare,
    sampling_target,
    too_slow,
    undetermined,
)
from stiction.reliability.subset import generator
from stiction.reliability.tail import (
    FREQUENT,
    Goal,
    Tail,
    TailPoint,
    lognormal_interval,
    sample_tail,
)

PILOT_SAMPLES = 1_000
"""Number of plain samples by which the algorithm is chosen."""
NEGLIGIBLE_PROBABILITY = 1e-15
"""Probability of failing, or of surviving, below which no sample is drawn."""
DOUBTFUL = 0.02
"""Fraction of the mean strength below which a stress is probably in
another unit."""
THOUSAND = 1e3
"""Ratio to the mean strength that means another unit, such as kN for N
or MPa for Pa."""
SHOWN_PROFILES = 20
"""Number of failing profiles in an answer."""
COVERED = 0.8
"""Fraction of the failures that the first stage must find to avoid a
warning."""
QUANTITIES = {"stress": "Pa", "force": "N", "friction_coefficient": "1"}
"""Units of the quantities in which a stress may be given."""


@checked
def failure_probability(
    problem: Problem,
    random: AnyRandom,
    stress: Positive | None = None,
    *,
    method: MethodObject | None = None,
    friction_coefficient: Positive | None = None,
    force: Positive | None = None,
    algorithm: Literal["auto", "plain", "subset", "two_level"] = "auto",
    target_cv: TargetCv = 0.1,
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    workers: Count | None = None,
    progress: Progress = True,
) -> Answer:
    """Estimate the probability that an interface of random strength slides below a stress.

    Parameters
    ----------
    problem, seed, workers, progress
        As in `monte_carlo`. The total number of samples that `progress`
        shows is an estimate.
    random : RandomInterface, RandomField, list of them, FieldFit or Posterior
        The members of a list are equally likely. A fit, a
        posterior, or any object with a method ``interfaces(count,
        seed)`` provides as many interfaces as the target needs,
        from 1,000 to 8,000. The answer is then their mean, the
        predictive probability, and has a `band`.
    stress : float, optional
        Mean shear stress to carry, Pa, above zero. Failure is an onset strictly below it.
    method : LocalCriterion, Equilibrium or Rupture
        By default the method of a posterior. `Rupture` and other methods
        that are too slow for subset simulation use plain Monte Carlo, unless `max_evaluations` is
        20,000 or more.
    friction_coefficient : float, optional
        Instead of `stress`: ratio of the mean shear stress to carry to
        the mean normal pressure. If the pressure is random, the
        pressure of each sample is used.
    force : float, optional
        Instead of `stress`: shear force to carry, N. The area of the
        interface must be known.
    algorithm : {"auto", "plain", "subset", "two_level"}
        Plain Monte Carlo, subset simulation, or subset simulation by
        the local criterion with equilibrium as the last level. See the
        page 'Failure probability' of the documentation. `reason` in the
        result explains the choice of 'auto'.
    target_cv : float
        Coefficient of variation to reach, including the part due to the
        choice of interfaces.
    max_evaluations : int, optional
        Largest number of samples to solve. The default takes about a
        quarter of an hour on one core, but is at most 2,000,000
        samples. For ruptures it is 1,000. Up to 32 samples of each interface of a
        list, which sort the list, come on top.

    Returns
    -------
    Answer
        With `probability`, `cv`, `interval` (90 %), `evaluations` and more.

    Raises
    ------
    InputError
        If any argument is invalid. The message lists every problem.

    Warns
    -----
    AccuracyWarning
        If the estimate is unreliable. The result has the same text in
        `warnings`. If the method is the local criterion, equilibrium
        also solves some samples near the stress.
    UnitWarning
        If the stress is below a fiftieth of the mean strength, or above
        fifty times the mean strength. A factor of a thousand raises an
        `InputError`.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> strength = st.paper.strength(problem, correlation_ratio=2.0)
    >>> found = st.failure_probability(problem, strength, 0.68e6, method=st.LocalCriterion())
    >>> low, high = found.interval["probability"]
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

    def solve(experiment: Experiment, meter: Meter, spent: int) -> Answer:
        state, budget = prepare(
            experiment, workers, meter, max_evaluations,
            algorithm=algorithm, per_pressure=name == "friction_coefficient", spent=spent,
        )  # fmt: skip
        wanted = demanded(state, name, given[name] or 0.0)
        answer = _probability(state, wanted, algorithm, target_cv, budget, max_evaluations)
        return replace(answer, quantity=name)

    method = method_of(random, method)
    experiment = Experiment(problem, as_random(random, seed), method, seed=seed)
    return answered(
        experiment, target_cv, "failure_probability", progress, max_evaluations, solve
    )


def demanded(state: LimitState, name: str, given: float) -> float:
    """Return a demand as a mean stress, Pa.

    Warn about a demand far from the mean strength. Refuse it if the
    ratio is a thousand.

    The mean strength is 2 MPa, the area 3 m², and the mean pressure 4 MPa.

    >>> from types import SimpleNamespace
    >>> problem = SimpleNamespace(area=3.0, specimen=None)
    >>> experiment = SimpleNamespace(problem=problem, pressure=4e6, mean_strength=2e6)
    >>> state = SimpleNamespace(experiment=experiment, bounds=(0.0, 9e6))
    >>> demanded(state, "stress", 1e6), demanded(state, "force", 6e6)
    (1000000.0, 2000000.0)
    >>> demanded(state, "friction_coefficient", 0.25)
    1000000.0
    >>> demanded(state, "force", 1e3)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: force: 1000 N is 0.00017 times the mean strength, 6 MN...

    A stress below a fiftieth of the strength is unusual, unless it is at most
    the lower bound:

    >>> from stiction.base.errors import collect_warnings
    >>> for stress, bound in (1e4, 0.0), (1e4, 1e4), (4e4, 0.0), (2e8, 0.0), (1e8, 0.0):
    ...     state.bounds = bound, 9e9
    ...     with collect_warnings() as warned:
    ...         _ = demanded(state, "stress", stress)
    ...     print(stress, len(warned))
    10000.0 1
    10000.0 0
    40000.0 0
    200000000.0 1
    100000000.0 0
    >>> experiment.pressure = math.nan
    >>> demanded(state, "friction_coefficient", 0.25)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: friction_coefficient: needs a normal pressure...
    """
    experiment, stress = state.experiment, given
    if name == "force":
        stress = stress_of(experiment.problem, name, given)
    elif name == "friction_coefficient":
        stress = given * experiment.pressure
        if not stress > 0.0:
            raise InputError(f"friction_coefficient: needs a normal pressure. {GIVE_PRESSURE}")
    ratio, unit = stress / experiment.mean_strength, QUANTITIES[name]
    possible = 1.0 / THOUSAND, THOUSAND
    certain = ratio < DOUBTFUL and stress <= state.bounds[0]
    usual = possible if certain else (DOUBTFUL, 1.0 / DOUBTFUL)
    text = (
        f"{name}: {f'{given:g} {unit}'.removesuffix(' 1')} is {ratio:.2g} times the mean strength,"
        f" {in_words(unit, given / ratio)}. Check the unit (Pa, N or none)"
    )
    doubt_units([Doubt(text, ratio, usual, possible)])
    return stress


def _probability(
    state: LimitState, stress: float, algorithm: str, target_cv: float, budget: int,
    allowed: int | None,
) -> Answer:  # fmt: skip
    """Return the answer from the chosen algorithm (steps 1 to 4)."""
    # 1. Beyond these bounds the probability is negligible, so no sample
    # would show it.
    likely = state.likely_bounds(NEGLIGIBLE_PROBABILITY)
    if not likely[0] < stress < likely[1]:
        return _certain(state, stress, likely)
    if (law := exact_law(state)) is not None:
        chance = law.probability(stress)
        return Answer.at(
            TailPoint(state, exact_tail(state), stress), (chance, chance),
            undetermined(state, law, chance) if 0.0 < chance < FREQUENT else (), probability=chance,
            cv=0.0, members_cv=0.0, members=np.zeros(0),
        )  # fmt: skip
    counted, reason, pilot = 0, "as requested", None
    least = min(PILOT_SAMPLES, max(budget // 5, 50))
    goal = Goal(sampling_target(state, target_cv), stress)
    if algorithm == "auto" and (slow := too_slow(state.experiment, allowed)):
        algorithm, reason = "plain", slow
    elif algorithm == "auto":
        # 2.
        counts, enough = count_tail(state, goal, budget)
        if counts and enough:
            return _by_tail(TailPoint(state, counts.tail, stress), goal.cv)
        if counts:  # its samples are part of the budget
            budget -= (counted := len(counts.values))
            least = min(PILOT_SAMPLES, max(budget // 5, 50))
        # 3. Members in order help the chains, and the pilot must have
        # the order of the chains.
        state = weakest_first(state)
        draws = state.draws(state.experiment.seed, 0, least)
        pilot = draws, state(draws)
        failures = int(np.sum(pilot[1] < stress))
        rare = failures < FREQUENT * least
        algorithm = "auto" if rare else "plain"
        reason = f"{failures} failure{'s' * (failures != 1)} of {least} plain samples: "
        reason += "rare" if rare else "frequent enough to count"
    if algorithm == "plain":
        start = least if pilot else 0
        answer = _by_counting(state, goal, budget, least, start, reason)
        return replace(answer, evaluations=counted + answer.evaluations)
    if algorithm != "auto":
        state = weakest_first(state)
    tail = sample_tail(
        state, goal, algorithm=algorithm, budget=budget, reason=reason, pilot=pilot
    )
    tail = tail._replace(spent=counted + tail.spent)
    return _by_tail(TailPoint(state, tail, stress), goal.cv)


def _certain(state: LimitState, stress: float, likely: tuple[float, float]) -> Answer:
    """Return an answer that needs no samples (step 1).

    >>> from types import SimpleNamespace
    >>> problem, random = SimpleNamespace(area=None), SimpleNamespace(members=range(5))
    >>> experiment = SimpleNamespace(problem=problem, pressure=math.nan, random=random)
    >>> state = SimpleNamespace(experiment=experiment, bounds=(1.0, 8.0), several=False)
    >>> def shown(stress, likely=(2.0, 6.0)):
    ...     answer = _certain(state, stress, likely)
    ...     low, high = answer.interval["probability"]
    ...     print(answer.probability, low, high, answer.members.tolist())
    ...     print(answer.reason)
    >>> shown(1.0)
    0.0 0.0 0.0 []
    no interface slides at or below 1 Pa
    >>> shown(8.0)
    1.0 1.0 1.0 []
    no interface carries more than 8 Pa
    >>> shown(2.0)
    0.0 0.0 1e-15 []
    no interface slides at or below 2 Pa, except with a probability below 1e-15

    Another list of 5 might have other bounds: at 95 % confidence, p is at most
    1 - 0.05^(1/5) = 0.4507.

    >>> state.several = True
    >>> answer = _certain(state, 9.0, (2.0, 6.0))
    >>> [round(end, 4) for end in answer.interval["probability"]], answer.members.tolist()
    ([0.5493, 1.0], [1.0, 1.0, 1.0, 1.0, 1.0])
    >>> [round(end, 4) for end in _certain(state, 1.5, (2.0, 6.0)).interval["probability"]]
    [0.0, 0.4507]
    """
    certain = not state.bounds[0] < stress < state.bounds[1]
    low, high = state.bounds if certain else likely
    doubt = 0.0 if certain else NEGLIGIBLE_PROBABILITY
    chance = float(stress >= high)
    reason = f"no interface slides at or below {low:.7g} Pa"
    if chance:
        reason = f"no interface carries more than {high:.7g} Pa"
    reason += "" if certain else f", except with a probability below {doubt:g}"
    members = len(state.experiment.random.members)
    if state.several:  # another list might have other bounds
        doubt = max(doubt, binomial_interval(0, members)[1])
    return Answer.at(
        TailPoint(state, Tail((), "exact", reason), stress),
        (chance - doubt, 1.0) if chance else (0.0, doubt),
        probability=chance,
        cv=0.0,
        members_cv=0.0,
        members=np.full(members if state.several else 0, chance),
    )


def _by_counting(
    state: LimitState, goal: Goal, budget: int, least: int, start: int, reason: str
) -> Answer:
    """Return the answer from plain Monte Carlo that begins with sample `start`.

    Samples of a pilot are not used, because their failures determine
    whether to count.
    """
    count, counted = count_failures(
        state, state.experiment.seed, goal.stress, target_cv=goal.cv, least=least,
        max_evaluations=budget - start, start=start,
    )  # fmt: skip
    spent = start + counted.evaluations
    point = TailPoint(state, Tail([counted], "plain", reason, spent), goal.stress)
    cv, interval = math.hypot(count.cv, point.members_cv), count.interval()
    if point.members_cv:  # the exact interval of a count holds for its sampling error only
        interval = lognormal_interval(count.probability, cv)
    # 4.
    doubts = imprecise(count.cv, goal.cv, spent) + exact_doubts(point)
    return Answer.at(
        point, interval, doubts, probability=count.probability, cv=cv,
        failing_profiles=_failing_profiles(point),
    )  # fmt: skip


def _by_tail(point: TailPoint, target_cv: float) -> Answer:
    """Return the answer for a point of an estimated tail.

    A tail that ends at 2 Pa, below which lie 40 of 80 samples. A smaller stress is less
    probable. The interval has the factor exp(`log_width`).

    >>> from types import SimpleNamespace
    >>> from stiction.base.errors import collect_warnings
    >>> from stiction.reliability.subset import Descent, Population
    >>> from stiction.reliability.tail import log_width
    >>> numbers, values = np.arange(80), np.arange(80.0) / 20.0
    >>> level = Population(math.inf, 0.0, values, numbers, numbers, np.zeros((80, 0)))
    >>> problem = SimpleNamespace(area=None)
    >>> method = SimpleNamespace(label="own", exact_method=None)
    >>> experiment = SimpleNamespace(problem=problem, pressure=math.nan, method=method, seed=0)
    >>> state = SimpleNamespace(experiment=experiment, bounds=(-1.0, 8.0), several=False)
    >>> state.guide = "no guide"
    >>> def answer(stress, tail):
    ...     with collect_warnings() as warned:
    ...         found = _by_tail(TailPoint(state, tail, stress), 9.0)
    ...     return found, [text.text for text in warned]
    >>> tail = Tail([Descent(80, [level], 1.999, 80, complete=False)], spent=90)
    >>> found, doubts = answer(-0.5, tail)
    >>> round(found.interval["probability"][1] / math.exp(log_width(tail.cv(1.999))), 6)
    0.5
    >>> found.probability, doubts[0][-23:]
    (0.0, 'The interval ends there')

    With two levels, no failure leaves the probability of the guide's level:

    >>> rare = level._replace(log_probability=math.log(0.125))
    >>> tail = Tail([Descent(80, [rare], -0.5, 80, complete=True)], "two_level", spent=40)
    >>> found, doubts = answer(-0.5, tail)
    >>> round(found.interval["probability"][1], 6), doubts[0][-43:]
    (0.125, 'The interval ends at the level of the guide')
    """
    tail, probability = point.tail, point.probability
    interval = lognormal_interval(probability, point.cv)
    doubts = imprecise(point.sampling_cv, target_cv, tail.spent)
    if tail.algorithm == "two_level" and probability == 0.0:
        # No exact sample fails, so the interval ends at the probability
        # of the guide's level.
        rarest = tail.repetitions[-1].populations[-1]
        interval = 0.0, math.exp(rarest.log_probability)
        doubts = [f"{tail.short_of('a failure')}. The interval ends at the level of the guide"]
    elif not tail.complete:
        # The requested stress is below all samples, so its probability
        # is below the last known.
        there = tail.probability(tail.reached), tail.cv(tail.reached)
        interval = 0.0, lognormal_interval(*there)[1]
        doubts = [f"{tail.short_of(f'{point.stress:.7g} Pa')}. The interval ends there"]
    else:
        guide, covered = point.state.guide, min(each.last for each in tail.repetitions)
        if covered < COVERED and isinstance(guide, LimitState):
            doubts.append(
                f"the {guide.experiment.method.label} misses {1.0 - covered:.0%} of the failures,"
                " so that the estimate may be too low. Compare with algorithm='subset'"
            )
        # 4.
        doubts += exact_doubts(point)
    return Answer.at(point, interval, doubts, failing_profiles=_failing_profiles(point))


def _failing_profiles(point: TailPoint) -> xr.Dataset:
    """Return labelled profiles and onsets of some samples that fail.

    No failure gives an empty dataset.

    >>> from types import SimpleNamespace
    >>> from stiction.reliability.subset import Descent, Population
    >>> none = np.zeros(0, int)
    >>> level = Population(math.inf, 0.0, np.array([3.0, 2.0]), none, none, np.zeros((2, 1)))
    >>> tail = Tail([Descent(2, [level], 2.0, 2, complete=True)])
    >>> state = SimpleNamespace(experiment=SimpleNamespace(seed=0))
    >>> len(_failing_profiles(TailPoint(state, tail, 2.0)))
    0
    """
    experiment, last = point.state.experiment, point.tail.repetitions[-1]
    draws, stresses = last.failing
    failed = np.flatnonzero(stresses < point.stress)
    rng = generator(experiment.seed, 2)  # draws of its own, so that estimates do not change
    chosen = failed[different(stresses[failed], SHOWN_PROFILES, rng)]
    if not chosen.size:
        return xr.Dataset()
    problem, method = experiment.problem, experiment.method
    profiles, onset = experiment.solve(draws[chosen])
    values = profiles | {name: onset[name] for name in ONSET_VARIABLES}
    variables = {name: along(problem.interface, PROFILES[name]) for name in profiles}
    attributes = study_attributes(problem=problem, method=method)
    return label(problem, method, values, np.arange(chosen.size), attributes, variables)
