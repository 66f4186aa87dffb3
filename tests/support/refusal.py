"""How a bad file must be refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from texvol import InputError, load


def refused(path: Path, capfd: pytest.CaptureFixture[str], **options: object) -> str:
    """The message that loading a file ends with: an InputError, of one line, that names it; stderr stays empty."""
    with pytest.raises(InputError) as caught:
        load(path, **options)
    return told_well(caught.value, path, capfd)


def told_well(error: InputError, path: Path, capfd: pytest.CaptureFixture[str]) -> str:
    """The message of an error that a file was refused with: it is of one line and names the file; stderr is empty."""
    message = str(error)
    assert "\n" not in message
    assert message.startswith(f"{path}: ")
    assert len(message) < len(str(path)) + 450
    assert capfd.readouterr().err == ""
    return message
