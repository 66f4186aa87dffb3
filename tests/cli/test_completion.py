"""Completion in real shells on a terminal: commands, options, their words, presets, files."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest
from support.terminals import shell_line

from texvol.__main__ import main

# What is typed, and the words of which the last one is all that fits; without a list nothing does.
CASES = [
    ("ren", ["render"]),
    ("render --orbit-a", ["--orbit-axis"]),
    ("render --orbit-axis he", ["head"]),
    ("render --tf ct-bo", ["ct-bone"]),
    ("render --tf=ct-bo", ["--tf=ct-bone"]),
    ("render --add-tf ct-bo", ["ct-bone"]),
    ("render --tf li", ["light.json"]),
    ("render --scene=li", ["--scene=light.json"]),
    ("render --light st", ["studio"]),
    ("render --projection p", ["perspective"]),
    ("render --time a", ["all"]),
    ("render --stats 'a f", ["a file.npy"]),
    ("render 'a f", ["a file.npy"]),
    ("render -o li", ["light.json"]),
    ("render ~/li", ["~/light.json"]),
    ("render render --tf ct-bo", ["ct-bone"]),  # a file may be called as a command
    ("completion f", ["fish"]),
    ("help cookb", ["cookbook"]),
    ("report mer", ["merge"]),
    ("report merge --art", ["--artifact"]),
    ("report merge --orbit-a", []),  # is of another command
    ("render v.npy --zoom l", []),  # a number is no file
    ("completion l", []),
]
# Ctrl-X begins other keys of a shell, for which it would wait half a second.
BASH = """bind 'set keyseq-timeout 1'; bind 'set bell-style none'; bind 'set enable-bracketed-paste off'
source ./script; bind -x '"\\C-x": printf "<<%s>>" "$READLINE_LINE"'"""
ZSH = """KEYTIMEOUT=1; unsetopt zle_bracketed_paste beep; autoload -Uz compinit && compinit -u -d ./dump
source ./script; show() { print -rn -- "<<$BUFFER>>" }; zle -N show; bindkey '^X' show"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("completion")
    for name in ("a file.npy", "light.json"):
        (made / name).touch()
    return made


def script(shell: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["completion", shell]) == 0
    return capsys.readouterr().out


def found(shell: str) -> str:
    if (path := shutil.which(shell)) is None:
        pytest.skip(f"no {shell} found")
    return path


@pytest.mark.parametrize(("shell", "options", "setup"), [("bash", "--norc", BASH), ("zsh", "-f", ZSH)])
def test_tab_completes_the_line(
    shell: str, options: str, setup: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = found(shell)
    (folder / "script").write_text(script(shell, capsys))
    for typed, words in CASES:
        line = shell_line([path, options, "-i"], folder, setup, f"texvol {typed}\t")
        whole = f"texvol {typed.rpartition(' ')[0]} ".replace("  ", " ")
        if "'" in typed:
            whole, words = f"texvol {typed.partition(chr(39))[0]}", [f"'{words[0]}'"]
        expected = whole + words[0] + " " if words else f"texvol {typed}"
        assert line == expected, (typed, line)


def test_fish_completes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    fish = found("fish")
    (folder / "script").write_text(script("fish", capsys))
    for typed, words in CASES:
        line = f"texvol {typed}".replace("'", "\\'")
        done = subprocess.run(
            [fish, "-N", "-c", f"source ./script; complete -C '{line}'"],
            cwd=folder, env={"HOME": str(folder), "PATH": "/usr/bin:/bin"}, capture_output=True, text=True, check=True,
        )  # fmt: skip
        offered = [each.split("\t")[0].replace("\\", "") for each in done.stdout.splitlines()]
        assert offered == words and not done.stderr, (line, done)


def test_scripts_have_all_commands(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit):
        main(["--help"])
    commands = re.findall(r"^    (\w[\w-]*)", capsys.readouterr().out, re.MULTILINE)
    assert len(commands) > 15
    for shell in ("bash", "zsh", "fish"):
        text = script(shell, capsys)
        assert not [each for each in commands if each not in text]
