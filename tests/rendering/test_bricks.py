"""A volume in bricks is the picture of the whole."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from support.hard_cases import bounds
from support.hard_cases.cases import linear_medium, looking, ramp
from support.pairs import IN_A_PROJECTION, each_classification_in_a_projection
from support.quick_stats import quick_stats
from support.scenes import BONE, inside, random_volume, smooth_volume, sparse_volume

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context, open_context
from texvol.opengl.drawing import Drawing, DrawnVolume, View
from texvol.opengl.texture_store import TextureStore
from texvol.ray_casting import raycast
from texvol.rendering.render import bake
from texvol.rendering.renderer import Renderer
from texvol.scene import optics
from texvol.scene.camera import Camera, Projection
from texvol.scene.cutting import ClipPlane
from texvol.scene.lighting import Lighting
from texvol.scene.scene import CLASSIFICATIONS, Classification, Scene
from texvol.scene.transfer import TransferFunction, label_function
from texvol.scene.volume import Volume
from texvol.slicing import bricks
from texvol.slicing import slabs as slicing
from texvol.slicing.bricks import Brick
from texvol.util.errors import InputError

SIZE = (40, 36)
SAME = 2e-6
seeds = st.integers(0, 2**32 - 1)
classifications = pytest.mark.parametrize("classification", CLASSIFICATIONS)
OBLIQUE = np.array([[1, 0.4, 0], [0.2, 1, 0.3], [0, -0.3, -1]])  # and left-handed
BYTES = {"rgba8": 4, "rgba16f": 8, "rgba32f": 16}
Renderers = Callable[[float | None], Renderer]


@pytest.fixture(scope="module")
def renderers() -> Iterator[Renderers]:
    """Renderers by megabytes of texture memory, each made once."""
    opened: dict[float | None, Renderer] = {}

    def renderer(megabytes: float | None) -> Renderer:
        if megabytes not in opened:
            opened[megabytes] = Renderer(texture_memory=megabytes)
        return opened[megabytes]

    yield renderer
    for each in opened.values():
        each.close()


@pytest.fixture
def own_context() -> Iterator[Context]:
    """Not the session's: what is given back is freed at once."""
    opened = open_context()
    with opened:
        yield opened
        assert opened.gl.error == "GL_NO_ERROR"
    opened.release()


def assert_the_same_in_bricks(
    renderers: Renderers, scene: Scene, megabytes: float, size: tuple[int, int] = SIZE, **options: object
) -> np.ndarray:
    """The picture of the whole, and that in bricks is no other."""
    whole, bricked = renderers(None), renderers(megabytes)
    picture = whole.render(scene, size, **options)  # type: ignore[arg-type]
    assert picture[..., 3].max() > 0.1
    in_bricks = bricked.render(scene, size, **options)  # type: ignore[arg-type]
    np.testing.assert_allclose(in_bricks, picture, rtol=0, atol=SAME)
    return picture


@pytest.mark.parametrize(
    "classification, projection, eye, rate",
    [  # thin slabs need the margin of one sample, thick ones several, seen from wherever
        *((each, "perspective", "inside", 0.3) for each in CLASSIFICATIONS),
        ("extinction", "orthographic", "inside", 0.3),
        ("post", "perspective", "inside", 2.3),
        ("integrated", "perspective", "outside", 0.3),
        ("slab", "orthographic", "outside", 1),
    ],
)
def test_dense_noise_on_an_oblique_grid(
    renderers: Renderers, classification: Classification, projection: Projection, eye: str, rate: float
) -> None:
    values = random_volume(1, (40, 36, 33)).values
    volume = Volume(values, (1, 1.3, 0.7), (50, -20, 3), OBLIQUE)
    camera = Camera.framing(volume, projection) if eye == "outside" else inside(volume, projection)
    scene = Scene(volume, BONE, camera, classification=classification)
    megabytes = 0.7 if classification in ("slab", "extinction") else 0.18
    options = {"sampling_rate": rate, "texture_format": "rgba32f"}
    assert_the_same_in_bricks(renderers, scene, megabytes, **options)
    assert_the_same_in_bricks(renderers, scene, megabytes, early_termination=0, **options)


@pytest.mark.parametrize(
    "classification, projection",
    [("slab", "orthographic"), ("extinction", "perspective"), ("post", "orthographic"), ("integrated", "perspective")],
)
def test_an_eye_close_to_a_face_between_bricks(
    renderers: Renderers, classification: Classification, projection: Projection
) -> None:
    """The slab that the eye cuts short may have its middle behind the eye, in another brick than what is seen of it."""
    volume = Volume(random_volume(1, (40, 36, 33)).values)
    megabytes = 0.7 if classification in ("slab", "extinction") else 0.18
    for position in np.linspace(-4, 4, 9):
        eye = volume.centre + (position, 0.7 * position, -position)
        target = eye + (1, 0.9, 0.4)
        camera = Camera.orthographic(eye, target, (0, 0, 1), height=30.0)
        if projection == "perspective":
            camera = Camera.perspective(eye, target, (0, 0, 1), fov=100)
        scene = Scene(volume, BONE, camera, classification=classification)
        assert_the_same_in_bricks(renderers, scene, megabytes, sampling_rate=0.4, texture_format="rgba32f")


@pytest.mark.parametrize("classification, projection", IN_A_PROJECTION[::2])
def test_stats_say_how_many_bricks_there_are(
    renderers: Renderers, classification: Classification, projection: Projection
) -> None:
    volume = Volume(random_volume(1, (40, 36, 33)).values)
    scene = Scene(volume, BONE, Camera.framing(volume, projection), classification=classification)
    stats = []
    for megabytes in (0.18, None):
        renderers(megabytes).render(scene, SIZE, texture_format="rgba16f", early_termination=0)
        stats.append(quick_stats(renderers(megabytes), samples=True))
        assert stats[-1]["bricks_total"] == stats[-1]["bricks_drawn"]
        assert 0 < stats[-1]["texture_bytes"] <= (megabytes or 99) * 1e6
    assert stats[0]["bricks_total"] >= 8 and stats[1]["bricks_total"] == 1
    # The bricks' slabs are those of the whole, each once.
    assert stats[0]["samples_total"] == stats[1]["samples_total"] > 0


@pytest.mark.parametrize("texel_format", BYTES)
@pytest.mark.parametrize("classification", ["slab", "extinction"])
def test_any_format_of_texels(renderers: Renderers, classification: Classification, texel_format: str) -> None:
    volume = random_volume(2, (36, 40, 33))
    scene = Scene(volume, BONE, Camera.framing(volume, "perspective"), classification=classification)
    megabytes = 0.045 * BYTES[texel_format]
    assert_the_same_in_bricks(renderers, scene, megabytes, texture_format=texel_format, sampling_rate=1.7)


@pytest.mark.parametrize(
    "classification, dtype",
    [
        *(("post", each) for each in (np.uint8, np.uint16, np.float16, np.float64)),
        *(("integrated", each) for each in (np.int8, np.int16, np.float32)),
    ],
)
def test_any_type_of_values(renderers: Renderers, classification: Classification, dtype: type) -> None:
    values = (100 * random_volume(3, (36, 40, 33)).values).astype(dtype)
    volume = Volume(values, (1, 1.3, 0.7))
    medium = TransferFunction(100 * BONE.values, BONE.colors, BONE.extinctions)
    scene = Scene(volume, medium, Camera.framing(volume, "perspective"), classification=classification)
    assert_the_same_in_bricks(renderers, scene, 0.09 if values.itemsize < 4 else 0.18, sampling_rate=1.7)


LABELS = Volume(
    np.random.default_rng(5).integers(0, 4, (21, 18, 23)).astype(np.uint8),
    (0.8, 1, 0.9),
    (3, -2, 1),
    OBLIQUE,
    labels=True,
)


@pytest.mark.parametrize(
    "classification, projection, more",
    [
        ("integrated", "perspective", {"lighting": Lighting()}),
        ("slab", "orthographic", {"clip": (ClipPlane((1, 0.3, 0), 10.0),), "caps": True}),
    ],
    ids=["lit", "capped"],
)
def test_labels_go_to_the_faces_of_their_voxels(
    renderers: Renderers, classification: Classification, projection: Projection, more: dict
) -> None:
    looks = label_function(LABELS, {2: 0.02, 3: 0.4}, others=0.1)
    bricked = renderers(0.06 if "lighting" in more else 0.0075)
    for camera, rate in ((Camera.framing(LABELS, projection), 2.0), (inside(LABELS, projection), 0.5)):
        scene = Scene(LABELS, looks, camera, classification=classification, **more)
        whole = renderers(None).render(scene, SIZE, sampling_rate=rate)
        picture = bricked.render(scene, SIZE, sampling_rate=rate)
        assert quick_stats(bricked)["bricks_drawn"] > 8
        assert whole[..., 3].max() > 0.5
        # As against the oracle: pieces of 1e-5 of a slab are given to their neighbours.
        np.testing.assert_allclose(picture, whole, rtol=0, atol=5e-5)


@settings(max_examples=12, deadline=None, derandomize=True)
@given(seeds, st.sampled_from(CLASSIFICATIONS), st.sampled_from(["orthographic", "perspective"]), st.booleans())
def test_any_volume_from_any_place(
    renderers: Renderers, seed: int, classification: Classification, projection: Projection, emissive: bool
) -> None:
    random = np.random.default_rng(seed)
    dimensions = random.integers(1, 45, 3)
    assume(dimensions.prod() > 5000)
    values = random_volume(seed, tuple(dimensions)).values
    direction = np.eye(3) + random.choice([0, 0.3]) * random.standard_normal((3, 3))
    direction[:, 0] *= random.choice([-1, 1])
    volume = Volume(values, random.uniform(0.5, 2, 3), random.uniform(-9, 9, 3), direction)
    line_of_sight = np.eye(3)[random.integers(3)] if random.random() < 0.4 else random.standard_normal(3)
    line_of_sight *= random.choice([0.1, 0.6, 2.5]) * volume.radius / np.linalg.norm(line_of_sight)
    up = np.cross(line_of_sight, random.standard_normal(3))
    if projection == "perspective":
        camera = Camera.perspective(volume.centre - line_of_sight, volume.centre, up, fov=random.uniform(20, 100))
    else:
        camera = Camera.orthographic(volume.centre - line_of_sight, volume.centre, up, height=2 * volume.radius)
    medium = TransferFunction(BONE.values, 0.02 * BONE.colors, BONE.extinctions, emissive) if emissive else BONE
    scene = Scene(volume, medium, camera, classification=classification)
    options = {"sampling_rate": random.choice([0.3, 1.0, 2.3]), "texture_format": "rgba32f"}
    sample = 16 if classification in ("slab", "extinction") else 4
    small = max(each for each in (0.018, 0.06, 0.18, 0.7) if each < dimensions.prod() * sample / 1e6)
    pictures = []
    for megabytes in (None, small):
        try:
            pictures.append(renderers(megabytes).render(scene, SIZE, **options))
        except InputError:
            assume(False)  # thick slabs need a margin that a flat volume's bricks have no room for
    np.testing.assert_allclose(pictures[1], pictures[0], rtol=0, atol=SAME * max(1.0, float(pictures[0].max())))


@each_classification_in_a_projection
def test_pictures_of_bricks_are_composited_in_visibility_order(
    own_context: Context, classification: Classification, projection: Projection
) -> None:
    """Each drawn alone, and put over what comes behind it: whoever has a brick has all that its picture needs."""
    volume = Volume(random_volume(4, (30, 31, 32)).values, (1, 1.3, 0.7), direction=OBLIQUE)
    camera = Camera.framing(volume, projection)
    scene = Scene(volume, BONE, camera, classification=classification).completed(SIZE)
    baked = bake(scene, 0.8, "rgba32f")
    view = View(camera, SIZE, 0.8, volume.centre)
    compositor = Compositor(own_context)

    def picture_of(store: TextureStore, brick: Brick) -> np.ndarray:
        drawing = Drawing(view, (DrawnVolume(volume, baked, store, lambda brick: brick.stored_box),))
        compositor.begin(drawing)
        stacks = slicing.slab_stacks(volume, camera, 0.8, SIZE, baked.slabs_per_stack, brick.stored_box)
        compositor.draw(drawing, brick, stacks)
        compositor.finish()
        return compositor.picture().astype(np.float64)

    stores = [
        TextureStore(own_context, budget)
        for budget in (1 << 30, 300_000 if baked.formats["texels"][1] == 4 else 80_000)
    ]
    for store in stores:
        store.prepare(baked, volume, (volume,), bricks.margin(volume, camera, SIZE, 0.8))
    whole = picture_of(stores[0], stores[0].bricks[0])
    together = np.zeros((SIZE[1], SIZE[0], 4))
    for brick in bricks.visibility_order(stores[1].bricks, volume, camera):
        together = optics.over(together, picture_of(stores[1], brick))
    np.testing.assert_allclose(together, whole, rtol=0, atol=SAME)
    assert len(stores[1].bricks) >= 8 and whole[..., 3].max() > 0.9
    for store in stores:
        store.release()
    compositor.release()


triples = st.tuples(*[st.integers(1, 60)] * 3)


@settings(max_examples=60, deadline=None, derandomize=True)
@given(triples, st.tuples(*[st.integers(1, 4)] * 3), st.integers(100, 100_000), st.integers(16, 2048))
def test_every_sample_has_one_owner_that_stores_what_it_needs(
    dimensions: tuple[int, int, int], margin: tuple[int, int, int], most: int, longest: int
) -> None:
    try:
        size = bricks.texture_size(dimensions, margin, 4, most, longest)
    except InputError:
        assume(False)
    assert np.prod(size) * 4 <= most and max(size) <= longest
    for side, count in zip(size, dimensions, strict=True):
        assert side == count or (side < count and side & (side - 1) == 0)
    owners = np.zeros(dimensions, int)
    found = bricks.cut(dimensions, size, margin)
    for brick in found:
        owners[tuple(map(slice, brick.first, brick.last))] += 1
        for axis in range(3):
            low, high = brick.stored_first[axis], brick.stored_last[axis]
            assert low == 0 if size[axis] == dimensions[axis] else low == max(brick.first[axis] - margin[axis], 0)
            assert high == min(max(brick.last[axis], brick.last[axis] + margin[axis]), dimensions[axis])
            assert high - low <= size[axis]
        assert brick.texture_size == size
        assert brick.is_whole == (len(found) == 1)
    assert (owners == 1).all()
    assert len({brick.position for brick in found}) == len(found)


@settings(max_examples=80, deadline=None, derandomize=True)
@given(seeds, st.sampled_from(["orthographic", "perspective"]), st.floats(0, 3))
def test_a_ray_meets_bricks_in_their_order(seed: int, projection: Projection, distance: float) -> None:
    random = np.random.default_rng(seed)
    dimensions = tuple(int(n) for n in random.integers(4, 60, 3))
    direction = np.eye(3) + random.choice([0, 0.4]) * random.standard_normal((3, 3))
    direction[:, 1] *= random.choice([-1, 1])
    volume = Volume(np.zeros(dimensions[::-1], np.uint8), random.uniform(0.5, 2, 3), (5, -7, 3), direction)
    size = tuple(min(n, int(side)) for n, side in zip(dimensions, 2 ** random.integers(2, 6, 3), strict=True))
    cut = bricks.cut(dimensions, size, (1, 1, 1))  # type: ignore[arg-type]
    shown = [brick for brick in cut if random.random() < random.choice([0.3, 1])]
    random.shuffle(shown)
    # Along an axis as often as not, the eye on a face between bricks every now and then.
    line_of_sight = np.eye(3)[random.integers(3)] if random.random() < 0.4 else random.standard_normal(3)
    eye = volume.centre - distance * volume.radius * line_of_sight / np.linalg.norm(line_of_sight)
    if random.random() < 0.2:
        eye = volume.box_corner + volume.world_from_index @ np.array(cut[random.integers(len(cut))].last)
    up = np.cross(line_of_sight, random.standard_normal(3))
    if projection == "perspective":
        camera = Camera.perspective(eye, eye + line_of_sight, up, fov=random.uniform(20, 140))
    else:
        camera = Camera.orthographic(eye, eye + line_of_sight, up, height=2 * volume.radius)
    ordered = bricks.visibility_order(shown, volume, camera)
    assert sorted(map(id, ordered)) == sorted(map(id, shown))
    if not ordered:
        return
    origins, directions = (each.reshape(-1, 3) for each in camera.rays((9, 8)))
    start = (origins - volume.box_corner) @ volume.index_from_world.T
    lines_of_sight = directions @ volume.index_from_world.T
    lines_of_sight[np.abs(lines_of_sight) < 1e-12] = 1e-12
    low, high = (np.array([getattr(b, end) for b in ordered])[:, np.newaxis] for end in ("first", "last"))
    a, b = (low - start) / lines_of_sight, (high - start) / lines_of_sight
    enters = np.maximum(np.minimum(a, b).max(axis=2), 0)
    leaves = np.maximum(a, b).min(axis=2)
    for ray in range(len(start)):
        met = np.flatnonzero(leaves[:, ray] - enters[:, ray] > 1e-6)
        assert (np.diff(enters[met, ray]) > -1e-9).all()


@pytest.mark.parametrize(
    "classification, projection, dimensions",
    [
        ("slab", "orthographic", (5000, 3, 3)),
        ("extinction", "perspective", (2100, 4, 3)),
        ("post", "orthographic", (3, 2500, 2)),
        ("integrated", "orthographic", (2100, 20, 20)),
    ],
)
def test_volumes_beyond_the_3d_texture_limit(
    renderers: Renderers, classification: Classification, projection: Projection, dimensions: tuple[int, int, int]
) -> None:
    """Linear matter, seen along the longest side: a sample's width of misplacement would be 5e-4."""
    volume = ramp(dimensions)
    line_of_sight = np.where(np.arange(3) == np.argmax(dimensions), 1.0, (2e-4, -3e-4, 1e-4))
    camera = looking(volume, tuple(line_of_sight), height=1.2 * min(dimensions[0], dimensions[2]))
    if projection == "perspective":
        camera = Camera.perspective(camera.eye, camera.target, camera.up, fov=0.1)
    scene = Scene(volume, linear_medium(volume), camera, classification=classification)
    renderer = renderers(None)
    picture = renderer.render(scene, (24, 20), texture_format="rgba32f")
    truth = raycast(scene, (24, 20))
    bound = SAME
    if classification == "slab":  # interpolates opacities; for the others linear matter is exact
        slabs = slicing.slab_stacks(volume, camera, 1.0, (24, 20)).slab_count
        bound = bounds.trilinear(bounds.Drawing(scene, (24, 20), 1.0, slabs, truth))
        assert bound < 2e-5
    np.testing.assert_allclose(picture, truth, rtol=0, atol=bound)
    assert (truth[..., 3] > 0.5).mean() > (0.3 if projection == "orthographic" else 0.1)
    assert min(dimensions) > 9 or quick_stats(renderer)["bricks_total"] > 1


@classifications
def test_a_texture_memory_too_small_for_any_brick_is_an_error(
    renderers: Renderers, classification: Classification
) -> None:
    volume = smooth_volume(24)
    with pytest.raises(InputError, match=r"^a brick of this volume needs .* MB of texture memory, got .* MB$"):
        renderers(0.0001).render(Scene(volume, BONE, classification=classification), SIZE)
    # And drawing goes on with what has room.
    point = Scene(Volume(np.ones((1, 1, 1))), BONE, classification=classification)
    assert renderers(0.0001).render(point, SIZE, texture_format="rgba8").any()


@pytest.mark.parametrize("megabytes", [0.0, -1.0, np.nan, np.inf])
def test_a_texture_memory_that_is_none_is_refused(megabytes: float) -> None:
    with pytest.raises(InputError, match="texture_memory must be positive and finite"):
        Renderer(texture_memory=megabytes)


@pytest.mark.parametrize("classification", ["extinction", "integrated"])
def test_bricks_in_which_nothing_shows_are_not_drawn(renderers: Renderers, classification: Classification) -> None:
    volume = sparse_volume(1)
    scene = Scene(volume, BONE, Camera.framing(volume), classification=classification)
    renderer = renderers(0.08)
    picture = renderer.render(scene, SIZE, texture_format="rgba8")
    stats = quick_stats(renderer)
    assert 0 < stats["bricks_drawn"] < stats["bricks_total"]
    plain = renderer.render(scene, SIZE, texture_format="rgba8", skip_empty=False)
    np.testing.assert_allclose(picture, plain, rtol=0, atol=SAME)
    all_of_them = quick_stats(renderer)
    assert all_of_them["bricks_drawn"] == all_of_them["bricks_total"] == stats["bricks_total"]
