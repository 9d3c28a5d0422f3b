"""The values of public calls, compared with recorded values.

A call is a function without arguments. Its result is taken apart into datasets, arrays, answers
and tables, down to each number, dimension and unit. A refusal is recorded by the arguments that it
names, and a warning by its class. Wording is never recorded, so that texts can improve freely.
Records (`records/*.json`) have one line for each output.
`pytest -n 0 tests/records --record` writes them anew and prints what changed.
"""

from __future__ import annotations

import contextlib
import dataclasses
import json
import math
import re
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import pytest
import xarray as xr

READ = "read beside the rule that refuses"
CLOSE = 1e-6
"""Relative distance of numbers that count as the same: other processors round otherwise."""
FLOOR = 1e-9
"""The same as a share of the largest of an output, for those that are nearly zero."""
WHOLE = 16
"""Most numbers of an output that are recorded one by one; of more their sums with two weights."""
FEW = 5
"""Most members of a list that are taken apart; of all, the number is recorded."""
ROUND_OFF = ("certificate_gap",)
"""Outputs that are nothing but round-off where all is well: recorded as whether they are small."""
MAX_WORDS_OF_A_NAME = 3
"""Texts of more words are prose, which is not recorded."""
NUMBER = re.compile(r"(?<![\w.])-?\d+(?:\.\d+)?(?:e[+-]?\d+)?(?![\w.])")
VERSIONS = re.compile(r"version|created|platform")


class Call(NamedTuple):
    """A public call, by what its recorded values were verified, and how close they must be."""

    make: Callable[[], Any]
    verified: str
    close: float


class Calls(dict[str, Call]):
    """The calls of a file, by name."""

    def __call__(
        self, verified: str, close: float = CLOSE, name: str = ""
    ) -> Callable[[Any], Any]:
        """Add a call; `verified` names the oracle, closed form or reading behind its values."""

        def add(make: Callable[[], Any]) -> Callable[[], Any]:
            self[name or make.__name__] = Call(make, verified, close)
            return make

        return add


def outputs_of(call: Call) -> dict[str, Any]:
    """All outputs of a call by their path, warnings included."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = call.make()
        found = dict(taken_apart(result))
    return found | {f"warning {name}": [count] for name, count in warned(caught).items()}


def warned(caught: list[warnings.WarningMessage]) -> dict[str, int]:
    """The number of different texts of our own warnings, by class."""
    texts = {
        (warning.category.__name__, str(warning.message))
        for warning in caught
        if warning.category is UserWarning or warning.category.__module__.startswith("stiction")
    }
    return dict(sorted(Counter(name for name, _ in texts).items()))


def taken_apart(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Paths, and the text or the numbers there."""
    if isinstance(value, xr.Dataset | xr.DataArray):
        yield from _labelled(value, path)
    elif isinstance(value, pd.DataFrame):
        for name in value.columns:
            yield from taken_apart(value[name].tolist(), f"{path}[{name}]")
    elif isinstance(value, Mapping):
        for key, each in value.items():
            yield from taken_apart(each, f"{path}.{key}" if path else str(key))
    elif hasattr(value, "__pydantic_fields__"):
        yield path, repr(value)
    elif dataclasses.is_dataclass(value) and not isinstance(value, type):
        names = [
            field.name
            for field in dataclasses.fields(value)
            if field.repr and not field.name.startswith("_")
        ]
        names += [name for name in dir(type(value)) if _is_property(type(value), name)]
        yield from taken_apart({name: getattr(value, name) for name in names}, path)
    elif isinstance(value, str | Path) or value is None:
        yield path, without_wording(str(value))
    elif isinstance(value, list | tuple) and not _numeric(value):
        yield f"{path}.len", [len(value)]
        for number, each in enumerate(value[:FEW]):
            yield from taken_apart(each, f"{path}[{number}]")
    elif _numeric(value):
        yield path, numbers(value, path)
    else:
        yield path, repr(value)


def without_wording(text: str) -> str:
    """The text if it is a name; prose may change, so that only its presence is recorded."""
    return text if len(text.split()) <= MAX_WORDS_OF_A_NAME else "a text"


def _is_property(kind: type, name: str) -> bool:
    return not name.startswith("_") and isinstance(getattr(kind, name), property)


def _numeric(value: Any) -> bool:
    try:
        return np.asarray(value).dtype.kind in "bifuc"
    except (TypeError, ValueError):
        return False


def numbers(value: Any, path: str) -> Any:
    """The numbers of an output: all of them, or of many their shape and four sums."""
    array = np.asarray(value, dtype=float)
    if any(name in path for name in ROUND_OFF):
        array = np.where(np.isnan(array), np.nan, array > 1.0)
    if array.size <= WHOLE:
        return [_short(one) for one in array.reshape(-1)]
    flat = np.nan_to_num(array.reshape(-1), posinf=0.0, neginf=0.0)
    place = np.arange(flat.size)
    weighted = [np.mean(flat * np.cos(frequency * place + 1.0)) for frequency in (1.234, 0.057)]
    least_and_most = [np.nanmin(array), np.nanmax(array)] if np.isfinite(flat).any() else []
    lost = int(np.isnan(array).sum())
    digest = [_short(float(one)) for one in (*least_and_most, flat.mean(), *weighted)]
    return {"shape": list(array.shape), "nan": lost, "digest": digest}


def _short(number: Any) -> float:
    return float(f"{float(number):.10g}")


def _labelled(value: Any, path: str) -> Iterator[tuple[str, Any]]:
    for name, text in value.attrs.items():
        if not VERSIONS.search(str(name)) and name != "study":
            yield f"{path}@{name}", without_wording(str(text))
    arrays = value.variables if isinstance(value, xr.Dataset) else {"": value.variable}
    for name, array in arrays.items():
        whole = f"{path}.{name}" if path and name else f"{path}{name}"
        yield f"{whole}@", f"{array.attrs.get('units')}, {array.dims}"
        yield from taken_apart(
            array.values.tolist() if array.dtype.kind in "OU" else array.values, whole
        )


def differences(
    found: Mapping[str, Any], recorded: Mapping[str, Any], close: float
) -> list[str]:
    """What differs between the outputs of a call and those recorded, a line each."""
    lines = [f"{path}: is new: {found[path]}" for path in found.keys() - recorded.keys()]
    lines += [f"{path}: is gone: {recorded[path]}" for path in recorded.keys() - found.keys()]
    for path in found.keys() & recorded.keys():
        if not _same(found[path], recorded[path], close):
            lines.append(f"{path}: {found[path]} for {recorded[path]}")
    return sorted(lines)


def _same(one: Any, other: Any, close: float) -> bool:
    if isinstance(one, dict) and isinstance(other, dict):
        alike = one["shape"] == other["shape"] and one["nan"] == other["nan"]
        return alike and _near(one["digest"], other["digest"], close)
    if isinstance(one, list) and isinstance(other, list):
        return len(one) == len(other) and _near(one, other, close)
    if isinstance(one, str) and isinstance(other, str):  # a field or a number as a text
        words, values = NUMBER.sub("", one), list(map(float, NUMBER.findall(one)))
        recorded = list(map(float, NUMBER.findall(other)))
        alike = words == NUMBER.sub("", other) and len(values) == len(recorded)
        return alike and all(
            _near([x], [y], close) for x, y in zip(values, recorded, strict=True)
        )
    return type(one) is type(other) and one == other


def _near(one: list[float], other: list[float], close: float) -> bool:
    size = max((abs(x) for x in other if math.isfinite(x)), default=0.0)
    return all(
        x == y or (x != x and y != y) or abs(x - y) <= close * abs(y) + FLOOR * size
        for x, y in zip(one, other, strict=True)
    )


def refusal(call: Callable[[], Any]) -> Any:
    """What a call gives, or the class of its error with the arguments that the error names."""
    try:
        return call()
    except (ValueError, RuntimeError) as error:
        named = [text.partition(": ")[0] for text in getattr(error, "problems", ())]
        arguments = [name for name in named if len(name.split()) <= MAX_WORDS_OF_A_NAME]
        return f"{type(error).__name__} {','.join(dict.fromkeys(arguments))}".strip()


def said(call: Callable[[], Any]) -> str:
    """How a call is refused, or the number of its warnings by class."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = refusal(call)
    if isinstance(result, str):
        return result
    return " ".join(f"{name}:{count}" for name, count in warned(caught).items()) or "taken"


def mistakes(file: str, scope: dict[str, Any]) -> Calls:
    """The calls that the records of a file hold as text, each beside what is said of it.

    A new one is written there with an empty answer, which ``--record`` fills in.
    """
    calls = Calls()
    for name, texts in read(record_of(file)).items():
        calls(READ, name=name)(
            lambda texts=texts: {text: said(partial(eval, text, scope)) for text in texts}
        )
    return calls


def record_of(file: str) -> Path:
    """The records beside a file of tests."""
    return Path(file).with_name(Path(file).stem.removeprefix("test_") + ".json")


@contextlib.contextmanager
def inside() -> Iterator[Path]:
    """A folder of its own, in which a call works, so that what it says names none."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        yield Path(folder)


def read(path: Path) -> dict[str, dict[str, Any]]:
    """Recorded outputs of the calls of a file."""
    return json.loads(path.read_text()) if path.exists() else {}


def write(path: Path, records: Mapping[str, Mapping[str, Any]]) -> None:
    """Write records, an output a line."""
    blocks = []
    for name in sorted(records):
        lines = [
            f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in records[name].items()
        ]
        blocks.append(f"{json.dumps(name)}: {{\n" + ",\n".join(lines) + "\n}")
    path.write_text("{\n" + ",\n".join(blocks) + "\n}\n")


def compared(calls: Calls, file: str) -> Callable[..., None]:
    """A test of each call of a file beside its records; with ``--record`` these are written."""

    @pytest.mark.parametrize("name", calls)
    def test(name: str, request: pytest.FixtureRequest) -> None:
        path = record_of(file)
        found = outputs_of(calls[name])
        recorded = read(path)
        changed = differences(found, recorded.get(name, {}), calls[name].close)
        if request.config.getoption("--record") and changed:
            print(f"\n{name}", *changed, sep="\n  ")
            here = {key: one for key, one in recorded.items() if key in calls}
            write(path, here | {name: found})
        else:
            assert not changed, "\n".join([f"{name} ({calls[name].verified})", *changed])

    return test
