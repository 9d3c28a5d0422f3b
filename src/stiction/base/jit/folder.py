"""The folder in which the compiled kernels of a module are kept.

Kernels are code, so only the package or the environment choose their folder. numba
also reads `.numba_config.yaml` in the current folder, but this file may come from a
stranger.
"""

import hashlib
import os
import re
from functools import cache
from pathlib import Path

from stiction.base.errors import warn_user
from stiction.base.files import cache_folder, private_folder

CHOSEN = os.environ.get("NUMBA_CACHE_DIR", "")
"""Folder that the user chose, or ''."""
if os.path.lexists(".numba_config.yaml"):
    warn_user(
        ".numba_config.yaml: numba reads this file in the current folder. stiction does not take"
        " the folder of its compiled kernels from it",
        UserWarning,
    )
_IMPORT = re.compile(rb"^\s*(?:from|import) (stiction[\w.]*)(?: import (\w+))?", re.MULTILINE)


@cache
def _kernel_sources() -> dict[str, bytes]:
    """Return, by module, the text of every file that may hold a part of a kernel.

    Files that refuse input hold no part of a kernel, unless they hold one themselves: an
    edited message recompiles nothing.
    """
    package = Path(__file__).parents[2]
    sources = {}
    for path in sorted(package.rglob("*.py")):
        text = path.read_bytes()
        has_kernels = b"stiction.base.jit import" in text or path.parent.name == "jit"
        if has_kernels or b"InputError" not in text:
            name = ".".join(path.relative_to(package.parent).with_suffix("").parts)
            sources[name.removesuffix(".__init__")] = text
    return sources


@cache
def kernel_folder(module: str, compiler: str) -> Path:
    """Return the folder for a module's kernels that a `compiler` (any name) compiled.

    numba treats a compiled kernel as current if the file of the kernel has not
    changed. It does not notice changes of functions or constants in other files.
    Therefore every state of the files that a module imports, directly or not, has a
    separate folder. Friction laws are resolved by type inside kernels and belong to
    every state.
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
    kept = Path(CHOSEN) if CHOSEN else cache_folder() / "compiled"
    return private_folder(kept / digest / module)
