"""Claims about run-away propagation that the energy balance decides."""

from __future__ import annotations

import math

import numpy as np

from stiction.paper.claims.claim import Finding, Quantity, Verdict, claim
from stiction.paper.claims.rules import at_each
from stiction.paper.data import Data
from stiction.statistics.estimates import Estimate, mean


@claim(
    where="Sec. 5.2",
    says="A crack longer than about 3 h_n cannot be arrested: its static energy release rate"
    " exceeds the largest fracture energy.",
    printed="3",
    needs=("monte_carlo",),
)
def runaway_length(data: Data) -> Finding:
    """Length of a shear crack under the stress drop tau_cr - tau_r whose G equals Gamma_max.

    For half-length a, G = pi a drop^2/(2 G*) (mode II, identical half-spaces), and
    Gamma_max = (tau_p,max - tau_r)^2/(2 W) (Albertini et al., 2020, Eq. 14).
    """
    problem = data.setting.problem
    high = data.setting.bounds[1]
    if not np.isfinite(high):
        return Finding((), Verdict.FAILS, "this strength has no upper bound, nor has Gamma")
    residual = float(np.mean(problem.friction.residual_strength))
    rate = float(np.max(problem.friction.weakening_rate))
    toughest = (high - residual) ** 2 / (2.0 * rate)
    series = []
    for ratio in data.ratios:
        drop = data.at(ratio)["critical_stress"].values - residual
        length = 4.0 * problem.effective_modulus * toughest / (math.pi * drop**2)
        series.append(mean(length / problem.nucleation_length))
    values = [each.value for each in series]
    # 'About 3': to within half a unit at every correlation length, or at least at one.
    near = [abs(value - 3.0) <= 0.5 for value in values]
    if all(near):
        verdict, comment = Verdict.HOLDS, ""
    else:
        partly = any(near) or min(values) < 3.0 < max(values)
        verdict = Verdict.CORRECTED if partly else Verdict.FAILS
        comment = f"{min(values):.2g} to {max(values):.2g} h_n"
    return Finding(at_each(data, series, "h_n"), verdict, comment)


@claim(
    where="Sec. 5.2",
    says="The static energy release rate grows in proportion to the length of the crack.",
)
def release_rate_grows(data: Data) -> Finding:
    """Logarithmic slope between h_n and 3 h_n on the periodic interface.

    A periodic row of collinear cracks of length 2a and period L under uniform drop has
    G = L drop^2 tan(pi a/L)/(2 G*) (Koiter, 1959), which is linear while a << L.
    """
    problem = data.setting.problem
    length, period = problem.nucleation_length, problem.interface.length

    def rate(crack: float) -> float:
        return math.tan(math.pi * crack / (2.0 * period))

    slope = Estimate(math.log(rate(3.0 * length) / rate(length)) / math.log(3.0))
    verdict = Verdict.HOLDS if abs(slope.value - 1.0) < 0.05 else Verdict.CORRECTED
    return Finding(
        (Quantity("logarithmic slope from h_n to 3 h_n", slope),),
        verdict,
        "" if verdict is Verdict.HOLDS else "faster: neighbouring periods help",
    )
