"""The local criterion on planes as a user meets it, and the theory of its nucleation stress."""

import dataclasses
import warnings

import numpy as np
import pytest
from importance import by_importance
from setups import RATE, beta_strength, make_problem

import stiction as st
from stiction.criterion.average import averages
from stiction.criterion.windows import windows_of

NUCLEATION = 2.0 * 0.5788869418506 * 1e9 / 0.67 / RATE
METHOD = st.LocalCriterion()


@pytest.fixture(scope="module")
def plane():
    return make_problem((48, 48), (5.0 * NUCLEATION, 4.0 * NUCLEATION))


def field_of(ratio=0.7, **options):
    return beta_strength(ratio * NUCLEATION, **options)


def test_what_is_returned(plane):
    strength = field_of().sample(plane.interface, samples=4, seed=1)
    found = st.onset(plane, strength, method=METHOD)
    assert found.critical_position.dims == ("sample", "direction")
    assert list(found.direction.values) == ["x", "y"]
    assert (found.critical_position < np.array(plane.interface.lengths)).all()
    averages = st.theory.nucleation_stress(plane, strength)
    assert averages.shape == strength.shape
    np.testing.assert_allclose(found.critical_load, averages.min(axis=(1, 2)), rtol=1e-13)
    aspects = [window.aspect for window in windows_of(plane, RATE)]
    assert np.isin(found.critical_aspect.values, aspects).all()
    extents = found.critical_patch_extent.values
    np.testing.assert_allclose(extents[:, 0] / extents[:, 1], found.critical_aspect, rtol=1e-12)
    # Of an ellipse of these extents, as far as whole nodes make one.
    area = 0.25 * np.pi * found.critical_patch_extent.prod("direction")
    np.testing.assert_allclose(found.critical_patch_area, area, rtol=0.15)


def test_weights_certify_the_bound(plane):
    """(K - W) y <= 0 everywhere, with spectral wave vectors too: an upper bound."""
    interface = plane.interface
    k = interface.wavenumbers.copy()
    k[0, 0] = 1.0
    kx, ky = interface.wave_vectors
    symbol = 0.5e9 * (kx**2 / 0.67 + ky**2) / k
    for window in windows_of(plane, RATE):
        y = window.weight
        assert y.min() >= 0.0
        assert y.sum() == pytest.approx(1.0, rel=1e-12)
        forces = interface.inverse_transform(symbol * interface.transform(y)) - RATE * y
        assert forces.max() < 1e-6 * RATE * y.max()  # residual of the eigenvector


@pytest.mark.parametrize(
    "change",
    [
        lambda s: np.roll(s, (7, -3), (1, 2)),
        lambda s: np.ascontiguousarray(s[:, ::-1]),
        lambda s: np.ascontiguousarray(s[:, :, ::-1]),
    ],
)
def test_translations_and_reflections_change_nothing(plane, change):
    strength = field_of().sample(plane.interface, samples=3, seed=1)
    first, second = (st.onset(plane, s, method=METHOD) for s in (strength, change(strength)))
    np.testing.assert_allclose(first.critical_load, second.critical_load, rtol=1e-12)


def test_between_least_and_greatest_strength(plane):
    interface = plane.interface
    weak = np.random.default_rng(0).random((2, *interface.shape)) < 0.5
    strength = np.where(weak, 0.7e6, 1.6e6)
    averages = st.theory.nucleation_stress(plane, strength)
    assert averages.min() >= 0.7e6
    assert averages.max() <= 1.6e6
    uniform = st.onset(plane, np.full(interface.shape, 1e6), method=METHOD)
    assert uniform.critical_load.item() == pytest.approx(1e6, rel=1e-13)


def test_sample_i_is_the_same_whatever_batch_and_workers(plane):
    options = {"method": METHOD, "seed": 4, "progress": False}
    whole = st.monte_carlo(plane, field_of(), samples=40, workers=1, **options)
    part = st.monte_carlo(plane, field_of(), samples=3, first=20, workers=2, **options)
    for name, values in part.data_vars.items():
        assert np.array_equal(values, whole[name][20:23]), name


@pytest.mark.parametrize("mean_mode", [False, True])
def test_variance_of_the_nucleation_stress_is_that_of_theory(plane, mean_mode):
    field = field_of(1.0, mean_mode=mean_mode, anisotropy=1.4)
    theory = st.theory.nucleation_statistics(plane, field)
    middle = windows_of(plane, RATE, stretches=(1.0,))
    strength = field.sample(plane.interface, samples=400, seed=2)
    tau_n = np.array(list(averages(plane.interface, middle, strength, np.ones((48, 48)))))
    each = ((tau_n - theory.mean) ** 2).mean(axis=(1, 2))
    # Four standard errors of the mean of independent samples.
    assert abs(each.mean() - theory.variance) < 4.0 * each.std() / 20.0
    means = tau_n.mean(axis=(1, 2))
    assert abs(means.mean() - theory.mean) < 4.0 * means.std() / 20.0


def test_failure_probability_is_that_of_counting(plane):
    field = field_of()
    options = {"method": METHOD, "progress": False, "target_cv": 0.25}
    onsets = st.monte_carlo(
        plane, field, method=METHOD, samples=3000, seed=9, progress=False
    ).critical_stress.values
    stress = float(np.quantile(onsets, 0.01))
    counted = 0.01
    own = 1.0 / np.sqrt(30.0)
    found = st.failure_probability(plane, field, stress, algorithm="subset", seed=1, **options)
    assert abs(found.probability / counted - 1.0) < 4.0 * np.hypot(own, found.cv)
    shifted = by_importance(plane, field, stress, METHOD, 0.25, seed=1)
    assert abs(shifted.probability / counted - 1.0) < 4.0 * np.hypot(own, shifted.cv)
    wanted = st.design_stress(plane, field, probability=0.01, seed=2, **options)
    assert found.failing_profiles.strength.dims[-2:] == ("x", "y")
    # Four standard errors on either side, by the density of the onsets there.
    low, high = np.quantile(onsets, [0.01 * (1.0 - 4.0 * own) + 1e-4, 0.01 * (1.0 + 4.0 * own)])
    assert low < wanted.stress < high


def test_dips_count_the_onsets_that_are_low(plane):
    """Euler characteristic against onsets of other samples, where it says it can."""
    field = field_of(1.0)
    rice = st.theory.rice_distribution(plane, field, profiles=1000, seed=3)
    onsets = st.monte_carlo(
        plane, field, method=METHOD, samples=1500, seed=4, progress=False
    ).critical_stress.values
    seen = 0
    for stress in rice.stress[rice.trusted][::2]:
        share = float(np.mean(onsets <= stress))
        error = np.sqrt(share / onsets.size + share / rice.profiles)
        chance = rice.failure_probability(stress)
        # Planes of equal mean dip more evenly than a Poisson process does: half of P too low.
        assert abs(chance - share) < 4.0 * error + 0.5 * share**2
        seen += share > 0.03
    assert seen >= 3
    together = st.theory.rice_distribution(
        plane, field_of(3.0, mean_mode=True), profiles=300, seed=3
    )
    assert (together.probability[together.trusted] <= 0.1).all()


def test_refusals_name_what_is_wrong(plane):
    small = dataclasses.replace(
        plane, interface=st.Interface((1.6 * NUCLEATION, 4.0 * NUCLEATION), (16, 48))
    )
    field = field_of(0.3)
    with pytest.raises(st.InputError, match="does not fit on a plane of"):
        st.monte_carlo(small, field, method=METHOD, samples=2, progress=False)
    with pytest.raises(st.InputError, match="not in plane stress"):
        st.Problem(
            st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress"),
            plane.interface,
            plane.friction,
        )
    wide = dataclasses.replace(plane, interface=st.Interface((0.02, 0.014), (64, 48)))
    with pytest.raises(st.InputError, match="swapped: the first axis of a profile is x"):
        st.onset(wide, np.full((48, 64), 1e6), method=METHOD)
    varying = np.full((48, 48), RATE)
    varying[3, 4] *= 0.9
    uneven = dataclasses.replace(plane, friction=st.LinearWeakening(weakening_rate=varying))
    with pytest.raises(st.InputError, match="weakening_rate varies"):
        st.monte_carlo(uneven, field, method=METHOD, samples=2, progress=False)


def test_coarse_directions_are_named(plane):
    coarse = dataclasses.replace(
        plane, interface=st.Interface(plane.interface.length, (48, 26))
    )
    with pytest.warns(
        st.AccuracyWarning, match=r"9\.6 nodes along x and, in mode III, 4\.4 along"
    ):
        st.onset(coarse, np.full((48, 26), 1e6), method=METHOD)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fine = dataclasses.replace(
            plane, interface=st.Interface(plane.interface.length, (60, 72))
        )
        st.onset(fine, np.full((60, 72), 1e6), method=METHOD)
