"""Devices of EGL: how they are listed and chosen, and what is said of those that cannot be used."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.small_pictures import backend_or_skip

from texvol import Renderer
from texvol.cli.command_line import main
from texvol.opengl import contexts
from texvol.opengl.contexts import described, devices, egl, listing, native, open_context, trial
from texvol.opengl.contexts.devices import Device, Machine, chosen, hindrances, in_words
from texvol.util.errors import ContextError, InputError

THREE = (
    Device(0, "Card A100 MIG", "", "this process may not use it"),
    Device(1, "Card A100", "Vendor, OpenGL 4.6"),
    Device(2, "llvmpipe", "Mesa, OpenGL 4.5"),
)


@pytest.fixture
def two_devices(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine whose first device cannot be used, as with MIG, and whose second is the real one."""
    backend_or_skip("egl")
    if not devices():
        pytest.skip("EGL lists no device here")
    monkeypatch.setattr(native, "loaded", {})
    real, initialised = egl.Egl._devices, egl.Egl._initialised

    def first_refuses(library: egl.Egl, name: str, *how) -> int:
        if name == "device 0":
            raise ContextError("eglInitialize failed with EGL_BAD_ACCESS")
        return initialised(library, name, *how)

    monkeypatch.setattr(egl.Egl, "_devices", lambda library: [*real(library)[:1], *real(library)[:1]])
    monkeypatch.setattr(egl.Egl, "_initialised", first_refuses)
    monkeypatch.setattr(listing, "told", told_by_this_process)


def told_by_this_process(what: str, number: int | None = None) -> dict[str, Any]:
    """Return the report of a device, made in this process with devices that are planted."""
    return json.loads(json.dumps(described.answer(what, number)))


@pytest.mark.usefixtures("two_devices")
def test_a_device_that_cannot_be_used_is_listed_with_its_reason_in_words() -> None:
    first, second = devices()
    assert first.number == 0 and first.reason is not None
    assert "MIG" in first.reason and "container" in first.reason and "EGL_BAD_ACCESS" in first.reason
    assert "cannot be used" in first.line and "\n" not in first.line
    assert (second.number, second.reason) == (1, None) and "OpenGL" in second.driver
    assert re.search(r"compute shaders; weights of \d+ bits", second.line)


@pytest.mark.usefixtures("two_devices")
def test_a_number_opens_that_device_and_no_other(monkeypatch: pytest.MonkeyPatch) -> None:
    initialised, opened = egl.Egl._initialised, []

    def heard(library: egl.Egl, name: str, *how) -> int:
        opened.append(name)
        return initialised(library, name, *how)

    monkeypatch.setattr(egl.Egl, "_initialised", heard)
    open_context(device=1).release()
    assert set(opened) == {"device 1"}


@pytest.mark.usefixtures("two_devices")
def test_the_device_that_is_asked_for_draws_or_none() -> None:
    for device in (1, "1", devices()[1].name[:6].upper()):
        context = open_context(device=device)
        assert (context.backend, context.device) == ("egl", 1)
        context.release()
    with pytest.raises(ContextError, match="device 0 .* cannot be used: .*EGL_BAD_ACCESS"):
        open_context(device=0)
    with Renderer(device=1) as renderer:
        assert renderer.renderer_name == devices()[1].name
    with pytest.raises(InputError, match="one of EGL"):
        open_context("osmesa", 1)


def test_a_name_chooses_the_first_that_can_be_used() -> None:
    assert chosen("a100", THREE).number == 1
    assert chosen(2, THREE).number == chosen("LLVM", THREE).number == 2
    with pytest.raises(ContextError, match="device 0 .Card A100 MIG. cannot be used: this process"):
        chosen("mig", THREE)


@pytest.mark.parametrize("wrong", [3, -1, "titan", "", True])
def test_a_wrong_device_is_answered_by_what_there_is(wrong: int | str) -> None:
    with pytest.raises(InputError) as caught:
        chosen(wrong, THREE)
    assert f"got {wrong!r}; there are: 0 (Card A100 MIG), 1 (Card A100), 2 (llvmpipe)" in str(caught.value)


def test_a_file_without_permission_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    node = tmp_path / "renderD128"
    node.touch()
    assert "may be missing" in in_words("eglInitialize failed with EGL_NOT_INITIALIZED", [str(node)])
    monkeypatch.setattr("os.access", lambda *_: False)
    said = in_words("eglInitialize failed with EGL_NOT_INITIALIZED", [str(node), str(tmp_path / "gone")])
    assert said.startswith(f"no permission for {node}") and "render or video" in said
    assert in_words("something else") == "something else"


def machine(*there: str, closed: str = "", **environment: str) -> Machine:
    def found(pattern: str) -> list[str]:
        return [path for path in there if Path(path).match(pattern)]

    return Machine(found, lambda path: path != closed, environment)


CARD, VENDOR = "/dev/nvidia0", "/usr/share/glvnd/egl_vendor.d/10_nvidia.json"
NODE = "/dev/dri/renderD128"


def test_a_card_that_egl_does_not_know_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(Machine, "loads", lambda *_: True)
    (said,) = hindrances(machine(CARD))
    assert "10_nvidia.json is missing" in said
    assert hindrances(machine(CARD, VENDOR)) == hindrances(machine(NODE)) == []


@pytest.mark.parametrize(
    "there, environment, words",
    [
        ((), {}, "there is no /dev/dri"),
        ((CARD, VENDOR), {"NVIDIA_DRIVER_CAPABILITIES": "compute,utility"}, "names graphics, here compute,utility"),
        ((CARD, VENDOR), {}, "names graphics (-e"),
        ((CARD, VENDOR, "/proc/driver/nvidia/capabilities/gpu0/mig/gi3"), {}, "divided by MIG"),
        ((CARD, VENDOR), {"NVIDIA_VISIBLE_DEVICES": "MIG-1234"}, "divided by MIG"),
    ],
)
def test_what_containers_and_mig_take_away_is_said(there: tuple[str, ...], environment: dict, words: str) -> None:
    said = hindrances(machine(*there, **environment))
    assert any(words in each for each in said) and not any("\n" in each for each in said)


def test_a_render_node_that_is_closed_is_named() -> None:
    (said,) = hindrances(machine(NODE, closed=NODE))
    assert said.startswith(f"no permission for {NODE}") and "render or video" in said


def test_a_device_that_is_not_there_is_answered_with_the_reason() -> None:
    with pytest.raises(InputError, match="there are: 2 .llvmpipe.; there is no /dev/dri"):
        chosen("nvidia", THREE[2:], hindrances(machine()))


@pytest.mark.parametrize(
    "dies, words", [("os.kill(os.getpid(), 11)", r"ends the process \(SIGSEGV\)"), ("os._exit(3)", "status 3")]
)
def test_a_driver_that_crashes_ends_the_process_of_its_device_only(
    dies: str, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    whole = trial.apart
    monkeypatch.setattr(trial, "apart", lambda code: whole(f"import os; {dies}" if "osmesa" in code else code))
    assert re.search(words, listing.osmesa().reason or "")


def test_devices_are_listed_by_the_command(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    backend_or_skip("egl")
    monkeypatch.setattr(listing, "told", cache(listing.told))
    assert main(["devices"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert main(["devices", "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    listed = [*told["devices"], told["osmesa"]]
    assert [each["name"] in line for each, line in zip(listed, lines, strict=False)] == [True] * len(listed)
    assert [line.removeprefix("note: ") for line in lines[len(listed) :]] == told["notes"]


def test_the_command_line_says_which_devices_there_are(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    backend_or_skip("egl")
    np.save(tmp_path / "v.npy", np.zeros((4, 4, 4), np.float32))
    volume, picture = str(tmp_path / "v.npy"), str(tmp_path / "p.png")
    assert main(["render", volume, "--device", "titan", "-o", picture]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and "got 'titan'; there are: " in said
    monkeypatch.setattr(contexts, "devices", lambda: list(THREE))
    for command in ("report", "methods", "presets", "demo"):
        source = [] if command == "demo" else [volume]
        assert main([command, *source, "--device", "titan", "-o", str(tmp_path / "out.png")]) == 2
        assert "got 'titan'; there are: " in capsys.readouterr().err
    assert main(["render", volume, "--device", "0", "--workers", "2", "-o", picture]) == 2
    assert "--device does not go with --workers" in capsys.readouterr().err
    assert not Path(picture).exists()
