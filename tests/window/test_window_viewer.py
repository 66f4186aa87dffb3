"""A viewer of a window in a browser: the newest frame only, whatever it sends, and the buttons that it leaves down."""

from __future__ import annotations

import json
import math
import threading
from typing import Any

import numpy as np
import pytest
from PIL import Image
from support.windows import PATIENCE

from texvol.scene.demo import demo_scene
from texvol.util.errors import InputError
from texvol.window.events import Event
from texvol.window.navigation import View
from texvol.window.remote.exchange import MOST_EVENTS, MOST_PIXELS, Exchange
from texvol.window.remote.viewer import Pieces, Viewer
from texvol.window.steering import Steering, Viewport


def frame(gray: int, size: tuple[int, int] = (3, 2)) -> dict[str, Any]:
    return {"pixels": bytes([gray]) * (3 * size[0] * size[1]), "size": size}


def head(content: bytes | None) -> dict[str, Any]:
    assert content is not None
    return dict(json.loads(content.partition(b"\n")[0]))


def test_a_slow_viewer_gets_the_newest_frame_only_and_a_png_at_rest() -> None:
    exchange = Exchange()
    viewer = Viewer(exchange)
    exchange.show(**frame(10))
    first = head(viewer.next())
    assert (first["frame"], first["type"]) == (1, "image/jpeg")
    for gray in (20, 30, 40):
        exchange.show(**frame(gray))
    waiting = threading.Thread(target=lambda: seen.append(viewer.next()))
    seen: list[bytes | None] = []
    waiting.start()
    waiting.join(0.3)
    assert not seen, "the first frame has not been drawn yet"
    viewer.receive('{"drawn": 1}')
    waiting.join(PATIENCE)
    assert head(seen[0])["type"] == "image/jpeg"
    viewer.receive('{"drawn": 2}')
    last = viewer.next()
    assert last is not None
    assert head(last)["type"] == "image/png"
    content = last.partition(b"\n")[2]
    with open_png(content) as picture:
        assert np.asarray(picture).tolist() == np.full((2, 3, 3), 40).tolist()


def test_a_frame_follows_before_the_last_is_drawn_where_the_link_has_room() -> None:
    exchange = Exchange()
    viewer = Viewer(exchange)
    for number in range(1, 7):
        exchange.show(**frame(10 * number))
        assert head(viewer.next())["frame"] == number
        viewer.receive(json.dumps({"drawn": number}))
    for number in (7, 8):
        exchange.show(**frame(10 * number))
        assert head(viewer.next())["frame"] == number


def test_a_frame_that_moves_waits_for_no_more_than_a_piece_of_the_png() -> None:
    exchange = Exchange()
    viewer = Viewer(exchange)
    size = 300, 200
    noise = np.random.default_rng(1).integers(0, 256, (size[1], size[0], 3), np.uint8)
    exchange.show(pixels=noise.tobytes(), size=size)
    pieces, numbers = Pieces(), iter(range(1, 100))

    def sent() -> bytes:
        content = viewer.next()
        assert content is not None
        viewer.receive(json.dumps({"drawn": next(numbers)}))
        return content

    assert head(sent())["type"] == "image/jpeg"
    contents = [sent() for _ in range(3)]
    assert head(contents[0])["type"] == "image/png" and all("type" not in head(each) for each in contents[1:])
    left = [head(each)["left"] for each in contents]
    assert left == list(range(left[0], left[0] - 3, -1)) and left[-1] > 0
    assert max(map(len, contents)) < 40_000
    exchange.show(cursor="hand")
    assert head(sent()).items() >= {"cursor": "hand"}.items(), "the picture is the same, and goes on"
    exchange.show(**frame(7, size))
    assert head(sent())["type"] == "image/jpeg"
    exchange.show(pixels=noise.tobytes(), size=size)
    whole: tuple[str, bytes] | None = None
    while whole is None or whole[0] != "image/png":
        whole = pieces.take(sent())
    with open_png(whole[1]) as picture:
        assert np.array_equal(np.asarray(picture)[::-1], noise)
    assert exchange.version == viewer._version and viewer._due() == math.inf


def open_png(content: bytes) -> Image.Image:
    import io

    return Image.open(io.BytesIO(content))


def test_a_frame_that_changes_nothing_is_not_sent_and_a_cursor_needs_no_picture() -> None:
    exchange = Exchange()
    viewer = Viewer(exchange)
    exchange.show(**frame(10))
    viewer.next()
    viewer.receive('{"drawn": 1}')
    assert head(viewer.next())["type"] == "image/png"
    before = exchange.version
    exchange.show(**frame(10))
    assert exchange.version == before
    exchange.show(cursor="hand")
    viewer.receive('{"drawn": 2}')
    assert "type" not in head(viewer.next())


@pytest.mark.parametrize(
    "message",
    [
        "", "{", "7", "[]", "[" * 100_000, '{"else": 1}', '{"drawn": 1}', '{"drawn": "1"}', '{"size": [1, 2]}',
        '{"size": [1, NaN, 1]}', '{"size": [' + "9" * 4000 + ', 1, 1]}', '{"size": [true, 1, 1]}', '{"drawn": true}',
        '{"paste": "\\ud800"}', '{"events": [{"kind": "text", "name": "a\\udfff"}]}',
        '{"events": [{"kind": "move", "x": ' + "9" * 4000 + "}]}",
        '{"size": [1e999, 1, 1]}', '{"paste": 3}', '{"events": {}}', '{"events": [3]}',
        '{"events": [{"kind": "drop", "names": ["/etc/passwd"]}]}', '{"events": [{"kind": "close"}]}',
        '{"events": [{"kind": "resize", "x": 1e5, "y": 1e5}]}', '{"events": [{"kind": "move", "x": NaN}]}',
        '{"events": [{"kind": "key", "name": "no such key"}]}', '{"events": [{"kind": "move", "__class__": 1}]}',
        '{"events": [{"kind": "text", "name": "' + "x" * 1000 + '"}]}',
        '{"events": [' + ",".join(['{"kind": "focus"}'] * 300) + "]}",
    ],
)  # fmt: skip
def test_a_message_that_is_not_valid_is_refused_and_changes_nothing(message: str) -> None:
    exchange = Exchange()
    viewer = Viewer(exchange)
    with exchange.viewed(viewer), pytest.raises(InputError):
        viewer.receive(message)
    assert exchange.wait(0) == []
    assert exchange.wanted is None


@pytest.mark.parametrize("modifiers", [[], ["ctrl"], ["shift"]])
def test_a_wheel_that_turns_a_million_times_ends_no_window(modifiers: list[str]) -> None:
    exchange = Exchange()
    Viewer(exchange).receive(
        json.dumps({"events": [{"kind": "scroll", "y": y, "modifiers": modifiers} for y in (-9e5, 9e5) * 20]})
    )
    steering, view, viewport = Steering(), View.of(demo_scene().completed((64, 64)).camera), Viewport(0, 0, 64, 64)
    for event in [Event("move", 32, 32), *exchange.wait(0)]:
        view = steering.handle([event], view, demo_scene().box, viewport, 0.0).view
    assert np.isfinite(view.camera.eye).all()


def test_more_events_than_a_hand_makes_are_refused() -> None:
    exchange = Exchange()
    viewer = Viewer(exchange)
    many = json.dumps({"events": [{"kind": "key", "name": "a", "down": True}] * 256})
    with pytest.raises(InputError, match="too many events wait"):
        for _ in range(MOST_EVENTS // 256 + 1):
            viewer.receive(many)
    assert len(exchange.wait(0)) == MOST_EVENTS


def test_a_viewer_that_begins_anew_gets_the_frame_that_it_was_sent_before() -> None:
    exchange = Exchange()
    viewer = Viewer(exchange)
    exchange.show(**frame(10))
    viewer.next()  # to a page that has gone: it is never drawn
    viewer.receive('{"begin": true}')
    contents: list[bytes | None] = []
    waiting = threading.Thread(target=lambda: contents.append(viewer.next()), daemon=True)
    waiting.start()
    waiting.join(5)
    again = head(contents[0] if contents else None)
    assert (again["frame"], again["type"]) == (2, "image/jpeg")
    viewer.receive('{"drawn": 2}')
    assert head(viewer.next())["type"] == "image/png"


def test_buttons_and_keys_are_released_when_the_focus_leaves() -> None:
    exchange = Exchange()
    viewer = Viewer(exchange)
    down = [{"kind": "button", "name": "left", "down": True}, {"kind": "key", "name": "w", "down": True}]
    viewer.receive(json.dumps({"events": down}))
    viewer.receive(json.dumps({"events": [{"kind": "focus", "down": True}]}))
    viewer.receive(json.dumps({"events": [{"kind": "focus"}]}))
    viewer.receive(json.dumps({"events": [{"kind": "focus"}]}))
    had, *rest = exchange.wait(0)[2:]
    assert had == Event("focus", down=True)
    assert rest == [Event("button", name="left"), Event("key", name="w"), Event("focus"), Event("focus")]


def test_a_viewer_that_leaves_lets_go_of_what_it_holds_and_makes_room_for_another() -> None:
    exchange = Exchange()
    viewer, other = Viewer(exchange), Viewer(exchange)
    with exchange.viewed(viewer) as welcome:
        assert welcome
        viewer.receive('{"size": [100, 1e9, 9], "events": [{"kind": "button", "name": "left", "down": true}]}')
        assert exchange.wanted == (100, 4096, 4.0)
        viewer.receive('{"size": [1e9, 1e9, 0]}')
        assert exchange.wanted == (4096, MOST_PIXELS // 4096, 1.0)
        with exchange.viewed(other) as refused:
            assert not refused
        viewer.leave()
        assert viewer.next() is None
    assert exchange.wait(0)[1:] == [Event("button", name="left"), Event("focus")]
    with exchange.viewed(other) as welcome:
        assert welcome
    assert not exchange.watched
