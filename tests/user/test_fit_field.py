"""`st.fit_field`: its intervals by hand, gaps and trends, members whose bounds are not known."""

import re
import warnings

import numpy as np
import pytest
import xarray as xr
from records.test_mistakes_in_files import COUNT, SPACING, VALUES
from refusals import refuses

import stiction as st
from stiction.inference.bootstrap import bootstrapped
from stiction.inference.records import records_of

X = SPACING * np.arange(COUNT)
LENGTH = "correlation_length"


def labelled(values, x=X):
    coords = {"x": ("x", x, {"units": "m"})}
    return xr.DataArray(values, dims="x", coords=coords, attrs={"units": "Pa"})


RECORD = labelled(VALUES)


def fitted(record, **options):
    given = {"marginal": "lognormal", "spectrum": "exponential", "noise": False}
    return st.fit_field(record, **given | {"bootstrap": 20, "progress": False} | options)


def test_intervals_are_those_of_three_sets_of_repetitions():
    """By hand: errors in units of root length; the ends from fields of either length."""
    plain = fitted(RECORD)
    truth = plain.parameters
    sets, _ = bootstrapped(plain._estimate, 20, 0, False)

    def end(of, share):
        true, fits = of.truth.parameters[LENGTH], [fit.parameters for fit in of.fits]
        errors = [np.log(p[LENGTH] / true) / p["efolding_length"] ** 0.5 for p in fits]
        off = np.quantile(errors, share, method="weibull") * truth["efolding_length"] ** 0.5
        return truth[LENGTH] * np.exp(-off)

    around, shorter, longer = sets
    lengths = [one.truth.parameters[LENGTH] for one in sets]
    first = [truth[LENGTH], end(around, 0.95), end(around, 0.05)]
    assert lengths == pytest.approx(first, rel=1e-9)
    assert lengths[1] < lengths[0] < lengths[2]
    found = plain.interval[LENGTH]
    assert found == pytest.approx((end(shorter, 0.95), end(longer, 0.05)), rel=1e-9)


def test_a_trend_that_is_removed_leaves_the_fit_of_the_record_without():
    u = np.linspace(-1.0, 1.3, COUNT)
    trend = 0.1e6 * (u**3 - 0.4 * u**2 + 0.5 * u)
    found, bare = (
        fitted(labelled(VALUES + added), detrend=3) for added in (trend - trend.mean(), 0.0)
    )
    assert found.parameters == pytest.approx(bare.parameters, rel=1e-6)


def test_members_keep_their_moments_where_a_bound_of_beta_ends_at_zero():
    """Of nearly normal coefficients bounds are hardly known; a lower one is no less than zero."""
    spectrum = st.PowerLawSpectrum(6e-3)
    field = st.RandomField(st.Gamma(mean=0.31, cv=0.13), spectrum, mean_mode=True)
    grid = st.Interface(length=0.15, nodes=64)
    fit = st.fit_field(
        field.sample(grid, samples=4, seed=3), grid, marginal="beta", bootstrap=20,
        quantity="friction_coefficient",
    )  # fmt: skip
    # Taken for a strength of 0.3 Pa, everything that it is used in would be wrong.
    assert {one.quantity for one in (fit.field, *fit.repetitions)} == {"friction_coefficient"}
    members = [one.strength.marginal for one in fit.interfaces(40)]
    assert sum(one.low == 0.0 for one in members) > 5
    laws = [marginal.distribution for marginal in members]
    means, deviations = np.array([(law.mean(), law.std()) for law in laws]).T
    assert np.abs(means / fit.field.mean - 1.0).max() < 0.1  # the interval reaches to 0.03
    assert np.abs(deviations / fit.field.standard_deviation - 1.0).max() < 0.5


def test_positions_of_few_digits_and_dropouts():
    """x with an error of 0.3 % of the spacing at 8,064 points; a smooth record with a dropout."""
    rng = np.random.default_rng(0)
    x = np.round(np.arange(8064) * 1.5376e-4, 6)
    (record,) = records_of(labelled(rng.random(8064) + 1.0, x), None, "strength")
    assert record.values.size == 8064
    assert record.spacings == pytest.approx((1.5376e-4,), rel=1e-6)
    smooth = 1e6 + 2e5 * np.sin(X / 5e-3) + 1e3 * rng.standard_normal(COUNT)
    for place in (1, 200, COUNT - 2):
        record = smooth * np.where(np.arange(COUNT) == place, 0.7, 1.0)
        named = re.escape(f"{record[place]:.4g}")
        with pytest.warns(st.AccuracyWarning, match=f"1 of 400 values differ .* as {named}"):
            records_of(labelled(record), None, "strength")


def test_a_family_that_cannot_be_repeated_is_left_out(monkeypatch):
    """Heights about zero: no doubts of units of numbers that were fitted, and no lost minutes."""
    from stiction.inference import bootstrap

    def fit(rows, setting, start):
        if setting.marginal.name == "gamma" and start is not None:
            raise st.InputError("too far")
        return estimate(rows, setting, start)

    estimate = bootstrap.estimate
    monkeypatch.setattr(bootstrap, "estimate", fit)
    with pytest.warns(st.AccuracyWarning, match="'gamma' could be fitted to only 0 of 20"):
        kept = fitted(RECORD, marginal=["gamma", "lognormal"])
    assert list(kept.families) == ["lognormal"]
    refuses("'gamma' could be fitted to only 0 of 20", lambda: fitted(RECORD, marginal="gamma"))
    heights = labelled((VALUES - VALUES.mean()) * 1e-12).assign_attrs(units="m")
    with warnings.catch_warnings():
        warnings.simplefilter("error", st.UnitWarning)
        fitted(heights, quantity="height", marginal=["beta", "gamma"])
