"""Recorded outputs: random fields and interfaces, their draws, correlations and measured parts."""

import dataclasses

import numpy as np
import scipy.stats
import xarray as xr
from crooked import LINE, in_mm
from recording import Calls, compared
from setups import EXACT

import stiction as st

calls = Calls()
INTERFACE = st.Interface(0.047, 90)
MARGINALS = {
    "beta": st.Beta(alpha=1.7, beta=3.3, low=0.61e6, high=1.72e6),
    "lognormal": st.Lognormal(mean=1.1e6, cv=0.23),
    "weibull": st.Weibull(mean=1.2e6, cv=0.31, low=3.1e5),
    "gamma": st.Gamma(mean=0.9e6, cv=0.27),
    "normal": st.TruncatedNormal(mean=1.05e6, cv=0.2, low=4e5),
    "scipy": scipy.stats.gumbel_l(loc=1.3e6, scale=1.4e5),
    "named": {"type": "gamma", "a": 3.2, "loc": 4e5, "scale": 2.1e5},
}
SPECTRA = {
    "power": st.PowerLawSpectrum(3.1e-3, exponent=1.3, power_kept=0.97),
    "cut": st.PowerLawSpectrum(3.7e-3),
    "exponential": st.ExponentialSpectrum(2.9e-3, power_kept=0.93),
    "gauss": st.SquaredExponentialSpectrum(2.3e-3),
}


@calls("quantiles of scipy and sums of modes, tests/exact/test_fields.py")
def each_marginal_with_a_spectrum():
    found = {}
    for number, (name, marginal) in enumerate(MARGINALS.items()):
        spectrum = list(SPECTRA.values())[number % len(SPECTRA)]
        field = st.RandomField(marginal, spectrum, mean_mode=number % 2 == 1)
        lag = np.linspace(0.0, 0.009, 5)
        found[name] = {
            "sample": field.sample(INTERFACE, samples=2, seed=number),
            "mean": [field.mean, field.standard_deviation],
            "length": field.efolding_length(),
            "quantile": field.quantile(INTERFACE, 0.013),
            "correlation": field.correlation(INTERFACE),
            "untruncated": spectrum.untruncated_correlation(lag),
            "written": repr(field),
        }
    return found


def three_properties(**more):
    strength = st.RandomField(MARGINALS["beta"], SPECTRA["power"], mean_mode=True)
    residual = st.RandomField(
        st.Beta(alpha=2.0, beta=2.6, low=1e5, high=2.4e5), SPECTRA["gauss"]
    )
    initial = st.RandomField(scipy.stats.norm(3e4, 1.2e4), SPECTRA["exponential"])
    return st.RandomInterface(
        strength=strength,
        residual_strength=residual,
        initial_stress=initial,
        correlation={
            ("strength", "residual_strength"): 0.7,
            ("strength", "initial_stress"): -0.35,
            ("residual_strength", "initial_stress"): 0.15,
        },
        **more,
    )


@calls("correlations of many samples, tests/exact/test_fields.py")
def three_correlated_properties_with_factors_between_specimens():
    between = {
        "strength": st.Lognormal(mean=1.0, cv=0.12),
        "residual_strength": st.Gamma(mean=1.0, cv=0.3),
    }
    random = three_properties(between=between)
    draws = random.draws(INTERFACE, samples=3, seed=4, first=255)
    return {
        "profiles": random.profiles(INTERFACE, samples=3, seed=4, first=255),
        "from draws": random.from_draws(INTERFACE, draws),
        "dimension": random.dimension(INTERFACE),
        "matrix": random.matrix,
    }


def scan(dims=("x",), noise=2e4):
    """Values at six places, off the nodes, and a seventh where none was measured."""
    x = np.array([0.0031, 0.0077, 0.0123, 0.0291, 0.0302, 0.0415, 0.0433])
    values = np.where(x < 0.042, 1e6 + 2.2e5 * np.sin(300.0 * x), np.nan)
    return xr.DataArray(values, {"x": x}, dims, attrs={"units": "Pa"})


@calls("dense kriging, tests/exact/test_conditional.py")
def a_field_that_is_known_in_places():
    known = st.RandomField(
        MARGINALS["lognormal"], SPECTRA["exponential"], mean_mode=True
    ).given(scan(), noise=3e4)
    both = dataclasses.replace(
        three_properties(), strength=known, correlation={("strength", "residual_strength"): 0.8}
    )
    found = {
        "sample": known.sample(INTERFACE, samples=3, seed=5),
        "quantile": known.quantile(INTERFACE, 0.1),
    }
    three = three_properties()
    measured = in_mm(1.4e5 + 0.2 * (scan() - 1e6))
    residual = three.residual_strength.given(measured, noise=9e3)
    second = dataclasses.replace(three, residual_strength=residual)
    found |= {"second": second.profiles(INTERFACE, samples=2, seed=6)}
    return found | {"both": both.profiles(INTERFACE, samples=2, seed=6)}


@calls("each sample as by onset, to the bit")
def an_ensemble_by_equilibrium_that_keeps_its_profiles():
    friction = dataclasses.replace(LINE.friction, residual_strength=0.0)
    load = dataclasses.replace(LINE.load, initial_stress=0.0)
    problem = dataclasses.replace(LINE, friction=friction, load=load)
    return st.monte_carlo(
        problem,
        three_properties(),
        method=st.Equilibrium(events=1),
        samples=4,
        seed=3,
        first=510,
        keep=("strength", "initial_stress"),
        workers=1,
    )


@calls("each sample as by onset, to the bit; the pilot beside equilibrium")
def an_ensemble_by_the_local_criterion_with_its_pilot():
    problem = dataclasses.replace(
        LINE, friction=st.LinearWeakening(weakening_rate=2.9e11, residual_strength=1.8e5)
    )
    field = st.RandomField(MARGINALS["beta"], SPECTRA["cut"])
    return st.monte_carlo(problem, field, method=st.LocalCriterion(), samples=700, seed=1)


@calls("others are selected: the samples below four nodes, and below the initial stress")
def ensembles_in_which_samples_are_steep_or_refused():
    solid, found = st.Solid(1e9, 0.3, 1200.0), {}
    law = st.LinearWeakening(critical_slip=5.93e-6, residual_strength=1e5)
    random = st.RandomField(st.Lognormal(mean=1.2e6, cv=0.35), st.PowerLawSpectrum(0.01))
    for initial in (7e4, 5.2e5):
        load = st.Load(initial_stress=initial)
        problem = st.Problem(solid, st.Interface(0.064, 64), law, load)
        found[str(initial)] = st.monte_carlo(problem, random, method=EXACT, samples=20)
    return found


test_outputs_are_as_recorded = compared(calls, __file__)
