"""Events, scripts of them, and what they do to the view."""

from __future__ import annotations

import json
import resource
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from imgui_bundle import imgui
from support.panel_frames import headless

from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.util.errors import InputError
from texvol.window.commands import is_command
from texvol.window.events import KEYS, Event, Queue
from texvol.window.navigation import View
from texvol.window.panels import parts
from texvol.window.script import Action, Player, Recorder, Step, read
from texvol.window.steering import BINDINGS, Steering, Viewport

VOLUME = Volume(np.zeros((8, 8, 8), np.uint8))
VIEWPORT = Viewport(0, 0, 800, 600)
EVENTS = [
    Event("move", 12.5, 30.0),
    Event("button", name="left", down=True, modifiers=("shift",)),
    Event("scroll", 0.0, -1.5),
    Event("key", name="f1", down=True),
    Event("text", name="ä"),
    Event("drop", names=("a b.nrrd", "c.toml")),
    Event("resize", 640, 480),
    Event("close"),
]


def view() -> View:
    return View.of(Camera.framing(VOLUME, "perspective"))


def test_what_is_recorded_is_played_back(tmp_path: Path) -> None:
    path = tmp_path / "script.jsonl"
    recorder = Recorder(path)
    for number, event in enumerate(EVENTS):
        recorder.add([event], 5.0 + 0.25 * number)
    recorder.close()
    steps = read(path)
    assert [step.item for step in steps] == EVENTS
    assert [step.t for step in steps] == [0.25 * number for number in range(len(EVENTS))]


def test_of_moves_in_a_row_the_last_counts() -> None:
    queue = Queue()
    for event in (Event("move", 1, 1), Event("move", 2, 2), Event("button", name="left"), Event("move", 3, 3)):
        queue.put(event)
    frames = [queue.take() for _ in range(4)]
    assert frames == [[Event("move", 2, 2)], [Event("button", name="left")], [Event("move", 3, 3)], []]


@pytest.mark.parametrize(
    "line, reason",
    [
        ("no", "2: step 'no'"),
        ("[1]", "2: step must be a JSON object"),
        ('{"kind": "shout"}', "2: event kind must be one of move"),
        ('{"kind": "move", "x": "here"}', "2: event {"),
        ('{"kind": "move", "x": 1e9}', "2: event {"),
        ('{"kind": "drop", "names": "a"}', "2: event {"),
        ('{"do": "dance"}', '2: "do" must be one of rest'),
        ('{"do": "rest", "loudly": 1}', '2: "do" must be one of rest'),
        ('{"t": -1, "do": "rest"}', "2: t must be a time"),
        ('{"t": "now", "do": "rest"}', "2: t must be a time"),
    ],
)
def test_what_is_no_script_is_refused_by_its_line(tmp_path: Path, line: str, reason: str) -> None:
    path = tmp_path / "s.jsonl"
    path.write_text("# first\n{}\n".replace("{}", line))
    with pytest.raises(InputError) as error:
        read(path)
    assert str(error.value).startswith(f"{path}:{reason}")


def test_a_script_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="cannot be read"):
        read(tmp_path / "none")


def due(player: Player, now: float, *, at_rest: bool) -> list[Event | Action]:
    return [step.item for step in player.due(now, at_rest=at_rest)]


def test_the_clock_stands_still_until_the_picture_is_at_rest() -> None:
    press, move = Event("button", name="left", down=True), Event("move", 1, 1)
    player = Player([Step(0.0, move), Step(0.1, Action("rest")), Step(0.2, press)])
    assert due(player, 100.0, at_rest=False) == [move]
    assert due(player, 100.15, at_rest=False) == []
    assert player.waits
    assert due(player, 130.0, at_rest=False) == []
    assert due(player, 130.01, at_rest=True) == [Action("rest")]
    assert due(player, 130.02, at_rest=True) == []
    assert due(player, 130.12, at_rest=False) == [press]
    assert player.over and player.clock == pytest.approx(0.26)


def test_an_action_sees_what_came_before_it() -> None:
    move, shot = Event("move", 1, 1), Action("screenshot", file="a.png")
    player = Player([Step(0.0, move), Step(0.0, shot), Step(0.0, move)])
    assert [due(player, 0.0, at_rest=False) for _ in range(3)] == [[move], [shot], [move]]


def handled(events: list[Event], **how: Any) -> Any:
    return Steering().handle(events, view(), VOLUME, VIEWPORT, 0.0, **how)


def drag(button: str, *, modifiers: tuple[str, ...] = (), start: tuple[float, float] = (400, 300)) -> list[Event]:
    return [
        Event("move", *start),
        Event("button", name=button, down=True, modifiers=modifiers),
        Event("move", start[0] + 40, start[1] - 20),
        Event("button", name=button, down=False),
        Event("move", 5, 5),
    ]


@pytest.mark.parametrize(
    "button, modifiers, keeps",
    [
        ("left", (), "distance"),
        ("middle", (), "forward"),
        ("left", ("shift",), "forward"),
        ("right", (), "forward"),
        ("left", ("ctrl",), "eye"),
    ],
)
def test_each_button_moves_in_its_own_way(button: str, modifiers: tuple[str, ...], keeps: str) -> None:
    before, after = view(), handled(drag(button, modifiers=modifiers, start=(500, 300))).view
    assert after.camera != before.camera
    if keeps == "distance":
        eyes = [np.linalg.norm(np.subtract(each.camera.eye, before.pivot)) for each in (before, after)]
        assert eyes[0] == pytest.approx(eyes[1])
        assert not np.allclose(after.camera.forward, before.camera.forward)
    elif keeps == "forward":
        assert np.allclose(after.camera.forward, before.camera.forward)
        assert after.camera.eye != before.camera.eye
    else:
        assert after.camera.eye == before.camera.eye and after.camera.up != before.camera.up


def test_a_drag_over_a_panel_is_the_panels() -> None:
    assert handled(drag("left"), mouse=False).view == view()
    assert handled(drag("left", start=(900, 300))).view == view()


def test_a_drag_goes_on_outside_of_the_picture_and_ends_with_the_button() -> None:
    steering, events = Steering(), drag("left")
    pressed = steering.handle(events[:2], view(), VOLUME, VIEWPORT, 0.0).view
    assert steering.dragging
    outside = steering.handle([Event("move", 1200, 300)], pressed, VOLUME, VIEWPORT, 0.1, mouse=False).view
    assert outside.camera != pressed.camera
    released = steering.handle(events[3:], outside, VOLUME, VIEWPORT, 0.2, mouse=False).view
    assert released == outside and not steering.dragging


def test_a_window_that_lost_the_focus_drags_no_more() -> None:
    steering = Steering()
    steering.handle(drag("left")[:2], view(), VOLUME, VIEWPORT, 0.0)
    outcome = steering.handle([Event("focus", down=False), Event("move", 300, 300)], view(), VOLUME, VIEWPORT, 0.1)
    assert outcome.view == view() and not steering.dragging


def test_two_clicks_are_a_double_one_where_they_are_near_and_soon() -> None:
    def clicked(second: float, x: float) -> Any:
        steering = Steering()
        for time, position in ((0.0, 400.0), (second, x)):
            events = [
                Event("move", position, 300),
                Event("button", name="left", down=True),
                Event("button", name="left"),
            ]
            outcome = steering.handle(events, view(), VOLUME, VIEWPORT, time)
        return outcome.clicked

    assert clicked(0.2, 402) == (402, 300)
    assert clicked(0.6, 402) is None
    assert clicked(0.2, 430) is None


def test_every_key_of_the_page_does_something() -> None:
    for binding in BINDINGS:
        for chord in binding.chords:
            *modifiers, name = chord.split("+")
            outcome = handled([Event("key", name=name, down=True, modifiers=tuple(modifiers))])
            assert bool(outcome.commands) != (outcome.view != view()), chord
            silent = handled([Event("key", name=name, down=True, modifiers=tuple(modifiers))], keyboard=False)
            assert not silent.commands and silent.view == view()


def test_keys_and_json_have_one_name_for_each_event() -> None:
    for event in EVENTS:
        assert Event.from_json(json.loads(json.dumps(event.as_json()))) == event


@pytest.mark.parametrize(
    "event, reason",
    [
        ({"kind": "button", "name": "fourth"}, "mouse button must be one of left, right, middle, got 'fourth'"),
        ({"kind": "key", "name": "bogus"}, "key must be a name such as .*, got 'bogus'"),
        ({"kind": "key", "name": "a", "modifiers": ["hyper"]}, "modifier must be one of shift, ctrl, alt, got 'hyper'"),
    ],
)
def test_what_no_mouse_or_keyboard_has_is_told_with_its_line(tmp_path: Path, event: Any, reason: str) -> None:
    path = tmp_path / "script.jsonl"
    path.write_text('{"do": "rest"}\n' + json.dumps(event | {"t": 1, "down": True}) + "\n")
    with pytest.raises(InputError, match=rf"script\.jsonl:2: {reason}"):
        read(path)


def test_commands_that_there_are_not_are_known_as_such() -> None:
    assert all(map(is_command, ("undo", "save a.toml", "axis -y", "tab File")))
    assert not any(map(is_command, ("nonsense", "", "axis", "axis x", "undoing")))


def test_keys_are_those_that_a_window_tells_of() -> None:
    glfw = pytest.importorskip("glfw", reason="the window needs the extra: pip install '.[view]'")
    from texvol.window.screen import key_names

    assert set(key_names(glfw).values()) == KEYS


def test_a_recording_on_a_full_disk_or_a_device_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="must be a regular file, got a device"):
        Recorder("/dev/full")
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    recorder = Recorder(tmp_path / "a.jsonl")
    recorder.add([Event("move", x=1, y=2)] * 100, 0.0)
    resource.setrlimit(resource.RLIMIT_FSIZE, (40, limits[1]))
    try:
        with pytest.raises(InputError, match=r"a.jsonl: cannot be written: File too large: the limit \(ulimit -f\)"):
            recorder.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)


def test_keys_that_are_meant_for_an_open_list_do_not_turn_the_picture() -> None:
    down, released = Event("key", name="down", down=True), Event("key", name="down")
    undo, move = Event("key", name="z", down=True, modifiers=("ctrl",)), Event("move", 3, 4)
    events = [down, released, undo, move]
    with headless():
        imgui.new_frame()
        assert parts.heard(events) == events
        imgui.open_popup("list")
        assert imgui.begin_popup("list")
        imgui.end_popup()
        assert parts.heard(events) == [released, undo, move]
        imgui.end_frame()
