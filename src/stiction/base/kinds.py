"""Kinds of methods, laws, marginals and spectra, distinguished by `type` in a study file."""

import dataclasses
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property, lru_cache
from importlib import import_module
from importlib.metadata import EntryPoint, entry_points
from typing import Any, TypeVar

import pydantic
from pydantic_core import CoreSchema, core_schema

from stiction.base.errors import InputError, unknown
from stiction.base.model import to_plain

T = TypeVar("T", bound=type)
_registered: dict[str, dict[str, Any]] = {}


def register(kind: T) -> T:
    """Class decorator: let study files name a class by its `type`.

    The class is a method, or derives from `FrictionLaw`, `Marginal` or
    `SpectralDensity`. Its `type` is a field such as ``type:
    Literal["band"] = "band"``. Files that name this type can be read
    when the module of the class is imported. No import is needed
    if the package has an entry point of the same name in the group
    ``stiction.methods``, ``.laws``, ``.marginals`` or ``.spectra``.

    >>> from typing import Literal
    >>> @register
    ... @dataclasses.dataclass
    ... class Uneven:
    ...     length: float = 2.5
    ...     type: Literal["uneven"] = "uneven"
    ...     family = "examples"
    >>> list(Kinds("examples")), Kinds("examples")["uneven"] is register(Uneven)
    (['uneven'], True)
    >>> class Other(Uneven):
    ...     pass
    >>> register(Other)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: Other: type 'uneven' is taken by <class ...Uneven'>. Rename it
    >>> Other.__abstractmethods__ = {"value", "slope"}
    >>> register(Other)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: Other: must define slope, value
    >>> register(int)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: <class 'int'>: needs a field such as type: Literal[...
    """
    name = getattr(getattr(kind, "__dataclass_fields__", {}).get("type"), "default", None)
    if not isinstance(name, str):
        raise InputError(f'{kind}: needs a field such as type: Literal["mine"] = "mine"')
    if missing := getattr(kind, "__abstractmethods__", ()):
        raise InputError(f"{kind.__name__}: must define {', '.join(sorted(missing))}")
    known = _registered.setdefault(getattr(kind, "family", "methods"), {})
    holder = known.setdefault(name, kind)
    if (holder.__module__, holder.__qualname__) != (kind.__module__, kind.__qualname__):
        raise InputError(f"{kind.__name__}: type {name!r} is taken by {holder}. Rename it")
    known[name] = kind
    return kind


class Kinds(Mapping[str, Any]):
    """The classes of a family, by `type`: in the package, registered, and from entry points.

    `places` ("module:name") lead to classes in the package. A class in
    the package, or of an entry point, is imported when a file names its
    type.

    Examples
    --------
    A class that is offered as an entry point is loaded when a file names it:

    >>> from types import SimpleNamespace
    >>> class Offered:
    ...     __dataclass_fields__ = {"type": SimpleNamespace(default="offered")}
    ...     family = "further examples"
    >>> _ = _registered.pop("further examples", None)
    >>> kinds = Kinds("further examples", {"error": "base.errors:InputError"})
    >>> point = SimpleNamespace(load=lambda: Offered, dist=SimpleNamespace(name="mypackage"))
    >>> kinds._offered = {"offered": [point], "twice": [point, point], "misnamed": [point]}
    >>> list(kinds), len(kinds), kinds["error"].__name__, kinds["offered"] is Offered
    (['error', 'offered', 'twice', 'misnamed'], 4, 'InputError', True)
    >>> list(kinds), [name in kinds for name in ("error", "offered", "twice", "other")]
    (['error', 'offered', 'twice', 'misnamed'], [True, True, True, False])
    """

    def __init__(self, family: str, places: Mapping[str, str] | None = None) -> None:
        self._group, self._places = f"stiction.{family}", places or {}
        self._registered = _registered.setdefault(family, {})

    @cached_property
    def _offered(self) -> dict[str, list[EntryPoint]]:
        points: dict[str, list[EntryPoint]] = {}
        for point in entry_points(group=self._group):
            points.setdefault(point.name, []).append(point)
        return points

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys((*self._places, *self._registered, *self._offered)))

    def __len__(self) -> int:
        return sum(1 for _ in self)

    def __getitem__(self, name: str) -> Any:
        if name in self._places:
            module, attribute = self._places[name].split(":")
            return getattr(import_module(f"stiction.{module}"), attribute)
        if name not in self._registered:
            self._load(name, self._offered[name])
        return self._registered[name]

    def __contains__(self, name: object) -> bool:
        return name in self._places or name in self._registered or name in self._offered

    def _load(self, name: str, points: Sequence[EntryPoint]) -> None:
        """Load a class from its entry point, or raise an `InputError` that names the package.

        >>> from types import SimpleNamespace
        >>> kinds = Kinds("laws/examples")
        >>> first, second = (SimpleNamespace(dist=SimpleNamespace(name=name)) for name in "ab")
        >>> kinds._load("power", [first, second])  # doctest: +ELLIPSIS
        Traceback (most recent call last):
            ...
        stiction...InputError: 'power' of the package a, b (...laws/examples)...Uninstall...
        >>> class Law:
        ...     __dataclass_fields__ = {"type": SimpleNamespace(default="root")}
        ...     family = "laws/examples"
        >>> point = SimpleNamespace(load=lambda: Law, dist=None)
        >>> kinds._load("power", [point])  # doctest: +ELLIPSIS
        Traceback (most recent call last):
            ...
        stiction.base.errors.InputError: 'power' of the package None ... another type
        """
        try:
            if len(points) > 1:
                raise ImportError("two packages offer this type. Uninstall one package")
            kind = register(points[0].load())
            if self._registered.get(name) is not kind:
                raise ImportError(f"{kind} is not of this family, or has another type")
        except Exception as error:  # of any kind: the code is another's
            packages = ", ".join(str(point.dist and point.dist.name) for point in points)
            text = f"{type(error).__name__}: {' '.join(str(error).split())}"
            raise InputError(
                f"{name!r} of the package {packages} (entry point of {self._group}) cannot be"
                f" used: {text}"
            ) from None


@dataclasses.dataclass(frozen=True, eq=False)
class OneOf:
    """Annotation for a field whose value belongs to a family of classes.

    `kinds` are the classes by `type`, and `default` is the type of a
    table without a `type`. `convert` maps a value to such an object. If
    it returns NotImplemented, a table goes to its class and any other
    value to the annotated type.

    Examples
    --------
    >>> from typing import Annotated, Literal
    >>> @register
    ... @dataclasses.dataclass
    ... class Band:
    ...     length: float = 2.5
    ...     type: Literal["band"] = "band"
    ...     family = "spectra of examples"
    >>> def convert(value):
    ...     if isinstance(value, str):
    ...         return Band(float(value[:-2]))
    ...     return [value] if isinstance(value, Band) else NotImplemented
    >>> _ = _registered["spectra of examples"].pop("wide", None)
    >>> one = OneOf(Kinds("spectra of examples"), lambda value: convert(value), "band")
    >>> field = pydantic.TypeAdapter(Annotated[int, one])
    >>> field.validate_python("7 m"), field.validate_python({"length": "7"})
    (Band(length=7.0, type='band'), [Band(length=7.0, type='band')])
    >>> field.validate_python(7.0), field.dump_python(Band(7.0)), field.dump_python(8)
    (7, {'length': 7.0, 'type': 'band'}, 8)
    >>> @dataclasses.dataclass
    ... class Wide(Band):
    ...     type: Literal["wide"] = "wide"
    >>> field.dump_python(Wide())  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    pydantic_core...: Wide is a class of your own that study files cannot name. Decorate it with...
    >>> field.validate_python({"type": register(Wide).type, "length": 3.5})
    [Wide(length=3.5, type='wide')]
    """

    kinds: Kinds
    convert: Callable[[Any], Any]
    default: str | None = None

    def __get_pydantic_core_schema__(self, source: Any, handler: Any) -> CoreSchema:
        def read(value: Any, inner: Any, info: Any) -> Any:
            converted = self.convert(value)
            if converted is not NotImplemented:
                return converted
            if not isinstance(value, Mapping):
                return inner(value)
            table = {"type": self.default, **value} if self.default else value
            return self.convert(from_table(self.kinds, table, info.context))

        schema = handler(source)
        plain = core_schema.wrap_serializer_function_ser_schema(self._written, schema=schema)
        return core_schema.with_info_wrap_validator_function(read, schema, serialization=plain)

    def _written(self, value: Any, handler: Any) -> Any:
        if not dataclasses.is_dataclass(value):
            return handler(value)
        plain = to_plain(value)
        if not hasattr(value, "plain") and self.kinds.get(plain.get("type")) is not type(value):
            raise ValueError(
                f"{type(value).__name__} is a class of your own that study files cannot name."
                " Decorate it with stiction.extensions.register"
            )
        return plain


def from_table(kinds: Kinds, given: Mapping[str, Any], context: Any = None) -> Any:
    """Make an object of the class that `type` names in a table, or raise an `InputError`.

    >>> from typing import Literal
    >>> @register
    ... @dataclasses.dataclass
    ... class Gap:
    ...     width: float
    ...     type: Literal["gap"] = "gap"
    ...     family = "examples of tables"
    >>> from_table(Kinds("examples of tables"), {"type": "gap", "width": 3})
    Gap(width=3.0, type='gap')
    >>> from_table(Kinds("examples of tables"), {"width": 3})
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: needs a type (valid: gap)
    >>> try:
    ...     from_table(Kinds("examples of tables"), {"type": "gapp"})
    ... except pydantic.ValidationError as error:
    ...     print(error.errors()[0]["loc"], error.errors()[0]["ctx"]["error"])
    ('type',) unknown 'gapp'; did you mean 'gap'? (valid: gap)
    """
    rest = dict(given)
    name = rest.pop("type", None)
    if name is None:
        raise InputError(f"needs a type (valid: {', '.join(kinds)})")
    if not isinstance(name, str) or name not in kinds:
        cause = {"error": InputError(unknown(str(name), kinds))}
        mistake: Any = {"type": "value_error", "loc": ("type",), "input": name, "ctx": cause}
        raise pydantic.ValidationError.from_exception_data("type", [mistake])
    return _adapter(kinds[name]).validate_python(rest, context=context)


@lru_cache(maxsize=64)
def _adapter(kind: Any) -> pydantic.TypeAdapter[Any]:
    return pydantic.TypeAdapter(kind)
