"""Laws of what users hold, at every argument that takes numbers: read by its labels, or refused.

The table stands in docs/guide/reading-data.md; here each pair of a kind and an argument is tried.
"""

import re

import astropy.units as u
import numpy as np
import pandas as pd
import pint
import pytest
import xarray as xr
from recording import evaluated
from refusals import refuses, warning_texts
from setups import LOCAL, make_problem

import stiction as st
from stiction.base.variables import QUANTITIES
from stiction.inference.peaks import make_peaks
from stiction.inference.records import records_of
from stiction.problem.profiles import at_nodes

NODES = 128
LINE = st.Interface(length=0.1, nodes=NODES)
X = LINE.x
STRENGTH = np.random.default_rng(0).uniform(0.8e6, 1.2e6, NODES)
ORDER = np.random.default_rng(1).permutation(NODES)
Q = pint.UnitRegistry()
HOLES = np.where(np.arange(NODES) == 5, np.nan, STRENGTH)
MASKED = np.ma.masked_invalid(HOLES)
KPA = STRENGTH * 1e-3
LABELS = "to_numpy()"  # the way out
IN_ORDER, PLACED, GAP = STRENGTH, STRENGTH, HOLES

PROFILES = evaluated("profiles of a line", globals())
"""What a user holds, and what comes of it: values at the nodes, or words of a refusal."""


PROBLEM = make_problem(NODES, 0.1)
RUPTURE = st.Rupture(loading_rate=1e9, stop="onset")
ARGUMENTS = {  # every call that takes a profile, and numbers of its result
    "a profile at nodes": lambda given: at_nodes("strength", given, LINE, missing=True),
    "fit_field": lambda given: records_of(given, LINE, "strength")[0].values,
    "read_profile": lambda given: st.read_profile(given).values,
    "read_profile on nodes": lambda given: st.read_profile(given, interface=LINE).values,
    "Problem.sample": lambda given: PROBLEM.sample({"strength": given}).strength,
    "onset": lambda given: st.onset(PROBLEM, given, method=LOCAL).critical_stress.values,
    "equilibrium_path": lambda given: st.equilibrium_path(PROBLEM, given, [8.3e5]).slip.values,
    "simulate_rupture": lambda given: st.simulate_rupture(
        PROBLEM, given, method=RUPTURE, progress=False).onset_time.values,
    "nucleation_stress": lambda given: st.theory.nucleation_stress(PROBLEM, given),
    "Study": lambda given: st.Study(
        problem=PROBLEM, method=LOCAL, profiles={"strength": given}
    ).run(progress=False).critical_stress.values,
    "plot.field": lambda given: st.plot.field(PROBLEM, given).lines[0].get_ydata(),
    "plot.onset": lambda given: st.plot.onset(
        ONSET, given, problem=PROBLEM).lines[0].get_ydata(),
    "residual_strength": lambda given: PROBLEM.sample(
        {"strength": 2.0 * STRENGTH, "residual_strength": given}).residual_strength,
}  # fmt: skip
ONSET = st.onset(PROBLEM, STRENGTH, method=LOCAL)


def outcome(call, given):
    """What a call returns, or NaN if it takes no missing values."""
    try:
        return np.squeeze(call(given))
    except st.InputError as error:
        if not re.search("missing|must be finite|valid number", str(error)):
            raise
        return np.nan


@pytest.mark.filterwarnings("ignore::stiction.UnitWarning", "ignore::stiction.AccuracyWarning")
@pytest.mark.parametrize("kind", PROFILES)
@pytest.mark.parametrize("argument", ARGUMENTS)
def test_a_profile_of_any_kind_is_its_values_at_the_nodes(kind, argument):
    (given, expected), call = PROFILES[kind], ARGUMENTS[argument]
    if isinstance(expected, str):
        refuses(expected, lambda: call(given))
    else:
        np.testing.assert_allclose(outcome(call, given), outcome(call, expected), rtol=1e-12)


@pytest.mark.parametrize("argument", sorted({*ARGUMENTS} - {"fit_field", "read_profile"}))
def test_a_place_beyond_the_interface_is_doubted(argument):
    """It is taken modulo the length, and results count from the same origin."""
    for shift, doubted in ((0.0, False), (0.1 * 100 / NODES, True), (-0.1 / NODES, True)):
        given = xr.DataArray(STRENGTH, {"x": X + shift}, ("x",), attrs={"units": "Pa"})
        texts = warning_texts(lambda given=given: ARGUMENTS[argument](given))
        assert any("modulo the length" in text for text in texts) == doubted, shift


OTHERS = {"fit_field", "read_profile", "read_profile on nodes", "plot.field"}
OTHERS |= {"a profile at nodes", "residual_strength"}


@pytest.mark.parametrize("argument", sorted({*ARGUMENTS} - OTHERS))
def test_labelled_coefficients_are_a_strength_under_the_pressure(argument, monkeypatch):
    pressed = make_problem(NODES, 0.1, load=st.Load(normal_pressure=2.0**21))
    monkeypatch.setitem(globals(), "PROBLEM", pressed)
    given = xr.DataArray(STRENGTH * 2.0**-21, {"x": X}, ("x",), attrs={"units": "1"})
    np.testing.assert_array_equal(ARGUMENTS[argument](given), ARGUMENTS[argument](STRENGTH))


UNITS = {
    "strength": "kPa", "residual_strength": "MPa", "initial_stress": "GPa", "height": "um",
    "normal_pressure": "N/mm^2", "weakening_rate": "MPa/mm", "critical_slip": "nm", "slip": "mm",
    "fracture_energy": "kJ/m^2", "friction_coefficient": "%", "residual_ratio": "1",
    "load_profile": "1",
}  # fmt: skip


@pytest.mark.filterwarnings("ignore::stiction.UnitWarning", "ignore::stiction.AccuracyWarning")
@pytest.mark.parametrize("quantity", QUANTITIES)
def test_each_quantity_is_read_in_si(quantity):
    values = Q.Quantity(np.linspace(0.5, 0.75, 9), UNITS[quantity])
    table = {"x (mm)": np.arange(9.0), f"measured ({UNITS[quantity]})": values.magnitude}
    given = st.read_profile(pd.DataFrame(table), quantity=quantity)
    np.testing.assert_allclose(given, values.to_base_units().magnitude, rtol=1e-12)
    unit = re.sub(r"([a-z])(-?\d)", r"\1**\2", given.units).replace(" ", "*")
    assert values.check(Q(unit).dimensionality)


PEAKS = np.array([700.0, 720.0, 750.0, 690.0])  # kPa
TESTS = evaluated("peaks of four tests", globals())
"""What a user holds, as kPa or as Pa."""


@pytest.mark.parametrize("kind", TESTS)
def test_peaks(kind):
    given, unit = TESTS[kind], None
    if kind in ("array", "list", "Series", "shuffled Series"):
        unit = "Pa"
        refuses("unit: is missing", lambda: st.infer(PROBLEM, None, given))
        refuses("unit: is missing", lambda: st.statistics.agreement(ONSET, given))
    values = make_peaks(given, unit).values[0]
    np.testing.assert_allclose(np.sort(values), np.sort(PEAKS) * 1e3)
    if kind != "table":
        peaks = make_peaks({0.1: given, 0.2 * u.m: given}, unit)
        assert peaks.lengths == (0.1, 0.2)


@pytest.mark.parametrize("library", [u.Unit, Q.Unit])
def test_numbers_with_units(library):
    """Stresses, lengths, moduli, forces and densities, by the names of their arguments."""
    unit = lambda number, text: number * library(text)  # noqa: E731
    plain = st.Solid(shear_modulus=1e9, poisson_ratio=0.3, density=1000.0)
    assert st.Solid(
        shear_modulus=unit(1.0, "GPa"), poisson_ratio=0.3, density=unit(1.0, "g/cm**3")
    ).shear_modulus == pytest.approx(plain.shear_modulus)
    for length in (unit(100.0, "mm"), np.array(0.1)[()]):
        assert st.Interface(length=length, nodes=NODES) == LINE
    plane = st.Interface(length=(unit(10.0, "cm"), unit(50.0, "mm")), nodes=(16, 8))
    assert plane.lengths == pytest.approx((0.1, 0.05))
    load = st.Load(normal_pressure=unit(2.0, "MPa"), initial_stress=unit(1.0, "kPa"))
    load = make_problem(NODES, load=load).load
    assert (load.normal_pressure, load.initial_stress) == pytest.approx((2e6, 1e3))
    assert st.Load(pressing_force=unit(3.0, "kN")).pressing_force == pytest.approx(3e3)
    law = make_problem(NODES, weakening_rate=unit(0.15, "MPa/um")).friction
    assert law.weakening_rate == pytest.approx(0.15e12)
    field = st.RandomField(
        st.Lognormal(mean=unit(1.0, "MPa"), cv=0.2), st.PowerLawSpectrum(unit(2.0, "mm"))
    )
    assert (field.marginal.mean, field.spectrum.correlation_length) == pytest.approx(
        (1e6, 2e-3)
    )


def test_a_mean_pressure_of_each_sample_is_distributed_between_glued_blocks():
    """As an array, as one with labels, and with a unit; of as many samples as nodes."""
    problem = st.Problem(
        solid=st.Solid(youngs_modulus=3e9, poisson_ratio=0.35, density=1180.0, plane="stress"),
        interface=st.Interface(length=0.1, nodes=64),
        friction=st.LinearWeakening(weakening_rate=0.2e12),
        specimen=st.Blocks(height=0.05, pressing="glued"),
    )
    strength, means = np.full((64, 64), 1e6), np.linspace(2e6, 3e6, 64)
    given = {"strength": strength, "normal_pressure": means}  # without a sample: at the nodes
    np.testing.assert_array_equal(problem.sample(given).normal_pressure, [means] * 64)
    alone = problem.sample(given | {"normal_pressure": 2e6}).normal_pressure
    np.testing.assert_allclose(alone, [2e6 * problem.blocks.pressure] * 64, rtol=1e-14)
    kinds = (
        means[:, None],
        xr.DataArray(means, dims="sample"),
        xr.DataArray(means * 1e-6, dims="sample", attrs={"units": "MPa"}),
    )
    for pressure in kinds:
        sample = problem.sample({"strength": strength, "normal_pressure": pressure})
        expected = means[:, None] * problem.blocks.pressure
        np.testing.assert_allclose(sample.normal_pressure, expected, rtol=1e-14)


PLANE = make_problem((32, 32), (0.02, 0.017))
MAP = np.random.default_rng(2).uniform(0.8e6, 1.2e6, (32, 32))
ON_PLANES = {
    "sample": lambda given: PLANE.sample({"strength": given}).strength,
    "onset": lambda given: st.onset(PLANE, given, method=LOCAL).critical_stress.values,
    "plot.field": lambda given: st.plot.field(PLANE, given).images[0].get_array(),
    "nucleation_stress": lambda given: st.theory.nucleation_stress(PLANE, given)[31, 3],
}


@pytest.mark.parametrize("call", ON_PLANES)
@pytest.mark.parametrize("known", [(), ("x",), ("y",), ("x", "y")], ids="".join)
@pytest.mark.parametrize("dims", [("x", "y"), ("y", "x")], ids="".join)
def test_a_map_is_read_by_the_names_of_its_directions(call, known, dims):
    """In either order. Coordinates of one direction alone are refused by their name."""
    grid = PLANE.interface.coordinates
    given = xr.DataArray(MAP, {dim: grid[dim] for dim in known}, ("x", "y")).transpose(*dims)
    if len(known) == 1:
        refuses("coordinates", lambda: ON_PLANES[call](given))
    else:
        np.testing.assert_allclose(ON_PLANES[call](given), ON_PLANES[call](MAP), rtol=1e-12)
