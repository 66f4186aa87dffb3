// Pixels from the page's data: three bytes for each number, bytes of equal weight together, deflated.
// pixel_data.py documents format and accuracy.

const MANTISSA_BITS = 14;
const DROPPED = 23 - MANTISSA_BITS;
const WHOLE = 1 << 23;

function decoded(text) {
  const letters = atob(text), bytes = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) bytes[i] = letters.charCodeAt(i);
  return bytes;
}

async function inflated(text) {
  const packed = decoded(text);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate'));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

async function unpacked({width, height, channels, bytes}) {
  const plane = await inflated(bytes), size = plane.length / 3, pixels = width * height;
  const numbers = new Uint32Array(4 * pixels);
  channels.forEach((source, channel) => {
    for (let i = 0, from = source * pixels, to = channel * pixels; i < pixels; i++, from++, to++) {
      numbers[to] = plane[from] | plane[size + from] << 8 | plane[2 * size + from] << 16;
    }
  });
  return numbers;
}

const floatBits = number => (number >>> 1 & 0x3fffff) << DROPPED | (number & 1) << 31;

/** Numbers of a picture, one channel after the other. */
async function referencePixels(data) {
  const numbers = await unpacked(data);
  const bits = new Int32Array(numbers.length);
  for (let i = 0, last = 0; i < numbers.length; i++) {
    if (i % data.width === 0) last = 0;
    last += numbers[i] >>> 1 ^ -(numbers[i] & 1);
    bits[i] = floatBits(last);
  }
  return new Float32Array(bits.buffer);
}

/** Numbers of the candidate, and its difference from the reference. */
async function candidatePixels(data, reference) {
  const numbers = await unpacked(data);
  const bits = new Int32Array(numbers.length);
  const candidate = new Float32Array(bits.buffer), difference = new Float32Array(numbers.length);
  for (let i = 0; i < numbers.length; i++) {
    bits[i] = floatBits(numbers[i]);
    if (numbers[i] & WHOLE) {
      difference[i] = candidate[i] - reference[i];
    } else {
      difference[i] = candidate[i];
      candidate[i] += reference[i];
    }
  }
  return {candidate, difference};
}

/** Everything that the viewer shows: two pictures, and their difference where they have one size. */
async function loadedPictures(data) {
  const picture = ({width, height}, values) => ({width, height, values});
  const reference = picture(data.reference, await referencePixels(data.reference));
  if (!data.oneSize) {
    return {reference, candidate: picture(data.candidate, await referencePixels(data.candidate))};
  }
  const count = reference.values.length;
  const both = data.candidate === null
    ? {candidate: reference.values, difference: new Float32Array(count)}
    : await candidatePixels(data.candidate, reference.values);
  return {
    reference,
    candidate: picture(reference, both.candidate),
    difference: picture(reference, both.difference),
    flip: data.flip ? await inflated(data.flip) : null,
  };
}
