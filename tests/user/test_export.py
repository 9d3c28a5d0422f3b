"""What `export` writes: as the suffix says, with units, to the last digit."""

import csv
import re

import numpy as np
import pytest
import xarray as xr
from refusals import refuses
from small_study import lengths, small_study

import stiction as st


def test_what_is_exported_reads_back_to_the_last_bit(command, tmp_path):
    """A sweep with profiles kept."""
    local = {"type": "local_criterion"}
    sweep = [*lengths(4e-3, 6e-3, 8e-3), {"method": [local, local]}]
    ensemble = {"samples": 5, "first": 2, "keep": ["strength"]}
    run = tmp_path / "run"
    whole = st.Study.from_dict(small_study(ensemble=ensemble, sweep=sweep)).run(out=run)
    with pytest.warns(st.AccuracyWarning, match="strength: profiles along the interface"):
        st.open_run(run).export(tmp_path / "out.csv")
    with (tmp_path / "out.csv").open(newline="", encoding="utf-8") as file:
        head, *rows = list(csv.reader(file))
    # Every column says its unit, in the last brackets.
    names = {re.fullmatch(r"(\w+) \((.+)\)", column).groups() for column in head}
    assert {("correlation_length", "m"), ("sample", "1"), ("critical_stress", "Pa")} <= names
    flat = whole["critical_stress"].stack(row=("correlation_length", "method", "sample"))
    columns = dict(zip(head, np.array(rows).T, strict=True))
    for name, expected in {
        "critical_stress (Pa)": flat,
        "correlation_length (m)": flat["correlation_length"],
        "sample (1)": [2, 3, 4, 5, 6] * 6,
    }.items():
        np.testing.assert_array_equal(columns[name].astype(float), expected)
    assert command("export", run, tmp_path / "out.nc")[0] == 0
    with xr.open_dataset(tmp_path / "out.nc") as found:
        assert found["strength"].attrs["units"] == "Pa"
        assert found["strength"].dims[-1] == "x"
    for name in ("out.txt", "out"):
        code, _, said = command("export", run, tmp_path / name)
        assert code == 2
        assert all(suffix in said for suffix in (".nc", ".csv"))
        assert not (tmp_path / name).exists()
        refuses("suffix", lambda name=name: st.open_run(run).export(tmp_path / name))
