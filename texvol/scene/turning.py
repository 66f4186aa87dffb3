"""Scenes seen from all around, for films and loops over pictures."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from texvol.scene import orbit
from texvol.scene.framing import framed
from texvol.scene.scene import Scene
from texvol.util.errors import check_type
from texvol.util.numbers import checked_count


def views_around(scene: Scene, count: int, size: tuple[int, int]) -> Iterator[Scene]:
    """Return an iterator over a scene's views from `count` sides, evenly once around; the first is its own.

    A scene without a camera is framed so that what shows stays in pictures of `size` (width, height) from all sides.

    Raises
    ------
    InputError
        If the count is not a whole number of at least 1.
    """
    check_type("scene", scene, Scene)
    number = checked_count("count of views", count)
    seen = scene.looked
    camera = scene.camera or framed(seen, aspect=size[0] / size[1], turning=True)
    return (replace(seen, camera=orbit.turned(camera, 360 * view / number)) for view in range(number))
