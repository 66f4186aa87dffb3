"""Kinds of films, and what ffmpeg is told to make one: H.264 in MP4, and GIF, which pages and mails play anywhere.

A GIF has 256 colours a picture and counts time in hundredths of a second: each picture has colours of its own, and
begins at the hundredth that is nearest to its time. It begins again at its end.
"""

from __future__ import annotations

import os
from pathlib import Path

from texvol.util.errors import InputError, missing_extra

FORMATS = (".mp4", ".gif")
# Viewers take what lasts less than two hundredths of a second for a mistake, and show it for ten.
_FASTEST_GIF = 50.0


def is_film(path: str | os.PathLike[str]) -> bool:
    """Whether the name is that of a film."""
    return Path(path).suffix.lower() in FORMATS


def is_gif(path: str | os.PathLike[str]) -> bool:
    """Whether the name is that of a GIF."""
    return Path(path).suffix.lower() == ".gif"


def check_size(path: str | os.PathLike[str], size: tuple[int, int]) -> None:
    """Raise InputError unless there are films of that kind and size."""
    if not is_gif(path) and (size[0] % 2 or size[1] % 2):
        raise InputError(f"size {size[0]}x{size[1]}: a film (H.264, 4:2:0) is even along both sides")
    if is_gif(path) and max(size) > 0xFFFF:
        raise InputError(f"size {size[0]}x{size[1]}: a GIF has at most 65535 pixels along each side")


def check_rate(path: str | os.PathLike[str], fps: float | None) -> None:
    """Raise InputError unless the file can show so many frames per second, or it isn't said how many."""
    if fps is None:
        return
    if not is_film(path):
        raise InputError(f"--fps is for films, and {path} is none: its name ends with {' or '.join(FORMATS)}")
    if is_gif(path) and fps > _FASTEST_GIF:
        raise InputError(f"{path}: a GIF shows at most {_FASTEST_GIF:g} frames per second, and not {fps:g}")


def ffmpeg() -> str:
    """The program that encodes films, or MissingExtraError."""
    try:
        import imageio_ffmpeg

        return str(imageio_ffmpeg.get_ffmpeg_exe())
    except (ImportError, RuntimeError) as error:
        raise missing_extra("imageio-ffmpeg", "film", "a film") from error


def command(program: str, path: str, size: tuple[int, int], fps: float) -> list[str]:
    """Words of the command that makes a film, of the kind that the path names, of pictures on its input.

    They are 8-bit sRGB, rows from the top. The file to write into follows.
    """
    width, height = size
    read = ["-v", "error", "-y", "-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{width}x{height}"]
    return [program, *read, "-r", f"{fps:.12g}", "-i", "-", "-an", *(_GIF if is_gif(path) else _MP4)]


# Said outright, because players take a film that says nothing for BT.601 or BT.709 by its size.
_COLORS = "scale=out_color_matrix=bt709:out_range=tv:flags=accurate_rnd,format=yuv420p"
_MP4 = ["-vf", f"{_COLORS},setparams=color_primaries=bt709:color_trc=iec61966-2-1"]
# Half of the time of the usual preset and no larger here; 18 is where losses are no longer seen.
_MP4 += ["-c:v", "libx264", "-preset", "veryfast", "-crf", "18", "-movflags", "+faststart", "-f", "mp4"]
# Ordered dither stays in its place from picture to picture, where error diffusion crawls, and packs better.
_PALETTE = "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=bayer:bayer_scale=4"
_GIF = ["-vf", _PALETTE, "-loop", "0", "-f", "gif"]
