"""Journal of an unfinished conversion, by which the same command goes on where it was interrupted."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

from texvol.formats.stores.writing.metadata import write_json
from texvol.util.errors import InputError

_NAME = ".texvol-convert.json"


class Journal:
    """How many shards of which level are written, in a file of the output folder; they are written in order.

    Parameters
    ----------
    folder : Path
        Of the output store.
    task : dict
        What is converted, and how, in JSON types; another task cannot go on with it.
    overwrite : bool
        True if what is in the folder may be deleted.

    Raises
    ------
    InputError
        If the folder holds anything but an unfinished conversion of the same task.
    """

    def __init__(self, folder: Path, task: dict[str, Any], overwrite: bool) -> None:
        self._path, self._task = folder / _NAME, task
        self._done: dict[str, int] = {}
        if folder.exists():
            self._take_up(folder, overwrite)
        folder.mkdir(parents=True, exist_ok=True)
        self._write()

    def done(self, level: str) -> int:
        """Return the number of shards of a level that have been written whole."""
        return self._done.get(level, 0)

    def note(self, level: str) -> None:
        """Note that the next shard of a level has been written whole."""
        self._done[level] = self.done(level) + 1
        self._write()

    def end(self) -> None:
        """Remove the journal: the store is whole."""
        self._path.unlink()

    def _take_up(self, folder: Path, overwrite: bool) -> None:
        known = self._known()
        if known is not None and known.get("task") == self._task:
            self._done = known["done"]
        elif overwrite:
            if known is None and not _is_store(folder):
                raise InputError(f"{folder}: --overwrite deletes Zarr stores only, got something else")
            shutil.rmtree(folder)
        elif known is not None:
            raise InputError(
                f"{folder}: holds an unfinished conversion of another volume or with other options: --overwrite "
                "begins anew"
            )
        elif not folder.is_dir() or any(folder.iterdir()):
            raise InputError(f"{folder}: exists: --overwrite replaces a store")

    def _known(self) -> dict[str, Any] | None:
        try:
            content = json.loads(self._path.read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return None
        done = content.get("done") if isinstance(content, dict) else None
        # What an older version began has lists, and another task.
        return content if isinstance(done, dict) else None

    def _write(self) -> None:
        write_json(self._path, {"task": self._task, "done": self._done})


def _is_store(folder: Path) -> bool:
    return any((folder / name).exists() for name in ("zarr.json", ".zgroup", ".zattrs", ".zarray"))
