"""A pilot: solve some samples of an approximate method also with its exact counterpart.

Problem. How much do the onsets from an approximate method, such as the
local criterion, differ from the exact onsets of the same samples?

Steps, at up to `MAX_PILOT_POINTS` sweep points:

1. Select the first samples that have an onset, and the weakest among
   the first `MAX_RANKED_SAMPLES` of them.
2. Test quickly, with the method, whether their onsets may differ from
   the exact onsets. If not, stop.
3. Solve these samples exactly. The difference divided by the mean exact
   onset has a mean (bias) and a standard deviation (scatter). Report
   the largest values over all points.
"""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, collect_warnings
from stiction.base.progress import Meter
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.ensemble.experiment import Experiment
from stiction.methods.onset import doubt, exact_counterpart, relative_differences
from stiction.methods.protocol import optional_member

SAMPLES_ON_LINE, SAMPLES_ON_PLANE = 32, 8
"""Number of first samples, and of weakest samples."""
MAX_RANKED_SAMPLES = 1000
"""Number of first samples among which the weakest are found."""
MAX_PILOT_POINTS = 8
"""Most points of a sweep that have a pilot."""


def compare(
    points: Sequence[Experiment],
    onsets: Array | None = None,
    show: bool = False,
    workers: int | None = None,
) -> dict[str, Any]:
    """Return the bias and scatter of an approximate method for the first and weakest samples.

    `onsets` (points, samples) has the critical stresses, or NaN. By
    default a few samples are solved. The result is empty if there is no
    exact counterpart, or if no point leaves a doubt.

    An exact method leaves no doubt.

    >>> from types import SimpleNamespace as Named
    >>> exact = Named(exact_method=None)
    >>> compare([Named(problem=None, method=exact)] * 3, np.ones((3, 2)), workers=1)
    {}
    """
    chosen = np.unique(np.linspace(0, len(points) - 1, MAX_PILOT_POINTS).round().astype(int))
    parts: dict[str, list[Array]] = {}
    cores = workers or usable_cores()
    with Meter("comparing with the exact onset", len(chosen), show, unit="points") as meter:
        for point in chosen.tolist():
            known = None if onsets is None else onsets[point]
            differences = _differences(points[point], known, cores)
            for name, relative in differences.items():
                if relative.size:
                    parts.setdefault(name, []).append(relative)
            meter.advance()
    attributes: dict[str, Any] = {}
    for name, differing in parts.items():
        attributes[f"{name}_samples"] = differing[0].size
        attributes[f"{name}_bias"] = float(max((part.mean() for part in differing), key=abs))
        attributes[f"{name}_scatter"] = float(
            max(part.std(ddof=1) if part.size > 1 else 0.0 for part in differing)
        )
    return attributes


def _differences(
    experiment: Experiment, stress: Array | None, workers: int
) -> dict[str, Array]:
    """Return differences from the exact onset over its mean, for the first and weakest samples.

    The result is empty without an exact counterpart, or if the quick
    test leaves no doubt.

    Samples 1 to 32 are the first with an onset, and samples 8 to 39 the
    weakest. Their exact onsets are 1 lower, with the means 32.5 and 25.5.

    >>> from types import SimpleNamespace as Named
    >>> import stiction as st
    >>> def experiment(differs, lower=0.0):
    ...     problem = st.paper.problem(nodes=256)
    ...
    ...     def solve(draws):
    ...         return {}, {"critical_stress": 50.0 - lower - draws[:, 0]}
    ...
    ...     return Named(
    ...         problem=problem,
    ...         solve=solve,
    ...         profiles=lambda draws: draws,
    ...         sample=lambda draws: draws,
    ...         draws=lambda first, count: np.full((count, 1), float(first)),
    ...         method=Named(exact_method="equilibrium", may_differ=differs),
    ...         by=lambda exact: experiment(differs, 1.0),
    ...     )
    >>> onsets = 50.0 - np.arange(40.0)
    >>> onsets[0] = np.nan
    >>> def by_exact(problem, sample, stress):
    ...     return stress[0] == 50.0 - sample[0, 0]
    >>> found = _differences(experiment(by_exact), onsets, workers=1)
    >>> [
    ...     (name, part.size, np.unique((1.0 / part).round(9)).tolist())
    ...     for name, part in found.items()
    ... ]
    [('pilot', 32, [32.5]), ('pilot_weakest', 32, [25.5])]
    >>> _differences(experiment(lambda *given: False), onsets, 1)  # no doubt
    {}
    >>> found = _differences(experiment(by_exact), onsets[:9], 1)
    >>> [(name, part.size) for name, part in found.items()]
    [('pilot', 8)]
    >>> _differences(experiment(by_exact), np.full(3, np.nan), 1)
    {}
    >>> found = _differences(experiment(by_exact), None, 1)  # samples 0 to 31
    >>> [
    ...     (name, part.size, np.unique((1.0 / part).round(9)).tolist())
    ...     for name, part in found.items()
    ... ]
    [('pilot', 32, [33.5])]
    """
    problem, method = experiment.problem, experiment.method
    exact = exact_counterpart(problem, method)
    if exact is None:
        return {}
    with collect_warnings():  # the ensemble itself warns
        if stress is None:
            stress = onsets_of(experiment, np.arange(SAMPLES_ON_LINE), workers)
        # 1.
        solved = np.flatnonzero(np.isfinite(stress))[:MAX_RANKED_SAMPLES]
        size = SAMPLES_ON_PLANE if problem.interface.is_plane else SAMPLES_ON_LINE
        chosen = {"pilot": solved[:size]}
        if solved.size > size:
            chosen["pilot_weakest"] = solved[np.argsort(stress[solved])[:size]]
        if not solved.size:
            return {}
        # 2.
        for rows in chosen.values():
            draws = np.concatenate([experiment.draws(row, 1) for row in rows.tolist()])
            sample = experiment.sample(experiment.profiles(draws))
            if optional_member(method, "may_differ")(problem, sample, stress[rows]):
                break
        else:
            return {}
        # 3.
        some = np.unique(np.concatenate(list(chosen.values())))
        true = np.full(stress.size, np.nan)
        true[some] = onsets_of(experiment.by(exact), some, workers)
    return {
        name: relative_differences(stress[rows], true[rows]) for name, rows in chosen.items()
    }


def onsets_of(experiment: Experiment, numbers: NDArray[np.int64], workers: int) -> Array:
    """Return the stress at the onset of samples, or NaN if it cannot be solved.

    >>> from types import SimpleNamespace as Named
    >>> def solve(number):
    ...     if number == 3:
    ...         raise ArithmeticError
    ...     return {}, {"critical_stress": np.array([10.0 * number])}
    >>> experiment = Named(draws=lambda first, count: first * count, solve=solve)
    >>> onsets_of(experiment, np.array([5, 3, 1]), workers=2).tolist()
    [50.0, nan, 10.0]
    """

    def solve(number: int) -> float:
        try:
            _, values = experiment.solve(experiment.draws(number, 1))
        except (InputError, RuntimeError, ArithmeticError):
            return np.nan
        return float(values["critical_stress"][0])

    return np.array(in_threads(solve, numbers.tolist(), workers))


def pilot_doubt(
    experiment: Experiment, comparison: Mapping[str, Any], where: str = ""
) -> str | None:
    """Return a warning if a difference from the exact onset exceeds 1 %.

    >>> from types import SimpleNamespace as Named
    >>> experiment = Named(method=Named(label="local criterion"))
    >>> comparison = {"pilot_samples": 32, "pilot_bias": 0.009, "pilot_scatter": 0.01}
    >>> pilot_doubt(experiment, comparison) is pilot_doubt(experiment, {}) is None
    True
    >>> weakest = {
    ...     "pilot_weakest_samples": 7,
    ...     "pilot_weakest_bias": -0.05,
    ...     "pilot_weakest_scatter": 0.02,
    ... }
    >>> text = pilot_doubt(experiment, comparison | weakest, " at the worst point")
    >>> text[:88]
    'the local criterion differs from the exact onset by +0.9 % on average, with a scatter of'
    >>> text[89:137]
    '1 %, in the 32 first samples at the worst point,'
    >>> text[142:212]
    'by -5 % on average, with a scatter of 2 %, in the 7 weakest of more at'
    """
    differences = {
        f"the {comparison[f'{name}_samples']} {text}{where}": (
            comparison[f"{name}_bias"], comparison[f"{name}_scatter"]
        )
        for name, text in (("pilot", "first samples"), ("pilot_weakest", "weakest of more"))
        if f"{name}_bias" in comparison
    }  # fmt: skip
    return doubt(experiment.method, differences)
