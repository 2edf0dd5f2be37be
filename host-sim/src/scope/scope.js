"use strict";
// The page of `pneuma scope`: rows come at full rate over a WebSocket; what is drawn is the least
// and the greatest value of each pixel, so no peak hides between two of them.

const $ = (id) => document.getElementById(id);
const token = new URLSearchParams(location.search).get("token") || "";
const KEPT_S = 610;

let hello = null; // what the server said of signals, gains and tick
let rows = null; // the history
let view = "time";
let paused = null; // null: runs; else the tick at the right edge
let cursors = { a: null, b: null };
let armed = { fired: null, last: null };
let changed = true;

// ---- history: rings of numbers, one a signal --------------------------------------------------

class History {
  constructor(count, tickS) {
    this.size = Math.ceil(KEPT_S / tickS);
    this.tickS = tickS;
    this.tick = new Float64Array(this.size);
    this.values = Array.from({ length: count }, () => new Float32Array(this.size));
    this.next = 0; // rows ever
    this.turns = 0; // turns of the board's 32-bit ticks
    this.before = null;
  }
  get first() { return Math.max(0, this.next - this.size); }
  push(tick, numbers, at) {
    if (this.before !== null && tick < this.before - 2 ** 31) this.turns += 1;
    const whole = tick + this.turns * 2 ** 32;
    // A board that was started anew counts from nought: its rows are another history.
    if (this.next > this.first && whole <= this.tickOf(this.next - 1)) { this.next = 0; this.turns = 0; clearCursors(); }
    this.before = tick;
    const place = this.next % this.size;
    this.tick[place] = tick + this.turns * 2 ** 32;
    for (let i = 0; i < this.values.length; i += 1) this.values[i][place] = numbers[at + i];
    this.next += 1;
  }
  tickOf(row) { return this.tick[row % this.size]; }
  valueOf(signal, row) {
    const it = hello.signals[signal];
    if (it.rateOf === undefined) return this.values[signal][row % this.size];
    // A rate over eight rows: less noise than between two.
    const from = Math.max(this.first, row - 4), to = Math.min(this.next - 1, row + 4);
    const time = (this.tickOf(to) - this.tickOf(from)) * this.tickS;
    return time > 0 ? (this.valueOf(it.rateOf, to) - this.valueOf(it.rateOf, from)) / time : NaN;
  }
  // The first row at or after a tick.
  rowAt(tick) {
    let low = this.first, high = this.next;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.tickOf(middle) < tick) low = middle + 1; else high = middle;
    }
    return low;
  }
}

function clearCursors() { cursors = { a: null, b: null }; paused = null; }

// ---- connection ---------------------------------------------------------------------------------

let socket = null;
function connect() {
  socket = new WebSocket(`ws://${location.host}/live?token=${encodeURIComponent(token)}`);
  socket.binaryType = "arraybuffer";
  socket.onmessage = (message) => {
    if (typeof message.data === "string") {
      const said = JSON.parse(message.data);
      if (said.hello) begin(said.hello);
      if (said.status) show(said.status);
      if (said.notes) said.notes.forEach(note);
    } else if (rows) {
      const ticks = new Uint32Array(message.data);
      const numbers = new Float32Array(message.data);
      const width = hello.width + 1;
      for (let at = 0; at + width <= ticks.length; at += width) {
        rows.push(ticks[at], numbers, at + 1);
        watchTrigger(rows.next - 1);
      }
      changed = true;
    }
  };
  socket.onclose = () => {
    $("state").textContent = "the program has ended; this page asks for it again";
    setTimeout(connect, 1000);
  };
}
const send = (order) => { if (socket && socket.readyState === 1) socket.send(JSON.stringify(order)); };

function begin(said) {
  // The same program after a broken line: the history goes on.
  if (hello && hello.session === said.session) return;
  hello = said;
  hello.width = said.signals.length;
  // Rates are made here; they are signals as others.
  said.signals.forEach((it, place) => {
    if (it.rate) hello.signals.push({ name: `rate of ${it.name}`, unit: `${it.unit}/s`, rateOf: place });
  });
  rows = new History(hello.width, said.tick_s);
  clearCursors();
  $("port").textContent = said.port;
  $("log").replaceChildren();
  buildPanels();
  buildGains(said.gains);
  fill($("trigger-signal"), 0);
  fill($("spectrum-of"), 2);
  fill($("xy-x"), hello.signals.findIndex((it) => it.unit === "V"));
  fill($("xy-y"), hello.signals.findIndex((it) => it.rateOf !== undefined));
  const [low, high] = said.reach_mm;
  Object.assign($("to"), { min: low, max: high, value: "" });
}

function fill(select, chosen) {
  const options = hello.signals.map((it, place) => new Option(`${it.name} (${it.unit || "1"})`, place));
  select.replaceChildren(...options);
  select.value = String(Math.max(0, chosen));
}

function show(status) {
  $("state").textContent = status.state;
  $("losses").textContent = status.losses;
  $("fault").hidden = !status.fault;
  $("fault").firstElementChild.textContent = status.fault || "";
  $("record").setAttribute("aria-pressed", String(Boolean(status.recording)));
  $("record").textContent = status.recording ? "End the recording" : "Record";
  $("recording").textContent = status.recording || "";
  for (const [key, value] of Object.entries(status.gains)) {
    const field = document.querySelector(`#gains input[name="${key}"]`);
    if (field && field !== document.activeElement) field.value = value;
  }
}

function note(said) {
  const item = document.createElement("li");
  const time = document.createElement("time");
  time.textContent = new Date(said.at_ms).toLocaleTimeString([], { hour12: false });
  item.append(time, said.text);
  if (said.wrong) item.className = "wrong";
  $("log").prepend(item);
  while ($("log").childElementCount > 200) $("log").lastElementChild.remove();
}

// ---- panels -------------------------------------------------------------------------------------

let panels = [];
function buildPanels() {
  const groups = new Map();
  hello.signals.forEach((it, place) => {
    if (it.group) groups.set(it.group, [...(groups.get(it.group) || []), place]);
  });
  panels = [...groups].map(([title, signals]) => {
    const figure = document.createElement("figure");
    figure.className = "panel";
    const head = document.createElement("header");
    const strong = document.createElement("strong");
    strong.textContent = `${title}, ${hello.signals[signals[0]].unit}`;
    head.append(strong);
    const items = signals.map((place, colour) => {
      const label = document.createElement("label");
      const box = Object.assign(document.createElement("input"), { type: "checkbox", checked: true });
      const line = document.createElement("i");
      line.style.background = `var(--c${colour})`;
      const value = document.createElement("b");
      value.dataset.signal = hello.signals[place].name;
      label.append(box, " ", line, hello.signals[place].name, value);
      box.onchange = () => { changed = true; };
      head.append(label);
      return { place, colour, box, value };
    });
    const canvas = document.createElement("canvas");
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", `${title} over time`);
    canvas.addEventListener("pointerdown", (event) => placeCursor(event, canvas));
    figure.append(head, canvas);
    return { figure, canvas, items };
  });
  $("panels").replaceChildren(...panels.map((panel) => panel.figure));
}

const windowS = () => Number($("window").value);
function range() {
  const last = rows.next ? rows.tickOf(rows.next - 1) : 0;
  const to = paused === null ? last : paused;
  return [to - windowS() / rows.tickS, to];
}
const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);

function fit(canvas) {
  const scale = devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const pen = canvas.getContext("2d");
  pen.setTransform(scale, 0, 0, scale, 0, 0);
  pen.clearRect(0, 0, width, height);
  pen.font = "11px system-ui, sans-serif";
  return { pen, width, height };
}

const LEFT = 58, RIGHT = 20, BELOW = 18;

function steps(low, high, most) {
  const raw = (high - low) / most;
  const power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((f) => f * power).find((s) => s >= raw) || raw;
  const marks = [];
  for (let at = Math.ceil(low / step) * step; at <= high + 1e-9 * step; at += step) marks.push(at);
  return { marks, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

// Marks at powers of ten, for axes in their logarithm.
function decades(low, high) {
  const marks = [];
  for (let power = Math.ceil(low); power <= high; power += 1) marks.push(power);
  return { marks, text: (power) => String(Number((10 ** power).toPrecision(1))) };
}

const linear = (low, high, most) => {
  const { marks, digits } = steps(low, high, most);
  return { marks, text: (at) => at.toFixed(digits) };
};

function axes({ pen, width, height }, [x0, x1], [y0, y1], unit, marksOf = linear) {
  const toX = (x) => LEFT + ((x - x0) / (x1 - x0)) * (width - LEFT - RIGHT);
  const toY = (y) => 4 + (1 - (y - y0) / (y1 - y0)) * (height - BELOW - 8);
  pen.strokeStyle = colour("--line");
  pen.fillStyle = colour("--soft");
  pen.lineWidth = 1;
  const vertical = marksOf(y0, y1, Math.max(2, height / 32));
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const y of vertical.marks) {
    pen.beginPath(); pen.moveTo(LEFT, toY(y)); pen.lineTo(width - RIGHT, toY(y)); pen.stroke();
    pen.fillText(vertical.text(y), LEFT - 6, toY(y));
  }
  const level = marksOf(x0, x1, Math.max(3, width / 110));
  pen.textAlign = "center";
  pen.textBaseline = "top";
  for (const x of level.marks) {
    pen.beginPath(); pen.moveTo(toX(x), 4); pen.lineTo(toX(x), height - BELOW); pen.stroke();
    pen.fillText(level.text(x) + unit, toX(x), height - BELOW + 4);
  }
  return { toX, toY };
}

// The least and the greatest value of a signal for each pixel between two ticks.
function extremes(signal, from, to, pixels) {
  const least = new Float64Array(pixels).fill(NaN), greatest = new Float64Array(pixels).fill(NaN);
  const first = new Float64Array(pixels).fill(NaN), last = new Float64Array(pixels).fill(NaN);
  const begin = rows.rowAt(from), end = rows.rowAt(to + 1);
  const scale = pixels / (to - from);
  for (let row = begin; row < end; row += 1) {
    const value = rows.valueOf(signal, row);
    if (Number.isNaN(value)) continue;
    const pixel = Math.min(pixels - 1, Math.max(0, Math.floor((rows.tickOf(row) - from) * scale)));
    if (!(least[pixel] <= value)) least[pixel] = value;
    if (!(greatest[pixel] >= value)) greatest[pixel] = value;
    if (Number.isNaN(first[pixel])) first[pixel] = value;
    last[pixel] = value;
  }
  return { least, greatest, first, last };
}

function spread(all) {
  let low = Infinity, high = -Infinity;
  for (const { least, greatest } of all) {
    for (let i = 0; i < least.length; i += 1) {
      if (least[i] < low) low = least[i];
      if (greatest[i] > high) high = greatest[i];
    }
  }
  if (!(low <= high)) return [0, 1];
  const margin = Math.max((high - low) * 0.06, Math.abs(high) * 1e-4, 1e-6);
  return [low - margin, high + margin];
}

function drawPanel(panel) {
  const page = fit(panel.canvas);
  const [from, to] = range();
  const pixels = Math.max(2, Math.floor(page.width - LEFT - RIGHT));
  const shown = panel.items.filter((item) => item.box.checked);
  const all = shown.map((item) => extremes(item.place, from, to, pixels));
  const span = [-windowS(), 0];
  const { toX, toY } = axes(page, span, spread(all), " s");
  const { pen } = page;
  all.forEach(({ least, greatest, first, last }, index) => {
    pen.strokeStyle = colour(`--c${shown[index].colour}`);
    pen.lineWidth = 1.3;
    pen.beginPath();
    let before = null;
    // Rows further apart than this are a gap, and stay one.
    const near = Math.max(2, (4 * hello.stride * pixels) / (to - from));
    for (let i = 0; i < pixels; i += 1) {
      if (Number.isNaN(least[i])) continue;
      const x = LEFT + i + 0.5;
      if (before === null || i - before > near) pen.moveTo(x, toY(first[i])); else pen.lineTo(x, toY(first[i]));
      if (greatest[i] > least[i]) { pen.lineTo(x, toY(least[i])); pen.lineTo(x, toY(greatest[i])); pen.lineTo(x, toY(last[i])); }
      before = i;
    }
    pen.stroke();
  });
  for (const [name, tick] of Object.entries(cursors)) {
    if (tick === null || tick < from || tick > to) continue;
    const x = toX((tick - to) * rows.tickS);
    pen.strokeStyle = colour("--ink");
    pen.setLineDash(name === "a" ? [] : [4, 3]);
    pen.beginPath(); pen.moveTo(x, 2); pen.lineTo(x, page.height - BELOW); pen.stroke();
    pen.setLineDash([]);
    pen.fillStyle = colour("--ink");
    pen.textAlign = "left"; pen.textBaseline = "top";
    pen.fillText(name.toUpperCase(), x + 3, 4);
  }
  const row = paused === null ? rows.next - 1 : rows.rowAt(to);
  for (const item of panel.items) {
    const value = rows.next ? rows.valueOf(item.place, Math.min(row, rows.next - 1)) : NaN;
    item.value.textContent = Number.isFinite(value) ? value.toFixed(3) : "-";
  }
}

function drawXY() {
  const page = fit($("wide"));
  const [x, y] = [Number($("xy-x").value), Number($("xy-y").value)];
  const [from, to] = range();
  const points = [];
  for (let row = rows.rowAt(from); row < rows.rowAt(to + 1); row += 1) {
    const point = [rows.valueOf(x, row), rows.valueOf(y, row)];
    if (point.every(Number.isFinite)) points.push(point);
  }
  const span = (place) => {
    let low = Infinity, high = -Infinity;
    for (const point of points) { low = Math.min(low, point[place]); high = Math.max(high, point[place]); }
    if (!(low <= high)) return [0, 1];
    const margin = Math.max((high - low) * 0.05, 1e-6);
    return [low - margin, high + margin];
  };
  const { toX, toY } = axes(page, span(0), span(1), "");
  page.pen.fillStyle = colour("--c0");
  for (const [px, py] of points) page.pen.fillRect(toX(px) - 0.8, toY(py) - 0.8, 1.6, 1.6);
  label(page, `${hello.signals[y].name}, ${hello.signals[y].unit} over ${hello.signals[x].name}, ${hello.signals[x].unit}`);
}

function label({ pen, width }, text) {
  pen.fillStyle = colour("--ink");
  pen.textAlign = "right"; pen.textBaseline = "top";
  pen.fillText(text, width - RIGHT - 4, 8);
}

// Amplitudes of a signal less its mean, in a Hann window of a power of two rows.
function spectrum(signal) {
  const [from, to] = range();
  const begin = rows.rowAt(from), end = rows.rowAt(to + 1);
  const size = 2 ** Math.floor(Math.log2(Math.max(2, Math.min(end - begin, 65536))));
  if (size < 64) return null;
  const re = new Float64Array(size), im = new Float64Array(size);
  let mean = 0;
  for (let i = 0; i < size; i += 1) {
    const value = rows.valueOf(signal, end - size + i);
    re[i] = Number.isFinite(value) ? value : 0;
    mean += re[i] / size;
  }
  for (let i = 0; i < size; i += 1) re[i] = (re[i] - mean) * (0.5 - 0.5 * Math.cos((2 * Math.PI * i) / size));
  fft(re, im);
  const stepS = ((rows.tickOf(end - 1) - rows.tickOf(end - size)) * rows.tickS) / (size - 1);
  // A sine's amplitude: twice the bin over the rows, over the window's mean of a half.
  const amplitude = Array.from({ length: size / 2 }, (_, i) => (4 * Math.hypot(re[i], im[i])) / size);
  return { hz: 1 / (stepS * size), amplitude };
}

function fft(re, im) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i += 1) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j |= bit;
    if (i < j) { [re[i], re[j]] = [re[j], re[i]]; [im[i], im[j]] = [im[j], im[i]]; }
  }
  for (let length = 2; length <= n; length *= 2) {
    const angle = (-2 * Math.PI) / length;
    for (let k = 0; k < length / 2; k += 1) {
      const c = Math.cos(angle * k), s = Math.sin(angle * k);
      for (let i = k; i < n; i += length) {
        const j = i + length / 2;
        const x = re[j] * c - im[j] * s, y = re[j] * s + im[j] * c;
        re[j] = re[i] - x; im[j] = im[i] - y;
        re[i] += x; im[i] += y;
      }
    }
  }
}

function drawSpectrum() {
  const page = fit($("wide"));
  const signal = Number($("spectrum-of").value);
  const found = spectrum(signal);
  if (!found) return;
  const { hz, amplitude } = found;
  const log = (value) => Math.log10(Math.max(value, 1e-9));
  const top = Math.max(...amplitude.slice(2).map(log));
  const { toX, toY } = axes(page, [log(2 * hz), log(hz * amplitude.length)], [top - 5, top + 0.3], " Hz", decades);
  page.pen.strokeStyle = colour("--c0");
  page.pen.beginPath();
  for (let i = 2; i < amplitude.length; i += 1) page.pen.lineTo(toX(log(i * hz)), toY(Math.max(top - 5, log(amplitude[i]))));
  page.pen.stroke();
  let peak = 2;
  for (let i = 3; i < amplitude.length; i += 1) if (amplitude[i] > amplitude[peak]) peak = i;
  const it = hello.signals[signal];
  label(page, `${it.name}: amplitude in ${it.unit}, the largest ${amplitude[peak].toPrecision(3)} at ${(peak * hz).toFixed(2)} Hz`);
}

// ---- pause, trigger, cursors ----------------------------------------------------------------------

function pause(at) {
  paused = at;
  $("pause").setAttribute("aria-pressed", String(at !== null));
  $("pause").textContent = at === null ? "Pause" : "Run";
  changed = true;
}
function togglePause() {
  armed = { fired: null, last: null };
  pause(paused === null && rows && rows.next ? rows.tickOf(rows.next - 1) : null);
}

// A quarter of the window lies before the trigger; when the rest is there the picture stands.
function watchTrigger(row) {
  const mode = $("trigger").value;
  if (mode === "off" || paused !== null) return;
  const of = { fault: "fault", state: "state" }[mode];
  const signal = of ? hello.signals.findIndex((it) => it.name === of) : Number($("trigger-signal").value);
  const now = rows.valueOf(signal, row), before = armed.last;
  armed.last = now;
  if (armed.fired === null && before !== null) {
    const level = Number($("trigger-level").value);
    const fires = {
      rise: before < level && now >= level, fall: before > level && now <= level,
      fault: before === 0 && now !== 0, state: before !== now,
    }[mode];
    if (fires) armed.fired = rows.tickOf(row);
  }
  $("trigger-said").textContent = armed.fired === null ? "waits" : "caught";
  const after = (0.75 * windowS()) / rows.tickS;
  if (armed.fired !== null && rows.tickOf(row) >= armed.fired + after) {
    cursors.a = armed.fired;
    pause(armed.fired + after);
    armed = { fired: null, last: null };
    showCursors();
  }
}

function placeCursor(event, canvas) {
  if (!rows || !rows.next) return;
  const [from, to] = range();
  const box = canvas.getBoundingClientRect();
  const share = (event.clientX - box.left - LEFT) / (box.width - LEFT - RIGHT);
  const row = rows.rowAt(from + Math.min(1, Math.max(0, share)) * (to - from));
  cursors[event.shiftKey ? "b" : "a"] = rows.tickOf(Math.min(row, rows.next - 1));
  showCursors();
}

function showCursors() {
  changed = true;
  const body = $("readout").tBodies[0];
  body.replaceChildren();
  $("readout").hidden = cursors.a === null && cursors.b === null;
  const line = (name, a, b, digits) => {
    const cells = [a, b, b === null || a === null ? null : b - a];
    const tr = body.insertRow();
    tr.append(Object.assign(document.createElement("th"), { textContent: name }));
    for (const cell of cells) tr.insertCell().textContent = Number.isFinite(cell) && cell !== null ? cell.toFixed(digits) : "-";
  };
  const last = rows.tickOf(rows.next - 1);
  const at = (tick) => (tick === null ? null : (tick - last) * rows.tickS);
  line("time, s", at(cursors.a), at(cursors.b), 4);
  hello.signals.forEach((it, place) => {
    if (!it.group) return;
    const value = (tick) => (tick === null ? null : rows.valueOf(place, rows.rowAt(tick)));
    line(`${it.name}, ${it.unit}`, value(cursors.a), value(cursors.b), 4);
  });
}

// ---- gains, orders, keys ----------------------------------------------------------------------------

function buildGains(gains) {
  const fields = gains.map((gain) => {
    const label = document.createElement("label");
    const field = Object.assign(document.createElement("input"), {
      type: "number", step: "any", name: gain.key, min: gain.lowest, max: gain.highest, value: gain.value, required: true,
    });
    const words = Object.assign(document.createElement("small"), {
      textContent: `${gain.what}; ${gain.lowest} to ${gain.highest} ${gain.unit}`,
    });
    field.onchange = () => {
      if (field.reportValidity()) send({ do: "gain", key: gain.key, value: Number(field.value) });
    };
    label.append(gain.key, field, words);
    return label;
  });
  $("gains").replaceChildren(...fields);
}

$("gains").onsubmit = (event) => { event.preventDefault(); document.activeElement.blur(); };
$("move").onsubmit = (event) => { event.preventDefault(); send({ do: "move", to_mm: Number($("to").value) }); };
$("stop").onclick = () => send({ do: "stop" });
$("acknowledge").onclick = () => send({ do: "acknowledge" });
$("store").onclick = () => send({ do: "store" });
const record = () => {
  const on = $("record").getAttribute("aria-pressed") !== "true";
  send({ do: "record", on, mcap: $("as_mcap").checked });
};
$("record").onclick = record;
$("pause").onclick = togglePause;
$("trigger").onchange = () => { armed = { fired: null, last: null }; $("trigger-said").textContent = ""; pause(null); showTrigger(); };
function showTrigger() {
  const isEdge = ["rise", "fall"].includes($("trigger").value);
  $("trigger-of").hidden = $("trigger-at").hidden = !isEdge;
}
for (const id of ["window", "xy-x", "xy-y", "spectrum-of"]) $(id).onchange = () => { changed = true; };
for (const name of ["time", "xy", "spectrum"]) $(`tab-${name}`).onclick = () => choose(name);
function choose(name) {
  view = name;
  for (const other of ["time", "xy", "spectrum"]) {
    $(`tab-${other}`).setAttribute("aria-selected", String(other === name));
    document.querySelector(`.of.${other}`).classList.toggle("shown", other === name);
  }
  $("panels").hidden = $("cursors").hidden = name !== "time";
  $("wide").hidden = name === "time";
  changed = true;
}

document.addEventListener("keydown", (event) => {
  if (["INPUT", "SELECT"].includes(event.target.tagName) || event.ctrlKey || event.metaKey || event.altKey) return;
  const step = windowS() / (rows ? rows.tickS : 1) / 10;
  const keys = {
    " ": togglePause, s: () => send({ do: "stop" }), r: record,
    ArrowLeft: () => paused !== null && pause(paused - step),
    ArrowRight: () => paused !== null && pause(paused + step),
    "+": () => zoom(-1), "-": () => zoom(1),
  };
  const act = keys[event.key];
  if (!act || (event.key === " " && event.target.tagName === "BUTTON")) return;
  event.preventDefault();
  act();
});
function zoom(by) {
  const select = $("window");
  select.selectedIndex = Math.min(select.options.length - 1, Math.max(0, select.selectedIndex + by));
  changed = true;
}

// Thirty pictures a second at the most, and none where nothing has changed.
let drawn = 0;
function draw(now) {
  requestAnimationFrame(draw);
  if (!rows || !changed || now - drawn < 33) return;
  drawn = now;
  changed = paused === null;
  if (view === "time") panels.forEach(drawPanel);
  else if (view === "xy") drawXY();
  else drawSpectrum();
}
addEventListener("resize", () => { changed = true; });
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { changed = true; });
choose("time");
showTrigger();
connect();
requestAnimationFrame(draw);
