"""`texvol info`: dimensions, values and notes of a volume file."""

from __future__ import annotations

import argparse
import json
from typing import Any

from texvol.cli.common import add_spacing
from texvol.options import first_choice
from texvol.options import reading as reading_options
from texvol.util.terminal import say


def add_info(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser("info", help="describe a volume file")
    reading_options.add_volume_options(parser)
    add_spacing(parser)
    parser.add_argument("--json", action="store_true", help="print JSON")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Print the volume's metadata."""
    from texvol.cli import information

    metadata = information.metadata(first_choice.volume_of(arguments))
    say(json.dumps(metadata, indent=2, allow_nan=False) if arguments.json else information.text(metadata))
