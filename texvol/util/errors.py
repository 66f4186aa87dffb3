"""Errors and warnings that texvol raises, each with one line that tells the user what to do."""

from numbers import Real

from texvol.util.installation import install_command
from texvol.util.shown_text import shown


class TexvolError(Exception):
    """Base of all errors that texvol raises on purpose; the command line prints each as one line.

    Control characters of file names and library messages are shown by their numbers.
    """

    def __str__(self) -> str:
        return shown(super().__str__())


class InputError(TexvolError, ValueError):
    """A file, an option or an argument is wrong; the message names it, what it must be and what it is."""


class NoRoomError(InputError):
    """The texture memory has no room for what must be drawn at once."""


class ContextError(TexvolError, RuntimeError):
    """No OpenGL context could be made; the message has the reason of each back end."""


class MissingExtraError(TexvolError, ImportError):
    """An optional library is missing; the message names the extra to install."""


class AccuracyWarning(UserWarning):
    """The requested error was not reached; the message says which error was."""


def missing_extra(library: str, extra: str, purpose: str) -> MissingExtraError:
    """Return the error that says which extra to install, for `raise missing_extra(…) from error`."""
    return MissingExtraError(f"{purpose} needs {library}, which is not installed: {install_command(extra)}")


def missing_library(library: str, purpose: str) -> MissingExtraError:
    """Return the error that names a library which no extra of texvol installs."""
    return MissingExtraError(f"{purpose} needs {library}, which is not installed: pip install {library}")


def is_number(thing: object) -> bool:
    """True of a real number, Python's or numpy's, but not of a truth value."""
    return isinstance(thing, Real) and not isinstance(thing, bool)


def check_type(name: str, thing: object, kind: type, advice: str = "") -> None:
    """Raise InputError, such as "scene: camera must be a Camera, got str; advice", unless `thing` is of a type."""
    if isinstance(thing, kind):
        return
    article = "an" if kind.__name__[0] in "AEIOU" else "a"
    more = f"; {advice}" if advice else ""
    raise InputError(f"{name} must be {article} {kind.__name__}, got {type(thing).__name__}{more}")
