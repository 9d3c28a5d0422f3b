"""A study: problem, strength, method and ensemble, in one object or TOML file."""

from __future__ import annotations

import codecs
import itertools
import json
import re
import tomllib
from collections.abc import Mapping
from concurrent.futures import Executor
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import pydantic
import tomli_w
from pydantic import BeforeValidator, Discriminator, PlainSerializer, Tag

from stiction.base.errors import InputError, StoreError, issue, merge_warnings, merged, prefixed
from stiction.base.files import content_of, write_whole
from stiction.base.kinds import OneOf
from stiction.base.model import (
    Converted,
    Count,
    FilePath,
    Flag,
    Listed,
    Names,
    Number,
    Positive,
    Progress,
    Text,
    check,
    checked,
    describe,
    explain,
    keys_of,
    model,
    to_plain,
)
from stiction.ensemble.dataset import GridAxes, distinct, variables_in
from stiction.ensemble.experiment import Experiment, Measured
from stiction.ensemble.limit_state import LimitState
from stiction.ensemble.monte_carlo import Samples, gather
from stiction.ensemble.store import Store, read_study
from stiction.inference.peaks import Peaks, make_peaks, read_peaks
from stiction.methods.protocol import METHODS, as_method
from stiction.problem.friction import SCALES
from stiction.problem.problem import Problem
from stiction.problem.profiles import ProfileFile, profile_in_file
from stiction.random.dotted_keys import with_values
from stiction.random.equally_likely import FIRST_MEMBERS, Source
from stiction.random.fields import RandomField, RandomInterface, as_random_interface
from stiction.reliability.answer import Answer
from stiction.reliability.design import design_stress
from stiction.reliability.failure import QUANTITIES, demanded, failure_probability
from stiction.reliability.solving import Probability, TargetCv, too_slow
from stiction.study.run import PartOfRun, StoredRun, samples_of_part
from stiction.study.sweep import SWEPT, Point, Sweep, grid_axes

if TYPE_CHECKING:
    import xarray as xr

TABLES = "problem", "random", "method"
"""Tables that a study file must have."""
MAX_TOML_BYTES, MAX_TOML_WORDS, MAX_DOTS = 2**21, 2**18, 64
"""Bytes of a study file, bytes apart from lists of numbers, and dots in
a line of those bytes."""
SHOWN_KEYS = 10
"""Number of keys in a message about a file that is no study."""
_NUMBERS = re.compile(rb"(?:[^=#]{1,200}=)?([\s\d.,eE+_\[\]-]*)")
"""A line that holds numbers, or a key and numbers."""
MOST_WRITTEN = 8
"""Number of random interfaces that a study file may hold.

More are in a file next to it.
"""


def _method(given: Any) -> Any:
    return NotImplemented if isinstance(given, dict) else as_method(given)


MethodOfStudy: Any = Annotated[Any, OneOf(METHODS, _method), "Method"]
"""Any registered method. In a study file ``type`` selects it."""


def _interface(given: Any) -> Any:
    return as_random_interface(given) if isinstance(given, RandomField) else given


_Interface: Any = Annotated[RandomInterface, BeforeValidator(_interface)]


def _interfaces(given: Any, info: pydantic.ValidationInfo) -> Any:
    """Return the interfaces from a fit or a posterior. Return other values unchanged."""
    seed = info.data.get("seed", 0)
    return given.interfaces(FIRST_MEMBERS, seed) if isinstance(given, Source) else given


RandomOfStudy: Any = Annotated[
    Annotated[_Interface, Tag("one")] | Annotated[list[_Interface], Tag("several")],
    Discriminator(lambda given: "several" if isinstance(given, list | tuple) else "one"),
    BeforeValidator(_interfaces),
    "RandomInterface | list",
]
"""A random interface, or several equally likely interfaces. A field
becomes an interface."""


def _profiles_of(given: Any, info: pydantic.ValidationInfo) -> Any:
    """Return profiles.

    In a study file, a profile may be a file or a table {file, ...}.
    """
    read = (info.context or {}).get("read")
    if not isinstance(given, Mapping) or read is None:
        return given
    files = str, Path, dict
    return {k: read(v, str(k)) if isinstance(v, files) else v for k, v in given.items()}


ProfilesOfStudy: Any = Annotated[Any, BeforeValidator(_profiles_of), "mapping of arrays"]
"""Profiles by name, which become plain values at the nodes."""


def _peaks_of(given: Any) -> Any:
    """Return peaks.

    A study in plain form holds them as a table {unit, values, lengths}.
    """
    if not isinstance(given, Mapping) or "values" not in given:
        return make_peaks(given)
    lengths = given.get("lengths", [None] * len(given["values"]))
    groups = dict(zip(lengths, given["values"], strict=True))
    return make_peaks(groups, given.get("unit"))


def _plain_peaks(peaks: Peaks) -> dict[str, Any]:
    plain = {"unit": peaks.unit, "values": [values.tolist() for values in peaks.values]}
    return plain if None in peaks.lengths else plain | {"lengths": list(peaks.lengths)}


PeaksOfStudy: Any = Annotated[Any, BeforeValidator(_peaks_of), PlainSerializer(_plain_peaks)]
"""Measured peaks; in a study file the name of a file next to it, as
`read_peaks` reads."""


@model(kw_only=True)
class Question:
    """A question: the failure probability for a demand, or the design for a probability.

    Parameters
    ----------
    stress, force, friction_coefficient : float, optional
        The demand in Pa, N or 1, as in `stiction.failure_probability`.
    probability : float, optional
        Probability of sliding below the design, as in
        `stiction.design_stress`.
    target_cv : float
        Coefficient of variation to reach.
    """

    stress: Positive | None = None
    force: Positive | None = None
    friction_coefficient: Positive | None = None
    probability: Probability | None = None
    target_cv: TargetCv = 0.1

    @pydantic.model_validator(mode="after")
    def _single(self) -> Question:
        asked = [name for name in self._given if name != "target_cv"]
        if len(asked) != 1:
            raise InputError(
                "give either stress (Pa), force (N), friction_coefficient or probability, got"
                f" {' and '.join(asked) or 'nothing'}"
            )
        return self

    @property
    def _given(self) -> dict[str, Any]:
        return {name: value for name, value in vars(self).items() if value is not None}

    def check(self, point: Experiment) -> None:
        """Refuse a question that a sweep point cannot answer.

        Doubt a demand in another unit.
        """
        for name in QUANTITIES.keys() & self._given:
            state = LimitState(point, name == "friction_coefficient")
            with prefixed("reliability", "."):
                demanded(state, name, self._given[name])
        if self.probability is not None and (slow := too_slow(point, None)):
            raise InputError(f"method: {slow}")

    def answer(self, experiment: Experiment, workers: int | None = None) -> Answer:
        """Answer the question for a point of a study."""
        options = self._given | {"method": experiment.method, "workers": workers}
        options["seed"] = experiment.seed
        if self.probability is None:
            return failure_probability(experiment.problem, experiment.random, **options)
        options["sensitivities"] = True
        return design_stress(experiment.problem, experiment.random, **options)


@model(kw_only=True)
class _Parts(Listed):
    """The parts of a study at a sweep point. Each part is valid by itself."""

    problem: Problem
    seed: Number = 0  # before the random properties, which a source draws with it
    random: RandomOfStudy | None = None
    method: MethodOfStudy


@model(kw_only=True)
class Study(_Parts):
    """Definition of a Monte Carlo study.

    Names are the same in Python and TOML.

    Parameters
    ----------
    problem : Problem
    random : RandomInterface, RandomField, list of them, FieldFit or Posterior
        As in `stiction.monte_carlo`.
    profiles : mapping of arrays, optional
        Given profiles rather than random properties, as in `onset`. In a
        study file, also files or tables {file, ...} for `read_profile`.
    method : LocalCriterion, Equilibrium or Rupture
    samples, seed, keep
        As in `stiction.monte_carlo`.
    sweep : list of dict
        Axes of the sweep. All their combinations are computed. An axis
        maps dotted keys, which vary together, to lists of values.
    reliability : Question, optional
        Question for `stiction reliability`: a ``force`` (N), ``stress``
        (Pa) or ``friction_coefficient`` to carry, or the
        ``probability`` of a design, with ``target_cv``.
    peaks : Peaks or as of `stiction.infer`, optional
        Peaks of further tests, which `stiction reliability` compares with
        its prediction. In a study file, the name of a file for `read_peaks`.
    title : str

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> random, method = st.paper.strength(problem, correlation_ratio=2.0), st.LocalCriterion()
    >>> sweep = [{"random.strength.spectrum.correlation_length": [3e-3, 6e-3]}]
    >>> study = st.Study(problem=problem, random=random, method=method, samples=20, sweep=sweep)
    >>> dict(study.run().sizes)
    {'correlation_length': 2, 'sample': 20}
    """

    profiles: ProfilesOfStudy | None = None
    samples: Samples = 1
    keep: Names = ()
    sweep: Sweep = ()
    reliability: Converted[Question | None, Any] = None  # type: ignore[assignment]  # converted
    peaks: PeaksOfStudy | None = None
    title: Text = ""
    _shown = "from_result", "from_toml", "run", "to_toml"

    @pydantic.model_validator(mode="after")
    def _fits_together(self) -> Study:
        if (self.random is None) == (self.profiles is None):
            raise InputError("random: give either random properties or profiles")
        if self.profiles is not None:
            self._place_profiles()
        points = self.experiments
        variables = variables_in(points)
        wide = [name for name in variables if {"x", "y"} & {*variables[name].dims}]
        if wide and len({point.problem.interface for point in points}) > 1:
            raise InputError(
                f"sweep: {', '.join(wide)} cannot be kept along a swept interface. Split the study"
            )
        if self.reliability is not None:
            with merge_warnings():
                for point in distinct(points, "problem", "random", "method"):
                    self.reliability.check(point)
        return self

    def _place_profiles(self) -> None:
        """Read the profiles, and hold them as plain values at the nodes, in SI."""
        unused = [f"{name}: has no effect on given profiles" for name in ("reliability", "peaks")
                  if getattr(self, name) is not None]  # fmt: skip
        if self.samples > 1:
            unused.append("samples: must be 1, because profiles are given")
        if unused:
            raise InputError(unused)
        sample, doubts = Measured(self.problem, self.profiles, self.method).placed
        names = [*self.profiles] if isinstance(self.profiles, Mapping) else ["strength"]
        fields = {"friction_coefficient": "strength"} | dict.fromkeys(SCALES, "weakening_rate")
        held = [fields.get(str(name), str(name)) for name in names]
        plain = {name: np.asarray(getattr(sample, name))[0].tolist() for name in held}
        object.__setattr__(self, "profiles", plain)
        # A run checks the plain values again. Doubts about their source are told here only.
        again = Measured(self.problem, plain, self.method).placed[1]
        for doubt in merged(doubt for doubt in doubts if doubt not in again):
            issue(doubt)

    @property
    def points(self) -> list[Point]:
        """The sweep points, in order.

        Without a sweep, there is one point without values.
        """
        keys = [key for axis in self.sweep for key in axis]
        steps = itertools.product(*(zip(*axis.values(), strict=True) for axis in self.sweep))
        return [
            Point(number, dict(zip(keys, itertools.chain(*values), strict=True)))
            for number, values in enumerate(steps)
        ]

    @cached_property
    def experiments(self) -> list[Experiment]:
        """The experiments at all points, with a single copy of shared objects.

        A mistake is reported once, with the first point at which it occurs.
        """
        base = _Parts(**{name: getattr(self, name) for name in SWEPT})
        made: dict[Any, Any] = {}
        experiments: list[Experiment] = []
        problems: dict[str, str] = {}
        for point in self.points:
            try:
                parts = {}
                for name in SWEPT:
                    values = {k: v for k, v in point.values.items() if k.split(".")[0] == name}
                    key = name, *map(id, values.values())
                    if key not in made:
                        made[key] = getattr(with_values(base, values), name)
                    parts[name] = made[key]
                problem, random, method, seed = parts.values()
                key = id(problem), id(random), id(method)
                if key not in made:
                    kind = Experiment if self.profiles is None else Measured
                    given = random if self.profiles is None else self.profiles
                    made[key] = kind(problem, given, method, tuple(self.keep))
                experiments.append(made[key].with_seed(seed))
            except InputError as error:
                where = f", at {point} of the sweep" if point.values else ""
                for text in error.problems:
                    problems.setdefault(text, text + where)
        if problems:
            raise InputError(problems.values())
        return experiments

    @property
    def axes(self) -> GridAxes:
        """The sweep axes as dimensions of the result."""
        taken = {*variables_in(self.experiments), "sample", "x", "y"}
        fields = {} if self.profiles else self.experiments[0].random.properties
        coefficients = [name for name, field in fields.items() if field.quantity]
        return grid_axes(self.sweep, taken, coefficients)

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes for a result. The study can be run again from these attributes."""
        try:
            attributes: dict[str, Any] = {"study": self.to_dict()}
        except InputError as error:  # a function of the user's: the result states it
            attributes = {"study_incomplete": str(error)}
        title = {"title": self.title} if self.title else {}
        return attributes | {"seed": self.seed} | title

    @checked
    def run(
        self,
        *,
        out: FilePath | None = None,
        workers: Count | None = None,
        executor: Executor | None = None,
        progress: Progress = True,
        part: PartOfRun | None = None,
        pilot: Flag = True,
    ) -> xr.Dataset:
        """Run the study, or the samples that are still missing.

        Parameters
        ----------
        out : path, optional
            Folder in which results are stored as they are computed. The
            same call resumes an interrupted run, computes failed samples
            again, and adds samples if `samples` was raised.
        workers, executor, progress, pilot
            See `stiction.monte_carlo`.
        part : str, optional
            Part to compute in a job, such as "3/100", in the same folder.

        Returns an `xarray.Dataset` over the sweep axes and
        'sample', with NaN for failed and missing samples. Errors are as
        in `stiction.monte_carlo`. A `StoreError` says why `out` cannot
        be used, such as a different study in it.
        """
        if part is not None and out is None:
            raise InputError("part: needs out=, the folder in which the parts are stored")
        store = None if out is None else Store.open(Path(out), self.to_dict())
        return gather(
            self.experiments,
            self.samples,
            self.attributes,
            self.axes,
            store=store,
            elsewhere=part is not None
            and ~samples_of_part(part, len(self.experiments), self.samples),
            workers=workers,
            executor=executor,
            progress=progress,
            pilot=pilot and (part is None or part[0] == 1),
        )

    def to_dict(self) -> dict[str, Any]:
        """Return the study as plain dictionaries, lists and numbers, as in TOML.

        An `InputError` names a part that exists only in Python.
        """
        plain = to_plain(self).items()
        left_out = ("title", "sweep", "keep")
        return {name: value for name, value in plain if value or name not in left_out}

    def to_toml(self, path: str | Path) -> None:
        """Write the study to a TOML file. Many interfaces are written to a JSON file next to it."""
        plain, place = self.to_dict(), check("path", path, FilePath)
        beside = place.with_suffix(".random.json")
        interfaces = plain["random"]
        if many := isinstance(interfaces, list) and len(interfaces) > MOST_WRITTEN:
            plain["random"] = beside.name
        text = tomli_w.dumps(plain).encode()
        with prefixed("path"):
            _check_toml(text)
        if many:
            write_whole(beside, json.dumps(interfaces).encode())
        write_whole(place, text)

    @classmethod
    def from_dict(cls, given: dict[str, Any], *, folder: str | Path | None = None) -> Study:
        """Make a study from plain dictionaries. Files of profiles are in `folder`."""
        place = None if folder is None else check("folder", folder, FilePath)
        return _validated(given, place, [])

    @classmethod
    def from_toml(cls, path: str | Path) -> Study:
        """Read a study from a TOML file."""
        return read_with_files(check("path", path, FilePath))[0]

    @classmethod
    def from_result(cls, result: xr.Dataset) -> Study:
        """Return the study that produced a result."""
        try:
            given = json.loads(result.attrs["study"])
        except (AttributeError, KeyError, TypeError, ValueError):
            raise InputError(
                "result: must hold a study as JSON in its attribute 'study'"
            ) from None
        return cls.from_dict(given)


# -- study files, which may come from strangers ---------------------------------------------------


def _check_toml(content: bytes) -> None:
    """Refuse text that Python's parser would read slowly, such as keys with a thousand parts."""
    words = 0
    for line in content.split(b"\n"):
        match = _NUMBERS.fullmatch(line)
        if match and match[1].count(b".") <= match[1].count(b",") + 1:
            line = line[: match.start(1)]
        words += len(line)
        if line.count(b".") > MAX_DOTS and not line.lstrip().startswith(b"#"):
            raise InputError(f"has a line with over {MAX_DOTS} dots apart from numbers")
    if words > MAX_TOML_WORDS or len(content) > MAX_TOML_BYTES:
        raise InputError(
            f"has more than {MAX_TOML_BYTES} bytes, or {MAX_TOML_WORDS} outside lists of numbers."
            " Name profiles by files next to the study, such as strength.npy"
        )


def _read_toml(path: Path) -> dict[str, Any]:
    """Return the tables in a TOML file, or raise an `InputError`."""
    content = content_of(path)
    wide = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))  # of PowerShell 5.1
    with prefixed(str(path)):
        try:
            text = content.decode("utf-16" if wide else "utf-8-sig")
        except UnicodeDecodeError as error:
            raise InputError(f"is not UTF-8 (byte {error.start}). Save it as UTF-8") from None
        _check_toml(text.encode())
        try:
            return tomllib.loads(text)
        except (RecursionError, ValueError) as error:  # the latter for integers of many digits
            advice = "`stiction example FILE` writes a study"
            if "'\\'" in str(error):
                advice = "in paths, write / for \\, or put them in single quotes"
            raise InputError(f"is not valid TOML: {error} ({advice})") from None


def _validated(given: dict[str, Any], folder: Path | None, files: list[Path]) -> Study:
    """Build a study from plain dictionaries.

    Files that the study names are in `folder`, and their paths are
    appended to `files`.
    """
    check("study", given, dict)
    if given and not {*keys_of(Study)} & {*given}:
        some = ", ".join(map(describe, [*given][:SHOWN_KEYS]))
        raise InputError(
            f"study: must have the tables {', '.join(TABLES)}, got {some}. `stiction example FILE`"
            " writes a study to start from"
        )
    context = {}
    if folder is not None:

        def read(profile: Any, name: str) -> Any:
            file = profile_in_file(profile, name, folder)
            if isinstance(file, ProfileFile):
                files.append(file.path)
            return file

        context["read"] = read
        given = dict(given)
        for key, reader in (("random", _stored_interfaces), ("peaks", read_peaks)):
            if isinstance(given.get(key), str):
                files.append(folder / check(key, given[key], FilePath))
                with prefixed(key):
                    given[key] = reader(files[-1])
    try:
        return pydantic.TypeAdapter(Study).validate_python(given, context=context)
    except pydantic.ValidationError as error:
        raise InputError(explain(error, given)) from None


def _stored_interfaces(path: Path) -> list[Any]:
    """Return the interfaces in a file that `Study.to_toml` wrote."""
    with prefixed(str(path)):
        content = content_of(path)
        try:
            interfaces = json.loads(content)
        except (RecursionError, ValueError) as error:
            raise InputError(f"is not valid JSON: {error}") from None
        return list(check("interfaces", interfaces, list))


def read_with_files(path: Path) -> tuple[Study, list[Path]]:
    """Return the study in a TOML file, and the files next to it that it names."""
    files: list[Path] = []
    return _validated(_read_toml(path), path.parent, files), files


def open_run(path: Any) -> StoredRun:
    """Open a run on disk for reading.

    Parameters
    ----------
    path : path
        Folder of the run, as given to `Study.run` or ``stiction run --out``.

    Returns
    -------
    StoredRun
        With `study`, `status()`, `dataset()` and `export(path)`.

    Raises
    ------
    InputError
        If `path` is not a path.
    StoreError
        If the folder holds no run, or if its study cannot be read, for
        example because it names a class that is not installed.
    """
    place = check("path", path, FilePath)
    if place.is_file():
        raise InputError(f"path: {place} is a file. Give the folder of the run")
    plain = read_study(place)
    store = Store(place, plain)
    try:
        study = Study.from_dict(plain)
    except InputError as error:
        raise StoreError(
            f"{place}: this installation cannot read its study: {'; '.join(error.problems)}."
            " Install the version that wrote it, or the package that defines the missing class"
        ) from None
    return StoredRun(store, study)
