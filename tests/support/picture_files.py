"""Picture files as OpenImageIO writes and reads them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray


def header(path: Path) -> dict[str, object]:
    source = oiio.ImageInput.open(str(path))
    spec = source.spec()
    source.close()
    metadata = {each.name: each.value for each in spec.extra_attribs}
    return metadata | {
        "channels": list(spec.channelnames),
        "format": str(spec.format),
        "size": (spec.width, spec.height),
    }


def write(path: Path, pixels: NDArray, kind: object = oiio.FLOAT, **attributes: object) -> Path:
    """A file of these pixels as they are; attributes have __ for a colon."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.ascontiguousarray(pixels))
    output.close()
    return path
