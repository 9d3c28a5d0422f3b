"""The posterior of mean and scatter between specimens beside an own computation in closed form."""

import sys
from pathlib import Path

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import norm

import stiction as st
from stiction.inference.density import REACH, tabulate
from stiction.inference.specimens import (
    MEAN,
    SCATTER,
    Onsets,
    Profiles,
    Tables,
    grid_of_profiles,
)

sys.path.append(str(Path(__file__).parents[2] / "validation"))
import design_force_closed as closed

RNG = np.random.default_rng(3)
LEVELS = np.exp(0.07 * RNG.standard_normal(5))
PEAKS = np.exp(0.09 * RNG.standard_normal(8) - 0.02)
FIELD = st.RandomInterface(
    strength=st.RandomField(st.Lognormal(mean=1.0, cv=0.2), st.PowerLawSpectrum(4e-3))
)


def package(levels, peaks):
    """The package's grids by levels alone and by both, of levels and peaks about 1."""
    within = np.full((1, len(levels)), closed.OF_LEVEL**2)
    profiles = Profiles((FIELD,), 1.0, np.array(levels), within)
    ratios = np.exp(closed.OF_PEAK * ndtri((np.arange(4000) + 0.5) / 4000))[None, None]
    z = np.linspace(-REACH, REACH, 401)
    # The density itself, not a kernel density of the onsets.
    known = tabulate(ratios[0], np.zeros(1))._replace(
        mean=np.zeros(1), spread=np.full(1, closed.OF_PEAK), table=norm.logpdf(z)[None]
    )
    onsets = Onsets(np.zeros(1), ratios, (known,))
    return grid_of_profiles(profiles, Tables(profiles, None, (onsets,), 0.0, (peaks,)))


@pytest.mark.parametrize("levels", [LEVELS, LEVELS[:0]], ids=["both", "tests alone"])
def test_posterior_is_that_of_the_closed_form(levels):
    """Means, deviations and families to three digits: both integrate by midpoints."""
    _, grid = package(levels, PEAKS)
    logs, weights = closed.posterior(levels, PEAKS)
    m = np.exp(logs)
    mass = np.array(list(weights.values()))
    mean = np.sum(mass * m)
    deviation = np.sqrt(np.sum(mass * (m - mean) ** 2))
    scatter = np.sum(mass * closed.CVS[:, None])
    of_mean, of_scatter = grid.mass.sum(axis=(0, 1, 2)), grid.mass.sum(axis=(0, 1, 3))
    found, cvs = np.exp(grid.means), grid.profiles.prior.cells()
    assert of_mean @ found == pytest.approx(mean, rel=1e-3)
    assert np.sqrt(of_mean @ (found - mean) ** 2) == pytest.approx(deviation, rel=2e-3)
    assert of_scatter @ cvs == pytest.approx(scatter, rel=2e-3)
    shares = {family: own.sum() for family, own in weights.items()}
    assert grid.families == pytest.approx(shares, abs=1e-3)
    drawn = grid.described(grid.draws(40_000, np.random.default_rng(1)))
    assert drawn[MEAN].mean() == pytest.approx(mean, abs=4.0 * deviation / 200.0)
    assert drawn[SCATTER].mean() == pytest.approx(scatter, rel=0.02)  # four errors
