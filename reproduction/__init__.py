"""The study of Albertini et al. (2020), recomputed with public names of `stiction` only."""

import tomllib
from pathlib import Path
from typing import Any

PARAMETERS: dict[str, Any] = {}
"""Tables of a study file that replace the paper's; the command fills them in before it imports
any other module."""
TEXTS = tomllib.loads(Path(__file__).with_name("page.toml").read_text("utf-8"))
"""Texts of the page, figures and their studies, and names of the points of what-ifs."""
