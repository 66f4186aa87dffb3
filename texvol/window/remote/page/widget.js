
// The window in a cell of a notebook, by anywidget.
function render({model, el}) {
  const box = document.createElement("div");
  box.style.cssText = `position:relative;max-width:100%;width:${model.get("width")}px;height:${model.get("height")}px;background:#1b1c1f`;
  el.append(box);
  const view = texvolView(box, content => model.send(content));
  function take(message, buffers) {
    if (message.error) box.textContent = "texvol: error: " + message.error;
    else if (buffers && buffers.length) view.take(buffers[0]);
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
