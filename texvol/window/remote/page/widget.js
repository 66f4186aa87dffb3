
// The window in a cell of a notebook, by anywidget.
function render({model, el}) {
  const box = document.createElement("div");
  box.style.cssText = `position:relative;max-width:100%;width:${model.get("width")}px;height:${model.get("height")}px;background:#1b1c1f`;
  el.append(box);
  const view = texvolView(box, content => model.send(content));
  // The last picture, until frames come: in a saved notebook that is opened without a kernel, for good.
  const still = document.createElement("img"), kept = model.get("picture");
  still.style.cssText = "position:absolute;inset:0;width:100%;height:100%;object-fit:contain;pointer-events:none";
  if (kept && kept.byteLength) {
    still.src = URL.createObjectURL(new Blob([kept], {type: "image/png"}));
    still.onload = () => URL.revokeObjectURL(still.src);
    box.append(still);
  }
  function take(message, buffers) {
    if (message.error) box.textContent = "texvol: error: " + message.error;
    else if (buffers && buffers.length) view.take(buffers[0]).then(head => { if (head.type) still.remove(); });
  }
  model.on("msg:custom", take);
  model.send({view: true});
  view.begin();
  return () => {
    model.off("msg:custom", take);
    view.end();
    model.send({view: false});
  };
}
export default {render};
