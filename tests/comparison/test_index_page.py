"""The page of all pictures: order, counts, thumbnails, names as they are, and its filters in headless Chromium."""

from __future__ import annotations

import base64
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from support.browser import Browser, Page
from support.compared_pictures import blob, filled, outcome_of
from support.pages import ODD, Parsed

from texvol.comparison.entries import entry_of, entry_without_reference
from texvol.comparison.index_page import index_page
from texvol.comparison.pictures import Picture
from texvol.formats.pictures import image
from texvol.util import color

LONG = "a-name-without-a-place-to-break-it-" * 9


def off_by(amount: float, name: str) -> dict[str, Any]:
    reference = filled(60, 40, 0.5, 0.5, 0.5)
    return entry_of(outcome_of(reference + np.float32(amount), reference, name), test=f"test of {name}")


def one_of_each() -> list[dict[str, Any]]:
    """Best first, so that nothing is in order by chance."""
    broken = outcome_of(filled(60, 40, np.nan, 0, 0), filled(60, 40, 0, 0, 0), "no number")
    return [
        *(off_by(0, "equal"), off_by(1e-6, "nearly equal"), off_by(1e-4, "near the limit")),
        entry_without_reference("unseen", Picture.of_array(blob(40, 60)), ["there is no reference refs/unseen.exr"]),
        *(off_by(0.01, "a bit off"), off_by(0.3, "far off")),
        entry_of(outcome_of(blob(40, 30), blob(30, 30), "other size"), page="pages/other size#1.html"),
        entry_of(broken),
    ]


def order(page: str) -> list[str]:
    return re.findall(r"</span> (?:<a [^>]*>)?([^<]*)(?:</a>)?</h3>", page)


def test_the_worst_come_first() -> None:
    names = order(index_page(one_of_each()))
    assert set(names[:2]) == {"no number", "other size"}
    assert names[2:] == ["far off", "a bit off", "unseen", "near the limit", "nearly equal", "equal"]


def test_counts_and_signs_do_not_need_colours() -> None:
    page = index_page(one_of_each())
    text = " ".join(Parsed(page).text.split())
    assert "5 of 8 pictures failed" in text
    assert "all 8" in text and "broken 2" in text and "different 2" in text and "new 1" in text and "same 3" in text
    assert [
        page.count(f'data-sign="{sign}">{word}')
        for sign, word in zip("✕≠+✓", ("broken", "different", "new", "same"), strict=True)
    ] == [2, 2, 1, 3]
    assert "--texvol-update" in text, "how a reference is made of what is new"
    assert "--texvol-update" not in index_page(one_of_each()[:2])


def test_an_entry_says_what_is_known() -> None:
    metadata = {"driver": "of all", "Python": "3.11"}
    entry = entry_of(
        outcome_of(blob(64, 48, 0.3), blob(64, 48)), test="test_x", metadata={**metadata, "driver": "<own>"}
    )
    text = " ".join(Parsed(index_page([entry], metadata=metadata)).text.split())
    for each in (*entry["violations"], *entry["kinds"], "test_x", "64 × 48 pixels", "ꟻLIP", "SSIM", "of all", "<own>"):
        assert each in text
    assert text.count("3.11") == 1, "what is the same for all is said once"


def test_what_is_perceived_of_a_picture_with_a_nan_is_not_said() -> None:
    page = index_page([entry_of(outcome_of(filled(60, 40, np.nan, 0, 0), filled(60, 40, 0, 0, 0)))])
    assert "rms <b>∞</b>" in page and "SSIM" not in page and "LIP <b>" not in page


def test_a_link_leads_to_the_page_whatever_its_name() -> None:
    assert 'href="pages/other%20size%231.html"' in index_page(one_of_each())


@pytest.mark.parametrize("count", [0, 1, 500])
def test_any_number_of_pictures_makes_a_page(count: int) -> None:
    entries = [off_by(0.1, "x")] * count
    page = index_page(entries, title="All of them")
    parsed = Parsed(page)
    assert parsed.tags.count("article") == count
    assert len(page) < 2e4 + count * 1.5e4


def test_names_are_text() -> None:
    entry = entry_of(outcome_of(blob(9, 9, 1), blob(9, 9), ODD), test=ODD, page=ODD, metadata={ODD: ODD})
    parsed = Parsed(index_page([entry], title=ODD))
    assert parsed.text.count(ODD) == 6
    assert all(each.startswith("data:image/") or "<" not in each for each in parsed.addresses)


def test_the_table_of_planted_mistakes_is_part_of_it() -> None:
    page = index_page([], self_test="<table><tr><td>dropped slab</td></tr></table>")
    assert "<td>dropped slab</td>" in page and "No pictures were compared" in page


def test_entries_survive_json_and_may_lack_things() -> None:
    entries = one_of_each()
    assert json.loads(json.dumps(entries, allow_nan=False)) == entries
    assert order(index_page([{"name": "bare", "status": "broken"}, {"name": "odd", "status": "exploded"}])) == [
        "bare",
        "odd",
    ]


def thumbnail(entry: dict[str, Any], role: str, folder: Path) -> Any:
    kind, content = re.fullmatch(r"data:image/(\w+);base64,(.*)", entry["thumbnails"][role]).groups()  # type: ignore[union-attr]
    path = folder / f"{role}.{kind}"
    path.write_bytes(base64.b64decode(content))
    return image.read(path)


def test_a_single_wrong_pixel_is_seen_in_a_thumbnail(tmp_path: Path) -> None:
    reference = filled(900, 150, 0, 0, 0)
    candidate = reference.copy()
    candidate[123, 777, 1] = 0.5
    seen = thumbnail(entry_of(outcome_of(candidate, reference, explain=False)), "difference", tmp_path)
    assert seen.shape[:2] == (21, 128)
    row, column = np.unravel_index(seen.sum(axis=2).argmax(), seen.shape[:2])
    # The middle of a block of seven pixels, and its neighbours: 123 / 150 and 777 / 900 of the way.
    assert abs(row - 21 * 123 / 150) < 2 and abs(column - 128 * 777 / 900) < 2
    assert (seen.max(axis=2) > 0.5).sum() >= 4


def test_thumbnails_are_means_and_small_pictures_stay_as_they_are(tmp_path: Path) -> None:
    stripes = filled(512, 256, 0, 0, 0)
    stripes[:, ::2] = 1
    entry = entry_of(outcome_of(stripes, stripes))
    seen = thumbnail(entry, "candidate", tmp_path)
    # Half of the light; a JPEG is within a level or two of it.
    assert seen.shape == (64, 128, 3)
    assert seen == pytest.approx(float(color.srgb_from_linear(np.array(0.5))), abs=2.5 / 255)
    assert set(entry["thumbnails"]) == {"candidate"}, "a reference that is equal is not shown twice"
    tiny = np.dstack([np.arange(18).reshape(2, 3, 3) / 17, np.ones((2, 3))]).astype(np.float32)
    seen = thumbnail(entry_of(outcome_of(tiny, tiny)), "candidate", tmp_path)
    assert seen == pytest.approx(color.srgb_from_linear(tiny[..., :3]), abs=0.6 / 255)


def test_what_is_no_number_is_magenta_in_a_thumbnail(tmp_path: Path) -> None:
    candidate = filled(600, 150, 0, 0, 0)
    candidate[100, 200, 3] = np.inf
    seen = thumbnail(entry_of(outcome_of(candidate, filled(600, 150, 0, 0, 0), explain=False)), "candidate", tmp_path)
    magenta = (seen[..., 0] > 0.5) & (seen[..., 2] > 0.5) & (seen[..., 1] < 0.5)
    assert 1 <= magenta.sum() <= 25 and magenta[20:24, 41:45].any()


def shown(page: Page) -> list[str]:
    found = page.tell(
        "[...document.querySelectorAll('article')].filter(e => e.checkVisibility()).map(e => e.dataset.status)"
    )
    return list(found)


@pytest.mark.parametrize("width, dark", [(1280, False), (400, True)])
def test_the_page_in_a_browser(browser: Browser, tmp_path: Path, width: int, dark: bool) -> None:
    entries = [*one_of_each(), {**off_by(0.2, LONG), "test": LONG, "violations": [LONG]}]
    (tmp_path / "index.html").write_text(index_page(entries, title=LONG, metadata={"driver": LONG}), "utf-8")
    page = Page(browser, tmp_path / "index.html", width, dark=dark)
    assert page.tell("document.documentElement.scrollWidth") <= width
    assert page.tell("[...document.images].every(e => e.complete && e.naturalWidth > 0)")
    paper = page.tell("getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)[0]")
    assert paper < 60 if dark else paper > 200
    page.click("button[data-status=different]")
    assert shown(page) == ["different"] * 3
    assert page.tell("document.querySelector('[aria-pressed=true]').dataset.status") == "different"
    page.click("#search")
    for key in "FAR oF":
        page.key(key)
    assert shown(page) == ["different"], "all the words, in any case, begun or whole"
    page.key("!")
    assert shown(page) == [] and page.tell("document.getElementById('none').checkVisibility()")
    page.click("button[data-status='']")
    page.tell(
        "(() => { const e = document.getElementById('search'); e.value = ''; e.dispatchEvent(new Event('input')); })()"
    )
    assert len(shown(page)) == 9
    assert page.complaints() == [] and page.requests() == []
    page.close()
