"""Combine profiles and peaks: onsets of fields within specimens, posterior and agreement.

See `stiction.inference.specimens` for the model, its sources and the steps. This
file contains step 1, the simulation, and the result with its notes.
"""

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from scipy.stats import entropy

from stiction.base.arrays import Array
from stiction.base.errors import InputError, warn_accuracy
from stiction.base.model import Count, Number, checked
from stiction.base.representation import Summary
from stiction.ensemble.batches import in_threads, usable_cores
from stiction.ensemble.limit_state import scales_with_strength
from stiction.inference.agreement import DOUBTFUL_P_VALUE, Agreement, agreement
from stiction.inference.density import tabulate
from stiction.inference.fit import FieldFit
from stiction.inference.likelihood import (
    SPECIMEN,
    Simulation,
    bounds_of,
    experiment_on,
    simulate,
    variable_of,
    warn_if_long,
)
from stiction.inference.peaks import Peaks
from stiction.inference.posterior import POSTERIOR_DRAWS, Posterior
from stiction.inference.prior import refuse_conditioned
from stiction.inference.specimens import (
    MEAN_KEY,
    ONSET_MEANS,
    SCATTER_KEY,
    FactorPrior,
    Grid,
    Onsets,
    Profiles,
    Tables,
    families_of,
    grid_of_profiles,
    of_mean,
)
from stiction.problem.problem import Problem
from stiction.random.equally_likely import Source, as_random
from stiction.random.fields import RandomInterface

LIKELY_FIELDS = 60
"""Fields within a specimen that represent all likely fields."""
ONSETS = {"local_criterion": 200}
FEW_ONSETS = 100
"""Simulated onsets of each field by other methods."""
LITTLE_INFORMATION = math.log(4.0 / 3.0)
"""Information on the scatter, nats, below which its prior decides: a uniform range would shrink
by less than a quarter."""
LOG_STRENGTH_MARGIN = 0.3
"""Distance in the logarithm of the strength by which simulated means exceed the range of peaks."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SpecimenPosterior(Posterior):
    """Posterior of the mean, the scatter between specimens and the field within a specimen.

    Attributes
    ----------
    families : dict of str to float
        Posterior probability of each family for the factor between specimens.
    agreement : Agreement or None
        Agreement of the peaks with the prediction from the profiles alone. None
        without profiles.
    """

    grid: Grid = field(repr=False, compare=False)
    by_profiles: Grid = field(repr=False, compare=False)
    agreement: Agreement | None = field(default=None, repr=False)

    @property
    def specimens(self) -> int:
        """Number of specimens that were scanned or tested."""
        return self.grid.profiles.levels.size + sum(map(len, self.peaks.values))

    @property
    def families(self) -> dict[str, float]:
        """Posterior probability of each family for the factor between specimens."""
        return self.grid.families

    @cached_property
    def before(self) -> dict[str, Array]:
        """Draws from the posterior given the profiles alone, or from the prior without profiles."""
        rng = np.random.default_rng([self.seed, 7])
        return self.by_profiles.described(self.by_profiles.draws(POSTERIOR_DRAWS, rng))

    def at(self, draw: int) -> tuple[Problem, RandomInterface]:
        """Return the problem and the random interface at a draw."""
        return self.problem, self.grid.interface(self.u[draw])

    @checked
    def interfaces(self, count: Count, seed: Number = 0) -> list[RandomInterface]:
        """Return equally likely random interfaces. They are draws from the posterior.

        Parameters
        ----------
        count : int
            Number of interfaces. A longer list does not begin with a shorter list.
        seed : int
            Not negative.
        """
        drawn = self.grid.draws(count, np.random.default_rng([seed, 4]))
        return [self.grid.interface(row) for row in drawn]

    @property
    def prior(self) -> Any:
        """Raise an `InputError`, because fields within a specimen have no prior of parameters."""
        raise InputError(
            "prior: this posterior has no parameters with a prior, because it holds fields within a"
            " specimen. `prior_transform` and `log_likelihood` need a posterior from st.infer with"
            " prior="
        )

    def _summary(self) -> Summary:
        summary = super()._summary()
        shares = ", ".join(f"{name} {share:.0%}" for name, share in self.families.items())
        notes = [*summary.notes, f"families of the factor between specimens: {shares}"]
        if self.agreement is not None:
            p = min(self.agreement.p_values.values())
            notes.append(f"agreement of peaks and profiles: p = {p:.2g}")
        return summary._replace(notes=notes)


def profiles_of(random: Any, prior: Any, families: Any, seed: int) -> Profiles:
    """Return the profiles of a fit, or the fields of any other source, which has no levels."""
    more: dict[str, Any] = {} if prior is None else {"prior": FactorPrior.of(prior)}
    more |= {} if families is None else {"families": families_of(families)}
    if isinstance(random, FieldFit):
        return random.profiles(LIKELY_FIELDS, seed)._replace(**more)
    if isinstance(random, Posterior):
        raise InputError(
            "random: is a posterior. Give its fit or interfaces, and all peaks together"
        )
    given = random.interfaces(LIKELY_FIELDS, seed) if isinstance(random, Source) else random
    likely = as_random(given)
    if len(likely.factor_laws[0]) > 1:
        raise InputError(
            "random: holds draws of mean and scatter between specimens, as a stored fit or"
            " posterior does. Fit the profiles again, and infer from the fit and all peaks at once."
            " For the fields within alone, pass [one.strength for one in random]"
        )
    members = likely.members
    refuse_conditioned(members)
    return Profiles.of_interfaces(members, **more)


def join(
    problem: Problem,
    random: Any,
    measured: Peaks,
    simulation: Simulation,
    *,
    prior: Any,
    between: Any,
    error: float,
) -> SpecimenPosterior:
    """Return the posterior of mean and scatter between specimens, from profiles and peaks."""
    profiles = profiles_of(random, prior, between, simulation.seed)
    variable = variable_of(problem, profiles.fields[0], measured.unit)
    pairs = zip(measured.lengths, measured.values, strict=True)
    kinds = [
        simulated_onsets(profiles, problem, simulation, length, peaks, number, error, variable)
        for number, (length, peaks) in enumerate(pairs)
    ]
    known = profiles.levels.size > 0
    if known:
        mean = float(profiles.levels.mean() / profiles.reference)
        measured.refuse_far([kind.area * mean * kind.ratios[:, 0].ravel() for kind in kinds])
    tables = Tables(profiles, simulation.method, tuple(kinds), error, tuple(measured.values))
    by_profiles, grid = grid_of_profiles(profiles, tables)
    tests, onsets = sum(map(np.size, measured.values)), kinds[0].ratios[:, 0].size
    common: dict[str, Any] = {
        "problem": problem, "likelihood": tables, "seed": simulation.seed,
        "by_profiles": by_profiles, "monte_carlo_error": math.sqrt(tests / onsets),
    }  # fmt: skip
    comparison = None
    if known:
        nothing = measured._replace(values=tuple(np.empty(0) for _ in kinds))
        alone = _result(by_profiles, nothing, **common)
        comparison = agreement(alone, measured, seed=simulation.seed)
    notes = _notes(grid, comparison)
    for text in notes:
        warn_accuracy(text)
    proper = known or profiles.prior.mean is not None
    evidence = grid.log_evidence if proper else math.nan
    return _result(
        grid, measured, notes=tuple(notes), agreement=comparison, log_evidence=evidence,
        information=_information(grid, by_profiles, proper), **common,
    )  # fmt: skip


def _result(grid: Grid, peaks: Peaks, **more: Any) -> SpecimenPosterior:
    u = grid.draws(POSTERIOR_DRAWS, np.random.default_rng(more["seed"]))
    options: dict[str, Any] = {"information": {}, "log_evidence": math.nan, "notes": ()} | more
    return SpecimenPosterior(peaks=peaks, draws=grid.described(u), u=u, grid=grid, **options)


def simulated_onsets(
    profiles: Profiles,
    problem: Problem,
    simulation: Simulation,
    length: float | None,
    peaks: Array,
    number: int,
    error: float,
    variable: str,
) -> Onsets:
    """Return the onsets of all fields for one kind of specimen (step 1)."""
    method, meter, workers = simulation.method, simulation.meter, simulation.workers
    samples = simulation.samples or ONSETS.get(method.type, FEW_ONSETS)
    simulation = simulation._replace(samples=samples, workers=1)  # fields run in threads
    first = experiment_on(problem, profiles.fields[0], method, length)
    forces = variable == "critical_force"
    area = (first.problem.area or math.nan) if forces else 1.0
    of = "critical_stress" if forces else variable

    def onsets(place: int, at: Array) -> tuple[Array, Any]:
        """Return onsets (steps, samples) divided by c/reference, and their densities."""
        strengths = np.exp(at)
        fields = [of_mean(profiles.fields[place], c * profiles.reference) for c in strengths]
        experiments = [experiment_on(problem, field, method, length) for field in fields]
        start = number * SPECIMEN + place * samples
        relative = simulate(experiments, simulation, start, of) / strengths[:, None]
        if not np.isfinite(relative).all() or relative.min() <= 0.0:
            raise InputError("method: some simulated specimens have no positive onset")
        bounds = np.array([bounds_of(one, of)[0] for one in experiments]) / strengths
        return relative, tabulate(relative, np.maximum(bounds, 0.0))

    at, fields = np.zeros(1), len(profiles.fields)
    if not scales_with_strength(problem, profiles.fields[0], method):
        ratios, known = onsets(0, at)
        peaks = peaks if peaks.size else area * ratios.ravel()
        low, high, _ = Onsets(at, ratios[None], (known,), area).ranges(peaks, error)
        at = np.linspace(low - LOG_STRENGTH_MARGIN, high + LOG_STRENGTH_MARGIN, ONSET_MEANS)
    warn_if_long(first, fields * at.size * samples, workers)
    meter.stage("simulated onsets", fields * at.size * samples)
    by_field = in_threads(
        lambda place: onsets(place, at), range(fields), workers or usable_cores()
    )
    # Standardised densities differ little between fields. Their mean has a
    # smaller error.
    table = np.log(np.mean([np.exp(known.table) for _, known in by_field], axis=0))
    densities = tuple(known._replace(table=table) for _, known in by_field)
    return Onsets(at, np.stack([ratios for ratios, _ in by_field]), densities, area)


def _information(grid: Grid, before: Grid, proper: bool) -> dict[str, float]:
    """Return the divergence, nats, of mean and scatter from their distribution without peaks."""
    axes = {SCATTER_KEY: (0, 1, 3)} | ({MEAN_KEY: (0, 1, 2)} if proper else {})
    return {
        name: float(entropy(grid.mass.sum(axis=of), before.mass.sum(axis=of)))
        for name, of in axes.items()
    }


def _notes(grid: Grid, comparison: Agreement | None) -> list[str]:
    """Return the reasons to doubt the posterior."""
    notes, profiles = [], grid.profiles
    if comparison is not None and (p := min(comparison.p_values.values())) < DOUBTFUL_P_VALUE:
        notes.append(
            f"the peaks contradict the profiles, p = {p:.2g} of their agreement. A force from"
            " both is then wrong. Check units, method and surfaces. Until they agree, use the lower"
            " of the two forces from peaks alone and from profiles alone"
        )
    shares = grid.mass.sum(axis=(0, 1, 3))  # equal by the prior
    usual = profiles.prior.scatter is FactorPrior().scatter
    if usual and math.log(shares.size) - float(entropy(shares)) < LITTLE_INFORMATION:
        notes.append(
            "the measurements say little about the scatter between specimens, so its prior decides"
            " small probabilities. Measure further specimens, or state what is known,"
            f" prior={{'{SCATTER_KEY}': ...}}"
        )
    if profiles.levels.size == 1:
        notes.append(
            "the profiles come from one specimen. The tested specimens are taken to have the same"
            " field within, and the tests alone show the scatter between specimens. Scan further"
            " specimens. If the records are of different specimens, fit them with between=True"
        )
    return notes
