"""What a signal ends leaves one line, a status, and nothing half written."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time
import weakref
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import numpy as np
import pytest

from texvol.util import termination


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder to work in, with a volume."""
    np.save(tmp_path / "v.npy", np.random.default_rng(0).random((12, 10, 8)).astype(np.float32))
    monkeypatch.chdir(tmp_path)
    return tmp_path


def _ended(code: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, timeout=60)


@pytest.mark.parametrize(
    ("stop", "status", "said"), [(signal.SIGINT, 130, "interrupted"), (signal.SIGTERM, 143, "ended by SIGTERM")]
)
def test_a_signal_ends_with_one_line_and_no_file(folder: Path, stop: signal.Signals, status: int, said: str) -> None:
    """The signal is sent when a picture has been drawn, and others are to follow."""
    process = _ended(f"""
import os, sys
from texvol.__main__ import main
from texvol.rendering import pictures

right = pictures.draw
pictures.draw = lambda *given: (right(*given), os.kill(os.getpid(), {stop.value}))[0]
sys.exit(main(["render", "v.npy", "--repeat", "100000", "--size", "9x9", "-o", "a.png"]))
""")
    assert (process.returncode, process.stdout, process.stderr) == (status, "", f"texvol: {said}\n")
    assert not Path("a.png").exists()


def test_ctrl_c_while_libraries_load_is_one_line_too() -> None:
    code = """
import os, signal, sys
from texvol.__main__ import main

class Finder:
    def find_spec(self, name, *_):
        if name == "numpy":
            os.kill(os.getpid(), signal.SIGINT)

sys.meta_path.insert(0, Finder())
sys.exit(main(["--version"]))
"""
    process = _ended(code)
    assert (process.returncode, process.stdout, process.stderr) == (130, "", "texvol: interrupted\n")


_LOADS = """
import os, signal, sys
from texvol.__main__ import main
from texvol.cli import command_line
from texvol.options import first_choice
from texvol.util.errors import InputError

def loads(*_):
    try:
        os.kill(os.getpid(), {number})
        signal.sigtimedwait([], 5 if {number} else 0)
        sys.exit()
    except BaseException:
        raise ImportError("could not import module datetime") from None

def reads(*_):
    try:
        loads()
    except ImportError as error:
        raise InputError("reading this needs the extra zarr") from error

{patch}
sys.exit(main(["info", "v.npy"]))
"""


@pytest.mark.parametrize(
    ("number", "patch", "status", "said"),
    [
        (signal.SIGINT, "command_line.main = loads", 130, "texvol: interrupted\n"),
        (signal.SIGINT, "first_choice.volume_of = reads", 130, "texvol: interrupted\n"),
        (signal.SIGTERM, "first_choice.volume_of = reads", 143, "texvol: ended by SIGTERM\n"),
        (0, "first_choice.volume_of = reads", 2, "texvol: error: reading this needs the extra zarr\n"),
    ],
)
def test_a_signal_of_which_a_library_makes_an_import_error(number: int, patch: str, status: int, said: str) -> None:
    """As compiled libraries do of any exception; without a signal (number 0) the error is what it says."""
    process = _ended(_LOADS.format(number=int(number), patch=patch))
    assert (process.returncode, process.stdout, process.stderr) == (status, "", said)


@pytest.mark.parametrize("context", [termination.heard, termination.never_lost])
def test_an_earlier_signal_is_no_reason_for_an_import_error(context: Callable[[], AbstractContextManager]) -> None:
    with pytest.raises(KeyboardInterrupt), termination.never_lost():
        signal.raise_signal(signal.SIGINT)
    with pytest.raises(ImportError, match="no such thing"), context():
        raise ImportError("no such thing")


@pytest.mark.parametrize(
    ("stop", "raised"), [(signal.SIGINT, KeyboardInterrupt), (signal.SIGTERM, termination.Terminated)]
)
def test_a_signal_is_heard_again_that_a_callback_has_dropped(stop: signal.Signals, raised: type[BaseException]) -> None:
    """As of imports, whose locks have callbacks."""
    begin = time.monotonic()
    with pytest.raises(raised), termination.heard(), termination.never_lost():
        thing = threading.Lock()
        dropping = weakref.ref(thing, lambda _: signal.raise_signal(stop))
        del thing
        assert dropping() is None
        time.sleep(30)
    assert time.monotonic() - begin < 20, "what the thread waits for has been ended"


def test_a_signal_leaves_nothing_beside_what_is_being_written(folder: Path) -> None:
    before = sorted(os.listdir())
    code = (
        "import os, sys; from texvol.__main__ import main; "
        f"os.replace = lambda *names: os.kill(os.getpid(), {signal.SIGTERM.value}); "
        "sys.exit(main(['render', 'v.npy', '-o', 'a.png', '--size', '9x9']))"
    )
    process = _ended(code)
    assert process.returncode == 143
    assert sorted(os.listdir()) == before


@pytest.mark.parametrize("number", termination.SIGNALS)
def test_signals_are_heard_where_nobody_else_does(number: signal.Signals) -> None:
    before = signal.signal(number, signal.SIG_DFL)
    try:
        with pytest.raises(termination.Terminated, match=number.name), termination.heard():
            os.kill(os.getpid(), number)
        assert signal.getsignal(number) is signal.SIG_DFL
        signal.signal(number, signal.SIG_IGN)  # as nohup has it
        with termination.heard():
            os.kill(os.getpid(), number)
        assert signal.getsignal(number) is signal.SIG_IGN
    finally:
        signal.signal(number, before)
