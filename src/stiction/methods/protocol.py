"""The protocol of methods, all methods, and the onset of given profiles by any of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator

from stiction.base.errors import InputError, collect_warnings, merge_warnings, warn_accuracy
from stiction.base.kinds import Kinds
from stiction.base.model import Progress, checked, is_finite
from stiction.base.progress import Meter
from stiction.base.variables import (
    DIRECTION,
    FRICTION_COEFFICIENT,
    ONSET_VARIABLES,
    SAMPLE,
    Variable,
    force_variables,
    forces,
)
from stiction.problem.problem import Problem, refusals
from stiction.problem.profiles.placing import with_gaps
from stiction.problem.results import study_attributes, to_dataset
from stiction.problem.sample import Sample

if TYPE_CHECKING:
    import xarray as xr

TICK, MOST = 0.5, 512
"""Seconds of work, and most samples, that are solved at once."""
COMPARED, SECONDS = 32, 2.0
"""Most samples that are solved exactly beside the local criterion, and the seconds for them."""
WORTH_A_WARNING = 1.0
"""Mean or scatter of their differences, per cent, above which there is a warning."""

Values = dict[str, NDArray[Any]]
Solver = Callable[[Sample], Mapping[str, NDArray[Any]]]

OWN = {
    "local_criterion": "methods.criterion.local:LocalCriterion",
    "equilibrium": "methods.equilibrium.method:Equilibrium",
    "rupture": "methods.dynamics.method:Rupture",
}
METHODS: Kinds = Kinds("methods", OWN)
"""The classes of methods by their `type`."""


class Method(Protocol):
    """Protocol of a method: options, and a solver that follows from them.

    Any frozen dataclass with these members serves `stiction.onset` and `stiction.monte_carlo`, and
    study files too if `stiction.extensions.register` or an entry point makes its `type` known.
    Two more members are optional: `accepts`, of "barriers" and "overstress" (see
    `Problem.sample`); and `first_stage`, the type of a faster method with similar onsets, by which
    rare failures are found first.
    """

    @property
    def type(self) -> str:
        """Its name in study files."""

    @property
    def label(self) -> str:
        """Its name in figures, tables and progress."""

    def variables(self, problem: Problem) -> Mapping[str, Variable]:
        """What the solver returns, each with 'sample' as first dimension.

        All of `stiction.extensions.onset_variables` must be among them.
        """

    def seconds_per_sample(self, problem: Problem) -> float:
        """About how long a sample takes on one core, in seconds, to a factor of three."""

    def supports(self, problem: Problem) -> list[str]:
        """Reasons why it cannot take a problem; none if it can."""

    def prepare(self, problem: Problem) -> Solver:
        """A solver of samples; what is the same for all of them is computed here, once."""


MEMBERS = [name for name in vars(Method) if not name.startswith("_")]
"""What every method has."""


def as_method(value: Any) -> Any:
    """Return a method, or raise a ValueError that names what it lacks."""
    if isinstance(value, type):
        raise ValueError(f"must be an object; write st.{value.__name__}(...)")
    missing = [name for name in MEMBERS if not hasattr(value, name)]
    if missing:
        raise ValueError(
            "must be a method object such as st.LocalCriterion(), st.Equilibrium() or"
            f" st.Rupture(loading_rate=...); lacks {', '.join(missing)}"
        )
    return value


MethodObject: TypeAlias = Annotated[Any, BeforeValidator(as_method)]
"""Annotation of an argument that is a method; see `stiction.base.model.checked`."""


def prepared(problem: Problem, method: Method) -> Solver:
    """Return the solver of a method, which checks its values and adds friction coefficients."""
    solver = method.prepare(problem)
    variables = method.variables(problem)
    lacking = [name for name in ONSET_VARIABLES if name not in variables]
    if lacking:
        raise InputError(f"method: the variables of {method.label} lack {', '.join(lacking)}")

    def solve(sample: Sample) -> Values:
        values = {name: np.asarray(found) for name, found in solver(sample).items()}
        _check_values(method.label, values, variables, sample)
        pressure = sample.normal_pressure.mean(axis=sample.axes)
        if not np.isnan(pressure).all():
            values["friction_coefficient"] = values["critical_stress"] / pressure
        return values if problem.area is None else values | forces(values, problem.area)

    return solve


def _check_values(
    name: str, values: Values, variables: Mapping[str, Variable], sample: Sample
) -> None:
    if values.keys() != variables.keys():
        raise InputError(
            f"method: the solver of {name} must return its variables {', '.join(variables)};"
            f" got {', '.join(values)}"
        )
    sizes = dict(zip(("x", "y"), sample.shape, strict=False))
    sizes |= {"sample": sample.samples, DIRECTION: 2}
    for one, variable in variables.items():
        shape = tuple(sizes.get(dim) for dim in variable.dims)
        if values[one].shape != shape and None not in shape:
            raise InputError(
                f"method: the solver of {name} must return {one!r} of shape {shape} over"
                f" ({', '.join(variable.dims)}), got {values[one].shape}"
            )


def seconds_per_sample(problem: Problem, method: Method) -> float:
    """Return about how long a sample takes, s, at least a nanosecond; refuse what is no time."""
    seconds = method.seconds_per_sample(problem)
    if not (is_finite(seconds) and seconds >= 0.0):
        raise InputError(
            f"method: seconds_per_sample of {method.label} must return a number of seconds, zero"
            f" or more, got {seconds!r}"
        )
    return max(float(seconds), 1e-9)


def batch_size(problem: Problem, method: Method) -> int:
    """Return how many samples to solve at once: half a second of work, at most 512."""
    return max(1, min(MOST, int(TICK / seconds_per_sample(problem, method))))


def variables_of(
    problem: Problem, method: Method, pressure: bool = False
) -> dict[str, Variable]:
    """Return the variables of a prepared solver; `pressure`: if that differs by sample."""
    variables = dict(method.variables(problem))
    if pressure or problem.given_pressure is not None:
        variables["friction_coefficient"] = FRICTION_COEFFICIENT
    return variables if problem.area is None else variables | force_variables(variables)


def label(
    problem: Problem,
    method: Method,
    values: Mapping[str, NDArray[Any]],
    samples: NDArray[np.int64],
    attributes: Mapping[str, Any],
    more_variables: Mapping[str, Variable] = MappingProxyType({}),
) -> xr.Dataset:
    """Label values of many samples: a dataset over 'sample', and the nodes where they differ."""
    variables = variables_of(problem, method, "friction_coefficient" in values)
    coordinates = {"sample": (samples, SAMPLE)}
    return to_dataset(
        values, variables | dict(more_variables), coordinates, attributes, problem.interface
    )


def _doubt(problem: Problem, method: Method, sample: Sample, values: Values) -> str | None:
    """Return a warning if the local criterion is off in the first samples; None if it is not.

    As many are solved by `Equilibrium` as take two seconds.
    """
    exact = METHODS["equilibrium"]()
    if method.type != "local_criterion" or exact.supports(problem):
        return None
    count = min(sample.samples, COMPARED, int(SECONDS / seconds_per_sample(problem, exact)))
    if not count:
        return None
    with collect_warnings():
        true = prepared(problem, exact)(sample.part(slice(0, count)))["critical_stress"]
    off = 100.0 * (values["critical_stress"][:count] / true - 1.0)
    if not max(abs(off.mean()), off.std()) > WORTH_A_WARNING:
        return None
    return (
        f"the local criterion differs from the exact onset by {off.mean():+.2g} % on average, in"
        f" one by {off[np.abs(off).argmax()]:+.2g} %, in the first {count} of {sample.samples}"
        " samples; method=st.Equilibrium() has no such error"
    )


@checked
def onset(
    problem: Problem,
    profiles: Any,
    *,
    method: MethodObject,
    gaps: Literal["refuse", "fill"] = "refuse",
    progress: Progress = True,
) -> xr.Dataset:
    """Compute the load and position at which interfaces of given strength begin to slide.

    Parameters
    ----------
    problem : Problem
    profiles : array, mapping of arrays, xarray.Dataset or Sample
        Peak strength tau_p (Pa), of shape (samples, nodes) or (nodes,), on a plane
        (samples, nx, ny) or (nx, ny); or several profiles by name, such as ``{"strength":
        ..., "residual_strength": ...}``, each given here or in the problem, not in both; see
        `Problem.sample`. In a DataArray or Dataset, the dimension 'x' runs along the
        interface (on a plane 'x' and 'y'), its coordinate (m) gives the position of each
        value, and stated `units` are converted; see `stiction.read_profile`. A DataArray in the
        unit 1, or the name 'friction_coefficient', holds friction coefficients, which times the
        normal pressure are the strength.
    method : LocalCriterion, Equilibrium or Rupture
        The method; there is no default.
    gaps : {"refuse", "fill"}
        Whether to refuse missing values (NaN) or fill them as `stiction.read_profile` does.
    progress : bool or callable
        True shows progress on standard error after two seconds; a callable gets (done, total).

    Returns
    -------
    xarray.Dataset
        Over 'sample': `critical_load`, `critical_stress`, `first_instability` (Pa),
        `critical_position` (m), with a normal pressure `friction_coefficient`, with a thickness,
        width or area `critical_force` and `first_instability_force` (N), and what the method
        adds. Every variable has `units` and `long_name`. If gaps were filled, also
        `in_gap`, whether the critical patch reaches into one, and the coordinate `measured`.

    Raises
    ------
    InputError
        If any argument is invalid; the message lists every problem.

    Warns
    -----
    AccuracyWarning
        If gaps are filled, or the onset lies in one; if the local criterion is off by more than
        1 % in the first samples, at most 32, that `Equilibrium` solves in two seconds.
    UnitWarning
        If a value is so far from what solids have that its unit is in doubt.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> found = st.onset(problem, tau_p, method=st.LocalCriterion())
    >>> bool(found.critical_stress.item() > tau_p.min())
    True
    """
    if refused := refusals(problem, method):
        raise InputError(refused)
    attributes = study_attributes(problem=problem, method=method)
    sample, measured = problem.placed_sample(profiles, getattr(method, "accepts", ()), gaps)
    problem.doubt(sample)
    solver, parts, size = prepared(problem, method), [], batch_size(problem, method)
    meter = Meter(f"onset by {method.label}", sample.samples, progress)
    with meter, merge_warnings() as warned:
        for start in range(0, sample.samples, size):
            part = sample.part(slice(start, start + size))
            with collect_warnings() as own:
                parts.append(solver(part))
            warned += (one.after(start) for one in own)
            meter.advance(part.samples)
    values = {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}
    if text := _doubt(problem, method, sample, values):
        warn_accuracy(text)
    result = label(problem, method, values, np.arange(sample.samples), attributes)
    return with_gaps(problem, result, measured)
