"""Pixels held against the oracle: which are chosen, what follows of them, and where it is said."""

from __future__ import annotations

import json
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support import planted
from support.far_values import SIZE, VIEW, medium_to, wave
from support.picture_files import header

from texvol import Renderer, Scene, TransferFunction, Volume, raycast
from texvol.cli.command_line import main
from texvol.ray_casting import raycast_pixels
from texvol.rendering.checking import (
    ATTRIBUTE,
    Check,
    can_march,
    check_picture,
    chosen_pixels,
    errors_of,
    fraction_at_most,
    march_pixels,
)
from texvol.util.errors import AccuracyWarning, InputError

MISTAKE = ("vec4 texel_at(vec3 position)", "return texel_at_right(0.8 * position);")


def plain_scene(classification: str = "post", **more) -> Scene:
    return Scene(Volume(wave()), medium_to(1.0), VIEW, classification=classification, **more)


@pytest.mark.parametrize(
    ("size", "count"), [((512, 512), 256), ((640, 11), 100), ((3, 3), 9), ((1, 50), 7), ((7, 5), 1)]
)
def test_each_stratum_has_one_pixel(size: tuple[int, int], count: int) -> None:
    pixels = chosen_pixels(size, count)
    assert pixels.shape == (count, 2)
    assert len({tuple(pixel) for pixel in pixels}) == count
    assert (pixels >= 0).all() and (pixels < size).all()
    if count == 256:  # 16 x 16 squares of 32 pixels: hardly any without a pixel, none with many
        squares = np.bincount((pixels[:, 1] // 32) * 16 + pixels[:, 0] // 32, minlength=256)
        assert squares.max() <= 4 and (squares == 0).mean() < 0.2


def test_all_pixels_are_equally_likely() -> None:
    found = np.zeros((6, 10))
    for seed in range(600):
        for x, y in chosen_pixels((10, 6), 12, seed):
            found[y, x] += 1
    # 120 of each are expected, with a standard deviation under 11.
    assert np.abs(found - 120).max() < 50


def test_shares_are_those_of_clopper_and_pearson() -> None:
    # With none of n beyond, 1 - 0.01^(1/n); scipy.stats.beta.ppf(0.99, k + 1, n - k) for the others.
    assert fraction_at_most(0, 256) == pytest.approx(1 - 0.01 ** (1 / 256), abs=1e-12)
    assert fraction_at_most(0, 1) == pytest.approx(0.99)
    from scipy.stats import beta

    for k, n in ((1, 10), (3, 256), (100, 101), (500, 4096)):
        assert fraction_at_most(k, n) == pytest.approx(beta.ppf(0.99, k + 1, n - k), abs=1e-9)
    assert fraction_at_most(7, 7) == 1


def test_what_is_said_of_all_holds_in_99_of_100_samples() -> None:
    """A picture with 3 % of wrong pixels in a patch and sprinkled: the share said is under 3 % once in a hundred."""
    wrong = np.zeros((40, 50), bool)
    wrong[5:10, 8:16] = True
    wrong.reshape(-1)[::100] = True
    fraction, missed = wrong.mean(), 0
    for seed in range(1000):
        x, y = chosen_pixels((50, 40), 64, seed).T
        missed += fraction_at_most(int(wrong[y, x].sum()), 64) < fraction
    assert missed <= 22  # of 10 that are expected at most, 3.8 standard deviations


def test_errors_count_infinities_and_nan() -> None:
    drawn = np.array([[1, np.inf, np.nan, 0], [np.nan, 0, 0, 0], [np.inf, 0, 0, 0], [np.inf, 0, 0, 0]])
    truth = np.array([[1, np.inf, np.nan, 0.5], [1, 0, 0, 0], [1e300, 0, 0, 0], [5, 0, 0, 0]])
    np.testing.assert_array_equal(errors_of(drawn.astype(np.float32), truth), [0.5, np.inf, 0, np.inf])


@pytest.mark.parametrize("mode", ["composite", "xray", "mip", "isosurface"])
def test_chosen_pixels_of_the_oracle_are_its_own(mode: str) -> None:
    scene = Scene(
        Volume(wave()), camera=VIEW, mode=mode, isovalue=0.5 if mode == "isosurface" else None, classification="slab"
    )
    pixels = chosen_pixels((60, 45), 50)
    np.testing.assert_array_equal(
        raycast_pixels(scene, (60, 45), pixels), raycast(scene, (60, 45))[pixels[:, 1], pixels[:, 0]]
    )


@pytest.mark.parametrize("check", [20, "all"])
def test_a_check_finds_the_largest_error(check: int | str) -> None:
    scene = plain_scene(background=(0.2, 0.4, 0.6))
    with Renderer() as renderer:
        picture = renderer.render(scene, SIZE, sampling_rate=0.5, check=check)
        stats, found = renderer.stats, renderer.check
    errors = np.abs(picture - raycast(scene, SIZE)).max(axis=2)
    assert isinstance(found, Check)
    assert stats["check"] == json.loads(json.dumps(found.metadata))
    assert stats["estimated_error"] >= found.largest_error
    if check == "all":
        assert found.largest_error == errors.max() and found.pixels == found.of == errors.size
        assert f"all {errors.size} pixels checked" in found.sentence
    else:
        x, y = chosen_pixels(SIZE, 20).T
        assert found.largest_error == errors[y, x].max() and (found.beyond, found.pixels) == (0, 20)
        assert (errors > found.limit).mean() <= found.at_most


def test_a_check_says_how_many_are_beyond_what_was_wanted() -> None:
    scene = plain_scene()
    picture = raycast(scene, SIZE).astype(np.float32)
    picture[:4] += 0.1  # a tenth of the rows
    found = check_picture(picture, scene, 200, limit=0.01)
    assert 10 <= found.beyond <= 30
    assert 0.1 <= found.at_most < 0.25
    assert f"{found.beyond} of them beyond 0.01; 99 % confident that at most" in found.sentence


def test_no_check_is_nothing_in_stats() -> None:
    with Renderer() as renderer:
        renderer.render(plain_scene(), SIZE)
        assert "check" not in renderer.stats and renderer.check is None
        assert "check" not in renderer.seconds


@pytest.mark.parametrize("check", [0, -3, 2.5, True, "some", "12"])
def test_a_check_must_be_a_number_of_pixels(check) -> None:
    with Renderer() as renderer, pytest.raises(InputError, match="check must be a number of pixels of at least 1"):
        renderer.render(plain_scene(), SIZE, check=check)


@pytest.mark.parametrize("classification", ["post", "slab"])
def test_marching_knows_its_own_error(classification: str) -> None:
    scene = plain_scene(classification, background=(1.0, 0.5, 0.0))
    pixels = chosen_pixels(SIZE, 30)
    found, off = march_pixels(scene.completed(SIZE), SIZE, pixels)
    errors = np.abs(found - raycast_pixels(scene, SIZE, pixels)).max(axis=1)
    assert (errors <= 4 * off + 1e-6).all()
    assert off.max() < 0.02
    assert not can_march(plain_scene(mode="mip").completed(SIZE))


@pytest.mark.parametrize("classification", ["extinction", "post"])
def test_marching_does_not_stumble_over_the_faces_of_the_box(classification: str) -> None:
    """Where a step crosses the face of a medium both halves of its samples are off alike."""
    volume = Volume(np.random.default_rng(0).random((12, 10, 8)).astype(np.float32))
    medium = TransferFunction([0, 1], [(0.1, 0.2, 0.9), (1, 0.9, 0.5)], [0, 0.3])
    scene = Scene(volume, medium, classification=classification)  # type: ignore[arg-type]
    pixels = chosen_pixels(SIZE, 40)
    found, off = march_pixels(scene.completed(SIZE), SIZE, pixels)
    errors = np.abs(found - raycast_pixels(scene, SIZE, pixels)).max(axis=1)
    assert (errors <= 4 * off + 1e-6).all() and errors.max() < 2e-5


def test_what_steps_may_pass_over_is_not_marched() -> None:
    """A spike of a thousandth of the range: the picture sees it, and short steps would not."""
    positions = np.array([0, 0.5, 0.5005, 0.501, 1])
    spike = TransferFunction(positions, np.ones((5, 3)), np.array([0, 0, 300, 0, 0]))
    scene = Scene(Volume(np.random.default_rng(3).random((12, 12, 12))), spike, VIEW, classification="integrated")
    assert not can_march(scene.completed(SIZE))
    # Steps see nothing of it, all of them alike, and the oracle does.
    pixels = chosen_pixels(SIZE, 30)
    found, off = march_pixels(scene.completed(SIZE), SIZE, pixels)
    assert (np.abs(found - raycast_pixels(scene, SIZE, pixels)).max(axis=1) > 4 * off + 0.01).any()
    assert can_march(replace(scene, classification="slab").completed(SIZE))


def test_a_wanted_error_is_taken_back_where_pixels_disagree() -> None:
    scene = plain_scene()
    raycast(scene, (16, 16))  # so that the oracle is at hand
    raycast(scene, (16, 16))
    with planted.planted(MISTAKE) as wrong:
        with pytest.warns(AccuracyWarning, match=r"error of 0.01 not reached.* of \d+ checked pixels \d+ are beyond"):
            picture = wrong.render(scene, SIZE, max_error=0.01)
        error = np.abs(picture - raycast(scene, SIZE)).max()
        assert wrong.stats["check"]["pixels"] == 64
        assert 0.01 < wrong.stats["check"]["largest_error"] <= error + 1e-6
        assert wrong.stats["estimated_error"] >= wrong.stats["check"]["largest_error"]
    with Renderer() as right, warnings.catch_warnings():
        warnings.simplefilter("error")
        right.render(scene, SIZE, max_error=0.01)
        assert right.check is not None and right.check.beyond == 0


def test_a_wanted_error_is_taken_back_where_nobody_has_loaded_the_oracle(tmp_path: Path) -> None:
    code = f"""
import sys, warnings
sys.path[:0] = {[str(Path(__file__).parents[1])]!r}
import numpy as np
from texvol.util.errors import AccuracyWarning
from texvol import Scene, Volume, TransferFunction, Renderer
from support import planted
x = np.linspace(0, 1, 16)
values = np.sin(6 * x)[:, None, None] * np.cos(5 * x)[:, None] * np.sin(4 * x + 1)
scene = Scene(Volume(values), TransferFunction([-1, 0, 1], np.eye(3), [0, 0.1, 0.5]), classification="post")
with warnings.catch_warnings():
    warnings.simplefilter("error")
    with Renderer() as right:
        right.render(scene, (64, 64), max_error=0.01)
with planted.planted({MISTAKE!r}) as wrong, warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    wrong.render(scene, (64, 64), max_error=0.01)
    assert wrong.stats["estimated_error"] > 0.05
assert any("of 16 checked pixels" in str(each.message) for each in caught), caught
assert "numba" not in sys.modules
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_command_line_says_it_and_keeps_it_in_header_and_stats(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    np.save("wave.npy", wave())
    line = ["render", "wave.npy", "--size", "40x30", "--tf", "grey", "--stats", "s.json"]
    assert main([*line, "-o", "a.exr", "--check", "50"]) == 0
    said = capsys.readouterr().out
    assert "50 pixels checked: largest error" in said and "99 % confident that at most" in said
    stats = json.loads(Path("s.json").read_text())
    assert stats["check"]["sentence"] == said.splitlines()[0]
    assert json.loads(header(Path("a.exr"))[ATTRIBUTE]) == stats["check"]
    assert main([*line, "-o", "a.png", "--check", "all", "--max-error", "0.01"]) == 0
    assert "all 1200 pixels checked" in capsys.readouterr().out
    assert json.loads(header(Path("a.png"))[ATTRIBUTE])["limit"] == 0.01
    for wrong in (["--check", "0"], ["--check", "half"], ["--check", "9", "--orbit", "3"]):
        assert main([*line, "-o", "b_%d.png", *wrong]) == 2
        assert "--check" in capsys.readouterr().err
