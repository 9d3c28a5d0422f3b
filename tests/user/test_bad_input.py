"""Every mistake gets a message that names the key, what was given and what is valid."""

import dataclasses
import pickle

import numpy as np
import pytest
import scipy.stats
from refusals import refuses

import stiction as st
from stiction.random.marginals import Marginal
from stiction.random.spectra import SpectralDensity
from stiction.reliability import subset

GOOD_SOLID = {"shear_modulus": 1e9, "poisson_ratio": 0.33, "density": 1170.0}
LOCAL = st.LocalCriterion()
LINE = st.Interface(length=0.1, nodes=256)
PLANE = st.Interface(length=(0.5, 0.5), nodes=(4096, 4096))


def make_problem(**options):
    arguments = {
        "solid": st.Solid(**GOOD_SOLID),
        "interface": LINE,
        "friction": st.LinearWeakening(weakening_rate=0.5e12),
    }
    return st.Problem(**(arguments | options))


def make_strength(correlation_length=2e-3, **options):
    arguments = {
        "marginal": st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        "spectrum": st.PowerLawSpectrum(correlation_length=correlation_length),
    }
    return st.RandomField(**(arguments | options))


def make_study(**options):
    given = {"method": LOCAL, "ensemble": st.Ensemble(samples=2)} | options
    return st.Study(problem=make_problem(), random=make_strength(), **given)


def solid(**changes):
    return st.Solid(**GOOD_SOLID | changes)


def weakening(**options):
    return make_problem(friction=st.LinearWeakening(**options))


def onset(strength, method=LOCAL, problem=None, **profiles):
    given = {"strength": strength} | profiles if profiles else strength
    return st.onset(problem or make_problem(), given, method=method)


def monte_carlo(**options):
    given = {"problem": make_problem(), "random": make_strength(), "method": LOCAL}
    return st.monte_carlo(**(given | {"samples": 1} | options))


ONE = np.full(256, 1e6)
MISTAKES = {
    # Types, signs and ranges of numbers
    "density ... 'heavy'": lambda: solid(density="heavy"),
    "density ... number ... '1170'": lambda: solid(density="1170"),
    "length ... True": lambda: st.Interface(length=True, nodes=64),
    "length ... finite ... inf": lambda: st.Interface(length=np.inf, nodes=64),
    "length ... finite": lambda: st.Interface(length=10**400, nodes=64),
    "length ... positive": lambda: st.Interface(length=0.0, nodes=64),
    "length: the nodes must be at least": lambda: st.Interface(length=1e-308, nodes=64),
    "density ... nan": lambda: solid(density=np.nan),
    "0.5 ... less": lambda: solid(poisson_ratio=0.5),
    "nodes ... 65 ... even": lambda: st.Interface(length=0.1, nodes=65),
    "nodes ... whole": lambda: st.Interface(length=0.1, nodes=64.5),
    "nodes ... at most 2^24": lambda: st.Interface(length=0.1, nodes=10**30),
    "-2 ... positive": lambda: st.LinearWeakening(weakening_rate=[1.0, -2.0]),
    "residual_strength ... -1": lambda: weakening(weakening_rate=1.0, residual_strength=-1.0),
    "normal_pressure ... positive": lambda: st.Load(normal_pressure=-1.0),
    "profile ... finite ... entry 1": lambda: st.Load(profile=[1.0, np.nan]),
    "profile ... positive": lambda: st.Load(profile=[1.0, 0.0]),
    "low=2 ... high=1": lambda: st.Beta(alpha=1.0, beta=1.0, low=2.0, high=1.0),
    "alpha ... 0": lambda: st.Beta(alpha=0.0, beta=1.0, low=1.0, high=2.0),
    "mean and cv ... finite squares ... 1e+308": lambda: st.Lognormal(mean=1e308, cv=1e308),
    "mean and cv ... finite squares ... 1e-300": lambda: st.Gamma(mean=1e6, cv=1e-300),
    "mean and cv ... finite squares ... 4.94066e-324": lambda: st.Gamma(mean=5e-324, cv=0.2),
    "slip ... got an array of shape ()": lambda: st.PiecewiseWeakening(
        slip=np.array(0.5), strength=[0.5, 0.0], critical_slip=1e-6
    ),
    "correlation_length ... 0.000000000000001": lambda: st.PowerLawSpectrum(
        correlation_length=5e-324
    ),
    "exponent ... 0.6 ... 0.5": lambda: st.PowerLawSpectrum(1.0, exponent=0.5),
    "power_kept ... less than 1": lambda: st.ExponentialSpectrum(1.0, power_kept=1.0),
    "arrival ... 1 ... 1.5": lambda: st.Rupture(loading_rate=1e7, arrival=1.5),
    "slip ... True or False ... '1'": lambda: st.Equilibrium(slip="1"),
    "implicit ... True or False ... 1": lambda: st.Rupture(loading_rate=1e9, implicit=1),
    "mean_mode ... True or False": lambda: make_strength(mean_mode="no"),
    "arrest ... True or False ... 'no'": lambda: st.theory.griffith_length(
        make_problem(), 1e6, 1.0, arrest="no"
    ),
    "seed ... -1 ... >= 0": lambda: make_strength().sample(LINE, seed=-1),
    "seed ... whole ... '1'": lambda: st.theory.rice_distribution(
        make_problem(), make_strength(), seed="1"
    ),
    "samples ... >= 1 ... 0": lambda: monte_carlo(samples=0),
    "samples ... less than or equal to 10000000000": lambda: st.Ensemble(samples=10**13),
    "title ... valid string ... b'x'": lambda: make_study(title=b"x"),
    "title ... valid string": lambda: make_study(title="\udcff"),
    # Names and choices
    "'plan' ... did you mean 'plane'": lambda: st.Solid(**GOOD_SOLID, plan="stress"),
    "plane ... 'strain' ... 'stran'": lambda: solid(plane="stran"),
    "mode ... 'II' ... 'I'": lambda: make_problem(mode="I"),
    "'II' or 'III' ... 'iii'": lambda: solid().effective_modulus("iii"),
    "poisson_ratio ... missing": lambda: st.Solid(shear_modulus=1e9, density=1.0),
    "by name ... alpha, beta, low, high": lambda: st.Beta(1.5, 3.0, 1.0, 2.0),
    "Interface": lambda: st.Interface(0.1, 64, 3),
    "weakening_rate ... critical_slip ... got none": lambda: st.LinearWeakening(),
    "rate and critical_slip": lambda: weakening(weakening_rate=1.0, critical_slip=1.0),
    "truncation ... power_kept ... not both": lambda: st.PowerLawSpectrum(
        1.0, truncation=2.0, power_kept=0.9
    ),
    "marginal ... type: unknown": lambda: make_strength(marginal={"type": {"a": 1}}),
    "'lognrm' ... did you mean 'lognorm'": lambda: make_strength(
        marginal={"type": "lognrm", "s": 1.0}
    ),
    "unknown 'sigma' ... valid: s, loc, scale": lambda: make_strength(
        marginal={"type": "lognorm", "sigma": 0.3}
    ),
    "'powerlaw' ... did you mean 'power_law'": lambda: make_strength(
        spectrum={"type": "powerlaw", "correlation_length": 1.0}
    ),
    "unknown 'gab' ... did you mean 'gap'": lambda: st.Equilibrium(gab=1e-6),
    "progress ... function of (done, total) ... 3": lambda: monte_carlo(progress=3),
    "keep ... 'initial_stress' ... valid: strength": lambda: monte_carlo(
        keep=("initial_stress",)
    ),
    "sweep ... unknown 'type' ... valid: problem": lambda: make_study(
        sweep=[{"type": ["beta"]}]
    ),
    "'strength' or 'z' ... 'tau'": lambda: make_strength().correlation(LINE, of="tau"),
    # Objects in the place of others
    "solid ... Solid ... 3": lambda: make_problem(solid=3),
    "problem ... must be a Problem": lambda: st.onset(ONE, make_problem(), method=LOCAL),
    "interface ... must be an Interface": lambda: make_strength().sample(make_problem()),
    "marginal ... scipy.stats ... int": lambda: make_strength(marginal=3),
    "a frozen continuous scipy.stats": lambda: make_strength(marginal=scipy.stats.lognorm),
    "continuous": lambda: make_strength(marginal=scipy.stats.poisson(3)),
    "st.PowerLawSpectrum(...) ... class": lambda: make_strength(spectrum=st.PowerLawSpectrum),
    "method ... write st.LocalCriterion(...)": lambda: onset(ONE, st.LocalCriterion),
    "method ... 'local'": lambda: onset(ONE, "local"),
    "method ... method object ... got 3": lambda: st.external.limit_state(
        make_problem(), make_strength(), 3
    ),
    "Study.method: must be a method object such as st.LocalCriterion() ... got 0": lambda: (
        make_study(method=0)
    ),
    "where: must be a Problem or an Interface, got 3": lambda: st.plot.field(3, ONE),
    "profile ... must be a DataArray over x ... (64, 64)": lambda: make_strength().given(
        np.ones((64, 64)), noise=1e4
    ),
    "sweep: slip cannot be kept ... number of nodes is swept": lambda: make_study(
        method=st.Equilibrium(slip=True), sweep=[{"problem.interface.nodes": [128, 256]}]
    ),
    # Fields that cannot be
    "lognorm ... finite": lambda: make_strength(marginal=scipy.stats.lognorm(-0.3)),
    "function ... >= 0": lambda: st.CustomSpectrum(np.cos, max_wavenumber=9.0),
    "modes ... must be positive": lambda: make_strength(
        spectrum=st.CustomSpectrum(function=lambda k: 0.0 * k, max_wavenumber=1e3)
    ).modes(LINE),
    "max_wavenumber=...": lambda: make_strength(spectrum=np.cos),
    "no mode is left ... 0.1 m": lambda: make_strength(1.0).sample(LINE),
    "25000000 modes ... units": lambda: make_strength(1e-8).sample(LINE),
    "draws ... (1, 3)": lambda: make_strength().profiles(LINE, np.zeros((1, 3))),
    "draws ... finite": lambda: make_strength().profiles(LINE, np.full((1, 250), np.nan)),
    # Profiles
    "profile ... (2, 2)": lambda: make_problem(load=st.Load(profile=np.ones((2, 2)))),
    "load.profile ... 256 ... (10,)": lambda: make_problem(load=st.Load(profile=np.ones(10))),
    "strength ... (100,) ... 256": lambda: onset(np.ones(100)),
    "strength ... numbers": lambda: onset("strong"),
    "strength: values are missing": lambda: onset(np.full(256, np.nan)),
    "strength ... finite ... 1e+100": lambda: onset(np.full(256, 1e308)),
    "strength ... (0, 256)": lambda: onset(np.ones((0, 256))),
    "strength ... complex128": lambda: onset(np.ones(256) * 1j),
    "strength ... masked": lambda: onset(np.ma.masked_less(np.arange(256.0), 3)),
    "residual_strength ... in sample 0 ... residual_strength 2e+06 to 2e+06 Pa": lambda: onset(
        ONE, residual_strength=2e6
    ),
    "initial_stress ... (2, 256) ... (3, 256)": lambda: onset(
        np.ones((3, 256)), initial_stress=np.zeros((2, 256))
    ),
    "strength ... initial_stress ... node 0 ... 2e+06": lambda: onset(ONE, initial_stress=2e6),
    "weakening_rate ... must be finite": lambda: onset(
        ONE, st.Equilibrium(), weakening_rate=np.nan
    ),
    # What a method does not take
    "interface.nodes ... at least 4 ... 64 ... >= 116": lambda: make_problem(
        interface=st.Interface(length=0.1, nodes=64)
    ),
    "weakening_rate ... st.Equilibrium()": lambda: onset(
        ONE, problem=weakening(weakening_rate=np.linspace(1, 2, 256) * 1e11)
    ),
    "weakening_rate ... uniform": lambda: weakening(critical_slip=1e-6).nucleation_length,
    "interface.length ... longer than the interface ... st.Equilibrium()": lambda: onset(
        ONE, problem=weakening(weakening_rate=1e10)
    ),
    # More memory than there is
    "samples: this takes ... GiB": lambda: make_strength().sample(LINE, samples=10**400),
    "samples: this takes ... GiB of memory": lambda: make_strength().sample(
        PLANE, samples=10**6
    ),
    "this takes ... GiB of memory": lambda: st.RandomInterface(
        strength=make_strength()
    ).profiles(PLANE, samples=10**6),
    "subset ... GiB of memory ... fewer nodes": lambda: subset.descend(
        lambda draws: draws[:, 0], 10**9, rng=None, samples=1000
    ),
    # Everything at once
    "shear_modulus ... poisson_ratio ... density": lambda: st.Solid(
        shear_modulus=-1.0, poisson_ratio=2.0, density=0.0
    ),
    "strength ... residual_strength ... initial_stress ... weakening_rate": lambda: onset(
        np.full(256, np.nan), residual_strength=-1.0, initial_stress="x", weakening_rate=-1.0
    ),
    "problem ... random ... seed": lambda: monte_carlo(problem=3, random=4, seed="x"),
}


@pytest.mark.parametrize("words", MISTAKES)
def test_a_mistake_is_named(words):
    refuses(words, MISTAKES[words])


def test_a_refusal_is_short_pickles_and_is_a_value_error():
    with pytest.raises(ValueError, match="keep") as caught:
        make_study(ensemble=st.Ensemble(samples=2, keep="x" * 10_000))
    assert len(str(caught.value)) < 200
    error = st.InputError(["a", "b"])
    assert pickle.loads(pickle.dumps(error)).problems == ("a", "b")


def test_grid_coarser_than_the_spectrum_warns_how_much():
    with pytest.warns(
        st.AccuracyWarning, match=r"52 % of the variance .*interface.nodes >= 624"
    ):
        make_strength(8e-4).sample(st.Interface(length=0.1, nodes=64))


def test_short_interface_warns_and_the_mean_mode_silences_it(recwarn):
    with pytest.warns(st.AccuracyWarning, match="no mean mode"):
        make_strength(0.05).sample(LINE)
    recwarn.clear()
    make_strength(0.05, mean_mode=True).sample(LINE)
    assert not recwarn.list


@pytest.mark.parametrize("nodes", [64, (32, 32)])
def test_no_samples_are_an_empty_array(nodes):
    length = 0.1 if nodes == 64 else (0.1, 0.1)
    field = make_strength(0.02).sample(st.Interface(length=length, nodes=nodes), samples=0)
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
        onset(np.full(128, 1e6), problem=problem)


def test_objects_are_frozen_compare_and_hash_by_value():
    a, b = (make_problem(load=st.Load(profile=np.ones(256))) for _ in range(2))
    assert a == b
    assert hash(a) == hash(b)
    assert a != make_problem()
    for each in (a, make_strength()):
        assert pickle.loads(pickle.dumps(each)) == each
    with pytest.raises(dataclasses.FrozenInstanceError):
        a.mode = "III"
    with pytest.raises(ValueError, match="read-only"):
        a.load.profile[0] = 2.0


def test_a_study_says_which_part_exists_in_python_only():
    strength = dataclasses.replace(make_strength(), spectrum=st.CustomSpectrum(_flat, 1e3))
    study = st.Study(
        problem=make_problem(), random=strength, method=st.LocalCriterion(),
        ensemble=st.Ensemble(samples=1),
    )  # fmt: skip
    words = (
        "Study: cannot be written down: spectrum.function is the Python function '_flat'; use"
    )
    refuses(words, lambda: study.to_toml("study.toml"))


def test_a_spectrum_and_a_marginal_name_what_they_lack():
    class Ring(SpectralDensity):
        def density(self, wavenumber, dimensions=1):
            return np.exp(-(wavenumber**2))

    class Nameless(Marginal):
        type = "nameless"

    with pytest.raises(TypeError, match="cutoff"):
        Ring()
    with pytest.raises(TypeError, match="distribution"):
        Nameless()


def _flat(k):
    return 1.0 * (k < 1e3)
