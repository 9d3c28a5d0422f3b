"""Parts of a run, computed apart, are joined to what one run gives; what is wrong is named."""

import re
import shutil
import warnings
from pathlib import Path

import numpy as np
import pytest
from small_study import lengths, small_study

import stiction as st
from stiction.ensemble.part import Part, as_part

STUDY = small_study(
    ensemble={"samples": 40, "seed": 3, "first": 7, "keep": ["strength"], "keep_samples": [9]},
    sweep=lengths(4e-3, 6e-3),
)
PARTS = 3


def make_study(**changes):
    return st.Study.from_dict(STUDY | changes)


@pytest.fixture(scope="module")
def reference():
    return make_study().run(workers=1)


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    top = tmp_path_factory.mktemp("made")
    for number in range(1, PARTS + 1):
        make_study().run(out=top / "run", part=(number, PARTS), progress=False)
    return top / "run.parts"


@pytest.fixture
def parts(made, tmp_path):
    shutil.copytree(made, tmp_path / "run.parts")
    return tmp_path / "run.parts"


def merged(parts, words=None):
    """The run that the parts give; a warning if words are given, and none if not."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        stored = st.merge_parts(parts.parent / "run", progress=False)
    texts = [str(w.message) for w in caught]
    assert (words is None) == (not texts), texts
    assert words is None or any(words in text for text in texts), texts
    return stored


@pytest.mark.parametrize("points", [1, 2, 7])
@pytest.mark.parametrize("samples", [1, 5, 1000, 5000])
@pytest.mark.parametrize("of", [1, 2, 3, 10])
def test_every_sample_is_in_one_part_and_parts_are_alike(points, samples, of):
    masks = [Part(k, of).mask(points, samples) for k in range(1, of + 1)]
    assert (np.sum(masks, axis=0) == 1).all()
    sizes = [mask.sum() for mask in masks]
    # Eight blocks a part or more: no part is longer than another by more than one.
    assert max(sizes) - min(sizes) <= max(1, points * samples // (8 * of))


def test_the_same_to_the_bit(parts, reference):
    run = merged(parts)
    assert run.dataset().identical(reference)
    assert run.status().complete
    assert merged(parts).dataset().identical(reference)  # once more changes nothing


def test_to_a_file(made, tmp_path, reference):
    shutil.copytree(made, tmp_path / "result.nc.parts")
    st.merge_parts(tmp_path / "result.nc", progress=False)
    assert st.open_run(tmp_path / "result.nc").dataset().identical(reference)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["result.nc", "result.nc.parts"]
    with pytest.raises(st.StoreError, match="is there already"):
        st.merge_parts(tmp_path / "result.nc")


def test_a_missing_part_is_named_and_run_later(parts, reference):
    shutil.rmtree(parts / "2-of-3")
    run = merged(parts, "1 of 3 parts are not there (2)")
    assert 0 < run.status().done < run.status().samples
    make_study().run(out=parts.parent / "run", part="2/3", progress=False)
    assert merged(parts).dataset().identical(reference)


def test_what_is_missing_may_be_run_instead(parts, reference):
    shutil.rmtree(parts / "1-of-3")
    merged(parts, "not there (1)")
    assert make_study().run(out=parts.parent / "run", progress=False).identical(reference)


def test_a_part_that_was_cut_short_is_named(parts, reference):
    shutil.rmtree(parts / "2-of-3")
    make_study().run(out=parts.parent / "run", part="2/3", progress=False, time_limit=1e-9)
    merged(parts, "part 2 of 3 is not whole")


def test_repeated_samples_are_taken_once(parts, reference):
    for number in (1, 4):
        make_study().run(out=parts.parent / "run", part=(number, 4), progress=False)
    shutil.rmtree(parts / "3-of-3")
    run = merged(parts, "parts are not there")
    done = run.status().done
    assert done == sum(chunk.samples for chunk in run._store.chunks) < 80
    make_study().run(out=parts.parent / "run", part=(3, 3), progress=False)
    assert merged(parts).dataset().identical(reference)


def test_a_damaged_part_is_named(parts):
    chunk = next((parts / "3-of-3" / "chunks").glob("*.nc"))
    data = bytearray(chunk.read_bytes())
    data[len(data) // 2] ^= 1
    chunk.write_bytes(data)
    assert merged(parts, "part 3 of 3 is not whole").missing() > 0


def test_a_damaged_manifest_is_named(parts):
    (parts / "3-of-3" / "manifest.json").write_text("{")
    merged(parts, "run part 3 of 3 again")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"ensemble": STUDY["ensemble"] | {"seed": 4}}, "ensemble.seed: 4"),
        ({"ensemble": STUDY["ensemble"] | {"samples": 41}}, "41 samples"),
    ],
)
def test_parts_of_other_studies_are_refused(parts, change, words):
    shutil.rmtree(parts / "3-of-3")
    make_study(**change).run(out=parts.parent / "run", part=(3, 3), progress=False)
    with pytest.raises(st.StoreError, match=words):
        merged(parts)


def test_the_same_sample_with_another_result_is_refused(parts):
    from stiction.ensemble.chunk import Table
    from stiction.ensemble.files import NoLock
    from stiction.ensemble.store_writer import StoreWriter

    store = StoreWriter(parts / "1-of-3", NoLock())
    table = store.table(store.chunks[0])
    stress = table.values["critical_stress"] * (1.0 + 1e-15)
    other = Table(table.values | {"critical_stress": stress}, {}, 0.0)
    shutil.copytree(parts / "1-of-3", parts / "1-of-4")
    changed = StoreWriter(parts / "1-of-4", NoLock())
    changed.chunks = [changed._write(other, 0)]
    changed._write_list()
    with pytest.raises(st.StoreError, match="stored already with another critical_stress"):
        merged(parts)


@pytest.mark.parametrize("value", ["0/3", "4/3", "3", "a/b", (1, 0), (1, 2, 3), 3, "1/1e9999", 1.5])
def test_what_is_no_part_is_refused(value):
    with pytest.raises(st.InputError, match="part: must be"):
        as_part(value)


def test_a_part_needs_a_place(tmp_path):
    with pytest.raises(st.InputError, match="out="):
        make_study().run(part=(1, 2))
    with pytest.raises(st.StoreError, match="holds no parts"):
        st.merge_parts(tmp_path / "run")


def test_from_the_command_line(tmp_path, command, reference):
    st.Study.from_dict(STUDY).to_toml(tmp_path / "study.toml")
    run = tmp_path / "run"
    for part in ("1/2", "2/2"):
        code, out, _ = command("run", tmp_path / "study.toml", "--out", run, "--part", part)
        assert code == 0
        assert f"part {part[0]} of 2: 40 samples in {run}.parts/{part[0]}-of-2" in out
        code, out, errors = command("merge", run)
        assert code == (0 if part == "2/2" else 1)
    assert "80 of 80 samples in" in out
    assert not errors
    assert st.open_run(run).dataset().identical(reference)
    code, _, errors = command("run", tmp_path / "study.toml", "--out", run, "--part", "3/2")
    assert code == 2
    assert "part: must be which part of how many" in errors


def test_the_page_on_clusters(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    st.Study.from_dict(STUDY).to_toml("study.toml")
    page = (Path(__file__).parents[2] / "docs" / "clusters.md").read_text("utf-8")
    (code,) = re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL)
    with pytest.warns(UserWarning, match="99 of 100 parts are not there"):
        exec(compile(code, "clusters.md", "exec"), {})
