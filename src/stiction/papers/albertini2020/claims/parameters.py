"""Claims about the parameters: printed numbers, nucleation length, spectrum, fracture energy."""

from __future__ import annotations

import math

import numpy as np

from stiction.criterion.eigenproblem import eigenvalues_and_vector, rounded_weight
from stiction.papers.albertini2020.claims import limits
from stiction.papers.albertini2020.claims.claim import Measured, Quantity, claim
from stiction.papers.albertini2020.claims.combined_rules import All, Construction
from stiction.papers.albertini2020.claims.measures import at_each, labelled, one, pairs
from stiction.papers.albertini2020.claims.rules import Above, Below, Graded, Printed, Within
from stiction.papers.albertini2020.data import Data
from stiction.statistics.estimates import Estimate, mean, standard_deviation


@claim(
    where="Sec. 3.1",
    says="The mean peak strength is 1 MPa.",
    printed="1 MPa",
    rule=Printed("1"),
)
def mean_strength(data: Data) -> Measured:
    """Exact, from the distribution."""
    return Measured(one("<tau_p>", data.setting.mean * 1e-6, "MPa"))


@claim(
    where="Sec. 3.1",
    says="The standard deviation of the peak strength is 0.2 MPa.",
    printed="0.2 MPa",
    rule=Printed("0.2"),
)
def strength_deviation(data: Data) -> Measured:
    """Exact, from the distribution."""
    return Measured(one("", data.setting.field(data.ratios[0]).standard_deviation * 1e-6, "MPa"))


@claim(
    where="Sec. 4.2, Fig. 5",
    says="The lower bound of the strength is 0.66 of its mean.",
    printed="0.66",
    rule=Printed("0.66"),
)
def lower_bound(data: Data) -> Measured:
    """Exact, from the distribution."""
    return Measured(one("", data.setting.bounds[0] / data.setting.mean))


@claim(
    where="Sec. 3.2, Eq. 8",
    says="The critical nucleation length is 1.158 G*/W.",
    printed="1.158",
    rule=Printed("1.158"),
)
def nucleation_factor(data: Data) -> Measured:
    """Twice the smallest eigenvalue of Uenishi and Rice (2003)."""
    smallest, _ = eigenvalues_and_vector()
    return Measured(one("2 lambda_0", 2.0 * smallest))


@claim(
    where="App. B, Eq. B.1",
    says="0.751 times the integral of the printed eigenfunction is 1.",
    printed="0.751",
    rule=Printed("0.751"),
)
def unit_weight(data: Data) -> Measured:
    """The factor that makes it one, from the integral pi/2 of the first sine coefficient."""
    whole = math.pi / 2.0 * float(rounded_weight().sine[0])
    return Measured(one("factor that makes it 1", 0.751 / whole), one("0.751 times it", whole))


@claim(
    where="Secs. 3.1 and 3.3",
    says="The interface is considerably longer than the nucleation length.",
    rule=Above(limits.MUCH_LONGER),
)
def long_interface(data: Data) -> Measured:
    """Their ratio."""
    problem = data.setting.problem
    return Measured(one("L/h_n", problem.interface.extent / problem.nucleation_length))


@claim(
    where="Sec. 3.2, Eq. 9",
    says="The rounded weights do for computing the critical stress.",
    needs=("correction",),
    rule=Below(limits.AS_ONE),
)
def rounded_weights(data: Data) -> Measured:
    """Mean difference on the same samples, per cent of the stress."""
    study = data["correction"]
    share = 100.0 / study["own"].values
    series = [
        each.scaled(float(unit)) for each, unit in zip(pairs(study, "rounded"), share, strict=True)
    ]
    series = [Estimate(abs(each.value), each.error) for each in series]
    return Measured(labelled(data.ratios, series, "%"), comment="mean difference of tau_cr")


@claim(
    where="Sec. 2.3, Eq. 7",
    says="Truncating the spectrum at 2.5 times the cutoff keeps 0.9997 of the power.",
    printed="0.9997",
    rule=Printed("0.9997"),
)
def power_kept(data: Data) -> Measured:
    """Exact, by the incomplete beta function."""
    return Measured(one("", data.setting.field(data.ratios[0]).spectrum.power_kept_by_truncation))


@claim(
    where="Sec. 2.3",
    says="Modes beyond the truncation would have negligible amplitudes.",
    needs=("modes",),
    rule=Below(limits.AS_ONE),
)
def higher_modes(data: Data) -> Measured:
    """What they change in tau_cr of the same draws, root mean square, per cent."""
    series = pairs(data["modes"], "untruncated_change", 100.0)
    return Measured(labelled(data.ratios, series, "%"), comment="with 1 - 1e-7 of the power kept")


@claim(
    where="Sec. 4.1, Eqs. 11 to 13",
    says="Pre-computed modal terms save considerable time.",
    needs=("modes",),
    rule=Above(limits.CONSIDERABLE),
)
def precomputed_terms(data: Data) -> Measured:
    """Time of the integral by quadrature at every node over that of the dot product with modes."""
    study = data["modes"]
    return Measured(
        (Quantity("quadrature over modes, in time", Estimate(float(study["saving"]))),),
        one("largest difference of tau_n", 1e6 * float(study["difference"]), "ppm"),
        comment="the same nucleation stress both ways, one row after the other on one core",
    )


@claim(
    where="Sec. 4.1, Eq. 11",
    says="A number of modes can be chosen whose error is negligible.",
    needs=("modes",),
    rule=Below(limits.AS_ONE),
)
def enough_modes(data: Data) -> Measured:
    """Change of tau_cr with the modes of the strength up to twice the truncation of z."""
    series = pairs(data["modes"], "cut_change", 100.0)
    return Measured(
        labelled(data.ratios, series, "%"),
        comment="root mean square change of tau_cr where the strength keeps twice the modes of z",
    )


@claim(
    where="Sec. 2.2",
    says="The mapping hardly changes the correlation: C of z and of tau_p are about equal.",
    needs=("theory",),
    rule=Below(limits.ALIKE),
)
def correlation_kept(data: Data) -> Measured:
    """Largest difference of the two over all lags."""
    theory = data["theory"]
    gap = np.abs(theory["correlation"].values - theory["gaussian_correlation"].values).max(axis=1)
    series = [Estimate(float(each)) for each in gap]
    return Measured(labelled(data.ratios, series), comment="largest difference over all lags")


@claim(
    where="Sec. 2.2",
    says="The correlation of z is positive.",
    needs=("theory",),
    rule=Graded(limits.Limit("positive", 0.0, "", "as written"),
                limits.Limit("nearly", -0.1, "", "within what an interface of this length shows")),
)  # fmt: skip
def positive_correlation(data: Data) -> Measured:
    """Smallest value on the periodic interface; on an infinite one it is positive."""
    smallest = data["theory"]["gaussian_correlation"].min("lag").values
    return Measured(
        labelled(data.ratios, [Estimate(float(each)) for each in smallest]),
        comment="true on an infinite line; without the mean mode C averages to zero over the"
        " period",
    )


@claim(
    where="Sec. 2.2",
    says="xi_0 = 2 pi/lambda measures the memory of the field like the length where C = 1/e.",
    rule=Within(0.5, 2.0, limits.SAME_MEMORY.word),
)
def correlation_length(data: Data) -> Measured:
    """Ratio of the two lengths, for z and for the strength."""
    field = data.setting.field(data.ratios[-1])
    xi = data.setting.spectrum(data.ratios[-1]).correlation_length
    found = {of: field.efolding_length(of=of) / xi for of in ("z", "strength")}
    return Measured(
        (*one("length where C of z is 1/e, over xi_0", found["z"]),
         *one("the same of tau_p", found["strength"])),
        comment=f"the decay length is {found['z']:.2f} of xi_0",
    )  # fmt: skip


@claim(
    where="Sec. 5.1, Eq. 14",
    says="The fracture energy varies with (tau_p - tau_r)^2: stronger places dissipate more.",
    needs=("griffith",),
    rule=Construction(
        "weakening rate and residual strength are uniform, so that a stronger place dissipates more"
    ),
)
def fracture_energy_varies(data: Data) -> Measured:
    """Mean and spread of Gamma(x)."""
    study = data["griffith"]
    return Measured(
        one("<Gamma>", float(study["energy_mean"]), "J/m^2"),
        one("standard deviation of Gamma over its mean", float(study["energy_variation"])),
    )


@claim(
    where="Sec. 3.2 and 5.1",
    says="The Griffith length is another one than h_n: the criterion for small-scale yielding does"
    " not apply at nucleation.",
    needs=("griffith",),
    rule=Above(
        limits.Limit("does not apply", 0.1, "", "the estimate would be off by a tenth"),
        partly=True,
    ),
)
def griffith_length(data: Data) -> Measured:
    """Griffith's length at the onset stress of each sample over h_n, less one (absolute)."""
    series = pairs(data["griffith"], "length_ratio")
    return Measured(
        labelled(data.ratios, [Estimate(abs(1.0 - e.value), e.error) for e in series]),
        labelled(data.ratios, series, label="Griffith length over h_n"),
        comment="2 G* <Gamma>/(pi drop^2) twice over h_n; at nucleation no node is at its residual",
    )


@claim(
    where="Sec. 4.1",
    says="10,000 samples describe the distribution of the critical stress accurately.",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=All(Below(limits.AS_ONE), Below(limits.RESOLVED)),
)
def enough_samples(data: Data) -> Measured:
    """Relative standard errors of mean and standard deviation of 10,000 samples."""
    count = data.samples
    fewer = math.sqrt(count / 10_000.0)

    def relative(each: Estimate, factor: float) -> Estimate:
        found = factor * fewer * each.error / each.value
        return Estimate(found, found / math.sqrt(2.0 * count))  # as a deviation is known

    return Measured(
        (
            at_each(data, lambda r: relative(mean(data.at(r)["critical_stress"].values), 100.0),
                    "%", "error of the mean"),
            at_each(data, lambda r: relative(
                standard_deviation(data.at(r)["critical_stress"].values), 1.0),
                label="error of the spread"),
        ),
        one("samples", float(count)),
        comment="standard errors, told from the samples taken",
    )  # fmt: skip
