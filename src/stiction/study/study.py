"""A study: problem, strength, method and ensemble in one object, from Python or one TOML file."""

from __future__ import annotations

import functools
import json
import operator
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import pydantic
import tomli_w
import xarray as xr
from pydantic import BeforeValidator, Field, model_validator

from stiction._checks import (
    as_path,
    check_flag,
    check_instance,
    check_progress,
    too_many_samples,
)
from stiction.dotted_keys import part_with_values
from stiction.ensemble.assemble import GridAxis
from stiction.ensemble.distributed import Cluster
from stiction.ensemble.monte_carlo import KEEP_LIMIT, check_size, make_plan, run_plans, wide_bytes
from stiction.ensemble.part import as_part
from stiction.ensemble.plan import Plan
from stiction.ensemble.points import Plans, differing_in, variables_in
from stiction.errors import InputError
from stiction.inference.settings import Inference
from stiction.methods import methods
from stiction.model import (
    explain,
    model,
    to_plain,
)
from stiction.problem import Problem
from stiction.progress import Meter, Show
from stiction.random.random_field import RandomField
from stiction.random.random_interface import RandomInterface, as_random_interface
from stiction.study.ensemble import Ensemble
from stiction.study.study_file import (
    completed,
    read_sweep,
    read_toml,
    reading,
    refuse_first_version,
)
from stiction.study.sweep import Point, Sweep, grid_axes, name_point, points_of

AnyMethod: Any = Annotated[
    functools.reduce(operator.or_, methods().values()), Field(discriminator="type")
]
"""Any registered method; in a study file ``type`` says which."""


def _interface(value: Any) -> Any:
    return as_random_interface(value) if isinstance(value, RandomField) else value


if TYPE_CHECKING:  # a field alone is accepted and becomes an interface
    AnyRandom: TypeAlias = RandomInterface | RandomField
else:
    AnyRandom = Annotated[RandomInterface, BeforeValidator(_interface)]


@model(kw_only=True)
class Study:
    """Everything that defines a Monte Carlo study.

    The same names serve Python and TOML; a study read from the attributes of a result runs again
    to the same numbers.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface or RandomField
        What is random; a field alone is the peak strength, Pa.
    method : LocalCriterion, Equilibrium or Rupture
    ensemble : Ensemble
    sweep : list of dict
        Axes that are crossed; each maps dotted keys of the study, which vary together, to lists
        of values or ranges ``{start, stop, count, spacing = "linear" | "log"}``. Every point of
        the sweep has the same samples.
    cluster : Cluster, optional
        What ``stiction run --slurm`` asks for; no part of what is computed.
    inference : Inference, optional
        What ``stiction infer`` is to find out; no part of what is computed.
    title : str
        For people.

    Raises
    ------
    InputError
        Naming every key that is missing, unknown or out of range, and the points of the sweep
        that make no valid study.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> study = st.Study(
    ...     problem=problem,
    ...     random=st.paper.strength(problem, correlation_ratio=2.0),
    ...     method=st.LocalCriterion(),
    ...     ensemble=st.Ensemble(samples=20),
    ...     sweep=[{"random.strength.spectrum.correlation_length": [3e-3, 6e-3]}],
    ... )
    >>> dict(study.run().sizes)
    {'correlation_length': 2, 'sample': 20}
    >>> st.Study.from_dict(study.to_dict()) == study
    True
    """

    problem: Problem
    random: AnyRandom
    method: AnyMethod
    ensemble: Ensemble
    sweep: Sweep = ()
    cluster: Cluster | None = None
    inference: Inference | None = None
    title: str = ""

    @model_validator(mode="after")
    def _fits_together(self, info: pydantic.ValidationInfo) -> Study:
        if (info.context or {}).get("trusted"):
            return self
        self._check_points()
        ensemble = self.ensemble
        problems = too_many_samples(ensemble.samples, ensemble.first, len(self.plans))
        if problems:
            raise InputError([f"ensemble.{text}" for text in problems])
        if ensemble.keep:
            self._check_kept()
        return self

    def _check_kept(self) -> None:
        ensemble = self.ensemble
        some = differing_in(self.plans, "method", "problem.load", "problem.interface", "random")
        nodes = {plan.problem.interface.shape for plan in some}
        if len(nodes) > 1 and any(plan.wide for plan in some):
            raise InputError(
                "ensemble.keep: nothing can be kept along the interface while its number of nodes"
                " is swept; make a study of each"
            )
        size = sum(wide_bytes(plan, ensemble.samples, ensemble.first) for plan in some)
        try:
            check_size(size * len(self.plans) / len(some), ensemble.keep_limit or KEEP_LIMIT)
        except InputError as error:
            raise InputError(f"ensemble.{error}") from None

    def _check_points(self) -> None:
        """Make every plan once; what is wrong is said once, with the points where it is."""
        problems: dict[str, list[int]] = {}
        with Meter("checking the sweep", len(self.plans), unit="points") as meter:
            for number in range(len(self.plans)):
                try:
                    self.plans[number]
                except InputError as error:
                    for text in error.problems:
                        problems.setdefault(text, []).append(number)
                meter.advance()
        if problems and not self.sweep:
            raise InputError(problems)
        if problems:
            points = self.points
            raise InputError(
                [_at_points(text, [points[n] for n in where]) for text, where in problems.items()]
            )

    @property
    def points(self) -> list[Point]:
        """The points of the sweep, in order; one without values if nothing is swept."""
        return points_of(self.sweep)

    @cached_property
    def plans(self) -> Sequence[Plan]:
        """What is to be computed, one plan a point, made when it is asked for."""
        base = _Parts(**{name: getattr(self, name) for name in _PARTS})
        keys = [axis.keys for axis in self.sweep]

        def part(name: str, steps: tuple[int, ...]) -> Any:
            values = {
                key: axis.steps[step][i]
                for axis, step in zip(self.sweep, steps, strict=True)
                for i, key in enumerate(axis.keys)
                if key.split(".")[0] == name
            }
            return part_with_values(base, name, values) if values else getattr(base, name)

        return Plans(keys, [len(axis.steps) for axis in self.sweep], _PARTS, part, _plan)

    @property
    def axes(self) -> list[GridAxis]:
        """The axes of the sweep as dimensions of the result."""
        variables = set(variables_in(self.plans))
        return grid_axes(
            self.sweep, sorted(variables | {"sample", "kept_sample", "x", "y", "position"})
        )

    @property
    def attributes(self) -> dict[str, Any]:
        """What a result says about itself: enough to run it again."""
        try:
            plain = self.to_dict()
        except InputError as error:  # a function of the user's: the result says so
            return {"study_incomplete": str(error), "seed": self.ensemble.seed}
        for name in ("cluster", "inference"):
            plain.pop(name, None)
        result: dict[str, Any] = {"study": plain, "seed": self.ensemble.seed}
        return result | ({"title": self.title} if self.title else {})

    def run(
        self,
        *,
        out: str | Path | None = None,
        workers: int | None = None,
        executor: Executor | None = None,
        progress: Show = True,
        retry: bool = False,
        time_limit: float | None = None,
        lock: bool = True,
        part: tuple[int, int] | str | None = None,
    ) -> xr.Dataset:
        """Run it, or what is missing of it.

        Parameters
        ----------
        out : path, optional
            A folder in which results are stored as they are done, or a file ending in ``.nc`` with
            such a folder beside it until it is complete. The same call goes on where a run was
            interrupted, and computes only what is new if `samples` was raised.
        workers, executor, progress, time_limit
            See `stiction.monte_carlo`. With `out`, what is missing when the time is over is NaN,
            and the same call goes on.
        retry : bool
            Compute stored samples that failed again.
        lock : bool
            Keep other runs out of the folder while this one writes; False for file systems that
            have no locks.
        part : (int, int) or str, optional
            Compute one part of so many only, such as (3, 100) or "3/100", into a folder of its own
            beside `out`, for jobs that know nothing of each other; `stiction.merge_parts` joins
            them to the same numbers as one run.

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
            If `out` cannot be used, or what was stored is damaged before the end.
        """
        check_flag("retry", retry)
        check_progress(progress)
        if part is not None and out is None:
            raise InputError("part: a part is stored; say where with out=")
        if out is not None:
            from stiction.study_run import run_into

            stored = run_into(
                self,
                out,
                workers=workers,
                executor=executor,
                progress=progress,
                retry=retry,
                time_limit=time_limit,
                lock=lock,
                part=None if part is None else as_part(part),
            )
            return stored.dataset()
        return run_plans(
            self.plans,
            self.ensemble.samples,
            first=self.ensemble.first,
            axes=self.axes,
            attributes=self.attributes,
            workers=workers,
            executor=executor,
            progress=progress,
            time_limit=time_limit,
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
    def from_dict(
        cls, given: dict[str, Any], *, folder: str | Path | None = None, trusted: bool = False
    ) -> Study:
        """A study from plain dictionaries; file names of profiles are relative to `folder`.

        A key that is swept need not have a value of its own. The points of a `trusted` study, one
        that was valid when it was stored, are not looked at one by one.
        """
        check_instance("study", given, dict)
        folder = None if folder is None else as_path("folder", folder)
        refuse_first_version(given)
        sweep, mistakes = read_sweep(given, folder, cls)
        if sweep:
            given = completed(given, sweep)
        try:
            study: Study = pydantic.TypeAdapter(cls).validate_python(
                given, context={**reading(folder), "trusted": trusted}
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
        return cls.from_dict(read_toml(path), folder=path.parent)

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


@model(kw_only=True)
class _Parts:
    """What a point of a sweep consists of, each part valid by itself."""

    problem: Problem
    random: AnyRandom
    method: AnyMethod
    ensemble: Ensemble


_PARTS = tuple(_Parts.__dataclass_fields__)


def _plan(parts: Mapping[str, Any]) -> Plan:
    given = parts["ensemble"]
    random = as_random_interface(parts["random"])
    return make_plan(
        parts["problem"], random, parts["method"], given.seed, given.keep, given.keep_samples
    )


def _at_points(text: str, points: list[Point]) -> str:
    more = f" and {len(points) - 1} more" if len(points) > 1 else ""
    return f"{text}, at {name_point(points[0])}{more} of the sweep"


def study_schema() -> dict[str, Any]:
    """JSON schema of a study file."""
    return pydantic.TypeAdapter(Study).json_schema()
