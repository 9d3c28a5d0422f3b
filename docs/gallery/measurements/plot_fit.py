"""
A field fitted to a record
==========================

Histogram, quantiles, correlation and spectrum of a record of strength and of the fitted field.
"""

import xarray as xr

import stiction as st

spectrum = st.PowerLawSpectrum(3e-3, exponent=2.0, power_kept=0.9999)
truth = st.RandomField(st.Weibull(mean=1e6, cv=0.2), spectrum, mean_mode=True)
line = st.Interface(length=0.2, nodes=2400)
record = xr.DataArray(
    truth.sample(line, seed=4)[0][:1800], dims="x", coords={"x": line.x[:1800]}
).assign_attrs(units="Pa")
found = st.fit_field(record, marginal=["weibull", "lognormal"], bootstrap=50, seed=0)
panels = st.plot.fit(found)
