"""Steps of every call in this folder: budget, number of interfaces, checks and doubts."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import replace
from typing import Annotated, Any, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from stiction.base.arrays import Array
from stiction.base.errors import (
    InputError,
    Warned,
    collect_warnings,
    merge_warnings,
    texts_of,
    warn_accuracy,
)
from stiction.base.model import Count, Real
from stiction.base.progress import Meter, Show
from stiction.base.units import in_words
from stiction.ensemble.batches import usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState
from stiction.ensemble.monte_carlo import check_fields
from stiction.methods.onset import exact_counterpart
from stiction.methods.protocol import optional_member, seconds_per_sample
from stiction.random.equally_likely import MAX_MEMBERS, drawn_from, specimens_of_fit
from stiction.reliability.answer import Answer
from stiction.reliability.tail import Tail, TailPoint

TargetCv: TypeAlias = Annotated[Real, Field(ge=1e-6, le=1)]
"""A smaller one would take more than 1e12 failures. A larger one is not
an estimate."""
Probability: TypeAlias = Annotated[Real, Field(ge=1e-30, lt=1)]
Budget: TypeAlias = Annotated[Count, Field(ge=100)]

COUNTING_SECONDS, FEWEST_EVALUATIONS, MOST_EVALUATIONS = 100.0, 1_000, 2_000_000
"""Computing time of counting by a slow method, and fewest and most
evaluations by default."""
CHAIN_EVALUATIONS, PATIENCE_SECONDS = 20_000, 900.0
"""Evaluations of subset simulation for about P = 1e-4 with a cv of 0.1,
and longest time of evaluations on one core, s, unless `max_evaluations`
allows more."""
LIST_SHARE, SAMPLING_SHARE = 0.6, 0.8
"""Parts of the target for the errors by choice of interfaces and by sampling.

Squares add up.
"""
REQUEST_MARGIN, CARRIED_SHARE = 1.2, 0.9
"""Margin on the wanted number of members, and fraction of the mean that
a warning reports."""
FRESH = 1.5
"""Least ratio of different members that makes a longer list worthwhile."""
UNDETERMINED, ODDS = 1.5, 20.0
"""Ratio of the stresses by family from which tests do not determine a
rare failure, and odds that tell families apart."""
EXACT_CHECKS = (8, 64)
"""Fewest and most samples of an approximate method that are solved
exactly as a check."""
CHECK_SECONDS = 10.0
"""Seconds of one core for the check by exact solutions."""
F = TypeVar("F", "Answer", TailPoint)


def prepare(
    experiment: Experiment,
    workers: int | None,
    meter: Meter,
    max_evaluations: int | None,
    *,
    algorithm: str = "subset",
    per_pressure: bool = False,
    executor: Executor | None = None,
    spent: int = 0,
) -> tuple[LimitState, int]:
    """Return the limit state and the allowed number of evaluations, unless a method is too slow."""
    threads = workers or usable_cores()
    state = LimitState(experiment, per_pressure, threads, meter, executor)
    problems = []
    if algorithm in ("subset", "two_level") and (slow := too_slow(experiment, max_evaluations)):
        problems.append(f"method: {slow}")
    elif algorithm == "two_level" and isinstance(reason := state.guide, str):
        problems.append(f"algorithm: 'two_level' is not possible: {reason}")
    if problems:
        raise InputError(problems)
    # Warnings come after errors: nobody needs a warning about a call
    # that is refused.
    check_fields([experiment])
    return state, allowed(experiment, max_evaluations) - spent


def exact_law(state: LimitState) -> Any:
    """Return the distribution of the onset if no samples are needed, else None.

    >>> from types import SimpleNamespace
    >>> source = SimpleNamespace(law=lambda problem, method: (problem, method))
    >>> random = SimpleNamespace(source=source)
    >>> experiment = SimpleNamespace(problem="joint", method="exact", random=random)
    >>> exact_law(SimpleNamespace(experiment=experiment))
    ('joint', 'exact')
    >>> random.source = None
    >>> exact_law(SimpleNamespace(experiment=experiment)) is None
    True
    """
    experiment, law = state.experiment, getattr(state.experiment.random.source, "law", None)
    return law(experiment.problem, experiment.method) if law else None


def exact_tail(state: LimitState) -> Tail:
    """Return an empty tail with the reason why no samples are needed.

    >>> from types import SimpleNamespace
    >>> source, method = SimpleNamespace(problem="plate"), SimpleNamespace(label="local criterion")
    >>> experiment = SimpleNamespace(problem="plate", method=method)
    >>> experiment.random = SimpleNamespace(source=source)
    >>> exact_tail(SimpleNamespace(experiment=experiment)).reason
    'specimens differ only as a whole, so the answer is an average over families'
    >>> experiment.problem = "joint"
    >>> tail = exact_tail(SimpleNamespace(experiment=experiment))
    >>> tail.algorithm, tail.spent, tail.reason[-52:]
    ('exact', 0, ' and local criterion computes the onset of the joint')
    """
    experiment = state.experiment
    reason = "specimens differ only as a whole, so the answer is an average over families"
    if experiment.problem != getattr(experiment.random.source, "problem", None):
        reason += (
            ". The joint differs from the specimens: the strength of a specimen is carried over,"
            f" and {experiment.method.label} computes the onset of the joint"
        )
    return Tail((), "exact", reason)


def undetermined(state: LimitState, law: Any, probability: float) -> list[str]:
    """Return a doubt if the distributions between specimens lead to very different stresses.

    The doubt states the number of specimens for which the likelihoods
    of the two families differ by `ODDS` on average. It follows from the
    divergence of one family from the other.

    The stresses at P = 1e-4 are 3 and 1 MPa, times the area of 2 m². The
    likelihoods differ by 20 after log(20)/0.1 = 29.96 specimens. A ratio
    of 1.5 is the least that leads to a doubt.

    >>> from types import SimpleNamespace
    >>> problem = SimpleNamespace(area=2.0)
    >>> state = SimpleNamespace(experiment=SimpleNamespace(problem=problem))
    >>> stresses = {"normal": 2e6, "weibull": 1e6, "lognormal": 3e6}
    >>> law = SimpleNamespace(families=list(stresses), quantile=lambda p, name: stresses[name])
    >>> law.divergence = lambda low, high: 0.1 if (low, high) == ("weibull", "lognormal") else 9.0
    >>> [text] = undetermined(state, law, 1e-4)
    >>> print(text.replace(". ", ".\\n").replace(" and", "\\nand"))
    the tests do not determine P = 0.0001: the lognormal family leads to 6 MN
    and the weibull family to 2 MN.
    About 30 specimens would tell these two apart, with odds of 20 to 1.
    Without a family about 3e+04 specimens are needed
    >>> problem.area, stresses["lognormal"] = None, 2.5e6
    >>> "to 2.5 MPa and the weibull family to 1 MPa. " in undetermined(state, law, 1e-4)[0]
    True
    >>> stresses["normal"], stresses["lognormal"] = 1.49e6, 1.49e6
    >>> undetermined(state, law, 1e-4)
    []
    >>> stresses["lognormal"] = 1.5e6
    >>> len(undetermined(state, law, 1e-4))
    1
    """
    stresses = {name: law.quantile(probability, name) for name in law.families}
    low, high = (pick(stresses, key=stresses.__getitem__) for pick in (min, max))
    if stresses[high] < UNDETERMINED * stresses[low]:
        return []
    area = state.experiment.problem.area
    unit, scale = ("N", area) if area else ("Pa", 1.0)
    ends = [in_words(unit, scale * stresses[name]) for name in (high, low)]
    needed = math.ceil(math.log(ODDS) / law.divergence(low, high))
    return [
        f"the tests do not determine P = {probability:g}: the {high} family leads to"
        f" {ends[0]} and the {low} family to {ends[1]}. About {needed} specimens"
        f" would tell these two apart, with odds of {ODDS:g} to 1. Without a family about"
        f" {3.0 / probability:.0e} specimens are needed"
    ]


def allowed(experiment: Experiment, max_evaluations: int | None) -> int:
    """Return the most evaluations in all rounds of a call.

    Evaluations take 900 s, or 100 s if 20,000 of them would take longer than
    900 s. They are at least 1,000 and at most 2,000,000.

    >>> from types import SimpleNamespace
    >>> for seconds in 0.03, 0.05, 2.0, 1e-6:
    ...     experiment = SimpleNamespace(seconds=seconds, method=SimpleNamespace(type="own"))
    ...     print(allowed(experiment, None), allowed(experiment, 300))
    30000 300
    2000 300
    1000 300
    2000000 300
    """
    seconds = COUNTING_SECONDS if too_slow(experiment, max_evaluations) else PATIENCE_SECONDS
    return max_evaluations or int(
        min(MOST_EVALUATIONS, max(FEWEST_EVALUATIONS, seconds / experiment.seconds))
    )


def too_slow(experiment: Experiment, max_evaluations: int | None) -> str | None:
    """Return a message if chains of samples take too long with this method, or None.

    >>> from types import SimpleNamespace
    >>> method = SimpleNamespace(type="own")
    >>> slow = SimpleNamespace(seconds=0.09, method=method)
    >>> fast = SimpleNamespace(seconds=0.045, method=method)
    >>> print(too_slow(slow, None).replace(" take", "\\ntake").replace(". ", ".\\n"))
    20,000 evaluations of subset simulation by 'own'
    take about 0.5 h.
    Allow so many with max_evaluations, or pass algorithm='plain'
    >>> too_slow(fast, None) is None, too_slow(slow, 20_000) is None
    (True, True)
    >>> too_slow(slow, 19_999) is None
    False
    >>> method.counted_only = True
    >>> too_slow(fast, None) is None, too_slow(fast, 30_000) is None
    (False, True)
    """
    seconds, method = CHAIN_EVALUATIONS * experiment.seconds, experiment.method
    fast = seconds <= PATIENCE_SECONDS and not optional_member(method, "counted_only")
    if fast or (max_evaluations or 0) >= CHAIN_EVALUATIONS:
        return None
    return (
        f"{CHAIN_EVALUATIONS:,} evaluations of subset simulation by {method.type!r} take about"
        f" {seconds / 3600.0:.1g} h. Allow so many with max_evaluations, or pass algorithm='plain'"
    )


def sampling_target(state: LimitState, target_cv: float) -> float:
    """Return the target that is left for the sampling error.

    >>> from types import SimpleNamespace
    >>> [round(sampling_target(SimpleNamespace(several=several), 0.3), 6) for several in (0, 1)]
    [0.3, 0.24]
    """
    return target_cv * (SAMPLING_SHARE if state.several else 1.0)


def wanted_members(random: Any, cv: float, target_cv: float) -> int:
    """Return the number of members to draw from a source, 0 if there are enough.

    A cv of 0.12 is twice the part 0.6 * 0.1 for the interfaces. So 4 times as many
    are needed, with a margin of 1.2. At least twice as many are drawn.

    >>> from types import SimpleNamespace
    >>> random = SimpleNamespace(members=range(900), source="posterior")
    >>> [wanted_members(random, cv, 0.1) for cv in (0.12, 0.066, 0.05, 0.6)]
    [4320, 1800, 0, 8000]
    >>> random.source = None
    >>> wanted_members(random, 0.12, 0.1)
    0
    >>> wanted_members(SimpleNamespace(members=range(8000), source="posterior"), 0.12, 0.1)
    0
    """
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
    max_evaluations: int | None,
    solve: Callable[[Experiment, Meter, int], Answer],
) -> Answer:
    """Return an answer, and its warnings, from as many members as the target needs."""
    with Meter(name, show=progress) as meter, merge_warnings() as warned:
        warn_of_field(experiment)
        experiment, answer, spent = with_enough_members(
            experiment, target_cv, meter, warned, max_evaluations, solve
        )
        for text in few_members(experiment.random, answer, target_cv):
            warn_accuracy(text)
    source = experiment.random.source
    return replace(
        answer,
        evaluations=spent,
        warnings=tuple(texts_of(warned)),
        doubts=(*getattr(source, "doubts", ()), *getattr(source, "notes", ())),
        specimens=getattr(source, "specimens", 0),
    )


def warn_of_field(experiment: Experiment) -> None:
    """Warn about the field of a fit in place of a fit with scatter between specimens.

    >>> from types import SimpleNamespace
    >>> with collect_warnings() as warned:
    ...     for between, specimens in (None, 8), (None, None), ("lognormal", 8):
    ...         strength = SimpleNamespace(specimens_of_fit=specimens)
    ...         member = SimpleNamespace(between=between, strength=strength)
    ...         random = SimpleNamespace(several=False, members=[member])
    ...         warn_of_field(SimpleNamespace(random=random))
    ...         print(len(warned))
    1
    1
    1
    """
    if specimens_of_fit(experiment.random):
        warn_accuracy(
            "random: is the field of a fit, without the scatter between specimens. Pass the fit"
        )


def with_enough_members(
    experiment: Experiment,
    target_cv: float,
    meter: Meter,
    warned: list[Warned],
    max_evaluations: int | None,
    solve: Callable[[Experiment, Meter, int], F],
) -> tuple[Experiment, F, int]:
    """Return a solution with enough members for the error due to their choice, and all evaluations.

    A source draws more members until the error is small enough, or
    another round would need more evaluations than are left.

    Each solution costs 400 evaluations. The error by the choice of n
    interfaces is 0.38/sqrt(n). A target of 0.1 allows 0.06, so that 10
    interfaces are too few, and 48 are enough.

    >>> from dataclasses import make_dataclass
    >>> from types import SimpleNamespace
    >>> import stiction as st
    >>> from stiction.base.progress import SILENT
    >>> problem = st.paper.problem(nodes=256)
    >>> class Source:
    ...     def __init__(self, different):
    ...         self.different = different
    ...     def interfaces(self, count, seed):
    ...         kinds = [1.0 + number % self.different for number in range(count)]
    ...         return [st.paper.strength(problem, kind) for kind in kinds]
    >>> def solve(experiment, meter, spent):
    ...     count = len(experiment.random.members)
    ...     print(count, "interfaces", spent)
    ...     return SimpleNamespace(members_cv=0.38 * count**-0.5, tail=SimpleNamespace(spent=400))
    >>> def spent(different, budget):
    ...     random = SimpleNamespace(
    ...         members=range(10), kinds=np.arange(10), source=Source(different)
    ...     )
    ...     case = make_dataclass("Case", ["random", "seed", "seconds", "method"])
    ...     case, warned = case(random, 0, 0.01, None), ["a warning"]
    ...     print(with_enough_members(case, 0.1, SILENT, warned, budget, solve)[2], warned)
    >>> spent(15, 800)
    10 interfaces 0
    48 interfaces 400
    800 []

    A list without half as many more different interfaces, or a smaller
    budget, ends the search:

    >>> spent(14, 800)
    10 interfaces 0
    400 ['a warning']
    >>> spent(15, 799)
    10 interfaces 0
    400 ['a warning']
    """
    spent, budget = 0, allowed(experiment, max_evaluations)
    while True:
        solution, known = solve(experiment, meter, spent), experiment.random
        cost = solution.evaluations if isinstance(solution, Answer) else solution.tail.spent
        spent += cost
        count = wanted_members(known, solution.members_cv, target_cv)
        if not count or spent + cost > budget:
            return experiment, solution, spent
        meter.note = f"{count:,} interfaces, cv by their choice {solution.members_cv:.2g}"
        larger = drawn_from(known.source, count, experiment.seed)
        # A posterior over a list has hardly more different members,
        # however many are drawn.
        if larger.kinds.max() + 1 < FRESH * (known.kinds.max() + 1):
            return experiment, solution, spent
        experiment = replace(experiment, random=larger)
        warned.clear()  # the new solution warns again where it must


def few_members(random: Any, estimate: Answer | TailPoint, target_cv: float) -> list[str]:
    """Return a warning if the choice of interfaces leaves the estimate above `target_cv`.

    The first two members are equal. The different ones carry 0.3, 0.6 and 0
    of the mean, and the two largest carry 90 % of it.

    >>> from types import SimpleNamespace
    >>> random = SimpleNamespace(kinds=np.array([0, 0, 1, 2]), source=None)
    >>> members = np.array([0.1, 0.2, 0.6, math.nan])
    >>> estimate = SimpleNamespace(cv=0.25, members_cv=0.15, members=members)
    >>> [text] = few_members(random, estimate, 0.2)
    >>> print(text.replace(". ", ".\\n").replace("), ", "),\\n").replace("list, ", "list,\\n"))
    the interfaces are a sample, and 2 of 3 different ones carry 90% of the mean.
    The coefficient of variation is 0.25 (target 0.2),
    of which this choice makes 0.15.
    Pass the fit or posterior itself, which gives more interfaces, pass a longer list,
    or measure more
    >>> random.source, estimate.members = "fit", np.full(4, math.nan)
    >>> print(few_members(random, estimate, 0.2)[0].replace(". ", ".\\n"))
    the interfaces are a sample.
    The coefficient of variation is 0.25 (target 0.2), of which this choice makes 0.15.
    Use more repetitions of the fit (bootstrap=), or measure more

    Both the error and the part by the choice must be too large:

    >>> few_members(random, SimpleNamespace(cv=0.2, members_cv=0.15), 0.2)
    []
    >>> few_members(random, SimpleNamespace(cv=0.25, members_cv=0.12), 0.2)
    []
    """
    by_list = estimate.members_cv
    if not (estimate.cv > target_cv and by_list > LIST_SHARE * target_cv):
        return []
    # Add up the probabilities of equal interfaces, the largest first.
    # None may be known.
    members = np.nan_to_num(estimate.members)
    shares = np.cumsum(np.sort(np.bincount(random.kinds, members))[::-1])
    count = 1 + int(np.searchsorted(shares, CARRIED_SHARE * shares[-1]))
    carried = f", and {count} of {shares.size} different ones carry {CARRIED_SHARE:.0%}"
    advice = "Pass the fit or posterior itself, which gives more interfaces, pass a longer list"
    if random.source is not None:
        advice = "Use more repetitions of the fit (bootstrap=)"
    return [
        f"the interfaces are a sample{f'{carried} of the mean' * bool(shares[-1])}. The"
        f" coefficient of variation is {estimate.cv:.2g} (target {target_cv:g}), of which this"
        f" choice makes {by_list:.2g}. {advice}, or measure more"
    ]


def imprecise(cv: float, target_cv: float, evaluations: int) -> list[str]:
    """Return a warning if the estimate is less precise than `target_cv`.

    Four times 1,100 evaluations halve the error, with a margin of 1.2:

    >>> print(imprecise(0.2, 0.1, 1100)[0].replace(", ", ",\\n").replace(". ", ".\\n"))
    the coefficient of variation by sampling is 0.2 after 1100 evaluations,
    but 0.1 was wanted.
    To reach it,
    raise max_evaluations to about 5e+03,
    or accept a larger target_cv
    >>> imprecise(math.inf, 0.1, 70)[0][-64:]
    'To reach it, raise max_evaluations, or accept a larger target_cv'
    >>> imprecise(0.1, 0.1, 70)
    []
    """
    advice = "raise max_evaluations"
    if math.isfinite(cv):
        advice += f" to about {REQUEST_MARGIN * evaluations * (cv / target_cv) ** 2:.1g}"
    text = (
        f"the coefficient of variation by sampling is {cv:.3g} after {evaluations} evaluations, but"
        f" {target_cv:.3g} was wanted. To reach it, {advice}, or accept a larger target_cv"
    )
    return [text] if cv > target_cv else []


def different(values: Array, count: int, rng: np.random.Generator) -> NDArray[np.int64]:
    """Return up to `count` positions of distinct values, in random order.

    >>> values, rng = np.array([3.0, 1.0, 3.0, 2.0]), np.random.default_rng(1)
    >>> sorted(different(values, 5, rng).tolist()), different(values, 2, rng).size
    ([0, 1, 3], 2)
    """
    _, first = np.unique(values, return_index=True)  # chains repeat states
    return rng.permutation(first)[:count]


def exact_doubts(point: TailPoint) -> list[str]:
    """Solve some samples exactly if the method is approximate.

    Warn if more or fewer samples fail.

    The checked samples are low samples on both sides of the stress.
    Failures are counted, because in a tail a small change of stress may
    multiply the probability.

    Of the 20 lowest of 40 samples, 10 are below the stress 10. By the
    exact method 4 are, so that 6 samples change sides. This is more than
    twice the square root of 6.

    >>> import stiction as st
    >>> from types import SimpleNamespace
    >>> from stiction.base.progress import SILENT
    >>> from stiction.reliability.subset import Descent, Population
    >>> method = SimpleNamespace(exact_method="equilibrium", label="guess")
    >>> experiment = SimpleNamespace(problem=st.paper.problem(nodes=256), method=method)
    >>> def doubts(limit, chance=0.3):
    ...     values = np.arange(40.0)
    ...     level = Population(math.inf, 0.0, values, values, values, values[:, None])
    ...     tail = SimpleNamespace(repetitions=[Descent(40, [level], 10.0, 40, complete=True)])
    ...     state = SimpleNamespace(experiment=experiment, meter=SILENT)
    ...     state.by = lambda exact: lambda draws: np.where(draws[:, 0] < limit, 9.0, 10.0)
    ...     point = SimpleNamespace(state=state, tail=tail, stress=10.0, probability=chance)
    ...     return exact_doubts(point)
    >>> print(doubts(4.0)[0].replace(". ", ".\\n"))
    of 20 samples in the tail 10 fail by the guess and 4 by equilibrium.
    The probability by st.Equilibrium() is about 0.12, not 0.3.
    Use the exact method
    >>> doubts(6.0), doubts(14.0)  # 4 samples on the same side
    ([], [])
    >>> "is below 0.03, not" in doubts(0.0)[0], "is about 1, not 0.8" in doubts(16.0, 0.8)[0]
    (True, True)
    >>> method.exact_method = None
    >>> doubts(4.0)
    []
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
        " Use the exact method"
    ]
