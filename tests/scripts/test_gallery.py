"""The gallery: its pictures of built-in volumes are those of the pages, and as near to the integral as they say."""

from __future__ import annotations

import json
import shlex
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.gallery import drawing as gallery
from support.gallery.entries import ENTRIES, Entry
from support.gallery.volumes import built_in
from support.real_data import DATA, real_volume

from texvol import Scene, Volume
from texvol.__main__ import main as texvol_main
from texvol.comparison.outcome import examine
from texvol.comparison.pictures import read_picture
from texvol.formats.pictures import image
from texvol.ray_casting import raycast
from texvol.rendering.renderer import Renderer

BUILT_IN = [entry for entry in ENTRIES.values() if entry.is_built_in]
REAL = [entry for entry in ENTRIES.values() if not entry.is_built_in]
SMALL = (48, 48)
TINY = (24, 24)  # for the oracle


def scene_of(entry: Entry) -> Scene:
    """The entry's scene for a small picture; the test is skipped where its file is not there."""
    if not entry.is_built_in:
        real_volume(entry.volume)
    scene = gallery.scene_of(entry, DATA, SMALL)
    assert scene is not None
    return scene


def thinned(scene: Scene, every: int = 2) -> Scene:
    """The scene with every second sample, or fewer, of its volume along each axis: small pictures need no more."""
    volume = scene.volume
    assert scene.mask is None and not scene.added and volume.colors is None
    spacing = [every * each for each in volume.spacing]
    values = volume.values[::every, ::every, ::every].copy()  # the volume's own can be freed
    about = {"unit": volume.unit, "space": volume.space, "labels": volume.labels}
    return replace(scene, volume=Volume(values, spacing, volume.origin, volume.direction, **about))


@pytest.mark.parametrize("entry", BUILT_IN, ids=lambda entry: entry.name)
def test_the_pages_show_what_is_drawn(entry: Entry, renderer: Renderer, tmp_path: Path) -> None:
    """Made with: python scripts/gallery.py --references. A quarter of each is drawn again: its middle."""
    stored = read_picture(gallery.REFERENCES / f"{entry.name}.png")
    width, height = gallery.reference_size(entry)
    assert stored.pixels.shape == (height, width, 4)
    left, top = width // 4, height // 4
    drawn = tmp_path / "drawn.png"
    part = gallery.reference(renderer, entry, (width - 2 * left, height - 2 * top))
    image.write(drawn, part, {"texvol:renderer": renderer.renderer_name})
    middle = {name: getattr(stored, name)[top : height - top, left : width - left] for name in ("pixels", "rounding")}
    outcome = examine(read_picture(drawn), replace(stored, **middle))
    assert outcome.passed, outcome.violations


def test_no_stored_picture_is_of_nothing() -> None:
    assert {path.stem for path in gallery.REFERENCES.glob("*.*")} == {entry.name for entry in BUILT_IN}


@pytest.mark.parametrize("entry", BUILT_IN, ids=lambda entry: entry.name)
def test_a_picture_is_as_near_to_the_oracle_as_it_says(entry: Entry, renderer: Renderer) -> None:
    scene = scene_of(entry)
    if entry.name == "cloud":
        scene = thinned(scene, 4)  # the oracle traces its shadows through every sample
    picture = renderer.render(scene, TINY, sampling_rate=entry.sampling_rate)
    error = np.abs(picture - raycast(scene, TINY)).max(axis=2)
    # On outlines a ray just meets a surface, or just not, whatever the estimate: one pixel in a hundred is let off.
    assert (error > renderer.stats["estimated_error"]).mean() <= 0.01
    if entry.name in ("galaxy", "cloud"):  # they have no outlines
        assert error.max() <= renderer.stats["estimated_error"]


def shows_something(levels: np.ndarray) -> bool:
    """True if a picture in 8 bits has contrast, and is not burnt out."""
    return bool(levels.astype(float).std() > 20 and (levels.min(axis=2) == 255).mean() < 0.02)


@pytest.mark.parametrize("entry", REAL, ids=lambda entry: entry.name)
def test_a_picture_shows_something_and_is_not_burnt_out(entry: Entry, renderer: Renderer) -> None:
    picture = gallery.draw(renderer, entry, thinned(scene_of(entry)), SMALL, supersampling=1)
    assert np.isfinite(picture).all()
    assert shows_something(image.eight_bits(picture))


def test_the_pictures_of_the_pages_show_something_and_are_not_burnt_out() -> None:
    pictures = {path.name: np.rint(image.read(str(path)) * 255) for path in gallery.REFERENCES.glob("*.png")}
    assert len(pictures) == len(BUILT_IN)
    assert not [name for name, levels in pictures.items() if not shows_something(levels)]


def test_random_fields_are_the_same_everywhere() -> None:
    values = built_in("cloud").values
    # Other builds of the Fourier transform, in float64, differ by less than float32 holds.
    found = values[[30, 45, 60], [40, 60, 56], [40, 50, 56]]
    np.testing.assert_allclose(found, [0.45850316, 0.47227004, 0.10105395], atol=1e-6)


def test_averaging_takes_the_mean_of_light() -> None:
    picture = np.zeros((4, 4, 4), np.float32)
    picture[:2, :2] = [[[1, 0, 0, 1], [0, 0, 0, 0]], [[0, 0, 0, 0], [1, 0, 0, 1]]]
    mean = gallery.averaged(picture, 2)
    assert mean.shape == (2, 2, 4)
    np.testing.assert_array_equal(mean[0, 0], [0.5, 0, 0, 0.5])
    assert not mean[1:].any()


@pytest.mark.parametrize("name", ["galaxy", "ripples"])
def test_the_command_of_the_page_makes_the_picture(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, renderer: Renderer
) -> None:
    entry = replace(ENTRIES[name], size=(160, 120))
    monkeypatch.setattr(gallery, "chosen_entries", lambda names: [entry])
    monkeypatch.setattr("sys.argv", ["gallery.py", "-o", str(tmp_path), "--quick"])
    assert gallery.main() == 0
    monkeypatch.chdir(tmp_path)
    page = Path("index.html").read_text(encoding="utf-8")
    command = gallery.command(entry, SMALL)
    assert page.count("<section>") == 1 and page.count("<img") == 1 + entry.depth
    assert command.split("--size")[0] in page.replace("&quot;", '"') and "http" not in page
    assert image.read(f"{name}.png").shape == (entry.size[1] // 2, entry.size[0] // 2, 3)
    assert not texvol_main(shlex.split(command)[1:])
    scene = gallery.scene_of(entry, DATA, SMALL)
    assert scene is not None
    drawn = gallery.draw(renderer, entry, scene, SMALL, supersampling=1)
    np.testing.assert_array_equal(np.rint(image.read(f"{name}.png") * 255), image.eight_bits(drawn))
    if entry.transfer_function:
        assert json.loads(Path(f"{name}.json").read_text(encoding="utf-8")) == entry.transfer_function


def test_an_unknown_picture_is_refused_with_the_list(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["gallery.py", "-o", "nowhere", "--only", "orbital,rembrandt"])
    assert gallery.main() == 2
    said = capsys.readouterr().err
    assert "rembrandt" in said and all(name in said for name in ENTRIES) and not Path("nowhere").exists()


def test_pictures_of_absent_files_are_left_out_and_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["gallery.py", str(tmp_path), "-o", str(tmp_path / "new"), "--only", "tooth"])
    assert gallery.main() == 0
    assert str(tmp_path / "tooth/tooth.nhdr") in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["index.html"]
