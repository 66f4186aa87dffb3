"""Files written whole or not at all: in a private folder beside their place first, then renamed.

The folder has a random name, is made new or not at all, and is its owner's alone, so that nobody else can put a link
where a file is about to be written. What is written in it gets the permissions of any new file, and `os.replace`
replaces a name and never writes through it.
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

from texvol.util import text_files
from texvol.util.errors import InputError


def check_writable(path: str | os.PathLike[str]) -> None:
    """Raise InputError if no file can be written to `path`: asked before the work of making one."""
    text_files.check_name(path)
    path = Path(path)
    folder = path.parent
    _check_link(path)
    try:
        if path.is_dir() or not path.name:
            raise InputError(f"{path}: is a folder, and a file is to be written")
        if not folder.is_dir():
            raise InputError(f"{path}: its folder {folder} does not exist")
        if path.exists() and not path.is_file():  # a name that is too long says so here
            raise InputError(f"{path}: is no file but a device or the like, and a file is to be written")
        accessible = os.access(folder, os.W_OK)
    except OSError as error:
        raise InputError(f"{path}: cannot be written: {error.strerror}") from None
    if not accessible:
        raise InputError(f"{path}: its folder {folder} cannot be written to")


def _check_link(path: Path) -> None:
    """Raise InputError where the kernel would not follow a link, which `os.replace` knows nothing of.

    In a folder where everybody may write, such as /tmp, it follows a link of the user's own, or of the folder's owner
    (fs.protected_symlinks): anybody else's may have been put there to have another file overwritten.
    """
    try:
        link, folder = path.lstat(), path.parent.stat()
    except OSError:
        return
    is_everybodys = folder.st_mode & (stat.S_ISVTX | stat.S_IWOTH) == stat.S_ISVTX | stat.S_IWOTH
    if stat.S_ISLNK(link.st_mode) and is_everybodys and link.st_uid not in (os.geteuid(), folder.st_uid):
        raise InputError(f"{path}: is somebody else's link, in a folder where everybody may write")


def check_apart(outputs: Mapping[str, str | None], read: Iterable[str | None], what: str = "is read") -> None:
    """Raise InputError if two of these options write one file, or one writes what is read.

    Parameters
    ----------
    outputs : mapping
        Names by option; None where an option is not given.
    read : iterable of paths
        What the outputs are made of; names of no file (those of presets) and None are passed over.
    what : str
        How a message calls that.
    """
    chosen = {option: path for option, path in outputs.items() if path is not None}
    for (one, path), (other, another) in itertools.combinations(chosen.items(), 2):
        if os.path.realpath(path) == os.path.realpath(another):
            raise InputError(f"{another}: {one} and {other} have to be two files")
    sources = [path for path in read if path is not None and os.path.exists(path)]
    for option, path in chosen.items():
        if os.path.exists(path) and any(os.path.samefile(path, each) for each in sources):
            raise InputError(f"{path}: {what}, and would be lost: give {option} another name")


def folder_beside(path: Path) -> Path:
    """Name of a folder that is not there yet, in that of `path`, for a file that is renamed to `path` when it is whole.

    Whoever writes the file makes the folder by `make`; whoever knows of it takes it away by `remove`.
    """
    return path.with_name(f".texvol-{secrets.token_hex(8)}")


def make(folder: Path) -> None:
    """Make such a folder, or raise OSError where anything has that name."""
    folder.mkdir(0o700)


def remove(folder: Path) -> None:
    """Remove such a folder and what is in it, if it is still there."""
    shutil.rmtree(folder, ignore_errors=True)


def write_files(files: Mapping[str | os.PathLike[str], bytes]) -> None:
    """Write all of these files, or none.

    Raises
    ------
    InputError
        If one can't be written, a full disk included.
    """
    scratch: dict[Path, Path] = {}
    with ExitStack() as folders:
        try:
            for name, content in files.items():
                text_files.check_name(name)
                _check_link(Path(name))
                path = Path(os.path.realpath(name))  # what a link points to, not the link
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
    """The path, with a new file there."""
    with open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o666), "wb") as file:
        file.write(content)
    return path


def memory_file(size: int) -> int:
    """Descriptor of a new file in memory with so many bytes, or OSError; limits on files hold for it, too."""
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
    """Why a file cannot be written, in words; with the limit on the size of files where that is what is met."""
    reason = error.strerror or str(error)
    if error.errno != errno.EFBIG or "ulimit" in reason:
        return reason
    import resource

    limit, _ = resource.getrlimit(resource.RLIMIT_FSIZE)
    return reason if limit == resource.RLIM_INFINITY else f"{reason}: the limit (ulimit -f) is {limit} bytes"
