"""Compile kernels in two thirds of the time by using numba's private parts.

1. Compiled forms are kept on disk by the text of their file, not by its
   place and time (`_Locator`).
2. A function that only other kernels call is a draft (`_Draft`). A
   draft is stored, but becomes machine code only as a part of the
   kernels that call it. These kernels also take over its environment
   (`Cache.save_overload`).
3. Options are compared by those that were set (`_Flags`).
4. Kernels that make no arrays count no references (`OPTIONS`).

This file may be deleted. Without it, or with a numba newer than
`NEWEST`, `decorators.py` compiles the same kernels to the same bits
with plain `numba.njit`.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, ClassVar

import numba
from numba.core.caching import (
    CompileResultCacheImpl,
    FunctionCache,
    IndexDataCacheFile,
    _CacheLocator,
)
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags

from stiction.base.files import kernel_folder

NEWEST = (0, 68)
"""The newest numba with which the tests ran."""
if numba.version_info.short > NEWEST:
    raise ImportError(f"numba {numba.__version__} was not tested")


class _Locator(_CacheLocator):
    """The folder for a function's compiled forms, named by a digest of the source text.

    Another environment with the same package
    therefore compiles nothing again.

    Examples
    --------
    >>> def kernel():
    ...     return 0.0
    >>> locator = _Locator.from_function(kernel, __file__)
    >>> locator.get_source_stamp() == hashlib.sha256(Path(__file__).read_bytes()).hexdigest()
    True
    >>> locator.get_disambiguator(), Path(locator.get_cache_path()).name
    ('1', 'stiction.base.jit.internals')
    >>> _Locator.from_function(kernel, "no such file") is None
    True
    """

    def __init__(self, function: Any, file: str) -> None:
        self._path = kernel_folder(function.__module__, "own")
        self._stamp = hashlib.sha256(Path(file).read_bytes()).hexdigest()
        self._line = function.__code__.co_firstlineno

    @classmethod
    def from_function(cls, function: Any, file: str) -> _Locator | None:
        try:
            locator = cls(function, file)
            locator.ensure_cache_path()
        except (OSError, TypeError):  # a folder that is read-only; a function of no module
            return None
        return locator

    def get_cache_path(self) -> str:
        return str(self._path)

    def get_source_stamp(self) -> str:
        return self._stamp

    def get_disambiguator(self) -> str:
        return str(self._line)


class _Format(CompileResultCacheImpl):
    _locator_classes: ClassVar = [_Locator]


class Cache(FunctionCache):
    """Compiled forms of a function on disk, with the environments of the drafts it calls.

    Forms for a user's friction law have a folder for each state of that
    law.
    """

    _impl_class = _Format

    def __init__(self, function: Any, law: str = "") -> None:
        super().__init__(function)
        if law:
            self._cache_path = str(kernel_folder(function.__module__, f"own {law}"))
            stamp = self._impl.locator.get_source_stamp()
            base = self._impl.filename_base
            self._cache_file = IndexDataCacheFile(self._cache_path, base, stamp)

    def save_overload(self, signature: Any, data: Any) -> None:
        for env in data._find_referenced_environments():
            data.library.codegen.set_env(env.env_name, env)
        super().save_overload(signature, data)


class _Flags(Flags):
    """Options of a compilation.

    Only options that were set are compared, but numba compares all.

    Examples
    --------
    >>> _Flags().values(), "nrt" in Flags().values()
    ({}, True)
    >>> flags = _Flags()
    >>> flags.nrt = True
    >>> flags.values()
    {'nrt': True}
    """

    def values(self) -> dict[str, Any]:
        given: dict[str, Any] = self._values
        return given


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

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.state.flags = _Flags(self.state.flags)


class _InsideCompiler(_Compiler):
    """A compiler of drafts."""

    def define_pipelines(self) -> Any:
        state = self.state
        state.library = _Draft(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().define_pipelines()


OPTIONS: dict[str, Any] = {"_nrt": False, "no_cfunc_wrapper": True, "pipeline_class": _Compiler}
ALLOCATING: dict[str, Any] = OPTIONS | {"_nrt": True}
"""Options of kernels that make arrays.

Other kernels count no references and compile faster.
"""
INSIDE: dict[str, Any] = OPTIONS | {
    "no_cpython_wrapper": True,
    "pipeline_class": _InsideCompiler,
}
"""Options of drafts."""
