"""The words that tables of users may hold, and the units of all quantities, as recorded.

Files of users and of earlier versions hold them: none may vanish or change its meaning.
"""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator, Mapping, Set
from pathlib import Path
from typing import Any

from recording import compare

import stiction
from stiction.base.variables import Variable

RECORDS = Path(__file__).with_name("vocabulary.json")


def tables(package: Any) -> Iterator[tuple[str, str, Any]]:
    """Constants that hold several values: their module and name, with each key and value."""
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        if module.name.endswith("__main__"):
            continue
        for name, table in vars(importlib.import_module(module.name)).items():
            if name.lstrip("_").isupper() and isinstance(table, Mapping):
                yield from ((f"{module.name} {name}", str(key), table[key]) for key in table)
            elif name.lstrip("_").isupper() and isinstance(table, Set | tuple):
                yield f"{module.name} {name}", "words", sorted(map(str, table))


def test_vocabulary(request):
    record = request.config.getoption("--record")
    variables = [(key, v.units) for _, key, v in tables(stiction) if isinstance(v, Variable)]
    units = {
        key: ", ".join(sorted({u for k, u in variables if k == key})) for key, _ in variables
    }
    compare(RECORDS, "units", units, record, 0.0)
    reading = importlib.import_module("stiction.problem.reading")
    words = {
        f"{name}, {key}": " ".join(value) if isinstance(value, list | tuple) else value
        for name, key, value in tables(reading)
        if isinstance(value, list | tuple | str)
    }
    compare(RECORDS, "words", words, record, 0.0)
