"""The answer of a call on failure probability: numbers, intervals, doubts, and how it is shown."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from typing import Any, Self

import numpy as np
import xarray as xr
from scipy.special import ndtri

from stiction.base.arrays import Array
from stiction.base.errors import warn_accuracy
from stiction.base.model import FilePath, Text, checked
from stiction.base.representation import Result, Row, Summary
from stiction.base.units import in_words
from stiction.ensemble.experiment import Experiment
from stiction.reliability.tail import TailPoint

ESTIMATED = ("stress", "probability", "cv", "members_cv", "members")
"""Attributes that an answer takes from a `TailPoint`."""
UNSEEN_CONFIDENCE = 0.95
"""Confidence with which a weaker batch would have been seen."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Answer(Result):
    """A stress, and the probability that an interface slides below it.

    Attributes
    ----------
    stress, probability : float
        Stress, Pa, and probability of an onset below this stress. One
        is given, and the other is estimated.
    interval : dict from str to (float, float)
        90 % interval of each estimated number by name, due to the error
        of the computation: ``probability``, or ``stress`` (Pa),
        ``force`` (N) and ``friction_coefficient`` of a design.
    cv : float
        Coefficient of variation of the probability: estimated standard
        error over the estimate, infinite without a failure, and zero if
        the answer is exact.
    members_cv : float
        Part of `cv` that arises because a list of equally likely
        interfaces is only a sample of the interfaces that may be true,
        or 0 for a single interface. The squares of this part and of the
        sampling error add up.
    evaluations, first_stage_evaluations : int
        Samples solved by the method, and samples solved only by its
        less expensive first stage.
    lower_bound, stress_above_bound : float
        No sample slides below `lower_bound`, Pa, which is
        minus infinity if unknown. `stress_above_bound` is
        `stress` minus this bound.
    algorithm, reason : str
        'plain', 'subset', 'two_level' or 'exact' (without samples), and
        the reason for this choice.
    members : (members,) array
        For a list of equally likely interfaces, the probability for
        each interface, or NaN if fewer than three samples of an
        interface slide below the stress. The mean over all interfaces
        is `probability`, the predictive probability, on which a
        decision should rest.
    survived : float
        Fraction of plain samples in which the event does not happen at any
        stress. With a stiff machine, an interface may stay stable and
        carry any load.
    warnings : tuple of str
        Reasons not to trust the answer, if any.
    doubts : tuple of str
        Doubts of the fit or posterior behind the answer.
    normal_pressure, friction_coefficient : float
        Mean pressure, Pa, and `stress` over this pressure. Both are NaN
        without a normal pressure.
    area, force : float
        Interface area, m², and `stress` times the area, N. NaN
        if the area is unknown: give ``Blocks(thickness=...)``, or
        ``Interface(width=...)`` for a line.
    failing_profiles : xarray.Dataset
        Given by `failure_probability`: some samples over ('sample',
        'x'), drawn from the distribution of failing samples. Variables
        are `strength` and other random properties, `critical_stress`,
        `critical_position`, ...
    sensitivities : xarray.Dataset
        Given by `design_stress`: effects on the design over 'source',
        the largest first. `low` and `high` are the settings at both
        ends. `force_at_low` and `force_at_high`, N, and `stress_at_low`
        and `stress_at_high`, Pa, are the designs there. Attributes
        ``stress by ...`` hold the stress for each distribution between
        specimens. ``sensitivities.to_dataframe().to_csv(path)`` writes
        a file, and `stiction.plot.sensitivities` draws it.
    characteristic_stress, confidence : float
        Given by `design_stress` if specimens were counted: stress, Pa,
        below which 5 % of the specimens slide, with this confidence (EN
        1990: 75 %): a quantile over equally likely interfaces. NaN if
        specimens were not counted.
    partial_factor, reliability_index : float
        `characteristic_stress` over `stress`, and minus the quantile of
        the normal distribution at the probability.
    of_stress : bool
        True if the stress is estimated, as in `design_stress`, and
        false if the probability is estimated.
    quantity : str
        First quantity of the printed answer: 'stress', 'force' or
        'friction_coefficient', as requested. For `design_stress` it is
        the force if the area is known.
    specimens : int
        Number of measured specimens behind the scatter between
        specimens, or 0.
    experiment : Experiment
        Problem, random properties, method and seed of the call.
    """

    stress: float
    probability: float
    interval: Mapping[str, tuple[float, float]]
    cv: float
    members_cv: float = 0.0
    evaluations: int
    first_stage_evaluations: int = 0
    lower_bound: float
    algorithm: str
    reason: str
    survived: float = 0.0
    warnings: tuple[str, ...]
    normal_pressure: float
    area: float = math.nan
    members: Array = field(default_factory=lambda: np.zeros(0), repr=False)
    failing_profiles: xr.Dataset = field(default_factory=xr.Dataset, repr=False)
    sensitivities: xr.Dataset = field(default_factory=xr.Dataset, repr=False)
    characteristic_stress: float = math.nan
    confidence: float = 0.75
    of_stress: bool = False
    quantity: str = "stress"
    specimens: int = 0
    experiment: Experiment = field(repr=False, compare=False)
    doubts: tuple[str, ...] = ()

    @classmethod
    def at(
        cls,
        point: TailPoint,
        ends: tuple[float, float],
        doubts: Sequence[str] = (),
        **more: Any,
    ) -> Self:
        """Return the answer at a point of a tail, and issue doubts as warnings.

        `ends` is the interval of the probability, or of the stress of a
        design. `more` contains further attributes, or replaces the
        attributes of the point.

        >>> from types import SimpleNamespace
        >>> problem = SimpleNamespace(area=3.0)
        >>> experiment = SimpleNamespace(pressure=4.0, problem=problem)
        >>> repetitions = [SimpleNamespace(first_stage_evaluations=count) for count in (5, 6)]
        >>> tail = SimpleNamespace(
        ...     repetitions=repetitions, spent=80, algorithm="subset", reason="rare", survived=0.25
        ... )
        >>> point = SimpleNamespace(
        ...     state=SimpleNamespace(experiment=experiment, bounds=(0.5, 9.0)), tail=tail,
        ...     stress=1.5, probability=0.01, cv=0.3, members_cv=0.1, members=np.zeros(0),
        ... )
        >>> answer = Answer.at(point, (0.004, 0.02))
        >>> answer.interval, answer.stress, answer.probability, answer.cv, answer.members_cv
        ({'probability': (0.004, 0.02)}, 1.5, 0.01, 0.3, 0.1)
        >>> answer.first_stage_evaluations, answer.evaluations, answer.lower_bound, answer.survived
        (11, 80, 0.5, 0.25)
        >>> design = Answer.at(point, (1.0, 2.0), of_stress=True, cv=0.2)
        >>> design.interval, design.cv
        ({'stress': (1.0, 2.0), 'force': (3.0, 6.0), 'friction_coefficient': (0.25, 0.5)}, 0.2)

        Without an area and a pressure:

        >>> problem.area, experiment.pressure = None, math.nan
        >>> Answer.at(point, (1.0, 2.0), of_stress=True).interval
        {'stress': (1.0, 2.0)}
        """
        for text in doubts:
            warn_accuracy(text)
        state, tail = point.state, point.tail
        pressure, area = state.experiment.pressure, state.experiment.problem.area or math.nan
        scales = {"probability": 1.0}
        if more.get("of_stress"):
            scales = {"stress": 1.0, "force": area, "friction_coefficient": 1.0 / pressure}
        interval = {
            name: (ends[0] * scale, ends[1] * scale)
            for name, scale in scales.items()
            if not math.isnan(scale)
        }
        known = {name: getattr(point, name) for name in ESTIMATED if name not in more}
        return cls(
            interval=interval,
            lower_bound=state.bounds[0],
            normal_pressure=pressure,
            area=area,
            experiment=state.experiment,
            evaluations=tail.spent,
            first_stage_evaluations=sum(d.first_stage_evaluations for d in tail.repetitions),
            algorithm=tail.algorithm,
            reason=tail.reason,
            survived=tail.survived,
            warnings=(),
            **known,
            **more,
        )

    @property
    def friction_coefficient(self) -> float:
        """`stress` over the mean normal pressure, or NaN without a pressure."""
        return self.stress / self.normal_pressure

    @property
    def force(self) -> float:
        """`stress` times the interface area, N, or NaN if the area is unknown."""
        return self.stress * self.area

    @property
    def partial_factor(self) -> float:
        """Characteristic value over the design value."""
        return self.characteristic_stress / self.stress

    @property
    def reliability_index(self) -> float:
        """Reliability index beta: a normal variable is below -beta with this probability."""
        return -float(ndtri(self.probability))

    @property
    def by_family(self) -> dict[str, float]:
        """Stress, Pa, for each distribution between specimens, if several are likely."""
        start = "stress by "
        families = self.sensitivities.attrs.items()
        return {name.removeprefix(start): v for name, v in families if name.startswith(start)}

    @property
    def band(self) -> tuple[float, float]:
        """90 % band of the probability over equally likely interfaces, NaN for a single interface.

        The probability is at most the first number for 5 % of the
        interfaces, and at most the second number for 95 %. More tests
        make the band narrower. The sampling error of each interface
        makes the band too wide, and a smaller `target_cv` reduces this
        error. An end is NaN if `members` is NaN at its rank, which is
        usual for lists of thousands. Use a list of tens in this case.
        `interval` shows the error of the mean.
        """
        return band_of(self.members)

    @property
    def stress_above_bound(self) -> float:
        """`stress` minus `lower_bound`, Pa."""
        return self.stress - self.lower_bound

    @checked
    def write_page(
        self,
        path: FilePath,
        *,
        evidence: Sequence[Any] = (),
        sources: Mapping[str, str] | None = None,
        title: Text = "Design of a joint",
    ) -> Path:
        """Write a design as an HTML page: force, inputs, evidence, doubts and sensitivities.

        Parameters
        ----------
        path : path
            HTML file.
        evidence : sequence
            Further results that are printed on the page, such as an
            agreement, with their doubts. The fit or posterior of the
            design, its peaks and its agreement are printed in any case.
        sources : mapping, optional
            The sources of inputs by dotted key, such as
            ``{"load.pressing_force": "drawing 12"}``. An input without
            a source is called 'assumed'.
        title : str

        Returns
        -------
        path
            The file.

        Raises
        ------
        InputError
            If the answer is not a design.
        StoreError
            If the file cannot be written.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> import stiction as st
        >>> problem = st.paper.problem(nodes=256)
        >>> strength = st.paper.strength(problem, correlation_ratio=1.0)
        >>> design = st.design_stress(
        ...     problem, strength, probability=1e-2, method=st.LocalCriterion(), target_cv=0.3
        ... )
        >>> page = design.write_page(Path(tempfile.mkdtemp()) / "design.html")
        >>> "reliability index" in page.read_text()
        True
        """
        # The page is drawn by an upper layer, which is imported when it is needed.
        pages = import_module("stiction.cli.pages")
        pages.write_design(self, Path(path), evidence, sources or {}, title)
        return Path(path)

    @property
    def _demand(self) -> tuple[str, float]:
        """Unit of the demand, and the factor from stresses: N if the area is known, else Pa."""
        return ("Pa", 1.0) if math.isnan(self.area) else ("N", self.area)

    def _summary(self) -> Summary:
        """>>> sensitivities = xr.Dataset(attrs={"stress by normal": 2.6, "stress": 2.5})
        >>> design = Answer(
        ...     stress=2.5, probability=0.001, interval={"stress": (2.25, 2.75)}, cv=0.5,
        ...     evaluations=70, lower_bound=0.5, algorithm="subset", reason="rare",
        ...     normal_pressure=5.0, of_stress=True, characteristic_stress=4.0, experiment=None,
        ...     sensitivities=sensitivities, warnings=("careful",), doubts=("few tests",),
        ...     members=np.array([0.0, 0.002, 0.001]),
        ... )
        >>> print(design)  # doctest: +NORMALIZE_WHITESPACE
        Design value
                                          value    90 % interval     unit
          stress                          2.5      2.25 to 2.75      Pa
          friction coefficient            0.5
          probability                     0.001
          coefficient of variation        0.5
          90 % of interfaces are between  0.0001   0.0001 to 0.0019
          reliability index               3.09023
          lower bound of the stress       0.5                        Pa
          5 % value, confidence 75 %      4                          Pa
          partial factor                  1.6
          subset, 70 evaluations: rare
          careful
          few tests
        >>> design.stress_above_bound, design.by_family, math.isnan(design.force)
        (2.0, {'normal': 2.6}, True)

        With an area, in order of the requested quantity. An exact answer has
        no interval.

        >>> from dataclasses import replace
        >>> force = replace(design, area=4.0, quantity="force")
        >>> force.force, [row.name for row in force._summary().rows][:4]
        (10.0, ['force', 'stress', 'friction coefficient', 'probability'])
        >>> [row.value for row in force._summary().rows if row.name.startswith("5 %")]
        [16.0]
        >>> chance = replace(force, of_stress=False, cv=0.0, algorithm="exact", survived=0.125)
        >>> [(row.name, row.value, row.interval) for row in chance._summary().rows][:2]
        [('probability', 0.001, ()), ('force', 10.0, ())]
        >>> [row.value for row in chance._summary().rows if row.name.startswith("fraction")]
        [0.125]
        >>> chance._summary().title, replace(chance, stress=math.inf)._summary().title
        ('Probability of sliding', 'No stress has this probability')
        """
        values = {
            "probability": (self.probability, ""),
            "stress": (self.stress, "Pa"),
            "force": (self.force, "N"),
            "friction_coefficient": (self.friction_coefficient, "1"),
        }
        # The estimated number comes first, or else the requested
        # quantity of a design, and then the given number.
        first = self.quantity if self.of_stress else "probability"
        order = dict.fromkeys([first, self.quantity, *values])
        names = sorted(order, key=lambda name: name == "probability" and self.of_stress)
        interval = {} if self.algorithm == "exact" and not self.cv else self.interval
        unit, scale = self._demand
        characteristic, low, high = scale * self.characteristic_stress, *self.band
        rows = []
        for name in names:
            value, si = values[name]
            rows.append(Row(name.replace("_", " "), value, interval.get(name, ()), si))
        rows += [
            Row("coefficient of variation", self.cv or math.nan),
            Row("of which by choice of the interfaces", self.members_cv or math.nan),
            Row("90 % of interfaces are between", low, self.band),
            Row("95 % of interfaces have at most", high if math.isnan(low) else math.nan),
            Row("fraction that survives any stress", self.survived or math.nan),
            Row("reliability index", self.reliability_index),
            Row("lower bound of the stress", self.lower_bound or math.nan, (), "Pa"),
            Row(f"5 % value, confidence {100 * self.confidence:g} %", characteristic, (), unit),
            Row("partial factor", self.partial_factor),
        ]
        known = [row for row in rows if math.isfinite(row.value)]
        title = "Design value" if self.of_stress else "Probability of sliding"
        if math.isinf(self.stress):
            title = "No stress has this probability"
        notes = [f"{self.algorithm}, {self.evaluations} evaluations: {self.reason}"]
        if moves := moves_of(self):
            notes.append(
                "interval: errors of the computation only. Sensitivities of the design:"
            )
        for source, least, most, *designs in moves:
            ends = " to ".join(filter(None, (least, most)))
            notes.append(f"  {source}: {ends}: {' to '.join(filter(None, designs))}")
        notes += [*self.warnings, *self.doubts, *unseen_batch(self.specimens)]
        return Summary(title, known, "90 % interval", notes)


def moves_of(design: Answer) -> list[tuple[str, str, str, str, str]]:
    """Return the sensitivities of a design in words: source, ends, and the design at both ends.

    A distribution between specimens has a single design.

    >>> from types import SimpleNamespace
    >>> columns = {"low": ["0.6", "absent"], "high": ["0.8", "as stated"]}
    >>> columns |= {"stress_at_low": [10.0, 15.0], "stress_at_high": [20.0, 12.0]}
    >>> effects = xr.Dataset({name: ("source", values) for name, values in columns.items()})
    >>> effects = effects.assign_coords(source=["ratio", "field"])
    >>> design = SimpleNamespace(sensitivities=effects, _demand=("N", 3.0))
    >>> design.by_family = {"normal": 7.0}
    >>> for row in moves_of(design):
    ...     print(row)
    ('ratio', '0.6', '0.8', '30 N', '60 N')
    ('field', 'absent', 'as stated', '45 N', '36 N')
    ('scatter of specimens', 'normal', '', '21 N', '')
    >>> design.sensitivities = xr.Dataset()
    >>> moves_of(design)
    []
    """
    effects, (unit, scale) = design.sensitivities, design._demand
    if not effects.sizes.get("source"):
        return []

    def words(stress: float) -> str:
        return in_words(unit, scale * stress)

    rows = [
        (str(row.Index), row.low, row.high, words(row.stress_at_low), words(row.stress_at_high))
        for row in effects.to_dataframe().itertuples()
    ]
    families = design.by_family.items()
    return rows + [("scatter of specimens", name, "", words(v), "") for name, v in families]


def unseen_batch(specimens: int) -> list[str]:
    """Return a sentence on the weak batch that some specimens cannot exclude (95 %).

    If a quarter of all specimens were weak, 10 specimens would miss them
    with a probability of 0.75^10 = 0.056.

    >>> unseen_batch(10)
    ['10 specimens cannot exclude a weaker batch of up to 26% of all specimens']
    >>> unseen_batch(0)
    []
    """
    if not specimens:
        return []
    unseen = 1.0 - (1.0 - UNSEEN_CONFIDENCE) ** (1.0 / specimens)
    return [
        f"{specimens} specimens cannot exclude a weaker batch of up to"
        f" {unseen:.0%} of all specimens"
    ]


def band_of(members: Array) -> tuple[float, float]:
    """Return the 90 % band over equally likely interfaces.

    An end is NaN if its value is NaN.

    >>> low, high = band_of(np.array([0.4, 0.0, 0.2]))  # a tenth of a rank from both ends
    >>> round(low, 6), round(high, 6), band_of(np.zeros(0))
    (0.02, 0.38, (nan, nan))

    An unknown probability is below 0.2, but above an exact zero:

    >>> low, high = band_of(np.array([0.4, math.nan, 0.2]))
    >>> low, round(high, 6)
    (nan, 0.38)
    >>> band_of(np.array([0.4, math.nan, 0.0]))
    (nan, nan)

    With 21 interfaces the ends are the values of ranks 1 and 19:

    >>> for least in ([math.nan, 0.0, 0.0], [0.0, math.nan, 0.3], [math.nan, 0.3, 0.5]):
    ...     print(band_of(np.array([*least, *18 * [0.4]])))
    (0.0, 0.4)
    (nan, 0.4)
    (0.3, 0.4)
    """
    if not members.size:
        return math.nan, math.nan
    # Unknown probabilities are small, but above those that are exactly zero.
    shares = np.array([0.05, 0.95])
    ends = np.quantile(np.nan_to_num(members), shares)
    zeros, known_from = np.sum(members == 0.0), np.sum(~(members > 0.0))
    # A quantile lies between the two ranks around it. It is unknown if
    # either is unknown.
    ranks = shares * (members.size - 1)
    hidden = (zeros < known_from) & (np.ceil(ranks) >= zeros) & (np.floor(ranks) < known_from)
    low, high = np.where(hidden, math.nan, ends).tolist()
    return low, high
