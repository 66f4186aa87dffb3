"""Memory for textures: free memory of the device, or of the machine if the driver is software."""

from __future__ import annotations

from pathlib import Path

from texvol.opengl.contexts import Context

_FRACTION = 0.5  # of what is free
_UNKNOWN = 1 << 30  # where the driver does not tell
_SOFTWARE_TEXTURE = (1 << 30) - 1  # Mesa's software driver refuses textures of a gibibyte and more
_NVIDIA_FREE, _AMD_FREE = 0x9049, 0x87FC  # GL_NVX_gpu_memory_info, GL_ATI_meminfo: kibibytes


def default_budget(context: Context) -> int:
    """Bytes: half of what is free."""
    return int(_FRACTION * _free(context))


def largest_texture(context: Context) -> int:
    """Bytes of the largest texture to ask for."""
    return _SOFTWARE_TEXTURE if _is_software(context) else 1 << 62


def _free(context: Context) -> int:
    if _is_software(context):
        return _free_in_machine()
    for extension, name in (("GL_NVX_gpu_memory_info", _NVIDIA_FREE), ("GL_ATI_meminfo", _AMD_FREE)):
        if extension in context.gl.extensions:
            kibibytes = context.integer(name)
            if kibibytes > 0:
                return kibibytes << 10
    return _UNKNOWN


def _is_software(context: Context) -> bool:
    return any(name in context.renderer.lower() for name in ("llvmpipe", "softpipe", "swrast"))


def _free_in_machine() -> int:
    """Bytes that Linux says are available, and no more than what the control group has left."""
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
    return min(known, default=_UNKNOWN)


def _text(path: str) -> str:
    try:
        return Path(path).read_text()
    except OSError:
        return ""
