"""`texvol help`: pages of documentation in the terminal, the same files that the site is made of.

A page is a Markdown file of texvol/docs. Its title is its first line, and the list in index.md says in one line what is
in it. A terminal shows pages by rich where that is installed; otherwise, and in a pipe, they are plain text. Libraries
are imported when a page is asked for: every command imports this file.
"""

from __future__ import annotations

import argparse
import re
import sys
from typing import Any

from texvol.util.errors import InputError
from texvol.util.package import PACKAGE
from texvol.util.terminal import say

INDEX = "index"
_FOLDER = PACKAGE / "docs"
_LISTED = re.compile(r"^- \[(?P<title>.+?)\]\((?P<topic>[\w-]+)\.md\): (?P<line>.+?)\.?$", re.MULTILINE)
_WIDEST = 100  # columns of a terminal that a page is laid out for


def add_help_command(commands: Any) -> None:
    """Add the command to the parser of the command line."""
    parser = commands.add_parser(
        "help",
        help="pages of documentation",
        description="Shows a page of documentation, or lists the pages. The name of a command shows its options.",
    )
    parser.add_argument("topic", metavar="TOPIC", nargs="?", help="page or command; the list of pages if none is given")
    parser.set_defaults(run=lambda arguments: _run(arguments.topic, commands.choices))


def topics() -> dict[str, str]:
    """Names of the pages and their line in the index, in its order; pages that it does not list come last."""
    listed = {found["topic"]: found["line"] for found in _LISTED.finditer(page(INDEX))}
    further = sorted({each.stem for each in _FOLDER.glob("*.md")} - {*listed, INDEX})
    return listed | {name: page(name).split("\n", 1)[0].lstrip("# ") for name in further}


def page(topic: str) -> str:
    """Markdown of a page."""
    return (_FOLDER / f"{topic}.md").read_text(encoding="utf-8")


def contents() -> str:
    """The list of pages."""
    found = topics()
    width = max(map(len, found))
    lines = [f"  {topic:{width}}  {line}" for topic, line in found.items()]
    return "\n".join(["texvol help TOPIC shows a page:", "", *lines, "", "texvol help COMMAND lists its options."])


def _run(topic: str | None, commands: dict[str, argparse.ArgumentParser]) -> None:
    if topic is None:
        say(contents())
    elif topic in topics():
        _show(page(topic))
    elif topic in commands:
        say(commands[topic].format_help())
    else:
        import difflib

        near = difflib.get_close_matches(topic, [*topics(), *commands], n=1)
        hint = f"did you mean {near[0]!r}?" if near else "texvol help lists the topics"
        raise InputError(f"topic {topic!r} not found; {hint}")


def _show(markdown: str) -> None:
    """Print a page: by rich on a terminal that has it, otherwise as plain text."""
    import shutil

    from texvol.cli.plain_text import as_text, simplified

    width = min(shutil.get_terminal_size().columns, _WIDEST)
    if sys.stdout is not None and sys.stdout.isatty():
        try:
            from rich.console import Console
            from rich.markdown import Markdown
        except ImportError:
            pass
        else:
            Console(width=width).print(Markdown(simplified(markdown)))
            return
    say(as_text(markdown, width))
