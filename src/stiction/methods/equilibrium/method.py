"""Equilibrium as a method: exact quasi-static onset with all interactions."""

from collections.abc import Callable
from typing import Annotated, Any, ClassVar, Literal, TypeAlias

from numpy.typing import NDArray
from pydantic import Field

from stiction.base.model import Flag, Listed, Number, Real, model
from stiction.base.variables import Variable
from stiction.methods.equilibrium.events import event_variables, of_samples
from stiction.methods.equilibrium.slider import OF_SLIDERS, SliderSolver, push_variables
from stiction.methods.equilibrium.solver import OnsetSolver, make_search, refused
from stiction.methods.equilibrium.strength import pieces_of
from stiction.problem.problem import Problem
from stiction.problem.results import along, onset_variables, position
from stiction.problem.sample import Sample
from stiction.problem.specimen import Slider

Tolerance: TypeAlias = Annotated[Real, Field(ge=1e-10, le=1e-2)]

VARIABLES = {
    "certificate_gap": Variable("Pa", "distance between the bounds of the first instability"),
    "slip_patches": Variable("1", "number of slipping patches at the first instability"),
    "arrested_events": Variable("1", "number of instabilities that came to rest"),
    "residual_reached": Variable(
        "1", "whether a node was at its residual strength before sliding"
    ),
    "sliding_position": Variable(
        "m", "position of the patch that runs along the whole interface"
    ),
}
OF_LINES = {
    "critical_patch_length": Variable("m", "length of the patch that becomes unstable first")
}
OF_PLANES = {
    "critical_patch_extent": Variable("m", "extent of the patch that becomes unstable first"),
    "critical_patch_area": Variable("m2", "area of the patch that becomes unstable first"),
    "certified": Variable("1", "whether the bounds of the first instability are rigorous"),
}
ON_NODES = {
    "slip": Variable("m", "slip at the first instability"),
    "sensitivity": Variable("1", "sensitivity of the first instability to the strength there"),
}


@model(kw_only=True)
class Equilibrium(Listed):
    """Exact quasi-static onset with all interactions between patches.

    The load rises until there is no equilibrium. While strength falls
    linearly, this is a linear programme, which is solved to round-off
    with a certificate. After the first instability, or after the first
    corner of a `PiecewiseWeakening`, the equilibria are followed event
    by event, which is also exact, but takes 5 times as long for two
    pieces and 50 times as long for 32. On planes the path between
    events is followed in steps of the load. Weakening rate, residual
    strength, initial stress and load profile may vary along the
    interface.

    On planes the programme is solved with Fourier transforms. Results contain its
    lower bound, at which there is an equilibrium.

    Parameters
    ----------
    sensitivity : bool
        Also return d first_instability / d tau_p at every node, at fixed weakening rates.
        Planes have no sensitivity. The sensitivity is NaN if a law steepens and a node
        passes a corner before the first instability. If a node of a specimen stops before
        the first instability, the derivatives are difference quotients, which need a path
        for every node.
    slip : bool
        Also return the slip at the first instability.
    events : int
        Also return this number of arrested events for each sample over
        'event', padded with NaN. If an interface ends, the event in
        which it slides is included. Stress and slip continue from event to
        event. `equilibrium_path` describes the variables.
    tolerance : float
        On planes, the distance between the bounds as a fraction of the
        load, 1e-10 to 1e-2. Lines are solved to round-off, or to 1e-9
        if thousands of nodes slip.

    Notes
    -----
    In addition to the variables of every method, the result contains
    `certificate_gap`, the distance between rigorous bounds of the first
    instability (Pa), `slip_patches` at the first instability,
    `critical_patch_length` (m), `arrested_events`, `residual_reached`
    (whether a node reached its residual strength before the interface
    slid), and `sliding_position` (m), which differs from
    `critical_position` only after an arrested event.

    Arrest is computed in equilibrium. Inertia may carry a rupture
    further. There is no upper bound, and `certificate_gap` is NaN, if a
    law steepens and a node passes a corner before the first
    instability, or if a node of a specimen stops before the first
    instability.

    On a slider, slip and opening change the pressure. `open_fraction`
    is the part of the interface that is open before it slides. No bound
    is claimed, and `certificate_gap` is NaN.

    On planes, positions have two components, along 'direction'.
    `critical_patch_extent` (m, along 'direction') and
    `critical_patch_area` (m²) replace the length. `certified` is true
    if the bounds are rigorous, which requires that no node reaches its
    residual strength before the first instability. This is tested at
    the lower bound, so a large `tolerance` may miss such a node. If the
    interface ends, the bounds hold for the load, because the mean
    stress also depends on the slip. Slipping nodes belong to the same
    patch if their cells have a common edge.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=512)
    >>> tau_p = st.paper.strength(problem, correlation_ratio=2.0).sample(problem.interface, seed=1)
    >>> found = st.onset(problem, tau_p, method=st.Equilibrium())
    >>> bool(found.certificate_gap.item() < 1e-6 * found.critical_stress.item())
    True
    """

    sensitivity: Flag = False
    slip: Flag = False
    events: Number = 0
    tolerance: Tolerance = 1e-6
    type: Literal["equilibrium"] = "equilibrium"
    first_stage: ClassVar[str] = "local_criterion"
    scaling: ClassVar[str] = "stretch"
    samples_at_point: ClassVar[int] = 500
    label = "equilibrium"
    _shown = ()

    def seconds_per_sample(self, problem: Problem) -> float:
        """Return the approximate time for a sample on a core, s.

        The size to the power 1.5 is 8 for 4096 nodes. A law with two pieces takes
        longer, and a machine with stiffness longer still:

        >>> from types import SimpleNamespace
        >>> import stiction as st
        >>> line = SimpleNamespace(is_plane=False, size=4096)
        >>> linear = st.LinearWeakening(1.0)
        >>> pieces = st.PiecewiseWeakening(1.0, slip=[0.3, 1.0], strength=[0.4, 0.0])
        >>> def seconds(interface=line, friction=linear, specimen=None):
        ...     parts = {"interface": interface, "friction": friction, "specimen": specimen}
        ...     return round(Equilibrium().seconds_per_sample(SimpleNamespace(**parts)), 6)
        >>> def blocks(kind, stiffness):
        ...     return SimpleNamespace(drive=SimpleNamespace(type=kind, stiffness=stiffness))
        >>> seconds(), seconds(friction=pieces)
        (0.0042, 0.034141)
        >>> drives = ("platen", 0), ("platen", 1), ("top", 0)
        >>> [seconds(specimen=blocks(*drive)) for drive in drives]
        [0.2402, 1.2002, 1.2002]
        >>> seconds(SimpleNamespace(is_plane=True, size=300))
        0.003
        >>> seconds(SimpleNamespace(is_plane=False, size=100), specimen=Slider.__new__(Slider))
        0.002
        """
        interface = problem.interface
        if interface.is_plane:
            return 1e-5 * interface.size
        if isinstance(problem.specimen, Slider):
            return 2e-9 * interface.size**3.0
        # Each corner that a node passes changes the factor.
        linear, corners = problem.friction.linear, pieces_of(problem.friction).ends.size
        more = 1.0 if linear else 6.0 * corners**0.5
        # A platen under a dead load causes the fewest events.
        if problem.specimen is not None:  # more events, and jumps are followed to their end
            drive = problem.specimen.drive
            more *= 60.0 if drive.type == "platen" and not drive.stiffness else 300.0
        # The numbers and the exponent are measured.
        return 2e-4 + 5e-4 * more * (interface.size / 1024) ** 1.5

    def supports(self, problem: Problem) -> list[str]:
        """Return the reasons why the method cannot solve a problem, or an empty list.

        >>> from types import SimpleNamespace
        >>> import stiction as st
        >>> def reasons(method, is_plane, **friction):
        ...     law = st.LinearWeakening(1.0)
        ...     if friction:
        ...         law = st.PiecewiseWeakening(1.0, slip=[0.3, 1.0], **friction)
        ...     interface = SimpleNamespace(is_plane=is_plane)
        ...     problem = SimpleNamespace(friction=law, interface=interface, specimen=None)
        ...     return [reason.split(":")[0] for reason in method.supports(problem)]
        >>> tight, sensitive = Equilibrium(tolerance=1e-8), Equilibrium(sensitivity=True)
        >>> for is_plane in (False, True):
        ...     print(reasons(tight, is_plane), reasons(sensitive, is_plane))
        ['tolerance'] []
        [] ['sensitivity']
        >>> [reasons(Equilibrium(), is_plane, strength=[1.0, 0.0]) for is_plane in (False, True)]
        [[], ['friction.strength']]
        """
        reasons = refused(problem)
        if problem.friction.plateau and problem.interface.is_plane:
            reasons.append(
                "friction.strength: begins with a plateau, which is followed on lines only. Let it"
                " fall slightly from zero slip on"
            )
        if self.sensitivity and problem.interface.is_plane:
            reasons.append(
                "sensitivity: applies to lines only. Leave it out, and take differences of st.onset"
                " with the strength of a few nodes raised"
            )
        if not problem.interface.is_plane and self.tolerance != type(self)().tolerance:
            reasons.append(
                "tolerance: applies to planes only. Lines are solved to round-off. Leave it out"
            )
        return reasons

    def bounded_by_strength(self, problem: Problem, event: str) -> tuple[bool, bool]:
        """Return whether strength bounds the stress of an event from below and from above.

        The bound from below holds because no node slips at a load below
        min (tau_p - tau_i)/p. With a machine, slip lowers the mean
        stress, but `critical_stress` is the largest stress on the way.
        The bound from above holds because stress is at most strength at
        every node. With a machine, the first instability need not
        happen, and has no bound. If the interface ends, slip lowers the
        mean stress of the part that can break. On a slider, the
        pressure changes the strength.

        >>> from types import SimpleNamespace
        >>> def bounded(event, is_held=False, specimen=None, has_machine=False):
        ...     interface = SimpleNamespace(is_held=is_held)
        ...     parts = {"specimen": specimen, "has_machine": has_machine}
        ...     problem = SimpleNamespace(interface=interface, **parts)
        ...     return Equilibrium().bounded_by_strength(problem, event)
        >>> first = "first_instability"
        >>> bounded(first)
        (True, True)
        >>> bounded(first, has_machine=True)
        (False, False)
        >>> bounded("static_friction", has_machine=True)
        (True, True)
        >>> bounded(first, is_held=True)
        (False, False)
        >>> bounded(first, specimen=Slider.__new__(Slider))
        (False, False)
        """
        if problem.interface.is_held or isinstance(problem.specimen, Slider):
            return False, False
        # A stiff machine lets the interface slide without an
        # instability, which is then NaN.
        certain = not (problem.has_machine and event == "first_instability")
        return certain, certain

    def variables(self, problem: Problem) -> dict[str, Variable]:
        """Return the variables in the solver's results.

        >>> from types import SimpleNamespace
        >>> from stiction.problem.interface import Interface
        >>> def names(method, interface, specimen=None):
        ...     problem = SimpleNamespace(interface=interface, specimen=specimen)
        ...     return method.variables(problem)
        >>> line, plane = Interface(0.8, 8), Interface((0.8, 2.0), (8, 10))
        >>> on_line, on_plane = (names(Equilibrium(), interface) for interface in (line, plane))
        >>> sorted(on_line.keys() - on_plane)
        ['critical_patch_length']
        >>> [name for name, variable in on_plane.items() if "direction" in variable.dims]
        ['critical_position', 'sliding_position', 'critical_patch_extent']
        >>> sorted(names(Equilibrium(slip=True), line).keys() - on_line)
        ['slip']
        >>> sorted(names(Equilibrium(), line, Slider.__new__(Slider)).keys() - on_line)
        ['open_fraction']
        >>> with_events = names(Equilibrium(events=2), line)
        >>> set(of_samples(event_variables(line))) == with_events.keys() - on_line
        True
        >>> with_events["event_load"].dims
        ('sample', 'event')
        >>> pushed = names(Equilibrium(events=2), line, Slider.__new__(Slider))
        >>> sorted(with_events.keys() - pushed)
        ['event_energy_stress_drop', 'event_fracture_energy']
        """
        interface = problem.interface
        # On planes, positions and extents have
        # a component along each direction.
        variables = onset_variables(interface) | VARIABLES
        variables |= OF_PLANES if interface.is_plane else OF_LINES
        slides = isinstance(problem.specimen, Slider)
        variables |= OF_SLIDERS if slides else {}
        for name in {"sliding_position", "critical_patch_extent"} & variables.keys():
            variables[name] = position(interface, variables[name])
        if self.events:
            of_events = push_variables if slides else event_variables
            variables |= of_samples(of_events(interface))
        for name, variable in ON_NODES.items():
            if getattr(self, name):
                variables[name] = along(interface, variable)
        return variables

    def prepare(self, problem: Problem) -> Callable[[Sample], dict[str, NDArray[Any]]]:
        """Return a solver for the samples of a problem."""
        if isinstance(problem.specimen, Slider):
            return SliderSolver(problem, self)
        return OnsetSolver(problem, self, make_search(problem, self.tolerance))
