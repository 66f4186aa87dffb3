"""Pictures of one scene in unlike formats are the same picture, and a real difference is found all the same."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import tifffile
from numpy.typing import NDArray
from support.picture_project import Project
from support.scenes import smooth_volume

from texvol import TransferFunction
from texvol.__main__ import main
from texvol.comparison.common_form import CommonForm
from texvol.comparison.judged import judged
from texvol.comparison.outcome import Outcome, examine
from texvol.comparison.pictures import Picture, read_picture
from texvol.formats.pictures import image
from texvol.util import color

pytest_plugins = ("pytester", "support.picture_project")

TRANSPARENT = ("--background", "transparent")
SCENES = {
    "plain": (),
    "over a background": ("--background", "0.2,0.5,0.9"),
    "transparent": TRANSPARENT,
    "lit": ("--light", "1,1,1", "--specular", "4", *TRANSPARENT),
    "glowing": ("--tf", "glow.json", *TRANSPARENT),
    "isosurface": ("--mode", "isosurface", "--isovalue", "0.5", "--specular", "3", *TRANSPARENT),
    "xray": ("--mode", "xray", "--air", "none", "--background", "0.2,0.5,0.9"),
    "xray above air": ("--mode", "xray", "--air", "0.2", "--background", "0.2,0.5,0.9"),
    "mip": ("--mode", "mip", *TRANSPARENT),
    "minip in colours": ("--mode", "minip", "--tf", "viridis"),
    "average in a window": ("--mode", "average", "--window", "0.4,0.3"),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A volume, and matter that gives more light than it hides."""
    position = tmp_path_factory.mktemp("forms")
    np.save(position / "wave.npy", smooth_volume(14).values)
    colors = np.array([[0.0, 0, 0], [0.9, 0.5, 0.2]])
    glow = TransferFunction(np.array([0.2, 1.0]), colors, np.array([0.0, 0.02]), emissive=True)
    (position / "glow.json").write_text(json.dumps(glow.as_json()))
    return position


def drawn(folder: Path, monkeypatch: pytest.MonkeyPatch, *options: str) -> tuple[Path, Path]:
    """The scene of these options as PNG and as EXR, drawn once."""
    monkeypatch.chdir(folder)
    png, exr = (folder / f"drawn{''.join(options)}.{kind}" for kind in ("png", "exr"))
    for path in (png, exr):
        if not path.exists():
            assert main(["render", "wave.npy", "-o", path.name, "--size", "44x36", *options]) == 0
    return png, exr


def both_ways(one: Picture, other: Picture) -> list[Outcome]:
    return [examine(*pair, explain=False) for pair in ((one, other), (other, one))]


@pytest.mark.parametrize("scene", SCENES)
def test_a_png_is_the_picture_that_the_exr_is(folder: Path, monkeypatch: pytest.MonkeyPatch, scene: str) -> None:
    png, exr = map(read_picture, drawn(folder, monkeypatch, *SCENES[scene]))
    for outcome in both_ways(png, exr):
        assert outcome.status == "same", outcome.violations
        assert not outcome.scene_changes


def test_an_xray_that_each_format_takes_its_own_air_for_is_two_scenes(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    png, exr = map(read_picture, drawn(folder, monkeypatch, "--mode", "xray"))
    for outcome in both_ways(png, exr):
        assert [change.part for change in outcome.scene_changes] == ["air"]


@pytest.mark.parametrize("scene", ["plain", "lit", "isosurface", "xray", "mip", "minip in colours"])
def test_a_real_difference_of_png_and_exr_is_found(folder: Path, monkeypatch: pytest.MonkeyPatch, scene: str) -> None:
    png, exr = map(read_picture, drawn(folder, monkeypatch, *SCENES[scene]))
    # 0.03 less light where there is some and it is not cut: more than the 0.02 that 8 bits round away there.
    shown = png.pixels[..., :3]
    changed = png.pixels.copy()
    seen = (shown > 0.1) & (shown < 0.9 * png.pixels[..., 3:])
    assert seen.any()
    changed[..., :3][seen] -= np.float32(0.03)
    for outcome in both_ways(replace(png, pixels=changed), exr):
        assert outcome.status == "different"


def test_light_beyond_opacity_is_cut_only_where_the_format_ends() -> None:
    light = np.full((8, 8, 4), 0.5, np.float32)
    light[..., 3] = 0.25
    exact = Picture.of_array(light, "exact")
    stored = image.eight_bits(light, transparent=True)
    assert (stored[..., :3] == 255).all()
    for outcome in both_ways(Picture.of_array(stored, "stored"), exact):
        assert outcome.passed and any("up to 0.25" in note for note in outcome.notes)
    stored[3, 4, 1] = 250  # the format had room for more
    for outcome in both_ways(Picture.of_array(stored, "stored"), exact):
        assert outcome.status == "different" and outcome.measures is not None
        assert outcome.measures.worst_pixel == (4, 3)


def test_opacity_counts_where_light_is_cut() -> None:
    light = np.full((8, 8, 4), 0.5, np.float32)
    light[..., 3] = 0.25
    stored = image.eight_bits(light, transparent=True)
    stored[2, 2, 3] += 3
    for outcome in both_ways(Picture.of_array(stored, "stored"), Picture.of_array(light, "exact")):
        assert outcome.status == "different"


def tiff(path: Path, pixels: NDArray, opacity: str | None) -> Picture:
    more = {} if opacity is None else {"extrasamples": [opacity]}
    tifffile.imwrite(path, pixels, photometric="rgb", **more)
    return read_picture(path)


def straight(pixels: NDArray) -> NDArray:
    opacity = np.clip(pixels[..., 3:], 0, 1)
    straight = np.divide(pixels[..., :3], opacity, out=np.zeros_like(pixels[..., :3]), where=opacity > 0)
    return np.dstack([color.srgb_from_linear(straight), opacity])


def over_black(pixels: NDArray) -> NDArray:
    return color.srgb_from_linear(pixels[..., :3])


def multiplied(pixels: NDArray) -> NDArray:
    whole = straight(pixels)
    return np.dstack([whole[..., :3] * whole[..., 3:], whole[..., 3:]])


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize(
    ("encoded", "opacity"), [(over_black, None), (straight, "unassalpha"), (multiplied, "assocalpha")]
)
@pytest.mark.parametrize("scene", ["plain", "transparent"])
def test_whole_numbers_in_a_tiff_are_the_picture_that_the_exr_is(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    scene: str,
    encoded: Callable[[NDArray], NDArray],
    opacity: str | None,
    bits: int,
) -> None:
    exr = read_picture(drawn(folder, monkeypatch, *SCENES[scene])[1])
    kind = {8: np.uint8, 16: np.uint16}[bits]
    found = tiff(tmp_path / "a.tif", np.rint(encoded(exr.pixels) * (2**bits - 1)).astype(kind), opacity)
    for outcome in both_ways(found, exr):
        assert outcome.status == "same", outcome.violations


def test_floats_without_opacity_in_a_tiff_are_the_exr_s_colours(tmp_path: Path) -> None:
    pixels = np.random.default_rng(2).random((9, 7, 4)).astype(np.float32)
    exr = tmp_path / "a.exr"
    image.write(exr, pixels)
    for outcome in both_ways(tiff(tmp_path / "a.tif", pixels[..., :3], None), read_picture(exr)):
        assert outcome.status == "same"


def test_a_jpeg_of_a_transparent_picture_has_the_right_channels(tmp_path: Path) -> None:
    pixels = np.full((16, 16, 4), 0.5, np.float32)
    for name in ("a.exr", "a.jpg"):
        image.write(tmp_path / name, pixels)
    for outcome in both_ways(read_picture(tmp_path / "a.jpg"), read_picture(tmp_path / "a.exr")):
        assert outcome.status != "broken", outcome.violations


def test_numbers_that_nobody_says_how_to_show_are_not_compared_with_colours(
    folder: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    png, exr = map(read_picture, drawn(folder, monkeypatch, "--mode", "mip"))
    colors = replace(png, attributes={})
    assert all(outcome.passed for outcome in both_ways(colors, exr))  # in the range of the volume, as found
    monkeypatch.chdir(tmp_path)
    lost = replace(exr, name="moved.exr", attributes={
        name: text.replace("wave.npy", "gone.npy") for name, text in exr.attributes.items()
    })  # fmt: skip
    for outcome in both_ways(colors, lost):
        assert outcome.status == "broken"
        assert any("display" in each and "unknown" in each for each in outcome.violations)


@pytest.mark.parametrize("scene", ["lit", "mip", "minip in colours", "over a background"])
def test_the_oracle_has_the_form_of_the_pictures(folder: Path, monkeypatch: pytest.MonkeyPatch, scene: str) -> None:
    png, exr = map(read_picture, drawn(folder, monkeypatch, *SCENES[scene]))
    outcome = judged(examine(png, exr, explain=False), required=True, explain=False)
    said = outcome.three_way
    assert said is not None and said.candidate_error is not None and said.reference_error is not None
    # One picture twice, but for rounding: of straight colour at most one level of 8 bits, 1/255 to the power 1/2.4.
    assert abs(said.candidate_error.max_error - said.reference_error.max_error) < 0.01
    assert said.verdict in ("sideways", "worse")


def test_the_picture_of_the_difference_is_of_what_was_compared(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    png, exr = drawn(folder, monkeypatch, *SCENES["xray"])
    assert main(["diff", png.name, exr.name, "--output", "d.exr"]) == 0
    assert image.read(folder / "d.exr")[..., :3].max() < 0.01


def test_a_test_may_hold_a_png_against_an_exr(project: Project) -> None:
    light = np.full((12, 12, 4), 0.4, np.float32)
    light[..., 3] = np.linspace(0.1, 1, 12, dtype=np.float32)
    project.references.mkdir()
    for name in ("opaque", "seen-through"):
        image.write(project.references / f"{name}.exr", light)
        image.write(project.folder / f"{name}.png", light, transparent=name != "opaque")
    project.write(
        test_it="""
@pytest.mark.parametrize("name", ["opaque", "seen-through"])
def test_it(check_picture, name):
    check_picture(f"{name}.png", name)
"""
    )
    project.run().assert_outcomes(passed=2)


def test_a_png_that_has_lost_its_opacity_is_not_its_reference(project: Project) -> None:
    light = np.full((12, 12, 4), 0.4, np.float32)
    light[..., 3] = 0.5
    image.write(project.folder / "a.png", light, transparent=True)
    project.check("'a.png'", "a")
    assert project.run("--texvol-update").ret == 0 and (project.references / "a.exr").exists()
    assert project.run().ret == 0
    flat = read_picture(project.folder / "a.png").pixels
    image.write(project.folder / "a.png", flat)
    result = project.run()
    assert result.ret == 11 and "3 channels, the reference 4" in "\n".join(result.outlines)


def test_the_end_of_a_format_is_known_per_channel() -> None:
    stored = np.zeros((1, 2, 4), np.uint8)
    stored[0, 0] = 255, 254, 0, 10
    stored[0, 1] = 255, 255, 255, 0
    form = CommonForm.of_pair(Picture.of_array(stored), Picture.of_array(np.ones((1, 2, 4), np.float32)))
    assert form.cut is not None
    np.testing.assert_array_equal(form.cut[0], [[True, False, False], [True, True, True]])
