"""The site as built: every link within it leads somewhere. Built by `.ci/run` before the tests."""

from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urldefrag, urlsplit

import pytest

SITE = Path(__file__).parents[2] / "build" / "docs"


class Page(HTMLParser):
    def __init__(self, path):
        super().__init__()
        self.path, self.names, self.targets, self.fetched = path, set(), [], []
        self.feed(path.read_text("utf-8"))

    def handle_starttag(self, tag, attributes):
        values = dict(attributes)
        self.names |= {values[key] for key in ("id", "name") if values.get(key)}
        for key in ("href", "src"):
            if values.get(key):
                (self.fetched if tag in ("img", "script", "link") else self.targets).append(
                    values[key]
                )


@pytest.fixture(scope="module")
def pages():
    if not (SITE / "index.html").exists():
        pytest.skip("the site is not built: python -m sphinx -W --keep-going docs build/docs")
    apart = {"_static", "_modules"}  # the latter is source code, whose links back Sphinx makes
    return {path: Page(path) for path in SITE.rglob("*.html") if not apart & set(path.parts)}


def is_outside(target):
    return bool(urlsplit(target).scheme or urlsplit(target).netloc)


def test_links_within_the_site(pages):
    broken = []
    for path, page in pages.items():
        for target in page.targets + page.fetched:
            if is_outside(target):
                continue
            file, fragment = urldefrag(target)
            place = (path.parent / unquote(file.partition("?")[0])).resolve() if file else path
            if not place.exists():
                broken.append(f"{path.relative_to(SITE)}: {target}")
            elif fragment and place in pages and unquote(fragment) not in pages[place].names:
                broken.append(f"{path.relative_to(SITE)}: {target} (no such place)")
    assert broken == []


def test_nothing_is_fetched_from_elsewhere(pages):
    outside = {t for page in pages.values() for t in page.fetched if is_outside(t)}
    assert {target for target in outside if not target.startswith("data:")} == set()


def test_every_public_name_has_a_page(pages):
    import stiction as st

    built = {path.stem for path in pages}
    modules = {"extensions", "external", "paper", "plot", "statistics", "theory"}
    names = set(st.__all__) - {"__version__", *modules}
    assert {name for name in names if f"stiction.{name}" not in built} == set()
    plots = {f"stiction.plot.{name}" for name in st.plot.__all__}
    assert plots - built == set()
