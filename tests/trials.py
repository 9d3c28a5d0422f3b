"""Trials with mutated files: bytes that are changed at random, and what is wrong with an end."""

from __future__ import annotations

import copy
import functools
import operator
import random
import time
import traceback
from collections.abc import Callable, Sequence
from typing import Any

from recording import stored

import stiction as st

JUNK = (
    b"\0", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"9" * 400, b"(", b'"', b";", b",,,", b"\n",
    b"\x1b[2J", b"nan", b"1e999", b"-1", b"[[[[", b"<a>", b"&x;", b"\xef\xbb\xbf", b"\r", b"#",
    b" " * 300, b'"""', b"[" * 2000,
)  # fmt: skip


def mutated(given: bytes, chance: random.Random) -> bytes:
    """Bytes with some changed, lost, repeated or put between."""
    data = bytearray(given)
    for _ in range(chance.choice((1, 1, 2, 4, 16))):
        at, kind = chance.randrange(len(data) + 1), chance.randrange(5)
        if kind == 0:
            data[at : at + 1] = bytes([chance.randrange(256)])
        elif kind == 1:
            del data[at : at + chance.choice((1, 4, 40, 4000))]
        elif kind == 2:
            data[at:at] = data[chance.randrange(len(data) + 1) :][: chance.choice((8, 200))]
        else:
            junk = chance.choice(JUNK)
            data[at : at + len(junk) * (kind == 3)] = junk
    return bytes(data)


VALUES = stored("values")
"""Values of any kind, few of which fit the key that gets them."""


def _leaves(tree: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Paths to everything inside, tables too."""
    found = [path] if path else []
    items = enumerate(tree) if isinstance(tree, list) else ()
    for key, value in tree.items() if isinstance(tree, dict) else items:
        found += _leaves(value, (*path, key))
    return found


def mutated_tree(tree: Any, chance: random.Random, values: Sequence[Any] = VALUES) -> str:
    """What is changed anywhere inside plain content."""
    path = chance.choice(_leaves(tree))
    *above, key = path
    owner = functools.reduce(operator.getitem, above, tree)
    kind = chance.choice(("value",) * 6 + ("scale", "remove", "rename", "move", "sweep"))
    if kind == "scale" and isinstance(owner[key], int | float):
        owner[key] = owner[key] * 10 ** chance.choice((-12, -6, -3, 3, 6, 12))
    elif kind == "remove":
        del owner[key]
    elif kind == "rename" and isinstance(owner, dict):
        owner[f"{key}{chance.choice('sx_ ')}"] = owner.pop(key)
    elif kind == "move" and isinstance(owner, dict) and isinstance(tree, dict):
        tree[str(key)] = owner.pop(key)
    elif kind == "sweep" and isinstance(tree, dict) and isinstance(tree.get("sweep"), list):
        dotted = ".".join(map(str, path))
        tree["sweep"].append({dotted: [chance.choice(values), chance.choice(values)]})
    else:
        owner[key] = copy.deepcopy(chance.choice(values))
    return f"{kind} {'.'.join(map(str, path))}"


def fault(use: Callable[[], Any], seconds: float) -> str:
    """What is wrong with the end of a trial: a traceback, several lines, long work.

    Processor time counts, which is the same on a busy machine.
    """
    begin = time.process_time()
    try:
        use()
    except (st.InputError, st.RunError) as error:
        problems = getattr(error, "problems", [str(error)])
        if not all(len(text.strip()) in range(1, 2000) for text in problems):
            return f"refused with {problems!r:.300}"
    except Exception:
        return traceback.format_exc(-3)
    work = time.process_time() - begin
    return "" if work < seconds else f"{work:.0f} s"
