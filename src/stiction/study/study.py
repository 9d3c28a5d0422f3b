"""A study: problem, strength, method and ensemble in one object, from Python or one TOML file."""

from __future__ import annotations

import functools
import json
import operator
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import pydantic
import tomli_w
import xarray as xr
from pydantic import BeforeValidator, Field, model_validator

from stiction.dynamics.save import Save
from stiction.ensemble.batches import AnyExecutor
from stiction.ensemble.dataset import GridAxis
from stiction.ensemble.dotted_keys import part_with_values
from stiction.ensemble.experiment import Ensemble, Experiment
from stiction.ensemble.monte_carlo import check_size, gather, wide_bytes
from stiction.ensemble.points import Points, differing_in, variables_in
from stiction.ensemble.store import Store
from stiction.errors import InputError, StoreError, unknown_name
from stiction.methods import methods
from stiction.model import (
    Count,
    FilePath,
    Flag,
    Progress,
    Seconds,
    Text,
    check,
    checked,
    explain,
    model,
    to_plain,
)
from stiction.problem import Problem
from stiction.progress import Meter
from stiction.random.random_field import RandomField, too_many_samples
from stiction.random.random_interface import RandomInterface, as_random_interface
from stiction.study.run import StoredRun, result_of, run_into
from stiction.study.study_file import completed, read_sweep, read_toml, reading
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
    save : Save, optional
        What `stiction rupture` keeps of one rupture, and where its stations are.
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
    save: Save | None = None
    title: Text = ""

    @model_validator(mode="after")
    def _fits_together(self, info: pydantic.ValidationInfo) -> Study:
        if (info.context or {}).get("trusted"):
            return self
        self._check_points()
        ensemble = self.ensemble
        problems = too_many_samples(ensemble.samples, ensemble.first, len(self.experiments))
        if problems:
            raise InputError([f"ensemble.{text}" for text in problems])
        if ensemble.keep:
            self._check_kept()
        return self

    def _check_kept(self) -> None:
        ensemble = self.ensemble
        some = differing_in(
            self.experiments, "method", "problem.load", "problem.interface", "random"
        )
        nodes = {point.problem.interface.shape for point in some}
        if len(nodes) > 1 and any(point.wide for point in some):
            raise InputError(
                "ensemble.keep: nothing can be kept along the interface while its number of nodes"
                " is swept; make a study of each"
            )
        size = sum(wide_bytes(point, ensemble.samples, ensemble.first) for point in some)
        try:
            check_size(size * len(self.experiments) / len(some), ensemble.keep_limit)
        except InputError as error:
            raise InputError(f"ensemble.{error}") from None

    def _check_points(self) -> None:
        """Make every experiment once; a mistake is reported once, with the points where it is."""
        problems: dict[str, list[int]] = {}
        with Meter("checking the sweep", len(self.experiments), unit="points") as meter:
            for number in range(len(self.experiments)):
                try:
                    self.experiments[number]
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
    def experiments(self) -> Sequence[Experiment]:
        """What is to be computed: one `Experiment` a point, made on demand."""
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

        return Points(keys, [len(axis.steps) for axis in self.sweep], _PARTS, part, _experiment)

    @property
    def axes(self) -> list[GridAxis]:
        """The axes of the sweep as dimensions of the result."""
        variables = set(variables_in(self.experiments))
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
        result: dict[str, Any] = {"study": plain, "seed": self.ensemble.seed}
        return result | ({"title": self.title} if self.title else {})

    @checked
    def run(
        self,
        *,
        out: FilePath | None = None,
        workers: Count | None = None,
        executor: AnyExecutor | None = None,
        progress: Progress = True,
        time_limit: Seconds | None = None,
        retry: Flag = False,
        part: Any = None,
        pilot: Flag = True,
    ) -> xr.Dataset:
        """Run it, or what is missing of it.

        Parameters
        ----------
        out : path, optional
            A folder in which results are stored as they are done. The same call goes on where a
            run was interrupted, and computes only what is new if `samples` was raised.
        workers, executor, progress, time_limit, pilot
            See `stiction.monte_carlo`. With `out`, what is missing when the time is over is NaN,
            and the same call goes on.
        retry : bool
            Compute stored samples that failed again.
        part : (int, int) or str, optional
            Compute one part of so many only, such as (3, 100) or "3/100", into the same folder as
            the other parts: for jobs that do not know of each other.

        Returns
        -------
        xarray.Dataset
            Over the sweep's axes and 'sample'; NaN where a sample failed or is missing.

        Raises
        ------
        InputError, RuntimeError
            See `stiction.monte_carlo`.
        StoreError
            If `out` cannot be used, or what was stored is damaged before the end.
        WorkerError
            If a worker is lost.
        """
        options: dict[str, Any] = {
            "workers": workers,
            "executor": executor,
            "progress": progress,
            "time_limit": time_limit,
            "pilot": pilot,
        }
        if out is not None:
            stored = run_into(self, out, retry=retry, part=part, **options)
            return result_of(stored, partial=time_limit is not None or part is not None)
        if part is not None:
            raise InputError("part: a part is stored; say where with out=")
        return gather(self.experiments, self.ensemble, self.attributes, self.axes, **options)

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
            check("path", path, FilePath).write_text(text, encoding="utf-8")
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
        check("study", given, dict)
        check("trusted", trusted, Flag)
        folder = None if folder is None else check("folder", folder, FilePath)
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
        file = Path(check("path", path, FilePath))
        return cls.from_dict(read_toml(file), folder=file.parent)

    @classmethod
    def from_result(cls, result: xr.Dataset) -> Study:
        """The study that made a result."""
        check("result", result, xr.Dataset)
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


def _experiment(parts: Mapping[str, Any]) -> Experiment:
    ensemble: Ensemble = parts["ensemble"]
    return ensemble.of(parts["problem"], parts["random"], parts["method"])


def _at_points(text: str, points: list[Point]) -> str:
    more = f" and {len(points) - 1} more" if len(points) > 1 else ""
    return f"{text}, at {name_point(points[0])}{more} of the sweep"


def study_schema() -> dict[str, Any]:
    """JSON schema of a study file."""
    return pydantic.TypeAdapter(Study).json_schema()


def read_setup(path: Path) -> tuple[Problem, Any, Save | None]:
    """Return problem, method and `save` of a study file, or None, for what draws no samples.

    Of a sweep, the first values.
    """
    given, folder = read_toml(path), path.parent
    problems = [
        unknown_name("study", name, Study.__dataclass_fields__)
        for name in given
        if name not in Study.__dataclass_fields__
    ]
    sweep, _ = read_sweep(given, folder, Study)
    given = completed(given, sweep)
    if "problem" not in given:
        problems.append("problem: missing")
    found: dict[str, Any] = {}
    kinds: dict[str, Any] = {"problem": Problem, "method": AnyMethod, "save": Save}
    for name, kind in kinds.items():
        if name not in given:
            continue
        try:
            found[name] = pydantic.TypeAdapter(kind).validate_python(
                given[name], context=reading(folder)
            )
        except pydantic.ValidationError as error:
            problems += explain(error, Study, prefix=(name,))
    if problems:
        raise InputError(problems)
    return found["problem"], found.get("method"), found.get("save")


def open_run(path: Any) -> StoredRun:
    """Open a run on disk for reading.

    Parameters
    ----------
    path : path
        Its folder, as given to `Study.run` or ``stiction run --out``.

    Returns
    -------
    StoredRun
        With `study`, `status()`, `dataset()` and `export(path)`.

    Raises
    ------
    InputError
        If it is no path.
    StoreError
        If there is no run, or it cannot be read.
    """
    place = check("path", path, FilePath)
    if not place.is_dir():
        raise StoreError(f"{place}: there is no run here; a run is a folder")
    store = Store(place)
    return StoredRun(store, Study.from_dict(store.study, trusted=True))
