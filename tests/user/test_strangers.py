"""Files from strangers and shared machines: no code, no other file, no wait, little memory."""

import os
import shutil
import stat
import warnings
from pathlib import Path

import pytest
from checks import python

from stiction.base import files
from stiction.base.files import private_folder

pytestmark = pytest.mark.skipif(os.name != "posix", reason="Windows has other means")
SOURCES = Path(__file__).parents[2] / "src"

# -- the folders of kernels ----------------------------------------------------------------------


def kept(folder):
    """Where kernels of this folder are kept, and what is warned of."""
    for cached in (files._stand_in, files._warn_of):
        cached.cache_clear()
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
def test_a_folder_that_others_could_write_is_not_used(tmp_path, depth):
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


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() != 0, reason="only root gives away"
)
@pytest.mark.parametrize("depth", range(3))
def test_a_folder_of_another_user_is_not_used(tmp_path, depth):
    folder = tmp_path / "cache" / "compiled"
    kept(folder)
    (folder / "kernel").write_text("")
    weak = (folder / "kernel", folder, folder.parent)[depth]
    os.chown(weak, 12345, 0)
    _, (warning,) = kept(folder)
    assert f"{weak} belongs to another user" in warning


def test_the_current_folder_chooses_no_folder_of_kernels(tmp_path, monkeypatch):
    """Neither by numba's own file nor by a relative path in the environment."""
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.chdir(tmp_path)
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: planted\n")
    where = (
        "import warnings\nwith warnings.catch_warnings(record=True) as caught:\n"
        "    warnings.simplefilter('always')\n"
        "    from stiction.base.jit.folder import kernel_folder\n"
        "    print(kernel_folder('stiction.random.synthesis', 'x').resolve())\n"
        "    print(*[one.message for one in caught])"
    )
    given = {"cwd": tmp_path, "PYTHONPATH": SOURCES, "STICTION_CACHE_DIR": tmp_path / "cache"}
    place, warning = python("-c", where, **given).splitlines()
    assert Path(place).parents[2] == tmp_path / "cache"
    assert warning.count(".numba_config.yaml") == 1
    shutil.rmtree(tmp_path / "cache")
    for name in ("NUMBA_CACHE_DIR", "STICTION_CACHE_DIR"):
        place, warning = python("-c", where, **given | {name: "planted"}).splitlines()
        assert tmp_path not in Path(place).parents
        assert "not an absolute path" in warning
    assert not (tmp_path / "planted").exists()
