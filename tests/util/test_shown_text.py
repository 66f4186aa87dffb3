"""Text of names, headers and libraries is shown as it stands; no terminal, browser or Markdown obeys it."""

from __future__ import annotations

import datetime
import json
import re
import subprocess
import sys
import unicodedata
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from texvol import Camera, Scene, Volume
from texvol.cli import command_line, information
from texvol.comparison import ci, templates
from texvol.formats.pictures import image
from texvol.pytest_plugin.records import PictureError
from texvol.report import page, table
from texvol.report.convergence import Truths
from texvol.report.measuring import Findings
from texvol.util import errors, terminal
from texvol.util.errors import InputError
from texvol.util.shown_text import markdown, one_line, shown, shown_line

EVIL = "\x1b]0;owned\x07\x9b31m\u202etxt\x08"
SHOWN = r"\x1b]0;owned\x07\x9b31m\u202etxt\x08"
HTML = '<img src=x onerror="alert(1)">&amp;'
OBEYED = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\u200e\u200f\u061c]")


def test_characters_of_control_and_of_direction_are_numbers() -> None:
    """All of the categories Cc and Cs, and all that Unicode says are explicit directions; nothing else."""
    for number in range(0x110000):
        letter = chr(number)
        is_direction = unicodedata.bidirectional(letter) in (
            "LRE",
            "RLE",
            "LRO",
            "RLO",
            "PDF",
            "LRI",
            "RLI",
            "FSI",
            "PDI",
        )
        is_mark = letter in "\u061c\u200e\u200f"
        if unicodedata.category(letter) in ("Cc", "Cs") or is_direction or is_mark:
            assert shown_line(letter) == (f"\\x{number:02x}" if number < 256 else f"\\u{number:04x}")
            assert shown(letter) == (letter if letter in "\n\t" else shown_line(letter))
        else:
            assert shown(letter) == shown_line(letter) == letter


def escaped(text: str) -> str:
    """The text as the templates of pages write it."""
    return templates._environment("texvol.comparison").from_string("{{ text }}").render(text=text)


def test_text_for_html_and_markdown() -> None:
    assert escaped(EVIL + "<b>&") == SHOWN + "&lt;b&gt;&amp;"
    assert one_line("a\n b\r\n\tc\x1b") == r"a b c\x1b"
    plain = re.sub(r"&#(\d+);", lambda found: chr(int(found[1])), markdown("| a*b_c`[x](y)\n<i>\x1b # ~~d~~ &lt;"))
    assert plain == r"| a*b_c`[x](y) <i>\x1b # ~~d~~ &lt;"
    assert not set("|*_`[]<>#~") & set(re.sub(r"&#\d+;", "", markdown("| a*b_c`[x](y) <i> # ~~d~~")))


@pytest.mark.parametrize("kind", [InputError, errors.ContextError, errors.MissingExtraError, errors.NoRoomError])
def test_every_error_is_safe_to_print(kind: type[Exception]) -> None:
    assert str(kind(f"{EVIL}: is no file")) == f"{SHOWN}: is no file"
    assert str(PictureError(EVIL, "different")) == SHOWN


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    np.save("v.npy", np.arange(64, dtype=np.float32).reshape(4, 4, 4))
    return tmp_path


@pytest.mark.parametrize(
    "line",
    [
        ["info", f"{EVIL}.npy"],
        ["info", "v.npy", f"--{EVIL}"],
        ["info", "v.npy", "--shape", EVIL],
        ["render", "v.npy", "--tf", f"{EVIL}.json", "-o", "a.png"],
        ["render", "v.npy", "--scene", f"{EVIL}.toml", "-o", "a.png"],
        ["render", "v.npy", "--mask", f"{EVIL}.npy", "-o", "a.png"],
        ["render", "v.npy", "--mesh", f"{EVIL}.ply", "-o", "a.png"],
        ["render", "v.npy", "-o", f"no/{EVIL}.png"],
        ["diff", f"{EVIL}.png", f"{EVIL}.exr"],
        ["diff", "a.png", "b.png", "--limits", f"{EVIL}.toml"],
        ["report", "v.npy", "-o", f"no/{EVIL}"],
        ["surface", "v.npy", "--value", "3", "-o", f"{EVIL}.ply2"],
    ],
)
def test_errors_of_the_command_line(folder: Path, capsys: pytest.CaptureFixture[str], line: list[str]) -> None:
    assert command_line.main(line) == 2
    out, err = capsys.readouterr()
    assert not OBEYED.search(err) and out == ""
    assert err.count("\n") == 1
    assert r"\x1b" in err


def test_scene_keys_and_values_are_shown(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for text in (f'"{json.dumps(EVIL)[1:-1]}" = 1', f"tf = {json.dumps(EVIL + '.json')}", f"size = {json.dumps(EVIL)}"):
        Path("a.toml").write_text(text)
        assert command_line.main(["render", "v.npy", "--scene", "a.toml", "-o", "a.png"]) == 2
        err = capsys.readouterr().err
        assert r"\x1b" in err and not OBEYED.search(err)


def test_names_and_notes_of_a_volume_are_shown(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    name = f"{EVIL}\nspoofed  line.npy".replace("/", "")
    np.save(name, np.zeros((4, 4, 4), np.float32))
    assert command_line.main(["info", name]) == 0
    out = capsys.readouterr().out
    assert out.startswith(SHOWN + r"\x0aspoofed")
    volume = Volume(np.zeros((2, 2, 2)), notes=(EVIL,), unit=EVIL, space=EVIL + "\n", name="v")
    page_ = information.text(information.metadata(volume))
    assert not OBEYED.search(page_) and SHOWN in page_


def test_a_comparison_shows_names(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for number, name in enumerate((f"{EVIL}.exr", "b.exr")):
        image.write(name, np.full((8, 8, 4), number / 2, np.float32), {"texvol:renderer": EVIL})
    assert command_line.main(["diff", f"{EVIL}.exr", "b.exr", "--html", "a.html"]) == 1
    out = capsys.readouterr().out
    assert SHOWN in out and not OBEYED.search(out)
    assert not OBEYED.search(Path("a.html").read_text("utf-8"))


def test_warnings_are_one_safe_line(
    folder: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("texvol.cli.info.run", lambda arguments: warnings.warn(f"{EVIL}\nand more", stacklevel=1))
    assert command_line.main(["info", "v.npy"]) == 0
    assert capsys.readouterr().err == f"texvol: warning: {SHOWN} and more\n"


def test_lines_have_an_end(capsys: pytest.CaptureFixture[str]) -> None:
    terminal.complain("error: " + "a" * 1_000_000)
    assert len(capsys.readouterr().err) < 5000


def test_github_is_told_nothing_that_it_obeys() -> None:
    result = ci.Result(f"a{EVIL}", "different", words=(f"{HTML}{EVIL}\n::set-env name=a::b",))
    (line,) = ci.workflow_commands([result], {})
    assert not OBEYED.search(line) and "\n" not in line
    summary = ci.job_summary([result])
    assert not OBEYED.search(summary) and "<img" not in summary
    assert ci.attachment(f"a\n{EVIL}") == rf"[[ATTACHMENT|a\x0a{SHOWN}]]"


def findings() -> Any:
    """As much of a report's findings as its texts take; whatever others name is evil."""
    volume = Volume(
        np.zeros((4, 4, 4), np.float32), name=f"a|{HTML}{EVIL}*b*_c_.npy".replace("/", ""), unit=HTML + EVIL
    )
    scene = SimpleNamespace(volumes=(volume,), volume=volume, smallest_spacing=1.0)
    evil = {"GL_RENDERER": HTML + EVIL, "processor": "a|b" + EVIL}
    truths = SimpleNamespace(model_error=None, reason="", seconds=1.0)
    return SimpleNamespace(
        scene=scene,
        size=(4, 4),
        fingerprint=evil,
        measurements=[],
        ours=[],
        asked=[],
        truths=truths,
        seconds=1.0,
        command=HTML + EVIL,
    )


def test_the_tables_of_a_report_are_markdown_of_ours_alone() -> None:
    text = table.markdown_text(findings())
    assert "<img" not in text and not OBEYED.search(text)
    first = text.split("\n")[0]
    assert "|" not in first and "*" not in first and "_" not in first.replace("`", "")


def test_the_page_of_a_report_may_ask_for_nothing() -> None:
    """Names of others are text in it, and its policy allows pictures inside it alone."""
    known, nothing = findings(), np.zeros((4, 4, 4), np.float32)
    scene = Scene(known.scene.volume, camera=Camera.framing(known.scene.volume), classification="slab")
    truths = Truths(None, None)
    began = datetime.datetime(2026, 1, 1)
    made = Findings(scene, (4, 4), truths, known.fingerprint, known.command, nothing, began)
    text = page.html(made, {})
    assert not OBEYED.search(text)
    assert set(re.findall(r'<img[^>]* src="([a-z]+:)', text)) == {"data:"} and "<img src=x" not in text
    policy = re.search(r'http-equiv="Content-Security-Policy" content="([^"]*)"', text)
    assert policy is not None
    rules = dict(rule.strip().split(" ", 1) for rule in policy[1].split(";"))
    assert rules["default-src"] == "'none'" and rules["img-src"] == "data:"


def test_a_python_warning_of_a_mask_is_safe(folder: Path) -> None:
    """Printed by Python itself, which shows whatever it is given."""
    code = (
        "import numpy as np, texvol; from texvol.options.files import _warn_if_elsewhere as w;"
        f"a = texvol.Volume(np.zeros((4, 4, 4)), origin=(9, 9, 9), name={EVIL!r});"
        "w(a, texvol.Volume(np.zeros((4, 4, 4))))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "voxels away" in done.stderr and not OBEYED.search(done.stderr)


def test_a_name_that_is_no_utf_8_can_be_written_on_a_page() -> None:
    """As Python has it: each byte that is none as half of a surrogate pair."""
    name = b"a\xff.npy".decode("utf-8", "surrogateescape")
    for text in (escaped(name), markdown(name).replace("&#92;", "\\"), shown(name), str(InputError(name))):
        assert text.encode("utf-8") == rb"a\udcff.npy"
