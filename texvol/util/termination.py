"""Signals that end a command: SIGTERM and SIGHUP raise an exception, as ctrl-C does, so that it can clean up.

`postponed` keeps these exceptions out of code that they would leave broken. `never_lost` raises them again where Python
drops them, and both contexts where a library that was loading has made an ImportError of them.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from types import FrameType

SIGNALS = (signal.SIGTERM, signal.SIGHUP)
_LATER = 0.01  # seconds: raised at once, it would be dropped with the rest of the callback
_arrived: list[int] = []  # numbers of signals, in order


class Terminated(BaseException):
    """One of `SIGNALS` arrived; not an Exception, like KeyboardInterrupt, so that `except Exception` passes it on."""

    def __init__(self, number: int) -> None:
        self.number = signal.Signals(number)
        super().__init__(f"ended by {signal.Signals(number).name}")
        self.status = 128 + number  # exit status as of a shell


@contextmanager
def heard() -> Iterator[None]:
    """Raise Terminated on `SIGNALS` within this context; ignored signals (nohup) stay ignored."""
    ours, before = [], len(_arrived)
    if threading.current_thread() is threading.main_thread():  # Python handles signals there only
        ours = [each for each in SIGNALS if signal.getsignal(each) is signal.SIG_DFL]
    try:
        for each in ours:
            signal.signal(each, _raise)
        yield
    except Exception as error:
        _raise_what_ended(error, before)
        raise
    finally:
        for each in ours:
            signal.signal(each, signal.SIG_DFL)


@contextmanager
def never_lost() -> Iterator[None]:
    """Raise ctrl-C and `SIGNALS` again within this context if Python drops their exceptions.

    It does so with whatever is raised in a destructor or in the callback of a weak reference, as imports have: a
    command that is interrupted while its libraries load would go on as if nothing had been said.
    """
    hook, before = sys.unraisablehook, len(_arrived)
    ours = threading.current_thread() is threading.main_thread()
    ours = ours and signal.getsignal(signal.SIGINT) is signal.default_int_handler
    sys.unraisablehook = partial(_again, hook)
    try:
        if ours:
            signal.signal(signal.SIGINT, _interrupt)
        yield
    except Exception as error:
        _raise_what_ended(error, before)
        raise
    finally:
        sys.unraisablehook = hook
        if ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)


def _raise_what_ended(error: BaseException, before: int) -> None:
    """Raise KeyboardInterrupt or Terminated if an import failed on the way to this error, and a signal has arrived.

    Compiled libraries (numpy's, for one) import others and say of any exception that the import failed. The first
    `before` signals that have arrived are older.
    """
    while not isinstance(error, ImportError):
        earlier = error.__cause__ or error.__context__
        if earlier is None:
            return
        error = earlier
    if len(_arrived) > before:
        raise (KeyboardInterrupt() if _arrived[-1] == signal.SIGINT else Terminated(_arrived[-1])) from error


def _again(before: Callable[[sys.UnraisableHookArgs], object], dropped: sys.UnraisableHookArgs) -> None:
    """Send a signal again whose exception was dropped; anything else goes to the hook before ours."""
    if not isinstance(dropped.exc_value, KeyboardInterrupt | Terminated):
        before(dropped)
        return
    number = signal.SIGINT
    if isinstance(dropped.exc_value, Terminated):
        number = dropped.exc_value.number
        signal.signal(number, _raise)
    # A signal to the main thread also ends what it waits for, which _thread.interrupt_main would not.
    threading.Timer(_LATER, signal.pthread_kill, (threading.main_thread().ident, number)).start()


@contextmanager
def postponed() -> Iterator[None]:
    """Postpone ctrl-C and `SIGNALS` until this context ends.

    Some C libraries call back into Python and crash if the callback raises an exception.
    """
    received: list[int] = []
    handlers = {}
    if threading.current_thread() is threading.main_thread():
        handlers = {each: signal.getsignal(each) for each in (signal.SIGINT, *SIGNALS)}
    handlers = {each: handler for each, handler in handlers.items() if callable(handler)}
    try:
        for each in handlers:
            signal.signal(each, lambda number, _: received.append(number))
        yield
    finally:
        for each, handler in handlers.items():
            signal.signal(each, handler)
        for number in received:
            signal.raise_signal(number)


@contextmanager
def unheard_by_children() -> Iterator[None]:
    """Start threads and processes inside that never hear ctrl-C, which a terminal sends to all of them.

    Blocked signals are inherited, also by processes that such a thread starts later. This thread hears at the end what
    it could not hear inside.
    """
    from multiprocessing import resource_tracker

    # Otherwise it would start inside, and let its thread hear ctrl-C again.
    resource_tracker.ensure_running()
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _interrupt(number: int, frame: FrameType | None) -> None:
    _arrived.append(number)
    signal.default_int_handler(number, frame)


def _raise(number: int, frame: FrameType | None) -> None:
    _arrived.append(number)
    signal.signal(number, signal.SIG_DFL)  # a second signal ends the process at once
    raise Terminated(number)
