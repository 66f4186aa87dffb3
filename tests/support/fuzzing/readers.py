"""Readers by name, for `fuzz.py`: what is done with a file, and how many bytes its result takes."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any
from unittest.mock import patch

import numpy as np

from support.fuzzing import readers_stores
from support.fuzzing.seeds import STEPS, VALUES
from texvol.annotation.lettering import Lettering
from texvol.cli import information
from texvol.comparison.judged import judged
from texvol.comparison.limits import named_limits
from texvol.comparison.outcome import examine
from texvol.comparison.pictures import Picture, read_picture
from texvol.formats.pictures.scene_metadata import ATTRIBUTE
from texvol.formats.readers import TimeSeries, load
from texvol.formats.readers.segment_tables import segments_of
from texvol.geometry.reading import load_mesh
from texvol.options import scene_options as options
from texvol.options.files import transform
from texvol.provenance.stored_scene import stored_scene_of
from texvol.pytest_plugin.references import fingerprint_of
from texvol.pytest_plugin.repeats import repeats_of
from texvol.scene import transfer
from texvol.scene.mask import Mask
from texvol.scene.volume import Volume
from texvol.util.errors import InputError, TexvolError
from texvol.window import recent, script

_VOLUME = Volume(VALUES, (1, 2, 3), name="v.npy")
_FURTHER = Volume((STEPS[0] * 2), (2, 2, 2), name="w.npy")
_MASK = Mask(VALUES / 60, "m.npy", {"path": "m.npy"})


def read(name: str, path: str, told: Mapping[str, Any]) -> int:
    """Bytes of what the reader of that name makes of a file; TexvolError where it refuses."""
    try:
        return _READERS[name](path, **told)
    except argparse.ArgumentTypeError as error:  # of an option, which the command line turns into a line
        raise InputError(str(error)) from None


def _volume(path: str, **told: Any) -> int:
    return _bytes(load(path, **told))


def _info(path: str, **told: Any) -> int:
    volume = load(path, **told)
    metadata = information.metadata(volume)
    json.dumps(metadata, allow_nan=False)
    information.text(metadata)
    return _bytes(volume)


def _bytes(volume: Volume) -> int:
    return volume.values.nbytes + (0 if volume.colors is None else volume.colors.nbytes)


def _series(path: str, **told: Any) -> int:
    with TimeSeries(path, **told) as series:
        volumes = [series[0], series[-1]]
        _ = series.times, series.time_unit
    return sum(volume.values.nbytes for volume in volumes)


def _mask(path: str, fade: tuple[float, float] | None = None) -> int:
    mask = Mask.of(load(path), fade)
    mask.check_fits(_VOLUME)
    return mask.array.nbytes


def _picture(path: str) -> int:
    picture = read_picture(path)
    if ATTRIBUTE in picture.attributes:
        with suppress(TexvolError):  # the picture has been read all the same
            stored_scene_of(picture.attributes, name=path, volume=_VOLUME, mask=_MASK)
    # As wide as what it decodes to, whose four channels of float64 and their rounding are made of it.
    return picture.pixels.nbytes * 4


def _diff(path: str) -> int:
    picture = read_picture(path)
    attributes = {ATTRIBUTE: '{"format": 2, "mode": "mip", "settings": {"slab_thickness": 1}}'}
    reference = Picture.of_array(np.linspace(0, 1, 120, dtype=np.float32).reshape(5, 6, 4), "reference", attributes)
    outcome = judged(examine(picture, reference))
    json.dumps(outcome.as_json(), allow_nan=False)
    repeats_of([picture, picture], picture, picture)
    fingerprint_of(picture)
    return picture.pixels.nbytes * 16


def _font(path: str) -> int:
    lettering = Lettering(path)
    lettering.check("AHp 1", "the text")
    lettering.fitted("AHp 1", 16, 30, 0.5)
    return lettering.coverage("AHp 1", 16, 1)[0].nbytes


def _mesh(path: str) -> int:
    mesh = load_mesh(path)
    return int(mesh.vertices.nbytes + mesh.triangles.nbytes) * 8


def _transfer(path: str) -> int:
    function = transfer.load(path, _VOLUME)
    text = json.dumps(function.as_json())
    transfer.loads(text, path, _VOLUME)
    return len(text)


def _segments(path: str) -> int:
    return len(segments_of(path)) * 1000


def _scene(path: str) -> int:
    chosen = options.SceneOptions.of(None, path)
    scene = chosen.scene(chosen.load())
    _ = chosen.annotation, scene.box
    return sum(volume.values.nbytes for volume in scene.volumes)


def _header(path: str) -> int:
    with open(path, "rb") as file:
        text = file.read().decode("utf-8", "replace")
    added = (_FURTHER,) if '"added"' in text else ()
    stored_scene_of({ATTRIBUTE: text}, name=path, volume=_VOLUME, mask=_MASK if '"mask"' in text else None, added=added)
    return len(text)


def _limits(path: str) -> int:
    named_limits(path)
    return 0


def _transform(path: str) -> int:
    _VOLUME.moved(transform(path).matrix())
    return 0


def _script(path: str) -> int:
    return len(script.read(path)) * 1000


def _recent(path: str) -> int:
    folder = os.path.join(os.path.dirname(path), "texvol")
    os.makedirs(folder, exist_ok=True)
    os.replace(path, os.path.join(folder, "recent.json"))
    with patch.dict(os.environ, XDG_STATE_HOME=os.path.dirname(path)):
        found = recent.files()
    _ = [(each.text, each.options) for each in found]
    return len(found) * 1000


_READERS: dict[str, Callable[..., int]] = {
    "volume": _volume,
    "info": _info,
    "series": _series,
    "store": readers_stores.store,
    "plan": readers_stores.plan,
    "recording": readers_stores.recording,
    "mask": _mask,
    "picture": _picture,
    "diff": _diff,
    "font": _font,
    "mesh": _mesh,
    "transfer": _transfer,
    "segments": _segments,
    "scene": _scene,
    "header": _header,
    "limits": _limits,
    "transform": _transform,
    "script": _script,
    "recent": _recent,
}
