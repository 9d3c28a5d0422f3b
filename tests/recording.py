"""Outputs of public calls, compared with recorded values.

Records are files of JSON with one line for each output. Texts are never recorded: a refusal is
recorded by the arguments that it names, and a warning by its class; both by the numbers, the names,
the units, and the words of sense ("earlier", "at least", "not") in them.
`pytest -n 0 FILE --record` writes them anew and prints what changed.
"""

from __future__ import annotations

import contextlib
import json
import re
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray as xr
from refusals import says

FLOOR = 1e-9
"""Distance of numbers that count as equal, as a share of the largest of an output."""
WHOLE = 8
"""Most numbers of an output that are recorded singly. Of more, five sums are recorded."""
MAX_WORDS_OF_A_NAME = 3
"""Texts of more words are prose, which is not recorded."""
NUMBER = r"(?<![\w.])-?\d[\d,]*(?:\.\d+)?(?:e[-+]?\d+)?(?![\w.]*\w)"
NAME = r"'[^' ]*'|(?!scipy)\b[A-Za-z]\w*(?:[._]\w+)+|\b[GMk\u00b5mu]?(?:Pa|N|m)\b"
SENSE = (
    r"|\b(?:above|at least|at most|before|below|beyond|after|earlier|fewer|finer|coarser|faster"
    r"|slower|higher|lower|larger|smaller|later|less|more|longer|shorter|stronger|weaker|never"
    r"|no|not|only|raise|reduce|with|without|\w+(?:est|normal|bull|ric)|II?I?)\b"
)
"""Words without which a message would say the opposite, or name another family or mode."""
OF_OTHERS = r"\S+ GiB|numba cannot compile it: .*"
"""Parts of messages that belong to the machine or to another package."""


def digest(values: Any) -> list[float]:
    """The numbers of an output, or their size, their number of NaN and five sums."""
    array = np.asarray(values, dtype=float).reshape(-1)
    if array.size > WHOLE:
        known = np.nan_to_num(array, posinf=0.0, neginf=0.0)
        waves = [np.cos(rate * np.arange(known.size) + 1.0) for rate in (1.234, 0.057)]
        sums = [known.min(), known.max(), known.mean(), *(np.mean(known * w) for w in waves)]
        array = np.array([array.size, np.isnan(array).sum(), *sums])
    return [float(f"{number:.9g}") for number in array]


def differences(
    outputs: Mapping[str, Any], recorded: Mapping[str, Any], close: float, floor: float = FLOOR
) -> list[str]:
    """The outputs of a call that differ from the recorded outputs, a line each."""
    return [
        f"{path}: {outputs.get(path, 'is gone')} for {recorded.get(path, 'nothing')}"
        for path in sorted({*outputs, *recorded})
        if not _same(outputs.get(path), recorded.get(path), close, floor)
    ]


def _same(output: Any, recorded: Any, close: float, floor: float) -> bool:
    if not isinstance(output, list) or not isinstance(recorded, list):
        return type(output) is type(recorded) and bool(output == recorded)
    size = max((abs(number) for number in recorded if np.isfinite(number)), default=0.0)
    return len(output) == len(recorded) and np.allclose(
        output, recorded, rtol=close, atol=floor * size, equal_nan=True
    )


def compare(
    path: Path, name: str, outputs: Mapping[str, Any], record: bool, close: float,
    floor: float = FLOOR,
) -> None:  # fmt: skip
    """Compare outputs with those recorded under a name, or record them."""
    recorded = read(path)
    changed = differences(outputs, recorded.get(name, {}), close, floor)
    if record and changed:
        print(f"\n{name}", *changed, sep="\n  ")
        write(path, recorded | {name: outputs})
    else:
        assert not changed, "\n".join([name, *changed])


def read(path: Path) -> dict[str, dict[str, Any]]:
    """Recorded outputs by name."""
    return json.loads(path.read_text()) if path.exists() else {}


def stored(name: str) -> Any:
    """A table of tests/records."""
    return json.loads((Path(__file__).parent / "records" / f"{name}.json").read_text())


def evaluated(name: str, scope: dict[str, Any]) -> Any:
    """A table of tests/records/contracts.json, of texts that are evaluated in a module."""

    def value(part: Any) -> Any:
        if isinstance(part, dict):
            return {key: value(inner) for key, inner in part.items()}
        return eval(part, scope)

    return value(stored("contracts")[name])


def write(path: Path, records: Mapping[str, Mapping[str, Any]]) -> None:
    """Write records, an output a line."""
    blocks = []
    for name in sorted(records):
        lines = [
            f"  {json.dumps(key)}: {json.dumps(value)}" for key, value in records[name].items()
        ]
        blocks.append(f"{json.dumps(name)}: {{\n" + ",\n".join(lines) + "\n}")
    path.write_text("{\n" + ",\n".join(blocks) + "\n}\n")


def said(call: Callable[[], Any]) -> tuple[str, str, Any]:
    """The arguments that a refusal names, or the number of warnings by class; texts and result."""
    result = None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            result = call()
        except (ValueError, RuntimeError) as error:
            named = [text.partition(": ")[0] for text in getattr(error, "problems", ())]
            arguments = [name for name in named if len(name.split()) <= MAX_WORDS_OF_A_NAME]
            names = ",".join(dict.fromkeys(arguments))
            return f"{type(error).__name__} {names}".strip(), str(error), None
    texts = {
        (warning.category.__name__, str(warning.message))
        for warning in caught
        if warning.category is UserWarning or warning.category.__module__.startswith("stiction")
    }
    counts = sorted(Counter(name for name, _ in texts).items())
    answer = " ".join(f"{name}:{count}" for name, count in counts) or "taken"
    return answer, "\n".join(sorted(text for _, text in texts)), result


def figures(text: str, result: Any) -> dict[str, Any]:
    """The numbers and names in messages, in their order, and the numbers that a call returns."""
    text = re.sub(OF_OTHERS, "", text)
    numbers = [float(part.replace(",", "")) for part in re.findall(NUMBER, text)]
    known, returned = " ".join(re.findall(NAME + SENSE, text)), []
    if isinstance(result, xr.DataArray):
        known += repr(result.attrs)
    with contextlib.suppress(TypeError, ValueError):
        returned = digest(result) if result is not None else []
    return {"numbers": numbers, "names": known, "returned": returned}


def mistakes(file: str, scope: dict[str, Any]) -> Callable[..., None]:
    """A test of each call that the records of a file hold as text, with its refusal.

    A new call is written there with an empty answer, which ``--record`` fills in.
    """
    path = Path(file).with_name(Path(file).stem.removeprefix("test_") + ".json")

    @pytest.mark.parametrize("name", read(path))
    def test(name: str, request: pytest.FixtureRequest) -> None:
        record, second = request.config.getoption("--record"), f"figures_in_{path.name}"
        told = {text: said(partial(eval, text, scope)) for text in read(path)[name]}
        compare(path, name, {text: answer for text, (answer, *_) in told.items()}, record, 0.0)
        texts = {f"{text}, {part}": values for text, (_, *more) in told.items()
                 for part, values in figures(*more).items() if values}  # fmt: skip
        compare(path.with_name(second), name, texts, record, 0.011)

    return test


def refusals(name: str, scope: dict[str, Any]) -> Callable[..., None]:
    """A test of each call that a record of this name holds as text: words of what it tells."""
    words = stored(name)

    @pytest.mark.parametrize("call", words)
    def test(call: str) -> None:
        says(words[call], partial(eval, call, scope))

    return test


@contextlib.contextmanager
def inside() -> Iterator[Path]:
    """A folder of its own, in which a call works, so that its messages name no folder."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        yield Path(folder)
