"""Frozen, validated parameter objects, and public functions that check their arguments.

One definition serves Python, TOML and JSON. All mistakes come at once, as one `InputError`.
"""

import dataclasses
import functools
import inspect
import math
import numbers
import operator
import os
import types
import typing
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any, Literal, TypeAlias, TypeVar, dataclass_transform

import numpy as np
import pydantic
import pydantic_core
from pydantic import (
    BeforeValidator,
    ConfigDict,
    Field,
    InstanceOf,
    PlainSerializer,
    WithJsonSchema,
)
from pydantic.dataclasses import dataclass as pydantic_dataclass

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.progress import Show

T = TypeVar("T")
Function = TypeVar("Function", bound=Callable[..., Any])


# -- kinds of values -----------------------------------------------------------------------------


def _is_real(value: Any) -> bool:
    """Numbers of any library, but no text and no truth values, which pydantic would convert."""
    return isinstance(value, numbers.Real) and not isinstance(value, bool)


def _number(value: Any) -> float:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if not _is_real(value):
        raise ValueError("must be a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError("must be finite") from None


def _count(value: Any) -> int:
    """Whole numbers of any library, 1e4 too."""
    if isinstance(value, numbers.Integral) and _is_real(value):
        return int(value)
    if not _is_real(value) or not float(value).is_integer():
        raise ValueError("must be a whole number")
    return int(float(value))


def is_whole(value: Any, least: int) -> bool:
    """Whether a value is a whole number (1e4 too), and not less than `least`."""
    try:
        return _count(value) >= least
    except ValueError:
        return False


def is_finite(value: Any) -> bool:
    """Whether a value is a finite number, and neither text nor a truth value."""
    try:
        return math.isfinite(_number(value))
    except ValueError:
        return False


def real_array(value: Any) -> Array:
    """`value` as a float64 array, or a TypeError that names what it is instead."""
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise TypeError("got a masked array")
    try:
        given = np.asarray(value)
    except ValueError:
        raise TypeError("got rows of unequal length") from None
    if given.dtype.kind not in "fiu":
        kind = type(value).__name__ if given.ndim == 0 else f"elements of type {given.dtype}"
        raise TypeError(f"got {kind}")
    return np.ascontiguousarray(given, dtype=np.float64).reshape(given.shape)


def is_unplaced(value: Any) -> bool:
    """Whether a profile has coordinates or units of its own, which its problem resolves."""
    own = ("dims", "to_xarray", "magnitude", "to_value")
    return isinstance(value, dict) or any(hasattr(value, name) for name in own)


def _profile(value: Any, info: pydantic.ValidationInfo) -> Any:
    """A number, a read-only float64 array of shape (*shape), or what a problem will place.

    In a study file also what its reader takes: a path, or a table {file, ...} with options.
    """
    read = (info.context or {}).get("read")
    if isinstance(value, str | Path | dict) and read is not None:
        value = read(value, str(info.field_name))
    if isinstance(value, str | Path):
        raise ValueError(
            "file names belong in a study file; in Python give a number, an array or"
            " st.read_profile(path)"
        )
    if is_unplaced(value):
        return value
    if is_finite(value):
        return _number(value)
    try:
        array = np.array(real_array(value))
    except TypeError as error:
        raise ValueError(f"must be a number or an array of numbers, {error}") from None
    if array.ndim == 2 and 1 in array.shape:  # a column, as out of a table
        array = array.reshape(-1)
    if array.ndim not in (1, 2) or array.size == 0:
        raise ValueError(f"must have shape (nodes,) or (nx, ny), got shape {array.shape}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"must be finite; entry {int(np.argmin(np.isfinite(array)))} is not")
    array.flags.writeable = False
    return array


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _numbers(value: Any) -> Array:
    try:
        return real_array(value)
    except (TypeError, OverflowError) as error:
        raise InputError(f"must be numbers; {error}") from None


def _is_flag(value: Any) -> bool:
    return isinstance(value, bool | np.bool_)


def _is_show(value: Any) -> bool:
    return _is_flag(value) or (callable(value) and not isinstance(value, type))


def _is_text(value: Any) -> bool:
    """Whether it is valid UTF-8, which TOML, JSON and NetCDF need."""
    return isinstance(value, str) and value == value.encode(errors="ignore").decode()


def _is_path(value: Any) -> bool:
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else ""
    if not text or not _is_text(text) or "\0" in text:
        return False
    return all(len(os.fsencode(part)) <= 255 for part in Path(text).parts)


def _listed(names: Any) -> tuple[Any, ...]:
    return tuple(names) if isinstance(names, list | tuple | set | frozenset) else (names,)


def _are_names(value: Any) -> bool:
    return all(isinstance(name, str) for name in _listed(value))


def _must(
    be: str, valid: Callable[[Any], bool], made: Callable[[Any], Any] = lambda value: value
) -> BeforeValidator:
    """Return the validator of an annotation that refuses what is not `valid`."""

    def read(value: Any) -> Any:
        if not valid(value):
            raise ValueError(f"must be {be}")
        return made(value)

    return BeforeValidator(read)


@functools.cache
def at_least(least: int) -> Any:
    """Return the annotation of a whole number not below `least`."""
    valid = functools.partial(is_whole, least=least)
    return Annotated[int, _must(f"a whole number >= {least}", valid, int)]


Count: TypeAlias = at_least(1)  # type: ignore[valid-type]  # a call makes it
Number: TypeAlias = at_least(0)  # type: ignore[valid-type]
"""Whole numbers from 1 and from 0; 1e4 counts as one."""
Real: TypeAlias = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Positive: TypeAlias = Annotated[Real, Field(gt=0)]
Seconds: TypeAlias = Positive
Numbers: TypeAlias = Annotated[Any, BeforeValidator(_numbers)]
"""Real numbers of any shape, as a float64 array."""
PROFILE_SCHEMA = [
    {"type": "number"},
    {"type": "array", "items": {"type": "number"}},
    {"type": "string", "description": "path to a .npy, text or NetCDF file"},
    {"type": "object", "description": "file, and options of read_profile: unit, x_unit, ..."},
]
Profile: TypeAlias = Annotated[
    Any,
    BeforeValidator(_profile),
    PlainSerializer(_plain),
    WithJsonSchema({"anyOf": PROFILE_SCHEMA}),
]
"""A number, or a read-only array of shape (nodes,)."""
OptionalProfile: TypeAlias = Annotated[
    Any,
    BeforeValidator(lambda value, info: None if value is None else _profile(value, info)),
    PlainSerializer(_plain),
    WithJsonSchema({"anyOf": [*PROFILE_SCHEMA, {"type": "null"}]}),
]
"""The same, or None for 'not given'."""
Flag: TypeAlias = Annotated[bool, _must("True or False", _is_flag, bool)]
Progress: TypeAlias = Annotated[Show, _must("True, False or a function", _is_show)]
"""True, False, or a function of (done, total)."""
Text: TypeAlias = Annotated[str, _must("text in UTF-8", _is_text)]
Names: TypeAlias = Annotated[
    tuple[str, ...], _must("a name or a list of names", _are_names, _listed)
]
"""One name or several, as a tuple."""
FilePath: TypeAlias = Annotated[
    Path, _must("a path in UTF-8, each name at most 255 bytes", _is_path, Path)
]
Mode: TypeAlias = Literal["II", "III"]


# -- mistakes ------------------------------------------------------------------------------------


def describe(value: Any) -> str:
    """Short form of what was given, for messages."""
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _models_in(annotation: Any) -> list[type]:
    """The model classes that an annotation mentions: X, X | Y, Annotated[X | Y, ...]."""
    if dataclasses.is_dataclass(annotation):
        return [annotation] if isinstance(annotation, type) else []
    return [cls for part in typing.get_args(annotation) for cls in _models_in(part)]


def keys_of(cls: Any) -> dict[str, str]:
    """Return the keys of a model in a study file, and the field that each stands for."""
    known = getattr(cls, "__pydantic_fields__", {})
    names = [field.name for field in dataclasses.fields(cls) if field.init]
    return {(name in known and known[name].alias) or name: name for name in names}


def _hints(cls: type) -> dict[str, Any]:
    hints = typing.get_type_hints(cls, include_extras=True)
    return {key: hints[name] for key, name in keys_of(cls).items()}


def _place(
    owner: Any, location: tuple[int | str, ...]
) -> tuple[list[str], list[str], list[type]]:
    """The path as the user wrote it, the keys valid in its last step, the models valid there.

    Pydantic numbers positional arguments, and puts the chosen member of a union into the path.
    """
    if not isinstance(owner, type):
        names = list(inspect.signature(owner).parameters) if owner else []
        first = location[:1] if owner else ()
        steps = [names[i] if isinstance(i, int) and i < len(names) else i for i in first]
        steps += [step for step in location[len(first) :] if isinstance(step, int)]
        return [str(step) for step in steps], names, []
    path: list[str] = []
    hints: dict[str, Any] = {}
    inside = [owner]
    for step in location:
        if path and (chosen := [one for one in inside if getattr(one, "type", None) == step]):
            inside = chosen
            continue
        hints = {key: hint for one in inside for key, hint in _hints(one).items()} or hints
        if isinstance(step, int) and not path and step < len(hints):
            step = list(hints)[step]
        path.append(str(step))
        inside = _models_in(hints.get(str(step)))
    return path, list(hints), inside


def explain(error: pydantic.ValidationError, owner: Any, root: str = "") -> list[str]:
    """List the mistakes that pydantic found, one text each, with the path to the key.

    `owner` is the model that was validated, or the function that was called, or None. Paths begin
    with `root`.
    """
    texts: list[tuple[str, str, str]] = []
    for item in error.errors():
        steps, valid, models = _place(owner, item["loc"])
        path = ".".join([root, *steps] if root else steps)
        kind, given = item["type"], describe(item.get("input"))
        context = item.get("ctx") or {}
        wrong = context.get("error")
        text, member, end = "", "", ""
        if kind == "unexpected_positional_argument":
            return [f"{owner.__name__}: give its arguments by name (valid: {', '.join(valid)})"]
        if kind.startswith("missing"):
            text = f"{path}: missing"
        elif kind in ("unexpected_keyword_argument", "extra_forbidden"):
            table, _, key = path.rpartition(".")
            text = unknown_name(table or owner.__name__, key, valid)
        elif kind == "union_tag_invalid":
            tags = [tag.strip("' ") for tag in context["expected_tags"].split(",")]
            text = unknown_name(f"{path}.type", str(context["tag"]), tags)
        elif kind == "union_tag_not_found":
            text = f"{path}.type: missing, got {given}"
        elif isinstance(wrong, InputError):
            prefix = f"{path}: " if path else ""
            texts += [(f"{prefix}{problem}", "", "") for problem in wrong.problems]
            continue
        elif wrong is not None:
            text = f"{path}: {wrong}, got {given}"
        else:
            text, end = f"{path}: must be ", f", got {given}"
            member = item["msg"].removeprefix("Input should be ")
            classes = [str(context[key]) for key in ("class_name", "class") if key in context]
            if kind == "model_attributes_type":  # one of several, told apart by its type
                classes = [one.__name__ for one in models]
            if classes:
                some = (f"{'an' if name[0] in 'AEIO' else 'a'} {name}" for name in classes)
                member = " or ".join(some)
        texts.append((text, member, end))
    whole: dict[tuple[str, str], list[str]] = {}  # members of a union have an item each
    for text, member, end in texts:
        whole.setdefault((text, end), []).append(member)
    return [
        text + " or ".join(dict.fromkeys(members)) + end
        for (text, end), members in whole.items()
    ]


# -- objects and functions -----------------------------------------------------------------------


@typing.overload
def model(cls: type[T]) -> type[T]: ...
@typing.overload
def model(*, kw_only: bool = ...) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, Field))
def model(cls: Any = None, *, kw_only: bool = False) -> Any:
    """Class decorator: a frozen pydantic dataclass whose mistakes come as `InputError`.

    Objects compare by value (arrays too) and hash by value. Consistency checks go into a method
    decorated with ``pydantic.model_validator(mode="after")`` that raises `InputError`.
    """
    if cls is None:
        return functools.partial(model, kw_only=kw_only)
    config = ConfigDict(extra="forbid", arbitrary_types_allowed=True, validate_by_name=True)
    decorate = pydantic_dataclass(
        frozen=True, eq=False, repr=False, kw_only=kw_only, config=config
    )
    wrapped: Any = decorate(cls)
    validated_init = wrapped.__init__

    @functools.wraps(validated_init)
    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        try:
            validated_init(self, *args, **kwargs)
        except pydantic.ValidationError as error:
            raise InputError(explain(error, wrapped, cls.__name__)) from None

    # Validation inside another model must keep calling pydantic's own path, not this wrapper.
    init.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # pydantic's own marker
    wrapped.__init__, wrapped.__repr__ = init, brief
    wrapped.__eq__, wrapped.__hash__ = _equal, _hash
    return wrapped


def _comparable(value: Any) -> Any:
    """What stands for a value where objects are compared and hashed."""
    if isinstance(value, np.ndarray):
        return value.shape, (value + 0.0).tobytes()  # zeros of both signs are equal
    if hasattr(value, "identical"):  # labelled arrays
        return str(value.to_dict())
    if isinstance(value, dict):
        return tuple((key, _comparable(value[key])) for key in sorted(value))
    return tuple(map(_comparable, value)) if isinstance(value, list) else value


def _fields(self: Any) -> list[Any]:
    return [_comparable(getattr(self, field.name)) for field in dataclasses.fields(self)]


def _equal(self: Any, other: Any) -> bool:
    return _fields(self) == _fields(other) if type(self) is type(other) else NotImplemented


def _hash(self: Any) -> int:
    return hash(tuple(_fields(self)))


def brief(self: Any) -> str:
    """Use as `__repr__` of a dataclass: its fields that are not at their default, shortened."""
    parts = []
    for field in dataclasses.fields(self):
        value = getattr(self, field.name)
        default = type(value) is type(field.default) and value == field.default
        if field.repr and not default:
            parts.append(f"{field.name}={_shown(value)}")
    return f"{type(self).__name__}({', '.join(parts)})"


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        shape = " x ".join(str(size) for size in value.shape)
        if value.dtype.kind not in "fiu" or value.size == 0:
            return f"<{shape} array>"
        return f"<{shape} array, {np.nanmin(value):.6g} to {np.nanmax(value):.6g}>"
    if isinstance(value, list | tuple) and len(value) > 6:
        return f"<{len(value)} values>"
    return repr(float(value) if isinstance(value, np.floating) else value)


def to_plain(value: Any) -> Any:
    """The object as plain dicts, lists and numbers: what TOML and JSON hold.

    Raises
    ------
    InputError
        If something in it exists in Python only, such as a function.
    """
    try:
        return pydantic.TypeAdapter(type(value)).dump_python(
            value, mode="json", exclude_none=True, by_alias=True
        )
    except pydantic_core.PydanticSerializationError as error:
        words = "cannot be written down: "  # the innermost reason, without names of exceptions
        reason = str(error).rsplit(words, 1)[-1].rsplit("Error: ", 1)[-1]
        raise InputError(f"{type(value).__name__}: {words}{reason}") from None
    except pydantic.errors.PydanticSchemaGenerationError:
        raise InputError(f"{type(value).__name__}: exists in Python only") from None


def checked(function: Function) -> Function:
    """Decorator of a public function: check its arguments by their annotations.

    A class in an annotation takes its own instances only, not the tables of a study file. All that
    is wrong comes as one `InputError`.
    """
    written = function.__annotations__
    function.__annotations__ = {name: one for name, one in written.items() if name != "return"}
    hints = typing.get_type_hints(function, include_extras=True)
    function.__annotations__ = {name: _instances(hint) for name, hint in hints.items()}
    validated = pydantic.validate_call(config=ConfigDict(arbitrary_types_allowed=True))(
        function
    )
    function.__annotations__ = written

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return validated(*args, **kwargs)
        except pydantic.ValidationError as error:
            raise InputError(explain(error, function)) from None

    return typing.cast(Function, call)


def _instances(hint: Any) -> Any:
    """The annotation, with model classes that take instances only."""
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return functools.reduce(operator.or_, map(_instances, typing.get_args(hint)))
    own = dataclasses.is_dataclass(hint)
    return Annotated[hint, InstanceOf()] if own else hint  # type: ignore[type-arg]


def check(name: str, value: Any, annotation: Any) -> Any:
    """Return a value as an annotation has it, or raise an `InputError` that begins with `name`.

    For what `checked` does not see, such as entries of a mapping or options of a command.
    """
    try:
        return _adapter(annotation).validate_python(value)
    except pydantic.ValidationError as error:
        raise InputError(explain(error, None, name)) from None


@functools.lru_cache(maxsize=64)
def _adapter(annotation: Any) -> pydantic.TypeAdapter[Any]:
    if isinstance(annotation, type):  # no table of a study file
        return pydantic.TypeAdapter(Annotated[annotation, InstanceOf()])
    return pydantic.TypeAdapter(_instances(annotation))


def check_memory(name: str, needed: float, advice: str = "take fewer") -> None:
    """Raise an `InputError` if arrays need more memory (bytes) than this machine has."""
    try:
        there = float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # unknown on this system
        return
    if needed > there:
        raise InputError(
            f"{name}: this takes {needed / 2**30:,.1f} GiB of memory, more than the"
            f" {there / 2**30:,.1f} GiB of this machine; {advice}"
        )
