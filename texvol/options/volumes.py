"""The option --add and the --add-… options: further volumes of a scene.

On the command line each `--add FILE` begins a volume, and each `--add-…` applies to the last one. In a scene file each
volume is a table with the same names, without `add-`:

    [[add]]
    file = "pet.nii.gz"
    tf = "inferno"
    transform = "pet_to_ct.txt"
    mask = {file = "body.nii.gz", fade = [0, 1]}
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from texvol.options import files, reading, texts
from texvol.options import light as lit
from texvol.options.scene_option import SceneOption
from texvol.scene import transfer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.looks import seen_as
from texvol.scene.spaces import letters_of_space, turned
from texvol.scene.transfer import adjusting, color_maps
from texvol.scene.transfer.foreign import ENDINGS, located
from texvol.util import locations
from texvol.util.errors import InputError
from texvol.util.suggestions import did_you_mean

if TYPE_CHECKING:
    from texvol.scene.mask import Mask
    from texvol.scene.transfer import TransferFunction
    from texvol.scene.transfer.labels import LabelLook
    from texvol.scene.volume import Volume


def _look(text: str) -> LabelLook:
    """Return the look of labels."""
    from texvol.scene.transfer.labels import parse_labels

    return texts.made(lambda: parse_labels(text))


# Options that each volume of a scene has of its own, beside those for reading it.
LOOK = (
    SceneOption(
        "tf", str, "PRESET|FILE|MAP",
        "transfer function: a file (texvol's JSON or TOML, ParaView's or VTK's JSON, FILE.json::NAME for one of "
        "several, 3D Slicer's .vp or .vp.json, Inviwo's .itf, MRIcroGL's .clut, .1dt), a colour map such as batlow, or "
        "a preset with its light: "
        + ", ".join(transfer.PRESETS),
    ),
    SceneOption(
        "unit-distance", texts.positive_length, "L",
        "world length that the opacities of another program's --tf belong to (its own, or that program's default)",
    ),
    SceneOption("materials", lit.materials, "NAME,NAME", "draw only these materials of --tf"),
    SceneOption(
        "range", texts.value_range, "LOW,HIGH",
        "values between which the transfer function changes, data units: shifts and scales a preset or a file",
    ),
    SceneOption("opacity", texts.opacity_factor, "F", "makes the volume F times as dense (1)"),
    SceneOption(
        "label-look", _look, "SPEC",
        "colour and opacity of labels: LABEL=OPACITY, LABEL=#RRGGBB or LABEL=#RRGGBB:OPACITY separated by commas, "
        "*=OPACITY for all other labels; opacity is per smallest spacing",
    ),
    SceneOption("hidden", bool, "", "the volume is not drawn, and stays in the window's list of volumes (default: no)"),
)  # fmt: skip
POSITION = (
    SceneOption("unit", texts.unit, "NAME", "name of the world unit, such as mm, overrides the file's"),
    SceneOption("spacing", texts.triple, "X,Y,Z", "distance of samples, overrides the file's spacing"),
    SceneOption(
        "transform", files.transform, "M",
        "moves the volume: 4 x 4 matrix of the world, 12 or 16 numbers row by row, or a file of 4 rows",
        from_value=files.transform_value,
    ),
    SceneOption(
        "mask", files.mask, "FILE[:LOW,HIGH]",
        "mask file on the volume's grid: of integers, 0 hides a sample; other numbers are weights from 0 to 1; with "
        "LOW,HIGH, weights rise from 0 at LOW to 1 at HIGH",
        from_value=files.mask_value,
    ),
)  # fmt: skip
_TIME = SceneOption("time", texts.index, "N", "time step, from 0")
_OF_ADDED = {each.name: each for each in (*LOOK, *POSITION, *(reading.READING | {"time": _TIME}).values())}


@dataclass(frozen=True)
class AddedChoice:
    """File of a further volume, and its options by name."""

    file: str
    chosen: Mapping[str, Any] = field(default_factory=dict)

    @property
    def hidden(self) -> bool:
        """True if the volume is not drawn."""
        return bool(self.chosen.get("hidden"))

    def load(self) -> Volume:
        """Return the volume as stored in its file.

        Raises
        ------
        InputError, MissingExtraError
            If the file can't be read.
        """
        from texvol.formats.readers import load

        return load(self.file, spacing=self.chosen.get("spacing"), **reading.arguments_of(reading.chosen(self.chosen)))

    def added_to(self, first: Volume, loaded: Volume, number: int) -> AddedVolume:
        """Return the loaded volume with transfer function and mask, in the world of the scene's first volume.

        Without a transfer function the volume gets a hue by its number among the added volumes; values that look like
        labels are labels then.

        Raises
        ------
        InputError, MissingExtraError
            If a file can't be read, or the files do not fit together.
        """
        mask = masked(self.chosen, loaded)
        volume = placed(turned(loaded, first.space), self.chosen)
        if not {"tf", "labels"} & self.chosen.keys():
            volume = seen_as(volume)
        medium = medium_of(self.chosen, volume) or transfer.proposed_beside(volume, number)
        return AddedVolume(volume, adjusted(self.chosen, medium, volume), mask)


def added(text: str) -> AddedChoice:
    """Return the choice of "FILE"."""
    if not text:
        raise argparse.ArgumentTypeError("must be the path of a file or folder, got ''")
    return AddedChoice(text)


def added_table(table: Mapping[str, Any]) -> AddedChoice:
    """Return the choice of a scene file's table."""
    if not isinstance(table.get("file"), str) or not table["file"]:
        raise argparse.ArgumentTypeError(f"must have a file (file = FILE), got {dict(table)!r}")
    chosen: dict[str, Any] = {}
    for key, value in table.items():
        name = key.replace("_", "-")
        if name == "file":
            continue
        if name not in _OF_ADDED:
            raise argparse.ArgumentTypeError(f"unknown key {key!r}; keys are file, {', '.join(_OF_ADDED)}")
        try:
            chosen[name] = _OF_ADDED[name].from_file(value)
        except argparse.ArgumentTypeError as error:
            raise argparse.ArgumentTypeError(f"{key}: {error}") from None
    check_look(chosen)
    return AddedChoice(table["file"], chosen)


ADD = SceneOption("add", added, "FILE", "further volume; repeat it for more", added_table)


class _Amend(argparse.Action):
    """Action that sets an option of the volume added last."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        so_far: list[AddedChoice] = getattr(namespace, "add", [])
        if not so_far:
            raise argparse.ArgumentError(self, "needs a volume to apply to: give --add FILE before it")
        value = not (option_string or "").startswith("--no-") if self.nargs == 0 else values
        if _OF_ADDED[self.const].repeated:
            value = [*so_far[-1].chosen.get(self.const, ()), value]
        namespace.add = [*so_far[:-1], AddedChoice(so_far[-1].file, {**so_far[-1].chosen, self.const: value})]


class OfAdded(NamedTuple):
    """Option of the command line for the volume added last."""

    option: SceneOption

    def add_to(self, group: argparse._ArgumentGroup) -> None:
        """Add the option to a parser's group."""
        name, is_switch = self.option.name, self.option.convert is bool
        how: dict[str, Any] = {"nargs": 0} if is_switch else {"type": self.option.convert, "metavar": self.option.shown}
        flags = [f"--add-{name}", *([f"--no-add-{name}"] if is_switch else [])]
        text = self.option.help if self.option is _TIME else f"as --{name}"
        group.add_argument(*flags, action=_Amend, const=name, default=argparse.SUPPRESS, help=text, **how)


OF_ADDED = tuple(OfAdded(option) for option in _OF_ADDED.values())


def beside(chosen: Mapping[str, Any], folder: str | os.PathLike[str]) -> dict[str, Any]:
    """Return options of a scene file with their paths relative to the file's folder."""
    found = {name: _moved(value, folder) for name, value in chosen.items()}
    if isinstance(found.get("tf"), str) and not transfer.is_named(found["tf"]):
        found["tf"] = str(Path(folder) / found["tf"])
    return reading.beside(found, folder)


def _moved(value: Any, folder: str | os.PathLike[str]) -> Any:
    if isinstance(value, list):
        return [_moved(each, folder) for each in value]
    if isinstance(value, AddedChoice):
        return AddedChoice(locations.beside(folder, value.file), beside(value.chosen, folder))
    names_file = isinstance(value, files.TransformChoice) and bool(value.path)
    if names_file or isinstance(value, files.MaskChoice | files.MeshChoice | files.DepthChoice):
        return value._replace(path=str(Path(folder) / value.path))
    return value


def check_look(chosen: Mapping[str, Any]) -> None:
    """Raise InputError if the look of a volume is given twice, or only in part."""
    if "label-look" in chosen and "tf" in chosen:
        raise InputError("--label-look and --tf both set the look of labels: give one of them")
    if "materials" in chosen and "tf" not in chosen:
        raise InputError("--materials needs --tf, a transfer function that has these materials")
    if "unit-distance" in chosen and "tf" not in chosen:
        raise InputError("--unit-distance needs --tf, the file of another program")


def placed(volume: Volume, chosen: Mapping[str, Any]) -> Volume:
    """Return the volume turned by --space and moved by --transform, with --unit.

    Raises
    ------
    InputError
        If --space is given for a file that names no directions of the body.
    """
    if "space" in chosen:
        if letters_of_space(volume.space) is None:
            named = volume.space or "none"
            raise InputError(f"{volume.name}: --space needs a file that names directions of the body, got {named}")
        volume = turned(volume, chosen["space"])
    volume = volume.moved(chosen["transform"].matrix()) if "transform" in chosen else volume
    return volume.with_unit(chosen["unit"]) if "unit" in chosen else volume


def masked(chosen: Mapping[str, Any], volume: Volume) -> Mask | None:
    """Return the volume's mask, or None."""
    return chosen["mask"].load(volume) if "mask" in chosen else None


def adjusted(chosen: Mapping[str, Any], medium: TransferFunction, volume: Volume) -> TransferFunction:
    """Return the transfer function with --range and --opacity.

    Raises
    ------
    InputError
        If --range is given for labels or colours.
    """
    if "range" in chosen:
        if volume.labels or volume.colors is not None:
            got, other = ("colours", "--no-color") if volume.colors is not None else ("labels", "--no-labels")
            said = f"--range needs measured values, got {got} in {volume.name}"
            raise InputError(f"{said}; {other} reads them as values")
        medium = adjusting.between(medium, *chosen["range"])
    return adjusting.denser(medium, chosen["opacity"]) if "opacity" in chosen else medium


def medium_of(chosen: Mapping[str, Any], volume: Volume) -> TransferFunction | None:
    """Return the volume's transfer function, or None if no option sets it.

    Raises
    ------
    InputError
        If it is not found, or does not fit the volume.
    """
    check_look(chosen)
    if "label-look" in chosen:
        from texvol.scene.transfer.labels import label_function

        return label_function(volume, **chosen["label-look"]._asdict())
    if "tf" not in chosen:
        return None
    return transfer_function(chosen["tf"], volume, chosen.get("materials"), chosen.get("unit-distance"))


def is_file(name: str) -> bool:
    """True if `--tf` takes a name for a file's, not for a preset's or colour map's."""
    endings = (".json", ".toml", *ENDINGS)
    name, _ = located(name)
    return name not in transfer.PRESETS and (name.lower().endswith(endings) or os.sep in name or os.path.exists(name))


def transfer_function(
    name: str,
    volume: Volume | None,
    materials: tuple[str, ...] | None = None,
    unit_distance: float | None = None,
) -> TransferFunction:
    """Return the preset, file or colour map `name`, reduced to `materials` if given."""
    if is_file(name):
        return transfer.load(name, volume, materials, unit_distance)
    if unit_distance is not None:
        raise InputError(f"--unit-distance is for files of other programs, got --tf {name}")
    if transfer.is_named(name):
        if volume is None:
            raise InputError(f"transfer function {name!r} is relative to a volume: give --volume VOLUME")
        return transfer.preset(name, volume, materials)
    known = ", ".join(transfer.PRESETS) + did_you_mean(name, (*transfer.PRESETS, *color_maps.names()))
    raise InputError(
        f"transfer function {name!r} must be a file such as .json or .toml, the name of a colour map, or a preset; "
        f"presets: {known}"
    )
