"""`texvol report`: speed against error of a scene, as a page, a table and plots."""

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


def add_report(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser("report", help="speed against error of a scene: a page, a table and plots")
    reading_options.add_volume_options(parser, in_scene_file=True)
    options.add_scene_options(parser)
    parser.add_argument(
        "-o", "--output", type=texts.file_name, metavar="DIR", required=True,
        help="folder for the report, made if missing",
    )  # fmt: skip
    parser.add_argument("--quick", action="store_true", help="few settings, few frames")
    add_backend(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Measure the scene, write the report and print the path of its page."""
    from texvol import report

    scene_options = options.SceneOptions(arguments)
    if scene_options.mode != "composite":
        raise InputError(f"--mode must be composite in a report, got {scene_options.mode}")
    if scene_options.has_depth_in:
        raise InputError("--depth-in is of a single picture: leave it out of a report")
    report.check_folder(arguments.output)
    report.check_libraries()
    scene = scene_options.scene(scene_options.load(), lit_by_default=False)
    command = shlex.join(["texvol", *arguments.line])
    how = {"backend": arguments.backend, "device": arguments.device, "quick": arguments.quick, "command": command}
    page = report.report(scene, arguments.output, scene_options.size, **how)
    say(str(page.resolve()))
