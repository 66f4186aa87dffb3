"""Processor seconds of processes that run, as Linux counts them: to the hundredth of a second."""

from __future__ import annotations

import os
from pathlib import Path

_TICKS = os.sysconf("SC_CLK_TCK")
_PARENT, _USER, _SYSTEM = 1, 11, 12  # words of /proc/PID/stat after the name


def of_descendants(ancestor: int) -> float:
    """Return the processor seconds of all processes that a process has started, and of those that they have."""
    parents, ticks = {}, {}
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            words = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue  # it has ended meanwhile
        pid = int(path.parent.name)
        parents[pid], ticks[pid] = int(words[_PARENT]), int(words[_USER]) + int(words[_SYSTEM])
    return sum(own for pid, own in ticks.items() if _descends(pid, ancestor, parents)) / _TICKS


def _descends(pid: int, ancestor: int, parents: dict[int, int]) -> bool:
    while pid in parents:
        pid = parents[pid]
        if pid == ancestor:
            return True
    return False
