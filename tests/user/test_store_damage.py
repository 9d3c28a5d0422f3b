"""Stored results are what was written, or it is said; nothing of anyone else's is touched."""

import errno
import fcntl
import json
import os
import subprocess
import sys
import threading
import warnings
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from executors import Forbidding
from small_study import lengths, small_study

from stiction.ensemble import files, resume, scheduler, store_writer
from stiction.ensemble.files import Lock
from stiction.ensemble.store import Store, sealed
from stiction.ensemble.store_writer import StoreWriter
from stiction.errors import StoreError
from stiction.stored_run import StoredRun, folder_beside
from stiction.study.study import Study
from stiction.study_run import run_into

STUDY = small_study(
    ensemble={"samples": 300, "seed": 3, "keep": ["strength"], "keep_samples": [1, 299]},
    sweep=lengths(4e-3, 6e-3),
)


def make_study(**changes):
    return Study.from_dict(STUDY | changes)


@pytest.fixture(autouse=True)
def often(monkeypatch):
    """Many chunks of fifty samples instead of one a second."""
    monkeypatch.setattr(resume, "FLUSH_SECONDS", 0.0)
    monkeypatch.setattr(
        scheduler.Sizer, "next", lambda sizer, plan, span, *rest: min(50, span.samples)
    )


@pytest.fixture(scope="module")
def reference():
    return make_study().run(workers=1)


@pytest.fixture
def run(tmp_path):
    run_into(make_study(), tmp_path / "run", workers=1)
    return tmp_path / "run"


def chunks(folder):
    return sorted((folder / "chunks").glob("*.nc"))


def flip(path, chance):
    """Change one byte somewhere."""
    data = bytearray(path.read_bytes())
    data[chance.integers(len(data))] ^= 1 << chance.integers(8)
    path.write_bytes(data)


def again(folder, words=None, executor=None):
    """Run the study again, with a warning if words are given and none if not."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = make_study().run(out=folder, workers=1, executor=executor)
    texts = "\n".join(str(w.message) for w in caught if w.category is UserWarning)
    assert bool(texts) == bool(words), texts
    assert all(word in texts for word in words or ()), texts
    return result


# -- what is reported is what is stored ----------------------------------------------------------


def test_a_chunk_damaged_while_the_run_goes_on(tmp_path, reference):
    def damage(done, total):
        if done == total:
            chunks(tmp_path / "run")[0].write_bytes(b"nonsense")

    with pytest.raises(StoreError, match="550 of 600 samples are stored.*computes them again"):
        run_into(make_study(), tmp_path / "run", workers=1, progress=damage)
    assert again(tmp_path / "run", ["50 samples are computed again"]).identical(reference)


def test_no_file_is_made_of_a_damaged_run(tmp_path, reference):
    beside = folder_beside(tmp_path / "result.nc")

    def damage(done, total):
        if done == total:
            chunks(beside)[0].unlink()

    with pytest.raises(StoreError, match="is gone"):
        run_into(make_study(), tmp_path / "result.nc", workers=1, progress=damage)
    assert not (tmp_path / "result.nc").exists()
    assert again(tmp_path / "result.nc", ["computed again"]).identical(reference)


def test_a_line_that_says_more_than_its_chunk_holds(run, reference):
    """With a digest of its own even: the samples of the chunk count, not those of the line."""
    lines = (run / "chunks.jsonl").read_bytes().splitlines(keepends=True)
    entry = json.loads(lines[0].partition(b" ")[2])
    point, first, count = entry["done"][0]
    entry["done"][0] = [point, first, count + 200]
    lines[0] = sealed(entry)
    (run / "chunks.jsonl").write_bytes(b"".join(lines))
    state = StoredRun(run).status()
    assert "holds other samples than the list says" in state.damaged[0]
    with pytest.warns(UserWarning, match="other samples"):
        assert StoredRun(run).dataset()["critical_stress"].isnull().sum() == 50


# -- checksums on everything kept ----------------------------------------------------------------


@pytest.mark.parametrize("name", ["manifest.json", "chunks.jsonl", "chunks"])
def test_one_bit_anywhere_is_found_and_mended(run, reference, name):
    for seed in range(12):
        chance = np.random.default_rng(seed)
        victim = chunks(run)[chance.integers(len(chunks(run)))] if name == "chunks" else run / name
        before = victim.read_bytes()
        flip(victim, chance)
        if name == "manifest.json":
            with pytest.raises(StoreError, match="damaged"):
                StoredRun(run)
        elif before[-1:] == victim.read_bytes()[-1:]:  # else the last line was cut short only
            assert StoredRun(run).status().damaged
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            assert make_study().run(out=run, workers=1).identical(reference)
        assert StoredRun(run).status().damaged == ()
        assert again(run).identical(reference)


@pytest.mark.parametrize("left", [None, 0, 0.5, 0.99], ids=["gone", "empty", "half", "cut"])
def test_chunks_that_no_list_names_are_said(run, reference, left):
    path = run / "chunks.jsonl"
    data = path.read_bytes()
    path.unlink()
    if left is not None:
        path.write_bytes(data[: int(left * len(data))])
    with pytest.warns(UserWarning, match=r"not in chunks\.jsonl.*running the study again"):
        found = StoredRun(run).dataset()
    assert "samples are done" in found.attrs["cut_short"]
    state = StoredRun(run).status(verify=False)
    assert state.done < state.samples
    assert all("not in chunks.jsonl" in text for text in state.damaged)
    assert again(run).identical(reference)


def test_what_joining_has_left_is_no_damage(run, reference):
    """Killed between the list and the removal of what was joined."""
    first = chunks(run)[0]
    (run / "chunks" / "000099-0123abcd.nc").write_bytes(first.read_bytes())
    assert StoredRun(run).status().damaged == ()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert StoredRun(run).dataset().identical(reference)


def test_a_lost_list_is_made_of_the_chunks(run, reference):
    (run / "chunks.jsonl").unlink()
    assert make_study().run(out=run, executor=Forbidding()).identical(reference)


@pytest.mark.parametrize("damage", [Path.unlink, lambda p: p.write_text("{"), Path.touch])
def test_a_damaged_manifest_is_made_of_the_study_and_the_chunks(run, reference, damage):
    damage(run / "manifest.json")
    other = make_study(ensemble={"samples": 300, "seed": 4})
    if damage is not Path.touch:
        with pytest.raises(StoreError, match="chunks belong to another study"):
            other.run(out=run)
        assert again(run, ["made anew"]).identical(reference)
    assert again(run).identical(reference)


def test_every_damaged_result_is_refused(tmp_path, reference):
    make_study().run(out=tmp_path / "result.nc", workers=1)
    whole = (tmp_path / "result.nc").read_bytes()
    accepted = 0
    for seed in range(40):
        (tmp_path / "result.nc").write_bytes(whole)
        flip(tmp_path / "result.nc", np.random.default_rng(seed))
        try:
            # Bits of HDF5's own that nothing depends on may change: then the content is the same.
            assert StoredRun(tmp_path / "result.nc").dataset().identical(reference)
            accepted += 1
        except StoreError as error:
            assert "damaged" in str(error) or "cannot be read" in str(error)  # noqa: PT017
    assert accepted < 35
    (tmp_path / "result.nc").write_bytes(whole)
    with xr.open_dataset(tmp_path / "result.nc") as result:
        changed = result.load()
        assert result["critical_stress"].encoding["fletcher32"]
    changed["critical_stress"][0, 0] *= 1.0 + 1e-15
    changed.to_netcdf(tmp_path / "changed.nc")
    with pytest.raises(StoreError, match="no checksum"):
        StoredRun(tmp_path / "changed.nc")


# -- nothing foreign is deleted ------------------------------------------------------------------


def test_files_of_others_stay(tmp_path, reference):
    foreign = ["note.txt", "note.nc", "000001.nc", "000001-mine.nc.part", "sub"]
    for name in ("run", "result.nc"):
        folder = tmp_path / name if name == "run" else folder_beside(tmp_path / name)
        make_study(ensemble=STUDY["ensemble"] | {"samples": 299, "keep_samples": [1]}).run(
            out=folder
        )
        for file in foreign[:-1]:
            (folder / "chunks" / file).write_text("mine")
        (folder / "chunks" / "sub").mkdir()
        study = make_study(ensemble=STUDY["ensemble"] | {"keep_samples": [1]})
        study.run(out=tmp_path / name)
        left = {path.name for path in (folder / "chunks").iterdir()}
        assert left >= set(foreign)


def test_chunks_that_are_a_link_are_refused(run, tmp_path):
    (run / "chunks").rename(tmp_path / "elsewhere")
    (run / "chunks").symlink_to(tmp_path / "elsewhere")
    (tmp_path / "elsewhere" / "000099-01234567.nc").write_text("mine")
    with pytest.raises(StoreError, match="no folder of its own"):
        make_study().run(out=run)
    assert (tmp_path / "elsewhere" / "000099-01234567.nc").read_text() == "mine"


@pytest.mark.parametrize("number", [errno.EIO, errno.EACCES])
@pytest.mark.parametrize("name", ["chunks.jsonl", "manifest.json", "000001"])
def test_what_cannot_be_read_is_not_damaged(run, monkeypatch, number, name):
    before = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    read = Path.read_bytes

    def fail(path):
        if path.name.startswith(name):
            raise OSError(number, os.strerror(number))
        return read(path)

    with monkeypatch.context() as patch:
        patch.setattr(Path, "read_bytes", fail)
        with pytest.raises(StoreError, match="cannot be read"):
            make_study().run(out=run)
        with pytest.raises(StoreError, match="cannot be read"):
            StoredRun(run).status()
    after = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    del before[run / "lock"], after[run / "lock"]  # says who wrote last
    assert after == before


# -- two writers ---------------------------------------------------------------------------------


def test_a_lock_that_vanishes_ends_the_first_run(tmp_path, reference):
    """The second run takes over; the first says why it ends, and nothing is damaged."""

    def vanish(done, total):
        if done == 200:
            (tmp_path / "run" / "lock").unlink()

    with pytest.raises(StoreError, match="was removed while this run was writing"):
        run_into(make_study(), tmp_path / "run", workers=1, progress=vanish)
    assert StoredRun(tmp_path / "run").status().damaged == ()
    assert again(tmp_path / "run").identical(reference)


@pytest.mark.parametrize("number", [errno.ENOLCK, errno.EOPNOTSUPP])
def test_a_file_system_without_locks(tmp_path, reference, monkeypatch, number):
    def fail(*arguments):
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(fcntl, "lockf", fail)
    with pytest.raises(StoreError, match="no locks.*--no-lock"):
        make_study().run(out=tmp_path / "run")
    assert make_study().run(out=tmp_path / "run", lock=False).identical(reference)
    assert not StoredRun(tmp_path / "run").status().active


def test_two_writers_without_a_lock_damage_nothing(tmp_path, reference, monkeypatch):
    """Each joins its chunks and writes the list as if alone; the next run finds all of both."""
    monkeypatch.setattr(store_writer, "MANY", 3)
    code = (
        "import sys, json; from stiction.ensemble import resume, scheduler;"
        "resume.FLUSH_SECONDS = 0.0; from stiction.ensemble import store_writer;"
        "store_writer.MANY = 3;"
        "scheduler.Sizer.next = lambda sizer, plan, span, *rest: min(20, span.samples);"
        "from stiction.study.study import Study; from stiction.study_run import run_into;"
        "run_into(Study.from_dict(json.loads(sys.argv[1])), sys.argv[2], lock=False, workers=1)"
    )
    command = [sys.executable, "-W", "ignore", "-c", code, json.dumps(STUDY), tmp_path / "run"]
    both = [subprocess.Popen(command, stderr=subprocess.PIPE, text=True) for _ in range(2)]
    for process in both:
        errors = process.communicate()[1]
        assert process.returncode == 0 or "StoreError" in errors, errors
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert make_study().run(out=tmp_path / "run", workers=1).identical(reference)
    assert StoredRun(tmp_path / "run").status().damaged == ()


def test_the_name_of_another_writer_is_printed_safely(tmp_path):
    holder = Lock(tmp_path / "lock")
    with holder:
        os.ftruncate(holder._handle, 0)
        os.pwrite(holder._handle, b"\x1b[2J process 7", 0)
        code = (
            "import sys; from pathlib import Path; from stiction.ensemble.files import Lock\n"
            "with Lock(Path(sys.argv[1])): pass"
        )
        done = subprocess.run(
            [sys.executable, "-c", code, tmp_path / "lock"], capture_output=True, text=True
        )
    assert "another run is writing" in done.stderr
    assert "\x1b" not in done.stderr


# -- size ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["run", "result.nc"])
def test_small_chunks_are_joined(tmp_path, reference, monkeypatch, name):
    monkeypatch.setattr(store_writer, "MANY", 4)
    monkeypatch.setattr(
        scheduler.Sizer, "next", lambda sizer, plan, span, *rest: min(7, span.samples)
    )
    folder = tmp_path / name if name == "run" else folder_beside(tmp_path / name)
    assert make_study().run(out=tmp_path / name, workers=1).identical(reference)
    if name == "run":
        found = Store(folder).chunks
        assert len(found) <= 3 * 4 < 600 / 7
        assert max(chunk.level for chunk in found) >= 2
        assert sum(chunk.samples for chunk in found) == 600
        assert {f"chunks/{path.name}" for path in chunks(folder)} == {c.file for c in found}


def test_killed_while_chunks_are_joined(run, reference, monkeypatch):
    """At each write in turn; nothing is lost, nothing computed again."""
    write = files.write_atomically
    for allowed in range(4):
        opened = StoreWriter(run, files.NoLock())
        monkeypatch.setattr(store_writer, "MANY", 2)
        left = [allowed]

        def dying(path, content, left=left):
            if not left[0]:
                raise KeyboardInterrupt
            left[0] -= 1
            write(path, content)

        with monkeypatch.context() as patch:
            patch.setattr(files, "write_atomically", dying)
            with suppress(KeyboardInterrupt):
                opened._join_small()
        assert again(run, executor=Forbidding()).identical(reference)


def test_a_reader_beside_a_writer_sees_no_damage(tmp_path, monkeypatch):
    monkeypatch.setattr(store_writer, "MANY", 3)
    thread = threading.Thread(
        target=lambda: make_study().run(out=tmp_path / "run", workers=1), daemon=True
    )
    thread.start()
    seen = 0
    while thread.is_alive():
        if (tmp_path / "run" / "manifest.json").exists():
            assert StoredRun(tmp_path / "run").status().damaged == ()
            seen += 1
    assert seen


# -- kept studies of the paper ---------------------------------------------------------------------


def test_kept_studies_are_what_was_written(tmp_path):
    from stiction.papers.albertini2020.setting import Setting
    from stiction.papers.albertini2020.studies import theory
    from stiction.papers.albertini2020.studies.context import Context
    from stiction.papers.albertini2020.studies.study_cache import keep, kept, place_of

    context = Context(Setting(), samples=2, seed=1, folder=tmp_path)
    dataset = xr.Dataset({"value": ("x", np.arange(300.0))}, attrs={"title": "kept"})
    keep(theory, context, dataset)
    assert kept(theory, context).identical(dataset)
    path = place_of(theory, context).with_suffix(".nc")
    whole = path.read_bytes()
    place = whole.index(np.arange(300.0).tobytes())
    for position in (place, place + 1000, place + 2399):
        data = bytearray(whole)
        data[position] ^= 1
        path.write_bytes(data)
        with pytest.warns(UserWarning, match="computed again"):
            assert kept(theory, context) is None
    path.unlink()
    assert kept(theory, context) is None
