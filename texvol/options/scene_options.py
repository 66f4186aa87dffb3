"""Options that describe a volume and a scene, on the command line or in a scene file.

A scene file is TOML. Its keys are the names of scene options, `spacing` included; triples and sizes are text or
arrays, switches are true or false, and `light` is a text, or an array of texts or tables. The file may also name the
volume and the options for reading it. The command line overrides the file; VOLUME on the line replaces the file's.

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
from dataclasses import replace
from functools import cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from texvol.annotation import Annotation
from texvol.options import files, reading, saved_views, texts
from texvol.options import light as lit
from texvol.options import volumes as volume_options
from texvol.options.groups import GROUPS, SCENE_OPTIONS
from texvol.options.looks import look_by
from texvol.options.volumes import AddedChoice
from texvol.scene import orbit as turning
from texvol.scene.added_volume import AddedVolume
from texvol.scene.air import Air, air_in_8_bits
from texvol.scene.camera import Camera
from texvol.scene.framing import ViewChoice, framed, zoomed
from texvol.scene.gradient import CENTRAL
from texvol.scene.looks import Look, seen_as
from texvol.scene.proportions import in_proportion
from texvol.scene.scene import Scene
from texvol.scene.tour import Tour
from texvol.scene.volume import Volume
from texvol.scene.volume_order import without_first
from texvol.util import locations, text_files
from texvol.util.errors import InputError
from texvol.util.suggestions import did_you_mean
from texvol.util.terminal import stage

if TYPE_CHECKING:
    from texvol.formats.readers import TimeSeries

DEFAULT_SIZE = (512, 512)
# Options of an image, and not of one of its channels.
_OF_ALL_CHANNELS = ("unit", "spacing", "transform", "mask", "opacity")


def add_scene_options(parser: argparse.ArgumentParser) -> None:
    """Add all scene options to a command's parser."""
    for title, about, members in GROUPS:
        group = parser.add_argument_group(title, about)
        if title == "scene":
            group.add_argument("--scene", metavar="FILE.toml", help="scene file")
        for option in members:
            option.add_to(group)


class SceneOptions:
    """Scene options of command line and scene file together, checked before the volume is read.

    Attributes
    ----------
    size : (width, height)
        Pixels.
    spacing : (x, y, z), optional
        Overrides the file's spacing.
    transparent : bool
        True if the background is transparent.
    mode : str
        Projection mode.
    window : (centre, width), optional
        Data units, for 8-bit pictures of a mode whose pixels are numbers.
    coloring : "grey" or "tf"
        Colours of such pictures: grey, or those of the transfer function.
    look : Look, optional
        Transfer function and light of the last scene that was asked for, and the reason for them.
    """

    def __init__(self, arguments: argparse.Namespace) -> None:
        given = {name.replace("_", "-"): value for name, value in vars(arguments).items()}
        line = {name: given[name] for name in SCENE_OPTIONS if name in given}
        file, self._reading = {}, {"volume": given.get("volume")} | reading.chosen(given)
        if arguments.scene is not None:
            in_file, reading_in_file = _read(Path(arguments.scene))
            file = lit.with_head_light(in_file)
            if self._reading["volume"] is None:
                self._reading = reading_in_file | reading.chosen(given)
        chosen = self._chosen = lit.with_head_light(lit.overridden(file, line))
        self.size: tuple[int, int] = chosen.get("size", DEFAULT_SIZE)
        if min(self.size) < 1:
            raise InputError(f"size must be at least 1x1, got {self.size[0]}x{self.size[1]}")
        self.spacing: tuple[float, float, float] | None = chosen.get("spacing")
        self.transparent = "background" in chosen and chosen["background"] is None
        self.window: tuple[float, float] | None = chosen.get("window")
        by_default = "tf" if "tf" in chosen and self.window is None else "grey"
        self.coloring: str = chosen.get("coloring", by_default)
        lit.check_mode(chosen)
        lit.check_view(chosen)
        for each in (chosen, *(added.chosen for added in chosen.get("add", ()))):
            volume_options.check_look(each)
        self.mode: str = chosen.get("mode", "composite")
        self._lighting = lit.lighting(chosen)
        self.look: Look | None = None  # of the last scene
        self._channels: tuple[tuple[AddedChoice, Volume], ...] = ()

    @classmethod
    def of(cls, volume: str | None = None, scene: str | None = None) -> SceneOptions:
        """Return the options of a volume, a scene file, or both."""
        return cls(argparse.Namespace(volume=volume, scene=scene))

    @property
    def volume(self) -> str:
        """Path of the volume.

        Raises
        ------
        InputError
            If neither the command line nor the scene file names a volume.
        """
        path = self._reading.get("volume")
        if path is None:
            raise InputError("VOLUME is required: give it, or name it in the scene file (volume = …)")
        return str(path)

    @property
    def told(self) -> dict[str, Any]:
        """Arguments of `texvol.load` that say how the volume is read; raise InputError for all time steps."""
        spacing = {} if self.spacing is None else {"spacing": self.spacing}
        return reading.told(self._reading) | spacing

    @property
    def all_times(self) -> bool:
        """True if all time steps are drawn."""
        return self._reading.get("time") == texts.ALL

    @property
    def chose_view(self) -> bool:
        """True if the camera's position, height or zoom is given, so that nothing else moves it."""
        return any(name in self._chosen for name in ("eye", "height", "zoom"))

    @property
    def has_depth_in(self) -> bool:
        """True if a depth picture is given, which is of one view and size."""
        return "depth-in" in self._chosen

    @property
    def transfer_function(self) -> str | None:
        """Transfer function as given: the name of a preset, or a path."""
        return self._chosen.get("tf")

    @property
    def annotation(self) -> Annotation:
        """Annotation of 8-bit pictures."""
        chosen = self._chosen
        further = {"value_name": chosen.get("value-name", ""), "font": chosen.get("font")}
        further["measures"] = tuple(chosen.get("measure", ()))
        return Annotation.of(chosen.get("annotate", ()), chosen.get("title"), **further)

    @property
    def tour(self) -> Tour:
        """Saved views of the scene file, and the path through them."""
        return saved_views.tour_of(self._chosen)

    def load(self) -> Volume:
        """Return the volume, read and moved by the options.

        Raises
        ------
        InputError
            If the options ask for all time steps, or a file can't be read.
        """
        from texvol.formats.readers import load

        told = reading.told(self._reading)
        stage(f"reading {self.volume}")
        volume = load(self.volume, spacing=self.spacing, **told)
        _ = self._further  # reads the further volumes now, as part of loading
        if "channel" not in told and self.mode == "composite" and "tf" not in self._chosen:
            self._channels = self._other_channels(volume)
        return self.taken(volume)

    def taken(self, volume: Volume) -> Volume:
        """Return a volume in memory as `load` does one from a file: moved, with labels if its values look like some."""
        return self.placed(self._seen_as(self._in_proportion(volume)))

    def _in_proportion(self, volume: Volume) -> Volume:
        """Return the volume, its axes scaled if their units differ and no option speaks of the world."""
        of_world = {"spacing", "transform", "eye", "target", "height", "clip", "crop", "add", "mesh", "isovalue"}
        return volume if of_world & set(self._chosen) else in_proportion(volume)

    def _seen_as(self, volume: Volume) -> Volume:
        """Return the volume, with labels in place of values that look like labels unless an option says something."""
        said = "tf" in self._chosen or "labels" in self._reading
        return volume if said or self.mode != "composite" else seen_as(volume)

    def _other_channels(self, volume: Volume) -> tuple[tuple[AddedChoice, Volume], ...]:
        """Return the other active channels of the volume's image, which are drawn with it."""
        from texvol.formats.stores.channels import other_channels

        like = {key: value for key, value in self._chosen.items() if key in _OF_ALL_CHANNELS}
        told = reading.chosen(self._reading)
        choices = [AddedChoice(self.volume, like | told | {"channel": each}) for each in other_channels(volume)]
        return tuple((each, each.load()) for each in choices)

    def placed(self, volume: Volume) -> Volume:
        """Return a volume moved by --transform."""
        return volume_options.placed(volume, self._chosen)

    @cached_property
    def _further(self) -> tuple[tuple[int, AddedChoice, Volume], ...]:
        """Further volumes that are not hidden, as stored in their files, with their numbers."""
        adds = enumerate(self._chosen.get("add", ()))
        return tuple((number, each, each.load()) for number, each in adds if not each.hidden)

    def hidden(self, volume: Volume) -> tuple[tuple[int, AddedVolume], ...]:
        """Return the hidden volumes, read now, with their positions among all volumes; `volume` is the first one."""
        before, found = len(self._channels), []
        if self._hides_first:
            medium = look_by(self._chosen, volume).transfer_function
            found.append((0, AddedVolume(volume, medium, volume_options.masked(self._chosen, volume))))
        for number, each in enumerate(self._chosen.get("add", ()), before):
            if each.hidden:
                found.append((number + 1, each.added_to(volume, each.load(), number)))
        return tuple(found)

    @property
    def _hides_first(self) -> bool:
        hides = bool(self._chosen.get("hidden"))
        if hides and self.mode != "composite":
            raise InputError(f"--hidden needs mode composite, got mode {self.mode}")
        return hides

    def _added(self, volume: Volume) -> tuple[AddedVolume, ...]:
        """Return the further volumes in the world of the first one."""
        before = len(self._channels)
        further = [(number, *each) for number, each in enumerate(self._channels)]
        further += [(before + number, choice, each) for number, choice, each in self._further]
        return tuple(choice.added_to(volume, each, number) for number, choice, each in further)

    def volumes(self) -> tuple[Volume, ...]:
        """Return all volumes of the scene, read and placed; nothing is made of their looks."""
        volume = self.load()
        return (volume, *(each.volume for each in self._added(volume)))

    def series(self) -> TimeSeries:
        """Return all time steps of the volume, not yet `placed`."""
        from texvol.formats.readers import TimeSeries

        chosen = reading.arguments_of(reading.chosen(self._reading))
        told = {name: value for name, value in chosen.items() if name != "time"}
        series = TimeSeries(self.volume, spacing=self.spacing, **told)
        if self._seen_as(first := series[0]).labels and not first.labels:
            return TimeSeries(self.volume, spacing=self.spacing, **(told | {"labels": True}))
        return series

    def scene(
        self,
        volume: Volume,
        *,
        orbit: bool | turning.Turn = False,
        adapting_to: Volume | None = None,
        in_8_bits: bool = False,
        lit_by_default: bool = True,
    ) -> Scene:
        """Return the scene of the options; its camera frames one picture, or all views of an orbit, True for one turn.

        The transfer function and the air of an X-ray adapt to the values of `adapting_to` if given, else to `volume`.
        `in_8_bits` is the kind of picture, which decides on the air if no option does. Without `lit_by_default` there
        is only the light that options ask for, for what cannot draw light.
        """
        chosen, added = self._chosen, self._added(volume)
        scene = Scene(
            volume,
            classification=chosen.get("classification", Scene.classification),
            depth_cue=lit.depth_cue_of(chosen),
            mode=self.mode,  # type: ignore[arg-type]
            **self._shown(adapting_to or volume, any(each.medium.emissive for each in added) or not lit_by_default),
            **lit.isosurfaces_of(chosen),
            air=self._air(adapting_to or volume, in_8_bits),
            coloring=self.coloring,  # type: ignore[arg-type]
            clip=tuple(chosen.get("clip", ())),
            crop=chosen.get("crop"),
            caps=chosen.get("caps", False),
            geometry=files.meshes(chosen.get("mesh", ())),
            mask=volume_options.masked(chosen, volume),
            added=added,
            depth=chosen["depth-in"].load() if "depth-in" in chosen else None,
        )
        if self._hides_first:
            scene = without_first(scene)
            adapting_to = None
        seen = scene if adapting_to is None else replace(scene, volume=adapting_to, mask=None)
        camera = self._camera(seen, orbit)
        return replace(scene, camera=camera, lighting=lit.placed(chosen, scene.lighting, camera))

    def _camera(self, scene: Scene, orbit: bool | turning.Turn) -> Camera:
        """Return the camera of the options, or one that frames what shows."""
        chosen, aspect = self._chosen, self.size[0] / self.size[1]
        projection = chosen.get("projection", "orthographic")
        turn = orbit if isinstance(orbit, turning.Turn) else None
        how: dict[str, Any] = {key: chosen.get(key) for key in ("up", "fov")}
        if any(name in chosen for name in ("eye", "target", "height")):
            framing = partial(turning.framing, turn=turn) if orbit else Camera.framing
            how |= {key: chosen.get(key) for key in ("eye", "target", "height")}
            camera = framing(scene.box, projection, **how, aspect=aspect)
        else:
            side = ViewChoice(chosen.get("view"), chosen.get("azimuth"), chosen.get("elevation"))
            how |= {"whole_box": chosen.get("fit") == "box", "turning": bool(orbit), "turn": turn}
            camera = framed(scene, projection, choice=side, **how, aspect=aspect)
        return zoomed(camera, chosen["zoom"]) if "zoom" in chosen else camera

    def _shown(self, volume: Volume, unlit: bool) -> dict[str, Any]:
        """Return transfer function, light, gradient and background: of the options, or else of the look.

        `unlit` is True if a look gives no light.
        """
        chosen, light, look = self._chosen, self._lighting, None
        if self.mode == "composite" or "tf" in chosen or "label-look" in chosen:
            look = self.look = look_by(chosen, volume)
        gradient = chosen.get("gradient", CENTRAL)
        background = chosen.get("background") or (0.0, 0.0, 0.0)
        if look is not None and self.mode == "composite":
            if "light" not in chosen and not unlit and look.lighting is not None:
                light, gradient = look.lighting, chosen.get("gradient", look.gradient)
            if "background" not in chosen and look.background is not None:
                background = look.background
            self.look = replace(look, lighting=light)
        medium = None if look is None else look.transfer_function
        return {"transfer_function": medium, "lighting": light, "gradient": gradient, "background": background}

    def _air(self, volume: Volume, in_8_bits: bool) -> Air:
        if "air" in self._chosen or self.mode != "xray":
            found: Air = self._chosen.get("air")
            return found
        return air_in_8_bits(volume) if in_8_bits else None


def _read(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the scene options of a scene file by name, and `volume` with the options for reading it.

    Paths in a scene file are relative to its folder.

    Raises
    ------
    InputError
        If the file can't be read, is not TOML, or has an unknown key or a wrong value.
    """
    chosen: dict[str, Any] = {}
    told: dict[str, Any] = {}
    for key, value in text_files.read_toml(path).items():
        name = key.replace("_", "-")
        if name == "volume":
            if not isinstance(value, str) or not value:
                raise InputError(f"{path}: volume must be the path of a file or folder, got {value!r}")
            told[name] = locations.beside(path.parent, value)
        elif name in (saved_views.SAVED_VIEW, saved_views.TOUR):
            chosen[name] = _of_tour(path, name, value)
        elif option := reading.READING.get(name) or SCENE_OPTIONS.get(name):
            try:
                (told if name in reading.READING else chosen)[name] = option.from_file(value)
            except argparse.ArgumentTypeError as error:
                raise InputError(f"{path}: {key}: {error}") from None
            except InputError as error:
                raise InputError(f"{path}: {error}") from None
        else:
            known = (*SCENE_OPTIONS, "volume", *reading.READING, saved_views.SAVED_VIEW, saved_views.TOUR)
            near, listed = did_you_mean(name, known), ", ".join(known)
            raise InputError(f"{path}: unknown scene option {key!r}; scene options are {listed}{near}")
    if told and "volume" not in told:
        raise InputError(f"{path}: {', '.join(told)} needs a volume: name it (volume = …)")
    return volume_options.beside(chosen, path.parent), reading.beside(told, path.parent)


def _of_tour(path: Path, name: str, value: Any) -> Any:
    """Return the saved views of a scene file, or the switches of the tour through them."""
    try:
        return saved_views.from_file(name, value)
    except (argparse.ArgumentTypeError, InputError) as error:
        raise InputError(f"{path}: {name}: {error}") from None
