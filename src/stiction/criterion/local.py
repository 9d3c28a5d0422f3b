"""The local criterion: the weakest patch, each patch by itself."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.criterion.average import averages, least_average
from stiction.criterion.windows import Window, windows_of
from stiction.elasticity.places import places_of
from stiction.elasticity.weakest import Places, weakest_place
from stiction.errors import InputError, warn_accuracy
from stiction.friction import ExponentialWeakening
from stiction.model import checked, model
from stiction.problem import Problem, Sample, refusals
from stiction.results import onset_variables, position
from stiction.variables import Variable

# W times the slip at the centre of a critical patch over the curvature of its strength, on lines
# and planes: the slip of (K - W) slip = tau_0 - curvature r^2 on the unit ball, K scalar, without
# a singularity at the rim.
SLIP = {1: 0.6614, 2: 1.3788}
ENOUGH = 1000  # samples that tell how many reach their residual strength
INSTEAD = "; use st.Equilibrium() or st.Rupture()"

OWN_VARIABLES = {
    "critical_aspect": Variable(
        "1", "extent of the critical ellipse along x over that along y"
    ),
    "critical_patch_extent": Variable("m", "extents of the critical ellipse"),
    "critical_patch_area": Variable("m2", "area of the critical ellipse"),
}
LENGTH = {"critical_patch_length": Variable("m", "nucleation length at the critical place")}


@model(kw_only=True)
class LocalCriterion:
    """Onset at the minimum of the nucleation stress, each patch taken in isolation.

    If no node reaches its residual strength (zero included) before the onset, this is an
    upper bound of the exact equilibrium onset, up to discretisation: interaction only makes
    patches unstable earlier. Where nodes do, the onset comes later than predicted, and an
    `AccuracyWarning` estimates in how many samples, and by how much. Events are assumed not
    to be arrested, so `first_instability` and `critical_stress` are equal.

    Notes
    -----
    The weights of the average are never negative, so the result lies between the least and
    the greatest strength also where the strength jumps. On a line the minimum is taken
    between the nodes. For a nonlinear friction law, the weakening rate at zero slip counts,
    with an `AccuracyWarning`: if strength falls ever less steeply, the onset comes later. A
    law that steepens raises an error.

    On a plane the average is over critical ellipses of five shapes, each the smallest on which the
    stiffness K - W of the discrete problem is unstable, with its eigenvector as the weight; the
    minimum is taken over nodes and shapes. `critical_aspect`, `critical_patch_extent` (m, along x
    and y) and `critical_patch_area` (m²) are those of the critical ellipse.

    On a specimen each place has a nucleation length of its own, the shortest run of nodes on which
    the stiffness of the blocks is unstable, with the eigenvector as the weight; that at the
    critical place is `critical_patch_length` (m). A pusher near the interface causes events long
    before it slides: `critical_stress` is then far too low, as the pilot of `monte_carlo` tells.

    Examples
    --------
    >>> import stiction as st
    >>> st.LocalCriterion().supports(st.paper.problem(nodes=512))  # no reason against it
    []
    """

    type: Literal["local_criterion"] = "local_criterion"
    label: ClassVar[str] = "local criterion"

    def seconds_per_sample(self, problem: Problem) -> float:
        """Return the approximate time of a sample on one core, s."""
        return (3e-8 if not problem.interface.is_plane else 6e-8) * problem.interface.size

    def supports(self, problem: Problem) -> list[str]:
        """Return the reasons why it cannot solve a problem; none if it can."""
        friction, reasons = problem.friction, []
        if friction.steepening > 1.0:
            reasons.append(
                f"friction: this law falls up to {friction.steepening:.3g} times as steeply later"
                f" as at zero slip, whose weakening rate the local criterion takes{INSTEAD}"
            )
        if friction.weakening_rate is not None and problem.uniform_rate is None:
            reasons.append(
                "friction.weakening_rate varies along the interface, so there is no one"
                f" nucleation length{INSTEAD}"
            )
        return reasons

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """Return the variables that the solver computes for each sample."""
        found = onset_variables(problem.interface)
        if problem.interface.is_plane:
            extent = position(problem.interface, OWN_VARIABLES["critical_patch_extent"])
            found = found | OWN_VARIABLES | {"critical_patch_extent": extent}
        return found if problem.specimen is None else found | LENGTH

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, Array]]:
        """Return a solver for samples of this problem.

        It raises an `InputError` if the weakening rate varies along the interface, or a critical
        patch does not fit on it.
        """
        check_law(problem)
        interface = problem.interface
        if problem.specimen is not None:
            return lambda sample: _onset_of_specimen(problem, sample)

        def solve(sample: Sample) -> dict[str, Array]:
            _warn_if_coarse(problem, sample)
            excess, profile = excess_of(sample), sample.load_profile
            load, patch = np.empty(len(excess)), np.empty((len(excess), 4))
            place = np.empty((len(excess), 2) if interface.is_plane else len(excess))
            for windows, same in _by_rate(problem, sample):
                some = excess if same.size == len(excess) else excess[same]
                load[same], place[same], chosen = least_average(
                    interface, windows, some, profile
                )
                if interface.is_plane:
                    patches = [(one.aspect, *one.extents, one.area) for one in windows]
                    patch[same] = np.array(patches)[chosen]
            stress = sample.mean_stress(load)
            found = {
                "critical_load": load,
                "critical_stress": stress,
                "first_instability": stress.copy(),
                "critical_position": place * interface.spacings,
            }
            if interface.is_plane:
                own = patch[:, 0], patch[:, 1:3], patch[:, 3]
                found |= zip(OWN_VARIABLES, own, strict=True)
            return found

        return solve

    def warn_of(self, problem: Problem, sample: Sample, values: dict[str, Array]) -> None:
        """Warn if samples reach their residual strength before the onset."""
        if not problem.friction.linear:  # `check_law` has warned of it
            return
        reached, missing = beyond_residual(problem, sample, values)
        if reached.any():
            middle, most = 100.0 * np.quantile(missing[reached], (0.5, 1.0))
            warn_accuracy(
                f"in about {100.0 * reached.mean():.2g} % of {reached.size} samples nodes of the"
                " critical patch reach their residual strength before the onset: there the local"
                " criterion is no upper bound but too low by an estimated"
                f" {middle:.2g} % (median; at most {most:.2g} %); use st.Equilibrium()"
            )


def beyond_residual(
    problem: Problem, sample: Sample, values: Mapping[str, Any]
) -> tuple[NDArray[np.bool_], Array]:
    """Estimate which samples reach their residual strength before the onset, and the error then.

    Of the first thousand samples: whether a node of the critical patch has slipped as far as it
    weakens, (tau_p - tau_r)/W, at the critical load; and by what share that load is too low, to
    first order: the mean strength that slip would have taken below the residual one.

    At the critical load tau_0 the slip of the patch follows from (K - W) slip = tau_0 p - (tau_p -
    tau_i) with no singularity at its rim. For a parabola of strength, tau_0 + c s^2 with s the
    distance in units of the semi-axes, it is nearly `SLIP` c/W (1 - s^2)^1.6; c is taken from the
    strength by regression with the weights of the patch.
    """
    sample, shape = sample.part(slice(0, ENOUGH)), problem.interface.shape
    if problem.specimen is not None:
        return _beyond_residual_of_specimen(problem, sample, values)
    reached, missing = np.zeros(sample.samples, dtype=np.bool_), np.zeros(sample.samples)
    spacings = np.array(problem.interface.spacings)
    loads, places = (np.asarray(values[f"critical_{name}"]) for name in ("load", "position"))
    aspects = np.asarray(values.get("critical_aspect", np.ones(len(loads))))
    excess = sample.strength - sample.initial_stress
    drop = sample.strength - sample.residual_strength
    for windows, same in _by_rate(problem, sample):
        for window in windows:
            some = same[aspects[same] == window.aspect]
            offsets = np.argwhere(window.weight > 0.0)
            middle = np.array(shape) // 2
            distance = (offsets + middle) % shape - middle
            square = np.sum((2.0 * distance * spacings / window.extents) ** 2, axis=1)
            offsets, square = offsets[square < 1.0], square[square < 1.0]
            weight = window.weight[tuple(offsets.T)]
            weight = weight / weight.sum()
            node = np.rint(places[some].reshape(some.size, 1, len(shape)) / spacings)
            at = tuple(np.moveaxis((node.astype(np.int64) + offsets) % shape, -1, 0))
            patch, profile = (some[:, None], *at), sample.load_profile[at]
            reached[some], missing[some] = _lost(
                excess[patch], profile, drop[patch], loads[some], weight, square, len(shape)
            )
    return reached, missing


def _lost(
    excess: Array,
    profile: Array,
    drop: Array,
    load: Array,
    weight: Array,
    square: Array,
    d: int,
) -> tuple[Any, Any]:
    """Return whether patches (samples, nodes) pass their residual strength, and the error then."""
    slope = weight * (square - (weight * square).sum(axis=-1, keepdims=True))
    bend = ((excess - load[:, None] * profile) * slope).sum(axis=1) / (slope @ square)
    slip = SLIP[d] * np.maximum(bend, 0.0)[:, None] * (1.0 - square) ** 1.6
    lost = np.maximum(slip - drop, 0.0)
    missing = (lost * weight).sum(axis=1) / (profile * weight).sum(axis=1)
    return lost.any(axis=1), missing / load


def _onset_of_specimen(problem: Problem, sample: Sample) -> dict[str, Array]:
    """Return the onset at the weakest place of each specimen."""
    _warn_if_coarse(problem, sample)
    excess, spacing = excess_of(sample), problem.interface.spacing
    load, start, width = np.empty((3, sample.samples))
    allowed = np.empty(problem.interface.size)
    for places, same in _places_by_rate(problem, sample):
        for i in same:
            load[i], c = weakest_place(
                excess[i], sample.load_profile, sample.weakening_rate[i], places, allowed
            )
            start[i], width[i] = places.starts[c], places.widths[c]
    stress = sample.mean_stress(load)
    return {
        "critical_load": load,
        "critical_stress": stress,
        "first_instability": stress.copy(),
        "critical_position": (start + 0.5 * width) * spacing,
        "critical_patch_length": width * spacing,
    }


def _places_by_rate(
    problem: Problem, sample: Sample
) -> Iterator[tuple[Places, NDArray[np.int64]]]:
    """Yield the critical windows of a specimen at each rate, and the samples of this rate."""
    for rate, same in _rates(sample):
        places = places_of(problem.blocks, rate)
        if not places.starts.size:
            raise InputError(
                "interface.length: no part of the specimen becomes unstable by itself, so the local"
                " criterion does not hold; use st.Equilibrium()"
            )
        yield places, same


def _beyond_residual_of_specimen(
    problem: Problem, sample: Sample, values: Mapping[str, Any]
) -> tuple[NDArray[np.bool_], Array]:
    """Estimate the same for specimens; a patch at a free end is taken as one in the middle."""
    reached, missing = np.zeros(sample.samples, dtype=np.bool_), np.zeros(sample.samples)
    excess = sample.strength - sample.initial_stress
    drop = sample.strength - sample.residual_strength
    loads, lengths = (
        np.asarray(values[name]) for name in ("critical_load", "critical_patch_length")
    )
    spacing = problem.interface.spacing
    widths = np.rint(lengths / spacing).astype(np.int64)
    starts = np.rint(values["critical_position"] / spacing - 0.5 * widths).astype(np.int64)
    for places, same in _places_by_rate(problem, sample):
        for width in np.unique(widths[same]):
            some = same[widths[same] == width]
            chosen = np.searchsorted(places.starts, starts[some])
            patch = starts[some, None] + np.arange(width)
            square = ((2.0 * np.arange(width) - width + 1.0) / width) ** 2
            reached[some], missing[some] = _lost(
                excess[some[:, None], patch], sample.load_profile[patch],
                drop[some[:, None], patch], loads[some], places.modes[chosen, :width], square, 1,
            )  # fmt: skip
    return reached, missing


@checked
def nucleation_stress(problem: Problem, tau_p: Any) -> Array:
    """Return the nucleation stress tau_n(x) of strength profiles.

    This is the load tau_0 at which a patch of length h_n centred at x, if isolated, becomes
    unstable: the average of tau_p - tau_i over h_n with the weight of the critical
    slip-rate profile, over the same average of the load profile (Uenishi and Rice, 2003,
    Eq. 14; Albertini et al., 2020, Eq. 9). On a plane it is the least over five ellipses.

    Parameters
    ----------
    problem : Problem
        With a weakening rate uniform along the interface.
    tau_p : (samples, *shape) or (*shape) array
        Peak strength, Pa.

    Returns
    -------
    (samples, *shape) or (*shape) array, Pa
        Between the smallest and the largest (tau_p - tau_i)/p of the profile.

    Raises
    ------
    InputError
        If the weakening rate varies along the interface, or a critical patch is larger than it.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> tau_n = st.theory.nucleation_stress(problem, tau_p)
    >>> bool(tau_p.min() < tau_n.min() < tau_n.max() < tau_p.max())
    True
    """
    check_law(problem)
    problem.refuse_specimen("nucleation_stress", "st.LocalCriterion() gives its minimum")
    sample, interface = problem.sample(tau_p), problem.interface
    _warn_if_coarse(problem, sample)
    ((windows, _), *others) = _by_rate(problem, sample)
    if others:
        raise InputError("weakening_rate: differs between samples; pass them one by one")
    excess, profile = excess_of(sample), sample.load_profile
    several = averages(interface, windows, excess, profile)
    result = np.array([np.minimum.reduce(list(each)) for each in several])
    # The weights keep to these bounds, the rounding of the transforms does not.
    ratio = windows[0].total * (excess / profile)
    low, high = (end(axis=sample.axes, keepdims=True) for end in (ratio.min, ratio.max))
    result = np.clip(result, low, high)
    return result[0] if np.ndim(tau_p) == len(interface.shape) else result


def check_law(problem: Problem) -> None:
    """Refuse what the method does not support; warn of a law that is not linear."""
    if refused := refusals(problem, LocalCriterion()):
        raise InputError(refused)
    if not problem.friction.linear:
        measured = ""
        if isinstance(problem.friction, ExponentialWeakening):
            measured = (
                ", by 0.6 % (at most 3 %) at a correlation length of h_n, by 2 % (at most 7 %) at"
                " one of h_n/4"
            )
        warn_accuracy(
            "friction: the local criterion takes the weakening rate at zero slip as constant, so"
            f" the onset is later than it predicts{measured}; st.Equilibrium() is exact for"
            " piecewise linear laws"
        )


def _warn_if_coarse(problem: Problem, sample: Sample) -> None:
    """Warn where the moving average is a coarse sum."""
    if problem.interface.is_plane:
        cost = "the local criterion is about 0.15 % too high at 8 nodes, 0.4 % at 5, 0.7 % at 4"
        problem.warn_if_coarse(sample, 8.0, cost)
    else:
        cost = (
            "where the strength varies within a quarter of it, the local criterion is off by about"
            " 0.8 % (rms) at 8 nodes and 3 % at 4; for smoother strength by far less"
        )
        problem.warn_if_coarse(sample, 12.0, cost)


def excess_of(sample: Sample) -> Array:
    """Return tau_p - tau_i, Pa; `InputError` where the strength is not finite."""
    if not np.isfinite(sample.strength).all():
        raise InputError(
            "strength: must be finite everywhere for the local criterion, which averages it; where"
            " some of it cannot break, give a large finite strength, or use st.Rupture()"
        )
    return np.ascontiguousarray(sample.strength - sample.initial_stress)


def _by_rate(
    problem: Problem, sample: Sample
) -> Iterator[tuple[list[Window], NDArray[np.int64]]]:
    """Yield the windows of each weakening rate, and the samples of this rate."""
    for rate, same in _rates(sample):
        yield windows_of(problem, rate), same


def _rates(sample: Sample) -> Iterator[tuple[float, NDArray[np.int64]]]:
    """Yield each weakening rate, and the samples of this rate."""
    if not sample.uniform_weakening:
        raise InputError(
            "weakening_rate: varies along the interface, so there is no single nucleation length"
            f" for the local criterion{INSTEAD}"
        )
    rates = sample.weakening_rate.reshape(sample.samples, -1)[:, 0]
    for rate in np.unique(rates):
        yield float(rate), np.flatnonzero(rates == rate)
