"""An instability of a specimen with inertia: from the unstable equilibrium until rest, or sliding.

A run is counted from the static state in which it becomes unstable. The drive is raised a little,
as it goes on to rise, and slip has grown a little along the unstable direction; what follows is all
by waves. A block is at rest when nothing slips any more while shear waves cross it and return.
"""

from collections import deque
from dataclasses import dataclass

import numpy as np

from stiction.base.arrays import Array
from stiction.base.errors import InputError
from stiction.methods.dynamics.mesh import Mesh
from stiction.methods.dynamics.waves import Waves, at_rest, follow
from stiction.methods.equilibrium.sample import State, StaticSample

RAISED = 1e-5
"""Rise of the drive in an event, as a share of the mean fall of strength over its profile."""
GROWN = 1e-3
"""Growth of the slip at the start, as a share of d_c where it is largest."""
STILL = 1e-4
"""Share of the largest slip of an event below which a node counts as resting."""
LOOKS = 8
"""How often it is seen whether all is at rest, while shear waves cross the block and return."""


@dataclass
class Event:
    """One instability on its way.

    Attributes
    ----------
    before : State
        The equilibrium that became unstable.
    start : (n,) array
        Stress of the static state at the start, less the initial stress, Pa.
    """

    sample: StaticSample
    mesh: Mesh
    before: State
    start: Array
    waves: Waves
    front: Array
    slides: bool = False
    steps: int = 0

    def advance(self, count: int, ends: bool = True) -> bool:
        """Take so many steps, or until all nodes have slipped; return whether they have not."""
        taken = follow(self.sample, self.start, self.front, self.mesh, self.waves, count, ends)
        self.steps += taken
        self.slides = bool((self.waves.slip > 0.0).all())
        return not self.slides

    def run(self, max_steps: int) -> None:
        """Go on until all is at rest or all nodes have slipped."""
        slips = deque([self.waves.slip.copy()], maxlen=LOOKS + 1)
        while self.advance(-(-self.mesh.window // LOOKS)):
            slips.append(self.waves.slip.copy())
            added = float((slips[-1] - slips[0]).max())
            most = float((slips[-1] - self.before.slip).max())
            if len(slips) > LOOKS and added <= STILL * most:
                return
            if self.steps > max_steps:
                raise InputError(
                    f"max_steps: an event has not come to rest after {self.steps} steps; raise"
                    " max_steps, or lower specimen.quality_factor"
                )


def begin(
    sample: StaticSample, mesh: Mesh, stiffness: Array, before: State, arrival: float
) -> Event:
    """Return an event that is about to run.

    `arrival` is the slip over d_c with which a front arrives at a node.
    """
    fall = sample.excess - sample.residual
    load = before.load + RAISED * float(fall.mean() / sample.profile.mean())
    z = before.direction
    place = int(np.argmax(z))
    grown = GROWN * sample.critical[place] / max(float(z[place]), 1e-300)
    slip = before.slip + grown * z
    start = load * sample.profile - stiffness @ slip
    front = arrival * sample.critical
    front = np.where(before.slip < front, np.maximum(front, slip * (1.0 + 1e-12)), np.inf)
    return Event(sample, mesh, before, start, at_rest(mesh, slip), front)
