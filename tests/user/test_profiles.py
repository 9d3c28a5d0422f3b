"""Profiles of one's own: units, coordinates and gaps decide, wherever one enters."""

import dataclasses
import sys
import warnings

import numpy as np
import openpyxl
import pytest
import xarray as xr
from refusals import refuses
from setups import make_problem
from small_study import small_study

import stiction as st
from stiction.base.units import parse

NODES = 128
LINE = st.Interface(length=0.1, nodes=NODES)
X = LINE.x
SYSTEM = make_problem(NODES, weakening_rate=0.15e12)
# One weak place, at 60 mm.
STRENGTH = 1e6 - 4e5 * np.exp(-(((X - 0.06) / 4e-3) ** 2)) + 1e6 * X


def onset(tau_p, system=SYSTEM, **options):
    return st.onset(system, tau_p, method=st.LocalCriterion(), **options)


def found(tau_p):
    result = onset(tau_p)
    return float(result["critical_stress"][0]), float(result["critical_position"][0])


def labelled(strength=STRENGTH, x=X, x_unit=None, **attributes):
    place = ("x", x, {"units": x_unit}) if x_unit else x
    return xr.DataArray(strength, dims="x", coords={"x": place}, attrs=attributes)


def without(*slices):
    """The strength with gaps."""
    holes = STRENGTH.copy()
    for each in slices:
        holes[each] = np.nan
    return holes


def text_of(columns, separator=";", comma=False, head=None):
    lines = [separator.join(f"{v:.12g}" for v in row) for row in zip(*columns, strict=True)]
    if comma:
        lines = [line.replace(".", ",") for line in lines]
    return "\n".join(([head] if head else []) + lines) + "\n"


SHUFFLED = np.random.default_rng(0).permutation(NODES)
ROLLED = np.roll(np.arange(NODES), 50)  # from the middle of the interface on
ORDERS = {
    "descending": labelled(STRENGTH[::-1], X[::-1]),
    "shuffled": labelled(STRENGTH[SHUFFLED], X[SHUFFLED]),
    "offset": labelled(STRENGTH[ROLLED], np.where(X[-50] <= X, X - 0.1, X)[ROLLED]),
    "whole periods further on": labelled(x=X + 0.3),
    "transposed": labelled().expand_dims("sample", axis=1),
    "a series": labelled(STRENGTH[::-1], X[::-1]).to_series(),
    "a series without places": labelled().to_series().reset_index(drop=True),
    "its first node twice": labelled(np.r_[STRENGTH, STRENGTH[0]], np.r_[X, 0.1]),
}


@pytest.mark.parametrize("order", ORDERS)
def test_the_coordinate_decides_and_not_the_order(order):
    given = ORDERS[order]
    assert found(given) == found(STRENGTH)
    if isinstance(given, xr.DataArray):
        assert found(given.to_dataset(name="strength")) == found(STRENGTH)


def test_the_names_of_dimensions_decide_where_samples_equal_nodes():
    rows = STRENGTH[np.newaxis] * np.linspace(1.0, 1.2, NODES)[:, np.newaxis]
    array = xr.DataArray(rows, dims=("sample", "x"), coords={"x": X})
    expected = onset(rows)
    for given in (array, array.transpose("x", "sample"), array.drop_vars("x").T):
        assert onset(given)["critical_stress"].equals(expected["critical_stress"])
    # One value a sample, not a profile, although there are as many of them as nodes.
    residual = np.linspace(0.0, 3e5, NODES)
    given = {"strength": rows, "residual_strength": xr.DataArray(residual, dims="sample")}
    rows = np.tile(residual[:, np.newaxis], NODES)
    np.testing.assert_array_equal(SYSTEM.sample(given).residual_strength, rows)


class Quantity:
    """As of pint: a magnitude and a way to convert it."""

    def __init__(self, magnitude, factor):
        self.magnitude, self.factor = magnitude, factor

    def to(self, unit):
        assert unit in ("Pa", "Pa*m**-1")
        return Quantity(self.magnitude * self.factor, 1.0)


def test_everything_beside_the_strength_is_read_alike():
    residual = 1e5 + 1e6 * X
    tau_r = labelled(residual[::-1] * 1e-3, X[::-1] * 1e3, "mm", units="kPa")
    initial = xr.DataArray(0.01, attrs={"units": "MPa"})
    given = {"strength": STRENGTH, "residual_strength": tau_r, "initial_stress": initial}
    rows = SYSTEM.sample(given)
    np.testing.assert_allclose(rows.residual_strength[0], residual, rtol=1e-14)
    np.testing.assert_allclose(rows.initial_stress, 1e4)
    load = st.Load(profile=labelled(1.0 + X[::-1], X[::-1]), initial_stress=Quantity(0.1, 1e6))
    rate = Quantity(np.full(NODES, 0.2), 1e12)
    problem = make_problem(NODES, weakening_rate=rate, residual_strength=tau_r, load=load)
    assert problem.friction.weakening_rate == pytest.approx(np.full(NODES, 0.2e12))
    np.testing.assert_allclose(problem.friction.residual_strength, residual, rtol=1e-14)
    np.testing.assert_array_equal(problem.load.profile, 1.0 + X)
    assert problem.load.initial_stress == pytest.approx(1e5)
    dataset = labelled().to_dataset(name="tau_p").assign(tau_i=labelled(STRENGTH / 2))
    assert found({"strength": dataset}) == found(STRENGTH)
    assert "unit" not in st.read_profile(labelled(STRENGTH / 1e6, unit="MPa")).attrs


@pytest.mark.parametrize(
    ("text", "factor", "powers"),
    [
        ("kPa/mm/s", 1e6, (1, -2, -3)),
        ("N/mm s", 1e3, (1, 0, -1)),  # only what follows the slash at once is divided by
        ("kN m/cm^2", 1e7, (1, 0, -2)),
        ("1/s", 1.0, (0, 0, -1)),
        ("mJ mm⁻²", 1e3, (1, 0, -2)),
        ("%", 0.01, (0, 0, 0)),
        ("MPa·um", 1.0, (1, 0, -2)),
        ("N**2/m**3", 1.0, (2, -1, -4)),
    ],
)
def test_powers_and_slashes_of_units(text, factor, powers):
    unit = parse(text)
    assert unit.factor == pytest.approx(factor, rel=1e-14)
    assert unit.powers == powers


MM, INCH, KSI = 1e3, 1.0 / 0.0254, 1.0 / 6894757.293168
HEADINGS = {  # scales of x and of the strength
    "x / mm;tau / MPa": (MM, 1e-6),
    "#x_mm tau_MPa": (MM, 1e-6),
    "\ufeffx (mm);tau (MPa)": (MM, 1e-6),
    "Wegl\u00e4nge [mm];tau [N/mm\u00b2]": (MM, 1e-6),
    "x (mm);tau (N mm-2)": (MM, 1e-6),
    "x,tau\nmm,MPa": (MM, 1e-6),
    "x (in);tau (ksi)": (INCH, KSI),
    "pos mm;taup MPa": (MM, 1e-6),
    "x (mm);N/mm^2": (MM, 1e-6),
    "position: mm;tau_p: MPa": (MM, 1e-6),
    "mm,MPa": (MM, 1e-6),
    "Interferometer\nrun 14, room 3\nx (mm);tau (MPa)": (MM, 1e-6),
    "Messung 3;\nDatum;3. Mai\n;\nx (mm);tau\nmm;MPa": (MM, 1e-6),
    "Probe;12\nTemperatur;21,5\nx (mm);tau (MPa)": (MM, 1e-6),
    "# x (mm)  tau (kPa)": (MM, 1e-3),
}


@pytest.mark.parametrize("comma", [False, True])
@pytest.mark.parametrize("head", [*HEADINGS, None])
@pytest.mark.filterwarnings("error")
def test_headings_of_laboratories(tmp_path, head, comma):
    x_scale, scale = HEADINGS.get(head, (1.0, 1.0))
    last = (head or ";").splitlines()[-1]
    separator = next((mark for mark in (";", "\t", ",") if mark in last), "  ")
    path = tmp_path / "p.csv"
    text = text_of([X * x_scale, STRENGTH * scale], separator, comma and separator != ",", head)
    path.write_text(text, encoding="utf-8" if "\ufeff" in text else "cp1252")
    profile = st.read_profile(path, interface=LINE)
    np.testing.assert_allclose(profile, STRENGTH, rtol=1e-9)
    assert (profile.attrs["units"], profile.coords["x"].attrs["units"]) == ("Pa", "m")


def test_a_spreadsheet_as_it_comes(tmp_path, monkeypatch):
    """A padded title, an empty column and empty rows at the end; a workbook with another sheet."""
    rows = [f"{x};{v};" for x, v in zip(X * MM, STRENGTH * 1e-6, strict=True)]
    lines = ["sep=;", "Messung 3;;", "x (mm);tau (MPa);", *rows, ";;", "", ";;"]
    (tmp_path / "p.csv").write_text("\n".join(lines).replace(".", ","))
    book = openpyxl.Workbook()
    for line in [*lines[1:3], *zip(X * MM, STRENGTH * 1e-6, strict=True), ""]:
        book.active.append(line.split(";") if isinstance(line, str) else line)
    book.create_sheet("remarks").append(["ground with 400"])
    book.save(tmp_path / "p.xlsx")
    for name in ("p.csv", "p.xlsx"):
        found = st.read_profile(tmp_path / name, interface=LINE)
        np.testing.assert_allclose(found, STRENGTH, rtol=1e-9)
    (tmp_path / "p.xlsx").write_text("x;tau")
    refuses("is not a workbook", lambda: st.read_profile(tmp_path / "p.xlsx"))
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    refuses("needs openpyxl ... save it as .csv", lambda: st.read_profile(tmp_path / "p.xlsx"))


def test_axes_of_a_matrix_are_not_swapped(tmp_path):
    np.save(tmp_path / "h.npy", 1e-3 * np.cos(np.arange(96.0)).reshape(12, 8))
    plane = st.Interface(length=(0.02, 0.01), nodes=(8, 12))
    given = {"interface": plane, "quantity": "height", "unit": "um"}
    refuses("swapped", lambda: st.read_profile(tmp_path / "h.npy", **given))


COEFFICIENTS = {  # as a laboratory exports them, and the scale of x
    "Weg [mm];Reibzahl [-]": (MM, 1.0),
    "x (mm);Reibzahl [%]": (MM, 100.0),
}


@pytest.mark.parametrize("head", COEFFICIENTS)
def test_coefficients_are_known_by_their_unit(tmp_path, head):
    """And times the pressure they are the strength: 2 MPa, and more in the middle."""
    x_scale, scale = COEFFICIENTS[head]
    columns = [X * x_scale, scale * STRENGTH / 2e6]
    path = tmp_path / "p.csv"
    path.write_text(text_of(columns[::-1] if head.startswith("Reib") else columns, head=head))
    with warnings.catch_warnings(action="error"):
        mu = st.read_profile(path, quantity="friction_coefficient")
    np.testing.assert_allclose(mu, STRENGTH / 2e6, rtol=1e-9)
    np.testing.assert_allclose(mu.x, X, atol=1e-12)
    refuses(
        "no variable that is clearly the strength ... quantity='friction_coefficient'",
        lambda: st.read_profile(path),
    )
    pressure = 2e6 + 3e5 * np.cos(2.0 * np.pi * X / 0.1)
    pressed = dataclasses.replace(SYSTEM, load=st.Load(normal_pressure=pressure))
    expected = onset(mu.values * pressure, pressed)
    for given in (mu, mu[::-1], {"friction_coefficient": mu.values}):
        assert onset(given, pressed).equals(expected)
    # Their product with the pressure may have kept the unit of the coefficients.
    product = (mu * pressure).assign_attrs(units="1")
    law = st.LinearWeakening(weakening_rate=0.15e12, residual_ratio=0.1)
    steep = dataclasses.replace(pressed, friction=law)
    words = r"its mean is .*e\+06; if that is a strength"
    with pytest.raises(st.InputError, match=words) as own:
        onset(product, steep)
    assert len(own.value.problems) == 1
    both = {"strength": STRENGTH, "friction_coefficient": mu}
    refuses("either strength (Pa) or friction_coefficient", lambda: onset(both, pressed))


COARSE = np.linspace(0.0, 0.1, 41)[:-1] + 1e-3
TENT = labelled(1e6 + 1e7 * np.minimum(COARSE, 0.1 - COARSE), COARSE)


def test_other_places_are_said_and_interpolated_only_where_it_is_asked_for():
    for shift in ("0.5", "-0.3"):
        with pytest.warns(st.AccuracyWarning, match=f"{shift} of a spacing from the nodes"):
            assert found(labelled(x=X + 0.1 * float(shift) / NODES)) == found(STRENGTH)
    with pytest.warns(st.AccuracyWarning, match="40 points are interpolated linearly to 128"):
        profile = st.read_profile(TENT, interface=LINE, interpolate=True)
    inside = (X > 1e-3) & (X < 0.045)
    np.testing.assert_allclose(profile[inside], 1e6 + 1e7 * X[inside], rtol=1e-14)
    # From an x on that is not 0, to unlike values: between the last and the first, too.
    at = 0.0113 + np.arange(40) * 0.0025
    values = 1e6 + 1e5 * np.sin(np.arange(40.0))
    with pytest.warns(st.AccuracyWarning, match="interpolated"):
        profile = st.read_profile(labelled(values, at), interface=LINE, interpolate=True)
    expected = np.interp(
        np.where(at[0] > X, X + 0.1, X), np.r_[at, at[0] + 0.1], np.r_[values, values[0]]
    )
    np.testing.assert_allclose(profile, expected, rtol=1e-13)
    # A gap ends where points lie on nodes but for a hundredth; dense points may lack a few.
    h = X[1]
    ends = np.r_[X[:11], 20.01 * h, X[21:], 40.5 * h]
    dense = np.delete(np.arange(1280) * 0.1 * h, range(297, 303))
    for at, missing in ((ends, range(11, 20)), (dense, ())):
        given = labelled(1e6 + 1e6 * at, at)
        profile = st.read_profile(given, interface=LINE, interpolate=True, gaps="skip")
        assert [*np.flatnonzero(np.isnan(profile))] == [*missing]


def test_gaps_are_named_filled_on_request_and_remembered():
    holes = without(slice(0, 3), slice(-2, None), slice(70, 86))
    words = "(NaN) at 21 of 128 nodes, the first at x = 0 m"
    expected = np.interp(X, X[~np.isnan(holes)], holes[~np.isnan(holes)], period=0.1)
    for given in (holes, labelled(holes), labelled(holes[::-1], X[::-1])):
        refuses(f"strength: values are missing ... {words}", lambda given=given: found(given))
        result = onset(given, gaps="fill")
        assert result["critical_stress"][0] == pytest.approx(found(expected)[0], rel=1e-14)
        np.testing.assert_array_equal(result["measured"], ~np.isnan(holes))
    with pytest.warns(
        st.AccuracyWarning, match=r"65 of 128.*check interface.length and the unit"
    ):
        onset(labelled(STRENGTH[:63], X[:63]), gaps="fill")
    profile = st.read_profile(labelled(holes), interface=LINE, gaps="fill")
    np.testing.assert_allclose(profile, expected, rtol=1e-14)
    np.testing.assert_array_equal(profile["measured"], ~np.isnan(holes))
    # It is remembered through arithmetic and another order.
    assert "in_gap" in onset((profile * 2.0)[::-1])
    assert "in_gap" not in onset(STRENGTH, gaps="fill")


def test_an_onset_in_a_gap_is_called_that():
    holes = without(slice(78, 100))  # beside the weak place: a straight line of low strength
    holes[100] = 0.9 * holes[77]
    profile = st.read_profile(labelled(holes[::-1], X[::-1]), interface=LINE, gaps="fill")
    for given in (profile, without(slice(80, 83))):
        with pytest.warns(st.AccuracyWarning, match="the critical patch .* reaches into a gap"):
            assert bool(onset(given, gaps="fill")["in_gap"][0])
    assert not bool(onset(without(slice(10, 13)), gaps="fill")["in_gap"][0])
    for gap, reached in ((slice(1, 3), True), (slice(6, 8), False)):  # across x = 0
        seam = np.roll(STRENGTH, 47)  # weakest at node 124
        seam[gap] = np.nan
        assert bool(onset(seam, gaps="fill")["in_gap"][0]) is reached
    method = st.Rupture(loading_rate=1e8, stop="onset")
    assert bool(st.simulate_rupture(SYSTEM, profile, method=method, save=st.Save([]))["in_gap"])


@pytest.fixture
def study(tmp_path):
    """A study, and files of profiles beside it."""
    columns = [X[::-1] * 1e3, 1e-3 * (1e5 + 1e6 * X[::-1])]
    (tmp_path / "tau_r.csv").write_text(text_of(columns, head="x (mm);tau_r (kPa)"))
    pressure = text_of([5.0 + X], separator=" ", head="# sigma (MPa)")
    (tmp_path / "pressure.txt").write_text(pressure)
    coarse = text_of([X[::4], 1.0 + X[::4]], head="x (m);profile")
    (tmp_path / "load.csv").write_text(coarse)
    study = small_study(method={"type": "equilibrium"})
    study["problem"]["friction"]["residual_strength"] = "tau_r.csv"
    study["problem"]["load"] = {
        "profile": {"file": "load.csv", "interpolate": True},
        "normal_pressure": "pressure.txt",
    }
    return study


def test_profiles_in_a_study_file(study, tmp_path):
    loaded = st.Study.from_dict(study, folder=tmp_path)
    problem = loaded.problem
    residual = problem.friction.residual_strength
    np.testing.assert_allclose(residual, 1e5 + 1e6 * X, rtol=1e-11)
    np.testing.assert_allclose(problem.load.normal_pressure, (5.0 + X) * 1e6, rtol=1e-11)
    np.testing.assert_allclose(problem.load.profile[: NODES - 4], 1.0 + X[:-4], rtol=1e-11)
    assert st.Study.from_dict(loaded.to_dict()) == loaded


def test_a_variable_called_position_holds_the_places(tmp_path):
    """In NetCDF files too, where it need not be a coordinate."""
    position = ("point", X[::-1] * 1e3, {"units": "mm"})
    data = xr.Dataset({"position": position, "strength": ("point", STRENGTH[::-1])})
    data.to_netcdf(tmp_path / "p.nc")
    for source in (data, tmp_path / "p.nc"):
        np.testing.assert_array_equal(st.read_profile(source, interface=LINE), STRENGTH)
