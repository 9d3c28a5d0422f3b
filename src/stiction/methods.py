"""One call, any method: the onset of given strength profiles."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from stiction._model import describe, to_plain
from stiction._progress import Meter, Portions, Show
from stiction.errors import InputError
from stiction.gaps import gather, with_gaps
from stiction.plausible import warn_of_units
from stiction.problem import Problem
from stiction.profile_nodes import Gaps, check_gaps
from stiction.results import FRICTION_COEFFICIENT, POSITION, SAMPLE, Variable, to_dataset
from stiction.rows import Rows

Values = dict[str, NDArray[Any]]

FIRST = 16
"""Rows that `onset` solves before it knows how long one takes."""


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


def _in_portions(problem: Problem, method: Method, rows: Rows, progress: Show) -> Values:
    """All rows, some at a time: a row's numbers do not depend on those beside it."""
    solver = method.prepare(problem)
    name = getattr(method, "type", type(method).__name__)
    parts: list[Values] = []
    with Meter(f"onset by {name}", rows.count, progress) as meter:
        first = min(FIRST, int(getattr(method, "chunk_size", FIRST)))
        for some in Portions(first)(rows.count):
            parts.append(solve(problem, method, solver, rows.part(some)))
            meter.advance(some.stop - some.start)
    if len(parts) == 1:
        return parts[0]
    return {key: np.concatenate([part[key] for part in parts]) for key in parts[0]}


def onset(
    problem: Problem,
    tau_p: Any,
    *,
    method: Method,
    residual_strength: Any = None,
    initial_stress: Any = None,
    weakening_rate: Any = None,
    gaps: Gaps = "refuse",
    progress: Show = True,
) -> xr.Dataset:
    """At which load, and where, do interfaces of given strength let go?

    Parameters
    ----------
    problem : Problem
    tau_p : (samples, nodes) or (nodes,) array
        Peak strength, Pa. Of a DataArray or Dataset the dimension 'x' runs along the interface,
        its coordinate (m) decides where a value belongs, and `units` that are stated are
        converted; see `stiction.read_profile`.
    method : LocalCriterion, Equilibrium or Rupture
        How to find out; nothing is chosen silently.
    residual_strength, initial_stress, weakening_rate : array, optional
        What differs between samples besides the strength, (samples, nodes) or (samples, 1), Pa or
        Pa/m; replaces the problem's own.
    gaps : {"refuse", "fill"}
        Whether missing values (NaN) are an error or are filled with straight lines between their
        ends.
    progress : bool or callable
        True shows how far it is, on standard error, once it takes more than two seconds; a
        callable gets (done, total).

    Returns
    -------
    xarray.Dataset
        Over 'sample': `critical_load`, `critical_stress`, `first_instability` (Pa),
        `critical_position` (m), with a normal pressure `friction_coefficient`, and what the
        method adds. Every variable has `units` and `long_name`. Of profiles with gaps that were
        filled also `in_gap`: whether the onset lies in one.

    Raises
    ------
    InputError
        Naming all that does not fit.

    Warns
    -----
    AccuracyWarning
        If gaps are filled, or the onset lies in one.
    UnitWarning
        If a value is so far from what solids have that its unit is in doubt.
    """
    check_method(method)
    check_problem(problem)
    check_gaps(gaps)
    attributes = study_attributes(problem, method)
    given = {
        "tau_p": tau_p,
        "residual_strength": residual_strength,
        "initial_stress": initial_stress,
        "weakening_rate": weakening_rate,
    }
    given, measured = gather(problem, given, gaps)
    rows = problem.rows(given.pop("tau_p"), **given, accept=accepted(method))
    warn_of_units(problem, rows.mean_strength, float(rows.residual_strength.mean()))
    values = _in_portions(problem, method, rows, progress)
    result = label(problem, method, values, np.arange(rows.count), attributes)
    return result if measured is None else with_gaps(problem, result, measured)
