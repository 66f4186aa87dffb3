"""`texvol devices`: the devices that EGL offers, and why one cannot be used."""

from __future__ import annotations

import argparse
import json
from dataclasses import asdict
from typing import Any

from texvol.util.errors import ContextError
from texvol.util.terminal import say


def add_devices(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        "devices",
        help="graphics devices, for --device",
        description="Lists the devices that EGL offers, and OSMesa: number and name, either of which --device takes, "
        "the driver and what it can do, or the reason why a device cannot be used. Each is tried in a process of its "
        "own.",
    )
    parser.add_argument("--json", action="store_true", help="as JSON")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Print a line for each device."""
    from texvol.opengl.contexts import listing
    from texvol.opengl.contexts.devices import hindrances

    try:
        found, notes = listing.devices(), hindrances()
    except ContextError as error:
        found, notes = [], [f"no EGL: {error}", *hindrances()]
    osmesa = listing.osmesa()
    if arguments.json:
        say(
            json.dumps(
                {"devices": [asdict(each) for each in found], "osmesa": asdict(osmesa), "notes": notes}, indent=2
            )
        )
        return
    lines = [each.line for each in found] or ["EGL lists no device; pictures are drawn by what it has without one"]
    say("\n".join([*lines, osmesa.line, *(f"note: {note}" for note in notes)]))
