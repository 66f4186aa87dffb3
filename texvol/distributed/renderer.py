"""Renderer whose pictures several processes draw, block by block."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import closing, contextmanager
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol.distributed.blocks import Block, Tree, blocks_of, composited, leaves
from texvol.distributed.drawing import Drawn, DrawnFrame, Order
from texvol.distributed.frames import SINGLE, Division, FramesOverWorkers, division_of, reason_for_blocks
from texvol.distributed.workers import Workers
from texvol.opengl.contexts import Context
from texvol.opengl.texture_store import Stopwatch
from texvol.rendering.frames import Frame, drawn_one_by_one
from texvol.rendering.late_estimate import Estimates
from texvol.rendering.picture import Picture
from texvol.rendering.pictures import Pictures
from texvol.rendering.renderer import Renderer
from texvol.rendering.settings import Settings
from texvol.rendering.stats import described_alike
from texvol.rendering.streaming.kinds import drawable
from texvol.rendering.streaming.levels import remark_on_coarse_levels
from texvol.scene.picture_size import AnySize
from texvol.scene.scene import CompleteScene, Scene
from texvol.textures.value_texture import Rounded
from texvol.util.errors import InputError

Size = tuple[int, int]
Corners = NDArray[np.float64]


class DistributedRenderer(Renderer):
    """`Renderer` whose pictures are drawn by `Workers`, and equal to those of one process to 2e-6.

    Parameters
    ----------
    workers : Workers
    blocks : int, optional
        Number of blocks that the box is cut into; as many as workers by default.
    backend : "auto", "egl" or "osmesa"
        Of the context of this process, which tells what workers are to draw.

    Raises
    ------
    InputError
        If `blocks` is less than 1.
    """

    def __init__(self, workers: Workers, *, blocks: int | None = None, backend: str = "auto") -> None:
        if blocks is not None and blocks < 1:
            raise InputError(f"blocks must be at least 1, got {blocks}")
        super().__init__(backend)
        self.workers = workers
        self._oracle = workers.raycast_pixels
        self._distributed = DistributedPictures(workers, blocks, self._context, self._watch)
        self._blocks, self._division = blocks, SINGLE
        self._in_sequence = False  # True while frames are drawn in blocks
        self._whole: FramesOverWorkers | None = None  # if workers drew the last pictures whole

    def render(self, scene: Scene, size: AnySize = (512, 512), **accuracy: Any) -> Picture:
        """Return the scene's picture, drawn in blocks; see `Renderer.render`."""
        self._whole = None
        if not self._in_sequence:
            self._division = SINGLE
        return super().render(scene, size, **accuracy)

    def frames(
        self, scenes: Iterable[Scene], size: AnySize = 512, *, count: int | None = None, views: int = 1, **how: Any
    ) -> Generator[Frame, None, None]:
        """Yield the frames of `count` scenes, see `Renderer.frames`.

        Each worker draws whole frames, unless `count` says that there are fewer frames than workers, the number of
        blocks was given, or a frame fits into the memory of workers in blocks only. `stats` says which.
        """
        return self._frames(iter(scenes), self._compositor.checked_size(size), count, views, how)

    def _frames(
        self, rest: Iterator[Scene], size: Size, count: int | None, views: int, accuracy: dict[str, Any]
    ) -> Generator[Frame, None, None]:
        kept = None
        self._division = division_of(count, self.workers.count, self._blocks)
        if self._division.divided == "frames":
            for frame in self._whole_frames(rest, size, views, accuracy):
                kept = frame.kept
                yield frame
        self._in_sequence = True
        try:
            yield from drawn_one_by_one(self, rest, size, views, accuracy, kept)
        finally:
            self._in_sequence = False

    def _whole_frames(
        self, scenes: Iterable[Scene], size: Size, views: int, accuracy: dict[str, Any]
    ) -> Generator[Frame, None, None]:
        """Yield frames that workers draw whole: all, or the first one if it shows that blocks are better."""

        def reason_to_stop(scene: Scene, frame: DrawnFrame) -> str | None:
            reason = None if reason_for_one(scene) else reason_for_blocks(frame, self.workers.count)
            if reason is not None:
                self._division = Division("blocks", reason)
            return reason

        self._whole = whole = FramesOverWorkers(self.workers, size, views, accuracy)
        scenes = (drawable(each, size, accuracy.get("texture_refinement")) for each in scenes)
        with closing(whole.drawn(scenes, reason_to_stop)) as drawn:
            for scene, frame in drawn:
                yield self._noted_frame(scene, size, frame)

    def _noted_frame(self, scene: Scene, size: Size, drawn: DrawnFrame) -> Frame:
        """Return a frame that a worker drew, which is the last picture of this renderer now."""
        scene = scene.classified_as(drawn.kept.classification)
        self._unrefined = complete = scene.completed(size)
        self._last, self._by_tiles = (complete, size, drawn.settings), drawn.by_tiles
        self._stats, self._estimates, self.drawn_scene = {}, Estimates(), scene
        self._check, self.chosen = drawn.check, drawn.chosen
        remark_on_coarse_levels(scene.volume, drawn.settings)
        return Frame(self._known(drawn.picture.whole(size), size), scene, self.settings, drawn.kept)

    @property
    def stats(self) -> dict[str, Any]:
        """Report of the last picture, see `Renderer.stats`, and how it was divided among workers."""
        if self._whole is not None and not self._stats:
            self._stats = self._whole.report()
        found = super().stats
        frames = {"frames": self._whole.stats} if self._whole is not None else {}
        return found and found | vars(self._division) | {"workers": self.workers.count} | frames

    def _pictures_of(self, scene: Scene) -> Pictures:
        return self._distributed

    @property
    def tell(self) -> Callable[[float], None]:
        """Function that is told which fraction of a picture's blocks is drawn."""
        return self._distributed.tell

    @tell.setter
    def tell(self, tell: Callable[[float], None]) -> None:
        self._distributed.tell = tell


class DistributedPictures:
    """Maker of pictures by workers, see `texvol.rendering.pictures.Pictures`."""

    def __init__(self, workers: Workers, count: int | None, context: Context, watch: Stopwatch) -> None:
        self._workers, self._count, self._context, self._watch = workers, count, context, watch
        self.bricks_drawn, self.lost_digits, self._rounding = 0, 0.0, 0.0
        self._told: list[tuple[Block | None, Drawn]] = []
        self._cut: tuple[Any, Tree] | None = None
        self.tell: Callable[[float], None] = lambda fraction: None

    def draw(
        self,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        repeat: int = 1,
        depth: bool = False,
        block: Corners | None = None,
    ) -> NDArray[np.float32]:
        """Return the picture, without background; or the depth of its isosurface."""
        with self._watch.timed("draw"):
            if depth or reason_for_one(scene) is not None:
                order = Order(b"", size, settings, block, depth=depth, repeat=repeat)
                told, _ = self._workers.draw(scene, [order], None, self.tell)
                self._note([None], told)
                picture = told[0].picture
                assert isinstance(picture, np.ndarray)
                return picture
            tree = self._tree(scene, size, settings.level)
            blocks = list(leaves(tree))
            orders = [Order(b"", size, settings, each.corners, repeat=repeat) for each in blocks]
            told, whole = self._workers.draw(scene, orders, partial(_composited, tree, scene), self.tell)
            self._note(blocks, told)
            assert whole is not None
            return whole.whole(size)

    def count(self, scene: CompleteScene, size: Size, settings: Settings, block: Corners | None = None) -> int:
        """Return the number of slabs that are sampled."""
        one = reason_for_one(scene) is not None
        corners = [block] if one else [each.corners for each in leaves(self._tree(scene, size, settings.level))]
        orders = [Order(b"", size, settings, each, count=True) for each in corners]
        told, _ = self._workers.draw(scene, orders, None, self.tell)
        return sum(each.picture for each in told if isinstance(each.picture, int))

    def rounding(self, scene: CompleteScene) -> float:
        """Upper bound of the last picture's error by the rounding of values."""
        return self._rounding

    @property
    def hidden_rounding(self) -> Rounded:
        """Part of the texels whose rounding may make two pictures of them wrong alike."""
        return "values"

    def described(self, scene: CompleteScene, size: Size, settings: Settings) -> dict[str, Any]:
        """Return the entries of `--stats` that say what was drawn, with one of each block."""
        return described_alike(self._context, scene, size, settings) | {
            "workers": self._workers.count,
            "one_block_because": reason_for_one(scene),
            "blocks": [_stats_of(block, drawn) for block, drawn in self._told],
        }

    @contextmanager
    def set_aside(self, most_bytes: int | None, exact_gradients: bool = True) -> Iterator[None]:
        """Keep what is told of the last picture while others are drawn."""
        told = self._told, self.bricks_drawn, self.lost_digits, self._rounding
        yield
        self._told, self.bricks_drawn, self.lost_digits, self._rounding = told

    def release(self) -> None:
        """Do nothing: the workers have the textures."""

    def _note(self, blocks: list[Block] | list[None], told: list[Drawn]) -> None:
        self._told = list(zip(blocks, told, strict=True))
        self.bricks_drawn = sum(each.stats["bricks_drawn"] for each in told)
        self.lost_digits = max(each.lost_digits for each in told)
        self._rounding = max(each.rounding for each in told)

    def _tree(self, scene: CompleteScene, size: Size, level: int) -> Tree:
        """Return the blocks of a scene; those of the last one if that had the same volume, medium, number and level."""
        count = self._count or self._workers.count
        key = (id(scene.volume), id(scene.medium), count, level)
        if self._cut is None or self._cut[0] != key:
            self._cut = key, blocks_of(scene, size, count, level)
        return self._cut[1]


def reason_for_one(scene: Scene) -> str | None:
    """Return what of a scene keeps it from being cut into blocks; None if nothing does."""
    if scene.mode != "composite":
        return f"mode {scene.mode}"
    if scene.geometry or scene.depth is not None:
        return "meshes, lines or a depth picture"
    return None


def _composited(tree: Tree, scene: CompleteScene, of: Callable[[int], Any], over: Callable[[Any, Any], Any]) -> Any:
    return composited(tree, scene, lambda block: of(block.number), over)


def _stats_of(block: Block | None, drawn: Drawn) -> dict[str, Any]:
    if block is None:
        return {"low": [0.0] * 3, "high": [1.0] * 3, "work": 1.0} | drawn.stats
    low, high = np.clip(block.corners, 0.0, 1.0).tolist()
    return {"low": low, "high": high, "work": block.work} | drawn.stats
