"""`texvol report merge`: one report of several runs of picture tests, and a comment for a pull request."""

from __future__ import annotations

import argparse
from typing import Any

from texvol.options import texts
from texvol.util.terminal import say

NAME = "report merge"  # typed as two words


def add_report_merge(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        NAME,
        help="one report of several runs of picture tests",
        description="Merges reports of pytest --texvol-report, as of several operating systems, drivers or versions of "
        "Python: a page with a column for each run, and comment.md for a pull request.",
    )
    parser.add_argument(
        "reports", metavar="[NAME=]DIR", nargs="+", help="folder of a run's report, and its name (the folder's)"
    )
    parser.add_argument(
        "-o", "--output", type=texts.file_name, metavar="DIR", required=True,
        help="folder for the merged report, made if missing: index.html, report.json, comment.md, and runs/NAME",
    )  # fmt: skip
    parser.add_argument(
        "--artifact",
        metavar="NAME[=ADDRESS]",
        help="name, and address, under which a CI system keeps DIR: for comment.md",
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Merge the reports and print the path of the page."""
    from texvol.comparison.runs import merging

    say(str(merging.merge(merging.named_runs(arguments.reports), arguments.output, arguments.artifact).resolve()))
