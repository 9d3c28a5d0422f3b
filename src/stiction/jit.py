"""The decorators for compiled kernels, and where compiled kernels are kept."""

from __future__ import annotations

import contextlib
import gc
import hashlib
import logging
import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import numba
import numpy as np
from numba.core import caching, event
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags

from stiction.files import cache_folder, private_folder

logger = logging.getLogger("stiction")

ZERO: Any = np.int64(0)
"""A zero that is not a literal: numba compiles a kernel again for each literal it is given."""

Kernel = TypeVar("Kernel", bound=Callable[..., Any])

_KEPT = numba.config.CACHE_DIR
_IMPORT = re.compile(rb"^\s*(?:from|import) (stiction[\w.]*)(?: import (\w+))?", re.MULTILINE)


@cache
def _kernel_sources() -> dict[str, bytes]:
    """Return the text of every file that may hold a part of a kernel, by module.

    Files that refuse input hold no part of a kernel, unless they hold one themselves: an edited
    message recompiles nothing.
    """
    package = Path(__file__).parent
    found = {}
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        if b"stiction.jit import" in text or b"InputError" not in text or path.stem == "jit":
            name = ".".join(path.relative_to(package.parent).with_suffix("").parts)
            found[name.removesuffix(".__init__")] = text
    return found


@cache
def _folder(module: str) -> Path:
    """Return the folder of the compiled kernels of a module.

    numba takes a compiled kernel for current as long as the kernel's own file is: it does not
    notice that a function or a constant of another file has changed. So every state of the files
    that a module imports, directly or not, has a folder of its own. Friction laws are resolved by
    type inside kernels and belong to every state.
    """
    texts = _kernel_sources()
    waiting = [name for name in texts if name == module or name.startswith("stiction.friction")]
    reached = set(waiting)
    while waiting:
        for source, member in _IMPORT.findall(texts[waiting.pop()]):
            names = {source.decode(), f"{source.decode()}.{member.decode()}"}
            new = (names & texts.keys()) - reached
            waiting += new
            reached |= new
    digest = hashlib.sha256(b"".join(texts[name] for name in sorted(reached))).hexdigest()[:16]
    return private_folder((Path(_KEPT) if _KEPT else cache_folder() / "compiled") / digest)


class _Locator(caching._CacheLocator):
    """The folder of a function's compiled forms.

    What tells it from others is the text of its file, not where the file lies or when it was
    written: another environment with the same package compiles nothing again.
    """

    def __init__(self, function: Any, file: str) -> None:
        self._path = _folder(function.__module__) / function.__module__
        self._stamp = hashlib.sha256(Path(file).read_bytes()).hexdigest()
        self._line = function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, function: Any, file: str) -> _Locator | None:
        try:
            found = cls(function, file)
            found.ensure_cache_path()
        except (OSError, TypeError):  # a folder that is read-only; a function of no module
            return None
        return found

    def get_cache_path(self) -> str:
        return str(self._path)

    def get_source_stamp(self) -> str:
        return self._stamp

    def get_disambiguator(self) -> str:
        return str(self._line)


class _Format(caching.CompileResultCacheImpl):
    _locator_classes: ClassVar = [_Locator]


class _Cache(caching.FunctionCache):
    """Keeps on disk only what is compiled for types of this package.

    A friction law from elsewhere is part of the kernels that are compiled for it. numba would not
    notice that the law was edited, and could not read its index where the law's module is missing.
    """

    _impl_class = _Format

    def load_overload(self, signature: Any, target: Any) -> Any:
        found = super().load_overload(signature, target) if _is_own(signature) else None
        if found is None:
            _announce(self._py_func.__module__.split(".")[1:2])
        return found

    def save_overload(self, signature: Any, data: Any) -> None:
        for env in data._find_referenced_environments():  # its own, and those of drafts
            data.library.codegen.set_env(env.env_name, env)
        if _is_own(signature):
            super().save_overload(signature, data)


class _Pause(event.Listener):
    """Pauses garbage collection during compilations, which are nested: 7 % of their time."""

    def __init__(self) -> None:
        self.depth, self.resumes = 0, False

    def on_start(self, event: event.Event) -> None:
        if not self.depth:
            self.resumes = gc.isenabled()
            gc.disable()
        self.depth += 1

    def on_end(self, event: event.Event) -> None:
        self.depth -= 1
        if not self.depth and self.resumes:
            gc.enable()


event.register("numba:compile", _Pause())
_announced: set[str] = set()


def _announce(part: list[str]) -> None:
    """State once for each part of the package that its kernels are being compiled."""
    for name in {*part} - _announced:
        _announced.add(name)
        logger.warning("compiling kernels: %s (on first use only, then cached)", name)


def _is_own(kind: Any) -> bool:
    """Whether a numba type, or a tuple of them, names no class from outside the package."""
    if isinstance(kind, tuple | list):
        return all(map(_is_own, kind))
    named = getattr(kind, "instance_class", None)
    if named is not None and not named.__module__.startswith("stiction."):
        return False
    return _is_own(getattr(kind, "types", ()))


class _Flags(Flags):
    """Options of a compilation, compared by those that were set: numba compares all of them."""

    def values(self) -> dict[str, Any]:
        given: dict[str, Any] = self._values
        return given


class _Library(JITCodeLibrary):
    """Code that LLVM optimises in one pass: numba's first one is there for reference counts."""

    def _optimize_final_module(self) -> None:
        manager, builder = self._codegen._module_pass_manager()
        manager.run(self._final_module, builder)


class _Draft(JITCodeLibrary):
    """Code that becomes machine code only as a part of the kernels that call it."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True

    @property
    def codegen(self) -> Any:
        """This draft, in place of the machine code in which numba looks for its environment."""
        return self

    def set_env(self, name: str, env: Any) -> None:
        """Leave the environment to the kernels that call this code."""

    def get_pointer_to_function(self, name: str) -> int:
        return 0

    def serialize_using_object_code(self) -> Any:
        return self.serialize_using_bitcode()


class _Compiler(Compiler):
    """numba's compiler with these options."""

    library: ClassVar = _Library

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.flags = _Flags(self.state.flags)

    def define_pipelines(self) -> Any:
        state = self.state
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().define_pipelines()


class _InsideCompiler(_Compiler):
    """A compiler of drafts."""

    library = _Draft


_OPTIONS: dict[str, Any] = {
    "nogil": True,
    "_nrt": False,
    "error_model": "numpy",
    "no_cfunc_wrapper": True,
    "pipeline_class": _Compiler,
}


def _compile(function: Kernel, options: dict[str, Any]) -> Kernel:
    """Compile on first call, cached on disk where that is possible."""
    compiled: Any = numba.njit(**options)(function)
    with contextlib.suppress(RuntimeError):  # numba finds no folder in which it may write
        compiled._cache = _Cache(function)
    result: Kernel = compiled
    return result


def jit(function: Kernel) -> Kernel:
    """Compile for one thread, without the interpreter lock.

    No ``parallel=True`` (forking after an OpenMP region aborts) and no fast-math: the same
    numbers must come out whatever the batch.
    """
    return _compile(function, _OPTIONS)


def jit_allocating(function: Kernel) -> Kernel:
    """Compile a kernel that makes arrays. Others count no references, and so compile faster."""
    return _compile(function, _OPTIONS | {"_nrt": True})


def jit_inside(function: Kernel) -> Kernel:
    """Compile what only other kernels call, in half the time: Python itself cannot call it."""
    inside = {"no_cpython_wrapper": True, "pipeline_class": _InsideCompiler}
    return _compile(function, _OPTIONS | inside)
