"""Claims about run-away propagation, arrest, and what drives or stops a rupture."""

from __future__ import annotations

import math

import numpy as np

from stiction.papers.albertini2020.claims import limits
from stiction.papers.albertini2020.claims.claim import Measured, Quantity, claim
from stiction.papers.albertini2020.claims.combined_rules import All
from stiction.papers.albertini2020.claims.measures import at_each, at_simulated, one, values
from stiction.papers.albertini2020.claims.rules import (
    Above,
    Below,
    Falling,
    Never,
    Verdict,
    Within,
    near,
)
from stiction.papers.albertini2020.data import Data
from stiction.papers.albertini2020.derived import toughest
from stiction.statistics.estimates import Estimate, mean, share

_ABOUT_THREE = Within(2.5, 3.5, "about 3: to the printed digit")


@claim(
    where="Sec. 5.2",
    says="A crack longer than about 3 h_n cannot be arrested: its static energy release rate"
    " exceeds the largest fracture energy.",
    printed="3",
    needs=("monte_carlo",),
    onsets_of="monte_carlo",
    rule=_ABOUT_THREE,
)
def runaway_length(data: Data) -> Measured:
    """Length of a shear crack under the stress drop tau_cr - tau_r whose G equals Gamma_max.

    For half-length a, G = pi a drop^2/(2 G*) (mode II, identical half-spaces), and
    Gamma_max = (tau_p,max - tau_r)^2/(2 W) (Albertini et al., 2020, Eq. 14).
    """
    problem = data.setting.problem
    if not np.isfinite(data.setting.bounds[1]):
        return Measured((), comment="this strength has no upper bound, nor has Gamma")
    residual = float(np.mean(problem.friction.residual_strength))
    energy = toughest(data)

    def length(ratio: float) -> Estimate:
        drop = data.at(ratio)["critical_stress"].values - residual
        whole = 4.0 * problem.effective_modulus * energy / (math.pi * drop**2)
        return mean(whole / problem.nucleation_length)

    return Measured(at_each(data, length, "h_n"))


@claim(
    where="Sec. 5.2",
    says="The static energy release rate grows in proportion to the length of the crack.",
    rule=near(1.0, limits.SLOPE),
)
def release_rate_grows(data: Data) -> Measured:
    """Logarithmic slope between h_n and 3 h_n on the periodic interface.

    A periodic row of collinear cracks of length 2a and period L under uniform drop has
    G = L drop^2 tan(pi a/L)/(2 G*) (Koiter, 1959), which is linear while a << L.
    """
    problem = data.setting.problem
    length, period = problem.nucleation_length, problem.interface.extent

    def rate(crack: float) -> float:
        return math.tan(math.pi * crack / (2.0 * period))

    slope = math.log(rate(3.0 * length) / rate(length)) / math.log(3.0)
    return Measured(
        one("logarithmic slope from h_n to 3 h_n", slope),
        comment="faster than in proportion by what neighbouring periods add",
    )


@claim(
    where="Sec. 5.2",
    says="Shorter than about 3 h_n a rupture may be arrested, longer it cannot be.",
    printed="3",
    needs=("arrest",),
    rule=Within(0.0, 3.5, "about 3: to the printed digit"),
)
def longest_arrest(data: Data) -> Measured:
    """Longest patch that came to rest by equilibrium, in units of h_n."""
    length = data["arrest"]["length"].values / data.setting.problem.nucleation_length
    found = one("longest arrested patch", float(length.max()), "h_n") if length.size else ()
    return Measured(found, one("samples", float(length.size)), comment="by equilibrium")


@claim(
    where="Sec. 5.2",
    says="In every simulation the rupture, once unstable, runs along the whole interface.",
    needs=("ruptures",),
    onsets_of="ruptures",
    rule=Never(limits.UNCOMMON),
)
def simulations_run_away(data: Data) -> Measured:
    """Share of runs with an event that came to rest before, with inertia."""
    return Measured(
        at_simulated(data, lambda r: share(values(data, "ruptures", "arrested_events", r) > 0)),
        comment="share of simulations, with inertia",
    )


def _arrested(data: Data) -> tuple[Quantity, ...]:
    return at_each(data, lambda r: share(values(data, "interaction", "arrested_events", r) > 0))


@claim(
    where="Abstract, Sec. 5.2, Conclusion",
    says="Random strength alone makes precursory events extremely unlikely.",
    needs=("arrest", "interaction"),
    rule=All(Below(limits.RARE), Below(limits.RARE)),
)
def precursors_unlikely(data: Data) -> Measured:
    """Share of samples with an arrested event by equilibrium, and what inertia leaves of it."""
    events = data["arrest"]
    shares = _arrested(data)
    largest = max((each.estimate for each in shares), key=lambda each: each.value)
    stay = (
        share(events["dynamic_arrests"].values > 0) if events.sizes["event"] else Estimate(0.0, 0.0)
    )
    held: tuple[Quantity, ...] = (
        Quantity(
            "with inertia, at most",
            Estimate(
                stay.value * largest.value,
                math.hypot(stay.error * largest.value, stay.value * largest.error),
            ),
        ),
    )
    if "dynamic" in data.studies:  # no need to conclude from a few
        held = at_each(
            data,
            lambda r: share(values(data, "dynamic", "arrested_events", r) > 0),
            label="with inertia",
        )
    return Measured(
        (shares, held),
        (Quantity(f"of {events.sizes['event']} run again with inertia, arrested", stay),),
        comment="share of samples by equilibrium; inertia carries some of these through",
    )


@claim(
    where="Sec. 5.2",
    says="Arrest is very unlikely in particular for xi_0 > h_n: the longer the correlation, the"
    " rarer.",
    needs=("interaction",),
    onsets_of="interaction",
    rule=Falling(),
)
def arrest_against_length(data: Data) -> Measured:
    """Share of samples with an arrested event against the correlation length, by equilibrium."""
    return Measured(
        _arrested(data),
        comment="by equilibrium",
        comments={
            Verdict.CORRECTED: "by equilibrium: rarest beyond h_n as the paper says, but most"
            " frequent at half of h_n, not at the shortest length, where patches average over"
            " strong places"
        },
    )


@claim(
    where="Sec. 5.2",
    says="After some growth the slipping area is a shear crack: constant residual strength inside,"
    " a cohesive zone at its edge.",
    needs=("representative", "ruptures"),
    rule=Above(limits.MOST),
)
def shear_crack(data: Data) -> Measured:
    """Share of the slipping area at its residual strength once it is twice 3 h_n long."""
    solid, runs = data.setting.problem.solid, data["ruptures"]
    speed = runs["median_rupture_speed"].values.ravel() / solid.shear_wave_speed
    return Measured(
        one("share at the residual strength", float(data["representative"]["weakened_share"])),
        (Quantity("median speed of fronts over c_s", mean(speed)),),
        comment="in the representative rupture; fronts soon run faster than shear waves, where the"
        " static balance decides no more",
    )


@claim(
    where="Sec. 5.4",
    says="Nucleation is of the pre-slip type: slow slip and one acceleration, no foreshocks.",
    needs=("ruptures",),
    onsets_of="ruptures",
    rule=Below(limits.UNCOMMON),
)
def pre_slip(data: Data) -> Measured:
    """Share of simulations with a foreshock, an arrested event before the onset."""
    events = data["ruptures"]["arrested_events"].values.ravel()
    return Measured(
        (Quantity("share of simulations with a foreshock", share(events > 0)),),
        comment="with inertia",
    )


@claim(
    where="Abstract, Sec. 5.2",
    says="Systematic non-uniform driving, by the loading configuration, produces arrested fronts.",
    needs=("driving",),
    rule=All(Above(limits.OFTEN), Above(limits.OFTEN)),
)
def systematic_driving(data: Data) -> Measured:
    """Share of samples with an arrested precursor under an edge load, by equilibrium and with
    inertia."""
    study = data["driving"]

    def by(case: str) -> Estimate:
        return share(study["arrested_events"].sel(case=case).values > 0)

    length = data.setting.problem.interface.extent
    dynamic = study["dynamic_length"].sel(case="edge").values
    held = share(dynamic < 0.95 * length)
    return Measured(
        ((Quantity("edge, by equilibrium", by("edge")),), (Quantity("edge, with inertia", held),)),
        (Quantity("gradient, by equilibrium", by("gradient")),
         Quantity("uniform, by equilibrium", by("uniform"))),
        comment="share of samples, at a residual strength of 0.6 of the weakest, which alone makes"
        " small arrests common; under an edge load every sample has long ones",
    )  # fmt: skip


@claim(
    where="Sec. 5.2",
    says="Arrest follows from an energy balance, G = Gamma, as for the precursors of experiments.",
    needs=("driving",),
    rule=All(
        Within(0.75, 1.33, "an estimate of a length: to a third"),
        Within(0.75, 1.33, "an estimate of a length: to a third"),
    ),
)
def griffith_arrest(data: Data) -> Measured:
    """Length of arrested patches over that at which G falls to the mean fracture energy."""
    edge = data["driving"].sel(case="edge")
    griffith, static = edge["griffith_length"].values, edge["event_length"].values
    dynamic = edge["dynamic_length"].values

    def middle(quotient: np.ndarray) -> Estimate:
        # One number a sample: the events of a sample are not independent.
        found = [np.median(row[np.isfinite(row)]) for row in quotient if np.isfinite(row).any()]
        if len(found) < 3:
            return Estimate(1.0, 1.0)
        low, high = np.quantile(found, (0.25, 0.75))  # a normal one has 1.349 deviations between
        spread = 1.2533 * float(high - low) / 1.349 / len(found) ** 0.5
        return Estimate(float(np.median(found)), spread)

    return Measured(
        (
            (Quantity("by equilibrium", middle(static / griffith)),),
            (Quantity("with inertia", middle(dynamic[:, None] / griffith[:, :1])),),
        ),
        comment="median ratio of the two lengths under an edge load; Bueckner's weights, mean"
        " fracture energy",
    )


@claim(
    where="Sec. 5.4",
    says="Small events smoothen the stress profile.",
    needs=("sequence",),
    rule=Below(0.0, partly=True),
)
def events_smoothen(data: Data) -> Measured:
    """Relative change of the spread of the stress by the first arrested event, by equilibrium."""
    study = data["sequence"]["roughening"]

    def change(case: str) -> Estimate:
        found = study.sel(case=case).values
        found = found[np.isfinite(found)]
        return mean(found) if found.size > 2 else Estimate(0.0, 1.0)

    return Measured(
        tuple(Quantity(str(case), change(case)) for case in study["case"].values),
        comment="relative change of the standard deviation of the stress along the interface: an"
        " arrested event leaves a hole with high edges; what smoothens is what many of them do to"
        " a stress that was rough before, in other models",
    )
