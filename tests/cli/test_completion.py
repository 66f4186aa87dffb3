"""Completion in real shells: commands, options, presets, files."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from texvol.__main__ import main

CASES = [
    (["ren"], {"render"}),
    (["render", "--orbit-a"], {"--orbit-axis"}),
    (["render", "--orbit-axis", "he"], {"head"}),
    (["render", "--tf", "ct-bo"], {"ct-bone"}),
    (["render", "--stats", "a f"], {"a file.npy"}),
    (["render", "a f"], {"a file.npy"}),
    (["completion", "f"], {"fish"}),
    (["help", "cookb"], {"cookbook"}),
    (["report", "mer"], {"merge"}),
    (["report", "merge", "--art"], {"--artifact"}),
]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "a file.npy").touch()
    return tmp_path


def script(shell: str, capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["completion", shell]) == 0
    return capsys.readouterr().out


def test_bash_completes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if (bash := shutil.which("bash")) is None:
        pytest.skip("no bash found")
    (folder / "s").write_text(script("bash", capsys))
    for words, expected in CASES:
        line = " ".join(f"'{each}'" for each in ["texvol", *words])
        code = (
            f"source ./s; COMP_WORDS=({line}); COMP_CWORD={len(words)}; _texvol; printf '%s\\n' \"${{COMPREPLY[@]}}\""
        )
        done = subprocess.run([bash, "--norc", "-c", code], cwd=folder, capture_output=True, text=True, check=True)
        assert set(done.stdout.splitlines()) == expected and not done.stderr, (words, done)


def test_zsh_takes_the_script(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if (zsh := shutil.which("zsh")) is None:
        pytest.skip("no zsh found")
    (folder / "s").write_text(script("zsh", capsys))
    code = "autoload -Uz compinit && compinit -u -d ./dump; source ./s; print $_comps[texvol]"
    done = subprocess.run([zsh, "-f", "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert "_texvol" in done.stdout and not done.stderr, done


def test_fish_completes(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    if (fish := shutil.which("fish")) is None:
        pytest.skip("no fish found")
    (folder / "s").write_text(script("fish", capsys))
    for words, expected in CASES:
        line = " ".join(["texvol", *words]).replace("a f", r"a\ f")
        code = f"source ./s; complete -C '{line}'"
        done = subprocess.run([fish, "-N", "-c", code], cwd=folder, capture_output=True, text=True, check=True)
        found = {each.split("\t")[0].replace("\\", "") for each in done.stdout.splitlines()}
        assert found == expected and not done.stderr, (words, done)
