"""What a refusal must name: the words of a table, apart by three dots, in any order."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

import stiction as st


def refuses(words: str, call: Callable[[], Any]) -> None:
    """Fail unless the call is refused with a message that holds all words."""
    with pytest.raises(st.InputError) as caught:
        call()
    for word in words.split(" ... "):
        assert word in str(caught.value), str(caught.value)
