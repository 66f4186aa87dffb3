"""HTML pages, parsed."""

from __future__ import annotations

from html.parser import HTMLParser

ODD = "<b>&\"' a/b ☃"
EMPTY = {"meta", "link", "input", "br", "img"}


class Parsed(HTMLParser):
    """What a page is made of; every element has to be closed."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.addresses: list[str] = []
        self.text = ""
        self._open: list[str] = []
        self.feed(page)
        assert not self._open

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        if tag not in EMPTY:
            self._open.append(tag)
        self.addresses += [value or "" for name, value in attributes if name in ("src", "srcset", "href", "action")]

    def handle_endtag(self, tag: str) -> None:
        if tag not in ("line", "path"):
            assert self._open.pop() == tag

    def handle_startendtag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)

    def handle_data(self, data: str) -> None:
        if self._open and self._open[-1] not in ("script", "style"):
            self.text += data
