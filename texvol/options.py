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
"""

from __future__ import annotations

import argparse
import os
import re
from collections.abc import Sequence
from typing import TYPE_CHECKING

from texvol import cut_options as cut
from texvol import light_options as lit
from texvol import mesh_options as geometry
from texvol import option_texts as texts
from texvol import orbit as turning
from texvol import reading_options as reading
from texvol import scene_file, transfer
from texvol.annotation import PARTS, Annotation
from texvol.camera import Camera
from texvol.errors import InputError
from texvol.gradient import CENTRAL
from texvol.lighting import Lighting
from texvol.scene import CLASSIFICATIONS, MODES, Scene
from texvol.scene_option import SceneOption
from texvol.transfer import TransferFunction
from texvol.volume import Volume

if TYPE_CHECKING:
    from texvol.readers import TimeSeries

DEFAULT_SIZE = (512, 512)


def _parts(text: str) -> tuple[str, ...]:
    """Names of annotation."""
    names = tuple(each.strip() for each in text.split(",") if each.strip())
    for name in names:
        texts.choice(*PARTS)(name)
    return names


# Title of a group, what it says, and its options.
_GROUPS: tuple[tuple[str, str | None, tuple[SceneOption, ...]], ...] = (
    (
        "scene",
        "What is drawn. All options of this and the next six groups may stand in the scene file, as keys; "
        "an option on the line wins.",
        (
            SceneOption("tf", str, "PRESET|FILE.json", f"transfer function; presets: {', '.join(transfer.PRESETS)}"),
            SceneOption("materials", lit.materials, "NAME,NAME", "only these materials of --tf"),
            SceneOption(
                "classification", texts.choice(*CLASSIFICATIONS), "KIND",
                "slab (default), extinction, post or integrated",
            ),
            SceneOption("spacing", texts.triple, "X,Y,Z", "distance of samples, overrides the file's"),
            SceneOption("size", texts.size, "WxH", "pixels (512x512)"),
            SceneOption("background", texts.color, "R,G,B", "linear light from behind (0,0,0), or: transparent"),
            SceneOption(
                "gradient", lit.gradient, "KIND",
                "central (default), zucker-hummel, or gaussian[:SCALE], which smooths over SCALE samples (1); "
                "computed only where light, contours or an isosurface need it",
            ),
        ),
    ),
    (
        "camera",
        None,
        (
            SceneOption(
                "projection", texts.choice("orthographic", "perspective"), "KIND",
                "orthographic (default) or perspective",
            ),
            SceneOption(
                "eye", texts.triple, "X,Y,Z", "where the camera is, world units (so that the whole box is seen)"
            ),
            SceneOption("target", texts.triple, "X,Y,Z", "what it looks at (the middle of the box)"),
            SceneOption("up", texts.triple, "X,Y,Z", "what is up in the picture (0,0,1)"),
            SceneOption("fov", texts.number, "DEGREES", "angle from bottom to top, perspective (40)"),
            SceneOption("height", texts.number, "H", "world units from bottom to top, orthographic (the box)"),
        ),
    ),
    (
        "light",
        "Without --light matter shows its own colour. An isosurface has a head light, and so has matter with any of "
        "--ambient, --diffuse, --specular, --shininess, --two-sided, --fade and --shadows.",
        (
            SceneOption(
                "light", lit.light, "SPEC",
                "head; directional:X,Y,Z or X,Y,Z, where it comes from; point:X,Y,Z, where it is; each may end with "
                "a colour :R,G,B or :I. Give it again for further lights. depth: no light, but shading by depth; "
                "none: no light, whatever the scene file says",
                lit.light_table,
            ),
            SceneOption("ambient", lit.share, "A", f"light from everywhere ({Lighting.ambient:g})"),
            SceneOption("diffuse", lit.share, "D", f"share of light that matter scatters ({Lighting.diffuse:g})"),
            SceneOption("specular", lit.share, "S", f"share of light in highlights ({Lighting.specular:g})"),
            SceneOption("shininess", lit.share, "N", f"the higher, the smaller highlights ({Lighting.shininess:g})"),
            SceneOption(
                "two-sided", bool, "", "light the side that faces the eye (default), or only the side of lower values"
            ),
            SceneOption(
                "fade", lit.share, "G",
                "gradient magnitude, data units per world unit, under which shading fades out "
                "(a hundredth of the range of values per sample)",
            ),
            SceneOption("shadows", bool, "", "matter takes light from what lies behind it, or not (default)"),
            SceneOption(
                "depth-cue", lit.depth_cue, "S[,R,G,B]",
                "mix what is farther with a colour (black), the farthest corner by S, from 0 to 1",
            ),
        ),
    ),
    (
        "cutting",
        "Of the volume only what lies inside of all of these is seen.",
        (
            SceneOption(
                "clip", cut.clip_plane, "NX,NY,NZ,D",
                "keep what has NX x + NY y + NZ z >= D, world units; give it again for further planes",
                cut.clip_plane_table,
            ),
            SceneOption("crop", cut.crop_box, "X0,X1,Y0,Y1,Z0,Z1", "keep what lies in this box, world units"),
            SceneOption(
                "caps", bool, "", "matter that is cut open is opaque there, in its own colour, or not (default)"
            ),
        ),
    ),
    (
        "geometry",
        None,
        (
            SceneOption(
                "mesh", geometry.mesh, "FILE[:R,G,B][:A]",
                "surface in the volume, PLY, STL, OBJ or VTP, world units; with a colour (linear) and an opacity of "
                "its own; give it again for further ones",
                geometry.mesh_table,
            ),
        ),
    ),
    (
        "annotation",
        "Drawn into PNG, JPEG and films, never into the data of an EXR.",
        (
            SceneOption("annotate", _parts, "PART,PART", f"what explains the picture: {', '.join(PARTS)}"),
            SceneOption("title", str, "TEXT", "one line on top"),
            SceneOption("value-name", str, "TEXT", "what the values are, for the legend, such as HU"),
            SceneOption("font", str, "FILE", "TrueType font, for letters that DejaVu Sans lacks"),
        ),
    ),
    (
        "projection mode",
        None,
        (
            SceneOption(
                "mode", texts.choice(*MODES), "MODE",
                "composite (default): emission and absorption; xray, mip, minip, average: the value's integral, "
                "maximum, minimum or average along each ray; isosurface: the first surface of --isovalue",
            ),
            SceneOption("isovalue", lit.finite, "V", "value of the isosurface, data units"),
            SceneOption(
                "window", lit.window, "CENTRE,WIDTH",
                "values from black to white in 8-bit pictures of xray, mip, minip and average",
            ),
        ),
    ),
)  # fmt: skip
_SCENE_OPTIONS = {option.name: option for *_, members in _GROUPS for option in members}


def add_scene_options(parser: argparse.ArgumentParser) -> None:
    """What is to be drawn; every option may stand in a scene file as well."""
    for title, about, members in _GROUPS:
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
    chose_transfer_function : bool
        Whether there is one that such pictures are to take their colours from.
    """

    def __init__(self, arguments: argparse.Namespace) -> None:
        given = {name.replace("_", "-"): value for name, value in vars(arguments).items()}
        line = {name: given[name] for name in _SCENE_OPTIONS if name in given}
        file, self._reading = {}, {"volume": given.get("volume")} | reading.chosen(given)
        if arguments.scene is not None:
            content = scene_file.read(arguments.scene, _SCENE_OPTIONS, reading.READING)
            file = lit.with_head_light(content.chosen)
            if self._reading["volume"] is None:
                self._reading = content.reading | reading.chosen(given)
        chosen = self._chosen = lit.with_head_light(lit.overridden(file, line))
        self.size: tuple[int, int] = chosen.get("size", DEFAULT_SIZE)
        if min(self.size) < 1:
            raise InputError(f"size {self.size[0]}x{self.size[1]}: a picture has at least one pixel along each side")
        self.spacing: tuple[float, float, float] | None = chosen.get("spacing")
        self.transparent = "background" in chosen and chosen["background"] is None
        self.window: tuple[float, float] | None = chosen.get("window")
        self.chose_transfer_function = "tf" in chosen
        if "materials" in chosen and not self.chose_transfer_function:
            raise InputError("--materials chooses from those of a transfer function: give --tf as well")
        lit.check_mode(chosen)
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
        from texvol.readers import load

        return load(self.volume, spacing=self.spacing, **reading.told(self._reading))

    def series(self) -> TimeSeries:
        """All time steps of the volume, read as it was said."""
        from texvol.readers import TimeSeries

        told = {name: value for name, value in reading.chosen(self._reading).items() if name != "time"}
        return TimeSeries(self.volume, spacing=self.spacing, **told)

    def scene(self, volume: Volume, *, orbit: bool = False, adapting_to: Volume | None = None) -> Scene:
        """The scene that the options make of `volume`; its camera frames one picture, or all of an orbit.

        A transfer function adapts to the values of `adapting_to`, where there is another volume for that.
        """
        chosen = self._chosen
        framing = turning.framing if orbit else Camera.framing
        return Scene(
            volume,
            self._transfer_function(adapting_to or volume),
            framing(
                volume,
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
            clip=tuple(chosen.get("clip", ())),
            crop=chosen.get("crop"),
            caps=chosen.get("caps", False),
            geometry=geometry.meshes(chosen.get("mesh", ())),
        )

    def _transfer_function(self, volume: Volume) -> TransferFunction | None:
        if self.chose_transfer_function:
            return transfer_function(self._chosen["tf"], volume, self._chosen.get("materials"))
        # The other modes classify nothing.
        return transfer.proposed_for(volume) if self.mode == "composite" else None


def transfer_function(name: str, volume: Volume, materials: tuple[str, ...] | None = None) -> TransferFunction:
    """The preset or file `name`, a file if it looks like one; of its materials only these, where they are given."""
    if name in transfer.PRESETS:
        return transfer.preset(name, volume, materials)
    if name.lower().endswith(".json") or os.sep in name or os.path.exists(name):
        return transfer.load(name, volume, materials)
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
