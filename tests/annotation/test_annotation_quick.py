"""Annotation over a moving picture, drawn by the device, is the annotation of the written picture."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import texvol
from texvol.annotation import Annotation, annotate
from texvol.annotation.quick import Parts, QuickAnnotation
from texvol.formats.pictures import image
from texvol.opengl.contexts import Context, open_context
from texvol.opengl.overlay import Line, Overlay, Patch, Triple
from texvol.scene.camera import Camera
from texvol.scene.measures.measure import Measure
from texvol.scene.scene import Scene
from texvol.scene.volume import Volume

SIZE = (320, 240)
ALL = Annotation(box=True, axes=True, orientation=True, legend=True, scale_bar=True, title="A title, gyq")


@pytest.fixture(scope="module")
def context() -> Iterator[Context]:
    opened = open_context("auto")
    yield opened
    opened.release()


def scene(background: tuple[float, float, float] = (0.0, 0.0, 0.0), camera: Camera | None = None) -> Scene:
    """A soft ball in a box that is not a cube, seen from aside."""
    z, y, x = np.mgrid[tuple(slice(-1, 1, 24 * 1j) for _ in range(3))]
    values = (200 * np.exp(-4 * (x**2 + y**2 + z**2))).astype(np.float32)
    volume = Volume(values, spacing=(1, 1.5, 2), space="right-anterior-superior", unit="mm")
    aside = camera or Camera.orthographic((70, -40, 30), (11.5, 17.25, 23), (0, 0, 1), height=70)
    return texvol.Scene(volume, camera=aside, background=background).completed(SIZE)


def drawn(context: Context, picture: NDArray, parts: Parts, background: Triple) -> NDArray[np.uint8]:
    """The picture with lines and patches over it, as the window shows it."""
    opacity = np.rint(np.clip(picture[..., 3:], 0, 1) * 255).astype(np.uint8)
    pixels = np.ascontiguousarray(np.concatenate([image.eight_bits(picture), opacity], axis=2))
    with context:
        gl = context.gl
        overlay, target = Overlay(gl), gl.framebuffer([gl.texture(SIZE, 4)])
        texture = gl.texture(SIZE, 4, pixels, alignment=1)
        target.use()
        overlay.draw(texture, SIZE, parts.lines, parts.patches, background)
        found = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(SIZE[1], SIZE[0], 3)[::-1]
        assert gl.error == "GL_NO_ERROR"
        overlay.release()
        texture.release()
    return found


def differences(context: Context, given: Scene, annotation: Annotation, *, transparent: bool = False) -> NDArray:
    """By how much each marked pixel differs from that of `annotate`, in steps of 8 bits."""
    picture = texvol.render(given, SIZE)
    wanted = image.eight_bits(annotate(picture, given, SIZE, annotation, transparent=transparent)).astype(int)
    parts = QuickAnnotation().parts(given, SIZE, annotation, transparent=transparent, window=None)
    found = drawn(context, picture, parts, given.background)
    plain = image.eight_bits(picture).astype(int)
    marked = (wanted != plain).any(axis=2)
    assert marked.sum() > 50, "something is drawn"
    assert (np.abs(found - plain).max(axis=2)[~marked] <= 1).all(), "and nothing elsewhere"
    return np.abs(found - wanted).max(axis=2)[marked]


@pytest.mark.parametrize("part", ["box", "axes", "orientation", "legend", "scale_bar", "title"])
def test_each_part_is_that_of_the_written_picture(context: Context, part: str) -> None:
    only = Annotation(**{part: "A title, gyq" if part == "title" else True})
    found = differences(context, scene((0.2, 0.3, 0.5)), only)
    # Eight bits of the picture below and of the blending are rounded once each. Where lines cross, the order in which
    # partly covered pixels are composited differs: a few pixels at corners of the box and at ticks.
    assert (found > 2).mean() < 0.04
    assert part in ("box", "axes") or found.max() <= 2


@pytest.mark.parametrize("background", [(0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (0.05, 0.2, 0.4)])
def test_all_of_it_is_that_of_the_written_picture(context: Context, background: tuple[float, float, float]) -> None:
    assert (differences(context, scene(background), ALL) > 2).mean() < 0.03


def test_in_perspective_with_colours_of_the_user_as_well(context: Context) -> None:
    camera = Camera.perspective((60, -40, 60), (11.5, 17.25, 23), (0, 0, 1), fov=40)
    own = replace(ALL, color=(0.9, 0.5, 0.1), font_size=13.0)
    assert (differences(context, scene((0.1, 0.1, 0.1), camera), own) > 2).mean() < 0.03
    inside = Camera.perspective((12, 12, 30), (11.5, 17.25, 23), (0, 0, 1), fov=60)
    assert (differences(context, scene((0.1, 0.1, 0.1), inside), ALL) > 2).mean() < 0.03


def test_a_transparent_picture_is_annotated_for_a_white_page(context: Context) -> None:
    assert (differences(context, scene(), ALL, transparent=True) > 2).mean() < 0.03


def test_measures_in_their_own_colours_and_widths_as_well(context: Context) -> None:
    measures = (
        Measure("ruler", ((2.0, 2.0, 2.0), (20.0, 30.0, 40.0))),
        Measure("box", ((5.0, 5.0, 5.0), (12.0, 20.0, 30.0))),
    )
    found = differences(context, scene((0.1, 0.1, 0.1)), Annotation(measures=measures))
    # A line over its outline is composited with the picture below both, in pixels that it covers in part.
    assert (found > 24).mean() < 0.04 and (found > 2).mean() < 0.3


def test_annotation_alone_has_the_colours_of_the_written_one_and_hides_only_what_it_covers(context: Context) -> None:
    given, black, white = scene(), np.zeros((*SIZE[::-1], 4), np.float32), np.ones((*SIZE[::-1], 4), np.float32)
    black[..., 3] = 1
    parts = QuickAnnotation().parts(given, SIZE, ALL, transparent=False, window=None)
    with context:
        overlay = Overlay(context.gl)
        for size in (SIZE, (64, 48), SIZE):
            texture = overlay.layer(size, parts.lines, parts.patches)
        pixels = np.frombuffer(texture.read(alignment=1), np.uint8).reshape(SIZE[1], SIZE[0], 4)[::-1].astype(float)
        assert context.gl.error == "GL_NO_ERROR"
        overlay.release()
    dark, light = (image.eight_bits(annotate(each, given, SIZE, ALL)).astype(float) for each in (black, white))
    is_covered, is_free = (pixels[..., 3] == 255), (pixels[..., 3] == 0)
    assert is_covered.sum() > 500 and is_free.mean() > 0.5
    assert (np.abs(pixels[..., :3] - dark).max(axis=2)[is_covered] <= 2).mean() > 0.97
    # An opacity that rounds to 0, below 1/510, of white over black is below 7 of 255 in sRGB.
    assert (dark[is_free] <= 7).all() and (light[is_free] >= 253).all()


def test_words_and_legends_are_drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    drawer, given = QuickAnnotation(), scene()
    first = drawer.parts(given, SIZE, ALL, transparent=False, window=None)
    again = drawer.parts(replace(given, camera=given.camera), SIZE, ALL, transparent=False, window=None)
    kept = {patch.key: patch.colors for patch in first.patches if patch.key[0] != "pixels"}  # type: ignore[index]
    assert len(kept) > 8
    assert all(kept[patch.key] is patch.colors for patch in again.patches if patch.key in kept)
    assert {patch.key for patch in again.patches} >= set(kept)
    other = replace(given, transfer_function=replace(given.transfer_function, name="another"))
    legends = [patch for patch in drawer.parts(other, SIZE, ALL, transparent=False, window=None).patches
               if patch.key[0] == "legend"]  # type: ignore[index]  # fmt: skip
    assert legends and not any(patch.key in kept for patch in legends), "another transfer function, another legend"


def test_an_atlas_that_is_full_is_begun_anew(context: Context, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("texvol.opengl.overlay._SIDE", 64)
    rng = np.random.default_rng(5)
    with context:
        gl = context.gl
        overlay, target = Overlay(gl), gl.framebuffer([gl.texture((200, 100), 4)])
        texture = gl.texture((200, 100), 4, bytes(80_000))
        target.use()
        for number in range(6):
            size = (90, 150) if number == 3 else (20, 30)
            colors = np.concatenate([rng.random((*size, 3)), np.ones((*size, 1))], axis=2)
            overlay.draw(texture, (200, 100), [], [Patch(number, colors, 7, 5)], (0.0, 0.0, 0.0))
            found = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(100, 200, 3)[::-1]
            part = found[5 : 5 + size[0], 7 : 7 + size[1]].astype(int)
            assert np.abs(part - image.eight_bits(colors.astype(np.float32))).max() <= 1
            assert not found[:5].any() and not found[5 + size[0] :].any()
        overlay.release()


@pytest.mark.parametrize("end", [(60.0, 20.0), (20.0, 70.0), (71.3, 55.2)])
def test_a_line_covers_what_it_covers_on_the_processor(context: Context, end: tuple[float, float]) -> None:
    from texvol.annotation import marks

    size, start, width, opacity = (96, 80), (20.4, 20.3), 2.3, 0.8
    mark = marks.line(start, end, width, (1.0, 1.0, 1.0), size, opacity)
    pixels = np.zeros((size[1], size[0], 4))
    marks.lay_over(pixels, mark)
    with context:
        gl = context.gl
        overlay, target = Overlay(gl), gl.framebuffer([gl.texture(size, 4)])
        texture = gl.texture(size, 4, bytes(4 * size[0] * size[1]))
        target.use()
        line = Line(start, end, (1.0, 1.0, 1.0), width, opacity)
        overlay.draw(texture, size, [line], [], (0.0, 0.0, 0.0))
        found = np.frombuffer(target.read(components=3, alignment=1), np.uint8).reshape(size[1], size[0], 3)[::-1]
        overlay.release()
    # A coverage of 1e-3 in float32 is 3 of 255 in sRGB.
    assert np.abs(found.astype(int) - image.eight_bits(pixels.astype(np.float32))).max() <= 3
