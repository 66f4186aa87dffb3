"""Pages that are dragged to turn: the right view under the hand, small enough to send, and alone on the disk."""

from __future__ import annotations

import base64
import json
import re
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.browser import Browser, Page, browser  # noqa: F401  (a fixture)

import texvol
from texvol.__main__ import main
from texvol.output.turn_page import page as pages
from texvol.output.turn_page import samples, views
from texvol.scene import orbit
from texvol.scene.camera import Camera
from texvol.scene.volume import Volume
from texvol.util.errors import InputError

COLUMNS, ROWS = 6, 3


def ramp_volume() -> Volume:
    """A volume that looks different from every side, with value x + 10 y + 100 z."""
    z, y, x = np.ogrid[:8, :10, :12]
    return Volume((x + 10 * y + 100 * z).astype(np.float32), (1, 1, 2), name="ramp <& more>")


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A page of the command line, with slices."""
    folder = tmp_path_factory.mktemp("page")
    np.save(folder / "ramp.npy", ramp_volume().values)
    line = ["render", str(folder / "ramp.npy"), "--orbit", f"{COLUMNS}x{ROWS}", "--slices", "--size", "96x64"]
    assert main([*line, "--background", "0.2,0,0", "--title", "<b>Ramp</b>", "-o", str(folder / "turn.html")]) == 0
    return folder / "turn.html"


def data_of(html: str) -> dict[str, Any]:
    found = re.search(r'<script type="application/json" id="data">(.*?)</script>', html, re.DOTALL)
    assert found
    return dict(json.loads(found[1]))


def view_shown(page: Page) -> tuple[int, int]:
    """Column and row of the stored view that the canvas shows, by its pixels."""
    page.tell("new Promise(done => setTimeout(done, 60))")
    number = page.tell(
        """(async () => {
        const shown = pen.getImageData(0, 0, canvas.width, canvas.height).data;
        const other = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d");
        for (let number = 0; number < data.views.length; number++) {
          const image = new Image();
          image.src = `data:${data.kind};base64,${data.views[number]}`;
          await image.decode();
          other.drawImage(image, 0, 0);
          const theirs = other.getImageData(0, 0, canvas.width, canvas.height).data;
          if (theirs.every((level, index) => level === shown[index])) return number;
        }
        return -1;
        })()"""
    )
    return number % COLUMNS, number // COLUMNS


def zoom_of(page: Page) -> float:
    return float(page.tell("new DOMMatrix(getComputedStyle(canvas).transform).a"))


# Views.


def test_rows_are_elevations_and_columns_go_around() -> None:
    volume = ramp_volume()
    first = Camera.orthographic((30, -20, 9), tuple(volume.centre), (0, 0, 2), height=20)
    found = list(orbit.cameras(first, COLUMNS * ROWS, orbit.Turn(rows=ROWS), volume))
    offsets = np.array([each.eye for each in found]) - volume.centre
    lengths = np.linalg.norm(offsets, axis=1)
    np.testing.assert_allclose(lengths, first.target_distance, rtol=1e-13)
    heights = np.degrees(np.arcsin(offsets[:, 2] / lengths))
    np.testing.assert_allclose(heights, np.repeat([80, 0, -80], COLUMNS), atol=1e-9)
    around = np.degrees(np.arctan2(offsets[:, 1], offsets[:, 0]))
    began = np.degrees(np.arctan2(first.eye[1] - volume.centre[1], first.eye[0] - volume.centre[0]))
    wanted = np.tile(60 * np.arange(COLUMNS), ROWS)
    np.testing.assert_allclose((around - began - wanted + 180) % 360, 180, atol=1e-9)


@pytest.mark.parametrize("axis", ["up", "x", "y", "z", "picture"])
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_the_box_is_in_every_row(axis: str, projection: Any) -> None:
    volume, turn = Volume(np.zeros((5, 20, 9)), (1, 1.7, 2.5)), orbit.Turn(axis, rows=5)
    first = orbit.framing(volume, projection, aspect=1.5, turn=turn)
    reach = 0.0
    for each in orbit.cameras(first, 5 * 24, turn, volume):
        right, up, depth = each.in_eye_space(volume.corners_from_centre, volume.centre).T
        scale = each.half_height * (depth if projection == "perspective" else 1)
        reach = max(reach, float((np.abs(up) / scale).max()), float((np.abs(right) / scale / 1.5).max()))
    assert 0.85 < reach <= 1


# The file.


def test_views_lose_quality_then_pixels_until_they_fit() -> None:
    noise = np.random.default_rng(0).random((64, 64, 4), np.float32)
    files = [views.first_encoded(noise)] * 5
    whole = sum(map(len, files))
    assert not views.fitted(files, whole).is_reduced
    told: list[int] = []
    fewer = views.fitted(files, whole * 2 // 3, told.append)
    assert told == [1, 2, 3, 4, 5]
    assert fewer.quality < 90 and fewer.scale == 1 and sum(map(len, fewer.files)) <= whole * 2 // 3
    small = views.fitted(files, whole // 8)
    assert small.scale < 1 and sum(map(len, small.files)) <= whole // 8
    with pytest.raises(InputError, match="5 views do not fit in .* MB: give a smaller --size"):
        views.fitted(files, 100)


def test_the_whole_page_fits_in_its_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pages, "ROOM", 120_000)
    noise = np.random.default_rng(0).random((16, 16, 16), np.float32)
    made = texvol.turn_page(noise, (12, 4), 128, tf="viridis", slices=True)
    assert 70_000 < len(made.html.encode()) <= 120_000
    assert "lowered to fit" in made.said


def test_the_page_shows_the_pictures_of_its_cameras(made: Path) -> None:
    data = data_of(made.read_text())
    assert (data["columns"], data["rows"], len(data["views"])) == (COLUMNS, ROWS, COLUMNS * ROWS)
    numbered = made.parent / "n_%02d.png"
    line = ["render", str(made.parent / "ramp.npy"), "--orbit", f"{COLUMNS}x{ROWS}", "--size", "96x64"]
    assert main([*line, "--background", "0.2,0,0", "--title", "<b>Ramp</b>", "-o", str(numbered)]) == 0
    wanted = [_picture(made.parent / f"n_{number:02d}.png") for number in range(COLUMNS * ROWS)]
    for number, view in enumerate(data["views"]):
        drawn = views._decoded(base64.b64decode(view)) / 255
        far = [float(np.mean((drawn - each) ** 2)) for each in wanted]
        assert np.argsort(far)[0] == number


def _picture(path: Path) -> np.ndarray:
    from texvol.formats.pictures import image

    return np.asarray(image.read(path)[..., :3], float)


def test_a_name_is_text_on_the_page(made: Path) -> None:
    html = made.read_text()
    assert "<b>Ramp" not in html and "&lt;b&gt;Ramp" in html
    assert not re.search(r"""(src|href)=["'](?!data:)""", html) and "http:" not in html and "https:" not in html


def test_a_page_tells_no_folder(tmp_path: Path) -> None:
    np.save(tmp_path / "für Ä.npy", ramp_volume().values)
    line = ["render", str(tmp_path / "für Ä.npy"), "--orbit", "2", "--size", "16", "-o", str(tmp_path / "a b.html")]
    assert main(line) == 0
    html = (tmp_path / "a b.html").read_text()
    assert "<title>für Ä.npy</title>" in html and "<dd>für Ä.npy</dd>" in html and str(tmp_path) not in html
    assert pages.last_name("scans/patient/") == "patient" and pages.last_name("/") == "/"


def test_python_gives_the_same_page_and_a_frame_for_notebooks(tmp_path: Path) -> None:
    made = texvol.turn_page(ramp_volume(), "4x2", 48, title='it\'s "it"')
    made.save(tmp_path / "a.html")
    assert (tmp_path / "a.html").read_text() == made.html
    frame = made._repr_html_()
    assert frame.startswith("<iframe srcdoc=") and frame.count('"') == frame.replace("&quot;", "").count('"')
    assert 'sandbox="allow-scripts"' in frame
    with pytest.raises(InputError, match="a.png: the name of a page must end with .html"):
        made.save(tmp_path / "a.png")
    with pytest.raises(InputError, match="views must be a number of views, .* got '4y2'"):
        texvol.turn_page(ramp_volume(), "4y2")


@pytest.mark.parametrize("size", [96, (640, 320)])
def test_a_frame_in_a_notebook_has_room_for_picture_and_buttons(
    browser: Browser,  # noqa: F811
    tmp_path: Path,
    size: int | tuple[int, int],
) -> None:
    made = texvol.turn_page(ramp_volume(), "2", size)
    made.save(tmp_path / "page.html")
    frame = made._repr_html_()
    height, width = (int(re.findall(rf'{name}[=:]"?(\d+)', frame)[-1]) for name in ("height", "max-width"))
    page = Page(browser, tmp_path / "page.html", width, height)
    assert page.tell("document.getElementById('bar').getBoundingClientRect().bottom") <= height
    page.close()


def test_slices_are_means_of_blocks_in_8_bits() -> None:
    volume = Volume(np.arange(4 * 6 * 8, dtype=np.float32).reshape(4, 6, 8), (1, 1, 2))
    data = samples.slice_data(volume)
    assert list(data["counts"]) == [8, 6, 4]
    coarse = samples._coarse(volume, [3, 2, 1])
    assert coarse.shape == (4, 3, 3)
    np.testing.assert_allclose(coarse[0, 0], [volume.values[0, :2, a:b].mean() for a, b in ((0, 3), (3, 6), (6, 8))])
    assert samples._steps(volume, 48) == [2, 2, 1], "blocks are about as long along every axis"


def test_missing_samples_of_slices_are_black_and_in_no_mean() -> None:
    values = np.full((4, 4, 4), -500.0, np.float32)
    values[:, :, 1] = 300
    values[:, :, 2:] = np.nan
    values[0, :, 2] = 100
    volume = Volume(values)
    levels = np.frombuffer(zlib.decompress(base64.b64decode(samples.slice_data(volume)["samples"])), np.uint8)
    row = levels.reshape(4, 4, 4)[2, 2]
    assert row[0] == row[2] == row[3] == 0 and row[1] == 255
    assert np.array_equal(samples._coarse(volume, [2, 1, 4])[0, 0], np.float32([-100, 100]))


# In the browser.


def test_dragged_by_the_mouse_the_view_follows_the_hand(browser: Browser, made: Path) -> None:  # noqa: F811
    page = Page(browser, made)
    page.wait_for("stage.dataset.view !== undefined")
    start = view_shown(page)
    assert start == (0, 1), "the row that is nearest to the scene's own view"
    x, y = page.middle("#stage")
    width = page.tell("stage.clientWidth")
    # Half a turn is the width of the picture; to the right, the camera goes to the left of the scene.
    page.drag([(x, y), (x + width / 6, y), (x + width / 3 + 2, y)])
    assert view_shown(page) == (COLUMNS - 1, 1)
    page.drag([(x, y), (x, y + width / 2)])
    assert view_shown(page) == (COLUMNS - 1, 0), "down: seen from higher"
    page.drag([(x, y), (x, y - 2 * width)])
    assert view_shown(page) == (COLUMNS - 1, ROWS - 1)
    page.close()


def test_from_disk_nothing_is_asked_for_and_nothing_complains(browser: Browser, made: Path) -> None:  # noqa: F811
    page = Page(browser, made)
    x, y = page.middle("#stage")
    page.drag([(x, y), (x + 200, y + 100)])
    page.wait_for(f"stage.dataset.view !== '{COLUMNS}'")
    page.wheel(x, y, -100)
    page.wait_for("zoom > 1")
    before = page.tell("stage.dataset.view")
    page.click("#play")
    page.wait_for(f"stage.dataset.view !== '{before}'")
    assert page.complaints() == [] and page.requests() == []
    page.close()


def test_keys_turn_and_zoom(browser: Browser, made: Path) -> None:  # noqa: F811
    page = Page(browser, made)
    page.tell("stage.focus()")
    page.key("ArrowRight")
    page.key("ArrowUp")
    assert view_shown(page) == (1, 0)
    assert page.tell("stage.ariaLabel") == "<b>Ramp</b>: view 2 of 6 around, row 1 of 3 from the top"
    page.key("+")
    assert zoom_of(page) == pytest.approx(1.25)
    page.key("Home")
    assert view_shown(page) == (0, 1) and zoom_of(page) == 1
    page.close()


def test_on_a_phone_one_finger_turns_and_two_zoom(browser: Browser, made: Path) -> None:  # noqa: F811
    page = Page(browser, made, 360, 640)
    page.call("Emulation.setTouchEmulationEnabled", enabled=True)
    x, y = page.middle("#stage")
    width = page.tell("stage.clientWidth")
    page.touch("touchStart", (x, y))
    page.touch("touchMove", (x - width / 6, y))
    page.touch("touchMove", (x - width / 3 - 2, y))
    page.touch("touchEnd")
    assert view_shown(page) == (1, 1)
    page.touch("touchStart", (x - 30, y), (x + 30, y))
    page.touch("touchMove", (x - 60, y), (x + 60, y))
    page.touch("touchEnd")
    assert zoom_of(page) == pytest.approx(2, rel=0.01)
    assert view_shown(page) == (1, 1), "two fingers do not turn"
    assert page.tell("document.documentElement.scrollWidth") <= 360
    page.call("Emulation.setTouchEmulationEnabled", enabled=False)
    page.close()


def test_slices_have_the_samples_in_the_orientation_of_radiology(browser: Browser, made: Path) -> None:  # noqa: F811
    page = Page(browser, made)
    page.wait_for("document.getElementById('slices').dataset.ready === 'yes'")
    data = data_of(made.read_text())["slices"]
    low, high, (centre, width) = data["low"], data["high"], data["window"]
    position = {"level": round((centre - low) / (high - low) * 1000), "window": round(width / (high - low) * 1000)}
    centre, width = low + position["level"] / 1000 * (high - low), position["window"] / 1000 * (high - low)
    levels = np.rint(np.clip((ramp_volume().values - low) / (high - low), 0, 1) * 255)
    grey = np.clip(255 * ((low + levels / 255 * (high - low) - centre) / width + 0.5), 0, 255)
    shown = page.tell(
        """[...document.querySelectorAll("figure canvas")].map(each => {
        const pixels = each.getContext("2d").getImageData(0, 0, each.width, each.height);
        return [pixels.width, pixels.height, [...pixels.data].filter((_, index) => index % 4 === 0)]; })"""
    )
    wanted = [grey[4], grey[::-1, 5], grey[::-1, :, 6]]
    for (wide, tall, pixels), expected in zip(shown, wanted, strict=True):
        # Half a level of the 8 bits, and its rounding to grey.
        np.testing.assert_allclose(np.reshape(pixels, (tall, wide)), expected, atol=1)
    page.close()
