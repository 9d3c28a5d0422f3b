"""The random interface: everything that is random along it, and how it is correlated."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property, lru_cache, reduce
from itertools import chain
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from stiction.arrays import Array
from stiction.errors import InputError, unknown_name
from stiction.friction import SCALES
from stiction.interface import Interface
from stiction.model import Number, Real, check_memory, checked, describe, model
from stiction.random.conditioning import Conditioning
from stiction.random.mapping import from_normal
from stiction.random.marginals import AnyMarginal
from stiction.random.random_field import RandomField
from stiction.random.synthesis import BLOCK, Stream, block_of
from stiction.variables import PROFILES

NAMES = tuple(PROFILES)
COEFFICIENTS = ("strength", "residual_strength", "initial_stress")  # or stresses
BETWEEN = 1000  # number of the stream of draws of the first property's factor
DEFINITE = 1e-12  # round-off of eigenvalues of a correlation matrix


def _pairs(value: Any) -> Any:
    """{("a", "b"): rho} or {"a": {"b": rho}} as the latter, each pair once, in order of names."""
    if not isinstance(value, Mapping):
        return value
    found: dict[str, dict[str, Any]] = {}
    for key, inner in value.items():
        nested = inner if isinstance(inner, Mapping) else {None: inner}
        for other, rho in nested.items():
            pair = key if other is None else (key, other)
            if not isinstance(pair, tuple) or len({*pair}) != 2 or len(pair) != 2:
                raise InputError(f"must name two different properties, got {describe(pair)}")
            first, second = sorted(map(str, pair), key=[*NAMES, *map(str, pair)].index)
            if second in found.setdefault(first, {}):
                raise InputError(f"{first}, {second}: given twice")
            found[first][second] = rho
    return found


Coefficient = Annotated[Real, Field(ge=-1.0, le=1.0)]
Correlation = Annotated[dict[str, dict[str, Coefficient]], BeforeValidator(_pairs)]


def lower_factor(matrix: Array) -> Array:
    """L with L L^T = matrix, lower triangular, of a matrix that may be singular."""
    size = matrix.shape[0]
    factor = np.zeros_like(matrix)
    for j in range(size):
        pivot = matrix[j, j] - float(factor[j, :j] @ factor[j, :j])
        if pivot <= DEFINITE:
            continue  # property j follows from those before it
        root = factor[j, j] = np.sqrt(pivot)
        factor[j + 1 :, j] = (matrix[j + 1 :, j] - factor[j + 1 :, :j] @ factor[j, :j]) / root
    return factor


@model(kw_only=True)
class RandomInterface:
    """The random properties of an interface: the strength, and any others that vary.

    Parameters
    ----------
    strength : RandomField
        Peak strength, Pa; or friction coefficients, with ``of="friction_coefficient"``, which
        are multiplied by the normal pressure. The other stresses may be coefficients too.
    residual_strength, initial_stress, normal_pressure : RandomField, optional
        Pa.
    weakening_rate, critical_slip, fracture_energy : RandomField, optional
        At most one of them: Pa/m, m or J/m².
    correlation : mapping, optional
        Correlation coefficients of the Gaussian fields of two properties, mode by mode:
        ``{("strength", "residual_strength"): 0.8}``, in a study file
        ``correlation.strength.residual_strength = 0.8``. Other pairs are independent.
    between : mapping, optional
        Marginals of positive factors with mean 1 that differ from specimen to specimen and
        are constant along each: ``{"strength": st.Lognormal(mean=1.0, cv=0.1)}``.

    Notes
    -----
    Correlated translation fields after Grigoriu (1995): the draws of a property combine, by
    the Cholesky factor of the correlation matrix, draws of its own and of the properties
    before it in the list above. Where spectra differ, the correlation of the fields at a
    point is a little less than that of the modes.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=1.0)
    >>> residual = st.RandomField(st.Lognormal(mean=0.3e6, cv=0.1), strength.spectrum)
    >>> random = st.RandomInterface(
    ...     strength=strength,
    ...     residual_strength=residual,
    ...     correlation={("strength", "residual_strength"): 0.8},
    ... )
    >>> random.profiles(problem.interface, samples=2, seed=1)["residual_strength"].shape
    (2, 256)
    """

    strength: RandomField
    residual_strength: RandomField | None = None
    initial_stress: RandomField | None = None
    weakening_rate: RandomField | None = None
    critical_slip: RandomField | None = None
    fracture_energy: RandomField | None = None
    normal_pressure: RandomField | None = None
    correlation: Correlation | None = None
    between: dict[str, AnyMarginal] | None = None

    @field_validator(*NAMES, mode="before")
    @classmethod
    def _name_quantity(cls, field: Any, info: ValidationInfo) -> Any:
        """Pass the quantity of a measured profile to the reader of a study file."""
        if info.context is not None and isinstance(field, dict):
            coefficient = field.get("of") is not None
            info.context["quantity"] = (
                "friction_coefficient" if coefficient else info.field_name
            )
        return field

    @model_validator(mode="after")
    def _consistent(self) -> RandomInterface:
        problems = [
            f"{name}: of = 'friction_coefficient' is for stresses; leave it out"
            for name, field in self.properties.items()
            if field.of is not None and name not in COEFFICIENTS
        ]
        scales = [name for name in SCALES if name in self.properties]
        if len(scales) > 1:
            problems.append(
                f"give at most one of {', '.join(SCALES)}, got {' and '.join(scales)}"
            )
        correlated, between = self.correlation or {}, self.between or {}
        tables = {
            "correlation": [*correlated, *chain(*correlated.values())],
            "between": between,
        }
        problems += [
            unknown_name(table, name, self.names)
            for table, given in tables.items()
            for name in given
            if name not in self.names
        ]
        for name, marginal in between.items():
            mean, low = marginal.distribution.mean(), marginal.distribution.support()[0]
            if low < 0.0 or abs(float(mean) - 1.0) > 1e-6:
                problems.append(
                    f"between.{name}: a factor must be positive with mean 1, got mean {mean:g} and"
                    f" lower bound {low:g}"
                )
        if not problems and np.linalg.eigvalsh(self.matrix)[0] < -DEFINITE:
            problems.append(
                "correlation: these coefficients contradict each other (their matrix is not"
                " positive definite); bring them nearer to 0"
            )
        if problems:
            raise InputError(problems)
        return self

    @cached_property
    def properties(self) -> dict[str, RandomField]:
        """The random properties by name, in the order of `stiction.results.PROFILES`."""
        return {name: getattr(self, name) for name in NAMES if getattr(self, name) is not None}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the random properties."""
        return tuple(self.properties)

    @property
    def matrix(self) -> Array:
        """Correlation matrix of the properties, in the order of `names`."""
        matrix = np.eye(len(self.names))
        for one, others in (self.correlation or {}).items():
            for other, rho in others.items():
                i, j = self.names.index(one), self.names.index(other)
                matrix[i, j] = matrix[j, i] = rho
        return matrix

    @property
    def linked(self) -> Array:
        """Whether properties are correlated, directly or through others."""
        return np.linalg.matrix_power(self.matrix != 0.0, len(self.names))

    def dimension(self, interface: Interface) -> int:
        """Return the number of standard normal draws of a sample."""
        return int(_layout(self, interface)[-1].columns.stop)

    @checked
    def draws(
        self, interface: Interface, samples: Number, seed: Number, first: Number = 0
    ) -> Array:
        """Draw the independent standard normal numbers of samples `first`, `first` + 1, ....

        Draw j of a property of sample i depends on (seed, property, i, j) only. Returned are
        (samples, dimension): each property in the order of `names`, then those of `between`.
        """
        each = self.dimension(interface) + len(self.names) * interface.size
        check_memory("samples", 8.0 * min(samples, 2**62) * each)
        parts = [stream.draw(seed, first, samples) for stream in _layout(self, interface)]
        return parts[0] if len(parts) == 1 else np.concatenate(parts, axis=1)

    def from_draws(self, interface: Interface, draws: Array) -> dict[str, Array]:
        """Map draws (samples, dimension) to profiles by name, (samples, *shape) each."""
        for columns, known in _conditioned(self, interface):
            draws = draws.copy()
            draws[:, columns] = known.draws(draws[:, columns])
        streams, found = _layout(self, interface), {}
        independent = [draws[:, stream.columns] for stream in streams]
        rows = zip(self.properties.items(), streams, lower_factor(self.matrix), strict=False)
        for (name, field), stream, row in rows:
            mixed = sum(row[j] * independent[j] for j in np.flatnonzero(row))
            own = np.take(mixed, stream.own, axis=1)
            found[name] = from_normal(field.marginal, field.gaussian(interface, own))
        factors = zip((self.between or {}).items(), independent[len(found) :], strict=True)
        for (name, marginal), u in factors:
            found[name] *= from_normal(marginal, u).reshape(-1, *(1 for _ in interface.shape))
        return found

    def profiles(
        self, interface: Interface, *, samples: int = 1, seed: int = 0, first: int = 0
    ) -> dict[str, Array]:
        """Sample profiles by name, (samples, *shape) each; sample i depends on (seed, i) only."""
        return self.from_draws(interface, self.draws(interface, samples, seed, first))

    def warn_if_inaccurate(self, interface: Interface) -> None:
        """Warn if the grid is too coarse or the interface too short for a field."""
        for field in self.properties.values():
            field.warn_if_inaccurate(interface)
        for _, known in _conditioned(self, interface):
            known.warn()


@lru_cache(maxsize=256)
def _layout(random: RandomInterface, interface: Interface) -> list[Stream]:
    """Draws of each property, and of each factor between specimens."""
    fields = list(random.properties.values())
    found, start, block = [], 0, block_of(len(interface.shape))
    for name, field, row in zip(random.names, fields, random.linked, strict=True):
        group = [fields[j] for j in np.flatnonzero(row)]
        ranks = reduce(np.union1d, [one.modes(interface).ranks for one in group])
        mean_mode = any(one.mean_mode for one in group)
        columns = slice(start, start + 2 * ranks.size + int(mean_mode))
        places = np.searchsorted(ranks, field.modes(interface).ranks)
        pairs = int(mean_mode) + 2 * places[:, None] + np.arange(2)
        own = np.concatenate((np.arange(int(field.mean_mode)), pairs.ravel()))
        found.append(Stream(NAMES.index(name), block, ranks, mean_mode, columns, own))
        start = columns.stop
    none = np.arange(0)
    for column, name in enumerate(random.between or (), start):
        number, columns = BETWEEN + NAMES.index(name), slice(column, column + 1)
        found.append(Stream(number, BLOCK, none, True, columns, none))
    return found


@lru_cache(maxsize=16)
def _conditioned(
    random: RandomInterface, interface: Interface
) -> list[tuple[NDArray[np.int64], Conditioning]]:
    """Measured values of each group of correlated properties, with the columns of its draws.

    The last column is that of the factor between specimens on which it depends, if any.
    """
    streams, fields = _layout(random, interface), list(random.properties.values())
    columns, between = [np.r_[stream.columns] for stream in streams], random.between or {}
    factor, found = lower_factor(random.matrix), []
    for group in np.unique(random.linked, axis=0):
        members, measured, factors = np.flatnonzero(group), [], []
        of_group = np.concatenate([columns[j] for j in members])
        for i in members:
            if fields[i].conditions is None:
                continue
            name = random.names[i]
            if name in between:
                factors.append(name)
            one = fields[i].measured(interface, between.get(name))
            phi = np.zeros((len(one.phi), random.dimension(interface)))
            for j in np.flatnonzero(factor[i]):
                phi[:, columns[j][streams[i].own]] = factor[i, j] * one.phi
            measured.append(one._replace(phi=phi[:, of_group]))
        if len(factors) > 1:
            raise InputError(
                f"between: {' and '.join(factors)} are correlated, were measured and have factors;"
                " at most one of them may have one"
            )
        if measured:
            last = [columns[len(fields) + list(between).index(name)] for name in factors]
            found.append((np.concatenate([of_group, *last]), Conditioning(measured)))
    return found


def as_random_interface(given: Any) -> RandomInterface:
    """Return a `RandomInterface`; a bare `RandomField` becomes the strength of one."""
    if isinstance(given, RandomField):
        return RandomInterface(strength=given)
    if not isinstance(given, RandomInterface):
        raise InputError(
            f"random: must be a RandomInterface or a RandomField, got {describe(given)}; a"
            " profile goes into st.onset, and st.fit_field fits a field to it"
        )
    return given
