"""One call, any method: the onset of given strength profiles."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction._model import describe, to_plain
from stiction.errors import InputError
from stiction.problem import Problem
from stiction.results import FRICTION_COEFFICIENT, POSITION, SAMPLE, Variable, to_dataset
from stiction.rows import Rows

Values = dict[str, NDArray[Any]]


class Method(Protocol):
    """What makes an object a method: options that know how to prepare a solver."""

    @property
    def variables(self) -> dict[str, Variable]:
        """What the solver returns, all with 'sample' as first dimension."""

    def prepare(self, problem: Problem) -> Callable[[Rows], Mapping[str, NDArray[Any]]]:
        """A solver of rows; what is the same for all rows is computed here, once."""


def check_method(method: Any) -> None:
    """Refuse what is not a method object, in particular the class instead of an instance."""
    if isinstance(method, type) or not hasattr(method, "prepare"):
        hint = f"; write st.{method.__name__}(...)" if isinstance(method, type) else ""
        raise InputError(
            "method: must be a method object such as st.LocalCriterion(), st.Equilibrium() or"
            f" st.Rupture(loading_rate=...), got {describe(method)}{hint}"
        )


def accepted(method: Method) -> tuple[str, ...]:
    """What `Problem.rows` may let through for a method, besides what every method can do."""
    return getattr(method, "accepts", ())


def check_problem(problem: Any) -> None:
    """Refuse what is not a `Problem`, such as arguments that changed places."""
    if not isinstance(problem, Problem):
        raise InputError(f"problem: must be a Problem, got {describe(problem)}")


def study_attributes(problem: Problem, method: Method) -> dict[str, Any]:
    """The problem and the method in plain form, or why they have none."""
    try:
        return {"study": {"problem": to_plain(problem), "method": to_plain(method)}}
    except InputError as error:
        return {"study_incomplete": str(error)}


def solve(
    problem: Problem, method: Method, solver: Callable[[Rows], Mapping[str, Any]], rows: Rows
) -> Values:
    """The solver's values, and what follows from them for every method alike."""
    values = dict(solver(rows))
    if problem.load.normal_pressure is not None:
        pressure = float(np.mean(problem.load.normal_pressure))
        values["friction_coefficient"] = values["critical_stress"] / pressure
    return values


def variables_of(problem: Problem, method: Method) -> dict[str, Variable]:
    """All that `solve` returns."""
    variables = dict(method.variables)
    if problem.load.normal_pressure is not None:
        variables["friction_coefficient"] = FRICTION_COEFFICIENT
    return variables


def label(
    problem: Problem,
    method: Method,
    values: Mapping[str, NDArray[Any]],
    samples: NDArray[np.int64],
    attributes: Mapping[str, Any],
    more_variables: Mapping[str, Variable] = MappingProxyType({}),
) -> xr.Dataset:
    """Values of many samples as a dataset over 'sample' (and 'x' where they have nodes)."""
    variables = variables_of(problem, method) | dict(more_variables)
    coordinates: dict[str, tuple[NDArray[Any], Variable]] = {"sample": (samples, SAMPLE)}
    if any("x" in variables[name].dims for name in values):
        coordinates["x"] = (problem.interface.x, POSITION)
    return to_dataset(values, variables, coordinates, attributes)


def onset(
    problem: Problem,
    tau_p: Any,
    *,
    method: Method,
    residual_strength: Any = None,
    initial_stress: Any = None,
    weakening_rate: Any = None,
) -> xr.Dataset:
    """At which load, and where, do interfaces of given strength let go?

    Parameters
    ----------
    problem : Problem
    tau_p : (samples, nodes) or (nodes,) array
        Peak strength, Pa.
    method : LocalCriterion, Equilibrium or Rupture
        How to find out; nothing is chosen silently.
    residual_strength, initial_stress, weakening_rate : array, optional
        What differs between samples besides the strength, (samples, nodes) or (samples, 1), Pa or
        Pa/m; replaces the problem's own.

    Returns
    -------
    xarray.Dataset
        Over 'sample': `critical_load`, `critical_stress`, `first_instability` (Pa),
        `critical_position` (m), with a normal pressure `friction_coefficient`, and what the
        method adds. Every variable has `units` and `long_name`.

    Raises
    ------
    InputError
        Naming all that does not fit.
    """
    check_method(method)
    check_problem(problem)
    attributes = study_attributes(problem, method)
    rows = problem.rows(
        tau_p,
        residual_strength=residual_strength,
        initial_stress=initial_stress,
        weakening_rate=weakening_rate,
        accept=accepted(method),
    )
    values = solve(problem, method, method.prepare(problem), rows)
    return label(problem, method, values, np.arange(rows.count), attributes)
