"""`texvol help` shows pages as text that reads well, and names the nearest topic where there is none."""

from __future__ import annotations

import re

import pytest

from texvol.__main__ import main
from texvol.cli.help import page, topics
from texvol.cli.plain_text import as_text


def test_without_a_topic_all_pages_are_listed_with_a_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["help"]) == 0
    said = capsys.readouterr().out
    for topic, line in topics().items():
        assert re.search(rf"^  {topic} +{re.escape(line)}$", said, re.MULTILINE)
        assert len(line) < 80


@pytest.mark.parametrize("topic", topics())
def test_a_page_is_plain_text_outside_a_terminal(topic: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["help", topic]) == 0
    said = capsys.readouterr().out
    prose = "\n".join(line for line in said.splitlines() if not line.startswith("    "))
    assert "<!-- not run: needs" not in said
    assert not re.search(r"`|\*\*|\]\(|!\[|^#|^\||\\[|<*\[]", prose, re.MULTILINE)
    title = page(topic).split("\n", 1)[0].removeprefix("# ")
    assert said.startswith(f"{title}\n{'=' * len(title)}\n")
    # Every word of the page is there.
    words = re.findall(r"[A-Za-z]{4,}", re.sub(r"<!--.*?-->|\]\(.*?\)|^```\w*", "", page(topic), flags=re.MULTILINE))
    assert set(words) <= set(re.findall(r"[A-Za-z]{4,}", said))


def test_prose_and_tables_fit_the_terminal() -> None:
    for width in (72, 100):
        lines = as_text(page("looks"), width).splitlines()
        assert max(len(line) for line in lines if not line.startswith("    ")) in range(width - 8, width + 1)


def test_tables_become_columns() -> None:
    table = "| key | does |\n|---|---|\n| `a\\|b` | one *thing* |\n| c | [more](x.md) of it |\n"
    assert as_text(table) == "  key  does\n  a|b  one thing\n  c    more of it"


def test_a_terminal_shows_the_page_by_rich(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("rich")
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert main(["help", "glossary"]) == 0
    said = capsys.readouterr().out
    assert "Glossary" in said and "━" in said.replace("─", "━")


def test_a_terminal_without_rich_shows_plain_text(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "rich.console", None)
    monkeypatch.setattr("sys.stdout.isatty", lambda: True, raising=False)
    assert main(["help", "glossary"]) == 0
    assert capsys.readouterr().out.startswith("Glossary\n========\n")


def test_the_name_of_a_command_shows_its_options(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["help", "surface"]) == 0
    assert capsys.readouterr().out.startswith("usage: texvol surface")


@pytest.mark.parametrize(
    ("asked", "hint"),
    [("cookbok", "did you mean 'cookbook'?"), ("redner", "did you mean 'render'?"), ("xyz", "texvol help lists")],
)
def test_an_unknown_topic_is_one_line_of_error(asked: str, hint: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["help", asked]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"texvol: error: topic {asked!r} not found; {hint}") and said.count("\n") == 1
