"""`texvol accept`: pictures of a report become references, by their names or by a button in the served page."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from texvol.options import texts
from texvol.util.errors import InputError, missing_extra
from texvol.util.shown_text import shown_line
from texvol.util.terminal import say


def add_accept(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        "accept",
        help="make pictures of a report the references of their tests",
        description="Copies pictures that failed, from a report of pytest --texvol-report, over their references: "
        "those that are named, or those that are chosen in the page, which is served on this machine until ctrl-C.",
    )
    parser.add_argument("report", metavar="DIR", help="folder of the report")
    parser.add_argument(
        "pictures", metavar="PICTURE", nargs="*", help="names of pictures; without them the page is served"
    )
    parser.add_argument("--all", action="store_true", help="all pictures of the report that failed and can be accepted")
    parser.add_argument(
        "--root", type=texts.file_name, metavar="DIR", default=".",
        help="folder where the tests are started: references are below it, others are refused (current folder)",
    )  # fmt: skip
    parser.add_argument("--port", type=int, metavar="N", default=None, help="port of the page (any free port)")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Accept the named pictures, or serve the page until ctrl-C; print a line for each accepted picture."""
    try:
        import pytest  # noqa: F401 (the plugin stands on it)
    except ImportError as error:
        raise missing_extra("pytest", "pytest", "texvol accept") from error
    from texvol.comparison.runs.stored import Run
    from texvol.pytest_plugin.accepting import accept, chosen, offers_of

    found = Run.read(arguments.report)
    if not Path(arguments.root).is_dir():
        raise InputError(f"--root must be a folder, got {arguments.root}")
    offers = offers_of(found)
    if arguments.all and arguments.pictures:
        raise InputError("--all takes no names of pictures: leave them out")
    if arguments.port is not None and (arguments.all or arguments.pictures):
        raise InputError("--port is of the served page: leave it out where pictures are named")
    if not offers:
        raise InputError(f"{arguments.report}: no picture of the report failed and has a candidate to accept")
    if not arguments.all and not arguments.pictures:
        _serve(arguments, found)
        return
    wanted = [key for key, offer in offers.items() if not offer.not_accepted] if arguments.all else arguments.pictures
    for key in offers if arguments.all else ():
        if offers[key].not_accepted:
            say(f"{key}: left out: {shown_line(offers[key].not_accepted)}")
    for line in accept(chosen(offers, wanted), arguments.root):
        say(line)


def _serve(arguments: argparse.Namespace, found: Any) -> None:
    from texvol.pytest_plugin.serving import Server

    with Server(found, Path(arguments.root), arguments.port or 0, say) as server:
        say(f"open {server.address}\nctrl-C ends")
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            count = len(server.accepted)
            say(f"accepted {count} picture{'' if count == 1 else 's'}")
