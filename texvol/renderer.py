"""A Renderer keeps what pictures have in common: the context, the programs, the last texture; and says what it did."""

from __future__ import annotations

import time
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from statistics import median
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from texvol import accuracy, error_control, slab_texture
from texvol.camera import Camera
from texvol.compositor import TARGET_FORMATS, BakedTexture, Compositor, DeviceTexture
from texvol.contexts import open_context
from texvol.errors import AccuracyWarning, InputError
from texvol.render import bake, draw, over_background
from texvol.scene import Scene, checked_size
from texvol.transfer import TransferFunction, proposed_for

Size = tuple[int, int]


class Renderer:
    """Draws scenes on one OpenGL context; keeps the context, the programs and the last texture.

    Parameters
    ----------
    backend : "auto", "egl" or "osmesa"

    Raises
    ------
    ContextError
        If no OpenGL context can be made; the message holds each back end's reason.
    """

    def __init__(self, backend: str = "auto") -> None:
        self._context = open_context(backend)
        with self._context:
            self._compositor = Compositor(self._context)
        self._baked: tuple[tuple[Any, ...], DeviceTexture] | None = None
        self._proposed: tuple[Any, TransferFunction] | None = None
        self._seconds: dict[str, float] = {}
        self._last: tuple[Scene, Size, float, str, str] | None = None
        self._stats: dict[str, Any] = {}
        self._estimate: float | None = None  # of the last picture's error, where it has been worked out

    def render(
        self,
        scene: Scene,
        size: Size = (512, 512),
        *,
        slab_thickness: float | None = None,
        sampling_rate: float | None = None,
        max_error: float | None = None,
        texture_format: str = "auto",
        target_format: str = "auto",
        repeat: int = 1,
    ) -> NDArray[np.float32]:
        """The scene's picture: (height, width, 4) float32, premultiplied, linear, top row first.

        Parameters
        ----------
        size : (width, height)
            Pixels.
        slab_thickness : float
            World units; or `sampling_rate`, in slabs per smallest spacing (default 1); or
        max_error : float
            Maximum absolute error that is wanted of the linear picture against the integral of its classification:
            the thickness is chosen by drawing the scene at several. Where it can't be reached there is an
            AccuracyWarning, and `stats` says what was.
        texture_format, target_format : "auto", "rgba8", "rgba16f" or "rgba32f"
            `auto` is the smallest texture whose rounding does not show beside the discretisation error, and a
            float32 target.
        repeat : int
            How often to draw; `stats` has the median time.

        Raises
        ------
        InputError
            If an argument is out of range, or the volume or the picture too large for the driver.
        """
        size = self._checked_size(size)
        target_format = _chosen_target(target_format)
        if texture_format not in ("auto", *slab_texture.TEXEL_FORMATS):
            raise InputError(f"texture format is auto, rgba8, rgba16f or rgba32f, and not {texture_format!r}")
        wanted = accuracy.checked(scene.volume, slab_thickness, sampling_rate, max_error)
        self._seconds, self._stats, self._estimate = {}, {}, None
        with self._context:
            if max_error is not None:
                # Any rounding of texels would hide in the differences that the choice goes by.
                texture_format = "rgba32f" if texture_format == "auto" else texture_format
                wanted = self._thickness_for_error(scene, size, texture_format, target_format, max_error)
            texture = self._texture(scene, wanted, texture_format)
            picture = self._draw(scene, texture, wanted, size, target_format, repeat)
        self._last = (scene, size, wanted, texture.baked.texel_format, target_format)
        return over_background(picture, scene.background)

    @property
    def stats(self) -> dict[str, Any]:
        """What the last `render` did, JSON-able, as `--stats` writes it.

        `estimated_error` is the maximum absolute error that is to be expected of the linear picture against the
        integral of its classification; it is worked out when first asked for, from two small pictures.
        """
        if self._last is None:
            return {}
        if not self._stats:
            self._stats = self._facts(*self._last)
        return self._stats

    @property
    def renderer_name(self) -> str:
        """What the driver calls itself (GL_RENDERER)."""
        return self._context.renderer

    @property
    def backend(self) -> str:
        """Where the context came from: "egl" or "osmesa"."""
        return self._context.backend

    def close(self) -> None:
        """Give everything back; closing twice is fine."""
        if self._context.released:
            return
        with self._context:
            self._forget_texture()
            self._compositor.release()
        self._context.release()

    def __enter__(self) -> Renderer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def _texture(self, scene: Scene, thickness: float, texel_format: str) -> DeviceTexture:
        """The scene's texture on the device, baked and uploaded where the last one was another."""
        transfer_function = self._transfer_function(scene)
        with self._timed("bake"):
            if scene.classification in ("post", "integrated"):
                key: tuple[Any, ...] = (scene.volume, transfer_function, scene.classification)
            else:
                if texel_format == "auto":
                    texel_format = accuracy.cheapest_texel_format(
                        scene.volume, transfer_function, scene.classification, thickness
                    )
                baked_for = thickness if scene.classification == "slab" else None
                key = (scene.volume, transfer_function, scene.classification, baked_for, texel_format)
            if self._baked and _same(self._baked[0], key):
                return self._baked[1]
            baked = bake(scene, transfer_function, thickness, texel_format)
        if self._baked and self._baked[0][0] is scene.volume and len(self._baked[0]) == len(key) == 3:
            # The same values: another transfer function is only another table.
            texture = self._baked[1]
            with self._timed("upload"):
                self._compositor.upload_transfer_function(texture, baked)
            self._baked = (key, texture)
            return texture
        self._forget_texture()
        return self._uploaded(key, baked)

    def _uploaded(self, key: tuple[Any, ...], baked: BakedTexture) -> DeviceTexture:
        with self._timed("upload"):
            texture = self._compositor.upload(baked)
        self._baked = (key, texture)
        return texture

    def _thickness_for_error(
        self, scene: Scene, size: Size, texture_format: str, target_format: str, max_error: float
    ) -> float:
        def picture(thickness: float) -> NDArray[np.float32]:
            texture = self._texture(scene, thickness, texture_format)
            return self._draw(scene, texture, thickness, size, target_format, 1)

        def reference(thickness: float) -> NDArray[np.float32]:
            return self._reference(scene, thickness, size)

        choice = error_control.thickness_for_error(picture, reference, scene.volume.smallest_spacing, max_error)
        self._estimate = choice.estimated_error
        if not choice.reached:
            warnings.warn(
                f"an error of {max_error:g} was wanted and {choice.estimated_error:.2g} was reached, by estimate, "
                f"at slab thickness {choice.slab_thickness:g}",
                AccuracyWarning,
                stacklevel=3,
            )
        return choice.slab_thickness

    def _reference(self, scene: Scene, thickness: float, size: Size) -> NDArray[np.float32]:
        """What stands for the integral: no formats but float32, so that their rounding counts as error."""
        scene = error_control.reference_for(scene)
        return self._draw(scene, self._texture(scene, thickness, "rgba32f"), thickness, size, "rgba32f", 1)

    def _draw(
        self, scene: Scene, texture: DeviceTexture, thickness: float, size: Size, target_format: str, repeat: int
    ) -> NDArray[np.float32]:
        camera = scene.camera_for(size)
        color_scale = accuracy.color_scale(scene.volume, self._transfer_function(scene))
        times = []
        for _ in range(max(repeat, 1)):
            start = time.perf_counter()
            self._slabs = draw(
                self._compositor, texture, scene.volume, camera, thickness, size, target_format, color_scale
            )
            times.append(time.perf_counter() - start)
        # The first draw compiles the programs: warm draws are the others.
        self._seconds["draw"] = median(times[1:] or times)
        with self._timed("read"):
            return self._compositor.picture()

    def _facts(
        self, scene: Scene, size: Size, thickness: float, texel_format: str, target_format: str
    ) -> dict[str, Any]:
        slabs, seconds = self._slabs, dict(self._seconds)
        return {
            "renderer": self._context.renderer,
            "backend": self._context.backend,
            "size": list(size),
            "slab_thickness": thickness,
            "slabs": slabs,
            "samples": slabs * size[0] * size[1],
            "classification": scene.classification,
            "texture_format": texel_format,
            "target_format": target_format,
            "bricks_total": 1,
            "bricks_drawn": int(slabs > 0),
            "modelled": _modelled(scene, scene.camera_for(size)),
            "seconds": seconds,
            "estimated_error": self._estimated_error(scene, size, thickness, texel_format, target_format),
        }

    def _estimated_error(
        self, scene: Scene, size: Size, thickness: float, texel_format: str, target_format: str
    ) -> float | None:
        """What the choice of thickness found, or what halving it changes in a picture of a sixteenth of the pixels."""
        if self._estimate is not None or self._context.released:
            return self._estimate
        small = (max(size[0] // 4, 1), max(size[1] // 4, 1))
        with self._context:
            texture = self._texture(scene, thickness, texel_format)
            picture = self._draw(scene, texture, thickness, small, target_format, 1)
            with self._texture_set_aside():
                reference = self._reference(scene, thickness / 2, small)
        self._estimate = error_control.estimate(picture, reference, halvings=1)
        return self._estimate

    def _transfer_function(self, scene: Scene) -> TransferFunction:
        if scene.transfer_function is not None:
            return scene.transfer_function
        if self._proposed is None or self._proposed[0] is not scene.volume:
            self._proposed = (scene.volume, proposed_for(scene.volume))
        return self._proposed[1]

    def _checked_size(self, size: Size) -> Size:
        width, height = checked_size(size)
        largest = self._compositor.largest_picture
        if not (width <= largest and height <= largest):
            raise InputError(f"size {width}x{height}: a picture has 1 to {largest} pixels along each side here")
        return width, height

    def _forget_texture(self) -> None:
        if self._baked:
            self._baked[1].release()
        self._baked = None

    @contextmanager
    def _texture_set_aside(self) -> Iterator[None]:
        """Whatever is baked inside, the last picture's texture is still there for the next."""
        kept, self._baked = self._baked, None
        try:
            yield
        finally:
            self._forget_texture()
            self._baked = kept

    @contextmanager
    def _timed(self, what: str) -> Iterator[None]:
        start = time.perf_counter()
        yield
        self._seconds[what] = time.perf_counter() - start


def _chosen_target(target_format: str) -> str:
    if target_format == "auto":
        # Any smaller target rounds each blend to 2^-11 or worse, more than the usual error of a whole picture; and
        # with a blend per slab stack its price does not show.
        return "rgba32f"
    if target_format not in TARGET_FORMATS:
        raise InputError(f"target format is auto, rgba8, rgba16f or rgba32f, and not {target_format!r}")
    return target_format


def _modelled(scene: Scene, camera: Camera) -> list[str]:
    """Names of what the scene made the renderer model beyond plain absorption and emission along parallel rays."""
    names = []
    if camera.projection == "perspective":
        names.append("perspective")
    if any(scene.background):
        names.append("background")
    if scene.transfer_function is not None and scene.transfer_function.emissive:
        names.append("emissive")
    return names


def _same(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    """Whether two texture keys mean the same texture: volume and transfer function by identity."""
    return one[0] is other[0] and one[1] is other[1] and one[2:] == other[2:]
