"""`texvol methods`: the survey's other methods on a scene, speed against error, as a page, a table and a plot."""

from __future__ import annotations

import argparse
import shlex
from typing import Any

from texvol.cli.common import add_backend
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.util.errors import InputError
from texvol.util.terminal import say


def add_methods(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        "methods", help="the scene by other methods: shear-warp, splatting, Fourier … compared"
    )
    reading_options.add_volume_options(parser, in_scene_file=True)
    options.add_scene_options(parser)
    parser.add_argument(
        "-o", "--output", type=texts.file_name, metavar="DIR", required=True,
        help="folder for the page, made if missing",
    )  # fmt: skip
    parser.add_argument(
        "--methods", metavar="NAME,…", help="the methods to draw with (all); texvol help methods lists them"
    )
    add_backend(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Measure the methods, write the page and print its path."""
    from texvol.methods import METHODS
    from texvol.report import folder
    from texvol.report.survey.measuring import checked_names
    from texvol.report.survey.methods_report import methods_report

    names = tuple(METHODS)
    if arguments.methods is not None:
        try:
            names = checked_names([name.strip() for name in arguments.methods.split(",")])
        except InputError as error:
            raise InputError(f"--{error}") from None
    scene_options = options.SceneOptions(arguments)
    if scene_options.mode != "composite":
        raise InputError(
            f"--mode must be composite, got {scene_options.mode}; methods that project draw the scene in mode xray"
        )
    folder.check_folder(arguments.output)
    folder.check_libraries("texvol methods")
    scene = scene_options.scene(scene_options.load(), lit_by_default=False)  # no method of the survey draws light
    command = shlex.join(["texvol", *arguments.line])
    how = {"backend": arguments.backend, "device": arguments.device, "command": command}
    page = methods_report(scene, arguments.output, scene_options.size, names, **how)
    say(str(page.resolve()))
