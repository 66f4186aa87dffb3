"""Files written whole or not at all: first in a private folder beside their target, then renamed.

The folder has a random name and the owner's permissions only, so that nobody else can put a link where a file is about
to be written. The file gets the permissions of any new file, and `os.replace` replaces a name and never writes through
a link.
"""

from __future__ import annotations

import errno
import itertools
import os
import secrets
import shutil
import stat
import tempfile
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from pathlib import Path

from texvol.util import reach, text_files
from texvol.util.errors import InputError


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise InputError if no file can be written to `path`; called before the work of making the file."""
    text_files.check_name(path)
    reach.check(path)
    path = Path(path)
    folder = path.parent
    _check_link(path)
    try:
        if path.is_dir() or not path.name:
            raise InputError(f"{path}: must be a file, got a folder")
        if not folder.is_dir():
            raise InputError(f"{path}: its folder {folder} does not exist")
        if path.exists() and not path.is_file():  # OSError here if the name is too long
            raise InputError(f"{path}: must be a regular file, got a device or the like")
        accessible = os.access(folder, os.W_OK)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    if not accessible:
        raise InputError(f"{path}: its folder {folder.absolute()} cannot be written to")


def _check_link(path: Path) -> None:
    """Raise InputError if the kernel would not follow a link (fs.protected_symlinks), which `os.replace` ignores.

    In a folder where everybody may write, such as /tmp, only links of the user or of the folder's owner are followed:
    anybody else may have put a link there to have another file overwritten.
    """
    try:
        link, folder = path.lstat(), path.parent.stat()
    except OSError:
        return
    is_everybodys = folder.st_mode & (stat.S_ISVTX | stat.S_IWOTH) == stat.S_ISVTX | stat.S_IWOTH
    if stat.S_ISLNK(link.st_mode) and is_everybodys and link.st_uid not in (os.geteuid(), folder.st_uid):
        raise InputError(f"{path}: must not be another user's link in a folder where everybody may write")


def check_apart(outputs: Mapping[str, str | None], inputs: Iterable[str | None]) -> None:
    """Raise InputError if two outputs are the same file, or an output is also an input.

    Parameters
    ----------
    outputs : mapping
        Paths by option; None if an option is not given.
    inputs : iterable of paths
        Files that are read; None and names that are not files (presets) are ignored.
    """
    chosen = {option: path for option, path in outputs.items() if path is not None}
    for (one, path), (other, another) in itertools.combinations(chosen.items(), 2):
        if os.path.realpath(path) == os.path.realpath(another):
            raise InputError(f"{another}: {one} and {other} must be two files")
    sources = [path for path in inputs if path is not None and os.path.exists(path)]
    for option, path in chosen.items():
        if os.path.exists(path) and any(os.path.samefile(path, each) for each in sources):
            raise InputError(f"{path}: {option} must not overwrite an input: give it another name")


def folder_beside(path: Path) -> Path:
    """Return the name of a new folder beside `path`, for a file that is renamed to `path` when it is complete.

    The process that writes the file makes the folder by `make`; `remove` deletes it.
    """
    return path.with_name(f".texvol-{secrets.token_hex(8)}")


def make(folder: Path) -> None:
    """Make such a folder, or raise OSError if the name exists."""
    folder.mkdir(0o700)


def remove(folder: Path) -> None:
    """Remove such a folder and its content, if it exists."""
    shutil.rmtree(folder, ignore_errors=True)


def write_files(files: Mapping[str | os.PathLike[str], bytes]) -> None:
    """Write all of these files, or none and raise InputError, for example because the disk is full."""
    scratch: dict[Path, Path] = {}
    with ExitStack() as folders:
        try:
            for name, content in files.items():
                text_files.check_name(name)
                _check_link(Path(name))
                path = Path(os.path.realpath(name))  # the target of a link, not the link
                check_writable(path)
                try:
                    folder = folder_beside(path)
                    make(folder)
                    folders.callback(remove, folder)
                    scratch[path] = _written(folder / "file", content)
                except OSError as error:
                    raise InputError(f"{name}: cannot be written: {reason_of(error)}") from None
            for path, written in scratch.items():
                os.replace(written, path)
        except OSError as error:
            raise InputError(f"{error.filename2 or error.filename}: cannot be written: {reason_of(error)}") from None


def _written(path: Path, content: bytes) -> Path:
    """Write a new file and return its path."""
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666), "wb") as file:
        file.write(content)
    return path


def memory_file(size: int) -> int:
    """Return the descriptor of a new file of `size` bytes in memory, or raise OSError; file size limits apply."""
    if hasattr(os, "memfd_create"):
        descriptor = os.memfd_create("texvol", 0)
    else:
        with tempfile.TemporaryFile() as file:
            descriptor = os.dup(file.fileno())
    try:
        os.ftruncate(descriptor, size)
    except OSError as error:
        os.close(descriptor)
        raise OSError(error.errno, f"{reason_of(error)}; a scratch file of {size} bytes is needed") from None
    return descriptor


def reason_of(error: OSError) -> str:
    """Return the reason of a failed write in words, with the limit if the file size limit was reached."""
    reason = error.strerror or str(error)
    if error.errno != errno.EFBIG or "ulimit" in reason:
        return reason
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    return reason if limit == resource.RLIM_INFINITY else f"{reason}: the limit (ulimit -f) is {limit} bytes"
