"""`texvol convert`: a volume of any format as OME-Zarr, with a pyramid and the statistics of its chunks."""

from __future__ import annotations

import argparse
import time
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from texvol.cli.common import add_spacing
from texvol.options import reading as reading_options
from texvol.options import texts
from texvol.util.errors import InputError
from texvol.util.locations import is_remote
from texvol.util.terminal import complain, say, status_line

if TYPE_CHECKING:
    from texvol.scene.volume import Volume

_ENDINGS = (".zarr",)


def add_convert(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser("convert", help="a volume as OME-Zarr, which pictures of any size are drawn from")
    reading_options.add_volume_options(parser)
    add_spacing(parser)
    samples = partial(texts.count, what="samples")
    parser.add_argument(
        "output", metavar="OUT.ome.zarr", help="store to be written; an interrupted one is gone on with"
    )
    parser.add_argument("--chunk", type=samples, metavar="N", default=64, help="samples along an axis of a chunk (64)")
    parser.add_argument(
        "--shard",
        type=samples,
        metavar="N",
        default=256,
        help="samples along an axis of a shard, a file (256)",
    )
    parser.add_argument(
        "--zarr-format",
        type=int,
        choices=(2, 3),
        metavar="2|3",
        default=3,
        help="3: OME-Zarr 0.5 with shards (default); 2: 0.4",
    )
    parser.add_argument("--overwrite", action="store_true", help="replace a store of that name")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> None:
    """Convert the volume and say what was written."""
    from texvol.formats.stores.writing.convert import Layout, convert

    output = arguments.output
    if is_remote(output) or not output.rstrip("/").endswith(_ENDINGS):
        raise InputError(f"{output}: must be a folder here that ends in .zarr")
    chunk, shard = arguments.chunk, arguments.shard
    layout = Layout((chunk,) * 3, (shard,) * 3, arguments.zarr_format)
    volume = _loaded(arguments)
    if not np.allclose(volume.direction, np.eye(3)):
        complain("note: OME-Zarr cannot say that the grid is turned: only texvol reads its direction from the store")
    start = time.perf_counter()
    with status_line() as show:

        def tell(fraction: float) -> None:
            seconds = time.perf_counter() - start
            show(f"texvol: {100 * fraction:.0f} % written, {seconds * (1 / fraction - 1):.0f} s left")

        how = {"memory": vars(arguments).get("memory"), "overwrite": arguments.overwrite, "tell": tell}
        written = convert(volume, output, layout=layout, **how)
    shapes = ", ".join(" x ".join(map(str, shape[::-1])) for shape in written.shapes)
    seconds = time.perf_counter() - start
    say(f"{output}: {len(written.shapes)} levels ({shapes}), {written.bytes / 1e6:.4g} MB, {seconds:.1f} s")


def _loaded(arguments: argparse.Namespace) -> Volume:
    """Return the volume; a plain .npy file stays on disk."""
    told = reading_options.told(vars(arguments))
    if not arguments.volume.lower().endswith(".npy") or set(told) - {"memory"}:
        return reading_options.load_volume(arguments, arguments.spacing)
    from texvol.formats.stores.arrays import open_array

    try:
        array = np.load(arguments.volume, mmap_mode="r", allow_pickle=False)
    except (OSError, ValueError):
        return reading_options.load_volume(arguments, arguments.spacing)  # which says what is wrong with it
    if array.ndim != 3:
        return reading_options.load_volume(arguments, arguments.spacing)
    return open_array(array, arguments.spacing, name=arguments.volume)
