"""Profiles and maps of one's own: units, coordinates and gaps decide, wherever one enters."""

import warnings

import numpy as np
import pytest
import xarray as xr
from recording import stored
from records.test_mistakes_in_files import LINE, NODES, PLANE, STRENGTH, SYSTEM, X, onset
from setups import make_problem
from small_study import small_study

import stiction as st


def found(tau_p):
    result = onset(tau_p)
    return result.critical_stress.item(), result.critical_position.item()


def labelled(strength=STRENGTH, x=X, x_unit=None, **attributes):
    place = ("x", x, {"units": x_unit}) if x_unit else x
    return xr.DataArray(strength, dims="x", coords={"x": place}, attrs=attributes)


SHUFFLED = np.random.default_rng(0).permutation(NODES)
ROLLED = np.roll(np.arange(NODES), 50)  # from the middle of the interface on


def test_the_coordinate_decides_and_not_the_order(tmp_path):
    for text in stored("cases")["orders of a coordinate"]:
        given = eval(text)
        assert found(given) == found(STRENGTH), text
        assert found(given.to_dataset(name="strength")) == found(STRENGTH), text
    values = 1e6 + 1e4 * np.arange(32)[:, None] + 1e3 * np.arange(16)
    array = xr.DataArray(values, PLANE.coordinates, ("x", "y"), name="strength")
    for dim, count in array.sizes.items():
        array = array.isel({dim: np.random.default_rng(0).permutation(count)})
    array.to_netcdf(tmp_path / "map.nc")
    for source in (array, tmp_path / "map.nc"):
        np.testing.assert_array_equal(st.read_profile(source, interface=PLANE), values)
    # In NetCDF files a variable called position need not be a coordinate.
    position = ("point", X[::-1] * 1e3, {"units": "mm"})
    data = xr.Dataset({"position": position, "strength": ("point", STRENGTH[::-1])})
    data.to_netcdf(tmp_path / "p.nc")
    for source in (data, tmp_path / "p.nc"):
        np.testing.assert_array_equal(st.read_profile(source, interface=LINE), STRENGTH)


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


def test_everything_beside_the_strength_is_read_alike():
    """What a sample holds, and what a problem holds; labels of a dataset name what is measured."""
    residual = 1e5 + 1e6 * X
    tau_r = labelled(residual[::-1] * 1e-3, X[::-1] * 1e3, "mm", units="kPa")
    initial = xr.DataArray(0.01, attrs={"units": "MPa"})
    load = st.Load(profile=labelled(1.0 + X[::-1], X[::-1]))
    problem = make_problem(NODES, load=load, residual_strength=tau_r)
    np.testing.assert_allclose(problem.friction.residual_strength, residual, rtol=1e-14)
    np.testing.assert_array_equal(problem.load.profile, 1.0 + X)
    rows = SYSTEM.sample({"strength": STRENGTH, "initial_stress": initial})
    np.testing.assert_allclose(rows.initial_stress, 1e4)
    dataset = labelled().to_dataset(name="tau_p").assign(tau_i=labelled(STRENGTH / 2))
    assert found({"strength": dataset}) == found(STRENGTH)
    assert "unit" not in st.read_profile(labelled(STRENGTH / 1e6, unit="MPa")).attrs


@pytest.mark.parametrize("comma", [False, True])
def test_headings_of_laboratories(tmp_path, comma):
    """Of a table, with the scales of x and of the strength in SI."""
    path = tmp_path / "p.csv"
    for head, (x_scale, scale) in stored("headings").items():
        last = (head or ";").splitlines()[-1]
        separator = next((mark for mark in (";", "\t", ",") if mark in last), "  ")
        rows = zip(X * x_scale, STRENGTH * scale, strict=True)
        text = "\n".join(separator.join(f"{value:.12g}" for value in row) for row in rows)
        if comma and separator != ",":
            text = text.replace(".", ",")
        text = f"{head}\n{text}\n"
        path.write_text(text, encoding="utf-8" if "\ufeff" in text else "cp1252")
        with warnings.catch_warnings(action="error" if head else "ignore"):
            profile = st.read_profile(path, interface=LINE)
        np.testing.assert_allclose(profile, STRENGTH, rtol=1e-9, err_msg=head)
        assert (profile.attrs["units"], profile.x.attrs["units"]) == ("Pa", "m"), head


def test_profiles_in_a_study_file(tmp_path):
    for name, (head, columns) in stored("cases")["profiles of a study file"].items():
        table = np.column_stack(eval(columns))
        np.savetxt(tmp_path / name, table, "%.12g", ";", header=head, comments="")
    study = small_study(method={"type": "equilibrium"})
    study["problem"]["friction"]["residual_strength"] = "tau_r.csv"
    load = {"file": "load.csv", "x_unit": "m"}
    study["problem"]["load"] = {"profile": load, "normal_pressure": "pressure.txt"}
    loaded = st.Study.from_dict(study, folder=tmp_path)
    problem = loaded.problem
    residual = problem.friction.residual_strength
    np.testing.assert_allclose(residual, 1e5 + 1e6 * X, rtol=1e-11)
    np.testing.assert_allclose(problem.load.normal_pressure, (5.0 + X) * 1e6, rtol=1e-11)
    np.testing.assert_allclose(problem.load.profile, 1.0 + X, rtol=1e-11)
    assert st.Study.from_dict(loaded.to_dict()) == loaded


@pytest.mark.parametrize("kind", "bBhHiIlLfd")
def test_a_netcdf_file_holds_numbers_of_any_type(kind, tmp_path):
    values = (1 + np.arange(NODES) % 100).astype(kind)
    labelled(values, x_unit="m", units="kPa").rename("strength").to_netcdf(tmp_path / "a.nc")
    np.testing.assert_array_equal(st.read_profile(tmp_path / "a.nc"), 1e3 * values)
