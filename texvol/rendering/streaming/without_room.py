"""Several volumes whose textures have no room on the device together: drawn part by part instead."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from texvol.opengl.contexts import Context
from texvol.rendering.any_pictures import AnyPictures
from texvol.rendering.streaming.kinds import fits, needs_memory
from texvol.scene.in_chunks import in_parts
from texvol.scene.scene import Scene
from texvol.util.errors import NoRoomError

_How = ParamSpec("_How")
_Drawn = TypeVar("_Drawn")


class _DrawsScenes(Protocol):
    @property
    def _context(self) -> Context: ...

    @property
    def _pictures(self) -> AnyPictures: ...


_Drawing = TypeVar("_Drawing", bound=_DrawsScenes)
_Render = Callable[Concatenate[_Drawing, Scene, _How], _Drawn]


def in_parts_without_room(render: _Render[_Drawing, _How, _Drawn]) -> _Render[_Drawing, _How, _Drawn]:
    """Return a method that draws a scene, and draws several volumes part by part if they have no room together."""

    @wraps(render)
    def drawn(self: _Drawing, scene: Scene, *args: _How.args, **how: _How.kwargs) -> _Drawn:
        if not (isinstance(scene, Scene) and scene.added and fits(scene)):
            return render(self, scene, *args, **how)
        lack = self._pictures.lack_of_room(scene)
        if not lack:
            try:
                return render(self, scene, *args, **how)
            except NoRoomError as error:
                lack = str(error)
        if (reason := needs_memory(scene)) is not None:
            raise NoRoomError(f"{lack} ({reason} cannot be drawn part by part)")
        with self._context:
            self._pictures.without_room(scene, lack)
        return render(self, _in_parts(scene), *args, **how)

    return drawn


def in_parts_if_without_room(pictures: AnyPictures, scene: Scene) -> Scene:
    """Return the scene, with volumes to be drawn part by part if they can be and are known to have no room together."""
    may_be = bool(scene.added) and fits(scene) and needs_memory(scene) is None
    return _in_parts(scene) if may_be and pictures.lack_of_room(scene) else scene


def _in_parts(scene: Scene) -> Scene:
    added = tuple(replace(each, volume=in_parts(each.volume)) for each in scene.added)
    return replace(scene, volume=in_parts(scene.volume), added=added)
