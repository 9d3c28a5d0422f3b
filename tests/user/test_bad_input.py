"""Every mistake gets a message that names the key, what was given and what is valid."""

import dataclasses
import pickle
import warnings

import numpy as np
import pytest
import scipy.stats
import xarray as xr
from refusals import refusals
from setups import LENGTH, LOCAL, RATE, SOLID, beta_strength, local_onset, make_problem

import stiction as st
from stiction.elasticity.exponential_sum import fit_exponentials
from stiction.methods.criterion.local import excess_of
from stiction.methods.equilibrium.solver import follow
from stiction.reliability import subset
from stiction.statistics import density, quantiles
from stiction.theory import energy_release_rate, griffith_length, nucleation_statistics

LINE = st.Interface(length=0.1, nodes=256)
PLANE = st.Interface(length=(0.5, 0.5), nodes=(4096, 4096))
PROBLEM, RATIO = make_problem(), make_problem(residual_ratio=0.5)
OTHER = make_problem(weakening_rate=0.9 * RATE, load=st.Load(initial_stress=3e4))
ONE, TEN = np.full(256, 1e6), np.arange(10.0)
FALLING = st.ExponentialWeakening(weakening_rate=RATE)


def make_strength(correlation_length=2e-3, **options):
    return dataclasses.replace(beta_strength(correlation_length), **options)


def of_draws(draws):
    return st.RandomInterface(strength=make_strength()).from_draws(LINE, draws)


def make_study(**options):
    given = {"method": LOCAL, "ensemble": st.Ensemble(samples=2)} | options
    return st.Study(problem=PROBLEM, random=make_strength(), **given)


def solid(**changes):
    return dataclasses.replace(SOLID, **changes)


def onset(strength, method=LOCAL, problem=PROBLEM, **profiles):
    given = {"strength": strength} | profiles if profiles else strength
    return st.onset(problem, given, method=method)


def path(loads):
    return st.equilibrium_path(PROBLEM, 0.9 * ONE, loads)


def monte_carlo(**options):
    given = {"problem": PROBLEM, "random": make_strength(), "method": LOCAL, "samples": 1}
    return st.monte_carlo(**given | options)


def loaded(profile):
    return dataclasses.replace(PROBLEM, load=st.Load(profile=profile))


def with_barrier(node):
    return excess_of(
        PROBLEM.sample(ONE)._replace(strength=np.where(np.arange(256) == node, np.inf, [ONE]))
    )


def on_plane(lengths, weakening_rate=RATE):
    problem = make_problem((48, 48), lengths, weakening_rate=weakening_rate)
    return monte_carlo(problem=problem, random=make_strength(1e-3), samples=2)


PAIR = ("strength", "residual_strength")
THREE = {PAIR: 0.9, ("strength", "initial_stress"): 0.9, (PAIR[1], "initial_stress"): -0.9}


def several(*names, **options):
    return st.RandomInterface(**{name: make_strength() for name in names}, **options)


def correlated(correlation):
    return several(*PAIR, "initial_stress", correlation=correlation)


test_numbers = refusals({
    "nodes ... 65 ... even": lambda: st.Interface(length=0.1, nodes=65),
    "length: the nodes must be at least": lambda: st.Interface(length=1e-308, nodes=64),
    "profile ... finite ... entry 1": lambda: st.Load(profile=[1.0, np.nan]),
    "profile ... positive ... pressure ... positive on average":
        lambda: st.Load(profile=[1.0, 0.0], normal_pressure=[1.0, -1.0]),
    "low=2 ... high=1": lambda: st.Beta(alpha=1.0, beta=1.0, low=2.0, high=1.0),
    "slip ... got an array of shape ()": lambda: st.PiecewiseWeakening(
        slip=np.array(0.5), strength=[0.5, 0.0], critical_slip=1e-6
    ),
    "max_wavenumber: must be less than":
        lambda: st.CustomSpectrum(function=np.exp, max_wavenumber=1e307),
})  # fmt: skip

test_names_and_choices = refusals({
    "'plan' ... did you mean 'plane'": lambda: st.Solid(1e9, 0.3, 1170.0, plan="stress"),
    "weakening_rate ... critical_slip ... got none": lambda: st.LinearWeakening(),
    "rate and critical_slip": lambda: st.LinearWeakening(1.0, critical_slip=1.0),
    "truncation ... power_kept ... not both":
        lambda: st.PowerLawSpectrum(1.0, truncation=2.0, power_kept=0.9),
    "'lognrm' ... did you mean 'lognorm'":
        lambda: make_strength(marginal={"type": "lognrm", "s": 1.0}),
    "unknown 'sigma' ... valid: s, loc, scale":
        lambda: make_strength(marginal={"type": "lognorm", "sigma": 0.3}),
    "progress ... a function of (done, total) ... int": lambda: monte_carlo(progress=int),
    "run: give the arguments by name (valid: out,": lambda: make_study().run("folder"),
    "'strength' or 'z' ... 'tau'": lambda: make_strength().correlation(LINE, of="tau"),
})  # fmt: skip

test_objects_in_the_place_of_others = refusals({
    "solid ... Solid ... 3": lambda: dataclasses.replace(PROBLEM, solid=3),
    "a frozen continuous scipy.stats": lambda: make_strength(marginal=scipy.stats.lognorm),
    "st.PowerLawSpectrum(...) ... class": lambda: make_strength(spectrum=st.PowerLawSpectrum),
    "method ... write st.LocalCriterion(...)": lambda: onset(ONE, st.LocalCriterion),
    "profile ... must be a DataArray over x ... (3, 256)":
        lambda: make_strength().given(np.stack([ONE, ONE, ONE]), noise=1e4),
    "profile ... values finite, or NaN where not measured": lambda: make_strength().given(
        xr.DataArray([1e6, np.inf], {"x": [0.01, 0.02]}, "x"), noise=1e4
    ),
    "profile ... places must be known": lambda: make_strength().given(
        xr.DataArray([1e6, 1.1e6], {"x": [0.01, np.nan]}, "x"), noise=1e4
    ),
    "profile: x is in s, which cannot be converted to m": lambda: make_strength().given(
        xr.DataArray([1e6, 1.1e6], {"x": ("x", [0.01, 0.02], {"units": "s"})}, "x"), noise=1e4
    ),
    "state a known unit, not 'kN', which no property has": lambda: make_strength().given(
        xr.DataArray([1e3, 1.1e3], {"x": [0.01, 0.02]}, "x", attrs={"units": "kN"}), noise=1e4
    ),
    "sweep: slip cannot be kept ... an interface that is swept": lambda: make_study(
        method=st.Equilibrium(slip=True), sweep=[{"problem.interface.nodes": [128, 256]}]
    ),
    "problem ... random ... seed": lambda: monte_carlo(problem=3, random=4, seed="x"),
})  # fmt: skip

test_fields_that_cannot_be = refusals({
    "function ... >= 0": lambda: st.CustomSpectrum(np.cos, max_wavenumber=9.0),
    "modes ... must be positive": lambda: make_strength(
        spectrum=st.CustomSpectrum(function=lambda k: 0.0 * k, max_wavenumber=1e3)
    ).modes(LINE),
    "max_wavenumber=...": lambda: make_strength(spectrum=np.cos),
    "no mode is left ... 0.1 m": lambda: make_strength(1.0).sample(LINE),
    "25000000 modes ... units": lambda: make_strength(1e-8).sample(LINE),
    "draws ... (samples, 250) ... (1, 251)": lambda: of_draws(np.zeros((1, 251))),
    "draws ... finite": lambda: of_draws(np.full((1, 250), np.nan)),
    # More memory than there is
    "samples: this takes ... GiB of memory": lambda: monte_carlo(keep="strength", samples=10**9),
    "this takes ... GiB of memory": lambda: st.RandomInterface(
        strength=make_strength()
    ).profiles(PLANE, samples=10**6),
    "strength.given.profile: this takes ... GiB of memory ... fewer places":
        lambda: make_strength(5e-6).given(
            xr.DataArray(ONE.repeat(400), {"x": np.linspace(0.0, 0.1, 256 * 400)}, "x"), noise=1e3
        ).sample(LINE),
    "subset ... GiB of memory ... fewer nodes":
        lambda: subset.descend(lambda draws: draws[:, 0], 10**9, rng=None, samples=1000),
})  # fmt: skip

test_random_interfaces = refusals({
    "did you mean 'residual_strength'": lambda: correlated({("strength", "residual"): 0.5}),
    "two different properties": lambda: correlated({("strength", "strength"): 0.5}),
    "given twice": lambda: correlated({PAIR: 0.5, PAIR[::-1]: 0.4}),
    "contradict each other": lambda: correlated(THREE),
    "at most one of weakening_rate":
        lambda: several("strength", "weakening_rate", "critical_slip"),
    "must lie between": lambda: st.TruncatedNormal(mean=1e6, cv=0.1, high=0.5e6),
    "cv: missing": lambda: make_strength(marginal={"type": "lognormal", "mean": 1.0}),
    "anisotropy: ... a line has no y; got 2":
        lambda: make_strength(anisotropy=2.0).sample(LINE),
    "between: needs several records":
        lambda: st.fit_field(make_strength().sample(LINE, seed=1)[0], LINE, between=True),
})  # fmt: skip

test_theory_and_statistics = refusals({
    "kernel tolerance": lambda: fit_exponentials("II", 1.7, 1e-14),
    "friction.residual_ratio": lambda: energy_release_rate(RATIO, 1e6, 0.01),  # taken for zero
    "the ratio times its mean": lambda: griffith_length(RATIO, 1e6, 1.0),
    "lengths ... 0.1": lambda: energy_release_rate(PROBLEM, 1e6, 0.2),
    "load.profile ... monte_carlo":
        lambda: nucleation_statistics(loaded(np.linspace(0.9, 1.1, 256)), make_strength()),
    "probability": lambda: quantiles(TEN, 1.0),
    "finite": lambda: quantiles([1.0, np.nan], 0.5),
    "equal": lambda: density(np.ones(50)),
    "below the lower bound": lambda: density(np.linspace(-1, 1, 50), bounds=(0.0, None)),
})  # fmt: skip

test_what_the_local_criterion_cannot_take = refusals({
    "must be finite everywhere ... st.Rupture": lambda: with_barrier(3),
    "does not fit on a plane of": lambda: on_plane((1.6 * LENGTH, 4.0 * LENGTH)),
    "weakening_rate varies": lambda: on_plane(
        (5.0 * LENGTH, 4.0 * LENGTH), RATE * np.linspace(0.9, 1.0, 48 * 48).reshape(48, 48)
    ),
    "not in plane stress":
        lambda: make_problem((48, 48), (0.02, 0.02), solid=solid(plane="stress")),
    "swapped: the first axis of a profile is x": lambda: onset(
        np.full((48, 64), 1e6), problem=make_problem((64, 48), (0.02, 0.014))
    ),
})  # fmt: skip

test_profiles_and_loads = refusals({
    "friction: ... ExponentialWeakening has none": lambda: st.equilibrium_path(
        make_problem((32, 32), (0.01, 0.01), friction=FALLING), np.full((32, 32), 1e6), [1e5]
    ),
    "profile ... (2, 2)": lambda: loaded(np.ones((2, 2))),
    "load.profile": lambda: st.theory.nucleation_statistics(
        loaded(st.EdgeLoad(excess=1.0, decay=0.01)), make_strength()
    ),
    "strength ... (100,) ... 256": lambda: onset(np.ones(100)),
    "strength ... finite ... 1e+100": lambda: onset(np.full(256, 1e308)),
    "profiles: the sample has shape (512,), the interface (256,)":
        lambda: onset(make_problem(512).sample(np.full(512, 1e6))),
    "strength ... masked": lambda: onset(np.ma.masked_less(np.arange(256.0), 3)),
    "residual_strength ... in sample 0 ... residual_strength 2e+06 to 2e+06 Pa":
        lambda: onset(ONE, residual_strength=2e6),
    "initial_stress ... (2, 256) ... (3, 256)":
        lambda: onset(np.ones((3, 256)), initial_stress=np.zeros((2, 256))),
    "initial_stress ... at 3 of 256 nodes of sample 1, the first at x = 0.0300781 m: 1e+06 ... 2e":
        lambda: onset(
            np.stack([3.0 * ONE, ONE]), initial_stress=2e6 * (abs(np.arange(256) - 78) < 2)
        ),
    "strength: 1e+90 Pa at x = 0.0117188 m of sample 1 ... 1e+08 times the median, 1e+06 Pa":
        lambda: onset(np.stack([ONE, np.where(np.arange(256) == 30, 1e90, ONE)])),
    "another friction.weakening_rate, load.initial_stress;": lambda: onset(OTHER.sample(ONE)),
    "another load_profile": lambda: onset(
        PROBLEM.sample(ONE)._replace(problem=None, load_profile=np.linspace(0.9, 1.1, 256))
    ),
    "strength: must be finite; entry (0, 3)": lambda: onset(
        PROBLEM.sample(np.where(np.arange(256) == 3, np.inf, ONE), accept=("barriers",)),
        st.Equilibrium(),
    ),
    "at 2 of 256 nodes of sample 0": lambda: onset(
        PROBLEM.sample(
            {"strength": ONE, "initial_stress": 2e6 * (np.arange(256) < 2)}, accept=("overstress",)
        )
    ),
    "residual_strength: must not be negative": lambda: onset(
        PROBLEM.sample(ONE)._replace(residual_strength=-ONE[None])
    ),
    "weakening_rate ... must be finite":
        lambda: onset(ONE, st.Equilibrium(), weakening_rate=np.nan),
    "normal_pressure: must be positive on average, that of sample 1 is -5e+06 Pa":
        lambda: onset(np.stack([ONE, ONE]), normal_pressure=np.array([[5e6], [-5e6]])),
    "strength ... residual_strength ... initial_stress ... weakening_rate": lambda: onset(
        np.full(256, np.nan), residual_strength=-1.0, initial_stress="x", weakening_rate=-1.0
    ),
    "rise ... entry 1 is 100000": lambda: path([2e5, 1e5]),
    "finite": lambda: path([np.nan]),
    # What a method does not take
    "interface.nodes ... at least 4 ... 64 ... >= 116": lambda: make_problem(64),
    "weakening_rate ... uniform": lambda: make_problem(critical_slip=1e-6).nucleation_length,
    "interface.length ... longer than the interface ... st.Equilibrium()":
        lambda: onset(ONE, problem=make_problem(weakening_rate=1e10)),
})  # fmt: skip


def test_a_refusal_is_short_pickles_and_is_a_value_error():
    with pytest.raises(ValueError, match="keep") as caught:
        make_study(ensemble=st.Ensemble(samples=2, keep="x" * 10_000))
    assert len(str(caught.value)) < 200
    error = st.InputError(["a", "b"])
    assert pickle.loads(pickle.dumps(error)).problems == ("a", "b")


def test_fields_and_grids_that_are_doubted(recwarn):
    words = r"52 % of the variance .*interface.nodes >= 330"
    with pytest.warns(st.AccuracyWarning, match=words):
        make_strength(8e-4).sample(st.Interface(length=0.1, nodes=64))
    with pytest.warns(st.AccuracyWarning, match="but 1 % of the variance"):
        make_strength(8e-4).sample(st.Interface(length=0.1, nodes=328))
    with pytest.warns(st.AccuracyWarning, match=r"spans 4.4 nodes"):
        onset(np.full(128, 1e6), problem=make_problem(128))
    with pytest.warns(st.AccuracyWarning, match="no mean mode"):
        make_strength(0.05).sample(LINE)
    recwarn.clear()
    make_strength(8e-4).sample(st.Interface(length=0.1, nodes=330))
    make_strength(0.05, mean_mode=True).sample(LINE)
    assert not recwarn.list


def test_errors_of_equilibrium_are_warned_of():
    no, ones = np.zeros(2, dtype=bool), np.ones(2)
    values = dict.fromkeys(("stopped", "residual_reached"), no) | {
        "certified": ~no,
        "certificate_gap": np.array([1e-6, np.nan]),
        "first_instability": 1e6 * ones,
        "critical_stress": 1e6 * ones,
    }
    rows = PROBLEM.sample(np.full((2, PROBLEM.interface.size), 1e6))
    with pytest.warns(st.AccuracyWarning, match="did not close to 1e-09 of it in 1 of 2"):
        st.Equilibrium().prepare(PROBLEM)._warn(rows, values, no)


def test_nothing_is_said_where_nothing_is_in_doubt():
    """Eighteen nodes in h_n, a spectrum that the grid resolves, a mean mode, stresses in Pa."""
    load = st.Load(initial_stress=1e4, normal_pressure=2e6)
    problem, field = make_problem(512, load=load), make_strength(2.0 * LENGTH, mean_mode=True)
    line = problem.interface
    place = ("x", 1e3 * line.x, {"units": "mm"})
    profile = field.sample(line, seed=3)[0]
    measured = xr.DataArray(profile, {"x": place}, "x", attrs={"units": "Pa"})
    with warnings.catch_warnings(action="error"):
        for method in (
            LOCAL,
            st.Equilibrium(sensitivity=True),
            st.Rupture(loading_rate=1e7, stop="onset"),
        ):
            onset(measured, method, problem)
        st.equilibrium_path(problem, profile, [0.5e6, 2e6])
        for random in (field, field.given(measured[::16], noise=2e4)):
            monte_carlo(problem=problem, random=random, samples=8)
        st.failure_probability(problem, field, 0.8e6, method=LOCAL, target_cv=0.3)
        st.failure_curve(problem, field, method=LOCAL, smallest=1e-2)


def test_a_path_whose_end_is_not_known_is_said(monkeypatch):
    ends = "stiction.methods.equilibrium.path.follow"
    monkeypatch.setattr(ends, lambda *given: dataclasses.replace(follow(*given), known=False))
    path([1e5])
    with pytest.warns(st.AccuracyWarning, match="no equilibrium was found beyond 900000 Pa"):
        path([1e5, 2e6])


def test_no_samples_are_an_empty_array():
    plane = st.Interface(length=(0.1, 0.1), nodes=(32, 32))
    for interface, shape in (LINE, (0, 256)), (plane, (0, 32, 32)):
        assert make_strength(0.02).sample(interface, samples=0).shape == shape


def test_objects_are_frozen_compare_and_hash_by_value():
    a, b = (loaded(np.ones(256)) for _ in range(2))
    assert a == b
    assert hash(a) == hash(b)
    assert a != PROBLEM
    for each in (a, make_strength()):
        assert pickle.loads(pickle.dumps(each)) == each
    with pytest.raises(dataclasses.FrozenInstanceError):
        a.mode = "III"
    with pytest.raises(ValueError, match="read-only"):
        a.load.profile[0] = 2.0


FIELD = beta_strength(4e-3)


def scaled(modulus=1e9, density=1170.0, length=0.1, pressure=None, **weakening):
    solid, load = st.Solid(modulus, 0.33, density), st.Load(normal_pressure=pressure)
    return make_problem(256, length, solid=solid, load=load, **weakening)


DOUBTS = {
    "units of shear_modulus = 1e.09 Pa and density = 1.17 kg/m3":
        lambda: st.Solid(1e9, 0.33, 1.17),
    "shear wave speed is 0.02924 m/s, which no solid has": lambda: st.Solid(1.0, 0.33, 1170.0),
    "fills the interface": lambda: scaled(critical_slip=2.0).warn_of_units(1e6),
    "is 1e.03 of the shear modulus": lambda: scaled(critical_slip=2.0).warn_of_units(1e12),
    "its mean, 6 Pa, is 6e-09 of the shear modulus":
        lambda: st.onset(scaled(weakening_rate=2e9, length=10.0), np.full(256, 6.0), method=LOCAL),
    "0.0002 of the normal pressure": lambda: scaled(pressure=5e9).warn_of_units(1e6),
    "1e.06 Pa, falls within a slip of 5e.09 m": lambda: scaled(
        length=4e-4, weakening_rate=2e14
    ).warn_of_units(1e6),
    "percentages": lambda: scaled(pressure=5e4).warn_of_units(1e6),
    "is 20 of the normal pressure": lambda: onset(ONE, normal_pressure=5e4),
    "for 2 % give 0.02": lambda: st.Lognormal(mean=1e6, cv=2),
    "each sample is uniform; check its unit": lambda: monte_carlo(
        random=st.RandomField(FIELD.marginal, st.PowerLawSpectrum(4.0), mean_mode=True)
    ),
    "friction_coefficient: 40 is 81 times the mean strength": lambda: st.failure_probability(
        scaled(pressure=2e6), FIELD, friction_coefficient=40, method=LOCAL
    ),
    "residual_strength: its mean, 0.45 Pa": lambda: PROBLEM.warn_of_units(1e6, 0.45),
}  # fmt: skip


LAID = dataclasses.replace(
    make_problem(residual_ratio=0.7, load=st.Load(normal_pressure=4000.0)),
    interface=dataclasses.replace(LINE, width=0.006),
)
test_a_unit_that_cannot_be_is_refused = refusals({
    "2e-06 of the normal pressure": lambda: scaled(pressure=5e11).warn_of_units(1e6),
    "2.5e+02 of the normal pressure": lambda: scaled(pressure=4000.0).warn_of_units(1e6),
    "30 Pa, falls within a slip of 6e-11 m": lambda: PROBLEM.warn_of_units(30.0),
    "0.4 Pa, is 4e-10 of the shear modulus ... need of='friction_coefficient'": lambda: monte_carlo(
        random=st.RandomField(scipy.stats.uniform(0.3, 0.2), FIELD.spectrum)
    ),
    "check the units of all lengths, moduli": lambda: scaled(modulus=1e3),
    "at most 10, got 15; for 15 % give 0.15": lambda: st.Weibull(mean=1e6, cv=15),
    # A pressing force, N: of a strength in Pa, and of coefficients.
    "load.normal_pressure: 4000 Pa ... over 0.0006 m2 are 6.67 MPa ... pressing_force = 4000":
        lambda: local_onset(LAID, np.full(256, 0.9e6)),
    "give load.pressing_force = 4000": lambda: monte_carlo(
        problem=LAID,
        random=st.RandomField(
            st.Gamma(mean=0.6, cv=0.1), FIELD.spectrum, of="friction_coefficient"
        ),
    ),
})  # fmt: skip


@pytest.mark.parametrize("words", DOUBTS)
def test_a_wrong_unit_is_doubted(words):
    with pytest.warns(st.UnitWarning, match=words) as caught:
        DOUBTS[words]()
    (unit, *_) = [one for one in caught if one.category is st.UnitWarning]
    assert unit.filename == __file__


def test_what_a_short_interface_means_is_said_once():
    """At a few nucleation lengths: what free ends would change; no word where that is 1 %."""
    words = "is 2.1 nucleation .* about 2 % on average and by up to 17 % in single cases"
    with pytest.warns(st.AccuracyWarning, match=words) as caught:
        local_onset(
            scaled(length=2.1 * PROBLEM.nucleation_length), np.linspace(1e6, 1.1e6, 256)
        )
    assert len([one for one in caught if "nucleation lengths long" in str(one.message)]) == 1
    with warnings.catch_warnings(action="error", category=st.AccuracyWarning):
        scaled(length=4.1 * PROBLEM.nucleation_length)
        make_problem((64, 64), (0.01, 0.01))  # a plane: its ends were not measured


@pytest.mark.parametrize(
    ("solid", "friction", "length", "strength"),
    [
        ((1e9, 0.33, 1170.0), 0.5e12, 0.1, 1e6),  # the paper's polymer
        ((3e10, 0.25, 2700.0), 1e6 / 1e-4, 100.0, 5e6),  # a laboratory fault in granite
        ((3e10, 0.25, 2700.0), 5e6 / 0.5, 5e4, 5e7),  # a natural fault, d_c of half a metre
        ((8e10, 0.3, 7850.0), 3e5 / 1e-6, 1.0, 3e5),  # steel, lightly clamped
        ((2e3, 0.49, 1000.0), 5e2 / 1e-3, 0.1, 5e2),  # a gel
        ((4.8e11, 0.1, 3500.0), 1e7 / 1e-8, 1e-3, 1e7),  # diamond
    ],
)
def test_what_people_study_raises_no_doubt(solid, friction, length, strength):
    with warnings.catch_warnings(action="error", category=st.UnitWarning):
        h_n = 2 * 0.5789 * solid[0] / (1 - solid[1]) / friction
        interface = st.Interface(length, max(64, 2 * int(4 * length / h_n)))
        system = st.Problem(st.Solid(*solid), interface, st.LinearWeakening(friction))
        system.warn_of_units(strength)


def test_harmless_forms_are_taken():
    given = {"samples": 1e1, "keep": "strength", "seed": 2.0}
    result = st.monte_carlo(PROBLEM, FIELD, method=LOCAL, **given)
    expected = FIELD.sample(PROBLEM.interface, samples=np.float64(10.0), seed=2)
    np.testing.assert_array_equal(result["strength"], expected)
    assert st.Interface(length=0.1, nodes=256.0).nodes == 256
    assert st.Ensemble(samples=1e4, keep="strength").keep == ("strength",)


def test_a_ready_made_sample_gives_what_its_profiles_give():
    load = st.Load(initial_stress=3e4, normal_pressure=7e6)
    problem = make_problem(residual_ratio=0.3, load=load)
    strength = np.stack(
        [1.0 + 0.2 * np.sin(np.arange(256)), 1.1 + 0.1 * np.cos(np.arange(256))]
    )
    given = {"residual_strength": 2e5, "critical_slip": np.array([[5e-6], [6e-6]])}
    given |= {"strength": 1e6 * strength, "normal_pressure": np.array([[6e6], [4e6]])}
    for other in (problem, dataclasses.replace(problem, load=st.Load())):
        found = st.onset(other, other.sample(given), method=st.Equilibrium(slip=True))
        assert found.equals(st.onset(other, given, method=st.Equilibrium(slip=True)))
