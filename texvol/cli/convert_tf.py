"""`texvol convert-tf`: a transfer function as a file of texvol's own, of ParaView or of 3D Slicer."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

from texvol.options import reading as reading_options
from texvol.options import texts
from texvol.scene.transfer.saving import FORMS, Form
from texvol.util import writing
from texvol.util.terminal import say

if TYPE_CHECKING:
    from texvol.scene.looks import Look


def add_convert_tf(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        "convert-tf",
        help="a transfer function as a file of texvol, ParaView or 3D Slicer",
        description="Reads a transfer function as --tf does and writes it as texvol's JSON, ParaView's (--to "
        "paraview), or 3D Slicer's .vp or .vp.json. Opacities of other programs are of a length: --unit-distance.",
    )
    parser.add_argument("input", metavar="IN", help="what --tf takes: a file, a preset or a colour map")
    parser.add_argument("output", metavar="OUT", help="file to be written: .json, .vp.json or .vp")
    parser.add_argument(
        "--to", choices=FORMS, help="program that reads OUT (of .json: texvol; of .vp, .vp.json: slicer)"
    )
    parser.add_argument("--name", metavar="NAME", help="name of ParaView's colour map (that of IN)")
    parser.add_argument(
        "--volume",
        metavar="VOLUME",
        help="volume that presets, colour maps and values or lengths relative to a volume are made for",
    )
    parser.add_argument(
        "--unit-distance", type=texts.positive_length, metavar="L", help="world length that opacities of OUT belong to"
    )
    parser.add_argument(
        "--in-unit-distance",
        type=texts.positive_length,
        metavar="L",
        help="world length that opacities of IN belong to, if it is of another program (its own, or that program's)",
    )
    parser.add_argument("--range", type=texts.value_range, metavar="LOW,HIGH", help="values between which OUT changes")
    reading_options.add_options(parser)
    parser.add_argument("--spacing", type=texts.triple, metavar="X,Y,Z", help="overrides the volume's spacing")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Write the transfer function and say in what."""
    form = Form.of(arguments.output, arguments.to, arguments.unit_distance)
    writing.check_writable(arguments.output)
    writing.check_apart({"OUT": arguments.output}, (arguments.input, arguments.volume))
    look = _look(arguments)
    text, said = form.text(look.transfer_function, arguments.name or look.name, look.lighting)
    writing.write_files({arguments.output: text.encode()})
    say(f"{arguments.output}: {said}")


def _look(arguments: argparse.Namespace) -> Look:
    """Return the transfer function, moved by --range, and its light."""
    from dataclasses import replace

    from texvol.options.looks import load_look
    from texvol.scene.transfer.adjusting import between

    volume = None if arguments.volume is None else reading_options.load_volume(arguments, arguments.spacing)
    look = load_look(arguments.input, volume, None, arguments.in_unit_distance)
    if arguments.range is None:
        return look
    return replace(look, transfer_function=between(look.transfer_function, *arguments.range))
