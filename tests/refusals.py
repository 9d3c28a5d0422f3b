"""What a refusal must name: the words of a table, apart by three dots, in any order."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest
from recording import CLOSE, Call, Calls

import stiction as st


def refuses(
    words: str, call: Callable[[], Any], error: type[Exception] = st.InputError
) -> None:
    """Fail unless the call is refused with a message that holds all words."""
    with pytest.raises(error) as caught:
        call()
    for word in words.split(" ... "):
        assert word in str(caught.value), str(caught.value)


def refusals(table: dict[str, Any], call: Callable[..., Any] | None = None) -> Any:
    """Return a test of each row: words, and a call that is refused or the options of `call`."""

    @pytest.mark.parametrize("words", table)
    def test(words: str) -> None:
        given = table[words]
        refuses(words, given if call is None else lambda: call(**given))

    return test


def said(call: Callable[[], Any]) -> str | list[str]:
    """The text by which a call is refused, or those of what it doubts."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            call()
        except (ValueError, RuntimeError) as error:
            return f"{type(error).__name__}: {error}"
    doubts = [one for one in caught if one.category.__module__.startswith("stiction")]
    return sorted({f"{one.category.__name__}: {one.message}" for one in doubts})


def table_of(calls: Calls, rows: dict[str, list[Callable[[], Any]]]) -> None:
    """Add what each call of a table says to those that are recorded, a record for each list."""

    def each(some: list[Callable[[], Any]]) -> dict[str, Any]:
        return {str(number): said(call) for number, call in enumerate(some)}

    for name, some in rows.items():
        calls[name] = Call(partial(each, some), "read beside the rule that refuses", CLOSE)
