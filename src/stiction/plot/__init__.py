"""Plots of results.

A plot with a single panel draws on `ax`, or on new axes, and returns
the axes. A plot with several panels (`fit`, `precursors`, `specimen`)
makes a new figure and returns an array of axes. New figures always have
the style of a printed page. `film` writes a file and returns its path.

Units suit the size of the numbers, such as mm and µs, or km and s. If
the problem has a normal pressure, friction coefficients are also drawn.
All files use `axes`. The files `fields`, `specimens`,
`ruptures`, `distributions` and `fits` each draw one kind of result.
"""

from stiction.plot.distributions import failure_curve, monte_carlo, quantiles, sensitivities
from stiction.plot.fields import field, onset
from stiction.plot.fits import agreement, fit
from stiction.plot.ruptures import film, rupture
from stiction.plot.specimens import precursors, specimen

__all__ = [
    "agreement",
    "failure_curve",
    "field",
    "film",
    "fit",
    "monte_carlo",
    "onset",
    "precursors",
    "quantiles",
    "rupture",
    "sensitivities",
    "specimen",
]


def __dir__() -> list[str]:  # what completion lists
    return __all__
