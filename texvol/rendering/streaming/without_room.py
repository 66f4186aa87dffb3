"""Several volumes in memory whose textures have no room on the device together: drawn part by part instead."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from texvol.rendering.streaming.kinds import all_in_parts, large_volumes, needs_memory
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume
from texvol.util.errors import NoRoomError

_How = ParamSpec("_How")
_Drawn = TypeVar("_Drawn")


class _DrawsScenes(Protocol):
    without_room: tuple[Volume, ...]  # volumes that had no room together when they were drawn last

    def forget_volumes_in_memory(self) -> None:
        """Release the textures of volumes in memory, and what they were made from."""


_Drawing = TypeVar("_Drawing", bound=_DrawsScenes)
_Render = Callable[Concatenate[_Drawing, Scene, _How], _Drawn]


def in_parts_without_room(render: _Render[_Drawing, _How, _Drawn]) -> _Render[_Drawing, _How, _Drawn]:
    """Return a method that draws a scene, and draws several volumes part by part if they have no room together.

    They are drawn so at once when they are drawn again.
    """

    @wraps(render)
    def drawn(self: _Drawing, scene: Scene, *args: _How.args, **how: _How.kwargs) -> _Drawn:
        known = self.without_room
        if known and isinstance(scene, Scene) and _are_same(known, scene.volumes) and needs_memory(scene) is None:
            return render(self, all_in_parts(scene), *args, **how)
        try:
            return render(self, scene, *args, **how)
        except NoRoomError as error:
            if not scene.added or large_volumes(scene):
                raise
            if (reason := needs_memory(scene)) is not None:
                raise NoRoomError(f"{error} ({reason} cannot be drawn part by part)") from None
        self.without_room = scene.volumes
        self.forget_volumes_in_memory()
        return render(self, all_in_parts(scene), *args, **how)

    return drawn


def _are_same(some: tuple[Volume, ...], others: tuple[Volume, ...]) -> bool:
    return len(some) == len(others) and all(a is b for a, b in zip(some, others, strict=True))
