"""Maps with gaps, and maps as text: the rules of lines, on planes."""

import numpy as np
import pytest
import xarray as xr

import stiction as st
from stiction.profiles import at_nodes

PLANE = st.Interface(length=(0.02, 0.01), nodes=(32, 16))
VALUES = 1e6 + 1e5 * np.sin(2.0 * np.pi * PLANE.x / 0.02)[:, None] * np.ones(16)


def text(path, unit="MPa", x_unit="mm", shuffled=True, without=0):
    x, y = np.meshgrid(*PLANE.coordinates.values(), indexing="ij")
    lengths, stresses = {"mm": 1e3, "m": 1.0}[x_unit], {"MPa": 1e-6, "Pa": 1.0}[unit]
    rows = np.column_stack([lengths * x.ravel(), lengths * y.ravel(), stresses * VALUES.ravel()])
    rows = rows[without:]
    if shuffled:
        rows = np.random.default_rng(0).permutation(rows)
    header = f"x ({x_unit}); y ({x_unit}); strength ({unit})"
    np.savetxt(path, rows, delimiter=";", header=header, comments="", fmt="%.9g")
    return path


def test_a_millimetre_taken_for_a_metre_is_refused(tmp_path):
    path = text(tmp_path / "map.csv")
    path.write_text(path.read_text().replace("(mm)", "(m)"))
    with pytest.raises(st.InputError, match="if x is in mm, say so"):
        st.read_profile(path, interface=PLANE)


def test_gaps_are_refused_filled_or_left(tmp_path):
    path = text(tmp_path / "map.csv", without=3)
    with pytest.raises(st.InputError, match="at 3 of 512 nodes, the first at x = 0 m, y = 0 m"):
        st.read_profile(path, interface=PLANE)
    left = st.read_profile(path, interface=PLANE, gaps="skip")
    assert int(np.isnan(left).sum()) == 3
    with pytest.warns(st.AccuracyWarning, match="filled smoothly"):
        filled = st.read_profile(path, interface=PLANE, gaps="fill")
    assert int((~filled["measured"]).sum()) == 3
    # The map varies along x as a sine and is odd about x = 0: Laplace keeps it between its rim.
    assert np.abs(filled.values[0, :3] - 1e6).max() < 1e3


def test_a_filled_gap_is_harmonic():
    """Of a map that solves the discrete Laplace equation, what is missing is found again."""
    i, j = np.arange(32)[:, None], np.arange(16)[None, :]
    plane = 1e6 + 2e3 * (i - 10) - 3e3 * (j - 5)  # linear, away from the edges
    values = plane.astype(float)
    values[8:13, 4:9] = np.nan
    with pytest.warns(st.AccuracyWarning, match="filled"):
        found = st.read_profile(xr.DataArray(values, dims=("x", "y")), interface=PLANE, gaps="fill")
    np.testing.assert_allclose(found, plane, rtol=1e-12)


def test_an_onset_in_a_gap_of_a_map_says_so():
    problem = st.Problem(
        solid=st.Solid(shear_modulus=1e9, poisson_ratio=0.3, density=1200.0),
        interface=PLANE,
        friction=st.LinearWeakening(weakening_rate=3e11),
    )
    values = VALUES.copy()
    values[22:27, 5:9] = np.nan  # around the weakest line, x = 15 mm
    values[24, 4] = values[24, 9] = 0.3e6
    with pytest.raises(st.InputError, match="must be finite"):
        st.onset(problem, values, method=st.LocalCriterion())
    with pytest.warns(st.AccuracyWarning, match="lies in a gap of the profile"):
        found = st.onset(problem, values, method=st.LocalCriterion(), gaps="fill")
    assert bool(found["in_gap"].item())
    whole = st.onset(problem, VALUES, method=st.LocalCriterion())
    assert "in_gap" not in whole


def heights_in(folder, ending):
    """VALUES as heights of micrometres, one for each MPa, and what must be said to read them."""
    path, heights = folder / f"heights{ending}", VALUES * 1e-6
    if ending == ".npy":
        np.save(path, heights)
        return path, {"unit": "um"}
    if ending == ".nc":
        coords = {name: (name, at, {"units": "m"}) for name, at in PLANE.coordinates.items()}
        array = xr.DataArray(heights, dims=("x", "y"), coords=coords, attrs={"units": "um"})
        array.transpose("y", "x").to_dataset(name="z").to_netcdf(path)
        return path, {}
    text(path)
    path.write_text(path.read_text().replace("strength (MPa)", "z (um)"))
    return path, {}


@pytest.mark.parametrize("ending", [".csv", ".nc", ".npy"])
def test_heights_of_a_map_are_mapped_from_metres(tmp_path, ending):
    path, said = heights_in(tmp_path, ending)
    with pytest.raises(st.InputError, match="plainly the strength|no unit of stress"):
        st.read_profile(path, interface=PLANE, **said)
    found = st.read_profile(path, interface=PLANE, strength=lambda h: 1e12 * h, **said)
    np.testing.assert_allclose(found, VALUES, rtol=1e-8)
    assert found.attrs["units"] == "Pa"
    unit = "banana" if ending == ".npy" else "mm"
    with pytest.raises(st.InputError, match="said to be in mm, the source states um|unknown unit"):
        st.read_profile(path, interface=PLANE, strength=lambda h: h, unit=unit)
    with pytest.raises(st.InputError, match="strength: must return one value a point"):
        st.read_profile(path, interface=PLANE, strength=lambda h: h.mean(), **said)


def test_heights_whose_axes_changed_places_are_refused(tmp_path):
    np.save(tmp_path / "turned.npy", VALUES.T * 1e-6)
    turned = PLANE.coordinates["x"], PLANE.coordinates["y"]
    with pytest.raises(st.InputError, match="x and y have changed places"):
        st.read_profile(tmp_path / "turned.npy", interface=PLANE, strength=lambda h: h, unit="um")
    array = xr.DataArray(VALUES.T, dims=("x", "y"), coords={"x": turned[1], "y": turned[0]})
    with pytest.raises(st.InputError, match="y reaches from 0 to 0.019375 m"):
        st.read_profile(array, interface=PLANE, strength=lambda h: h)


@pytest.mark.parametrize("interface", [None, st.Interface(length=0.02, nodes=32)])
@pytest.mark.parametrize("ending", [".csv", ".nc", ".npy", "matrix", "array"])
@pytest.mark.filterwarnings("error")
def test_a_map_is_not_read_as_a_line(tmp_path, ending, interface):
    if ending == "matrix":
        path = tmp_path / "matrix.csv"
        np.savetxt(path, VALUES, delimiter=",")
    elif ending == "array":
        path = xr.DataArray(VALUES, dims=("x", "y"))
    else:
        path, _ = heights_in(tmp_path, ending)
    for given in ({}, {"strength": lambda h: 1e12 * h, "unit": "um"}):
        with pytest.raises(st.InputError, match=r"interface=st.Interface\(length=\(Lx, Ly\)"):
            st.read_profile(path, interface=interface, **given)


def test_filled_gaps_of_a_turned_map_stay_where_they_are(tmp_path):
    path = text(tmp_path / "map.csv", without=3)
    with pytest.warns(st.AccuracyWarning, match="filled"):
        filled = st.read_profile(path, interface=PLANE, gaps="fill")
    found = at_nodes("strength", filled[::-1, ::-1], "strength", PLANE)
    np.testing.assert_array_equal(found.values, filled)
    np.testing.assert_array_equal(found.measured, filled["measured"])


@pytest.mark.parametrize("order", ["descending", "shuffled"])
def test_coordinates_of_a_map_decide_and_not_the_order(tmp_path, order):
    values = VALUES + 1e4 * np.arange(16)
    array = xr.DataArray(values, dims=("x", "y"), coords=PLANE.coordinates, name="strength")
    for dim, count in array.sizes.items():
        index = np.arange(count)[::-1]
        if order == "shuffled":
            index = np.random.default_rng(0).permutation(count)
        array = array.isel({dim: index})
    array.to_netcdf(tmp_path / "map.nc")
    for source in (array, tmp_path / "map.nc"):
        np.testing.assert_array_equal(st.read_profile(source, interface=PLANE), values)
    unknown = array.assign_coords(x=np.where(array.x == 0.0, np.nan, array.x))
    with pytest.raises(st.InputError, match="x must be finite"):
        st.read_profile(unknown, interface=PLANE)


def test_a_matrix_as_text_is_told_what_it_is(tmp_path):
    np.savetxt(tmp_path / "map.csv", VALUES, delimiter=",")
    with pytest.raises(st.InputError, match="16 columns without names, as of a matrix.*np.save"):
        st.read_profile(tmp_path / "map.csv", interface=PLANE)


def test_options_without_a_meaning_on_a_plane_are_refused(tmp_path):
    np.save(tmp_path / "map.npy", VALUES)
    with pytest.raises(st.InputError, match="interpolate: is an option of profiles of a line"):
        st.read_profile(tmp_path / "map.npy", interface=PLANE, interpolate=True)
    with pytest.raises(st.InputError, match="value: a .npy file of a plane holds one array"):
        st.read_profile(tmp_path / "map.npy", interface=PLANE, value="q")
    given = xr.DataArray(VALUES, dims=("x", "y"), name="tau")
    with pytest.raises(st.InputError, match="value: 'q' is not the one variable here, 'tau'"):
        st.read_profile(given, interface=PLANE, value="q")
