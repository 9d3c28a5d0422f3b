"""How the documentation is built: `python -m sphinx -W --keep-going docs build/docs`."""

from __future__ import annotations

import logging
import math
import os
import re
import sys
import tomllib
import warnings
from pathlib import Path

import click
import typer.main
from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst

HERE = Path(__file__).parent
ROOT = HERE.parent
# Notebooks show figures by a backend of their own, which this would switch off.
os.environ.pop("MPLBACKEND", None)
# Their figures are wide enough for dense screens.
KERNEL = ROOT / "build" / "ipython" / "profile_default" / "ipython_kernel_config.py"
KERNEL.parent.mkdir(parents=True, exist_ok=True)
KERNEL.write_text('c.InlineBackend.print_figure_kwargs = {"bbox_inches": "tight", "dpi": 270}\n')
os.environ["IPYTHONDIR"] = str(KERNEL.parents[1])
sys.path.insert(0, str(HERE / "_extensions"))

import stiction  # noqa: E402  # after the environment is set
from stiction.base import progress  # noqa: E402  # after the environment is set
from stiction.cli.commands import app as commands  # noqa: E402

META = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
URLS = META.get("urls", {})

project = "stiction"
author = "The Stiction developers"
copyright = "2026, The Stiction developers"
version = release = stiction.__version__

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.intersphinx",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "mathml",
    "see_also",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["README.md", "_build", "**/GALLERY_HEADER.rst", "**/*.ipynb", "gallery/*"]
# Times of the gallery's scripts: a page whose tables come from elsewhere.
exclude_patterns += ["**/sg_execution_times.rst", "sg_execution_times.rst"]
source_suffix = {".rst": "restructuredtext", ".md": "myst-nb"}
default_role = "py:obj"
suppress_warnings = ["config.cache"]  # a function in the configuration of the gallery

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 4
highlight_language = "none"  # of code that names no language
nb_execution_mode = "cache"
nb_execution_cache_path = str(ROOT / "build" / "notebooks")
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_merge_streams = True
nb_output_stderr = "remove"  # compilation and progress

# Links into other projects need their inventories, which a hosted build can fetch.
intersphinx_mapping = {}
if os.environ.get("READTHEDOCS"):
    intersphinx_mapping = {
        "python": ("https://docs.python.org/3", None),
        "numpy": ("https://numpy.org/doc/stable", None),
        "scipy": ("https://docs.scipy.org/doc/scipy", None),
        "xarray": ("https://docs.xarray.dev/en/stable", None),
        "matplotlib": ("https://matplotlib.org/stable", None),
    }

copybutton_prompt_text = ">>> |... "
copybutton_prompt_is_regexp = True

numpydoc_show_class_members = False
autosummary_generate = True
autodoc_typehints = "none"  # the docstrings say types with shapes and units
templates_path = ["_templates"]


def scrape_figure(block, block_vars, gallery_conf):
    """Return the picture of a `figure` that pyplot does not manage, as `st.plot.fit` returns it."""
    figure = block_vars["example_globals"].get("figure")
    if not isinstance(figure, Figure) or figure.canvas.manager is not None:
        return ""
    path = next(block_vars["image_path_iterator"])
    figure.savefig(path, dpi=270)
    return figure_rst([path], gallery_conf["src_dir"])


# The how-tos that examples/README.md lists, with a title each.
HOW_TOS = re.findall(
    r"\[([^\]`]+)\]\((\w+)\.py\)", (ROOT / "examples" / "README.md").read_text("utf-8")
)
SCRIPTS = ROOT / "build" / "examples"


def keep_pages_clean(conf, name):
    """Leave paths, progress and the compilation of kernels out of the printed output of scripts."""
    warnings.formatwarning = lambda text, kind, *_, **__: f"{kind.__name__}: {text}\n"
    logging.getLogger("stiction").setLevel(logging.ERROR)
    progress.PIPE_INTERVAL = math.inf


sphinx_gallery_conf = {
    "examples_dirs": [str(SCRIPTS)],
    "gallery_dirs": ["examples"],
    "subsection_order": [str(SCRIPTS / "how-to"), "*"],
    "backreferences_dir": "api/backreferences",
    "doc_module": ("stiction",),
    "image_scrapers": (scrape_figure, "matplotlib"),  # the second closes figures of pyplot
    "image_srcset": ["3x"],
    "thumbnail_size": (800, 540),
    "filename_pattern": r"\.py$",
    "within_subsection_order": "FileNameSortKey",
    "download_all_examples": False,
    "show_memory": False,
    "capture_repr": (),
    "reset_modules": ("matplotlib", keep_pages_clean),
    "abort_on_example_error": True,
}


def write_if_new(path, text):
    """Unchanged, a page is not built again."""
    if not path.exists() or path.read_text("utf-8") != text:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def collect_scripts():
    """Copy how-tos and pictures to `SCRIPTS`, the how-tos with a title."""
    texts = {
        path.relative_to(HERE / "gallery"): path.read_text("utf-8")
        for path in (HERE / "gallery").rglob("*")
        if path.suffix in (".py", ".rst")
    }
    for title, name in HOW_TOS:
        title = title.removeprefix("a ").capitalize()
        text = (ROOT / "examples" / f"{name}.py").read_text("utf-8").removeprefix('"""')
        texts[Path("how-to", f"{name}.py")] = f'"""\n{title}\n{"=" * len(title)}\n\n{text}'
    for path in SCRIPTS.rglob("*.py"):
        if path.relative_to(SCRIPTS) not in texts:
            path.unlink()
    for name, text in texts.items():
        write_if_new(SCRIPTS / name, text)


collect_scripts()

# Pages that have moved: the old address and the new page.
MOVED = dict(line.split() for line in """
installation start/installation
tutorials/first-onset start/first-onset
methods start/choose-a-method
tutorials/measured-profile tutorials/profile
what-do-twenty-five-tests-tell-me tutorials/peak-forces
design-force tutorials/joint
theory guide/model
correlation-lengths guide/random-strength
inspection guide/random-strength
friction guide/friction-laws
specimens guide/specimens
planes guide/planes-and-ends
measured-profiles guide/reading-data
reliability guide/failure-probability
studies guide/studies
clusters guide/clusters
plug-ins guide/extend-and-connect
tutorials/own-code guide/extend-and-connect
conventions reference/conventions
faq reference/errors-and-warnings
project reference/changelog
equilibrium evidence/exact-equilibrium
specimens-evidence evidence/numerics
validation evidence/accuracy
rupture-benchmarks evidence/rupture-benchmarks
stick-slips evidence/laboratory-fault
paper evidence/paper
comparison evidence/other-programs
architecture developers/architecture
changelog reference/changelog
tutorials/index index
guides index
evidence evidence/accuracy
reference api/index
how-to/index examples/index
pictures/index examples/index
""".strip().splitlines())
REDIRECT = """<!DOCTYPE html><meta charset="utf-8"><title>Moved</title>
<meta http-equiv="refresh" content="1; url={0}"><link rel="canonical" href="{0}">
<script>location.replace("{0}" + location.hash)</script><p>This page has moved <a href="{0}">here</a>.
"""


def redirect(app, error):
    """Write a page at each old address that leads to the new page."""
    if error or app.builder.format != "html":
        return
    moved = dict(MOVED)
    for page in app.env.found_docs:
        if page.startswith("examples/") and page.count("/") == 2:
            old = page.removeprefix("examples/")
            moved[old if old.startswith("how-to") else f"pictures/{old}"] = page
    for old, new in moved.items():
        path = os.path.relpath(f"{new}.html", os.path.dirname(old) or ".")
        write_if_new(Path(app.outdir, f"{old}.html"), REDIRECT.format(path))


html_math_renderer = "mathml"
html_theme = "pydata_sphinx_theme"
html_title = f"stiction {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sourcelink = False
html_sidebars = {"**": ["all-pages.html"]}
html_theme_options = {
    "logo": {"text": f"stiction {version}"},
    "icon_links": [
        {"name": "Source", "url": URLS[name], "icon": "fa-solid fa-code"}
        for name in ("Repository",)
        if name in URLS
    ],
    "navbar_center": [],
    "secondary_sidebar_items": {"**": ["page-toc"], "examples/index": []},
    "footer_start": ["copyright"],
    "footer_end": [],
}
html_context = {"default_mode": "auto"}


def links_to_the_list(app, docname, source):
    """Of all pages: where the source is read it is README.md, here the front page."""
    source[0] = re.sub(r"\]\((?:\.\./docs/)?README\.md(#[\w-]+)?\)", "](/index.md)", source[0])


def plain_text(app, what, name, obj, options, lines):
    """Docstrings are read in terminals too: |k| and (*shape) have no meaning for Sphinx."""
    code = False
    for number, line in enumerate(lines):
        if line.strip():
            code = line.startswith(">>>") or (code and line.startswith(" "))
        if not code:
            parts = re.split(r"(``.*?``|`.*?`)", line)
            parts[::2] = [
                re.sub(r"(?<!\\)\||(?<=[( ])\*(?=\w+[,)])", r"\\\g<0>", part)
                for part in parts[::2]
            ]
            lines[number] = "".join(parts)


def write_commands(app):
    """The page of commands, from the commands."""
    group = typer.main.get_command(commands)
    head = "What each says with `--help`. In study files and in Python the names are the same."
    parts = [f"# Commands\n\n{head}\n"]
    context = click.Context(group, info_name="stiction")
    for name, command in sorted(group.commands.items()):
        inner = click.Context(command, info_name=name, parent=context, terminal_width=90)
        parts.append(f"## `stiction {name}`\n\n```text\n{command.get_help(inner)}\n```\n")
    write_if_new(HERE / "api" / "commands.md", "\n".join(parts))


def setup(app):
    app.connect("source-read", links_to_the_list)
    app.connect("autodoc-process-docstring", plain_text, priority=900)
    app.connect("builder-inited", write_commands, priority=1)
    app.connect("build-finished", redirect)
