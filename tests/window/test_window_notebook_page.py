"""The page of a widget in a notebook: keys, wheel and menu that are the notebook's, and the picture below it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from support.browser import Browser, Page

from texvol.window.remote import notebook

CTRL, META = 2, 4
_PAGE = """<!doctype html><style>body { height: 4000px; margin: 0 }</style>
<div class="jp-OutputArea-child"><div id="cell"></div></div>
<div class="jp-OutputArea-child" id="below"><div class="jp-RenderedImage"><img></div></div>
<div class="jp-OutputArea-child" id="own"><div class="jp-RenderedImage"><img></div></div>
<input id="else"><script type="module">SCRIPT
window.sent = []; window.heard = {}; window.left = []; window.menus = 0;
const values = {width: 200, height: 100, picture: new DataView(new ArrayBuffer(0)), title: "window", output: "mine"};
const output = (name, data) => ({metadata: {texvol: name}, data, toJSON: () => ({metadata: {texvol: name}, data})});
window.outputs = ["other", "mine"].map(name => output(name, {"image/png": "before"}));
const list = {get length() { return outputs.length; }, get: i => outputs[i], set: (i, to) => { outputs[i] = to; }};
const model = {
  get: name => values[name], send: content => sent.push(content), off: () => {},
  on: (name, f) => { const before = heard[name]; heard[name] = (...all) => { before?.(...all); f(...all); }; },
  widget_manager: {context: {model: {cells: [{}, {outputs: list}]}}}
};
window.values = values;
initialize({model});
window.end = render({model, el: document.getElementById("cell")});
document.addEventListener("keydown", e => { if (!e.defaultPrevented) left.push(e.key); });
document.addEventListener("contextmenu", () => menus++);
window.ready = true;
</script>"""


@pytest.fixture
def page(browser: Browser, tmp_path: Path) -> Iterator[Page]:
    script = notebook.page_script()
    assert "\nexport default {initialize, render};" in script
    path = tmp_path / "page.html"
    path.write_text(_PAGE.replace("SCRIPT", script.replace("export default", "void ")), "utf-8")
    opened = Page(browser, path, 400, 300)
    opened.wait_for("window.ready")
    yield opened
    assert opened.complaints() == []
    opened.close()


def events(page: Page, *kinds: str) -> list[dict[str, Any]]:
    """Events of these kinds that the widget has sent, once the page has drawn."""
    page.tell("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    sent = page.tell("JSON.stringify(sent.splice(0).flatMap(each => each.events ?? []))")
    return [each for each in json.loads(sent) if each["kind"] in kinds]


def press(page: Page, key: str, modifiers: int = 0) -> None:
    told = {
        "key": key,
        "modifiers": modifiers,
        "windowsVirtualKeyCode": ord(key.upper()[0]),
        "code": f"Key{key.upper()}",
    }
    for kind in ("rawKeyDown", "keyUp"):
        page.call("Input.dispatchKeyEvent", type=kind, **told)


def test_keys_are_the_windows_only_while_it_has_the_focus_and_save_and_find_never(page: Page) -> None:
    press(page, "w")
    assert (events(page, "key"), page.tell("left.splice(0)")) == ([], ["w"])
    page.click("canvas")
    assert events(page, "button", "focus") == [
        {"kind": "focus", "down": True},
        *({"kind": "button", "name": "left", "down": down, "modifiers": []} for down in (True, False)),
    ]
    for key in "sfmol":
        press(page, key, CTRL)
    assert page.tell("left.splice(0)") == list("sfmol")
    assert not [each for each in events(page, "key") if each["down"]]
    for key, modifiers in (("w", 0), ("z", CTRL), ("c", CTRL)):
        press(page, key, modifiers)
    assert page.tell("left.splice(0)") == []
    assert [each["name"] for each in events(page, "key") if each["down"]] == ["w", "z", "c"]
    page.click("#else")
    assert events(page, "focus") == [{"kind": "focus", "down": False}]


def test_a_pen_that_is_taken_away_holds_no_button(page: Page) -> None:
    for kind in ("pointerdown", "pointercancel"):
        how = {"pointerType": "pen", "button": 0, "buttons": 1, "clientX": 100, "clientY": 50}
        page.tell(f"document.querySelector('canvas').dispatchEvent(new PointerEvent('{kind}', {json.dumps(how)}))")
    told = [(each["kind"], each["down"]) for each in events(page, "button", "focus")]
    assert told == [("focus", True), ("button", True), ("focus", False), ("focus", True)]


def test_no_key_and_no_ctrl_stay_down_where_no_release_is_told(page: Page) -> None:
    page.click("canvas")
    events(page)
    # macOS tells no release of a key while cmd is down.
    told = {"type": "rawKeyDown", "key": "z", "modifiers": META, "windowsVirtualKeyCode": 90, "code": "KeyZ"}
    page.call("Input.dispatchKeyEvent", **told)
    page.tell(
        "(() => { const e = new ClipboardEvent('paste', {clipboardData: new DataTransfer()});"
        "document.activeElement.dispatchEvent(e); })()"
    )
    assert [(each["name"], each["down"], each["modifiers"]) for each in events(page, "key")] == [
        ("z", True, ["ctrl"]), ("z", False, []), ("v", True, ["ctrl"]), ("v", False, [])
    ]  # fmt: skip


def test_the_wheel_scrolls_the_notebook_until_the_window_is_clicked_and_the_menu_stays_away(page: Page) -> None:
    page.wheel(100, 50, 120)
    page.wait_for("scrollY > 0")
    assert events(page, "scroll") == []
    page.tell("scrollTo(0, 0)")
    page.drag([(100, 50)])
    page.wheel(100, 50, 120)
    assert len(events(page, "scroll")) == 1
    assert page.tell("scrollY") == 0
    page.mouse("mousePressed", 100, 50, button="right", clickCount=1)
    page.mouse("mouseReleased", 100, 50, button="right", clickCount=1)
    assert page.tell("menus") == 0


def test_the_picture_below_is_hidden_once_the_widget_shows_one_and_is_kept_up_to_date(page: Page) -> None:
    shown = "['below', 'own'].map(id => getComputedStyle(document.getElementById(id)).display !== 'none')"
    assert page.tell(shown) == [True, True]
    head = json.dumps({"frame": 1, "size": [1, 1], "type": "image/png", "left": 1})
    page.tell(
        f"(async () => {{ const c = new OffscreenCanvas(1, 1); c.getContext('2d'); const b = await c.convertToBlob();"
        "const half = b.size >> 1, rest = JSON.stringify({frame: 2, size: [1, 1], left: 0});"
        f"for (const each of [[{json.dumps(head)}, b.slice(0, half)], [rest, b.slice(half)]]) {{"
        "const file = await new Blob([each[0] + '\\n', each[1]]).arrayBuffer();"
        "heard['msg:custom']({}, [new DataView(file)]); } })()"
    )
    page.wait_for(f"!{shown}[0]")
    assert page.tell(shown) == [False, True]
    page.tell("values.picture = new DataView(Uint8Array.from([1, 2, 255]).buffer); heard['change:picture']()")
    assert page.tell("outputs.map(each => each.data['image/png'])") == ["before", "AQL/"]
    page.tell("heard['msg:custom']({put: 'other'}, [new DataView(Uint8Array.from([3]).buffer)])")
    assert page.tell("outputs.map(each => each.data['image/png'])") == ["Aw==", "AQL/"]
    page.tell("sent.length = 0; heard['msg:custom']({ask: true})")
    assert page.tell("JSON.stringify(sent)") == '[{"view":true}]'
    page.tell("end()")
    assert page.tell("sent.at(-1).view") is False


def test_an_output_that_vs_code_takes_away_lets_go_of_its_window_and_a_cell_out_of_sight_does_not(
    page: Page,
) -> None:
    told = "JSON.stringify(sent.splice(0).filter(each => 'view' in each).map(each => each.view))"
    drawn = "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(done))))"
    page.wait_for("sent.some(each => each.view)")
    page.tell(f"{told}, window.kept = document.querySelector('.jp-OutputArea-child'), kept.remove(), {drawn}")
    assert page.tell(told) == "[]", "JupyterLab takes cells away that are out of sight"
    page.tell(f"document.body.prepend(kept), kept.className = 'output_container', {drawn}")
    page.tell(f"kept.remove(), {drawn}")
    assert page.tell(told) == "[false]"
    page.tell("heard['msg:custom']({ask: true}), end()")
    assert page.tell(told) == "[]", "it was told once"
