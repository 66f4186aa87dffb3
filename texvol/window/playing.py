"""Commands of time: going to a step, playing; and what follows from another step being shown."""

from __future__ import annotations

from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.window.desk import Desk


def follow(desk: Desk) -> None:
    """Show the wanted time step once it has been read; panels keep their state for the volumes of the new step."""
    times = desk.times
    found = times.update(desk.document, desk.director, desk.now, desk.wake)
    for name, each in desk.panel_state.items():
        if isinstance(each, Volume) and each in found:
            desk.panel_state[name] = found[each]
        elif (held := getattr(each, "volume", None)) in found:
            each.volume = found[held]
    layout = desk.layout
    if layout.volume in found:  # slices stay where they are, with their window of values
        layout.volume = found[layout.volume]
    for fault in times.faults:
        desk.say(fault, fault=True)
    times.faults.clear()


def play(desk: Desk) -> None:
    """Play the time steps, or pause."""
    times = desk.times
    if not times.has_steps:
        _say_none(desk)
        return
    times.playing = not times.playing
    times.shown.clear()


def _say_none(desk: Desk) -> None:
    counting = desk.times.pending
    desk.say("the time steps are still being counted" if counting else "there is one time step only")


def go(desk: Desk, words: str) -> None:
    """Go to a time step, or say why not."""
    desk.attempt(lambda: step(desk, words))


def step(desk: Desk, words: str) -> None:
    """Pause, and go to a time step: a number from 0, "+1" or "-1" from the one that is wanted, "first" or "last".

    Raises
    ------
    InputError
        If there is no such step.
    """
    times = desk.times
    if not times.has_steps:
        _say_none(desk)
        return
    times.playing = False
    named = {"first": 0, "last": times.count - 1}
    try:
        number = named[words] if words in named else int(words)
    except ValueError:
        raise InputError(f"step must be a number, +N, -N, first or last, got {words!r}") from None
    if words.startswith(("+", "-")):
        times.go(times.wanted + number)
    elif not 0 <= number < times.count:
        raise InputError(f"step must be from 0 to {times.count - 1}, got {number}")
    else:
        times.go(number)
