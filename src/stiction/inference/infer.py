"""Infer parameters of a random interface from peaks in repeated tests.

Problem. Find the posterior p(theta | y) of parameters theta with a
prior from measured peaks y.

Source. Bayes' theorem is evaluated on a grid, as in
Gelman and others, Bayesian Data Analysis (2013),
section 10.1. The choice of the box is our own.

Steps:

1. If only the mean and the scatter between specimens are unknown, use
   the grid of `stiction.inference.specimens`. Compare the peaks with
   the prediction from the profiles alone. The other steps are for
   parameters with a prior.
2. Refuse peaks that lie beyond the bounds
   of the onset everywhere in the prior.
3. If the method is expensive and the local criterion applies, first
   find the posterior by the local criterion. The box around this
   posterior, slightly widened, is the relevant part of the prior.
   Otherwise use the whole prior.
4. Simulate onsets in this box (`likelihood`), and sum the posterior on
   a grid (`posterior`).
5. If the posterior reaches an end of the box, widen the box on this
   side and repeat step 4.
"""

import itertools
import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from scipy.stats import entropy

from stiction.base.arrays import Array
from stiction.base.errors import InputError, prefixed, warn_accuracy
from stiction.base.model import Count, NotNegative, Number, Progress, checked
from stiction.base.progress import Meter
from stiction.ensemble.pilot import compare, pilot_doubt
from stiction.inference.agreement import Agreement, agreement
from stiction.inference.fit import FieldFit
from stiction.inference.likelihood import (
    Likelihood,
    Simulation,
    bounds_of,
    experiments_at,
    is_guided,
    make_likelihood,
    out_of_reach,
    variable_of,
)
from stiction.inference.peaks import Peaks, peaks_and_error
from stiction.inference.posterior import POSTERIOR_DRAWS, Posterior, SpecimenPosterior, grid_of
from stiction.inference.prior import Prior, make_prior, refuse_conditioned
from stiction.inference.specimens import (
    MEAN_KEY,
    SCATTER_KEY,
    FactorGrid,
    FactorPrior,
    Profiles,
    families_of,
    grid_of_profiles,
    of_mean,
    tables_of,
)
from stiction.methods.criterion.local import LocalCriterion
from stiction.methods.equilibrium.method import Equilibrium
from stiction.methods.protocol import MethodObject
from stiction.problem.checks import doubt_strengths
from stiction.problem.problem import Problem
from stiction.random.equally_likely import AnyRandom, Source, as_random, specimens_of_fit
from stiction.random.stresses import mean_in_stress

LIKELY_FIELDS = 60
"""Number of fields within a specimen that represent all likely fields."""
LITTLE_INFORMATION = math.log(4.0 / 3.0)
"""Information on the scatter, nats, below which its prior controls the
result: a uniform range would shrink by less than a quarter."""
TOLERABLE = 0.25
"""Monte Carlo error over the standard deviation of the posterior above
which a note reports it."""
NEVER = 1e-9
"""Neglected probability of a peak outside the bounds of the onset."""
WIDEN = 0.1
"""Fraction of the width of the first posterior by which its box is
widened on either side."""
BOX_END_SHARE, HELD = 0.05, 1e-3
"""Fraction of the box at either end, and posterior mass there above
which the box grows."""
PRIOR_END, PILED = 0.02, 4.0
"""Fraction of a prior at either end, and multiple of it above which the
posterior piles up."""
OUTWARDS = np.array([[-1.0], [1.0]])
"""Directions in which the lower and the upper corner of a box move when
it grows."""


@checked
def infer(
    problem: Problem,
    random: AnyRandom | None,
    peaks: Any,
    *,
    prior: Any = None,
    between: Any = None,
    method: MethodObject | None = None,
    load_cell_error: NotNegative = 0.0,
    unit: str | None = None,
    samples: Annotated[Count, Field(ge=100)] | None = None,
    seed: Number = 0,
    workers: Count | None = None,
    progress: Progress = True,
) -> Posterior:
    """Infer parameters of the random strength from peak stresses in repeated tests.

    The result is the mean strength and its scatter between specimens, unless `prior`
    names other parameters.

    Parameters
    ----------
    problem : Problem
        One specimen.
    random : RandomInterface, RandomField, a fit, a list of interfaces, or None
        If None, specimens differ only as a whole, and a joint is a new specimen. For
        mean and scatter: a fit, whose records are combined with the peaks, or equally
        likely fields within a specimen. For other parameters: one interface.
    peaks : array, mapping of arrays, or Peaks
        Mean shear stress or force at which each specimen slid, in `unit`, or the result
        of `read_peaks`. Repeated slip loads of one specimen count as their mean. For
        specimens of several lengths (m): ``{0.1: [...], 0.2: [...]}``.
    prior : mapping, optional
        ``"mean"``, by default flat in its logarithm, and ``"between"``, the coefficient
        of variation between specimens, by default half-Cauchy with scale 0.1. Or other
        parameters by the keys of a sweep, such as ``"correlation_length"``. A prior is a
        frozen `scipy.stats` distribution, a range, or ``{"low": ..., "high": ...,
        "spacing": "log"}``.
    between : str or sequence of str, optional
        Families of the factor between specimens, as in `fit_field`. By
        default of the fit, or all.
    method : LocalCriterion, Equilibrium or any other
        Method that computes the onset. May be left out if `random` is None.
    load_cell_error : float
        Standard error of a peak, in `unit` (SI if `Peaks` are given).
    unit : str, optional
        Unit of peaks and error, needed by plain numbers. Forces need an area, "1" a pressure.
    samples : int, optional
        Simulated specimens at each point (2000 by the local criterion,
        else 500), or for each field within a specimen (200, else 100).
    seed, workers, progress
        As in `monte_carlo`.

    Returns
    -------
    Posterior
        With `draws`, `mean`, `interval` and `information` (nats).

    Raises
    ------
    InputError
        If any argument is invalid, or no parameters in the prior can
        produce the peaks.

    Warns
    -----
    AccuracyWarning
        For each of the `notes`: the prior determines the result, the
        method or the number of samples is inaccurate, or profiles and
        peaks contradict each other.
    UserWarning
        Before a simulation that takes more than a minute.

    Notes
    -----
    The posterior is summed on a grid, with a kernel density of
    simulated onsets as likelihood (`stiction.inference.infer` has the
    steps). At most four parameters are simulated, besides those that
    only shift and stretch the strength.

    Examples
    --------
    >>> import stiction as st
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=0.5)
    >>> peaks = [0.695, 0.702, 0.731, 0.688, 0.715]
    >>> prior = {"marginal.low": (0.5e6, 0.8e6), "marginal.high": (1.2e6, 2.0e6)}
    >>> local = st.LocalCriterion()
    >>> posterior = st.infer(problem, strength, peaks, unit="MPa", prior=prior, method=local)
    >>> low, high = posterior.interval["marginal.low"]
    >>> 0.5e6 < low < high < 0.75e6
    True
    """
    measured, error = peaks_and_error(peaks, unit, load_cell_error)
    of_specimens = isinstance(prior, Mapping) and {*prior} <= {MEAN_KEY, SCATTER_KEY}
    of_parameters = prior is not None and not of_specimens
    if method is None:
        if random is not None:
            raise InputError("method: is needed with a random interface. Give st.Equilibrium()")
        method = Equilibrium()
    if random is None and of_parameters:
        raise InputError("random: was not given, so the prior can hold mean and between only")
    # Tests of a single length must be tests of the problem. A posterior
    # from several lengths holds for any problem.
    (length, *further), size = measured.lengths, problem.interface.measure
    several = bool(further) or problem.interface.is_plane
    if not (several or length is None or math.isclose(length, size)):
        raise InputError(
            f"peaks: the specimens are {length:g} m long, but the problem is {size:g} m. Pass"
            " the problem of the tests. The posterior is valid for other problems, too"
        )
    with Meter("infer", show=progress) as meter:
        simulation = Simulation(method, samples, seed, workers, meter)
        if of_parameters:
            if between is not None:
                raise InputError("between: has no effect with this prior. Leave it out")
            unknown = make_prior(problem, random, prior)
            posterior = _of_parameters(unknown, simulation, measured, error)
        else:
            # 1.
            source = Profiles.without_field(problem, measured) if random is None else random
            profiles = profiles_of(source, prior, between, seed)
            posterior = _of_specimens(problem, profiles, simulation, measured, error)
    for text in posterior.notes:
        warn_accuracy(text)
    return posterior


def _of_parameters(
    prior: Prior, simulation: Simulation, measured: Peaks, error: float
) -> Posterior:
    """Return the posterior for the parameters in a prior (steps 2 to 5).

    One parameter x = 10 u has a normal likelihood, and the simulation is
    replaced. The local criterion finds u = 0.3, and the method 0.45, so the
    box of the local criterion must grow.

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> class Normal(SimpleNamespace):
    ...     def of(self, peaks):
    ...         return self
    ...     def __call__(self, u):
    ...         return self.top - 0.5 * ((u[:, 0] - self.at) / 0.01) ** 2
    ...     def refusals(self):
    ...         return self.refused
    >>> prior = SimpleNamespace(
    ...     names=("x",), middle=None, at=lambda u: (None, None), theta=lambda u: 10.0 * u,
    ...     ends=np.array([[0.0, 10.0]]), whole=np.array([[0.0], [1.0]]))
    >>> peaks = Peaks((0.1, 0.2), (np.ones(2), np.ones(3)), "Pa")
    >>> def posterior(guided, top=0.0, refused=(), far=()):
    ...     boxes = []
    ...     def likelihood(prior, simulation, box, **given):
    ...         boxes.append(box.ravel().tolist())
    ...         local = isinstance(simulation.method, LocalCriterion)
    ...         return Normal(at=0.3 if local else 0.45, samples=500, top=top, refused=refused)
    ...     changed = {
    ...         "variable_of": lambda *_: "critical_stress", "doubt_strengths": lambda *_: None,
    ...         "mean_in_stress": lambda *_: None, "experiments_at": lambda *_: [None, None],
    ...         "bounds_of": lambda *_: (0.0, 1.0), "out_of_reach": lambda *_: [*far],
    ...         "is_guided": lambda *_: guided, "make_likelihood": likelihood,
    ...         "_notes": lambda *_: []}
    ...     with patch.multiple("stiction.inference.infer", **changed):
    ...         setting = Simulation(Equilibrium(), None, 0)
    ...         return _of_parameters(prior, setting, peaks, 0.0), boxes
    >>> for guided in (False, True):
    ...     found, boxes = posterior(guided)
    ...     evidence = math.log(0.01 * math.sqrt(2.0 * math.pi))
    ...     print(f"{found.mean['x']:.2f} {found.log_evidence / evidence:.3f}",
    ...           f"{found.information['x'] / (-evidence - 0.5):.3f}", found.monte_carlo_error)
    4.50 1.000 1.000 0.1
    4.50 1.000 1.000 0.1
    >>> boxes[0], boxes[1][1] < 0.45 < boxes[-1][1] < 1.0, len(boxes) > 2
    ([0.0, 1.0], True, True)
    >>> (low,), (high,) = grid_of(Normal(at=0.3, top=0.0), prior.whole).box
    >>> width = high - low
    >>> bool(np.allclose(boxes[1], [low - 0.1 * width, high + 0.1 * width]))
    True
    >>> posterior(False, refused=["peak 9 is out of reach"])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: peak 9 is out of reach
    >>> posterior(True, top=-math.inf)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: peaks: no parameters within ...
    >>> posterior(False, far=["far"])
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: far
    far
    """
    tested, middle = prior.at(prior.middle)
    variable = variable_of(tested, middle, measured.unit)
    doubt_strengths(tested, mean_in_stress(tested, middle, "strength"))
    # 2.
    points = np.array(list(itertools.product(*prior.ends.T)))
    problems = []
    for length, peaks in zip(measured.lengths, measured.values, strict=True):
        experiments = experiments_at(prior, points, simulation.method, length)
        reach = [bounds_of(own, measured.variable, NEVER) for own in experiments]
        problems += out_of_reach(prior, points, np.transpose(reach), error, peaks)
    if problems:
        raise InputError(problems)

    def likelihood_of(simulation: Simulation, box: Array) -> Likelihood:
        given: Any = {"lengths": measured.lengths, "error": error, "variable": variable}
        return make_likelihood(prior, simulation, box, **given).of(measured.values)

    # 3.
    box = prior.whole
    if is_guided(prior, simulation.method):
        local = likelihood_of(simulation._replace(method=LocalCriterion(), samples=None), box)
        # Other methods may produce peaks that the local criterion cannot
        # produce, if nodes reach their residual strength before the onset.
        first = None if local.refusals() else grid_of(local, box)
        if first is not None:
            room = np.maximum(WIDEN * np.diff(first.box, axis=0), 1e-3)
            box = np.clip(first.box + room * OUTWARDS, 0.0, 1.0)
    while True:
        # 4.
        likelihood = likelihood_of(simulation, box)
        grid = grid_of(likelihood, box)
        u = None if grid is None else grid.draws(POSTERIOR_DRAWS, simulation.seed)
        # 5.
        wider = _grown(box, u)
        if np.array_equal(wider, box):
            break
        box = wider
    # In the whole prior, no further box can
    # contain peaks that are out of reach.
    refused = likelihood.refusals() if np.all(box == prior.whole) else []
    if refused or grid is None or u is None:
        raise InputError(
            refused
            or "peaks: no parameters within the prior produce all peaks. Widen the prior, or"
            " pass load_cell_error="
        )
    relative_error = math.sqrt(sum(map(np.size, measured.values)) / likelihood.samples)
    return Posterior(
        peaks=measured, draws=dict(zip(prior.names, prior.theta(u).T, strict=True)), u=u,
        information={name: grid.information(i) for i, name in enumerate(prior.names)},
        log_evidence=grid.log_evidence, monte_carlo_error=relative_error,
        notes=tuple(_notes(likelihood, relative_error, u)), likelihood=likelihood,
        seed=simulation.seed,
    )  # fmt: skip


def _grown(box: Array, u: Array | None) -> Array:
    """Return the box, widened at the ends that draws (draws, parameters) reach (step 5).

    A box grows by its width at the ends that more than 0.1 % of the
    draws reach.

    >>> box = np.array([[0.4, 0.3], [0.6, 0.35]])
    >>> u = np.full((2000, 2), [0.5, 0.32])
    >>> u[:3] = [[0.409, 0.32], [0.409, 0.3481], [0.409, 0.3481]]
    >>> _grown(box, u).round(6).tolist()
    [[0.2, 0.3], [0.6, 0.35]]
    >>> u[3] = 0.591, 0.3481
    >>> _grown(box, u).round(6).tolist()  # 3 of 2000 draws reach the upper end
    [[0.2, 0.3], [0.6, 0.4]]
    >>> _grown(np.array([[0.4, 0.1], [0.6, 0.9]]), None).round(6).tolist()
    [[0.2, 0.0], [0.8, 1.0]]
    """
    # A box without any likelihood grows on all sides.
    width, touched = np.ptp(box, axis=0), np.ones(box.shape, dtype=np.bool_)
    if u is not None:
        low, high = box[0] + BOX_END_SHARE * width, box[1] - BOX_END_SHARE * width
        touched = np.stack([np.mean(u < low, axis=0), np.mean(u > high, axis=0)]) > HELD
    return np.clip(box + width * touched * OUTWARDS, 0.0, 1.0)


def _notes(likelihood: Likelihood, error: float, u: Array) -> list[str]:
    """Return notes on the limitations of a posterior with draws u (draws, parameters).

    A posterior in the middle of the prior, with a small error,
    gives no notes. More than 8 % of the draws in the last 2 % of a
    prior do.

    >>> import stiction as st
    >>> from types import SimpleNamespace
    >>> problem = st.paper.problem(nodes=256)
    >>> strength = st.paper.strength(problem, correlation_ratio=0.6)
    >>> ranges = {"marginal.low": (0.5e6, 0.8e6), "marginal.high": (1.2e6, 2.0e6)}
    >>> prior = make_prior(problem, strength, ranges)
    >>> likelihood = SimpleNamespace(prior=prior, method=Equilibrium())
    >>> u = np.full((100, 2), 0.5)
    >>> u[:8, 0], u[:9, 1], u[20:29, 0] = 0.019, 0.981, 0.981
    >>> (note,) = _notes(likelihood, 0.25, u)
    >>> for part in note.split(": ")[1].split(", and "):
    ...     print(part)  # doctest: +ELLIPSIS
    the upper end of marginal.low, 800000, holds 9% of the draws
    the upper end of marginal.high, 2e+06, holds 9% of the draws within 2% of its range. ...
    >>> u[:9, 0] = 0.019
    >>> _notes(likelihood, 0.25, u)[0].split(": ")[1].split(", and ")[0]
    'the lower end of marginal.low, 500000, holds 9% of the draws'
    >>> [note.split(" because")[0] for note in _notes(likelihood, 0.26, np.full((100, 2), 0.5))]
    ['the means are uncertain by about 26% of their standard deviations']
    """
    prior, notes = likelihood.prior, []
    texts = [
        f"the {side} end of {name}, {end:g}, holds {np.mean(near):.0%} of the draws"
        for name, draws, ends in zip(prior.names, u.T, prior.ends.T, strict=True)
        for side, near, end in (
            ("lower", draws < PRIOR_END, ends[0]),
            ("upper", draws > 1.0 - PRIOR_END, ends[1]),
        )
        if np.mean(near) > PILED * PRIOR_END
    ]
    if texts:
        notes.append(
            f"the posterior piles up at the ends of the prior: {', and '.join(texts)} within"
            f" {PRIOR_END:.0%} of its range. Check the unit of the peaks, or widen the prior"
        )
    # The local criterion may be inaccurate where the posterior lies,
    # not in all of the prior.
    middle = prior.theta(u.mean(axis=0, keepdims=True))
    (experiment,) = experiments_at(prior, middle, likelihood.method)
    if text := pilot_doubt(experiment, compare([experiment])):
        notes.append(text)
    if error > TOLERABLE:
        notes.append(
            f"the means are uncertain by about {error:.0%} of their standard deviations because"
            " few samples were simulated at each point. Use more samples"
        )
    return notes


def _of_specimens(
    problem: Problem, profiles: Profiles, simulation: Simulation, measured: Peaks, error: float
) -> SpecimenPosterior:
    """Return the posterior of mean and scatter between specimens, from profiles and peaks.

    The grid of a single field has four cells of s and two of the
    mean. Simulations, the grid and the comparison are replaced
    here.

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> class Grid(SimpleNamespace):
    ...     def draws(self, count, rng):
    ...         return rng.random((count, 4))
    ...     def described(self, u):
    ...         return {MEAN_KEY: u[:, 3], SCATTER_KEY: u[:, 2]}
    >>> def profiles(levels, mean=None):
    ...     prior = FactorPrior(mean=mean)
    ...     return SimpleNamespace(levels=np.array(levels), reference=2.0, prior=prior)
    >>> before = np.full((1, 1, 4, 2), 1 / 8)
    >>> after = np.array([[0.5, 0.0], [0.25, 0.25], [0, 0], [0, 0]]).reshape(1, 1, 4, 2)
    >>> kind = SimpleNamespace(area=2.0, ratios=np.full((1, 1, 8), 5.0))
    >>> def posterior(profiles, peaks):
    ...     both = Grid(profiles=profiles, mass=before), Grid(
    ...         profiles=profiles, mass=after, log_evidence=-7.0)
    ...     compared = []
    ...     def agree(prediction, peaks, seed):
    ...         known = prediction.peaks.values[0].size
    ...         compared.append((prediction.grid is both[0], known, peaks.values[0].size, seed))
    ...         return SimpleNamespace(notes=())
    ...     with patch.multiple("stiction.inference.infer", agreement=agree,
    ...                         tables_of=lambda *_: SimpleNamespace(onsets=(kind,)),
    ...                         grid_of_profiles=lambda *_: both):
    ...         found = _of_specimens("p", profiles, Simulation(None, None, 3), peaks, 0.1)
    ...     return found, compared
    >>> peaks = Peaks((None,), (np.array([14.0, 15.0]),), "N")
    >>> found, compared = posterior(profiles([3.0, 5.0]), peaks)
    >>> compared, found.log_evidence, found.monte_carlo_error  # sqrt(2/8)
    ([(True, 0, 2, 3)], -7.0, 0.5)
    >>> {name: round(nats, 6) for name, nats in found.information.items()}  # ln 2, and of 3/4
    {'between': 0.693147, 'mean': 0.130812}
    >>> found, compared = posterior(profiles([]), peaks)
    >>> compared, found.log_evidence, [*found.information], found.agreement
    ([], nan, ['between'], None)
    >>> [*posterior(profiles([], mean="stated"), peaks)[0].information]
    ['between', 'mean']
    >>> posterior(profiles([3e3, 5e3]), peaks)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: peaks: are about 14.5 N, but predictions ... 2e+04 N. ...
    """
    tables = tables_of(problem, profiles, simulation, measured, error)
    known = profiles.levels.size > 0
    # Without profiles the fields have the mean that the user stated.
    mean = float(profiles.levels.mean() / profiles.reference) if known else 1.0
    measured.refuse_far([k.area * mean * k.ratios[:, 0].ravel() for k in tables.onsets])
    by_profiles, grid = grid_of_profiles(profiles, tables)
    tests, onsets = sum(map(np.size, measured.values)), tables.onsets[0].ratios[:, 0].size

    def posterior(grid: FactorGrid, peaks: Peaks, **more: Any) -> SpecimenPosterior:
        u = grid.draws(POSTERIOR_DRAWS, np.random.default_rng(simulation.seed))
        return SpecimenPosterior(
            peaks=peaks, draws=grid.described(u), u=u, grid=grid, by_profiles=by_profiles,
            problem=problem, likelihood=tables, seed=simulation.seed,
            monte_carlo_error=math.sqrt(tests / onsets), **more,
        )  # fmt: skip

    comparison = None
    if known:
        # The prediction must not know the peaks with which it is compared.
        nothing = replace(measured, values=tuple(np.empty(0) for _ in measured.values))
        comparison = agreement(posterior(by_profiles, nothing), measured, seed=simulation.seed)
    # Without profiles and with a prior of the mean that is flat in its
    # logarithm, the prior has no density, and neither the evidence nor
    # the information on the mean is defined.
    proper = known or profiles.prior.mean is not None
    axes = {SCATTER_KEY: (0, 1, 3)} | ({MEAN_KEY: (0, 1, 2)} if proper else {})
    information = {
        name: float(entropy(grid.mass.sum(axis=of), by_profiles.mass.sum(axis=of)))
        for name, of in axes.items()
    }
    return posterior(
        grid, measured, notes=tuple(_specimen_notes(grid, comparison)), agreement=comparison,
        log_evidence=grid.log_evidence if proper else math.nan, information=information,
    )  # fmt: skip


def profiles_of(random: Any, prior: Any, families: Any, seed: int) -> Profiles:
    """Return the profiles of a fit, or the fields of any other source, which has no levels.

    >>> import stiction as st
    >>> def interface(mean):
    ...     law, spectrum = st.Lognormal(mean=mean, cv=0.2), st.ExponentialSpectrum(1e-3)
    ...     return st.RandomInterface(strength=st.RandomField(law, spectrum))
    >>> fields = [interface(1e6), interface(3e6), interface(1e6)]
    >>> profiles = profiles_of(fields, None, None, 0)
    >>> profiles.reference * 3.0, profiles.levels.size, profiles.within.shape
    (5000000.0, 0, (1, 0))
    >>> profiles.families == families_of(True), profiles.prior == FactorPrior()
    (True, True)
    >>> f"{profiles.fields[0].strength.mean / profiles.reference:.6f}"
    '1.000000'

    Profiles keep all but the stated prior and families.

    >>> known = profiles._replace(levels=np.ones(2))
    >>> again = profiles_of(known, {"between": (0.1, 0.3)}, "normal", 0)
    >>> again.families, again.levels.size, round(float(again.prior.scatter.mean()), 6)
    (('normal',), 2, 0.2)
    >>> profiles_of(known, None, None, 0) == known
    True
    >>> profiles_of(fields, None, "norm", 0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: between: family: unknown 'norm'; did you mean 'normal'? ...
    >>> profiles_of(object.__new__(Posterior), None, None, 0)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: random: must not be a posterior. ...
    """
    more: dict[str, Any] = {"prior": FactorPrior.of(prior)} if prior else {}
    with prefixed("between"):
        more |= {} if families is None else {"families": families_of(families)}
    if isinstance(random, Profiles):
        return random._replace(**more)
    if isinstance(random, FieldFit):
        return random.profiles(LIKELY_FIELDS, seed)._replace(**more)
    if isinstance(random, Posterior):
        raise InputError(
            "random: must not be a posterior. Pass its fit or interfaces, and all peaks together"
        )
    # A list of interfaces, or draws from any source.
    given = random.interfaces(LIKELY_FIELDS, seed) if isinstance(random, Source) else random
    likely = as_random(given)
    if len(likely.factor_laws[0]) > 1:
        raise InputError(
            "random: holds draws of mean and scatter between specimens, as a stored fit does. Pass"
            " the fit itself, or [draw.strength for draw in random] to use the fields alone"
        )
    members = likely.members
    refuse_conditioned(members)
    if specimens_of_fit(likely) is not None:
        warn_accuracy(
            "random: is the field of a fit, whose profiles then have no effect on the mean and the"
            " scatter. Pass the fit itself to combine profiles and peaks"
        )
    # Means and factors of the strength have no effect.
    reference = float(np.mean([one.strength.mean for one in members]))
    fields = tuple(dict.fromkeys(of_mean(one, reference) for one in members))
    return Profiles(fields, reference, np.zeros(0), np.zeros((len(fields), 0)), **more)


def _specimen_notes(grid: FactorGrid, comparison: Agreement | None) -> list[str]:
    """Return the reasons to doubt the posterior.

    >>> from types import SimpleNamespace
    >>> def notes(shares, levels, comparison=None, prior=FactorPrior()):
    ...     profiles = SimpleNamespace(prior=prior, levels=np.ones(levels))
    ...     grid = SimpleNamespace(profiles=profiles, mass=np.reshape(shares, (1, 1, -1, 1)))
    ...     return [note.split(",")[0] for note in _specimen_notes(grid, comparison)]

    Half of the range is ln 2 = 0.69 nats. Four fifths are ln 5/4
    nats, less than ln 4/3.

    >>> notes([0.5, 0.5, 0, 0], 2)
    []
    >>> notes([0.25, 0.25, 0.25, 0.25, 0], 2)
    ['the measurements say little about the scatter between specimens']
    >>> stated = FactorPrior(scatter=1.0)
    >>> notes([0.25, 0.25, 0.25, 0.25, 0], 2, prior=stated), notes([1, 0], 0, prior=stated)
    ([], [])
    >>> notes([1, 0], 1, SimpleNamespace(notes=("they differ",)))
    ['they differ. Until then use the lower force', 'the profiles come from one specimen']
    """
    profiles, doubts = grid.profiles, comparison.notes if comparison else ()
    until = "Until then use the lower force, from peaks or profiles alone"
    notes = [f"{text}. {until}" for text in doubts]
    # The cells of s have equal prior probability. A prior that the user
    # states is meant.
    shares = grid.mass.sum(axis=(0, 1, 3))
    usual = profiles.prior.scatter is FactorPrior().scatter
    if usual and math.log(shares.size) - float(entropy(shares)) < LITTLE_INFORMATION:
        notes.append(
            "the measurements say little about the scatter between specimens, so its prior controls"
            f" rare failures. Measure further specimens, or give prior={{'{SCATTER_KEY}': ...}}"
        )
    if profiles.levels.size == 1:
        notes.append(
            "the profiles come from one specimen, and others are assumed to vary along their length"
            " in the same way. Scan further specimens, or pass between=True if there were several"
        )
    return notes
