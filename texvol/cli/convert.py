"""`texvol convert`: a file of any format as OME-Zarr, with a pyramid and the statistics of its chunks.

All time steps, channels and labels are written, unless options choose of them.
"""

from __future__ import annotations

import argparse
import os
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
    from texvol.formats.stores.writing.files import Opened
    from texvol.formats.stores.writing.recording import Recording

_ENDINGS = (".zarr",)


def add_convert(commands: Any) -> None:
    """Add the command's parser."""
    parser = commands.add_parser("convert", help="a file as OME-Zarr, which pictures of any size are drawn from")
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
    from texvol.formats.stores.writing.convert import convert
    from texvol.formats.stores.writing.files import open_file
    from texvol.formats.stores.writing.levels import Layout

    output = arguments.output
    if is_remote(output) or not output.rstrip("/").endswith(_ENDINGS):
        raise InputError(f"{output}: must be a folder here that ends in .zarr")
    _check_apart(arguments.volume, output)
    chunk, shard = arguments.chunk, arguments.shard
    layout = Layout((chunk,) * 3, (shard,) * 3, arguments.zarr_format)
    told = reading_options.arguments_of(reading_options.chosen(vars(arguments)))
    every_step = told.get("time") == texts.ALL
    if every_step:
        del told["time"]
    opened = open_file(arguments.volume, output, every_step=every_step, spacing=arguments.spacing, **told)
    _remark(opened.image)
    start = time.perf_counter()
    with status_line() as show:

        def tell(fraction: float) -> None:
            seconds = time.perf_counter() - start
            show(f"texvol: {100 * fraction:.0f} % written, {seconds * (1 / fraction - 1):.0f} s left")

        how = {"memory": vars(arguments).get("memory"), "overwrite": arguments.overwrite, "tell": tell}
        written = convert(opened.image, output, layout=layout, labels=opened.labels, **how)
    shapes = ", ".join(" x ".join(map(str, shape[::-1])) for shape in written.shapes)
    seconds = time.perf_counter() - start
    say(
        f"{output}: {len(written.shapes)} levels ({shapes}){_further(opened)}, {written.bytes / 1e6:.4g} MB, "
        f"{seconds:.1f} s"
    )


def _check_apart(volume: str, output: str) -> None:
    """Raise InputError if the input is the output or lies in it, where --overwrite would delete it."""
    if is_remote(volume):
        return
    source, target = os.path.realpath(volume), os.path.realpath(output)
    if os.path.commonpath([source, target]) == target:
        raise InputError(f"{output}: must be another folder than that of the input, got {volume}")


def _remark(image: Recording) -> None:
    """Tell what other readers will not know of the store."""
    if not np.allclose(image.form.direction, np.eye(3)):
        complain("note: OME-Zarr cannot say that the grid is turned: only texvol reads its direction from the store")
    if image.times and image.even_times() is None:
        complain("note: OME-Zarr cannot say that time steps are uneven: only texvol reads their times from the store")


def _further(opened: Opened) -> str:
    """Return how many time steps, channels and labels there are, in words."""
    found = ""
    for letter, count in zip(opened.image.axes, opened.image.leading, strict=True):
        word = {"t": "time step", "c": "channel"}[letter]
        found += f", {count} {word}{'' if count == 1 else 's'}"
    return found + (f", labels {' '.join(opened.labels)}" if opened.labels else "")
