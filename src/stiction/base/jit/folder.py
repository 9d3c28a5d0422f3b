"""The folder in which the compiled kernels of a module are kept."""

import hashlib
import re
from functools import cache
from pathlib import Path

import numba

from stiction.base.files import cache_folder, private_folder

KEPT = numba.config.CACHE_DIR
"""Folder that the user chose by NUMBA_CACHE_DIR, or ''."""
_IMPORT = re.compile(rb"^\s*(?:from|import) (stiction[\w.]*)(?: import (\w+))?", re.MULTILINE)


@cache
def _kernel_sources() -> dict[str, bytes]:
    """Return the text of every file that may hold a part of a kernel, by module.

    Files that refuse input hold no part of a kernel, unless they hold one themselves: an edited
    message recompiles nothing.
    """
    package = Path(__file__).parents[2]
    found = {}
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        own = b"stiction.base.jit import" in text or path.parent.name == "jit"
        if own or b"InputError" not in text:
            name = ".".join(path.relative_to(package.parent).with_suffix("").parts)
            found[name.removesuffix(".__init__")] = text
    return found


@cache
def kernel_folder(module: str, compiler: str) -> Path:
    """Return the folder of the kernels of a module that a `compiler` (any name) compiled.

    numba takes a compiled kernel for current as long as the kernel's own file is: it does not
    notice that a function or a constant of another file has changed. So every state of the files
    that a module imports, directly or not, has a folder of its own. Friction laws are resolved by
    type inside kernels and belong to every state.
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
    return private_folder((Path(KEPT) if KEPT else cache_folder() / "compiled") / digest)
