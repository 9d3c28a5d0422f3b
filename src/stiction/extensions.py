"""Names for your own packages that add a method, law, marginal or spectrum.

`docs/guide/extend-and-connect.md` shows an example of each. Import
these names from this module, because the modules that define them may
move.
"""

from stiction.base.kinds import register
from stiction.base.model import Positive, Real, model
from stiction.base.variables import Variable
from stiction.methods.protocol import Method, Solver
from stiction.problem.friction import FrictionLaw
from stiction.problem.results import onset_variables
from stiction.random.marginals import Marginal
from stiction.random.spectra import ScaledSpectrum, SpectralDensity

__all__ = [
    "FrictionLaw",
    "Marginal",
    "Method",
    "Positive",
    "Real",
    "ScaledSpectrum",
    "Solver",
    "SpectralDensity",
    "Variable",
    "model",
    "onset_variables",
    "register",
]


def __dir__() -> list[str]:  # what completion lists
    return __all__
