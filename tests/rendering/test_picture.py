"""Pictures that know their scene and error, and stay arrays."""

from __future__ import annotations

import copy
import pickle
from pathlib import Path

import numpy as np
import PIL.Image
import pytest

import texvol
from texvol.comparison.pictures import read_picture
from texvol.formats.pictures import image
from texvol.provenance.stored_scene import stored_scene_of
from texvol.scene.camera import Camera

AXIS = np.linspace(-1, 1, 24)
Z, Y, X = np.meshgrid(AXIS, AXIS, AXIS, indexing="ij")
BALL = np.exp(-3 * (X * X + Y * Y + Z * Z)).astype(np.float32)
SIZE = (48, 32)


@pytest.fixture(scope="module")
def scene() -> texvol.Scene:
    return texvol.Scene(texvol.Volume(BALL, name="ball"), "viridis", background=(0.2, 0.1, 0.4))


@pytest.fixture(scope="module")
def drawn(scene: texvol.Scene) -> texvol.Picture:
    with texvol.Renderer() as renderer:
        return renderer.render(scene, SIZE, sampling_rate=1)


@pytest.fixture
def picture(drawn: texvol.Picture) -> texvol.Picture:
    """Copy of a picture that is drawn once; a test may change it."""
    return drawn.copy()


def test_a_picture_is_an_array(picture: texvol.Picture) -> None:
    assert isinstance(picture, np.ndarray)
    assert picture.shape == (32, 48, 4)
    assert picture.dtype == np.float32


@pytest.mark.parametrize(
    "compute",
    [
        lambda p: p * 2, lambda p: p + p, lambda p: np.sqrt(p), lambda p: p[4:8, 5], lambda p: p[..., 3],
        lambda p: p.max(axis=2), lambda p: np.concatenate([p, p]), lambda p: np.clip(p, 0, 1), lambda p: np.abs(p - p),
        lambda p: p[3, 4, 0], lambda p: np.where(p > 0.5, p, 0), lambda p: np.stack([p, p]), lambda p: p.mean(axis=0),
    ],
)  # fmt: skip
def test_what_is_computed_of_it_claims_nothing(picture: texvol.Picture, compute) -> None:
    found, plain = compute(picture), compute(np.asarray(picture))
    assert not isinstance(found, texvol.Picture)
    np.testing.assert_array_equal(found, plain)


@pytest.mark.parametrize("part", [np.s_[4:20], np.s_[4:20, 8:40], np.s_[::-1, ::2]])
def test_a_part_is_shown_as_the_picture_is_and_claims_nothing(picture: texvol.Picture, part, tmp_path: Path) -> None:
    found = picture[part]
    np.testing.assert_array_equal(found, np.asarray(picture)[part])
    assert found.scene is found.error is None and found.settings == found.stats == {}
    np.testing.assert_array_equal(found.to_srgb(), picture.to_srgb()[part])
    found.save(tmp_path / "part.png")
    assert not [key for key in read_picture(tmp_path / "part.png").attributes if key.startswith("texvol")]
    found[...] = 0
    assert not np.asarray(picture)[part].any(), "it is a view, as of any array"


def test_a_part_of_a_picture_of_numbers_is_numbers(scene: texvol.Scene) -> None:
    assert not isinstance(texvol.render(scene.replace(mode="mip"), SIZE)[4:20], texvol.Picture)


@pytest.mark.parametrize("how", ["u4", np.dtype("u4"), np.uint32])
def test_its_numbers_may_be_viewed_as_another_type(picture: texvol.Picture, how) -> None:
    np.testing.assert_array_equal(picture.view(how), np.asarray(picture).view(np.uint32))


@pytest.mark.parametrize("make", [lambda p: p.copy("F"), copy.copy, copy.deepcopy, lambda p: p.astype(np.float64)])
def test_a_copy_knows_as_much(picture: texvol.Picture, make) -> None:
    assert make(picture).scene is picture.scene is not None


@pytest.mark.parametrize("dumps", [pickle.dumps, lambda p: pickle.dumps(p, protocol=2)])
def test_it_knows_as_much_in_another_process(picture: texvol.Picture, dumps) -> None:
    sent = pickle.loads(dumps(picture))
    np.testing.assert_array_equal(sent, picture)
    assert sent.settings == picture.settings
    np.testing.assert_array_equal(sent.scene.volume.values, BALL)
    assert sent.error == pytest.approx(picture.error)
    picture[0] = 0
    assert len(pickle.dumps(picture)) < picture.nbytes + 1000 < len(dumps(sent))  # without a scene


def _set_through_plain_array(picture: texvol.Picture) -> None:
    np.asarray(picture)[3, 4] += 1


def _scale(picture: texvol.Picture) -> None:
    picture *= 2


_CHANGES = {
    "scaled": _scale, "set": lambda p: p.__setitem__((0, 0), 0.5), "row": lambda p: p[3].fill(0.5),
    "ufunc": lambda p: np.add(p, 1, out=p), "fill": lambda p: p.fill(0), "sort": lambda p: p.sort(axis=0),
    "copyto": lambda p: np.copyto(p, 0), "plain array": _set_through_plain_array, "ravel": lambda p: p.ravel().fill(0),
    "one digit": lambda p: p.view(np.uint32).ravel().__setitem__(5, 1), "flat": lambda p: p.flat.__setitem__(0, 3),
}  # fmt: skip


@pytest.mark.parametrize("change", _CHANGES.values(), ids=_CHANGES)
def test_a_changed_picture_is_no_longer_of_its_scene(picture: texvol.Picture, change, tmp_path: Path) -> None:
    before = picture.copy()
    change(picture)
    assert picture.scene is picture.error is None
    assert picture.settings == picture.stats == {}
    for name in ("a.exr", "a.png"):
        picture.save(tmp_path / name)
        assert not [key for key in read_picture(tmp_path / name).attributes if key.startswith("texvol")]
    assert "ball" not in repr(picture)
    picture[...] = before
    assert picture.scene is not None, "the numbers are those that were drawn"


@pytest.mark.parametrize(
    "make",
    [
        lambda p: p.swapaxes(0, 1), lambda p: np.roll(p, 1), np.zeros_like, lambda p: p.reshape(-1, 4),
        lambda p: p.byteswap(), lambda p: p.view(np.int32), lambda p: p.repeat(2, axis=0), lambda p: np.sort(p, axis=0),
    ],
)  # fmt: skip
def test_what_is_arranged_of_it_claims_nothing(scene: texvol.Scene, make) -> None:
    square = texvol.render(scene, 32, sampling_rate=1)
    made = make(square)
    assert getattr(made, "scene", None) is None


def test_an_array_of_another_shape_is_not_shown_as_a_picture(picture: texvol.Picture, tmp_path: Path) -> None:
    turned = picture.T
    assert turned._repr_png_() is None
    for use in (turned.to_srgb, lambda: turned.save(tmp_path / "a.png"), lambda: turned.save(tmp_path / "a.exr")):
        with pytest.raises(texvol.InputError, match=r"must have shape \(height, width, 4\), got \(4, 48, 32\)"):
            use()


def test_changed_numbers_are_still_shown_as_numbers(scene: texvol.Scene) -> None:
    picture = texvol.render(scene.replace(mode="mip"), SIZE)
    high = scene.volume.finite_range[1]
    picture[16, 20, 0] = high
    for each in (picture, pickle.loads(pickle.dumps(picture))):
        np.testing.assert_array_equal(each.to_srgb()[16, 18:22, 0] == 255, [False, False, True, False])


def test_its_scene_and_settings_draw_it_again(picture: texvol.Picture) -> None:
    assert picture.scene is not None
    again = texvol.render(picture.scene, SIZE, **picture.settings)
    np.testing.assert_array_equal(again, picture)


def test_stats_are_those_of_the_picture_and_not_of_a_later_one(scene: texvol.Scene) -> None:
    with texvol.Renderer() as renderer:
        coarse = renderer.render(scene, SIZE, sampling_rate=0.25)
        direct = renderer.stats["estimated_error"]
        fine = renderer.render(scene, SIZE, sampling_rate=4)
        assert coarse.stats["slab_thickness"] == pytest.approx(4)
        assert fine.stats is renderer.stats
    assert coarse.error == pytest.approx(direct, rel=1e-6)
    assert fine.error is not None
    assert coarse.error is not None
    assert fine.error < coarse.error / 4


def test_the_error_is_at_least_the_true_one(picture: texvol.Picture) -> None:
    assert picture.scene is not None
    truth = texvol.raycast(picture.scene, SIZE)
    assert picture.error is not None
    assert np.abs(picture - truth).max() <= 1.5 * picture.error
    assert picture.error < 0.1


def test_an_error_that_was_asked_for_is_known_without_drawing(scene: texvol.Scene, monkeypatch) -> None:
    picture = texvol.render(scene, SIZE, max_error=0.01)
    monkeypatch.setattr(texvol.Renderer, "render", lambda *_, **__: pytest.fail("drawn again"))
    assert picture.error is not None
    assert picture.error <= 0.01


def test_a_file_is_that_of_the_command(picture: texvol.Picture, tmp_path: Path) -> None:
    for name in ("a.exr", "a.png"):
        picture.save(tmp_path / name)
    np.testing.assert_array_equal(image.read(tmp_path / "a.exr"), picture)
    pixels = np.rint(image.read(tmp_path / "a.png") * 255)
    np.testing.assert_array_equal(pixels[..., :3], picture.to_srgb())
    assert picture.scene is not None
    header = read_picture(tmp_path / "a.exr").attributes
    stored = stored_scene_of(header, name="a.exr", volume=picture.scene.volume)
    np.testing.assert_array_equal(texvol.render(stored.scene, SIZE, **stored.settings), picture)


def test_a_picture_of_numbers_is_saved_in_a_window(scene: texvol.Scene, tmp_path: Path) -> None:
    picture = texvol.render(scene.replace(mode="mip"), SIZE)
    picture.save(tmp_path / "mip.png", window=(0.5, 1.0))
    pixels = image.read(tmp_path / "mip.png")
    middle, value = pixels[16, 24, 0], float(picture[16, 24, 0])
    assert middle == pytest.approx(value, abs=1 / 255)  # the encoded grey is linear in the value


def test_a_wrong_name_is_refused(picture: texvol.Picture, tmp_path: Path) -> None:
    with pytest.raises(texvol.InputError, match="must end with one of"):
        picture.save(tmp_path / "a.bmp")


def test_a_notebook_shows_it(picture: texvol.Picture, tmp_path: Path) -> None:
    (tmp_path / "shown.png").write_bytes(picture._repr_png_())
    np.testing.assert_array_equal(np.rint(image.read(tmp_path / "shown.png")[..., :3] * 255), picture.to_srgb())
    assert repr(picture) == str(picture) == "<Picture 48x32 of ball, error not estimated yet>"


def test_transparent_colours_are_straight(scene: texvol.Scene) -> None:
    picture = texvol.render(scene.replace(background=(0, 0, 0)), SIZE)
    straight = picture.to_srgb(transparent=True)
    assert straight.shape == (32, 48, 4)
    assert straight[0, 0, 3] == 0
    assert straight[16, 24, 3] > 0


def test_a_transparent_background_keeps_the_opacity_wherever_it_is_shown(tmp_path: Path) -> None:
    options = tmp_path / "scene.toml"
    np.save(tmp_path / "ball.npy", BALL)
    options.write_text('volume = "ball.npy"\ntf = "viridis"\nbackground = "transparent"\n', encoding="utf-8")
    for picture in (
        texvol.render(BALL, SIZE, tf="viridis", background="transparent"), texvol.render(options, SIZE),
        texvol.show(options, SIZE, interactive=False),
    ):  # fmt: skip
        kept = picture.to_srgb(transparent=True)
        for each in (picture, pickle.loads(pickle.dumps(picture)), picture.copy()):
            np.testing.assert_array_equal(each.to_srgb(), kept)
        assert kept[0, 0, 3] == 0 < kept[16, 24, 3]
        assert picture.to_srgb(transparent=False).shape == (32, 48, 3)
        picture.save(tmp_path / "a.png")
        (tmp_path / "b.png").write_bytes(picture._repr_png_())
        for name in ("a.png", "b.png"):
            np.testing.assert_array_equal(np.asarray(PIL.Image.open(tmp_path / name)), kept)


@pytest.mark.parametrize("mode", ["composite", "mip"])
def test_matplotlib_shows_it_in_srgb(scene: texvol.Scene, mode: str) -> None:
    figure = pytest.importorskip("matplotlib.figure").Figure()
    picture = texvol.render(scene.replace(mode=mode), SIZE)
    before = np.asarray(picture).copy()
    drawn = figure.subplots().imshow(picture)
    assert np.abs(255 * np.asarray(drawn.get_array()) - picture.to_srgb()).max() <= 0.51
    np.testing.assert_array_equal(picture, before)
    masked = np.ma.masked_invalid(picture)  # nobody else is given other numbers
    np.testing.assert_array_equal(masked.data, before)


def test_a_loop_goes_once_around(scene: texvol.Scene) -> None:
    with texvol.Renderer() as renderer:
        pictures = list(renderer.orbit(scene, 4, SIZE, sampling_rate=1))
        eyes = [np.subtract(each.scene.camera.eye, scene.volume.centre) for each in pictures]
        np.testing.assert_allclose(eyes[0] + eyes[2], 2 * np.mean(eyes, axis=0), atol=1e-6)
        assert len({each.tobytes() for each in pictures}) == 4
        with pytest.raises(texvol.InputError, match="whole number of at least 1, got 0"):
            next(renderer.orbit(scene, 0))


def test_a_loop_keeps_a_given_camera(scene: texvol.Scene) -> None:
    camera = Camera.perspective((90, 3, 40), (11, 11, 11), (0, 0, 1))
    with texvol.Renderer() as renderer:
        first = next(renderer.orbit(scene.replace(camera=camera), 3, SIZE, sampling_rate=1))
    assert first.scene is not None
    assert first.scene.camera == camera
