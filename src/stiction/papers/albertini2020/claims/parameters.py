"""Claims about the parameters: printed numbers, modulus, nucleation length, spectrum."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from stiction.criterion.eigenproblem import eigenvalues_and_vector, rounded_weight
from stiction.papers.albertini2020.claims.claim import Finding, Quantity, Verdict, claim
from stiction.papers.albertini2020.claims.rules import (
    agrees,
    at_each,
    below,
    kilopascal,
    megapascal,
    worst,
)
from stiction.papers.albertini2020.data import Data
from stiction.statistics.estimates import Estimate, mean, standard_deviation


@claim(where="Sec. 3.1", says="The mean peak strength is 1 MPa.", printed="1 MPa")
def mean_strength(data: Data) -> Finding:
    """Exact, from the distribution."""
    found = Estimate(data.setting.mean * 1e-6)
    verdict = agrees(found, 1.0, 0.001)
    comment = "rounded up; ratios to <tau_p> are here to the exact mean"
    return Finding((Quantity("<tau_p>", found, "MPa"),), verdict, _unless_holds(verdict, comment))


@claim(
    where="Sec. 3.1",
    says="The standard deviation of the peak strength is 0.2 MPa.",
    printed="0.2 MPa",
)
def strength_deviation(data: Data) -> Finding:
    """Exact, from the distribution."""
    found = Estimate(data.setting.field(data.ratios[0]).standard_deviation * 1e-6)
    return Finding((Quantity("", found, "MPa"),), agrees(found, 0.2, 0.01))


@claim(
    where="Sec. 4.2, Fig. 5",
    says="The lower bound of the strength is 0.66 of its mean.",
    printed="0.66",
)
def lower_bound(data: Data) -> Finding:
    """Exact, from the distribution."""
    found = Estimate(data.setting.bounds[0] / data.setting.mean)
    verdict = agrees(found, 0.66, 0.001)
    comment = "0.66 MPa over the exact mean strength"
    return Finding((Quantity("", found),), verdict, _unless_holds(verdict, comment))


@claim(
    where="Sec. 3.2, Eq. 8",
    says="In plane stress the effective modulus of mode II is G/(1-nu).",
    printed="G/(1-nu)",
)
def effective_modulus(data: Data) -> Finding:
    """Against 2 G (1 - c_s^2/c_d^2), the static limit of elastodynamics in that plane state."""
    solid = data.setting.problem.solid
    stress = dataclasses.replace(solid, plane="stress").effective_modulus("II")
    printed = solid.shear_modulus / (1.0 - solid.poisson_ratio)
    verdict = agrees(Estimate(stress), printed, 1e-6 * printed, 0.0)
    return Finding(
        (
            Quantity("G*/G of plane stress", Estimate(stress / solid.shear_modulus)),
            Quantity("G/(1-nu) over G", Estimate(printed / solid.shear_modulus)),
        ),
        verdict,
        _unless_holds(verdict, "in plane stress G* = G (1+nu); G/(1-nu) belongs to plane strain"),
    )


@claim(
    where="Sec. 3.2, Eq. 8",
    says="The critical nucleation length is 1.158 G*/W.",
    printed="1.158",
)
def nucleation_factor(data: Data) -> Finding:
    """Twice the smallest eigenvalue of Uenishi and Rice (2003)."""
    smallest, _ = eigenvalues_and_vector()
    found = Estimate(2.0 * smallest)
    return Finding((Quantity("2 lambda_0", found),), agrees(found, 1.158, 0.001))


@claim(
    where="Sec. 3.3",
    says="The nucleation length is 0.034 of the length of the interface.",
    printed="0.034",
)
def nucleation_length(data: Data) -> Finding:
    """With the modulus of the setting's plane state, and with the printed one."""
    problem = data.setting.problem
    length = problem.interface.extent
    own = Estimate(problem.nucleation_length / length)
    strain = dataclasses.replace(problem, solid=dataclasses.replace(problem.solid, plane="strain"))
    printed = Estimate(strain.nucleation_length / length)
    verdict = agrees(own, 0.034, 0.001)
    comment = (
        f"{printed.value:.4f} with the printed modulus, {own.value:.4f} with that of plane"
        f" {problem.solid.plane}"
    )
    return Finding(
        (Quantity("h_n/L", own), Quantity("with the printed modulus", printed)),
        verdict,
        _unless_holds(verdict, comment),
    )


@claim(
    where="Secs. 3.1 and 3.3",
    says="The interface is considerably longer than the nucleation length.",
)
def long_interface(data: Data) -> Finding:
    """At least ten nucleation lengths."""
    problem = data.setting.problem
    found = Estimate(problem.interface.extent / problem.nucleation_length)
    verdict = Verdict.HOLDS if found.value >= 10.0 else Verdict.FAILS
    return Finding((Quantity("L/h_n", found),), verdict)


@claim(
    where="App. B, Eq. B.1",
    says="0.751 times the integral of the printed eigenfunction is 1.",
    printed="1",
)
def unit_weight(data: Data) -> Finding:
    """The rounded weights' integral, pi/2 of its first sine coefficient."""
    found = Estimate(math.pi / 2.0 * float(rounded_weight().sine[0]))
    verdict = agrees(found, 1.0, 1e-4, 0.001)
    return Finding(
        (Quantity("", found),),
        verdict,
        _unless_holds(verdict, "tau_n and tau_cr come out too high by the same factor"),
    )


@claim(
    where="Sec. 3.2, Eq. 9",
    says="The rounded weights do for computing the critical stress.",
    needs=("correction",),
)
def rounded_weights(data: Data) -> Finding:
    """Mean difference on the same samples, against 0.1 % of the stress."""
    study = data["correction"]
    pairs = zip(study["rounded"].values, study["rounded_error"].values, strict=True)
    series = [Estimate(float(value), float(error)) for value, error in pairs]
    limit = 1e-3 * float(study["own"].min())
    verdict = worst([below(Estimate(abs(each.value), each.error), limit) for each in series])
    return Finding(
        at_each(data, [kilopascal(each) for each in series], "kPa"),
        verdict,
        f"too high by less than 0.1 % of tau_cr ({limit * 1e-3:.2g} kPa)"
        if verdict is Verdict.HOLDS
        else "too high by so much",
    )


@claim(
    where="Sec. 3.2, Eq. 8, and Sec. 3.3",
    says="The prediction with the printed modulus is that of the plane-stress problem.",
    needs=("correction",),
)
def printed_modulus(data: Data) -> Finding:
    """Mean difference on the same samples between the two moduli, against 0.1 % of the stress."""
    study = data["correction"]
    pairs = zip(study["printed"].values, study["printed_error"].values, strict=True)
    series = [Estimate(float(value), float(error)) for value, error in pairs]
    share = [
        each.scaled(100.0 / float(own))
        for each, own in zip(series, study["own"].values, strict=True)
    ]
    verdict = worst([below(each, 0.1) for each in share])
    return Finding(
        at_each(data, share, "%"),
        verdict,
        _unless_holds(
            verdict, f"tau_cr comes out up to {max(each.value for each in share):.2g} % too high"
        ),
    )


@claim(
    where="Sec. 2.3, Eq. 7",
    says="Truncating the spectrum at 2.5 times the cutoff keeps 0.9997 of the power.",
    printed="0.9997",
)
def power_kept(data: Data) -> Finding:
    """Exact, by the incomplete beta function."""
    found = Estimate(data.setting.field(data.ratios[0]).spectrum.power_kept_by_truncation)
    return Finding((Quantity("", found),), agrees(found, 0.9997, 0.0001))


@claim(
    where="Sec. 2.2",
    says="The mapping hardly changes the correlation: C of z and of tau_p are about equal.",
    needs=("theory",),
)
def correlation_kept(data: Data) -> Finding:
    """Largest difference of the two over all lags, against 0.05."""
    theory = data["theory"]
    gap = np.abs(theory["correlation"].values - theory["gaussian_correlation"].values).max(axis=1)
    series = [Estimate(float(each)) for each in gap]
    return Finding(
        at_each(data, series),
        worst([below(each, 0.05) for each in series]),
        "largest difference over all lags",
    )


@claim(where="Sec. 2.2", says="The correlation of z is positive.", needs=("theory",))
def positive_correlation(data: Data) -> Finding:
    """Smallest value on the periodic interface; on an infinite one it is positive."""
    smallest = data["theory"]["gaussian_correlation"].min("lag").values
    series = [Estimate(float(each)) for each in smallest]
    if min(smallest) > 0.0:
        verdict = Verdict.HOLDS
    else:
        verdict = Verdict.CORRECTED if min(smallest) > -0.1 else Verdict.FAILS
    comment = "true on an infinite line; without the mean mode C averages to zero over the period"
    return Finding(at_each(data, series), verdict, _unless_holds(verdict, comment))


@claim(
    where="Sec. 2.2",
    says="xi_0 = 2 pi/lambda measures the memory of the field like the length where C = 1/e.",
)
def correlation_length(data: Data) -> Finding:
    """Ratio of the two lengths, for z and for the strength; alike within a factor of two."""
    field = data.setting.field(data.ratios[-1])
    xi = data.setting.spectrum(data.ratios[-1]).correlation_length
    found = [Estimate(field.efolding_length(of=of) / xi) for of in ("z", "strength")]
    alike = all(0.5 <= each.value <= 2.0 for each in found)
    return Finding(
        (
            Quantity("length where C of z is 1/e, over xi_0", found[0]),
            Quantity("the same of tau_p", found[1]),
        ),
        Verdict.HOLDS if alike else Verdict.FAILS,
        f"but the decay length is only {found[0].value:.2f} of xi_0" if alike else "",
    )


@claim(
    where="Sec. 4.1",
    says="10,000 samples describe the distribution of the critical stress accurately.",
    needs=("monte_carlo",),
)
def enough_samples(data: Data) -> Finding:
    """Relative standard errors of mean and standard deviation at the number of samples taken."""
    stress = data.at(data.ratios[0])["critical_stress"].values
    m, s = mean(stress), standard_deviation(stress)
    good = m.error < 1e-3 * m.value and s.error < 0.02 * s.value
    return Finding(
        (
            Quantity("mean", megapascal(m), "MPa"),
            Quantity("standard deviation", kilopascal(s), "kPa"),
            Quantity("samples", Estimate(float(data.samples))),
        ),
        Verdict.HOLDS if good else Verdict.OPEN,
        "" if good else "more samples are needed to tell",
    )


def _unless_holds(verdict: Verdict, comment: str) -> str:
    return "" if verdict is Verdict.HOLDS else comment
