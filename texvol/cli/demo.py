"""`texvol demo`: a picture of the built-in volume."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from texvol.cli.common import add_backend
from texvol.formats.pictures import image
from texvol.formats.pictures.scene_metadata import scene_metadata
from texvol.output.export import is_exact
from texvol.util.terminal import say


def add_demo(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser("demo", help="a picture of a built-in volume, no file needed")
    parser.add_argument("-o", "--output", metavar="IMAGE", default="texvol-demo.png", help="picture (texvol-demo.png)")
    add_backend(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Draw the built-in scene, write the picture and print its path."""
    from texvol.rendering.renderer import Renderer
    from texvol.scene.demo import demo_scene

    image.check_writable(arguments.output)
    with Renderer(arguments.backend, device=arguments.device) as renderer:
        scene = demo_scene()
        picture = renderer.render(scene, (512, 512), sampling_rate=2)
        scene = renderer.drawn_scene or scene
        metadata = scene_metadata("demo", scene, settings=renderer.settings, checksum=is_exact(arguments.output))
        image.write(arguments.output, picture, renderer.attributes | metadata)
        say(f"{Path(arguments.output).resolve()} drawn by {renderer.renderer_name} ({renderer.backend})")
