"""Claims of the discussion: what if the strength, its spectrum or the interface were different."""

from __future__ import annotations

import numpy as np

from stiction.paper.claims.claim import Finding, Quantity, claim
from stiction.paper.claims.rules import (
    above,
    at_each,
    below,
    falling,
    kilopascal,
    megapascal,
    rising,
    worst,
)
from stiction.paper.data import Data
from stiction.paper.studies.summary import estimate, estimates
from stiction.statistics.estimates import Estimate


@claim(
    where="Sec. 5.3",
    says="A longer interface makes the critical stress vary less.",
    needs=("interface_length",),
)
def longer_interface(data: Data) -> Finding:
    """Standard deviation of tau_cr against L."""
    study = data["interface_length"]
    series = [kilopascal(each) for each in estimates(study, "standard_deviation")]
    return Finding(
        tuple(
            Quantity(f"{float(factor):g} L", each, "kPa")
            for factor, each in zip(study["length_factor"].values, series, strict=True)
        ),
        falling(series),
        f"at xi_0/h_n = {study.attrs['correlation_ratio']:g}; its mean falls too",
    )


@claim(
    where="Sec. 5.3",
    says="Strength skewed to high values would make the critical stress vary more.",
    needs=("skewness",),
)
def mirrored_variability(data: Data) -> Finding:
    """Standard deviation with the mirrored distribution over that with the setting's."""
    study = data["skewness"]
    series = []
    for ratio in data.ratios:
        own, other = (
            estimate(study, "standard_deviation", mirrored=which, correlation_ratio=ratio)
            for which in (0, 1)
        )
        quotient = other.value / own.value
        spread = np.hypot(other.error / other.value, own.error / own.value)
        series.append(Estimate(quotient, quotient * float(spread)))
    return Finding(
        at_each(data, series),
        worst([above(each, 1.0) for each in series]),
        "standard deviation with the mirrored distribution over that of the paper's",
    )


@claim(
    where="Sec. 5.3",
    says="With the other skewness, too, a shorter correlation length means a higher critical"
    " stress that varies less.",
    needs=("skewness",),
)
def mirrored_trend(data: Data) -> Finding:
    """Means and standard deviations of the mirrored distribution."""
    study = data["skewness"].sel(mirrored=1)
    means = [megapascal(each) for each in estimates(study, "mean")]
    deviations = [kilopascal(each) for each in estimates(study, "standard_deviation")]
    return Finding(
        (
            *at_each(data, means, "MPa"),
            *(
                Quantity(f"st. dev. at {ratio:g}", each, "kPa")
                for ratio, each in zip(data.ratios, deviations, strict=True)
            ),
        ),
        worst([falling(means), rising(deviations)]),
    )


@claim(
    where="Sec. 5.3",
    says="At equal length of decay to 1/e the form of the spectrum hardly matters to tau_cr.",
    needs=("spectrum",),
)
def spectrum_minor(data: Data) -> Finding:
    """Largest change of mean (against 1 %) and standard deviation (10 %) among the exponents."""
    study = data["spectrum"]
    computed, verdicts = [], []
    for exponent in study["exponent"].values:
        if exponent == data.setting.exponent:
            continue
        other = study.sel(exponent=exponent)
        for name, limit, label in (("mean", 1.0, "mean"), ("deviation", 10.0, "st. dev.")):
            change = 100.0 * np.abs(other[f"{name}_change"].values)
            at = int(change.argmax())
            error = 100.0 * float(other[f"{name}_change_error"].values[at])
            found = Estimate(float(change[at]), error)
            computed.append(Quantity(f"{label}, exponent {exponent:g}", found, "%"))
            verdicts.append(below(found, limit))
    return Finding(
        tuple(computed),
        worst(verdicts),
        "largest change over the correlation lengths, on the same draws; limits 1 % and 10 %",
    )
