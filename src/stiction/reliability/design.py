"""The design stress, and its change with assumed distributions and constants.

Problem. Estimate the stress below which the interface slides with a
given probability. Its interval contains the error of the computation.
Assumptions have a larger effect: constants in the problem that were not
measured, and the distribution between specimens. How large is
this effect?

Source. The method is local sensitivities with common random numbers, as
in Asmussen and Glynn, Stochastic Simulation (2007), chapter VII.

Steps:

1. Count many specimens for each solved field, if this costs less
   (`counting`). Otherwise sample the tail (`tail`). The design stress is
   a quantile of the onset.
2. If so many onsets lie at their lower bound that the design stress is
   the bound itself, return the bound.
3. For the sensitivities, take the quantile at the design probability:
   from the prediction of a fit or posterior
   (`inference.specimens.Prediction`), or else from `SAMPLES_PER_END`
   samples (`counting.solve_specimens`). All further steps use the same
   draws, so that differences are accurate.
4. For each family, take the quantile over the posterior given the
   family, or over the interfaces with this family.
5. For each constant repeat step 3 at both ends of its range: a stated
   range, or `USUAL_SHARE` below and above its value. A posterior infers
   the strength again from the same tests with the changed constant.
6. Multiply the design by the ratios of the quantiles from steps 4 and 5
   to the quantile from step 3.
"""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple, Self

import numpy as np
import pandas as pd
import xarray as xr

from stiction.base.arrays import Array
from stiction.base.errors import InputError, collect_warnings
from stiction.base.model import Count, Flag, Number, Progress, Real, checked, is_finite
from stiction.base.progress import Meter
from stiction.ensemble.experiment import Experiment, method_of
from stiction.ensemble.limit_state import LimitState, weakest_first
from stiction.methods.protocol import MethodObject
from stiction.problem.problem import Problem
from stiction.random.dotted_keys import value_at, with_values
from stiction.random.equally_likely import AnyRandom, Predictive, as_random
from stiction.random.marginals import FACTOR_FAMILIES
from stiction.random.spectra import Share
from stiction.reliability.answer import Answer
from stiction.reliability.counting import CHARACTERISTIC, Counts, count_tail, solve_specimens
from stiction.reliability.solving import (
    Budget,
    Probability,
    TargetCv,
    answered,
    exact_doubts,
    exact_law,
    exact_tail,
    imprecise,
    prepare,
    sampling_target,
    undetermined,
)
from stiction.reliability.tail import FREQUENT, Goal, TailPoint, sample_tail

SAMPLES_PER_END = 300
"""Number of samples that are solved at each end of a range."""
USUAL_SHARE = 0.1
"""Fraction of a constant below and above its value if no range is stated."""
CONSTANTS = (
    "friction.residual_ratio", "friction.residual_strength", "friction.weakening_rate",
    "friction.critical_slip", "friction.fracture_energy", "load.normal_pressure",
    "load.pressing_force", "solid.shear_modulus", "specimen.height", "specimen.drive.stiffness",
    "specimen.drive.height",
)  # fmt: skip
"""Dotted keys of constants that may be assumptions, if they are numbers
in a problem."""
FAMILY = "distribution between specimens"


@checked
def design_stress(
    problem: Problem,
    random: AnyRandom,
    *,
    probability: Probability,
    method: MethodObject | None = None,
    target_cv: TargetCv = 0.1,
    seed: Number = 0,
    max_evaluations: Budget | None = None,
    confidence: Share = 0.75,
    sensitivities: Flag | dict[str, tuple[Real, Real]] | None = None,
    workers: Count | None = None,
    progress: Progress = True,
) -> Answer:
    """Estimate the stress below which the interface slides with a given probability.

    The design stress is a quantile of the onset stress. One set of
    repetitions gives the quantile.

    Parameters
    ----------
    probability : float
        Between 0 and 1, such as 1e-6.
    method : LocalCriterion or Equilibrium
        By default the method of a posterior.
        `Rupture`, or a method that would take more than
        a quarter of an hour on one core, is refused
        unless `max_evaluations` is 20,000 or more.
    target_cv : float
        Coefficient of variation to reach for the failure probability at
        the design stress.
    confidence : float
        Confidence of the `characteristic_stress`.
    sensitivities : bool or mapping, optional
        Whether to compute how families and constants affect the design. By default
        this is done if `random` is a fit or a posterior. A mapping from
        dotted keys in the problem to ranges, such as
        ``{"problem.friction.residual_ratio": (0.6, 0.8)}``, replaces the usual 10 %
        on either side. Sources without a prediction by a formula solve 300 samples for
        each end of a range. They come on top of `max_evaluations`.
    problem, random, seed, max_evaluations, workers, progress
        As in `failure_probability`.

    Returns
    -------
    Answer
        With `stress`, its 90 % `interval` due to the error of the
        computation (Pa), and `sensitivities`.

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

    def solve(experiment: Experiment, meter: Meter, spent: int) -> Answer:
        state, budget = prepare(experiment, workers, meter, max_evaluations, spent=spent)
        answer = _quantile(state, probability, target_cv, budget, confidence)
        by_default = experiment.random.source is not None
        wanted = by_default if sensitivities is None else bool(sensitivities)
        if wanted and math.isfinite(answer.stress):
            stated = sensitivities if isinstance(sensitivities, dict) else {}
            effects = sensitivities_of(state, probability, answer.stress, stated)
            answer = replace(answer, sensitivities=effects)
        return replace(answer, quantity="stress" if math.isnan(answer.area) else "force")

    method = method_of(random, method)
    experiment = Experiment(problem, as_random(random, seed), method, seed=seed)
    return answered(experiment, target_cv, "design_stress", progress, max_evaluations, solve)


def _quantile(
    state: LimitState, probability: float, target_cv: float, budget: int, confidence: float
) -> Answer:
    """Return the design stress, by counting or from the tail (steps 1 and 2)."""
    lowest = state.bounds[0]
    goal = Goal(sampling_target(state, target_cv), probability=probability)
    asked: dict[str, Any] = {"probability": probability, "of_stress": True}
    # 1. Specimens that differ only as a whole need no samples.
    if (law := exact_law(state)) is not None:
        stress, tail = law.quantile(probability), exact_tail(state)
        source: Any = state.experiment.random.source
        whole = law.characteristic(source.u, CHARACTERISTIC, confidence)
        return Answer.at(
            TailPoint(state, tail, stress), (stress, stress),
            undetermined(state, law, probability), cv=0.0, members_cv=0.0, members=np.zeros(0),
            characteristic_stress=whole, confidence=confidence, **asked,
        )  # fmt: skip
    # Counted specimens are whole samples, so they also give the
    # characteristic value.
    counts, enough = count_tail(state, goal, budget)
    if counts:
        asked["characteristic_stress"] = counts.characteristic(confidence)
        asked["confidence"] = confidence
    if counts and enough:
        tail = counts.tail
    else:
        often, counted = probability >= FREQUENT, len(counts.values) if counts else 0
        tail = sample_tail(
            weakest_first(state), goal, budget=budget - counted,
            algorithm="subset" if often else "auto",
            reason=f"the probability is {'at least' if often else 'below'} {FREQUENT:g}",
        )  # fmt: skip
        tail = tail._replace(spent=counted + tail.spent)
    if not tail.complete:  # the tail ends at its lowest sample
        point = TailPoint(state, tail, tail.extent[0])
        interval = (lowest, point.stress) if point.stress > lowest else state.bounds
        doubts = [tail.short_of(f"P = {probability:g}")]
        return Answer.at(point, interval, doubts, cv=math.inf, members_cv=0.0, **asked)
    point, doubts = TailPoint(state, tail, tail.quantile(probability)), []
    # 2. A lower bound of strength, or the accuracy of the method, lets
    # onsets accumulate.
    bound = TailPoint(state, tail, math.nextafter(lowest, math.inf))
    if bound.probability >= probability:
        point, asked["stress"] = bound, lowest
        doubts.append(
            f"{bound.probability:.2g} of all samples slide at the bound of {lowest:.7g} Pa, within"
            f" the accuracy of the method. The stress at P = {probability:g} is the bound itself"
        )
    interval = tail.stress_interval(probability, point.cv, lowest)
    if math.isinf(point.stress):
        interval = interval[0], math.inf
        doubts.append(
            f"the event happens in {1.0 - tail.survived:.3g} of all samples, less than"
            f" P = {probability:g}. No stress has that probability"
        )
    doubts += imprecise(point.sampling_cv, goal.cv, tail.spent) + exact_doubts(point)
    return Answer.at(point, interval, doubts, **asked)


def ranges_of(problem: Any, source: Any, stated: Mapping[str, Any]) -> dict[str, Any]:
    """Return the range of each constant that may be an assumption, by full key.

    The constants of a problem, by 10 % on either side. Zero, a field and a missing
    value have no range.

    >>> from types import SimpleNamespace
    >>> friction = SimpleNamespace(residual_ratio=0.5, residual_strength=0.0)
    >>> friction.weakening_rate, friction.critical_slip = np.ones(3), None
    >>> problem = SimpleNamespace(friction=friction, load=SimpleNamespace(pressing_force=20.0))
    >>> def shown(ranges):
    ...     for key, ends in ranges.items():
    ...         print(key, *(round(end, 6) for end in ends))
    >>> shown(ranges_of(problem, None, {}))
    problem.friction.residual_ratio 0.45 0.55
    problem.load.pressing_force 18.0 22.0

    Assumptions of a fit are added, and stated ranges replace the usual ones:

    >>> source = SimpleNamespace(assumed={"random.correlation_length": 2.0})
    >>> stated = {"random.correlation_length": [1.0, 4.0]}
    >>> stated["problem.friction.residual_strength"] = 0.0, 2.0
    >>> shown(ranges_of(problem, source, stated))
    problem.friction.residual_ratio 0.45 0.55
    problem.load.pressing_force 18.0 22.0
    random.correlation_length 1.0 4.0
    problem.friction.residual_strength 0.0 2.0
    >>> key = "problem.friction.critical_slip"
    >>> ranges_of(problem, None, {key: (1.0, 2.0)})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: sensitivities: ...critical_slip: is not a constant ...
    """
    values = {f"problem.{key}": value_at(problem, key) for key in CONSTANTS}
    values |= getattr(source, "assumed", {})
    ranges = {
        key: (value * (1.0 - USUAL_SHARE), value * (1.0 + USUAL_SHARE))
        for key, value in values.items()
        if np.ndim(value) == 0 and is_finite(value) and value > 0.0
    }
    for key, ends in stated.items():
        known = key.startswith("problem.") and value_at(problem, key[8:]) is not None
        if not known and key not in ranges:
            raise InputError(f"sensitivities: {key}: is not a constant of this problem")
        ranges[key] = tuple(ends)
    return ranges


class _Counted(NamedTuple):
    """Prediction from samples, for interfaces without a prediction of their own.

    >>> from types import SimpleNamespace
    >>> counts = SimpleNamespace(
    ...     members=np.array([[0, 1], [2, 0]]), values=np.array([[1.0, 2.0], [4.0, 5.0]]),
    ...     tail=SimpleNamespace(quantile=lambda probability: 9.0),
    ... )
    >>> counted = _Counted(counts, np.array(["normal", "weibull", "weibull", "lognormal"]))
    >>> counted.families
    ['normal', 'weibull']
    >>> counted.quantile(0.25), counted.quantile(0.25, "weibull"), counted.quantile(0.5, "normal")
    (9.0, 2.5, 3.0)
    """

    counts: Counts
    kinds: Array  # family of the factor of each interface

    @classmethod
    def of(cls, state: LimitState, changes: Mapping[str, float]) -> Self:
        experiment = state.experiment
        given = {key.removeprefix("problem."): value for key, value in changes.items()}
        changed = replace(experiment, problem=with_values(experiment.problem, given, "problem"))
        counts = solve_specimens(replace(state, experiment=changed), 0, SAMPLES_PER_END)
        laws, law = experiment.random.factor_laws
        names = {family: name for name, family in FACTOR_FAMILIES.items()}
        kinds = [names.get(type(one), getattr(one, "type", "none")) for one in laws]
        return cls(counts, np.array(kinds)[law])

    def quantile(self, probability: float, family: str | None = None) -> float:
        if family is None:
            return self.counts.tail.quantile(probability)
        alike = self.kinds[self.counts.members] == family
        return float(np.quantile(self.counts.values[alike], probability))

    @property
    def families(self) -> list[str]:
        return [str(name) for name in np.unique(self.kinds[self.counts.members])]


def sensitivities_of(
    state: LimitState, probability: float, stress: float, stated: Mapping[str, Any]
) -> xr.Dataset:
    """Return the design stress at both ends of each source, with the largest effect first.

    Here the quantile of the prediction is 4 Pa, divided by the ratio 0.5 and
    times the force of 20 N, and times 0.5 for the lognormal family. The design is
    6 Pa at an area of 3 m².

    >>> from types import SimpleNamespace
    >>> from stiction.base.progress import SILENT
    >>> class Source:
    ...     notes = doubts = ()
    ...     assumed = {}
    ...     def interfaces(self, count, seed):
    ...         return []
    ...     def prediction(self, problem, method, changes, workers):
    ...         ratio = changes.get("problem.friction.residual_ratio", 0.5)
    ...         force = changes.get("problem.load.pressing_force", 20.0)
    ...         if force > 25.0:
    ...             raise InputError("too large")
    ...         factors = {None: 1.0, "normal": 1.0, "lognormal": 0.5}
    ...         def quantile(probability, family=None):
    ...             return 4.0 * ratio / 0.5 * (force / 20.0) ** 2 * factors[family]
    ...         return SimpleNamespace(families=["normal", "lognormal"], quantile=quantile)
    ...     def without_field(self, problem, method):
    ...         return SimpleNamespace(quantile=lambda probability: 5.0)
    >>> problem = SimpleNamespace(
    ...     friction=SimpleNamespace(residual_ratio=0.5), area=3.0,
    ...     load=SimpleNamespace(pressing_force=20.0),
    ... )
    >>> source = Source()
    >>> experiment = SimpleNamespace(
    ...     problem=problem, method=None, random=SimpleNamespace(source=source)
    ... )
    >>> state = SimpleNamespace(experiment=experiment, workers=1, meter=SILENT)
    >>> def shown(stated):
    ...     effects = sensitivities_of(state, 0.01, 6.0, stated)
    ...     for row in effects.to_dataframe().round(4).itertuples():
    ...         print(*row[:5])
    ...     return effects
    >>> effects = shown({})
    distribution between specimens lognormal normal 3.0 6.0
    problem.load.pressing_force 18 22 4.86 7.26
    problem.friction.residual_ratio 0.45 0.55 5.4 6.6
    >>> effects.force_at_low.values.round(4).tolist()
    [9.0, 14.58, 16.2]
    >>> effects.force_at_high.values.round(4).tolist()
    [18.0, 21.78, 19.8]
    >>> effects.attrs["stress by lognormal"], effects.attrs["stress by normal"]
    (3.0, 6.0)
    >>> effects.attrs["probability"], effects.attrs["stress"]
    (0.01, 6.0)

    The field of a specimen, if it is an assumption, and a value that is not possible:

    >>> source.assumed = {"random.correlation_length": 2.0}
    >>> _ = shown({"problem.load.pressing_force": (10.0, 30.0)})
    distribution between specimens lognormal normal 3.0 6.0
    variation along a specimen none as stated 7.5 6.0
    problem.friction.residual_ratio 0.45 0.55 5.4 6.6
    random.correlation_length 1.8 2.2 6.0 6.0
    """
    experiment = state.experiment
    problem, source = experiment.problem, experiment.random.source

    def predicted(changes: Mapping[str, float]) -> Any:
        known = None
        if isinstance(source, Predictive):
            known = source.prediction(problem, experiment.method, changes, state.workers)
        return _Counted.of(state, changes) if known is None else known

    rows: list[tuple[str, str, str, float, float]] = []  # source, its ends, quantiles there
    with collect_warnings():
        # 3. The reference takes the same samples as the ends, not those
        # of the design.
        known = predicted({})
        reference = known.quantile(probability)
        # 4.
        families = {name: known.quantile(probability, name) for name in known.families}
        if len(families) > 1:
            least, most = (pick(families, key=families.__getitem__) for pick in (min, max))
            rows.append((FAMILY, least, most, families[least], families[most]))
        # A field that was stated and not measured: what did it change?
        if getattr(source, "assumed", None):
            whole = source.without_field(problem, experiment.method).quantile(probability)
            rows.append(("variation along a specimen", "none", "as stated", whole, reference))
        # 5.
        for key, ends in ranges_of(problem, source, stated).items():
            state.meter.note = f"what moves the design: {key}"
            try:
                low, high = (predicted({key: end}).quantile(probability) for end in ends)
            except InputError:  # the constant cannot have this value
                continue
            rows.append((key, f"{ends[0]:.4g}", f"{ends[1]:.4g}", low, high))
    # 6. The widest range comes first.
    rows.sort(key=lambda row: -abs(row[4] - row[3]))
    names = "source", "low", "high", "stress_at_low", "stress_at_high"
    effects = pd.DataFrame(rows, columns=names).set_index("source").to_xarray()
    effects.attrs = {"probability": probability, "stress": stress}
    if len(families) > 1:
        ratios = {name: value / reference for name, value in families.items()}
        effects.attrs |= {f"stress by {name}": stress * r for name, r in ratios.items()}
    area = problem.area or np.nan
    for end in ("low", "high"):
        ratio = effects[f"stress_at_{end}"].values / reference
        effects[f"stress_at_{end}"] = "source", stress * ratio, {"units": "Pa"}
        effects[f"force_at_{end}"] = "source", area * stress * ratio, {"units": "N"}
    return effects
