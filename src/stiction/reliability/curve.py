"""Failure curves: the probability of an onset below a stress, over many stresses.

Problem. Tabulate P(T < s) for the onset T from `COMMONEST` down to a
smallest probability.

Steps:

1. Sample the tail down to the smallest probability
   (`tail.sample_curve`). If interfaces are drawn from a fit or a
   posterior, draw more of them until the error due to their number is
   small enough (`solving.with_enough_members`).
2. Warn if the end of the curve is in doubt (`curve_doubts`).
3. At `PER_DECADE` probabilities per decade, take the stress, its
   interval, and the probabilities of the equally likely interfaces
   (`curve_of`).
"""

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from stiction.base.arrays import Array
from stiction.base.errors import merge_warnings, warn_accuracy
from stiction.base.model import Count, Number, Progress, checked
from stiction.base.progress import Meter
from stiction.base.variables import Variable
from stiction.ensemble.experiment import Experiment
from stiction.ensemble.limit_state import LimitState, weakest_first
from stiction.methods.protocol import MethodObject
from stiction.problem.problem import Problem
from stiction.problem.results import study_attributes, to_dataset
from stiction.random.equally_likely import AnyRandom, as_random
from stiction.reliability.answer import band_of
from stiction.reliability.solving import (
    Budget,
    Probability,
    TargetCv,
    exact_doubts,
    few_members,
    prepare,
    sampling_target,
    warn_of_field,
    with_enough_members,
)
from stiction.reliability.tail import Goal, Tail, TailPoint, lognormal_interval, sample_curve

CURVE_CV = 0.3
"""Coefficient of variation at the end of a curve by default."""
COMMONEST, PER_DECADE = 0.5, 3
"""Probability at the beginning of a curve, and points per decade."""

CURVE: dict[str, Variable] = {
    name: Variable(unit, text, ("point",))
    for name, unit, text in (
        ("stress", "Pa", "stress"),
        ("stress_above_bound", "Pa", "stress above its lower bound"),
        ("friction_coefficient", "1", "stress over the mean normal pressure"),
        ("force", "N", "stress times the area of the interface"),
        ("probability", "1", "probability of an onset below the stress"),
        ("probability_low", "1", "lower end of the interval of the probability"),
        ("probability_high", "1", "upper end of the 90 % interval of the probability"),
        ("cv", "1", "coefficient of variation of the probability"),
        ("stress_low", "Pa", "lower end of the interval of the stress"),
        ("stress_high", "Pa", "upper end of the interval of the stress"),
        ("band_low", "1", "probability that 5 % of the interfaces do not exceed"),
        ("band_high", "1", "probability that 95 % of the interfaces do not exceed"),
        ("members_cv", "1", "part of the coefficient of variation by the choice of interfaces"),
    )
}
CURVE["members"] = Variable("1", "probability of each interface", ("point", "member"))
OF_A_LIST = ("band_low", "band_high", "members_cv", "members")


@checked
def failure_curve(
    problem: Problem,
    random: AnyRandom,
    *,
    method: MethodObject,
    smallest: Probability = 1e-6,
    target_cv: TargetCv = CURVE_CV,
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    workers: Count | None = None,
    executor: Executor | None = None,
    progress: Progress = True,
) -> xr.Dataset:
    """Estimate P(onset < s) from 0.5 down to a smallest probability, with three points per decade.

    Parameters
    ----------
    smallest : float
        Smallest probability of the curve.
    target_cv : float
        Coefficient of variation to reach at the smallest probability.
        At other points the coefficient is lower. Repetitions are added
        until the target is reached.
    problem, random, method, seed, max_evaluations, workers, progress
        As in `design_stress`.
    executor
        As in `monte_carlo`. The samples of each step are divided between its workers.

    Returns
    -------
    xarray.Dataset
        Over 'point': `stress` and `stress_above_bound` (Pa),
        `probability` with `probability_low`, `probability_high` and
        `cv`, and `stress_low` and `stress_high` (Pa). If there is a
        normal pressure, `friction_coefficient` is the stress over the
        mean pressure. If the area is known, there is `force` (N).
        `stress_above_bound` has no meaning if the attribute
        `lower_bound` is zero or less. For a list of interfaces,
        `probability` is their mean, and `members`, over 'point' and
        'member', holds the curve of each interface. The probabilities
        of 5 % and 95 % of the interfaces are at most `band_low` and
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
    experiment = Experiment(problem, as_random(random, seed), method, seed=seed)

    def solve(experiment: Experiment, meter: Meter, spent: int) -> TailPoint:
        state, budget = prepare(
            experiment, workers, meter, max_evaluations, executor=executor, spent=spent
        )
        state = weakest_first(state)
        goal = Goal(sampling_target(state, target_cv), probability=smallest)
        tail = sample_curve(state, goal, budget)
        stress = tail.quantile(smallest) if tail.complete else tail.reached
        return TailPoint(state, tail, stress)

    with Meter("failure_curve", show=progress) as meter, merge_warnings() as warned:
        warn_of_field(experiment)
        # 1.
        _, end, spent = with_enough_members(
            experiment, target_cv, meter, warned, max_evaluations, solve
        )
        # 2.
        for text in curve_doubts(end, smallest, target_cv):
            warn_accuracy(text)
    attributes = study_attributes(problem=problem, random=experiment.given, method=method)
    attributes["seed"] = seed
    # 3. If the event never happens, the only point is NaN.
    last = smallest if end.tail.complete else end.probability or COMMONEST
    end = replace(end, tail=end.tail._replace(spent=spent))
    return curve_of(end.tail, end.state, chances(last), attributes)


def curve_doubts(end: TailPoint, smallest: float, target_cv: float = CURVE_CV) -> list[str]:
    """Return the reasons not to trust the end of a curve (step 2).

    >>> from types import SimpleNamespace
    >>> tail = SimpleNamespace(complete=False, short_of=lambda goal: f"samples do not reach {goal}")
    >>> curve_doubts(SimpleNamespace(tail=tail), 1e-3)
    ['samples do not reach P = 0.001. The curve ends there']
    """
    if not end.tail.complete:
        return [f"{end.tail.short_of(f'P = {smallest:g}')}. The curve ends there"]
    return few_members(end.state.experiment.random, end, target_cv) + exact_doubts(end)


def chances(smallest: float) -> Array:
    """Return the probability at each point on a curve.

    A decade takes three steps. The steps are shorter if the last point is
    no whole number of steps away.

    >>> chances(0.05).round(6).tolist()
    [0.5, 0.232079, 0.107722, 0.05]
    >>> len(chances(0.02)), round(float(chances(0.02)[-1]), 6)  # 4.19 thirds of a decade
    (6, 0.02)
    >>> chances(0.5).tolist(), chances(0.7).tolist()
    ([0.5], [0.5])
    """
    # The last point lies at the smallest probability, also if it is no
    # power of ten.
    decades = max(np.log10(COMMONEST / smallest), 0.0)
    count = int(np.ceil(decades * PER_DECADE)) + 1
    return COMMONEST * 10.0 ** -np.linspace(0.0, decades, count)


def curve_of(
    tail: Tail, state: LimitState, wanted: Array, attributes: Mapping[str, Any]
) -> xr.Dataset:
    """Return the labelled curve of a tail at given probabilities (step 3).

    Four plain samples give the stresses at P = 0.5 and 0.25. One of four
    survives, so that no stress has the probability 0.8.

    >>> import math
    >>> from types import SimpleNamespace
    >>> from stiction.reliability.subset import Descent, Population
    >>> numbers = np.arange(4)
    >>> level = Population(math.inf, 0.0, np.array([3.0, 1.0, math.inf, 2.0]), numbers, numbers)
    >>> tail = Tail([Descent(4, [level], 0.0, 4, complete=True)], spent=70)
    >>> problem, method = SimpleNamespace(area=10.0), SimpleNamespace(type="own")
    >>> experiment = SimpleNamespace(problem=problem, pressure=5.0, method=method)
    >>> state = SimpleNamespace(bounds=(0.75, 9.0), several=False, experiment=experiment)
    >>> curve = curve_of(tail, state, np.array([0.8, 0.5, 0.25]), {"seed": 3})
    >>> for name in ("stress", "stress_above_bound", "friction_coefficient", "force"):
    ...     print(name, curve[name].values.round(6).tolist())
    stress [nan, 2.0, 1.0]
    stress_above_bound [nan, 1.25, 0.25]
    friction_coefficient [nan, 0.4, 0.2]
    force [nan, 20.0, 10.0]
    >>> curve.probability.values.tolist(), (curve.cv.values[1:] ** 2).round(6).tolist()
    ([nan, 0.5, 0.25], [0.333333, 3.0])
    >>> ends = lognormal_interval(0.5, 3.0**-0.5)
    >>> (float(curve.probability_low[1]), float(curve.probability_high[1])) == ends
    True
    >>> bool(curve.stress_low[1] == 0.75), round(float(curve.stress_high[1]), 6)
    (True, inf)
    >>> [curve.attrs[name] for name in ("seed", "evaluations", "repetitions", "survived", "method")]
    [3, 70, 1, 0.25, 'own']
    >>> curve.attrs["lower_bound"], [name for name in OF_A_LIST if name in curve]
    (0.75, [])

    Without an area and a pressure, the curve has no forces and no coefficients:

    >>> problem.area, experiment.pressure = None, math.nan
    >>> curve = curve_of(tail, state, np.array([0.5]), {})
    >>> "force" in curve, "friction_coefficient" in curve, "stress_above_bound" in curve
    (False, False, True)
    """
    lowest, pressure = state.bounds[0], state.experiment.pressure
    area = state.experiment.problem.area or np.nan
    rows, members = [], []
    for chance in wanted.tolist():
        point = TailPoint(state, tail, stress := tail.quantile(chance))
        members.append(point.members)
        values = stress, stress - lowest, stress / pressure, stress * area, point.probability
        ends = lognormal_interval(point.probability, point.cv)
        # Both intervals come from the same error: of the probability at
        # this stress, and of the stress at this probability.
        sides = tail.stress_interval(chance, point.cv, lowest)
        rows.append((*values, *ends, point.cv, *sides, *band_of(members[-1]), point.members_cv))
    table: dict[str, Any] = dict(zip(CURVE, np.array(rows).T, strict=False))
    table["members"] = np.array(members)
    # So many samples survive that no stress has this chance.
    survive = np.isinf(table["stress"])
    for values in table.values():
        values[survive] = np.nan
    known = dict.fromkeys(OF_A_LIST, state.several)
    known |= {"friction_coefficient": np.isfinite(pressure), "force": np.isfinite(area)}
    table = {name: values for name, values in table.items() if known.get(name, True)}
    about = {
        "evaluations": tail.spent,
        "repetitions": len(tail.repetitions),
        "lower_bound": lowest,
        "method": state.experiment.method.type,
        "survived": tail.survived,
    }
    return to_dataset(table, CURVE, {}, {**attributes, **about})
