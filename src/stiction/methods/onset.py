"""Compute the onset of given profiles by any method, and check approximate methods.

`onset`, `monte_carlo`, `infer` and failure probabilities check
approximate methods, such as the local criterion: they also solve some
samples by the exact method. `exact_counterpart` returns the exact
method. `may_differ` returns whether the check is needed. `doubt`
returns a warning.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError, collect_warnings, merge_warnings, warn_accuracy
from stiction.base.model import Progress, checked
from stiction.base.progress import Meter
from stiction.methods.protocol import (
    METHODS,
    Method,
    MethodObject,
    batch_size,
    label,
    optional_member,
    prepared,
    seconds_per_sample,
)
from stiction.problem.checks import doubt_sample
from stiction.problem.problem import Problem, refusals
from stiction.problem.results import study_attributes
from stiction.problem.sample import Sample

if TYPE_CHECKING:
    import xarray as xr

MAX_COMPARED, COMPARISON_SECONDS = 32, 2.0
"""Most samples that `onset` also solves by the exact method, and the
seconds for these samples."""
MAX_DIFFERENCE = 0.01
"""Mean or scatter of the difference, over the exact onset, above which
there is a warning."""


def exact_counterpart(problem: Problem, method: Method) -> Method | None:
    """Return the exact method that a method approximates, or `None`.

    The result is also `None` if the exact method cannot solve the problem.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> exact_counterpart(problem, st.LocalCriterion()).type
    'equilibrium'
    >>> exact_counterpart(problem, st.Equilibrium()) is None
    True
    """
    name = optional_member(method, "exact_method")
    exact: Method | None = METHODS[name]() if name else None
    return None if exact is None or exact.supports(problem) else exact


def relative_differences(stress: Array, exact: Array) -> Array:
    """Return the differences from exact onsets, divided by the mean of the exact onsets.

    A sample is left out if either method finds no onset.

    >>> relative_differences(np.array([3.0, np.nan, 2.0, 1.0]), np.array([2.0, 2.0, np.nan, 2.0]))
    array([ 0.5, -0.5])
    """
    # The mean, and not each onset, divides: an onset may be close to zero.
    known = np.isfinite(stress) & np.isfinite(exact)
    mean = np.abs(exact.mean(where=known)) if known.any() else 1.0
    return (stress - exact)[known] / mean


def doubt(method: Method, differences: Mapping[str, tuple[float, float]]) -> str | None:
    """Return a warning if the mean or scatter of a difference is above 1 %, otherwise `None`.

    `differences` maps a description of samples to their mean relative
    difference and its scatter.

    A mean of 1 % is no doubt, and a scatter of 1.5 % is.

    >>> from types import SimpleNamespace
    >>> method = SimpleNamespace(label="guess")
    >>> doubt(method, {"10 samples": (-0.01, 0.01)}) is None
    True
    >>> text = doubt(method, {"weak samples": (-0.002, 0.015), "all samples": (0.001, 0.004)})
    >>> print(text.replace(", and", ",\\nand").replace(" with", "\\nwith").replace(". ", ".\\n"))
    the guess differs from the exact onset by -0.2 % on average,
    with a scatter of 1.5 %, in weak samples,
    and by +0.1 % on average,
    with a scatter of 0.4 %, in all samples.
    method=st.Equilibrium() has no such error
    >>> doubt(method, {"10 samples": (-0.02, 0.0)}) is None
    False
    """
    if not any(abs(size) > MAX_DIFFERENCE for pair in differences.values() for size in pair):
        return None
    texts = [
        f"{100.0 * mean:+.2g} % on average, with a scatter of {100.0 * scatter:.2g} %, in {kind}"
        for kind, (mean, scatter) in differences.items()
    ]
    return (
        f"the {method.label} differs from the exact onset by {', and by '.join(texts)}."
        " method=st.Equilibrium() has no such error"
    )


@checked
def onset(
    problem: Problem, profiles: Any, *, method: MethodObject, progress: Progress = True
) -> xr.Dataset:
    """Compute the load and position at which interfaces with a given strength begin to slide.

    Parameters
    ----------
    problem : Problem
    profiles : array, mapping of arrays, xarray.Dataset or Sample
        Peak strength tau_p (Pa) with shape (samples, nodes) or
        (nodes,), or on a plane (samples, nx, ny) or (nx, ny).
        Alternatively, several profiles by name, such as ``{"strength":
        ..., "residual_strength": ...}``. Give each profile here or in
        the problem, not in both (see `Problem.sample`). In a DataArray
        or Dataset, the dimension 'x' runs along the interface (on a
        plane 'x' and 'y'), the coordinate (m) gives the position of
        each value, and stated `units` are converted (see
        `stiction.read_profile`). A DataArray with the unit 1, or the
        name 'friction_coefficient', holds friction coefficients, which
        are multiplied by the normal pressure.
    method : LocalCriterion, Equilibrium or Rupture
        The method that computes the onset. There is no default.
    progress : bool or callable
        True shows progress on standard error after a second. A callable
        receives (done, total).

    Returns
    -------
    xarray.Dataset
        Over 'sample': `critical_load`, `critical_stress`,
        `first_instability` (Pa), `critical_position` (m), and the
        variables that the method adds. If there is a normal pressure,
        the result includes `friction_coefficient`. If a thickness,
        width or area is known, it includes `critical_force` and
        `first_instability_force` (N). Every variable has `units` and
        `long_name`.

    Raises
    ------
    InputError
        If any argument is invalid. The message lists every mistake.

    Warns
    -----
    AccuracyWarning
        If the error of the local criterion exceeds 1 % in the first
        samples. These are checked only if a quick test leaves a doubt:
        as many as `Equilibrium` solves in two seconds, but at most 32.
    UnitWarning
        If a value is so unusual for a solid that its unit is in doubt.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> found = st.onset(problem, tau_p, method=st.LocalCriterion())
    >>> bool(found.critical_stress.item() > tau_p.min())
    True

    A table for pandas has a row for each sample:

    >>> len(found.to_dataframe())
    1
    """
    if refused := refusals(problem, method):
        raise InputError(refused)
    attributes = study_attributes(problem=problem, method=method)
    # Profiles pass the checks for users' data here, and nowhere else.
    sample = problem.sample(profiles, accept=optional_member(method, "accepts"))
    doubt_sample(problem, sample)
    # Batches keep arrays small, and let the progress move.
    solver, parts, size = prepared(problem, method), [], batch_size(problem, method)
    meter = Meter(f"onset by {method.label}", sample.samples, progress)
    with meter, merge_warnings() as warned:
        for start in range(0, sample.samples, size):
            part = sample.part(slice(start, start + size))
            with collect_warnings() as caught:
                parts.append(solver(part))
            # Samples are numbered in a batch: shift their numbers to
            # those in all profiles.
            warned += (text.after(start) for text in caught)
            meter.advance(part.samples)
    values = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    _compare(problem, method, sample, values["critical_stress"])
    return label(problem, method, values, np.arange(sample.samples), attributes)


def _compare(problem: Problem, method: Method, sample: Sample, stress: Array) -> None:
    """Warn if an approximate method is inaccurate for the first samples.

    The exact method solves as many samples as take
    `COMPARISON_SECONDS`, at most `MAX_COMPARED`.
    """
    # The cost determines how many samples are compared, and the quick test
    # whether any are.
    exact = exact_counterpart(problem, method)
    if exact is None:
        return
    seconds = seconds_per_sample(problem, exact)
    count = min(sample.samples, MAX_COMPARED, int(COMPARISON_SECONDS / seconds))
    first, stress = sample.part(slice(0, count)), stress[:count]
    if not count or not optional_member(method, "may_differ")(problem, first, stress):
        return
    # The exact method may warn of its own accuracy, which is not the
    # question here.
    with collect_warnings():  # and drop warnings of the comparison
        true = prepared(problem, exact)(first)["critical_stress"]
    differences = relative_differences(stress, true)
    kind = f"the first {count} of {sample.samples} samples"
    if text := doubt(method, {kind: (differences.mean(), differences.std())}):
        warn_accuracy(text)
