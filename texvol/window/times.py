"""Time of the open scene: which step is shown, which is wanted, and playing through them.

A time step is like the view: it is no step of the undo history, and no unsaved change. All volumes of the scene that
are steps of a series of the same length go along; others, and hidden ones, stay as they are. While a film is played,
the next step follows as soon as it has been read, the picture of the last one is shown, and its time has come.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from texvol.scene.volume import Volume
from texvol.window.ahead import Ahead, Track, replacements
from texvol.window.director import Director
from texvol.window.document import Document

DEFAULT_PACE, LEAST_PACE, MOST_PACE = 10.0, 0.5, 60.0  # steps per second
_AHEAD = 32  # steps that are read before they are needed


@dataclass
class Times:
    """Time of the open scene.

    Attributes
    ----------
    count : int
        Number of time steps; 1 without a time series.
    step, wanted : int
        The step that is shown, and the one that will be as soon as it has been read.
    pace : float
        Most steps per second while a film is played.
    shown : list of float
        Moments at which steps were shown, the latest last; at most 30.
    prepare : callable, optional
        Copies arrays of the next steps to where painting processes read them, see `Ahead`.
    """

    count: int = 1
    step: int = 0
    wanted: int = 0
    playing: bool = False
    pace: float = DEFAULT_PACE
    ahead: Ahead | None = None
    faults: list[str] = field(default_factory=list)
    shown: list[float] = field(default_factory=list)
    prepare: Callable[[Sequence[NDArray]], None] | None = None
    _document: Document | None = None
    _volumes: tuple[Volume, ...] = ()
    _tracks: dict[str, list[Volume]] = field(default_factory=dict)
    _asked: tuple[object, ...] = ()
    _counted: bool = False
    _waiting: bool = False

    @property
    def has_steps(self) -> bool:
        """True if there is more than one step."""
        return self.count > 1

    @property
    def pending(self) -> bool:
        """True while the wanted step of a volume is being read, or the steps are being counted."""
        return self.ahead is not None and (self.wanted != self.step or self._waiting or not self._counted)

    @property
    def time(self) -> str:
        """Time of the wanted step with its unit, "" if the file does not tell."""
        for key in self._tracks:
            known = None if self.ahead is None else self.ahead.times.get(key)
            if known is not None and self.wanted < len(known[0]):
                return f"{known[0][self.wanted]:.4g} {known[1].partition(' since ')[0]}".strip()
        return ""

    @property
    def rate(self) -> float:
        """Steps per second that were shown lately; 0 if too few were."""
        moments = self.shown[-10:]
        return (len(moments) - 1) / (moments[-1] - moments[0]) if len(moments) > 2 else 0.0

    def go(self, step: int) -> None:
        """Show a step as soon as it has been read; beyond the last one comes the first one."""
        if self.has_steps:
            self.wanted = step % self.count

    def due(self, now: float) -> float:
        """Return the seconds until the next step of a film may be shown; infinite if it waits for something else."""
        left = self._left(now) if self.playing and self.has_steps else 0.0
        return left if left > 0 else float("inf")

    def _left(self, now: float) -> float:
        return self.shown[-1] + 1 / self.pace - now if self.shown else 0.0

    def update(
        self, document: Document | None, director: Director, now: float, wake: Callable[[], None]
    ) -> dict[Volume, Volume]:
        """Follow the open scene, and show the wanted step if it has been read; return new volumes by old ones."""
        if document is not self._document:
            self._leave(document)
        if document is None:
            return {}
        if document.scene.volumes != self._volumes:
            self._look(document, wake)
        if self.ahead is None:
            return {}
        self.faults += self.ahead.faults
        self.ahead.faults.clear()
        self._count()
        if self.playing:
            self._play(director, now)
        self._ask()
        return self._show(document, now)

    def close(self) -> None:
        """End the thread that reads."""
        self._leave(None)

    def _leave(self, document: Document | None) -> None:
        if self.ahead is not None:
            self.ahead.close()
        self._document, self.ahead, self._volumes, self._tracks = document, None, (), {}
        self.count, self.step, self.wanted, self.playing, self._asked = 1, 0, 0, False, ()
        self._waiting = False
        self.shown.clear()

    def _look(self, document: Document, wake: Callable[[], None]) -> None:
        """Find the time series of the scene, whose volumes have changed."""
        self._volumes = document.scene.volumes
        found: dict[str, list[Volume]] = {}
        tracks = []
        for volume in self._volumes:
            track = Track.of(volume)
            if track is not None:
                tracks.append(track)
                found.setdefault(track.key, []).append(volume)
        if tracks and self.ahead is None:
            self.step = self.wanted = tracks[0].step
            self.ahead = Ahead(wake, prepare=self.prepare)
        self._tracks, self._asked = found, ()
        if not tracks:
            self.count, self.playing = 1, False

    def _count(self) -> None:
        """Learn the number of steps: that of the longest series; shorter ones stay as they are."""
        assert self.ahead is not None
        known = {key: self.ahead.lengths.get(key) for key in self._tracks}
        self._counted = None not in known.values()
        if not self._counted or not known:
            return
        self.count = max(each or 1 for each in known.values())
        self._tracks = {key: each for key, each in self._tracks.items() if known[key] == self.count}
        self.wanted = min(self.wanted, self.count - 1)

    def _play(self, director: Director, now: float) -> None:
        """Want the next step if it has been read and the picture of this one is shown."""
        assert self.ahead is not None
        next_one = (self.step + 1) % self.count
        if self.ahead.is_bad(list(self._tracks), next_one):
            self.playing = False
            return
        seen = director.shown is not None and director.shown.version == director.version
        ready = self.ahead.steps(list(self._tracks), next_one) is not None
        if self.wanted == self.step and seen and ready and self._left(now) <= 0:
            self.wanted = next_one

    def _ask(self) -> None:
        """Have the wanted step read, then those that will be wanted next."""
        assert self.ahead is not None
        ways = (1,) if self.playing else (1, -1)
        most = min(_AHEAD, self.count)
        near = (self.wanted + way * distance for distance in range(1, most) for way in ways)
        order = tuple(dict.fromkeys([self.wanted, *(number % self.count for number in near)]))[:most]
        asked = (order, tuple(self._tracks))
        if asked != self._asked:
            self._asked = asked
            self.ahead.ask([Track(key, several[0]) for key, several in self._tracks.items()], order)

    def _show(self, document: Document, now: float) -> dict[Volume, Volume]:
        """Put the wanted step into the scene, if one of its volumes is of another step."""
        assert self.ahead is not None
        self._waiting = False
        stale = any(each.source["time"] != self.wanted for several in self._tracks.values() for each in several)
        if not stale or not self.has_steps:
            self.step = self.wanted
            return {}
        steps = self.ahead.steps(list(self._tracks), self.wanted)
        if steps is None:
            if self.ahead.is_bad(list(self._tracks), self.wanted):
                self.wanted, self.playing = self.step, False
            else:
                self._waiting = True  # also for a volume that was added at another step than the shown one
            return {}
        found = replacements(self._tracks, steps)
        if not _alike(found):
            self.faults.append(f"time step {self.wanted} has another number of samples, and is not shown")
            self.wanted, self.playing = self.step, False
            return {}
        document.at_step(found)
        self.shown = [*self.shown[-29:], now]
        self.step = self.wanted
        self._volumes = document.scene.volumes
        self._tracks = {key: [found.get(each, each) for each in several] for key, several in self._tracks.items()}
        return found


def _alike(found: dict[Volume, Volume]) -> bool:
    """True if each new volume is as large as the old one: masks and hidden labels are of its samples."""
    return all(np.array_equal(old.shape, new.shape) and old.labels == new.labels for old, new in found.items())
