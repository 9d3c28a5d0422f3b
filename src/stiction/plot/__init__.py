"""Plots of results: each function draws on axes (given as ``ax=``, or new ones) and returns them.

Units follow the size of what is drawn: mm and µs, or km and s. Where the problem has a normal
pressure, friction coefficients are drawn too. `fit` and `posterior` have several panels and
return a figure; `film` writes a file.
"""

from stiction.plot.distributions import monte_carlo, quantiles
from stiction.plot.failure import failure_curve, weak_spots
from stiction.plot.fields import field
from stiction.plot.films import film
from stiction.plot.fits import fit, posterior
from stiction.plot.onsets import equilibrium_path, onset
from stiction.plot.ruptures import front, rupture
from stiction.plot.style import paper_style

__all__ = [
    "equilibrium_path",
    "failure_curve",
    "field",
    "film",
    "fit",
    "front",
    "monte_carlo",
    "onset",
    "paper_style",
    "posterior",
    "quantiles",
    "rupture",
    "weak_spots",
]
