"""Mutated tables, workbooks, NetCDF and runs are refused in a line, or read: no traceback.

More of them: pytest tests/fuzz/test_files.py --fuzz-count 15000 --fuzz-seed 771.
"""

import io
import json
import random
import shutil
import zipfile
from functools import partial

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from small_study import small_study
from trials import VALUES, fault, mutated, mutated_tree

import stiction as st
from stiction.base import files
from stiction.ensemble import store

pytestmark = pytest.mark.filterwarnings("ignore")
X, Y = np.arange(32) * 1e-3, np.random.default_rng(0).random(32) + 1.0
TABLE = pd.DataFrame({"x_m": X, "strength_MPa": Y})
SEPARATORS = {"p.csv": ";", "p.txt": " ", "p.dat": ","}


def workbook(folder):
    TABLE.to_excel(folder / "p.xlsx", index=False)
    return "p.xlsx", (folder / "p.xlsx").read_bytes()


def netcdf(folder, **options):
    data = xr.Dataset({"strength": ("x", Y, {"units": "MPa"})}, {"x": ("x", X)})
    engine = "scipy" if options.get("format") else "h5netcdf"
    data.to_netcdf(folder / "p.nc", engine=engine, **options)
    return "p.nc", (folder / "p.nc").read_bytes()


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """Good files to begin with, and a run."""
    folder = tmp_path_factory.mktemp("sources")
    array = io.BytesIO()
    np.save(array, Y)
    packed = {"encoding": {"strength": {"zlib": True, "shuffle": True, "fletcher32": True}}}
    good = [
        (name, TABLE.to_csv(sep=separator, index=False).encode())
        for name, separator in SEPARATORS.items()
    ]
    good += [
        workbook(folder), netcdf(folder), netcdf(folder, **packed),
        netcdf(folder, format="NETCDF3_CLASSIC"), ("p.npy", array.getvalue()),
    ]  # fmt: skip
    st.Study.from_dict(small_study(64)).run(out=folder / "run", workers=1, progress=False)
    return good, folder / "run"


def mutated_workbook(data, chance):
    """A workbook one of whose parts is mutated: a mutated archive is soon refused."""
    file = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as whole, zipfile.ZipFile(file, "w") as packed:
        names = whole.namelist()
        victim = chance.choice(["xl/worksheets/sheet1.xml", chance.choice(names)])
        for name in names:
            part = whole.read(name)
            packed.writestr(name, mutated(part, chance) if name == victim else part)
    return file.getvalue()


def forged(content, chance):
    """Plain content that is replaced, or changed inside."""
    values = [*VALUES, None, 2**63]
    if not content or chance.random() < 0.2:
        return chance.choice(values)
    mutated_tree(content, chance, values)
    return content


def forge(folder, chance):
    """Change something of a run, and make all digests right."""
    (path,) = (folder / "chunks").iterdir()
    arrays = files.read_arrays(path)
    kind = chance.choice(("study", "about", "rows", "bytes", "pilot"))
    if kind in ("study", "pilot"):
        victim = folder / f"{kind}.json"
        store._write_json(victim, forged(store.read_json(victim), chance))
        return kind
    if kind == "about":
        parts = forged(json.loads(arrays["about"].tobytes()), chance)
        arrays["about"] = np.frombuffer(json.dumps(parts).encode(), np.uint8)
    elif kind == "rows":
        rows = arrays["rows"].copy()
        name = chance.choice(rows.dtype.names)
        rows[name] = chance.choice((-1, 77, 2**62))
        kind += " of numbers" * (name[0] != "_")
        kinds = [(one, rows.dtype[one]) for one in rows.dtype.names]
        at = chance.randrange(len(kinds))
        kinds[at] = (
            chance.choice((kinds[at][0], "x")),
            chance.choice(("f4", "i8", "U3", "(2,)f8")),
        )
        arrays["rows"] = chance.choice((rows, rows[:0], rows[:, None], rows.astype(kinds)))
    packed = io.BytesIO()
    np.savez(packed, **arrays)
    data = packed.getvalue() if kind != "bytes" else mutated(packed.getvalue(), chance)
    path.unlink()
    (path.parent / f"{store.digest(data)}.npz").write_bytes(data)
    return kind


def test_mutated_files_are_refused_or_read(tmp_path, fuzz, sources):
    chance, faults = random.Random(fuzz.seed), []
    for number in range(fuzz.count):
        name, data = chance.choice(sources[0])
        change = mutated_workbook if name == "p.xlsx" and chance.random() < 0.9 else mutated
        path = tmp_path / name
        path.write_bytes(change(data, chance))
        read = st.read_peaks if name == "p.csv" and chance.random() < 0.2 else st.read_profile
        if wrong := fault(partial(read, path), 20.0):
            faults.append(f"file {number} ({name}): {wrong}")
    assert not faults, "\n".join(faults)


def test_forged_runs_are_refused_damaged_or_read(tmp_path, fuzz, sources):
    chance, faults = random.Random(fuzz.seed), []

    whole = st.open_run(sources[1]).dataset().drop_attrs()

    def use(folder, kind):
        """What is wrong counts as damage, and is computed again."""
        stored = st.open_run(folder)
        stored.status()
        stored.export(folder / "out.nc", partial=True)
        study = st.Study.from_dict(small_study(64))
        again = study.run(out=folder, workers=1, progress=False)
        assert kind == "rows of numbers" or again.drop_attrs().identical(whole), kind

    for number in range(max(1, fuzz.count // 5)):
        folder = tmp_path / f"{number}"
        shutil.copytree(sources[1], folder)
        kind = forge(folder, chance)
        if wrong := fault(partial(use, folder, kind), 20.0):
            faults.append(f"run {number} ({kind}): {wrong}")
        shutil.rmtree(folder)
    assert not faults, "\n".join(faults)
