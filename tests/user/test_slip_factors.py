"""Slip factors by the book: five specimens with two slip loads each, no scans."""

import dataclasses
import math

import numpy as np
import pytest
import xarray as xr
from joint import PROBLEM

import stiction as st
from stiction.inference.standards import fractile_factor

JOINT = dataclasses.replace(PROBLEM, load=st.Load(pressing_force=5e6 * PROBLEM.area))
FACTORS = np.array([[0.43, 0.41], [0.47, 0.46], [0.45, 0.46], [0.40, 0.42], [0.44, 0.45]])
FORCES = 390e3 + 1e3 * np.arange(10.0).reshape(5, 2)
HEADING = "specimen;slip load (kN);clamping force (kN)"
QUIET = {"progress": False}
ASKED = QUIET | {"sensitivities": False}


@pytest.fixture
def written(tmp_path):
    """Return a function that writes lines as a test house does, and reads them."""

    def read(lines, heading=HEADING, **more):
        path = tmp_path / "slip.csv"
        path.write_text("\n".join([heading, *lines]))
        return st.read_peaks(path, **({"normal": "clamping force (kN)"} | more))

    return read


def lines_of(factors, names="{0}"):
    return [
        f"{names.format(k + 1, 'ab'[i])};{1e-3 * factors[k, i] * FORCES[k, i]:.3f};"
        f"{1e-3 * FORCES[k, i]:.1f}"
        for k in range(len(factors))
        for i in range(2)
    ]


def mixture(factors, probabilities):
    """Slip factors of a new specimen at probabilities, by a plain sum over s and log m."""
    means, within = factors.mean(axis=1), factors / factors.mean(axis=1, keepdims=True) - 1.0
    error = math.sqrt(np.sum(within**2) / len(factors) / 2) * means.mean()
    scatters = 0.1 * np.tan((np.arange(40) + 0.5) / 40 * math.atan(9.0))
    logs = np.log(means.mean()) + np.linspace(-0.3, 0.3, 121)
    at = np.exp(np.linspace(-1.8, -0.4, 401))
    weight, below = 0.0, 0.0
    for family in (st.Lognormal, st.TruncatedNormal, st.Weibull):
        for cv in scatters:
            law = family(mean=1.0, cv=float(cv)).distribution
            b = np.exp(logs)[:, None] * law.ppf((np.arange(150) + 0.5) / 150)
            noise = np.exp(-0.5 * ((means[:, None, None] - b) / error) ** 2)
            likely = np.prod(noise.mean(axis=2), axis=0)
            weight += likely.sum()
            below += likely @ law.cdf(at / np.exp(logs)[:, None])
    return np.exp(np.interp(probabilities, below / weight, np.log(at)))


def test_a_dozen_lines_of_numpy_reproduce_the_design(written, monkeypatch):
    monkeypatch.setattr("stiction.random.equally_likely.FIRST_MEMBERS", 200)
    peaks = written(lines_of(FACTORS))
    np.testing.assert_allclose(peaks.values[0], FACTORS.ravel(), rtol=1e-5)
    posterior = st.infer(JOINT, None, peaks, **QUIET)
    assert posterior.specimens == 5
    assert posterior.peaks.loads is peaks
    chances = np.array([1e-2, 1e-3])
    with pytest.warns(st.AccuracyWarning, match="do not determine P = 1e-05"):
        rare = st.design_stress(JOINT, posterior, probability=1e-5, **ASKED)
    designs = [st.design_stress(JOINT, posterior, probability=p, **ASKED) for p in chances]
    # Steps of s and of log m are coarser in the package: 40 and 48 cells.
    found = [design.friction_coefficient for design in designs]
    np.testing.assert_allclose(found, mixture(FACTORS, chances), rtol=0.01)
    assert rare.stress < designs[1].stress
    for design, chance in zip(designs, chances, strict=True):
        back = st.failure_probability(JOINT, posterior, design.stress, **QUIET)
        assert back.probability == pytest.approx(chance, rel=1e-3)
        assert design.stress < design.characteristic_stress


def test_the_unit_is_a_specimen(written):
    """Slip loads that scatter about equal means lower the design less than as ten specimens."""
    twice = written(lines_of(FACTORS))
    with pytest.warns(st.AccuracyWarning, match="1a, 1b, ... are read as slip loads"):
        named = written(lines_of(FACTORS, names="{0}{1}"))
    assert named.specimens[0].tolist() == twice.specimens[0].tolist()
    single = dataclasses.replace(twice, specimens=None)
    given = QUIET | {"between": "lognormal"}
    unit, tens = (st.infer(JOINT, None, peaks, **given) for peaks in (twice, single))
    assert (unit.specimens, tens.specimens) == (5, 10)
    assert "5 peaks, means of 10 slip loads" in str(unit)
    # Pairs with ten numbers and five means: half of the pooled variance is that of a mean.
    squares = (FACTORS / FACTORS.mean(axis=1, keepdims=True) - 1.0) ** 2
    assert any(
        f"error of {np.sqrt(squares.sum() / 10):.1%}" in text for text in unit.assumptions
    )
    widths = [np.ptp(posterior.interval["between"]) for posterior in (unit, tens)]
    assert widths[0] > widths[1]


def test_values_of_the_standards(written):
    """Factors of EN 1990, tables D1 and D2, for an unknown coefficient of variation."""
    tables = {3: 3.37, 5: 2.33, 10: 1.92, 20: 1.76}
    for count, factor in tables.items():
        assert fractile_factor(count) == pytest.approx(factor, rel=0.01)
    for count, factor in {5: 7.85, 10: 4.51, 20: 3.64}.items():
        assert fractile_factor(count, 1e-3) == pytest.approx(factor, rel=0.01)
    peaks = written(lines_of(FACTORS))
    values, of = FACTORS.ravel(), peaks.standards
    mean, deviation = values.mean(), values.std(ddof=1)
    expected = [mean, deviation, mean - 1.92 * deviation, mean - 4.51 * deviation]
    expected += [mean - 2.05 * deviation, 5]
    np.testing.assert_allclose(list(of.values()), expected, rtol=2e-3)
    scattered = written(lines_of(0.44 + 3.0 * (FACTORS - 0.44))).standards
    cv = 100.0 * scattered["standard deviation"] / scattered["mean"]
    needed = scattered["EN 1090-2 specimens in all"]
    assert needed == (math.floor((cv / 3.5) ** 2) + 1 if cv > 8.0 else 5)


def test_slip_loads_over_clamping_forces(written):
    """EN 1090-2, annex G: a force of each test, and two slip loads of a specimen."""
    rows = lines_of(FACTORS)
    loads, forces = np.array([row.split(";")[1:] for row in rows], dtype=float).T
    peaks = written(rows, surfaces=2)
    np.testing.assert_allclose(peaks.values[0], loads / (2.0 * forces), rtol=1e-12)
    np.testing.assert_allclose(peaks.normal_forces[0], 1e3 * forces, rtol=1e-12)
    assert (peaks.unit, peaks.specimens[0].tolist()) == ("1", [*"1122334455"])
    assert "normal force" in str(peaks)
    peaks = written(rows, normal=196e3, surfaces=2)
    np.testing.assert_allclose(peaks.values[0], loads / 392.0, rtol=1e-12)


def test_an_agreement_compares_specimens_not_slip_loads(written):
    """Repeated slip loads count as their mean, whose error is that of the prediction, too."""
    peaks = written(lines_of(FACTORS))
    rng = np.random.default_rng(1)
    predicted = xr.Dataset({"friction_coefficient": ("sample", rng.normal(0.44, 0.02, 400))})
    found = st.statistics.agreement(predicted, peaks)
    np.testing.assert_allclose(found.peaks.values[0], FACTORS.mean(axis=1), rtol=1e-5)
    assert found.peaks.loads is peaks
    assert found.p_values["cramer_von_mises"] > 0.05
