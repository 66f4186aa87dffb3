"""The option --add and those that say more of what it added last: further volumes of a scene.

On the line each `--add FILE` begins one, and every `--add-…` is of the last. In a scene file each is a table with the
same names, without `add-`:

    [[add]]
    file = "pet.nii.gz"
    tf = "inferno"
    transform = "pet_to_ct.txt"
    mask = {file = "body.nii.gz", fade = [0, 1]}
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from texvol.options import light as lit
from texvol.options import mask as mask_options
from texvol.options import texts
from texvol.options import transform as transform_options
from texvol.options.reading import READING
from texvol.options.scene_option import SceneOption
from texvol.scene import transfer
from texvol.scene.added_volume import AddedVolume
from texvol.scene.spaces import turned
from texvol.util.errors import InputError

if TYPE_CHECKING:
    from texvol.scene.mask import Mask
    from texvol.scene.transfer import TransferFunction
    from texvol.scene.transfer.labels import LabelLook
    from texvol.scene.volume import Volume


def _look(text: str) -> LabelLook:
    """How labels look."""
    from texvol.scene.transfer.labels import parse_labels

    try:
        return parse_labels(text)
    except InputError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


# What each volume of a scene has of its own, beside how it is read: of the scene's own volume an option by that name.
LOOK = (
    SceneOption("tf", str, "PRESET|FILE.json", f"transfer function; presets: {', '.join(transfer.PRESETS)}"),
    SceneOption("materials", lit.materials, "NAME,NAME", "only these materials of --tf"),
    SceneOption(
        "label-look", _look, "SPEC",
        "colour and opacity of labels: LABEL=OPACITY, LABEL=#RRGGBB or LABEL=#RRGGBB:OPACITY with commas between, "
        "*=OPACITY for the others; an opacity is that of one smallest spacing",
    ),
)  # fmt: skip
POSITION = (
    SceneOption("spacing", texts.triple, "X,Y,Z", "distance of samples, overrides the file's"),
    SceneOption(
        "transform", transform_options.transform, "M",
        "moves the volume: 4 x 4 matrix of the world, 12 or 16 numbers row by row, or a file of 4 rows",
        from_value=transform_options.transform_value,
    ),
    SceneOption(
        "mask", mask_options.mask, "FILE[:LOW,HIGH]",
        "what of the volume is there: integers hide where they are 0, others are weights from 0 to 1; or weights rise "
        "from 0 at LOW to 1 at HIGH. A file on the volume's grid",
        from_value=mask_options.mask_value,
    ),
)  # fmt: skip
_TIME = SceneOption("time", texts.index, "N", "which time step, from 0")
_OF_ADDED = {
    option.name: option for option in (*LOOK, *POSITION, *(READING | {"time": _TIME}).values())
}  # fmt: skip


@dataclass(frozen=True)
class AddedChoice:
    """A file, and what is said of it by the options' names."""

    file: str
    chosen: Mapping[str, Any] = field(default_factory=dict)

    def with_option(self, name: str, value: Any) -> AddedChoice:
        """The same, with one more option."""
        return replace(self, chosen={**self.chosen, name: value})

    def beside(self, folder: str | os.PathLike[str]) -> AddedChoice:
        """The same, its paths relative to a folder."""
        return AddedChoice(str(Path(folder) / self.file), beside(self.chosen, folder))

    def load(self) -> Volume:
        """The volume as its file has it.

        Raises
        ------
        InputError, MissingExtraError
            If it can't be read.
        """
        from texvol.formats.readers import load

        told = {name: self.chosen[name] for name in READING if name in self.chosen}
        return load(self.file, spacing=self.chosen.get("spacing"), **told)

    def added_to(self, first: Volume, loaded: Volume, number: int) -> AddedVolume:
        """What was loaded with its transfer function and its mask, in the world of a scene's first volume.

        Without a transfer function each volume gets a hue of its own, by its number among those that are added.

        Raises
        ------
        InputError, MissingExtraError
            If one of them can't be read, or they don't go together.
        """
        mask = masked(self.chosen, loaded)
        volume = placed(turned(loaded, first.space), self.chosen)
        medium = medium_of(self.chosen, volume)
        return AddedVolume(volume, transfer.proposed_beside(volume, number) if medium is None else medium, mask)


def added(text: str) -> AddedChoice:
    """A further volume from "FILE"."""
    if not text:
        raise argparse.ArgumentTypeError("the path of a file or folder is wanted")
    return AddedChoice(text)


def added_table(table: Mapping[str, Any]) -> AddedChoice:
    """A further volume from a scene file's table."""
    if not isinstance(table.get("file"), str) or not table["file"]:
        raise argparse.ArgumentTypeError(f"a further volume has a file, and not {dict(table)!r}")
    choice = AddedChoice(table["file"])
    for key, value in table.items():
        name = key.replace("_", "-")
        if name == "file":
            continue
        if name not in _OF_ADDED:
            raise argparse.ArgumentTypeError(f"there is no {key!r} of a volume; there are file, {', '.join(_OF_ADDED)}")
        try:
            choice = choice.with_option(name, _OF_ADDED[name].from_file(value))
        except argparse.ArgumentTypeError as error:
            raise argparse.ArgumentTypeError(f"{key}: {error}") from None
    check_look(choice.chosen)
    return choice


ADD = SceneOption("add", added, "FILE", "one more volume; give it again for further ones", added_table)


class _Amend(argparse.Action):
    """Says something of the volume that was added last."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: str | Sequence[Any] | None,
        option_string: str | None = None,
    ) -> None:
        so_far: list[AddedChoice] = list(getattr(namespace, "add", []))
        if not so_far:
            raise argparse.ArgumentError(self, "it is of the volume that --add adds: give --add FILE before it")
        value = not (option_string or "").startswith("--no-") if self.nargs == 0 else values
        if _OF_ADDED[self.const].repeated:
            value = [*so_far[-1].chosen.get(self.const, ()), value]
        so_far[-1] = so_far[-1].with_option(self.const, value)
        namespace.add = so_far


class OfAdded(NamedTuple):
    """An option of the line for the volume that was added last."""

    option: SceneOption

    def add_to(self, group: argparse._ArgumentGroup) -> None:
        """Let the line have it."""
        name, is_switch = self.option.name, self.option.convert is bool
        how: dict[str, Any] = {"nargs": 0} if is_switch else {"type": self.option.convert, "metavar": self.option.shown}
        flags = [f"--add-{name}", *([f"--no-add-{name}"] if is_switch else [])]
        text = self.option.help if self.option is _TIME else f"as --{name}"
        group.add_argument(*flags, action=_Amend, const=name, default=argparse.SUPPRESS, help=text, **how)


OF_ADDED = tuple(OfAdded(option) for option in _OF_ADDED.values())


def beside(chosen: Mapping[str, Any], folder: str | os.PathLike[str]) -> dict[str, Any]:
    """Options of a scene file in that folder, paths among them relative to it, wherever the command is called."""
    found = {name: _moved(value, folder) for name, value in chosen.items()}
    if isinstance(found.get("tf"), str) and found["tf"] not in transfer.PRESETS:
        found["tf"] = str(Path(folder) / found["tf"])
    return found


def _moved(value: Any, folder: str | os.PathLike[str]) -> Any:
    if isinstance(value, list):
        return [_moved(each, folder) for each in value]
    move: Callable[[str | os.PathLike[str]], Any] | None = getattr(value, "beside", None)
    return value if move is None else move(folder)


def without_other_look(file: Mapping[str, Any], line: Mapping[str, Any]) -> dict[str, Any]:
    """Options of the scene file but for those in whose place the line has another kind of look."""
    dropped = {"tf", "materials"} if "label-look" in line else {"label-look"} if "tf" in line else set()
    return {name: value for name, value in file.items() if name not in dropped}


def check_look(chosen: Mapping[str, Any]) -> None:
    """InputError if it is said in two ways how a volume looks, or half of one."""
    if "label-look" in chosen and "tf" in chosen:
        raise InputError("--label-look and --tf both say how labels look: give one of them")
    if "materials" in chosen and "tf" not in chosen:
        raise InputError("--materials chooses from those of a transfer function: give --tf as well")


def placed(volume: Volume, chosen: Mapping[str, Any]) -> Volume:
    """The volume where the options put it."""
    return volume.moved(chosen["transform"].matrix()) if "transform" in chosen else volume


def masked(chosen: Mapping[str, Any], volume: Volume) -> Mask | None:
    """The volume's mask by the options; None where they name none."""
    if "mask" not in chosen:
        return None
    choice: mask_options.MaskChoice = chosen["mask"]
    return choice.load(volume)


def medium_of(chosen: Mapping[str, Any], volume: Volume) -> TransferFunction | None:
    """The transfer function that the options say for a volume; None where they say nothing.

    Raises
    ------
    InputError
        If it is none, or none for this volume.
    """
    check_look(chosen)
    if "label-look" in chosen:
        from texvol.scene.transfer.labels import label_function

        return label_function(volume, **chosen["label-look"]._asdict())
    if "tf" not in chosen:
        return None
    return transfer_function(chosen["tf"], volume, chosen.get("materials"))


def transfer_function(name: str, volume: Volume, materials: tuple[str, ...] | None = None) -> TransferFunction:
    """The preset or file `name`, a file if it looks like one; of its materials only these, where they are given."""
    if name in transfer.PRESETS:
        return transfer.preset(name, volume, materials)
    if name.lower().endswith(".json") or os.sep in name or os.path.exists(name):
        return transfer.load(name, volume, materials)
    raise InputError(
        f"transfer function {name}: neither a .json file nor a preset; presets: {', '.join(transfer.PRESETS)}"
    )
