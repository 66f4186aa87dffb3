"""One viewer of a window: its messages become events, and the newest frame becomes a JPEG or, at rest, a PNG.

As many frames are under way as the link carries, see `texvol.window.remote.flow`; when another may be sent, it is the
newest one. So a slow link shows fewer frames, and no old ones. A PNG is sent in pieces, each of which counts as a
frame: one that moves waits for a few of them at most, and what is left of the PNG is not sent.

A packed frame is a line of JSON, and the picture; of a picture in pieces the line says how many are left, and the first
one its type. A message of the viewer is a JSON object with some of these keys:

    begin    true: it is new, and has no frame yet
    drawn    number of the frame that it has drawn
    size     [width, height, scale] of its page, in pixels
    events   list of events, as texvol.window.events writes them
    paste    text of its clipboard
"""

from __future__ import annotations

import io
import json
import math
import time
from functools import cache
from typing import Any

import numpy as np

from texvol.formats.pictures import quick_png
from texvol.util.errors import InputError
from texvol.window.events import Event, is_unicode
from texvol.window.remote.exchange import Exchange, Frame
from texvol.window.remote.flow import Flow

SETTLED = 0.15  # seconds without another frame, after which the last one is sent again as a PNG
_QUALITY = 85  # of a JPEG
_PIECE = 1 << 15  # bytes of a PNG, as long as many a JPEG
_KINDS = {"move", "button", "scroll", "key", "text", "focus"}  # others, such as files dropped, are none of a viewer's
_MOST_SIDE = 1e12  # of a size that is asked for; Exchange sets the limit of what is given
_MOST_AT_ONCE, _MOST_LETTERS, _MOST_PASTED = 256, 64, 1 << 16
_KEYS = {"begin", "drawn", "size", "events", "paste"}


class Viewer:
    """Messages of one viewer, and frames for it."""

    def __init__(self, exchange: Exchange) -> None:
        self._exchange = exchange
        self._gone = False
        self._number = 0  # of the frame sent last
        self._flow = Flow()
        self._version, self._is_sharp = -1, False
        self._sent = Frame()
        self._left: list[bytes] = []  # pieces of the PNG that is being sent
        self._held: dict[tuple[str, str], Event] = {}  # buttons and keys that are down

    def receive(self, text: str) -> None:
        """Take a message.

        Raises
        ------
        InputError
            If it is not valid.
        """
        message = _parsed(text)
        if "begin" in message:
            self._forget()
        if "drawn" in message:
            self._acknowledge(message["drawn"])
        if "size" in message:
            self._exchange.ask_size(self, _size(message["size"]))
        if "paste" in message:
            if not isinstance(message["paste"], str) or not is_unicode(message["paste"]):
                raise InputError("paste must be a text of Unicode")
            self._exchange.pasted = message["paste"][:_MOST_PASTED]
        if "events" in message:
            events: list[Event] = []
            for event in _events(message["events"]):
                if event.kind == "focus" and not event.down:
                    events += self._released()
                if event.kind in ("button", "key"):
                    self._held.pop((event.kind, event.name), None)
                    if event.down:
                        self._held[event.kind, event.name] = event
                events.append(event)
            if not self._exchange.put(events):
                raise InputError("too many events wait")

    def leave(self) -> None:
        """End `next`, and let go of the buttons and keys that are down."""
        self._exchange.put([*self._released(), Event("focus", down=False)])
        with self._exchange.changed:
            self._gone = True
            self._exchange.changed.notify_all()

    def _released(self) -> list[Event]:
        """Return events that let go of the buttons and keys that are down."""
        released = [Event(each.kind, name=each.name) for each in self._held.values()]
        self._held.clear()
        return released

    def _forget(self) -> None:
        """Send the newest frame again, as if none had been sent."""
        with self._exchange.changed:
            self._version, self._is_sharp, self._sent, self._flow, self._left = -1, False, Frame(), Flow(), []
            self._exchange.changed.notify_all()

    def next(self) -> bytes | None:
        """Wait for a frame that is to be sent, and return it packed; None if viewer or window have gone."""
        exchange = self._exchange
        with exchange.changed:
            while (left := self._due()) > 0:
                exchange.changed.wait(None if math.isinf(left) else left)
            if self._gone or exchange.ended:
                return None
            frame, self._number = exchange.frame, self._number + 1
            self._flow.send(self._number)
            same = frame.pixels is self._sent.pixels
            if exchange.version == self._version and self._left:
                content = self._left.pop(0)
                return _packed(_head(self._number, frame, frame) | {"left": len(self._left)}, content)
            is_sharp = exchange.version == self._version or (same and self._is_sharp)
            kind = "" if same and is_sharp == self._is_sharp else "png" if is_sharp else "jpeg"
            self._version, self._is_sharp = exchange.version, is_sharp
            head, self._sent = _head(self._number, frame, self._sent), frame
            self._left = self._left if same else []
        if not kind:
            return _packed(head)
        head["type"] = f"image/{kind}"
        if kind == "jpeg":
            return _packed(head, _jpeg(frame))
        content, *rest = _pieces(png(frame))
        with exchange.changed:
            self._left = rest
        return _packed(head | {"left": len(rest)}, content)

    def _due(self) -> float:
        """Return the seconds until a frame is to be sent; infinite if that depends on others."""
        exchange = self._exchange
        if self._gone or exchange.ended:
            return 0.0
        if not exchange.frame.pixels or not self._flow.is_open:
            return math.inf
        if exchange.version != self._version or self._left:
            return 0.0
        return math.inf if self._is_sharp else exchange.changed_at + SETTLED - time.monotonic()

    def _acknowledge(self, number: Any) -> None:
        if type(number) is not int or not 0 < number <= self._number:
            raise InputError(f"drawn must be the number of a frame, got {number!r}")
        with self._exchange.changed:
            self._flow.drawn(number)
            self._exchange.changed.notify_all()


def _parsed(text: str) -> dict[str, Any]:
    try:
        message = json.loads(text)
    except (ValueError, RecursionError):
        raise InputError("a message must be JSON") from None
    if not isinstance(message, dict) or not message.keys() <= _KEYS:
        raise InputError(f"a message must be an object with keys of {', '.join(sorted(_KEYS))}")
    return message


def _size(value: Any) -> tuple[int, int, float]:
    is_right = isinstance(value, list) and len(value) == 3 and all(type(each) in (int, float) for each in value)
    if not is_right or not all(abs(each) < _MOST_SIDE for each in value):
        raise InputError("size must be [width, height, scale]")
    return value[0], value[1], value[2]


def _events(value: Any) -> list[Event]:
    if not isinstance(value, list) or len(value) > _MOST_AT_ONCE or not all(isinstance(each, dict) for each in value):
        raise InputError(f"events must be a list of at most {_MOST_AT_ONCE} objects")
    events = [Event.from_json(each) for each in value]
    if any(each.kind not in _KINDS or len(each.name) > _MOST_LETTERS for each in events):
        raise InputError(f"events must be of kinds {', '.join(sorted(_KINDS))}")
    return events


def _head(number: int, frame: Frame, before: Frame) -> dict[str, Any]:
    head: dict[str, Any] = {
        "frame": number, "size": frame.size, "cursor": frame.cursor, "title": frame.title, "typing": frame.typing,
    }  # fmt: skip
    return head | ({"copied": frame.copied[1]} if frame.copied[0] != before.copied[0] else {})


def _packed(head: dict[str, Any], content: bytes = b"") -> bytes:
    """Return the message of a frame; without content if the viewer has the picture."""
    return json.dumps(head).encode() + b"\n" + content


def _pieces(content: bytes) -> list[bytes]:
    """Return pieces of about the same length: by how long each takes the link is measured."""
    length = math.ceil(len(content) / math.ceil(len(content) / _PIECE))
    return [content[start : start + length] for start in range(0, len(content), length)]


class Pieces:
    """Put together again what a viewer packs."""

    def __init__(self) -> None:
        self._type, self._taken = "", b""

    def take(self, packed: bytes) -> tuple[str, bytes] | None:
        """Take a message; return the type and the file of the picture that is complete with it, if one is."""
        line, _, content = packed.partition(b"\n")
        head = json.loads(line)
        if "type" in head:
            self._type, self._taken = head["type"], b""
        self._taken += content
        return (self._type, self._taken) if content and not head.get("left") else None


def _jpeg(frame: Frame) -> bytes:
    file = io.BytesIO()
    _image(frame).save(file, "JPEG", quality=_QUALITY)
    return file.getvalue()


def png(frame: Frame) -> bytes:
    """Return a frame as a PNG file."""
    width, height = frame.size
    pixels = np.frombuffer(frame.pixels, np.uint8).reshape(height, width, 3)[::-1]
    return quick_png.filled(_one_pixel(), {}, pixels)


@cache
def _one_pixel() -> bytes:
    file = io.BytesIO()
    _image(Frame(bytes(3), (1, 1))).save(file, "PNG")
    return file.getvalue()


def _image(frame: Frame) -> Any:
    from PIL import Image

    return Image.frombuffer("RGB", frame.size, frame.pixels, "raw", "RGB", 0, -1)
