"""Sound OME-Zarr stores and Zarr arrays, as seeds for `fuzz.py`; a process of its own writes them.

What writes them has threads, which are not there in the processes that `fuzz.py` forks.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from support.fuzzing.seeds import Seed

NAME = "v.zarr"
_FIRST = {"channel": 0, "time": 0}
_OPENED: dict[str, dict[str, Any]] = {  # each store, and what is chosen of it
    "image": {}, "image4": {}, "series": _FIRST, "series4": _FIRST, "converted": _FIRST,
    "labels": {"image": "labels/n"}, "array": {}, "array4": {}, "several": {"image": "1"},
}  # fmt: skip
_READERS = ("store", "plan", "recording")


def seeds() -> Iterator[Seed]:
    """Stores of both versions, by zarr-python and by `texvol convert`, each read by all readers of stores."""
    with tempfile.TemporaryDirectory() as folder:
        code = "import sys; from support.fuzzing import seeds_zarr; seeds_zarr.write(sys.argv[1])"
        paths = os.pathsep.join(filter(None, sys.path))
        environment = {**os.environ, "PYTHONPATH": paths}
        subprocess.run([sys.executable, "-c", code, folder], check=True, env=environment, stderr=subprocess.DEVNULL)
        for kind, options in _OPENED.items():
            root = Path(folder) / kind
            found = sorted(each for each in root.rglob("*") if each.is_file())
            files = {f"{NAME}/{each.relative_to(root)}": each.read_bytes() for each in found}
            for reader in _READERS:
                yield Seed("zarr", files, NAME, reader, {} if reader == "recording" else options)


def write(folder: str) -> None:
    """Write all stores."""
    import zarr

    from support.stores import field, write_ome
    from texvol.formats.stores.writing.convert import Layout, convert
    from texvol.formats.stores.writing.files import open_file

    root, values = Path(folder), field(12)
    omero = [{"label": "a", "color": "FF0000", "window": {"start": 1, "end": 200}, "active": True}, {"label": "b"}]
    steps = np.array([[values, values + 1], [values + 2, values + 3]])
    named = (values > 100).astype("u1")
    write_ome(root / "image", values, levels=2, chunk=4, shard=8)
    write_ome(root / "image4", values, levels=2, chunk=8, version="0.4")
    write_ome(root / "series", steps, axes="tczyx", levels=2, chunk=8, omero=omero)
    write_ome(root / "series4", steps, axes="tczyx", levels=1, chunk=8, omero=omero, version="0.4")
    write_ome(root / "labels", values, levels=1, chunk=8)
    write_ome(root / "labels", named, levels=1, chunk=8, group="labels/n", more={"image-label": {}})
    zarr.open_group(root / "labels/labels", mode="a").attrs["ome"] = {"version": "0.5", "labels": ["n"]}
    convert(open_file(f"{root}/series").image, root / "converted", layout=Layout((8,) * 3, (16,) * 3))
    zarr.create_array(root / "array", data=values, chunks=(8, 8, 8), dimension_names=list("zyx"))
    zarr.create_array(root / "array4", data=values, chunks=(8, 8, 8), zarr_format=2)
    zarr.open_group(root / "several", mode="w").attrs["ome"] = {"version": "0.5", "bioformats2raw.layout": 3}
    for number in range(2):
        write_ome(root / "several", values + number, levels=1, chunk=8, group=str(number))
