"""The physical problem: two solids, an interface, a friction law and a load."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Collection
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import model_validator

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import (
    Listed,
    Mode,
    OptionalProfile,
    Positive,
    Profile,
    describe,
    is_unplaced,
    model,
)
from stiction.base.units import Doubt, doubt_units
from stiction.elasticity.protocol import HalfSpaces
from stiction.problem.checks import check_resolution, warn_if_short
from stiction.problem.friction import Friction, contradictions
from stiction.problem.interface import Interface
from stiction.problem.profiles import at_nodes, placed_sample
from stiction.problem.sample import GIVE_PRESSURE, Sample, pressing_of, turned
from stiction.problem.solid import Solid
from stiction.problem.specimen import UNFIT_FOR_SLIDER, Blocks, Slider, Specimen

if TYPE_CHECKING:
    from stiction.elasticity.driven import Driven
    from stiction.elasticity.rig import Rig

MIN_MACHINE_RATIO = 1e-4
"""Machine stiffness over block stiffness below which the unit is
probably wrong."""
MIN_HEIGHT_RATIO, MAX_HEIGHT_RATIO = 0.025, 10.0
"""Height of blocks over length between which the response takes seconds
and less than 1 GB."""
NO_AREA = (
    "a force needs the area of the interface: give the thickness of the specimen, or"
    " interface.width of a line (m)"
)
"""Advice for a force if the area is unknown."""


@model
class Load(Listed):
    """Shear stress tau_i(x) + tau_0 p(x) on an interface without slip. The load factor tau_0 rises.

    Parameters
    ----------
    profile : float or (nodes,) array
        p, dimensionless, positive. Divide it by its mean: tau_0 is then
        the mean stress.
    initial_stress : float or (nodes,) array
        tau_i, Pa, below the peak strength everywhere. `Rupture` also
        accepts nodes with a higher value, which break at once.
    normal_pressure : float or (nodes,) array, optional
        Pa, positive on average. Every onset then has a
        `friction_coefficient`.
    pressing_force : float, optional
        Force, N, positive, in place of `normal_pressure`. The force
        over the interface area, which must be known, is the
        uniform pressure, or the mean pressure between glued plates.

    Examples
    --------
    >>> import numpy as np
    >>> import stiction as st
    >>> x = st.Interface(length=0.1, nodes=512).x
    >>> profile = 1.0 + 2.0 * np.exp(-x / 0.01)
    >>> load = st.Load(profile=profile / profile.mean(), normal_pressure=5e6)
    """

    profile: Profile = 1.0  # type: ignore[assignment]  # converted
    initial_stress: Profile = 0.0  # type: ignore[assignment]
    normal_pressure: OptionalProfile = None  # type: ignore[assignment]
    pressing_force: Positive | None = None

    @model_validator(mode="after")
    def _consistent(self) -> Load:
        r"""Refuse a profile or a pressure with the wrong sign, and two normal forces.

        >>> def refused(**given):
        ...     try:
        ...         Load(**given)
        ...     except InputError as error:
        ...         print(*[text.partition(": ")[2][:65] for text in error.problems], sep="\n")
        >>> refused(profile=[0.1, 3.0], normal_pressure=[3.0, -2.0])
        >>> refused(profile=[0.0, 3.0], normal_pressure=[3.0, -3.0], pressing_force=2.0)
        profile must be positive everywhere, got 0
        normal_pressure must be positive on average, got 0
        pressing_force: give either normal_pressure (Pa) or pressing_forc
        """
        profile, pressure, problems = self.profile, self.normal_pressure, []
        if not is_unplaced(profile) and np.min(profile) <= 0.0:
            problems.append(f"profile must be positive everywhere, got {np.min(profile):g}")
        if not (pressure is None or is_unplaced(pressure) or np.mean(pressure) > 0.0):
            mean = np.mean(pressure)
            problems.append(f"normal_pressure must be positive on average, got {mean:g}")
        if pressure is not None and self.pressing_force is not None:
            problems.append(
                "pressing_force: give either normal_pressure (Pa) or pressing_force (N), not both"
            )
        if problems:
            raise InputError(problems)
        return self


@model
class Problem(Listed):
    """The deterministic part of a model: solid, interface, friction law and load.

    Parameters
    ----------
    solid : Solid
    interface : Interface
    friction : LinearWeakening, ExponentialWeakening or PiecewiseWeakening
    load : Load, optional
        By default a uniform load without initial stress.
    mode : {"II", "III"}
        In-plane or anti-plane shear. A plane is in-plane along x and
        anti-plane along y.
    specimen : Blocks or Slider, optional
        Finite bodies rather than half-spaces. Their drive determines the
        load profile. The interface ends with the blocks or the slider
        (`interface.ends` is "free"). tau_0 is the mean stress that the
        drive would cause without slip. `solid` is a slider's material.

    Raises
    ------
    InputError
        The message lists every invalid argument. At least four nodes
        must span the nucleation length.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.Problem(
    ...     solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0),
    ...     interface=st.Interface(length=0.1, nodes=1024),
    ...     friction=st.LinearWeakening(weakening_rate=0.5e12),
    ... )
    >>> round(problem.nucleation_length * 1e3, 3)  # mm
    3.456
    """

    solid: Solid
    interface: Interface
    friction: Friction
    load: Load = Load()
    mode: Mode = "II"
    specimen: Specimen | None = None
    _shown = "area", "normal_pressure", "nucleation_length", "sample"

    @model_validator(mode="after")
    def _consistent(self) -> Problem:
        problems = self._of_specimen()
        problems += self._place_profiles()
        if self.interface.is_plane and self.solid.plane != "strain":
            problems.append(
                "solid.plane: must be 'strain' for a plane interface, whose solids are not thin"
            )
        if self.interface.is_plane and self.mode != "II":
            problems.append(f"mode: must be 'II' for a plane, got {self.mode!r}")
        if self.area is None and self.load.pressing_force is not None:
            problems.append(f"load.pressing_force: {NO_AREA}, or load.normal_pressure in Pa")
        problems += [f"friction: {text}" for text in contradictions(self.friction)]
        if problems:
            raise InputError(problems)
        if isinstance(self.specimen, Blocks):
            self._check_drive()
        scale, rates = self.friction.scale or ("", 0.0)
        if scale == "weakening_rate":
            steepening = self.friction.steepening
            check_resolution(self, float(np.max(rates)) * steepening)
            warn_if_short(self, float(np.median(rates)) * steepening)
        return self

    def _of_specimen(self) -> list[str]:
        """Let the interface end with the specimen, and return messages about unsuitable inputs.

        >>> from stiction.problem.friction import LinearWeakening
        >>> solid, law = Solid(1e9, 0.2, 1200.0), LinearWeakening(critical_slip=1.0)
        >>> def problems(interface=Interface(8.0, 16), mode="II", load=Load(), **given):
        ...     part = Blocks(**given) if given else None
        ...     try:
        ...         return Problem(solid, interface, law, load, mode, part).interface.ends
        ...     except InputError as error:
        ...         return [text[9:42] for text in error.problems]
        >>> problems(), problems(height=1.0), problems(Interface(8.0, 16, ends="free"))
        (None, 'free', ['interface.ends: free ends need a '])
        >>> problems(height=0.99), problems(Interface(50.0, 100), height=1.0)
        (['specimen.height: must be at least'], ['specimen.height: must be 0.025 to'])
        >>> problems(Interface(50.0, 100), height=1.25), problems(height=81.0, mode="III")
        ('free', 'free')
        >>> problems(height=2.0, load=Load(normal_pressure=[1e6] * 16))
        'free'
        >>> problems(height=2.0, pressing="glued", load=Load(normal_pressure=[1e6] * 16))
        ['load.normal_pressure: must be a m']
        """
        interface, specimen = self.interface, self.specimen
        pressure: Any = self.load.normal_pressure
        if specimen is None:
            text = "interface.ends: free ends need a specimen. Give specimen=st.Blocks(...)"
            return [text] * interface.is_free
        if interface.is_plane:
            return ["specimen: blocks meet on a line. Give one length and number of nodes"]
        if interface.ends == "periodic":
            return ["interface.ends: the ends of a specimen are free. Leave it out"]
        object.__setattr__(self, "interface", dataclasses.replace(interface, ends="free"))
        problems = []
        if interface.width is not None:
            problems.append("interface.width: give the thickness of a specimen instead")
        if not (isinstance(self.load.profile, float) and self.load.profile == 1.0):
            problems.append("load.profile: comes from the drive of a specimen. Leave it out")
        if isinstance(specimen, Slider):
            return problems + self._of_slider(specimen)
        if specimen.pressing == "glued" and np.shape(pressure):
            problems.append("load.normal_pressure: must be a mean, because blocks are glued")
        if specimen.height < 2.0 * interface.spacing:
            problems.append(
                f"specimen.height: must be at least two spacings of {interface.spacing:.3g} m"
            )
        high = specimen.height / interface.measure
        if self.mode == "II" and not MIN_HEIGHT_RATIO <= high <= MAX_HEIGHT_RATIO:
            problems.append(
                f"specimen.height: must be {MIN_HEIGHT_RATIO:g} to {MAX_HEIGHT_RATIO:g} times the"
                f" length in mode II, got {high:.3g} times. Check the units, or shorten flat blocks"
            )
        return problems

    def _of_slider(self, slider: Slider) -> list[str]:
        """Return messages about inputs that do not fit a slider.

        >>> from types import SimpleNamespace
        >>> from stiction.problem.friction import LinearWeakening
        >>> from stiction.problem.specimen import Base, TopShear
        >>> slider = Slider(height=0.1, base=Base(height=0.1), drive=TopShear())
        >>> solid = Solid(1e9, 0.2, 1e3)
        >>> part = SimpleNamespace(interface=Interface(0.25, 16), solid=solid, mode="II")
        >>> def messages(load, **given):
        ...     part.load, part.friction = Load(**load), LinearWeakening(**given)
        ...     return [text[:29] for text in Problem._of_slider(part, slider)]
        >>> messages({"pressing_force": 5.0}, residual_ratio=0.5)
        []
        >>> messages({"normal_pressure": 5.0}, residual_strength=2.0)
        ['friction.residual_strength: a']
        >>> messages({"initial_stress": 3.0})
        ['load.initial_stress: follows ', 'load: a slider needs a normal']
        >>> messages({"normal_pressure": [5.0, 6.0]})
        ['load.normal_pressure: follows']
        """
        load: Any = self.load
        interface = self.interface
        given = {
            "friction.residual_strength": np.any(self.friction.residual_strength),
            "interface.extent": interface.is_held,
            "load.initial_stress": np.any(load.initial_stress),
            "load.normal_pressure": np.ndim(load.normal_pressure),
        }
        problems = slider.misfits(interface.measure, interface.spacing, self.solid, self.mode)
        problems += [
            f"{key}: {UNFIT_FOR_SLIDER[key.split('.')[1]]}"
            for key, unfit in given.items()
            if unfit
        ]
        if load.normal_pressure is None and load.pressing_force is None:
            problems.append(f"load: a slider needs a normal force. {GIVE_PRESSURE}")
        return problems

    def _check_drive(self) -> None:
        """Refuse blocks that open, and doubt a machine whose stiffness has no effect.

        The blocks have 0.5 x 0.5 m x 4 GPa = 1 GN/m:

        >>> import warnings
        >>> from types import SimpleNamespace
        >>> from stiction.problem.specimen import Platen
        >>> def check(stiffness, pressure=(1.0, 2.0)):
        ...     drive = Platen(stiffness=stiffness)
        ...     part = SimpleNamespace(specimen=Blocks(height=1.0, thickness=0.5, drive=drive))
        ...     part.blocks = SimpleNamespace(pressure=np.array(pressure), drive_stiffness=4e9)
        ...     part.interface = Interface(8.0, 8)
        ...     with warnings.catch_warnings(record=True) as told:
        ...         warnings.simplefilter("always")
        ...         Problem._check_drive(part)
        ...     return [str(warning.message)[:44] for warning in told]
        >>> check(1.1e5), check(0.0), check(9e4)
        ([], [], ['specimen.drive.stiffness: 9e+04 N/m hardly d'])
        >>> check(0.0, (1.0, -0.5))  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: ... opens the interface at x = 1 m, ... -0.5 times ...
        """
        pressure = self.blocks.pressure
        if not pressure.min() > 0.0:
            place = self.interface.describe_node(int(np.argmin(pressure)))
            raise InputError(
                f"specimen.pressing: opens the interface at {place}, where the pressure is"
                f" {pressure.min():.3g} times its mean. Pass 'frictionless'"
            )
        assert self.specimen is not None  # else there is no drive
        machine, depth = self.specimen.drive.stiffness, self.specimen.thickness or 1.0
        blocks = 0.5 * depth * self.blocks.drive_stiffness  # of both, in series
        if machine > 0.0:
            text = (
                f"specimen.drive.stiffness: {machine:.3g} N/m hardly differs from 0 (dead load),"
                f" because the blocks have {blocks:.3g} N/m. Check its unit (N/m)"
            )
            doubt_units([Doubt(text, machine / blocks, (MIN_MACHINE_RATIO, math.inf))])

    def _place_profiles(self) -> list[str]:
        r"""Put profiles that have coordinates on the nodes, and return errors of profiles.

        >>> import xarray as xr
        >>> from stiction.problem.friction import LinearWeakening
        >>> reversed_x = xr.DataArray([7.0, *[3.0] * 7], {"x": np.arange(8.0)[::-1]}, ["x"])
        >>> def placed(**given):
        ...     solid, law = Solid(1e9, 0.2, 1200.0), LinearWeakening(critical_slip=1.0)
        ...     try:
        ...         return Problem(solid, Interface(8.0, 8), law, Load(**given)).load
        ...     except InputError as error:
        ...         print(*[text[9:73] for text in error.problems], sep="\n")
        >>> placed(profile=reversed_x, initial_stress=[1.0] * 8).profile.tolist()
        [3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0, 7.0]
        >>> placed(profile=[1.0] * 7, initial_stress=reversed_x[:4])
        load.profile: must have the shape (8,) of the nodes, got an arra
        load.initial_stress: values are missing (NaN) at 4 of 8 nodes, t
        """
        problems: list[str] = []
        shape = self.interface.shape
        for part in ("friction", "load"):
            owner, placed = getattr(self, part), {}
            for name, value in vars(owner).items():
                if is_unplaced(value):
                    try:
                        value = at_nodes(f"{part}.{name}", value, self.interface)
                    except InputError as error:
                        problems += error.problems
                    placed[name] = value
                if isinstance(value, np.ndarray) and value.shape not in ((), shape):
                    problems.append(
                        f"{part}.{name}: must have the shape {shape} of the nodes, got"
                        f" {describe(value)}{turned(value.shape, shape)}"
                    )
            if placed and not problems:  # frozen for others; validation is not over yet
                object.__setattr__(self, part, dataclasses.replace(owner, **placed))
        return problems

    @property
    def blocks(self) -> Driven:
        """Stiffness and profiles of the specimen, which must be given.

        >>> from types import SimpleNamespace
        >>> part = SimpleNamespace(specimen=Blocks(height=1.0))
        >>> part.blocks = SimpleNamespace(shear=[2.0])
        >>> Problem.load_profile.func(part)
        [2.0]
        >>> part = SimpleNamespace(specimen=None)
        >>> Problem.blocks.fget(part)
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: problem.specimen: must be Blocks here
        """
        if not isinstance(self.specimen, Blocks):
            raise InputError("problem.specimen: must be Blocks here")
        interface = self.interface
        return self.specimen.driven(interface.measure, interface.size, self.solid, self.mode)

    @property
    def rig(self) -> Rig:
        """Stiffness and loads of the slider, which must be given.

        >>> from types import SimpleNamespace
        >>> from stiction.problem.specimen import Base, TopShear
        >>> slider = Slider(height=0.1, base=Base(height=0.1), drive=TopShear())
        >>> rig = SimpleNamespace(T=np.array([0.25, 0.75, 9.0]))
        >>> part = SimpleNamespace(specimen=slider, rig=rig, interface=SimpleNamespace(size=2))
        >>> Problem.load_profile.func(part).tolist()
        [0.5, 1.5]
        >>> part.solid = Solid(1e9, 0.2, 1e3)
        >>> f"{Problem.effective_modulus.func(part):.6g}"
        '1.25e+09'
        >>> Problem.rig.fget(SimpleNamespace(specimen=None))
        Traceback (most recent call last):
        ...
        stiction.base.errors.InputError: problem.specimen: must be a Slider here
        """
        if not isinstance(self.specimen, Slider):
            raise InputError("problem.specimen: must be a Slider here")
        return self.specimen.rig(self.interface.measure, self.interface.size, self.solid)

    @property
    def has_machine(self) -> bool:
        """Whether an elastic machine, which loses force by slip, drives the specimen.

        >>> from types import SimpleNamespace
        >>> from stiction.problem.specimen import Platen
        >>> machines = [Platen(stiffness=value) for value in (0.0, 3e6)]
        >>> blocks = [Blocks(height=1.0, thickness=0.5, drive=drive) for drive in machines]
        >>> [Problem.has_machine.fget(SimpleNamespace(specimen=part)) for part in (None, *blocks)]
        [False, False, True]
        """
        return self.specimen is not None and self.specimen.drive.stiffness > 0.0

    def released_stress(self, slip: Array) -> Array:
        """Return the stress K d that a slip (*shape), m, takes off the interface, Pa.

        A slip cos 2x of half-spaces releases (G*/2) 2 cos 2x, and G* = 1.25 GPa:

        >>> from stiction.problem.friction import LinearWeakening
        >>> line, law = Interface(2.0 * np.pi, 16), LinearWeakening(critical_slip=1.0)
        >>> problem = Problem(Solid(1e9, 0.2, 1200.0), line, law)
        >>> slip = 1e-9 * np.cos(2.0 * line.x)
        >>> exact = 1.25 * np.cos(2.0 * line.x)
        >>> float(np.abs(problem.released_stress(slip) - exact).max()) < 1e-9
        True
        """
        if self.specimen is not None:
            return np.asarray(self.blocks.stiffness @ slip)
        symbol = self.half_spaces.symbol(self.interface.shape)
        return self.interface.inverse_transform(symbol * self.interface.transform(slip))

    def relief(self, slip: Array) -> float:
        """Return the decrease of the mean stress, Pa, by a slip (m, flattened).

        A machine with finite stiffness loses force when the interface
        slips, and nodes beyond the extent take over stress. The mean
        covers the nodes that can break, and is divided by the mean of
        their load profile.

        The mean of the released stress over the nodes that can break, divided
        by the mean of their load profile:

        >>> from stiction.problem.friction import LinearWeakening
        >>> solid, law = Solid(1e9, 0.2, 1200.0), LinearWeakening(critical_slip=1.0)
        >>> load, slip = Load(profile=np.linspace(1.0, 3.0, 16)), np.linspace(0.0, 2e-6, 16) ** 2
        >>> problem = Problem(solid, Interface(8.0, 16, extent=(1.0, 4.0)), law, load)
        >>> inside = problem.interface.breakable
        >>> means = problem.released_stress(slip)[inside].mean(), load.profile[inside].mean()
        >>> round(float(problem.relief(slip) / (means[0] / means[1])), 9)
        1.0
        >>> Problem(solid, Interface(8.0, 16), law, load).relief(slip)
        0.0
        """
        if not self.interface.is_held:
            return 0.0 if self.specimen is None else float(self.blocks.mean_relief(slip))
        return float(self.relief_of_nodes @ slip)

    @cached_property
    def relief_of_nodes(self) -> Array:
        """Relief (nodes,), Pa/m, by unit slip at each node, for an interface that ends.

        K is symmetric, so the mean of K d over the nodes
        that can break is <K b, d> over their number,
        where b is 1 at these nodes and 0 beyond.
        """
        interface, can_break = self.interface, self.interface.breakable
        profile = np.broadcast_to(self.load_profile, interface.shape)[can_break].sum()
        return self.released_stress(1.0 * can_break).reshape(-1) / profile

    @cached_property
    def half_spaces(self) -> HalfSpaces:
        """The solids as half-spaces, which give K(k) and nucleation lengths."""
        lengths = self.interface.lengths
        moduli = (self.effective_modulus, self.solid.shear_modulus)
        return HalfSpaces(lengths, moduli[: len(lengths)])

    @cached_property
    def area(self) -> float | None:
        """Area that can break, m², if the width or the thickness of the specimen is known."""
        interface, specimen = self.interface, self.specimen
        depth = interface.width if specimen is None else specimen.thickness
        if interface.is_plane:
            return interface.breakable_measure
        return None if depth is None else interface.breakable_measure * depth

    @property
    def whole_area(self) -> float | None:
        """Area of the whole interface, m², also beyond an extent, if `area` is known.

        Four of eight nodes can break. A force presses the free surfaces of an
        extent, and the whole of two blocks:

        >>> from stiction.problem.friction import LinearWeakening
        >>> solid, law = Solid(1e9, 0.2, 1200.0), LinearWeakening(critical_slip=1.0)
        >>> load, line = Load(pressing_force=6.0), Interface(8.0, 8, width=0.5, extent=(2.0, 5.0))
        >>> problem = Problem(solid, line, law, load)
        >>> [float(number) for number in (problem.area, problem.whole_area, problem.given_pressure)]
        [2.0, 4.0, 3.0]
        >>> line, blocks = Interface(8.0, 8, extent=(2.0, 5.0)), Blocks(height=4.0, thickness=0.5)
        >>> problem = Problem(solid, line, law, load, "II", blocks)
        >>> [float(number) for number in (problem.area, problem.whole_area, problem.given_pressure)]
        [1.5, 4.0, 1.5]
        >>> problem = Problem(solid, Interface((8.0, 16.0), (8, 8)), law, Load(normal_pressure=7.0))
        >>> problem.area, problem.given_pressure, problem.normal_pressure, problem.load_profile
        (128.0, 7.0, 7.0, 1.0)
        >>> problem = Problem(solid, Interface(8.0, 8), law)
        >>> unknown = problem.area, problem.whole_area, problem.given_pressure
        >>> {*unknown, problem.normal_pressure} == {None}
        True
        """
        interface = self.interface
        return self.area and self.area * interface.measure / interface.breakable_measure

    @cached_property
    def given_pressure(self) -> Any:
        """Given normal pressure, or force over area, Pa: a number or an array, if any.

        Blocks are pressed together over the whole interface, also beyond an extent.
        """
        force = self.load.pressing_force
        area = self.area if self.specimen is None else self.whole_area
        if force is None or area is None:
            return self.load.normal_pressure
        return force / area

    @cached_property
    def normal_pressure(self) -> Any:
        """Normal pressure, Pa: a number or an array at the nodes, if any."""
        pressure = self.given_pressure
        return pressure if pressure is None else pressure * pressing_of(self)

    @cached_property
    def load_profile(self) -> Any:
        """Load profile p: a number, or an array at the nodes, (*shape)."""
        if isinstance(self.specimen, Slider):
            return self.rig.T[: self.interface.size] * self.interface.size
        if self.specimen is not None:
            return self.blocks.shear
        return self.load.profile

    @cached_property
    def effective_modulus(self) -> float:
        """Static modulus G*, Pa, for the plane state and the mode.

        On a plane, G* along x.
        """
        if isinstance(self.specimen, Slider):
            return self.specimen.effective_modulus(self.solid)
        return self.solid.effective_modulus(self.mode)

    @property
    def nucleation_length(self) -> float:
        """h_n = 2 lambda_0 G*/W, m (Uenishi and Rice, 2003), for a uniform weakening rate.

        If the law steepens, W is the steepest rate. An `InputError`
        says that the rate varies along the interface or follows from
        other parameters.

        A law that falls later with 3 times its first slope has a third of the
        length:

        >>> from stiction.problem.friction import LinearWeakening, PiecewiseWeakening
        >>> steep = PiecewiseWeakening(slip=[0.5, 1.0], strength=[0.75, 0.0], weakening_rate=1e9)
        >>> laws = LinearWeakening(weakening_rate=1e9), steep
        >>> solid, line = Solid(1e9, 0.2, 1200.0), Interface(9.0, 128)
        >>> [round(Problem(solid, line, law).nucleation_length, 3) for law in laws]
        [1.447, 0.482]
        """
        if self.friction.uniform_weakening_rate is None:
            raise InputError(
                "friction.weakening_rate: must be uniform for a nucleation length, about"
                " (strength - residual_strength)/critical_slip. st.Equilibrium() works without it"
            )
        steepest = self.friction.uniform_weakening_rate * self.friction.steepening
        return self.nucleation_lengths(steepest)[0]

    def nucleation_lengths(self, weakening_rate: float) -> tuple[float, ...]:
        """Return h_n, m, in each direction, for a uniform weakening rate (Pa/m).

        If the law steepens, give its steepest rate, such as
        `Sample.steepest_weakening_rate`. On a plane, the length along x
        belongs to mode II and the length along y to mode III.

        >>> from stiction.problem.friction import LinearWeakening
        >>> law = LinearWeakening(critical_slip=1.0)
        >>> line, plane = Interface(8.0, 8), Interface((8.0, 16.0), (8, 8))
        >>> for interface, mode in ((line, "III"), (plane, "II")):
        ...     problem = Problem(Solid(1e9, 0.2, 1200.0), interface, law, mode=mode)
        ...     print([round(length, 4) for length in problem.nucleation_lengths(2e9)])
        [0.5789]
        [0.7236, 0.5789]
        """
        if not weakening_rate > 0.0:
            given = describe(weakening_rate)
            raise InputError(f"weakening_rate: must be a positive number, got {given}")
        return self.half_spaces.nucleation_lengths(weakening_rate)

    def sample(self, profiles: Any, *, accept: Collection[str] = ()) -> Sample:
        """Return validated profiles of samples. Profiles that are not given come from the problem.

        Parameters
        ----------
        profiles : array, mapping of arrays, xarray.Dataset or Sample
            Peak strength tau_p (Pa) with shape (samples, *shape) or
            (*shape), or profiles by name: 'strength' and other names in
            `PROFILES`. Give each profile here or in the problem, not in
            both. Except for the strength, a profile may be a number. A
            'friction_coefficient', or a DataArray with the unit 1, is
            multiplied by the pressure.
        accept : collection of {"overstress"}
            "overstress" allows an initial stress above the strength.

        An `InputError` lists every invalid name, shape and value. An
        `AccuracyWarning` gives the fraction of nodes without weakening.
        """
        return placed_sample(self, profiles, accept)


def stress_of(problem: Problem, name: str, force: float) -> float:
    """Return force (N) over area that can break, Pa.

    An error message begins with `name`.

    >>> from types import SimpleNamespace
    >>> line = SimpleNamespace(is_held=False)
    >>> stress_of(SimpleNamespace(area=0.5, specimen=None, interface=line), "force", 3.0)
    6.0
    >>> stress_of(SimpleNamespace(area=None), "force", 3.0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: force: a force needs the area of the interface: ...
    """
    if problem.area is None:
        raise InputError(f"{name}: {NO_AREA}")
    warn_of_weld(problem, name)
    return force / problem.area


def warn_of_weld(problem: Problem, name: str) -> None:
    """Warn that the machine of a specimen carries more than the force on the part that breaks.

    >>> import warnings
    >>> from types import SimpleNamespace
    >>> lines = Interface(8.0, 8, extent=(2.0, 4.0)), Interface(8.0, 8)
    >>> with warnings.catch_warnings(record=True) as told:
    ...     warnings.simplefilter("always")
    ...     for interface, specimen in zip((*lines, lines[0]), ("blocks", "blocks", None)):
    ...         warn_of_weld(SimpleNamespace(interface=interface, specimen=specimen), "force")
    >>> [str(warning.message)[:90] for warning in told]
    ['force: is compared with the shear force on the part that can break, 37.5 % of the interfac']
    """
    if problem.specimen is not None and problem.interface.is_held:
        percent = 100.0 * problem.interface.breakable_measure / problem.interface.measure
        warn_accuracy(
            f"{name}: is compared with the shear force on the part that can break, {percent:.3g} %"
            " of the interface. The machine also carries the force on the part in one piece"
        )


def refuse_specimen(problem: Problem, what: str, instead: str) -> None:
    """Raise an `InputError` with advice, `instead`, if the problem has a specimen.

    >>> from types import SimpleNamespace
    >>> refuse_specimen(SimpleNamespace(specimen=None), "rupture", "Use onset")
    >>> refuse_specimen(SimpleNamespace(specimen="blocks"), "rupture", "Use it")
    Traceback (most recent call last):
    ...
    stiction.base.errors.InputError: problem.specimen: rupture applies to half-spaces only. Use it
    """
    if problem.specimen is not None:
        raise InputError(f"problem.specimen: {what} applies to half-spaces only. {instead}")


def refusals(problem: Problem, method: Any) -> list[str]:
    """Return the reasons why a method does not accept a problem, or an empty list.

    >>> from types import SimpleNamespace
    >>> def method(reasons):
    ...     return SimpleNamespace(label="onset", supports=lambda problem: reasons)
    >>> refusals("problem", method(["no law", "no load"])), refusals("problem", method([]))
    (['method: the onset cannot be used: no law', 'method: the onset cannot be used: no load'], [])
    >>> refusals("problem", method(True))
    ['method: supports must return a list of reasons, got True']
    """
    reasons = method.supports(problem)
    if not isinstance(reasons, list):
        return [f"method: supports must return a list of reasons, got {describe(reasons)}"]
    return [f"method: the {method.label} cannot be used: {reason}" for reason in reasons]
