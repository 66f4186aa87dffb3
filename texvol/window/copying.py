"""Copying of the window's picture on behalf of the user."""

from __future__ import annotations

from texvol.window.clipboard import program
from texvol.window.desk import Desk


def copy(desk: Desk) -> None:
    """Copy the picture of the window; a coarse one, of something that moves, only when it has become fine."""
    if desk.attempt(program):
        desk.clipboard.wanted = True
        desk.wake()


def update(desk: Desk) -> None:
    """Start copying if the picture is fine, and show what has come of it."""
    clipboard, shown = desk.clipboard, desk.director.shown
    while clipboard.outcome:
        text, is_fault = clipboard.outcome.pop(0)
        desk.say(text, fault=is_fault)
    if clipboard.wanted and shown is not None and shown.state != "moving":
        clipboard.start(shown.pixels, desk.director.at_rest, desk.wake)
