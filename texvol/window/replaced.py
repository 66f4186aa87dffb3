"""Documents that were replaced by others, to which undo and redo return: each keeps its view, history and changes."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

from texvol.util.memory import free_memory
from texvol.window.document import Document

_OF_FREE = 1 / 4  # of the free memory that volumes of replaced documents may take


@dataclass
class Replaced:
    """Documents before the open one, and documents after it, the next one last."""

    past: list[Document] = field(default_factory=list)
    future: list[Document] = field(default_factory=list)
    kept: list[Document] = field(default_factory=list)  # the user wants to keep them, whatever memory they take

    def open(self, before: Document) -> None:
        """Note that a newly opened document replaces another one; documents that were undone stay before both."""
        before.history.end()
        before.rest()
        self.past += [*self.future, before]
        self.future.clear()

    def step(self, now: Document, *, back: bool) -> Document | None:
        """Return the document before the open one, or after it; None if there is none."""
        source, target = (self.past, self.future) if back else (self.future, self.past)
        if not source:
            return None
        now.rest()
        target.append(now)
        return source.pop()

    def drop(self, document: Document) -> None:
        """Forget a document."""
        for each in (self.past, self.future, self.kept):
            if document in each:
                each.remove(document)

    def excess(self, now: Document | None) -> list[Document]:
        """Return the documents that have to go, the oldest first, so that the others take little memory."""
        gone: list[Document] = []
        candidates = [each for each in (*self.past, *self.future) if each not in self.kept]
        most, held = free_memory() * _OF_FREE, _arrays([now] if now is not None else [])
        while candidates:
            stays = [each for each in (*self.past, *self.future) if each not in gone]
            taken = _arrays(stays)
            if sum(size for key, size in taken.items() if key not in held) <= most:
                break
            gone.append(candidates.pop(0))
        return gone


def _arrays(documents: Iterable[Document]) -> dict[int, int]:
    """Return the bytes of all volumes of documents and their histories, by the arrays' identities."""
    found: dict[int, int] = {}
    for document in documents:
        for scene in document.scenes:
            masks = [scene.mask, *(each.mask for each in scene.added)]
            arrays: list[Any] = [mask.array for mask in masks if mask is not None]
            arrays += [part for volume in scene.volumes for part in (volume.values, volume.colors) if part is not None]
            found |= {id(array): array.nbytes for array in arrays}
    return found
