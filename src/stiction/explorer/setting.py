"""What the explorer shows: from ten numbers to a profile, its patches and a thousand onsets."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
import scipy.stats
import tomli_w

from stiction._typing import Array
from stiction.criterion.method import LocalCriterion
from stiction.criterion.nucleation import nucleation_stress
from stiction.ensemble.monte_carlo import monte_carlo
from stiction.equilibrium.method import Equilibrium
from stiction.equilibrium.path import equilibrium_path
from stiction.errors import InputError, collect_warnings
from stiction.evaluation import onset
from stiction.friction.linear import LinearWeakening
from stiction.interface import Interface
from stiction.load import Load
from stiction.problem import Problem
from stiction.random.marginals import Beta
from stiction.random.random_field import RandomField
from stiction.random.spectra import PowerLawSpectrum
from stiction.solid import Solid
from stiction.study.ensemble import Ensemble
from stiction.study.study import Study

SAMPLES = 1000
SHOWN_NODES = 20
"""Nodes in a nucleation length; the local criterion needs 16."""
FEWEST, MOST = 256, 4096
SOLID = Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0, plane="stress")

_ALPHA, _BETA = 1.5, 3.0
_BETA_MEAN = _ALPHA / (_ALPHA + _BETA)
_BETA_SD = math.sqrt(_ALPHA * _BETA / (_ALPHA + _BETA + 1.0)) / (_ALPHA + _BETA)


def _beta(mean: float, sd: float) -> Any:
    """Of the shape in Albertini et al. (2020)."""
    low = mean - _BETA_MEAN * sd / _BETA_SD
    return Beta(alpha=_ALPHA, beta=_BETA, low=low, high=low + sd / _BETA_SD)


def _uniform(mean: float, sd: float) -> Any:
    half = math.sqrt(3.0) * sd
    return Beta(alpha=1.0, beta=1.0, low=mean - half, high=mean + half)


def _lognormal(mean: float, sd: float) -> Any:
    s = math.sqrt(math.log1p((sd / mean) ** 2))
    return scipy.stats.lognorm(s, scale=mean * math.exp(-0.5 * s * s))


MARGINALS: dict[str, Callable[[float, float], Any]] = {
    "beta": _beta,
    "uniform": _uniform,
    "lognormal": _lognormal,
}


@dataclass(frozen=True)
class Setting:
    """What the sliders say, in the units that they show.

    Attributes
    ----------
    correlation_length : float
        xi_0, mm.
    marginal : str
        One of `MARGINALS`.
    mean, spread : float
        Mean and standard deviation of the strength, MPa.
    residual : float
        Residual strength, MPa.
    critical_slip : float
        Critical slip at the mean strength, um; with it and the two strengths goes the weakening
        rate, which is uniform.
    pressure : float
        Normal pressure, MPa.
    length : float
        Of the interface, mm.
    sample : int
        The one whose profile is shown.
    load : float
        Share of its exact onset at which its slip patches are shown.
    """

    correlation_length: float = 1.5
    marginal: str = "beta"
    mean: float = 1.0
    spread: float = 0.2
    residual: float = 0.0
    critical_slip: float = 2.0
    pressure: float = 5.0
    length: float = 100.0
    sample: int = 0
    load: float = 0.98

    @property
    def weakening_rate(self) -> float:
        """(mean strength - residual strength)/critical slip, Pa/m.

        Raises
        ------
        InputError
            If the strength does not fall.
        """
        if self.residual >= self.mean:
            raise InputError(
                f"residual strength: {self.residual:g} MPa is not below the mean strength,"
                f" {self.mean:g} MPa; nothing would weaken"
            )
        return (self.mean - self.residual) * 1e6 / (self.critical_slip * 1e-6)

    @property
    def nodes(self) -> int:
        """A power of two that resolves the nucleation length and all of the spectrum."""
        h_n = 2.0 * 0.5788869418506 * SOLID.effective_modulus("II") / self.weakening_rate
        waves = (
            2.0
            * PowerLawSpectrum(correlation_length=self.correlation_length).cutoff
            / (2.0 * math.pi)
        )
        wanted = max(SHOWN_NODES * self.length * 1e-3 / h_n, waves * self.length)
        return int(np.clip(2 ** math.ceil(math.log2(wanted)), FEWEST, MOST))

    def problem(self) -> Problem:
        """Everything that is not random."""
        return Problem(
            solid=SOLID,
            interface=Interface(length=self.length * 1e-3, nodes=self.nodes),
            friction=LinearWeakening(
                weakening_rate=self.weakening_rate, residual_strength=self.residual * 1e6
            ),
            load=Load(normal_pressure=self.pressure * 1e6),
        )

    def strength(self) -> RandomField:
        """The random strength."""
        return RandomField(
            marginal=MARGINALS[self.marginal](self.mean * 1e6, self.spread * 1e6),
            spectrum=PowerLawSpectrum(correlation_length=self.correlation_length * 1e-3),
        )

    def study(self) -> Study:
        """The thousand samples as a study."""
        return Study(
            problem=self.problem(),
            random=self.strength(),
            method=LocalCriterion(),
            ensemble=Ensemble(samples=SAMPLES, seed=0),
            title="From the explorer",
        )

    def toml(self) -> str:
        """The study as a file for `stiction run`."""
        return tomli_w.dumps(self.study().to_dict())

    def code(self) -> str:
        """Python that computes what is shown."""
        problem, field = self.problem(), self.strength()
        if isinstance(field.marginal, Beta):
            marginal = f"st.{field.marginal!r}"
            head = "import stiction as st\n"
        else:
            parameters = MARGINALS[self.marginal](self.mean * 1e6, self.spread * 1e6)
            marginal = (
                f"scipy.stats.lognorm({parameters.args[0]!r}, scale={parameters.kwds['scale']!r})"
            )
            head = "import scipy.stats\n\nimport stiction as st\n"
        solid, friction = problem.solid, problem.friction
        return f"""{head}
problem = st.Problem(
    solid=st.Solid(
        shear_modulus={solid.shear_modulus!r}, poisson_ratio={solid.poisson_ratio!r},
        density={solid.density!r}, plane={solid.plane!r},
    ),
    interface=st.Interface(length={problem.interface.length!r}, nodes={problem.interface.nodes!r}),
    friction=st.LinearWeakening(
        weakening_rate={friction.weakening_rate!r},
        residual_strength={friction.residual_strength!r},
    ),
    load=st.Load(normal_pressure={problem.load.normal_pressure!r}),
)
strength = st.RandomField(
    marginal={marginal},
    spectrum=st.PowerLawSpectrum(correlation_length={self.correlation_length * 1e-3!r}),
)
many = st.monte_carlo(problem, strength, method=st.LocalCriterion(), samples={SAMPLES}, seed=0)
st.plot.monte_carlo(many)

tau_p = strength.sample(problem.interface, samples={self.sample + 1}, seed=0)[{self.sample}]
exact = st.onset(problem, tau_p, method=st.Equilibrium())
st.plot.onset(exact, tau_p)
path = st.equilibrium_path(problem, tau_p, [{self.load!r} * exact.first_instability.item()])
st.plot.equilibrium_path(path)
"""


class Answer(NamedTuple):
    """What is drawn, in the units of the page.

    Attributes
    ----------
    x : (nodes,) array
        mm.
    strength, average, stress : (nodes,) arrays
        Strength, nucleation stress, and shear stress at the load shown, MPa.
    slip : (nodes,) array
        At the load shown, um.
    place, onset : float
        Where (mm) and at which mean stress (MPa) this sample begins to slide, exactly.
    coefficients : (samples,) array
        Friction coefficients by the local criterion, in rising order.
    doubts : tuple of str
        Warnings.
    """

    x: Array
    strength: Array
    average: Array
    stress: Array
    slip: Array
    place: float
    onset: float
    coefficients: Array
    doubts: tuple[str, ...]


class Cached:
    """The answers to settings; what a slider does not change is not computed again."""

    def __init__(self) -> None:
        self._many: tuple[Any, Array] | None = None
        self._one: tuple[Any, tuple[Any, ...]] | None = None

    def answer(self, setting: Setting) -> Answer:
        """All that is shown.

        Raises
        ------
        InputError
            If the numbers do not fit together.
        """
        with collect_warnings() as caught:
            problem, strength = setting.problem(), setting.strength()
            coefficients = self._coefficients(problem, strength)
            tau_p, average, exact = self._profile(problem, strength, setting.sample)
            load = setting.load * float(exact.first_instability[0])
            path = equilibrium_path(problem, tau_p, [load])
        doubts = tuple(dict.fromkeys(warning.message for warning in caught))
        return Answer(
            x=problem.interface.x * 1e3,
            strength=tau_p * 1e-6,
            average=average * 1e-6,
            stress=path.stress.values[0] * 1e-6,
            slip=path.slip.values[0] * 1e6,
            place=float(exact.critical_position[0]) * 1e3,
            onset=float(exact.critical_stress[0]) * 1e-6,
            coefficients=coefficients,
            doubts=doubts,
        )

    def _coefficients(self, problem: Problem, strength: RandomField) -> Array:
        key = problem, strength
        if self._many is None or self._many[0] != key:
            method = LocalCriterion()
            found = monte_carlo(
                problem, strength, method=method, samples=SAMPLES, seed=0, progress=False
            )
            self._many = key, np.sort(found.friction_coefficient.values)
        return self._many[1]

    def _profile(self, problem: Problem, strength: RandomField, sample: int) -> tuple[Any, ...]:
        key = problem, strength, sample
        if self._one is None or self._one[0] != key:
            tau_p = strength.sample(problem.interface, samples=1, first=sample, seed=0)[0]
            exact = onset(problem, tau_p, method=Equilibrium(), progress=False)
            self._one = key, (tau_p, nucleation_stress(problem, tau_p), exact)
        return self._one[1]
