"""Animated moves of the camera: to another view, along a tour, or around; any other change of the view ends them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from texvol.scene import orbit
from texvol.scene.orbit import Turn
from texvol.scene.tour import Tour, between
from texvol.window.desk import Desk
from texvol.window.document import Document
from texvol.window.moving import Motion
from texvol.window.navigation import View

_SECONDS = 0.45  # of a move to another view: long enough to be followed, short enough not to be waited for
_SECONDS_OF_TURN = 8.0  # of one turn of a preview


def step(desk: Desk) -> None:
    """Move the camera to where it is to be in this frame."""
    motion, document = desk.moving.motion, desk.document
    if motion is None:
        return
    if motion.document is not document or (motion.last is not None and document.view.camera != motion.last):
        desk.moving.motion = None
        return
    if motion.start is None:
        motion.start = desk.now
    passed = desk.now - motion.start
    if passed >= motion.seconds and not motion.repeats:
        desk.moving.motion = None
        desk.attempt(lambda: document.look(motion.at(motion.seconds)))
        motion.end()
        return
    if desk.attempt(lambda: document.look(motion.at(passed % motion.seconds))):
        motion.last = document.view.camera
    else:
        desk.moving.motion = None


def stop(desk: Desk) -> None:
    """End the move where it is."""
    desk.moving.motion = None


def go(desk: Desk, document: Document, view: View, end: Callable[[], Any] = lambda: None) -> None:
    """Move to a view by a short, eased path."""
    path = between(document.view.camera, view.camera)

    def at(seconds: float) -> View:
        return view if seconds >= _SECONDS else View(path.at(seconds / _SECONDS), view.pivot)

    desk.moving.motion = Motion(document, at, _SECONDS, end)


def preview(desk: Desk, document: Document, course: Turn | Tour) -> None:
    """Show a turn, or the path through the saved views, in the window; the view before it returns at the end.

    Raises
    ------
    InputError
        If there is no such path.
    """
    before = document.view
    if isinstance(course, Tour):
        course.cameras(1)
        at, seconds, repeats = (lambda passed: View.of(course.at(passed))), course.seconds, course.closed
    else:
        camera, turns = before.camera, course.turns
        about = course.direction(camera, document.scene.volume)
        seconds, repeats = _SECONDS_OF_TURN * abs(turns), False

        def at(passed: float) -> View:
            return View(orbit.turned(camera, 360 * turns * passed / seconds, about), before.pivot)

    desk.moving.motion = Motion(document, at, seconds, lambda: document.look(before), "preview", repeats)
