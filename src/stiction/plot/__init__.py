"""Plots of results.

A plot with a single panel draws on `ax`, or on new axes, and returns
the axes. A plot with several panels (`block`, `events`, `fit`,
`moment_rate`, `precursors`, `specimen`) makes a new figure and returns
an array of axes. New figures always have the style of a printed page.
On a user's axes, lines and texts keep a contrast of at least 4.5 to 1
with the background. `film` writes a file and returns its path.

Units suit the size of the numbers, such as mm and µs, or km and s. If
the problem has a normal pressure, friction coefficients are also drawn.
All files share `axes` and `style`. The files `fields`, `specimens`,
`ruptures`, `distributions` and `fits` each draw one kind of result.
"""

from stiction.plot.distributions import failure_curve, monte_carlo, quantiles, sensitivities
from stiction.plot.fields import field, onset
from stiction.plot.fits import agreement, fit
from stiction.plot.ruptures import events, film, moment_rate, rupture
from stiction.plot.specimens import block, force_travel, precursors, specimen

__all__ = [
    "agreement",
    "block",
    "events",
    "failure_curve",
    "field",
    "film",
    "fit",
    "force_travel",
    "moment_rate",
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
