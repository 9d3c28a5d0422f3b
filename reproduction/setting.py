"""The paper's problem and random strength, or those of a parameter file, for all other files.

A parameter file has the tables `[problem...]` and `[random.strength...]` of a study file, and two
keys of its own: `correlation_ratios` (the list of xi_0/h_n) and `loading_rate` (Pa/s). A table
replaces the paper's table of the same name as a whole.
"""

import dataclasses
import math
import warnings
from pathlib import Path

import numpy as np
import scipy.fft

import stiction as st
from reproduction import PARAMETERS

PRINTED_RATIOS = (0.25, 0.5, 1.0, 2.0)  # xi_0/h_n of the paper's Monte Carlo study
PRINTED_RATE = 2e7  # loading rate of the ruptures, Pa/s. The paper does not give its own
OWN_KEYS = ("correlation_ratios", "loading_rate")
MAX_RATIOS = 6  # as many correlation lengths can be told apart in a figure
MIN_NODES_SPANNED = 16  # fewest nodes in the nucleation length
TAIL = 1e-4  # probability beyond each end of the range shown of an unbounded strength


def _study(plane: str | None = None) -> st.Study:
    """Return the paper's study with the tables that replace its own."""
    problem = st.paper.problem()
    random = st.paper.strength(problem)
    unscaled = random.spectrum.correlation_length
    study = st.Study(problem=problem, random=random, method=st.LocalCriterion(),
                     samples=1)  # fmt: skip
    plain = study.to_dict()
    valid = ("problem", "random", *OWN_KEYS)
    if unknown := [key for key in PARAMETERS if key not in valid]:
        raise st.InputError(f"{unknown[0]}: unknown key (valid: {', '.join(valid)})")
    given = {key: value for key, value in PARAMETERS.items() if key not in OWN_KEYS}
    _replace(plain, given)
    if plane:
        plain["problem"]["solid"]["plane"] = plane
    field = plain["random"]["strength"]
    if given and field["spectrum"].setdefault("correlation_length", unscaled) != unscaled:
        raise st.InputError("random.strength.spectrum.correlation_length: give correlation_ratios"
                            " instead, in multiples of the nucleation length")  # fmt: skip
    # The number of modes is checked, so the correlation length must be in proportion to h_n.
    field["spectrum"]["correlation_length"] = 1e12
    endless = plain | {"random": {"strength": field | {"mean_mode": True}}}
    length = st.Study.from_dict(endless, folder=Path.cwd()).problem.nucleation_length
    field["spectrum"]["correlation_length"] = RATIOS[0] * length
    return st.Study.from_dict(plain, folder=Path.cwd())


def _replace(plain: dict, given: dict) -> None:
    for key, value in given.items():
        if key in ("problem", "random", "strength") and isinstance(value, dict):
            _replace(plain.setdefault(key, {}), value)
        else:
            plain[key] = value


def _check(study: st.Study) -> None:
    """Refuse what the figures cannot show, before anything is computed."""
    problem, mistakes = study.problem, []
    if problem.interface.is_plane or problem.specimen is not None:
        mistakes.append("problem: the report is about a line between half-spaces")
    elif set(study.random.names) != {"strength"}:
        mistakes.append("random: the report varies the strength alone")
    elif not hasattr(study.random.properties["strength"].spectrum, "correlation_length"):
        mistakes.append("random.strength.spectrum: needs a correlation length")
    for method in (st.LocalCriterion(), st.Equilibrium()):
        mistakes += [] if mistakes else method.supports(problem)
    if not mistakes:
        span = problem.nucleation_length / problem.interface.spacing
        if span < MIN_NODES_SPANNED:
            nodes = 2 * int(np.ceil(0.5 * problem.interface.size * MIN_NODES_SPANNED / span))
            mistakes.append(f"problem.interface.nodes: the nucleation length spans {span:.1f} nodes"
                            f" of at least {MIN_NODES_SPANNED}; give {nodes} or more")  # fmt: skip
        mean = study.random.properties["strength"].marginal.distribution.mean()
        if not 1e-7 < mean / problem.effective_modulus < 0.1:
            mistakes.append(f"random.strength.marginal: a mean of {mean:g} Pa beside a modulus of"
                            f" {problem.effective_modulus:g} Pa; check the units")  # fmt: skip
        if np.size(problem.friction.residual_strength or 0.0) > 1:
            mistakes.append("problem.friction.residual_strength: give one number, no profile")
    if mistakes:
        raise st.InputError(mistakes)


def _ratios() -> tuple[float, ...]:
    values = PARAMETERS.get("correlation_ratios", PRINTED_RATIOS)
    known = isinstance(values, list | tuple) and all(isinstance(x, int | float) for x in values)
    rising = known and all(np.diff([0.0, *values]) > 0.0)
    if not (rising and 2 <= len(values) <= MAX_RATIOS):
        raise st.InputError(f"correlation_ratios: give 2 to {MAX_RATIOS} rising positive numbers,"
                            f" got {values!r}")  # fmt: skip
    return tuple(map(float, values))


RATIOS = _ratios()  # all xi_0/h_n
SIMULATED = tuple(dict.fromkeys((RATIOS[0], RATIOS[1], RATIOS[-1])))
"""xi_0/h_n at which ruptures are run. The paper ran 20 at each of 0.25, 0.5 and 2."""
FIRST, SECOND, LAST = RATIOS[0], RATIOS[1], RATIOS[-1]
with warnings.catch_warnings():
    if PARAMETERS:  # a number of a wrong unit is a mistake in a parameter file
        warnings.simplefilter("error", st.UnitWarning)
    _own = _study()
    _check(_own)
PROBLEM = _own.problem
FIELD = _own.random.properties["strength"]
H = PROBLEM.nucleation_length  # nucleation length h_n, m
L = PROBLEM.interface.measure
G_STAR = PROBLEM.effective_modulus
W = PROBLEM.friction.uniform_weakening_rate  # weakening rate, Pa/m
STRAIN = PROBLEM if PARAMETERS else _study("strain").problem
"""The same with the printed modulus, G/(1 - nu), which belongs to plane strain."""
PRINTED_H = STRAIN.nucleation_length

MARGINAL = FIELD.marginal
_LAW = MARGINAL.distribution
MEAN, DEVIATION = _LAW.mean(), _LAW.std()
SUPPORT = _LAW.support()  # bounds of the strength, Pa; the upper one may be infinite
DENSITY_BOUNDS = [bound if np.isfinite(bound) else None for bound in SUPPORT]
"""The same for densities of stresses, Pa; None where there is no bound."""
LOW = SUPPORT[0] if SUPPORT[0] > 0.0 else float(_LAW.ppf(TAIL))
HIGH = SUPPORT[1] if np.isfinite(SUPPORT[1]) else float(_LAW.ppf(1.0 - TAIL))
"""The range of the strength in figures, and the largest strength of the energy balance, Pa."""


def residual(strength):
    """Return the residual strength that belongs to a peak strength, Pa."""
    law = PROBLEM.friction
    if getattr(law, "residual_ratio", None) is not None:
        return law.residual_ratio * strength
    return float(law.residual_strength or 0.0)


RESIDUAL = residual(MEAN)
DROP = MEAN - RESIDUAL
"""The mean strength above the residual strength, Pa. Only differences to tau_r matter before the
onset, so that relative differences of stresses refer to it, or to tau_cr - tau_r."""


def _loading_rate() -> float:
    scaled = float(f"{PRINTED_RATE * (DROP / 1e6) / (CROSSING / 1.08e-4):.2g}")
    given = PARAMETERS.get("loading_rate", scaled)
    if not (isinstance(given, int | float) and 0.0 < given < np.inf):
        raise st.InputError(f"loading_rate: give a positive number, Pa/s, got {given!r}")
    return float(given)


CROSSING = L / PROBLEM.solid.shear_wave_speed  # time of a shear wave along the interface, s
LOADING_RATE = _loading_rate()
"""Of the ruptures, Pa/s; by default the load rises by the same part of `DROP` while a shear wave
runs along the interface as it does with the paper's parameters."""
WHAT_IF = Path(__file__).parent / "what_if"


def strength(ratio: float, **changes):
    """Return the random strength at xi_0/h_n; `changes` replace parts of the field."""
    length = changes.pop("nucleation_length", H)
    spectrum = dataclasses.replace(FIELD.spectrum, correlation_length=ratio * length)
    return dataclasses.replace(FIELD, spectrum=spectrum, **changes)


def grid(problem, *, span: float):
    """Return the problem with so many nodes in the nucleation length, or a few more."""
    count = scipy.fft.next_fast_len(math.ceil(problem.interface.measure / H * span / 2.0)) * 2
    interface = st.Interface(length=problem.interface.measure, nodes=count)
    return dataclasses.replace(problem, interface=interface)


def distance(place, reference, period: float = L):
    """Return the distance of positions on the periodic interface, m."""
    gap = np.abs(np.asarray(place) - np.asarray(reference)) % period
    return np.minimum(gap, period - gap)
