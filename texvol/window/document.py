"""Open document: a scene, its view, its files, and its undo history.

A Scene is immutable: a change replaces it by another Scene. Changes of one *stroke*, such as a drag of a slider, are
one step of the history. The view is not part of the history: undoing a change of colour does not turn the picture.
"""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any, NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from texvol.annotation import Annotation, check, with_room
from texvol.options.first_choice import opened_with
from texvol.options.scene_options import SceneOptions
from texvol.scene.added_volume import AddedVolume
from texvol.scene.camera import Camera
from texvol.scene.content import forget_content
from texvol.scene.measures.measure import Measure
from texvol.scene.scene import Scene
from texvol.scene.tour import Tour
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.window.histogram import Histogram, histogram_of
from texvol.window.jobs import Showing
from texvol.window.navigation import View, has_time, on_content
from texvol.window.own_files import OwnFiles, marks_of_scene
from texvol.window.stand_in import in_memory, stand_in, with_stand_ins
from texvol.window.stepped import Stepper
from texvol.window.switched import NOTHING_OFF, Off

_QUICK = 1 << 21  # samples of scenes that are framed at once; of more it takes longer than a frame
_LONGEST = 200  # steps of the history: scenes share the arrays that they have in common


@dataclass(frozen=True)
class Origin:
    """Files that were opened."""

    volume: str
    scene_file: str | None = None
    transfer_function: str | None = None  # name as it was given


class Home(NamedTuple):
    """View that the program chose: a camera that frames the box alone, and one that leaves room for annotation."""

    plain: Camera
    roomy: Camera

    @classmethod
    def of(cls, plain: Camera, scene: Scene, size: tuple[int, int], annotation: Annotation) -> Home:
        """Return the home view of a scene in a picture of `size` pixels."""
        return cls(plain, with_room(plain, scene, size, annotation) if annotation else plain)


class Saved(NamedTuple):
    """Scene as it was last written to a scene file."""

    path: str
    scene: Scene
    showing: Showing
    size: tuple[int, int]
    hidden: tuple[tuple[int, AddedVolume], ...] = ()


class State(NamedTuple):
    """Scene, what is switched off in it, its measures, and its saved views."""

    scene: Scene
    off: Off = Off()
    measures: tuple[Measure, ...] = ()
    tour: Tour = Tour()


class History:
    """Undo history: `past` states, the current one, and undone ones, the `future`."""

    def __init__(self, state: State) -> None:
        self.past: list[State] = []
        self.future: list[State] = []
        self.now = state
        self._stroke: str | None = None

    def change(self, state: State, stroke: str | None = None) -> None:
        """Add a state; a change of the same stroke as the last change belongs to the same step."""
        if stroke is None or stroke != self._stroke:
            self.past = [*self.past[-_LONGEST:], self.now]
        self._stroke, self.now, self.future = stroke, state, []

    def end_stroke(self) -> None:
        """End the stroke: the next change is a new step."""
        self._stroke = None

    def resume(self, stroke: str) -> None:
        """Go on with a stroke that has ended: the next change of that name belongs to the last step."""
        self._stroke = stroke if self.past and not self.future else None

    def end(self) -> None:
        """Forget undone states: something other than a change of the scene has followed."""
        self.end_stroke()
        self.future = []

    def undo(self) -> State:
        """Go one step back, if there is one; return the state there."""
        return self._step(self.past, self.future)

    def redo(self) -> State:
        """Go one step forward, if there is one; return the state there."""
        return self._step(self.future, self.past)

    def _step(self, source: list[State], target: list[State]) -> State:
        if source:
            target.append(self.now)
            self.now, self._stroke = source.pop(), None
        return self.now


class Document:
    """Open scene with its view and history.

    Parameters
    ----------
    scene : Scene
        Scene with a camera.
    size : (width, height), optional
        Size of the picture in pixels.

    Attributes
    ----------
    scene : Scene
        Scene with the camera of the view; the same object until something changes.
    view : View
    history : History
    unframed : bool
        True if the box of the scene or the size of the picture has changed, and the home view is still that of before.
    """

    def __init__(
        self, scene: Scene, origin: Origin, showing: Showing | None = None, size: tuple[int, int] | None = None,
        off: Off = NOTHING_OFF,
    ) -> None:  # fmt: skip
        assert scene.camera is not None
        self.origin, self.showing = origin, showing or Showing()
        self.saved: Saved | None = None  # what the file of the scene has
        self.written: Saved | None = None  # what the last scene file has, which may be that of a copied command line
        self.kept_tour = Tour()  # the saved views of the scene file
        self.home: Home | None = None
        self.unframed = False
        self._size = size
        self.view = View.of(scene.camera)
        self.history = History(State(scene, off, self.measures))
        self.own = OwnFiles()  # those in which the scene was read or saved
        self.scene = scene
        self._opened = scene, self.showing, off.volumes
        self._histograms: WeakKeyDictionary[Volume, Histogram] = WeakKeyDictionary()
        for volume in (*scene.volumes, *(each.volume for _, each in off.volumes)):
            self.histogram(volume)

    def histogram(self, volume: Volume) -> Histogram:
        """Return the histogram of a volume, computed at the first call; a thread that reads a volume calls it early."""
        if volume not in self._histograms:
            self._histograms[volume] = histogram_of(volume)
        return self._histograms[volume]

    def adopt(self, new: Volume, old: Volume) -> None:
        """Give a volume of like values the histogram of another one: its own would take longer than a frame."""
        if old in self._histograms:
            self._histograms.setdefault(new, self._histograms[old])

    @property
    def opened(self) -> Scene:
        """Scene as it was opened."""
        return self._opened[0]

    @property
    def unsaved(self) -> bool:
        """True if anything but the view has changed since the scene was opened or saved."""
        saved = self.saved
        scene, showing, hidden = self._opened if saved is None else (saved.scene, saved.showing, saved.hidden)
        names = [part.name for part in fields(Scene) if part.name != "camera"]
        same = showing == self.showing and hidden == self.off.volumes and self.kept_tour == self.tour
        return not same or any(getattr(scene, name) != getattr(self.scene, name) for name in names)

    @property
    def name(self) -> str:
        """Name of the scene file, or of the volume."""
        return os.path.basename(os.path.normpath(self.origin.scene_file or self.origin.volume))

    @property
    def off(self) -> Off:
        """Parts that are switched off."""
        return self.history.now.off

    @property
    def measures(self) -> tuple[Measure, ...]:
        """Measures, a part of the annotation that undo covers."""
        return self.showing.annotation.measures

    @property
    def drawn(self) -> Showing:
        """Presentation that the painting processes draw: the window draws measures over the picture itself."""
        if not self.measures:
            return self.showing
        return replace(self.showing, annotation=replace(self.showing.annotation, measures=()))

    @property
    def tour(self) -> Tour:
        """Saved views, and the path through them."""
        return self.history.now.tour

    @property
    def scenes(self) -> list[Scene]:
        """Scenes of the history."""
        history = self.history
        return [state.scene for state in (*history.past, history.now, *history.future)]

    @property
    def at_home(self) -> bool:
        """True if the user has not changed the view since `go_home`."""
        return self.home is not None and self.home.roomy == self.view.camera

    def look(self, view: View) -> None:
        """Change the view."""
        if view.camera != self.view.camera:
            self.scene = replace(self.scene, camera=view.camera)
        self.view = view

    def go_home(self, home: Home) -> None:
        """Set a view that leaves room for the annotation; the document remembers it until the user changes the view."""
        self.look(replace(self.view, camera=home.roomy))
        self.home = home

    def annotate(self, annotation: Annotation, size: tuple[int, int]) -> None:
        """Change the annotation of a picture of `size` pixels; an unchanged home view is framed anew for it.

        Raises
        ------
        InputError, MissingExtraError
            If the annotation can't be drawn; the previous annotation stays.
        """
        check(annotation, self.scene)
        if self.home is not None and self.at_home:
            self.go_home(Home.of(self.home.plain, self.scene, size, annotation))
        self.show(annotation=annotation)

    def fit(self, size: tuple[int, int]) -> None:
        """Set the size of the picture in pixels; an unchanged home view is framed anew for it, or soon if it is large.

        See `texvol.window.reframing` for the latter.
        """
        if size != self._size:
            self._size = size
            self._reframe()

    def _reframe(self) -> None:
        """Frame an unchanged home view anew."""
        if not self.at_home or self._size is None:
            return
        if sum(volume.size for volume in self.scene.volumes) > _QUICK:
            self.unframed = True
        else:
            self.frame_home(self._size)

    def frame_home(self, size: tuple[int, int]) -> None:
        """Frame the home view anew for a picture of `size` pixels, now."""
        assert self.home is not None
        self.take_home(on_content(View(self.home.plain, self.view.pivot), self.scene, size[0] / size[1]), size)

    def take_home(self, view: View, size: tuple[int, int]) -> None:
        """Look at the scene in a home view that frames it in a picture of `size` pixels."""
        self.look(view)
        self.go_home(Home.of(view.camera, self.scene, size, self.showing.annotation))

    def change(
        self, stroke: str | None = None, off: Off | None = None, measures: tuple[Measure, ...] | None = None,
        **parts: Any,
    ) -> None:  # fmt: skip
        """Change parts of the scene, by name, what is switched off, and the measures.

        Raises
        ------
        InputError
            If the parts make no valid scene; the previous scene stays.
        """
        scene, now = replace(self.scene, **parts) if parts else self.scene, self.history.now
        state = now._replace(
            scene=scene,
            off=now.off if off is None else off,
            measures=now.measures if measures is None else measures,
        )
        self.history.change(state, stroke)
        self._become(scene)

    def change_tour(self, tour: Tour, stroke: str | None = None) -> None:
        """Change the saved views; views that are the same have no effect."""
        if tour != self.tour:
            self.history.change(self.history.now._replace(scene=self.scene, tour=tour), stroke)

    def at_step(self, found: Mapping[Volume, Volume]) -> None:
        """Replace volumes by those of another time step, everywhere: no step of the history, and no unsaved change."""
        history, of = self.history, Stepper(found).scene
        for states in (history.past, history.future):
            states[:] = [each._replace(scene=of(each.scene)) for each in states]
        history.now = history.now._replace(scene=of(history.now.scene))
        self._opened = (of(self._opened[0]), *self._opened[1:])
        if self.saved is not None:
            self.saved = self.saved._replace(scene=of(self.saved.scene))
        for old, new in found.items():
            self.adopt(new, old)
        self.scene = of(self.scene)

    def show(self, **parts: Any) -> None:
        """Change parts of the presentation."""
        self.showing = replace(self.showing, **parts)

    def undo(self) -> None:
        """Undo one step, if there is one."""
        self._become(replace(self.history.undo().scene, camera=self.view.camera))

    def redo(self) -> None:
        """Redo one step, if there is one."""
        self._become(replace(self.history.redo().scene, camera=self.view.camera))

    def rest(self) -> None:
        """Free what can be computed again: another document is shown."""
        forget_content(self.scene.volumes)

    def _become(self, scene: Scene) -> None:
        """Replace the scene, and frame it anew if its box has changed."""
        before, self.scene = self.scene, scene
        if self.history.now.measures != self.measures:
            self.show(annotation=replace(self.showing.annotation, measures=self.history.now.measures))
        forget_content(each for each in before.volumes if each not in scene.volumes)  # the history holds many
        if self._size and before.volumes != scene.volumes:
            one, other = (box.corners_from_centre + box.centre for box in (before.box, scene.box))
            if not np.array_equal(one, other):
                self._reframe()


def opened(arguments: argparse.Namespace, size: tuple[int, int]) -> Document:
    """Return the document of options from the command line and the scene file; the volume is read.

    A file of several time steps is opened at the first one, and vectors are shown by their length.

    Raises
    ------
    InputError
        In all other cases in which `texvol render` raises it.
    """
    return opened_with(lambda told: _opened(told, size), arguments)


def _opened(arguments: argparse.Namespace, size: tuple[int, int]) -> Document:
    marks = marks_of_scene(arguments.scene)  # before the file is read: what changes meanwhile is of others
    options = SceneOptions(arguments)
    if options.has_depth_in:
        raise InputError("--depth-in is of a single view: leave it out of a window")
    options.size = size
    first = stand_in(options.load())
    scene = with_stand_ins(options.scene(first, in_8_bits=True))
    off = Off(volumes=tuple((position, in_memory(each)) for position, each in options.hidden(first)))
    check(options.annotation, scene)
    showing = Showing(options.window, options.transparent, options.annotation)
    origin = Origin(options.volume, arguments.scene, options.transfer_function)
    document = Document(scene, origin, showing, size, off)
    document.own.learn(marks)
    document.kept_tour = options.tour
    document.history.now = document.history.now._replace(tour=options.tour)
    if not options.chose_view:
        document.go_home(Home.of(document.view.camera, scene, size, options.annotation))
        if has_time(scene):
            document.frame_home(size)
    return document


def opened_file(path: str, size: tuple[int, int], how: Mapping[str, Any] | None = None) -> Document:
    """Return the document of a scene file, or of a volume with options that say how to read it."""
    if path.lower().endswith(".json"):
        raise InputError(f"{path}: a transfer function needs an open scene; open a volume first")
    is_scene = path.lower().endswith(".toml")
    named = {"volume": None, "scene": path} if is_scene else {"volume": path, "scene": None, **(how or {})}
    return opened(argparse.Namespace(**named), size)
