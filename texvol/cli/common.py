"""Options that several commands share, and checks of their output files."""

from __future__ import annotations

import argparse

from texvol.formats.pictures import depth as depth_picture
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.util import writing
from texvol.util.errors import InputError


def take_scene_file(arguments: argparse.Namespace) -> None:
    """Take a scene file in the place of VOLUME as that of --scene, of commands that have both.

    Raises
    ------
    InputError
        If --scene names a scene file, too.
    """
    path = getattr(arguments, "volume", None)
    if not hasattr(arguments, "scene") or path is None or not path.lower().endswith(".toml"):
        return
    if arguments.scene is not None:
        raise InputError(f"{path}: is a scene file, and --scene names one as well: leave one of them out")
    arguments.scene, arguments.volume = path, None


def add_backend(group: argparse._ActionsContainer) -> None:
    """Add --backend and --device."""
    group.add_argument("--backend", choices=("auto", "egl", "osmesa"), default="auto", help="OpenGL without a screen")
    add_device(group)


def add_device(group: argparse._ActionsContainer) -> None:
    """Add --device."""
    group.add_argument("--device", metavar="N|NAME", help="one of `texvol devices`, by number or part of its name")


def add_spacing(parser: argparse.ArgumentParser) -> None:
    """Add --spacing, for commands without scene options."""
    parser.add_argument("--spacing", type=texts.triple, metavar="X,Y,Z", help="overrides the file's spacing")


def add_depth(parser: argparse.ArgumentParser) -> None:
    """Add --depth."""
    parser.add_argument(
        "--depth", type=texts.file_name, metavar="FILE.exr",
        help="depth of the isosurface along the view from the eye, world units, channel Z, infinite where a ray does "
        "not hit it",
    )  # fmt: skip


def check_outputs(arguments: argparse.Namespace, scene_options: options.SceneOptions) -> None:
    """Raise InputError if --depth does not fit the other options, or two outputs, or output and input, are one file."""
    if arguments.depth:
        if scene_options.mode != "isosurface":
            raise InputError(f"--depth needs --mode isosurface, got --mode {scene_options.mode}")
        if vars(arguments).get("orbit") is not None:
            raise InputError("--depth needs a single picture: leave --orbit out")
        depth_picture.check_writable(arguments.depth)
    outputs = {"--output": arguments.output, "--depth": arguments.depth, "--stats": vars(arguments).get("stats")}
    writing.check_apart(outputs, (scene_options.volume, arguments.scene, scene_options.transfer_function))
