"""Numbered pictures and films, encoded by other processes while the next view is drawn.

Processes, not threads: moderngl holds Python's lock while it draws, so that a thread would run only a few times per
picture, and encoding one PNG takes a dozen such turns. Pictures are passed in shared memory, two for each process, so
that memory does not grow with their number. Messages go through a socket; when it closes, the process ends and leaves
no half-written file.
"""

from __future__ import annotations

import contextlib
import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from texvol.formats.films import containers as film_formats
from texvol.formats.films.containers import is_film
from texvol.formats.pictures import image
from texvol.util import writing
from texvol.util.errors import InputError
from texvol.util.package import environment_of_child

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

DEFAULT_FPS = 30.0
_LEAST_SECONDS = 2.0  # that a film lasts unless a rate is asked for
_SLOTS = 2  # pictures held for each process: one that it encodes, one that waits
_MOST_PROCESSES = 4  # encode as fast as a graphics card draws; llvmpipe needs the cores itself
_PATIENCE = 20.0  # seconds for a process to finish its current picture
# Settings that save a third of a process' time: no threads for linear algebra, and no memory returned to the system
# after every picture.
_ENVIRONMENT = {
    "OPENBLAS_NUM_THREADS": "1",
    "MALLOC_MMAP_THRESHOLD_": str(1 << 25),  # the maximum of glibc
    "MALLOC_TRIM_THRESHOLD_": str(1 << 26),
}
_SPEAKER = re.compile(r"^(\[[^]]* @ 0x[0-9a-f]+\] )+")  # name and address of ffmpeg's component in a message
_CONVERSION = re.compile(r"%%|%0?\d{0,2}d|%")


def default_rate(pictures: int) -> float:
    """Return the pictures per second of a film for which nobody chose them: it lasts two seconds at least."""
    return min(DEFAULT_FPS, max(pictures, 1) / _LEAST_SECONDS)


def numbered(path: str | os.PathLike[str], number: int) -> Path:
    """Return the path with %d or %04d in the file's name replaced by the number, and %% by %."""
    path = Path(path)
    name = _CONVERSION.sub(lambda found: "%" if found[0] == "%%" else found[0] % number, path.name)
    return path.with_name(name)


def check_output(path: str | os.PathLike[str], views: int | None, size: tuple[int, int]) -> None:
    """Raise InputError if a picture (`views` None), or so many pictures, or a film can't be written to `path`.

    Raises
    ------
    MissingExtraError
        If the encoder of films is not installed.
    """
    found = [match for match in _CONVERSION.findall(Path(path).name) if match != "%%"]
    numbers = [match for match in found if match != "%"]
    if views is None:
        if is_film(path):
            raise InputError(f"{path}: a film needs several pictures: give --orbit N or --time all, or name a picture")
        if numbers:
            several = "--orbit N or --time all"
            raise InputError(f"{path}: {numbers[0]} needs several pictures: give {several}, or a name without it")
        image.check_writable(path)
    elif is_film(path):
        if numbers:
            raise InputError(f"{path}: the name of a film must not have {numbers[0]}")
        film_formats.check_size(path, size)
        film_formats.ffmpeg()
        writing.check_writable(path)
    elif len(numbers) != 1 or len(found) != 1:
        raise InputError(
            f"{path}: the name for several pictures must have one %d, such as frame_%04d.png, "
            "or be a film, such as film.mp4 or film.gif"
        )
    else:
        for number in (0, views - 1):
            image.check_writable(numbered(path, number))


class Writer:
    """Writer of views to numbered pictures or a film; leaving its context without `finish` removes the film.

    Parameters
    ----------
    path : path
        As for `check_output`.
    size : (width, height)
        Pixels of every picture.
    views : int
        Number of pictures.
    transparent : bool
        True if PNGs keep the opacity.
    fps : float
        Frames per second of a film.

    Raises
    ------
    InputError
        From `add` and `finish`: if a file can't be written, for example because the disk is full.
    """

    def __init__(
        self,
        path: str | os.PathLike[str],
        size: tuple[int, int],
        views: int,
        *,
        transparent: bool = False,
        fps: float = DEFAULT_FPS,
    ) -> None:
        job: dict[str, Any] = {"path": os.fspath(path), "size": size, "transparent": transparent}
        self._folder: Path | None = None  # of a film in progress
        count = min(max(len(os.sched_getaffinity(0)) // 2, 1), _MOST_PROCESSES, views)
        if is_film(path):
            count = 1
            job |= {"ffmpeg": film_formats.ffmpeg(), "fps": fps}
            self._folder = writing.folder_beside(Path(os.path.realpath(path)))
            job["folder"] = str(self._folder)
        self._processes: list[_Process] = []
        self._added = 0
        try:
            for _ in range(count):
                self._processes.append(_Process(job))
        except BaseException:
            self.close()
            raise

    def add(self, picture: NDArray[np.float32], attributes: Mapping[str, str] | None = None) -> None:
        """Write the next view, (height, width, 4); wait while its process has two pictures."""
        self._processes[self._added % len(self._processes)].send(self._added, picture, dict(attributes or {}))
        self._added += 1

    def finish(self) -> None:
        """Wait until every file is complete and renamed."""
        for process in self._processes:
            process.finish()

    def close(self) -> None:
        """End the processes; pictures in progress are finished, an unfinished film is removed."""
        for process in self._processes:
            process.connection.close()
        for process in self._processes:
            process.wait()
        if self._folder is not None:
            writing.remove(self._folder)

    def __enter__(self) -> Writer:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


class _Process:
    """Encoding process, as its parent uses it."""

    def __init__(self, job: dict[str, Any]) -> None:
        import multiprocessing.connection
        import subprocess

        width, height = job["size"]
        try:
            memory = writing.memory_file(_SLOTS * width * height * 16)
        except OSError as error:
            raise InputError(f"{job['path']}: cannot be written: {writing.reason_of(error)}") from None
        try:
            self._slots = _pictures(memory, job["size"])
            self.connection, theirs = multiprocessing.connection.Pipe()
            with theirs:
                code = f"from texvol.formats.films import film; film.serve({theirs.fileno()}, {memory})"
                self._process = subprocess.Popen(
                    [sys.executable, "-P", "-c", code],
                    stdin=subprocess.DEVNULL,
                    stdout=subprocess.DEVNULL,
                    env=environment_of_child(**_ENVIRONMENT),
                    pass_fds=(theirs.fileno(), memory),
                    process_group=0,  # ctrl-C goes to the parent; the process ends when the connection closes
                )
        except OSError as error:
            raise InputError(f"can't start a process to write pictures: {error.strerror or error}") from None
        finally:
            os.close(memory)
        self._sent = self._acknowledged = 0
        self._tell(job)

    def send(self, number: int, picture: NDArray[np.float32], attributes: dict[str, str]) -> None:
        """Send a picture to be written under that number."""
        while self._sent - self._acknowledged == _SLOTS or self.connection.poll():
            self._hear()
        slot = self._sent % _SLOTS
        self._slots[slot] = picture
        self._tell((slot, number, attributes))
        self._sent += 1

    def finish(self) -> None:
        """Wait until all pictures are written."""
        self._tell(None)
        while self._acknowledged <= self._sent:  # one more than pictures: for the end
            self._hear()

    def wait(self) -> None:
        """Wait for the process, which has little left to do."""
        import subprocess

        try:
            self._process.wait(_PATIENCE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _tell(self, message: Any) -> None:
        try:
            self.connection.send(message)
        except ConnectionError:
            while True:  # until the process has reported its error
                self._hear()

    def _hear(self) -> None:
        try:
            answer = self.connection.recv()
        except (EOFError, ConnectionError):
            status = self._process.wait()
            raise InputError(f"the process that writes pictures ended unexpectedly (status {status})") from None
        if answer is not None:
            kind, text = answer
            raise (MemoryError if kind == "MemoryError" else InputError)(text)
        self._acknowledged += 1


class _Film:
    """Film, encoded in a folder beside its path."""

    def __init__(self, job: Mapping[str, Any]) -> None:
        import subprocess
        import tempfile

        self._path, self._folder = job["path"], Path(job["folder"])
        try:
            writing.make(self._folder)
        except OSError as error:
            raise InputError(f"{self._path}: cannot be written: {writing.reason_of(error)}") from None
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115  (closed with the process)
        command = film_formats.command(job["ffmpeg"], job["path"], job["size"], job["fps"])
        self._process = subprocess.Popen(
            [*command, f"file:{self._folder / 'film'}"],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._errors,
            restore_signals=False,  # SIGXFSZ stays ignored, so that ffmpeg reports that the file is too large
        )

    def add(self, picture: NDArray[np.float32]) -> None:
        """Add a picture."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(image.eight_bits(picture).tobytes())
        except OSError:
            raise self._failed() from None

    def finish(self) -> None:
        """Flush frames, and rename the film."""
        assert self._process.stdin is not None
        try:
            self._process.stdin.close()
        except OSError:
            raise self._failed() from None
        if self._process.wait():
            raise self._failed()
        try:
            os.replace(self._folder / "film", os.path.realpath(self._path))  # the target of a link, not the link
        except OSError as error:
            raise InputError(f"{self._path}: cannot be written: {writing.reason_of(error)}") from None
        writing.remove(self._folder)

    def drop(self) -> None:
        """Remove what is half written."""
        self._process.kill()
        self._process.wait()
        writing.remove(self._folder)

    def _failed(self) -> InputError:
        status = self._process.wait()
        self._errors.seek(0)
        said = self._errors.read().decode(errors="replace").split("\n")
        lines = (_SPEAKER.sub("", line).strip() for line in said)
        reason = next(filter(None, lines), f"ffmpeg ended with status {status}")
        return InputError(f"{self._path}: the film cannot be written: {reason}")


def serve(connection_descriptor: int, memory_descriptor: int) -> None:
    """Body of the process: write the pictures received, answering None, or an error, to each."""
    from multiprocessing.connection import Connection

    connection: Connection[Any, Any] = Connection(connection_descriptor)
    try:
        job = connection.recv()
        pictures = _pictures(memory_descriptor, job["size"])
        film = _Film(job) if is_film(job["path"]) else None
        try:
            with np.errstate(all="ignore"):  # numbers out of range are visible in the picture
                while (message := connection.recv()) is not None:
                    slot, number, attributes = message
                    if film is None:
                        _write(job, number, pictures[slot], attributes)
                    else:
                        film.add(pictures[slot])
                    connection.send(None)
            if film is not None:
                film.finish()
        except BaseException:
            if film is not None:
                film.drop()
            raise
        connection.send(None)
    except (EOFError, ConnectionError):
        pass  # the parent has closed the connection
    except Exception as error:
        with contextlib.suppress(OSError):
            connection.send((type(error).__name__, str(error) or type(error).__name__))


def _write(job: Mapping[str, Any], number: int, picture: NDArray[np.float32], attributes: dict[str, str]) -> None:
    """Write a numbered picture file."""
    path = numbered(job["path"], number)
    content = image.encoded(path, picture, attributes, transparent=job["transparent"], quick=True)
    writing.write_files({path: content})


def _pictures(memory: int, size: tuple[int, int]) -> NDArray[np.float32]:
    """Return the pictures in shared memory, (slots, height, width, 4)."""
    import mmap

    return np.frombuffer(mmap.mmap(memory, 0), np.float32).reshape(_SLOTS, size[1], size[0], 4)
