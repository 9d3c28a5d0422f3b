"""What `export` writes: as the suffix says, with units, to the last digit."""

import csv
import re

import numpy as np
import pytest
import xarray as xr

import stiction as st


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A sweep with profiles kept, on disk."""
    problem = st.paper.problem(nodes=256)
    study = st.Study(
        problem=problem,
        random=st.paper.strength(problem, 0.5),
        method=st.LocalCriterion(),
        ensemble=st.Ensemble(samples=5, first=2, keep=("strength",)),
        sweep=[
            {"random.strength.spectrum.correlation_length": [1e-3, 2e-3, 3e-3]},
            {"method": [{"type": "local_criterion"}, {"type": "local_criterion"}]},
        ],
    )
    folder = tmp_path_factory.mktemp("runs") / "run"
    study.run(out=folder)
    return folder


def test_a_table_reads_back_to_the_last_bit(run, tmp_path):
    with pytest.warns(st.AccuracyWarning, match="strength: profiles along the interface"):
        st.open_run(run).export(tmp_path / "out.csv")
    with (tmp_path / "out.csv").open(newline="", encoding="utf-8") as file:
        head, *rows = list(csv.reader(file))
    # Every column says its unit, in the last brackets.
    names = {re.fullmatch(r"(\w+) \((.+)\)", column).groups() for column in head}
    assert {("correlation_length", "m"), ("sample", "1"), ("critical_stress", "Pa")} <= names
    assert len(rows) == 3 * 2 * 5
    whole = st.open_run(run).dataset()
    flat = whole["critical_stress"].stack(row=("correlation_length", "method", "sample"))
    found = [float(row[head.index("critical_stress (Pa)")]) for row in rows]
    np.testing.assert_array_equal(found, flat.values)
    assert [int(row[head.index("sample (1)")]) for row in rows] == [2, 3, 4, 5, 6] * 6
    lengths = [float(row[head.index("correlation_length (m)")]) for row in rows]
    np.testing.assert_array_equal(lengths, flat["correlation_length"].values)


def test_netcdf_holds_everything(run, command, tmp_path):
    code, _, err = command("export", run, tmp_path / "out.nc")
    assert (code, err) == (0, "")
    with xr.open_dataset(tmp_path / "out.nc") as found:
        assert found["strength"].attrs["units"] == "Pa"
        assert found["strength"].dims[-1] == "x"


@pytest.mark.parametrize("name", ["out.txt", "out"])
def test_other_suffixes_are_refused(run, command, tmp_path, name):
    code, _, err = command("export", run, tmp_path / name)
    assert code == 2
    assert all(suffix in err for suffix in (".nc", ".csv"))
    assert not (tmp_path / name).exists()
    with pytest.raises(st.InputError, match="suffix"):
        st.open_run(run).export(tmp_path / name)
