"use strict";
// Pixels of the picture: x right, y down, the centre of the top left pixel is (0, 0). The canvas has corners there: half more.
const data = JSON.parse(document.getElementById("data").textContent);
const byId = (id) => document.getElementById(id);
const canvas = byId("picture"), pen = canvas.getContext("2d"), loupe = byId("loupe").getContext("2d");
const image = new Image(), pixels = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
const BOX_DIAMETERS = 1.4, SMALLEST = 3, REACH = 22, CLICK = 4, LOUPE_PX = 56;
const colour = Object.fromEntries(data.markers.map((name, k) => [name, `hsl(${(k * 360 * 0.381966 + 190) % 360} 95% 72%)`]));

const state = { boxes: { ...data.suggested }, undo: [], current: null, last: null, view: null, mouse: null, drag: null };
let side = data.side_px, byMarker = true; // the side of new boxes: by the marker under the click, until the slider is moved
state.current = data.markers.find((name) => !state.boxes[name]) ?? null;

// --- view: canvas = scale * (pixel + 1/2) + shift ---------------------------------------------------------------------
function fit() {
  const scale = Math.min(canvas.clientWidth / data.width, canvas.clientHeight / data.height);
  state.view = { scale, x: (canvas.clientWidth - scale * data.width) / 2, y: (canvas.clientHeight - scale * data.height) / 2, whole: true };
}
const toCanvas = ([x, y]) => [state.view.scale * (x + 0.5) + state.view.x, state.view.scale * (y + 0.5) + state.view.y];
const toPicture = ([u, v]) => [(u - state.view.x) / state.view.scale - 0.5, (v - state.view.y) / state.view.scale - 0.5];
function zoom(factor, [u, v] = [canvas.clientWidth / 2, canvas.clientHeight / 2]) {
  const view = state.view, scale = Math.min(40, Math.max(0.05, view.scale * factor)), by = scale / view.scale;
  state.view = { scale, x: u - by * (u - view.x), y: v - by * (v - view.y), whole: false };
}

// --- boxes ------------------------------------------------------------------------------------------------------------
const centreOf = ([x, y, w, h]) => [x + (w - 1) / 2, y + (h - 1) / 2];
function boxAround([x, y], wanted) {
  const room = 2 * Math.min(x, y, data.width - 1 - x, data.height - 1 - y) + 1, s = Math.min(wanted, room);
  return s < SMALLEST ? null : [x - (s - 1) / 2, y - (s - 1) / 2, s, s];
}
function remember() { state.undo.push(JSON.stringify([state.boxes, state.current, state.last, side, byMarker])); }
function undo() {
  if (!state.undo.length) return;
  [state.boxes, state.current, state.last, side, byMarker] = JSON.parse(state.undo.pop());
}
const sideFor = ([, , diameter]) => byMarker && diameter ? Math.max(BOX_DIAMETERS * diameter, 9) : side;
function put(name, centre) {
  const box = boxAround(centre, sideFor(centre));
  if (!box) return;
  remember();
  state.boxes[name] = box;
  state.last = name;
  const from = data.markers.indexOf(name);
  const order = [...data.markers.slice(from + 1), ...data.markers.slice(0, from)];
  state.current = order.find((other) => !state.boxes[other]) ?? null;
}
function move(name, centre) {
  const box = boxAround(centre, Math.max(...state.boxes[name].slice(2)));
  if (box) state.boxes[name] = box;
}
function resize(px) {
  remember();
  side = Math.min(81, Math.max(7, px)); byMarker = false;
  for (const name in state.boxes) state.boxes[name] = boxAround(centreOf(state.boxes[name]), side) ?? state.boxes[name];
}
function boxAt(at) {
  const near = data.markers.filter((name) => state.boxes[name]).map((name) => {
    const [x, y] = centreOf(state.boxes[name]), half = state.boxes[name][2] / 2;
    return { name, off: Math.max(Math.abs(at[0] - x), Math.abs(at[1] - y)) / Math.max(half, 6 / state.view.scale) };
  });
  return near.filter(({ off }) => off <= 1).sort((a, b) => a.off - b.off)[0]?.name ?? null;
}

// --- snapping: [x, y, diameter] of a blob found before, else of what stands out under the click --------------------------
const freeBlobs = () => data.blobs.filter(([x, y, d]) =>
  !data.markers.some((name) => state.boxes[name] && Math.hypot(centreOf(state.boxes[name])[0] - x, centreOf(state.boxes[name])[1] - y) < d / 3));
function snapped(at, exactly) {
  if (exactly || !byId("snap").checked) return at;
  const near = freeBlobs().map(([x, y, d]) => ({ x, y, d, off: Math.hypot(at[0] - x, at[1] - y), reach: Math.max(d * 0.75, REACH / state.view.scale) }))
    .filter((blob) => blob.off < blob.reach).sort((a, b) => a.off - b.off)[0];
  return near ? [near.x, near.y, near.d] : centroid(at) ?? at;
}
function centroid([x, y]) {
  const half = Math.round(side), left = Math.round(x) - half, top = Math.round(y) - half, n = 2 * half + 1;
  if (left < 0 || top < 0 || left + n > data.width || top + n > data.height) return null;
  const rgba = pixels.getImageData(left, top, n, n).data;
  const luma = Float32Array.from({ length: n * n }, (_, k) => 0.299 * rgba[4 * k] + 0.587 * rgba[4 * k + 1] + 0.114 * rgba[4 * k + 2]);
  const edge = [...luma].filter((_, k) => k < n || k >= n * (n - 1) || k % n === 0 || k % n === n - 1).sort((a, b) => a - b);
  const floor = edge[edge.length >> 1], middle = half * n + half;
  const contrast = luma[middle] - floor;
  if (Math.abs(contrast) < 12) return null;
  const open = [middle], seen = new Set(open), sum = [0, 0, 0];
  while (open.length) {
    const k = open.pop(), i = k % n, j = Math.floor(k / n), weight = (luma[k] - floor) / contrast;
    if (i === 0 || j === 0 || i === n - 1 || j === n - 1) return null; // runs out of the patch: no marker
    sum[0] += weight; sum[1] += weight * i; sum[2] += weight * j;
    for (const next of [k - 1, k + 1, k - n, k + n])
      if (!seen.has(next) && (luma[next] - floor) / contrast > 0.5) { seen.add(next); open.push(next); }
  }
  return [left + sum[1] / sum[0], top + sum[2] / sum[0], 2 * Math.sqrt(seen.size / Math.PI)];
}

// --- drawing ----------------------------------------------------------------------------------------------------------
function draw() {
  const ratio = window.devicePixelRatio || 1, { clientWidth: w, clientHeight: h } = canvas;
  if (canvas.width !== Math.round(w * ratio) || canvas.height !== Math.round(h * ratio)) {
    canvas.width = Math.round(w * ratio); canvas.height = Math.round(h * ratio);
  }
  if (!state.view || state.view.whole) fit();
  const { scale, x, y } = state.view;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, w, h);
  pen.imageSmoothingEnabled = scale < 3;
  pen.drawImage(image, x, y, scale * data.width, scale * data.height);
  if (state.current) for (const [bx, by, d] of freeBlobs()) ring(toCanvas([bx, by]), Math.max(4, scale * d * 0.62), "rgb(255 255 255 / .45)", 1);
  drawBoxes();
  if (state.mouse && state.current && !state.drag?.moved) drawAim();
  drawLoupe();
}
function ring([u, v], radius, style, width) {
  pen.beginPath(); pen.arc(u, v, radius, 0, 7); pen.strokeStyle = style; pen.lineWidth = width; pen.stroke();
}
function drawBoxes() {
  const placed = data.markers.filter((name) => state.boxes[name]);
  for (const name of placed) {
    const [x, y, w, h] = state.boxes[name], [u, v] = toCanvas([x - 0.5, y - 0.5]);
    for (const [style, width] of [["rgb(0 0 0 / .75)", 3.5], [colour[name], name === state.last ? 2.4 : 1.6]]) {
      pen.strokeStyle = style; pen.lineWidth = width; pen.strokeRect(u, v, state.view.scale * w, state.view.scale * h);
    }
  }
  placeNames(placed);
}
function placeNames(placed) {
  pen.font = "600 12px system-ui, sans-serif"; pen.textBaseline = "middle";
  const taken = placed.map((name) => { const [x, y, w, h] = state.boxes[name], [u, v] = toCanvas([x, y]); return [u, v, u + state.view.scale * w, v + state.view.scale * h]; });
  for (const name of placed) {
    const [u, v] = toCanvas(centreOf(state.boxes[name])), wide = pen.measureText(name).width + 10;
    const spots = [28, 46, 66, 90, 118].flatMap((far) => [-60, 60, -120, 120, -90, 90, -25, 25, 155, -155].map((deg) => [far, deg * Math.PI / 180]));
    const free = spots.map(([far, turn]) => {
      const cu = u + far * Math.cos(turn) + Math.cos(turn) * wide / 2, cv = v + far * Math.sin(turn);
      return { cu, cv, area: [cu - wide / 2, cv - 9, cu + wide / 2, cv + 9] };
    }).find(({ area }) => taken.every((other) => area[2] < other[0] || area[0] > other[2] || area[3] < other[1] || area[1] > other[3]));
    if (!free) continue;
    taken.push(free.area);
    pen.strokeStyle = colour[name]; pen.lineWidth = 1; pen.beginPath(); pen.moveTo(...rim(name, free));
    pen.lineTo(Math.min(Math.max(u, free.area[0]), free.area[2]), Math.min(Math.max(v, free.area[1]), free.area[3])); pen.stroke();
    pen.fillStyle = "rgb(8 12 16 / .8)"; pen.beginPath(); pen.roundRect(free.area[0], free.area[1], wide, 18, 5); pen.fill();
    pen.fillStyle = colour[name]; pen.fillText(name, free.area[0] + 5, free.cv + 0.5);
  }
}
function rim(name, { cu, cv }) {
  const [u, v] = toCanvas(centreOf(state.boxes[name])), half = state.view.scale * state.boxes[name][2] / 2, by = [cu - u, cv - v];
  const share = half / Math.max(...by.map(Math.abs), half);
  return [u + share * by[0], v + share * by[1]];
}
function drawAim() {
  const at = snapped(toPicture(state.mouse), state.mouse.exactly), box = boxAround(at, sideFor(at));
  if (!box) return;
  const [u, v] = toCanvas([box[0] - 0.5, box[1] - 0.5]), size = state.view.scale * box[2];
  pen.setLineDash([4, 3]); pen.strokeStyle = colour[state.current]; pen.lineWidth = 1.6; pen.strokeRect(u, v, size, size); pen.setLineDash([]);
}
function drawLoupe() {
  const round = byId("loupe"), at = state.mouse && toPicture(state.mouse);
  round.style.opacity = at && state.view.scale < 6 ? 1 : 0;
  if (!at) return;
  const size = round.width, scale = size / LOUPE_PX;
  loupe.imageSmoothingEnabled = false;
  loupe.fillStyle = "#0a0d10"; loupe.fillRect(0, 0, size, size);
  loupe.drawImage(image, at[0] + 0.5 - LOUPE_PX / 2, at[1] + 0.5 - LOUPE_PX / 2, LOUPE_PX, LOUPE_PX, 0, 0, size, size);
  loupe.strokeStyle = state.current ? colour[state.current] : "#fff"; loupe.lineWidth = 1.5;
  loupe.beginPath(); loupe.moveTo(size / 2, size / 2 - 16); loupe.lineTo(size / 2, size / 2 + 16);
  loupe.moveTo(size / 2 - 16, size / 2); loupe.lineTo(size / 2 + 16, size / 2); loupe.stroke();
  if (state.current) {
    const target = snapped(at, state.mouse.exactly), u = size / 2 + scale * (target[0] - at[0]), v = size / 2 + scale * (target[1] - at[1]);
    const half = scale * sideFor(target) / 2;
    loupe.setLineDash([5, 4]); loupe.strokeRect(u - half, v - half, 2 * half, 2 * half); loupe.setLineDash([]);
  }
}
function drawRobot() {
  const svg = byId("robot"), places = data.layout;
  if (!places) { svg.style.display = "none"; return; }
  const xs = places.map(([x]) => x), low = Math.min(...xs), long = Math.max(...xs) - low, far = 0.2 * long;
  svg.setAttribute("viewBox", `${low - 0.12 * long} ${-far} ${1.24 * long} ${2 * far}`);
  const axis = places.filter(([, y]) => Math.abs(y) < 0.02 * long).map(([x]) => x).sort((a, b) => a - b), root = axis[2] ?? axis.at(-1);
  const middle = (low + root) / 2, half = (root - low) / 2 + 0.06 * long;
  const shape = (tag, attributes) => svg.append(Object.entries(attributes).reduce(
    (element, [key, value]) => (element.setAttribute(key, value), element), document.createElementNS("http://www.w3.org/2000/svg", tag)));
  shape("path", { d: `M ${root} 0 H ${axis.at(-1)}`, "stroke-width": 0.05 * long });
  shape("ellipse", { class: "head", cx: middle, cy: 0, rx: half, ry: 0.155 * long });
  places.forEach(([x, y], k) => shape("circle", { "data-name": data.markers[k], cx: x, cy: -y, r: 0.013 * long }));
}
function showState() {
  const left = data.markers.filter((name) => !state.boxes[name]).length;
  byId("ask").innerHTML = state.current
    ? `<i style="background:${colour[state.current]}"></i>Click the <b>${spoken(state.current)}</b> · ${data.markers.length - left + 1} of ${data.markers.length}`
    : "All markers have a box. Drag to adjust, then <b>save</b>.";
  if (state.current && left === 0) byId("ask").innerHTML = `<i style="background:${colour[state.current]}"></i>Click the <b>${spoken(state.current)}</b> again`;
  byId("save").disabled = left > 0;
  document.querySelector("[data-do=undo]").disabled = !state.undo.length;
  byId("size").value = side; byId("size_px").textContent = byMarker ? "auto" : `${Math.round(side)} px`;
  for (const item of byId("markers").children) {
    const name = item.dataset.name, box = state.boxes[name], button = item.firstChild;
    item.className = box ? "put" : "";
    button.setAttribute("aria-current", name === state.current);
    button.lastChild.textContent = box ? centreOf(box).map((value) => value.toFixed(1)).join(", ") : "";
  }
  for (const dot of byId("robot").querySelectorAll("circle")) {
    const name = dot.dataset.name, now = name === state.current;
    dot.style.fill = state.boxes[name] || now ? colour[name] : "";
    dot.style.strokeWidth = now ? 4 : ""; dot.style.stroke = now ? "var(--accent)" : "";
  }
}
const spoken = (name) => name.replaceAll("_", " ").replace(/[<>&]/g, "");
function refresh() { showState(); draw(); }

// --- saving -----------------------------------------------------------------------------------------------------------
function asText() {
  const line = (name) => `  ${JSON.stringify(name)}: ${JSON.stringify(state.boxes[name].map((value) => Math.round(100 * value) / 100))}`;
  return `{"frame": ${data.frame}, "boxes": {\n${data.markers.map(line).join(",\n")}\n}}\n`;
}
function save() {
  if (byId("save").disabled) return;
  const link = document.createElement("a");
  link.href = "data:application/json;charset=utf-8," + encodeURIComponent(asText());
  link.download = `${data.trial}.boxes.json`;
  link.click();
  byId("json").value = asText();
  byId("saved").hidden = false;
  byId("saved").scrollIntoView({ block: "nearest" });
}

// --- hands ------------------------------------------------------------------------------------------------------------
function theme() {
  const dark = document.documentElement.classList.contains("dark")
    || (!document.documentElement.classList.contains("light") && matchMedia("(prefers-color-scheme: dark)").matches);
  document.documentElement.className = dark ? "light" : "dark";
}
const actions = { undo, save, fit, theme, closer: () => zoom(1.5), farther: () => zoom(1 / 1.5) };
const pointer = (event) => { const r = canvas.getBoundingClientRect(); return Object.assign([event.clientX - r.left, event.clientY - r.top], { exactly: event.altKey }); };

canvas.addEventListener("pointerdown", (event) => {
  const at = pointer(event), name = boxAt(toPicture(at));
  state.drag = { from: at, name, view: { ...state.view }, box: name && state.boxes[name], moved: false };
  try { canvas.setPointerCapture(event.pointerId); } catch { /* a made-up pointer */ }
});
canvas.addEventListener("pointermove", (event) => {
  const at = state.mouse = pointer(event), drag = state.drag;
  if (drag) {
    const by = [at[0] - drag.from[0], at[1] - drag.from[1]];
    if (!drag.moved && Math.hypot(...by) > CLICK) { drag.moved = true; if (drag.name) { remember(); state.last = drag.name; } }
    if (drag.moved && drag.name) { const [x, y] = centreOf(drag.box), s = state.view.scale; move(drag.name, [x + by[0] / s, y + by[1] / s]); }
    else if (drag.moved) state.view = { ...drag.view, x: drag.view.x + by[0], y: drag.view.y + by[1], whole: false };
  }
  canvas.className = drag?.moved ? "moving" : boxAt(toPicture(at)) && !state.current ? "over" : "";
  refresh();
});
canvas.addEventListener("pointerup", (event) => {
  const at = pointer(event), drag = state.drag;
  state.drag = null;
  if (drag && !drag.moved && state.current) put(state.current, snapped(toPicture(at), at.exactly));
  else if (drag && !drag.moved && drag.name) state.last = drag.name;
  refresh();
});
canvas.addEventListener("pointerleave", () => { state.mouse = null; refresh(); });
canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(-event.deltaY / 400), pointer(event)); refresh(); }, { passive: false });
document.addEventListener("click", (event) => {
  const action = actions[event.target.closest("[data-do]")?.dataset.do], name = event.target.closest("[data-name]")?.dataset.name;
  if (action) action(); else if (name) state.current = name; else return;
  refresh();
});
byId("size").addEventListener("input", (event) => { resize(Number(event.target.value)); refresh(); });
document.addEventListener("keydown", (event) => {
  if (event.target.matches("textarea, input[type=range]")) return;
  const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key], step = event.shiftKey ? 0.1 : 1;
  if (arrow && state.last && state.boxes[state.last]) {
    remember();
    const [x, y] = centreOf(state.boxes[state.last]);
    move(state.last, [x + step * arrow[0], y + step * arrow[1]]);
  } else if (event.key === "Backspace" || (event.key === "z" && (event.ctrlKey || event.metaKey))) undo();
  else if (event.ctrlKey || event.metaKey) return;
  else if (event.key === "[" || event.key === "]") resize(side + (event.key === "]" ? 2 : -2));
  else if ({ "+": 1, "=": 1, "-": 1, f: 1, s: 1, t: 1 }[event.key]) actions[{ "+": "closer", "=": "closer", "-": "farther", f: "fit", s: "save", t: "theme" }[event.key]]();
  else return;
  event.preventDefault();
  refresh();
});
new ResizeObserver(() => image.complete && draw()).observe(canvas);
byId("markers").append(...data.markers.map((name) => {
  const item = document.createElement("li"), button = document.createElement("button"), chip = document.createElement("span");
  item.dataset.name = name; chip.className = "chip"; button.type = "button"; button.style.setProperty("--chip", colour[name]);
  button.append(chip, spoken(name), document.createElement("small"));
  item.append(button);
  return item;
}));
drawRobot();
image.onload = () => {
  pixels.canvas.width = data.width; pixels.canvas.height = data.height;
  pixels.drawImage(image, 0, 0);
  refresh();
  window.startBoxes = { toCanvas, toPicture, state }; // for tests
};
image.src = data.image;
