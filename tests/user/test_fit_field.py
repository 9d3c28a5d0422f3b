"""`st.fit_field` as a laboratory uses it: units, gaps, order, bad records."""

import numpy as np
import pytest
import xarray as xr

import stiction as st
from stiction.inference.bootstrap import bootstrapped
from stiction.inference.records import records_of

FIELD = st.RandomField(
    st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3), mean_mode=True
)
COUNT, SPACING = 400, 2e-4
PIECE = st.Interface(length=COUNT * SPACING, nodes=COUNT)
QUICK = {
    "marginal": "lognormal", "spectrum": "exponential", "noise": False, "bootstrap": 20,
    "progress": False,
}  # fmt: skip


def record_of(field, count, spacing, seed, noise=0.0):
    """The first third of a sample, so that it does not repeat itself, and its interface."""
    whole = st.Interface(length=3 * count * spacing, nodes=3 * count)
    values = field.sample(whole, seed=seed)[0, :count]
    values = values + noise * np.random.default_rng(seed).standard_normal(count)
    return values, st.Interface(length=count * spacing, nodes=count)


VALUES = record_of(FIELD, COUNT, SPACING, seed=5)[0]


def labelled(values=VALUES, x=PIECE.x, unit="Pa", x_unit="m"):
    coords = {"x": ("x", x, {"units": x_unit})}
    return xr.DataArray(values, dims="x", coords=coords, attrs={"units": unit})


def fitted(record, interface=None, **options):
    return st.fit_field(record, interface, **QUICK | options)


@pytest.fixture(scope="module")
def plain():
    return fitted(VALUES, PIECE)


def test_intervals_are_those_of_three_sets_of_repetitions(plain):
    """By hand: errors in units of root length; the ends from fields of either length."""
    name, truth = "spectrum.correlation_length", plain.parameters
    sets, _ = bootstrapped(plain._estimate, 20, 0.9, 0, False)

    def end(of, share):
        true = of.truth.parameters[name]
        errors = [
            np.log(one.parameters[name] / true) / one.parameters["efolding_length"] ** 0.5
            for one in of.fits
        ]
        off = np.quantile(errors, share, method="weibull") * truth["efolding_length"] ** 0.5
        return truth[name] * np.exp(-off)

    around, shorter, longer = sets
    lengths = [one.truth.parameters[name] for one in sets]
    first = [truth[name], end(around, 0.95), end(around, 0.05)]
    assert lengths == pytest.approx(first, rel=1e-9)
    assert lengths[1] < lengths[0] < lengths[2]
    found = plain.interval[name]
    assert found == pytest.approx((end(shorter, 0.95), end(longer, 0.05)), rel=1e-9)


def test_a_trend_that_is_removed_leaves_the_fit_of_the_record_without(plain):
    u = np.linspace(-1.0, 1.3, COUNT)
    trend = 0.5e6 * (u**3 - 0.4 * u**2 + 0.5 * u)
    found, bare = (
        fitted(labelled(VALUES + added), detrend=3) for added in (trend - trend.mean(), 0.0)
    )
    assert found.parameters == pytest.approx(bare.parameters, rel=1e-6)
    for name, interval in bare.interval.items():
        assert found.interval[name] == pytest.approx(interval, rel=1e-5)
    assert found.parameters["mean"] == pytest.approx(VALUES.mean(), rel=0.01)
    # Of 80 correlation lengths the trend takes some.
    truth = {"standard_deviation": 0.2e6, "spectrum.correlation_length": 1e-3}
    for name, value in truth.items():
        assert found.parameters[name] == pytest.approx(value, rel=0.25)


def test_missing_values_are_left_out_and_counted(plain):
    values = VALUES.copy()
    values[100:110] = np.nan
    fit = fitted(labelled(values))
    assert fit.missing == (10, 400)
    assert "10 of 400 points are missing and left out" in str(fit)
    there = np.isfinite(values)
    assert fit.parameters == fitted(labelled(VALUES[there], PIECE.x[there])).parameters
    length = "spectrum.correlation_length"
    assert fit.parameters[length] == pytest.approx(plain.parameters[length], rel=0.15)
    with pytest.warns(st.AccuracyWarning, match="filled"):  # which is no measurement
        filled = st.read_profile(labelled(values), interface=PIECE, gaps="fill")
    assert fitted(filled).parameters == fit.parameters


def test_specimens_of_different_strength_are_not_taken_for_one_field(plain):
    records = [labelled(factor * VALUES) for factor in (1.0, 0.8, 1.2)]
    with pytest.warns(st.AccuracyWarning, match="p-value of the level .* pass between=True"):
        fit = fitted(records)
    assert fit.p_values["level"] < 0.01
    alike = fitted([labelled(), labelled(VALUES[::-1])])
    assert alike.p_values["level"] == pytest.approx(1.0)
    assert "level" not in plain.p_values


def test_a_profile_that_is_there_twice_is_no_further_measurement():
    with pytest.warns(st.AccuracyWarning, match="1 of 3 profiles repeat another"):
        records_of([labelled(), labelled(VALUES[::-1]), labelled()], None, "strength")


@pytest.mark.parametrize("records", [2, 3])
@pytest.mark.filterwarnings("error::stiction.base.errors.UnitWarning")
def test_two_specimens_leave_a_wide_but_finite_scatter(records):
    rows = [
        labelled(VALUES[i * 100 : i * 100 + 100] * f, PIECE.x[:100])
        for i, f in enumerate((1.0, 1.6, 0.8)[:records])
    ]
    with pytest.warns(
        st.AccuracyWarning, match=f"{records} specimens leave .* measure at least 5"
    ):
        fit = fitted(rows, between=True)
    low, high = fit.interval["between"]
    assert 0.0 <= low < fit.parameters["between"] < high <= 1.0
    members = fit.interfaces(200, seed=4)
    cvs = np.array([one.between["strength"].cv for one in members])
    assert np.quantile(cvs, 0.05) < fit.parameters["between"] < np.quantile(cvs, 0.9)
    assert cvs.max() <= 1.0 + 1e-9
    # A mean of two scatters as a specimen does.
    means = np.log([one.strength.mean for one in members])
    assert means.std() > 0.5 * np.log1p(np.median(cvs) ** 2) ** 0.5


def test_no_noise_found_is_not_no_noise():
    """Of this rough record none is the best estimate; the noise was a tenth of the deviation.

    Repetitions without noise mostly find none either: their intervals would end at next to nothing.
    """
    spectrum = st.ExponentialSpectrum(2e-3, power_kept=0.9999)  # the usual end hides such noise
    rough = st.RandomField(st.Lognormal(mean=1e6, cv=0.3), spectrum, mean_mode=True)
    fit = fitted(*record_of(rough, 200, 2e-4, seed=6, noise=3e4), noise=True, bootstrap=40)
    low, high = fit.interval["noise"]
    assert fit.parameters["noise"] == low == 0.0
    assert high > 3e4


def test_less_than_no_noise_is_not_known_to_be_none():
    """A truncated field has less at high wavenumbers than its family: far less than zero."""
    spectrum = st.PowerLawSpectrum(2e-3, exponent=2.0, power_kept=0.99)
    truncated = st.RandomField(st.Lognormal(mean=1e6, cv=0.2), spectrum)
    family = {"type": "power_law", "exponent": 2.0}
    record = record_of(truncated, 300, 2e-4, seed=1, noise=2e4)
    fit = fitted(*record, noise=True, spectrum=family)
    assert fit.interval["noise"][0] == fit.parameters["noise"] == 0.0
    assert fit.interval["noise"][1] > 1e4


@pytest.fixture(scope="module")
def bounded():
    """A rough field between bounds, to be fitted by its bounds and its exponent too."""
    truth = st.RandomField(
        st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        st.PowerLawSpectrum(2e-3, exponent=1.0, power_kept=0.99),
    )
    interface = st.Interface(length=0.05, nodes=256)
    values = truth.sample(interface, samples=1, seed=3)[0, :128]
    return labelled(values, interface.x[:128]), {"marginal": "beta", "spectrum": "power_law"}


def test_bounds_lie_outside_of_values_without_noise(bounded):
    record, families = bounded
    interval = fitted(record, **families).interval
    assert interval["marginal.low"][1] <= record.min()
    assert interval["marginal.high"][0] >= record.max()
    assert interval["spectrum.exponent"][0] >= 0.65
    assert interval["spectrum.exponent"][1] <= 16.0
    for name in ("marginal.low", "marginal.high", "spectrum.exponent"):
        assert interval[name][0] < interval[name][1]
    interval = fitted(labelled(), marginal="uniform").interval
    assert interval["marginal.loc"][1] <= VALUES.min()
    assert interval["marginal.scale"][0] >= np.ptp(VALUES) * (1.0 - 1e-12)


def test_a_field_of_coefficients_says_so():
    """Taken for a strength of 0.3 Pa, everything that it is used in would be wrong."""
    fit = fitted(VALUES * 3e-7, PIECE, quantity="friction_coefficient")
    assert fit.field.of == "friction_coefficient"
    assert {field.of for field in fit.repetitions} == {"friction_coefficient"}


def test_members_keep_their_moments_where_a_bound_of_beta_ends_at_zero():
    """Of nearly normal values bounds are hardly known; a lower one is no less than zero."""
    field = st.RandomField(
        st.Gamma(mean=0.31e6, cv=0.13), st.PowerLawSpectrum(6e-3), mean_mode=True
    )
    records = field.sample(st.Interface(length=0.15, nodes=64), samples=4, seed=3)
    fit = st.fit_field(
        records, st.Interface(length=0.15, nodes=64), marginal="beta", bootstrap=40
    )
    members = [one.strength.marginal for one in fit.interfaces(40)]
    assert sum(one.low == 0.0 for one in members) > 5
    means, deviations = np.array(
        [(one.distribution.mean(), one.distribution.std()) for one in members]
    ).T
    assert np.abs(means / fit.field.mean - 1.0).max() < 0.1  # the interval reaches to 0.03
    assert np.abs(deviations / fit.field.standard_deviation - 1.0).max() < 0.5
