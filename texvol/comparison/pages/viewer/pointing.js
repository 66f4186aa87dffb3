// Mouse, pen, touch and wheel on the stage.

/** Let the stage be pointed at; `hold(isHeld)` is told of a press while blinking by hand. */
function pointAt(stage, settings, hold) {
  const {element} = stage, pointers = new Map();
  let grip = null;  // distance between divider and pointer

  const place = event => {
    const pane = event.target.closest('.pane').getBoundingClientRect();
    return {x: event.clientX - pane.left, y: event.clientY - pane.top};
  };
  const pointed = ({x, y}) => {
    const at = stage.pictureAt(x, y), column = Math.floor(at.x), row = Math.floor(at.y);
    if (column >= 0 && row >= 0 && column < stage.width && row < stage.height) stage.choose(column, row);
  };
  const wipeTo = x => {
    settings.divider = Math.max(0, Math.min(1, x / stage.paneWidth));
    stage.draw();
  };

  element.addEventListener('pointerdown', event => {
    if (event.button !== 0 || !event.target.closest('.pane')) return;
    const at = place(event);
    event.target.setPointerCapture(event.pointerId);
    pointers.set(event.pointerId, at);
    const onDivider = event.target === stage.divider;
    if (settings.mode === 'wipe' && (onDivider || !stage.canMove())) grip = onDivider ? at.x - settings.divider * stage.paneWidth : 0;
    if (grip !== null) {
      wipeTo(at.x - grip);
      stage.divider.focus({preventScroll: true});
      event.preventDefault();
    } else if (settings.mode === 'blink' && !settings.isBlinking) {
      hold(true);
    }
    pointed(at);
  });

  element.addEventListener('pointermove', event => {
    if (!event.target.closest('.pane')) return;
    const at = place(event), before = pointers.get(event.pointerId);
    if (before && grip !== null) {
      wipeTo(at.x - grip);
    } else if (before && pointers.size === 2) {
      const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
      const apart = point => Math.hypot(point.x - other.x, point.y - other.y);
      if (apart(before) > 0) stage.zoomBy(apart(at) / apart(before), (at.x + other.x) / 2, (at.y + other.y) / 2);
    } else if (before && stage.canMove()) {
      const {view} = stage;
      element.classList.add('dragged');
      stage.look({x: view.x - (at.x - before.x) / view.zoom, y: view.y - (at.y - before.y) / view.zoom});
    }
    if (before) pointers.set(event.pointerId, at);
    pointed(at);
  });

  const released = event => {
    pointers.delete(event.pointerId);
    if (pointers.size) return;
    grip = null;
    element.classList.remove('dragged');
    hold(false);
  };
  for (const name of ['pointerup', 'pointercancel', 'lostpointercapture']) element.addEventListener(name, released);

  element.addEventListener('wheel', event => {
    if (!event.target.closest('.pane') || event.deltaY === 0) return;
    const before = stage.view.zoom, at = place(event);
    // A notch of a wheel is 100 to 120 pixels, or 3 lines.
    const pixels = event.deltaY * (event.deltaMode === WheelEvent.DOM_DELTA_PIXEL ? 1 : 40);
    stage.zoomBy(2 ** (-Math.max(-240, Math.min(240, pixels)) / 200), at.x, at.y);
    if (stage.view.zoom !== before) event.preventDefault();  // the page scrolls if the zoom is at its end
  }, {passive: false});

  element.addEventListener('dblclick', event => {
    if (!event.target.closest('.pane') || event.target === stage.divider) return;
    const at = place(event);
    if (stage.view.isFit) stage.zoomBy(4, at.x, at.y);
    else stage.look({zoom: stage.fitZoom});
  });
}
