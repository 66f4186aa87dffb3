"""Host and port at which a window is served, and the token that opens it."""

from __future__ import annotations

import ipaddress
import re
import secrets
from typing import NamedTuple

from texvol.util.errors import InputError

LOOPBACK = "127.0.0.1"
DEFAULT_PORT = 8765
_LEAST_TOKEN = 8  # letters
_ADDRESS = re.compile(r"(\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9.-]*):(\d{1,5})")
_TOKEN = re.compile(r"[A-Za-z0-9_-]+")


def is_loopback(host: str) -> bool:
    """True if a host is this machine, as it alone sees it."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host.lower() == "localhost"


class Address(NamedTuple):
    """Host and port; if `is_usual`, another port is taken where that one is in use, and port 0 is any free port."""

    host: str = LOOPBACK
    port: int = DEFAULT_PORT
    is_usual: bool = True

    @property
    def is_loopback(self) -> bool:
        """True if other machines cannot reach it."""
        return is_loopback(self.host)

    def url(self, port: int, token: str) -> str:
        """Return the address to be opened."""
        host = f"[{self.host}]" if ":" in self.host else self.host
        return f"http://{host}:{port}/?token={token}"


def is_address(text: str) -> bool:
    """True if a word has the form of an address."""
    return not text or _ADDRESS.fullmatch(text) is not None


def address(text: str) -> Address:
    """Return the address of HOST:PORT, or of :PORT; without a text, the usual one.

    Raises
    ------
    InputError
        If the text has another form, or the port is none.
    """
    if not text:
        return Address()
    found = _ADDRESS.fullmatch(text)
    if found is None or int(found[2]) > 65535:
        raise InputError(f"--serve must be HOST:PORT, such as 127.0.0.1:{DEFAULT_PORT}, got {text!r}")
    return Address(found[1].strip("[]") or LOOPBACK, int(found[2]), False)


def token(text: str | None) -> str:
    """Return a token as it was given, or a random one.

    Raises
    ------
    InputError
        If it is too short, or has letters that an address cannot hold.
    """
    if text is None:
        return secrets.token_urlsafe(24)
    if len(text) < _LEAST_TOKEN or not _TOKEN.fullmatch(text):
        raise InputError(f"--token must be at least {_LEAST_TOKEN} letters, digits, - or _, got {text!r}")
    return text
