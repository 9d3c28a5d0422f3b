"""The decorators for compiled kernels."""

from __future__ import annotations

import contextlib
import hashlib
import logging
import math
import sys
import threading
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from types import FunctionType
from typing import Any, TypeVar

import numba
import numpy as np

from stiction.base.files import kernel_folder

internals: Any = None
with contextlib.suppress(Exception):  # it was deleted, or numba is not one that was tried
    import stiction.base.jit.internals as internals

logger = logging.getLogger("stiction")

ZERO: Any = np.int64(0)
"""Zero as a variable, because numba compiles a kernel again for each literal."""

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

_ANYWHERE: dict[str, Any] = {"nogil": True, "error_model": "numpy"}
_one_at_a_time = threading.Lock()
_announced: set[str] = set()


def _foreign_classes(kind: Any) -> set[Any]:
    """Return the classes from outside the package that are named in numba types.

    >>> from types import SimpleNamespace
    >>> class Law:
    ...     __module__ = "mylaws"
    >>> class Ours:
    ...     __module__ = "stiction.problem.friction.laws"
    >>> foreign, ours = (SimpleNamespace(instance_class=kind) for kind in (Law, Ours))
    >>> [name.__name__ for name in _foreign_classes((ours, [SimpleNamespace(types=[foreign])]))]
    ['Law']
    >>> _foreign_classes([ours, SimpleNamespace()])
    set()
    """
    kinds = kind if isinstance(kind, tuple | list) else getattr(kind, "types", ())
    classes: set[Any] = set().union(*map(_foreign_classes, kinds))
    named = getattr(kind, "instance_class", None)
    if named is not None and not named.__module__.startswith("stiction."):
        classes.add(named)
    return classes


def _parts(value: Any) -> Iterator[str]:
    """Yield the parts of a compiled function, and the functions and constants that it names.

    A TypeError says that the function names something else, which may
    change without being noticed.

    >>> list(_parts((3, ("a", None), 2.5, np))), list(_parts(math))
    (['3', "'a'", 'None', '2.5', 'numpy'], ['math'])
    >>> def law(limit):
    ...     return lambda slip, rate=0.125: math.exp(-slip) * limit + rate
    >>> parts = list(_parts(law(7)))
    >>> [parts.count(part) for part in ("exp", "math", "0.125", "7", "8")]  # math is a name, too
    [1, 2, 1, 1, 0]
    >>> list(_parts(numba.njit(law(7)))) == parts, list(_parts(law(8))) == parts
    (True, False)
    >>> list(_parts([3]))
    Traceback (most recent call last):
        ...
    TypeError: <class 'list'>
    """
    value = getattr(value, "py_func", value)
    if isinstance(value, tuple):
        yield from chain.from_iterable(map(_parts, value))
    elif isinstance(value, FunctionType):
        code = value.__code__
        named = (value.__globals__.get(name) for name in code.co_names)
        cells = (cell.cell_contents for cell in value.__closure__ or ())
        yield from (code.co_code.hex(), *code.co_names)
        yield from _parts((code.co_consts, value.__defaults__, *named, *cells))
    elif value is math or value is np:
        yield value.__name__
    elif isinstance(value, int | float | str | None):
        yield repr(value)
    else:
        raise TypeError(type(value))


def _state_of(classes: Iterable[Any]) -> str | None:
    """Return a digest of external friction laws, or None if the laws may change unnoticed.

    >>> class Law:
    ...     f = staticmethod(lambda slip: 2.0 * slip)
    >>> class Steep(Law):
    ...     f = staticmethod(lambda slip: 3.0 * slip)
    >>> states = [_state_of(laws) for laws in ([Law], [Steep], [Law, Steep])]
    >>> len({*states}), _state_of([Steep, Law]) == states[2], len(states[0])
    (3, True, 64)
    >>> Steep.f = staticmethod(lambda slip: [slip])
    >>> _state_of([Steep]) is None, _state_of([int]) is None  # int has no f
    (False, True)
    >>> Steep.__qualname__ = "f.<locals>.Steep"
    >>> _state_of([Law, Steep]) is None
    True
    """
    state = hashlib.sha256()
    for law in sorted(classes, key=str):
        try:
            parts = (law.__module__, law.__qualname__, *_parts(law.f))
        except (AttributeError, RecursionError, TypeError, ValueError):
            return None
        if "<locals>" in law.__qualname__:  # another process could not find it
            return None
        state.update("\n".join(parts).encode())
    return state.hexdigest()


class _Guard:
    """A cache that keeps code compiled for an external friction law, by the state of the law.

    An external law is part of the kernels that are compiled for the
    law. Numba would not notice that the law was edited, and could not
    read the index of its cache if the law's module is missing.

    Examples
    --------
    Compiled code for a law that may change unnoticed is not kept:

    >>> from types import SimpleNamespace
    >>> from unittest.mock import Mock, patch
    >>> cache = Mock(load_overload=Mock(return_value="compiled"))
    >>> guard = _Guard(cache, _compile)
    >>> guard._part, guard.load_overload((), "cpu"), guard.path is cache.path
    (['jit'], 'compiled', True)
    >>> class Law:
    ...     __module__ = "mylaws"
    >>> signature = (SimpleNamespace(instance_class=Law),)
    >>> with patch("stiction.base.jit.decorators._announce") as announce:
    ...     guard.load_overload(signature, "cpu"), guard.save_overload(signature, "data")
    ...     guard.save_overload((), "data")
    (None, None)
    >>> announce.call_args.args, cache.save_overload.call_args_list
    ((['jit'], False), [call((), 'data')])
    >>> Law.f = staticmethod(lambda slip: 2.0 * slip)
    >>> with patch("stiction.base.jit.decorators.internals") as kept:
    ...     kept.Cache.return_value.load_overload.return_value = "compiled for the law"
    ...     guard.load_overload(signature, "cpu"), guard.load_overload(signature, "cpu")
    ('compiled for the law', 'compiled for the law')
    >>> kept.Cache.call_count, kept.Cache.call_args.args == (_compile, _state_of([Law]))
    (1, True)
    """

    def __init__(self, cache: Any, function: Callable[..., Any]) -> None:
        self._cache, self._function = cache, function
        self._part = function.__module__.split(".")[-2:-1]
        self._of_laws: dict[str, Any] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._cache, name)

    def _cache_of(self, signature: Any) -> Any:
        """Return the cache for types of arguments, or None if compiled code must not be kept."""
        foreign = _foreign_classes(signature)
        if not foreign:
            return self._cache
        state = _state_of(foreign) if internals else None
        if state is None:
            return None
        if state not in self._of_laws:
            self._of_laws[state] = internals.Cache(self._function, state)
        return self._of_laws[state]

    def load_overload(self, signature: Any, target: Any) -> Any:
        """Return the compiled form for the given types of arguments, if it is stored."""
        cache = self._cache_of(signature)
        compiled = cache.load_overload(signature, target) if cache else None
        if compiled is None:
            _announce(self._part, cache is not None)
        return compiled

    def save_overload(self, signature: Any, data: Any) -> None:
        """Store a compiled form."""
        if cache := self._cache_of(signature):
            cache.save_overload(signature, data)


def _announce(part: list[str], kept: bool) -> None:
    """State once for each part of the package that its kernels are being compiled.

    >>> from unittest.mock import patch
    >>> with patch.object(logger, "log") as log:
    ...     for kept in (True, True, False):
    ...         _announce(["example"], kept)
    >>> texts = [call.args[2] for call in log.call_args_list]
    >>> texts
    ['example (on first use only, then cached)', 'example (for your friction law; not cached)']
    >>> _announced.difference_update(texts)
    """
    when = "on first use only, then cached" if kept else "for your friction law; not cached"
    for text in {f"{name} ({when})" for name in part} - _announced:
        _announced.add(text)
        # In a notebook the line would stay.
        level = logging.INFO if "ipykernel" in sys.modules else logging.WARNING
        logger.log(level, "compiling kernels: %s", text)


def _compile(function: Kernel, options: str) -> Kernel:
    """Compile at the first call. The result is cached on disk if possible."""
    if internals is None:
        return _plain(function)
    compiled: Any = numba.njit(**_ANYWHERE, **getattr(internals, options))(function)
    with contextlib.suppress(RuntimeError):  # numba finds no folder in which it may write
        compiled._cache = _Guard(internals.Cache(function), function)
    result: Kernel = compiled
    return result


def _plain(function: Any) -> Any:
    """Compile with the documented parts of numba, and with `_cache` if it exists."""
    with _one_at_a_time:
        kept = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(kernel_folder(function.__module__, "plain"))
        try:
            compiled = numba.njit(**_ANYWHERE, cache=True)(function)
            compiled._cache = _Guard(compiled._cache, function)
            return compiled
        except (RuntimeError, AttributeError, TypeError):  # no folder, or no such cache
            return numba.njit(**_ANYWHERE)(function)
        finally:
            numba.config.CACHE_DIR = kept


def jit(function: Kernel) -> Kernel:
    """Compile for a single thread, without the interpreter lock.

    ``parallel=True`` is not used, because forking after an OpenMP
    region aborts. Fast-math is not used either, because results must
    not depend on the batch.
    """
    return _compile(function, "OPTIONS")


def jit_allocating(function: Kernel) -> Kernel:
    """Compile a kernel that makes arrays."""
    return _compile(function, "ALLOCATING")


def jit_inside(function: Kernel) -> Kernel:
    """Compile a function for other kernels only, in less time. Python cannot call it."""
    return _compile(function, "INSIDE")
