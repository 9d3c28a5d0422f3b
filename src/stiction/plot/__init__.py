"""Public plots: each takes a result, draws on axes (given as ``ax=``, or new ones), returns them.

Stresses are in MPa, lengths in mm; where the problem has a normal pressure, friction coefficients
are shown with them or in their place. `film` writes a file. Figures of several panels, as the
commands write them, are made of these in `stiction.report`.
"""

from stiction.plot.distributions import monte_carlo, quantiles
from stiction.plot.failure import failure_curve, weak_spots
from stiction.plot.fields import field, nucleation_stress
from stiction.plot.films import film
from stiction.plot.onsets import onset
from stiction.plot.paths import equilibrium_path
from stiction.plot.ruptures import front, rupture
from stiction.plot.style import paper_style

__all__ = [
    "equilibrium_path",
    "failure_curve",
    "field",
    "film",
    "front",
    "monte_carlo",
    "nucleation_stress",
    "onset",
    "paper_style",
    "quantiles",
    "rupture",
    "weak_spots",
]
