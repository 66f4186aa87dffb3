// A window in an element of a page: frames are drawn on a canvas, and pointer, wheel, keys and touch become events.
// `send` takes an object that is a message of the viewer; the value's `take` is called with each packed frame.
// `owns`, on a page that has other things than the window, is true of the keys that are the window's: the rest is the
// page's, as is the wheel while the window has no focus.
function texvolView(element, send, owns) {
  const CURSORS = {text_input: "text", resize_ew: "ew-resize", hand: "pointer"};
  const KEYS = {
    ArrowLeft: "left", ArrowRight: "right", ArrowUp: "up", ArrowDown: "down", PageUp: "page_up", PageDown: "page_down",
    Home: "home", End: "end", Enter: "enter", Escape: "escape", Backspace: "backspace", Delete: "delete", Tab: "tab",
    Space: "space", Insert: "insert", Minus: "minus", Equal: "equal", BracketLeft: "left_bracket",
    BracketRight: "right_bracket", Comma: "comma", Period: "period", Slash: "slash", Semicolon: "semicolon",
    Quote: "apostrophe", Backquote: "grave_accent", Backslash: "backslash", ShiftLeft: "left_shift",
    ShiftRight: "right_shift", ControlLeft: "left_control", ControlRight: "right_control", AltLeft: "left_alt",
    NumpadAdd: "kp_add", NumpadSubtract: "kp_subtract", NumpadMultiply: "kp_multiply", NumpadDivide: "kp_divide",
    NumpadDecimal: "kp_decimal", NumpadEnter: "kp_enter"
  };
  const BUTTONS = ["left", "middle", "right"];
  const TAP = 6;  // pixels of the page that a finger may move before it drags
  const AWAY = -99999;  // where no mouse is
  const TURN = 40;  // milliseconds between events of two fingers: each pair takes the window two frames

  const canvas = document.createElement("canvas"), text = document.createElement("textarea");
  canvas.style.cssText = "position:absolute;inset:0;width:100%;height:100%;touch-action:none;display:block;object-fit:contain";
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "window of texvol");
  // Letters are typed here, so that dead keys, input methods and keyboards on the screen work.
  text.style.cssText = "position:absolute;left:0;top:0;width:1px;height:1px;opacity:0;border:0;padding:0;resize:none;font-size:16px";
  for (const [name, value] of [["autocapitalize", "off"], ["autocomplete", "off"], ["aria-label", "keys"], ["inputmode", "none"]])
    text.setAttribute(name, value);
  text.spellcheck = false;
  element.append(canvas, text);
  const context = canvas.getContext("2d", {alpha: false});
  let waiting = [], scheduled = false, size = [0, 0], asked = "";

  function flush() {
    scheduled = false;
    if (waiting.length) send({events: waiting.splice(0, 256)});
    if (waiting.length) schedule();
  }
  function schedule() {
    if (!scheduled) { scheduled = true; requestAnimationFrame(flush); }
  }
  function put(event) {
    const last = waiting[waiting.length - 1];
    if (event.kind === "move" && last && last.kind === "move") waiting[waiting.length - 1] = event;
    else waiting.push(event);
    schedule();
  }
  const modifiers = e => [["shift", e.shiftKey], ["ctrl", e.ctrlKey || e.metaKey], ["alt", e.altKey]].filter(m => m[1]).map(m => m[0]);

  // The whole window is seen, in the middle of the element.
  function place(x, y) {
    const box = canvas.getBoundingClientRect();
    const ratio = Math.min(box.width / size[0], box.height / size[1]) || 1;
    return {
      x: (x - box.left - (box.width - ratio * size[0]) / 2) / ratio,
      y: (y - box.top - (box.height - ratio * size[1]) / 2) / ratio
    };
  }
  const move = (x, y) => put({kind: "move", ...place(x, y)});
  const button = (name, down, e) => put({kind: "button", name, down, modifiers: modifiers(e)});

  function fit() {
    const scale = Math.min(Math.max(window.devicePixelRatio || 1, 1), 4);
    const wanted = [Math.round(element.clientWidth * scale), Math.round(element.clientHeight * scale), scale];
    if (wanted[0] > 0 && wanted[1] > 0 && String(wanted) !== asked) { asked = String(wanted); send({size: wanted}); }
  }
  const observer = new ResizeObserver(fit);
  observer.observe(element);
  window.addEventListener("resize", fit);  // another scale alone does not resize the element

  // Fingers: one is the left button once it moves or is lifted, two are the middle button and the wheel.
  const fingers = new Map();
  let held = "", began = null, apart = 0, turned = 0;
  const middle = () => {
    const all = [...fingers.values()];
    return [all.reduce((sum, f) => sum + f.x, 0) / all.length, all.reduce((sum, f) => sum + f.y, 0) / all.length];
  };
  const distance = () => {
    const [a, b] = [...fingers.values()];
    return Math.max(Math.hypot(a.x - b.x, a.y - b.y), 1);
  };
  function let_go(e) {
    if (held) button(held, false, e);
    held = "";
  }
  function touched(e) {
    fingers.set(e.pointerId, {x: e.clientX, y: e.clientY});
    if (fingers.size === 1) { began = {x: e.clientX, y: e.clientY}; move(e.clientX, e.clientY); }
    if (fingers.size === 2) {
      let_go(e);
      began = null; apart = distance(); held = "middle";
      move(...middle()); button("middle", true, e);
    }
  }
  function slid(e) {
    if (!fingers.has(e.pointerId)) return;
    fingers.set(e.pointerId, {x: e.clientX, y: e.clientY});
    if (fingers.size === 1) {
      if (began && Math.hypot(e.clientX - began.x, e.clientY - began.y) > TAP) {
        move(began.x, began.y); button("left", true, e); held = "left"; began = null;
      }
      if (held === "left") move(e.clientX, e.clientY);
    } else if (fingers.size === 2 && e.timeStamp - turned > TURN) {
      turned = e.timeStamp;
      pinch();
    }
  }
  function pinch() {
    move(...middle());
    const now = distance(), ticks = Math.log(now / apart) / Math.log(1.1);
    if (Math.abs(ticks) > 0.05) { put({kind: "scroll", x: 0, y: ticks}); apart = now; }
  }
  function lifted(e) {
    if (fingers.size === 2 && fingers.has(e.pointerId)) pinch();  // where they were last
    if (!fingers.delete(e.pointerId)) return;
    if (began && e.type === "pointerup") {
      move(began.x, began.y); button("left", true, e); button("left", false, e);
    }
    began = null;
    let_go(e);
    if (!fingers.size) put({kind: "move", x: AWAY, y: AWAY});  // else the tip of a button that was tapped stays
  }

  const handlers = {
    pointerdown(e) {
      e.preventDefault();
      text.focus({preventScroll: true});
      try { canvas.setPointerCapture(e.pointerId); } catch { /* the finger has left already */ }
      if (e.pointerType === "touch") return touched(e);
      move(e.clientX, e.clientY);
      if (BUTTONS[e.button]) button(BUTTONS[e.button], true, e);
    },
    pointermove(e) {
      if (e.pointerType === "touch") return slid(e);
      move(e.clientX, e.clientY);
      // Further buttons that go down or up come as moves.
      if (e.button > -1 && BUTTONS[e.button]) button(BUTTONS[e.button], Boolean(e.buttons & [1, 4, 2][e.button]), e);
    },
    pointerup(e) {
      if (e.pointerType === "touch") return lifted(e);
      move(e.clientX, e.clientY);
      if (BUTTONS[e.button]) button(BUTTONS[e.button], false, e);
    },
    pointercancel(e) {
      if (e.pointerType === "touch") return lifted(e);
      for (const down of [false, true]) put({kind: "focus", down});  // a pen lets go of its buttons, which are not told
    },
    contextmenu(e) { e.preventDefault(); e.stopPropagation(); },
    wheel(e) {
      if (owns && !text.matches(":focus")) return;
      e.preventDefault();
      const unit = [100, 3, 1][e.deltaMode];
      move(e.clientX, e.clientY);
      put({kind: "scroll", x: -e.deltaX / unit, y: -e.deltaY / unit, modifiers: modifiers(e)});
    }
  };
  for (const [name, handler] of Object.entries(handlers)) canvas.addEventListener(name, handler, {passive: false});

  function named(e) {
    const letter = e.key.length === 1 ? e.key.toLowerCase() : "";
    if (/^[a-z]$/.test(letter)) return letter;
    let found = /^(?:Key|Digit)([A-Z0-9])$/.exec(e.code);
    if (found) return found[1].toLowerCase();
    found = /^Numpad([0-9])$/.exec(e.code);
    if (found) return "kp_" + found[1];
    if (/^F([1-9]|1[0-9])$/.test(e.key)) return e.key.toLowerCase();
    return KEYS[e.code] || KEYS[e.key] || (/^[0-9]$/.test(letter) ? letter : "");
  }
  // A key with ctrl that is released at once: macOS tells no release while cmd is down, and a menu has none.
  function chord(name, held) {
    put({kind: "key", name, down: true, modifiers: held});
    put({kind: "key", name, down: false, modifiers: []});
  }
  function pressed(e, down) {
    // Function keys are the browser's, but for the window's help. A key that was pressed is released in any case.
    if (e.isComposing || /^F([2-9]|1[0-9])$/.test(e.key) || (down && owns && !owns(e))) return;
    e.stopPropagation();
    const isPasted = (e.ctrlKey || e.metaKey) && !e.altKey && e.key.toLowerCase() === "v";
    const name = named(e);
    if (isPasted) return;  // `paste` follows
    if (name && down && e.metaKey) chord(name, modifiers(e));
    else if (name) put({kind: "key", name, down, modifiers: modifiers(e)});
    if (e.key.length !== 1 || ((e.ctrlKey || e.metaKey) !== e.altKey && (e.ctrlKey || e.metaKey))) e.preventDefault();
  }
  function typed() {
    for (const letter of text.value) put({kind: "text", name: letter});
    text.value = "";
  }
  text.addEventListener("keydown", e => pressed(e, true));
  text.addEventListener("keyup", e => pressed(e, false));
  text.addEventListener("input", e => { if (!e.isComposing) typed(); });
  text.addEventListener("compositionend", typed);
  text.addEventListener("focus", () => put({kind: "focus", down: true}));
  text.addEventListener("blur", () => put({kind: "focus", down: false}));
  text.addEventListener("paste", e => {
    e.preventDefault();
    send({paste: e.clipboardData.getData("text/plain")});
    chord("v", ["ctrl"]);
  });

  // Frames are drawn one after the other. A picture may come in several pieces; another one ends it.
  let drawing = Promise.resolve(), pieces = [], type = "";
  async function draw(data) {
    const bytes = new Uint8Array(data instanceof DataView ? data.buffer.slice(data.byteOffset, data.byteOffset + data.byteLength) : data);
    const end = bytes.indexOf(10), head = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
    if (head.type) { type = head.type; pieces = []; }
    if (end + 1 < bytes.length) pieces.push(bytes.subarray(end + 1));
    if (end + 1 < bytes.length && !head.left) {
      const picture = await createImageBitmap(new Blob(pieces, {type}), {colorSpaceConversion: "none"});
      if (canvas.width !== picture.width || canvas.height !== picture.height) {
        canvas.width = picture.width; canvas.height = picture.height;
      }
      context.drawImage(picture, 0, 0);
      picture.close();
      canvas.dataset.type = type;
    }
    size = head.size;
    canvas.style.cursor = CURSORS[head.cursor] || "default";
    canvas.dataset.frame = head.frame;
    text.setAttribute("inputmode", head.typing ? "text" : "none");
    if (head.copied !== undefined && navigator.clipboard) navigator.clipboard.writeText(head.copied).catch(() => {});
    send({drawn: head.frame});
    return head;
  }
  return {
    canvas,
    begin() { asked = ""; fit(); if (!owns) text.focus({preventScroll: true}); },
    press(name) { for (const down of [true, false]) put({kind: "key", name, down}); },
    take(data) { return drawing = drawing.catch(() => {}).then(() => draw(data)); },
    end() { observer.disconnect(); window.removeEventListener("resize", fit); canvas.remove(); text.remove(); }
  };
}
