"""`texvol report history`: each picture over the runs of picture tests."""

from __future__ import annotations

import argparse
from typing import Any

from texvol.options import texts
from texvol.util.errors import InputError
from texvol.util.terminal import say

NAME = "report history"  # typed as two words
_KEPT = 100  # runs of a series; a page of more is slow to read


def add_report_history(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        NAME,
        help="history of each picture over runs of picture tests",
        description="Adds reports of pytest --texvol-report to a history: of each picture a chart, and its changes "
        "with date, commit, measured difference and thumbnail. Reports that are added need not be kept.",
    )
    parser.add_argument(
        "reports", metavar="[NAME=]DIR", nargs="+",
        help="folder of a run's report, and the name of its series (the folder's), such as that of a system",
    )  # fmt: skip
    parser.add_argument(
        "-o", "--output", type=texts.file_name, metavar="DIR", required=True,
        help="folder of the history, made if missing: history.json, to which the runs are added, and index.html",
    )  # fmt: skip
    parser.add_argument(
        "--keep", type=int, default=_KEPT, metavar="N", help=f"runs of each series that are kept, the last ({_KEPT})"
    )
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Add the reports and print the path of the page."""
    from texvol.comparison.runs import history, merging
    from texvol.comparison.runs.history_page import history_page

    if arguments.keep < 1:
        raise InputError(f"--keep must be at least 1, got {arguments.keep}")
    runs = merging.named_runs(arguments.reports, one_each=False)
    past = history.extended(history.read(arguments.output), runs, arguments.keep)
    say(str(history.write(arguments.output, past, history_page(past)).resolve()))
