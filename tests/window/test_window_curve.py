"""The Medium tab by mouse and keyboard: the curve is dragged, points are edited, looks and colours are chosen."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.windows import display, script, viewed  # noqa: F401 (display is a fixture)

from texvol.formats.readers import load
from texvol.scene.transfer import TransferFunction, adjusting, preset
from texvol.window import color_maps

# The picture is 300 wide; the plot reaches from 336 to 648, and from 182 almost to the controls at the foot.
_INSIDE = (560, 440)


class Played:
    """Steps of a script, each a little later than the one before."""

    def __init__(self) -> None:
        self.t = 0.2
        self.steps: list[dict[str, Any]] = [{"do": "rest"}]

    def add(self, **step: Any) -> None:
        self.t += 0.06
        self.steps.append({"t": round(self.t, 3), **step})

    def key(self, name: str, *modifiers: str) -> None:
        for down in (True, False):
            self.add(kind="key", name=name, down=down, modifiers=modifiers)

    def text(self, text: str) -> None:
        for letter in text:
            self.add(kind="text", name=letter)

    def button(self, down: bool, name: str = "left", *modifiers: str) -> None:
        self.add(kind="button", name=name, down=down, modifiers=modifiers)

    def click(self, x: float, y: float, name: str = "left") -> None:
        self.add(kind="move", x=x, y=y)
        self.button(True, name)
        self.button(False, name)

    def drag(self, start: tuple[float, float], by: tuple[float, float], *modifiers: str) -> None:
        self.add(kind="move", x=start[0], y=start[1])
        self.button(True, "left", *modifiers)
        for fraction in (0.25, 0.5, 0.75, 1.0):
            self.add(kind="move", x=start[0] + fraction * by[0], y=start[1] + fraction * by[1])
        self.button(False, "left", *modifiers)

    def save(self, name: str) -> None:
        self.add(do="save", file=f"{name}.toml")


def stored(folder: Path, name: str) -> TransferFunction:
    return TransferFunction.loads((folder / f"{name}.tf.json").read_text(), "ct-bone")


def thorax(folder: Path) -> str:
    z, y, x = np.mgrid[tuple(slice(-1, 1, 24j) for _ in range(3))]
    np.save(folder / "t.npy", (1500 * np.exp(-2 * (x**2 + y**2 + z**2)) - 1000).astype(np.int16))
    return "t.npy"


def played(display: str, folder: Path, steps: Played) -> None:  # noqa: F811
    # The panels are looked at: the picture is made in a moment.
    words = ["--tf", "ct-bone", "--size", "300x700", "--max-error", "0.9", "--light", "none", "--zoom", "0.2"]
    done = viewed(display, folder, thorax(folder), *words, "--script", script(folder, steps.steps))
    assert (done.returncode, done.stderr) == (0, "")


def test_the_curve_is_dragged_as_range_and_opacity_are_given(display: str, tmp_path: Path) -> None:  # noqa: F811
    steps = Played()
    steps.drag(_INSIDE, (-60, 5))
    steps.save("shifted")
    steps.drag(_INSIDE, (3, 30))
    steps.save("thinner")
    steps.drag(_INSIDE, (-30, 4), "shift")
    steps.save("narrower")
    steps.add(kind="move", x=_INSIDE[0], y=_INSIDE[1])
    for _ in range(3):
        steps.add(kind="scroll", y=1.0)
    steps.save("wider")
    for number in range(4):
        steps.key("z", "ctrl")
        steps.save(f"undone {number}")
    played(display, tmp_path, steps)

    before = preset("ct-bone", load(str(tmp_path / "t.npy")))
    seen = {name: stored(tmp_path, name) for name in ("shifted", "thinner", "narrower", "wider")}
    ends = {name: adjusting.ends(medium) for name, medium in seen.items()}
    low, high = adjusting.ends(before)
    # 312 pixels show 1.04 of the values of histogram and curve.
    pixel = 1.04 * (high + 1000) / 312
    assert ends["shifted"] == pytest.approx((low - 60 * pixel, high - 60 * pixel), abs=4 * pixel)
    assert np.array_equal(seen["shifted"].values, adjusting.between(before, *ends["shifted"]).values)
    assert np.array_equal(seen["shifted"].extinctions, before.extinctions)
    factor = seen["thinner"].extinctions[-1] / before.extinctions[-1]
    assert 0.1 < factor < 0.9 and factor == pytest.approx(float(f"{factor:.3g}"), rel=1e-12)
    assert ends["thinner"] == ends["shifted"], "an upright drag leaves the values"

    def width(name: str) -> float:
        return ends[name][1] - ends[name][0]

    assert width("narrower") < 0.9 * width("thinner") and width("wider") > 1.2 * width("narrower")
    # Three notches of the wheel are one step, as a drag is.
    undone = [stored(tmp_path, f"undone {number}") for number in range(4)]
    for found, wanted in zip(undone, ("narrower", "thinner", "shifted"), strict=False):
        assert np.array_equal(found.values, seen[wanted].values)
        assert np.array_equal(found.extinctions, seen[wanted].extinctions)
    assert np.array_equal(undone[3].values, before.values)


def test_points_are_added_moved_typed_and_removed(display: str, tmp_path: Path) -> None:  # noqa: F811
    # Near the plot's upper edge, where points stay when lines of the status take height from the plot.
    steps = Played()
    steps.click(400, 212)
    steps.save("added")
    steps.drag((400, 212), (20, 12))
    steps.save("moved")
    steps.click(420, 224)  # opens the popup, whose first field is the value
    steps.click(480, 277)  # selects its text
    steps.text("-700")
    steps.key("enter")
    steps.save("typed")
    steps.key("escape")
    for _ in range(2):
        steps.key("z", "ctrl")
    steps.click(400, 212, "right")
    steps.save("removed")
    played(display, tmp_path, steps)
    count = len(preset("ct-bone", load(str(tmp_path / "t.npy"))).values)
    added, moved, typed, removed = (stored(tmp_path, name) for name in ("added", "moved", "typed", "removed"))
    assert len(added.values) == len(moved.values) == len(typed.values) == count + 1
    assert added.values[0] < moved.values[0] and added.extinctions[0] > moved.extinctions[0] > 0
    assert typed.values[0] == -700 and typed.extinctions[0] == moved.extinctions[0]
    assert len(removed.values) == count


def test_looks_colours_and_shapes_are_chosen_by_mouse_and_keyboard(display: str, tmp_path: Path) -> None:  # noqa: F811
    steps = Played()
    steps.click(400, 164)  # colours
    steps.text("magma")
    steps.key("enter")
    steps.add(do="rest")
    steps.save("magma")
    steps.click(570, 164)  # opacity
    steps.key("down")
    steps.key("down")
    steps.key("escape")
    steps.add(do="rest")
    steps.save("curve")
    steps.click(420, 135)  # looks
    steps.text("soft tissue vessels")
    steps.key("enter")
    steps.add(do="rest")
    steps.save("look")
    played(display, tmp_path, steps)
    volume = load(str(tmp_path / "t.npy"))
    before, wanted = preset("ct-bone", volume), preset("ct-soft-tissue", volume)
    magma, curve, look = (stored(tmp_path, name) for name in ("magma", "curve", "look"))
    low, high = adjusting.ends(before)
    for value in np.linspace(low, high, 50)[1:-1]:
        there = color_maps.color_at(color_maps.map_stops("magma"), (value - low) / (high - low))
        np.testing.assert_allclose(magma.at(value)[:3], there, atol=1e-9)
        np.testing.assert_allclose(curve.at(value)[:3], there, atol=1e-9)
        np.testing.assert_allclose(magma.at(value)[3], before.at(value)[3], rtol=1e-9)
    assert curve.at((low + high) / 2)[3] == pytest.approx(before.extinctions.max() / 4)
    assert np.array_equal(look.values, wanted.values) and np.array_equal(look.colors, wanted.colors)
    content = json.loads((tmp_path / "curve.tf.json").read_text())
    assert len(content["points"]) > 5
