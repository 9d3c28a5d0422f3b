"""Profiles of one's own: units, coordinates and gaps decide, wherever one enters."""

import dataclasses
import os
import struct

import numpy as np
import pytest
import xarray as xr
from small_study import small_study

import stiction as st

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
    rows_of = system.sample(
        {"strength": rows, "residual_strength": by_sample}
    ).residual_strength
    np.testing.assert_array_equal(rows_of, np.tile(residual[:, np.newaxis], NODES))
    with pytest.raises(st.InputError, match=r"not clear from \(a, b\).*call it 'x'"):
        st.onset(
            system, array.rename(sample="a", x="b").drop_vars("b"), method=st.LocalCriterion()
        )
    with pytest.raises(st.InputError, match="strength: has no dimension along the interface"):
        st.onset(system, xr.DataArray(strength, dims="sample"), method=st.LocalCriterion())


@pytest.mark.parametrize("unit", ["MPa", "N/mm^2", "N mm-2", "megapascal", "MN/m²"])
def test_units_that_are_stated_are_converted(system, strength, unit):
    x = labelled(strength * 1e-6, system.interface.x * 1e3, units=unit)
    x.coords["x"].attrs["units"] = "mm"
    assert found(system, x) == pytest.approx(found(system, strength), rel=1e-13)


UNITS = {
    "um": "strength: strength is in um, which is no unit of stress; give it in Pa",
    "mpa": r"unknown unit 'mpa'; did you mean MPa\?",
    "V": "unknown unit 'V'",
    "1": "no unit of stress",
    "m/s/s/": "unknown unit",
}


@pytest.mark.parametrize("unit", UNITS)
def test_other_units_are_refused(system, strength, unit):
    with pytest.raises(st.InputError, match=UNITS[unit]):
        found(system, labelled(strength, system.interface.x, units=unit))


def test_everything_beside_the_strength_is_read_alike(system, strength, interface):
    x = interface.x
    residual = 1e5 + 1e6 * x
    given = labelled(residual[::-1] * 1e-3, x[::-1] * 1e3, units="kPa")
    given.coords["x"].attrs["units"] = "mm"
    plain = system.sample(
        {"strength": strength, "residual_strength": residual, "initial_stress": 1e4}
    )
    rows = system.sample(
        {"strength": strength, "residual_strength": given, "initial_stress": 1e4}
    )
    np.testing.assert_allclose(rows.residual_strength, plain.residual_strength, rtol=1e-14)
    friction = st.LinearWeakening(weakening_rate=0.2e12, residual_strength=given)
    load = st.Load(profile=labelled(1.0 + x[::-1], x[::-1]))
    problem = st.Problem(system.solid, interface, friction, load)
    np.testing.assert_allclose(problem.friction.residual_strength, residual, rtol=1e-14)
    np.testing.assert_array_equal(problem.load.profile, 1.0 + x)
    with pytest.raises(st.InputError, match="load.profile: x lies elsewhere"):
        st.Problem(
            system.solid, interface, friction, st.Load(profile=labelled(1.0 + x, x * 0.99))
        )
    load = st.Load(profile=labelled(1.0 + x, x, units="Pa"))
    with pytest.raises(st.InputError, match="profile: load_profile is in Pa"):
        st.Problem(system.solid, interface, friction, load)


MM, INCH, KSI = 1e3, 1.0 / 0.0254, 1.0 / 6894757.293168
HEADINGS = {  # scales of x and of the strength
    "x / mm;tau / MPa": (MM, 1e-6),
    "x_mm;tau_MPa": (MM, 1e-6),
    "#x_mm tau_MPa": (MM, 1e-6),
    "x in mm;strength in MPa": (MM, 1e-6),
    "\ufeffx (mm);tau (MPa)": (MM, 1e-6),
    "Wegl\u00e4nge [mm];tau [N/mm\u00b2]": (MM, 1e-6),
    "x (mm);tau (N mm-2)": (MM, 1e-6),
    "x (cm);tau (bar)": (1e2, 1e-5),
    "x,tau\nmm,MPa": (MM, 1e-6),
    "x (mm), tau_p (MPa)": (MM, 1e-6),
    "Position (mm)\tShear strength (MPa)": (MM, 1e-6),
    "distance (um);peak strength [kPa]": (1e6, 1e-3),
    "x (in);tau (ksi)": (INCH, KSI),
    "x [m];tau": (1.0, 1.0),
    "X {mm};TAU {MPa}": (MM, 1e-6),
    "pos mm;taup MPa": (MM, 1e-6),
    "x (mm);N/mm^2": (MM, 1e-6),
    "position: mm;tau_p: MPa": (MM, 1e-6),
    "mm,MPa": (MM, 1e-6),
    "Interferometer\nrun 14, room 3\nx (mm);tau (MPa)": (MM, 1e-6),
    "x,strength": (1.0, 1.0),
    "Position [\N{MICRO SIGN}m];Festigkeit [MPa]": (1e6, 1e-6),
    "# x (mm)  tau (kPa)": (MM, 1e-3),
}


@pytest.mark.parametrize("comma", [False, True])
@pytest.mark.parametrize("head", [*HEADINGS, None])
@pytest.mark.filterwarnings("error")
def test_headings_of_laboratories(interface, strength, tmp_path, head, comma):
    x_scale, scale = HEADINGS.get(head, (1.0, 1.0))
    last = (head or ";").splitlines()[-1]
    separator = next((mark for mark in (";", "\t", ",") if mark in last), "  ")
    path = tmp_path / "p.csv"
    columns = [interface.x * x_scale, strength * scale]
    text = text_of(columns, separator, comma and separator != ",", head)
    path.write_text(text, encoding="utf-8" if "\ufeff" in text else "cp1252")
    profile = st.read_profile(path, interface=interface)
    np.testing.assert_allclose(profile, strength, rtol=1e-9)
    assert (profile.attrs["units"], profile.coords["x"].attrs["units"]) == ("Pa", "m")


def test_columns_are_chosen_by_name_heading_number_or_meaning(interface, strength, tmp_path):
    path = tmp_path / "p.csv"
    head = "time (s);Weg (mm);height (um);Local strength [MPa]"
    columns = [interface.x, interface.x * 1e3, strength, strength * 1e-6]
    path.write_text(text_of(columns, comma=True, head=head))
    for options in (
        {"value": "Local strength", "x": "Weg"},
        {"value": "Local strength [MPa]", "x": 1},
        {"value": 3, "x": "Weg (mm)", "unit": "MPa"},
    ):
        profile = st.read_profile(path, interface=interface, **options)
        np.testing.assert_allclose(profile, strength, rtol=1e-9)
    cases = {
        "say which are meant: x=..., value=...": {},
        "unknown 'Local'; did you mean 'Local strength'": {"value": "Local"},
        "strength is in um, which is no unit of stress": {"value": "height", "x": 1},
        "said to be in kPa, the source states MPa": {"unit": "kPa", "x": 1},
        "unknown 'stress'": {"quantity": "stress"},
        "interface: needed": {"interpolate": True},
        "unit: must be a valid string, got 3": {"unit": 3},
    }
    for words, options in cases.items():
        with pytest.raises(st.InputError, match=words):
            st.read_profile(path, **options)
    path.write_text(path.read_text().replace("height (um)", "quality"))
    np.testing.assert_allclose(st.read_profile(path, interface=interface), strength, rtol=1e-9)
    given = labelled(strength, interface.x).rename("tau")
    np.testing.assert_array_equal(st.read_profile(given, value="tau"), strength)
    with pytest.raises(st.InputError, match="value: 'q' is not the one variable here, 'tau'"):
        st.read_profile(given, value="q")


@pytest.mark.parametrize("head", ["x (mm);height (um)", "x (mm);height", "x (mm);foo (um)"])
def test_heights_are_no_strength(interface, strength, tmp_path, head):
    path = tmp_path / "p.csv"
    path.write_text(text_of([interface.x * 1e3, strength], head=head))
    with pytest.raises(
        st.InputError, match="no variable that is plainly the strength.*'height'"
    ):
        st.read_profile(path, interface=interface)
    with pytest.raises(st.InputError, match="no unit of stress|no variable that is plainly"):
        st.read_profile(path, value=1, unit="um")
    with pytest.raises(st.InputError, match="plainly the strength.*'z'"):
        st.read_profile(labelled(strength, interface.x).to_dataset(name="z"))


@pytest.mark.parametrize("ending", [".csv", ".nc"])
@pytest.mark.parametrize("with_x", [True, False])
def test_heights_and_the_strength_beside_them_are_told_apart(
    system, interface, strength, tmp_path, ending, with_x
):
    heights = 10.0 * interface.x
    path = tmp_path / f"p{ending}"
    columns = {"x": interface.x * 1e3, "height": heights, "strength": strength * 1e-6}
    units = {"x": "mm", "height": "um", "strength": "MPa"}
    if not with_x:
        del columns["x"]
    if ending == ".csv":
        head = ";".join(f"{name} ({units[name]})" for name in columns)
        path.write_text(text_of(columns.values(), head=head))
    else:
        order = slice(None, None, -1 if with_x else 1)
        data = {name: ("x", at[order], {"units": units[name]}) for name, at in columns.items()}
        xr.Dataset(data).to_netcdf(path)
    if with_x:
        found = st.read_profile(path, interface=interface)
        np.testing.assert_allclose(found, strength, rtol=1e-10)
    found = st.read_profile(path, quantity="height")
    np.testing.assert_allclose(found, 1e-6 * heights, rtol=1e-10)
    assert ("x" in found.coords) == with_x
    with pytest.raises(st.InputError, match="strength is in m, which is no unit of stress"):
        st.onset(system, found, method=st.LocalCriterion())
    own = (1e12 * (found + 1e-6)).assign_attrs(units="Pa")
    assert st.onset(system, own, method=st.LocalCriterion())["critical_stress"].item() > 1e6


TEXTS = {
    "1,5\n2,6\n": "may be one number or two",
    "x;tau\n0;1e6\n0.05;strong\n": "line 3: 'strong' is no number",
    "0;1\n0.05\n": "line 2 has 1 columns, line 1 has 2",
    "a;b;c\n1;2;3\n": "got 'a', 'b', 'c'",
    "x;tau;mu\n0;1\n": "line 1 names 3 columns",
    "x;tau (Volt)\n0;1\n": "unknown unit 'Volt'",
    "\n# nothing\n": "holds no numbers",
    "x;tau\n": "holds no numbers",
    "x\0;tau\n": "not a text file",
    "x;tau\n;1e6\n0.05;1e6\n": "x must be finite; entry 0",
    "x;tau\nmm;Pa\nmean;1\n0;1\n": "line 3: 'mean' is no number",
    "x (mm);tau\nmm;Pa\n0;1\n": "line 2: 'mm' is neither a number nor a unit",
    "x;tau\n0;1_000\n": "'1_000' is no number",
}


@pytest.mark.parametrize("text", TEXTS)
def test_text_that_cannot_be_understood(interface, tmp_path, text):
    (tmp_path / "p.csv").write_text(text)
    with pytest.raises(st.InputError, match=TEXTS[text]):
        st.read_profile(tmp_path / "p.csv", interface=interface)


def test_coordinates_that_do_not_fit(system, strength):
    x = system.interface.x
    uneven = np.sort(np.random.default_rng(0).uniform(0.0, 0.1, NODES))
    cases = {
        "x lies elsewhere than the 128 nodes": np.linspace(0.0, 0.1, NODES),
        "128 points from 0 to 0.0982.*check the unit of x": x * 0.99,
        "x reaches from 0 to 99.2.*check the unit of x": x * 1e3,
        "x = 0 and 0 m are one place": np.r_[x[0], x[0], x[2:]],
        "x must be finite; entry 3": np.r_[x[:3], np.nan, x[4:]],
        r"crop the record.*or make interface.length 0.198": 2.0 * x,
        "interpolate=True": uneven,
    }
    for words, place in cases.items():
        with pytest.raises(st.InputError, match=words):
            found(system, labelled(strength, place))
    with pytest.raises(
        st.InputError, match=r"no values \(NaN\) at x = 0.00078125 m \(1 of 128"
    ):
        found(system, labelled(np.delete(strength, 1), np.delete(x, 1)))
    with pytest.raises(st.InputError, match="64 of 128 nodes.*make interface.length that of"):
        found(system, labelled(strength[: NODES // 2], x[: NODES // 2]))
    with pytest.raises(st.InputError, match=r"x=\.\.\. names its column.*interpolate=True"):
        found(system, xr.DataArray(strength[:60], dims="x"))
    holes = np.where(np.arange(NODES) % 9 == 4, np.nan, strength)
    with pytest.raises(st.InputError, match=r"(?s)interpolate=True.*14 points.*gaps='fill'"):
        found(system, labelled(holes, uneven))
    with pytest.raises(st.InputError, match="64 points from 0 to .*interpolate"):
        found(system, labelled(strength[::2], x[::2]))
    closed = labelled(np.r_[strength, strength[0]], np.r_[x, 0.1])
    assert found(system, closed) == found(system, strength)
    closed[-1] *= 2.0
    with pytest.raises(st.InputError, match="x = 0 and 0.1 m are one place"):
        found(system, closed)


def test_centres_of_cells_are_taken_with_a_word(system, strength):
    with pytest.warns(st.AccuracyWarning, match="0.5 of a spacing beside the nodes"):
        shifted = found(system, labelled(strength, system.interface.x + 0.05 / NODES))
    assert shifted == found(system, strength)


def test_interpolation_only_where_it_is_asked_for(interface):
    x = np.linspace(0.0, 0.1, 41)[:-1] + 1e-3
    tent = labelled(1e6 + 1e7 * np.minimum(x, 0.1 - x), x)
    with pytest.raises(st.InputError, match="interpolate=True"):
        st.read_profile(tent, interface=interface)
    with pytest.warns(
        st.AccuracyWarning, match="40 points are interpolated linearly to 128 nodes"
    ):
        profile = st.read_profile(tent, interface=interface, interpolate=True)
    inside = (interface.x > 1e-3) & (interface.x < 0.045)
    np.testing.assert_allclose(profile[inside], 1e6 + 1e7 * interface.x[inside], rtol=1e-14)
    with pytest.raises(st.InputError, match="no values .* at x = 0.0265625 to 0.0382813 m"):
        st.read_profile(
            tent.drop_isel(x=[11, 12, 13, 14]), interface=interface, interpolate=True
        )


def test_gaps_are_named_filled_on_request_and_remembered(system, strength, recwarn):
    x = system.interface.x
    holes = strength.copy()
    holes[:3], holes[-2:], holes[70:86] = np.nan, np.nan, np.nan
    words = (
        r"no values \(NaN\) at x = 0.0546875 to 0.0664062 m, 0.0984375 to 0.0015625 m \(21 of"
    )
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
    with pytest.raises(st.InputError, match="gaps: must be 'refuse' or 'fill'"):
        found(system, strength, gaps="drop")


def test_an_onset_in_a_gap_is_called_that(system, strength):
    holes = strength.copy()
    holes[78:100] = np.nan  # beside the weak place: a straight line of low strength
    holes[100] = 0.9 * holes[77]
    with pytest.warns(
        st.AccuracyWarning, match="the onset at x = .* lies in a gap of the profile"
    ):
        result = st.onset(system, holes, method=st.LocalCriterion(), gaps="fill")
    assert bool(result["in_gap"][0])
    edge = strength.copy()
    edge[80:83] = np.nan
    with pytest.warns(st.AccuracyWarning, match="the critical patch .* reaches into a gap"):
        result = st.onset(system, edge, method=st.LocalCriterion(), gaps="fill")
    assert not bool(result["in_gap"][0])
    given = labelled(holes[::-1], system.interface.x[::-1])
    profile = st.read_profile(given, interface=system.interface, gaps="fill")
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
    assert found(system, Quantity(strength * 1e-6, 1e6)) == pytest.approx(
        found(system, strength)
    )
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
    paths = [
        tmp_path / f"{name}.{ending}" for name in ("pipe", "zero", "folder", "huge", "none")
    ]
    os.mkfifo(paths[0])  # opening it in the ordinary way would wait for ever
    paths[1].symlink_to("/dev/zero")
    paths[2].mkdir()
    with paths[3].open("wb") as file:
        file.truncate(2**40)
    refused = [
        *["is not a regular file"] * 3,
        "1099511627776 bytes",
        "cannot be read: No such file",
    ]
    for path, words in zip(paths, refused, strict=True):
        with pytest.raises(st.InputError, match=words):
            st.read_profile(path)


def test_profiles_in_a_study_file(interface, tmp_path):
    x = interface.x
    (tmp_path / "tau_r.csv").write_text(
        text_of([x[::-1] * 1e3, 1e-3 * (1e5 + 1e6 * x[::-1])], head="x (mm);tau_r (kPa)")
    )
    (tmp_path / "pressure.txt").write_text(
        text_of([5.0 + x], separator=" ", head="# sigma (MPa)")
    )
    coarse = text_of([x[::4], 1.0 + x[::4]], head="x (m);profile")
    (tmp_path / "load.csv").write_text(coarse)
    study = small_study(method={"type": "equilibrium"})
    study["problem"]["friction"]["residual_strength"] = "tau_r.csv"
    load = study["problem"]["load"] = {
        "profile": {"file": "load.csv", "interpolate": True},
        "normal_pressure": "pressure.txt",
    }
    loaded = st.Study.from_dict(study, folder=tmp_path)
    problem = loaded.problem
    np.testing.assert_allclose(problem.friction.residual_strength, 1e5 + 1e6 * x, rtol=1e-11)
    np.testing.assert_allclose(problem.load.normal_pressure, (5.0 + x) * 1e6, rtol=1e-11)
    np.testing.assert_allclose(problem.load.profile[: NODES - 4], 1.0 + x[:-4], rtol=1e-11)
    assert st.Study.from_dict(loaded.to_dict()) == loaded
    refused = {
        "problem: load.profile: x lies elsewhere": {"file": "load.csv"},
        "unknown 'interpol'; did you mean 'interpolate'": {
            "file": "tau_r.csv",
            "interpol": True,
        },
        "gaps: must be 'refuse' or 'fill'": {"file": "load.csv", "gaps": "skip"},
        "profile: .*tau_r.csv: holds no variable": "tau_r.csv",
        "a profile as a table has a file": {"values": [1.0, 2.0]},
    }
    for words, profile in refused.items():
        load["profile"] = profile
        with pytest.raises(st.InputError, match=words):
            st.Study.from_dict(study, folder=tmp_path)
    del load["profile"]
    study["sweep"] = [{"problem.friction.residual_strength": [0.0, "tau_r.csv"]}]
    swept = st.Study.from_dict(study, folder=tmp_path)
    assert st.Study.from_dict(swept.to_dict()) == swept
    np.testing.assert_allclose(
        swept.experiments[1].problem.friction.residual_strength, 1e5 + 1e6 * x, rtol=1e-11
    )
