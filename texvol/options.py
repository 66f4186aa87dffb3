"""Options of the command line that describe a volume and a scene, on the line or in a scene file.

A scene file is TOML with the scene options' names as keys, `spacing` among them; triples and sizes may be text or
arrays. An option on the line wins.

    tf = "bone.json"
    projection = "perspective"
    eye = [300, -200, 120]
    size = "800x600"
"""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from texvol import orbit as turning
from texvol import transfer
from texvol.camera import Camera
from texvol.errors import InputError
from texvol.scene import CLASSIFICATIONS, Scene
from texvol.transfer import TransferFunction
from texvol.volume import Volume

DEFAULT_SIZE = (512, 512)


def size(text: str) -> tuple[int, int]:
    """(width, height) from "WxH"."""
    match = re.fullmatch(r"\s*(\d{1,9})\s*[xX×,]\s*(\d{1,9})\s*", text)
    if not match:
        raise argparse.ArgumentTypeError(f"a size is WxH in pixels, such as 640x480, and not {text!r}")
    return int(match[1]), int(match[2])


def triple(text: str) -> tuple[float, float, float]:
    """Three finite numbers from "X,Y,Z"."""
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 3:
        raise argparse.ArgumentTypeError(f"three numbers X,Y,Z are wanted, and not {text!r}")
    return numbers


def color(text: str) -> tuple[float, float, float] | None:
    """Linear RGB from "R,G,B", or None from "transparent"."""
    if text.strip().lower() in ("transparent", "none"):
        return None
    numbers = triple(text)
    if not all(0 <= number < np.inf for number in numbers):
        raise argparse.ArgumentTypeError(f"a colour is three numbers from 0 upwards, and not {text!r}")
    return numbers


def dimensions(text: str) -> tuple[int, int, int]:
    """(nx, ny, nz) from "NX,NY,NZ"."""
    match = re.fullmatch(r"\s*(\d{1,18})\s*[,x]\s*(\d{1,18})\s*[,x]\s*(\d{1,18})\s*", text)
    if not match:
        raise argparse.ArgumentTypeError(f"a shape is NX,NY,NZ, and not {text!r}")
    return int(match[1]), int(match[2]), int(match[3])


def number(text: str) -> float:
    """A number."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"a number is wanted, and not {text!r}") from None


def megabytes(text: str) -> float:
    """Megabytes of texture memory."""
    wanted = number(text)
    if not 0 < wanted < 1e12:  # an exabyte: more than any device has, and its bytes are still a number
        raise argparse.ArgumentTypeError(f"megabytes between 0 and 1e12 are wanted, and not {text!r}")
    return wanted


def transmittance(text: str) -> float:
    """A transmittance from 0 to under 1."""
    wanted = number(text)
    if not 0 <= wanted < 1:
        raise argparse.ArgumentTypeError(f"a transmittance from 0 to under 1 is wanted, and not {text!r}")
    return wanted


def views(text: str) -> int:
    """How many views an orbit has."""
    if not re.fullmatch(r"\s*\+?\d{1,9}\s*", text) or int(text) < 1:
        raise argparse.ArgumentTypeError(f"a number of views from 1 upwards is wanted, and not {text!r}")
    return int(text)


def frames_per_second(text: str) -> float:
    """Frames per second of a film."""
    wanted = number(text)
    if not 0.1 <= wanted <= 1000:
        raise argparse.ArgumentTypeError(f"frames per second from 0.1 to 1000 are wanted, and not {text!r}")
    return wanted


def _choice(*allowed: str) -> Callable[[str], str]:
    def choose(text: str) -> str:
        if text not in allowed:
            raise argparse.ArgumentTypeError(f"one of {', '.join(allowed)} is wanted, and not {text!r}")
        return text

    return choose


# Scene options: name, what its text becomes, how it is shown, help.
_SCENE_OPTIONS: tuple[tuple[str, Callable[[str], Any], str, str], ...] = (
    ("tf", str, "PRESET|FILE.json", f"transfer function; presets: {', '.join(transfer.PRESETS)}"),
    ("size", size, "WxH", "pixels (512x512)"),
    ("background", color, "R,G,B", "linear light from behind (0,0,0), or: transparent"),
    ("projection", _choice("orthographic", "perspective"), "KIND", "orthographic (default) or perspective"),
    ("eye", triple, "X,Y,Z", "where the camera is, world units (so that the whole box is seen)"),
    ("target", triple, "X,Y,Z", "what it looks at (the middle of the box)"),
    ("up", triple, "X,Y,Z", "what is up in the picture (0,0,1)"),
    ("fov", number, "DEGREES", "angle from bottom to top, perspective (40)"),
    ("height", number, "H", "world units from bottom to top, orthographic (the box)"),
    ("spacing", triple, "X,Y,Z", "distance of samples, overrides the file's"),
    ("classification", _choice(*CLASSIFICATIONS), "KIND", "slab (default), extinction, post or integrated"),
)


def add_volume_options(parser: argparse.ArgumentParser) -> None:
    """VOLUME and how to read it, but for the spacing, which is a scene option."""
    parser.add_argument(
        "volume", metavar="VOLUME", help="NRRD, NIfTI, MetaImage, DICOM folder, TIFF, MRC, VTI, NPY, RAW"
    )
    group = parser.add_argument_group("reading the volume")
    group.add_argument("--shape", type=dimensions, metavar="NX,NY,NZ", help="dimensions of a RAW file")
    group.add_argument("--dtype", metavar="TYPE", help="sample type of a RAW file: uint8, >i2 (big-endian), float32 …")
    group.add_argument("--series", metavar="NAME", help="which series of a DICOM folder")
    group.add_argument("--channel", type=int, metavar="N", help="which channel, from 0")
    group.add_argument("--time", type=int, metavar="N", help="which time step, from 0")


def add_scene_options(parser: argparse.ArgumentParser) -> None:
    """What is to be drawn; every option may stand in a scene file as well."""
    group = parser.add_argument_group("scene options (each may stand in the scene file; the line wins)")
    group.add_argument("--scene", metavar="FILE.toml", help="scene file")
    for name, convert, shown, text in _SCENE_OPTIONS:
        group.add_argument(f"--{name}", type=convert, metavar=shown, help=text, default=argparse.SUPPRESS)


def load_volume(arguments: argparse.Namespace, spacing: tuple[float, float, float] | None) -> Volume:
    """The volume that the arguments name; `spacing` overrides the file's."""
    from texvol.readers import load

    return load(
        arguments.volume,
        shape=arguments.shape,
        dtype=arguments.dtype,
        spacing=spacing,
        series=arguments.series,
        channel=arguments.channel,
        time=arguments.time,
    )


class SceneOptions:
    """Scene options of the line and the scene file, together; checked before the volume is read."""

    def __init__(self, arguments: argparse.Namespace) -> None:
        self._chosen: dict[str, Any] = {}
        if arguments.scene is not None:
            self._chosen.update(_scene_file(Path(arguments.scene)))
        self._chosen.update({name: vars(arguments)[name] for name, *_ in _SCENE_OPTIONS if name in vars(arguments)})
        self.size: tuple[int, int] = self._chosen.get("size", DEFAULT_SIZE)
        if min(self.size) < 1:
            raise InputError(f"size {self.size[0]}x{self.size[1]}: a picture has at least one pixel along each side")
        self.spacing: tuple[float, float, float] | None = self._chosen.get("spacing")
        self.transparent = "background" in self._chosen and self._chosen["background"] is None

    def scene(self, volume: Volume, *, orbit: bool = False) -> Scene:
        """The scene that the options make of `volume`; its camera frames one picture, or all of an orbit."""
        chosen = self._chosen
        framing = turning.framing if orbit else Camera.framing
        return Scene(
            volume,
            transfer_function(chosen["tf"], volume) if "tf" in chosen else transfer.proposed_for(volume),
            framing(
                volume,
                chosen.get("projection", "orthographic"),
                **{key: chosen.get(key) for key in ("eye", "target", "up", "fov", "height")},
                aspect=self.size[0] / self.size[1],
            ),
            chosen.get("background") or (0.0, 0.0, 0.0),
            chosen.get("classification", "slab"),
        )


def transfer_function(name: str, volume: Volume) -> TransferFunction:
    """The preset or file `name`; a file if it looks like one."""
    if name in transfer.PRESETS:
        return transfer.preset(name, volume)
    if name.lower().endswith(".json") or os.sep in name or os.path.exists(name):
        return transfer.load(name, volume)
    raise InputError(f"--tf {name}: neither a .json file nor a preset; presets: {', '.join(transfer.PRESETS)}")


def with_negative_values(line: Sequence[str]) -> list[str]:
    """The line with `--eye -1,2,3` as `--eye=-1,2,3`: argparse takes a value that begins with a minus for an option."""
    joined: list[str] = []
    for word in line:
        after_option = joined and joined[-1].startswith("--") and "=" not in joined[-1] and len(joined[-1]) > 2
        if after_option and re.match(r"-[\d.]", word):
            joined[-1] += "=" + word
        else:
            joined.append(word)
    return joined


def _scene_file(path: Path) -> dict[str, Any]:
    import tomllib

    try:
        content = tomllib.loads(path.read_text("utf-8"))
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: is not TOML: {error}") from None
    known = {name: convert for name, convert, *_ in _SCENE_OPTIONS}
    chosen = {}
    for key, value in content.items():
        name = key.replace("_", "-")
        if name not in known:
            raise InputError(f"{path}: there is no scene option {key!r}; there are {', '.join(known)}")
        if isinstance(value, bool | dict):
            raise InputError(f"{path}: {key} is text, a number or an array of numbers, and not {value!r}")
        text = ",".join(str(part) for part in value) if isinstance(value, list) else str(value)
        try:
            chosen[name] = known[name](text)
        except argparse.ArgumentTypeError as error:
            raise InputError(f"{path}: {key}: {error}") from None
    if isinstance(chosen.get("tf"), str) and chosen["tf"] not in transfer.PRESETS:
        chosen["tf"] = str(path.parent / chosen["tf"])  # beside the scene file, wherever the command is called
    return chosen
