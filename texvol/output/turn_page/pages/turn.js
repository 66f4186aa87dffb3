"use strict";
// The view is at a fractional column and row; the nearest picture is shown.
const data = JSON.parse(document.getElementById("data").textContent);
const stage = document.getElementById("stage"), canvas = document.getElementById("view");
const pen = canvas.getContext("2d");
const MOST_DECODED = 48; // pictures; each has a megabyte at 512x512, and phones have few
const MOST_ZOOM = 8;
let [column, row] = data.start;
let zoom = 1, shiftX = 0, shiftY = 0;

const decoded = new Map(); // by number, the least recently used first
function picture(number) {
  let found = decoded.get(number);
  if (found) {
    decoded.delete(number);
  } else {
    found = new Image();
    found.src = `data:${data.kind};base64,${data.views[number]}`;
    found.ready = found.decode().then(() => true, () => false);
  }
  decoded.set(number, found);
  if (decoded.size > MOST_DECODED) decoded.delete(decoded.keys().next().value);
  return found;
}

function numberAt(aColumn, aRow) {
  const around = ((Math.round(aColumn) % data.columns) + data.columns) % data.columns;
  return Math.min(Math.max(Math.round(aRow), 0), data.rows - 1) * data.columns + around;
}

// A picture is painted unless a later one has been: while the hand is faster than the decoder, the view still moves.
let asked = 0, painted = 0, shown = -1;
async function show() {
  const number = numberAt(column, row);
  const mine = ++asked;
  const image = picture(number);
  if (!(await image.ready) || mine < painted) return;
  painted = mine;
  if (number === shown) return;
  if (canvas.width !== image.naturalWidth) [canvas.width, canvas.height] = [image.naturalWidth, image.naturalHeight];
  pen.drawImage(image, 0, 0);
  shown = number;
  stage.dataset.view = number;
  const around = `view ${(number % data.columns) + 1} of ${data.columns} around`;
  const above = data.rows > 1 ? `, row ${Math.floor(number / data.columns) + 1} of ${data.rows} from the top` : "";
  stage.setAttribute("aria-label", `${data.title}: ${around}${above}`);
  for (const [x, y] of [[-1, 0], [1, 0], [0, -1], [0, 1]]) picture(numberAt(column + x, row + y));
}

function turn(columns, rows) {
  column += columns;
  row = Math.min(Math.max(row + rows, 0), data.rows - 1);
  show();
}

// What the hand holds follows it: half a turn for the width of the picture.
function turnByHand(x, y) {
  const degrees = 180 / stage.clientWidth;
  turn((-x * degrees * data.columns) / 360, data.rows > 1 ? (-y * degrees * (data.rows - 1)) / 160 : 0);
}

function place() {
  const width = stage.clientWidth, height = stage.clientHeight;
  shiftX = Math.min(Math.max(shiftX, width * (1 - zoom)), 0);
  shiftY = Math.min(Math.max(shiftY, height * (1 - zoom)), 0);
  canvas.style.transform = zoom === 1 ? "" : `translate(${shiftX}px, ${shiftY}px) scale(${zoom})`;
}

function zoomBy(factor, clientX, clientY) {
  const box = stage.getBoundingClientRect();
  const x = clientX - box.left, y = clientY - box.top;
  const next = Math.min(Math.max(zoom * factor, 1), MOST_ZOOM);
  shiftX = x - ((x - shiftX) * next) / zoom;
  shiftY = y - ((y - shiftY) * next) / zoom;
  zoom = next;
  place();
}

function zoomInMiddle(factor) {
  const box = stage.getBoundingClientRect();
  zoomBy(factor, box.left + box.width / 2, box.top + box.height / 2);
}

function reset() {
  [column, row] = data.start;
  zoom = 1;
  shiftX = shiftY = 0;
  place();
  show();
}

const held = new Map(); // pointers that are down
function middleOf() {
  const points = [...held.values()];
  const x = points.reduce((sum, each) => sum + each.x, 0) / points.length;
  const y = points.reduce((sum, each) => sum + each.y, 0) / points.length;
  const apart = points.length > 1 ? Math.hypot(points[0].x - points[1].x, points[0].y - points[1].y) : 0;
  return { x, y, apart };
}
stage.addEventListener("pointerdown", event => {
  if (event.pointerType === "mouse" && event.button !== 0) return;
  stop();
  stage.setPointerCapture(event.pointerId);
  held.set(event.pointerId, { x: event.clientX, y: event.clientY });
});
stage.addEventListener("pointermove", event => {
  if (!held.has(event.pointerId)) return;
  const before = middleOf();
  held.set(event.pointerId, { x: event.clientX, y: event.clientY });
  const after = middleOf();
  if (held.size === 1 && !event.shiftKey) {
    turnByHand(after.x - before.x, after.y - before.y);
    return;
  }
  shiftX += after.x - before.x;
  shiftY += after.y - before.y;
  zoomBy(before.apart > 0 && after.apart > 0 ? after.apart / before.apart : 1, after.x, after.y);
});
for (const name of ["pointerup", "pointercancel", "lostpointercapture"]) {
  stage.addEventListener(name, event => held.delete(event.pointerId));
}
stage.addEventListener("dblclick", reset);
stage.addEventListener("wheel", event => {
  event.preventDefault();
  zoomBy(Math.exp(-event.deltaY / (event.deltaMode ? 20 : 400)), event.clientX, event.clientY);
}, { passive: false });

const KEYS = {
  ArrowLeft: () => turn(-1, 0), ArrowRight: () => turn(1, 0), ArrowUp: () => turn(0, -1), ArrowDown: () => turn(0, 1),
  "+": () => zoomInMiddle(1.25), "=": () => zoomInMiddle(1.25), "-": () => zoomInMiddle(0.8), Home: reset,
};
stage.addEventListener("keydown", event => {
  const action = KEYS[event.key];
  if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
  event.preventDefault();
  stop();
  [column, row] = [Math.round(column), Math.round(row)];
  action();
});

// Nothing moves by itself. Asked to, the view turns once in six seconds, or by one picture a second for those who have
// asked their system for less motion.
const play = document.getElementById("play");
const lessMotion = matchMedia("(prefers-reduced-motion: reduce)");
let timer = 0;
function stop() {
  clearInterval(timer);
  timer = 0;
  play.setAttribute("aria-pressed", "false");
}
play.addEventListener("click", () => {
  if (timer) {
    stop();
    return;
  }
  timer = setInterval(() => turn(1, 0), lessMotion.matches ? 1000 : Math.max(6000 / data.columns, 30));
  play.setAttribute("aria-pressed", "true");
});
document.getElementById("reset").addEventListener("click", () => {
  stop();
  reset();
});
addEventListener("resize", place);
show();
