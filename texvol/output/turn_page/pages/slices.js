"use strict";
// Slices of 8-bit samples, [z][y][x], grey by window and level.
(async () => {
  const { slices } = data;
  const section = document.getElementById("slices");
  if (typeof DecompressionStream === "undefined") {
    section.textContent = "Slices need a browser of 2023 or later.";
    return;
  }
  const packed = Uint8Array.from(atob(slices.samples), each => each.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const samples = new Uint8Array(await new Response(stream).arrayBuffer());
  const [nx, ny] = slices.counts;
  const strides = [1, nx, nx * ny];
  const range = slices.high - slices.low;
  const level = document.getElementById("level"), width = document.getElementById("window");
  const values = document.getElementById("values");
  const greys = new Uint8ClampedArray(256);
  const figures = [...section.querySelectorAll("figure")];

  function begin() {
    level.value = Math.round(((slices.window[0] - slices.low) / range) * 1000);
    width.value = Math.round((slices.window[1] / range) * 1000);
    figures.forEach((figure, number) => {
      const plane = slices.planes[number], slider = figure.querySelector("input"), canvas = figure.querySelector("canvas");
      slider.max = slices.counts[plane.axis] - 1;
      slider.value = Math.floor(slices.counts[plane.axis] / 2);
      [canvas.width, canvas.height] = [slices.counts[plane.across[0]], slices.counts[plane.down[0]]];
      canvas.style.aspectRatio = plane.aspect;
      slider.addEventListener("input", () => paint(number));
      canvas.addEventListener("wheel", event => {
        event.preventDefault();
        slider.value = Number(slider.value) + Math.sign(event.deltaY);
        paint(number);
      }, { passive: false });
    });
  }

  function paint(number) {
    const plane = slices.planes[number], canvas = figures[number].querySelector("canvas");
    const index = Number(figures[number].querySelector("input").value);
    const [across, right] = plane.across, [down, below] = plane.down;
    const wide = canvas.width, tall = canvas.height;
    const pixels = new ImageData(wide, tall);
    for (let y = 0, pixel = 0; y < tall; y++) {
      const start = index * strides[plane.axis] + (below > 0 ? y : tall - 1 - y) * strides[down];
      for (let x = 0; x < wide; x++, pixel += 4) {
        const grey = greys[samples[start + (right > 0 ? x : wide - 1 - x) * strides[across]]];
        pixels.data[pixel] = pixels.data[pixel + 1] = pixels.data[pixel + 2] = grey;
        pixels.data[pixel + 3] = 255;
      }
    }
    canvas.getContext("2d").putImageData(pixels, 0, 0);
    figures[number].querySelector("output").textContent = `${index + 1} of ${slices.counts[plane.axis]}`;
  }

  function paintAll() {
    const centre = slices.low + (level.value / 1000) * range, wide = (width.value / 1000) * range;
    for (let sample = 0; sample < 256; sample++) {
      greys[sample] = 255 * ((slices.low + (sample / 255) * range - centre) / wide + 0.5);
    }
    const text = number => Number(number.toPrecision(4)).toString();
    values.textContent = `level ${text(centre)}, window ${text(wide)} ${slices.unit}`;
    figures.forEach((_, number) => paint(number));
  }

  begin();
  level.addEventListener("input", paintAll);
  width.addEventListener("input", paintAll);
  paintAll();
  section.dataset.ready = "yes";
})();
