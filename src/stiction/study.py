"""A study: problem, strength, method and ensemble in one object, from Python or one TOML file."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable
from concurrent.futures import Executor
from functools import cached_property
from pathlib import Path
from typing import Annotated, Any

import pydantic
import tomli_w
import xarray as xr
from pydantic import BeforeValidator, Field, model_validator

from stiction._checks import (
    as_path,
    check_flag,
    check_instance,
    check_progress,
    is_whole,
    too_many_samples,
)
from stiction._model import Count, Positive, _count, describe, explain, model, to_plain
from stiction.criterion.method import LocalCriterion
from stiction.dynamics.method import Rupture
from stiction.ensemble.distributed import Cluster
from stiction.ensemble.gather import GridAxis
from stiction.ensemble.plan import Plan
from stiction.ensemble.run import KEEP_LIMIT, check_size, make_plan, run_plans, wide_bytes
from stiction.equilibrium.method import Equilibrium
from stiction.errors import InputError
from stiction.fields.random_field import RandomField
from stiction.problem import Problem
from stiction.sweep import Point, Sweep, grid_axes, name_point, points_of, unknown_keys, with_values

METHODS: tuple[Any, ...] = (LocalCriterion, Equilibrium, Rupture)
AnyMethod = Annotated[LocalCriterion | Equilibrium | Rupture, Field(discriminator="type")]
Number = Annotated[int, BeforeValidator(_count), Field(ge=0)]


MOST_KEPT = 10**6


def _chosen(value: Any) -> Any:
    """A number of samples stands for the first ones."""
    if is_whole(value, MOST_KEPT + 1):
        raise InputError(f"must be at most {MOST_KEPT} samples, got {describe(value)}")
    if is_whole(value, 1):
        return tuple(range(value))
    if not isinstance(value, list | tuple):
        raise InputError(
            "must be a list of sample numbers, or how many of the first samples to keep;"
            f" got {describe(value)}"
        )
    return tuple(value)


@model(kw_only=True)
class Ensemble:
    """How many samples, and which.

    Parameters
    ----------
    samples : int
        Number of samples.
    seed : int
        Not negative.
    first : int
        Number of the first sample.
    keep : tuple of str
        What is kept along the interface: random fields, such as ``"strength"``, and what the
        method can add, such as ``"slip"`` or ``"sensitivity"`` of `Equilibrium`.
    keep_samples : tuple of int or int, optional
        Numbers of the samples for which it is kept, or how many of the first; all if left out.
    keep_limit : float, optional
        Bytes that this may take in all; 1 GiB if left out.
    """

    samples: Count
    seed: Number = 0
    first: Number = 0
    keep: tuple[str, ...] = ()
    keep_samples: Annotated[tuple[Number, ...], BeforeValidator(_chosen)] | None = None
    keep_limit: Positive | None = None


@model(kw_only=True)
class Study:
    """Everything that defines a Monte Carlo study.

    The same names serve Python and TOML; a study read from the attributes of a result runs again
    to the same numbers.

    Parameters
    ----------
    problem : Problem
    strength : RandomField
        Peak strength, Pa.
    method : LocalCriterion, Equilibrium or Rupture
    ensemble : Ensemble
    residual_strength, initial_stress, weakening_rate : RandomField, optional
        What is random besides the strength.
    sweep : list of dict
        Axes that are crossed; each maps dotted keys of the study, which vary together, to lists
        of values or ranges ``{start, stop, count, spacing = "linear" | "log"}``. Every point of
        the sweep has the same samples.
    cluster : Cluster, optional
        What ``stiction run --slurm`` asks for; no part of what is computed.
    title : str
        For people.

    Raises
    ------
    InputError
        Naming every key that is missing, unknown or out of range, and the points of the sweep
        that make no valid study.
    """

    problem: Problem
    strength: RandomField
    method: AnyMethod
    ensemble: Ensemble
    residual_strength: RandomField | None = None
    initial_stress: RandomField | None = None
    weakening_rate: RandomField | None = None
    sweep: Sweep = ()
    cluster: Cluster | None = None
    title: str = ""

    @model_validator(mode="after")
    def _fits_together(self) -> Study:
        plans = self.plans
        nodes = {plan.problem.interface.nodes for plan in plans}
        if len(nodes) > 1 and any(plan.wide for plan in plans):
            raise InputError(
                "ensemble.keep: nothing can be kept along the interface while its number of nodes"
                " is swept; make a study of each"
            )
        ensemble = self.ensemble
        problems = too_many_samples(ensemble.samples, ensemble.first, len(plans))
        if problems:
            raise InputError([f"ensemble.{text}" for text in problems])
        size = sum(wide_bytes(plan, ensemble.samples, ensemble.first) for plan in plans)
        try:
            check_size(size, ensemble.keep_limit or KEEP_LIMIT)
        except InputError as error:
            raise InputError(f"ensemble.{error}") from None
        return self

    @property
    def points(self) -> list[Point]:
        """The points of the sweep, in order; one without values if nothing is swept."""
        return points_of(self.sweep)

    @cached_property
    def plans(self) -> list[Plan]:
        """What is to be computed, one plan a point."""
        if not self.sweep:
            return [self._plan()]
        base = {name: getattr(self, name) for name in Study.__dataclass_fields__}
        single = object.__new__(Study)
        single.__dict__.update(base | {"sweep": ()})
        plans: list[Plan] = []
        problems: dict[str, list[Point]] = {}
        for point in self.points:
            try:
                plans.append(with_values(single, point.values).plans[0])
            except InputError as error:
                for text in error.problems:
                    problems.setdefault(text, []).append(point)
        if problems:
            raise InputError([_at_points(text, points) for text, points in problems.items()])
        return plans

    def _plan(self) -> Plan:
        fields = {
            "residual_strength": self.residual_strength,
            "initial_stress": self.initial_stress,
            "weakening_rate": self.weakening_rate,
        }
        given = self.ensemble
        return make_plan(
            self.problem, self.strength, self.method, given.seed, fields, given.keep,
            given.keep_samples,
        )  # fmt: skip

    @property
    def axes(self) -> list[GridAxis]:
        """The axes of the sweep as dimensions of the result."""
        variables = {name for plan in self.plans for name in plan.variables}
        return grid_axes(self.sweep, sorted(variables | {"sample", "kept_sample", "x", "position"}))

    @property
    def attributes(self) -> dict[str, Any]:
        """What a result says about itself: enough to run it again."""
        try:
            plain = self.to_dict()
        except InputError as error:  # a function of the user's: the result says so
            return {"study_incomplete": str(error), "seed": self.ensemble.seed}
        plain.pop("cluster", None)
        result: dict[str, Any] = {"study": plain, "seed": self.ensemble.seed}
        return result | ({"title": self.title} if self.title else {})

    def run(
        self,
        *,
        out: str | Path | None = None,
        workers: int | None = None,
        executor: Executor | None = None,
        progress: bool | Callable[[int, int], None] = False,
        retry: bool = False,
    ) -> xr.Dataset:
        """Run it, or what is missing of it.

        Parameters
        ----------
        out : path, optional
            A folder in which results are stored as they are done, or a file ending in ``.nc`` with
            such a folder beside it until it is complete. The same call goes on where a run was
            interrupted, and computes only what is new if `samples` was raised.
        workers, executor, progress
            See `stiction.monte_carlo`.
        retry : bool
            Compute stored samples that failed again.

        Returns
        -------
        xarray.Dataset
            Over the sweep's axes and 'sample'; NaN where a stored sample failed.

        Raises
        ------
        InputError, RuntimeError
            See `stiction.monte_carlo`; with `out`, samples that fail are listed in the attribute
            'failed_samples' instead.
        StoreError
            If `out` cannot be used.
        """
        check_flag("retry", retry)
        check_progress(progress)
        if out is not None:
            from stiction.runs import run_into

            return run_into(
                self, out, workers=workers, executor=executor, progress=progress, retry=retry
            ).dataset()
        return run_plans(
            self.plans,
            self.ensemble.samples,
            first=self.ensemble.first,
            axes=self.axes,
            attributes=self.attributes,
            workers=workers,
            executor=executor,
            progress=progress,
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain dictionaries, lists and numbers, as in TOML.

        Raises
        ------
        InputError
            If something in it exists in Python only (a spectrum that is a function).
        """
        plain: dict[str, Any] = to_plain(self)
        for name in ("title", "sweep"):
            if not plain[name]:
                del plain[name]
        return plain

    def to_toml(self, path: str | Path) -> None:
        """Write it as a TOML file.

        Raises
        ------
        InputError
            If something in it exists in Python only, or the file cannot be written.
        """
        text = tomli_w.dumps(self.to_dict())
        try:
            as_path("path", path).write_text(text, encoding="utf-8")
        except OSError as error:
            raise InputError(f"path: {path} cannot be written: {error.strerror}") from None

    @classmethod
    def from_dict(cls, given: dict[str, Any], *, folder: str | Path | None = None) -> Study:
        """A study from plain dictionaries; file names of profiles are relative to `folder`.

        A key that is swept need not have a value of its own.
        """
        check_instance("study", given, dict)
        folder = None if folder is None else as_path("folder", folder)
        sweep, mistakes = _read_sweep(given, folder)
        if sweep:
            given = _completed(given, sweep)
        try:
            study: Study = pydantic.TypeAdapter(cls).validate_python(
                given, context={"folder": folder}
            )
        except pydantic.ValidationError as error:
            texts = explain(error, cls)
            new = [text for text in mistakes if text not in texts]
            raise InputError(texts + new) from None
        return study

    @classmethod
    def from_toml(cls, path: str | Path) -> Study:
        """A study from a TOML file."""
        path = as_path("path", path)
        try:
            given = tomllib.loads(path.read_text(encoding="utf-8"))
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: cannot be read: {error}") from None
        except RecursionError:
            raise InputError(f"{path}: is not valid TOML: nested too deeply") from None
        except tomllib.TOMLDecodeError as error:
            raise InputError(f"{path}: is not valid TOML: {error}") from None
        return cls.from_dict(given, folder=path.parent)

    @classmethod
    def from_result(cls, result: xr.Dataset) -> Study:
        """The study that made a result."""
        check_instance("result", result, xr.Dataset)
        if "study" not in result.attrs:
            raise InputError("result: has no attribute 'study'; it is not the result of a study")
        try:
            given = json.loads(result.attrs["study"])
        except (TypeError, ValueError, RecursionError) as error:
            raise InputError(f"result: its attribute 'study' is no JSON: {error}") from None
        return cls.from_dict(given)


def _at_points(text: str, points: list[Point]) -> str:
    more = f" and {len(points) - 1} more" if len(points) > 1 else ""
    return f"{text}, at {name_point(points[0])}{more} of the sweep"


def _read_sweep(given: Any, folder: str | Path | None) -> tuple[Any, list[str]]:
    """The axes of a study in plain form and its unknown keys; nothing if it cannot be read."""
    if not isinstance(given, dict) or "sweep" not in given:
        return (), []
    try:
        adapter: pydantic.TypeAdapter[Any] = pydantic.TypeAdapter(Sweep)
        axes = adapter.validate_python(given["sweep"], context={"folder": folder})
    except pydantic.ValidationError:
        return (), []
    return axes, unknown_keys(Study, axes)


def _completed(given: dict[str, Any], axes: Any) -> dict[str, Any]:
    """The same with the first value of every swept key that has none of its own."""
    result = given
    for axis in axes:
        for key, value in zip(axis.keys, axis.steps[0], strict=True):
            result = _with_default(result, key.split("."), value)
    return result


def _with_default(table: dict[str, Any], steps: list[str], value: Any) -> dict[str, Any]:
    name, *rest = steps
    if not rest:
        return table if name in table else table | {name: value}
    inner = table.get(name, {})
    if not isinstance(inner, dict):
        return table
    return table | {name: _with_default(inner, rest, value)}


def study_schema() -> dict[str, Any]:
    """JSON schema of a study file."""
    return pydantic.TypeAdapter(Study).json_schema()
