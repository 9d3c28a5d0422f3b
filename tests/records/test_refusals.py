"""Recorded refusals of what several keys, or calls, are wrong about, beside what is just taken."""

from unittest import mock

import numpy as np
import scipy.stats
import xarray as xr
from crooked import LINE, LINE_STRENGTH, PLANE
from recording import Calls, compared, refusal
from setups import EXACT, LOCAL, make_problem
from small_study import small_study

import stiction as st
from stiction.ensemble import monte_carlo

calls = Calls()
READ = "read beside the rule that refuses"
RISING = np.linspace(1e11, 2e11, 256)
FINE = st.PowerLawSpectrum(2e-9)


def field(mean=1.1e6, spectrum=None, **more):
    marginal = st.Lognormal(mean=mean, cv=0.2)
    return st.RandomField(marginal, spectrum or st.PowerLawSpectrum(4e-3), **more)


def ensemble(random, problem=None, **more):
    found = st.monte_carlo(
        problem or make_problem(),
        random,
        **{"method": LOCAL, "samples": 2, "pilot": False} | more,
    )
    return found.critical_stress


def announced(samples, workers):
    """An ensemble of which nothing is computed."""
    given = {"method": st.Rupture(loading_rate=1e6), "samples": samples, "workers": workers}
    with mock.patch.object(monte_carlo, "complete"):
        return dict(
            st.monte_carlo(make_problem(4096, 0.7), field(), pilot=False, **given).sizes
        )


def studied(**tables):
    study = st.Study.from_dict(small_study(**tables))
    return {"points": len(study.points), "axes": " ".join(study.axes)}


def steep(critical_slip, **more):
    problem = make_problem(256, 0.1, critical_slip=critical_slip, residual_strength=3e5)
    strength = 1.1e6 + 2e5 * np.sin(np.arange(256) / 7.0)
    return st.onset(problem, strength, method=EXACT, **more).critical_stress


def inferred(peaks=(7e5, 7.1e5, 6.9e5), **more):
    prior = {"marginal.mean": (1e6, 1.3e6)}
    given = {"method": LOCAL, "samples": 100, "prior": prior} | more
    return st.infer(make_problem(), field(), peaks, **given).names


def with_residual(residual, method=EXACT):
    profiles = {"strength": LINE_STRENGTH, "residual_strength": residual}
    return st.onset(LINE, profiles, method=method).critical_stress


PREDICTED = xr.Dataset({"critical_stress": ("sample", 7e5 + 1e4 * np.sin(np.arange(90.0)))})
ONSET = st.onset(LINE, LINE_STRENGTH, method=LOCAL)
CALLS = {
    "rates that vary": [
        lambda: make_problem(weakening_rate=RISING * 60.0),
        lambda: make_problem(weakening_rate=RISING * 5.55).nodes_in_nucleation_length(1.2e12),
        lambda: make_problem(weakening_rate=RISING).nodes_in_nucleation_length(2e11),
        lambda: st.onset(make_problem(weakening_rate=RISING), np.ones(256), method=LOCAL),
    ],
    "ensembles that take hours": [lambda: announced(2_100, 1), lambda: announced(47_000, 3)],
    "samples that are steep": [lambda: steep(4e-7), lambda: steep(2.1e-6)],
    "what is no residual strength": [
        lambda: with_residual(0.0),
        lambda: with_residual(-1.0),
        lambda: with_residual(1.02e6),
        lambda: with_residual(1.02e6, st.Rupture(loading_rate=9e8)),
    ],
    "fields that are too fine": [
        lambda: ensemble(st.RandomInterface(strength=field(spectrum=FINE),
                                            residual_strength=field(2e5, FINE))),
        lambda: ensemble(field(), keep=("residual_strength", "strenght")),
    ],
    "moments": [
        lambda: st.Lognormal(mean=2e5, cv=0.1, low=2e5),
        lambda: st.Weibull(mean=2.1e5, cv=0.1, low=2e5),
        lambda: st.Gamma(mean=1e6, cv=10.0),
        lambda: st.TruncatedNormal(mean=1e6, cv=0.4, low=8e5),
        lambda: st.RandomField({"type": "gamma", "a": 2.0, "cv": 0.2}, FINE),
        lambda: st.RandomField(scipy.stats.lognorm(-0.3), FINE),
    ],
    "long values": [
        lambda: st.Solid(shear_modulus=[1.0] * 40, poisson_ratio="x" * 90, density=np.ones(3)),
        lambda: make_problem(mode="i" * 58),
    ],
    "studies": [
        lambda: studied(
            uncertain={"count": 3, "strength.marginal.low": [5e5, 6e5]},
            sweep=[{"random.strength.marginal": [
                {"type": "beta", "alpha": a, "beta": 3.0, "low": low, "high": 1.6e6}
                for a, low in ((1.5, 6e5), (2.5, 6e5))
            ]}],
        ),
        lambda: studied(
            uncertain={"count": 3, "strength.marginal.low": [5e5, 6e5]},
            sweep=[{"random.strength.marginal.low": [5e5, 6e5]}],
        ),
        lambda: studied(
            ensemble={"samples": 3, "keep": ["strength"]},
            sweep=[{"random.strength": [
                small_study(correlation_length=one)["random"]["strength"] for one in (4e-3, 6e-3)
            ]}],
        ),
        lambda: studied(sweep=[{"problem.solid.poisson_ratio": [0.2, 0.7]}, {"mehtod": [1, 2]}]),
    ],
    "fits": [
        lambda: st.fit_field(LINE_STRENGTH, LINE.interface, quantity="strenght"),
    ],
    "planes": [
        lambda: st.onset(PLANE, np.full((20, 24), 1e6), method=LOCAL),
        lambda: st.onset(PLANE, np.full((24, 20), np.nan), method=LOCAL),
    ],
    "peaks and priors": [
        lambda: inferred(unit="Mstone"),
        lambda: inferred(peaks=[7e5, np.nan, 7.1e5]),
        lambda: inferred(peaks=[7e5, -7e5, 7.1e5]),
        lambda: inferred(peaks=["0.7", "0.8", "0.9"]),
        lambda: inferred(peaks=[[7e5, 7.1e5], [6.9e5, 7e5]]),
        lambda: inferred(prior={}),
        lambda: inferred(prior={"marginal.mean": (1.3e6, 1e6)}),
        lambda: inferred(prior={"marginal.mean": scipy.stats.uniform}),
        lambda: inferred(prior={"marginal.mean": scipy.stats.poisson(3)}),
        lambda: inferred(prior={"marginl.mean": (1e6, 1.3e6), "corelation_length": (1.0, 2.0)}),
        lambda: inferred(load_cell_error=-1.0, method="local"),
    ],
    "agreement": [
        lambda: st.statistics.agreement(PREDICTED, [1015.0, 998.0, 1031.0]),
        lambda: st.statistics.agreement(PREDICTED, [7e5, 7.1e5, 6.9e5], unit="N"),
        lambda: st.statistics.agreement(PREDICTED),
        lambda: st.statistics.agreement(xr.Dataset({"load": 1.0}), [7e5, 7.1e5, 6.9e5]),
        lambda: st.statistics.agreement(np.nan * PREDICTED, [7e5, 7.1e5, 6.9e5]),
    ],
    "pictures": [
        lambda: st.plot.onset(ONSET, LINE_STRENGTH[:50]),
        lambda: st.plot.onset(ONSET, LINE_STRENGTH, sample=3),
        lambda: st.plot.onset(ONSET, np.stack([LINE_STRENGTH] * 3)),
        lambda: st.plot.field(LINE, LINE_STRENGTH, quantity="rough"),
        lambda: st.plot.field(LINE, LINE_STRENGTH, ax=LINE_STRENGTH),
        lambda: st.plot.monte_carlo(ONSET, quantity="slip_patches"),
        lambda: st.plot.quantiles(PREDICTED),
        lambda: st.plot.rupture(ONSET.drop_attrs()),
        lambda: st.plot.rupture(ONSET, problem=LINE),
        lambda: st.plot.film(ONSET, "film.avi"),
    ],
    "densities": [
        lambda: st.statistics.density(np.linspace(0.1, 1.0, 40), bounds=(None, 1.0)).value[:9],
    ],
}  # fmt: skip


@calls(READ)
def what_several_keys_are_wrong_about():
    return {
        f"{name} {number}": refusal(one)
        for name, some in CALLS.items()
        for number, one in enumerate(some)
    }


test_outputs_are_as_recorded = compared(calls, __file__)
