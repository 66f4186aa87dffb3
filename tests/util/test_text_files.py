"""Whatever stands in a file of text, or in its place, is read or refused with one line, within a second or so."""

from __future__ import annotations

import json
import os
import socket
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from texvol.annotation.lettering import Lettering
from texvol.cli import command_line
from texvol.comparison import limits
from texvol.formats.pictures.scene_metadata import ATTRIBUTE
from texvol.geometry import load_mesh
from texvol.options import files
from texvol.options.scene_options import SceneOptions
from texvol.provenance.stored_scene import stored_scene_of
from texvol.pytest_plugin.tables import Tables
from texvol.scene.transfer import TransferFunction
from texvol.util import text_files
from texvol.util.errors import InputError
from texvol.window import recent, script

Read = Callable[[Path], object]
TOML: dict[str, Read] = {
    "scene": lambda path: SceneOptions.of(scene=str(path)),
    "limits": lambda path: limits.named_limits(str(path)),
    "plugin's limits": Tables.read,
}
JSON: dict[str, Read] = {
    "tf": lambda path: TransferFunction.load(path),
    "script": lambda path: script.read(path),
}
OTHERS: dict[str, Read] = {
    "transform": lambda path: files.transform(str(path)).matrix(),
    "mesh": lambda path: load_mesh(path),
    "font": lambda path: Lettering(path),
}
ENDINGS = {"mesh": ".ply", "font": ".ttf", "transform": ".txt", "tf": ".json", "script": ".jsonl"}


def refusal(read: Read, path: Path) -> str:
    """The one line that a reader refuses a file with."""
    begun = time.perf_counter()
    with pytest.raises(InputError) as caught:
        read(path)
    assert time.perf_counter() - begun < 5
    message = str(caught.value)
    assert "\n" not in message and "\0" not in message
    assert len(message) < 1000
    return message


BAD_TOML = {
    "nested arrays": "a = " + "[" * 100_000 + "]" * 100_000,
    "arrays that tomllib takes": "a = " + "[" * 60 + "]" * 60,
    "nested tables": "a = " + "{a = " * 20_000 + "1" + "}" * 20_000,
    "dotted key": ".".join(["a"] * 100_000) + " = 1",
    "dotted key in quotes": " . ".join(['"a b"'] * 50_000) + " = 1",
    "dotted header": "[" + ".".join(["a"] * 100_000) + "]",
    "digits": "a = " + "1" * 5000,
    "hexadecimal": "a = 0x" + "f" * 5000,
    "large number": "a = 1" + "0" * 400,
    "NUL": 'a = "b\\u0000c"',
    "NUL in a key": '"b\\u0000c" = 1',
    "raw NUL": 'a = "b\0c"',
    "not closed": 'a = "b',
    "control": 'a = "\x1b[31m"',
    "long": "# " + "x" * (1 << 20),
}


@pytest.mark.parametrize("what", BAD_TOML)
@pytest.mark.parametrize("kind", TOML)
def test_toml_that_cannot_be_used_is_refused(tmp_path: Path, kind: str, what: str) -> None:
    path = tmp_path / "a.toml"
    path.write_text(BAD_TOML[what], encoding="utf-8")
    assert refusal(TOML[kind], path).startswith(f"{path}: is ")


@pytest.mark.parametrize("key", ["tf", "mask", "mesh", "volume", "transform"])
def test_a_nul_in_a_name_of_a_scene_file_is_refused(tmp_path: Path, key: str) -> None:
    (tmp_path / "a.toml").write_text(f'{key} = "b\\u0000.npy"\n')
    assert "with a NUL" in refusal(TOML["scene"], tmp_path / "a.toml")


BAD_JSON = {
    "nested": "[" * 100_000 + "]" * 100_000,
    "nested objects": '{"a":' * 900 + "1" + "}" * 900,
    "nested as deep as the parser takes": "[" * 400 + "]" * 400,
    "digits": '{"t": ' + "1" * 5000 + "}",
    "NUL": '{"do": "command", "name": "b\\u0000"}',
    "surrogate": '{"do": "screenshot", "file": "\\ud800.png"}',
    "surrogate in a key": '{"\\udfff": 1}',
    "number": '{"t": 1, "kind": "move", "x": 1' + "0" * 400 + "}",
    "not a number": '{"t": NaN, "kind": "move", "x": NaN}',
    "infinity": '{"t": 1, "kind": "move", "x": Infinity}',
    "twice": '{"t": 1, "t": 2, "kind": "close"}',
    "nothing": "null",
    "truncated": '{"points": [{"value',
}


@pytest.mark.parametrize("what", BAD_JSON)
@pytest.mark.parametrize("kind", JSON)
def test_json_that_cannot_be_used_is_refused(tmp_path: Path, kind: str, what: str) -> None:
    path = tmp_path / "a.json"
    path.write_text(BAD_JSON[what], encoding="utf-8")
    assert refusal(JSON[kind], path).startswith(str(path))


@pytest.mark.parametrize("what", BAD_JSON)
def test_headers_that_cannot_be_used_are_refused(what: str) -> None:
    with pytest.raises(InputError, match="^a.exr: the scene in its header"):
        stored_scene_of({ATTRIBUTE: BAD_JSON[what]}, name="a.exr")


@pytest.mark.parametrize("number", ["NaN", "Infinity", "-Infinity", "1" + "0" * 400, "1e999"])
@pytest.mark.parametrize("key", ["value", "color", "extinction"])
def test_numbers_of_a_transfer_function_that_are_none(tmp_path: Path, number: str, key: str) -> None:
    given = {"value": "0", "color": "[0, 0, 0]", "extinction": "1"}
    given[key] = f"[0, {number}, 0]" if key == "color" else number
    path = tmp_path / "a.json"
    path.write_text('{"points": [{' + ", ".join(f'"{name}": {text}' for name, text in given.items()) + "}]}")
    if key == "extinction" and number in ("Infinity", "1e999"):  # matter that nothing shines through
        assert np.isinf(TransferFunction.load(path).extinctions[0])
    else:
        refusal(JSON["tf"], path)


@pytest.mark.parametrize("kind", [*TOML, *JSON, *OTHERS])
@pytest.mark.parametrize("what", ["pipe", "socket", "folder", "endless device", "empty device", "nothing"])
def test_only_regular_files_are_read(tmp_path: Path, kind: str, what: str) -> None:
    """None of these is opened: a pipe that nobody writes to would never come, /dev/zero never end."""
    path = tmp_path / f"a{ENDINGS.get(kind, '.toml')}"
    if what == "pipe":
        os.mkfifo(path)
    elif what == "socket":
        with socket.socket(socket.AF_UNIX) as made:
            made.bind(str(path))
    elif what == "folder":
        path.mkdir()
    elif what != "nothing":
        path.symlink_to("/dev/zero" if what == "endless device" else "/dev/null")
    if what == "nothing" and kind == "plugin's limits":
        return  # which need not be there
    reason = {"folder": "is a folder", "nothing": "No such file"}.get(what, "is not a regular file")
    assert reason in refusal((TOML | JSON | OTHERS)[kind], path)


@pytest.mark.parametrize("kind", [*TOML, *JSON, "transform"])
def test_files_are_of_a_bounded_size(tmp_path: Path, kind: str) -> None:
    """Sparse, so that all of it is zeros that take no room."""
    path = tmp_path / f"a{ENDINGS.get(kind, '.toml')}"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    assert "got 1099511627776" in refusal((TOML | JSON | OTHERS)[kind], path)


@pytest.mark.parametrize("kind", [*TOML, *JSON, "transform"])
def test_text_is_utf_8(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"a{ENDINGS.get(kind, '.toml')}"
    path.write_bytes(b"a = '\xff\xfe'")
    assert "it is not UTF-8 text" in refusal((TOML | JSON | OTHERS)[kind], path)


@pytest.mark.parametrize("name", ["a\0b.json", "a\ud800.json"])
def test_a_name_that_no_file_can_have_is_refused(name: str) -> None:
    assert "not a valid file name" in refusal(TransferFunction.load, name)  # type: ignore[arg-type]


def test_links_and_windows_lines_are_read(tmp_path: Path) -> None:
    (tmp_path / "b.toml").write_bytes(b"max-abs = 0.5\r\n# 1.2.3\r\nrms = 0.25\r\n")
    (tmp_path / "a.toml").symlink_to(tmp_path / "b.toml")
    assert limits.named_limits(str(tmp_path / "a.toml")).rms == 0.25


def test_many_numbers_and_names_with_dots_are_no_long_key(tmp_path: Path) -> None:
    """Arrays of numbers, and texts, have as many dots as they like; a DICOM UID has 32 parts."""
    path = tmp_path / "a.toml"
    numbers = ", ".join(["1.5"] * 1000)
    path.write_text(f'a = [{numbers}]\nb = "{"Some words. " * 500}"\n"{"1.2" * 16}" = 3\n')
    assert len(text_files.read_toml(path)["a"]) == 1000


def test_a_quarter_of_a_million_numbers_are_read_in_seconds(tmp_path: Path) -> None:
    points = [{"value": i, "color": [0, 0.5, 1], "extinction": 1} for i in range(50_000)]
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"points": points}))
    begun = time.perf_counter()
    assert TransferFunction.load(path).values.size == 50_000
    assert time.perf_counter() - begun < 5


@pytest.mark.parametrize("key", ["materials", "contours", "boundaries", "graded"])
def test_there_are_only_so_many_parts_that_are_mixed(tmp_path: Path, key: str) -> None:
    """A file of 60 MB could have a million, and time goes with the square of their number."""
    path = tmp_path / "a.json"
    path.write_text(json.dumps({key: [{}] * 100_000}))
    assert f"at most 1000 {key}" in refusal(JSON["tf"], path)


def test_a_recent_list_of_nonsense_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    recent.state_file().parent.mkdir()
    for text in BAD_JSON.values():
        recent.state_file().write_text(text)
        assert recent.files() == []


@pytest.mark.parametrize(
    "option, ending",
    [("--tf", ".json"), ("--scene", ".toml"), ("--transform", ".txt"), ("--mesh", ".ply"), ("--mask", "")],
)
def test_the_command_line_refuses_pipes_and_devices(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], option: str, ending: str
) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", np.zeros((4, 4, 4), np.float32))
    os.mkfifo(f"pipe{ending}")
    os.symlink("/dev/zero", f"zero{ending}")
    for name in ("pipe", "zero"):
        assert command_line.main(["render", "v.npy", option, name + ending, "-o", "a.png"]) == 2
        err = capsys.readouterr().err
        assert err.startswith(f"texvol: error: {name}") and err.count("\n") == 1
        assert not Path("a.png").exists()
