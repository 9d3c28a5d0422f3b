"""Frozen, validated parameter objects, and public functions that check their arguments.

One definition serves Python, TOML and JSON. All mistakes come at once, as one `InputError`.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import math
import numbers
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
    WrapValidator,
)
from pydantic.dataclasses import dataclass as pydantic_dataclass

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.progress import Show

T = TypeVar("T")


def _number(value: Any) -> Any:
    """Numbers of any library, but no strings and no booleans, which pydantic would convert."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        raise ValueError("must be a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError("must be finite") from None


def whole(value: Any) -> int | None:
    """`value` as an int if it is a whole number (1e4 too), None otherwise."""
    if isinstance(value, bool | np.bool_) or not isinstance(value, numbers.Real):
        return None
    if isinstance(value, numbers.Integral):
        return int(value)
    number = float(value)
    return int(number) if number.is_integer() else None


def _count(value: Any) -> Any:
    count = whole(value)
    if count is None:
        raise ValueError("must be a whole number")
    return count


def as_list(value: Any) -> Any:
    """Return arrays and ranges as lists, for annotations of sequences."""
    if isinstance(value, np.ndarray):
        return value.tolist()
    return list(value) if isinstance(value, range) else value


def is_whole(value: Any, least: int) -> bool:
    """Whether a value is a whole number (1e4 too), and not less than `least`."""
    number = whole(value)
    return number is not None and number >= least


def is_real(value: Any) -> bool:
    """Whether a value is a number and neither text nor a truth value; NaN and infinity are."""
    try:
        return isinstance(_number(value), float)
    except ValueError:
        return False


def is_finite(value: Any) -> bool:
    """Whether a value is a finite number."""
    return is_real(value) and math.isfinite(value)


def real_array(value: Any) -> Array:
    """`value` as a float64 array, or a TypeError that says what it is instead."""
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


@functools.cache
def at_least(least: int) -> Any:
    """Return the annotation of a whole number not below `least`."""

    def read(value: Any) -> int:
        if not is_whole(value, least):
            raise ValueError(f"must be a whole number >= {least}")
        return int(value)

    return Annotated[int, BeforeValidator(read)]


Count: TypeAlias = at_least(1)  # type: ignore[valid-type]  # a call makes it
Number: TypeAlias = at_least(0)  # type: ignore[valid-type]
"""Whole numbers from 1 and from 0; 1e4 counts as one."""


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
    if isinstance(value, numbers.Real) or (isinstance(value, np.ndarray) and value.ndim == 0):
        number = _number(value)
        if not np.isfinite(number):
            raise ValueError("must be finite")
        return number
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
    if hasattr(value, "plain"):
        return value.plain()
    return value.tolist() if isinstance(value, np.ndarray) else value


Real: TypeAlias = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Positive: TypeAlias = Annotated[float, BeforeValidator(_number), Field(gt=0, allow_inf_nan=False)]
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


def _optional_profile(value: Any, info: pydantic.ValidationInfo) -> Any:
    return None if value is None else _profile(value, info)


OptionalProfile: TypeAlias = Annotated[
    Any,
    BeforeValidator(_optional_profile),
    PlainSerializer(_plain),
    WithJsonSchema({"anyOf": [*PROFILE_SCHEMA, {"type": "null"}]}),
]
"""The same, or None for 'not given'."""


def _truth(value: Any) -> Any:
    if not isinstance(value, bool | np.bool_):
        raise ValueError("must be True or False")
    return bool(value)


def _progress(value: Any) -> Any:
    if isinstance(value, bool | np.bool_) or (callable(value) and not isinstance(value, type)):
        return value
    raise ValueError("must be True, False or a function")


def _names(value: Any) -> tuple[str, ...]:
    several = isinstance(value, list | tuple | set | frozenset)
    names = tuple(value) if several else (value,)
    if not all(isinstance(name, str) for name in names):
        raise ValueError("must be a name or a list of names")
    return names


def _path(value: Any) -> Path:
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else None
    if not isinstance(text, str) or not text or "\0" in text:
        raise ValueError("must be a path")
    try:
        text.encode()
    except UnicodeEncodeError:
        raise ValueError(
            "must be valid UTF-8, which NetCDF and JSON need; rename the file"
        ) from None
    if any(len(os.fsencode(part)) > 255 for part in Path(text).parts):
        raise ValueError("is too long a name for a file")
    return Path(text)


def _text(value: Any) -> str:
    if not isinstance(value, str):
        raise ValueError("must be text")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise ValueError("must be valid UTF-8, which TOML and NetCDF need") from None
    return value


def _numbers(value: Any) -> Array:
    try:
        return real_array(value)
    except (TypeError, OverflowError) as error:
        raise InputError(f"must be numbers; {error}") from None


Flag: TypeAlias = Annotated[bool, BeforeValidator(_truth)]
Progress: TypeAlias = Annotated[Show, WrapValidator(lambda value, _: _progress(value))]
"""True, False, or a function of (done, total)."""
Names: TypeAlias = Annotated[tuple[str, ...], BeforeValidator(_names)]
"""One name or several, as a tuple."""
Text: TypeAlias = Annotated[str, BeforeValidator(_text)]
FilePath: TypeAlias = Annotated[Path, BeforeValidator(_path)]
Numbers: TypeAlias = Annotated[Any, BeforeValidator(_numbers)]
"""Real numbers of any shape, as a float64 array."""
Seconds: TypeAlias = Annotated[float, BeforeValidator(_number), Field(gt=0, allow_inf_nan=False)]


def describe(value: Any) -> str:
    """Short form of what was given, for messages."""
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _article(name: str) -> str:
    return f"{'an' if name[0] in 'AEIO' else 'a'} {name}"


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


def _parameters(owner: Any) -> dict[str, Any]:
    """Names and annotations of the fields of a model, or of the arguments of a function."""
    if dataclasses.is_dataclass(owner):
        hints = typing.get_type_hints(owner, include_extras=True)
        return {key: hints[name] for key, name in keys_of(owner).items()}
    hints = typing.get_type_hints(_without_return(owner), include_extras=True)
    return {name: hints.get(name, Any) for name in inspect.signature(owner).parameters}


def _walk(owner: Any, location: tuple[int | str, ...]) -> tuple[list[str], list[str], list[Any]]:
    """Path as the user wrote it, the keys valid in its last-but-one step, models valid in the last.

    Pydantic numbers positional arguments and puts the chosen member of a union into the path.
    """
    path: list[str] = []
    owners: list[Any] = [owner]
    inside: list[Any] = []
    for step in location:
        members = {getattr(one, "type", None): one for one in owners}
        if len(owners) > 1 and step in members:
            owners = [members[step]]
            continue
        found: dict[str, Any] = {}
        for one in owners:
            found |= _parameters(one)
        if isinstance(step, int) and not path and step < len(found):
            step = list(found)[step]
        path.append(str(step))
        inside = _models_in(found.get(str(step)))
        if inside and step is not location[-1]:
            owners = inside
    names = dict.fromkeys(name for one in owners for name in _parameters(one))
    return path, list(names), inside


def explain(
    error: pydantic.ValidationError, owner: Any, root: str = "", prefix: tuple[str, ...] = ()
) -> list[str]:
    """List the mistakes that pydantic found, one text each, with the path to the key.

    Parameters
    ----------
    error : pydantic.ValidationError
    owner : class or function
        The model that was validated, or the function that was called.
    root : str
        What paths begin with.
    prefix : tuple of str
        Which part of the `owner` was validated, if not all of it.
    """
    texts = []
    items = error.errors()
    if any(item["type"] == "unexpected_positional_argument" for item in items):
        names = list(_parameters(owner))
        return [f"{owner.__name__}: give its arguments by name (valid: {', '.join(names)})"]
    for item in items:
        steps, valid, inside = _walk(owner, (*prefix, *item["loc"]))
        path = ".".join([root, *steps] if root else steps)
        kind, message, given = item["type"], item["msg"], item.get("input")
        message = message.removeprefix("Value error, ").removeprefix("Assertion failed, ")
        if kind in ("missing", "missing_argument"):
            texts.append(f"{path}: missing")
        elif kind in ("unexpected_keyword_argument", "extra_forbidden"):
            table, _, key = path.rpartition(".")
            texts.append(unknown_name(table or owner.__name__, key, valid))
        elif kind == "union_tag_invalid":
            tags = [tag.strip("' ") for tag in item["ctx"]["expected_tags"].split(",")]
            texts.append(unknown_name(f"{path}.type", str(item["ctx"]["tag"]), tags))
        elif kind == "union_tag_not_found":
            texts.append(f"{path}.type: missing, got {describe(given)}")
        elif kind == "value_error":
            nested = (item.get("ctx") or {}).get("error")
            if isinstance(nested, InputError):
                texts.extend(f"{path}: {text}" if path else text for text in nested.problems)
            else:
                texts.append(f"{path}: {message}, got {describe(given)}")
        elif kind == "is_instance_of":
            texts.append(f"{path}: must be {_article(item['ctx']['class'])}, got {describe(given)}")
        elif inside and kind in ("dataclass_type", "model_attributes_type"):
            expected = " or ".join(_article(one.__name__) for one in inside)
            texts.append(f"{path}: must be {expected}, got {describe(given)}")
        else:
            message = message.removeprefix("Input should be ")
            texts.append(f"{path}: must be {message}, got {describe(given)}")
    return texts


def _same(left: Any, right: Any) -> bool:
    if isinstance(left, np.ndarray) or isinstance(right, np.ndarray):
        return np.array_equal(left, right)
    if hasattr(left, "identical"):
        return type(left) is type(right) and bool(left.identical(right))
    return bool(left == right)


def _equal(self: Any, other: Any) -> bool:
    if type(self) is not type(other):
        return NotImplemented
    fields = dataclasses.fields(self)
    return all(_same(getattr(self, f.name), getattr(other, f.name)) for f in fields)


def _hashable(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return (value + 0.0).tobytes()  # zeros of both signs are equal, so they must hash alike
    if hasattr(value, "identical"):  # labelled arrays cannot be hashed
        return np.asarray(value).tobytes()
    if isinstance(value, dict):
        return tuple((key, _hashable(inner)) for key, inner in value.items())
    if isinstance(value, list):
        return tuple(map(_hashable, value))
    return value


def _hash(self: Any) -> int:
    return hash(tuple(_hashable(getattr(self, field.name)) for field in dataclasses.fields(self)))


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
    bare = cls.__repr__ in (object.__repr__, brief)  # its own, if it has one, stays
    wrapped: Any = pydantic_dataclass(frozen=True, eq=False, kw_only=kw_only, config=config)(cls)
    validated_init = wrapped.__init__

    @functools.wraps(validated_init)
    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        try:
            validated_init(self, *args, **kwargs)
        except pydantic.ValidationError as error:
            raise InputError(explain(error, wrapped, cls.__name__)) from None
        except TypeError as error:  # too many positional arguments, for example
            raise InputError(f"{cls.__name__}: {error}") from None

    # Validation inside another model must keep calling pydantic's own path, not this wrapper.
    init.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # pydantic's own marker
    wrapped.__init__ = init
    wrapped.__eq__ = _equal
    if bare:
        wrapped.__repr__ = brief
    wrapped.__hash__ = _hash
    return wrapped


Function = TypeVar("Function", bound=Callable[..., Any])


def checked(function: Function) -> Function:
    """Decorator of a public function: check its arguments by their annotations.

    A class in an annotation takes its own instances only, not the tables of a study file. All that
    is wrong comes as one `InputError`.
    """
    plain = _without_return(function)
    hints = typing.get_type_hints(plain, include_extras=True)
    plain.__annotations__ = {name: _instances(hint) for name, hint in hints.items()}
    validated = pydantic.validate_call(config=ConfigDict(arbitrary_types_allowed=True))(plain)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        try:
            return validated(*args, **kwargs)
        except pydantic.ValidationError as error:
            raise InputError(explain(error, function)) from None

    return typing.cast(Function, call)


def check(name: str, value: Any, annotation: Any) -> Any:
    """Return a value as an annotation has it, or raise an `InputError` that begins with `name`.

    For what `checked` does not see, such as entries of a mapping or options of a command.
    """
    try:
        return _adapter(annotation).validate_python(value)
    except pydantic.ValidationError as error:
        raise InputError(explain(error, check, name)) from None


@functools.lru_cache(maxsize=64)
def _adapter(annotation: Any) -> pydantic.TypeAdapter[Any]:
    of_class = isinstance(annotation, type)
    return pydantic.TypeAdapter(InstanceOf[annotation] if of_class else _instances(annotation))


def check_memory(name: str, needed: float, advice: str = "ask for fewer") -> None:
    """Raise an `InputError` if arrays need more memory (bytes) than this machine has."""
    try:
        there = float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # systems that do not say
        return
    if needed > there:
        raise InputError(
            f"{name}: this takes {needed / 2**30:,.1f} GiB of memory, more than the"
            f" {there / 2**30:,.1f} GiB of this machine; {advice}"
        )


def _without_return(function: Any) -> types.FunctionType:
    """The same function without an annotation of its result, which may name what is not loaded."""
    plain = types.FunctionType(
        function.__code__, function.__globals__, function.__name__, function.__defaults__,
        function.__closure__,
    )  # fmt: skip
    plain.__kwdefaults__ = function.__kwdefaults__
    names = function.__annotations__.items()
    plain.__annotations__ = {name: hint for name, hint in names if name != "return"}
    return plain


def _instances(annotation: Any) -> Any:
    """The annotation with model classes that take instances only."""
    if dataclasses.is_dataclass(annotation) and isinstance(annotation, type):
        return _instance_of((annotation,))
    if isinstance(annotation, types.UnionType) or typing.get_origin(annotation) is typing.Union:
        members = typing.get_args(annotation)
        classes: Any = tuple(one for one in members if dataclasses.is_dataclass(one))
        rest = tuple(one for one in members if one not in classes)
        if classes:
            return typing.Union[(_instance_of(classes), *rest)]
    return annotation


def _instance_of(classes: tuple[type, ...]) -> Any:
    def read(value: Any, _: Any) -> Any:
        if not isinstance(value, classes):
            raise ValueError("must be " + " or ".join(_article(one.__name__) for one in classes))
        return value

    return Annotated[Any, WrapValidator(read)]


_LONG = 6


def brief(self: Any) -> str:
    """Use as `__repr__` of a dataclass: its fields that are not at their default, shortened."""
    parts = []
    for field in dataclasses.fields(self):
        value = getattr(self, field.name)
        if field.repr and not _is_default(value, field.default):
            parts.append(f"{field.name}={_shown(value)}")
    return f"{type(self).__name__}({', '.join(parts)})"


def _is_default(value: Any, default: Any) -> bool:
    if isinstance(value, np.ndarray) or type(value) is not type(default):
        return False
    return bool(value == default)


def _shown(value: Any) -> str:
    if isinstance(value, np.ndarray):
        shape = " x ".join(str(size) for size in value.shape)
        if value.dtype.kind not in "fiub" or value.size == 0:
            return f"<{shape} array>"
        if value.dtype.kind == "b":
            return f"<{shape} array, {int(value.sum())} true>"
        return f"<{shape} array, {np.nanmin(value):.6g} to {np.nanmax(value):.6g}>"
    if isinstance(value, list | tuple) and len(value) > _LONG:
        return f"<{len(value)} values>"
    if isinstance(value, float):
        return f"{float(value)!r}"  # numpy's own says np.float64(...)
    return repr(value)


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
        reason = str(error).removeprefix("Error calling function ").split(": ", 1)[-1]
        raise InputError(f"{type(value).__name__}: cannot be written down: {reason}") from None
    except pydantic.errors.PydanticSchemaGenerationError:
        raise InputError(f"{type(value).__name__}: exists in Python only") from None


Mode: TypeAlias = Literal["II", "III"]
