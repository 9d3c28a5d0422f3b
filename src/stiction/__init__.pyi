# What editors see: the names of the lazy table in __init__.py, imported for real.
# A test keeps the two equal.

from stiction import external as external
from stiction import paper as paper
from stiction import plot as plot
from stiction import statistics as statistics
from stiction import theory as theory
from stiction.criterion.local import LocalCriterion as LocalCriterion
from stiction.dynamics.method import Rupture as Rupture
from stiction.dynamics.save import Save as Save
from stiction.dynamics.simulate import simulate_rupture as simulate_rupture
from stiction.ensemble.experiment import Ensemble as Ensemble
from stiction.ensemble.monte_carlo import monte_carlo as monte_carlo
from stiction.equilibrium.method import Equilibrium as Equilibrium
from stiction.equilibrium.path import equilibrium_path as equilibrium_path
from stiction.errors import (
    AccuracyWarning as AccuracyWarning,
)
from stiction.errors import (
    InputError as InputError,
)
from stiction.errors import (
    RunError as RunError,
)
from stiction.errors import (
    UnitWarning as UnitWarning,
)
from stiction.friction import ExponentialWeakening as ExponentialWeakening
from stiction.friction import LinearWeakening as LinearWeakening
from stiction.friction import PiecewiseWeakening as PiecewiseWeakening
from stiction.inference.design import design_of_tests as design_of_tests
from stiction.inference.fit import fit_field as fit_field
from stiction.inference.infer import infer as infer
from stiction.inference.peaks import read_peaks as read_peaks
from stiction.interface import Interface as Interface
from stiction.load import EdgeLoad as EdgeLoad
from stiction.load import GradientLoad as GradientLoad
from stiction.load import Load as Load
from stiction.methods import onset as onset
from stiction.problem import Problem as Problem
from stiction.profiles import read_profile as read_profile
from stiction.random.marginals import Beta as Beta
from stiction.random.marginals import (
    Gamma as Gamma,
)
from stiction.random.marginals import (
    Lognormal as Lognormal,
)
from stiction.random.marginals import (
    TruncatedNormal as TruncatedNormal,
)
from stiction.random.marginals import (
    Weibull as Weibull,
)
from stiction.random.random_field import RandomField as RandomField
from stiction.random.random_interface import RandomInterface as RandomInterface
from stiction.random.spectra import CustomSpectrum as CustomSpectrum
from stiction.random.spectra import (
    ExponentialSpectrum as ExponentialSpectrum,
)
from stiction.random.spectra import (
    PowerLawSpectrum as PowerLawSpectrum,
)
from stiction.random.spectra import (
    SquaredExponentialSpectrum as SquaredExponentialSpectrum,
)
from stiction.reliability.curve import failure_curve as failure_curve
from stiction.reliability.failure import (
    design_stress as design_stress,
)
from stiction.reliability.failure import failure_probability as failure_probability
from stiction.solid import Solid as Solid
from stiction.study.study import Study as Study
from stiction.study.study import open_run as open_run

__version__: str
