"""Slices beside the 3D view in a window: keys, double clicks, drags and the wheel do what they say."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.windows import ball, display_of_all, script, viewed

from texvol.formats.pictures import image

REST = {"do": "rest"}
SIZE = 402, 402
TILE = 200  # pixels of each view, with 2 between them
# Colours of the planes' borders and lines.
COLORS = {"axial": (80, 150, 255), "coronal": (90, 210, 100), "sagittal": (255, 90, 90)}
CORNERS = {"axial": (0, 0), "coronal": (0, TILE + 2), "sagittal": (TILE + 2, TILE + 2)}  # x, y


def pressed(name: str, x: float, y: float, *, twice: bool = False) -> list[dict[str, Any]]:
    """Clicks at a point, each step in a frame of its own."""
    clicks = [{"kind": "button", "name": name, "down": down} for _ in range(1 + twice) for down in (True, False)]
    return [{"kind": "move", "x": x, "y": y}, REST, *clicks, REST]


def dragged(name: str, start: tuple[float, float], end: tuple[float, float]) -> list[dict[str, Any]]:
    def at(place: tuple[float, float]) -> dict[str, Any]:
        return {"kind": "move", "x": place[0], "y": place[1]}

    down = {"kind": "button", "name": name, "down": True}
    return [at(start), REST, down, REST, at(end), REST, {**down, "down": False}, REST]


def seen(name: str) -> list[dict[str, Any]]:
    """A picture of the window, once a frame has shown what was done."""
    return [{"do": "command", "name": "tab View"}, REST, {"do": "screenshot", "file": f"{name}.png"}]


STEPS = [
    REST,
    *[{"kind": "key", "name": "g", "down": down} for down in (True, False)],
    REST,
    *seen("four"),
    *dragged("left", (100, 100), (130, 60)),
    *seen("dragged"),
    {"kind": "scroll", "y": 3},
    REST,
    *seen("stepped"),
    {"kind": "scroll", "y": 4, "modifiers": ["ctrl"]},
    REST,
    *seen("zoomed"),
    *dragged("middle", (300, 300), (330, 310)),
    *seen("moved"),
    *pressed("left", 100, 300, twice=True),
    *seen("large"),
    *pressed("left", 100, 300, twice=True),
    *seen("small"),
    {"do": "save", "file": "s.toml"},
    *[{"kind": "key", "name": "g", "down": down} for down in (True, False)],
    REST,
    *seen("alone"),
]


def of_a_body(folder: Path, name: str) -> str:
    """Name of a volume with the same samples and directions of a body, so that slices have letters."""
    values = np.load(folder / name)
    header = (
        "NRRD0004\ntype: float\ndimension: 3\nspace: left-posterior-superior\n"
        f"sizes: {' '.join(map(str, values.shape[::-1]))}\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n"
        "endian: little\nencoding: raw\n\n"
    )
    (folder / "body.nrrd").write_bytes(header.encode() + values.astype("<f4").tobytes())
    return "body.nrrd"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder with pictures of one window in which all of that was done."""
    folder = tmp_path_factory.mktemp("views")
    steps = [{"t": round(0.1 + 0.05 * number, 2), **step} for number, step in enumerate(STEPS)]
    words = ["--size", f"{SIZE[0]}x{SIZE[1]}", "--light", "none", "--max-error", "0.1"]
    done = viewed(
        display_of_all(), folder, of_a_body(folder, ball(folder, 24)), *words, "--script", script(folder, steps)
    )
    assert (done.returncode, done.stderr) == (0, "")
    return folder


def picture(folder: Path, name: str) -> np.ndarray:
    levels = np.rint(255 * image.read(folder / f"{name}.png")[..., :3]).astype(int)  # sRGB, as it is stored
    return np.asarray(levels[: SIZE[1], : SIZE[0]])


def is_color(pixels: np.ndarray, name: str) -> np.ndarray:
    """True where pixels are of the colour of a plane, mixed with what is behind, and of no other."""
    others = [each for each in COLORS if each != name]
    own = int(np.argmax(COLORS[name]))
    rest = [int(np.argmax(COLORS[each])) for each in others]
    return np.asarray((pixels[..., own] - pixels[..., rest[0]] > 25) & (pixels[..., own] - pixels[..., rest[1]] > 25))


def border_at(shown: np.ndarray, x: int, y: int) -> list[str]:
    """Names of the planes whose colour the border at a point has."""
    found = shown[y : y + 1, x + 20 : x + 60]
    return [name for name, color in COLORS.items() if np.abs(found - color).max() <= 2]


def lines(shown: np.ndarray, view: str) -> tuple[float, float]:
    """Column of the vertical line and row of the horizontal line in a small view, from its corner."""
    x, y = CORNERS[view]
    inside = shown[y + 4 : y + TILE - 4, x + 4 : x + TILE - 4]
    across, down = "coronal" if view == "sagittal" else "sagittal", "coronal" if view == "axial" else "axial"
    column = np.argmax(is_color(inside, across).mean(axis=0)) + 4
    row = np.argmax(is_color(inside, down).mean(axis=1)) + 4
    return float(column), float(row)


def test_a_key_shows_four_views_of_one_size_and_the_same_key_the_picture_alone(folder: Path) -> None:
    four, alone = picture(folder, "four"), picture(folder, "alone")
    for name, (x, y) in CORNERS.items():
        assert border_at(four, x, y) == [name]
        assert lines(four, name) == pytest.approx((TILE / 2, TILE / 2), abs=2)
        assert border_at(alone, x, y) == []


def test_the_crosshair_leaves_letters_free(folder: Path) -> None:
    """The crosshair goes through the middle, where the letters of the directions stand at the borders."""
    four = picture(folder, "four")
    for name, (x, y) in CORNERS.items():
        inside = four[y : y + TILE, x : x + TILE]
        column, row = (round(place) for place in lines(four, name))
        across, down = "coronal" if name == "sagittal" else "sagittal", "coronal" if name == "axial" else "axial"
        upright, level = is_color(inside[:, column], across), is_color(inside[row], down)
        for line, length in ((upright, 10), (level, 5)):  # pixels of a letter along the line, 8 before the border
            assert not line[9 : 9 + length].any() and not line[-9 - length : -9].any()
            assert line[40:-40].mean() > 0.9


def test_a_drag_moves_the_crosshair_in_all_slices(folder: Path) -> None:
    before, after = picture(folder, "four"), picture(folder, "dragged")
    assert lines(after, "axial") == pytest.approx((130, 60), abs=2)
    column, row = lines(after, "coronal")
    assert column == pytest.approx(130, abs=2) and row == pytest.approx(TILE / 2, abs=2)
    # Up in the axial slice is to the left of the sagittal one.
    assert lines(after, "sagittal")[0] == pytest.approx(60, abs=2)
    # The box fills 94 % of a view: the slice at the side of the ball is another one.
    x, y = CORNERS["sagittal"]
    assert np.abs(before - after)[y + 30 : y + 90, x + 70 : x + 90].mean() > 5


def test_the_wheel_goes_through_the_slices_by_one_for_each_notch(folder: Path) -> None:
    before, after = (lines(picture(folder, name), "coronal")[1] for name in ("dragged", "stepped"))
    layer = 0.94 * TILE / 24
    assert before - after == pytest.approx(3 * layer, abs=layer / 2 + 1), "superior is up"


def test_the_wheel_with_ctrl_zooms_about_the_mouse_and_the_middle_button_moves(folder: Path) -> None:
    stepped, zoomed, moved = (picture(folder, name) for name in ("stepped", "zoomed", "moved"))
    # The mouse, on the crosshair, stays where it is on the slice.
    assert lines(zoomed, "axial") == pytest.approx(lines(stepped, "axial"), abs=2)
    x, y = CORNERS["axial"]
    bright = [(shown[y + 6 : y + 194, x + 6 : x + 194].mean(axis=2) > 60).mean() for shown in (stepped, zoomed)]
    assert bright[1] > 1.3 * bright[0]
    before, after = lines(zoomed, "sagittal"), lines(moved, "sagittal")
    assert np.subtract(after, before) == pytest.approx((30, 10), abs=2)
    # All slices move together: what is to the right in the sagittal one is posterior.
    assert lines(moved, "axial")[1] - lines(zoomed, "axial")[1] == pytest.approx(30, abs=2)


def test_a_double_click_makes_a_slice_large_and_small_again(folder: Path) -> None:
    large, small = picture(folder, "large"), picture(folder, "small")
    assert border_at(large, 0, 0) == ["coronal"]
    left = np.flatnonzero(is_color(large[:, :, :], "coronal").mean(axis=0) > 0.9).max()
    assert left > 0.65 * SIZE[0]
    for name, (x, y) in CORNERS.items():
        assert border_at(small, x, y) == [name]


def test_a_scene_that_is_saved_has_the_size_of_the_view_without_slices(folder: Path) -> None:
    assert f'size = "{SIZE[0]}x{SIZE[1]}"' in (folder / "s.toml").read_text()
