"""The page of one pair: what it says, that it asks for nothing, and how much work it is."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from support.compared_pictures import blob, filled, outcome_of
from support.pages import ODD, Parsed

from texvol.comparison import page as page_module
from texvol.comparison.entries import entry_of, excess
from texvol.comparison.histogram import histogram
from texvol.comparison.limits import ONE_DRIVER
from texvol.comparison.outcome import examine
from texvol.comparison.page import comparison_page
from texvol.comparison.pictures import Picture


def shifted() -> Any:
    return outcome_of(blob(64, 48, 0.1), blob(64, 48))


def test_the_page_asks_for_nothing() -> None:
    page = comparison_page(shifted(), index="index.html")
    parsed = Parsed(page)
    assert all(each.startswith("data:") or each == "index.html" for each in parsed.addresses)
    assert not re.search(r"https?://|@import|url\(|fetch\(|XMLHttpRequest|import\(", page)
    assert "default-src 'none'" in page, "a browser would not let it"


def test_names_and_facts_are_text() -> None:
    pair = (Picture.of_array(blob(9, 9, s), ODD, {"Software": ODD, "texvol:renderer": ODD}) for s in (0.5, 0))
    page = comparison_page(examine(*pair, name=ODD), metadata={ODD: ODD}, index=f"{ODD}.html")
    parsed = Parsed(page)
    assert "b" not in parsed.tags
    # Title, heading, two files, two drivers, two programs, fact and its name.
    assert parsed.text.count(ODD) == 10


def test_what_ends_a_script_does_not_end_the_data(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(page_module, "_viewer_data", lambda *_: ["</script><i>"])
    page = comparison_page(shifted())
    assert "u003ci" in page and "i" not in Parsed(page).tags


def test_the_page_says_what_a_reader_wants_to_know() -> None:
    candidate, reference = blob(64, 48), blob(64, 48)
    candidate[30, 20, 1] += 0.5
    outcome = outcome_of(candidate, reference, "one pixel", **{"texvol:renderer": "some driver"})
    text = " ".join(Parsed(comparison_page(outcome, metadata={"Python": "3.11"})).text.split())
    assert "different" in text and "Largest difference 0.5, " in text
    assert "column 20, row 30" in text
    for each in (*outcome.violations, *(kind.words for kind in outcome.kinds), "some driver", "3.11", "64 × 48"):
        assert each in text
    for name in ("maximum", "rms", "mean", "PSNR", "99th percentile", "99.9th percentile", "SSIM", "ꟻLIP", "opacity"):
        assert name in text
    assert "limit 0.001" in text, "in the histogram"


def test_notes_and_the_oracle_are_said() -> None:
    class Said:
        words = "changed for the better: <rms> 1e-4"

    outcome = replace(shifted(), notes=("the reference is a JPEG",), three_way=Said())
    text = Parsed(comparison_page(outcome)).text
    assert "changed for the better: <rms> 1e-4" in text and "the reference is a JPEG" in text


def test_limits_that_are_broken_have_a_sign_and_no_others() -> None:
    page = comparison_page(shifted())
    table = page[page.index('class="limits"') :]
    rows = re.findall(r'<tr><th scope="row">([^<]*)</th><td( class="over")?>', table[: table.index("</table>")])
    measures = shifted().measures
    assert measures.percent_over > 0 and measures.beyond_rms > ONE_DRIVER.rms and measures.flip > ONE_DRIVER.flip
    assert [bool(over) for _, over in rows] == [True, False, False, True, True, False, False]
    assert table[: table.index("</table>")].count("✕") == 3


@pytest.mark.parametrize("make", [
    lambda: outcome_of(blob(8, 8), blob(8, 8)),
    lambda: outcome_of(blob(8, 8), blob(9, 8)),
    lambda: outcome_of(blob(1, 1), blob(1, 1) + 1),
    lambda: outcome_of(filled(3, 2, np.nan, 0, 0), filled(3, 2, 0, 0, 0)),
    lambda: outcome_of(filled(3, 2, np.nan, 0, 0), filled(3, 2, np.nan, 0, 0)),
    lambda: outcome_of(filled(3, 2, 1e30, 0, 0), filled(3, 2, -1e30, 0, 0)),
    lambda: outcome_of(filled(3, 2, 1e-30, 0, 0), filled(3, 2, 0, 0, 0)),
])  # fmt: skip
def test_odd_pairs_make_a_page_and_a_line(make: Any) -> None:
    outcome = make()
    parsed = Parsed(comparison_page(outcome, flip=True))
    assert outcome.status in parsed.text
    assert entry_of(outcome)["status"] == outcome.status


def bars(svg: str, kind: str) -> int:
    found = re.search(rf'<path class="{kind}" d="([^"]*)"', svg)
    return found[1].count("M") if found else 0


def test_the_histogram_counts_on_both_sides_of_the_limit() -> None:
    largest = np.zeros((10, 100))
    largest[0] = 1e-5
    largest[1, :3] = 0.5
    largest[2, 0] = np.inf
    svg = histogram(largest, 1e-3)
    assert bars(svg, "columns") == 1 and bars(svg, "too-far") == 1
    assert "103 of 1,000 pixels differ; 896 are equal; 1 hold" in svg
    one, hundred = (
        float(re.search(rf'class="{kind}" d="M[\d.]+ 210V([\d.]+)', svg)[1])  # type: ignore[index]
        for kind in ("too-far", "columns")
    )
    # The axis begins at a half and ends at 100, so 3 and 100 are log 6 and log 200 of log 200 of the height up.
    assert (210 - one) / (210 - hundred) == pytest.approx(np.log10(6) / np.log10(200), abs=0.01)


def test_a_page_is_small_enough() -> None:
    outcomes = [outcome_of(blob(256, 256, by), blob(256, 256), explain=False) for by in (0.1, 0)]
    size, of_equal = (len(comparison_page(each)) for each in outcomes)
    # 3 MB for 512 x 512 pixels; the page itself is a constant part of it.
    assert size < 3e6 / 4
    assert of_equal < size, "equal pictures are kept once"


def test_how_far_over_the_limits_a_pair_is() -> None:
    measures = shifted().measures
    fractions = (
        *(measures.beyond_max / ONE_DRIVER.max_abs, measures.beyond_rms / ONE_DRIVER.rms),
        measures.flip / ONE_DRIVER.flip,
    )
    assert excess(measures, ONE_DRIVER) == pytest.approx(max(fractions))
    assert excess(None, ONE_DRIVER) is None
    assert excess(measures, replace(ONE_DRIVER, rms=0.0)) == 1e12, "JSON has no infinity"
    loose = replace(ONE_DRIVER, max_abs=1.0, rms=1.0, flip=1.0)
    assert excess(outcome_of(blob(9, 9), blob(9, 9)).measures, loose) == 0
