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
    """Return a method. A table goes to the class that its type names.

    >>> import stiction as st
    >>> _method({"type": "equilibrium"}), _method(st.LocalCriterion())
    (NotImplemented, LocalCriterion())
    """
    return NotImplemented if isinstance(given, dict) else as_method(given)


MethodOfStudy: Any = Annotated[Any, OneOf(METHODS, _method), "Method"]
"""Any registered method. In a study file ``type`` selects it."""


def _interface(given: Any) -> Any:
    """Return a random interface. A field becomes the strength of an interface.

    >>> import stiction as st
    >>> field = st.paper.strength(st.paper.problem(nodes=576))
    >>> _interface(field) == st.RandomInterface(strength=field), _interface("other")
    (True, 'other')
    """
    return as_random_interface(given) if isinstance(given, RandomField) else given


_Interface: Any = Annotated[RandomInterface, BeforeValidator(_interface)]


def _interfaces(given: Any, info: pydantic.ValidationInfo) -> Any:
    """Return the interfaces from a fit or a posterior. Return other values unchanged.

    >>> from types import SimpleNamespace
    >>> fit = SimpleNamespace(interfaces=lambda count, seed: (count == FIRST_MEMBERS, seed))
    >>> [_interfaces(fit, SimpleNamespace(data=data)) for data in ({"seed": 7}, {})]
    [(True, 7), (True, 0)]
    >>> _interfaces("other", SimpleNamespace(data={}))
    'other'
    """
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

    >>> from types import SimpleNamespace
    >>> read = lambda value, name: f"{name} from {value}"
    >>> info, given = SimpleNamespace(context={"read": read}), {"slip": "a.csv", "strength": [3.0]}
    >>> _profiles_of(given, info), _profiles_of([3.0], info)
    ({'slip': 'slip from a.csv', 'strength': [3.0]}, [3.0])
    >>> _profiles_of(given, SimpleNamespace(context=None)) is given
    True
    >>> _profiles_of({"slip": {"file": "a.csv"}}, info)
    {'slip': "slip from {'file': 'a.csv'}"}
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

    >>> table = {"unit": "N", "values": [[3e3, 5e3, 4e3], [7e3, 8e3]], "lengths": [0.1, 0.25]}
    >>> peaks = _peaks_of(table)
    >>> peaks.lengths, [values.tolist() for values in peaks.values], peaks.unit
    ((0.1, 0.25), [[3000.0, 5000.0, 4000.0], [7000.0, 8000.0]], 'N')
    >>> _plain_peaks(peaks) == table
    True
    >>> _plain_peaks(_peaks_of({"unit": "Pa", "values": [[3e6, 5e6, 4e6, 7e6]]}))
    {'unit': 'Pa', 'values': [[3000000.0, 5000000.0, 4000000.0, 7000000.0]]}
    >>> _peaks_of(peaks) is peaks
    True
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

    Examples
    --------
    >>> import stiction as st
    >>> Question(force=620, target_cv=0.2)
    Question(force=620.0, target_cv=0.2)
    >>> for given in ({}, {"force": 620, "probability": 0.05}):
    ...     try:
    ...         Question(**given)
    ...     except st.InputError as error:
    ...         print(str(error).rpartition(", ")[2])
    got nothing
    got force and probability
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
        """Answer the question for a point of a study.

        >>> from types import SimpleNamespace
        >>> from unittest.mock import patch
        >>> point = SimpleNamespace(problem="problem", random="random", method="method", seed=7)
        >>> with patch("stiction.study.study.failure_probability") as answer:
        ...     _ = Question(force=620, target_cv=0.2).answer(point, 3)
        >>> answer.call_args
        call('problem', 'random', force=620.0, target_cv=0.2, method='method', workers=3, seed=7)
        >>> with patch("stiction.study.study.design_stress") as answer:
        ...     _ = Question(probability=0.05).answer(point)
        >>> answer.call_args.args, answer.call_args.kwargs["sensitivities"]
        (('problem', 'random'), True)
        """
        options = self._given | {"method": experiment.method, "workers": workers}
        options["seed"] = experiment.seed
        if self.probability is None:
            return failure_probability(experiment.problem, experiment.random, **options)
        options["sensitivities"] = True
        return design_stress(experiment.problem, experiment.random, **options)


@model(kw_only=True)
class _Parts(Listed):
    """The parts of a study at a sweep point. Each part is valid by itself.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=576)
    >>> _Parts(problem=problem, method={"type": "local_criterion"}).method
    LocalCriterion()
    """

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
        """Read the profiles, and hold them as plain values at the nodes, in SI.

        >>> import stiction as st
        >>> given = {"problem": st.paper.problem(nodes=576), "method": st.LocalCriterion()}
        >>> profiles = {"strength": np.linspace(1e6, 2e6, 576)}
        >>> Study(**given, profiles=profiles).profiles["strength"][::575]
        [1000000.0, 2000000.0]
        >>> Study(**given, profiles=profiles, samples=3, reliability={"stress": 1.0})
        Traceback (most recent call last):
            ...
        stiction.base.errors.InputError: Study: reliability: has no effect on given profiles
        Study: samples: must be 1, because profiles are given
        >>> for both in ({}, {"profiles": profiles, "random": st.paper.strength(given["problem"])}):
        ...     try:
        ...         Study(**given, **both)
        ...     except InputError as error:
        ...         print(error)
        Study: random: give either random properties or profiles
        Study: random: give either random properties or profiles
        """
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
        r"""The sweep points, in order.

        Without a sweep, there is one point without values.

        >>> from types import SimpleNamespace
        >>> sweep = [{"random.a": [0.25, 0.5], "random.b": [3, 4]}, {"seed": [7, 9]}]
        >>> print(*Study.points.fget(SimpleNamespace(sweep=sweep)), sep="\n")
        point 0 (random.a = 0.25, random.b = 3, seed = 7)
        point 1 (random.a = 0.25, random.b = 3, seed = 9)
        point 2 (random.a = 0.5, random.b = 4, seed = 7)
        point 3 (random.a = 0.5, random.b = 4, seed = 9)
        >>> Study.points.fget(SimpleNamespace(sweep=[]))
        [Point(number=0, values={})]
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
        """The sweep axes as dimensions of the result.

        >>> import stiction as st
        >>> problem = st.paper.problem(nodes=576)
        >>> given = {"problem": problem, "random": st.paper.strength(problem)}
        >>> length = "random.strength.spectrum.correlation_length"
        >>> sweep = [{length: [0.02, 0.03], "problem.interface.length": [0.2, 0.1]}]
        >>> sweep += [{"seed": [7, 9]}]
        >>> study = Study(**given, method=st.LocalCriterion(), sweep=sweep)
        >>> {dim: list(coordinates) for dim, coordinates in study.axes.items()}
        {'correlation_length': ['correlation_length', 'length'], 'seed': ['seed']}
        >>> points = study.experiments
        >>> [(point.problem.interface.length, point.seed) for point in points]
        [(0.2, 7), (0.2, 9), (0.1, 7), (0.1, 9)]
        >>> points[0].problem is points[1].problem, points[2].problem == problem
        (True, True)
        >>> strengths = [point.random.properties["strength"] for point in points]
        >>> [field.spectrum.correlation_length for field in strengths], study.attributes["seed"]
        ([0.02, 0.02, 0.03, 0.03], 0)
        >>> sweep = [{length: [0.02, -3.0]}, {"seed": [7, 9]}]
        >>> Study(**given, method=st.LocalCriterion(), sweep=sweep)  # doctest: +ELLIPSIS
        Traceback (most recent call last):
            ...
        stiction...: Study: ...: must be greater than ... got -3.0, at point 2 (...) of the sweep
        """
        taken = {*variables_in(self.experiments), "sample", "x", "y"}
        fields = {} if self.profiles else self.experiments[0].random.properties
        coefficients = [name for name, field in fields.items() if field.quantity]
        return grid_axes(self.sweep, taken, coefficients)

    @property
    def attributes(self) -> dict[str, Any]:
        """Attributes for a result. The study can be run again from these attributes.

        >>> from types import SimpleNamespace
        >>> study = SimpleNamespace(to_dict=lambda: {"samples": 3}, title="first", seed=7)
        >>> Study.attributes.fget(study)
        {'study': {'samples': 3}, 'seed': 7, 'title': 'first'}
        >>> def refuse():
        ...     raise InputError("Law: exists only in Python")
        >>> Study.attributes.fget(SimpleNamespace(to_dict=refuse, title="", seed=7))
        {'study_incomplete': 'Law: exists only in Python', 'seed': 7}
        """
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
        """Write the study to a TOML file. Many interfaces are written to a JSON file next to it.

        >>> import tempfile
        >>> import stiction as st
        >>> problem = st.paper.problem(nodes=576)
        >>> given = {"problem": problem, "method": st.LocalCriterion(), "title": "many"}
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     for count in (8, 9):
        ...         study = Study(random=[st.paper.strength(problem)] * count, **given)
        ...         study.to_toml(Path(folder, f"study{count}.toml"))
        ...         Study.from_toml(Path(folder, f"study{count}.toml")) == study
        ...     sorted(path.name for path in Path(folder).iterdir())
        ...     [path.name for path in read_with_files(Path(folder, "study9.toml"))[1]]
        True
        True
        ['study8.toml', 'study9.random.json', 'study9.toml']
        ['study9.random.json']
        >>> plain = study.to_dict()
        >>> list(plain), list(Study.from_dict(plain | {"title": ""}).to_dict())[-1]
        (['problem', 'seed', 'random', 'method', 'samples', 'title'], 'samples')
        """
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
    r"""Refuse text that Python's parser would read slowly, such as keys with a thousand parts.

    >>> _check_toml(b"a" + b".b" * 64 + b" = 1\n# " + b"." * 65 + b"\nx = [" + b"1.5, " * 99 + b"]")
    >>> for line in (b"a" + b".b" * 65, b"x = " + b"1." * 65, b"a" * (MAX_TOML_WORDS + 1)):
    ...     try:
    ...         _check_toml(b"a = 1\n" + line)
    ...     except InputError as error:
    ...         print(str(error)[:41])
    has a line with over 64 dots apart from n
    has a line with over 64 dots apart from n
    has more than 2097152 bytes, or 262144 ou
    >>> _check_toml(b"a = [" + b"1, " * MAX_TOML_WORDS + b"]")
    >>> _check_toml(b"1, " * MAX_TOML_BYTES)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: has more than 2097152 bytes, or 262144 outside lists...
    """
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
    r"""Return the tables in a TOML file, or raise an `InputError`.

    >>> import tempfile
    >>> def read(content):
    ...     with tempfile.TemporaryDirectory() as folder:
    ...         path = Path(folder, "study.toml")
    ...         path.write_bytes(content)
    ...         try:
    ...             return _read_toml(path)
    ...         except InputError as error:
    ...             return str(error).removeprefix(f"{path}: ")
    >>> [read("a = 'é'".encode(code))["a"] for code in ("utf-8", "utf-8-sig", "utf-16")]
    ['é', 'é', 'é']
    >>> read(b"a = \xff")
    'is not UTF-8 (byte 4). Save it as UTF-8'
    >>> read(b"a = ")[:23], read(b"a = ")[-40:]
    ('is not valid TOML: Inva', '(`stiction example FILE` writes a study)')
    >>> read(rb'a = "C:\peaks.csv"')[-55:]
    '(in paths, write / for \\, or put them in single quotes)'
    """
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

    >>> _validated({str(number): 0 for number in range(12)}, None, [])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction...: study: must have the tables problem, random, method, got '0', '1', ..., '9'. `...
    >>> _validated({"title": "first"}, None, [])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: problem: missing
    method: missing
    >>> files = []
    >>> _validated({"peaks": "peaks.csv"}, Path("no folder"), files)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: peaks: ...: does not exist
    >>> files == [Path("no folder", "peaks.csv")]
    True
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
    """Return the interfaces in a file that `Study.to_toml` wrote.

    >>> import tempfile
    >>> def read(content):
    ...     with tempfile.TemporaryDirectory() as folder:
    ...         path = Path(folder, "study.random.json")
    ...         path.write_text(content)
    ...         try:
    ...             return _stored_interfaces(path)
    ...         except InputError as error:
    ...             return str(error).removeprefix(f"{path}: ")
    >>> read("[3, 5]"), read("{}"), read("[3")[:18]
    ([3, 5], 'interfaces: must be a list, got {}', 'is not valid JSON:')
    """
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

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "study.toml")
    ...     path.touch()
    ...     try:
    ...         open_run(path)
    ...     except InputError as error:
    ...         print(str(error).replace(str(path), "PATH"))
    path: PATH is a file. Give the folder of the run
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
