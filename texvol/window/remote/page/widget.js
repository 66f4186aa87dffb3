
// The window in a cell of a notebook, by anywidget.
// With ctrl or cmd the window has these keys; save, find, reload, tabs and all others are the notebook's.
const OWN = /^(a|c|v|x|y|z|backspace|delete|home|end|arrow.*)$/i;
const owns = e => !(e.ctrlKey || e.metaKey) || (OWN.test(e.key) && (!e.shiftKey || !/^[acvxy]$/i.test(e.key)));
// Below the widget the cell shows the last picture once more, for pages without one: see last_picture.py.
// The places of outputs are those of JupyterLab and Notebook, of nbconvert's classic pages, and of VS Code.
const STYLE = `.texvol-window:focus-within::after { content: ""; position: absolute; inset: 0; border: 2px solid #4a90d9; pointer-events: none; }
.jp-OutputArea-child:has(.texvol-shown) + .jp-OutputArea-child:has(> .jp-RenderedImage),
.output_area:has(.texvol-shown) + .output_area:has(> .output_png),
.output_container:has(.texvol-shown) + .output_container:has(img) { display: none; }`;

function render({model, el}) {
  const box = document.createElement("div"), style = document.createElement("style");
  box.className = "texvol-window";
  box.style.cssText = `position:relative;max-width:100%;width:${model.get("width")}px;height:${model.get("height")}px;background:#1b1c1f`;
  style.textContent = STYLE;
  el.append(style, box);
  const view = texvolView(box, content => model.send(content), owns);
  view.canvas.setAttribute("aria-label", model.get("title"));
  // The last picture, until frames come: in a saved notebook that is opened without a kernel, for good.
  const still = document.createElement("img"), kept = model.get("picture");
  still.style.cssText = "position:absolute;inset:0;width:100%;height:100%;object-fit:contain;pointer-events:none";
  if (kept && kept.byteLength) {
    still.src = URL.createObjectURL(new Blob([kept], {type: "image/png"}));
    still.onload = () => URL.revokeObjectURL(still.src);
    box.append(still);
    box.classList.add("texvol-shown");
  }
  // A window takes processes, so that it starts once it is seen; until then its picture stands there.
  let begun = false;
  const come = () => { if (begun) model.send({view: true}); };
  const seeing = new IntersectionObserver(entries => {
    if (!entries.some(each => each.isIntersecting)) return;
    seeing.disconnect();
    begun = true;
    come();
    view.begin();
  });
  function take(message, buffers) {
    if (message.put) return;  // of the box that it is in, see initialize
    if (message.error) box.textContent = "texvol: error: " + message.error;
    else if (message.ask) come();
    else if (buffers && buffers.length) view.take(buffers[0]).then(() => {
      if (!view.canvas.dataset.type) return;  // no picture is whole yet
      still.remove();
      box.classList.add("texvol-shown");
    });
  }
  function end() {
    seeing.disconnect();
    gone.disconnect();
    model.off("msg:custom", take);
    view.end();
    if (!begun) return;
    begun = false;
    try { model.send({view: false}); } catch { /* the kernel has ended, and the window with it */ }
  }
  // VS Code takes an output away for good and tells no widget. JupyterLab takes cells away that are out of sight.
  const gone = new ResizeObserver(() => { if (!box.isConnected && box.closest(".output_container")) end(); });
  model.on("msg:custom", take);
  seeing.observe(box);
  gone.observe(box);
  return end;
}

// JupyterLab updates no display of a page that was loaded again: there its own model of the notebook is told.
function put(model, name, picture) {
  let text = "";
  for (let i = 0; i < picture.byteLength; i++) text += String.fromCharCode(picture.getUint8(i));
  const content = btoa(text);
  for (const {outputs} of model.widget_manager?.context?.model?.cells ?? []) {
    for (let i = 0; i < (outputs?.length ?? 0); i++) {
      const {data, metadata} = outputs.get(i);
      if (metadata.texvol === name && data["image/png"] !== content)
        outputs.set(i, {...outputs.get(i).toJSON(), data: {...data, "image/png": content}});
    }
  }
}
function initialize({model}) {
  model.on("change:picture", () => put(model, model.get("output"), model.get("picture")));
  model.on("msg:custom", (message, buffers) => { if (message.put) put(model, message.put, buffers[0]); });
}
export default {initialize, render};
