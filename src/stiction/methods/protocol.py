"""The protocol for methods, the table of all methods, and solvers that check their results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Protocol

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, SkipValidation

from stiction.base.arrays import Array
from stiction.base.errors import InputError, nearest
from stiction.base.kinds import Kinds
from stiction.base.model import is_finite
from stiction.base.variables import (
    DIRECTION,
    FRICTION_COEFFICIENT,
    ONSET_VARIABLES,
    SAMPLE,
    Variable,
    force_variables,
    forces,
)
from stiction.problem.problem import Problem
from stiction.problem.results import to_dataset
from stiction.problem.sample import Sample

if TYPE_CHECKING:
    import xarray as xr

BATCH_SECONDS, MAX_BATCH_SAMPLES = 0.5, 512
"""Seconds of work in a batch, and largest number of samples."""

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
    """Protocol for a method: its options, and the solver that they define.

    `stiction.onset` and `stiction.monte_carlo` accept any frozen
    dataclass with these members. To use the method in study files, make
    its `type` known with `stiction.extensions.register` or an entry
    point. The members of `OptionalMembers` may be added.
    """

    @property
    def type(self) -> str:
        """Method name in study files."""

    @property
    def label(self) -> str:
        """Method name in figures, tables and progress."""

    def variables(self, problem: Problem) -> Mapping[str, Variable]:
        """Return the variables in the solver's results. Each has 'sample' as first dimension.

        The variables include all variables in `stiction.extensions.onset_variables`.
        """

    def seconds_per_sample(self, problem: Problem) -> float:
        """Return the time, s, that a sample takes on a core, to within a factor of three."""

    def supports(self, problem: Problem) -> list[str]:
        """Return the reasons why the method cannot solve a problem, or an empty list."""

    def prepare(self, problem: Problem) -> Solver:
        """Compute the quantities that are the same for all samples, and return a solver."""


class OptionalMembers:
    """Optional members of a method, with their defaults."""

    accepts: ClassVar[tuple[str, ...]] = ()
    """Special profiles that the method accepts: "overstress", see
    `Problem.sample`."""
    first_stage: ClassVar[str | None] = None
    """Type of a faster method with similar onsets, for the first search
    of rare failures."""
    exact_method: ClassVar[str | None] = None
    """Type of the method that this method approximates. Some samples
    are solved by both, and a warning gives the difference."""
    scaling: ClassVar[Literal["none", "stretch", "affine"]] = "none"
    """How onsets scale with the strength s at a given weakening rate
    and a uniform load. "affine": onset(a + b s) = a + b onset(s).
    "stretch": onset(b s) = b onset(s) without residual strength and
    initial stress."""
    counted_only: ClassVar[bool] = False
    """Whether failures are counted in plain samples, not sought by
    subset simulation."""
    samples_at_point: ClassVar[int] = 100
    """Number of samples with which `stiction.infer` simulates each
    point of a prior."""

    def bounded_by_strength(self, problem: Problem, event: str) -> tuple[bool, bool]:
        """Return whether strength bounds the stress of an event from below and from above.

        The bound from below is min (tau_p - tau_i)/p, the load at which
        the first node slips. The bound from above is the mean strength.
        The event is 'critical_stress' or 'first_instability'.
        """
        return False, False

    def unfit_as_guide(self, problem: Problem, varying: set[str]) -> str | None:
        """Return a reason if this `first_stage` cannot guide another method, or `None`.

        `varying` contains the names of the properties that differ
        between samples.
        """
        return None

    def may_differ(self, problem: Problem, sample: Sample, stress: Array) -> bool:
        """Return whether to compare the onsets of samples (Pa) with the onsets by `exact_method`.

        The result is False if a quick test finds that the onsets differ
        by less than 1 %.
        """
        return True


def optional_member(method: Any, name: str) -> Any:
    """Return an optional member of a method, or its default.

    >>> from types import SimpleNamespace
    >>> method = SimpleNamespace(scaling="affine")
    >>> optional_member(method, "scaling"), optional_member(method, "samples_at_point")
    ('affine', 100)
    >>> optional_member(method, "may_differ")(None, None, None)
    True
    >>> optional_member(method, "bounded_by_strength")(None, "critical_stress")
    (False, False)
    """
    return getattr(method if hasattr(method, name) else OptionalMembers(), name)


MEMBERS = [name for name in vars(Method) if not name.startswith("_")]
"""Names of the members of every method."""


def as_method(value: Any) -> Any:
    """Return a method, or raise a ValueError that lists its missing members."""
    name = nearest(value, [*METHODS]) if isinstance(value, str) else ""
    kind = METHODS[name] if name else value
    if isinstance(kind, type):  # or parentheses were forgotten
        table = f", or in a study file a table with type = {name!r}" * bool(name)
        raise ValueError(f"must be an object. Write st.{kind.__name__}(...){table}")
    missing = [name for name in MEMBERS if not hasattr(value, name)]
    if missing:
        raise ValueError(
            "must be a method object such as"
            f" {' or '.join(f'{kind.__name__}(...)' for kind in METHODS.values())}, but lacks"
            f" {', '.join(missing)}"
        )
    return value


MethodObject = Annotated[Method, SkipValidation, BeforeValidator(as_method), "Method"]
"""Annotation of an argument that is a method; see
`stiction.base.model.checked`."""


def prepared(problem: Problem, method: Method) -> Solver:
    """Return the solver of a method, which checks values and adds friction coefficients.

    The mean pressure is 4 Pa, and the area 3 m², of 5 m² in total.

    >>> from types import SimpleNamespace
    >>> values = {name: np.array([6.0, 8.0]) for name in ONSET_VARIABLES}
    >>> method = SimpleNamespace(
    ...     label="own", prepare=lambda problem: lambda sample: values,
    ...     variables=lambda problem: ONSET_VARIABLES,
    ... )
    >>> sample = SimpleNamespace(shape=(4,), samples=2, normal_pressure=np.array([4.0, 2.0]))
    >>> sample.mean = lambda rows: rows
    >>> problem = SimpleNamespace(area=3.0, whole_area=5.0)
    >>> found = prepared(problem, method)(sample)
    >>> found["friction_coefficient"].tolist(), found["critical_force"].tolist()
    ([1.5, 4.0], [18.0, 24.0])
    >>> sample.normal_pressure = np.full(2, np.nan)
    >>> "friction_coefficient" in prepared(problem, method)(sample)
    False
    >>> method.variables = lambda problem: dict(list(ONSET_VARIABLES.items())[1:])
    >>> prepared(problem, method)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: method: the variables of own must include critical_load
    """
    solver = method.prepare(problem)
    variables = method.variables(problem)
    # Other layers read these variables from any method.
    lacking = [name for name in ONSET_VARIABLES if name not in variables]
    if lacking:
        names = ", ".join(lacking)
        raise InputError(f"method: the variables of {method.label} must include {names}")

    def solve(sample: Sample) -> Values:
        values = {name: np.asarray(value) for name, value in solver(sample).items()}
        _check_values(method.label, values, variables, sample)
        # The pressure is NaN if the problem has none.
        pressure = sample.mean(sample.normal_pressure)
        if not np.isnan(pressure).all():
            values["friction_coefficient"] = values["critical_stress"] / pressure
        return values | forces(values, problem.area, problem.whole_area)

    return solve


def _check_values(
    name: str, values: Values, variables: Mapping[str, Variable], sample: Sample
) -> None:
    """Raise an `InputError` unless a solver returns its variables in the right shapes.

    >>> from types import SimpleNamespace
    >>> sample = SimpleNamespace(shape=(4, 5), samples=2)
    >>> variables = {"stress": Variable("Pa", "stress"), "slip": Variable("m", "slip")}
    >>> variables["slip"] = Variable("m", "slip", ("sample", "x", "y"))
    >>> variables["events"] = Variable("Pa", "events", ("sample", "event"))
    >>> values = {"stress": np.ones(2), "slip": np.ones((2, 4, 5)), "events": np.ones((2, 9))}
    >>> _check_values("own", values, variables, sample)
    >>> wrong = values | {"slip": np.ones((2, 5, 4))}
    >>> _check_values("own", wrong, variables, sample)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: ...'slip' of shape (2, 4, 5) over (sample, x, y), got (2, 5, 4)
    >>> _check_values("own", {"stress": np.ones(2)}, variables, sample)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: method: the solver of own must return its variables ...
    >>> line = SimpleNamespace(shape=(4,), samples=2)
    >>> way = {"way": Variable("m", "way", ("sample", DIRECTION))}
    >>> _check_values("own", {"way": np.ones((2, 3))}, way, line)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: method: the solver of own must return 'way' of shape (2, 2) ...
    """
    if values.keys() != variables.keys():
        raise InputError(
            f"method: the solver of {name} must return its variables {', '.join(variables)},"
            f" but returned {', '.join(values)}"
        )
    # Dimensions of known size. On a line there is no 'y'.
    sizes = dict(zip(("x", "y"), sample.shape, strict=False))
    sizes |= {"sample": sample.samples, DIRECTION: 2}
    for key, variable in variables.items():
        # Dimensions of the method's own, such as 'event', may have any size.
        shape = tuple(sizes.get(dim) for dim in variable.dims)
        if values[key].shape != shape and None not in shape:
            raise InputError(
                f"method: the solver of {name} must return {key!r} of shape {shape} over"
                f" ({', '.join(variable.dims)}), got {values[key].shape}"
            )


def seconds_per_sample(problem: Problem, method: Method) -> float:
    """Return the time, s, that a sample takes, at least 1 ns, or raise an `InputError`.

    >>> from types import SimpleNamespace
    >>> for seconds in (0.25, 0.0):
    ...     method = SimpleNamespace(seconds_per_sample=lambda problem: seconds)
    ...     print(seconds_per_sample(None, method))
    0.25
    1e-09
    >>> method = SimpleNamespace(label="own", seconds_per_sample=lambda problem: -1.0)
    >>> seconds_per_sample(None, method)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: method: seconds_per_sample of own must ... got -1.0
    """
    seconds = method.seconds_per_sample(problem)
    if not (is_finite(seconds) and seconds >= 0.0):
        raise InputError(
            f"method: seconds_per_sample of {method.label} must return a number of seconds, zero"
            f" or more, got {seconds!r}"
        )
    # Batch sizes and estimates divide by the time.
    return max(float(seconds), 1e-9)


def batch_size(problem: Problem, method: Method) -> int:
    """Return the number of samples in a batch: half a second of work, but at most 512 samples.

    >>> from types import SimpleNamespace
    >>> for seconds in (0.02, 3.0, 1e-4):
    ...     print(batch_size(None, SimpleNamespace(seconds_per_sample=lambda problem: seconds)))
    25
    1
    512
    """
    count = int(BATCH_SECONDS / seconds_per_sample(problem, method))
    return max(1, min(MAX_BATCH_SAMPLES, count))


def variables_of(
    problem: Problem, method: Method, pressure: bool = False
) -> dict[str, Variable]:
    """Return the variables of a prepared solver.

    `pressure` is true if pressures vary by sample.

    >>> from types import SimpleNamespace
    >>> method = SimpleNamespace(variables=lambda problem: ONSET_VARIABLES)
    >>> problem = SimpleNamespace(given_pressure=None, area=None)
    >>> list(variables_of(problem, method)) == list(ONSET_VARIABLES)
    True
    >>> list(variables_of(problem, method, pressure=True))[4:]
    ['friction_coefficient']
    >>> problem.given_pressure, problem.area = 0.0, 2.0
    >>> list(variables_of(problem, method))[4:]
    ['friction_coefficient', 'critical_force', 'first_instability_force']
    """
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
    """Return values for many samples as a dataset over 'sample' and, if needed, the nodes."""
    variables = variables_of(problem, method, "friction_coefficient" in values)
    variables, coordinates = variables | dict(more_variables), {"sample": (samples, SAMPLE)}
    return to_dataset(values, variables, coordinates, attributes, problem.interface)
