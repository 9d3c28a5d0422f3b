"""What a refusal must name: the words of a table, apart by three dots, in any order."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import pytest
from contracts.bodies import attempt

import stiction as st


def refuses(
    words: str, call: Callable[[], Any], error: type[Exception] = st.InputError
) -> None:
    """Fail unless the call is refused with a message that holds all words, in any case."""
    with pytest.raises(error) as caught:
        call()
    for word in words.split(" ... "):
        assert word.lower() in str(caught.value).lower(), str(caught.value)


def says(words: str, call: Callable[[], Any]) -> None:
    """Fail unless the refusal and the doubts of a call hold all words, in any case."""
    told: list[str] = []
    told += warning_texts(lambda: told.append(attempt(call)[1]))
    for word in words.split(" ... "):
        assert word.lower() in " ".join(told).lower(), told


def warning_texts(call: Callable[[], Any]) -> list[str]:
    """The different texts of the package's own warnings during a call, sorted."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    ours = [given for given in caught if given.category.__module__.startswith("stiction")]
    return sorted({str(given.message) for given in ours})
