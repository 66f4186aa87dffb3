"""Main loop of the window: it takes events and draws one frame at a time; no step takes longer than a frame."""

from __future__ import annotations

import contextlib

import numpy as np
from imgui_bundle import imgui

from texvol.formats.pictures import image
from texvol.util import color, writing
from texvol.util.errors import InputError
from texvol.window import closing, commands, exporting, freeing, kept, navigation, opening, panels, rescue, timings
from texvol.window.desk import MOST_PANEL, PANEL_WIDTH, Desk
from texvol.window.director import Director, Wanted
from texvol.window.events import Event, Queue
from texvol.window.home import Home
from texvol.window.interface import Interface
from texvol.window.painter import Painter
from texvol.window.plan import Plan
from texvol.window.playing import follow as follow_time
from texvol.window.probe import at_point, first_medium
from texvol.window.quality import SETTLED, Pace
from texvol.window.reframing import follow as follow_box
from texvol.window.screen import Textures
from texvol.window.script import Action, Player, Recorder
from texvol.window.steering import Viewport, pressed_commands
from texvol.window.timings import Frame
from texvol.window.transport import SharedArrays

_FRAME = 1 / 60  # seconds: screens show no more frames, and the painting processes need the cores
_PATIENT = 0.1  # seconds between frames while a drag waits for a picture
_IDLE = 0.5  # seconds between checks for changes that raise no event
_MINIMISED = 0.1  # seconds to wait in each frame of a minimised window
_FRAMES_AFTER_EVENT = 3
_REFINER_NICENESS = 5


class Application:
    """Window with its main loop, a context manager that closes the window."""

    def __init__(self, plan: Plan) -> None:
        self._plan, self._queue, self._played = plan, Queue(), Queue()
        self._late = 0.0  # seconds since the events of the frame came
        self._timed: list[Frame] = []
        is_played = plan.player is not None
        # What is played back must not depend on what was done before.
        beside = PANEL_WIDTH if is_played else kept.panel_width()
        self._closers = contextlib.ExitStack()
        try:
            self._recorder = Recorder(plan.record) if plan.record else None
            if self._recorder:
                self._closers.callback(self._recorder.close)
            screen: Home = plan.home(plan.window_size(beside), "texvol", self._queue.put)
            self._screen = screen
            self._closers.callback(screen.close)
            if screen.scale > 1:
                screen.resize(plan.window_size(beside, screen.scale))
            self._interface = Interface(screen)
            self._closers.callback(self._interface.close)
            self._shared = SharedArrays()
            self._closers.callback(self._shared.close)
            self._painters = mover, refiner = self._painter(0), self._painter(_REFINER_NICENESS)
            director = Director(mover, refiner, Pace(plan.frames_per_second), plan.max_error, plan.slicing)
        except BaseException:
            self.close()
            raise
        self._desk = Desk(director, lambda: self._painter(_REFINER_NICENESS), screen.wake, screen.copy)
        self._desk.textures = Textures(screen)
        self._desk.times.prepare = self._shared.prepare
        self._closers.callback(self._desk.close)
        self._desk.is_played = is_played
        self._desk.preferences.panels, self._desk.preferences.width = plan.panels, beside
        self._minimised = self._over = False
        self._foot = self._grown = 0  # height of the time bar, and what the window has grown by it
        self._lively = _FRAMES_AFTER_EVENT
        self._mark = ""
        self._frames = 0  # frames counted against `plan.frames`
        self._shots: list[str] = []
        self._last = self._last_picture = self._started = screen.time
        self._changed_at: float | None = None

    def __enter__(self) -> Application:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the window and end the painting processes; errors while closing are ignored."""
        with contextlib.suppress(Exception):
            self._closers.close()

    def run(self) -> None:
        """Run the main loop until the window is closed.

        Raises
        ------
        InputError
            If the first document can't be opened.
        """
        plan = self._plan
        if not self._desk.is_played:
            kept.restore_views(self._desk)
        self._arrange()
        self._first_size = self._screen.size
        if plan.open is not None:
            pixels, make = self._desk.pixels, plan.open
            self._desk.load(plan.name, lambda: make(pixels), first=True)
        desk, has_begun = self._desk, False
        with rescue.rescuing(desk):
            while not self._over and not desk.wants_close:
                plan.check()
                self.frame()
                if desk.document is None and desk.failed_first:
                    raise InputError(desk.failed_first)
                if not has_begun and (plan.open is None or desk.document is not None):
                    has_begun = True
                    plan.begun(desk.document)
        if not desk.is_played:
            kept.keep(desk.preferences.width, self._size_to_keep(), kept.views_of(desk))
        if plan.timings:
            timings.write(plan.timings, self._timed)

    def _size_to_keep(self) -> tuple[int, int] | None:
        """Return the size of the picture if the user has changed that of the window."""
        desk, area = self._desk, self._desk.layout.area
        width, height = self._screen.size
        same = (
            (width, height - self._grown) == self._first_size or desk.preferences.fullscreen or self._screen.is_remote
        )
        return None if same else (round(area.width), round(area.height))

    def frame(self) -> None:
        """Process the events and draw one frame."""
        screen, desk = self._screen, self._desk
        self._wait()
        desk.now = start = screen.time
        events = self._events()
        self._minimised = screen.minimised
        screen.fullscreen(desk.preferences.fullscreen)
        if self._minimised:
            screen.wait(_MINIMISED)
        self._interface.begin(events, self._late)
        self._arrange()
        desk.update()
        freeing.limit(desk)
        follow_time(desk)
        follow_box(desk)
        screen.title(desk.title)
        new = desk.director.update(desk.now)  # before the panels, which describe the newest picture
        if dragging := desk.steering.dragging:  # the next picture is drawn while the panels of this one are laid out
            new |= self._follow(events)
        panels.show(desk)
        if not dragging:
            new |= self._follow(events)
        if self._minimised:
            imgui.end_frame()
            return
        screen.clear(panels.ground.color(desk))
        panels.picture(desk)
        self._interface.end()
        if desk.textures is not None:
            desk.textures.drawn()
        self._note(start, new)
        self._screenshots()
        screen.check()
        if self._plan.shows_empty or self._begun:
            screen.swap()

    def _wait(self) -> None:
        """Wait for an event; the events of a drag wait until the picture of the last of them has come.

        A frame without a new picture shows nothing new then, and takes CPU time from the picture.
        """
        screen, desk = self._screen, self._desk
        screen.wait(self._patience())
        while desk.steering.dragging and desk.director.moving and (since := screen.time - self._last) < _PATIENT:
            screen.wait(_PATIENT - since)

    def _patience(self) -> float:
        """Return the seconds to wait for an event; an answer of a painting process ends the wait earlier."""
        desk, plan = self._desk, self._plan
        since = self._screen.time - self._last
        counting = (plan.frames is not None and self._counts) or (plan.player is not None and not plan.player.over)
        counting &= plan.player is None or not plan.player.waits or self._at_rest
        if counting or desk.steering.dragging or desk.moving.motion is not None or self._lively > 0:
            return max(_FRAME - since, 0.0)
        waits = [_IDLE, desk.director.next_due(desk.now), desk.times.due(desk.now)]
        waits += [each.until - desk.now for each in desk.messages]
        if plan.player is not None and plan.player.waits:  # for rest: each check takes CPU time from the refiner
            waits.append(0.1)
        elif desk.loading is not None or desk.writing is not None or plan.player is not None:
            waits.append(0.05)
        return max(_FRAME - since, min(waits), 0.0)

    def _events(self) -> list[Event]:
        """Return the events since the last frame, including those played back from a script."""
        events, player = self._queue.take(), self._plan.player
        self._late = self._queue.late
        if player is not None and not self._played_back:
            # Events of the real mouse would change the result of the script.
            events = [each for each in events if each.kind in ("close", "resize", "iconify", "focus")]
            if self._begun and self._desk.loading is None:  # a script is meant for the opened scene
                events += self._next_played(player)
        # A panel that is changed by an event shows the change one or two frames later.
        self._lively = _FRAMES_AFTER_EVENT if events else max(self._lively - 1, 0)
        if self._recorder and events:
            self._recorder.add(events, self._desk.now - self._late)
        for event in events:
            if event.kind == "close":
                closing.close(self._desk)
            elif event.kind == "drop" and event.names:
                opening.drop(self._desk, event.names, adds="ctrl" in event.modifiers)
        return events

    def _next_played(self, player: Player) -> list[Event]:
        """Return the events of a script for this frame, or do its next action."""
        if not self._played:
            for step in player.due(self._desk.now, at_rest=self._at_rest):
                if isinstance(step.item, Action):
                    self._act(step.item)
                else:
                    self._played.append(step.item, player.clock - step.t)
        events = self._played.take()
        self._late = self._played.late
        for event in events:
            if event.kind == "resize":
                self._screen.resize((int(event.x), int(event.y)))
            elif event.kind == "iconify":
                self._screen.iconify(event.down)
        return events

    @property
    def _played_back(self) -> bool:
        """True if no step of a script is left."""
        player = self._plan.player
        return (player is None or player.over) and not self._played

    @property
    def _at_rest(self) -> bool:
        desk = self._desk
        busy = desk.times.pending or desk.measuring.counting.busy or desk.moving.motion is not None
        busy |= desk.search is not None or (desk.document is not None and desk.document.unframed)
        quiet = desk.loading is None and desk.writing is None and not busy
        return desk.director.at_rest and quiet

    @property
    def _begun(self) -> bool:
        """True if a picture is shown, or if none will be drawn."""
        desk, director = self._desk, self._desk.director
        if desk.loading is not None and desk.loading.first:
            return False
        return director.shown is not None or desk.document is None or director.idle

    @property
    def _counts(self) -> bool:
        """True if this frame counts towards `plan.frames`."""
        plan = self._plan
        kept = plan.screenshot is not None and plan.frames is not None and self._frames == plan.frames - 1
        return self._begun and (self._at_rest or not (kept and self._played_back))

    def _act(self, action: Action) -> None:
        if action.do == "screenshot":
            self._shots.append(action.file)
        elif action.do == "save":
            if self._desk.document is not None:  # a script says which files it writes, and is not asked
                exporting.scene(self._desk, self._desk.document, action.file, asks=False)
        elif action.do == "command":
            commands.run(self._desk, action.name)
        elif action.do == "mark":
            self._mark = action.name

    def _arrange(self) -> None:
        """Divide the window between the picture and the panels."""
        screen, desk = self._screen, self._desk
        width, height, scale = *screen.size, max(self._interface.scale, 1.0)
        if screen.is_remote:
            desk.preferences.suit(width / scale)
        beside = min(desk.preferences.width * scale, MOST_PANEL * width) if desk.preferences.panels else 0
        area = Viewport(0, 0, width - round(beside), height)
        foot = round(panels.timebar.room(desk))
        if foot != self._foot:  # the picture keeps its height if the monitor has room for it
            self._grown += screen.grow(foot - self._grown)
        self._foot = foot
        desk.viewport = desk.layout.arrange(area, scale, desk.document is not None, foot)
        if width and height:
            pixels, before = screen.pixels, desk.pixels
            right, down = desk.viewport.width * pixels[0] / width, desk.viewport.height * pixels[1] / height
            desk.pixels = max(round(right), 1), max(round(down), 1)
            if desk.pixels != before and desk.document is not None:
                desk.document.fit(desk.pixels)

    def _steer(self, events: list[Event]) -> None:
        desk, document = self._desk, self._desk.document
        typing = bool(imgui.get_io().want_text_input)
        modal = desk.hear(events, typing=typing)
        if document is None:
            for command in pressed_commands(events) if not modal and not typing else ():
                commands.run(desk, command)  # those of a document do nothing
            return
        mouse = not imgui.get_io().want_capture_mouse and not desk.gripping and not modal
        events = panels.parts.heard(events)
        free = {"mouse": mouse, "keyboard": not typing and not modal}
        came = desk.now - self._late
        outcome = desk.steering.handle(events, document.view, document.scene.box, desk.viewport, came, **free)
        if outcome.view is not document.view:
            desk.attempt(lambda: document.look(outcome.view))
        if outcome.clicked and not desk.measuring.tool:
            point = first_medium(document.scene, desk.viewport.position(*outcome.clicked))
            if point is not None:
                document.look(navigation.with_pivot(document.view, point))
                desk.say("the view now turns about the clicked point")
        for command in outcome.commands:
            commands.run(desk, command)
        desk.probed = None
        if desk.preferences.probe and mouse and desk.viewport.holds(*desk.steering.cursor):
            point = first_medium(document.scene, desk.viewport.position(*desk.steering.cursor))
            desk.probed = None if point is None else at_point(document.scene, point)
        if not imgui.is_any_item_active() and not desk.gripping:
            document.history.end_stroke()

    def _follow(self, events: list[Event]) -> bool:
        """Do what the events say, and ask for the picture of it; return True if there is a new picture."""
        self._steer(events)
        return self._direct()

    def _direct(self) -> bool:
        desk = self._desk
        director, document = desk.director, desk.document
        if document is not None and self._minimised:
            return False
        before = director.version
        director.want(Wanted(document.scene, desk.pixels, document.drawn) if document else None, desk.now)
        if director.version != before and self._changed_at is None:
            self._changed_at = desk.now
        new = director.update(desk.now)
        self._shared.keep_only(set().union(*(each.arrays for each in self._painters)))
        return new

    def _note(self, start: float, new: bool) -> None:
        now, shown = self._screen.time, self._desk.director.shown
        height, width = shown.pixels.shape[:2] if shown is not None else (0, 0)
        rate = shown.coarseness.rate if shown is not None and shown.coarseness else 0.0
        changed = self._last_picture if self._changed_at is None else self._changed_at
        # After a pause, the interval between pictures counts from the first change.
        since = changed if changed - self._last_picture >= SETTLED else self._last_picture
        between = now - since if new else 0.0
        delay = now - changed if new and self._changed_at is not None else 0.0
        state = shown.state if shown is not None else "empty"
        if new:
            self._last_picture, self._changed_at = now, None
        if not self._counts:
            self._last = now
            return
        self._timed.append(
            Frame(
                now - self._started, now - self._last, now - start, self._desk.director.pictures, between, delay,
                state, width, height, rate, self._mark,
            )
        )  # fmt: skip
        self._frames += 1
        if not self._plan.timings:
            del self._timed[:-100]
        self._desk.panel_state["frames"] = self._timed[-100:]
        self._mark, self._last = "", now

    def _screenshots(self) -> None:
        plan = self._plan
        if plan.ends and self._played_back:
            self._desk.times.playing = False  # a film of time steps would never rest
        self._over = plan.ends and self._played_back and self._at_rest and not self._shots
        self._over |= plan.frames is not None and self._frames >= plan.frames
        if self._over:
            self._shots += [plan.screenshot] if plan.screenshot else []
        while self._shots:
            path = self._shots.pop()
            linear = color.linear_from_srgb(self._screen.read() / 255.0)
            picture = np.concatenate([linear, np.ones((*linear.shape[:2], 1))], axis=2).astype(np.float32)
            writing.write_files({path: image.encoded(path, picture, {})})

    def _painter(self, niceness: int) -> Painter:
        painter = Painter(self._shared, self._screen.wake, niceness, self._plan.device)
        self._closers.callback(painter.close)
        return painter
