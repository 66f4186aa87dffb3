"""Copying of the picture to the clipboard, as a PNG, by a program of the desktop.

GLFW knows texts only. The program stays in the background and answers whoever pastes.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from texvol.formats.pictures import image
from texvol.util.color import linear_from_srgb
from texvol.util.errors import InputError, TexvolError

_WAYLAND = ("wl-copy", "--type", "image/png")
_X11 = ("xclip", "-selection", "clipboard", "-t", "image/png", "-i")
Finish = Callable[[NDArray], NDArray]
_PATIENCE = 10.0  # seconds until the program has taken the picture


@dataclass
class Clipboard:
    """Picture that is on its way to the clipboard.

    Attributes
    ----------
    wanted : bool
        True while the picture of the window is to be copied as soon as it is no longer coarse.
    outcome : list of (str, bool)
        Messages to be shown, each with True if it is of a fault; written by a thread.
    """

    wanted: bool = False
    outcome: list[tuple[str, bool]] = field(default_factory=list)

    def start(self, pixels: NDArray[np.uint8], is_final: bool, wake: Callable[[], None], finish: Finish) -> None:
        """Copy pixels on a thread, which calls `wake` at the end; `finish` draws more into the picture."""
        self.wanted = False

        def work() -> None:
            self.outcome.append(_copied(pixels, is_final, finish))
            wake()

        threading.Thread(target=work, daemon=True, name="texvol clipboard").start()


def program() -> tuple[str, ...]:
    """Return the command that takes a PNG to the clipboard.

    Raises
    ------
    InputError
        If no such program is installed.
    """
    wayland = bool(os.environ.get("WAYLAND_DISPLAY"))
    for command, fits in ((_WAYLAND, wayland), (_X11, bool(os.environ.get("DISPLAY")))):
        if fits and shutil.which(command[0]):
            return command
    wanted = "wl-copy (package wl-clipboard)" if wayland else "xclip (package xclip)"
    raise InputError(f"copying a picture needs the program {wanted}: install it, or save the picture (p)")


def _copied(pixels: NDArray[np.uint8], is_final: bool, finish: Finish) -> tuple[str, bool]:
    """Copy pixels; return a message, and True if it is of a fault."""
    try:
        give(encoded(pixels, finish), program())
    except (TexvolError, OSError, subprocess.SubprocessError) as error:
        return f"the picture was not copied: {' '.join(str(error).split())}", True
    height, width = pixels.shape[:2]
    return f"copied the picture, {width} x {height} pixels{'' if is_final else '; it was not final yet'}", False


def encoded(pixels: NDArray[np.uint8], finish: Finish) -> bytes:
    """Return a PNG of sRGB pixels, shape (height, width, 3), after `finish` has drawn into the linear picture."""
    linear = linear_from_srgb(pixels[..., :3] / np.float32(255)).astype(np.float32)
    opaque = np.concatenate([linear, np.ones_like(linear[..., :1])], axis=2)
    return image.encoded("clipboard.png", finish(opaque))


def give(content: bytes, command: tuple[str, ...]) -> None:
    """Hand a PNG to the program, which goes on in the background.

    Raises
    ------
    InputError
        If the program fails.
    """
    # Its output is not read: the program keeps it open as long as it holds the clipboard.
    done = subprocess.run(
        command, input=content, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=_PATIENCE,
        check=False, start_new_session=True,
    )  # fmt: skip
    if done.returncode:
        raise InputError(f"{command[0]} ended with status {done.returncode}")
