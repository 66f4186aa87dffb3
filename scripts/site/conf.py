"""Settings of the documentation's site; the pages are those of texvol/docs, the reference is made from docstrings.

Two pages get more on the site than they have as files: the index a table of contents of all pages in its order, and the
reference the docstrings of all public names.
"""

from __future__ import annotations

import inspect
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import texvol
from texvol.cli.help import topics

project = "texvol"
author = "The texvol authors"
project_copyright = author
version = release = texvol.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
myst_heading_anchors = 3
default_role = "literal"  # of single backticks in docstrings
smartquotes = False  # two hyphens begin an option
autodoc_member_order = "bysource"
autodoc_typehints = "none"  # types stand in the docstrings
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

html_theme = "furo"
html_title = f"texvol {release}"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False


def _contents() -> str:
    names = "\n".join(topics())
    return f"\n```{{toctree}}\n:hidden:\n:maxdepth: 1\n\n{names}\n```\n"


def _docstrings() -> str:
    parts = []
    for name in (each for each in texvol.__all__ if not each.startswith("_")):
        found = getattr(texvol, name)
        kind = "class" if inspect.isclass(found) else "module" if inspect.ismodule(found) else "function"
        members = "   :members:\n" if kind != "function" else ""
        heading = name if kind != "module" else f"texvol.{name}"
        parts.append(f"## {heading}\n\n```{{eval-rst}}\n.. auto{kind}:: texvol.{name}\n{members}```\n")
    return "\n" + "\n".join(parts)


def _complete(app: Any, name: str, source: list[str]) -> None:
    more = {"index": _contents, "reference": _docstrings}.get(name)
    if more is not None:
        source[0] += more()


def setup(app: Any) -> None:
    """Connect what completes the two pages."""
    app.connect("source-read", _complete)
