"""Laws of friction laws, marginals and spectra: derivative, integral, inverse and limits agree."""

from __future__ import annotations

import dataclasses
import re
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

import stiction as st
from stiction import extensions
from stiction.problem.friction.laws import LAWS
from stiction.random.dotted_keys import with_values
from stiction.random.mapping import correlation_of_mapped, hermite_coefficients
from stiction.random.marginals import MARGINALS, affine_parameters
from stiction.random.spectra import SPECTRA
from stiction.statistics import density

FRICTION = {
    "linear": st.LinearWeakening(weakening_rate=1e11),
    "exponential": st.ExponentialWeakening(weakening_rate=1e11),
    "piecewise": st.PiecewiseWeakening(
        slip=[0.2, 0.7, 1.0], strength=[0.9, 0.85, 0.0], weakening_rate=1e11
    ),
    "piecewise that steps down": st.PiecewiseWeakening(
        slip=[0.1, 1.0], strength=[0.3, 0.0], critical_slip=2e-6
    ),
}
OF_MOMENTS = {"mean": 1.1e6, "cv": 0.23}
STRENGTHS = {
    "beta": st.Beta(alpha=1.5, beta=3.0, low=0.6e6, high=1.7e6),
    "lognormal": st.Lognormal(**OF_MOMENTS, low=2e5),
    "weibull": st.Weibull(**OF_MOMENTS, low=3e5),
    "gamma": st.Gamma(**OF_MOMENTS, low=1e5),
    "truncated_normal": st.TruncatedNormal(**OF_MOMENTS, low=7e5, high=1.9e6),
    "lognormal from zero": st.Lognormal(**OF_MOMENTS),
    "normal up to a bound": st.TruncatedNormal(**OF_MOMENTS, high=1.4e6),
    "normal from a bound": st.TruncatedNormal(**OF_MOMENTS, low=6e5),
}
DENSITIES = {
    "power_law": st.PowerLawSpectrum(3e-3, exponent=1.4, power_kept=0.97),
    "squared_exponential": st.SquaredExponentialSpectrum(3e-3),
    "exponential": st.ExponentialSpectrum(3e-3, power_kept=0.95),
}


def test_every_kind_has_an_example():
    for kinds, examples in ((LAWS, FRICTION), (MARGINALS, STRENGTHS), (SPECTRA, DENSITIES)):
        own = {name for name in kinds if kinds[name].__module__.startswith("stiction.")}
        assert own == {example.type for example in examples.values()}


LINE = st.Interface(0.05, 128)
SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.3, density=1170.0)
CLASSES = {  # examples of all classes that a study file names, by the key of their table
    "problem.friction": FRICTION, "random.strength.marginal": STRENGTHS,
    "random.strength.spectrum": DENSITIES,
    "method": {"local": st.LocalCriterion(), "exact": st.Equilibrium(),
               "rupture": st.Rupture(loading_rate=1e8)},
}  # fmt: skip


@pytest.mark.parametrize(
    ("key", "name"), [(key, name) for key in CLASSES for name in CLASSES[key]]
)
def test_a_class_comes_back_from_a_file_and_a_subclass_is_not_written_as_its_parent(
    key, name, tmp_path
):
    """Until it is registered."""
    example = CLASSES[key][name]
    own = extensions.model(type("Own", (type(example),), {}))
    fields = [field.name for field in dataclasses.fields(example) if field.init]
    instance = own(**{field: getattr(example, field) for field in fields if field != "type"})
    problem = st.Problem(SOLID, LINE, FRICTION["linear"])
    field = st.RandomField(STRENGTHS["lognormal"], DENSITIES["power_law"])
    study = st.Study(
        problem=problem, random=field, method=CLASSES["method"]["rupture"], samples=2
    )
    given = {part: getattr(study, part) for part in ("problem", "random", "method")}
    known = dataclasses.replace(study, **with_values(given, {key: example}))
    known.to_toml(tmp_path / "known.toml")
    assert st.Study.from_toml(tmp_path / "known.toml") == known
    (tmp_path / "known.toml").unlink()
    study = dataclasses.replace(study, **with_values(given, {key: instance}))
    for call in (
        lambda: study.to_toml(tmp_path / "study.toml"), lambda: study.to_dict(),
        lambda: study.run(out=tmp_path / "run", progress=False),
    ):  # fmt: skip
        with pytest.raises(st.InputError, match="Own is a class of your own"):
            call()
    assert [*tmp_path.iterdir()] == []


@pytest.mark.parametrize("bound", [-3.0, 0.0, 2.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_density_moves_and_turns_with_its_sample_and_bounds(bound, side):
    """Whatever the bound, an exponential sample has its full density there."""
    sample = -np.log1p(-(np.arange(4000) + 0.5) / 4000)
    ends = (bound, None) if side > 0.0 else (None, bound)
    at = np.array([0.0, 0.5, 2.0])
    found = density(bound + side * sample, bounds=ends)
    values = np.interp(bound + side * at, found.x, found.value)
    np.testing.assert_allclose(values, np.exp(-at), atol=0.12)  # half of it without the bound
    with pytest.raises((st.InputError, ValueError)):
        density(np.append(bound + side * sample, bound - 0.1 * side), bounds=ends)


@pytest.mark.parametrize("name", FRICTION)
def test_a_friction_law_agrees_with_itself(name):
    law, drop = FRICTION[name], np.full(3, 0.8e6)
    u = np.linspace(0.0, 1.2 * law.reach, 400)
    f = law.fraction(u)
    assert f[0] == 1.0
    assert (np.diff(f) <= 0.0).all()
    assert law.fraction(law.reach) <= 0.01 * (1.0 + 1e-9)
    middle = 0.5 * (u[1:] + u[:-1])
    # Trapezia of pieces: a corner costs less than half a step.
    np.testing.assert_allclose(np.diff(law.area(u)), law.fraction(middle) * np.diff(u),
                               atol=np.diff(u)[0] ** 2 * 2.0)  # fmt: skip
    whole = quad(law.fraction, 0.0, 40.0, points=[0.1, 0.2, 0.7, 1.0], limit=200)[0]
    assert law.integral == pytest.approx(whole, rel=1e-9)
    for share in (0.95, 0.6, 0.2, 0.05):
        assert law.fraction(law.slip_at(share)) == pytest.approx(share, rel=1e-9)
    start = 1e-6
    assert (1.0 - law.fraction(start)) / start == pytest.approx(law.initial_slope, rel=1e-5)
    steepest = (-np.diff(f) / np.diff(u)).max() / law.initial_slope
    assert max(1.0, steepest) == pytest.approx(law.steepening, rel=1e-2)
    lengths = [
        st.Problem(
            SOLID, LINE, dataclasses.replace(kind, critical_slip=None, weakening_rate=1e11)
        ).nucleation_length
        for kind in (FRICTION["linear"], law)
    ]
    assert lengths[0] / lengths[1] == pytest.approx(max(1.0, steepest), rel=1e-2)
    for scale, value in (("critical_slip", 2e-6), ("fracture_energy", 0.7)):
        rate = law.weakening_rate_of(drop, scale, value)
        critical = law.critical_slip_of(drop, rate)
        spent = law.dissipated(np.full(3, 60.0 * critical[0]), drop, rate)
        assert {"critical_slip": critical, "fracture_energy": spent}[scale] == pytest.approx(
            np.full(3, value), rel=1e-9
        )
        slip = np.linspace(0.0, 1.5, 40)[:, None] * critical
        energy = law.dissipated(slip, drop, rate)
        np.testing.assert_allclose(
            energy, drop * critical * law.area(slip / critical), rtol=1e-9
        )


@pytest.mark.parametrize("name", STRENGTHS)
def test_a_marginal_agrees_with_itself(name):
    marginal, q = STRENGTHS[name], np.array([1e-9, 1e-3, 0.2, 0.5, 0.9, 1.0 - 1e-6])
    distribution = marginal.distribution
    x = distribution.ppf(q)
    np.testing.assert_allclose(distribution.cdf(x), q, rtol=1e-7)
    step = 1e-4 * np.ptp(x)
    inside = x[1:-1]
    slope = (distribution.cdf(inside + step) - distribution.cdf(inside - step)) / (2.0 * step)
    np.testing.assert_allclose(slope, distribution.pdf(inside), rtol=2e-2)
    for key, value in {"mean": distribution.mean(),
                       "cv": distribution.std() / distribution.mean()}.items():  # fmt: skip
        if hasattr(marginal, key):
            assert value == pytest.approx(getattr(marginal, key), rel=1e-6), key
    names, shift, scale = affine_parameters(marginal)
    for key in names:  # which change nothing else
        other = dataclasses.replace(marginal, **{key: 1.05 * getattr(marginal, key)})
        _, a, b = affine_parameters(other)
        alike = (other.distribution.ppf(q) - a) / b
        np.testing.assert_allclose(alike, (x - shift) / scale, rtol=1e-6, atol=1e-9)
    field = st.RandomField(marginal, DENSITIES["power_law"])
    mean, square = (quad(lambda p, n=n: distribution.ppf(p) ** n, 0.0, 1.0, limit=400)[0]
                    for n in (1, 2))  # fmt: skip
    assert field.mean == pytest.approx(mean, rel=1e-4)
    assert field.standard_deviation == pytest.approx(np.sqrt(square - mean**2), rel=2e-3)
    rho = field.spectrum.correlation(np.array(field.efolding_length()))
    found = correlation_of_mapped(rho, hermite_coefficients(marginal))
    assert found == pytest.approx(np.exp(-1.0), rel=1e-9)
    low, high = getattr(marginal, "low", 0.0) or 0.0, getattr(marginal, "high", None) or np.inf
    # scipy keeps bounds in units of the scale, here about 1e6: 1e-9 is its round-off.
    assert distribution.support() == pytest.approx((low, high), rel=1e-12, abs=1e-9)
    rows = field.sample(st.Interface(0.05, 256), samples=50, seed=1)
    assert low <= rows.min() < rows.max() <= high


@pytest.mark.parametrize("dimensions", [1, 2])
@pytest.mark.parametrize("name", DENSITIES)
def test_a_spectrum_agrees_with_itself(name, dimensions):
    spectrum = DENSITIES[name]

    def power(end):
        def g(k):
            return float(spectrum.density(np.array([k]), dimensions)[0]) * k ** (dimensions - 1)

        edges = np.concatenate(([0.0], np.geomspace(1.0, end, 40)))
        return sum(quad(g, *pair)[0] for pair in pairwise(edges))

    whole = power(1e9)
    for share in (0.3, 0.8, spectrum.power_kept or spectrum.default_power):
        k = spectrum.quantile(share, dimensions)
        assert spectrum.power_within(k, dimensions) == pytest.approx(share, rel=1e-9)
        assert power(k) / whole == pytest.approx(share, rel=1e-3)
    end = spectrum.power_within(spectrum.cutoff(dimensions), dimensions)
    assert end == pytest.approx(spectrum.power_kept or spectrum.default_power, rel=1e-9)
    if dimensions == 1:
        length = spectrum.efolding_length
        assert spectrum.correlation(np.array([0.0, length])) == pytest.approx(
            [1.0, np.exp(-1.0)], rel=1e-9
        )
        assert spectrum.with_efolding_length(2e-3).efolding_length == pytest.approx(2e-3)
        lag = np.array([0.0, 0.001, 0.004])
        wide = type(spectrum)(**{
            key: value for key, value in vars(spectrum).items()
            if key in ("correlation_length", "exponent")
        } | {"power_kept": 0.999999})  # fmt: skip
        np.testing.assert_allclose(
            wide.correlation(lag), spectrum.untruncated_correlation(lag), atol=5e-3
        )


@pytest.mark.parametrize("name", FRICTION)
def test_a_grid_is_refused_alike_for_every_scale_of_slip(name):
    """A law by its rate, its critical slip or its fracture energy demands the same nodes."""
    law, drop = FRICTION[name], 1e6
    slip = law.initial_slope * drop / 1e11
    scales = {"weakening_rate": 1e11, "critical_slip": slip}
    scales["fracture_energy"] = law.integral * drop * slip
    solid, interface = st.Solid(1e9, poisson_ratio=0.33, density=1170.0), st.Interface(0.4, 64)
    none, demanded = dict.fromkeys(scales), []
    for key, scale in scales.items():
        friction = dataclasses.replace(law, **none | {key: scale})
        with pytest.raises(st.InputError, match="must be") as caught:
            st.Problem(solid, interface, friction).sample(np.full(64, drop))
        demanded.append(re.search(r"nodes: must be (\d+) or more", str(caught.value))[1])
    assert len({*demanded}) == 1
