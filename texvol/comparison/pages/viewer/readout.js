// Table of the numbers of one pixel, readable by a screen reader.

const CHANNELS = ['red', 'green', 'blue', 'opacity'];

/** About four digits, which is what the numbers are true to. */
function shortNumber(number) {
  if (Number.isNaN(number)) return 'NaN';
  if (!Number.isFinite(number)) return number > 0 ? '∞' : '−∞';
  const size = Math.abs(number);
  const text = number === 0 ? '0' : size >= 1e-3 && size < 1e6 ? String(Number(number.toPrecision(4))) : number.toExponential(3);
  return text.replace('-', '−').replace('e−', 'e-').replace('e-', 'e−');
}

function numbersAt({width, height, values}, column, row) {
  if (column >= width || row >= height) return null;
  return CHANNELS.map((_, channel) => values[(channel * height + row) * width + column]);
}

function showNumbers(element, pictures, pixel) {
  const head = `<tr><th scope="col"><span hidden>picture</span></th>${CHANNELS.map(each => `<th scope="col">${each}</th>`).join('')}</tr>`;
  const lines = ['candidate', 'reference', 'difference'].filter(name => pictures[name]).map(name => {
    const numbers = pixel && numbersAt(pictures[name], ...pixel);
    const cells = CHANNELS.map((_, channel) => {
      const text = pixel ? numbers ? shortNumber(numbers[channel]) : 'none' : '–';
      return `<td data-value="${numbers ? numbers[channel] : ''}">${text}</td>`;
    });
    return `<tr data-picture="${name}"><th scope="row">${name}</th>${cells.join('')}</tr>`;
  });
  const caption = pixel ? `Column ${pixel[0]}, row ${pixel[1]}: linear, premultiplied` : 'Point at a pixel to see its numbers';
  element.innerHTML = `<div class="wide"><table><caption>${caption}</caption><thead>${head}</thead><tbody>${lines.join('')}</tbody></table></div>`;
}
