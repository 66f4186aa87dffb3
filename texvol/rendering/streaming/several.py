"""Pictures of several large volumes at once, region by region of a grid that they have in common.

Each volume has its own samples in memory, threads and textures, and a share of the budget. In a region the parts of all
volumes that show anything there are drawn together, as the volumes in memory are: their media add up along each ray.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from contextlib import ExitStack
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from texvol.opengl.compositor import Compositor
from texvol.opengl.contexts import Context
from texvol.opengl.drawing import Drawing, View
from texvol.opengl.part_store import Part
from texvol.opengl.texture_store import Stopwatch
from texvol.rendering.render import draw_together
from texvol.rendering.scene_cache import color_scale_of, most_light_of
from texvol.rendering.settings import Settings
from texvol.rendering.streaming.ahead import PendingPart
from texvol.rendering.streaming.boxes_only import BoxesOnly
from texvol.rendering.streaming.kinds import large_volumes
from texvol.rendering.streaming.levels import levels_beside
from texvol.rendering.streaming.ordering import Drawn
from texvol.rendering.streaming.parts import PictureOfParts
from texvol.rendering.streaming.picture import Size, StreamedPictures
from texvol.rendering.streaming.visibility import Places, Screen, most_extinction
from texvol.rendering.streaming.volume_parts import VolumeParts
from texvol.scene.large_volume import LargeVolume
from texvol.scene.scene import CompleteScene
from texvol.slicing import bricks
from texvol.slicing.bricks import BEYOND, Brick, Triple
from texvol.slicing.common_regions import CommonRegions, common_regions, share_of
from texvol.slicing.regions import Region, margin_of

Numbers = NDArray[np.float64]


class PicturesOfSeveral(StreamedPictures):
    """Pictures of scenes of several large volumes; methods need the context to be current."""

    def __init__(self, context: Context, compositor: Compositor, budget: int, watch: Stopwatch) -> None:
        super().__init__(context, compositor, budget, watch)
        self._boxes = BoxesOnly(context, watch)

    def release(self) -> None:
        """Release everything on the device, and the samples."""
        super().release()
        self._boxes.release()

    def _drawn(
        self,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        block: Numbers | None,
        count: bool = False,
        depth: bool = False,
    ) -> Drawing:
        volumes = large_volumes(scene)
        of_each = self._prepared(volumes, share_of(volumes))
        picture = PictureOfSeveral(self._context, scene, size, settings, self._boxes, count)
        self._formats, self.lost_digits, self.drawn = set(), 0.0, Drawn()
        self.compositor.begin(picture.drawing, settings.target_format)
        turns = picture.turns(of_each, self.drawn)
        order = [region for region in picture.order if block is None or picture.is_in(region, block)]
        for turn in turns:
            turn.expect(order)
        try:
            with ExitStack() as counted:
                for parts in of_each:
                    counted.enter_context(parts.cache.counted())
                self._draw_regions(order, turns, picture)
        except BaseException:
            for parts in of_each:
                parts.cache.forget()  # so that what could not be read is tried again
            raise
        finally:
            for turn in turns:
                turn.picture.release()
        self.drawn.hidden, self.bricks_drawn = picture.screen.hidden, self.drawn.drawn
        self.compositor.finish()
        return picture.drawing

    def _draw_regions(self, order: list[Region], turns: list[_Turn], picture: PictureOfSeveral) -> None:
        with ExitStack() as stack:
            for turn in turns:
                stack.callback(turn.close)
                turn.begin()
            for done, region in enumerate(order):
                found = []
                for turn in turns:
                    with self._watch.timed_textures():
                        part = turn.part(region)
                    if part is not None:
                        self._note(part, turn.picture.scene)
                        found.append((turn, part))
                shown = [(turn, part) for turn, part in found if part.shown is not None]
                self.drawn.drawn += bool(found)
                if shown:
                    picture.draw(self.compositor, region, shown, turns)
                self.tell((done + 1) / len(order))

    def _note(self, part: Part, scene: CompleteScene) -> None:
        drawn = self.drawn.drawn
        super()._note(part, scene)
        self.drawn.drawn = drawn  # regions, not parts


class PictureOfSeveral:
    """Drawing of a picture of several volumes, its regions and the pictures of each volume."""

    def __init__(
        self,
        context: Context,
        scene: CompleteScene,
        size: Size,
        settings: Settings,
        boxes: BoxesOnly,
        count: bool,
    ) -> None:
        volumes, self._how, self._boxes = large_volumes(scene), (size, settings), boxes
        levels = levels_beside(volumes, settings.level)
        self.pictures = []
        for alone, volume, level in zip(scene.each_alone(), volumes, levels, strict=True):
            picture = PictureOfParts(context, alone, size, replace(settings, level=level), volume, alone=False)
            picture.drawing = replace(picture.drawing, count=count)
            self.pictures.append(picture)
        scenes = tuple(picture.scene for picture in self.pictures)
        self.drawing = Drawing(
            View(scene.camera, size, settings.slab_thickness, scene.volume.centre),
            (),
            color_scale=color_scale_of(scenes),
            least_transmittance=settings.early_termination / most_light_of(scenes),
            cutting=scene.cutting,
            depth_cue=scenes[0].depth_cue,
            slicing=settings.slicing,
            count=count,
        )
        self.common = common_regions(volumes, levels, [picture.margin for picture in self.pictures])
        frame = self.common.frame
        self._beyond = margin_of(frame, scene.camera, size, settings.slab_thickness, 0) / np.array(frame.dimensions)
        self.screen = SharedScreen(scenes, self.common, size, self.drawing.least_transmittance, self._beyond)
        self.order: list[Region] = []

    def turns(self, of_each: list[VolumeParts], drawn: Drawn) -> list[_Turn]:
        """Return what each volume has of the picture, and find the order of the regions that any of them shows."""
        turns = [
            _Turn(parts, picture, own, ends, self.screen)
            for parts, picture, own, ends in zip(of_each, self.pictures, self.common.own, self.common.ends, strict=True)
        ]
        shown = set().union(*(turn.regions for turn in turns))
        drawn.regions, drawn.empty = len(self.common.regions), len(self.common.regions) - len(shown)
        at = {region.position: region for region in self.common.regions}
        few = [self.screen.brick(position) for position in shown]
        ordered = bricks.visibility_order(few, self.common.frame, self.drawing.view.camera)
        self.order = [at[brick.position] for brick in ordered]
        return turns

    def is_in(self, region: Region, block: Numbers) -> bool:
        """True if a region's middle lies in a block, in fractions of the first volume's box, shape (2, 3)."""
        frame, volume = self.common.frame, self.pictures[0].volume
        middle = frame.centre + frame.box_edges @ (region.box(frame.dimensions).mean(axis=0) - 0.5)
        place = (volume.index_from_world @ (middle - volume.centre)) / np.array(volume.dimensions) + 0.5
        return bool((block[0] <= place).all() and (place < block[1]).all())

    def draw(self, compositor: Compositor, region: Region, shown: list[tuple[_Turn, Part]], turns: list[_Turn]) -> None:
        """Composite the parts of a region behind the picture so far."""
        box = region.box(self.common.frame.dimensions)
        block = box.copy()
        block[0, box[0] <= 0.0], block[1, box[1] >= 1.0] = -BEYOND, BEYOND
        volumes = [(turn.picture.drawn_volume(part), part.brick) for turn, part in shown]
        boxes = [turn.picture.volume for turn, _ in shown]
        for turn in turns:
            if region.position in turn.ends and not any(_is_same_box(turn.picture.volume, each) for each in boxes):
                drawn = self._boxes.drawn_volume(turn.picture.scene, *self._how)
                volumes.append((drawn, drawn.textures.bricks[0]))
                boxes.append(turn.picture.volume)
        of_all = replace(self.drawing, volumes=tuple(each for each, _ in volumes), block=block, frame=self.common.frame)
        part = np.clip(box + np.outer([-1, 1], self._beyond), 0.0, 1.0)
        draw_together(compositor, of_all, [brick for _, brick in volumes], part)
        extinction = sum(most_extinction(turn.picture.scene, part.baked.volume.value_range) for turn, part in shown)
        self.screen.has_added_together(compositor, region.position, extinction)


class _Turn:
    """A volume of a picture of several: its parts, one after the other."""

    def __init__(
        self,
        parts: VolumeParts,
        picture: PictureOfParts,
        own: dict[Triple, Region],
        ends: set[Triple],
        screen: SharedScreen,
    ) -> None:
        self.ends = ends
        self._parts, self.picture, self._screen = parts, picture, _OwnScreen(screen, picture.volume)
        picture.show(list(own.values()))
        self.regions = {region.position: region for region in picture.shown}  # of its own samples
        self._order: list[Region] = []
        self._everything = False
        self._pending: Generator[PendingPart, None, None] | None = None
        self._next: PendingPart | None = None

    def expect(self, order: list[Region]) -> None:
        """Say in which order regions of the frame are drawn."""
        picture, cache = self.picture, self._parts.cache
        self._order = [self.regions[each.position] for each in order if each.position in self.regions]
        levels = {picture.level(each) for each in self._order}
        count = len(picture.volume.levels)
        cache.need([picture.needed(number) if number in levels else None for number in range(count)])
        few = [picture.brick(each, picture.level(each)) for each in self._order]
        cache.expect([(brick.level, brick.stored_first, brick.stored_last) for brick in few])
        self._everything = picture.bytes_of(self._order) <= self._parts.texture_bytes

    def begin(self) -> None:
        """Begin to read and prepare parts."""
        self._pending = self._parts.ahead.in_order(self._order, self._screen, self.picture)

    def part(self, region: Region) -> Part | None:
        """Return the volume's part of a region of the frame, in their order; None if it shows nothing of it there."""
        assert self._pending is not None
        if region.position not in self.regions:
            return None
        if self._next is None:
            self._next = next(self._pending, None)
        if self._next is None or self._next.brick.position != region.position:  # hidden
            return None
        pending, self._next = self._next, None
        return self._parts.ahead.part(pending, self._screen, self.picture, self._everything)

    def close(self) -> None:
        """Give back what is still being prepared."""
        if self._pending is not None:
            self._pending.close()
        if self._next is not None:
            self._parts.ahead.forget(self._next)


class SharedScreen(Screen):
    """Pixels that are opaque, behind which no volume has to be read."""

    def __init__(
        self,
        scenes: tuple[CompleteScene, ...],
        common: CommonRegions,
        size: Size,
        least_transmittance: float,
        beyond: Numbers,
    ) -> None:
        super().__init__(replace(scenes[0], volume=common.frame), size, least_transmittance)
        self._scenes, self._frame = scenes, common.frame
        self._at = {region.position: region for region in common.regions}
        self._hidden: set[Triple] = set()
        self._bricks: dict[Triple, Brick] = {}
        self._reach = np.ceil(beyond * np.array(common.frame.dimensions)).astype(int)

    def brick(self, position: Triple) -> Brick:
        """Return a region as a brick of the frame, with what slabs reach beyond it."""
        if (known := self._bricks.get(position)) is not None:
            return known
        region, dimensions = self._at[position], self._frame.dimensions
        low, high = np.array(region.first) - self._reach, np.array(region.last) + self._reach
        first, last = (np.clip(each, 0, dimensions).tolist() for each in (low, high))
        stored = (first[0], first[1], first[2]), (last[0], last[1], last[2])
        self._bricks[position] = Brick(position, region.first, region.last, *stored, dimensions, dimensions)
        return self._bricks[position]

    def hides_region(self, position: Triple) -> bool:
        """True if all pixels that a region may reach are opaque; it counts as hidden then, once."""
        if position not in self._hidden and self.covers(self.brick(position)):
            self._hidden.add(position)
            self.hidden = len(self._hidden)
        return position in self._hidden

    def has_added_together(self, compositor: Compositor, position: Triple, extinction: float) -> None:
        """Remember that a region has been drawn, in which extinctions add up to at most so much."""
        brick = self.brick(position)
        self.has_added(compositor, brick, extinction * self.longest(brick))

    def _depth_of(self, brick: Brick, values: tuple[float, float] | None) -> float:
        return sum(most_extinction(scene, None) for scene in self._scenes) * self.longest(brick)


class _OwnScreen:
    """The shared screen as one of the volumes sees it: bricks of a position are those of the common region."""

    def __init__(self, shared: SharedScreen, volume: LargeVolume) -> None:
        self._shared, self._volume, self.hidden = shared, volume, 0

    def hides(self, brick: Brick) -> bool:
        return self._shared.hides_region(brick.position)

    def may_hide(self, brick: Brick, before: Sequence[Brick]) -> bool:
        of_frame = self._shared.brick
        return self._shared.may_hide(of_frame(brick.position), [of_frame(each.position) for each in before])

    @property
    def tells_chunks(self) -> bool:
        return self._shared.tells_chunks

    def are_hidden(self, level: int, places: Places, parts: Numbers) -> NDArray[np.bool_]:
        return self._shared.all_opaque(self._volume, parts)

    def has_drawn(self, compositor: Compositor, brick: Brick, values: tuple[float, float] | None) -> None:
        """Do nothing: the shared screen is told of whole regions."""


def _is_same_box(one: LargeVolume, other: LargeVolume) -> bool:
    """True if pieces of rays that end at the box, or the labels, of one volume end where those of the other do."""
    if one is other:
        return True
    alike = not one.nearest or (other.nearest and one.dimensions == other.dimensions)
    return alike and all(
        np.array_equal(a, b) for a, b in ((one.box_corner, other.box_corner), (one.box_edges, other.box_edges))
    )
