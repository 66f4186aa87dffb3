"""Free memory of the machine."""

from __future__ import annotations

from pathlib import Path

_UNKNOWN = 1 << 30  # where the system does not tell


def free_memory() -> int:
    """Bytes that Linux says are available, and no more than what the control group and `ulimit -v` have left."""
    free = [_UNKNOWN]
    meminfo = _text("/proc/meminfo")
    free += [int(line.split()[1]) << 10 for line in meminfo.splitlines() if line.startswith("MemAvailable:")]
    known = free[1:]
    for most, used in (
        ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
        ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"),
    ):
        limit, current = _text(most).strip(), _text(used).strip()
        if limit.isdigit() and current.isdigit():
            known.append(max(int(limit) - int(current), 64 << 20))
    return min([*known, *_address_space()], default=_UNKNOWN)


def _address_space() -> list[int]:
    """Return the bytes that a limit on the address space of this process has left; none without a limit."""
    try:
        import resource
    except ImportError:  # Windows
        return []
    most, _ = resource.getrlimit(resource.RLIMIT_AS)
    pages = _text("/proc/self/statm").split()
    if most == resource.RLIM_INFINITY or not pages:
        return []
    return [max(most - int(pages[0]) * resource.getpagesize(), 0)]


def _text(path: str) -> str:
    try:
        return Path(path).read_text()
    except OSError:
        return ""
