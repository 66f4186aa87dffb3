"""Textures hold what was baked, stay as long as there is room, and never take more than the budget."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from support.scenes import BONE, FOG, random_volume, smooth_volume

from texvol.opengl import texture_store
from texvol.opengl.contexts import Context, open_context
from texvol.opengl.texture_store import BakedTexture, TextureStore
from texvol.rendering.render import bake
from texvol.rendering.renderer import Renderer
from texvol.scene.camera import Camera
from texvol.scene.scene import Scene
from texvol.scene.transfer import TransferFunction
from texvol.scene.volume import Volume
from texvol.textures.slab_texture import TEXEL_TYPES
from texvol.util.errors import InputError

MARGIN = (1, 2, 1)
BYTES = {"rgba8": 4, "rgba16f": 8, "rgba32f": 16, "r16": 2, "r16f": 2, "r32f": 4}
TYPES = TEXEL_TYPES | {"r16": np.uint16, "r16f": np.float16, "r32f": np.float32}


def baked_of(volume: Volume, texel_format: str = "rgba32f", medium: TransferFunction = BONE) -> BakedTexture:
    classification = "post" if texel_format.startswith("r1") or texel_format == "r32f" else "extinction"
    scene = Scene(volume, medium, classification=classification)  # type: ignore[arg-type]
    return bake(scene.completed((8, 8)), 1.0, texel_format)


@pytest.fixture(scope="module")
def own_context() -> Iterator[Context]:
    """Not the session's: what a store gives back is freed at once."""
    opened = open_context()
    yield opened
    opened.release()


@pytest.fixture
def store(own_context: Context) -> Iterator[TextureStore]:
    """One with a budget of 100 kB."""
    with own_context:
        opened = TextureStore(own_context, 100_000)
        yield opened
        opened.release()
        assert own_context.gl.error == "GL_NO_ERROR"


@pytest.mark.parametrize("texel_format", BYTES)
@pytest.mark.parametrize("budget", [16_000, 10_000_000])
@pytest.mark.parametrize("slice_bytes", [1, 800, 8 << 20])
def test_a_texture_holds_the_texels_of_its_brick(
    store: TextureStore, monkeypatch: pytest.MonkeyPatch, texel_format: str, budget: int, slice_bytes: int
) -> None:
    """Whatever slices they are written in; beyond the end of the volume the last sample goes on."""
    monkeypatch.setattr(texture_store, "_SLICE_BYTES", slice_bytes)
    kind = {"r16": np.uint16, "r16f": np.float16}.get(texel_format, np.float32)
    volume = Volume((random_volume(0, (18, 26, 20)).values * (60000 if kind == np.uint16 else 1)).astype(kind))
    baked = baked_of(volume, texel_format)
    assert baked.texel_format == texel_format
    store.budget = budget
    store.prepare(baked, volume, (volume,), MARGIN)
    whole = baked.texels()
    for brick in store.bricks:
        texture = store.resources(brick)["texels"]
        nx, ny, nz = texture.size
        held = np.frombuffer(texture.read(alignment=1), TYPES[texel_format]).reshape(
            nz, ny, nx, baked.formats["texels"][1]
        )
        z, y, x = (slice(*ends) for ends in zip(brick.stored_first[::-1], brick.stored_last[::-1], strict=True))
        beyond = [(0, int(room)) for room in brick.has_room_beyond[::-1]] + [(0, 0)]
        expected = np.pad(whole[z, y, x], beyond, mode="edge")
        dz, dy, dx, _ = expected.shape
        np.testing.assert_array_equal(held[:dz, :dy, :dx], expected)
    assert (len(store.bricks) == 1) == (whole.nbytes <= budget)
    assert store.uploads == len(store.bricks)


CONSTANT = [Volume(np.full(size, 0.7, np.float32)) for size in ((9, 9, 9), (20, 30, 25), (40, 8, 70))]


@cache
def baked_once(which: int, texel_format: str) -> BakedTexture:
    return baked_of(CONSTANT[which], texel_format)


@settings(max_examples=15, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(st.tuples(st.integers(0, 2), st.sampled_from(list(TEXEL_TYPES)), st.integers(0, 99)), max_size=25))
def test_textures_never_take_more_than_the_budget(store: TextureStore, wanted: list[tuple[int, str, int]]) -> None:
    """Whatever is asked for in whatever order, bricks of other volumes and formats included."""
    for which, texel_format, number in wanted:
        volume = CONSTANT[which]
        store.prepare(baked_once(which, texel_format), volume, (volume, texel_format), MARGIN)
        brick = store.bricks[number % len(store.bricks)]
        assert store.resources(brick)["texels"].size == brick.texture_size
        assert np.prod(brick.texture_size) * BYTES[texel_format] <= store.bytes <= store.budget


def test_what_is_there_is_not_uploaded_again(store: TextureStore) -> None:
    volume = smooth_volume(16)
    baked = baked_of(volume)
    for again in range(3):
        store.prepare(baked, volume, (volume, BONE, 1.0), MARGIN)
        first = store.resources(store.bricks[0])
        assert store.uploads == 1, again
    # Other texels go where the old ones were.
    thinner = baked_of(volume, medium=FOG)
    store.prepare(thinner, volume, (volume, FOG, 1.0), MARGIN)
    assert store.resources(store.bricks[0])["texels"] is first["texels"]
    assert store.uploads == 2
    store.prepare(thinner, volume, (volume, FOG, 1.5), MARGIN)
    store.resources(store.bricks[0])
    assert store.uploads == 3


def test_the_bricks_of_a_large_volume_share_a_few_textures_until_they_are_drawn_again(
    store: TextureStore, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(texture_store, "_LARGE", 500_000)
    monkeypatch.setattr(texture_store, "_LARGE_BRICK", 120_000)
    monkeypatch.setattr(texture_store, "_AT_FIRST", 260_000)
    store.budget = 10_000_000
    volume = Volume(random_volume(0, (20, 20, 90)).values)  # 576 kB
    baked = baked_of(volume)
    for picture in range(4):
        store.prepare(baked, volume, (volume,), MARGIN)
        assert len(store.bricks) > 4 and {brick.texture_size for brick in store.bricks} == {(20, 20, 16)}
        uploads = store.uploads
        for brick in store.bricks:
            store.resources(brick)
            assert store.bytes <= (260_000 if picture == 0 else 10_000_000)
        # The second picture bakes what the first one gave away, the others nothing.
        assert (store.uploads - uploads > 0) == (picture < 2)
    store.prepare(baked, volume, (volume, "others"), MARGIN)
    for brick in store.bricks:
        store.resources(brick)
    assert store.bytes == store.bytes_of_all  # what is there already is written again
    store.prepare(baked, volume, (volume,), MARGIN, alone=False)
    assert len(store.bricks) == 1


def test_bricks_that_fit_stay_for_the_next_picture(store: TextureStore) -> None:
    """Of n bricks in a budget of k at least k - 1 stay, however often all are drawn in their order."""
    volume = Volume(random_volume(0, (40, 40, 40)).values)
    store.prepare(baked_of(volume), volume, (volume,), MARGIN)
    count = len(store.bricks)
    room = store.budget // (int(np.prod(store.bricks[0].texture_size)) * 16)
    assert 4 <= room < count
    for picture in range(1, 4):
        before = store.uploads
        for brick in store.bricks:
            store.resources(brick)
        assert store.uploads - before <= (count if picture == 1 else count - room + 1)
    before = store.uploads
    store.resources(store.bricks[0])
    store.resources(store.bricks[1])
    assert store.uploads == before, "those that are drawn first are still there"


def test_the_transfer_function_of_values_is_a_table_and_no_texel(store: TextureStore) -> None:
    volume = smooth_volume(16)
    opaque = TransferFunction(np.array([0.0, 1]), np.ones((2, 3)), np.array([0, np.inf]))
    found = []
    for medium in (opaque, replace(opaque, colors=np.zeros((2, 3))), BONE, opaque):
        store.prepare(baked_of(volume, "r32f", medium), volume, (volume,), MARGIN)
        resources = store.resources(store.bricks[0])
        assert set(resources) == ({"texels"} if medium is BONE else {"texels", "segments", "segment_grid"})
        found.append(resources["texels"])
    assert store.uploads == 1
    assert all(texture is found[0] for texture in found)


def test_a_budget_with_no_room_for_a_brick_is_an_error_and_leaves_what_was(store: TextureStore) -> None:
    small, large = smooth_volume(16), Volume(np.zeros((64, 64, 64), np.float32))
    store.prepare(baked_of(small), small, (small,), MARGIN)
    store.resources(store.bricks[0])
    with pytest.raises(InputError, match=r"^a brick of this volume needs .* MB of texture memory, got 0.025 MB$"):
        store.prepare(baked_of(large), large, (large,), (6, 6, 6))
    store.prepare(baked_of(small), small, (small,), MARGIN)
    store.resources(store.bricks[0])
    assert store.uploads == 1


def test_a_released_store_is_empty_and_can_be_used_again(store: TextureStore) -> None:
    volume = smooth_volume(16)
    for uploads in (1, 2):
        store.prepare(baked_of(volume), volume, (volume,), MARGIN)
        store.resources(store.bricks[0])
        assert (store.uploads, store.bytes) == (uploads, 16**3 * 16)
        store.release()
        assert store.bytes == 0 and not store.bricks


def test_a_renderer_uploads_only_what_it_draws(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bricks in which nothing shows never; the others once, as long as all of them fit."""
    stores: list[TextureStore] = []
    plain = TextureStore.__init__

    def noted(self: TextureStore, *arguments: Any) -> None:
        plain(self, *arguments)
        stores.append(self)

    monkeypatch.setattr(TextureStore, "__init__", noted)
    values = np.zeros((64, 64, 64), np.float32)
    values[2:12, 3:9, 40:50] = 0.9
    volume = Volume(values)
    with Renderer(texture_memory=0.9) as renderer:
        for turn, eye in enumerate([(1, 2, 3), (3, -2, 1), (-1, -1, 2)]):
            camera = Camera.framing(volume, eye=volume.centre + 100 * np.array(eye))
            scene = Scene(volume, BONE, camera, classification="post")
            renderer.render(scene, (24, 24), texture_format="rgba32f")
            if not turn:
                drawn = stores[0].uploads
        assert 0 < stores[0].uploads == drawn < len(stores[0].bricks) / 4
        assert stores[0].bytes <= 900_000
        stats = renderer.stats
        assert stats["bricks_drawn"] == drawn
        assert stores[0].uploads == drawn, "nor to count samples"
        assert stats["texture_bytes"] == stores[0].bytes


@pytest.mark.parametrize("dtype", [np.uint8, np.int8])
def test_eight_bits_are_interpolated_in_single_precision(renderer: Renderer, dtype: type) -> None:
    """A ramp that 8-bit weights, as Mesa's software driver likes them, would move by up to a hundredth."""
    values = np.random.default_rng(3).integers(0, 256, (9, 10, 11)).astype(np.uint8).view(dtype)
    low = float(np.iinfo(dtype).min)
    medium = TransferFunction([low, low + 255], [(1, 0.5, 0.2), (0.2, 0.5, 1)], [0, 0.4])
    camera = Camera.framing(Volume(values))
    pictures = [
        renderer.render(Scene(Volume(each), medium, camera, classification="post"), (40, 40), texture_format=kind)
        for each, kind in ((values, "auto"), (values.astype(np.float32), "rgba32f"))
    ]
    # Some 30 slabs, each rounded to single precision in another order.
    np.testing.assert_allclose(pictures[0], pictures[1], atol=2e-5)


def test_half_of_the_free_memory_of_a_graphics_card_is_for_textures(
    context: Context, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(texture_store, "is_software", lambda context: False)
    assert context.integer(0xFFFF) == 0 and context.gl.error == "GL_NO_ERROR"
    for enumerant, budget in ((texture_store._NVIDIA_FREE, 4), (texture_store._AMD_FREE, 4), (None, 0.5)):
        told = {enumerant: 8 << 20}  # kibibytes
        monkeypatch.setattr(Context, "integer", lambda self, name, told=told: told.get(name, 0))
        assert texture_store.default_budget(context) == budget * 2**30
