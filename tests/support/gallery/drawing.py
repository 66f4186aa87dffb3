"""Draws the gallery, pictures that show what texvol models: index.html and a PNG for each, and a table in Markdown.

    python scripts/gallery.py [DATA] -o FOLDER [--only NAME,NAME] [--quick]
    python scripts/gallery.py --references

DATA is the folder of real volumes: what TEXVOL_DATA names, or ../shared/data beside the repository. Pictures of what
is not there are left out; the others are of built-in volumes. All are drawn at twice their size and averaged, as light,
so that edges are smooth. FOLDER also gets the transfer functions and built-in volumes that the page's commands name.

`--references` draws those of the built-in volumes for the pages, into texvol/docs/pictures/gallery; tests draw them
again.
"""

from __future__ import annotations

import argparse
import json
import os
import shlex
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from support.gallery.entries import ENTRIES, Entry, Size
from support.gallery.page import page
from support.gallery.volumes import built_in
from texvol import Renderer, Scene, TransferFunction, Volume
from texvol.formats.pictures import image
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.options import texts
from texvol.scene import display
from texvol.util import color, writing
from texvol.util.errors import InputError, TexvolError

REPOSITORY = Path(__file__).resolve().parents[3]
REFERENCES = REPOSITORY / "texvol" / "docs" / "pictures" / "gallery"
REFERENCE_WIDTH = 400
SUPERSAMPLING = 2
_FARTHEST_GREY = 0.04  # linear; the nearest of a picture of depth is white


@dataclass(frozen=True)
class Drawn:
    """A picture, linear and premultiplied, over its background, and what is said of it."""

    entry: Entry
    picture: NDArray[np.float32]
    depth: NDArray[np.float32] | None
    seconds: float
    modelled: tuple[str, ...]
    estimated_error: float  # of numbers: as a share of the range that is shown
    command: str


def data_folder(given: Path | None = None) -> Path:
    """Where the real volumes are."""
    return given or Path(os.environ.get("TEXVOL_DATA") or REPOSITORY / ".." / "shared" / "data").resolve()


def parsed(entry: Entry, path: str, size: Size) -> tuple[argparse.Namespace, options.SceneOptions]:
    """The entry's options as the command line takes them, at `size`."""
    parser = argparse.ArgumentParser(exit_on_error=False)
    reading_options.add_volume_options(parser)
    options.add_scene_options(parser)
    line = [path, *shlex.split(entry.options), "--size", "x".join(map(str, size))]
    arguments = parser.parse_args(texts.with_negative_values(line))
    return arguments, options.SceneOptions(arguments)


def scene_of(entry: Entry, data: Path, size: Size) -> Scene | None:
    """The entry's scene for a picture of that size, or None where its file is not there."""
    path = data / entry.volume
    if not entry.is_built_in and not path.exists():
        return None
    arguments, chosen = parsed(entry, str(path), size)
    read = reading_options.load_volume
    volume: Volume = built_in(entry.volume) if entry.is_built_in else read(arguments, chosen.spacing)
    scene = chosen.scene(volume, in_8_bits=True)
    if entry.transfer_function is None:
        return scene
    own = TransferFunction.from_content(entry.transfer_function, entry.name, volume)
    return replace(scene, transfer_function=own, coloring="tf")


def shown(picture: NDArray, scene: Scene, entry: Entry) -> NDArray[np.float32]:
    """A picture of the entry's scene as it is seen: numbers through the window or the colours of the entry."""
    window = parsed(entry, "", (1, 1))[1].window
    return display.shown(picture, scene, window=window)


def averaged(picture: NDArray[np.float32], times: int) -> NDArray[np.float32]:
    """The picture at a size so many times smaller: each pixel the mean of its light, premultiplied."""
    height, width, channels = picture.shape
    tiles = picture.reshape(height // times, times, width // times, times, channels)
    return np.asarray(tiles.mean(axis=(1, 3), dtype=np.float64).astype(np.float32))


def draw(renderer: Renderer, entry: Entry, scene: Scene, size: Size, supersampling: int = SUPERSAMPLING) -> NDArray:
    """The entry's picture (height, width, 4), from `scene`; its stats are the renderer's."""
    large = (size[0] * supersampling, size[1] * supersampling)
    picture = renderer.render(scene, large, sampling_rate=entry.sampling_rate)
    return averaged(shown(picture, scene, entry), supersampling)


def depth_picture(renderer: Renderer, supersampling: int = SUPERSAMPLING) -> NDArray[np.float32]:
    """Depths of the last picture as grey, the nearest white; black where there is no surface."""
    depth = renderer.depth()
    hit = np.isfinite(depth)
    picture = np.zeros((*depth.shape, 4), np.float32)
    near, far = (float(depth[hit].min()), float(depth[hit].max())) if hit.any() else (0.0, 1.0)
    fraction = (far - depth[hit]) / max(far - near, 1e-300)
    picture[hit, :3] = color.linear_from_srgb(fraction * (1 - _FARTHEST_GREY) + _FARTHEST_GREY)[:, np.newaxis]
    picture[hit, 3] = 1
    return averaged(picture, supersampling)


def command(entry: Entry, size: Size) -> str:
    """Command line of the picture, at the size that it is drawn at."""
    volume = f"{entry.volume}.npy" if entry.is_built_in else f"DATA/{entry.volume}"
    parts = [f"texvol render {volume}", entry.options]
    if entry.transfer_function is not None:
        parts.append(f"--tf {entry.name}.json")
    parts += [f"--size {size[0]}x{size[1]} --sampling-rate {entry.sampling_rate:g} -o {entry.name}.png"]
    return " ".join([*parts, *[f"--depth {entry.name}.exr"] * entry.depth])


def drawn(renderer: Renderer, entry: Entry, data: Path, size: Size) -> Drawn | None:
    """The entry drawn and measured, or None where its file is not there."""
    large = (size[0] * SUPERSAMPLING, size[1] * SUPERSAMPLING)
    scene = scene_of(entry, data, large)
    if scene is None:
        return None
    start = time.perf_counter()
    picture = draw(renderer, entry, scene, size)
    seconds = time.perf_counter() - start
    stats = renderer.stats
    depth = depth_picture(renderer) if entry.depth else None
    error = stats["estimated_error"] / shown_range(scene, entry)
    return Drawn(entry, picture, depth, seconds, tuple(stats["modelled"]), error, command(entry, large))


def shown_range(scene: Scene, entry: Entry) -> float:
    """Unit of the picture's errors: 1, or for numbers the range that is shown in colours."""
    if scene.mode not in display.NUMBER_MODES:
        return 1.0
    window = parsed(entry, "", (1, 1))[1].window
    if window is not None:
        return window[1]
    assert scene.transfer_function is not None, "numbers have a window or a transfer function here"
    return float(np.ptp(scene.transfer_function.values))


def write(folder: Path, found: list[Drawn]) -> Path:
    """Pictures, what the commands need, and the page; the page's path."""
    folder.mkdir(parents=True, exist_ok=True)
    pictures: dict[str, bytes] = {}
    for each in found:
        name = each.entry.name
        pictures[name] = image.encoded(f"{name}.png", each.picture)
        if each.depth is not None:
            pictures[f"{name}-depth"] = image.encoded(f"{name}-depth.png", each.depth)
        if each.entry.transfer_function is not None:
            text = json.dumps(each.entry.transfer_function, indent=1)
            (folder / f"{name}.json").write_text(text + "\n", encoding="utf-8")
        if each.entry.is_built_in:
            np.save(folder / f"{each.entry.volume}.npy", built_in(each.entry.volume).values)
    writing.write_files({folder / f"{name}.png": content for name, content in pictures.items()})
    index = folder / "index.html"
    index.write_text(page([(d.entry, d.command, row(d)) for d in found], pictures), encoding="utf-8")
    return index


def row(each: Drawn) -> tuple[str, str, str, str]:
    """Name, seconds, what was modelled, and estimated error, as text."""
    return each.entry.name, f"{each.seconds:.1f}", ", ".join(each.modelled), f"{each.estimated_error:.1e}"


def write_references(renderer: Renderer) -> None:
    """Draw the pictures of the built-in volumes for the pages."""
    REFERENCES.mkdir(parents=True, exist_ok=True)
    for entry in filter(lambda each: each.is_built_in, ENTRIES.values()):
        path = REFERENCES / f"{entry.name}.png"
        image.write(path, reference(renderer, entry), {"texvol:renderer": renderer.renderer_name})
        print(path.relative_to(REPOSITORY), f"{path.stat().st_size / 1000:.0f} kB")


def reference_size(entry: Entry) -> Size:
    """Width and height of a picture of the pages."""
    return REFERENCE_WIDTH, REFERENCE_WIDTH * entry.size[1] // entry.size[0]


def reference(renderer: Renderer, entry: Entry, part: Size | None = None) -> NDArray[np.float32]:
    """The picture of a built-in volume for the pages, or its middle of so many pixels."""
    width, height = reference_size(entry)
    scene = scene_of(entry, data_folder(), (width * SUPERSAMPLING, height * SUPERSAMPLING))
    assert scene is not None, "built-in volumes need no file"
    if part is None:
        return draw(renderer, entry, scene, (width, height))
    camera, share = scene.completed((width, height)).camera, part[1] / height
    fov = 2 * np.degrees(np.arctan(share * np.tan(np.radians(camera.fov) / 2)))
    nearer = replace(camera, height=share * camera.height, fov=float(fov))
    return draw(renderer, entry, replace(scene, camera=nearer), part)


def chosen_entries(names: str | None) -> list[Entry]:
    """The entries of those names, in the gallery's order; all, unless told."""
    wanted = list(ENTRIES) if names is None else [name.strip() for name in names.split(",")]
    for name in wanted:
        if name not in ENTRIES:
            raise InputError(f"there is no picture {name!r}; there are {', '.join(ENTRIES)}")
    return [entry for entry in ENTRIES.values() if entry.name in wanted]


def make(arguments: argparse.Namespace) -> None:
    """Draw what the arguments ask for; print the table."""
    if arguments.references:
        with Renderer() as renderer:
            write_references(renderer)
        return
    if arguments.output is None:
        raise InputError("-o FOLDER says where the gallery goes")
    entries, data, found = chosen_entries(arguments.only), data_folder(arguments.data), []
    print("| picture | seconds | modelled | estimated error |\n|---|---|---|---|")
    with Renderer() as renderer:
        for entry in entries:
            width, height = (side // 2 if arguments.quick else side for side in entry.size)
            each = drawn(renderer, entry, data, (width, height))
            if each is None:
                print(f"{entry.name}: {data / entry.volume} is not there", file=sys.stderr)
                continue
            found.append(each)
            print(f"| {' | '.join(row(each))} |", flush=True)
    print(f"\n{write(arguments.output, found)}")


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=Path, nargs="?", metavar="DATA")
    parser.add_argument("-o", "--output", type=Path, metavar="FOLDER")
    parser.add_argument("--only", metavar="NAME,NAME")
    parser.add_argument("--quick", action="store_true", help="half the size")
    parser.add_argument("--references", action="store_true", help="write texvol/docs/pictures/gallery instead")
    try:
        make(parser.parse_args())
    except TexvolError as error:
        print(f"gallery: error: {error}", file=sys.stderr)
        return 2
    return 0
