// Layers: canvases with one pixel for each pixel of the picture, painted again when their content changes.

const MAGENTA = [255, 0, 255];
const CHECKER = [0.08, 0.16];  // linear light; visible against black and white
const SRGB_STEPS = 16384;  // five for the narrowest level of sRGB

const srgbLevels = Uint8ClampedArray.from({length: SRGB_STEPS + 1}, (_, i) => {
  const linear = i / SRGB_STEPS;
  return 255 * (linear <= 0.0031308 ? 12.92 * linear : 1.055 * linear ** (1 / 2.4) - 0.055);
});
const level = linear => srgbLevels[linear <= 0 ? 0 : linear >= 1 ? SRGB_STEPS : linear * SRGB_STEPS + 0.5 | 0];

function isFiniteAt(values, i, pixels) {
  return Number.isFinite(values[i] + values[i + pixels] + values[i + 2 * pixels] + values[i + 3 * pixels])
    || [0, 1, 2, 3].every(channel => Number.isFinite(values[i + channel * pixels]));
}

/** A canvas of the picture's size, each pixel coloured by `paint(i, set)`; magenta where a number is none. */
function painted({width, height, values}, paint) {
  const canvas = Object.assign(document.createElement('canvas'), {width, height});
  const context = canvas.getContext('2d'), image = context.createImageData(width, height), data = image.data;
  const pixels = width * height;
  for (let i = 0, at = 0; i < pixels; i++, at += 4) {
    data[at + 3] = 255;
    if (isFiniteAt(values, i, pixels)) paint(i, data, at, pixels);
    else data.set(MAGENTA, at);
  }
  context.putImageData(image, 0, 0);
  return canvas;
}

function paintedPicture(picture, {channel, ground, exposure, range}) {
  const {width, values} = picture, [low, high] = range, factor = 2 ** exposure / (high - low);
  const cell = Math.max(1, Math.min(8, Math.round(width / 64)));
  const isNumbers = low !== 0 || high !== 1;
  const grounds = {black: [0, 0], white: [1, 1], checker: CHECKER}[ground];
  return painted(picture, (i, data, at, pixels) => {
    if (channel === 'all') {
      const x = i % width, y = (i - x) / width;
      const behind = isNumbers ? 0 : (1 - values[i + 3 * pixels]) * grounds[(x / cell | 0) + (y / cell | 0) & 1];
      for (let c = 0; c < 3; c++) data[at + c] = level((values[i + c * pixels] - low) * factor + behind);
    } else if (channel === '3') {
      data[at] = data[at + 1] = data[at + 2] = 255 * values[i + 3 * pixels];
    } else {
      data[at] = data[at + 1] = data[at + 2] = level((values[i + channel * pixels] - low) * factor);
    }
  });
}

function paintedDifference(difference, {channel, gain, scale}) {
  const {values} = difference, factor = gain / scale;
  return painted(difference, (i, data, at, pixels) => {
    if (channel === 'all') {
      const opacity = Math.abs(values[i + 3 * pixels]);
      for (let c = 0; c < 3; c++) data[at + c] = level(Math.max(Math.abs(values[i + c * pixels]), opacity) * factor);
    } else {
      data[at] = data[at + 1] = data[at + 2] = level(Math.abs(values[i + channel * pixels]) * factor);
    }
  });
}

function paintedFalseColor(difference, {channel, colors, decades, scale}) {
  const {values} = difference, [low, high] = decades, perDecade = 255 / (high - low);
  return painted(difference, (i, data, at, pixels) => {
    let largest = 0;
    if (channel === 'all') {
      for (let c = 0; c < 4; c++) largest = Math.max(largest, Math.abs(values[i + c * pixels]));
    } else {
      largest = Math.abs(values[i + channel * pixels]);
    }
    const share = Math.round((Math.log10(largest / scale) - low) * perDecade);
    const entry = 3 * Math.max(0, Math.min(255, share));
    for (let c = 0; c < 3; c++) data[at + c] = share < 0 ? 0 : colors[entry + c];
  });
}

function paintedFlip(difference, flip, {colors}) {
  return painted(difference, (i, data, at) => {
    for (let c = 0; c < 3; c++) data[at + c] = colors[3 * flip[i] + c];
  });
}

/** Layers by name, kept as long as the settings that they depend on stay. */
function layersOf(pictures, facts, settings) {
  const kept = new Map();
  const layer = (name, dependsOn, paint) => {
    const key = JSON.stringify(dependsOn);
    if (kept.get(name)?.key !== key) kept.set(name, {key, canvas: paint()});
    return kept.get(name).canvas;
  };
  const shown = () => ({channel: settings.channel, ground: settings.ground, exposure: settings.exposure, range: facts.range});
  return {
    candidate: () => layer('candidate', shown(), () => paintedPicture(pictures.candidate, shown())),
    reference: () => layer('reference', shown(), () => paintedPicture(pictures.reference, shown())),
    difference: () => {
      const how = {channel: settings.channel, gain: 2 ** settings.gain, scale: facts.scale};
      return layer('difference', how, () => paintedDifference(pictures.difference, how));
    },
    false: () => layer('false', settings.channel, () => paintedFalseColor(pictures.difference, {...facts, channel: settings.channel})),
    flip: () => layer('flip', 0, () => paintedFlip(pictures.difference, pictures.flip, facts)),
  };
}
