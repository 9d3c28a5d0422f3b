"""Specimens: two equal blocks with free ends, how they are driven and how they are pressed."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, PlainSerializer, model_validator

from stiction.base.errors import InputError
from stiction.base.kinds import Kinds, OneOf
from stiction.base.model import Mode, Positive, Real, as_number, model
from stiction.problem.solid import Solid

if TYPE_CHECKING:
    from stiction.elasticity.blocks import Pushes
    from stiction.elasticity.driven import Driven


def _stiffness(value: Any) -> float:
    return math.inf if value == "inf" else as_number(value)


def _written(value: float) -> Any:
    """Return a number, or 'inf' because JSON has no infinite number."""
    return "inf" if value == math.inf else value


Stiffness = Annotated[
    float, BeforeValidator(_stiffness), PlainSerializer(_written), Field(ge=0.0)
]
Quality = Annotated[
    float, BeforeValidator(_stiffness), PlainSerializer(_written), Field(ge=0.01)
]
NotNegative = Annotated[Real, Field(ge=0.0)]


@model(kw_only=True)
class Platen:
    """A rigid platen that is glued to the top face and moves along the interface only.

    Parameters
    ----------
    stiffness : float
        Stiffness of the machine between the grips of the two blocks,
        N/m. 0 is a dead load (the force is controlled).
        ``float("inf")`` is a rigid machine (the travel is controlled).
    mass : float
        Mass of the platen and the grip that move with a block, kg. It
        counts in ruptures with inertia only.
    """

    stiffness: Stiffness = 0.0
    mass: NotNegative = 0.0
    type: Literal["platen"] = "platen"


@model(kw_only=True)
class Pusher:
    """A uniform traction on one or both sides of each block. The top face lies on rollers.

    Parameters
    ----------
    height : float
        Height of the middle of the pusher above the interface, m. The
        pusher may be anywhere on the side, up to the top and down to
        the interface.
    width : float
        Extent of the pusher along the side, m.
    side : {"left", "right", "both"}
        The trailing side, from which slip is driven. Two pushers share
        the force equally. This is the shear of a lap joint. Its
        bending, and its change of pressure, are not modelled.
    stiffness : float
        Stiffness of the machine between the grips of the two blocks,
        N/m (see `Platen`).
    mass : float
        Mass, kg, that moves with the pushers of a block (see `Platen`).
    """

    height: Positive
    width: Positive
    side: Literal["left", "right", "both"] = "left"
    stiffness: Stiffness = 0.0
    mass: NotNegative = 0.0
    type: Literal["pusher"] = "pusher"


DRIVES = Kinds(
    "drives", {"platen": "problem.specimen:Platen", "pusher": "problem.specimen:Pusher"}
)


def _drive(value: Any) -> Any:
    return value if isinstance(value, Platen | Pusher) else NotImplemented


@model(kw_only=True)
class Blocks:
    """Two equal blocks on top of each other, with free ends, driven in opposite directions.

    Parameters
    ----------
    height : float
        Height of each block, m. Its length is the length of the interface.
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
    drive: Annotated[Platen | Pusher, OneOf(DRIVES, _drive)] = Platen()
    pressing: Literal["frictionless", "glued"] = "frictionless"
    quality_factor: Quality = 25.0

    @model_validator(mode="after")
    def _consistent(self) -> Blocks:
        drive, problems = self.drive, []
        if isinstance(drive, Pusher):
            low, high = drive.height - 0.5 * drive.width, drive.height + 0.5 * drive.width
            if low < -1e-9 * self.height or high > (1.0 + 1e-9) * self.height:
                problems.append(
                    f"drive: the pusher reaches from {low:g} to {high:g} m above the interface, the"
                    f" side of the block from 0 to {self.height:g} m"
                )
        if self.thickness is None and (drive.mass or 0.0 < drive.stiffness < math.inf):
            problems.append(
                "thickness: is needed with drive.mass, and unless drive.stiffness is 0 or inf"
            )
        if problems:
            raise InputError(problems)
        return self

    @property
    def pushes(self) -> Pushes | None:
        """Sides, height and width (m) of pushers. A platen has no pushers."""
        drive = self.drive
        if isinstance(drive, Platen):
            return None
        from stiction.elasticity.blocks import Pushes

        sides: Any = ("left", "right") if drive.side == "both" else (drive.side,)
        return Pushes(sides, drive.height, drive.width)

    def driven(self, length: float, nodes: int, solid: Solid, mode: Mode) -> Driven:
        """Return the stiffness and the profiles of the blocks and their machine, at the nodes."""
        from stiction.elasticity.driven import driven  # scipy takes half a second

        machine = self.drive.stiffness
        if 0.0 < machine < math.inf:  # half of the symmetric set-up is twice as stiff
            machine *= 2.0 / (self.thickness or 1.0)
        return driven(
            length, nodes, self.height, solid.shear_modulus, solid.kolosov, mode == "III",
            self.pushes, self.pressing == "glued", machine,
        )  # fmt: skip
