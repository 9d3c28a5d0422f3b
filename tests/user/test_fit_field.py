"""`st.fit_field` as a laboratory uses it: units, gaps, order, bad records, the command."""

import re

import numpy as np
import pytest
import xarray as xr
from refusals import refuses

import stiction as st
from stiction.inference import bootstrap

FIELD = st.RandomField(
    st.Lognormal(mean=1e6, cv=0.2), st.ExponentialSpectrum(1e-3), mean_mode=True
)
COUNT, SPACING = 400, 2e-4
PIECE = st.Interface(length=COUNT * SPACING, nodes=COUNT)
VALUES = FIELD.sample(st.Interface(length=3 * PIECE.length, nodes=3 * COUNT), seed=5)[0, :COUNT]
QUICK = {
    "marginal": "lognormal", "spectrum": "exponential", "noise": False, "bootstrap": 20,
    "progress": False,
}  # fmt: skip


def labelled(values=VALUES, x=PIECE.x, unit="Pa", x_unit="m"):
    coords = {"x": ("x", x, {"units": x_unit})}
    return xr.DataArray(values, dims="x", coords=coords, attrs={"units": unit})


@pytest.fixture(scope="module")
def plain():
    return st.fit_field(VALUES, PIECE, **QUICK)


def test_what_it_finds_is_what_was_put_in(plain):
    assert plain.field.mean == pytest.approx(1e6, rel=0.15)
    assert plain.parameters["spectrum.correlation_length"] == pytest.approx(1e-3, rel=0.6)
    assert plain.parameters.keys() == plain.interval.keys()
    for name, (low, high) in plain.interval.items():
        assert low < high, name
    assert "marginal.cv" in repr(plain)
    assert len(plain.repetitions) == 20
    assert plain.field.sample(PIECE, seed=1).shape == (1, COUNT)


def test_units_that_are_stated_are_converted(plain):
    other = st.fit_field(labelled(VALUES * 1e-6, PIECE.x * 1e3, "MPa", "mm"), **QUICK)
    for name, value in plain.parameters.items():
        assert other.parameters[name] == pytest.approx(value, rel=1e-6), name


def test_coordinates_decide_and_not_the_order(plain):
    order = np.random.default_rng(0).permutation(COUNT)
    other = st.fit_field(labelled(VALUES[order], PIECE.x[order] + 0.3), **QUICK)
    assert other.parameters == pytest.approx(plain.parameters, rel=1e-6)


def test_missing_values_are_left_out_and_counted(plain):
    values = VALUES.copy()
    values[100:110] = np.nan
    fit = st.fit_field(labelled(values), **QUICK)
    assert fit.missing == (10, 400)
    assert "10 of 400 points are missing and left out" in str(fit)
    missing = np.delete(np.arange(COUNT), np.arange(100, 110))
    left_out = st.fit_field(labelled(VALUES[missing], PIECE.x[missing]), **QUICK)
    assert fit.parameters == left_out.parameters
    length = "spectrum.correlation_length"
    assert fit.parameters[length] == pytest.approx(plain.parameters[length], rel=0.15)
    with pytest.warns(
        st.AccuracyWarning, match="filled"
    ):  # what was filled in is no measurement
        filled = st.read_profile(labelled(values), interface=PIECE, gaps="fill")
    assert st.fit_field(filled, **QUICK).parameters == fit.parameters


def test_several_records_are_of_one_field(plain):
    many = st.fit_field([labelled(), labelled(VALUES[::-1])], **QUICK)
    assert many.lengths_held == pytest.approx(2.0 * plain.lengths_held, rel=0.2)


def test_maps_are_fitted_too():
    truth = st.RandomField(
        st.Weibull(mean=2e6, cv=0.3), st.SquaredExponentialSpectrum(1e-3), mean_mode=True
    )
    plane = st.Interface(length=(16e-3, 16e-3), nodes=(64, 64))
    values = truth.sample(plane, seed=1)[0, :48, :40]
    pressure = xr.DataArray(
        values * 1e-6,
        dims=("x", "y"),
        coords={"x": plane.coordinates["x"][:48], "y": plane.coordinates["y"][:40]},
        attrs={"units": "MPa"},
    )
    options = {"marginal": "weibull", "spectrum": "squared_exponential", "bootstrap": 20}
    fit = st.fit_field(
        pressure.transpose("y", "x"), quantity="normal_pressure", progress=False, **options
    )
    # 120 correlation areas.
    assert fit.field.mean == pytest.approx(2e6, rel=0.15)
    assert fit.parameters["spectrum.correlation_length"] == pytest.approx(1e-3, rel=0.15)
    assert st.plot.fit(fit).axes


INFINITE = np.where(np.arange(COUNT) == 3, np.inf, VALUES)
REFUSED = {
    "has no point spacing": VALUES,
    "x repeats": labelled(x=np.repeat(PIECE.x[::2], 2)),
    "not equally spaced": labelled(x=PIECE.x**1.2),
    "40 measured points, too short": labelled(VALUES[:40], PIECE.x[:40]),
    "is constant, 1e+06 everywhere": labelled(np.full(COUNT, 1e6)),
    "must be finite; entry 3": labelled(INFINITE),
    "x or y repeats": xr.DataArray(
        VALUES.reshape(20, 20),
        {"x": PIECE.x[[*range(19), 18]], "y": PIECE.x[:20]},
        ("x", "y"),
    ),
    "must be numbers": "profile.csv",
    "must not be empty": [],
    "400 of 400 values ... do not lie between the bounds": labelled(-VALUES),
    "unknown unit 'banana'": labelled(x_unit="banana"),
    "cannot be converted to Pa": labelled(unit="um"),
}
WRONG_OPTIONS = {
    "detrend ... noise ... bootstrap ... confidence ... seed ... progress": {
        "detrend": 7, "noise": -1.0, "bootstrap": 3, "confidence": 90, "seed": -1, "progress": "x",
    },
    "did you mean 'lognormal' ... did you mean 'exponent'": {
        "marginal": "lognormul", "spectrum": {"type": "power_law", "exponnt": 2.0},
    },
    "anisotropy: applies to maps only": {"anisotropy": True},
}  # fmt: skip


@pytest.mark.parametrize("words", REFUSED)
def test_records_that_cannot_be_fitted_are_refused(words):
    refuses(words, lambda: st.fit_field(REFUSED[words], **QUICK))


@pytest.mark.parametrize("words", WRONG_OPTIONS)
def test_wrong_options_are_refused(words):
    refuses(words, lambda: st.fit_field(VALUES, PIECE, **QUICK | WRONG_OPTIONS[words]))


NOISE = np.random.default_rng(1).standard_normal(COUNT)
FEW = {"spectrum": {"type": "exponential", "correlation_length": 1e-3}}
HIGH = np.median(VALUES) < VALUES
DOUBTS = {
    "correlation lengths, too few": (labelled(VALUES[:64], PIECE.x[:64] / 4.0), FEW),
    "p-value of the marginal is 0.01": (labelled(VALUES + 2e6 * HIGH), {"bootstrap": 99}),
    "hides the cut-off": (labelled(1e7 + VALUES + 3e6 * NOISE), {"noise": 3e6}),
    r"1 of 400 values are outliers.* 2e\+07": (labelled(np.r_[2e7, VALUES[1:]]), {}),
}


@pytest.mark.parametrize("words", DOUBTS)
def test_doubtful_records_are_warned_of(words):
    record, options = DOUBTS[words]
    with pytest.warns(st.AccuracyWarning, match=words):
        st.fit_field(record, **QUICK | options)


def test_no_noise_found_is_not_no_noise():
    """Of this rough record none is the best estimate; the noise was a tenth of the deviation.

    Repetitions without noise mostly find none either: their intervals would end at next to nothing.
    """
    spectrum = st.ExponentialSpectrum(2e-3, power_kept=0.9999)  # the usual end hides such noise
    rough = st.RandomField(st.Lognormal(mean=1e6, cv=0.3), spectrum, mean_mode=True)
    record = rough.sample(st.Interface(length=0.12, nodes=600), seed=6)[0, :200]
    record = record + 3e4 * np.random.default_rng(6).standard_normal(200)
    fit = st.fit_field(
        record, st.Interface(length=0.04, nodes=200), **QUICK | {"noise": True, "bootstrap": 40}
    )
    low, high = fit.interval["noise"]
    assert fit.parameters["noise"] == low == 0.0
    assert high > 3e4


def test_less_than_no_noise_is_not_known_to_be_none():
    """A truncated field has less at high wavenumbers than its family: far less than zero."""
    truncated = st.RandomField(
        st.Lognormal(mean=1e6, cv=0.2), st.PowerLawSpectrum(2e-3, exponent=2.0, power_kept=0.99)
    )
    values = truncated.sample(st.Interface(length=0.18, nodes=900), seed=1)[0, :300]
    values = values + 2e4 * np.random.default_rng(1).standard_normal(300)
    options = QUICK | {"noise": True, "spectrum": {"type": "power_law", "exponent": 2.0}}
    fit = st.fit_field(values, st.Interface(length=0.06, nodes=300), **options)
    assert fit.interval["noise"][0] == fit.parameters["noise"] == 0.0
    assert fit.interval["noise"][1] > 1e4


def test_shapes_of_scipy_may_be_negative():
    fit = st.fit_field(labelled(), **QUICK | {"marginal": "skewnorm"})
    low, high = fit.interval["marginal.a"]
    assert low < fit.parameters["marginal.a"] < high
    assert low < 0.0


def bounded(noise):
    """A rough field between bounds, fitted by its bounds and its exponent too."""
    truth = st.RandomField(
        st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        st.PowerLawSpectrum(2e-3, exponent=1.0, power_kept=0.99),
    )
    interface = st.Interface(length=0.05, nodes=256)
    values = truth.sample(interface, samples=1, seed=3)[0, :128]
    options = QUICK | {"marginal": "beta", "spectrum": "power_law", "noise": noise}
    return values, st.fit_field(labelled(values, interface.x[:128]), **options)


def test_bounds_lie_outside_of_values_without_noise():
    values, fit = bounded(noise=False)
    assert fit.interval["marginal.low"][1] <= values.min()
    assert fit.interval["marginal.high"][0] >= values.max()
    assert fit.interval["spectrum.exponent"][0] >= 0.65
    assert fit.interval["spectrum.exponent"][1] <= 16.0
    for name in ("marginal.low", "marginal.high", "spectrum.exponent"):
        assert fit.interval[name][0] < fit.interval[name][1]


def test_the_scale_of_a_uniform_marginal_spans_the_values():
    fit = st.fit_field(labelled(), **QUICK | {"marginal": "uniform"})
    least, most = VALUES.min(), VALUES.max()
    limits = bootstrap.limits_of(fit._estimate, VALUES)
    assert limits["marginal.loc"] == (-np.inf, least)
    assert limits["marginal.scale"] == (pytest.approx(most - least), np.inf)
    normal = st.fit_field(labelled(), **QUICK | {"marginal": "normal"})  # has no bounds
    assert bootstrap.limits_of(normal._estimate, VALUES) == {}


@pytest.mark.parametrize(
    ("interval", "limits", "cut"),
    [
        ((1.0, 2.0), (0.65, 16.0), (1.0, 2.0)),
        ((1.0, 350.0), (0.65, 16.0), (1.0, 16.0)),
        ((15.999, 350.0), (0.65, 16.0), (0.65, 16.0)),
        ((-4.0, 3.0), (2.0, np.inf), (2.0, 3.0)),
        ((-4.0, 1.0), (2.0, np.inf), (2.0, 2.5)),  # the estimate
        ((2.0, 2.0001), (2.0, np.inf), (2.0, 2.0001)),
    ],
)
def test_intervals_are_cut(interval, limits, cut):
    assert bootstrap.cut(interval, limits, 2.5) == cut


def test_a_field_of_coefficients_says_so():
    """Taken for a strength of 0.3 Pa, everything that it is used in would be wrong."""
    mu = st.RandomField(st.Lognormal(mean=0.3, cv=0.2), st.ExponentialSpectrum(1e-3))
    values = mu.sample(PIECE, seed=1)[0]
    fit = st.fit_field(values, PIECE, quantity="friction_coefficient", **QUICK)
    assert fit.field.of == "friction_coefficient"
    assert {field.of for field in fit.repetitions} == {"friction_coefficient"}
    assert st.fit_field(VALUES, PIECE, **QUICK).field.of is None


@pytest.mark.slow
def test_intervals_hold_nothing_that_cannot_be():
    values, fit = bounded(noise=True)
    interval = fit.interval
    # Noise may have carried values beyond the bounds: as far as the estimate has it, or as the most
    # there may be of it does.
    share = 1.0 - (interval["noise"][1] / values.std()) ** 2
    quiet = values.mean() + np.sqrt(share) * (values - values.mean())
    low, high = fit.parameters["marginal.low"], fit.parameters["marginal.high"]
    assert interval["marginal.low"][1] <= max(low, quiet.min()) * (1.0 + 1e-9)
    assert interval["marginal.high"][0] >= min(high, quiet.max()) * (1.0 - 1e-9)
    # The estimate is the end of the range; repetitions end there too, which tells nothing.
    assert interval["spectrum.exponent"] == (0.65, 16.0)
    assert re.search(r"exponent +16 +0.65 to 16 \(searched from 0.65 to 16\)", str(fit))
