"""What can go wrong outside the program, each with one line that a user can act on."""

from texvol.util.shown_text import shown


class TexvolError(Exception):
    """Base of every error that texvol raises on purpose; the command line prints it as one line.

    Names of files and words of libraries are in it: what a terminal would obey is shown by its number.
    """

    def __str__(self) -> str:
        return shown(super().__str__())


class InputError(TexvolError, ValueError):
    """A file, an option or an argument is not what was wanted; the message names both."""


class NoRoomError(InputError):
    """The texture memory has no room for what is to be drawn at once."""


class ContextError(TexvolError, RuntimeError):
    """No OpenGL context could be made; the message holds each back end's reason."""


class MissingExtraError(TexvolError, ImportError):
    """A library that is installed only on demand is missing; the message names the extra."""


class AccuracyWarning(UserWarning):
    """A wanted error was not reached; the message says what was."""


def missing_extra(library: str, extra: str, purpose: str) -> MissingExtraError:
    """Error that says which extra to install, for `raise missing_extra(…) from error`."""
    return MissingExtraError(f"{purpose} needs {library}, which is not installed: pip install 'texvol[{extra}]'")


def check_type(name: str, thing: object, kind: type, advice: str = "") -> None:
    """Raise InputError unless `thing` is of a type; `name` says what it is, `advice` what to do.

    Raises
    ------
    InputError
        For example "scene: camera must be a Camera, got str".
    """
    if isinstance(thing, kind):
        return
    article = "an" if kind.__name__[0] in "AEIOU" else "a"
    more = f"; {advice}" if advice else ""
    raise InputError(f"{name} must be {article} {kind.__name__}, got {type(thing).__name__}{more}")
