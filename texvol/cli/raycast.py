"""`texvol raycast`: the picture of `texvol render`, computed by the oracle."""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.cli.common import add_depth, check_outputs
from texvol.cli.exact_cells import raycast_cells
from texvol.cli.workers import add_workers, workers_of
from texvol.formats.pictures import depth as depth_picture
from texvol.formats.pictures import image
from texvol.options import reading as reading_options
from texvol.options import scene_options as options
from texvol.output.export import PictureExport, is_exact
from texvol.scene.refinement import REFINEMENTS
from texvol.scene.scene import Scene
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.terminal import status_line


def add_raycast(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser("raycast", help="the same picture by the oracle: exact, slow, float64")
    reading_options.add_volume_options(parser, in_scene_file=True)
    options.add_scene_options(parser)
    parser.add_argument("-o", "--output", metavar="IMAGE", required=True, help=f"picture: {', '.join(image.FORMATS)}")
    add_depth(parser)
    parser.add_argument(
        "--texture-refinement", type=int, choices=REFINEMENTS, metavar="1|2|4", default=1,
        help="the medium of slab and extinction is that of a grid so many times finer (1)",
    )  # fmt: skip
    parser.add_argument(
        "--progressive", action="store_true",
        help="write a coarse picture first, and finer ones in its place; an interruption keeps the last of them",
    )  # fmt: skip
    parser.add_argument(
        "--exact-cells", action="store_true",
        help="of an unstructured grid, integrate its own cells instead of the grid to which it is resampled",
    )  # fmt: skip
    add_workers(parser)
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Ray cast the scene and write the picture, or with --progressive pictures that become finer."""
    scene_options = options.SceneOptions(arguments)
    image.check_writable(arguments.output)
    check_outputs(arguments, scene_options)
    unlit = arguments.exact_cells  # which have no gradient
    in_8_bits = not is_exact(arguments.output)
    scene = scene_options.scene(scene_options.load(), in_8_bits=in_8_bits, lit_by_default=not unlit)

    from texvol.rendering.streaming.exact import isosurface_depth

    size, output = scene_options.size, arguments.output
    export = PictureExport(scene_options, scene_options.annotation)
    scene = export.prepared(scene, size, chose_view=scene_options.chose_view)
    if arguments.exact_cells and arguments.texture_refinement != 1:
        raise InputError("--exact-cells does not go with --texture-refinement")
    by_workers = arguments.workers is not None or arguments.dask is not None
    if by_workers and (arguments.exact_cells or arguments.texture_refinement != 1 or arguments.progressive):
        raise InputError("--workers and --dask do not go with --exact-cells, --texture-refinement or --progressive")
    if scene.classification == "auto":
        scene = scene.classified_as("post")  # whose integral it stands for; the header says what was computed
    what = "ray casting of tetrahedra, float64" if arguments.exact_cells else "ray casting, float64"
    for picture, is_last in _pictures(scene, size, arguments):
        if not (is_last or arguments.progressive):
            continue
        shown, metadata = export.of(picture, scene, output), {"texvol:renderer": what}
        metadata |= export.metadata(scene_options.volume, scene, output) if is_last else {}
        files = {output: image.encoded(output, shown, metadata, transparent=scene_options.transparent)}
        if arguments.depth and is_last:
            files[arguments.depth] = depth_picture.encoded(arguments.depth, isosurface_depth(scene, size))
        writing.write_files(files)


def _pictures(
    scene: Scene, size: tuple[int, int], arguments: argparse.Namespace
) -> Iterator[tuple[NDArray[np.float64], bool]]:
    """Yield pictures from coarse to exact, and True with the last; show the progress on a terminal."""
    if arguments.exact_cells:
        yield raycast_cells(scene, size), True
        return
    from texvol.ray_casting import raycast_progressively
    from texvol.rendering.streaming.exact import raycast
    from texvol.rendering.streaming.kinds import fits

    refinement = arguments.texture_refinement
    with status_line() as show:
        start = time.perf_counter()

        def tell(fraction: float) -> None:
            left = (time.perf_counter() - start) * (1 / fraction - 1) if fraction else 0.0
            show(f"texvol: {100 * fraction:.0f} % of the pixels, {left:.0f} s left")

        if (workers := workers_of(arguments)) is not None:
            with workers:
                yield workers.raycast(scene, size, tell), True
            return
        if not fits(scene):
            yield raycast(scene, size, texture_refinement=refinement, tell=tell), True
            return
        scene = scene.in_memory("the oracle")
        for step, picture in raycast_progressively(scene, size, texture_refinement=refinement, tell=tell):
            yield picture, step == 1
