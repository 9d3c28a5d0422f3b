"""Maps of a plane, with gaps and as text."""

import numpy as np
import pytest
import xarray as xr
from refusals import refuses

import stiction as st

PLANE = st.Interface(length=(0.02, 0.01), nodes=(32, 16))
VALUES = 1e6 + 1e5 * np.sin(2.0 * np.pi * PLANE.x / 0.02)[:, None] * np.ones(16)
MAP = xr.DataArray(VALUES, dims=("x", "y"), coords=PLANE.coordinates, name="strength")


def text(path, head="x (mm); y (mm); strength (MPa)", without=0):
    x, y = np.meshgrid(*PLANE.coordinates.values(), indexing="ij")
    rows = np.column_stack([1e3 * x.ravel(), 1e3 * y.ravel(), 1e-6 * VALUES.ravel()])[without:]
    rows = np.random.default_rng(0).permutation(rows)
    np.savetxt(path, rows, delimiter=";", header=head, comments="", fmt="%.9g")
    return path


def read(source, **options):
    return st.read_profile(source, interface=PLANE, **options)


def test_gaps_are_refused_or_left(tmp_path):
    path = text(tmp_path / "map.csv", without=3)
    refuses("at 3 of 512 nodes, the first at x = 0 m, y = 0 m", lambda: read(path))
    assert int(np.isnan(read(path, gaps="skip")).sum()) == 3
    refuses("gaps are filled on periodic lines only", lambda: read(path, gaps="fill"))


@pytest.fixture(params=[".csv", ".nc", ".npy"])
def heights(request, tmp_path):
    """A file of VALUES as heights of micrometres, one for each MPa, and how it is read."""
    path = tmp_path / f"heights{request.param}"
    if request.param == ".npy":
        np.save(path, VALUES * 1e-6)
        return path, {"unit": "um"}
    if request.param == ".nc":
        array = (MAP * 1e-6).assign_attrs(units="um").transpose("y", "x")
        array.to_dataset(name="z").to_netcdf(path)
        return path, {}
    return text(path, "x (mm); y (mm); z (um)"), {}


@pytest.mark.parametrize("order", ["descending", "shuffled"])
def test_coordinates_of_a_map_decide_and_not_the_order(tmp_path, order):
    values = VALUES + 1e4 * np.arange(16)
    array = MAP.copy(data=values)
    for dim, count in array.sizes.items():
        shuffled = np.random.default_rng(0).permutation(count)
        array = array.isel({dim: shuffled if order == "shuffled" else np.arange(count)[::-1]})
    array.to_netcdf(tmp_path / "map.nc")
    for source in (array, tmp_path / "map.nc"):
        np.testing.assert_array_equal(read(source), values)
