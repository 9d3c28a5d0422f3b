"""Every mistake gets a message that names the key, what was given and what is valid."""

import numpy as np
import pytest
import scipy.stats

import stiction as st

GOOD_SOLID = {"shear_modulus": 1e9, "poisson_ratio": 0.33, "density": 1170.0}


def make_problem(**options):
    arguments = {
        "solid": st.Solid(**GOOD_SOLID),
        "interface": st.Interface(length=0.1, nodes=256),
        "friction": st.LinearWeakening(weakening_rate=0.5e12),
    }
    return st.Problem(**(arguments | options))


def make_strength(**options):
    arguments = {
        "marginal": st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        "spectrum": st.PowerLawSpectrum(correlation_length=2e-3),
    }
    return st.RandomField(**(arguments | options))


def make_study(**options):
    return st.Study(
        problem=make_problem(),
        random=make_strength(),
        method=st.LocalCriterion(),
        **({"ensemble": st.Ensemble(samples=2)} | options),
    )


CASES = {
    "wrong type": (
        lambda: st.Solid(**GOOD_SOLID | {"density": "heavy"}),
        ["density", "'heavy'"],
    ),
    "a number as text": (lambda: st.Solid(**GOOD_SOLID | {"density": "1170"}), ["density"]),
    "a boolean": (lambda: st.Interface(length=True, nodes=64), ["length", "True"]),
    "not finite": (lambda: st.Interface(length=np.inf, nodes=64), ["length", "finite", "inf"]),
    "nan": (lambda: st.Solid(**GOOD_SOLID | {"density": np.nan}), ["density", "nan"]),
    "incompressible": (
        lambda: st.Solid(**GOOD_SOLID | {"poisson_ratio": 0.5}),
        ["0.5", "less"],
    ),
    "plane": (lambda: st.Solid(**GOOD_SOLID, plane="stran"), ["plane", "'strain'", "'stran'"]),
    "unknown key": (
        lambda: st.Solid(**GOOD_SOLID, plan="stress"),
        ["'plan'", "did you mean 'plane'"],
    ),
    "missing": (lambda: st.Solid(shear_modulus=1e9, density=1.0), ["poisson_ratio", "missing"]),
    "all at once": (
        lambda: st.Solid(shear_modulus=-1.0, poisson_ratio=2.0, density=0.0),
        ["shear_modulus", "poisson_ratio", "density"],
    ),
    "too many": (lambda: st.Interface(0.1, 64, 3), ["Interface"]),
    "odd nodes": (lambda: st.Interface(length=0.1, nodes=65), ["nodes", "65", "even"]),
    "half a node": (lambda: st.Interface(length=0.1, nodes=64.5), ["nodes", "whole"]),
    "no length": (lambda: st.Interface(length=0.0, nodes=64), ["length", "positive"]),
    "no rate": (lambda: st.LinearWeakening(), ["weakening_rate", "critical_slip", "got none"]),
    "both": (
        lambda: st.LinearWeakening(weakening_rate=1.0, critical_slip=1.0),
        ["rate and critical_slip"],
    ),
    "negative rate": (
        lambda: st.LinearWeakening(weakening_rate=[1.0, -2.0]),
        ["-2", "positive"],
    ),
    "negative residual": (
        lambda: st.LinearWeakening(weakening_rate=1.0, residual_strength=-1.0),
        ["residual_strength", "-1"],
    ),
    "profile nan": (lambda: st.Load(profile=[1.0, np.nan]), ["profile", "finite", "entry 1"]),
    "profile not positive": (lambda: st.Load(profile=[1.0, 0.0]), ["profile", "positive"]),
    "profile shape": (
        lambda: make_problem(load=st.Load(profile=np.ones((2, 2)))),
        ["profile", "(2, 2)"],
    ),
    "pressure": (lambda: st.Load(normal_pressure=-1.0), ["normal_pressure", "positive"]),
    "solid": (lambda: make_problem(solid=3), ["solid", "Solid", "3"]),
    "mode": (lambda: make_problem(mode="I"), ["mode", "'II'", "'I'"]),
    "array length": (
        lambda: make_problem(load=st.Load(profile=np.ones(10))),
        ["load.profile", "256", "(10,)"],
    ),
    "too few nodes in h_n": (
        lambda: make_problem(interface=st.Interface(length=0.1, nodes=64)),
        ["interface.nodes", "at least 4", "64", ">= 116"],
    ),
    "bounds": (lambda: st.Beta(alpha=1.0, beta=1.0, low=2.0, high=1.0), ["low=2", "high=1"]),
    "shape": (lambda: st.Beta(alpha=0.0, beta=1.0, low=1.0, high=2.0), ["alpha", "0"]),
    "marginal": (lambda: make_strength(marginal=3), ["marginal", "scipy.stats", "int"]),
    "discrete": (lambda: make_strength(marginal=scipy.stats.poisson(3)), ["continuous"]),
    "distribution name": (
        lambda: make_strength(marginal={"type": "lognrm", "s": 1.0}),
        ["'lognrm'", "did you mean 'lognorm'"],
    ),
    "distribution shape": (
        lambda: make_strength(marginal={"type": "lognorm", "sigma": 0.3}),
        ["unknown 'sigma'", "valid: s, loc, scale"],
    ),
    "distribution out of range": (
        lambda: make_strength(marginal=scipy.stats.lognorm(-0.3)),
        ["lognorm", "finite"],
    ),
    "spectrum name": (
        lambda: make_strength(spectrum={"type": "powerlaw", "correlation_length": 1.0}),
        ["'powerlaw'", "did you mean 'power_law'"],
    ),
    "exponent": (
        lambda: st.PowerLawSpectrum(correlation_length=1.0, exponent=0.5),
        ["exponent", "0.6", "0.5"],
    ),
    "two truncations": (
        lambda: st.PowerLawSpectrum(correlation_length=1.0, truncation=2.0, power_kept=0.9),
        ["truncation", "power_kept", "not both"],
    ),
    "power": (
        lambda: st.ExponentialSpectrum(correlation_length=1.0, power_kept=1.0),
        ["power_kept", "less than 1"],
    ),
    "negative density": (
        lambda: st.CustomSpectrum(function=lambda k: np.cos(k)),
        ["function", ">= 0"],
    ),
    "infinite power": (
        lambda: st.CustomSpectrum(function=lambda k: 0.0 * k),
        ["integral", "positive"],
    ),
    "no mode left": (
        lambda: make_strength(spectrum=st.PowerLawSpectrum(correlation_length=1.0)).sample(
            st.Interface(length=0.1, nodes=64)
        ),
        ["no mode is left", "0.1 m"],
    ),
    "seed": (
        lambda: make_strength().sample(st.Interface(length=0.1, nodes=256), seed=-1),
        ["seed", "-1", ">= 0"],
    ),
    "draws": (
        lambda: make_strength().profiles(st.Interface(length=0.1, nodes=256), np.zeros((1, 3))),
        ["draws", "(1, 3)"],
    ),
    "correlation of what": (
        lambda: make_strength().correlation(st.Interface(length=0.1, nodes=256), of="tau"),
        ["'strength' or 'z'", "'tau'"],
    ),
    "method class": (
        lambda: st.onset(make_problem(), np.ones(256), method=st.LocalCriterion),
        ["method", "write st.LocalCriterion(...)"],
    ),
    "method name": (
        lambda: st.onset(make_problem(), np.ones(256), method="local"),
        ["method", "'local'"],
    ),
    "method option": (
        lambda: st.LocalCriterion(weight="exact"),
        ["unknown 'weight'", "did you mean 'weights'"],
    ),
    "profile length": (
        lambda: st.onset(make_problem(), np.ones(100), method=st.LocalCriterion()),
        ["strength", "(100,)", "256"],
    ),
    "profile text": (
        lambda: st.onset(make_problem(), "strong", method=st.LocalCriterion()),
        ["strength", "numbers"],
    ),
    "profile not finite": (
        lambda: st.onset(make_problem(), np.full(256, np.nan), method=st.LocalCriterion()),
        ["strength", "finite"],
    ),
    "no samples": (
        lambda: st.onset(make_problem(), np.ones((0, 256)), method=st.LocalCriterion()),
        ["strength", "no samples"],
    ),
    "strength below residual": (
        lambda: st.onset(
            make_problem(),
            {"strength": np.ones(256), "residual_strength": 2.0},
            method=st.LocalCriterion(),
        ),
        ["strength", "residual_strength", "sample 0 is nowhere"],
    ),
    "samples of one and of another": (
        lambda: st.onset(
            make_problem(),
            {"strength": np.ones((3, 256)), "initial_stress": np.zeros((2, 256))},
            method=st.LocalCriterion(),
        ),
        ["initial_stress", "(2, 256)", "(3, 256)"],
    ),
    "strength below initial stress": (
        lambda: st.onset(
            make_problem(),
            {"strength": np.full(256, 1e6), "initial_stress": 2e6},
            method=st.LocalCriterion(),
        ),
        ["strength", "initial_stress", "node 0", "2e+06"],
    ),
    "all rows at once": (
        lambda: st.onset(
            make_problem(),
            {
                "strength": np.full(256, np.nan),
                "residual_strength": -1.0,
                "initial_stress": "x",
                "weakening_rate": -1.0,
            },
            method=st.LocalCriterion(),
        ),
        ["strength", "residual_strength", "initial_stress", "weakening_rate"],
    ),
    "complex profile": (
        lambda: st.onset(make_problem(), np.ones(256) * 1j, method=st.LocalCriterion()),
        ["strength", "complex128"],
    ),
    "masked profile": (
        lambda: st.onset(
            make_problem(), np.ma.masked_less(np.arange(256.0), 3), method=st.LocalCriterion()
        ),
        ["strength", "masked"],
    ),
    "swapped": (
        lambda: st.onset(np.ones(256), make_problem(), method=st.LocalCriterion()),
        ["problem", "must be a Problem"],
    ),
    "sample on a problem": (
        lambda: make_strength().sample(make_problem()),
        ["interface", "must be an Interface"],
    ),
    "by position": (lambda: st.Beta(1.5, 3.0, 1.0, 2.0), ["by name", "alpha, beta, low, high"]),
    "flag": (lambda: make_strength(mean_mode="no"), ["mean_mode", "True or False"]),
    "class of a spectrum": (
        lambda: make_strength(spectrum=st.PowerLawSpectrum),
        ["st.PowerLawSpectrum(...)", "class"],
    ),
    "too many modes": (
        lambda: make_strength(spectrum=st.PowerLawSpectrum(correlation_length=1e-8)).sample(
            st.Interface(length=0.1, nodes=64)
        ),
        ["25000000 modes", "units"],
    ),
    "huge": (lambda: st.Interface(length=10**400, nodes=64), ["length", "finite"]),
    "mode of the modulus": (
        lambda: st.Solid(**GOOD_SOLID).effective_modulus("iii"),
        ["'II' or 'III'", "'iii'"],
    ),
    "draws not finite": (
        lambda: make_strength().profiles(
            st.Interface(length=0.1, nodes=256), np.full((1, 250), np.nan)
        ),
        ["draws", "finite"],
    ),
    "arrival beyond the residual strength": (
        lambda: st.Rupture(loading_rate=1e7, arrival=1.5),
        ["arrival", "1", "1.5"],
    ),
    "rate that is nan": (
        lambda: st.onset(
            make_problem(),
            {"strength": np.full(256, 1e6), "weakening_rate": np.nan},
            method=st.Equilibrium(),
        ),
        ["weakening_rate", "must be finite"],
    ),
    "rate that varies": (
        lambda: st.onset(
            make_problem(
                friction=st.LinearWeakening(weakening_rate=np.linspace(1, 2, 256) * 1e11)
            ),
            np.ones(256),
            method=st.LocalCriterion(),
        ),
        ["weakening_rate", "st.Equilibrium()"],
    ),
    "nucleation length of critical slip": (
        lambda: make_problem(friction=st.LinearWeakening(critical_slip=1e-6)).nucleation_length,
        ["weakening_rate", "uniform"],
    ),
    "h_n longer than L": (
        lambda: st.onset(
            make_problem(friction=st.LinearWeakening(weakening_rate=1e10)),
            np.full(256, 1e6),
            method=st.LocalCriterion(),
        ),
        ["interface.length", "longer than the interface", "st.Equilibrium()"],
    ),
    "samples": (
        lambda: st.monte_carlo(
            make_problem(), make_strength(), method=st.LocalCriterion(), samples=0
        ),
        ["samples", ">= 1", "0"],
    ),
    "many wrong at once": (
        lambda: st.monte_carlo(
            3,
            4,
            method=st.LocalCriterion(),
            samples=10,
            seed="x",
        ),
        ["problem", "random", "seed"],
    ),
    "keep": (
        lambda: st.monte_carlo(
            make_problem(),
            make_strength(),
            method=st.LocalCriterion(),
            samples=1,
            keep=("initial_stress",),
        ),
        ["keep", "'initial_stress'", "valid: strength"],
    ),
    "text for a flag": (lambda: st.Equilibrium(slip="1"), ["slip", "True or False", "'1'"]),
    "a number for a flag": (
        lambda: st.Rupture(loading_rate=1e9, implicit=1),
        ["implicit", "True or False", "1"],
    ),
    "text for a seed": (
        lambda: st.theory.rice_distribution(make_problem(), make_strength(), seed="1"),
        ["seed", "whole", "'1'"],
    ),
    "profile whose square overflows": (
        lambda: st.onset(make_problem(), np.full(256, 1e308), method=st.LocalCriterion()),
        ["strength", "finite", "1e+100"],
    ),
    "moments whose square overflows": (
        lambda: st.Lognormal(mean=1e308, cv=1e308),
        ["mean and cv", "finite squares", "1e+308"],
    ),
    "arrest that is no flag": (
        lambda: st.theory.griffith_length(make_problem(), 1e6, 1.0, arrest="no"),
        ["arrest", "True or False", "'no'"],
    ),
    "whole that is no flag": (
        lambda: st.plot.rupture(None, whole=1),
        ["whole", "True or False", "got 1"],
    ),
    "length whose square vanishes": (
        lambda: st.PowerLawSpectrum(correlation_length=5e-324),
        ["correlation_length", "1e-100"],
    ),
    "title in bytes": (lambda: make_study(title=b"x"), ["title", "text", "b'x'"]),
    "title that is no Unicode": (lambda: make_study(title="\udcff"), ["title", "UTF-8"]),
    "swept key of nothing": (
        lambda: make_study(sweep={"type": ["beta"]}),
        ["sweep", "unknown 'type'", "valid: problem"],
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_message(case):
    call, words = CASES[case]
    with pytest.raises(st.InputError) as caught:
        call()
    for word in words:
        assert word in str(caught.value), str(caught.value)
    assert isinstance(caught.value, ValueError)


def test_grid_coarser_than_the_spectrum_warns_how_much():
    strength = make_strength(spectrum=st.PowerLawSpectrum(correlation_length=8e-4))
    with pytest.warns(
        st.AccuracyWarning, match=r"52 % of the variance .*interface.nodes >= 624"
    ):
        strength.sample(st.Interface(length=0.1, nodes=64))


def test_short_interface_warns_and_the_mean_mode_silences_it(recwarn):
    spectrum = st.PowerLawSpectrum(correlation_length=0.05)
    interface = st.Interface(length=0.1, nodes=256)
    with pytest.warns(st.AccuracyWarning, match="no mean mode"):
        make_strength(spectrum=spectrum).sample(interface)
    recwarn.clear()
    make_strength(spectrum=spectrum, mean_mode=True).sample(interface)
    assert not recwarn.list


def test_long_names_are_cut_short():
    with pytest.raises(st.InputError) as caught:
        make_study(ensemble=st.Ensemble(samples=2, keep="x" * 10_000))
    assert len(str(caught.value)) < 200


@pytest.mark.parametrize("nodes", [64, (32, 32)])
def test_no_samples_are_an_empty_array(nodes):
    length = 0.1 if nodes == 64 else (0.1, 0.1)
    field = make_strength(spectrum=st.PowerLawSpectrum(correlation_length=0.02)).sample(
        st.Interface(length=length, nodes=nodes), samples=0
    )
    assert field.shape == (0, *np.atleast_1d(nodes))


@pytest.mark.parametrize(("lost", "warns"), [(0.05, True), (5e-5, False)])
def test_coarse_grid_warns_from_a_ten_thousandth_of_the_variance(lost, warns, recwarn):
    spectrum = st.SquaredExponentialSpectrum(correlation_length=2e-3, power_kept=0.999999)
    interface = st.Interface(length=0.1, nodes=2 * round(spectrum.quantile(1 - lost) / 62.8))
    make_strength(spectrum=spectrum).sample(interface)
    assert bool(recwarn.list) == warns
    if warns:
        assert recwarn.list[0].filename == __file__  # it points at the caller


def test_few_nodes_in_the_nucleation_length_warn():
    problem = make_problem(interface=st.Interface(length=0.1, nodes=128))
    with pytest.warns(st.AccuracyWarning, match=r"spans 4.4 nodes"):
        st.onset(problem, np.full(128, 1e6), method=st.LocalCriterion())


def test_objects_are_frozen_compare_and_hash_by_value():
    import dataclasses
    import pickle

    a = make_problem(load=st.Load(profile=np.ones(256)))
    b = make_problem(load=st.Load(profile=np.ones(256)))
    assert a == b
    assert hash(a) == hash(b)
    assert a != make_problem()
    assert pickle.loads(pickle.dumps(a)) == a
    assert pickle.loads(pickle.dumps(make_strength())) == make_strength()
    with pytest.raises(dataclasses.FrozenInstanceError):
        a.mode = "III"
    with pytest.raises(ValueError, match="read-only"):
        a.load.profile[0] = 2.0
    error = st.InputError(["a", "b"])
    assert pickle.loads(pickle.dumps(error)).problems == ("a", "b")
