"""Scene, settings and estimates of a renderer's last picture."""

from __future__ import annotations

from typing import Any

from texvol.opengl.contexts import Context
from texvol.opengl.texture_store import Stopwatch
from texvol.rendering import checking, error_control
from texvol.rendering.classification import Classified
from texvol.rendering.error_control import ByTiles
from texvol.rendering.late_estimate import Estimates
from texvol.rendering.picture import Drawn
from texvol.rendering.settings import Settings, arguments_of
from texvol.scene.scene import CompleteScene, Scene

Size = tuple[int, int]


class LastPicture:
    """Scene, settings, estimates and driver of the picture that was drawn last."""

    def __init__(self, context: Context, watch: Stopwatch) -> None:
        self._context, self._watch = context, watch
        self._last: tuple[CompleteScene, Size, Settings] | None = None
        self._by_tiles: ByTiles = None, ()
        self._stats: dict[str, Any] = {}
        self._estimates = Estimates()
        self._is_of_post = False  # True if it was checked against the integral of post
        self._check: checking.Check | None = None
        self._drawn: Drawn | None = None
        self.drawn_scene: Scene | None = None  # its scene, in the classification in which it was drawn
        self.chosen: Classified | None = None  # if it was of classification auto

    @property
    def last(self) -> Drawn | None:
        """Scene and settings of the last picture, while its report can be found: until the renderer is closed."""
        return None if self._context.released and self._estimates.error is None else self._drawn

    @property
    def estimate(self) -> float | None:
        """Estimated error of the last picture if an error was requested; nothing is drawn to find it."""
        found = checking.at_least(self._estimates.error, None if self._is_of_post else self._check)
        return error_control.if_finite(found)

    @property
    def _found_error(self) -> float | None:
        """Estimated error of the last picture that was found while it was drawn."""
        return self.estimate if self.estimate is not None else error_control.if_finite(self._estimates.quick)

    @property
    def check(self) -> checking.Check | None:
        """Check of the last picture against the oracle; None if no pixel was checked."""
        return self._check

    @property
    def attributes(self) -> dict[str, str]:
        """Attributes of the last picture's header: the driver, and the choice of classification auto."""
        chosen = {"texvol:classification": self.chosen.sentence} if self.chosen else {}
        return {"texvol:renderer": self.renderer_name} | chosen

    @property
    def settings(self) -> dict[str, Any]:
        """Arguments with which `render` draws the last picture again, with every choice of accuracy made."""
        return arguments_of(self._last[2], self._by_tiles[0]) if self._last else {}

    @property
    def uniform_settings(self) -> dict[str, Any]:
        """Arguments with which `render` draws the last scene again in slabs of one thickness, the thinnest of tiles."""
        return arguments_of(self._last[2]) if self._last else {}

    @property
    def seconds(self) -> dict[str, float]:
        """Seconds of the last `render` by step, as in `stats`: `bake`, `upload`, `draw`, `read`."""
        return dict(self._watch.seconds)

    @property
    def renderer_name(self) -> str:
        """Name that the driver gives itself (GL_RENDERER)."""
        return self._context.renderer

    @property
    def backend(self) -> str:
        """Back end: "egl" or "osmesa"."""
        return self._context.backend

    @property
    def device(self) -> int | None:
        """Number of the device that was asked for."""
        return self._context.device
