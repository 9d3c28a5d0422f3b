"""Files that are complete or absent, archives of arrays, and folders for cache and kernels.

Files may come from strangers. Every reader in the package gets its
bytes from `read_regular` or `content_of`, and checks the size of its
result before it allocates memory.
"""

import atexit
import hashlib
import io
import os
import re
import shutil
import stat
import struct
import tempfile
import uuid
import warnings
import zipfile
import zlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import platformdirs
from numpy.typing import NDArray

from stiction.base.errors import InputError, StoreError

PART = ".part"
MAX_FILE_BYTES = 2**30
MAX_HEADER_BYTES = 2**16
"""Size of the description of an array, which numpy reads with Python's
own parser."""

UNREADABLE = (
    OSError, ValueError, EOFError, KeyError, NotImplementedError, RuntimeError,
    SyntaxError, zipfile.BadZipFile, zlib.error, struct.error,
)  # fmt: skip
"""Errors that damaged archives raise."""


def read_regular(
    path: Path, *, max_bytes: int = MAX_FILE_BYTES, follow_links: bool = True
) -> bytes:
    """Return the content of a regular file.

    Raises an `InputError` if the file is not regular or is too large.
    Other errors of the system (OSError) are passed on. The steps are:

    1. Check the type of the file before opening it, because opening a
       device may act on the device.
    2. Open the file without waiting, and check again, because the file
       may have been replaced.
    3. Read as many bytes as the file had then. Files that the system
       generates, such as in /proc, have size 0.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "data")
    ...     _ = path.write_bytes(b"12345")
    ...     print(read_regular(path, max_bytes=5), content_of(path, max_bytes=5))
    b'12345' b'12345'
    """
    extra = getattr(os, "O_NONBLOCK", 0)
    if not follow_links:
        extra |= getattr(os, "O_NOFOLLOW", 0)
        if stat.S_ISLNK(os.lstat(path).st_mode):
            raise InputError("is a symbolic link. Give the path of the file itself")
    _check_regular(os.stat(path), max_bytes)
    with open(path, "rb", opener=lambda name, flags: os.open(name, flags | extra)) as file:
        state = os.fstat(file.fileno())
        _check_regular(state, max_bytes)
        return file.read(state.st_size)


def _check_regular(state: os.stat_result, max_bytes: int) -> None:
    """Refuse folders, devices and large files.

    >>> from types import SimpleNamespace
    >>> _check_regular(SimpleNamespace(st_mode=stat.S_IFREG, st_size=7), 7)
    >>> _check_regular(SimpleNamespace(st_mode=stat.S_IFREG, st_size=8), 7)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: has 8 bytes, more than the limit of 7
    >>> _check_regular(os.stat(os.curdir), 2**40)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: is not a regular file
    """
    if not stat.S_ISREG(state.st_mode):
        raise InputError("is not a regular file")
    if state.st_size > max_bytes:
        raise InputError(f"has {state.st_size} bytes, more than the limit of {max_bytes}")


def content_of(path: Path, *, max_bytes: int = MAX_FILE_BYTES) -> bytes:
    """Return the content of a regular file, or raise an `InputError`.

    >>> with tempfile.TemporaryDirectory() as folder:
    ...     _ = Path(folder, "data").write_bytes(b"12345")
    ...     content_of(Path(folder, "data"), max_bytes=4)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: has 5 bytes, more than the limit of 4
    >>> content_of(Path("no such file"))
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: does not exist
    >>> from unittest.mock import patch
    >>> with patch("os.stat", side_effect=PermissionError(13, "not allowed")):
    ...     content_of(Path("closed"))
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: cannot be read: not allowed
    """
    try:
        return read_regular(path, max_bytes=max_bytes)
    except FileNotFoundError:
        raise InputError(f"does not exist{_near_file(path)}") from None
    except OSError as error:
        raise InputError(f"cannot be read: {error.strerror or error}") from None


def _near_file(path: Path) -> str:
    """Return a question that suggests a file whose name differs only in case, or ''.

    >>> with tempfile.TemporaryDirectory() as folder:
    ...     Path(folder, "Peaks.CSV").touch()
    ...     near, far = (_near_file(Path(folder, name)) for name in ("peaks.csv", "peak.csv"))
    >>> near[:15], near[-11:], far
    ('; did you mean ', "Peaks.CSV'?", '')
    """
    with suppress(OSError):
        for name in os.listdir(path.parent):
            if name.casefold() == path.name.casefold():
                return f"; did you mean {str(path.with_name(name))!r}?"
    return ""


def check_unpacked(size: int, content: bytes, least: int, times: int) -> None:
    """Refuse content that unpacks to more than `least` bytes and `times` the size of its file.

    >>> check_unpacked(10, b"abc", 10, 2)  # at most ten bytes are always allowed
    >>> check_unpacked(12, b"abc", 10, 4)
    >>> check_unpacked(13, b"abc", 10, 4)
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: would unpack to 13, more than the limit of 12 for its size
    """
    limit = max(least, times * len(content))
    if size > limit:
        raise InputError(f"would unpack to {size}, more than the limit of {limit} for its size")


@contextmanager
def refuse_damage(kind: str) -> Iterator[None]:
    r"""Turn every error that a library raises for a broken file into an `InputError`.

    >>> with refuse_damage("a table"):
    ...     raise ValueError("line 3\nis too long")
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: is not a table: line 3
    >>> with refuse_damage("a table"):
    ...     raise EOFError
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: is not a table: EOFError
    >>> with refuse_damage("a table"):
    ...     raise InputError("has no columns")
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: has no columns
    """
    try:
        yield
    except InputError:
        raise
    except Exception as error:  # libraries raise all kinds of errors on a broken file
        text = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError(f"is not {kind}: {text}") from None


def write_whole(path: Path, content: bytes | Callable[[Path], object]) -> None:
    """Write a temporary file, sync it and rename it.

    The old file stays until then.

    From its first byte on, the new file has the
    permissions of the old file. The content is bytes, or a
    function that writes to a given path. If writing fails
    (a `StoreError`), the unfinished file is removed.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "data")
    ...     write_whole(path, b"old")
    ...     path.chmod(0o640)
    ...     before = path.stat().st_mode
    ...     write_whole(path, lambda aside: aside.write_bytes(b"new"))
    ...     try:
    ...         write_whole(path, lambda aside: aside.write_bytes(b"x") + open(folder, "wb"))
    ...     except StoreError as error:
    ...         print(str(error).startswith(f"{path}: cannot be written"))
    ...     print(path.read_bytes(), path.stat().st_mode == before, os.listdir(folder))
    True
    b'new' True ['data']
    """
    aside = path.with_name(f"{path.name}.{uuid.uuid4().hex[:12]}{PART}")
    try:
        with suppress(FileNotFoundError):
            state = path.lstat()
            if stat.S_ISREG(state.st_mode):
                aside.touch(0o600, exist_ok=False)
                aside.chmod(stat.S_IMODE(state.st_mode))
        if callable(content):
            content(aside)
        else:
            aside.write_bytes(content)
        with open(aside, "rb+") as file:
            os.fsync(file.fileno())
        os.replace(aside, path)
    except BaseException as error:
        with suppress(OSError):
            aside.unlink()
        if isinstance(error, OSError | RuntimeError):  # the NetCDF library raises either
            raise cannot("written", path, error) from error
        raise
    with suppress(OSError):  # Windows opens no folders
        folder = os.open(path.parent, os.O_RDONLY)
        os.fsync(folder)
        os.close(folder)


def cannot(what: str, path: Path, error: BaseException) -> StoreError:
    """Return the error for a file that cannot be read or written.

    >>> print(cannot("read", Path("data"), OSError(5, "input/output error")))
    data: cannot be read: input/output error
    >>> print(cannot("written", Path("data"), RuntimeError("NetCDF: bad name")))
    data: cannot be written: NetCDF: bad name
    """
    return StoreError(f"{path}: cannot be {what}: {getattr(error, 'strerror', None) or error}")


def write_arrays(path: Path, arrays: dict[str, Any]) -> None:
    """Write an .npz archive, completely or not at all.

    Errors are the same as in `write_whole`.

    Examples
    --------
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "chunks", "first.npz")
    ...     write_arrays(path, {"load": np.array([3, 7]), "slip": np.array(0.25)})
    ...     {name: array.tolist() for name, array in read_arrays(path).items()}
    {'load': [3, 7], 'slip': 0.25}
    """
    archive = io.BytesIO()
    np.savez(archive, **arrays)
    with suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
    write_whole(path, archive.getvalue())


def arrays_in(content: bytes) -> dict[str, NDArray[Any]]:
    """Return the arrays in an .npz file that `write_arrays` wrote.

    Raise an error of `UNREADABLE` for compressed members, and for
    members that together are larger than the archive.

    Examples
    --------
    >>> archive = io.BytesIO()
    >>> with zipfile.ZipFile(archive, "w") as file:
    ...     file.writestr("load.npy", bytes(9))
    ...     file.writestr("slip.npy", bytes(9), compress_type=zipfile.ZIP_DEFLATED)
    >>> arrays_in(archive.getvalue())
    Traceback (most recent call last):
        ...
    ValueError: members are compressed or larger than the file
    >>> with zipfile.ZipFile(archive, "w") as file:
    ...     file.writestr("load.npy", bytes(999))
    ...     file.filelist.append(file.filelist[0])  # two members with the same content
    >>> arrays_in(archive.getvalue())
    Traceback (most recent call last):
        ...
    ValueError: members are compressed or larger than the file
    >>> archive = io.BytesIO()
    >>> np.savez(archive, law=np.array([None]))  # numpy would unpickle an object
    >>> arrays_in(archive.getvalue())
    Traceback (most recent call last):
        ...
    ValueError: Object arrays cannot be loaded when allow_pickle=False
    """
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        members = archive.infolist()
        packed = any(member.compress_type != zipfile.ZIP_STORED for member in members)
        if packed or sum(member.file_size for member in members) > len(content):
            raise ValueError("members are compressed or larger than the file")
        arrays = {}
        for member in members:
            with archive.open(member) as stream:
                arrays[member.filename.removesuffix(".npy")] = np.lib.format.read_array(
                    stream, allow_pickle=False, max_header_size=MAX_HEADER_BYTES
                )
        return arrays


def read_arrays(path: Path) -> dict[str, NDArray[Any]]:
    """Return the arrays of an .npz file, or raise FileNotFoundError or an error in `UNREADABLE`."""
    return arrays_in(read_regular(path))


def cache_folder() -> Path:
    """Return `STICTION_CACHE_DIR` if set, or else the platform's cache folder for the user.

    >>> from unittest.mock import patch
    >>> with patch.dict(os.environ, STICTION_CACHE_DIR="kept"):
    ...     print(cache_folder())
    kept
    >>> with patch.dict(os.environ, STICTION_CACHE_DIR=""):
    ...     cache_folder() == Path(platformdirs.user_cache_dir("stiction"))
    True
    """
    given = os.environ.get("STICTION_CACHE_DIR")
    return Path(given) if given else Path(platformdirs.user_cache_dir("stiction"))


@cache
def _warn_once(text: str) -> None:
    """Warn once in a process, even where warnings are collected.

    >>> with warnings.catch_warnings(record=True) as shown:
    ...     warnings.simplefilter("always")
    ...     _warn_once.__wrapped__("full")
    ...     for text in ("slow", "slow"):
    ...         _warn_once(text)
    >>> [str(warning.message) for warning in shown][:2]
    ['cache: full', 'cache: slow']
    """
    warnings.warn(f"cache: {text}", UserWarning, stacklevel=2)


def private_folder(folder: Path) -> Path:
    """Return a folder to which only this user can have written.

    Make the folder if needed.

    Compiled kernels are pickles, so whoever can replace a kernel can
    run code as the user who loads it. If the folder is not private, a
    warning says why, and a temporary folder of this process takes its
    place. The steps are:

    1. Resolve links, because their owners could let them lead elsewhere.
    2. Make all missing folders with mode 0700, for any umask.
    3. Check the content of the folder, the folder, and all folders
       above it.

    >>> with tempfile.TemporaryDirectory() as top:
    ...     folder = private_folder(Path(top, "cache", "own", "line"))
    ...     modes = [oct(path.stat().st_mode & 0o777) for path in (folder, folder.parent)]
    ...     folder == Path(top, "cache", "own", "line").resolve()
    True
    >>> modes if os.name == "posix" else ["0o700"] * 2
    ['0o700', '0o700']
    >>> with warnings.catch_warnings(), tempfile.TemporaryDirectory() as top:
    ...     warnings.simplefilter("ignore")
    ...     folder = private_folder(Path("cache", "own"))
    ...     os.chmod(top, 0o777)
    ...     if os.name == "posix":
    ...         assert private_folder(Path(top, "own")) == folder
    >>> folder.is_absolute(), folder.parent == _temporary_folder(), folder.name
    (True, True, 'own')
    """
    if not folder.is_absolute():
        return _stand_in(f"{folder} is not an absolute path", folder.name)
    try:
        folder = folder.resolve()
        for missing in [one for one in (*reversed(folder.parents), folder) if not one.exists()]:
            missing.mkdir(mode=0o700, exist_ok=True)
        weakness = _weakness(folder) if os.name == "posix" else ""
    except OSError as error:  # nothing can be kept there
        _warn_once(
            f"{folder.parent} cannot be used ({error.strerror or error}), so kernels are"
            " compiled in every process. Set STICTION_CACHE_DIR to a folder of your own"
        )
        return folder
    return _stand_in(weakness, folder.name) if weakness else folder


def _weakness(folder: Path) -> str:
    """Return why somebody besides this user and root could write to a folder, or ''.

    A folder is open to others if it or a folder above it is, unless only owners can rename
    there (the sticky bit). Its content is protected by a folder that others cannot enter.

    >>> def weakness(above, mode, inside, make=Path.touch):
    ...     with tempfile.TemporaryDirectory() as top:
    ...         folder = Path(top, "own")
    ...         folder.mkdir()
    ...         make(Path(folder, "kernel"))
    ...         for path, allowed in ((folder / "kernel", inside), (folder, mode), (top, above)):
    ...             os.chmod(path, allowed)
    ...         return _weakness(folder).rpartition(os.sep)[2]
    >>> if os.name == "posix":
    ...     assert weakness(0o1777, 0o755, 0o644) == weakness(0o755, 0o700, 0o666) == ""
    ...     assert weakness(0o755, 0o710, 0o720, Path.mkdir) == "kernel can be written by others"
    ...     assert weakness(0o755, 0o701, 0o602) == "kernel can be written by others"
    ...     assert weakness(0o755, 0o702, 0o600) == "own can be written by others"
    ...     assert weakness(0o755, 0o1777, 0o600) == "own can be written by others"
    ...     assert weakness(0o770, 0o700, 0o600).endswith("can be written by others")
    """
    inside = {
        Path(top) / name for top, *names in os.walk(folder) for name in (*names[0], *names[1])
    }
    closed = folder.stat().st_mode & 0o011 == 0  # what lies in it cannot be reached by others
    for path in (*inside, folder, *folder.parents):
        state, above = path.lstat(), path in folder.parents
        if state.st_uid not in (os.geteuid(), 0):
            return f"{path} belongs to another user"
        shared = not stat.S_ISLNK(state.st_mode) and state.st_mode & 0o022 != 0
        shared = shared and not (closed and path in inside)
        if shared and not (above and state.st_mode & stat.S_ISVTX):
            return f"{path} can be written by others"
    return ""


def _stand_in(weakness: str, name: str) -> Path:
    """Return a temporary folder for this process, and warn why it is needed."""
    _warn_once(
        f"{weakness}, so others could put compiled code there. Each process compiles again."
        " Run chmod go-w on it, or set STICTION_CACHE_DIR to the absolute path of a private folder"
    )
    folder = _temporary_folder() / name
    folder.mkdir(mode=0o700, exist_ok=True)
    return folder


@cache
def _temporary_folder() -> Path:
    """Return a folder that is removed at the end of the process.

    >>> _temporary_folder().is_dir(), _temporary_folder() is _temporary_folder()
    (True, True)
    >>> _temporary_folder().name[:9]
    'stiction-'
    """
    folder = tempfile.mkdtemp(prefix="stiction-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return Path(folder)


# -- compiled kernels ----------------------------------------------------------------------------

_IMPORT = re.compile(rb"^\s*(?:from|import) (stiction[\w.]*)(?: import (\w+))?", re.MULTILINE)


@cache
def _kernel_sources() -> dict[str, bytes]:
    """Return, by module, the text of every file that may hold a part of a kernel.

    A file that raises `InputError` is left out unless it defines a
    kernel, so that an edited message recompiles nothing.

    >>> names = "base.jit", "random.mapping", "base.arrays", "problem.friction.kernels"
    >>> [f"stiction.{name}" in _kernel_sources() for name in (*names, "base.errors")]
    [True, True, True, True, False]
    >>> _kernel_sources()["stiction.base.arrays"][3:20]
    b'Arrays: their typ'
    """
    package = Path(__file__).parents[1]
    sources = {}
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        has_kernels = re.search(rb"stiction\.base\.jit import", text)
        if has_kernels or path.parent.name == "jit" or b"InputError" not in text:
            name = ".".join(path.relative_to(package.parent).with_suffix("").parts)
            sources[name.removesuffix(".__init__")] = text
    return sources


@cache
def kernel_folder(module: str, compiler: str) -> Path:
    """Return the folder for a module's kernels that a `compiler` (any name) compiled.

    numba treats a compiled kernel as current if the file of the kernel
    has not changed. Numba does not notice changes of functions or
    constants in other files. Therefore every state of the files that a
    module imports, directly or not, has a separate folder. Friction
    laws are resolved by type inside kernels and belong to every state.
    Kernels are code, so only the package or the environment choose
    their folder.

    Examples
    --------
    The name of the folder changes with the files that the module imports, and with friction laws.

    >>> from unittest.mock import patch
    >>> texts = {"stiction.a": b"import stiction.b", "stiction.b": b"from stiction.c import d"}
    >>> texts |= dict.fromkeys(("stiction.c.d", "stiction.e", "stiction.problem.friction.l"), b"")
    >>> def state(changed="", compiler="any"):
    ...     edited = texts | ({changed: texts[changed] + b"#"} if changed else {})
    ...     with tempfile.TemporaryDirectory() as top, patch.dict(os.environ, NUMBA_CACHE_DIR=top):
    ...         with patch("stiction.base.files._kernel_sources", lambda: edited):
    ...             folder = kernel_folder.__wrapped__("stiction.a", compiler)
    ...             return str(folder.parent.relative_to(Path(top).resolve()))
    >>> [state(name) == state() for name in texts], state(compiler="other") == state()
    ([False, False, False, True, False], False)
    >>> len(state())
    16
    """
    texts = _kernel_sources()
    waiting = [
        name for name in texts if name == module or name.startswith("stiction.problem.friction")
    ]
    reached = set(waiting)
    while waiting:
        for source, member in _IMPORT.findall(texts[waiting.pop()]):
            names = {source.decode(), f"{source.decode()}.{member.decode()}"}
            new = (names & texts.keys()) - reached
            waiting += new
            reached |= new
    state = compiler.encode() + b"".join(texts[name] for name in sorted(reached))
    digest = hashlib.sha256(state).hexdigest()[:16]
    if os.path.lexists(".numba_config.yaml"):  # it may come from a stranger
        _warn_once(
            ".numba_config.yaml: numba reads this file in the current folder, but stiction does"
            " not look in this file for the folder of its compiled kernels"
        )
    given = os.environ.get("NUMBA_CACHE_DIR")
    kept = Path(given) if given else cache_folder() / "compiled"
    return private_folder(kept / digest / module)
