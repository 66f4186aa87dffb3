"""Names of files and of stores on servers: URLs are neither looked up nor joined as paths of this machine."""

from __future__ import annotations

import os
import re
from pathlib import Path
from urllib.parse import urlsplit, urlunsplit

_REMOTE = re.compile(r"(https?|s3)://", re.IGNORECASE)


def is_remote(path: str | os.PathLike[str]) -> bool:
    """True for the URL of a store on a server: http, https or s3."""
    return bool(_REMOTE.match(os.fspath(path)))


def public(path: str | os.PathLike[str]) -> str:
    """Return the name for messages and headers: a URL without user, password and query, any other path as it is."""
    name = os.fspath(path)
    if not is_remote(name):
        return name
    parts = urlsplit(name)
    return urlunsplit((parts.scheme, parts.netloc.rpartition("@")[2], parts.path, "", ""))


def absolute(path: str | os.PathLike[str]) -> str:
    """Return the absolute path, or the URL as it is."""
    return os.fspath(path) if is_remote(path) else os.path.abspath(path)


def beside(folder: str | os.PathLike[str], path: str) -> str:
    """Return a path relative to a folder, or the URL as it is."""
    return path if is_remote(path) else str(Path(folder) / path)


def may_exist(path: str) -> bool:
    """True if the path exists on this machine, or is a URL, which is not asked."""
    return is_remote(path) or os.path.exists(path)
