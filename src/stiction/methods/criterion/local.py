"""The local criterion: the onset at the weakest patch, with each patch in isolation.

Problem
-------
s is the strength minus initial stress (Pa), p is the load profile, and
y >= 0 are the weights of a critical window, centred at x. A patch of
this size becomes unstable in isolation at the nucleation stress (K.
Uenishi and J. R. Rice, J. Geophys. Res. 108, 2003, equation 14; G.
Albertini et al., 2020, equation 9)

    tau_n(x) = <s, y>_x / <p, y>_x.                                  (1)

The predicted onset is the least tau_n over all positions and windows.

Algorithm
---------
1. Find the critical windows for the weakening rate (`windows`).
2. Find the least average of strength over load, over windows and positions
   (`average`). On a specimen every position has its own window
   (`elasticity.weakest`).
3. With a machine, subtract an estimate of the stress that slip releases
   before the onset (`_relief_of_patch`).
"""

from collections.abc import Callable, Iterator
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import Listed, checked, model
from stiction.base.variables import Variable
from stiction.elasticity.weakest import weakest_window
from stiction.methods.criterion.average import averages, least_average
from stiction.methods.criterion.onset_bracket import rms_difference
from stiction.methods.criterion.windows import windows_of
from stiction.problem.checks import warn_if_coarse
from stiction.problem.friction import SCALES
from stiction.problem.problem import Problem, refusals, refuse_specimen
from stiction.problem.profiles import named_profiles
from stiction.problem.results import onset_variables, position
from stiction.problem.sample import Sample
from stiction.problem.specimen import Slider

MAX_RMS_DIFFERENCE = 0.01
"""Relative difference from the exact onset (rms) above which samples
are solved by both methods."""
COARSE_PLANE = (
    8.0,
    "the local criterion is about 0.15 % too high at 8 nodes, 0.4 % at 5, 0.7 % at 4",
)
COARSE_LINE = (
    12.0,
    "if the strength varies within a quarter of this length, the local criterion is off by about"
    " 0.8 % (rms) at 8 nodes and 3 % at 4, and by far less for smoother strength",
)
"""Number of nodes in a nucleation length above which there is no
warning, and error on coarser grids."""
INSTEAD = ". Use st.Equilibrium() or st.Rupture()"

OF_PLANES = {
    "critical_aspect": Variable(
        "1", "ratio of the extents of the critical ellipse along x and y"
    ),
    "critical_patch_extent": Variable("m", "extents of the critical ellipse"),
    "critical_patch_area": Variable("m2", "area of the critical ellipse"),
}
OF_SPECIMENS = {
    "critical_patch_length": Variable("m", "nucleation length at the critical place")
}


@model(kw_only=True)
class LocalCriterion(Listed):
    """Onset at the minimum of the nucleation stress, with each patch in isolation.

    If no node reaches its residual strength (or zero) before the onset,
    this is an upper bound of the exact onset, up to discretisation,
    because interaction can only lower the load at which patches become
    unstable. If nodes reach their residual strength, the exact onset is
    higher than predicted. Events are assumed not to be arrested, so
    `first_instability` and `critical_stress` are equal. If a quick test
    leaves a doubt, `onset` and `monte_carlo` compare samples with
    `Equilibrium`, and warn about differences above 1 %.

    Notes
    -----
    The weights of the average are never negative, so the result lies
    between the least and the greatest strength even if the strength
    jumps. On a line the minimum may lie between the nodes. For a
    nonlinear friction law, the criterion uses the weakening rate at
    zero slip and issues an `AccuracyWarning`: if strength falls less
    and less steeply, the exact onset is higher. A law that steepens
    raises an error.

    If the interface ends, patches lie within its extent. Between
    half-spaces, slip before the onset transfers stress to the nodes
    beyond the extent, and the criterion neglects this transfer. In
    tests, the correlation length of the strength was one nucleation
    length, and the extent was 2, 4, 8 and 17 nucleation lengths.
    Stresses were too high by 4, 1, 0.3 and 0.1 % on average, and by up
    to 21, 6, 2.5 and 3 %. Loads were too high by 0.9, 0.3, 0.1 and 0.1
    %. `onset` and `monte_carlo` always compare such interfaces with
    `Equilibrium`, and the warning gives the difference.

    On a plane the average is over critical ellipses with five aspect
    ratios. A critical ellipse is the smallest ellipse on which the
    stiffness K - W of the discrete problem is unstable. The unstable
    eigenvector is the weight. The minimum is taken over nodes and
    ellipses. `critical_aspect`, `critical_patch_extent` (m, along x and
    y) and `critical_patch_area` (m²) describe the critical ellipse.

    On a specimen each position has its own nucleation length: the length of the
    shortest run of nodes on which the blocks are unstable. The eigenvector is
    the weight. `critical_patch_length` (m) is the nucleation length at the
    critical position. With a machine, stable slip lowers the mean stress below
    `critical_load`. The returned stresses include an estimate of this
    reduction, for the critical patch alone. The slip of other patches is
    unknown, so the stresses are too high. In six set-ups in mode II, stresses
    and `critical_load` were too high by 0.2 to 5 %. A pusher near the interface
    causes events long before the interface slides. `critical_stress` is then
    far too low.

    Examples
    --------
    >>> import stiction as st
    >>> st.LocalCriterion().supports(st.paper.problem(nodes=512))  # no reason against it
    []
    """

    type: Literal["local_criterion"] = "local_criterion"
    _shown = ()
    label = "local criterion"
    exact_method: ClassVar[str] = "equilibrium"
    scaling: ClassVar[str] = "affine"
    samples_at_point: ClassVar[int] = 2000

    def seconds_per_sample(self, problem: Problem) -> float:
        """Return the approximate time for a sample on a core, s.

        >>> import stiction as st
        >>> seconds = st.LocalCriterion().seconds_per_sample(
        ...     st.paper.problem(nodes=1000)
        ... )
        >>> print(f"{seconds:.3g}")  # 0.03 + 0.03 ms
        6e-05
        """
        # The numbers are measured. The time on planes is mostly
        # transforms over several ellipses.
        fixed, per_node = (5e-4, 8e-8) if problem.interface.is_plane else (3e-5, 3e-8)
        return fixed + per_node * problem.interface.size

    def supports(self, problem: Problem) -> list[str]:
        """Return the reasons why the method cannot solve a problem, or an empty list.

        >>> import dataclasses, numpy as np, stiction as st
        >>> problem, corners = st.paper.problem(nodes=512), {"weakening_rate": 2e11}
        >>> laws = [
        ...     st.PiecewiseWeakening(slip=[0.2, 1.0], strength=[1.0, 0.0], **corners),
        ...     st.PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.8, 0.0], **corners),
        ...     st.PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.2, 0.0], **corners),
        ...     st.LinearWeakening(weakening_rate=np.linspace(1e11, 2e11, 512)),
        ... ]
        >>> for law in laws:
        ...     reasons = st.LocalCriterion().supports(
        ...         dataclasses.replace(problem, friction=law)
        ...     )
        ...     print([reason[:46] for reason in reasons])
        ['friction.strength: begins with a plateau, on w']
        ['friction: this law falls up to 4 times as stee']
        []
        ['friction.weakening_rate: varies along the inte']
        """
        friction, reasons = problem.friction, []
        if isinstance(problem.specimen, Slider):
            return [
                "problem.specimen: the pressure under a slider changes with the push and with slip,"
                " so that no patch has a fixed strength. Use st.Equilibrium()"
            ]
        if friction.plateau:
            reasons.append(
                "friction.strength: begins with a plateau, on which no patch is unstable, but the"
                f" local criterion assumes weakening from zero slip{INSTEAD}"
            )
        if friction.steepening > 1.0:
            reasons.append(
                f"friction: this law falls up to {friction.steepening:.3g} times as steeply later"
                f" as at zero slip, but the local criterion uses the rate at zero slip{INSTEAD}"
            )
        if friction.weakening_rate is not None and friction.uniform_weakening_rate is None:
            reasons.append(
                "friction.weakening_rate: varies along the interface, so the nucleation length is"
                f" not defined{INSTEAD}"
            )
        return reasons

    def bounded_by_strength(self, problem: Problem, event: str) -> tuple[bool, bool]:
        """Return whether strength bounds the onset from below and from above.

        The onset is bounded from below because the weights are
        positive, except with a machine, because the criterion neglects
        the slip of other patches. The onset is bounded from above
        because load <g, p> <= <g, tau_p - tau_i> at each position.
        Averaged over all positions between half-spaces, this is load
        <p> <= <tau_p - tau_i>. An interface that ends has no bounds.

        >>> from types import SimpleNamespace
        >>> cases = [
        ...     (False, None, False),
        ...     (True, None, False),
        ...     (False, 1, False),
        ...     (False, 1, True),
        ... ]
        >>> for held, specimen, machine in cases:
        ...     problem = SimpleNamespace(specimen=specimen, has_machine=machine)
        ...     problem.interface = SimpleNamespace(is_held=held)
        ...     print(LocalCriterion().bounded_by_strength(problem, "first_instability"))
        (True, True)
        (False, False)
        (True, False)
        (False, False)
        """
        # Nodes beyond an end take over stress, but do not count in means.
        everywhere = not problem.interface.is_held
        return everywhere and not problem.has_machine, everywhere and problem.specimen is None

    def unfit_as_guide(self, problem: Problem, varying: set[str]) -> str | None:
        """Return a reason if the length of patches differs between samples, or `None`.

        >>> import dataclasses, stiction as st
        >>> problem, unfit = st.paper.problem(nodes=512), LocalCriterion().unfit_as_guide
        >>> unfit(problem, {"strength"}) is None
        True
        >>> unfit(problem, {"strength", "critical_slip"})
        'the weakening rate is not uniform'
        >>> laws = [st.ExponentialWeakening(weakening_rate=5e11)]
        >>> laws += [st.LinearWeakening(critical_slip=1e-6)]
        >>> [unfit(dataclasses.replace(problem, friction=law), set()) for law in laws]
        ['strength does not fall linearly with slip', 'the weakening rate is not uniform']
        >>> long = dataclasses.replace(
        ...     problem, friction=st.LinearWeakening(weakening_rate=1e10)
        ... )
        >>> unfit(long, set())
        'a critical patch does not fit on the interface'
        """
        W = problem.friction.uniform_weakening_rate
        if isinstance(problem.specimen, Slider):
            return "the pressure under a slider changes with the push"
        if not problem.friction.linear:
            return "strength does not fall linearly with slip"
        if W is None or varying & set(SCALES):
            return "the weakening rate is not uniform"
        try:
            if problem.specimen is None:
                windows_of(problem, W)
            elif not problem.blocks.windows(W, W).starts.size:
                return "no part of the specimen becomes unstable by itself"
        except InputError:
            return "a critical patch does not fit on the interface"
        return None

    def may_differ(self, problem: Problem, sample: Sample, stress: Array) -> bool:
        """Return whether exact onsets may differ by more than 1 % in mean or scatter.

        The quick test applies to lines between half-spaces without
        ends. In other cases the result is True.

        A uniform strength of 1 MPa slides at 1 MPa.

        >>> import dataclasses, stiction as st
        >>> problem, method = st.paper.problem(nodes=144), LocalCriterion()
        >>> interface = st.Interface(0.1, 144, extent=(0.01, 0.07))
        >>> held = dataclasses.replace(problem, interface=interface)
        >>> samples = [one.sample(np.full(144, 1e6)) for one in (problem, held)]
        >>> [
        ...     method.may_differ(problem, samples[0], np.array([stress]))
        ...     for stress in (1e6, 1.03e6)
        ... ]
        [False, True]
        >>> method.may_differ(held, samples[1], np.array([1e6]))
        True
        """
        # The quick test needs the signs of K and a law with one piece.
        interface = problem.interface
        half_spaces = problem.specimen is None and not interface.is_plane
        if not (half_spaces and problem.friction.linear and not interface.is_held):
            return True
        return rms_difference(problem, sample, stress) > MAX_RMS_DIFFERENCE

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """Return the variables in the solver's results.

        >>> from types import SimpleNamespace
        >>> import stiction as st
        >>> line, plane = st.Interface(0.1, 8), st.Interface((0.1, 0.1), (8, 8))
        >>> for interface, specimen in ((line, None), (line, 1), (plane, None)):
        ...     problem = SimpleNamespace(interface=interface, specimen=specimen)
        ...     known = LocalCriterion().variables(problem)
        ...     print([name for name in known if name not in onset_variables(interface)])
        []
        ['critical_patch_length']
        ['critical_aspect', 'critical_patch_extent', 'critical_patch_area']
        >>> known["critical_patch_extent"].dims, known["critical_aspect"].dims
        (('sample', 'direction'), ('sample',))
        """
        variables = onset_variables(problem.interface)
        if problem.interface.is_plane:
            extent = position(problem.interface, OF_PLANES["critical_patch_extent"])
            variables = variables | OF_PLANES | {"critical_patch_extent": extent}
        return variables if problem.specimen is None else variables | OF_SPECIMENS

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, Array]]:
        """Return a solver for the samples of a problem.

        Raises an `InputError` if the weakening rate varies along the
        interface, or if a critical patch does not fit on it.

        On a plane with uniform strengths, the load is the strength less the
        initial stress. The second sample weakens 1.5 times as fast, so its patch
        is about two thirds as long.

        >>> import numpy as np, stiction as st
        >>> problem = st.Problem(
        ...     solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.25, density=1000.0),
        ...     interface=st.Interface((0.1, 0.1), (64, 64)),
        ...     friction=st.LinearWeakening(),
        ...     load=st.Load(initial_stress=3e5),
        ... )
        >>> rates = np.array([1e11, 1.5e11])[:, None, None] * np.ones((2, 64, 64))
        >>> strength = np.array([1e6, 2e6])[:, None, None] * np.ones((2, 64, 64))
        >>> profiles = {"strength": strength, "weakening_rate": rates}
        >>> values = LocalCriterion().prepare(problem)(problem.sample(profiles))
        >>> (
        ...     (values["critical_load"] / 1e5).round(6).tolist(),
        ...     values["critical_position"].shape,
        ... )
        ([7.0, 17.0], (2, 2))
        >>> (values["critical_stress"] / 1e5).round(6).tolist()
        [10.0, 20.0]
        >>> extent, aspect = values["critical_patch_extent"], values["critical_aspect"]
        >>> np.allclose(extent[:, 0], aspect * extent[:, 1])
        True
        >>> bool(1.4 < extent[0, 1] / extent[1, 1] < 1.6)
        True
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
            # The rate, and with it the nucleation length, may differ
            # between samples.
            for weakening_rate, rows in _weakening_rates(sample):
                # 1.
                windows = windows_of(problem, weakening_rate)
                # 2.
                least = least_average(interface, windows, excess[rows], profile)
                load[rows], place[rows], chosen = least
                if interface.is_plane:
                    patches = [(y.aspect, *y.extents, y.area) for y in windows]
                    patch[rows] = np.array(patches)[chosen]
            values = _values(sample, load, load, place * interface.spacings)
            if interface.is_plane:
                columns = patch[:, 0], patch[:, 1:3], patch[:, 3]
                values |= zip(OF_PLANES, columns, strict=True)
            return values

        return solve


def _onset_of_specimen(problem: Problem, sample: Sample) -> dict[str, Array]:
    """Return the onset of each specimen, at its weakest position.

    The weakest window has three nodes and begins at node 2. The relief counts
    only if the machine has a stiffness.

    >>> from types import FunctionType, SimpleNamespace
    >>> names = {"_warn_if_coarse": lambda *given: None}
    >>> names["_relief_of_patch"] = lambda *given: given[1] + 0.5
    >>> names["weakest_window"] = lambda excess, *given: (excess.min(), 1, 2)
    >>> plain = FunctionType(_onset_of_specimen.__code__, globals() | names)
    >>> interface = SimpleNamespace(spacing=0.25, size=6, is_held=False)
    >>> windows = SimpleNamespace(starts=np.arange(2), widths=np.array([2, 3]))
    >>> blocks = SimpleNamespace(windows=lambda *rates: windows, relief=1.0)
    >>> sample = SimpleNamespace(
    ...     strength=np.full((2, 6), 9.0),
    ...     samples=2,
    ...     initial_stress=np.array([[1.0] * 6, [2.0] * 6]),
    ...     weakening_rate=np.array([[3.0] * 6, [4.0] * 6]),
    ...     uniform_weakening=True,
    ...     load_profile=np.ones(6),
    ...     mean_stress=lambda load: 2.0 * load,
    ... )
    >>> problem = SimpleNamespace(interface=interface, blocks=blocks)
    >>> values = plain(problem, sample)
    >>> values["critical_load"].tolist(), values["critical_stress"].tolist()
    ([8.0, 7.0], [9.0, 5.0])
    >>> (
    ...     values["critical_position"].tolist(),
    ...     values["critical_patch_length"].tolist(),
    ... )
    ([0.875, 0.875], [0.75, 0.75])
    >>> blocks.relief = 0.0
    >>> plain(problem, sample)["critical_stress"].tolist()
    [16.0, 14.0]
    >>> interface.is_held = True
    >>> plain(problem, sample)["critical_stress"].tolist()
    [9.0, 5.0]
    """
    _warn_if_coarse(problem, sample)
    excess, spacing = excess_of(sample), problem.interface.spacing
    # The weakest window of each sample: its load, its first node, and
    # its number of nodes.
    load, start, width, relief = np.zeros((4, sample.samples))
    work, blocks = np.empty(problem.interface.size), problem.blocks
    for weakening_rate, rows in _weakening_rates(sample):
        # 1.
        windows = blocks.windows(weakening_rate, weakening_rate)
        if not windows.starts.size:
            raise InputError(
                "interface.length: no part of the specimen becomes unstable by itself, so the local"
                " criterion does not hold. Use st.Equilibrium()"
            )
        for i in rows:
            # 2.
            W, profile = sample.weakening_rate[i], sample.load_profile
            load[i], c, start[i] = weakest_window(excess[i], profile, W, windows, np.inf, work)
            if not np.isfinite(load[i]):
                raise InputError(
                    "interface.extent: no part becomes unstable by itself, so the local"
                    " criterion does not hold. Use st.Equilibrium()"
                )
            width[i] = windows.widths[c]
            # 3. Under a dead load, slip does not change
            # the mean stress, unless it transfers
            # stress to nodes beyond an extent.
            if blocks.relief > 0.0 or problem.interface.is_held:
                run = slice(int(start[i]), int(start[i] + width[i]))
                drive = load[i] * sample.load_profile - excess[i]
                relief[i] = _relief_of_patch(problem, weakening_rate, run, drive)
    values = _values(sample, load, load - relief, (start + 0.5 * width) * spacing)
    return values | {"critical_patch_length": width * spacing}


def _values(sample: Sample, load: Array, relieved: Array, place: Array) -> dict[str, Array]:
    """Return the variables of all methods.

    `relieved` is the load less the relief by slip, Pa.

    >>> from types import SimpleNamespace
    >>> sample = SimpleNamespace(mean_stress=lambda load: 2.0 * load + 1.0)
    >>> values = _values(sample, np.array([5.0]), np.array([3.0]), np.array([0.25]))
    >>> for name, value in values.items():
    ...     print(name, value.tolist())
    critical_load [5.0]
    critical_stress [7.0]
    first_instability [7.0]
    critical_position [0.25]
    """
    # Arrested events are not known, so the first instability is the onset.
    stress = sample.mean_stress(relieved)
    variables = ("critical_load", "critical_stress", "first_instability", "critical_position")
    return dict(zip(variables, (load, stress, stress.copy(), place), strict=True))


def _relief_of_patch(problem: Problem, W: float, run: slice, drive: Array) -> float:
    """Step 3: return the mean stress that slip on a patch releases before its instability.

    Slip on the patch alone solves (K - W) slip = drive, up to a
    multiple of the unstable mode. An additional equation fixes the
    multiple: the slips at the two ends add up to zero. In reality, slip
    does not vanish at a free end, and releases more stress.

    With the slips 2, 5 and -2 on the patch, (K - W) slip is -2, 0 and -10.
    The force 3 at both ends, times W, completes the drive. The relief counts
    2 and 5 only.

    >>> from types import SimpleNamespace
    >>> K = np.array([[9, 1, 1, 1.0], [1, 5, -2, 1], [1, -2, 4, 1], [1, 1, 1, 6]])
    >>> relief = lambda slip: float(np.array([100.0, 10.0, 1.0, 0.1]) @ slip)
    >>> problem = SimpleNamespace(blocks=SimpleNamespace(stiffness=K), relief=relief)
    >>> slip, ends = np.array([2.0, 5.0, -2.0]), np.array([1.0, 0.0, 1.0])
    >>> drive = np.append(
    ...     99.0, (K[1:, 1:] - 0.5 * np.eye(3)) @ slip + 0.5 * 3.0 * ends
    ... )
    >>> round(_relief_of_patch(problem, 0.5, slice(1, 4), drive), 9)
    25.0
    """
    matrix = np.zeros((run.stop - run.start + 1,) * 2)
    matrix[:-1, :-1] = problem.blocks.stiffness[run, run] - W * np.eye(len(matrix) - 1)
    # The last row and column are the added equation and its unknown
    # force, scaled like the others.
    matrix[[0, -2], -1] = matrix[-1, [0, -2]] = W
    # The slip of a part that would move back counts as zero.
    slip = np.zeros(len(drive))
    slip[run] = np.linalg.solve(matrix, np.append(drive[run], 0.0))[:-1]
    return problem.relief(np.maximum(slip, 0.0))


@checked
def nucleation_stress(problem: Problem, tau_p: Any) -> Array:
    """Return the nucleation stress tau_n(x) of strength profiles.

    tau_n is the load tau_0 at which an isolated patch of length h_n
    centred at x becomes unstable: the average of tau_p - tau_i over
    h_n, with the critical slip-rate profile as weight, divided by the
    same average of the load profile (Uenishi and Rice, 2003, Eq. 14;
    Albertini et al., 2020, Eq. 9). On a plane tau_n is the minimum over
    five ellipses.

    Parameters
    ----------
    problem : Problem
        A problem whose weakening rate is uniform along the interface.
    tau_p : (samples, *shape) or (*shape) array
        Peak strength, Pa.

    Returns
    -------
    (samples, *shape) or (*shape) array, Pa
        Nucleation stress, between the smallest and the largest (tau_p -
        tau_i)/p in the profile.

    Raises
    ------
    InputError
        If the weakening rate varies along the interface, or if a
        critical patch does not fit on it.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(
    ...     problem.interface, seed=1
    ... )
    >>> tau_n = st.theory.nucleation_stress(problem, tau_p)
    >>> bool(tau_p.min() < tau_n.min() < tau_n.max() < tau_p.max())
    True
    """
    check_law(problem)
    refuse_specimen(problem, "nucleation_stress", "st.LocalCriterion() gives its minimum")
    sample, interface = problem.sample(tau_p), problem.interface
    _warn_if_coarse(problem, sample)
    # A profile has one nucleation length.
    ((weakening_rate, _), *further_weakening_rates) = _weakening_rates(sample)
    if further_weakening_rates:
        raise InputError("weakening_rate: differs between samples. Pass a single sample")
    excess, profile = excess_of(sample), sample.load_profile
    windows = windows_of(problem, weakening_rate)
    samples = averages(interface, windows, excess, profile)
    result = np.array([np.minimum.reduce(list(fields)) for fields in samples])
    # These bounds hold for the exact average. Round-off of the
    # transforms may exceed them.
    ratio = windows[0].total * (excess / profile)
    low, high = (end(axis=sample.axes, keepdims=True) for end in (ratio.min, ratio.max))
    result = np.clip(result, low, high)
    named = tau_p._asdict() if isinstance(tau_p, Sample) else named_profiles(tau_p)
    given: Any = named.get("strength", named.get("friction_coefficient"))
    if not hasattr(given, "ndim"):
        given = np.asarray(given, dtype=object)  # elements of a list may have units
    return result[0] if given.ndim == len(interface.shape) else result


def check_law(problem: Problem) -> None:
    """Raise an `InputError` for an unsupported problem, and warn about a nonlinear law.

    >>> import dataclasses, stiction as st
    >>> from stiction.base.errors import collect_warnings
    >>> problem = st.paper.problem(nodes=512)
    >>> law = st.ExponentialWeakening(weakening_rate=5e11)
    >>> for checked_problem in (problem, dataclasses.replace(problem, friction=law)):
    ...     with collect_warnings() as warned:
    ...         check_law(checked_problem)
    ...     print(len(warned))
    0
    1
    """
    if refused := refusals(problem, LocalCriterion()):
        raise InputError(refused)
    if not problem.friction.linear:
        warn_accuracy(
            "friction: the local criterion takes the weakening rate at zero slip as constant, so"
            " the onset is later than predicted (for an exponential law by 2 %, at most 7 %, at a"
            " correlation length of h_n/4). st.Equilibrium() is exact for piecewise linear laws"
        )


def _warn_if_coarse(problem: Problem, sample: Sample) -> None:
    """Warn if the moving average covers too few nodes.

    A line is warned about below 12 nodes, and a plane below 8 nodes.

    >>> from types import SimpleNamespace
    >>> import stiction as st
    >>> from stiction.base.errors import collect_warnings
    >>> problem, plane = st.paper.problem(nodes=256), SimpleNamespace(is_plane=True)
    >>> for nodes in (7.9, 8.1, 11.9, 12.1):
    ...     length = nodes * problem.interface.spacing
    ...     rate = (
    ...         problem.friction.weakening_rate * problem.nucleation_length / length
    ...     )
    ...     sample = SimpleNamespace(steepest_weakening_rate=rate)
    ...     with collect_warnings() as warned:
    ...         _warn_if_coarse(problem, sample)
    ...     print(nodes, len(warned))
    7.9 1
    8.1 1
    11.9 1
    12.1 0
    """
    nodes, cost = COARSE_PLANE if problem.interface.is_plane else COARSE_LINE
    warn_if_coarse(problem, sample.steepest_weakening_rate, nodes, cost)


def excess_of(sample: Sample) -> Array:
    """Return tau_p - tau_i, Pa.

    >>> from types import SimpleNamespace
    >>> strength, initial = np.array([[5.0, 4.0]]), np.array([[1.0, 2.5]])
    >>> sample = SimpleNamespace(strength=strength, initial_stress=initial)
    >>> excess_of(sample).tolist()
    [[4.0, 1.5]]
    """
    return np.ascontiguousarray(sample.strength - sample.initial_stress)


def _weakening_rates(sample: Sample) -> Iterator[tuple[float, NDArray[np.int64]]]:
    """Yield each weakening rate (Pa/m) with the numbers of its samples.

    >>> from types import SimpleNamespace
    >>> rates = np.array([[3.0, 3.0], [2.0, 2.0], [3.0, 3.0]])
    >>> sample = SimpleNamespace(
    ...     uniform_weakening=True, samples=3, weakening_rate=rates
    ... )
    >>> [(rate, rows.tolist()) for rate, rows in _weakening_rates(sample)]
    [(2.0, [1]), (3.0, [0, 2])]
    >>> next(
    ...     _weakening_rates(SimpleNamespace(uniform_weakening=False))
    ... )  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: weakening_rate: varies along the interface, so the ...
    """
    if not sample.uniform_weakening:
        raise InputError(
            "weakening_rate: varies along the interface, so the nucleation length of the local"
            f" criterion is not defined{INSTEAD}"
        )
    weakening_rates = sample.weakening_rate.reshape(sample.samples, -1)[:, 0]
    for weakening_rate in np.unique(weakening_rates):
        yield float(weakening_rate), np.flatnonzero(weakening_rates == weakening_rate)
