"""Options of the command line that describe a volume and a scene, on the line or in a scene file.

A scene file is TOML with the scene options' names as keys, `spacing` among them; triples and sizes may be text or
arrays, switches are true or false, and `light` is a text, or an array of texts or tables. An option on the line wins.
It may name its volume, and say how that is read, by the options' names again; a VOLUME on the line is another one.

    volume = "head.nrrd"
    tf = "bone.json"
    projection = "perspective"
    eye = [300, -200, 120]
    size = "800x600"
    light = ["head:0.5", {kind = "directional", direction = [-1, -1, 2], color = [1, 0.9, 0.8]}]
    two-sided = false
    [[add]]
    file = "pet.nrrd"
    transform = "pet_to_head.txt"
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

from texvol.annotation import Annotation
from texvol.options import light as lit
from texvol.options import meshes as geometry
from texvol.options import reading, scene_file, texts
from texvol.options import volumes as volume_options
from texvol.options.groups import GROUPS, SCENE_OPTIONS
from texvol.scene import orbit as turning
from texvol.scene import transfer
from texvol.scene.added_volume import common_box
from texvol.scene.air import Air, air_in_8_bits
from texvol.scene.camera import Camera
from texvol.scene.gradient import CENTRAL
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

if TYPE_CHECKING:
    from texvol.formats.readers import TimeSeries

DEFAULT_SIZE = (512, 512)


def add_scene_options(parser: argparse.ArgumentParser) -> None:
    """What is to be drawn; every option may stand in a scene file as well."""
    for title, about, members in GROUPS:
        group = parser.add_argument_group(title, about)
        if title == "scene":
            group.add_argument("--scene", metavar="FILE.toml", help="scene file")
        for option in members:
            option.add_to(group)


class SceneOptions:
    """Scene options of the line and the scene file, together; checked before the volume is read.

    Attributes
    ----------
    size : (width, height)
    spacing : (x, y, z), optional
        What overrides the file's.
    transparent : bool
        Whether the background is to let through what lies behind the picture.
    mode : str
        What is seen of the volume.
    window : (centre, width), optional
        In data units, for 8-bit pictures of a mode whose pixels are numbers.
    coloring : "grey" or "tf"
        Whether such pictures take their colours from the transfer function.
    """

    def __init__(self, arguments: argparse.Namespace) -> None:
        given = {name.replace("_", "-"): value for name, value in vars(arguments).items()}
        line = {name: given[name] for name in SCENE_OPTIONS if name in given}
        file, self._reading = {}, {"volume": given.get("volume")} | reading.chosen(given)
        if arguments.scene is not None:
            content = scene_file.read(arguments.scene, SCENE_OPTIONS, reading.READING)
            file = lit.with_head_light(content.chosen)
            if self._reading["volume"] is None:
                self._reading = content.reading | reading.chosen(given)
        file = volume_options.without_other_look(lit.overridden(file, line), line)
        chosen = self._chosen = lit.with_head_light(file | line)
        self.size: tuple[int, int] = chosen.get("size", DEFAULT_SIZE)
        if min(self.size) < 1:
            raise InputError(f"size {self.size[0]}x{self.size[1]}: a picture has at least one pixel along each side")
        self.spacing: tuple[float, float, float] | None = chosen.get("spacing")
        self.transparent = "background" in chosen and chosen["background"] is None
        self.window: tuple[float, float] | None = chosen.get("window")
        by_default = "tf" if "tf" in chosen and self.window is None else "grey"
        self.coloring: str = chosen.get("coloring", by_default)
        lit.check_mode(chosen)
        for each in (chosen, *(added.chosen for added in chosen.get("add", ()))):
            volume_options.check_look(each)
        self.mode: str = chosen.get("mode", "composite")
        self._lighting = lit.lighting(chosen)

    @classmethod
    def of(cls, volume: str | None = None, scene: str | None = None) -> SceneOptions:
        """What is chosen by a volume, a scene file, or both."""
        return cls(argparse.Namespace(volume=volume, scene=scene))

    @property
    def volume(self) -> str:
        """Path of the volume.

        Raises
        ------
        InputError
            If neither the line nor the scene file has one.
        """
        path = self._reading.get("volume")
        if path is None:
            raise InputError("VOLUME is required: give it, or name it in the scene file (volume = …)")
        return str(path)

    @property
    def all_times(self) -> bool:
        """Whether every time step is to be drawn."""
        return self._reading.get("time") == texts.ALL

    @property
    def chose_view(self) -> bool:
        """Whether it was said where the camera is, or how much it sees."""
        return "eye" in self._chosen or "height" in self._chosen

    @property
    def meshes(self) -> tuple[geometry.MeshChoice, ...]:
        """Where geometry comes from."""
        return tuple(self._chosen.get("mesh", ()))

    @property
    def transfer_function(self) -> str | None:
        """The name of the transfer function, as it was given: a preset's, or a file's."""
        return self._chosen.get("tf")

    @property
    def annotation(self) -> Annotation:
        """What is drawn into pictures that are looked at."""
        chosen = self._chosen
        further = {"value_name": chosen.get("value-name", ""), "font": chosen.get("font")}
        return Annotation.of(chosen.get("annotate", ()), chosen.get("title"), **further)

    def load(self) -> Volume:
        """The volume, read as it was said.

        Raises
        ------
        InputError
            If that is every time step.
        """
        from texvol.formats.readers import load

        volume = load(self.volume, spacing=self.spacing, **reading.told(self._reading))
        _ = self._further  # is read now, which is the time for that
        return self.placed(volume)

    def placed(self, volume: Volume) -> Volume:
        """A volume as it was read, where the options put it."""
        return volume_options.placed(volume, self._chosen)

    @cached_property
    def _further(self) -> tuple[Volume, ...]:
        """Further volumes, as their files have them."""
        return tuple(each.load() for each in self._chosen.get("add", ()))

    def series(self) -> TimeSeries:
        """All time steps of the volume, read as it was said, and not yet `placed`."""
        from texvol.formats.readers import TimeSeries

        told = {name: value for name, value in reading.chosen(self._reading).items() if name != "time"}
        return TimeSeries(self.volume, spacing=self.spacing, **told)

    def scene(
        self, volume: Volume, *, orbit: bool = False, adapting_to: Volume | None = None, in_8_bits: bool = False
    ) -> Scene:
        """The scene that the options make of `volume`; its camera frames one picture, or all of an orbit.

        A transfer function adapts to the values of `adapting_to`, where there is another volume for that; and so does
        the air of an X-ray, which the picture's format decides on where nobody says it.
        """
        chosen = self._chosen
        choices = chosen.get("add", ())
        added = tuple(
            choice.added_to(volume, each, number)
            for number, (choice, each) in enumerate(zip(choices, self._further, strict=True))
        )
        framing = turning.framing if orbit else Camera.framing
        return Scene(
            volume,
            self._transfer_function(adapting_to or volume),
            framing(
                common_box((volume, *(each.volume for each in added))),
                chosen.get("projection", "orthographic"),
                **{key: chosen.get(key) for key in ("eye", "target", "up", "fov", "height")},
                aspect=self.size[0] / self.size[1],
            ),
            chosen.get("background") or (0.0, 0.0, 0.0),
            chosen.get("classification", "slab"),
            lighting=self._lighting,
            gradient=chosen.get("gradient", CENTRAL),
            depth_cue=lit.depth_cue_of(chosen),
            mode=self.mode,  # type: ignore[arg-type]
            isovalue=chosen.get("isovalue"),
            air=self._air(adapting_to or volume, in_8_bits),
            coloring=self.coloring,  # type: ignore[arg-type]
            clip=tuple(chosen.get("clip", ())),
            crop=chosen.get("crop"),
            caps=chosen.get("caps", False),
            geometry=geometry.meshes(chosen.get("mesh", ())),
            mask=volume_options.masked(chosen, volume),
            added=added,
        )

    def _air(self, volume: Volume, in_8_bits: bool) -> Air:
        if "air" in self._chosen or self.mode != "xray":
            found: Air = self._chosen.get("air")
            return found
        return air_in_8_bits(volume) if in_8_bits else None

    def _transfer_function(self, volume: Volume) -> TransferFunction | None:
        medium = volume_options.medium_of(self._chosen, volume)
        # The other modes classify nothing.
        return transfer.proposed_for(volume) if medium is None and self.mode == "composite" else medium


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
