"""Files from strangers and shared machines: no code, no other file, no wait, little memory."""

import io
import os
import shutil
import stat
import warnings
import zipfile
import zlib
from contextlib import suppress
from functools import cache, partial
from pathlib import Path

import h5py
import matplotlib
import numpy as np
import openpyxl
import pytest
import tomli_w
import xarray as xr
from checks import python
from recording import stored
from refusals import refuses
from small_study import altered, small_study

import stiction as st
from stiction.base import files, netcdf
from stiction.base.files import private_folder
from stiction.base.netcdf import read_netcdf
from stiction.methods.dynamics.save import open_rupture
from stiction.problem.reading.files import NETCDF, TEXT

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Windows has other means")
SOURCES = Path(__file__).parents[2] / "src"

# -- the folders of kernels ----------------------------------------------------------------------


def kept(folder):
    """Where kernels of this folder are kept, and what is warned of."""
    files._warn_once.cache_clear()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        return private_folder(folder), [str(one.message) for one in caught]


def test_folders_of_kernels_are_made_for_their_user_alone(tmp_path):
    mask = os.umask(0o002)
    try:
        folder = tmp_path / "cache" / "compiled" / "digest"
        assert kept(folder) == (folder, [])
    finally:
        os.umask(mask)
    for made in (folder, *list(folder.parents)[:2]):
        assert stat.S_IMODE(made.stat().st_mode) == 0o700


@pytest.mark.parametrize("depth", range(4))
def test_a_folder_of_others_or_that_they_could_write_is_not_used(tmp_path, depth):
    """Whichever of them it is: who can write to one above can put another in its place."""
    folder = tmp_path / "cache" / "compiled" / "digest"
    kept(folder)
    (folder / "inside").mkdir()
    folder.chmod(0o755)
    weak = (folder / "inside", folder, folder.parent, folder.parents[1])[depth]
    for mode in (0o775, 0o757):
        weak.chmod(mode)
        place, (warning,) = kept(folder)
        assert f"{weak} can be written by others" in warning
        assert "chmod go-w" in warning
        assert tmp_path not in place.parents
        assert stat.S_IMODE(place.stat().st_mode) == 0o700
    weak.chmod(0o1777)  # others cannot put anything in the place of what is there
    assert bool(kept(folder)[1]) == (depth < 2)
    if os.geteuid() == 0 and depth < 3:  # only root gives away
        weak.chmod(0o700)
        os.chown(weak, 12345, 0)
        assert f"{weak} belongs to another user" in kept(folder)[1][0]


WHERE = """
import warnings
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    from stiction.base.files import kernel_folder
    print(kernel_folder("stiction.random.synthesis", "x").resolve())
    print(*[warning.message for warning in caught])
"""


def test_the_current_folder_chooses_no_folder_of_kernels(tmp_path, monkeypatch):
    """Neither by numba's own file nor by a relative path in the environment."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: planted\n")
    given = {"cwd": tmp_path, "PYTHONPATH": SOURCES, "STICTION_CACHE_DIR": tmp_path / "cache"}
    place, warning = python("-c", WHERE, **given).splitlines()
    assert Path(place).parents[2] == tmp_path / "cache"
    assert warning.count(".numba_config.yaml") == 1
    shutil.rmtree(tmp_path / "cache")
    for name in ("NUMBA_CACHE_DIR", "STICTION_CACHE_DIR"):
        place, warning = python("-c", WHERE, **given | {name: "planted"}).splitlines()
        assert tmp_path not in Path(place).parents
        assert "not an absolute path" in warning
    assert not (tmp_path / "planted").exists()


# -- files of every kind, to every reader --------------------------------------------------------

STUDY, CHUNK = small_study(64), f"chunks/{'0' * 32}.npz"
READERS = {
    **{f"p{ending}": st.read_profile for ending in (*TEXT, *NETCDF, ".xlsx", ".npy")},
    "peaks.csv": st.read_peaks,
    "study.toml": st.Study.from_toml,
    "study.json": lambda path: st.open_run(path.parent),
    "pilot.json": lambda path: st.open_run(path.parent).dataset(),
    CHUNK: lambda path: st.open_run(path.parents[1]).status(),
    "frames-1.nc": lambda path: open_rupture(path.parent),
    "fitted.npz": files.read_arrays,
}


@cache
def zipped():
    """An archive of 64 MB of zeros."""
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as packed:
        packed.writestr("rows.npy", bytes(2**26))
    return archive.getvalue()


class Code:
    """What a pickle runs."""

    def __reduce__(self):
        return pytest.fail, ("a file has run code",)


def pickled(path):
    with path.open("wb") as file:
        (np.savez if path.suffix == ".npz" else np.save)(file, np.array([Code()]))


KINDS = stored("strange_files")["files of every kind"]
"""How a file of each kind is made at a path."""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run with one chunk and a pilot."""
    folder = tmp_path_factory.mktemp("strangers") / "run"
    st.Study.from_dict(STUDY).run(out=folder, workers=1, progress=False)
    return folder


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.filterwarnings("ignore")
def test_no_reader_takes_such_a_file(tmp_path, run, kind):
    """A pipe would wait for ever, the others would take all memory, or hours."""
    for name, read in READERS.items():
        folder = tmp_path / name.replace("/", " ")
        shutil.copytree(run, folder)
        path = folder / name
        path.unlink(missing_ok=True)
        eval(KINDS[kind])
        try:
            found = read(path)
            said = name == "pilot.json" or found.damaged  # a pilot may be lost
        except (st.InputError, st.RunError, *files.UNREADABLE) as error:
            said = str(error).strip()
            assert len(said) < 1000
            if kind in ("pipe", "device", "folder"):  # which is seen before it is opened
                assert "regular" in said or "link" in said, name
        assert said, name


@pytest.mark.parametrize("name", ["study.json", "pilot.json", CHUNK, "chunks"])
def test_a_run_folder_holds_no_links(tmp_path, run, name, command):
    """Neither to be read nor to be written to: what they lead to stays as it is."""
    folder, elsewhere = tmp_path / "run", tmp_path / "elsewhere"
    shutil.copytree(run, folder)
    whole = folder / name if (folder / name).exists() else next((folder / "chunks").iterdir())
    whole.rename(elsewhere)
    if elsewhere.is_dir():
        (elsewhere / f"{'c' * 32}.npz").write_bytes(b"theirs")
    (folder / name).symlink_to(elsewhere)
    before = {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}
    (tmp_path / "study.toml").write_text(tomli_w.dumps(STUDY))
    words = "study.json" if name == "pilot.json" else name
    for line in (("report", folder), ("run", tmp_path / "study.toml", "--out", folder)):
        code, _, errors = command(*line)
        assert (code, errors.count("error:")) == (2, 1), errors
        assert Path(words).name in errors or "pilot" in errors
    (tmp_path / "study.toml").unlink()
    assert before == {path: path.read_bytes() for path in tmp_path.rglob("*") if path.is_file()}


# -- NetCDF --------------------------------------------------------------------------------------


def hdf5(path, **datasets):
    """A file with a variable that holds what each is given, or is made as a function has it."""
    with h5py.File(path, "w") as file:
        for name, given in datasets.items():
            made = given(file) if callable(given) else file.create_dataset(name, data=given)
            if made is not None:
                made.attrs["units"] = "MPa"


def virtual(file):
    layout = h5py.VirtualLayout((8,), "u1")
    layout[:] = h5py.VirtualSource("other.nc", "strength", (8,))
    return file.create_virtual_dataset("strength", layout)


def inflating(file):
    """A chunk of eight values that unpacks to 64 MB."""
    made = file.create_dataset("strength", (8,), "f8", chunks=(8,), compression="gzip")
    made.id.write_direct_chunk((0,), zlib.compress(bytes(2**26), 9))
    return made


NETCDF_ATTACKS = stored("strange_files")["attacks of NetCDF files"]
"""Words of the refusal, and what makes the variable in an open file."""


@pytest.mark.parametrize("attack", NETCDF_ATTACKS)
def test_a_profile_holds_its_own_numbers(tmp_path, attack, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("secret").write_bytes(b"not for you")
    hdf5("other.nc", strength=np.arange(1.0, 9.0))
    assert st.read_profile("other.nc").values.tolist() == [1e6 * i for i in range(1, 9)]
    words, made = NETCDF_ATTACKS[attack]
    hdf5("p.nc", strength=eval(made))
    refuses(words, lambda: st.read_profile("p.nc"))


def test_texts_of_a_netcdf_file_are_counted_one_by_one(tmp_path, monkeypatch):
    """HDF5 may refer to one text many times: a thousand times a megabyte, from a file of one."""
    hdf5(tmp_path / "p.nc", strength=np.ones(8), names=["a" * 10**4] * 10)
    content = (tmp_path / "p.nc").read_bytes()
    assert set(read_netcdf(content)) == {"strength", "names"}
    with h5py.File(io.BytesIO(content)) as file:
        refuses("texts ... more memory than the whole file",
                lambda: netcdf._check(file, content[:10**5], ()))  # fmt: skip
        assert netcdf._check(file, content[: 10**5 + 10], ["names"]) == []
    with h5py.File(tmp_path / "p.nc", "w") as file:
        file.create_dataset("strength", data=np.ones(8)).attrs["list"] = ["long" * 99] * 50
    monkeypatch.setattr(netcdf, "MAX_FILE_BYTES", 2**14)
    refuses("'list' holds too many texts, 50", lambda: st.read_profile(tmp_path / "p.nc"))


def test_netcdf_is_read_as_by_its_own_library(tmp_path):
    """Dimensions, packed and missing values, groups, classic files."""
    chance = np.random.default_rng(0)
    data = xr.Dataset(
        {"a": (("x", "y"), chance.random((9, 4)), {"units": "MPa"}), "n": ("x", np.arange(9))},
        {"x": chance.random(9), "y": np.arange(4.0), "t": ("x", chance.random(9))},
        {"title": "µ", "number": 3, "list": [1.0, 2.0]},
    )
    data["a"][3, 1] = np.nan
    packed = {"dtype": "i2", "scale_factor": 1e-4, "_FillValue": -1}
    zipped_ = {"zlib": True, "shuffle": True, "chunksizes": (4, 3)}
    for number, options in enumerate([
        {}, {"encoding": {"a": packed | zipped_}}, {"format": "NETCDF3_64BIT"},
        {"encoding": {"a": zipped_ | {"fletcher32": True}}, "unlimited_dims": ["x"]},
    ]):  # fmt: skip
        path = tmp_path / f"{number}.nc"
        engine = "scipy" if options.get("format") else "h5netcdf"
        data.to_netcdf(path, engine=engine, **options)
        with xr.open_dataset(path, engine=engine) as expected:
            xr.testing.assert_identical(read_netcdf(path.read_bytes()), expected.load())


# -- the rest ------------------------------------------------------------------------------------


def test_a_workbook_is_looked_at_before_its_cells_are_kept(tmp_path):
    book = openpyxl.Workbook()
    book.active["A1"], book.active["XFD1048576"] = 1, 1
    book.save(tmp_path / "far.xlsx")
    refuses("a file of its size may", lambda: st.read_profile(tmp_path / "far.xlsx"))
    parts = {
        "xl/worksheets/sheet1.xml": b"<row><c><v>1</v></c></row>" * 2**20,
        "xl/styles.xml": b"<xf/>" * 2**20,
    }
    for name, content in parts.items():
        with zipfile.ZipFile(tmp_path / "p.xlsx", "w", zipfile.ZIP_DEFLATED) as packed:
            packed.writestr(name, content)
        refuses("would unpack", lambda: st.read_profile(tmp_path / "p.xlsx"))


def test_a_file_that_is_written_again_keeps_its_permissions(tmp_path):
    """And its content, with nothing beside it, if writing fails."""
    path = tmp_path / "result.csv"
    path.write_text("")

    def write(failure, aside):
        assert stat.S_IMODE(aside.stat().st_mode) == mode
        aside.write_text("half" if failure else "new")
        if failure:
            raise failure

    for failure in (None, OSError, RuntimeError, KeyboardInterrupt):
        mode = 0o640 if failure is RuntimeError else 0o604
        path.chmod(mode)
        with suppress(st.RunError, KeyboardInterrupt):
            files.write_whole(path, partial(write, failure))
        assert stat.S_IMODE(path.stat().st_mode) == mode
        assert [path.read_text(), *tmp_path.iterdir()] == ["new", path]


def test_check_lists_files_outside(tmp_path, command):
    inside, load = tmp_path / "inside", {"profile": "../p.npy", "initial_stress": "q.npy"}
    inside.mkdir()
    np.save(tmp_path / "p.npy", np.ones(64))
    np.save(inside / "q.npy", np.zeros(64))
    (inside / "study.toml").write_text(tomli_w.dumps(altered(STUDY, problem__load=load)))
    code, said, errors = command("check", inside / "study.toml")
    assert code == 0, errors
    outside = [line.split()[-1] for line in said.splitlines() if "file outside" in line]
    assert outside == [str(tmp_path / "p.npy")]


def test_the_current_folder_has_no_style_of_figures(tmp_path, run, monkeypatch, command):
    (tmp_path / "matplotlibrc").write_text("text.usetex: True\nbackend: module://nothing\n")
    monkeypatch.chdir(tmp_path)
    with matplotlib.rc_context(fname="matplotlibrc"):
        code, _, errors = command("report", run, "--out", tmp_path / "report.html")
    assert code == 0, errors
