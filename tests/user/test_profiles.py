"""Profiles of one's own: units, coordinates and gaps decide, wherever one enters."""

import dataclasses
import os
import struct
import warnings

import numpy as np
import pytest
import xarray as xr

import stiction as st
from stiction.profiles import points_of

NODES = 128


@pytest.fixture(scope="module")
def interface():
    return st.Interface(length=0.1, nodes=NODES)


@pytest.fixture(scope="module")
def system(interface):
    solid = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
    return st.Problem(solid, interface, st.LinearWeakening(weakening_rate=0.15e12))


@pytest.fixture(scope="module")
def strength(interface):
    """One weak place, at 60 mm."""
    return 1e6 - 4e5 * np.exp(-(((interface.x - 0.06) / 4e-3) ** 2)) + 1e6 * interface.x


def found(system, tau_p, **options):
    result = st.onset(system, tau_p, method=st.LocalCriterion(), **options)
    return float(result["critical_stress"][0]), float(result["critical_position"][0])


def labelled(strength, x, **attributes):
    return xr.DataArray(strength, dims="x", coords={"x": x}, attrs=attributes)


def text_of(columns, separator=";", comma=False, head=None):
    lines = [separator.join(f"{v:.12g}" for v in row) for row in zip(*columns, strict=True)]
    if comma:
        lines = [line.replace(".", ",") for line in lines]
    return "\n".join(([head] if head else []) + lines) + "\n"


@pytest.mark.parametrize("order", ["descending", "shuffled", "offset", "beyond", "transposed"])
def test_the_coordinate_decides_and_not_the_order(system, strength, order):
    x = system.interface.x
    index = np.arange(NODES)
    if order == "descending":
        index = index[::-1]
    if order == "shuffled":
        index = np.random.default_rng(0).permutation(NODES)
    if order == "offset":  # from the middle of the interface on
        index = np.roll(index, 50)
        x = np.where(x >= x[-50], x - 0.1, x)
    if order == "beyond":  # whole periods further on
        x = x + 0.3
    given = labelled(strength[index], x[index])
    if order == "transposed":
        given = given.expand_dims("sample", axis=1)
    assert found(system, given) == found(system, strength)
    assert found(system, given.to_dataset(name="strength")) == found(system, strength)


def test_the_names_of_dimensions_decide_where_samples_equal_nodes(system, interface, strength):
    rows = strength[np.newaxis] * np.linspace(1.0, 1.2, NODES)[:, np.newaxis]
    array = xr.DataArray(rows, dims=("sample", "x"), coords={"x": interface.x})
    expected = st.onset(system, rows, method=st.LocalCriterion())
    for given in (array, array.transpose("x", "sample"), array.drop_vars("x").T):
        result = st.onset(system, given, method=st.LocalCriterion())
        np.testing.assert_array_equal(result["critical_stress"], expected["critical_stress"])
    # One value a sample, not a profile, although there are as many of them as nodes.
    residual = np.linspace(0.0, 3e5, NODES)
    by_sample = xr.DataArray(residual, dims="sample")
    rows_of = system.sample({"strength": rows, "residual_strength": by_sample}).residual_strength
    np.testing.assert_array_equal(rows_of, np.tile(residual[:, np.newaxis], NODES))
    with pytest.raises(st.InputError, match=r"not clear from \(a, b\).*call it 'x'"):
        st.onset(system, array.rename(sample="a", x="b").drop_vars("b"), method=st.LocalCriterion())
    with pytest.raises(st.InputError, match="strength: has no dimension along the interface"):
        st.onset(system, xr.DataArray(strength, dims="sample"), method=st.LocalCriterion())


@pytest.mark.parametrize("unit", ["MPa", "N/mm^2", "N mm-2", "megapascal", "MN/m²"])
def test_units_that_are_stated_are_converted(system, strength, unit):
    x = labelled(strength * 1e-6, system.interface.x * 1e3, units=unit)
    x.coords["x"].attrs["units"] = "mm"
    assert found(system, x) == pytest.approx(found(system, strength), rel=1e-13)


@pytest.mark.parametrize(
    ("unit", "words"),
    [
        ("um", "strength: strength is in um, which is no unit of stress; give it in Pa"),
        ("mpa", r"unknown unit 'mpa'; did you mean MPa\?"),
        ("V", "unknown unit 'V'|in V, which is no unit of stress"),  # the second with pint
        ("1", "no unit of stress"),
        ("m/s/s/", "unknown unit"),
    ],
)
def test_other_units_are_refused(system, strength, unit, words):
    with pytest.raises(st.InputError, match=words):
        found(system, labelled(strength, system.interface.x, units=unit))


def test_everything_beside_the_strength_is_read_alike(system, strength, interface):
    x = interface.x
    residual = 1e5 + 1e6 * x
    given = labelled(residual[::-1] * 1e-3, x[::-1] * 1e3, units="kPa")
    given.coords["x"].attrs["units"] = "mm"
    plain = system.sample(
        {"strength": strength, "residual_strength": residual, "initial_stress": 1e4}
    )
    rows = system.sample({"strength": strength, "residual_strength": given, "initial_stress": 1e4})
    np.testing.assert_allclose(rows.residual_strength, plain.residual_strength, rtol=1e-14)
    friction = st.LinearWeakening(weakening_rate=0.2e12, residual_strength=given)
    load = st.Load(profile=labelled(1.0 + x[::-1], x[::-1]))
    problem = st.Problem(system.solid, interface, friction, load)
    np.testing.assert_allclose(problem.friction.residual_strength, residual, rtol=1e-14)
    np.testing.assert_array_equal(problem.load.profile, 1.0 + x)
    with pytest.raises(st.InputError, match="load.profile: x lies elsewhere"):
        st.Problem(system.solid, interface, friction, st.Load(profile=labelled(1.0 + x, x * 0.99)))
    load = st.Load(profile=labelled(1.0 + x, x, units="Pa"))
    with pytest.raises(st.InputError, match="profile: load_profile is in Pa"):
        st.Problem(system.solid, interface, friction, load)
    run = st.simulate_rupture(
        system, labelled(strength[::-1], x[::-1]), method=st.Rupture(loading_rate=1e9, stop="onset")
    )
    np.testing.assert_array_equal(run["peak_strength"], strength)


MICRO = "\N{MICRO SIGN}"


@pytest.mark.parametrize(
    ("ending", "separator", "comma", "head", "scale"),
    [
        (".csv", ",", False, "x,strength", (1.0, 1.0)),
        (".csv", ";", True, f"Position [{MICRO}m];Festigkeit [MPa]", (1e6, 1e-6)),
        (".txt", " ", False, "# x (mm)  tau (kPa)", (1e3, 1e-3)),
        (".txt", "\t", True, "x_mm\tpeak strength / MPa", (1e3, 1e-6)),
        (".dat", "  ", True, None, (1.0, 1.0)),
        (".csv", ",", False, "x, tau_p\nmm, MPa", (1e3, 1e-6)),
        (".csv", ", ", False, "strength in MPa, distance (cm)", (1e2, 1e-6)),
    ],
)
def test_text_as_instruments_write_it(
    interface, strength, tmp_path, ending, separator, comma, head, scale
):
    columns = [interface.x * scale[0], strength * scale[1]]
    if head and head.startswith("strength"):
        columns = columns[::-1]
    path = tmp_path / f"p{ending}"
    encoding = "cp1252" if ";" in separator else "utf-8"
    path.write_text(text_of(columns, separator, comma, head), encoding=encoding)
    profile = st.read_profile(path, interface=interface)
    np.testing.assert_allclose(profile, strength, rtol=1e-10)
    assert profile.attrs["units"] == "Pa"
    assert profile.coords["x"].attrs["units"] == "m"


def test_columns_are_chosen_by_name_number_or_meaning(interface, strength, tmp_path):
    path = tmp_path / "p.csv"
    head = "time (s);x (mm);height (um);tau [MPa]"
    columns = [interface.x, interface.x * 1e3, strength, strength * 1e-6]
    path.write_text(text_of(columns, head=head))
    for options in ({}, {"value": "tau"}, {"value": 3, "x": 1}, {"x": "x", "unit": "MPa"}):
        profile = st.read_profile(path, interface=interface, **options)
        np.testing.assert_allclose(profile, strength, rtol=1e-10)
    mapped = st.read_profile(path, value="height", strength=lambda h: 1e6 * h)
    np.testing.assert_allclose(mapped, strength, rtol=1e-10)
    cases = {
        "unknown 'tu'; did you mean 'tau'": {"value": "tu"},
        "strength is in um, which is no unit of stress": {"value": "height"},
        "said to be in kPa, the source states MPa": {"unit": "kPa"},
        "unknown 'stress'": {"quantity": "stress"},
        "interface: needed": {"interpolate": True},
    }
    for words, options in cases.items():
        with pytest.raises(st.InputError, match=words):
            st.read_profile(path, **options)


@pytest.mark.parametrize("head", ["x (mm);height (um)", "x (mm);height", "x (mm);height (m)"])
def test_heights_are_no_strength(interface, strength, tmp_path, head):
    path = tmp_path / "p.csv"
    path.write_text(text_of([interface.x * 1e3, strength], head=head))
    with pytest.raises(st.InputError, match="no variable that is plainly the strength"):
        st.read_profile(path, interface=interface)
    heights = xr.Dataset({"z": ("x", strength, {"units": "um"})}, {"x": interface.x})
    heights.to_netcdf(tmp_path / "p.nc")
    with pytest.raises(st.InputError, match="plainly the strength.*'z' in um"):
        st.read_profile(tmp_path / "p.nc")
    with pytest.raises(st.InputError, match="no unit of stress"):
        st.read_profile(tmp_path / "p.nc", value="z")
    with pytest.raises(st.InputError, match="plainly the strength"):
        points_of(heights.drop_attrs(), "strength")


@pytest.mark.parametrize("ending", [".csv", ".nc"])
@pytest.mark.parametrize("with_x", [True, False])
def test_a_map_is_applied_to_heights_and_not_to_the_strength_beside_them(
    interface, strength, tmp_path, ending, with_x
):
    """The strength (1e6 Pa) times 1e11 would be 1e17 Pa."""
    heights = 10.0 * interface.x
    path = tmp_path / f"p{ending}"
    if ending == ".csv":
        head = "x (mm);height (um);strength (MPa)"
        columns = [interface.x * 1e3, heights, strength * 1e-6]
        path.write_text(text_of(columns, head=head) if with_x else
                        text_of(columns[1:], head=head[7:]))  # fmt: skip
    else:
        data = {"strength": ("x", strength * 1e-6, {"units": "MPa"})}
        data["height"] = ("x", heights, {"units": "um"})
        xr.Dataset(data, {"x": interface.x} if with_x else None).to_netcdf(path)
    found = st.read_profile(path, strength=lambda h: 1e11 * h)
    np.testing.assert_allclose(found, 1e5 * heights, rtol=1e-10)
    assert ("x" in found.coords) == with_x
    with pytest.raises(st.InputError, match="'strength' is the strength already"):
        st.read_profile(path, value="strength", strength=lambda h: 1e11 * h)


def test_which_variable_a_map_is_applied_to_is_not_guessed(strength):
    both = xr.Dataset({name: ("x", strength, {"units": "um"}) for name in ("front", "back")})
    with pytest.raises(st.InputError, match="which variable strength= is applied to.*value=..."):
        st.read_profile(both, strength=lambda h: h)
    one = both.assign(back=both["back"].assign_attrs(units="1"))  # the only length
    np.testing.assert_allclose(st.read_profile(one, strength=lambda h: 1e6 * h), strength)
    beside = both[["front"]].assign(tau=both["back"].assign_attrs(units="MPa"))
    np.testing.assert_allclose(st.read_profile(beside, strength=lambda h: 1e6 * h), strength)
    stresses = beside.assign(front=both["front"].assign_attrs(units="kPa"))
    with pytest.raises(st.InputError, match="'front' in kPa, 'tau' in MPa"):
        st.read_profile(stresses, strength=lambda h: h)


def test_a_map_from_a_stress_is_doubted_unless_the_source_says_what_it_is(strength, tmp_path):
    np.save(tmp_path / "p.npy", strength)
    with pytest.warns(st.UnitWarning, match="the quantity to map is in Pa, a stress"):
        st.read_profile(tmp_path / "p.npy", unit="Pa", strength=lambda h: h)
    given = xr.DataArray(strength, dims="x", name="height", attrs={"units": "MPa"})
    with pytest.raises(st.InputError, match="'height' is in MPa, which is no unit of length"):
        st.read_profile(given, strength=lambda h: h)
    with pytest.raises(st.InputError, match="'tau' is the strength already"):
        st.read_profile(given.rename("tau"), strength=lambda h: h)
    with pytest.warns(st.UnitWarning, match="'front' is in MPa, a stress"):
        st.read_profile(given.rename("front"), strength=lambda h: h)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = st.read_profile(given.rename("pressure"), strength=lambda p: 0.6e-6 * p)
    np.testing.assert_allclose(found, 0.6 * strength)


MAPS = {
    "strength: must be callable, got 5": 5,
    "strength: failed with TypeError: .*missing 1.*called with one array": lambda h, b: h,
    "strength: failed with ZeroDivisionError": lambda h: h * (1 / 0),
    "strength: .*finite and not negative, got -1e\\+06 for 0 ": lambda h: h - 1e6,
    "strength: .*got inf": lambda h: h + np.inf,
    "strength: .*got nan .*at 128 of 128 points": lambda h: h * np.nan,
    "strength: failed with TypeError: .*complex128": lambda h: h + 1j,
}


@pytest.mark.parametrize("words", MAPS)
def test_maps_that_make_no_strength_are_refused(interface, tmp_path, words):
    np.save(tmp_path / "p.npy", interface.x)
    with pytest.raises(st.InputError, match=words):
        st.read_profile(tmp_path / "p.npy", strength=MAPS[words], unit="mm")


def test_a_map_may_be_negative_of_what_may_and_leaves_gaps(interface, tmp_path):
    heights = np.where(interface.x > 0.05, np.nan, interface.x)
    np.save(tmp_path / "p.npy", heights)
    options = {"quantity": "initial_stress", "unit": "m"}
    found = st.read_profile(tmp_path / "p.npy", strength=lambda h: -1e6 - h, **options)
    assert (found.values[~np.isnan(heights)] < 0.0).all()
    filled = st.read_profile(tmp_path / "p.npy", strength=lambda h: 1e6 + np.nan_to_num(h))
    np.testing.assert_array_equal(np.isnan(filled), np.isnan(heights))


def test_heights_without_a_unit_that_make_no_strength_are_doubted(interface, tmp_path):
    np.save(tmp_path / "p.npy", 1.0 + interface.x)  # um
    with pytest.warns(st.UnitWarning, match=r"1.05e\+12 Pa.*give it with unit="):
        st.read_profile(tmp_path / "p.npy", strength=lambda h: 1e12 * h)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        st.read_profile(tmp_path / "p.npy", strength=lambda h: 1e6 * h)
        st.read_profile(tmp_path / "p.npy", strength=lambda h: 1e12 * h, unit="um")


def test_options_of_the_wrong_kind_are_refused(interface, strength, tmp_path):
    np.save(tmp_path / "p.npy", strength)
    with pytest.raises(st.InputError, match="unit: must be a valid string, got 3"):
        st.read_profile(tmp_path / "p.npy", unit=3)
    with pytest.raises(st.InputError, match="x_unit: must be a valid string"):
        st.read_profile(tmp_path / "p.npy", x_unit=3)
    given = labelled(strength, interface.x).rename("tau")
    with pytest.raises(st.InputError, match="value: 'q' is not the one variable here, 'tau'"):
        st.read_profile(given, value="q")
    np.testing.assert_array_equal(st.read_profile(given, value="tau"), strength)


def test_netcdf_with_units(interface, strength, tmp_path):
    x = ("x", interface.x[::-1] * 1e3, {"units": "mm"})
    data = {"friction_strength": ("x", strength[::-1] * 1e-6, {"units": "MPa"})}
    xr.Dataset(data | {"z": ("x", strength, {"units": "um"})}, {"x": x}).to_netcdf(
        tmp_path / "p.nc"
    )
    profile = st.read_profile(tmp_path / "p.nc", interface=interface)
    np.testing.assert_allclose(profile, strength, rtol=1e-14)
    result = st.read_profile(tmp_path / "p.nc")
    np.testing.assert_allclose(result, strength, rtol=1e-14)
    np.testing.assert_allclose(result["x"], interface.x, rtol=1e-14)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,5\n2,6\n", "may be one number or two"),
        ("x;tau\n0;1e6\n0.05;strong\n", "line 3: 'strong' is no number"),
        ("0;1\n0.05\n", "line 2 has 1 columns, line 1 has 2"),
        ("a;b;c\n1;2;3\n", r"3 columns \('a', 'b', 'c'\); say which"),
        ("x;tau;mu\n0;1\n", "line 1 names 3 columns"),
        ("x;tau (Volt)\n0;1\n", "unknown unit 'Volt'"),
        ("\n# nothing\n", "holds no numbers"),
        ("x;tau\n", "holds no numbers"),
        ("x\0;tau\n", "not a text file"),
        ("x;tau\n;1e6\n0.05;1e6\n", "x must be finite; entry 0"),
        ("x;tau\nmm;Pa\nmean;1\n0;1\n", "line 3: 'mean' is no number"),
        ("x;tau\n0;1_000\n", "'1_000' is no number"),
    ],
)
def test_text_that_cannot_be_understood(interface, tmp_path, text, words):
    (tmp_path / "p.csv").write_text(text)
    with pytest.raises(st.InputError, match=words):
        st.read_profile(tmp_path / "p.csv", interface=interface)


def test_coordinates_that_do_not_fit(system, strength):
    x = system.interface.x
    cases = {
        "one place of an interface.*endpoint=False": np.linspace(0.0, 0.1, NODES),
        "x lies elsewhere than the 128 nodes.*interface.length = 0.099": x * 0.99,
        "if x is in mm, say so": x * 1e3,
        "x repeats: 0 and 0 m": np.r_[x[0], x[0], x[2:]],
        "x must be finite; entry 3": np.r_[x[:3], np.nan, x[4:]],
    }
    for words, place in cases.items():
        with pytest.raises(st.InputError, match=words):
            found(system, labelled(strength, place))
    with pytest.raises(st.InputError, match=r"no values \(NaN\) at x = 0.00078125 m \(1 of 128"):
        found(system, labelled(np.delete(strength, 1), np.delete(x, 1)))
    with pytest.raises(st.InputError, match="64 points from 0 to .*interpolate"):
        found(system, labelled(strength[::2], x[::2]))
    closed = labelled(np.r_[strength, strength[0]], np.r_[x, 0.1])
    assert found(system, closed) == found(system, strength)


def test_centres_of_cells_are_taken_with_a_word(system, strength):
    with pytest.warns(st.AccuracyWarning, match="0.5 of a spacing beside the nodes"):
        shifted = found(system, labelled(strength, system.interface.x + 0.05 / NODES))
    assert shifted == found(system, strength)


def test_interpolation_only_where_it_is_asked_for(interface):
    x = np.linspace(0.0, 0.1, 41)[:-1] + 1e-3
    tent = labelled(1e6 + 1e7 * np.minimum(x, 0.1 - x), x)
    with pytest.raises(st.InputError, match="interpolate=True"):
        st.read_profile(tent, interface=interface)
    with pytest.warns(st.AccuracyWarning, match="40 points are interpolated linearly to 128 nodes"):
        profile = st.read_profile(tent, interface=interface, interpolate=True)
    inside = (interface.x > 1e-3) & (interface.x < 0.045)
    np.testing.assert_allclose(profile[inside], 1e6 + 1e7 * interface.x[inside], rtol=1e-14)
    with pytest.raises(st.InputError, match="no values .* at x = 0.0265625 to 0.0382813 m"):
        st.read_profile(tent.drop_isel(x=[11, 12, 13, 14]), interface=interface, interpolate=True)


def test_gaps_are_named_filled_on_request_and_remembered(system, strength, recwarn):
    x = system.interface.x
    holes = strength.copy()
    holes[:3], holes[-2:], holes[70:86] = np.nan, np.nan, np.nan
    words = r"no values \(NaN\) at x = 0.0546875 to 0.0664062 m, 0.0984375 to 0.0015625 m \(21 of"
    for given in (holes, labelled(holes, x), labelled(holes[::-1], x[::-1])):
        with pytest.raises(st.InputError, match=f"strength: must be finite: there are {words}"):
            found(system, given)
    expected = np.interp(x, x[~np.isnan(holes)], holes[~np.isnan(holes)], period=0.1)
    for given in (holes, labelled(holes[::-1], x[::-1])):
        result = st.onset(system, given, method=st.LocalCriterion(), gaps="fill")
        assert not bool(result["in_gap"][0])
        np.testing.assert_allclose(
            result["critical_stress"],
            st.onset(system, expected, method=st.LocalCriterion())["critical_stress"],
            rtol=1e-14,
        )
        assert result.attrs["gaps"].startswith("[[0.0546875, 0.06640625], [0.0984375")
    profile = st.read_profile(labelled(holes, x), interface=system.interface, gaps="fill")
    np.testing.assert_allclose(profile, expected, rtol=1e-14)
    np.testing.assert_array_equal(profile["measured"], ~np.isnan(holes))
    # It is remembered through a file, arithmetic and another order.
    again = (profile * 2.0)[::-1]
    assert "in_gap" in st.onset(system, again, method=st.LocalCriterion())
    assert "in_gap" not in st.onset(system, strength, method=st.LocalCriterion(), gaps="fill")
    with pytest.raises(st.InputError, match="gaps: must be 'refuse', 'fill' or 'skip'"):
        found(system, strength, gaps="drop")


def test_an_onset_in_a_gap_is_called_that(system, strength):
    holes = strength.copy()
    holes[78:100] = np.nan  # beside the weak place: a straight line of low strength
    holes[100] = 0.9 * holes[77]
    with pytest.warns(st.AccuracyWarning, match="the onset at x = .* lies in a gap of the profile"):
        result = st.onset(system, holes, method=st.LocalCriterion(), gaps="fill")
    assert bool(result["in_gap"][0])
    edge = strength.copy()
    edge[80:83] = np.nan
    with pytest.warns(st.AccuracyWarning, match="the critical patch .* reaches into a gap"):
        result = st.onset(system, edge, method=st.LocalCriterion(), gaps="fill")
    assert not bool(result["in_gap"][0])
    profile = st.read_profile(
        labelled(holes, system.interface.x), interface=system.interface, gaps="fill"
    )
    run = st.simulate_rupture(
        system, profile, method=st.Rupture(loading_rate=1e8, stop="onset"), save=st.Save([])
    )
    assert bool(run["in_gap"])


def test_a_column_is_a_profile(system, strength):
    assert found(system, strength[:, np.newaxis]) == found(system, strength)
    load = st.Load(initial_stress=np.full((NODES, 1), 1e4))
    assert load.initial_stress.shape == (NODES,)


class Quantity:
    """As of pint: a magnitude and a way to convert it."""

    def __init__(self, magnitude, factor):
        self.magnitude, self.factor = magnitude, factor

    def to(self, unit):
        assert unit == "Pa"
        return Quantity(self.magnitude * self.factor, 1.0)


def test_quantities_are_converted(system, strength):
    assert found(system, Quantity(strength * 1e-6, 1e6)) == pytest.approx(found(system, strength))
    loaded = dataclasses.replace(system, load=st.Load(initial_stress=Quantity(0.1, 1e6)))
    assert loaded.load.initial_stress == pytest.approx(1e5)
    number = xr.DataArray(0.1, attrs={"units": "MPa"})
    rows = system.sample({"strength": strength, "initial_stress": number})
    np.testing.assert_allclose(rows.initial_stress, 1e5)
    series = labelled(strength[::-1], system.interface.x[::-1]).to_series()
    assert found(system, series) == found(system, strength)
    assert found(system, series[::-1].reset_index(drop=True)) == found(system, strength)


def npy(shape, payload=b"", dtype="<f8", version=b"\x01\x00", extra=""):
    header = f"{{'descr': {dtype!r}, 'fortran_order': False, 'shape': {shape!r}, {extra}}}\n"
    return b"\x93NUMPY" + version + struct.pack("<H", len(header)) + header.encode() + payload


@pytest.mark.parametrize(
    "content",
    [
        npy((10**15,)),
        npy((-4,), b"x" * 32),
        npy((4,), b"x" * 31),
        npy((2,), b"x" * 16, dtype="|O"),
        b"\x93NUMPY\x02\x00\xff\xff\xff\xff{",
        npy((1,), b"x" * 8, extra="'a': " + "(" * 300),
        b"",
    ],
)
def test_a_hostile_npy_is_refused(interface, tmp_path, content):
    (tmp_path / "p.npy").write_bytes(content)
    with pytest.raises(st.InputError, match="not a .npy file"):
        st.read_profile(tmp_path / "p.npy", interface=interface)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs pipes")
@pytest.mark.parametrize("ending", ["csv", "npy", "nc"])
def test_only_regular_files_of_some_size_are_read(tmp_path, ending):
    pipe = tmp_path / f"pipe.{ending}"
    os.mkfifo(pipe)  # opening it in the ordinary way would wait for ever
    device = tmp_path / f"zero.{ending}"
    device.symlink_to("/dev/zero")
    folder = tmp_path / f"folder.{ending}"
    folder.mkdir()
    for path in (pipe, device, folder):
        with pytest.raises(st.InputError, match="is not a regular file"):
            st.read_profile(path)
    huge = tmp_path / f"huge.{ending}"
    with huge.open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(st.InputError, match="1099511627776 bytes"):
        st.read_profile(huge)
    with pytest.raises(st.InputError, match="cannot be read: No such file"):
        st.read_profile(tmp_path / f"none.{ending}")


def test_profiles_in_a_study_file(interface, strength, tmp_path):
    x = interface.x
    (tmp_path / "tau_r.csv").write_text(
        text_of([x[::-1] * 1e3, 1e-3 * (1e5 + 1e6 * x[::-1])], head="x (mm);tau_r (kPa)")
    )
    (tmp_path / "pressure.txt").write_text(text_of([5.0 + x], separator=" ", head="# sigma (MPa)"))
    coarse = text_of([x[::4], 1.0 + x[::4]], head="x (m);profile")
    (tmp_path / "load.csv").write_text(coarse)
    plain = {
        "solid": {"shear_modulus": 1e9, "poisson_ratio": 0.33, "density": 1170.0},
        "interface": {"length": 0.1, "nodes": NODES},
        "friction": {"weakening_rate": 0.2e12, "residual_strength": "tau_r.csv"},
        "load": {
            "profile": {"file": "load.csv", "interpolate": True},
            "normal_pressure": "pressure.txt",
        },
    }
    study = {
        "problem": plain,
        "random": {
            "strength": {
                "marginal": {
                    "type": "beta",
                    "alpha": 1.5,
                    "beta": 3,
                    "low": 0.66e6,
                    "high": 1.66e6,
                },
                "spectrum": {"type": "power_law", "correlation_length": 4e-3},
            }
        },
        "method": {"type": "equilibrium"},
        "ensemble": {"samples": 4.0, "keep": "strength"},
    }
    loaded = st.Study.from_dict(study, folder=tmp_path)
    problem = loaded.problem
    np.testing.assert_allclose(problem.friction.residual_strength, 1e5 + 1e6 * x, rtol=1e-11)
    np.testing.assert_allclose(problem.load.normal_pressure, (5.0 + x) * 1e6, rtol=1e-11)
    np.testing.assert_allclose(problem.load.profile[: NODES - 4], 1.0 + x[:-4], rtol=1e-11)
    assert st.Study.from_dict(loaded.to_dict()) == loaded
    assert loaded.ensemble.keep == ("strength",)
    plain["load"]["profile"] = {"file": "load.csv"}
    with pytest.raises(st.InputError, match="problem: load.profile: x lies elsewhere"):
        st.Study.from_dict(study, folder=tmp_path)
    plain["load"]["profile"] = {"file": "tau_r.csv", "value": "tau_r", "interpol": True}
    with pytest.raises(st.InputError, match="unknown 'interpol'; did you mean 'interpolate'"):
        st.Study.from_dict(study, folder=tmp_path)
    plain["load"]["profile"] = "tau_r.csv"
    with pytest.raises(st.InputError, match="profile: tau_r.csv: holds no variable"):
        st.Study.from_dict(study, folder=tmp_path)
    del plain["load"]["profile"]
    study["sweep"] = [{"problem.friction.residual_strength": [0.0, "tau_r.csv"]}]
    swept = st.Study.from_dict(study, folder=tmp_path)
    np.testing.assert_allclose(
        swept.experiments[1].problem.friction.residual_strength, 1e5 + 1e6 * x, rtol=1e-11
    )


HEADINGS = [
    "x / mm;tau / MPa", "x_mm;tau_MPa", "#x_mm tau_MPa", "x in mm;strength in MPa",
    "\ufeffx (mm);tau (MPa)", "Wegl\u00e4nge [mm];tau [N/mm\u00b2]", "x (mm);tau (N mm-2)",
    "x (cm);tau (bar)", "x,tau\nmm,MPa", "x (mm), tau_p (MPa)",
    "Position (mm)\tShear strength (MPa)",
    "distance (um);peak strength [kPa]", "x (in);tau (ksi)", "x [m];tau", "X {mm};TAU {MPa}",
    "pos mm;taup MPa", "x (mm);N/mm^2", "position: mm;tau_p: MPa", "mm,MPa",
    "Interferometer\nrun 14, room 3\nx (mm);tau (MPa)",
]  # fmt: skip
SCALES = {"cm": 1e2, "um": 1e6, "(in)": 1.0 / 0.0254, "[m]": 1.0}
STRESSES = {"bar": 1e-5, "kPa": 1e-3, "ksi": 1.0 / 6894757.293168, "tau": 1e-6}


@pytest.mark.parametrize("head", HEADINGS)
@pytest.mark.filterwarnings("error")
def test_headings_of_laboratories(interface, strength, tmp_path, head):
    length = next((scale for text, scale in SCALES.items() if text in head), 1e3)
    stress = next((scale for text, scale in STRESSES.items() if text in head), 1e-6)
    if head == "x [m];tau":
        stress = 1.0
    separator = next((mark for mark in (";", "\t", ",") if mark in head.splitlines()[-1]), " ")
    path = tmp_path / "p.csv"
    encoding = "cp1252" if "\u00e4" in head else "utf-8"
    text = text_of([interface.x * length, strength * stress], separator, head=head)
    path.write_text(text, encoding=encoding)
    profile = st.read_profile(path, interface=interface)
    np.testing.assert_allclose(profile, strength, rtol=1e-9)


def test_a_heading_names_its_column_and_units_tell_columns_apart(interface, strength, tmp_path):
    path = tmp_path / "scan.csv"
    head = "Position along interface (mm);Local friction strength [MPa];quality"
    columns = [interface.x * 1e3, strength * 1e-6, 0.0 * strength]
    path.write_text(text_of(columns, comma=True, head=head))
    for options in ({}, {"value": "Local friction strength [MPa]"}, {"value": 1, "x": 0}):
        profile = st.read_profile(path, interface=interface, **options)
        np.testing.assert_allclose(profile, strength, rtol=1e-9)


def test_one_message_names_all_that_is_to_be_decided(interface, strength):
    x = np.sort(np.random.default_rng(0).uniform(0.0, 0.1, 60))
    values = np.where(np.arange(60) % 9 == 4, np.nan, 1e6)
    with pytest.raises(st.InputError, match=r"(?s)interpolate=True.*gaps='fill'"):
        st.read_profile(labelled(values, x), interface=interface)
    with pytest.raises(st.InputError, match=r"x=\.\.\. names its column.*interpolate=True"):
        st.read_profile(xr.DataArray(values, dims="x"), interface=interface)


def test_records_longer_and_shorter_than_the_interface(interface, strength):
    longer = labelled(np.r_[strength, strength], np.arange(2 * NODES) * interface.spacing)
    with pytest.raises(st.InputError, match=r"crop the record.*or make interface.length 0.199"):
        st.read_profile(longer, interface=interface)
    shorter = labelled(strength[: NODES // 2], interface.x[: NODES // 2])
    with pytest.raises(
        st.InputError, match=r"covers 0.05 m of the interface.*interface.length 0.05"
    ):
        st.read_profile(shorter, interface=interface)
