"""The site as built: every link within it leads somewhere. Built by `.ci/run` before the tests."""

import re
from html import unescape
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlsplit

import pytest

SITE = Path(__file__).parents[2] / "build" / "docs"


def read(path):
    """Names of places in a page, and its links: whether each is fetched with it, and its target."""
    text = path.read_text("utf-8")
    names = re.findall(r'\s(?:id|name)="([^"]+)"', text)
    pairs = re.findall(r'<(\w+)(?=\s)[^>]*?\s(?:href|src)="([^"]+)"', text)
    links = [(tag in ("img", "script", "link"), unescape(target)) for tag, target in pairs]
    return {*map(unescape, names)}, links


@pytest.fixture(scope="module")
def pages():
    if not (SITE / "index.html").exists():
        pytest.skip("the site is not built: python -m sphinx -W --keep-going docs build/docs")
    apart = {"_static", "_modules"}  # the latter is source code, whose links back Sphinx makes
    return {path: read(path) for path in SITE.rglob("*.html") if not apart & set(path.parts)}


def is_outside(target):
    return bool(urlsplit(target).scheme or urlsplit(target).netloc)


def test_links_within_the_site(pages):
    broken = []
    for path, (_, links) in pages.items():
        for _, target in links:
            if is_outside(target):
                continue
            file, fragment = urldefrag(target)
            place = (path.parent / unquote(file.partition("?")[0])).resolve() if file else path
            if not place.exists():
                broken.append(f"{path.relative_to(SITE)}: {target}")
            elif fragment and place in pages and unquote(fragment) not in pages[place][0]:
                broken.append(f"{path.relative_to(SITE)}: {target} (no such place)")
    assert broken == []


def test_nothing_is_fetched_from_elsewhere(pages):
    outside = {t for _, links in pages.values() for own, t in links if own and is_outside(t)}
    assert {target for target in outside if not target.startswith("data:")} == set()


def test_every_public_name_has_a_page(pages):
    import stiction as st

    built = {path.stem for path in pages}
    modules = {"extensions", "external", "paper", "plot", "statistics", "theory"}
    names = set(st.__all__) - {"__version__", *modules}
    assert {name for name in names if f"stiction.{name}" not in built} == set()
    plots = {f"stiction.plot.{name}" for name in st.plot.__all__}
    assert plots - built == set()
