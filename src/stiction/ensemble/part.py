"""A part of a run: which samples one of several independent processes computes."""

from __future__ import annotations

import re
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from stiction._checks import is_whole
from stiction.errors import InputError
from stiction.model import describe
from stiction.random.draws import BLOCK

FEWEST_BLOCKS = 8
"""Blocks that a part has if there are samples enough, so that parts take about as long."""


class Part(NamedTuple):
    """Part `number` (from 1) of `of`.

    Blocks of consecutive samples are dealt out in turn, through all points of a sweep, so that
    parts are alike even where points are not.
    """

    number: int
    of: int

    @property
    def name(self) -> str:
        """Of its folder: '003-of-100'."""
        width = len(str(self.of))
        return f"{self.number:0{width}d}-of-{self.of}"

    def mask(self, points: int, samples: int) -> NDArray[np.bool_]:
        """Which samples are its own, (points, samples)."""
        total = points * samples
        block = min(BLOCK, max(1, total // (FEWEST_BLOCKS * self.of)))
        mine: NDArray[np.bool_] = np.arange(total) // block % self.of == self.number - 1
        return mine.reshape(points, samples)


def as_part(value: Any) -> Part:
    """A part from a pair of numbers or a text such as '3/100'.

    Raises
    ------
    InputError
    """
    pair: Any = value
    if isinstance(value, str):
        found = re.fullmatch(r"\s*(\d{1,9})\s*/\s*(\d{1,9})\s*", value)
        pair = tuple(int(number) for number in found.groups()) if found else None
    whole = (
        isinstance(pair, tuple | list)
        and len(pair) == 2
        and all(is_whole(number, 1) for number in pair)
    )
    if not whole or not 1 <= pair[0] <= pair[1]:
        raise InputError(
            "part: must be which part of how many, such as 3/100 (in Python also (3, 100)), from"
            f" 1/100 to 100/100; got {describe(value)}"
        )
    return Part(int(pair[0]), int(pair[1]))


def part_of_name(name: str) -> Part | None:
    """The part whose folder has this name; None if it is no such name."""
    found = re.fullmatch(r"(\d+)-of-(\d+)", name)
    if found is None:
        return None
    part = Part(int(found[1]), int(found[2]))
    return part if 1 <= part.number <= part.of and part.name == name else None
