"""Ctrl-C is noted at once and raised where it is safe."""

from __future__ import annotations

import os
import signal

import pytest

from texvol.util.termination import Terminated
from texvol.window.interruption import Interruption


def pressed() -> None:
    """Ctrl-C; Python hears of it before the next line."""
    os.kill(os.getpid(), signal.SIGINT)


def test_it_is_noted_and_raised_by_a_check() -> None:
    before = signal.getsignal(signal.SIGINT)
    steps = []
    with pytest.raises(KeyboardInterrupt), Interruption() as interruption:
        interruption.check()
        pressed()
        steps.append("whole")
        interruption.check()
        steps.append("never")
    assert steps == ["whole"] and signal.getsignal(signal.SIGINT) is before


def test_it_is_not_forgotten_at_the_end() -> None:
    with pytest.raises(KeyboardInterrupt), Interruption():
        pressed()


def test_sigterm_waits_for_a_check_as_well() -> None:
    steps = []
    with pytest.raises(Terminated, match="SIGTERM") as caught, Interruption() as interruption:
        os.kill(os.getpid(), signal.SIGTERM)
        steps.append("whole")
        interruption.check()
        steps.append("never")
    assert steps == ["whole"] and caught.value.status == 143
    assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL


def test_another_error_goes_first() -> None:
    with pytest.raises(ValueError, match="spoilt"), Interruption():
        pressed()
        raise ValueError("spoilt")


def test_without_it_nothing_is_raised() -> None:
    with Interruption() as interruption:
        interruption.check()
    assert not interruption.received
