"""The local criterion: the weakest patch, each by itself."""

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stiction.arrays import Array
from stiction.criterion.average import local_onset, minimum_rows
from stiction.criterion.windows import Weights, Window, windows_of
from stiction.errors import InputError, warn_accuracy
from stiction.model import check, describe, is_finite, model
from stiction.problem import Problem, Sample
from stiction.results import Variable, onset_variables, position

SLIP = {1: 0.6614, 2: 1.3788}
"""W times the slip at the centre of a critical patch over the curvature of its strength, in one and
two dimensions: the slip of (K - W) slip = tau_0 - curvature r^2 on the unit ball, K scalar, without
a singularity at the rim."""
ENOUGH = 1000
"""Number of samples for the estimate of how many reach their residual strength."""

OWN_VARIABLES = {
    "critical_aspect": Variable(
        "1", "extent of the critical ellipse along x over that along y"
    ),
    "critical_patch_extent": Variable("m", "extents of the critical ellipse"),
    "critical_patch_area": Variable("m2", "area of the critical ellipse"),
}


@model(kw_only=True)
class LocalCriterion:
    """Onset at the minimum of the nucleation stress, each patch taken in isolation.

    If no node reaches its residual strength (zero included) before the onset, this is an
    upper bound of the exact equilibrium onset, up to discretisation: interaction only makes
    patches unstable earlier. A node at its residual strength weakens no more, so that the
    onset comes later than the criterion predicts. An `AccuracyWarning` estimates in how
    many samples, and by how much. Events are assumed not to be arrested, so
    `first_instability` and `critical_stress` are equal.

    Parameters
    ----------
    weights : {"exact", "rounded"}
        The exact eigenfunction, or the rounded one printed by Albertini et al. (2020, Eq. 9).

    Notes
    -----
    The weights of the average are never negative, so the result lies between the least and
    the greatest strength also where the strength jumps. On a line the minimum is taken
    between the nodes. For a nonlinear friction law, the weakening rate at zero slip counts,
    with an `AccuracyWarning`: if strength falls ever less steeply, the onset comes later. A
    law that steepens raises an error.

    On a plane the average is over critical ellipses of five shapes, each the smallest on which the
    stiffness K - W of the discrete problem is unstable, with its eigenvector as the weight; the
    minimum is taken over nodes and shapes. Beside the variables of every method there are then
    `critical_aspect`, `critical_patch_extent` (m, along x and y) and `critical_patch_area` (m²) of
    the critical ellipse.

    Examples
    --------
    >>> import stiction as st
    >>> st.LocalCriterion().supports(st.paper.problem(nodes=512))  # no reason against it
    []
    """

    weights: Weights = "exact"
    type: Literal["local_criterion"] = "local_criterion"

    @property
    def chunk_size(self) -> int:
        """Number of samples in a batch of an ensemble."""
        return 1024

    @property
    def label(self) -> str:
        """Name in figures and tables."""
        return "local criterion"

    def seconds_per_sample(self, problem: Problem) -> float:
        """Return the approximate time of a sample on one core, s."""
        return (3e-8 if not problem.interface.is_plane else 6e-8) * problem.interface.size

    def supports(self, problem: Problem) -> list[str]:
        """Return the reasons why it cannot solve a problem; none if it can."""
        reasons = _refused_laws(problem)
        if problem.interface.is_plane and self.weights != "exact":
            reasons.append(
                f"weights = {self.weights!r} apply to lines only; on a plane leave them 'exact'"
            )
        rate = problem.friction.weakening_rate
        if rate is not None and problem.uniform_rate is None:
            reasons.append(
                "friction.weakening_rate varies along the interface, so there is no one"
                " nucleation length; use st.Equilibrium() or st.Rupture()"
            )
        return reasons

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """Return the variables that the solver computes for each sample."""
        found = onset_variables(problem.interface)
        if problem.interface.is_plane:
            extent = position(problem.interface, OWN_VARIABLES["critical_patch_extent"])
            found = found | OWN_VARIABLES | {"critical_patch_extent": extent}
        return found

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, Array]]:
        """Return a solver for samples of this problem.

        Raises
        ------
        InputError
            From the solver: if the weakening rate varies along the interface, or a critical patch
            does not fit on it.
        """
        check_law(problem)
        interface = problem.interface

        def solve(sample: Sample) -> dict[str, Array]:
            _warn_if_coarse(problem, sample)
            rates, excess = _uniform_rates(sample), excess_of(sample)
            found: dict[str, Array] = {}
            for rate in np.unique(rates):
                windows = windows_of(problem, float(rate), self.weights)
                same = np.flatnonzero(rates == rate)
                some = excess if same.size == rates.size else excess[same]
                on = _on_plane if interface.is_plane else _on_line
                for name, values in on(problem, windows, some, sample.load_profile).items():
                    whole = found.setdefault(name, np.empty((rates.size, *values.shape[1:])))
                    whole[same] = values
            load = found.pop("critical_load")
            stress = sample.mean_stress(load)
            return {
                "critical_load": load,
                "critical_stress": stress,
                "first_instability": stress.copy(),
            } | found

        return solve

    def warn_of(self, problem: Problem, sample: Sample, values: dict[str, Array]) -> None:
        """Warn if samples reach their residual strength before the onset."""
        reached, missing = beyond_residual(problem, sample, values)
        if not reached.any():
            return
        shares = 100.0 * np.quantile(missing[reached], (0.5, 1.0))
        warn_accuracy(
            f"in about {100.0 * reached.mean():.2g} % of {reached.size} samples nodes of the"
            " critical patch reach their residual strength before the onset: there the local"
            " criterion is not an upper bound, and its onset is too low by an estimated"
            f" {shares[0]:.2g} % (median; at most {shares[1]:.2g} %); use st.Equilibrium()"
        )


def _on_line(
    problem: Problem, windows: list[Window], excess: Array, load_profile: Array
) -> dict[str, Array]:
    """Return load and position of the least average, between the nodes of a line."""
    (window,), spacing = windows, problem.interface.spacing
    reach = math.ceil(0.5 * window.extents[0] / spacing) + 2
    load, place = np.empty(excess.shape[0]), np.empty(excess.shape[0])
    minimum_rows(excess, load_profile, window.spectrum, reach, load, place)
    return {"critical_load": load, "critical_position": place * spacing}


def _on_plane(
    problem: Problem, windows: list[Window], excess: Array, load_profile: Array
) -> dict[str, Array]:
    """Return load, position and ellipse of the least average over the nodes of a plane."""
    onsets = [local_onset(windows, one, load_profile) for one in excess]
    chosen = [windows[onset.window] for onset in onsets]
    # The weights keep to this bound; only the rounding of the transforms may not.
    least = (excess / load_profile).min(axis=(1, 2))
    spacings = np.array(problem.interface.spacings)
    return {
        "critical_load": np.maximum([onset.load for onset in onsets], least),
        "critical_position": np.array([onset.place * spacings for onset in onsets]),
        "critical_aspect": np.array([window.aspect for window in chosen]),
        "critical_patch_extent": np.array([window.extents for window in chosen]),
        "critical_patch_area": np.array([window.area for window in chosen]),
    }


def beyond_residual(
    problem: Problem, sample: Sample, values: dict[str, Array]
) -> tuple[NDArray[np.bool_], Array]:
    """Estimate which samples reach their residual strength before the onset, and what that costs.

    Of the first thousand samples: whether a node of the critical patch has slipped as far as it
    weakens, (tau_p - tau_r)/W, at the critical load; and by what share that load is too low, to
    first order: the strength that slip would have taken below the residual one, averaged with the
    weights of the patch. Of a law that is not linear nothing is said: `check_law` has warned of it.

    At the critical load tau_0 the slip of the patch follows from (K - W) slip = tau_0 p - (tau_p -
    tau_i) with no singularity at its rim. For a parabola of strength, tau_0 + c s^2 with s the
    distance in units of the semi-axes, it is nearly `SLIP` c/W (1 - s^2)^1.6; c is taken from the
    strength by regression with the weights of the patch.
    """
    sample = sample.part(slice(0, ENOUGH))
    count, interface = sample.samples, problem.interface
    reached, missing = np.zeros(count, dtype=np.bool_), np.zeros(count)
    if not problem.friction.linear:
        return reached, missing
    rates, spacings = _uniform_rates(sample), np.array(interface.spacings)
    places = np.asarray(values["critical_position"])[:count].reshape(count, -1)
    nodes = np.rint(places / spacings).astype(np.int64)
    aspects = np.asarray(values.get("critical_aspect", np.ones(count)))[:count]
    excess, drop = (
        sample.strength - sample.initial_stress,
        sample.strength - sample.residual_strength,
    )
    for rate in np.unique(rates):
        for window in windows_of(problem, float(rate)):
            some = np.flatnonzero((rates == rate) & (aspects == window.aspect))
            offsets = np.argwhere(window.weight > 0.0)
            middle = np.array(interface.shape) // 2
            distance = (offsets + middle) % interface.shape - middle
            square = np.sum((2.0 * distance * spacings / window.extents) ** 2, axis=1)
            offsets, square = offsets[square < 1.0], square[square < 1.0]
            weight = window.weight[tuple(offsets.T)]
            weight = weight / weight.sum()
            slope = weight * (square - weight @ square)
            at = tuple(np.moveaxis((nodes[some, None] + offsets) % interface.shape, -1, 0))
            row = some[:, None]
            load, shape = np.asarray(values["critical_load"])[some], sample.load_profile[at]
            bend = (excess[(row, *at)] - load[:, None] * shape) @ slope / (slope @ square)
            slip = SLIP[len(spacings)] * np.maximum(bend, 0.0)[:, None] * (1.0 - square) ** 1.6
            lost = np.maximum(slip - drop[(row, *at)], 0.0)
            reached[some] = lost.any(axis=1)
            missing[some] = (lost @ weight) / (shape @ weight) / load
    return reached, missing


def nucleation_stress(
    problem: Problem, tau_p: Any, *, weights: Weights = "exact", aspect: float | None = None
) -> Array:
    """Return the nucleation stress tau_n(x) of strength profiles.

    This is the load tau_0 at which a patch of length h_n centred at x, if isolated, becomes
    unstable: the average of tau_p - tau_i over h_n with the weight of the critical
    slip-rate profile, over the same average of the load profile (Uenishi and Rice, 2003,
    Eq. 14; Albertini et al., 2020, Eq. 9).

    Parameters
    ----------
    problem : Problem
        With a weakening rate uniform along the interface.
    tau_p : (samples, *shape) or (*shape) array
        Peak strength, Pa.
    weights : {"exact", "rounded"}
        The exact eigenfunction, or the paper's 0.751 (0.925 - 0.308 s^2) sqrt(1 - s^2), which is
        too high by 0.036 %; the latter on a line only.
    aspect : float, optional
        On a plane, extent of the critical ellipse along x over that along y; by default the
        least average over five shapes is taken.

    Returns
    -------
    (samples, *shape) or (*shape) array, Pa
        Between the smallest and the largest (tau_p - tau_i)/p of the profile, times 1.00036 with
        the rounded weights.

    Raises
    ------
    InputError
        If the profile does not fit the problem, the weakening rate varies along the interface, or
        a critical patch is larger than the interface.

    Examples
    --------
    The average of a uniform strength is that strength; of any other it lies between the extremes.

    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> tau_n = st.theory.nucleation_stress(problem, tau_p)
    >>> bool(tau_p.min() < tau_n.min() < tau_n.max() < tau_p.max())
    True
    """
    check("problem", problem, Problem)
    check_window(problem, weights, aspect)
    check_law(problem)
    sample = problem.sample(tau_p)
    rates = _uniform_rates(sample)
    if np.ptp(rates) > 0.0:
        raise InputError("weakening_rate: differs between samples; pass them one by one")
    _warn_if_coarse(problem, sample)
    grid, excess = problem.interface, excess_of(sample)
    windows = windows_of(problem, float(rates[0]), weights, aspect)
    result = np.full(excess.shape, np.inf)
    load = grid.transform(sample.load_profile)
    loads = [grid.inverse_transform(load * (one.spectrum / one.total)) for one in windows]
    for own, strength in zip(result, excess, strict=True):
        spectrum = grid.transform(strength)
        for window, average in zip(windows, loads, strict=True):
            np.minimum(
                own, grid.inverse_transform(spectrum * window.spectrum) / average, out=own
            )
    # The weights keep to these bounds; only the rounding of the transforms may not.
    ratio = windows[0].total * (excess / sample.load_profile)
    low, high = (end(axis=sample.axes, keepdims=True) for end in (ratio.min, ratio.max))
    np.clip(result, low, high, out=result)
    return result[0] if np.ndim(tau_p) == len(grid.shape) else result


def check_window(problem: Problem, weights: Weights, aspect: Any) -> None:
    """Refuse the options of a plane on a line, and the other way round."""
    check("weights", weights, Literal["exact", "rounded"])
    plane = problem.interface.is_plane
    if aspect is not None and not (plane and is_finite(aspect) and aspect > 0.0):
        valid = "a positive number" if plane else "left out on a line"
        raise InputError(f"aspect: must be {valid}, got {describe(aspect)}")
    if plane and weights != "exact":
        raise InputError(
            "weights: 'rounded' applies to lines only; on a plane leave weights = 'exact'"
        )


def _refused_laws(problem: Problem) -> list[str]:
    """Return why the weakening rate at zero slip does not determine the onset, if so."""
    friction = problem.friction
    times = friction.steepest_slope / friction.initial_slope
    if times <= 1.0:
        return []
    return [
        "friction: the local criterion takes the weakening rate at zero slip, and this"
        f" law falls up to {times:.3g} times as steeply later, so that patches become"
        " unstable at lower loads than it predicts; use st.Equilibrium() or st.Rupture()"
    ]


def check_law(problem: Problem) -> None:
    """Refuse a law that steepens; warn of one that is not linear, with the error to expect."""
    if reasons := _refused_laws(problem):
        raise InputError(reasons)
    if not problem.friction.linear:
        warn_accuracy(
            "friction: the local criterion takes the weakening rate at zero slip as constant;"
            " as strength falls ever less steeply, patches become unstable later than it"
            " predicts: for an exponential law and strength from 0.66 to 1.66 MPa by 2 % (at"
            " most 7 %) at a correlation length of a quarter of h_n, by 0.6 % (at most 3 %) at"
            " one of h_n; st.Equilibrium() is exact for piecewise linear laws"
        )


def _warn_if_coarse(problem: Problem, sample: Sample) -> None:
    """Warn where the moving average is a coarse sum."""
    cost = (
        "where the strength varies within a quarter of it, the local criterion is off by about"
        " 0.8 % (rms) at 8 nodes and 3 % at 4; for smoother strength by far less"
    )
    if problem.interface.is_plane:
        cost = (
            "the local criterion takes the lowest node and critical patches of whole nodes, which"
            " makes it about 0.15 % too high at 8 nodes, 0.4 % at 5 and 0.7 % at 4"
        )
    problem.warn_if_coarse(sample, 8.0 if problem.interface.is_plane else 12.0, cost)


def excess_of(sample: Sample) -> Array:
    """Return tau_p - tau_i, Pa; `InputError` where the strength is not finite."""
    if not np.isfinite(sample.strength).all():
        raise InputError(
            "strength: the local criterion averages the strength over the nucleation length, so it"
            " must be finite everywhere; where some of it cannot break, give a large finite"
            " strength, or use st.Rupture()"
        )
    return np.ascontiguousarray(sample.strength - sample.initial_stress)


def _uniform_rates(sample: Sample) -> Array:
    """Return W of each sample, (samples,); `InputError` where it varies along the interface."""
    if not sample.uniform_weakening:
        raise InputError(
            "weakening_rate: varies along the interface, so there is no single nucleation length;"
            " the local criterion does not hold, use st.Equilibrium() or st.Rupture()"
        )
    return np.ascontiguousarray(sample.weakening_rate.reshape(sample.samples, -1)[:, 0])
