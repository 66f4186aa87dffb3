"""Saved views of the open scene: each edit is a step of the undo history, and part of the scene file."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from texvol.scene.tour import SavedView, Tour
from texvol.util.errors import InputError
from texvol.window import motion
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.navigation import View

MOST = 99


def save(desk: Desk, document: Document, name: str = "") -> None:
    """Save the current view at the end of the list."""
    tour, camera = document.tour, document.view.camera
    if len(tour.views) >= MOST:
        desk.say(f"there can be {MOST} saved views; delete one first", fault=True)
        return
    seconds = {"seconds": tour.views[-1].seconds} if tour.views else {}

    def add() -> None:
        view = SavedView(name.strip() or unused_name(tour), camera, **seconds)
        document.change_tour(replace(tour, views=(*tour.views, view)))
        desk.moving.thumbnails.capture(desk.director, camera)
        desk.say(f"saved {view.name}")

    desk.attempt(add)


def unused_name(tour: Tour) -> str:
    """Return a name that no saved view has: "view 1", "view 2" and so on."""
    names = {each.name for each in tour.views}
    return next(name for name in (f"view {number}" for number in range(1, MOST + 2)) if name not in names)


def change(document: Document, number: int, stroke: str | None = None, **parts: Any) -> None:
    """Change parts of a view.

    Raises
    ------
    InputError
        If the parts make no valid view.
    """
    views = list(document.tour.views)
    views[number] = replace(views[number], **parts)
    document.change_tour(replace(document.tour, views=tuple(views)), stroke)


def update(desk: Desk, document: Document, number: int) -> None:
    """Replace the camera of a saved view by the current one."""
    camera = document.view.camera
    change(document, number, camera=camera)
    desk.moving.thumbnails.capture(desk.director, camera)


def delete(document: Document, number: int) -> None:
    """Delete a view."""
    views = document.tour.views
    document.change_tour(replace(document.tour, views=(*views[:number], *views[number + 1 :])))


def move(document: Document, number: int, to: int) -> None:
    """Move a view to another place in the list."""
    views = list(document.tour.views)
    views.insert(to, views.pop(number))
    document.change_tour(replace(document.tour, views=tuple(views)))


def go(desk: Desk, document: Document, number: int) -> None:
    """Go to a view by a short path."""
    motion.go(desk, document, View.of(document.tour.views[number].camera))


def number_of(tour: Tour, text: str) -> int:
    """Return the position of the view with a name, or a number from 1.

    Raises
    ------
    InputError
        If there is none.
    """
    for position, view in enumerate(tour.views):
        if text in (view.name, str(position + 1)):
            return position
    names = ", ".join(each.name for each in tour.views) or "there is none"
    raise InputError(f"saved view {text!r} not found: {names}")
