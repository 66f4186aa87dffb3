"""`texvol convert-tf`: a transfer function as a file of texvol's own, of ParaView or of 3D Slicer."""

from __future__ import annotations

import argparse
import json
from typing import TYPE_CHECKING, Any

from texvol.options import reading as reading_options
from texvol.options import texts
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.terminal import say

if TYPE_CHECKING:
    from texvol.scene.looks import Look

_FORMS = ("texvol", "paraview", "slicer")
_JSON, _SLICER_TEXT, _SLICER = ".json", ".vp", ".vp.json"


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
        "--to", choices=_FORMS, help="program that reads OUT (of .json: texvol; of .vp, .vp.json: slicer)"
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
    form = _form(arguments.output, arguments.to)
    unit = _unit(arguments.output, form, arguments.unit_distance)
    writing.check_writable(arguments.output)
    writing.check_apart({"OUT": arguments.output}, (arguments.input, arguments.volume))
    look = _look(arguments)
    text, said = _written(form, look, unit, arguments)
    writing.write_files({arguments.output: text.encode()})
    say(f"{arguments.output}: {said}")


def _form(output: str, told: str | None) -> str:
    """Return the program that reads the output."""
    name = output.lower()
    if not name.endswith((_JSON, _SLICER_TEXT)):
        raise InputError(f"{output}: the name must end with {_JSON}, {_SLICER} or {_SLICER_TEXT}")
    by_name = "slicer" if name.endswith((_SLICER_TEXT, _SLICER)) else None
    if by_name and told not in (None, by_name):
        raise InputError(f"{output}: --to {told} needs a name that ends with {_JSON}, got one of 3D Slicer")
    if told == "slicer" and not by_name:
        raise InputError(f"{output}: --to slicer needs a name that ends with {_SLICER} or {_SLICER_TEXT}")
    return by_name or told or "texvol"


def _unit(output: str, form: str, told: float | None) -> float:
    """Return the length that opacities of the output belong to."""
    if form == "texvol":
        if told is not None:
            raise InputError("--unit-distance is for ParaView and 3D Slicer: texvol's own files have extinctions")
        return 1.0
    if form == "slicer" and output.lower().endswith(_SLICER_TEXT):
        if told not in (None, 1.0):
            raise InputError(
                f"--unit-distance must be 1 for {_SLICER_TEXT}, which has none, got {told:g}; try {_SLICER}"
            )
        return 1.0
    if told is None:
        raise InputError(
            "--unit-distance L must be given: the world length that opacities belong to, such as the volume's spacing"
        )
    return told


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


def _written(form: str, look: Look, unit: float, arguments: argparse.Namespace) -> tuple[str, str]:
    """Return the text of the output, and a sentence about it."""
    from texvol.scene.transfer.foreign import writing as foreign

    function, output = look.transfer_function, arguments.output
    if form == "texvol":
        text = json.dumps(function.as_json(), indent=1, allow_nan=False) + "\n"
        return text, f"transfer function of texvol, {function.values.size} points, in data and world units"
    if form == "paraview":
        text, nodes = foreign.paraview(function, unit, arguments.name or look.name)
        return text, f"colour map of ParaView, {nodes} nodes; set its Scalar Opacity Unit Distance to {unit:g}"
    if output.lower().endswith(_SLICER_TEXT):
        text, nodes = foreign.slicer_text(function, look.lighting)
        return text, f"volume property of 3D Slicer, {nodes} nodes, opacities per 1 world unit"
    text, nodes = foreign.slicer(function, unit, look.lighting)
    return text, f"volume property of 3D Slicer, {nodes} nodes, opacities per {unit:g}"
