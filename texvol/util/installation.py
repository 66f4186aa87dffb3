"""Command that installs an extra of texvol, which works for the way in which texvol itself is installed.

From a checkout, the checkout is installed again with the extra. From a wheel, which may be gone, and from anywhere else
the libraries of the extra are installed by their own names, since nothing says that an index has texvol.
"""

from __future__ import annotations

import json
import re
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from texvol.util.package import PACKAGE

_REQUIREMENT = re.compile(r"(?P<name>[\w.-]+)\s*(\[(?P<extras>[^]]*)\])?\s*(?P<versions>[^;]*?)\s*(;(?P<marker>.*))?")


def install_command(extra: str) -> str:
    """Return the command for a shell that installs an extra."""
    distribution = _distribution()
    editable, folder = _checkout(distribution)
    if folder is not None:
        option = "-e " if editable else ""
        return f"pip install {option}{shlex.quote(f'{folder}[{extra}]')}"
    wanted = sorted(set(libraries(distribution.requires or [], extra))) if distribution else []
    return "pip install " + (" ".join(map(shlex.quote, wanted)) or shlex.quote(f"texvol[{extra}]"))


def libraries(requires: Sequence[str], extra: str) -> Iterator[str]:
    """Yield the requirements of an extra, with those of extras that it contains, from metadata of a distribution."""
    for each in requires:
        found = _REQUIREMENT.fullmatch(each.strip())
        if found is None or not re.search(rf"""extra\s*==\s*["']{re.escape(extra)}["']""", found["marker"] or ""):
            continue
        if found["name"] == "texvol":
            for other in (found["extras"] or "").split(","):
                yield from libraries(requires, other.strip())
        else:
            extras = f"[{found['extras']}]" if found["extras"] else ""
            yield found["name"] + extras + found["versions"].replace(" ", "")


def _distribution() -> Any:
    """Return the metadata of the texvol that is installed; None if there is none."""
    from importlib import metadata

    try:
        return metadata.distribution("texvol")
    except metadata.PackageNotFoundError:
        return None


def _checkout(distribution: Any) -> tuple[bool, Path | None]:
    """Return if texvol runs in its checkout, and the folder of the checkout, None if it is installed from elsewhere."""
    here = PACKAGE.parent
    if (here / "pyproject.toml").is_file():  # texvol is not copied to the environment's packages
        return True, here
    try:
        told = json.loads((distribution and distribution.read_text("direct_url.json")) or "{}")
    except ValueError:
        return False, None
    folder = Path(unquote(urlsplit(told.get("url", "")).path))
    is_there = "dir_info" in told and (folder / "pyproject.toml").is_file()
    return False, folder if is_there else None
