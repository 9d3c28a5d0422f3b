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
        """Return the interfaces with the factors for new specimens.

        >>> from types import SimpleNamespace as Named
        >>> import stiction as st
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.25), st.SquaredExponentialSpectrum(0.05)
        ... )
        >>> a, b = st.Lognormal(mean=1.0, cv=0.1), st.Lognormal(mean=1.0, cv=0.3)
        >>> known = RandomInterface(
        ...     strength=field, between={"strength": a, "normal_pressure": a}
        ... )
        >>> tests, new = [known, RandomInterface(strength=field)], {"normal_pressure": b}
        >>> scattered = WithFactors._scattered(Named(_between=new), tests)
        >>> [{name: law.cv for name, law in one.between.items()} for one in scattered]
        [{'strength': 0.1, 'normal_pressure': 0.3}, {'normal_pressure': 0.3}]
        >>> WithFactors._scattered(Named(_between={}), tests) == tests
        True
        """
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
    """Return random interfaces, or raise an `InputError` that names the first invalid entry.

    >>> import stiction as st
    >>> field = RandomField(
    ...     st.Lognormal(mean=2e6, cv=0.25), st.SquaredExponentialSpectrum(0.05)
    ... )
    >>> random = RandomInterface(strength=field)
    >>> _known(field) == random, _known([field, random]) == [random, random]
    (True, True)
    >>> mixture = EquallyLikely((random, random))
    >>> _known(mixture) is mixture
    True
    >>> _known([field, 3.0])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: [1] must be a RandomInterface or a RandomField, got 3.0. ...
    """
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

    Examples
    --------
    The means 2 and 3 MPa are proportional to each other, so the first two
    members belong to one group. They are of one kind only if they are
    equal.

    >>> import stiction as st
    >>> def random(mean, cv, **between):
    ...     field = RandomField(
    ...         st.Lognormal(mean=mean, cv=cv), st.SquaredExponentialSpectrum(0.05)
    ...     )
    ...     return RandomInterface(strength=field, between=between or None)
    >>> factor = st.Lognormal(mean=1.0, cv=0.1)
    >>> members = (
    ...     random(2e6, 0.2),
    ...     random(3e6, 0.2),
    ...     random(2e6, 0.3),
    ...     random(2e6, 0.2, critical_slip=factor),
    ... )
    >>> mixture = EquallyLikely(members)
    >>> mixture.kinds.tolist(), mixture.groups.tolist()
    ([0, 1, 2, 0], [0, 0, 1, 0])
    >>> mixture.means.round().tolist(), mixture.names, sorted(mixture.varying)
    ([2000000.0, 3000000.0, 2000000.0, 2000000.0], ('strength',), ['critical_slip', 'strength'])
    >>> laws, numbers = EquallyLikely((random(2e6, 0.2, strength=factor), *members)).factor_laws
    >>> laws == [factor, None], numbers.tolist()
    (True, [0, 1, 1, 1, 1])
    >>> mixture.several, EquallyLikely(members[:1]).several
    (True, False)
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
        """Random properties of the first member.

        >>> import stiction as st
        >>> spectrum = st.SquaredExponentialSpectrum(0.05)
        >>> fields = [
        ...     RandomField(st.Lognormal(mean=mean, cv=0.2), spectrum) for mean in (2e6, 3e6)
        ... ]
        >>> mixture = EquallyLikely(tuple(RandomInterface(strength=field) for field in fields))
        >>> mixture.properties == {"strength": fields[0]}
        True
        """
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

        The strength has two draws below. The draws of one member follow its own
        order, and the draws of several members follow the draw that selects the
        member, in the order of properties.

        >>> import stiction as st
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.25), st.SquaredExponentialSpectrum(0.05)
        ... )
        >>> names, factor = (
        ...     ("critical_slip", "normal_pressure", "strength"),
        ...     st.Lognormal(mean=1.0, cv=0.1),
        ... )
        >>> random = RandomInterface(strength=field, between=dict.fromkeys(names, factor))
        >>> line, single, several = (
        ...     Interface(0.1, 8),
        ...     EquallyLikely((random,)),
        ...     EquallyLikely((random,) * 2),
        ... )
        >>> single.factor_column(line), several.factor_column(line)
        (4, 3)
        >>> single.dimension(line), several.dimension(line)
        (5, 6)
        >>> without = RandomInterface(strength=field, between={"critical_slip": factor})
        >>> EquallyLikely((random, without)).factor_column(line) is None
        True
        """
        if None in self.factor_laws[0]:
            return None
        number = FIRST_FACTOR_STREAM + FACTORS.index("strength")
        streams, _ = _shared(self, interface)
        return next(stream.columns.start for stream in streams if stream.number == number)

    def select(self, draws: Array, rows: NDArray[np.int64], members: NDArray[np.int64]) -> None:
        """Change rows of draws so that they select given members.

        >>> import stiction as st
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.25), st.SquaredExponentialSpectrum(0.05)
        ... )
        >>> mixture = EquallyLikely((RandomInterface(strength=field),) * 3, order=(2, 0, 1))
        >>> draws = np.zeros((3, 2))
        >>> mixture.select(
        ...     draws, np.array([0, 2]), np.array([2, 1])
        ... )  # first and last in the order
        >>> (
        ...     ndtr(draws[:, 0]).round(6).tolist(),
        ...     draws[:, 1].tolist(),
        ...     mixture.member(draws).tolist(),
        ... )
        ([0.166667, 0.5, 0.833333], [0.0, 0.0, 0.0], [2, 0, 1])
        >>> replace(mixture, order=()).select(draws, np.array([1]), np.array([2]))
        >>> ndtr(draws[:, 0]).round(6).tolist()
        [0.166667, 0.833333, 0.833333]
        >>> EquallyLikely(mixture.members[:1]).select(draws, np.array([0]), np.array([0]))
        >>> round(float(ndtr(draws[0, 0])), 6)
        0.166667
        """
        if not self.several:
            return
        count = len(self.members)
        place = np.argsort(self.order) if self.order else np.arange(count)
        # The middle of a member's interval, so that round-off cannot
        # select its neighbour.
        draws[rows, 0] = ndtri((place[members] + 0.5) / count)

    def member(self, draws: Array) -> NDArray[np.int64]:
        """Return the number of the member that each sample selects.

        >>> import stiction as st
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.25), st.SquaredExponentialSpectrum(0.05)
        ... )
        >>> mixture, draws = (
        ...     EquallyLikely((RandomInterface(strength=field),) * 3),
        ...     np.zeros((4, 2)),
        ... )
        >>> draws[:, 0] = ndtri([0.1, 0.6, 0.9, 1.0])
        >>> draws[3, 0] = 40.0  # has the probability 1 in double precision
        >>> (
        ...     mixture.member(draws).tolist(),
        ...     replace(mixture, order=(1, 2, 0)).member(draws).tolist(),
        ... )
        ([0, 1, 2, 2], [1, 2, 0, 0])
        >>> EquallyLikely(mixture.members[:1]).member(draws).tolist()
        [0, 0, 0, 0]
        """
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
        """Map draws (samples, dimension) to profiles (samples, *shape) by name.

        Only the first member has the factor of the slip, and only the second
        has two modes, so it uses the fourth and fifth draw.

        >>> import stiction as st
        >>> def random(mean, length, between):
        ...     field = RandomField(
        ...         st.Lognormal(mean=mean, cv=0.2), st.SquaredExponentialSpectrum(length)
        ...     )
        ...     return RandomInterface(strength=field, between=between)
        >>> factor = st.Lognormal(mean=1.0, cv=0.3)
        >>> mixture = EquallyLikely(
        ...     (random(2e6, 0.06, {"critical_slip": factor}), random(3e6, 0.03, None))
        ... )
        >>> line = Interface(0.1, 8)
        >>> draws = mixture.draws(line, samples=4, seed=5, first=2)
        >>> draws[:, 0] = -1.0, 1.0, 0.5, -0.5
        >>> profiles = mixture.from_draws(line, draws)
        >>> first = mixture.members[0].from_draws(line, draws[[0, 3]][:, [1, 2, 5]])
        >>> second = mixture.members[1].from_draws(line, draws[1:3, 1:5])
        >>> bool((profiles["strength"][[0, 3]] == first["strength"]).all())
        True
        >>> bool((profiles["strength"][1:3] == second["strength"]).all())
        True
        >>> slips = profiles["between.critical_slip"]
        >>> (
        ...     bool((slips[[0, 3]] == first["between.critical_slip"]).all()),
        ...     bool((slips[1:3] == 1.0).all()),
        ... )
        (True, True)
        >>> EquallyLikely(mixture.members[1:]).from_draws(line, draws[:, 1:5])["strength"].shape
        (4, 8)
        >>> again = mixture.draws(line, samples=6, seed=5)[2:]
        >>> bool((again[:, 1:] == draws[:, 1:]).all()), mixture.dimension(line)
        (True, 6)
        """
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

    The first member has the modes 1 and 2, whose draws have the numbers 2
    to 5. The second has the mean mode with the number 0, and the mode 1.

    >>> import stiction as st
    >>> def random(length, mean_mode):
    ...     spectrum = st.SquaredExponentialSpectrum(length)
    ...     field = RandomField(st.Lognormal(mean=2e6, cv=0.2), spectrum, mean_mode=mean_mode)
    ...     return RandomInterface(strength=field)
    >>> members, line = (random(0.03, False), random(0.06, True)), Interface(0.1, 8)
    >>> streams, columns = _shared(EquallyLikely(members), line)
    >>> [(stream.number, stream.numbers.tolist()) for stream in streams], streams[1].columns
    ([(2000, [0]), (0, [0, 2, 3, 4, 5])], slice(1, 6, None))
    >>> [column.tolist() for column in columns]
    [[2, 3, 4, 5], [1, 2, 3]]
    >>> streams, columns = _shared(EquallyLikely(members[1:]), line)
    >>> [stream.number for stream in streams], [column.tolist() for column in columns]
    ([0], [[0, 1, 2]])
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
    """Return the different entries, and for each entry its number among them.

    >>> names, numbers = _numbered(["b", "a", "b", "c", "a"])
    >>> names, numbers.tolist()
    (['b', 'a', 'c'], [0, 1, 0, 2, 1])
    """
    known: dict[Any, int] = {}
    numbers = [known.setdefault(entry, len(known)) for entry in entries]
    return list(known), np.array(numbers, np.int64)


def _named(member: RandomInterface) -> str:
    """Return the properties of an interface for a message.

    >>> from types import SimpleNamespace as Named
    >>> fields = {
    ...     "strength": Named(quantity="friction_coefficient"),
    ...     "critical_slip": Named(quantity=None),
    ... }
    >>> _named(Named(properties=fields))
    'strength (friction_coefficient) and critical_slip'
    """
    fields = member.properties.items()
    return " and ".join(
        f"{name} ({field.quantity})" if field.quantity else name for name, field in fields
    )


def form_of(field: RandomField) -> Any:
    """Return a key that is equal for fields whose values are proportional to each other.

    >>> import stiction as st
    >>> def form(mean=2e6, cv=0.2, length=0.05, **options):
    ...     spectrum = st.SquaredExponentialSpectrum(length)
    ...     return form_of(RandomField(st.Lognormal(mean=mean, cv=cv), spectrum, **options))
    >>> form() == form(mean=3.3e6)
    True
    >>> others = [form(cv=0.3), form(length=0.06), form(mean_mode=True), form(anisotropy=2.0)]
    >>> form() in [*others, form(quantity="friction_coefficient")]
    False
    >>> values = {"x": [0.03], "values": [2.1e6]}
    >>> field = RandomField(st.Lognormal(mean=2e6, cv=0.2), st.SquaredExponentialSpectrum(0.05))
    >>> field = field.given(values, noise=1e5)
    >>> form_of(field) is field
    True
    """
    if field.conditions is not None:
        return field
    relative = field.marginal.distribution.ppf(FORM_SHARES) / field.mean
    shape = tuple(f"{value:.10g}" for value in relative)
    return shape, field.spectrum, field.mean_mode, field.anisotropy, field.quantity


def drawn_from(source: Source, count: int, seed: int) -> EquallyLikely:
    """Return a mixture that holds `count` interfaces from a source.

    >>> from types import SimpleNamespace as Named
    >>> import stiction as st
    >>> spectrum, asked = st.SquaredExponentialSpectrum(0.05), []
    >>> fields = [RandomField(st.Lognormal(mean=mean, cv=0.2), spectrum) for mean in (2e6, 3e6)]
    >>> source = Named(interfaces=lambda count, seed: asked.append((count, seed)) or fields)
    >>> mixture = drawn_from(source, 2, 7)
    >>> mixture.means.round().tolist(), mixture.source is source, asked
    ([2000000.0, 3000000.0], True, [(2, 7)])
    """
    return EquallyLikely(tuple(_known(list(source.interfaces(count, seed)))), source=source)


def specimens_of_fit(random: EquallyLikely) -> int | None:
    """Return `specimens` of the fit if the strength is its `field` alone, otherwise `None`.

    >>> from types import SimpleNamespace as Named
    >>> def member(between):
    ...     return Named(between=between, strength=Named(specimens_of_fit=5), properties={})
    >>> alone, factor = member(None), member({"strength": "its law"})
    >>> [specimens_of_fit(EquallyLikely(own)) for own in ((alone,), (factor,), (alone, alone))]
    [5, None, None]
    """
    member = random.members[0]
    return None if random.several or member.between else member.strength.specimens_of_fit


def as_random(given: Any, seed: int = 0) -> EquallyLikely:
    """Return one interface, or several from a list or a source.

    >>> from types import SimpleNamespace as Named
    >>> import stiction as st
    >>> spectrum, asked = st.SquaredExponentialSpectrum(0.05), []
    >>> fields = [RandomField(st.Lognormal(mean=mean, cv=0.2), spectrum) for mean in (2e6, 3e6)]
    >>> len(as_random(fields[0]).members), len(as_random(fields).members)
    (1, 2)
    >>> mixture = as_random(fields)
    >>> as_random(mixture) is mixture
    True
    >>> source = Named(interfaces=lambda count, seed: asked.append((count, seed)) or fields)
    >>> as_random(source, 7).source is source, asked
    (True, [(1000, 7)])
    """
    known = _known(given)
    if isinstance(known, EquallyLikely):
        return known
    if isinstance(known, Source):
        return drawn_from(known, FIRST_MEMBERS, seed)
    return EquallyLikely(tuple(known) if isinstance(known, list) else (known,))
