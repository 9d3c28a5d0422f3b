"""Specimens: two equal blocks or a slider on a base, and how they are driven and pressed."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, model_validator

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.base.kinds import Kinds, OneOf
from stiction.base.model import Listed, Mode, NotNegative, Positive, Real, as_number, model
from stiction.problem.solid import Solid

if TYPE_CHECKING:
    from stiction.elasticity.blocks import Pushes
    from stiction.elasticity.driven import Driven
    from stiction.elasticity.rig import Rig


def _stiffness(value: Any) -> float:
    """Return a stiffness, N/m, which may be the word inf.

    >>> _stiffness("inf"), _stiffness(3)
    (inf, 3.0)
    """
    return math.inf if value == "inf" else as_number(value)


def _written(value: float) -> Any:
    """Return a number, or 'inf' because JSON has no infinite number.

    >>> _written(math.inf), _written(3.0), _written(-math.inf)
    ('inf', 3.0, -inf)
    """
    return "inf" if value == math.inf else value


Stiffness = Annotated[
    float, BeforeValidator(_stiffness), PlainSerializer(_written), Field(ge=0.0)
]
Quality = Annotated[Stiffness, Field(ge=0.01)]
MAX_SIZE_RATIO = 20.0
"""Sizes of a slider and its base over its length above which their unit
is probably wrong."""
MIN_PRESSURE = 1e-6
"""Smallest local pressure over its mean with which a critical slip
gives a weakening rate."""
MAX_POSITIVE = 1e-2
"""Largest positive entry of K_uu + mu Q K_wu of the cells, over its
diagonal, for which a path is defined. It counts how much the slip of a
cell loads another cell forwards."""


_NEEDS_COEFFICIENTS = (
    "a slider needs friction coefficients instead of stresses. Give a DataArray with the unit 1, a"
    " random field of coefficients, or friction.residual_ratio"
)
UNFIT_FOR_SLIDER = {
    "strength": _NEEDS_COEFFICIENTS,
    "residual_strength": _NEEDS_COEFFICIENTS,
    "initial_stress": "follows from the pressing of a slider. Leave it out",
    "normal_pressure": "follows from the rig of a slider. Give load.pressing_force (N)",
    "extent": "the whole slider can slip. Leave it out",
}
"""Advice about inputs that a slider does not accept, by the last part
of the key."""


@model(kw_only=True)
class Platen(Listed):
    """A rigid platen that is glued to the top face and moves along the interface only.

    Parameters
    ----------
    stiffness : float
        Machine stiffness between the grips of the two blocks,
        N/m. 0 is a dead load (the force is controlled).
        ``float("inf")`` is a rigid machine (the travel is controlled).
    mass : float
        Mass of the platen and the grip that move with a block, kg. The
        mass matters only in ruptures with inertia.
    """

    stiffness: Stiffness = 0.0
    mass: NotNegative = 0.0
    type: Literal["platen"] = "platen"


@model(kw_only=True)
class Pusher(Listed):
    """A uniform traction on a side of a slider, or on one or both sides of two blocks.

    The top faces of pushed blocks lie on rollers.

    Parameters
    ----------
    height : float
        Height of the pusher's middle above the interface, m. The
        pusher may be anywhere on the side, up to the top and down to
        the interface.
    width : float
        Extent of the pusher along the side, m.
    side : {"left", "right", "both"}
        The trailing side, from which slip is driven. Two pushers (of
        blocks only) each apply half the force. This is the shear of a lap
        joint. Bending, and the change of pressure, are not modelled.
    stiffness : float
        Machine stiffness between the grips of the two blocks, or
        behind the slider, N/m (see `Platen`).
    mass : float
        Mass, kg, that moves with the pushers of a block (see `Platen`).
    """

    height: Positive
    width: Positive
    side: Literal["left", "right", "both"] = "left"
    stiffness: Stiffness = 0.0
    mass: NotNegative = 0.0
    type: Literal["pusher"] = "pusher"


@model(kw_only=True)
class TopShear(Listed):
    """A uniform shear traction on the top face of a slider.

    Parameters
    ----------
    stiffness : float
        Stiffness of the machine, N/m, which carries the mean
        displacement of the top face (see `Platen`).
    """

    stiffness: Stiffness = 0.0
    type: Literal["top_shear"] = "top_shear"


def _kinds(family: str, **names: str) -> Kinds:
    return Kinds(family, {key: f"problem.specimen:{name}" for key, name in names.items()})


DRIVES = _kinds("drives", platen="Platen", pusher="Pusher")
SLIDER_DRIVES = _kinds("drives of sliders", pusher="Pusher", top_shear="TopShear")


def _only(*kinds: type) -> Callable[[Any], Any]:
    """Return a reader that accepts members of some classes only.

    >>> reader, drive = _only(Pusher, TopShear), TopShear()
    >>> reader(drive) is drive, reader(Platen()), reader("platen")
    (True, NotImplemented, NotImplemented)
    """
    return lambda value: value if isinstance(value, kinds) else NotImplemented


def _beyond_side(drive: Any, height: float) -> list[str]:
    """Return messages about a pusher that does not fit the side of a body with a height (m).

    >>> pusher = Pusher(height=0.02, width=0.04)
    >>> _beyond_side(pusher, 0.04), _beyond_side(Platen(), 0.04)
    ([], [])
    >>> for height in (0.03, 0.02):
    ...     (text,) = _beyond_side(pusher, height)
    ...     print(text.partition(", but ")[2])
    the side is 0 to 0.03 m high. Give a width of at most 0.02 m
    the side is 0 to 0.02 m high. Give a height of at most 0 m
    >>> _beyond_side(Pusher(height=0.02, width=0.05), 0.06)[0][-30:]
    'Give a width of at most 0.04 m'
    """
    if not isinstance(drive, Pusher):
        return []
    low, high = drive.height - 0.5 * drive.width, drive.height + 0.5 * drive.width
    if low >= -1e-9 * height and high <= (1.0 + 1e-9) * height:
        return []
    width = 2.0 * min(drive.height, height - drive.height)
    name, most = ("width", width) if width > 0.0 else ("height", height - 0.5 * drive.width)
    return [
        f"drive: the pusher reaches from {low:g} to {high:g} m above the interface, but the side"
        f" is 0 to {height:g} m high. Give a {name} of at most {most:.6g} m"
    ]


@model(kw_only=True)
class Blocks(Listed):
    """Two equal blocks on top of each other, with free ends, driven in opposite directions.

    Parameters
    ----------
    height : float
        Height of each block, m. Its length is the interface length.
    thickness : float, optional
        Depth, m, which turns stresses into forces, N. A machine of
        finite stiffness needs it.
    drive : Platen or Pusher
    pressing : {"frictionless", "glued"}
        How the blocks are pressed: by a uniform pressure, or between
        plates on which the top faces do not slide. With plates,
        ``Load(normal_pressure=...)`` is the mean pressure.
    quality_factor : float
        Q of the slowest shear wave along a block, at the
        frequency f = c_s/(2 L). Momentum decays at the rate
        2 pi f/Q, in ruptures with inertia only. The value 25
        is for acrylic at about 10 kHz, with a loss tangent
        of 0.04. With ``float("inf")``, waves echo for ever.

    Examples
    --------
    >>> import stiction as st
    >>> blocks = st.Blocks(height=0.05, thickness=0.006, drive=st.Platen(stiffness=2e7))
    """

    height: Positive
    thickness: Positive | None = None
    drive: Annotated[Platen | Pusher, OneOf(DRIVES, _only(Platen, Pusher))] = Platen()
    pressing: Literal["frictionless", "glued"] = "frictionless"
    quality_factor: Quality = 25.0
    type: Literal["blocks"] = "blocks"

    @model_validator(mode="after")
    def _consistent(self) -> Blocks:
        """Refuse a pusher beyond the side, and a machine that needs the thickness.

        >>> def refused(**drive):
        ...     try:
        ...         Blocks(height=1.0, drive=Platen(**drive))
        ...     except InputError as error:
        ...         return str(error)[:38]
        >>> refused(stiffness=math.inf) or refused(stiffness=0.0)
        >>> refused(stiffness=3.0), refused(mass=2.0)
        ('Blocks: thickness: is needed with driv', 'Blocks: thickness: is needed with driv')
        """
        drive, problems = self.drive, _beyond_side(self.drive, self.height)
        if self.thickness is None and (drive.mass or 0.0 < drive.stiffness < math.inf):
            problems.append(
                "thickness: is needed with drive.mass, and unless drive.stiffness is 0 or inf"
            )
        if problems:
            raise InputError(problems)
        return self

    @property
    def pushes(self) -> Pushes | None:
        """Sides, height and width (m) of pushers. A platen has no pushers.

        >>> for side in ("both", "right"):
        ...     print(Blocks(height=0.05, drive=Pusher(height=0.02, width=0.01, side=side)).pushes)
        Pushes(sides=('left', 'right'), height=0.02, width=0.01)
        Pushes(sides=('right',), height=0.02, width=0.01)
        >>> Blocks(height=0.05).pushes
        """
        drive = self.drive
        if isinstance(drive, Platen):
            return None
        from stiction.elasticity.blocks import Pushes

        sides: Any = ("left", "right") if drive.side == "both" else (drive.side,)
        return Pushes(sides, drive.height, drive.width)

    def driven(self, length: float, nodes: int, solid: Solid, mode: Mode) -> Driven:
        """Return the stiffness and the profiles of the blocks and their machine, at the nodes.

        Half of the symmetric set-up has twice the stiffness, 3e6 N/m, over the
        thickness:

        >>> from unittest.mock import patch
        >>> solid = Solid(1e9, 0.2, 1200.0)
        >>> for pressing, stiffness in (("glued", 3e6), ("frictionless", math.inf)):
        ...     drive = Platen(stiffness=stiffness)
        ...     blocks = Blocks(height=0.05, thickness=0.004, drive=drive, pressing=pressing)
        ...     with patch("stiction.elasticity.driven.driven") as called:
        ...         _ = blocks.driven(0.3, 64, solid, "III" if pressing == "glued" else "II")
        ...     *first, pushes, glued, machine = called.call_args.args
        ...     print(*first, pushes is None, glued, machine)
        0.3 64 0.05 1000000000.0 2.2 True True True 1500000000.0
        0.3 64 0.05 1000000000.0 2.2 False True False inf
        """
        from stiction.elasticity.driven import driven  # scipy takes half a second

        machine = self.drive.stiffness
        if 0.0 < machine < math.inf:  # half of the symmetric set-up is twice as stiff
            machine *= 2.0 / (self.thickness or 1.0)
        return driven(
            length, nodes, self.height, solid.shear_modulus, solid.kolosov, mode == "III",
            self.pushes, self.pressing == "glued", machine,
        )  # fmt: skip


@model(kw_only=True)
class Base(Listed):
    """The body on which a slider lies, at least as long as the slider.

    Parameters
    ----------
    height : float
        Height, m.
    behind, ahead : float
        Free length beyond the trailing and the leading end of the
        slider, m.
    solid : Solid, optional
        Material. By default the material of the slider.
    bottom : {"fixed", "rollers"}
        Whether the bottom is glued to the ground, or lies on rollers, so
        that a frictionless stop at the leading end takes the push.

    Examples
    --------
    >>> import stiction as st
    >>> base = st.Base(height=0.03, behind=0.06, ahead=0.10)
    """

    height: Positive
    behind: NotNegative = 0.0
    ahead: NotNegative = 0.0
    solid: Solid | None = None
    bottom: Literal["fixed", "rollers"] = "fixed"


@model(kw_only=True)
class Slider(Listed):
    """A slider on a base, pressed from above and pushed until it slides.

    The push changes the pressure on the interface, and the interface may
    open. Strengths are given as friction coefficients.

    Parameters
    ----------
    height : float
        Height of the slider, m. Its length is the interface length.
    thickness : float, optional
        Depth, m, which turns stresses into forces, N. A machine of
        finite stiffness needs it.
    base : Base
    drive : Pusher or TopShear
    pressing : {"soft", "plate"}
        A uniform pressure on the top face, or a rigid frictionless plate
        that moves down without rotation.
    tilt : float
        Linear part of the soft pressure over its mean, in [-1, 1],
        positive towards the leading end: the pressure is mean (1 + tilt
        (2 x/L - 1)), with x from the trailing end.

    Examples
    --------
    >>> import stiction as st
    >>> slider = st.Slider(
    ...     height=0.075,
    ...     thickness=0.006,
    ...     base=st.Base(height=0.03, behind=0.06, ahead=0.10),
    ...     drive=st.Pusher(height=0.02, width=0.01),
    ... )
    """

    height: Positive
    thickness: Positive | None = None
    base: Base
    drive: Annotated[Pusher | TopShear, OneOf(SLIDER_DRIVES, _only(Pusher, TopShear))]
    pressing: Literal["soft", "plate"] = "soft"
    tilt: Annotated[Real, Field(ge=-1.0, le=1.0)] = 0.0
    type: Literal["slider"] = "slider"

    @model_validator(mode="after")
    def _consistent(self) -> Slider:
        """Refuse drives and presses that a slider cannot have.

        >>> pusher, base = {"height": 0.2, "width": 0.1}, Base(height=1.0)
        >>> def refused(drive, **given):
        ...     try:
        ...         Slider(height=1.0, base=base, drive=drive, **given)
        ...     except InputError as error:
        ...         return [text[8:25] for text in error.problems]
        >>> refused(Pusher(**pusher), tilt=0.5) or refused(TopShear(stiffness=math.inf))
        >>> refused(Pusher(**pusher, side="both", mass=2.0)), refused(TopShear(stiffness=3.0))
        (['drive.side: a sli', 'drive.mass: has n'], ['thickness: is nee'])
        >>> refused(TopShear(), tilt=0.5, pressing="plate")
        ['tilt: a plate doe']
        """
        problems = _beyond_side(self.drive, self.height)
        if isinstance(self.drive, Pusher):
            if self.drive.side == "both":
                problems.append("drive.side: a slider is pushed on a side, 'left' or 'right'")
            if self.drive.mass:
                problems.append("drive.mass: has no effect on a slider. Leave it out")
        if self.thickness is None and 0.0 < self.drive.stiffness < math.inf:
            problems.append("thickness: is needed unless drive.stiffness is 0 or inf")
        if self.tilt and self.pressing == "plate":
            problems.append("tilt: a plate does not rotate. Leave tilt out, or pass 'soft'")
        if problems:
            raise InputError(problems)
        return self

    @property
    def machine(self) -> float:
        """Machine stiffness per unit depth, Pa.

        >>> drive = Pusher(height=0.02, width=0.01, side="right", stiffness=3e6)
        >>> slider = Slider(height=0.07, thickness=0.004, base=Base(height=0.03), drive=drive)
        >>> dead = Slider(height=0.07, base=Base(height=0.03), drive=TopShear())
        >>> round(slider.machine, 3), dead.machine
        (750000000.0, 0.0)
        """
        return self.drive.stiffness / (self.thickness or 1.0)

    @property
    def towards(self) -> Literal[-1, 1]:
        """Direction of the push along x.

        >>> drives = [Pusher(height=0.02, width=0.01, side=side) for side in ("left", "right")]
        >>> for drive in (*drives, TopShear()):
        ...     print(Slider(height=0.07, base=Base(height=0.03), drive=drive).towards)
        1
        -1
        1
        """
        return -1 if isinstance(self.drive, Pusher) and self.drive.side == "right" else 1

    def toppling_ratio(self, length: float) -> float:
        """Return the largest push over the normal force before the slider topples.

        The push F moves the pressure by h F/N towards the leading end,
        from the middle or, for a tilted press, from tilt L/6.

        >>> pusher = Pusher(height=0.02, width=0.01)
        >>> plate = {"pressing": "plate"}
        >>> for drive, given in ((pusher, {"tilt": 0.6}), (TopShear(), {}), (pusher, plate)):
        ...     slider = Slider(height=0.075, base=Base(height=0.03), drive=drive, **given)
        ...     print(round(slider.toppling_ratio(0.15), 9))
        3.0
        1.0
        inf
        """
        if self.pressing == "plate":
            return math.inf
        high = self.drive.height if isinstance(self.drive, Pusher) else self.height
        return length * (0.5 - self.tilt / 6.0) / high

    def rig(self, length: float, nodes: int, solid: Solid) -> Rig:
        """Return the stiffness and the loads of the rig, per unit depth.

        >>> from unittest.mock import patch
        >>> drive, below = Pusher(height=0.02, width=0.01, side="right"), Solid(3e9, 0.25, 1e3)
        >>> base = Base(height=0.03, behind=0.06, ahead=0.1, solid=below, bottom="rollers")
        >>> slider = Slider(height=0.075, base=base, drive=drive, tilt=0.5)
        >>> with patch("stiction.elasticity.rig.contact_rig") as called:
        ...     _ = slider.rig(0.3, 64, Solid(1e9, 0.2, 1200.0))
        >>> [getattr(body, "height", body) for body in called.call_args.args]
        [0.3, 64, 0.075, 0.03]
        >>> [*called.call_args.args[3]], [*called.call_args.kwargs.values()][1:]
        ([0.03, 3000000000.0, 2.0], ['soft', 0.5, 0.06, 0.1, 'rollers', -1])
        """
        from stiction.elasticity.blocks import Pushes  # scipy takes half a second
        from stiction.elasticity.columns import Body
        from stiction.elasticity.rig import contact_rig

        base, drive, push = self.base, self.drive, None
        if isinstance(drive, Pusher):
            push = Pushes((), drive.height, drive.width).edges(self.height)
        slider, below = (
            Body(height, of.shear_modulus, of.kolosov)
            for height, of in ((self.height, solid), (base.height, base.solid or solid))
        )
        return contact_rig(
            length, nodes, slider, below, push=push, pressing=self.pressing, tilt=self.tilt,
            behind=base.behind, ahead=base.ahead, bottom=base.bottom, towards=self.towards,
        )  # fmt: skip

    def effective_modulus(self, solid: Solid) -> float:
        """Return 2/(a (1 - beta^2)), Pa, which is G* for equal materials.

        a = sum (kappa + 1)/(4 G), and beta is Dundurs' second constant.

        >>> slider = Slider(height=0.1, base=Base(height=0.1), drive=TopShear())
        >>> soft = Solid(1e9, 0.2, 1e3)
        >>> f"{slider.effective_modulus(soft):.6g} {soft.effective_modulus():.6g}"
        '1.25e+09 1.25e+09'

        With kappa = 2.2 and 1.8, a = 0.975/GPa and a beta = 0.25/GPa:

        >>> base = Base(height=0.1, solid=Solid(4e9, 0.3, 1e3))
        >>> modulus = Slider(height=0.1, base=base, drive=TopShear()).effective_modulus(soft)
        >>> f"{modulus:.6g} {2e9 * 0.975 / (0.975**2 - 0.25**2):.6g}"
        '2.19564e+09 2.19564e+09'
        """
        slider, base = (
            np.add(of.kolosov, [1.0, -1.0]) / (4.0 * of.shear_modulus)
            for of in (solid, self.base.solid or solid)
        )
        a, b = slider[0] + base[0], slider[1] - base[1]
        return float(2.0 * a / (a**2 - b**2))

    def misfits(self, length: float, spacing: float, solid: Solid, mode: Mode) -> list[str]:
        """Return messages about a slider that does not fit an interface (m) and a material.

        >>> solid, base = Solid(1e9, 0.2, 1e3), Base(height=0.0625, behind=4.0, ahead=5.5)
        >>> drive = Pusher(height=0.05, width=0.03125)
        >>> slider = Slider(height=0.125, base=base, drive=drive)
        >>> slider.misfits(0.275, 0.03125, solid, "II")
        []
        >>> for text in slider.misfits(0.25, 0.0625, solid, "III"):
        ...     print(text[:79])
        mode: a slider is sheared in its plane. Keep mode='II'
        specimen.base.height: is not resolved by nodes 0.0625 m apart. Give interface.n
        specimen.drive.width: is not resolved by nodes 0.0625 m apart. Give interface.n
        specimen.base.ahead: 5.5 m is more than 20 times the length of the slider, 0.25
        >>> slider.misfits(0.28, 0.0625, solid, "II")[1][-27:]
        'interface.nodes = 9 or more'
        >>> base = Base(height=0.1, solid=Solid(1e9, 0.2, 1e3, "stress"))
        >>> Slider(height=0.1, base=base, drive=TopShear()).misfits(0.25, 0.05, solid, "II")
        ["specimen.base.solid.plane: must be the slider's 'strain'"]
        """
        problems, base = [], self.base
        if mode != "II":
            problems.append("mode: a slider is sheared in its plane. Keep mode='II'")
        if base.solid is not None and base.solid.plane != solid.plane:
            problems.append(f"specimen.base.solid.plane: must be the slider's {solid.plane!r}")
        sizes = {"height": self.height, "base.height": base.height}
        resolved = {name: 0.5 * size for name, size in sizes.items()}
        if isinstance(self.drive, Pusher):
            resolved["drive.width"] = self.drive.width
        problems += [
            f"specimen.{name}: is not resolved by nodes {spacing:.3g} m apart. Give"
            f" interface.nodes = {math.ceil(length / size)} or more"
            for name, size in resolved.items()
            if size < (1.0 - 1e-9) * spacing
        ]
        sizes |= {"base.behind": base.behind, "base.ahead": base.ahead}
        problems += [
            f"specimen.{name}: {size:g} m is more than {MAX_SIZE_RATIO:g} times the length of the"
            f" slider, {length:g} m. Check its unit (m)"
            for name, size in sizes.items()
            if size > MAX_SIZE_RATIO * length
        ]
        return problems

    def checked_pressing(self, rig: Rig, length: float, peak: Array, residual: Array) -> Array:
        """Return the local pressure of the pressing over its mean, for peak slips and energies.

        Refuse friction coefficients (samples, nodes) for which the path
        is not defined. Coupling must not let the slip at a node shear
        other nodes forwards, and the slider must not topple before it
        slides.

        The coupling between the two cells is 0.2 and 0.1. The smaller limit is
        (0.01 x 8 + 1)/0.2:

        >>> from types import SimpleNamespace
        >>> K = np.array([[10.0, -1.0], [-0.5, 8.0], [9.0, 0.2], [0.0, 0.0], [0.1, 9.0]])
        >>> rig = SimpleNamespace(K=K, T_p=np.array([7.0, 7.0, -0.1, -0.3, 0.1]))
        >>> slider = Slider(height=0.02, base=Base(height=0.03), drive=TopShear())
        >>> residual = np.array([[1.0, 8.0], [6.0, 3.8]])
        >>> slider.checked_pressing(rig, 0.2, np.full((2, 2), 5.39), residual).round(9).tolist()
        [0.5, 0.1]
        >>> for peak, more in ((5.41, 0.0), (4.0, 0.2)):
        ...     try:
        ...         slider.checked_pressing(rig, 0.2, np.full((2, 2), peak), residual + more)
        ...     except InputError as error:
        ...         print(str(error)[-46:])
        friction coefficients up to 5.4 only, got 5.41
         its residual friction is 5.1. Lower the drive
        """
        from stiction.elasticity.rig import on_cells

        n = peak.shape[-1]
        K, coupling = rig.K[:n, :n], on_cells(rig.K[n:, :n])
        forwards = (coupling > 0.0) & ~np.eye(n, dtype=bool)
        limits = (MAX_POSITIVE * K.diagonal().min() - K[forwards]) / coupling[forwards]
        if (limit := limits.min(initial=np.inf)) < peak.max():
            raise InputError(
                "specimen.base.solid: differs so much from the slider that the path is defined for"
                f" friction coefficients up to {limit:.3g} only, got {peak.max():.3g}"
            )
        least, ratio = residual.mean(axis=-1).max(), self.toppling_ratio(length)
        if least >= ratio:
            raise InputError(
                f"specimen.drive.height: the slider topples at a push of {ratio:.3g} times the"
                f" normal force, but its residual friction is {least:.3g}. Lower the drive"
            )
        # Nodes without pressure hardly weaken.
        return np.maximum(-n * on_cells(rig.T_p[n:]), MIN_PRESSURE)


SPECIMENS = _kinds("specimens", blocks="Blocks", slider="Slider")
Specimen = Annotated[Blocks | Slider, OneOf(SPECIMENS, _only(Blocks, Slider), default="blocks")]
