"""Arrays that were given are read-only here, and one that is changed elsewhere gives an error and no old picture."""

from __future__ import annotations

import copy
import pickle
import time
from collections.abc import Callable
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.scenes import FOG, smooth_volume

import texvol
from texvol import (
    AddedVolume,
    Camera,
    ClipPlane,
    DepthCue,
    Estimator,
    Light,
    Lighting,
    Mask,
    Scene,
    TransferFunction,
    Volume,
)
from texvol.annotation import Annotation
from texvol.comparison import compare
from texvol.comparison.limits import ONE_DRIVER
from texvol.formats.readers import TimeSeries
from texvol.geometry import Lines, Mesh
from texvol.rendering.renderer import Renderer
from texvol.scene.transfer.graded import Contour, Graded
from texvol.scene.transfer.materials import Material
from texvol.util.errors import ContextError, InputError
from texvol.util.kept_arrays import checksum

SIZE = (24, 20)
DTYPES = ["u1", "i1", "u2", "i4", "u8", "f2", "f4", "f8", "?", ">f4", ">i2"]


def wave(dtype: str = "f4", samples: int = 12) -> np.ndarray:
    return (100 * smooth_volume(samples).values).astype(dtype)


@pytest.mark.parametrize("dtype", DTYPES)
def test_the_values_of_a_volume_are_read_only(dtype: str) -> None:
    array = wave(dtype)
    volume = Volume(array)
    with pytest.raises(ValueError, match="read-only"):
        volume.values[0, 0, 0] = 1
    array[0, 0, 0] = 1  # which stays its owner's


def test_other_arrays_are_read_only() -> None:
    volume = Volume(np.ones((2, 3, 4)), colors=np.ones((2, 3, 4, 3)))
    graded = Graded(np.array([0.0, 1]), np.ones((2, 3)), np.ones(2), 0, 1)
    medium = TransferFunction([0, 1], np.ones((2, 3)), [0, 1], modulation=[[0, 0], [1, 1]], graded=(graded,))  # type: ignore[arg-type]
    mesh = Mesh(np.eye(3), np.array([[0, 1, 2]]), normals=np.eye(3))
    lines = Lines(np.eye(3), np.array([[0, 1]]))
    kept = [volume.spacing, volume.origin, volume.direction, volume.colors, Mask(np.ones((2, 3, 4))).weights]
    kept += [medium.values, medium.colors, medium.extinctions, medium.modulation]
    kept += [graded.values, graded.emissions, graded.extinctions]
    kept += [mesh.vertices, mesh.triangles, mesh.normals, lines.points, lines.segments]
    for array in kept:
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0


def test_short_arrays_become_numbers() -> None:
    """So that a change in place of what was given changes nothing, and frozen objects can be compared."""
    given = np.array([1.0, 2, 3])
    plane, light = ClipPlane(given, 2), Light("directional", given, given)  # type: ignore[arg-type]
    camera = Camera.perspective(given, 2 * given, given[::-1])  # type: ignore[arg-type]
    scene = Scene(Volume(wave()), background=given, clip=(plane,), crop=np.array([[0, 9.0]] * 3), classification="slab")  # type: ignore[arg-type]
    given[...] = 7
    assert plane == ClipPlane((1, 2, 3), 2) and light.vector == light.color == (1, 2, 3)
    assert camera.eye == (1, 2, 3) and camera.up == (3, 2, 1)
    assert scene.background == (1, 2, 3) and scene.crop == ((0, 9),) * 3
    assert len({plane, ClipPlane((1, 2, 3), 2)}) == 1


CHANGES: dict[str, Callable[[np.ndarray], Any]] = {
    "all": lambda a: a.fill(3),
    "one sample": lambda a: a.__setitem__((3, 4, 5), a[3, 4, 5] + 1),
    "the last": lambda a: a.__setitem__((-1, -1, -1), a[-1, -1, -1] + 1),
    "turned": lambda a: a.__setitem__(..., a[::-1].copy()),
    "rolled": lambda a: a.__setitem__(..., np.roll(a, 1, axis=2)),
    "two swapped": lambda a: a.__setitem__(([2, 5], 1, 7), a[[5, 2], 1, 7].copy()),
}


# Each change of small and of large samples, of all kinds.
CHANGED = [(what, dtype) for number, what in enumerate(CHANGES) for dtype in (("u1", "f4"), ("i2", "f8"))[number % 2]]


@pytest.mark.parametrize("what, dtype", CHANGED)
def test_a_change_in_place_is_an_error_when_it_is_drawn(renderer: Renderer, what: str, dtype: str) -> None:
    array = wave(dtype, 13)
    scene = Scene(Volume(array, name="mine"), FOG, classification="slab")
    renderer.render(scene, SIZE)
    CHANGES[what](array)
    with pytest.raises(InputError, match="mine: samples were changed in place"):
        renderer.render(scene, SIZE)
    with pytest.raises(InputError, match="make a new Volume of the array"):
        texvol.raycast(scene, SIZE)
    now = renderer.render(Scene(Volume(array), FOG, classification="slab"), SIZE)
    np.testing.assert_array_equal(now, renderer.render(Scene(Volume(array.copy()), FOG, classification="slab"), SIZE))


@pytest.mark.parametrize(
    "kind", ["mask", "mask of booleans", "colours", "added", "added mask", "view", "not contiguous"]
)
def test_every_array_of_a_scene_is_looked_at(renderer: Renderer, kind: str) -> None:
    array = wave()
    weights = np.ones(array.shape, np.float32) if kind == "mask" else np.ones(array.shape, np.bool_)
    colors = np.ones((*array.shape, 3), np.float32)
    given = {"mask": weights, "mask of booleans": weights, "colours": colors, "added mask": weights}.get(kind, array)
    if kind.startswith("mask"):
        scene = Scene(Volume(wave()), FOG, mask=Mask(weights), classification="slab")
    elif kind.startswith("added"):
        mask = Mask(weights) if kind == "added mask" else None
        scene = Scene(Volume(wave()), FOG, added=(AddedVolume(Volume(array), FOG, mask),), classification="slab")
    elif kind == "colours":
        scene = Scene(Volume(array, colors=colors), FOG, classification="slab")
    else:
        part = array[2:] if kind == "view" else array.transpose(2, 1, 0)
        scene = Scene(Volume(part), FOG, classification="slab")
    before = renderer.render(scene, SIZE)
    given[5:, 5:] = 0
    if kind in ("mask", "not contiguous"):  # of which the object has a copy
        np.testing.assert_array_equal(renderer.render(scene, SIZE), before)
        return
    with pytest.raises(InputError, match="were changed in place"):
        renderer.render(scene, SIZE)


def test_an_array_may_be_filled_before_it_is_looked_at(renderer: Renderer) -> None:
    array = np.zeros((12, 12, 12), np.float32)
    scene = Scene(Volume(array), FOG, classification="slab")
    array[...] = wave()
    np.testing.assert_array_equal(
        renderer.render(scene, SIZE), renderer.render(Scene(Volume(wave()), FOG, classification="slab"), SIZE)
    )
    other = Volume(array)
    assert other.finite_range is not None
    array[...] = 0
    with pytest.raises(InputError, match="changed in place"):
        renderer.render(Scene(other, FOG, classification="slab"), SIZE)


def test_a_moved_volume_is_of_the_same_array(renderer: Renderer) -> None:
    array = wave()
    volume = Volume(array)
    renderer.render(Scene(volume, FOG, classification="slab"), SIZE)
    array[...] = 0
    with pytest.raises(InputError, match="changed in place"):
        renderer.render(Scene(volume.moved(np.eye(4)), FOG, classification="slab"), SIZE)


def test_a_file_is_nobody_elses(tmp_path: Path) -> None:
    np.save(tmp_path / "v.npy", wave())
    assert texvol.load(tmp_path / "v.npy")._unchanged._arrays == []


def test_a_look_at_a_large_array_takes_no_time_and_sees_what_is_more_than_a_few_samples() -> None:
    """256³ samples; a bound of 5 ms leaves the measured 0.1 ms room on a busy machine."""
    array = np.random.default_rng(0).integers(0, 99, (256, 256, 256)).astype(np.uint8)
    before = checksum(array)
    begun = time.perf_counter()
    for _ in range(10):
        checksum(array)
    assert (time.perf_counter() - begun) / 10 < 5e-3
    for z, y, x in np.random.default_rng(1).integers(0, 236, (100, 3)):
        array[z : z + 20, y : y + 20, x : x + 20] += 1
        assert checksum(array) != before
        array[z : z + 20, y : y + 20, x : x + 20] -= 1
    assert checksum(array) == before


@pytest.mark.parametrize(
    "shape", [(1, 1, 1), (1, 1, 7), (8, 1, 1), (3, 5, 7), (61, 8, 1), (128, 128, 64), (131, 127, 67)]
)
@pytest.mark.parametrize("dtype", ["u1", "u2", "f8"])
def test_arrays_of_every_size_have_a_checksum(shape: tuple[int, int, int], dtype: str) -> None:
    array = np.zeros(shape, dtype)
    before = checksum(array)
    array[...] += np.arange(array.size).reshape(shape).astype(dtype)
    array[0, 0, 0] += 1
    assert checksum(array) != before


def public_objects(folder: Path) -> dict[str, Any]:
    """One of each class whose objects are data."""
    np.save(folder / "v.npy", wave())
    volume, labels = texvol.load(folder / "v.npy"), Volume((wave() / 30).astype(np.int16), labels=True)
    colored = Volume(wave(), colors=np.ones((12, 12, 12, 3)), notes=("a",), unit="mm", resampling={"grid": "b"})
    graded = Graded(np.array([0.0, 1]), np.ones((2, 3)), np.ones(2), 0, 1)
    medium = TransferFunction(
        [0, 100], np.ones((2, 3)), [0, 1], graded=(graded,), contours=(Contour(50, 2, (1, 1, 1), 1),)
    )  # type: ignore[arg-type]
    mesh, lines = Mesh(10 * np.eye(3), np.array([[0, 1, 2]])), Lines(np.eye(3), np.array([[0, 1]]))
    camera = Camera.framing(volume, "perspective")
    mask = Mask(wave() > 40)
    light = Light("directional", (1, 2, 3))
    scene = Scene(
        volume, medium, camera, lighting=Lighting((light,)), mask=mask, geometry=(mesh, lines), classification="post"
    )
    several = Scene(
        Volume(wave()), FOG, added=(AddedVolume(labels), AddedVolume(volume, FOG, mask)), classification="slab"
    )
    objects = [
        volume, labels, colored, Volume(wave()), graded, medium, mesh, lines, camera, mask, light, Lighting((light,)),
        scene, several, several.added[0], DepthCue(), ClipPlane((1, 0, 0), 2), Estimator("gaussian", 2.0),
        Annotation(box=True, title="a"), ONE_DRIVER, compare(np.zeros((2, 2, 4)), np.ones((2, 2, 4))),
        TimeSeries(folder / "v.npy"), Material("a", (0, 1), None, (1, 1, 1), 2.0), InputError("a"), ContextError("b"),
        texvol.MissingExtraError("c"),
    ]  # fmt: skip
    return {f"{type(each).__name__} {number}": each for number, each in enumerate(objects)}


def by_pickle(thing: Any) -> Any:
    return pickle.loads(pickle.dumps(thing))


def by_old_pickle(thing: Any) -> Any:
    return pickle.loads(pickle.dumps(thing, protocol=2))


METHODS: list[Callable[[Any], Any]] = [by_pickle, by_old_pickle, copy.deepcopy, copy.copy]


def assert_alike(one: Any, other: Any) -> None:
    assert type(one) is type(other)
    if isinstance(one, np.ndarray):
        np.testing.assert_array_equal(one, other)
        assert one.dtype == other.dtype
        assert other.flags.writeable <= one.flags.writeable
    elif isinstance(one, tuple | list):
        assert len(one) == len(other)
        for a, b in zip(one, other, strict=True):
            assert_alike(a, b)
    elif hasattr(one, "__dict__") and type(one).__module__.startswith("texvol"):
        assert vars(one).keys() == vars(other).keys()
        for name in vars(one):
            assert_alike(vars(one)[name], vars(other)[name])
    elif not callable(one):
        assert one == other or one is other or repr(one) == repr(other)


@pytest.mark.parametrize("method", METHODS)
def test_data_can_be_copied_and_sent(tmp_path: Path, method: Callable[[Any], Any]) -> None:
    for name, thing in public_objects(tmp_path).items():
        found = method(thing)
        assert type(found) is type(thing), name
        assert_alike(thing, found)


@pytest.mark.parametrize("method", METHODS)
def test_a_copy_of_a_scene_is_the_same_picture(
    renderer: Renderer, tmp_path: Path, method: Callable[[Any], Any]
) -> None:
    """Also after the first one was drawn, with all that is kept of it by then."""
    for thing in public_objects(tmp_path).values():
        if isinstance(thing, Scene):
            expected = renderer.render(thing, SIZE)
            found = method(thing)
            np.testing.assert_array_equal(renderer.render(found, SIZE), expected)
            np.testing.assert_array_equal(renderer.render(thing, SIZE), expected)
            with pytest.raises(ValueError, match="read-only"):
                found.volume.values[0, 0, 0] = 1
            with pytest.raises(AttributeError):
                found.mode = "mip"


def test_a_copy_is_another_array(renderer: Renderer) -> None:
    array = wave()
    scene = Scene(Volume(array), FOG, classification="slab")
    picture = renderer.render(scene, SIZE)
    other = copy.deepcopy(scene)
    array[...] = 0
    np.testing.assert_array_equal(renderer.render(other, SIZE), picture)


def _drawn(scene: Scene) -> np.ndarray:
    return texvol.raycast(scene, (4, 4))


def test_scenes_are_arguments_of_a_pool() -> None:
    scene = Scene(Volume(wave()), FOG, classification="slab")
    with get_context("spawn").Pool(1) as pool:
        (picture,) = pool.map(_drawn, [scene])
    np.testing.assert_array_equal(picture, _drawn(scene))


def test_a_source_of_any_mapping_is_sent_too() -> None:
    from types import MappingProxyType

    told = MappingProxyType({"built_in": "demo"})
    assert by_pickle(Volume(wave(), source=told)).source == {"built_in": "demo"}
    assert by_pickle(Mask(wave() > 1, source=told)).source == {"built_in": "demo"}
