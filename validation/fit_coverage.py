"""How often the intervals of `st.fit_field` hold the truth: simulated records of known fields.

Three spectra and marginals, on records of 20 and 60 correlation lengths, without noise and with
noise of a fifth of the field's standard deviation. Intervals of 90 % should hold it 85 to 95 times
in 100; of 100 records the count itself scatters by 3.

    python validation/fit_coverage.py [--records 100] [--first 0] [--bootstrap 100] [--only NAME]
"""

import argparse
import time
import warnings
from typing import NamedTuple

import numpy as np

import stiction as st

LENGTH = 2e-3  # m; every field's correlation length
POINTS = 10  # in a correlation length


class Case(NamedTuple):
    """A field, and as what it is fitted."""

    field: st.RandomField
    marginal: str | dict
    spectrum: str | dict


CASES = {
    "power law, beta": Case(
        st.RandomField(
            st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
            st.PowerLawSpectrum(LENGTH, 4.0),
            mean_mode=True,
        ),
        {"type": "beta", "low": 0.66e6, "high": 1.66e6},
        {"type": "power_law", "exponent": 4.0},
    ),
    "exponential, lognormal": Case(
        st.RandomField(
            st.Lognormal(mean=1e6, cv=0.3),
            st.ExponentialSpectrum(LENGTH, power_kept=0.9999),  # a fit takes it as whole
            mean_mode=True,
        ),
        "lognormal",
        "exponential",
    ),
    "squared exponential, Weibull": Case(
        st.RandomField(
            st.Weibull(mean=1e6, cv=0.3), st.SquaredExponentialSpectrum(LENGTH), mean_mode=True
        ),
        "weibull",
        "squared_exponential",
    ),
}
SIZES = {"short": 20, "long": 60}
NOISES = (0.0, 0.2)


def truth_of(case: Case, noise: float) -> dict[str, float]:
    """What the fit's parameters should be."""
    marginal, spectrum = case.field.marginal, case.field.spectrum
    deviation = case.field.standard_deviation
    values = {
        "mean": case.field.mean,
        "standard_deviation": deviation,
        "correlation_length": spectrum.correlation_length,
        "noise": noise * deviation,
    }
    names = ("alpha", "beta", "mean", "cv")
    return values | {
        f"marginal.{n}": getattr(marginal, n) for n in names if hasattr(marginal, n)
    }


def record(case: Case, lengths: int, noise: float, seed: int) -> np.ndarray:
    """A piece, a third of the period, of a simulated field, with noise."""
    nodes = 3 * lengths * POINTS
    interface = st.Interface(length=3 * lengths * LENGTH, nodes=nodes)
    values = case.field.sample(interface, seed=seed)[0, : nodes // 3]
    rng = np.random.default_rng([seed, 1])
    return values + noise * case.field.standard_deviation * rng.standard_normal(values.size)


def coverage(
    case: Case, lengths: int, noise: float, records: int, bootstrap: int, first: int = 0
) -> dict[str, tuple[float, float]]:
    """Share of intervals that hold the truth, and median relative error, by parameter."""
    truth = truth_of(case, noise)
    interface = st.Interface(length=lengths * LENGTH, nodes=lengths * POINTS)
    hits: dict[str, list[bool]] = {}
    errors: dict[str, list[float]] = {}
    for seed in range(first, first + records):
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", st.AccuracyWarning)
            fit = st.fit_field(
                record(case, lengths, noise, seed), interface, marginal=case.marginal,
                spectrum=case.spectrum, noise=noise > 0.0, bootstrap=bootstrap, seed=seed,
                progress=False,
            )  # fmt: skip
        for name, (low, high) in fit.interval.items():
            if name in truth:
                hits.setdefault(name, []).append(low <= truth[name] <= high)
                errors.setdefault(name, []).append(fit.parameters[name] / truth[name] - 1.0)
    return {name: (float(np.mean(hits[name])), float(np.median(errors[name]))) for name in hits}


def main() -> None:
    """Print the table, case by case."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--records", type=int, default=100)
    parser.add_argument("--first", type=int, default=0, help="seed of the first record")
    parser.add_argument("--bootstrap", type=int, default=100)
    parser.add_argument("--only", default="")
    options = parser.parse_args()
    for name, case in CASES.items():
        for size, lengths in SIZES.items():
            for noise in NOISES:
                title = f"{name}, {size}, noise {noise:g}"
                if options.only not in title:
                    continue
                begin = time.process_time()
                how = (options.records, options.bootstrap, options.first)
                found = coverage(case, lengths, noise, *how)
                cells = ", ".join(
                    f"{key.rpartition('.')[2]} {100 * share:.0f} % ({100 * bias:+.1f} %)"
                    for key, (share, bias) in found.items()
                )
                print(f"{title}: {cells}; {time.process_time() - begin:.0f} s", flush=True)


if __name__ == "__main__":
    main()
