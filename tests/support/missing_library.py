"""A library that is not installed, and what is said then."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from texvol import MissingExtraError, load
from texvol.util.installation import install_command


def check_asked_for(monkeypatch: pytest.MonkeyPatch, path: Path, library: str, extra: str) -> None:
    """Assert that reading a file without a library names it, and the command that installs its extra."""
    for module in [library, *(each for each in sys.modules if each.startswith(f"{library}."))]:
        monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtraError) as caught:
        load(path)
    assert str(caught.value).endswith(f"needs {library}, which is not installed: {install_command(extra)}")
