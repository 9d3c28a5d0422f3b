"""Random fields, and the random interface that holds all random properties.

Problem: map independent standard normal draws to profiles
of correlated properties. Each property is a translation
field (M. Grigoriu, Applied Non-Gaussian Processes, 1995).
`layout` assigns the draws to properties and modes.

Algorithm (`RandomInterface.from_draws`)
----------------------------------------
1. Condition the draws on measured values (`conditioning`).
2. Combine a property's own draws with the draws of earlier properties
   by the Cholesky factor of the correlation matrix (`lower_factor`).
3. Synthesise the Gaussian field z from its modes (`synthesis`), and map it
   to the marginal (`mapping`).
4. Multiply by the factors between specimens. Each factor takes one draw.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping
from functools import cached_property, reduce
from itertools import chain
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator
from scipy.optimize import brentq
from scipy.special import ndtri

from stiction.base.arrays import Array
from stiction.base.errors import InputError, unknown_name, warn_accuracy
from stiction.base.model import (
    Converted,
    Flag,
    Listed,
    Number,
    Positive,
    Real,
    RealArray,
    checked,
    describe,
    model,
)
from stiction.base.units import is_in
from stiction.problem.friction import SCALES
from stiction.problem.interface import Interface
from stiction.random.conditioning import MIN_PIVOT, Conditions, conditioning_of, lower_factor
from stiction.random.mapping import correlation_of_mapped, from_normal, hermite_coefficients
from stiction.random.marginals import AnyMarginal, AnyMarginals
from stiction.random.spectra import Share, Spectrum, lag_of_correlation
from stiction.random.synthesis import FACTORS, NAMES, Modes, draws_of, layout, make_modes

MAY_BE_COEFFICIENTS = ("strength", "residual_strength", "initial_stress")
FACTOR = "between."  # begins the name of a factor among profiles, if its property is not random
# Limits of warnings
MAX_UNRESOLVED = 0.01  # fraction of the variance that the grid does not resolve
MAX_MEAN_SHARE = 0.075  # fraction of the variance that the mean mode would hold
MAX_CORRELATION_ERROR = 0.01


@model
class RandomField(Listed):
    """Stationary, periodic, non-Gaussian random field F^-1(Phi(z(x))).

    Parameters
    ----------
    marginal : Beta, ..., or frozen continuous scipy.stats distribution
        Distribution F of the field at a point.
    spectrum : PowerLawSpectrum, ..., CustomSpectrum
        Power spectral density of the Gaussian field z.
    mean_mode : bool
        Whether z has the mean mode, k = 0. Without this mode, as in
        Albertini et al. (2020), the mean of z is the same in every
        sample, which is harmless on long interfaces only.
    anisotropy : float, optional
        On a plane, the correlation length along y over the correlation
        length along x, which the spectrum gives. By default 1.
    quantity : {"friction_coefficient"}, optional
        Declares that the field holds friction coefficients, which are
        multiplied by the normal pressure.
    conditions : Conditions, optional
        Measured values, as `given` sets them: ``profile`` and ``noise``.

    Notes
    -----
    The field is a translation process (Grigoriu, 1995), and z is sampled by its spectral
    representation (Shinozuka and Deodatis, 1991), as in Albertini et al. (2020), Eqs. 2 to 7.

    Examples
    --------
    >>> import stiction as st
    >>> field = st.RandomField(
    ...     st.Lognormal(mean=1e6, cv=0.2), st.PowerLawSpectrum(correlation_length=2e-3)
    ... )
    >>> field.sample(st.Interface(length=0.1, nodes=512), samples=3, seed=1).shape
    (3, 512)
    """

    marginal: AnyMarginal
    spectrum: Spectrum
    mean_mode: Flag = False
    anisotropy: Positive | None = None
    quantity: Literal["friction_coefficient"] | None = None
    conditions: Conditions | None = None
    _shown = "efolding_length", "given", "mean", "quantile", "sample", "standard_deviation"
    specimens_of_fit: ClassVar[int | None] = None
    """Set for `FieldFit.field`: `specimens` of its fit, so that a call can ask for the fit."""

    @property
    def mean(self) -> float:
        """Field mean, in its unit (Pa for strength).

        >>> import stiction as st
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.25), st.SquaredExponentialSpectrum(0.05)
        ... )
        >>> round(field.mean), round(field.standard_deviation)
        (2000000, 500000)
        """
        return float(self.marginal.distribution.mean())

    @property
    def standard_deviation(self) -> float:
        """Standard deviation of the field, in its unit."""
        return float(self.marginal.distribution.std())

    @checked
    def modes(self, interface: Interface) -> Modes:
        """Return the modes of the field on an interface, or raise an `InputError` without modes.

        >>> import stiction as st
        >>> marginal, spectrum = (
        ...     st.Lognormal(mean=2e6, cv=0.2),
        ...     st.SquaredExponentialSpectrum(0.05),
        ... )
        >>> plane = Interface((0.3, 0.2), (16, 8))
        >>> field = RandomField(marginal, spectrum, mean_mode=True, anisotropy=0.7)
        >>> field.modes(plane) is make_modes(spectrum, True, 0.7, plane)
        True
        >>> RandomField(marginal, spectrum).modes(plane) is make_modes(
        ...     spectrum, False, 1.0, plane
        ... )
        True
        """
        if self.anisotropy is not None and not interface.is_plane:
            raise InputError(
                f"anisotropy: applies to planes only, got {self.anisotropy:g}. Leave it out"
            )
        return make_modes(self.spectrum, self.mean_mode, self.anisotropy or 1.0, interface)

    @checked
    def given(self, profile: Any, *, noise: Positive) -> RandomField:
        """Return the field conditioned on measured values, which stays random at other places.

        Parameters
        ----------
        profile : xarray.DataArray over x (m), on a plane over x and y
            Values at any places, in the field's unit. NaN is missing.
        noise : float
            Standard deviation of the measurement error, in this unit.

        >>> import stiction as st
        >>> import xarray as xr
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.2), st.SquaredExponentialSpectrum(0.05)
        ... )
        >>> def measured(units):
        ...     return xr.DataArray(
        ...         [1.5, 0.5], {"x": [0.01, 0.03]}, ("x",), attrs={"units": units}
        ...     )
        >>> known = field.given(measured("MPa"), noise=1e4)
        >>> (
        ...     known.conditions.values.tolist(),
        ...     known.conditions.noise,
        ...     known.marginal == field.marginal,
        ... )
        ([1500000.0, 500000.0], 10000.0, True)
        >>> coefficient = dataclasses.replace(field, quantity="friction_coefficient")
        >>> for one, units in (
        ...     (field, "1"),
        ...     (coefficient, "MPa"),
        ...     (known, "MPa"),
        ...     (coefficient, "%"),
        ... ):
        ...     try:
        ...         print(one.given(measured(units), noise=1e4).conditions.values.tolist())
        ...     except InputError as error:
        ...         print(str(error)[:44])
        profile: has the unit 1. Only a field with q
        profile: has the unit MPa. Only a field with
        profile: the field already has a profile. Co
        [0.015, 0.005]
        """
        if self.conditions is not None:
            raise InputError("profile: the field already has a profile. Combine both profiles")
        stated = str(getattr(profile, "attrs", {}).get("units") or "")
        if stated and is_in(stated, "1") != (self.quantity is not None):
            raise InputError(
                f"profile: has the unit {stated}. Only a field with quantity='friction_coefficient'"
                " accepts coefficients (unit 1), and it accepts no other unit"
            )
        conditions: Any = {"profile": profile, "noise": noise}
        return dataclasses.replace(self, conditions=conditions)

    @checked
    def quantile(self, interface: Interface, probability: Share) -> Array:
        """Return the quantile of the field at each node, given the measured values.

        If v = 5 + 2 z was measured as 6 with the error 0.5, z at this place
        has the mean (2 / 0.5) (6 - 5) / 0.5 / 17 and the variance 1 / 17.

        >>> import scipy.stats
        >>> import stiction as st
        >>> field = RandomField(scipy.stats.norm(5.0, 2.0), st.SquaredExponentialSpectrum(0.05))
        >>> known, line = (
        ...     field.given({"x": [0.025], "values": [6.0]}, noise=0.5),
        ...     Interface(0.1, 8),
        ... )
        >>> at_nodes = known.quantile(line, 0.8)
        >>> there = 5.0 + 2.0 * (8.0 / 17.0 + float(ndtri(0.8)) / 17.0**0.5)
        >>> at_nodes.shape, math.isclose(at_nodes[2], there, rel_tol=1e-8)
        ((8,), True)
        >>> everywhere = field.quantile(Interface((0.1, 0.2), (8, 10)), 0.8)
        >>> everywhere.shape, np.allclose(everywhere, 5.0 + 2.0 * float(ndtri(0.8)), rtol=1e-8)
        ((8, 10), True)
        """
        mean, deviation = np.zeros(interface.size), np.ones(interface.size)
        if known := conditioning_of(self._alone, interface):
            grid = np.meshgrid(*interface.coordinates.values(), indexing="ij")
            phi = self.modes(interface).basis(np.array([row.ravel() for row in grid]))
            mean, deviation = known[1].regression.moments(phi)
        # The marginal rises, so quantiles of z become quantiles of the field.
        z = mean + float(ndtri(probability)) * deviation
        return from_normal(self.marginal, z).reshape(interface.shape)

    def sample(
        self, interface: Interface, *, samples: int = 1, seed: int = 0, first: int = 0
    ) -> Array:
        """Return sampled profiles (samples, *shape) in the field's unit.

        Sample i depends on the seed and on i only. An `AccuracyWarning`
        says if the grid is too coarse for the spectrum, or the interface
        too short for a field without mean mode.

        >>> import stiction as st
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.2), st.SquaredExponentialSpectrum(0.008)
        ... )
        >>> line = Interface(0.2, 64)
        >>> fields, alone = (
        ...     field.sample(line, samples=5, seed=3),
        ...     RandomInterface(strength=field),
        ... )
        >>> bool((field.sample(line, samples=2, seed=3, first=3) == fields[3:]).all())
        True
        >>> bool((alone.profiles(line, samples=5, seed=3)["strength"] == fields).all())
        True
        >>> field.sample(line).shape
        (1, 64)
        """
        self._alone.warn_if_inaccurate(interface)
        profiles = self._alone.profiles(interface, samples=samples, seed=seed, first=first)
        return profiles["strength"]

    @cached_property
    def _alone(self) -> RandomInterface:
        """Random interface in which only this field is random."""
        return RandomInterface(strength=self)

    def warn_if_inaccurate(self, interface: Interface) -> None:
        """Warn if the grid is too coarse for the spectrum or the interface too short.

        The modes 1 to 5 hold 3, 2, 1, 1 and 2 parts. Eight nodes resolve
        four modes, and a mean mode would hold 2 / (2 + 9). To lose the last
        mode, the spectrum would lose all modes with two parts or less.

        >>> import stiction as st
        >>> from stiction.base.errors import collect_warnings
        >>> step, marginal = 2.0 * math.pi / 0.1, st.Lognormal(mean=2e6, cv=0.2)
        >>> def warned(density, nodes, mean_mode):
        ...     spectrum = st.CustomSpectrum(lambda k: density(k / step), 5.5 * step)
        ...     field = RandomField(marginal, spectrum, mean_mode=mean_mode)
        ...     with collect_warnings() as texts:
        ...         field.warn_if_inaccurate(Interface(0.1, nodes))
        ...     return [str(text) for text in texts]
        >>> def parts(number):
        ...     return np.abs(number - 3.5) + 0.5
        >>> lost, short = warned(parts, 8, False)
        >>> lost[85:123], lost[148:]
        ('22.2 % of the variance is not resolved', 'give interface.nodes >= 10 or power_kept=0.333')
        >>> short[:67]
        'the field has no mean mode, which would hold 18.2 % of the variance'
        >>> len(warned(parts, 8, True)), warned(parts, 10, True)
        (1, [])
        >>> def little_beyond(number):  # 0.5 % in mode 5
        ...     return np.where(number < 1.5, 1000.0, np.where(number > 4.5, 5.0, 4.0))
        >>> warned(little_beyond, 8, True)
        []
        """
        modes = self.modes(interface)
        lost, short = modes.unresolved
        if lost > MAX_UNRESOLVED:
            nodes = " x ".join(map(str, interface.shape))
            enough = " x ".join(map(str, modes.nodes_for(MAX_UNRESOLVED)))
            warn_accuracy(
                f"the grid of {nodes} nodes is coarser than the spectrum: values at the nodes are"
                f" exact, but {100.0 * lost:.3g} % of the variance is not resolved. Check lengths"
                f" (m), and give interface.nodes >= {enough} or power_kept={1.0 - short:.3g}"
            )
        if self.mean_mode:
            return
        # How much would the mean mode hold, if there were one?
        with_mean = make_modes(self.spectrum, True, self.anisotropy or 1.0, interface)
        share = float(with_mean.sigma[0] ** 2)
        if share > MAX_MEAN_SHARE:
            warn_accuracy(
                f"the field has no mean mode, which would hold {100.0 * share:.3g} % of the"
                " variance on so short an interface. RandomField(mean_mode=True) lets the mean vary"
            )

    @checked
    def correlation(
        self, interface: Interface, *, of: Literal["strength", "z"] = "strength"
    ) -> Array:
        """Compute the periodic correlation at the lags ``interface.coordinates``.

        `of` selects the mapped field (with a Hermite expansion:
        Grigoriu, 1995) or z. If the tails of the marginal are too
        heavy, an `AccuracyWarning` gives the error.

        A lognormal field has the correlation (exp(s^2 rho) - 1) / (exp(s^2) -
        1), with s^2 = log(1 + cv^2). A single mode has rho = cos(2 pi x / L).

        >>> import stiction as st
        >>> spectrum = st.CustomSpectrum(np.ones_like, 100.0)
        >>> field, line = (
        ...     RandomField(st.Lognormal(mean=2.0, cv=0.75), spectrum),
        ...     Interface(0.1, 8),
        ... )
        >>> field.correlation(line, of="z").round(6).tolist()
        [1.0, 0.707107, 0.0, -0.707107, -1.0, -0.707107, 0.0, 0.707107]
        >>> expected = (1.5625 ** np.cos(math.pi / 4.0 * np.arange(8.0)) - 1.0) / 0.5625
        >>> np.allclose(field.correlation(line), expected)
        True
        """
        modes = self.modes(interface)
        origin = np.zeros((len(interface.shape), 1))
        rho = modes.gaussian(modes.basis(origin))[0]  # correlation of z with z at the origin
        return rho if of == "z" else correlation_of_mapped(rho, self._map_coefficients())

    def _map_coefficients(self) -> Array:
        """Return c_0, c_1, ... of `mapping`, or warn about a large remainder.

        >>> import stiction as st
        >>> spectrum = st.SquaredExponentialSpectrum(0.05)
        >>> field = RandomField(st.Lognormal(mean=2.0, cv=0.75), spectrum)
        >>> s = math.log(1.5625) ** 0.5
        >>> np.allclose(field._map_coefficients()[:3], [2.0, 2.0 * s, 2.0 * s**2 / 2.0**0.5])
        True
        """
        coefficients = hermite_coefficients(self.marginal)
        # The last coefficient represents the
        # terms that the expansion leaves out.
        error = float(coefficients[-1] ** 2 / np.sum(coefficients[1:] ** 2))
        if error > MAX_CORRELATION_ERROR:
            warn_accuracy(
                f"the correlation of the strength is uncertain by up to {error:.2g}: the tails of"
                " its marginal are too heavy, or its jumps too sharp, for the expansion"
            )
        return coefficients

    def efolding_length(self) -> float:
        """Return the distance (m) at which the correlation of the field first falls to 1/e.

        `spectrum.efolding_length` is the distance for z. On a plane, it is along x.

        A lognormal field has the correlation 1/e where (1 + cv^2)^rho = 1 +
        cv^2 / e.

        >>> import stiction as st
        >>> spectrum = st.SquaredExponentialSpectrum(0.05)
        >>> field = RandomField(st.Lognormal(mean=2.0, cv=0.75), spectrum)
        >>> rho = math.log(1.0 + 0.5625 / math.e) / math.log(1.5625)
        >>> math.isclose(
        ...     field.efolding_length(), lag_of_correlation(spectrum, rho), rel_tol=1e-6
        ... )
        True
        """
        coefficients = self._map_coefficients()

        def excess(rho: float) -> float:
            return float(correlation_of_mapped(np.array(rho), coefficients)) - math.exp(-1.0)

        # The correlation of the mapped field rises with the correlation
        # of z: find the value of z.
        return lag_of_correlation(self.spectrum, brentq(excess, 0.0, 1.0, xtol=1e-16))


def _pairs(value: Any) -> Any:
    """Return {("a", "b"): rho} or {"a": {"b": rho}} as {"a": {"b": rho}}, in the order of names.

    >>> _pairs({("residual_strength", "strength"): 0.5, "critical_slip": {"strength": 0.25}})
    {'strength': {'residual_strength': 0.5, 'critical_slip': 0.25}}
    >>> _pairs({("strengthh", "strength"): 0.5, "initial_stress": {"a": 1, "strength": 2}})
    {'strength': {'strengthh': 0.5, 'initial_stress': 2}, 'initial_stress': {'a': 1}}
    >>> _pairs(3.0)
    3.0
    >>> _pairs({"strength": 0.5})
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: must name two different properties, got 'strength'
    >>> _pairs({("strength", "normal_pressure", "strength"): 0.5})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: must name two different properties, got ('strength', ...)
    """
    if not isinstance(value, Mapping):
        return value
    pairs: dict[str, dict[str, Any]] = {}
    for key, inner in value.items():
        nested = inner if isinstance(inner, Mapping) else {None: inner}
        for second_key, rho in nested.items():
            pair = key if second_key is None else (key, second_key)
            if not isinstance(pair, tuple) or len({*pair}) != 2 or len(pair) != 2:
                raise InputError(f"must name two different properties, got {describe(pair)}")
            first, second = sorted(map(str, pair), key=[*NAMES, *map(str, pair)].index)
            if second in pairs.setdefault(first, {}):
                raise InputError(f"{first}, {second}: given twice")
            pairs[first][second] = rho
    return pairs


Coefficient = Annotated[Real, Field(ge=-1.0, le=1.0)]
Correlation: TypeAlias = Converted[
    Annotated[dict[str, dict[str, Coefficient]], BeforeValidator(_pairs)] | None,
    Mapping[tuple[str, str], float] | Mapping[str, Mapping[str, float]] | None,
]


@model(kw_only=True)
class RandomInterface(Listed):
    """Random properties of an interface: the strength, and any others that vary.

    Parameters
    ----------
    strength : RandomField
        Peak strength, Pa, or with
        ``quantity="friction_coefficient"`` a friction coefficient,
        which is multiplied by the normal pressure.
    residual_strength, initial_stress, normal_pressure : RandomField, optional
        Other stresses, Pa. The first two may also be coefficients.
        Leave random properties out of the problem.
    weakening_rate, critical_slip, fracture_energy : RandomField, optional
        At most one of the three, in Pa/m, m or J/m². If one is random,
        leave all three out of the friction law.
    correlation : mapping, optional
        Correlation coefficients between the Gaussian fields of two
        properties, mode by mode. Example: ``{("strength",
        "residual_strength"): 0.8}``. In a study file, write
        ``correlation.strength.residual_strength = 0.8``. Other pairs
        are independent.
    between : mapping, optional
        Marginals of positive factors with mean 1 that are constant along a
        specimen and differ from specimen to specimen: ``{"strength":
        st.Lognormal(mean=1.0, cv=0.1)}``. A property that is not random here, such as
        ``"critical_slip"`` or ``"pressing_force"``, may also have a factor. The
        problem then gives its mean.

    Notes
    -----
    Correlated translation fields follow Grigoriu (1995). The Cholesky factor of the
    correlation matrix combines a property's own draws with the draws of the
    properties before it in the list above. If spectra differ, the correlation of the
    fields at a point is slightly weaker than the correlation of the modes.

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
    correlation: Correlation = None  # type: ignore[assignment]  # converted
    between: AnyMarginals = None  # type: ignore[assignment]
    _shown = ("profiles",)

    @field_validator(*NAMES, mode="before")
    @classmethod
    def _name_quantity(cls, field: Any, info: ValidationInfo) -> Any:
        """Pass the quantity of a measured profile to the reader of a study file.

        >>> from types import SimpleNamespace as Named
        >>> info, field = Named(context={}, field_name="critical_slip"), {"quantity": None}
        >>> RandomInterface._name_quantity(field, info) is field, info.context
        (True, {'quantity': 'critical_slip'})
        >>> _ = RandomInterface._name_quantity({"quantity": "friction_coefficient"}, info)
        >>> info.context
        {'quantity': 'friction_coefficient'}
        >>> RandomInterface._name_quantity({}, Named(context=None, field_name="critical_slip"))
        {}
        """
        if info.context is not None and isinstance(field, dict):
            of_stress = field.get("quantity") is None
            info.context["quantity"] = info.field_name if of_stress else "friction_coefficient"
        return field

    @model_validator(mode="after")
    def _consistent(self) -> RandomInterface:
        """Refuse properties, correlations and factors that do not fit together.

        >>> import scipy.stats
        >>> import stiction as st
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.2), st.SquaredExponentialSpectrum(0.05)
        ... )
        >>> coefficient = dataclasses.replace(field, quantity="friction_coefficient")
        >>> def mistakes(strength=field, between=None, **options):
        ...     try:
        ...         RandomInterface(strength=strength, between=between, **options)
        ...     except InputError as error:
        ...         for text in error.problems:
        ...             print(text.removeprefix("RandomInterface: ")[:69])
        >>> may = {"residual_strength": coefficient, "initial_stress": coefficient}
        >>> mistakes(coefficient, **may, fracture_energy=field)
        >>> mistakes(normal_pressure=coefficient, weakening_rate=field, fracture_energy=field)
        normal_pressure: leave out quantity = 'friction_coefficient', which i
        give one of weakening_rate, critical_slip, fracture_energy, got weake
        >>> uniform = scipy.stats.uniform
        >>> mistakes(
        ...     between={
        ...         "strength": uniform(0.0, 2.0),
        ...         "pressing_force": uniform(0.5, 1.0 + 1e-6),
        ...     }
        ... )
        >>> mistakes(
        ...     between={"strength": uniform(-0.1, 2.2), "normal_pressure": uniform(0.5, 1.1)}
        ... )
        between.strength: a factor must be positive with mean 1, got mean 1 a
        between.normal_pressure: a factor must be positive with mean 1, got m
        >>> three = {"residual_strength": field, "initial_stress": field}
        >>> rho = {"strength": {"residual_strength": 0.6, "initial_stress": 0.6}}
        >>> mistakes(
        ...     **three, correlation=rho | {"residual_strength": {"initial_stress": -0.28}}
        ... )
        >>> mistakes(
        ...     **three, correlation=rho | {"residual_strength": {"initial_stress": -0.29}}
        ... )
        correlation: these coefficients contradict each other (their matrix i
        >>> known = field.given({"x": [0.03], "values": [2e6]}, noise=1e4)
        >>> mistakes(known, {"critical_slip": st.Lognormal(mean=1.0, cv=0.1)})
        >>> mistakes(known, {"strength": st.Lognormal(mean=1.0, cv=0.1)})
        between.strength: scatters between specimens, but strength.conditions
        """
        problems = [
            f"{name}: leave out quantity = 'friction_coefficient', which is for stresses"
            for name, field in self.properties.items()
            if field.quantity is not None and name not in MAY_BE_COEFFICIENTS
        ]
        scales = [name for name in SCALES if name in self.properties]
        if len(scales) > 1:
            problems.append(f"give one of {', '.join(SCALES)}, got {' and '.join(scales)}")
        correlated, between = self.correlation or {}, self.between or {}
        named = [*correlated, *chain(*correlated.values())]
        for table, given, valid in (
            ("correlation", named, self.names), ("between", between, FACTORS)
        ):  # fmt: skip
            problems += [unknown_name(table, key, valid) for key in given if key not in valid]
        if {"normal_pressure", "pressing_force"} <= {*between}:
            problems.append("between: give one of normal_pressure and pressing_force, got both")
        for name, marginal in between.items():
            if getattr(self.properties.get(name), "conditions", None) is not None:
                problems.append(
                    f"between.{name}: scatters between specimens, but {name}.conditions were"
                    " measured on a single specimen. Leave either out"
                )
            # The field has the mean of the property, and the factor
            # only scatters about it.
            mean, low = marginal.distribution.mean(), marginal.distribution.support()[0]
            if low < -1e-12 or abs(float(mean) - 1.0) > 1e-6:
                problems.append(
                    f"between.{name}: a factor must be positive with mean 1, got mean {mean:g} and"
                    f" lower bound {low:g}"
                )
        if not problems and np.linalg.eigvalsh(self.matrix)[0] < -MIN_PIVOT:
            problems.append(
                "correlation: these coefficients contradict each other (their matrix is not"
                " positive definite). Bring them nearer to 0"
            )
        if problems:
            raise InputError(problems)
        return self

    @cached_property
    def properties(self) -> dict[str, RandomField]:
        """Random properties by name, in the order of `stiction.base.variables.PROFILES`."""
        return {name: getattr(self, name) for name in NAMES if getattr(self, name) is not None}

    @property
    def varying(self) -> set[str]:
        """Names of what differs from sample to sample: random, or with a factor.

        >>> import stiction as st
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.2), st.SquaredExponentialSpectrum(0.05)
        ... )
        >>> factors = dict.fromkeys(
        ...     ["pressing_force", "strength", "critical_slip"], st.Lognormal(mean=1.0, cv=0.1)
        ... )
        >>> sorted(RandomInterface(strength=field, between=factors).varying)
        ['critical_slip', 'normal_pressure', 'strength']
        >>> RandomInterface(strength=field).varying
        {'strength'}
        """
        pressed = {"pressing_force": "normal_pressure"}
        return {*self.names, *(pressed.get(name, name) for name in self.between or ())}

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the random properties.

        >>> import stiction as st
        >>> spectrum = st.SquaredExponentialSpectrum(0.05)
        >>> a, b = (
        ...     RandomField(st.Lognormal(mean=mean, cv=0.2), spectrum) for mean in (2e6, 3e6)
        ... )
        >>> random = RandomInterface(normal_pressure=a, strength=b)
        >>> random.properties == {"strength": b, "normal_pressure": a}, random.names
        (True, ('strength', 'normal_pressure'))
        """
        return tuple(self.properties)

    @property
    def matrix(self) -> Array:
        """Correlation matrix of the properties, in the order `names`.

        The strength is linked with the pressure through the initial stress.

        >>> import stiction as st
        >>> field = RandomField(
        ...     st.Lognormal(mean=2e6, cv=0.2), st.SquaredExponentialSpectrum(0.05)
        ... )
        >>> random = RandomInterface(
        ...     strength=field,
        ...     residual_strength=field,
        ...     initial_stress=field,
        ...     normal_pressure=field,
        ...     correlation={
        ...         ("strength", "initial_stress"): 0.5,
        ...         ("initial_stress", "normal_pressure"): -0.25,
        ...     },
        ... )
        >>> random.matrix.tolist()
        [[1.0, 0.0, 0.5, 0.0], [0.0, 1.0, 0.0, 0.0], [0.5, 0.0, 1.0, -0.25], [0.0, 0.0, -0.25, 1.0]]
        >>> random.linked.astype(int).tolist()
        [[1, 0, 1, 1], [0, 1, 0, 0], [1, 0, 1, 1], [1, 0, 1, 1]]
        """
        matrix = np.eye(len(self.names))
        for first, coefficients in (self.correlation or {}).items():
            for second, rho in coefficients.items():
                i, j = self.names.index(first), self.names.index(second)
                matrix[i, j] = matrix[j, i] = rho
        return matrix

    @property
    def linked(self) -> Array:
        """Matrix that says whether two properties are correlated, directly or through others."""
        return np.linalg.matrix_power(self.matrix != 0.0, len(self.names))

    def dimension(self, interface: Interface) -> int:
        """Count the standard normal draws in a sample.

        >>> import stiction as st
        >>> spectrum = st.CustomSpectrum(np.ones_like, 130.0)  # the modes 1 and 2
        >>> field, factor = (
        ...     RandomField(st.Lognormal(mean=2e6, cv=0.2), spectrum),
        ...     st.Lognormal(mean=1.0, cv=0.1),
        ... )
        >>> random = RandomInterface(
        ...     strength=field, between={"strength": factor, "critical_slip": factor}
        ... )
        >>> random.dimension(Interface(0.1, 8))
        6
        """
        return int(layout(self, interface)[-1].columns.stop)

    @checked
    def draws(
        self, interface: Interface, samples: Number, seed: Number, first: Number = 0
    ) -> Array:
        """Draw independent standard normal numbers for samples `first`, `first` + 1, ....

        Draw j for a property in sample i depends on (seed, property, i,
        j) only. The result has shape (samples, dimension). It holds the
        draws for the properties in the order of `names`, and then the
        draws for `between`.

        >>> import stiction as st
        >>> spectrum, line = st.CustomSpectrum(np.ones_like, 130.0), Interface(0.1, 8)
        >>> random = RandomInterface(
        ...     strength=RandomField(st.Lognormal(mean=2e6, cv=0.2), spectrum)
        ... )
        >>> draws = random.draws(line, 5, 7)
        >>> draws.shape, bool((random.draws(line, 2, 7, 3) == draws[3:]).all())
        ((5, 4), True)
        """
        return draws_of(layout(self, interface), interface, samples, seed, first)

    @checked
    def from_draws(self, interface: Interface, draws: RealArray) -> dict[str, Array]:
        """Map draws (samples, dimension) to profiles (samples, *shape) by name.

        For a property that is not random, the name is `FACTOR` followed
        by the property.

        A single mode has the draws of cos(2 pi x / L) and sin(2 pi x / L). The
        residual strength has its own draws times 0.8, and the strength's times
        0.6. A factor with cv = 0.75 has the median 0.8.

        >>> import scipy.stats
        >>> import stiction as st
        >>> spectrum, line = st.CustomSpectrum(np.ones_like, 100.0), Interface(0.1, 8)
        >>> factor = st.Lognormal(mean=1.0, cv=0.75)
        >>> random = RandomInterface(
        ...     strength=RandomField(scipy.stats.norm(5.0, 2.0), spectrum),
        ...     residual_strength=RandomField(scipy.stats.norm(30.0, 10.0), spectrum),
        ...     correlation={("strength", "residual_strength"): 0.6},
        ...     between={"critical_slip": factor, "pressing_force": factor, "strength": factor},
        ... )
        >>> draws = np.zeros((2, 7))
        >>> draws[0] = 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0
        >>> profiles = random.from_draws(line, draws)
        >>> for name, rows in profiles.items():
        ...     print(name, rows.shape, rows[:, 2:8:2].round(4).tolist())
        strength (2, 8) [[4.0, 2.4, 4.0], [4.0, 4.0, 4.0]]
        residual_strength (2, 8) [[38.0, 24.0, 22.0], [30.0, 30.0, 30.0]]
        between.critical_slip (2, 8) [[1.5603, 1.5603, 1.5603], [0.8, 0.8, 0.8]]
        between.normal_pressure (2, 8) [[0.8, 0.8, 0.8], [0.8, 0.8, 0.8]]
        """
        check_draws(draws, self.dimension(interface))
        streams = layout(self, interface)
        # 1.
        if known := conditioning_of(self, interface):
            draws, (columns, conditioning) = draws.copy(), known
            draws[:, columns] = conditioning.draws(draws[:, columns])
        profiles: dict[str, Array] = {}
        independent = [draws[:, stream.columns] for stream in streams]
        rows = zip(self.properties.items(), streams, lower_factor(self.matrix), strict=False)
        for (name, field), stream, row in rows:
            # 2. The factor is triangular: only draws of properties up
            # to this one.
            mixed = reduce(np.add, (row[j] * independent[j] for j in np.flatnonzero(row)))
            # 3.
            z = field.modes(interface).gaussian(mixed.take(stream.of_property, axis=1))
            profiles[name] = from_normal(field.marginal, z)
        # 4. A factor is a single number for each sample.
        factors = zip((self.between or {}).items(), independent[len(profiles) :], strict=True)
        for (name, marginal), u in factors:
            factor = from_normal(marginal, u).reshape(-1, *(1 for _ in interface.shape))
            if name in profiles:
                profiles[name] *= factor
            else:
                name = "normal_pressure" if name == "pressing_force" else name
                whole = np.broadcast_to(factor, (len(draws), *interface.shape))
                profiles[FACTOR + name] = whole
        return profiles

    def profiles(
        self, interface: Interface, *, samples: int = 1, seed: int = 0, first: int = 0
    ) -> dict[str, Array]:
        """Return sampled profiles (samples, *shape) by name.

        Sample i depends on the seed and on i only.

        >>> import stiction as st
        >>> spectrum, line = st.CustomSpectrum(np.ones_like, 130.0), Interface(0.1, 8)
        >>> random = RandomInterface(
        ...     strength=RandomField(st.Lognormal(mean=2e6, cv=0.2), spectrum)
        ... )
        >>> fields = random.from_draws(line, random.draws(line, 2, 7, 3))["strength"]
        >>> bool(
        ...     (random.profiles(line, samples=2, seed=7, first=3)["strength"] == fields).all()
        ... )
        True
        """
        return self.from_draws(interface, self.draws(interface, samples, seed, first))

    def warn_if_inaccurate(self, interface: Interface) -> None:
        """Warn if the grid is too coarse or the interface too short for a field.

        >>> import stiction as st
        >>> from stiction.base.errors import collect_warnings
        >>> marginal, line = st.Lognormal(mean=2e6, cv=0.2), Interface(0.2, 64)
        >>> good, short = (
        ...     RandomField(marginal, st.SquaredExponentialSpectrum(xi)) for xi in (0.008, 0.05)
        ... )
        >>> unlikely = good.given(
        ...     {"x": [0.01, 0.02, 0.03], "values": [9e6, 9e6, 9e6]}, noise=1e4
        ... )
        >>> for residual in (good, short, unlikely):
        ...     with collect_warnings() as texts:
        ...         RandomInterface(
        ...             strength=good, residual_strength=residual
        ...         ).warn_if_inaccurate(line)
        ...     print([str(text)[:41] for text in texts])
        []
        ['the field has no mean mode, which would h']
        ['conditions: the measured values are unlik']
        """
        for field in self.properties.values():
            field.warn_if_inaccurate(interface)
        if known := conditioning_of(self, interface):
            known[1].warn()


def check_draws(draws: Array, dimension: int) -> None:
    """Raise an `InputError` unless draws are finite and have shape (samples, dimension).

    >>> check_draws(np.zeros((2, 3)), 3)
    >>> check_draws(np.zeros((3, 2)), 3)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: draws: must have shape (samples, 3), got (3, 2)
    >>> check_draws(np.zeros(3), 3)
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: draws: must have shape (samples, 3), got (3,)
    """
    if draws.ndim != 2 or draws.shape[1] != dimension:
        raise InputError(f"draws: must have shape (samples, {dimension}), got {draws.shape}")
    if not np.isfinite(draws).all():
        raise InputError("draws: must be finite")


def as_random_interface(given: Any) -> RandomInterface:
    """Return a `RandomInterface`. A `RandomField` becomes its strength.

    >>> import stiction as st
    >>> field = RandomField(st.Lognormal(mean=2e6, cv=0.2), st.SquaredExponentialSpectrum(0.05))
    >>> random = as_random_interface(field)
    >>> random.strength is field, as_random_interface(random) is random
    (True, True)
    """
    if isinstance(given, RandomField):
        return RandomInterface(strength=given)
    if not isinstance(given, RandomInterface):
        raise InputError(
            f"must be a RandomInterface or a RandomField, got {describe(given)}. For a measured"
            " profile, use st.onset, or fit a field to it with st.fit_field. For peaks, pass peaks="
            " to st.infer"
        )
    return given
