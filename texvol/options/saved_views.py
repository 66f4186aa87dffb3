"""Saved views of a scene file, and the path of the camera through them; the command line has no words for them.

[[saved-view]]
name = "from the front"
projection = "perspective"
eye = [300, -200, 120]
target = [0, 0, 0]
up = [0, 0, 1]
fov = 40
seconds = 2.0               # from this view to the next

[tour]
closed = true               # from the last view to the first
stops = false               # pass through the views instead of stopping at each
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import Any

from texvol.options import texts
from texvol.scene.camera import Camera
from texvol.scene.tour import SavedView, Tour
from texvol.util.suggestions import did_you_mean

SAVED_VIEW, TOUR = "saved-view", "tour"
_VIEW_KEYS = ("name", "projection", "eye", "target", "up", "fov", "height", "seconds")
_TOUR_KEYS = ("closed", "stops")


def from_file(key: str, value: Any) -> Any:
    """Return the value of a key of scene files: the saved views, or the switches of the tour.

    Raises
    ------
    ArgumentTypeError, InputError
        If the value is wrong.
    """
    if key == SAVED_VIEW:
        if not isinstance(value, list) or not all(isinstance(each, Mapping) for each in value):
            raise argparse.ArgumentTypeError(f"must be tables [[{SAVED_VIEW}]], got {value!r}")
        return tuple(_view(table, number) for number, table in enumerate(value, start=1))
    if not isinstance(value, Mapping):
        raise argparse.ArgumentTypeError(f"must be a table [{TOUR}], got {value!r}")
    _check_keys(value, _TOUR_KEYS)
    for name, switch in value.items():
        if not isinstance(switch, bool):
            raise argparse.ArgumentTypeError(f"{name} must be true or false, got {switch!r}")
    return dict(value)


def tour_of(chosen: Mapping[str, Any]) -> Tour:
    """Return the tour of a scene file, without views if it has none."""
    return Tour(chosen.get(SAVED_VIEW, ()), **chosen.get(TOUR, {}))


def tables_of(tour: Tour) -> dict[str, Any]:
    """Return the content of the keys of scene files that describe a tour; none for a tour without views."""
    if not tour.views:
        return {}
    return {SAVED_VIEW: [_table(each) for each in tour.views], TOUR: {"closed": tour.closed, "stops": tour.stops}}


def _table(view: SavedView) -> dict[str, Any]:
    camera = view.camera
    extent = "fov" if camera.projection == "perspective" else "height"
    placed = {name: getattr(camera, name) for name in ("projection", "eye", "target", "up", extent)}
    return {"name": view.name} | placed | {"seconds": float(view.seconds)}


def _view(table: Mapping[str, Any], number: int) -> SavedView:
    """Return the saved view of a table."""
    _check_keys(table, _VIEW_KEYS, f"view {number}: ")
    name, projection = table.get("name", f"view {number}"), table.get("projection", "orthographic")
    extent = "fov" if projection == "perspective" else "height"
    wanted = ("eye", "target", "up") if extent == "fov" else ("eye", "target", "up", "height")
    if missing := [each for each in wanted if each not in table]:
        raise argparse.ArgumentTypeError(f"view {number} ({name}): {', '.join(missing)} must be given")
    eye, target, up = (texts.triple(texts.as_text(table[each])) for each in ("eye", "target", "up"))
    other: dict[str, Any] = {extent: texts.number(texts.as_text(table[extent]))} if extent in table else {}
    camera = Camera(projection, eye, target, up, **other)
    seconds = {"seconds": table["seconds"]} if "seconds" in table else {}
    return SavedView(name, camera, **seconds)


def _check_keys(table: Mapping[str, Any], known: tuple[str, ...], where: str = "") -> None:
    for key in table:
        if key not in known:
            near = did_you_mean(key, known)
            raise argparse.ArgumentTypeError(f"{where}unknown key {key!r}; keys are {', '.join(known)}{near}")
