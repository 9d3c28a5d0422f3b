"""The random input of a computation: one random interface, or several that are equally likely.

`EquallyLikely` is the only protocol for random inputs, so that one search
for failures covers all members. For several members:

1. Collect the draws of all members. Members share one draw for the same
   property and mode (`_shared`).
2. Map the first draw to a uniform number, which selects the member
   (`EquallyLikely.member`).
3. Let this member map the other draws that it uses to profiles
   (`EquallyLikely.from_draws`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import chain
from typing import Annotated, Any, Protocol, Self, TypeAlias, runtime_checkable

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, SkipValidation
from scipy.special import ndtr, ndtri

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed
from stiction.problem.interface import Interface
from stiction.random.fields import (
    FACTOR,
    RandomField,
    RandomInterface,
    as_random_interface,
    check_draws,
)
from stiction.random.synthesis import (
    FACTORS,
    FIRST_DRAW,
    FIRST_FACTOR_STREAM,
    SAMPLES_PER_BLOCK,
    Stream,
    draws_of,
    layout,
)

MEMBER_STREAM = Stream(2000, SAMPLES_PER_BLOCK, FIRST_DRAW)
"""Stream of the draw that selects a member."""

FORM_SHARES = np.array([0.05, 0.5, 0.95])
"""Probabilities whose quantiles over the mean tell marginals apart."""
FIRST_MEMBERS, MAX_MEMBERS = 1_000, 8_000
"""Number of members drawn from a source at first, and at most."""


@runtime_checkable
class Source(Protocol):
    """Source that returns any number of equally likely interfaces, such as a fit or a posterior."""

    def interfaces(self, count: int, seed: int = 0) -> list[RandomInterface]:
        """Return `count` equally likely interfaces."""


class WithFactors:
    """Source whose interfaces also have factors of constants, such as the preload of new joints."""

    _between: Mapping[str, Any]

    def with_between(self, between: Mapping[str, Any]) -> Self:
        """Return the source for new specimens, in which constants scatter between specimens.

        Scatter of constants that was already present in the tests
        explains a part of the scatter of the peaks. State such scatter
        before `infer`, in ``RandomInterface(between=)``. State here the
        scatter that only new joints have.

        Parameters
        ----------
        between : mapping
            Distributions with mean 1, as in `RandomInterface`, such as
            ``{"pressing_force": Lognormal(mean=1.0, cv=0.05)}``. The
            factor of the strength is inferred, and cannot be given.

        Examples
        --------
        >>> import stiction as st
        >>> problem = st.paper.problem(nodes=512)
        >>> strength = st.paper.strength(problem, correlation_ratio=0.5)
        >>> method = st.LocalCriterion()
        >>> tests = st.infer(
        ...     problem, strength, [0.70, 0.71, 0.74], unit="MPa", method=method, samples=100
        ... )
        >>> joints = tests.with_between({"normal_pressure": st.Lognormal(mean=1.0, cv=0.05)})
        >>> sorted(joints.interfaces(1)[0].between)
        ['normal_pressure', 'strength']
        """
        if "strength" in between:
            raise InputError("between: strength: is inferred. State it in prior= of st.infer")
        return replace(self, _between=dict(between))  # type: ignore[type-var]

    def _scattered(self, interfaces: Sequence[RandomInterface]) -> list[RandomInterface]:
        if not self._between:
            return list(interfaces)
        factors = [{**(one.between or {}), **self._between} for one in interfaces]
        return [replace(one, between=own) for one, own in zip(interfaces, factors, strict=True)]


@runtime_checkable
class Predictive(Protocol):
    """Source that predicts the onset of one further specimen, also with changed constants."""

    def prediction(
        self, problem: Any, method: Any, changes: Mapping[str, float], workers: int | None
    ) -> Any:
        """Return an object with `families` and ``quantile(probability, family)``, Pa, or None."""


def _known(given: Any) -> Any:
    """Return random interfaces, or raise an `InputError` that names the first invalid entry."""
    if isinstance(given, Source | EquallyLikely):
        return given
    if not isinstance(given, list | tuple):
        return as_random_interface(given)
    interfaces = []
    for number, entry in enumerate(given):
        with prefixed(f"[{number}]", " "):
            interfaces.append(as_random_interface(entry))
    return interfaces


AnyRandom: TypeAlias = Annotated[
    RandomInterface | RandomField | Source | Sequence[RandomInterface | RandomField],
    SkipValidation, BeforeValidator(_known), "RandomInterface | RandomField | list",
]  # fmt: skip
"""A random interface or field, a list of equally likely interfaces, or
their source."""


@dataclass(frozen=True, eq=False)
class EquallyLikely:
    """One random interface, or several that are equally likely: the random input of every method.

    If there are several, the first draw of a sample selects the member.
    All members use the same draw for a property and a mode, so that the
    profiles of a sample keep their form if its member changes. A single
    member needs no such first draw.
    """

    members: tuple[RandomInterface, ...]
    order: tuple[int, ...] = ()  # of the members along the first draw; empty keeps their order
    source: Source | None = None  # from which the members were drawn

    def __post_init__(self) -> None:
        if not self.members:
            raise InputError("random: needs at least one random interface, got an empty list")
        first = _named(self.members[0])
        for number, member in enumerate(self.members):
            if (named := _named(member)) != first:
                raise InputError(
                    "random: equally likely interfaces need the same properties, all as stresses or"
                    f" all as coefficients. [0] has {first}, but [{number}] has {named}"
                )

    @property
    def several(self) -> bool:
        """Whether there are several members."""
        return len(self.members) > 1

    @property
    def properties(self) -> dict[str, RandomField]:
        """Random properties of the first member."""
        return self.members[0].properties

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the random properties."""
        return self.members[0].names

    @cached_property
    def varying(self) -> set[str]:
        """Names of properties that differ between samples: random properties, or with a factor."""
        return set().union(*(member.varying for member in self.members))

    @cached_property
    def kinds(self) -> NDArray[np.int64]:
        """Kind of each member, as a number.

        Members with equal fields are of the same kind.
        """
        return _numbered([tuple(member.properties.items()) for member in self.members])[1]

    @cached_property
    def groups(self) -> NDArray[np.int64]:
        """Number of each member's group. The strengths in a group are proportional."""
        return _numbered([form_of(member.strength) for member in self.members])[1]

    @cached_property
    def means(self) -> Array:
        """Mean strength for each member."""
        return np.array([member.strength.mean for member in self.members])

    @cached_property
    def factor_laws(self) -> tuple[list[Any], NDArray[np.int64]]:
        """Distributions of the strength's factor, and each member's number among them."""
        return _numbered([(member.between or {}).get("strength") for member in self.members])

    def factor_column(self, interface: Interface) -> int | None:
        """Return the column of the draw for the strength's factor, or `None` if
        a member has no factor.
        """
        if None in self.factor_laws[0]:
            return None
        number = FIRST_FACTOR_STREAM + FACTORS.index("strength")
        streams, _ = _shared(self, interface)
        return next(stream.columns.start for stream in streams if stream.number == number)

    def select(self, draws: Array, rows: NDArray[np.int64], members: NDArray[np.int64]) -> None:
        """Change rows of draws so that they select given members."""
        if not self.several:
            return
        count = len(self.members)
        place = np.argsort(self.order) if self.order else np.arange(count)
        # The middle of a member's interval, so that round-off cannot
        # select its neighbour.
        draws[rows, 0] = ndtri((place[members] + 0.5) / count)

    def member(self, draws: Array) -> NDArray[np.int64]:
        """Return the number of the member that each sample selects."""
        if not self.several:
            return np.zeros(len(draws), np.int64)
        count = len(self.members)
        place = np.minimum((ndtr(draws[:, 0]) * count).astype(np.int64), count - 1)
        return np.array(self.order, np.int64)[place] if self.order else place

    def dimension(self, interface: Interface) -> int:
        """Return the number of standard normal draws in a sample."""
        return int(_shared(self, interface)[0][-1].columns.stop)

    def draws(self, interface: Interface, samples: int, seed: int, first: int = 0) -> Array:
        """Draw samples `first`, `first` + 1, ... as an array (samples, dimension)."""
        return draws_of(_shared(self, interface)[0], interface, samples, seed, first)

    def from_draws(self, interface: Interface, draws: Array) -> dict[str, Array]:
        """Map draws (samples, dimension) to profiles (samples, *shape) by name."""
        if not self.several:
            return self.members[0].from_draws(interface, draws)
        check_draws(draws, self.dimension(interface))
        profiles = {name: np.empty((len(draws), *interface.shape)) for name in self.names}
        for name in self.varying - {*self.names}:  # of members without such a factor it is 1
            profiles[FACTOR + name] = np.ones((len(draws), *interface.shape))
        selected, columns = self.member(draws), _shared(self, interface)[1]
        for number in np.unique(selected).tolist():
            rows = np.flatnonzero(selected == number)
            of_member = draws[np.ix_(rows, columns[number])]
            sampled = self.members[number].from_draws(interface, of_member)
            for name, values in sampled.items():
                profiles[name][rows] = values
        return profiles


@lru_cache(maxsize=16)
def _shared(
    random: EquallyLikely, interface: Interface
) -> tuple[list[Stream], list[NDArray[np.int64]]]:
    """Return the streams of all members together, and the columns that each member uses.

    Of several members, the first stream selects the member, and a stream
    holds the draws that any member uses.
    """
    layouts = [layout(member, interface) for member in random.members]
    if not random.several:
        return layouts[0], [np.arange(layouts[0][-1].columns.stop)]
    joined: dict[int, Stream] = {}
    for stream in chain.from_iterable(layouts):
        known = joined.setdefault(stream.number, stream).numbers
        joined[stream.number] = stream._replace(numbers=np.union1d(known, stream.numbers))
    start = 1
    for number in sorted(joined):
        stop = start + joined[number].numbers.size
        joined[number] = joined[number]._replace(columns=slice(start, stop))
        start = stop
    columns = [
        np.concatenate([joined[stream.number].places_of(stream.numbers) for stream in own])
        for own in layouts
    ]
    return [MEMBER_STREAM, *(joined[number] for number in sorted(joined))], columns


def _numbered(entries: Sequence[Any]) -> tuple[list[Any], NDArray[np.int64]]:
    """Return the different entries, and for each entry its number among them."""
    known: dict[Any, int] = {}
    numbers = [known.setdefault(entry, len(known)) for entry in entries]
    return list(known), np.array(numbers, np.int64)


def _named(member: RandomInterface) -> str:
    fields = member.properties.items()
    return " and ".join(
        f"{name} ({field.quantity})" if field.quantity else name for name, field in fields
    )


def form_of(field: RandomField) -> Any:
    """Return a key that is equal for fields whose values are proportional to each other."""
    if field.conditions is not None:
        return field
    relative = field.marginal.distribution.ppf(FORM_SHARES) / field.mean
    shape = tuple(f"{value:.10g}" for value in relative)
    return shape, field.spectrum, field.mean_mode, field.anisotropy, field.quantity


def drawn_from(source: Source, count: int, seed: int) -> EquallyLikely:
    """Return a mixture that holds `count` interfaces from a source."""
    return EquallyLikely(tuple(_known(list(source.interfaces(count, seed)))), source=source)


def specimens_of_fit(random: EquallyLikely) -> int | None:
    """Return `specimens` of the fit if the strength is its `field` alone, otherwise `None`."""
    member = random.members[0]
    return None if random.several or member.between else member.strength.specimens_of_fit


def as_random(given: Any, seed: int = 0) -> EquallyLikely:
    """Return one interface, or several from a list or a source."""
    known = _known(given)
    if isinstance(known, EquallyLikely):
        return known
    if isinstance(known, Source):
        return drawn_from(known, FIRST_MEMBERS, seed)
    return EquallyLikely(tuple(known) if isinstance(known, list) else (known,))
