// Buttons, sliders and keys; the page's address stores the view.

const MODE_KEYS = {s: 'side', b: 'blink', w: 'wipe', d: 'difference', c: 'false', f: 'flip'};
const element = id => document.getElementById(id);

function makeControls(stage, pictures, facts, settings) {
  const buttons = [...document.querySelectorAll('button[data-mode]')];
  const isOffered = mode => mode === 'side' || Boolean(pictures.difference && (mode !== 'flip' || pictures.flip));
  let timer = null, toSave = null;

  const change = (changes = {}) => {
    Object.assign(settings, changes);
    show();
    stage.draw();
  };

  function show() {
    buttons.forEach(each => each.setAttribute('aria-pressed', each.dataset.mode === settings.mode));
    document.querySelectorAll('[data-for]').forEach(each => { each.hidden = each.dataset.for !== settings.mode; });
    Object.assign(element('rate'), {value: settings.rate});
    element('rate-text').textContent = `${settings.rate} a second`;
    Object.assign(element('gain'), {value: settings.gain});
    element('gain-text').textContent = `× ${2 ** settings.gain}`;
    element('exposure').value = settings.exposure;
    element('exposure-text').textContent = settings.exposure ? `${settings.exposure > 0 ? '+' : '−'}${Math.abs(settings.exposure)} stops` : '0 stops';
    element('channel').value = settings.channel;
    element('ground').value = settings.ground;
    element('marker').checked = settings.marker;
    element('pause').setAttribute('aria-pressed', !settings.isBlinking);
    showLegend(settings.mode, facts);
  }

  function setMode(mode, focus = true) {
    if (!isOffered(mode)) return;
    change({mode, blinkOn: false});
    stage.isHeld = false;
    stage.layOut();
    blink();
    if (focus) (mode === 'wipe' ? stage.divider : stage.element).focus({preventScroll: true});
  }

  function blink() {
    clearInterval(timer);
    timer = null;
    if (settings.mode !== 'blink' || !settings.isBlinking) return;
    timer = setInterval(() => {
      settings.blinkOn = !settings.blinkOn;
      stage.draw();
    }, 1000 / settings.rate);
  }

  function blinkByHand(byHand = settings.isBlinking) {
    change({isBlinking: !byHand, blinkOn: false});
    blink();
  }

  function hold(isHeld) {
    if (stage.isHeld === isHeld || !['blink', 'wipe'].includes(settings.mode)) return;
    stage.isHeld = isHeld;
    stage.draw();
  }

  function goTo(pixel) {
    if (!pixel) return;
    stage.look({zoom: Math.max(16, stage.fitZoom), x: pixel[0] + 0.5, y: pixel[1] + 0.5});
    stage.choose(...pixel);
  }

  function nextBroken() {
    const {width, height, values} = pictures.difference ?? pictures.candidate, pixels = width * height;
    const start = stage.pixel ? stage.pixel[1] * width + stage.pixel[0] + 1 : 0;
    for (let k = 0; k < pixels; k++) {
      const i = (start + k) % pixels;
      if (!isFiniteAt(values, i, pixels)) return goTo([i % width, Math.floor(i / width)]);
    }
  }

  function step(sign) {
    const clamp = (value, least, most) => Math.max(least, Math.min(most, value));
    if (settings.mode === 'blink') change({rate: clamp(settings.rate + 0.5 * sign, 0.5, 10)}), blink();
    if (settings.mode === 'wipe') change({divider: clamp(settings.divider + 0.05 * sign, 0, 1)});
    if (['difference', 'side'].includes(settings.mode)) change({gain: clamp(settings.gain + sign, 0, 30)});
  }

  const next = (id, name) => {
    const {options} = element(id), index = [...options].findIndex(each => each.value === settings[name]);
    change({[name]: options[(index + 1) % options.length].value});
  };

  const expose = stops => change({exposure: Math.max(-10, Math.min(10, settings.exposure + stops))});

  const actions = {
    '+': () => stage.zoomBy(2), '=': () => stage.zoomBy(2), '-': () => stage.zoomBy(0.5), '_': () => stage.zoomBy(0.5),
    '0': () => stage.look({zoom: stage.fitZoom}), '1': () => stage.look({zoom: 1}),
    'x': () => goTo(facts.worst), 'n': nextBroken, 'p': () => blinkByHand(), '[': () => step(-1), ']': () => step(1),
    'k': () => next('channel', 'channel'), 'g': () => facts.hasOpacity && next('ground', 'ground'),
    'm': () => change({marker: !settings.marker}), ',': () => expose(-0.5), '.': () => expose(0.5),
    '?': () => { element('keys').open = !element('keys').open; },
  };

  const arrows = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1]};

  function onDivider(event) {
    const places = {Home: 0, End: 1, PageUp: settings.divider + 0.1, PageDown: settings.divider - 0.1};
    const [x, y] = arrows[event.key] ?? [0, 0];
    const place = places[event.key] ?? (x || y ? settings.divider + 0.01 * (x - y) : null);
    if (place === null) return false;
    change({divider: Math.max(0, Math.min(1, place))});
    return true;
  }

  function onArrow(event) {
    const [x, y] = arrows[event.key], {view} = stage;
    if (event.shiftKey) {
      const [column, row] = stage.pixel ?? [Math.floor(view.x), Math.floor(view.y)];
      stage.choose(column + (stage.pixel ? x : 0), row + (stage.pixel ? y : 0), true);
      return true;
    }
    if (!stage.canMove()) return settings.mode === 'wipe' && onDivider(event);
    stage.look({x: view.x + x * stage.paneWidth / view.zoom / 8, y: view.y + y * stage.paneHeight / view.zoom / 8});
    return true;
  }

  function onKey(event) {
    const {target, key} = event;
    if (event.ctrlKey || event.metaKey || event.altKey) return false;
    if (target.matches('select, textarea, input:not([type=range], [type=checkbox])')) return false;
    const isOnStage = stage.element.contains(target) || target === document.body;
    if (target === stage.divider && !event.shiftKey && onDivider(event)) return true;
    // Arrow keys move the picture also while a button has the focus.
    if (key in arrows) return (isOnStage || target.matches('#viewer button')) && onArrow(event);
    if (key === ' ') {
      if (!isOnStage || !['blink', 'wipe'].includes(settings.mode)) return false;
      hold(true);
      return true;
    }
    const name = key.length === 1 ? key.toLowerCase() : key;
    if (name in MODE_KEYS) setMode(MODE_KEYS[name]);
    else if (name in actions) actions[name]();
    else return false;
    return true;
  }

  addEventListener('keydown', event => { if (onKey(event)) event.preventDefault(); });
  addEventListener('keyup', event => { if (event.key === ' ') hold(false); });
  addEventListener('blur', () => hold(false));
  pointAt(stage, settings, hold);

  buttons.forEach(each => {
    each.disabled = !isOffered(each.dataset.mode);
    each.hidden = each.dataset.mode === 'flip' && !pictures.flip;
    if (each.disabled) each.title = 'for pictures of one size';
    // A click by mouse moves the focus to the picture; a key press leaves it on the button.
    each.addEventListener('click', event => setMode(each.dataset.mode, event.detail > 0));
  });
  const click = {'zoom-in': '+', 'zoom-out': '-', 'zoom-fit': '0', worst: 'x', 'next-broken': 'n', pause: 'p'};
  for (const [id, key] of Object.entries(click)) element(id).addEventListener('click', () => actions[key]());
  for (const name of ['rate', 'gain', 'exposure']) {
    element(name).addEventListener('input', event => { change({[name]: Number(event.target.value)}); blink(); });
  }
  for (const name of ['channel', 'ground']) element(name).addEventListener('change', event => change({[name]: event.target.value}));
  element('marker').addEventListener('change', event => change({marker: event.target.checked}));
  const byHand = isHeld => () => { if (isHeld) blinkByHand(true); hold(isHeld); };
  element('hold').addEventListener('pointerdown', byHand(true));
  for (const name of ['pointerup', 'pointercancel', 'pointerleave']) element('hold').addEventListener(name, byHand(false));
  element('hold').addEventListener('keydown', event => { if ([' ', 'Enter'].includes(event.key)) byHand(true)(); });
  element('hold').addEventListener('keyup', byHand(false));

  stage.onChange = () => {
    element('zoom-text').textContent = `${Number((100 * stage.view.zoom).toPrecision(3))}%`;
    if (String(stage.pixel) !== stage.shownPixel) {
      stage.shownPixel = String(stage.pixel);
      showNumbers(element('readout'), pictures, stage.pixel);
    }
    clearTimeout(toSave);
    toSave = setTimeout(() => saveState(stage, settings, facts), 300);
  };
  return {setMode, change};
}

/** The scale below a false-colour map, with the limit that a pixel is held against. */
function showLegend(mode, facts) {
  const legend = element('legend');
  legend.hidden = !['false', 'flip'].includes(mode);
  if (legend.hidden) return;
  const steps = Array.from({length: 33}, (_, i) => Math.round(255 * i / 32));
  const stops = steps.map(i => `rgb(${facts.colors.slice(3 * i, 3 * i + 3)}) ${(100 * i / 255).toFixed(1)}%`);
  const bar = legend.querySelector('.colors'), [low, high] = facts.decades;
  bar.style.background = `linear-gradient(to right, ${stops})`;
  const marks = mode === 'flip'
    ? [0, 0.25, 0.5, 0.75, 1].map(value => [value, String(value)])
    : Array.from({length: high - low + 1}, (_, k) => [k / (high - low), low + k === 0 ? '1' : `1e${low + k}`]);
  legend.querySelector('.ticks').innerHTML = marks.map(([share, text]) => `<span style="left: ${100 * share}%">${text}</span>`).join('');
  const share = (Math.log10(facts.limit) - low) / (high - low);
  bar.innerHTML = mode === 'false' && share >= 0 && share <= 1
    ? `<span class="limit" style="left: ${100 * share}%"></span>` : '';
  legend.querySelector('.note').textContent = mode === 'false' ? `The line is the limit of a pixel, ${facts.limit}.` : '';
}

/** What is looked at, in the address, so that it can be sent to somebody; nothing while all is as at the start. */
function saveState({view, pixel}, settings, facts) {
  const state = new URLSearchParams(), usual = {mode: 'side', gain: facts.gain, channel: 'all'};
  for (const [name, value] of Object.entries(usual)) if (settings[name] !== value) state.set(name, settings[name]);
  if (!view.isFit) for (const name of ['zoom', 'x', 'y']) state.set(name, Number(view[name].toFixed(2)));
  if (pixel) state.set('pixel', pixel);
  if (`#${state}` === (location.hash || '#')) return;
  try {
    history.replaceState(null, '', `#${state}`);
  } catch { /* a page inside another may not */ }
}

function savedState() {
  const state = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
  const numbers = text => text?.split(',').map(Number).filter(Number.isFinite) ?? [];
  const [gain] = numbers(state.gain), view = ['zoom', 'x', 'y'].map(name => numbers(state[name])[0]);
  return {
    mode: Object.values(MODE_KEYS).includes(state.mode) ? state.mode : null,
    channel: ['all', '0', '1', '2', '3'].includes(state.channel) ? state.channel : 'all',
    gain: gain >= 0 && gain <= 30 ? Math.round(gain) : null,
    view: view.every(Number.isFinite) ? {zoom: view[0], x: view[1], y: view[2]} : null,
    pixel: numbers(state.pixel).length === 2 ? numbers(state.pixel).map(Math.floor) : null,
  };
}
