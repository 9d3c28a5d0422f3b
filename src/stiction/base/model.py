"""Frozen, validated parameter objects, and public functions that check their arguments.

The same definition serves Python, TOML and JSON. An `InputError` lists
all mistakes at once.
"""

import dataclasses
import functools
import inspect
import math
import numbers
import operator
import os
import re
import types
import typing
from abc import ABCMeta
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Generic,
    Literal,
    Protocol,
    TypeAlias,
    TypeVar,
    dataclass_transform,
)

import numpy as np
import pydantic
import pydantic_core
from pydantic import BeforeValidator, ConfigDict, Field, InstanceOf, PlainSerializer
from pydantic.dataclasses import dataclass as pydantic_dataclass

from stiction.base.errors import InputError, nearest, unknown
from stiction.base.progress import Show
from stiction.base.representation import brief, equal, hash_of
from stiction.base.units import (
    as_numbers,
    is_quantity,
    magnitude_in_one_of,
    states_unit,
    units_of_argument,
)

T = TypeVar("T")
Function = TypeVar("Function", bound=Callable[..., Any])


# -- kinds of values -----------------------------------------------------------------------------

SI_NUMBER = "must be a number in SI units, such as 4e3, or a quantity of pint or astropy"
"""Advice for a text such as '4 km' in place of a number."""


def as_number(value: Any) -> float:
    """Return a number from any library as a float. Strings and Booleans are refused.

    >>> as_number(np.array(3)), as_number(np.float32(0.5)), as_number(7)
    (3.0, 0.5, 7.0)
    >>> for given in ("4 km", True, np.array([1.0]), 1j, 10**400):
    ...     try:
    ...         as_number(given)
    ...     except ValueError as error:
    ...         print(error)
    must be a number in SI units, such as 4e3, or a quantity of pint or astropy
    must be a number
    must be a number
    must be a number
    must be finite
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, str):
        raise ValueError(SI_NUMBER)
    if not isinstance(value, numbers.Real) or isinstance(value, bool):
        raise ValueError("must be a number")
    try:
        return float(value)
    except OverflowError:
        raise ValueError("must be finite") from None


def _real(value: Any, info: pydantic.ValidationInfo) -> float:
    """Return a number in SI. The name of the argument gives the unit for a quantity.

    >>> from types import SimpleNamespace
    >>> quantity = SimpleNamespace(magnitude=3, to=lambda text: {"m": 0.003, "": 5}[text])
    >>> _real(quantity, SimpleNamespace(field_name="length"))
    0.003
    >>> _real(quantity, SimpleNamespace(field_name=None)), in_si(7, "length")
    (5.0, 7)
    """
    return as_number(in_si(value, info.field_name or ""))


def in_si(value: Any, name: str) -> Any:
    """Return a quantity as a number in the argument's SI unit.

    Return other values unchanged.
    """
    return magnitude_in_one_of(value, units_of_argument(name))[0]


def as_count(value: Any) -> int:
    """Return a whole number from any library, such as 1e4, as an int.

    >>> as_count(1e4), as_count(np.int64(7)), as_count(np.float64(-3.0))
    (10000, 7, -3)
    >>> for given in (1.5, True, "3", np.inf, np.array(3)):
    ...     try:
    ...         as_count(given)
    ...     except ValueError as error:
    ...         print(error)
    must be a whole number
    must be a whole number
    must be a whole number
    must be a whole number
    must be a whole number
    """
    if isinstance(value, numbers.Integral) and not isinstance(value, bool):
        return int(value)
    if isinstance(value, bool | np.ndarray) or not is_finite(value) or value % 1:
        raise ValueError("must be a whole number")
    return int(value)


def is_whole(value: Any, least: int) -> bool:
    """Return whether a value is a whole number, such as 1e4, and not less than `least`.

    >>> is_whole(3e0, 3), is_whole(2, 3), is_whole(3.5, 1), is_whole("3", 1)
    (True, False, False, False)
    """
    with suppress(ValueError):
        return as_count(value) >= least
    return False


def is_finite(value: Any) -> bool:
    """Return whether a value is a finite number, and not a string or a Boolean.

    >>> [is_finite(value) for value in (3, np.float64(0.5), np.nan, -np.inf, "3", True, None)]
    [True, True, False, False, False, False, False]
    """
    with suppress(ValueError):
        return math.isfinite(as_number(value))
    return False


def is_unplaced(value: Any) -> bool:
    """Return whether a profile has coordinates or units, which its problem converts.

    >>> from types import SimpleNamespace
    >>> given = {"dims": "x"}, {"to_xarray": None}, {"to_value": None, "unit": "m"}, {"unit": "m"}
    >>> [is_unplaced(SimpleNamespace(**value)) for value in given]
    [True, True, True, False]
    """
    return is_quantity(value) or any(hasattr(value, name) for name in ("dims", "to_xarray"))


def _profile(value: Any, info: pydantic.ValidationInfo) -> Any:
    """Return a number, a read-only float64 array (*shape), or labelled values for the problem.

    A study file may also give a path, or a table {file, ...} with
    options of the reader.

    Examples
    --------
    >>> from types import SimpleNamespace
    >>> info = SimpleNamespace(context=None, field_name="strength")
    >>> given = np.array([3, 7])
    >>> array = _profile(given, info)
    >>> array.tolist(), array.flags.writeable, given.flags.writeable, _profile(np.array(5), info)
    ([3.0, 7.0], False, True, 5.0)
    >>> for value in ("4 cm", np.nan, [], [[[1.0]]], [1.0, np.nan], np.float64(np.inf), "a.csv"):
    ...     try:
    ...         _profile(value, info)
    ...     except ValueError as error:
    ...         print(error)
    must be a number in SI units, such as 4e3, or a quantity of pint or astropy
    must be finite
    must have shape (nodes,) or (nx, ny), got shape (0,)
    must have shape (nodes,) or (nx, ny), got shape (1, 1, 1)
    must be finite. Entry 1 is not
    must be finite
    must be numbers, got str. Read files by st.read_profile(path) or st.read_peaks(path)

    A study file may name a file:

    >>> info.context = {"read": lambda value, name: [len(name), len(value)]}
    >>> [_profile(value, info).tolist() for value in ("a.csv", {"file": "a.csv"})]
    [[8.0, 5.0], [8.0, 1.0]]
    """
    read = (info.context or {}).get("read")
    if isinstance(value, str) and states_unit(value):
        raise ValueError(SI_NUMBER)
    if isinstance(value, str | Path | dict) and read is not None:
        value = read(value, str(info.field_name))
    if is_unplaced(value):
        return value
    if isinstance(value, numbers.Real) or is_finite(value):
        if not is_finite(as_number(value)):
            raise ValueError("must be finite")
        return as_number(value)
    array = np.array(as_numbers(value))
    if array.ndim not in (1, 2) or array.size == 0:
        raise ValueError(f"must have shape (nodes,) or (nx, ny), got shape {array.shape}")
    if not np.all(np.isfinite(array)):
        raise ValueError(f"must be finite. Entry {int(np.argmin(np.isfinite(array)))} is not")
    array.flags.writeable = False
    return array


def _plain(value: Any) -> Any:
    """Return arrays as lists.

    >>> _plain(np.array([3.0, 7.0])), _plain("a.csv")
    ([3.0, 7.0], 'a.csv')
    """
    return value.tolist() if isinstance(value, np.ndarray) else value


def _flag(value: Any, words: str = "True or False") -> bool:
    """Return a Boolean of Python or numpy.

    >>> _flag(np.bool_(False)), _flag(True)
    (False, True)
    >>> _flag(1)
    Traceback (most recent call last):
        ...
    ValueError: must be True or False
    """
    if not isinstance(value, bool | np.bool_):
        raise ValueError(f"must be {words}")
    return bool(value)


def _show(value: Any) -> Any:
    """Return how progress is shown.

    >>> _show(False), _show(print) is print
    (False, True)
    >>> _show(int)
    Traceback (most recent call last):
        ...
    ValueError: must be True, False or a function of (done, total)
    """
    if callable(value) and not isinstance(value, type):
        return value
    return _flag(value, "True, False or a function of (done, total)")


def _names(value: Any) -> tuple[str, ...]:
    """Return a name, or several, as a tuple.

    >>> _names("slip"), _names(["slip", "load"]), _names({"load"}), _names(())
    (('slip',), ('slip', 'load'), ('load',), ())
    >>> _names(["slip", 3])
    Traceback (most recent call last):
        ...
    ValueError: must be a name or a list of names
    """
    names = tuple(value) if isinstance(value, list | tuple | set | frozenset) else (value,)
    if not all(isinstance(name, str) for name in names):
        raise ValueError("must be a name or a list of names")
    return names


def _path(value: Any) -> Path:
    r"""Return a path with usable names.

    >>> _path("a" * 255) == Path("a" * 255), _path(Path("runs") / "a").name
    (True, 'a')
    >>> for given in ("a" * 256, "", 3, b"a", "C:\temp"):
    ...     try:
    ...         _path(given)
    ...     except ValueError as error:
    ...         print(str(error)[:42])
    must be a path in UTF-8 with names of at m
    must be a path in UTF-8 with names of at m
    must be a path in UTF-8 with names of at m
    must be a path in UTF-8 with names of at m
    must be a path without tabs and line break
    """
    text = os.fspath(value) if isinstance(value, str | os.PathLike) else ""
    usable = isinstance(text, str) and text != ""
    if usable and not text.isprintable():
        raise ValueError(
            "must be a path without tabs and line breaks (\\t and \\n in double quotes). Write /"
            " for \\, or put the path in single quotes"
        )
    if not usable or max(map(len, Path(text).parts), default=0) > 255:
        raise ValueError("must be a path in UTF-8 with names of at most 255 letters")
    return Path(text)


Number: TypeAlias = Annotated[int, Field(ge=0), BeforeValidator(as_count)]
"""A whole number, such as 1e4, that is not negative."""
Count: TypeAlias = Annotated[Number, Field(ge=1)]
Real: TypeAlias = Annotated[float, BeforeValidator(_real), Field(allow_inf_nan=False)]
Positive: TypeAlias = Annotated[Real, Field(gt=0)]
NotNegative: TypeAlias = Annotated[Real, Field(ge=0)]
RealArray: TypeAlias = Annotated[Any, BeforeValidator(as_numbers), "array"]
"""Real numbers of any shape, as a float64 array."""
Held = TypeVar("Held", covariant=True)
Given = TypeVar("Given", contravariant=True)


class Converted(Generic[Held, Given]):
    """Annotation for a field of a model whose stored type differs from the given type.

    Type checkers treat the annotation as a descriptor. At runtime only
    the stored type, with its validators, remains.
    """

    if TYPE_CHECKING:

        def __get__(self, owner: Any, kind: Any = None) -> Held: ...
        def __set__(self, owner: Any, value: Given) -> None: ...
    else:

        def __class_getitem__(cls, types: tuple[Any, Any]) -> Any:
            return types[0]


class Labelled(Protocol):
    """An array from any library, with or without labels and a unit."""

    @property
    def shape(self) -> Any: ...


AnyNumbers: TypeAlias = float | Labelled | Sequence[float] | Sequence[Sequence[float]]
PlacedProfile: TypeAlias = Annotated[
    Any, BeforeValidator(_profile), PlainSerializer(_plain), "float | array"
]
Profile: TypeAlias = Converted[PlacedProfile, AnyNumbers]
OptionalProfile: TypeAlias = Converted[PlacedProfile | None, AnyNumbers | None]
"""A number, a read-only array of shape (nodes,), or None for 'not given'."""
Names: TypeAlias = Annotated[Sequence[str], BeforeValidator(_names), "tuple"]
"""A name or several, as a tuple."""
HeldPath: TypeAlias = Annotated[Path, BeforeValidator(_path)]
FilePath: TypeAlias = Annotated[str | Path, BeforeValidator(_path), "Path"]
"""A path, which the function or model receives as a `Path`."""
Flag: TypeAlias = Annotated[bool, BeforeValidator(_flag)]
Progress: TypeAlias = Annotated[Show, BeforeValidator(_show), "bool | Callable"]
"""True, False, or a function of (done, total)."""
Text: TypeAlias = Annotated[str, Field(strict=True, min_length=0)]
"""Text in valid UTF-8. Pydantic checks the encoding only if the length
is limited."""
Mode: TypeAlias = Literal["II", "III"]


# -- mistakes ------------------------------------------------------------------------------------


def describe(value: Any) -> str:
    """Return a short form of a given value, for messages.

    >>> describe(np.zeros((3, 2))), describe([3, "a"])
    ('an array of shape (3, 2)', "[3, 'a']")
    >>> describe("a" * 58) == repr("a" * 58), describe("a" * 59) == "'" + "a" * 56 + "..."
    (True, True)
    """
    if isinstance(value, np.ndarray):
        return f"an array of shape {value.shape}"
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def keys_of(cls: Any) -> list[str]:
    """Return the keys for a model in a study file, which are the names of its fields.

    >>> @dataclasses.dataclass
    ... class Line:
    ...     instead_of_fields = ("span",)
    ...     length: float
    ...     nodes: int = 3
    ...     area: float = dataclasses.field(init=False)
    >>> keys_of(Line), valid_keys(Line), valid_keys(Line(2.0))
    (['length', 'nodes'], ['length', 'nodes', 'span'], ['length', 'nodes', 'span'])
    """
    return [field.name for field in dataclasses.fields(cls) if field.init]


def valid_keys(cls: Any) -> list[str]:
    """Return all keys that a model accepts, including `instead_of_fields`."""
    return [*keys_of(cls), *getattr(cls, "instead_of_fields", ())]


MAX_MISTAKES = 100
"""Number of mistakes in a call or a file that are explained at most."""


def explain(
    error: pydantic.ValidationError, given: Any, root: str = "", otherwise: str = ""
) -> list[str]:
    """Return a message for each mistake that pydantic found in a given value.

    The path in a message begins with `root`. `otherwise` replaces
    an empty path. A union has an item for each of its members.
    The texts of the members are joined by 'or'.

    >>> def mistakes(given, annotation, **options):
    ...     try:
    ...         pydantic.TypeAdapter(annotation).validate_python(given)
    ...     except pydantic.ValidationError as error:
    ...         return explain(error, given, **options)
    >>> mistakes({"a": [3, 0.5]}, dict[str, list[Count]], root="nodes")
    ['nodes.a.1: must be a whole number, got 0.5']
    >>> mistakes("c", int | Literal["a", "b"], otherwise="nodes")  # doctest: +ELLIPSIS
    ["nodes: must be a valid integer, ... or 'a' or 'b', got 'c'"]
    >>> @dataclasses.dataclass
    ... class Pair:
    ...     a: int
    ...     b: InstanceOf[str]
    >>> mistakes({"b": 5}, Pair)
    ['a: missing', 'b: must be a str, got 5']
    >>> mistakes(-3e-7, Annotated[float, Field(ge=0.00005)])
    ['must be greater than or equal to 5e-05, got -3e-07']
    >>> shown = mistakes([-1] * 103, list[Count])
    >>> len(mistakes([-1] * 100, list[Count])), len(shown), shown[-2:]
    (100, 101, ['99: must be greater than or equal to 0, got -1', 'and 3 more'])
    """
    members: dict[tuple[str, str], dict[str, None]] = {}
    items = error.errors(include_url=False)
    for item in items[:MAX_MISTAKES]:
        context, missing = item.get("ctx", {}), item["type"].startswith("missing")
        steps = filter(None, (root, *_steps_into(given, item["loc"], missing)))
        begin = f"{'.'.join(steps) or otherwise}: ".removeprefix(": ")
        cause, got = context.get("error"), f", got {describe(item['input'])}"
        if isinstance(cause, InputError):
            members |= {(begin + text, ""): {} for text in cause.problems}
        elif missing:
            members[begin + "missing", ""] = {}
        elif cause is not None:
            members[begin + str(cause), got] = {}
        else:
            name = str(context.get("class_name") or context.get("class") or "")
            text = item["msg"].removeprefix("Input should be ")
            text = re.sub(r"0\.0000\d+", lambda digits: f"{float(digits[0]):g}", text)
            text = f"{'an' if name[0] in 'AEIO' else 'a'} {name}" if name else text
            members.setdefault((begin + "must be ", got), {})[text] = None
    texts = [text + " or ".join(names) + got for (text, got), names in members.items()]
    return [*texts, *[f"and {len(items) - MAX_MISTAKES} more"] * (len(items) > MAX_MISTAKES)]


def _steps_into(given: Any, steps: Sequence[int | str], missing: bool) -> Iterator[str]:
    """Yield the steps that lead into a value, without pydantic's steps into members of unions.

    >>> given = {"a": [3, {"b": np.array([5])}]}
    >>> list(_steps_into(given, ("a", "list[int]", 1, "b", 0), False))
    ['a', '1', 'b', '0']
    >>> [list(_steps_into(given, ("a", 1, "c"), missing)) for missing in (True, False)]
    [['a', '1', 'c'], ['a', '1']]
    >>> list(_steps_into(given, ("tag", "a", 2), True))
    ['a', '2']
    """
    for step in steps:
        given = given.tolist() if isinstance(given, np.ndarray) else given
        keys = range(len(given)) if isinstance(given, list | tuple) else given
        if isinstance(keys, Mapping | range) and step in keys:
            given = given[step]
        elif not missing or step != steps[-1]:
            continue
        yield str(step)


def named(error: pydantic.ValidationError, valid: Sequence[str]) -> pydantic.ValidationError:
    """Return pydantic's error about a model or a call with the valid names.

    A missing name is not reported if a given name is a misspelling of it.

    >>> @model
    ... class Line:
    ...     length: Positive
    ...     nodes: Count
    >>> Line(lenqth=2)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: Line.nodes: missing
    Line: unknown 'lenqth'; did you mean 'length'? (valid: length, nodes)
    """
    mistakes: list[Any] = error.errors(include_url=False)
    misspelt = set()
    for mistake in mistakes:
        if mistake["type"] == "unexpected_keyword_argument":
            *path, name = mistake["loc"]
            text = f"unknown {name!r}" if path else unknown(name, valid)
            if not path:  # otherwise it belongs to a dataclass that is no model
                misspelt.add((nearest(name, valid),))
            cause = {"error": InputError(text)}
            mistake |= {"type": "value_error", "loc": tuple(path), "ctx": cause}
    kept = [
        mistake
        for mistake in mistakes
        if not mistake["type"].startswith("missing") or mistake["loc"] not in misspelt
    ]
    return pydantic.ValidationError.from_exception_data(error.title, kept)


class Door:
    """A public call or constructor, where an `InputError` lists all mistakes in the arguments.

    Examples
    --------
    >>> door = Door("solve", inspect.signature(lambda x, *, y=5: None))
    >>> door.names, door.by_place
    (['x', 'y'], ['x'])
    >>> door.call(dict, (3,), {"y": 7})
    {'x': 3, 'y': 7}
    >>> for args, kwargs in (((3, 7), {}), ((3,), {"x": 7})):
    ...     try:
    ...         door.call(dict, args, kwargs)
    ...     except InputError as error:
    ...         print(error)
    solve: give the arguments by name (valid: x, y)
    solve: give the arguments by name (valid: x, y)
    >>> method = Door("solve", inspect.signature(lambda self, x: None))
    >>> method.names, method.call(lambda *args, **given: (args, given), ("object", 3), {})
    (['x'], (('object',), {'x': 3}))
    """

    def __init__(self, owner: str, signature: inspect.Signature, root: str = "") -> None:
        parameters = signature.parameters.values()
        self.owner, self.root = owner, root
        self.names = [parameter.name for parameter in parameters if parameter.name != "self"]
        self.by_place = [
            parameter.name
            for parameter in parameters
            if parameter.kind is not parameter.KEYWORD_ONLY
        ]

    def call(self, validated: Callable[..., Any], args: Any, kwargs: dict[str, Any]) -> Any:
        """Call a function that pydantic validates, with all arguments by name."""
        given = dict(zip(self.by_place, args, strict=False)) | kwargs
        if len(given) < len(args) + len(kwargs):  # too many by place, or a name given twice
            raise InputError(
                f"{self.owner}: give the arguments by name (valid: {', '.join(self.names)})"
            )
        by_place = (given.pop("self"),) if "self" in given else ()  # pydantic 2.11 needs it so
        try:
            return validated(*by_place, **given)
        except pydantic.ValidationError as error:
            error = named(error, self.names)
            raise InputError(explain(error, given, self.root, self.owner)) from None


# -- objects and functions -----------------------------------------------------------------------


def _named_keys(cls: Any, given: Any, handler: Callable[[Any], Any]) -> Any:
    """Validate a model, and name its keys in messages. Only its class knows the keys."""
    try:
        return handler(given)
    except pydantic.ValidationError as error:
        raise named(error, valid_keys(cls)) from None


class _Listing(ABCMeta):
    """Type of `Listed`.

    Examples
    --------
    >>> @dataclasses.dataclass
    ... class Base(Listed):
    ...     length: float = 2.0
    ...     _shown = ("run",)
    ...     def run(self): ...
    ...     def prepare(self): ...
    >>> @dataclasses.dataclass
    ... class Study(Base):
    ...     samples: int = 3
    ...     def sweep(self): ...
    >>> dir(Base), dir(Study)
    (['run'], ['run', 'sweep'])
    """

    def __dir__(cls) -> list[str]:
        """Return the public names without internal members and without fields.

        The signature shows the fields.
        """
        hidden = {*getattr(cls, "__dataclass_fields__", ())}
        for kind in cls.__mro__:
            if "_shown" in vars(kind):
                hidden |= {*vars(kind)} - {*vars(kind)["_shown"]}
        return [name for name in super().__dir__() if name not in hidden and name[0] != "_"]


class Listed(metaclass=_Listing):
    """Base of models whose `dir` and `help` show only the members that users need.

    `_shown` names the members of a class that users need, by default all.
    Other members serve other parts of the package.
    """

    _shown: ClassVar[tuple[str, ...]]

    """Examples
    --------
    >>> @model(kw_only=True)
    ... class Line:
    ...     length: Positive
    ...     heights: RealArray = ()
    >>> line = Line(length=2, heights=[3, 5])
    >>> line, line == Line(length=2.0, heights=(3.0, 5.0)), line == Line(length=2)
    (Line(length=2.0, heights=[3.0, 5.0]), True, False)
    >>> print(inspect.signature(Line))
    (*, length: float, heights: array = ()) -> None
    >>> Line(length=-2, heights="a")
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: Line.length: must be greater than 0, got -2
    Line.heights: must be numbers, got str
    >>> Line(2.0)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: Line: give the arguments by name (valid: length, heights)
    >>> line.length = 3.0
    Traceback (most recent call last):
        ...
    dataclasses.FrozenInstanceError: cannot assign to field 'length'
    """


@typing.overload
def model(cls: type[T]) -> type[T]: ...
@typing.overload
def model(*, kw_only: bool = ...) -> Callable[[type[T]], type[T]]: ...
@dataclass_transform(frozen_default=True, field_specifiers=(dataclasses.field, Field))
def model(cls: Any = None, *, kw_only: bool = False) -> Any:
    """Class decorator: a frozen pydantic dataclass that reports invalid values as `InputError`.

    Objects, including arrays, are compared and hashed by value.
    Consistency checks go into a method decorated with
    ``pydantic.model_validator(mode="after")`` that raises `InputError`.
    """
    if cls is None:
        return functools.partial(model, kw_only=kw_only)
    named_keys: Any = classmethod(_named_keys)
    # A subclass replaces the validator of its base class.
    cls._named_keys = pydantic.model_validator(mode="wrap")(named_keys)
    config = ConfigDict(extra="forbid", arbitrary_types_allowed=True, validate_by_name=True)
    decorate = pydantic_dataclass(
        frozen=True, eq=False, repr=False, kw_only=kw_only, config=config
    )
    wrapped: Any = decorate(cls)
    validated_init = wrapped.__init__

    @functools.wraps(validated_init)
    def init(self: Any, *args: Any, **kwargs: Any) -> None:
        door.call(functools.partial(validated_init, self), args, kwargs)

    # Validation inside another model must keep calling pydantic's own
    # path, not this wrapper.
    init.__pydantic_base_init__ = True  # type: ignore[attr-defined]  # pydantic's own marker
    wrapped.__init__, wrapped.__repr__ = init, brief
    wrapped.__eq__, wrapped.__hash__ = equal, hash_of
    hints = typing.get_type_hints(cls, include_extras=True)
    keys = {name: hints[name] for name in keys_of(wrapped)}
    wrapped.__signature__ = plain_signature(wrapped, keys)
    door = Door(cls.__name__, wrapped.__signature__, cls.__name__)
    door.names = valid_keys(wrapped)
    return wrapped


def to_plain(value: Any) -> Any:
    """Return the object as plain dictionaries, lists and numbers for TOML and JSON.

    Raises an `InputError` for parts that
    exist only in Python, such as a function.

    >>> @model
    ... class Law:
    ...     rates: PlacedProfile
    ...     slope: Any = None
    >>> to_plain(Law([3, 5])), to_plain(Law(2, "x"))
    ({'rates': [3.0, 5.0]}, {'rates': 2.0, 'slope': 'x'})
    >>> from types import SimpleNamespace
    >>> to_plain(SimpleNamespace(plain=lambda: 7))
    7
    >>> to_plain(Law(2, abs))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: Law: cannot be written down: Unable to serialize ...
    >>> to_plain(SimpleNamespace())
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: SimpleNamespace: exists only in Python
    """
    if hasattr(value, "plain"):
        return value.plain()
    try:
        return pydantic.TypeAdapter(type(value)).dump_python(
            value, mode="json", exclude_none=True
        )
    except pydantic_core.PydanticSerializationError as error:
        words = "cannot be written down: "  # the innermost reason, without names of exceptions
        reason = str(error).rsplit(words, 1)[-1].rsplit("Error: ", 1)[-1]
        raise InputError(f"{type(value).__name__}: {words}{reason}") from None
    except pydantic.errors.PydanticSchemaGenerationError:
        raise InputError(f"{type(value).__name__}: exists only in Python") from None


def checked(function: Function) -> Function:
    """Decorator for a public function: check its arguments against their annotations.

    A class in an annotation accepts only instances, not tables of a
    study file. An `InputError` lists all mistakes.

    >>> @checked
    ... def scaled(values: Sequence[float], *, factor: Positive = 2.0) -> float:
    ...     return [factor * value for value in values]
    >>> scaled([3, 5], factor=7), scaled([3.0])
    ([21.0, 35.0], [6.0])
    >>> print(inspect.signature(scaled))
    (values: Sequence, *, factor: float = 2.0) -> float
    >>> scaled([3], factor=-1, facto=3)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: factor: must be greater than 0, got -1
    scaled: unknown 'facto'; did you mean 'factor'? (valid: values, factor)
    """
    written = function.__annotations__
    function.__annotations__ = {
        name: hint for name, hint in written.items() if name != "return"
    }
    hints = typing.get_type_hints(function, include_extras=True)
    function.__annotations__ = {name: _instances(hint) for name, hint in hints.items()}
    validated = pydantic.validate_call(config=ConfigDict(arbitrary_types_allowed=True))(
        function
    )
    function.__annotations__ = written
    signature = plain_signature(function, hints)
    door = Door(function.__name__, signature)

    @functools.wraps(function)
    def call(*args: Any, **kwargs: Any) -> Any:
        return door.call(validated, args, kwargs)

    typing.cast(Any, call).__signature__ = signature
    return typing.cast(Function, call)


class _Plain(str):
    """Annotation that is shown as a name without quotation marks."""

    __repr__ = str.__str__


def plain_name(hint: Any) -> str:
    """Return an annotation in plain words: the text among its metadata, or else the type.

    >>> [plain_name(hint) for hint in (Positive, Names, FilePath, Mode, Progress, Count | None)]
    ['float', 'tuple', 'Path', 'str', 'bool | Callable', 'int']
    >>> hints = list[int], float | Real | str, Literal[3, "a", 4], "st.Study"
    >>> [plain_name(hint) for hint in hints]
    ['list', 'float | str', 'int | str', 'Study']
    """
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    metadata = getattr(hint, "__metadata__", ())
    if metadata:
        names = [entry for entry in metadata if isinstance(entry, str)]
        return names[-1] if names else plain_name(arguments[0])
    if origin is Literal:
        return " | ".join(dict.fromkeys(type(value).__name__ for value in arguments))
    if origin in (typing.Union, types.UnionType):
        named = [plain_name(kind) for kind in arguments if kind is not type(None)]
        return " | ".join(dict.fromkeys(named))
    return str(getattr(origin or hint, "__name__", None) or hint).rpartition(".")[2]


def plain_signature(owner: Any, hints: Mapping[str, Any]) -> inspect.Signature:
    """Return the signature of a function or class with plain annotations.

    The default shows whether an argument may be left out.

    >>> def solve(self, x, y: Positive | None = 7.5) -> Mode: ...
    >>> print(plain_signature(solve, {"y": Positive | None}))
    (self, x, y: float = 7.5) -> str
    """
    signature = inspect.signature(owner)
    parameters = [
        parameter.replace(annotation=_Plain(plain_name(hints[name])))
        if name in hints
        else parameter  # self
        for name, parameter in signature.parameters.items()
    ]
    returned = _Plain(plain_name(signature.return_annotation))
    return signature.replace(parameters=parameters, return_annotation=returned)


def _instances(hint: Any) -> Any:
    """Return the annotation with model classes that accept only instances.

    >>> @dataclasses.dataclass
    ... class Line:
    ...     length: float
    >>> [check("line", given, Line | None | float) for given in (Line(2.0), None, 3)]
    [Line(length=2.0), None, 3.0]
    >>> check("line", {"length": 2.0}, Line | None)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: line: must be a Line, got {'length': 2.0}
    """
    if isinstance(hint, types.UnionType) or typing.get_origin(hint) is typing.Union:
        return functools.reduce(operator.or_, map(_instances, typing.get_args(hint)))
    is_model = dataclasses.is_dataclass(hint)
    return Annotated[hint, InstanceOf()] if is_model else hint  # type: ignore[type-arg]


def check(name: str, value: Any, annotation: Any) -> Any:
    """Validate a value by an annotation, or raise an `InputError` that begins with `name`.

    Use this for values that `checked` does
    not see, such as entries of a mapping.

    >>> check("nodes", 3.0, Count), check("names", "slip", Names)
    (3, ('slip',))
    >>> check("title", 3, str)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: title: must be a str, got 3
    >>> check("axes", {"a": [3, 0.5]}, dict[str, list[Count]])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: axes.a.1: must be a whole number, got 0.5
    """
    try:
        return _adapter(annotation).validate_python(value)
    except pydantic.ValidationError as error:
        raise InputError(explain(error, value, name)) from None


@functools.lru_cache(maxsize=64)
def _adapter(annotation: Any) -> pydantic.TypeAdapter[Any]:
    if isinstance(annotation, type):  # no table of a study file
        return pydantic.TypeAdapter(Annotated[annotation, InstanceOf()])
    return pydantic.TypeAdapter(_instances(annotation))


def check_memory(name: str, needed: float, advice: str = "Take fewer") -> None:
    """Raise an `InputError` if arrays need more memory (bytes) than this machine has.

    >>> from unittest.mock import patch
    >>> pages = {"SC_PHYS_PAGES": 3 * 2**17, "SC_PAGE_SIZE": 2**12}  # 1.5 GiB
    >>> with patch("os.sysconf", pages.__getitem__, create=True):
    ...     check_memory("nodes", 1.5 * 2**30)
    ...     check_memory("nodes", 2000 * 2**30)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction...: nodes: would take 2,000.0 GiB of memory, more than the 1.5 GiB ... Take fewer
    >>> with patch("os.sysconf", side_effect=ValueError, create=True):
    ...     check_memory("nodes", 2000 * 2**30)
    """
    try:
        there = float(os.sysconf("SC_PHYS_PAGES")) * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # unknown on this system
        return
    if needed > there:
        raise InputError(
            f"{name}: would take {needed / 2**30:,.1f} GiB of memory, more than the"
            f" {there / 2**30:,.1f} GiB of this machine. {advice}"
        )
