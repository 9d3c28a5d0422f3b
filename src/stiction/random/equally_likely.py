"""Several equally likely random interfaces as one: which of them holds is one more draw."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from pydantic import InstanceOf
from scipy.special import ndtr

from stiction.arrays import Array
from stiction.errors import InputError
from stiction.interface import Interface
from stiction.random.fields import RandomField, RandomInterface, as_random_interface, layout
from stiction.random.synthesis import BLOCK, Stream

WHICH = Stream(2000, BLOCK, np.arange(0), mean_mode=True)
"""The draw that selects a member."""
MODES = 1 << 40
"""More than the number of draws of a stream."""

AnyRandom: TypeAlias = (
    RandomInterface
    | RandomField
    | list[Annotated[RandomInterface, InstanceOf()] | Annotated[RandomField, InstanceOf()]]
)
"""A random interface, a field that becomes one, or several that are equally likely."""


@dataclass(frozen=True, eq=False)
class EquallyLikely:
    """Random interfaces of which one holds, nobody knows which; it has the protocol of one.

    The first draw of a sample selects its member. The others are those of the members, which share
    a draw where it has the same property and mode: a sample that changes its member keeps its form.
    """

    members: tuple[RandomInterface, ...]
    order: tuple[int, ...] = ()  # of the members along the first draw; empty: as they are

    def __post_init__(self) -> None:
        if not self.members:
            raise InputError(
                "random: must hold at least one random interface, got an empty list"
            )
        first, *others = ({k: f.of for k, f in one.properties.items()} for one in self.members)
        for number, other in enumerate(others, start=1):
            if other != first:
                raise InputError(
                    "random: equally likely interfaces need the same random properties, all as"
                    f" stresses or all as coefficients; [0] has {_named(first)} and [{number}]"
                    f" {_named(other)}"
                )

    @property
    def properties(self) -> dict[str, RandomField]:
        """The random properties of the first member."""
        return self.members[0].properties

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the random properties."""
        return self.members[0].names

    def member(self, draws: Array) -> NDArray[np.int64]:
        """Return the number of the member of each sample."""
        count = len(self.members)
        place = np.minimum((ndtr(draws[:, 0]) * count).astype(np.int64), count - 1)
        return np.array(self.order, np.int64)[place] if self.order else place

    def dimension(self, interface: Interface) -> int:
        """Return the number of standard normal draws of a sample."""
        return 1 + max(int(own.max(initial=0)) for own in _columns(self, interface))

    def draws(self, interface: Interface, samples: int, seed: int, first: int = 0) -> Array:
        """Draw samples `first`, `first` + 1, ..., (samples, dimension)."""
        found = np.full((samples, self.dimension(interface)), np.nan)
        found[:, :1] = WHICH.draw(seed, first, samples)
        for one, own in zip(self.members, _columns(self, interface), strict=True):
            if samples and np.isnan(found[0, own]).any():
                found[:, own] = one.draws(interface, samples, seed, first)
        return found

    def from_draws(self, interface: Interface, draws: Array) -> dict[str, Array]:
        """Map draws (samples, dimension) to profiles by name, (samples, *shape) each."""
        found = {name: np.empty((len(draws), *interface.shape)) for name in self.names}
        selected, columns = self.member(draws), _columns(self, interface)
        for number in np.unique(selected).tolist():
            rows = np.flatnonzero(selected == number)
            own = draws[np.ix_(rows, columns[number])]
            for name, profiles in self.members[number].from_draws(interface, own).items():
                found[name][rows] = profiles
        return found


@lru_cache(maxsize=16)
def _columns(random: EquallyLikely, interface: Interface) -> list[NDArray[np.int64]]:
    """Return the columns of each member's draws among those of all."""
    keys = []
    for one in random.members:
        parts = []
        for stream in layout(one, interface):
            modes = 1 + 2 * stream.ranks[:, None] + np.arange(2)
            own = np.concatenate([np.arange(int(stream.mean_mode)), modes.ravel()])
            parts.append(stream.number * MODES + own)
        keys.append(np.concatenate(parts))
    every = np.unique(np.concatenate(keys))
    return [1 + np.searchsorted(every, own) for own in keys]


def _named(kinds: Mapping[str, Any]) -> str:
    return " and ".join(f"{name} ({of})" if of else name for name, of in kinds.items())


def as_random(given: Any) -> RandomInterface | EquallyLikely:
    """Return what is random; a list of one is that one, of several one that stands for them."""
    if isinstance(given, EquallyLikely):
        return given
    if not isinstance(given, list | tuple):
        return as_random_interface(given)
    found = EquallyLikely(tuple(map(as_random_interface, given)))
    return found if len(found.members) > 1 else found.members[0]
