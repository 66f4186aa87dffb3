"""Every control has a tooltip."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

from texvol.annotation.request import PARTS
from texvol.window.panels import tips

PANELS = Path(tips.__file__).parent
CONTROLS = {"choice", "slider", "number", "ends", "color", "switch"}


def labels() -> Iterator[str]:
    """Labels of the controls in all panels, as far as they are written out; units in them are replaced by "units"."""
    for path in PANELS.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if not (isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr in CONTROLS):
                continue
            if isinstance(node.func.value, ast.Name) and node.func.value.id == "parts":
                label = node.args[0]
                if isinstance(label, ast.Constant):
                    yield str(label.value)
                elif isinstance(label, ast.JoinedStr) and path.name in ("medium.py", "point.py"):
                    yield "".join(
                        str(part.value) if isinstance(part, ast.Constant) else "units" for part in label.values
                    )


def test_every_control_has_a_tooltip() -> None:
    found = [*labels(), *(part.replace("-", " ") for part in PARTS), "undo", "redo", "reset", "frame"]
    assert len(found) > 40
    assert not [label for label in found if not tips.tip(label)]


@pytest.mark.parametrize("label", ["opacity /5.97 mm", "opacity is per (mm)", "error at rest (/255)"])
def test_units_are_no_part_of_a_name(label: str) -> None:
    assert tips.tip(label) in tips.TIPS.values()


def test_a_control_without_a_tooltip_has_none() -> None:
    assert tips.tip("plane 1") == ""
