"""Kinds of films and their ffmpeg commands: H.264 in MP4, and GIF, which any page or mail program plays.

A GIF has 256 colours per picture and counts time in hundredths of a second: each picture has its own palette, and
begins at the hundredth nearest to its time. A GIF repeats.
"""

from __future__ import annotations

import os
from pathlib import Path

from texvol.util.errors import InputError, missing_extra

FORMATS = (".mp4", ".gif")
# Viewers replace a duration of less than two hundredths of a second by ten hundredths.
_FASTEST_GIF = 50.0


def is_film(path: str | os.PathLike[str]) -> bool:
    """True if the name is that of a film."""
    return Path(path).suffix.lower() in FORMATS


def is_gif(path: str | os.PathLike[str]) -> bool:
    """True if the name is that of a GIF."""
    return Path(path).suffix.lower() == ".gif"


def check_size(path: str | os.PathLike[str], size: tuple[int, int]) -> None:
    """Raise InputError if the kind of film can't have this size."""
    if not is_gif(path) and (size[0] % 2 or size[1] % 2):
        raise InputError(f"size must be even along both sides for a film (H.264, 4:2:0), got {size[0]}x{size[1]}")
    if is_gif(path) and max(size) > 0xFFFF:
        raise InputError(f"size must be at most 65535 along each side for a GIF, got {size[0]}x{size[1]}")


def check_rate(path: str | os.PathLike[str], fps: float | None) -> None:
    """Raise InputError if --fps is given and the file can't have it."""
    if fps is None:
        return
    if not is_film(path):
        raise InputError(f"--fps needs a film, whose name ends with {' or '.join(FORMATS)}, got {path}")
    if is_gif(path) and fps > _FASTEST_GIF:
        raise InputError(f"{path}: --fps must be at most {_FASTEST_GIF:g} for a GIF, got {fps:g}")


def ffmpeg() -> str:
    """Return the path of ffmpeg, or raise MissingExtraError."""
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise missing_extra("imageio-ffmpeg", "film", "a film") from error


def command(program: str, path: str, size: tuple[int, int], fps: float) -> list[str]:
    """Return the ffmpeg command that makes a film of pictures on its input; the output file must be appended.

    The pictures are 8-bit sRGB, top row first. The kind of film is that of `path`.
    """
    width, height = size
    read = ["-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
    return [program, *read, "-r", f"{fps:.12g}", "-i", "-", "-an", *(_GIF if is_gif(path) else _MP4)]


# Explicit, because players assume BT.601 or BT.709 by the size of a film without colour tags.
_COLORS = "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd,format=yuv420p"
_MP4 = ["-vf", f"{_COLORS},setparams=color_primaries=bt709:color_trc=iec61966-2-1"]
# Half the time of the default preset, and no larger here; at 18 losses are invisible.
_MP4 += ["-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-movflags", "+faststart", "-f", "mp4"]
# Ordered dither is stable from picture to picture, where error diffusion crawls, and compresses better.
_PALETTE = "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=bayer:bayer_scale=4"
_GIF = ["-vf", _PALETTE, "-loop", "0", "-f", "gif"]
