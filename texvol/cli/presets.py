"""`texvol presets`: all looks of a volume on one sheet."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING, Any

import numpy as np

from texvol.cli.common import add_backend
from texvol.formats.pictures import image
from texvol.options import first_choice, texts
from texvol.options import reading as reading_options
from texvol.util.errors import InputError
from texvol.util.terminal import say, status_line

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from texvol.scene.volume import Volume

_TILE = 240  # pixels
_COLUMNS = 6
_LINE = 1.6  # height of a label, in ems


def add_presets(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser(
        "presets",
        help="all looks of a volume on one sheet",
        description="Draws the volume, or the built-in one, in every preset, each with its light, labelled with the "
        "name that --tf takes. The first is the look that the volume gets without --tf.",
    )
    reading_options.add_volume_options(parser, in_scene_file=True)
    parser.add_argument("--spacing", type=texts.triple, metavar="X,Y,Z", help="overrides the file's spacing")
    parser.add_argument("-o", "--output", metavar="IMAGE", required=True, help=f"picture: {', '.join(image.FORMATS)}")
    parser.add_argument("--size", type=texts.size, metavar="WxH", help=f"pixels of each look ({_TILE})")
    add_backend(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Draw the looks, write the sheet and print its path."""
    image.check_writable(arguments.output)
    size = arguments.size or (_TILE, _TILE)
    if min(size) < 48 or max(size) > 4096:
        raise InputError(f"--size must be from 48 to 4096 pixels along each side, got {size[0]}x{size[1]}")
    tiles = _tiles(_volume(arguments), size, arguments.backend, arguments.device)
    image.write(arguments.output, _sheet(tiles))
    say(f"{arguments.output}: {len(tiles)} looks: {', '.join(name for name, _ in tiles)}")


def _volume(arguments: argparse.Namespace) -> Volume:
    """Return the volume of the command line, or the built-in one."""
    if arguments.volume is not None:
        return first_choice.volume_of(arguments)
    from texvol.scene.demo import demo_volume

    return demo_volume()


def _tiles(
    volume: Volume, size: tuple[int, int], backend: str, device: str | None
) -> list[tuple[str, NDArray[np.float32]]]:
    """Return names and pictures of the looks: first that without a name, then all presets."""
    from texvol.rendering.renderer import Renderer
    from texvol.scene.looks import look_for, look_of, seen_as
    from texvol.scene.scene import Scene
    from texvol.scene.transfer import PRESETS

    first = look_for(volume)
    looks = [(f"without --tf: {first.name}", seen_as(volume), first)]
    # Labels have no presets: these are of measured values.
    looks += [] if volume.labels else [(name, volume, look_of(name, volume)) for name in PRESETS]
    tiles: list[tuple[str, NDArray[np.float32]]] = []
    with Renderer(backend, device=device) as renderer, status_line() as show:
        for number, (name, seen, look) in enumerate(looks, 1):
            show(f"texvol: look {number} of {len(looks)}, {name}")
            medium = look.transfer_function
            tiles.append(
                (name, renderer.render(Scene(seen, medium, lighting=look.lighting, gradient=look.gradient), size))
            )
    return tiles


def _sheet(tiles: list[tuple[str, NDArray[np.float32]]]) -> NDArray[np.float32]:
    """Return all pictures in rows, each above its name."""
    from texvol.annotation.lettering import Lettering
    from texvol.annotation.sheet import Sheet

    height, width = tiles[0][1].shape[:2]
    columns = min(_COLUMNS, len(tiles))
    rows = -(-len(tiles) // columns)
    em = max(height / 15, 10.0)
    below = round(_LINE * em)
    sheet = np.zeros((rows * (height + below), columns * width, 4), np.float32)
    marks = Sheet((sheet.shape[1], sheet.shape[0]), Lettering(), (0.0, 0.0, 0.0), em=em)
    for number, (name, picture) in enumerate(tiles):
        top, left = number // columns * (height + below), number % columns * width
        sheet[top : top + height, left : left + width] = picture
        scale = min(1.0, 0.95 * width / max(marks.text_size(name)[0], 1.0))
        marks.text(name, (left + width / 2, top + height + below / 2), scale)
    sheet[..., 3] = 1.0
    return np.asarray(marks.over(sheet, (0.0, 0.0, 0.0)), np.float32)
