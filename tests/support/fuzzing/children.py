"""Attempts in forked children that may die: which attempt raised, crashed, hung, or took memory, and how it went on.

A child makes hundreds of attempts one after the other and notes each outcome in memory that it shares with its parent.
When it dies, the attempt without an outcome is the one to blame, and another child goes on after it. An attempt is a
function of a number; it returns the bytes that its result honestly takes, or raises TexvolError to refuse.
"""

from __future__ import annotations

import contextlib
import faulthandler
import gc
import json
import mmap
import os
import resource
import select
import signal
import struct
import sys
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import IO, NamedTuple

from texvol.util.errors import TexvolError

Attempt = Callable[[int], int]

NONE, READ, REFUSED, RAISED, SIGNAL, TIME, MEMORY, PRINTED, LEAKED, MESSAGE = (
    "none", "read", "refused", "other exception", "signal", "time", "memory", "printed", "leaked", "message"
)  # fmt: skip
OUTCOMES = (NONE, READ, REFUSED, RAISED, SIGNAL, TIME, MEMORY, PRINTED, LEAKED, MESSAGE)
_LONGEST = 6000  # characters of a traceback that are kept
_SLOWEST = struct.Struct("dq")  # seconds, number


class Limits(NamedTuple):
    """Limits of an attempt: wall-clock seconds; resident bytes beyond twice the result; bytes of address space."""

    seconds: float = 10.0
    memory: int = 64 << 20
    address_space: int = 3 << 30


class Finding(NamedTuple):
    """An attempt that ended in any other way than by a result or a refusal."""

    number: int
    outcome: str
    signature: str  # the same for findings of the same cause, as far as a traceback tells
    text: str


@dataclass
class Results:
    """Outcomes of attempts; counts by kind and outcome."""

    counts: Counter[tuple[str, str]] = field(default_factory=Counter)
    findings: list[Finding] = field(default_factory=list)
    slowest: tuple[float, int] = (0.0, -1)  # seconds, number
    signatures: set[str] = field(default_factory=set)


@dataclass
class _Child:
    """A forked child, its numbers, and what it leaves for its parent."""

    pid: int
    handle: int
    numbers: Sequence[int]
    shared: mmap.mmap
    log: IO[str]
    trace: IO[str]
    seen: tuple[int, float] = (-1, 0.0)  # attempts made, and since when as many

    @property
    def made(self) -> int:
        """Number of attempts that have an outcome."""
        return self.shared[_SLOWEST.size :].index(0)


def run(
    attempt: Attempt,
    blocks: Iterable[Sequence[int]],
    kind_of: Callable[[int], str],
    limits: Limits = Limits(),  # noqa: B008 (immutable)
    *,
    jobs: int = 1,
    report: Callable[[Results, Sequence[Finding]], None] = lambda *_: None,
) -> Results:
    """Results of the attempts at all numbers of the blocks, each block begun in a child of its own.

    `kind_of` names the kind of a number for the counts; `report` is called after each child with the results so far
    and with what the child has found.
    """
    results, pending = Results(), iter(blocks)
    running: dict[int, _Child] = {}
    again: list[Sequence[int]] = []
    poll = select.poll()
    gc.collect()
    gc.freeze()  # children leave what they share alone, and do not copy it
    try:
        while True:
            while len(running) < jobs and (numbers := again.pop() if again else next(pending, None)):
                child = _started(attempt, numbers, limits)
                running[child.handle] = child
                poll.register(child.handle, select.POLLIN)
            if not running:
                return results
            ended = {handle for handle, _ in poll.poll(1000)}
            ended |= {handle for handle, child in running.items() if _hangs(child, limits)}
            for handle in ended:
                poll.unregister(handle)
                found, rest = _collected(running.pop(handle), results, kind_of)
                again += [rest] if rest else []
                results.findings += found
                report(results, found)
    finally:
        gc.unfreeze()
        for child in running.values():
            _end(child)


def _started(attempt: Attempt, numbers: Sequence[int], limits: Limits) -> _Child:
    shared = mmap.mmap(-1, _SLOWEST.size + len(numbers) + 1)
    log, trace = (tempfile.TemporaryFile("w+", errors="replace") for _ in range(2))  # noqa: SIM115 (as long as it)
    sys.stdout.flush()
    pid = os.fork()
    if pid == 0:
        try:
            _be_child(attempt, numbers, limits, shared, log, trace)
        except BaseException:
            traceback.print_exc(file=trace)
            trace.flush()
            os._exit(1)
        os._exit(0)
    return _Child(pid, os.pidfd_open(pid), numbers, shared, log, trace)


def _hangs(child: _Child, limits: Limits) -> bool:
    """True if a child has not ended by its own alarm, as one that blocks signals does not."""
    if child.made != child.seen[0]:
        child.seen = child.made, time.monotonic()
    return time.monotonic() - child.seen[1] > 2 * limits.seconds + 1


def _end(child: _Child) -> int:
    """Wait status of a child, which is killed with whatever it has started if it still runs."""
    pid, status = os.waitpid(child.pid, os.WNOHANG)
    with contextlib.suppress(ProcessLookupError, PermissionError):
        os.killpg(child.pid, signal.SIGKILL)
    if not pid:
        os.waitpid(child.pid, 0)
        status = signal.SIGALRM  # did not end by itself
    os.close(child.handle)
    return status


def _collected(child: _Child, results: Results, kind_of: Callable[[int], str]) -> tuple[list[Finding], Sequence[int]]:
    """Findings of a child that has ended or hangs, and the numbers that it left; its counts go to the results."""
    status, made = _end(child), child.made
    child.log.seek(0)
    found = [Finding(**json.loads(line)) for line in child.log if line.endswith("\n")]
    outcomes = [OUTCOMES[code] for code in child.shared[_SLOWEST.size : _SLOWEST.size + made]]
    results.slowest = max(results.slowest, _SLOWEST.unpack(child.shared[: _SLOWEST.size]))
    rest = child.numbers[made:]
    if rest:
        child.trace.seek(0)
        found.append(_death(rest[0], status, child.trace.read(_LONGEST)))
        outcomes.append(found[-1].outcome)
        rest = rest[1:]
    results.counts.update((kind_of(number), outcome) for number, outcome in zip(child.numbers, outcomes, strict=False))
    child.log.close()
    child.trace.close()
    return found, rest


def _death(number: int, status: int, trace: str) -> Finding:
    """The attempt that ended its child, by the child's wait status and the traceback that it has left."""
    if os.WIFSIGNALED(status) and os.WTERMSIG(status) != signal.SIGALRM:
        outcome, how = SIGNAL, signal.Signals(os.WTERMSIG(status)).name
    elif os.WIFSIGNALED(status):
        outcome, how = TIME, ""
    else:
        outcome, how = SIGNAL, f"exit status {os.WEXITSTATUS(status)}"
    trace = trace.partition("Extension modules:")[0]
    frames = [line.strip() for line in trace.splitlines() if line.strip().startswith("File ")]
    own = [frame for frame in frames if f"{os.sep}texvol{os.sep}" in frame]
    signature = " < ".join(frame.rpartition(os.sep)[2] for frame in [*frames[:1], *own[:1]])
    return Finding(number, outcome, f"{outcome} {how} {signature}", trace)


def _be_child(
    attempt: Attempt, numbers: Sequence[int], limits: Limits, shared: mmap.mmap, log: IO[str], trace: IO[str]
) -> None:
    os.setpgid(0, 0)  # so that what it starts is ended with it
    printed = _with_limits(limits, trace)
    clear_refs = os.open("/proc/self/clear_refs", os.O_WRONLY)
    handles = _handles()
    for position, number in enumerate(numbers):
        os.pwrite(clear_refs, b"5", 0)  # the peak of resident memory begins anew
        before, start = _peak(), time.perf_counter()
        signal.setitimer(signal.ITIMER_REAL, limits.seconds)
        outcome, signature, text, honest = _outcome(attempt, number)
        signal.setitimer(signal.ITIMER_REAL, 0)
        seconds, taken = time.perf_counter() - start, _peak() - before
        if outcome in (READ, REFUSED) and taken > limits.memory + 2 * honest:
            outcome = signature = MEMORY
            text = f"{taken >> 20} MiB were taken, for a result of {honest} bytes"
        if outcome in (READ, REFUSED) and os.lseek(printed, 0, os.SEEK_CUR):
            outcome, text = PRINTED, os.pread(printed, _LONGEST, 0).decode("utf-8", "replace")
            signature = f"{PRINTED} {text[:60]}"
        if os.lseek(printed, 0, os.SEEK_CUR):
            os.ftruncate(printed, 0)
            os.lseek(printed, 0, os.SEEK_SET)
        if outcome in (READ, REFUSED) and _handles() > handles:
            gc.collect()
            if not _are_closed(handles):
                outcome = signature = LEAKED
                text = f"{_handles() - handles} more descriptors are open than before"
        handles = max(handles, _handles())
        if outcome not in (READ, REFUSED):
            print(json.dumps(Finding(number, outcome, signature, text)._asdict()), file=log, flush=True)
        if seconds > _SLOWEST.unpack(shared[: _SLOWEST.size])[0]:
            shared[: _SLOWEST.size] = _SLOWEST.pack(seconds, number)
        shared[_SLOWEST.size + position] = OUTCOMES.index(outcome)


def _outcome(attempt: Attempt, number: int) -> tuple[str, str, str, int]:
    """Outcome of an attempt, its signature and text, and the bytes of its result."""
    try:
        return READ, "", "", attempt(number)
    except TexvolError as error:
        if "\n" in str(error) or not str(error).strip():
            return MESSAGE, f"{MESSAGE} of {_frames(error)}", repr(str(error)), 0
        return REFUSED, "", "", 0
    except BaseException as error:
        text = "".join(traceback.format_exception(error))[-_LONGEST:]
        return RAISED, f"{type(error).__name__} {_frames(error)}", text, 0


def _frames(error: BaseException) -> str:
    """Where an error comes from: the innermost frame, and the innermost one of texvol."""
    frames = traceback.extract_tb(error.__traceback__)[::-1]
    own = [frame for frame in frames if f"{os.sep}texvol{os.sep}" in frame.filename]
    # Where recursion ends says nothing, and may be anywhere.
    chosen = own[:1] if isinstance(error, RecursionError) and own else [*frames[:1], *own[:1]]
    return " < ".join(f"{os.path.basename(frame.filename)}:{frame.lineno} {frame.name}" for frame in chosen)


def _with_limits(limits: Limits, trace: IO[str]) -> int:
    """Set the limits of this process; the descriptor of what it prints."""
    printed = os.memfd_create("printed")
    nothing = os.open(os.devnull, os.O_RDONLY)
    for source, target in ((nothing, 0), (printed, 1), (printed, 2)):
        os.dup2(source, target)
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    faulthandler.enable(trace, all_threads=False)
    faulthandler.register(signal.SIGALRM, trace, all_threads=False, chain=True)  # then it ends the process
    with open("/proc/self/statm", encoding="ascii") as pages:
        now = int(pages.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + limits.address_space,) * 2)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    return printed


def _are_closed(handles: int) -> bool:
    """True if no more descriptors are open than before; threads that end an abandoned reading get a second for it."""
    end = time.monotonic() + 1
    while _handles() > handles and time.monotonic() < end:
        time.sleep(0.02)
    return _handles() <= handles


def _peak() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def _handles() -> int:
    return len(os.listdir("/proc/self/fd"))
