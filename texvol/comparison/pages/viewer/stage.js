// The stage: panes that show layers, all with one zoom and position, and the selected pixel.
// `view.x`, `view.y` are the picture's coordinates in the middle of a pane, `view.zoom` the CSS pixels of a picture's pixel.

const LAYERS = {side: ['candidate', 'reference', 'difference'], difference: ['difference'], false: ['false'], flip: ['flip']};
const NAMES = {candidate: 'candidate', reference: 'reference', difference: 'difference', false: 'difference, false colour', flip: 'ꟻLIP'};
const GAP = 6;
const MOST_ZOOM = 128;

class Stage {
  constructor(element, pictures, layers, settings, facts) {
    Object.assign(this, {element, pictures, layers, settings, facts});
    this.width = Math.max(pictures.candidate.width, pictures.reference.width);
    this.height = Math.max(pictures.candidate.height, pictures.reference.height);
    this.view = {x: this.width / 2, y: this.height / 2, zoom: 0, isFit: true};
    this.pixel = null;
    this.isHeld = false;  // the other picture is shown
    this.panes = [];
    this.divider = this.#makeDivider();
    new ResizeObserver(() => this.layOut()).observe(element);
    addEventListener('resize', () => this.layOut());
  }

  /** Names of the layers that the mode shows, one for each pane; a wipe shows two in one. */
  shownLayers() {
    const {mode, blinkOn} = this.settings;
    if (mode === 'blink') return [blinkOn !== this.isHeld ? 'reference' : 'candidate'];
    if (mode === 'wipe') return [this.isHeld ? 'reference' : 'candidate'];
    const hasDifference = this.pictures.difference && !this.facts.isEqual;
    const isNarrow = this.element.clientWidth < 700;
    return LAYERS[mode].filter(name => name !== 'difference' || mode === 'difference' || (hasDifference && !isNarrow));
  }

  /** Make the panes for the mode, as large as fits, side by side or below each other. */
  layOut() {
    const count = this.shownLayers().length, across = this.element.clientWidth, tall = Math.max(260, 0.8 * innerHeight);
    const fitting = columns => {
      const rows = Math.ceil(count / columns);
      const width = (across - GAP * (columns - 1)) / columns, height = (tall - GAP * (rows - 1)) / rows;
      return {columns, width, height, zoom: Math.min(width / this.width, height / this.height)};
    };
    // Side by side unless the pictures are much smaller then, as for a panorama.
    const best = fitting(1).zoom > 1.5 * fitting(count).zoom ? fitting(1) : fitting(count);
    const zoom = best.zoom > 1 ? Math.floor(best.zoom) : best.zoom;  // whole factors make pixels of equal size
    this.fitZoom = zoom;
    this.paneWidth = best.width;
    this.paneHeight = Math.max(Math.min(best.height, 120), zoom * this.height);
    while (this.panes.length > count) this.panes.pop().element.remove();
    while (this.panes.length < count) this.panes.push(this.#makePane());
    this.element.style.gridTemplateColumns = `repeat(${best.columns}, minmax(0, 1fr))`;
    const dense = devicePixelRatio || 1;
    for (const {element, canvas} of this.panes) {
      element.style.height = `${this.paneHeight}px`;
      canvas.width = Math.round(this.paneWidth * dense);
      canvas.height = Math.round(this.paneHeight * dense);
    }
    if (this.settings.mode === 'wipe') this.panes[0].element.append(this.divider);
    else this.divider.remove();
    this.look({});
  }

  /** Change the view, within what makes sense, and draw it. */
  look(change) {
    const view = Object.assign(this.view, change);
    if (change.zoom !== undefined) {
      view.zoom = this.#possible(change.zoom);
      view.isFit = Math.abs(view.zoom / this.fitZoom - 1) < 1e-3;
    }
    if (view.isFit) view.zoom = this.fitZoom;
    const within = (at, size, pane) => {
      const half = pane / view.zoom / 2;
      return 2 * half >= size ? size / 2 : Math.max(half, Math.min(size - half, at));
    };
    view.x = within(view.x, this.width, this.paneWidth);
    view.y = within(view.y, this.height, this.paneHeight);
    this.element.classList.toggle('whole', !this.canMove());
    this.draw();
  }

  #possible(zoom) {
    return Math.max(Math.min(this.fitZoom, 1), Math.min(Math.max(MOST_ZOOM, this.fitZoom), zoom));
  }

  canMove() {
    const {zoom} = this.view;
    return zoom * this.width > this.paneWidth + 0.5 || zoom * this.height > this.paneHeight + 0.5;
  }

  /** Zoom by a factor, with what is at (x, y) of a pane staying there. */
  zoomBy(factor, x = this.paneWidth / 2, y = this.paneHeight / 2) {
    const {view} = this, before = this.pictureAt(x, y);
    const zoom = this.#possible(view.zoom * factor);
    this.look({zoom, x: before.x - (x - this.paneWidth / 2) / zoom, y: before.y - (y - this.paneHeight / 2) / zoom});
  }

  pictureAt(x, y) {
    const {view} = this;
    return {x: view.x + (x - this.paneWidth / 2) / view.zoom, y: view.y + (y - this.paneHeight / 2) / view.zoom};
  }

  paneAt(x, y) {
    const {view} = this;
    return {x: (x - view.x) * view.zoom + this.paneWidth / 2, y: (y - view.y) * view.zoom + this.paneHeight / 2};
  }

  /** Choose the pixel whose numbers are shown; `follow` moves it into sight. */
  choose(column, row, follow = false) {
    const clamped = (at, size) => Math.max(0, Math.min(size - 1, at));
    this.pixel = [clamped(column, this.width), clamped(row, this.height)];
    if (follow) {
      const at = this.paneAt(this.pixel[0] + 0.5, this.pixel[1] + 0.5);
      const isSeen = at.x >= 0 && at.y >= 0 && at.x <= this.paneWidth && at.y <= this.paneHeight;
      if (!isSeen) return this.look({x: this.pixel[0] + 0.5, y: this.pixel[1] + 0.5});
    }
    this.draw();
  }

  /** Draw before the next frame; several calls cost one. */
  draw() {
    this.onChange?.();
    this.#placeDivider();
    this.frame ??= requestAnimationFrame(() => {
      this.frame = null;
      this.shownLayers().forEach((name, index) => this.panes[index] && this.#drawPane(this.panes[index], name));
    });
  }

  #drawPane({canvas, tag, other}, name) {
    const context = canvas.getContext('2d'), dense = canvas.width / this.paneWidth;
    const isWipe = this.settings.mode === 'wipe';
    tag.textContent = NAMES[name] + (name === 'difference' ? ` × ${2 ** this.settings.gain}` : '');
    other.hidden = !isWipe;
    other.textContent = this.isHeld ? 'candidate' : 'reference';
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.clearRect(0, 0, canvas.width, canvas.height);
    const at = this.settings.divider * canvas.width;
    this.#drawLayer(context, name, dense, isWipe ? [0, at] : [0, canvas.width]);
    if (isWipe) this.#drawLayer(context, this.isHeld ? 'candidate' : 'reference', dense, [at, canvas.width]);
    this.#drawMarks(context, dense);
  }

  #drawLayer(context, name, dense, [left, right]) {
    const {view} = this, layer = this.layers[name](), corner = this.paneAt(0, 0);
    context.save();
    context.beginPath();
    context.rect(left, 0, right - left, context.canvas.height);
    context.clip();
    context.imageSmoothingEnabled = view.zoom * dense < 1;
    context.imageSmoothingQuality = 'high';
    const snap = number => Math.round(number * dense);
    const x = snap(corner.x), y = snap(corner.y);
    context.drawImage(layer, x, y, view.zoom * dense * layer.width, view.zoom * dense * layer.height);
    context.restore();
  }

  #drawMarks(context, dense) {
    context.setTransform(dense, 0, 0, dense, 0, 0);
    const {zoom} = this.view;
    const twice = draw => [[3.5, '#000'], [1.5, '#fff']].forEach(([width, color]) => {
      Object.assign(context, {lineWidth: width, strokeStyle: color});
      context.beginPath();
      draw();
      context.stroke();
    });
    if (this.facts.worst && this.settings.marker) {
      const at = this.paneAt(this.facts.worst[0] + 0.5, this.facts.worst[1] + 0.5);
      twice(() => context.arc(at.x, at.y, Math.max(9, Math.min(0.9 * zoom, 40)), 0, 2 * Math.PI));
    }
    if (this.pixel) {
      const at = this.paneAt(...this.pixel), half = zoom / 2;
      if (zoom >= 6) {
        twice(() => context.rect(at.x, at.y, zoom, zoom));
      } else {
        twice(() => [[-9, 0], [9, 0], [0, -9], [0, 9]].forEach(([x, y]) => {
          context.moveTo(at.x + half + x / 2.2, at.y + half + y / 2.2);
          context.lineTo(at.x + half + x, at.y + half + y);
        }));
      }
    }
  }

  #makePane() {
    const element = document.createElement('div'), canvas = document.createElement('canvas');
    const tag = document.createElement('span'), other = document.createElement('span');
    element.className = 'pane';
    tag.className = 'tag';
    other.className = 'tag right';
    element.append(canvas, tag, other);
    this.element.append(element);
    return {element, canvas, tag, other};
  }

  #makeDivider() {
    const divider = document.createElement('div');
    divider.id = 'divider';
    divider.tabIndex = 0;
    const told = {role: 'slider', 'aria-label': 'Wipe: fraction of the candidate', 'aria-valuemin': 0, 'aria-valuemax': 100};
    Object.entries(told).forEach(([name, value]) => divider.setAttribute(name, value));
    return divider;
  }

  #placeDivider() {
    this.divider.style.left = `${100 * this.settings.divider}%`;
    this.divider.setAttribute('aria-valuenow', Math.round(100 * this.settings.divider));
  }
}
