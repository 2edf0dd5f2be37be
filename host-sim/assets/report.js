"use strict";
/*
 * Draws the charts of a report.
 *
 * Every <figure class="chart"> holds an empty <div class="plot"> and its data
 * as JSON (written by src/report/chart.rs). A Figure is one x axis with its
 * zoom and cursor; it has one Panel per pair of axes. Everything is SVG that
 * names roles ("role-given") and leaves all colours to the style sheet, so
 * light, dark and paper need no redrawing.
 *
 * Long columns come packed (24 bits a value, base64) and are drawn thinned to
 * the pixels at hand, so that zooming in brings more of them.
 *
 * Every figure can be saved: PNG and SVG as it stands on the page, in the
 * colours of paper, and CSV with all its values. Nothing leaves the page.
 *
 * Text from the data reaches the page through textContent and setAttribute
 * only; no markup is ever built from it.
 */
(() => {
  const PRINT_WIDTH = 680; // CSS pixels that fit A4 and Letter upright
  const PRINT_COLUMN = 324; // and side by side
  const PRINT_HEIGHT = 0.78; // share of the screen's height
  const MARGIN_RIGHT = 14;
  const MARGIN_TOP = 8;
  const TICK_ROW = 22; // height below the last panel for tick labels
  const LABEL_ROW = 18; // and for the axis label
  const LABEL_LINE = 15; // height of a row of interval labels above the plot
  const CHARACTER = 6.4; // average width of a tick label's character
  const BOLD_CHARACTER = 7.3;
  const CLICK = 4; // pixels below which a drag is a click
  const FAR = 20000; // pixels; browsers draw garbage much further out
  const MANY = 3000; // points in view from which a curve is thinned to pixels
  const TICK_SPACE = 24; // pixels between the ticks of a vertical axis
  const PNG_SCALE = 2; // pixels of a saved picture per CSS pixel

  // ---- numbers ----------------------------------------------------------

  const clamp = (value, low, high) => Math.min(Math.max(value, low), high);

  const superscript = (integer) =>
    [...String(integer)].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[Number(c)] ?? "⁻").join("");

  const trueMinus = (text) => text.replace("-", "−");

  /** A number where `resolution` is the smallest difference worth showing. */
  function numberText(value, resolution) {
    if (!Number.isFinite(value)) return "–";
    const size = Math.max(Math.abs(value), resolution);
    const longest = size / resolution > 1e4 ? 1e12 : 1e6; // counts and clocks stay plain
    if (value !== 0 && (size >= longest || size < 1e-4)) {
      const digits = clamp(Math.ceil(Math.log10(size / resolution) - 1e-9), 0, 6);
      const [mantissa, exponent] = value.toExponential(digits).split("e");
      return `${trueMinus(mantissa)}×10${superscript(Number(exponent))}`;
    }
    const decimals = size < 1e-4 ? 0 : clamp(Math.ceil(-Math.log10(resolution) - 1e-9), 0, 10);
    const text = value.toFixed(decimals);
    return Number(text) === 0 ? text.replace("-", "") : trueMinus(text);
  }

  /** A number on a logarithmic axis: a power of ten where it is one. */
  function logText(value) {
    const exponent = Math.log10(value);
    if (exponent >= -2.5 && exponent < 4.5) return String(Number(value.toPrecision(3)));
    const whole = Math.floor(exponent + 1e-9);
    const mantissa = Number((value / 10 ** whole).toPrecision(2));
    return `${mantissa === 1 ? "" : `${mantissa}×`}10${superscript(whole)}`;
  }

  const LEAST_TICKS = 3; // a scale: two give a distance, the third shows that it is even

  /** The coarsest round steps that put enough ticks into the range. */
  function linearTicks(low, high, wanted) {
    const power = 10 ** Math.floor(Math.log10((high - low) / Math.max(wanted, 1)));
    if (!(power > 0) || !Number.isFinite(power)) return [];
    const enough = Math.max(LEAST_TICKS, Math.ceil(wanted / 2));
    const span = (step) => [Math.ceil(low / step - 1e-9), Math.floor(high / step + 1e-9)];
    const steps = [10, 5, 2.5, 2, 1, 0.5, 0.25, 0.2, 0.1].map((factor) => factor * power);
    const step = steps.find((one) => span(one)[1] - span(one)[0] + 1 >= enough) ?? steps.at(-1);
    const [first, last] = span(step);
    // A step of 2.5 needs one more decimal than its size.
    const resolution = Math.abs(step / power - 2.5) < 1e-9 || Math.abs(step / power - 0.25) < 1e-9 ? step / 25 : step;
    const ticks = [];
    for (let n = first; n <= last; n += 1) {
      ticks.push({ value: n * step, text: numberText(n * step, resolution) });
    }
    return ticks;
  }

  /** Decades, fewer of them if many; 1-2-5 within if few. */
  function logTicks(low, high, wanted) {
    const decades = Math.log10(high / low);
    if (decades < 0.7) return linearTicks(low, high, wanted).filter((t) => t.value > 0);
    const stride = Math.max(1, Math.ceil(decades / wanted));
    const factors = decades * 3 <= wanted ? [1, 2, 5] : [1];
    const ticks = [];
    for (let e = Math.floor(Math.log10(low)); e <= Math.log10(high) + 1e-9; e += 1) {
      if (e % stride !== 0) continue;
      for (const factor of factors) {
        const value = factor * 10 ** e;
        if (value < low * 0.9999 || value > high * 1.0001) continue;
        ticks.push({ value, text: logText(value) });
      }
    }
    return ticks;
  }

  /** Maps values to pixels and back. */
  function makeScale(logarithmic, [low, high], from, to) {
    const map = logarithmic ? Math.log10 : (value) => value;
    const start = map(low);
    const factor = (to - from) / (map(high) - start);
    return {
      logarithmic, low, high,
      at: (value) => from + (map(value) - start) * factor,
      value: (pixel) => {
        const mapped = start + (pixel - from) / factor;
        return logarithmic ? 10 ** mapped : mapped;
      },
      ticks: (wanted) => (logarithmic ? logTicks : linearTicks)(low, high, wanted),
      text: (value) => (logarithmic ? logText(value) : numberText(value, (high - low) / 2000)),
    };
  }

  /** The range of the values, widened where it is empty. */
  function rangeOf(values, logarithmic) {
    let low = Infinity;
    let high = -Infinity;
    for (const value of values) {
      if (!Number.isFinite(value) || (logarithmic && value <= 0)) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
    if (low > high) return logarithmic ? [0.1, 10] : [0, 1];
    if (low === high) {
      if (logarithmic) return [low / 2, low * 2];
      const half = Math.abs(low) * 0.05 || 1;
      return [low - half, high + half];
    }
    return [low, high];
  }

  function padded([low, high], share, logarithmic) {
    if (logarithmic) {
      const factor = (high / low) ** share;
      return [low / factor, high * factor];
    }
    const margin = (high - low) * share;
    return [low - margin, high + margin];
  }

  /** The first position in ascending `values` whose value is at least `x`. */
  function lowerBound(values, x) {
    let from = 0;
    let to = values.length;
    while (from < to) {
      const middle = (from + to) >> 1;
      if (values[middle] < x) from = middle + 1;
      else to = middle;
    }
    return from;
  }

  /** The values of a column as `src/report/chart.rs` writes it. */
  function unpacked(column, series) {
    if (typeof column === "number") return series[column].x;
    if (Array.isArray(column)) return Float64Array.from(column, (v) => (v === null ? NaN : v));
    if (column.count) {
      return Float64Array.from({ length: column.count }, (_, row) => column.first + row * column.step);
    }
    const bytes = atob(column.packed);
    const { low, high } = column;
    return Float64Array.from({ length: bytes.length / 3 }, (_, row) => {
      const [a, b, c] = [0, 1, 2].map((place) => bytes.charCodeAt(3 * row + place));
      const whole = a * 65536 + b * 256 + c;
      return whole === 0xffffff ? NaN : low + ((high - low) * whole) / 0xfffffe;
    });
  }

  // ---- elements ---------------------------------------------------------

  function html(tag, className, text) {
    const element = document.createElement(tag);
    if (className) element.className = className;
    if (text !== undefined) element.textContent = text;
    return element;
  }

  const SVG = new DOMParser()
    .parseFromString("<svg></svg>", "text/html").querySelector("svg").namespaceURI;

  function svg(parent, tag, attributes, text) {
    const element = document.createElementNS(SVG, tag);
    for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
    if (text !== undefined) element.textContent = text;
    parent.append(element);
    return element;
  }

  const withUnit = (axis) =>
    axis.unit && axis.label ? `${axis.label} (${axis.unit})` : axis.label || axis.unit;

  const px = (pixel) => Math.round(clamp(pixel, -FAR, FAR) * 10) / 10;

  // ---- paths ------------------------------------------------------------

  /**
   * The points worth drawing: of each pixel column the first, lowest, highest and last,
   * and a gap. A line through them covers the same pixels as one through all.
   */
  function worthDrawing(one, first, last, x) {
    const rows = [];
    if (!one.ordered || last - first < MANY) {
      for (let i = first; i < last; i += 1) rows.push(i);
      return rows;
    }
    for (let i = first; i < last;) {
      const column = Math.floor(x.at(one.x[i]));
      const kept = [i, i, i, i, i];
      let end = i;
      for (; end < last && (end === i || Math.floor(x.at(one.x[end])) === column); end += 1) {
        const value = one.y[end];
        if (Number.isNaN(value)) kept[3] = end;
        else if (!(value >= one.y[kept[1]])) kept[1] = end;
        else if (!(value <= one.y[kept[2]])) kept[2] = end;
      }
      kept[4] = end - 1;
      kept.sort((a, b) => a - b).forEach((row) => { if (row !== rows.at(-1)) rows.push(row); });
      i = end;
    }
    return rows;
  }

  /** A line with gaps where a value is missing; lone points become dots. */
  function linePath(one, first, last, x, y, stepped) {
    let path = "";
    let drawing = false;
    for (const i of worthDrawing(one, first, last, x)) {
      const across = x.at(one.x[i]);
      const down = y.at(one.y[i]);
      if (!Number.isFinite(across) || !Number.isFinite(down)) {
        drawing = false;
      } else if (!drawing) {
        path += `M${px(across)} ${px(down)}h0`;
        drawing = true;
      } else {
        path += stepped ? `H${px(across)}V${px(down)}` : `L${px(across)} ${px(down)}`;
      }
    }
    return path;
  }

  function dotsPath(one, first, last, x, y) {
    let path = "";
    for (let i = first; i < last; i += 1) {
      const across = x.at(one.x[i]);
      const down = y.at(one.y[i]);
      if (Number.isFinite(across) && Number.isFinite(down)) path += `M${px(across)} ${px(down)}h0`;
    }
    return path;
  }

  /** Bars between neighbouring x values, as high as the left one's value. */
  function barsPath(one, x, y) {
    let path = "";
    const floor = px(y.at(y.logarithmic ? y.low : 0));
    for (let i = 0; i + 1 < one.x.length; i += 1) {
      const [left, right] = [px(x.at(one.x[i])), px(x.at(one.x[i + 1]))];
      const top = y.at(one.y[i]);
      if (Number.isFinite(top)) path += `M${left} ${floor}V${px(top)}H${right}V${floor}Z`;
    }
    return path;
  }

  function bandPath(band, first, last, x, y) {
    let path = "";
    let run = [];
    const close = () => {
      const upper = run.map((i) => `${px(x.at(band.x[i]))} ${px(y.at(band.upper[i]))}`);
      const lower = run.map((i) => `${px(x.at(band.x[i]))} ${px(y.at(band.lower[i]))}`);
      if (run.length > 1) path += `M${upper.join("L")}L${lower.reverse().join("L")}Z`;
      run = [];
    };
    for (let i = first; i < last; i += 1) {
      const usable = [x.at(band.x[i]), y.at(band.lower[i]), y.at(band.upper[i])];
      if (usable.every(Number.isFinite)) run.push(i);
      else close();
    }
    close();
    return path;
  }

  // ---- one pair of axes -------------------------------------------------

  class Panel {
    constructor(figure, data, isLast) {
      Object.assign(this, data);
      this.figure = figure;
      this.isLast = isLast;
      for (const one of this.series) {
        one.x = unpacked(one.x, this.series);
        one.y = unpacked(one.y, this.series);
      }
      for (const band of this.bands) {
        for (const column of ["x", "lower", "upper"]) band[column] = unpacked(band[column]);
        band.ordered = true;
      }
      this.build();
    }

    build() {
      const panel = html("div", "panel");
      const head = html("div", "head");
      const name = html("div", "name");
      if (this.title) name.append(html("b", "", this.title), " ");
      name.append(withUnit(this.y));
      const legend = html("div", "legend");
      this.entries = [...this.series, ...this.bands].map((one) => this.legendEntry(one, legend));
      head.append(name, legend);
      panel.append(head);
      this.svg = svg(panel, "svg", { role: "img", "aria-label": this.spoken });
      this.figure.plot.append(panel);
    }

    legendEntry(one, legend) {
      const button = html("button", `role-${one.role}`);
      button.type = "button";
      button.title = "show or hide";
      const swatch = svg(button, "svg", { class: "swatch", viewBox: "0 0 22 10", "aria-hidden": "true" });
      this.swatch(one, swatch);
      button.append(html("span", "", one.name));
      const readout = html("output");
      button.append(readout);
      button.addEventListener("click", () => this.figure.toggle(one.name));
      legend.append(button);
      return { one, button, readout };
    }

    swatch(one, parent) {
      if (one.lower) svg(parent, "rect", { class: "band", width: 22, height: 10 });
      else if (one.shape === "bars") svg(parent, "rect", { class: "bars", width: 22, height: 10 });
      else if (one.shape === "dots") svg(parent, "path", { class: "dots", d: "M4 5h0M11 5h0M18 5h0" });
      else svg(parent, "path", { class: `line${one.dashed ? " dashed" : ""}`, d: "M1 5H21" });
    }

    isShown(one) {
      return !this.figure.hidden.has(one.name);
    }

    /** The positions to draw: those in view and one neighbour on either side. */
    inView(one, [low, high]) {
      if (!one.ordered) return [0, one.x.length];
      const first = lowerBound(one.x, low);
      const last = lowerBound(one.x, high);
      return [Math.max(first - 1, 0), Math.min(last + 1, one.x.length)];
    }

    /** The y range: fixed, chosen by a box zoom, or that of what is in view. */
    yRange(view) {
      const { logarithmic } = this.y;
      if (this.box) return this.box;
      if (this.y_range && !(logarithmic && this.y_range[0] <= 0)) return this.y_range;
      const values = [];
      const collect = (one, column) => {
        if (!this.isShown(one)) return;
        const [first, last] = this.inView(one, view);
        for (let i = first; i < last; i += 1) {
          if (one.x[i] >= view[0] && one.x[i] <= view[1]) values.push(one[column][i]);
        }
      };
      for (const one of this.series) collect(one, "y");
      for (const band of this.bands) { collect(band, "lower"); collect(band, "upper"); }
      const bars = this.series.some((one) => one.shape === "bars" && this.isShown(one));
      for (const level of this.levels) values.push(level.value);
      if (bars && !logarithmic) values.push(0);
      const exact = rangeOf(values, logarithmic);
      const range = padded(exact, 0.06, logarithmic);
      // Bars stand on the axis.
      return bars && exact[0] === 0 ? [0, range[1]] : range;
    }

    /** Vertical scale and ticks, before the widths of the labels are known. */
    prepare(view, heightShare) {
      this.shownHeight = Math.round(this.height * heightShare);
      const bottom = MARGIN_TOP + this.shownHeight;
      this.yScale = makeScale(this.y.logarithmic, this.yRange(view), bottom, MARGIN_TOP);
      this.yTicks = this.yScale.ticks(Math.max(3, Math.round(this.shownHeight / TICK_SPACE)));
      return Math.max(...this.yTicks.map((tick) => tick.text.length), 3);
    }

    draw(width, left, x) {
      const bottomEdge = MARGIN_TOP + this.shownHeight;
      this.frame = { left, right: width - MARGIN_RIGHT, top: MARGIN_TOP, bottom: bottomEdge };
      const labels = this.placeLabels(x);
      // Labels of intervals stand above the plot, at negative y.
      this.headroom = labels.length ? LABEL_LINE * (1 + Math.max(...labels.map((l) => l.row))) : 0;
      const full = this.headroom + bottomEdge + (this.isLast ? TICK_ROW + LABEL_ROW : 6);
      this.svg.setAttribute("viewBox", `0 ${-this.headroom} ${width} ${full}`);
      this.svg.replaceChildren();
      svg(this.svg, "rect", { class: "hit", y: -this.headroom, width, height: full });
      this.drawAxes(x);
      this.drawLabels(labels);
      // A nested svg clips at its edges without needing an id.
      const { right, top, bottom } = this.frame;
      const size = { x: left, y: top, width: Math.max(right - left, 1), height: bottom - top };
      this.inner = svg(this.svg, "svg", {
        ...size, viewBox: `${size.x} ${size.y} ${size.width} ${size.height}`, class: "inner",
      });
      this.drawIntervals(x);
      const drawn = this.drawCurves(x);
      this.drawLevels();
      this.overlay = svg(this.svg, "g", { class: "overlay", "aria-hidden": "true" });
      if (!drawn) {
        const place = { class: "empty", x: (left + right) / 2, y: (top + bottom) / 2 };
        svg(this.svg, "text", place, "no data to show");
      }
      for (const { one, button } of this.entries) {
        button.setAttribute("aria-pressed", String(this.isShown(one)));
      }
    }

    drawAxes(x) {
      const { left, right, top, bottom } = this.frame;
      for (const tick of this.yTicks) {
        const y = px(this.yScale.at(tick.value));
        svg(this.svg, "path", { class: "grid", d: `M${left} ${y}H${right}` });
        svg(this.svg, "text", { class: "tick y", x: left - 7, y: y + 4 }, tick.text);
      }
      const wanted = Math.max(2, Math.floor((right - left) / (x.logarithmic ? 55 : 90)));
      for (const tick of x.ticks(wanted)) {
        const across = px(x.at(tick.value));
        svg(this.svg, "path", { class: "grid", d: `M${across} ${top}V${bottom}` });
        if (this.isLast) svg(this.svg, "text", { class: "tick x", x: across, y: bottom + 17 }, tick.text);
      }
      svg(this.svg, "path", { class: "axis", d: `M${left} ${bottom}H${right}` });
      if (!this.isLast) return;
      const place = { class: "label x", x: (left + right) / 2, y: bottom + TICK_ROW + 13 };
      svg(this.svg, "text", place, withUnit(this.figure.x));
    }

    drawIntervals(x) {
      const { top, bottom } = this.frame;
      for (const { from, to, label } of this.visibleIntervals(x)) {
        const group = svg(this.inner, "g", { class: "interval" });
        const shade = { x: from, y: top, width: Math.max(to - from, 1.5), height: bottom - top };
        svg(group, "rect", shade);
        svg(group, "path", { d: `M${from} ${top}V${bottom}M${to} ${top}V${bottom}` });
        if (label) svg(group, "title", {}, label);
      }
    }

    /** The intervals that reach into the view, in pixels. */
    visibleIntervals(x) {
      const { left, right } = this.frame;
      return this.intervals
        .map(({ from, to, label }) => ({ from: px(x.at(from)), to: px(x.at(to)), label }))
        .filter(({ from, to }) => to >= left && from <= right);
    }

    /** Rows for the labels, the lowest first, so that none covers another. */
    placeLabels(x) {
      const { left, right } = this.frame;
      const ends = []; // right end of the last label in each row
      const placed = [];
      const longest = Math.max(Math.floor((right - left) / BOLD_CHARACTER), 2);
      for (const { from, label } of this.visibleIntervals(x)) {
        if (!label) continue;
        const text = label.length > longest ? `${label.slice(0, longest - 1)}…` : label;
        const width = text.length * BOLD_CHARACTER;
        const start = clamp(from, left, Math.max(right - width, left));
        let row = ends.findIndex((end) => end < start);
        if (row < 0) row = ends.length;
        ends[row] = start + width + 8;
        placed.push({ text, start, row });
      }
      return placed;
    }

    drawLabels(labels) {
      for (const { text, start, row } of labels) {
        const place = { class: "interval", x: start, y: MARGIN_TOP - 5 - row * LABEL_LINE };
        svg(this.svg, "text", place, text);
      }
    }

    drawCurves(x) {
      const view = [x.low, x.high];
      const y = this.yScale;
      let drawn = false;
      for (const band of this.bands.filter((one) => this.isShown(one))) {
        const d = bandPath(band, ...this.inView(band, view), x, y);
        drawn ||= d !== "";
        svg(this.inner, "path", { class: `band role-${band.role}`, d });
      }
      for (const one of this.series.filter((series) => this.isShown(series))) {
        const [first, last] = this.inView(one, view);
        let d = "";
        if (one.shape === "bars") d = barsPath(one, x, y);
        else if (one.shape === "dots") d = dotsPath(one, first, last, x, y);
        else d = linePath(one, first, last, x, y, one.shape === "step");
        drawn ||= d !== "";
        const shape = one.shape === "step" ? "line" : one.shape;
        svg(this.inner, "path", { class: `${shape}${one.dashed ? " dashed" : ""} role-${one.role}`, d });
      }
      return drawn;
    }

    drawLevels() {
      const { left, right } = this.frame;
      for (const level of this.levels) {
        const y = px(this.yScale.at(level.value));
        if (!Number.isFinite(y)) continue;
        svg(this.inner, "path", { class: "level", d: `M${left} ${y}H${right}` });
        svg(this.inner, "text", { class: "level", x: right - 4, y: y - 5 }, level.label);
      }
    }

    // ---- cursor

    /** The position in the curve the pointer means, or -1. */
    nearest(one, x, pointer) {
      if (one.x.length === 0) return -1;
      if (one.ordered) {
        const at = lowerBound(one.x, pointer.value);
        if (one.shape === "bars") return at - 1 < one.x.length - 1 ? at - 1 : -1;
        if (at === 0) return pointer.value < one.x[0] ? -1 : 0;
        if (at === one.x.length) return -1;
        const nearLeft = pointer.value - one.x[at - 1] < one.x[at] - pointer.value;
        return one.shape === "step" || nearLeft ? at - 1 : at;
      }
      if (pointer.panel !== this) return -1;
      let best = -1;
      let least = Infinity;
      for (let i = 0; i < one.x.length; i += 1) {
        const across = x.at(one.x[i]) - pointer.across;
        const down = this.yScale.at(one.y[i]) - pointer.down;
        const distance = across * across + down * down;
        if (distance < least) { least = distance; best = i; }
      }
      return best;
    }

    showCursor(x, pointer) {
      const { left, right, top, bottom } = this.frame;
      this.overlay.replaceChildren();
      const across = clamp(px(x.at(pointer.value)), left, right);
      svg(this.overlay, "path", { class: "cursor", d: `M${across} ${top}V${bottom}` });
      for (const { one, readout } of this.entries) {
        readout.textContent = "";
        if (!this.isShown(one)) continue;
        const i = this.nearest(one, x, pointer);
        if (i >= 0) readout.textContent = this.readoutText(one, i, x);
        if (i >= 0 && one.y && one.shape !== "bars") this.showPoint(one, i, x);
      }
      if (!this.isLast) return;
      const text = `${x.text(pointer.value)} ${this.figure.x.unit}`.trim();
      const half = (text.length * BOLD_CHARACTER) / 2 + 6;
      const middle = clamp(across, left + half, right - half);
      const box = { class: "flag", x: middle - half, y: bottom + 3, width: 2 * half, height: 19, rx: 3 };
      svg(this.overlay, "rect", box);
      svg(this.overlay, "text", { class: "flag", x: middle, y: bottom + 17 }, text);
    }

    readoutText(one, i, x) {
      const y = this.yScale;
      if (one.lower) return `${y.text(one.lower[i])} … ${y.text(one.upper[i])}`;
      if (!one.ordered) return `(${x.text(one.x[i])}, ${y.text(one.y[i])})`;
      return y.text(one.y[i]);
    }

    showPoint(one, i, x) {
      const [cx, cy] = [x.at(one.x[i]), this.yScale.at(one.y[i])];
      const { left, right, top, bottom } = this.frame;
      const inside = cx >= left && cx <= right && cy >= top && cy <= bottom;
      if (inside) svg(this.overlay, "circle", { class: `point role-${one.role}`, cx, cy, r: 3.5 });
    }

    hideCursor() {
      this.overlay?.replaceChildren();
      for (const { readout } of this.entries) readout.textContent = "";
    }

    showSelection(from, to, isBox) {
      const { left, right, top, bottom } = this.frame;
      const x1 = clamp(Math.min(from.across, to.across), left, right);
      const x2 = clamp(Math.max(from.across, to.across), left, right);
      const y1 = isBox ? clamp(Math.min(from.down, to.down), top, bottom) : top;
      const y2 = isBox ? clamp(Math.max(from.down, to.down), top, bottom) : bottom;
      svg(this.overlay, "rect", { class: "selection", x: x1, y: y1, width: x2 - x1, height: y2 - y1 });
    }
  }

  // ---- panels that share x ----------------------------------------------

  class Figure {
    constructor(element) {
      const data = JSON.parse(element.querySelector("script").textContent);
      this.plot = element.querySelector(".plot");
      this.x = data.x;
      this.hidden = new Set();
      this.panels = data.panels.map((panel, i) => new Panel(this, panel, i === data.panels.length - 1));
      // Phase portraits have no direction: there a drag chooses a box.
      this.isBox = this.panels.some((panel) => panel.series.some((one) => !one.ordered && one.x.length));
      this.whole = this.wholeView();
      this.view = data.view ?? this.whole;
      this.plot.tabIndex = 0;
      this.plot.setAttribute("role", "group");
      this.plot.setAttribute("aria-label", "Chart. Keys: plus and minus zoom, arrows move, 0 resets.");
      this.reset = html("button", "reset", "show all");
      this.reset.type = "button";
      this.reset.addEventListener("click", () => this.zoom(this.whole));
      this.hint = html("div", "hint", "drag to zoom · shift-drag to move · double-click for all");
      this.plot.append(this.reset, this.hint);
      if (this.panels.some((panel) => panel.series.some((one) => one.thinned))) {
        element.append(html("p", "note", "Long recording, drawn thinned: magnified views show its envelope."));
      }
      tools(element, () => this.csv());
      this.panels.forEach((panel) => this.listen(panel));
      this.plot.addEventListener("keydown", (event) => this.key(event));
      new ResizeObserver(() => {
        if (Math.round(this.plot.clientWidth) !== this.width) this.draw();
      }).observe(this.plot);
    }

    wholeView() {
      const columns = this.panels.flatMap((panel) => [...panel.series, ...panel.bands]);
      const ends = columns.flatMap((one) => {
        // Of a long ascending column the ends suffice, unless gaps or logarithms hide them.
        const needsAll = !one.ordered || this.x.logarithmic;
        return needsAll ? rangeOf(one.x, this.x.logarithmic) : [one.x[0], one.x[one.x.length - 1]];
      });
      const range = rangeOf(ends, this.x.logarithmic);
      const lines = columns.every((one) => one.lower || (one.ordered && ["line", "step"].includes(one.shape)));
      return lines ? range : padded(range, 0.03, this.x.logarithmic);
    }

    draw(width = Math.round(this.plot.clientWidth), heightShare = 1) {
      if (width < 50) return; // inside a closed part of the page
      this.width = width;
      const longest = Math.max(...this.panels.map((panel) => panel.prepare(this.view, heightShare)));
      const left = Math.round(longest * CHARACTER + 16);
      this.scale = makeScale(this.x.logarithmic, this.view, left, width - MARGIN_RIGHT);
      this.panels.forEach((panel) => panel.draw(width, left, this.scale));
      this.reset.hidden = this.view === this.whole;
      if (this.pointer) this.showCursor(this.pointer);
    }

    /** All values, of each series a column; series with the same x share it. */
    csv() {
      const sets = []; // { x, columns }
      const same = (a, b) => a === b || (a.length === b.length && a.every((value, i) => value === b[i]));
      const add = (x, name, values) => {
        let set = sets.find((one) => same(one.x, x));
        if (!set) sets.push((set = { x, columns: [[withUnit(this.x) || "x", x]] }));
        set.columns.push([name, values]);
      };
      for (const panel of this.panels) {
        const what = [panel.title || panel.y.label, panel.y.unit && `(${panel.y.unit})`].filter(Boolean).join(" ");
        for (const one of panel.series) add(one.x, `${what}: ${one.name}`, one.y);
        for (const band of panel.bands) {
          add(band.x, `${what}: ${band.name}, lower`, band.lower);
          add(band.x, `${what}: ${band.name}, upper`, band.upper);
        }
      }
      const columns = sets.flatMap((set) => set.columns);
      const length = Math.max(0, ...columns.map(([, values]) => values.length));
      const cell = (value) => (Number.isFinite(value) ? Number(value.toPrecision(9)) : "");
      const rows = Array.from({ length }, (_, row) => columns.map(([, values]) => cell(values[row])));
      return [columns.map(([name]) => name), ...rows];
    }

    drawForPrint() {
      const isColumn = this.plot.closest(".row")?.childElementCount > 1;
      this.draw(isColumn ? PRINT_COLUMN : PRINT_WIDTH, PRINT_HEIGHT);
    }

    /** The pointer keeps its pixel when the scale below it changes. */
    showCursor(pointer) {
      this.pointer = { ...pointer, value: this.scale.value(pointer.across) };
      this.panels.forEach((panel) => panel.showCursor(this.scale, this.pointer));
    }

    hideCursor() {
      this.pointer = undefined;
      this.panels.forEach((panel) => panel.hideCursor());
    }

    toggle(name) {
      if (!this.hidden.delete(name)) this.hidden.add(name);
      this.draw();
    }

    zoom(view) {
      const [low, high] = view;
      const smallest = 1e-9 * (Math.abs(low) + Math.abs(high)); // near what a number resolves
      if (!(high - low > smallest)) return;
      this.view = view;
      if (view === this.whole) this.panels.forEach((panel) => { panel.box = undefined; });
      this.draw();
    }

    /** Shifts and stretches the view, both as shares of its width. */
    move(shift, stretch) {
      const { left, right } = this.panels[0].frame;
      const width = right - left;
      const middle = (left + right) / 2 + shift * width;
      const half = (stretch * width) / 2;
      this.zoom([this.scale.value(middle - half), this.scale.value(middle + half)]);
    }

    key(event) {
      const moves = { "+": [0, 0.5], "-": [0, 2], ArrowLeft: [-0.25, 1], ArrowRight: [0.25, 1] };
      if (event.target !== this.plot) return;
      if (event.key === "0" || event.key === "Escape") this.zoom(this.whole);
      else if (moves[event.key]) this.move(...moves[event.key]);
      else return;
      event.preventDefault();
    }

    listen(panel) {
      const at = (event) => {
        const box = panel.svg.getBoundingClientRect();
        const across = event.clientX - box.left;
        const down = event.clientY - box.top - panel.headroom;
        return { panel, across, down };
      };
      const hide = () => this.hideCursor();
      let start = null;
      panel.svg.addEventListener("pointerdown", (event) => {
        if (event.button !== 0) return;
        start = { ...at(event), scale: this.scale };
        panel.svg.setPointerCapture(event.pointerId);
      });
      panel.svg.addEventListener("pointermove", (event) => {
        const here = at(event);
        if (start && event.shiftKey) {
          // The view follows the pointer on the scale it had at the start.
          const shift = start.across - here.across;
          const { left, right } = panel.frame;
          this.zoom([start.scale.value(left + shift), start.scale.value(right + shift)]);
          return;
        }
        this.showCursor(here);
        if (start) this.selected(start, here).forEach((one) => one.showSelection(start, here, this.isBox));
      });
      panel.svg.addEventListener("pointerup", (event) => {
        if (start && !event.shiftKey) this.choose(panel, start, at(event));
        start = null;
      });
      panel.svg.addEventListener("pointercancel", () => { start = null; hide(); });
      panel.svg.addEventListener("pointerleave", hide);
      panel.svg.addEventListener("dblclick", () => this.zoom(this.whole));
    }

    selected(start, here) {
      if (Math.abs(here.across - start.across) < CLICK) return [];
      return this.isBox ? [start.panel] : this.panels;
    }

    /** Zooms to what was dragged over. */
    choose(panel, start, end) {
      if (Math.abs(end.across - start.across) < CLICK) return;
      const { left, right, top, bottom } = panel.frame;
      const xs = [start.across, end.across].map((p) => clamp(p, left, right)).sort((a, b) => a - b);
      const ys = [start.down, end.down].map((p) => clamp(p, top, bottom)).sort((a, b) => b - a);
      if (this.isBox && ys[0] - ys[1] >= CLICK) panel.box = ys.map((p) => panel.yScale.value(p));
      this.zoom(xs.map((p) => this.scale.value(p)));
    }
  }

  // ---- saving -----------------------------------------------------------

  const SVG_STYLES = [
    "fill", "fill-opacity", "stroke", "stroke-width", "stroke-opacity", "stroke-dasharray", "stroke-linejoin",
    "stroke-linecap", "paint-order", "opacity", "font-family", "font-size", "font-weight", "text-anchor",
  ];
  const NOT_SAVED = ".tools, .hint, .reset, .overlay, output, script";

  /** Writes the style sheet's decisions into a copy of a drawing. */
  function inlined(original, copy) {
    const style = getComputedStyle(original);
    for (const name of SVG_STYLES) copy.setAttribute(name, style.getPropertyValue(name));
    [...original.children].forEach((child, i) => inlined(child, copy.children[i]));
  }

  const isVisible = (colour) => colour !== "transparent" && !/, 0\)$|\/ 0\)$/.test(colour);

  /** The words of a text, each where it stands. */
  function drawWords(node, style, origin, into) {
    const upright = !style.writingMode.startsWith("vertical");
    for (const match of node.data.matchAll(/\S+/g)) {
      const range = document.createRange();
      range.setStart(node, match.index);
      range.setEnd(node, match.index + match[0].length);
      const box = range.getBoundingClientRect();
      if (!box.width) continue;
      const size = parseFloat(style.fontSize);
      const [x, y] = upright
        ? [box.left - origin.left, (box.top + box.bottom) / 2 - origin.top + 0.35 * size]
        : [(box.left + box.right) / 2 - origin.left + 0.35 * size, box.bottom - origin.top];
      const place = upright ? { x, y } : { transform: `translate(${x} ${y}) rotate(-90)` };
      svg(into, "text", {
        ...place, fill: style.color, "font-size": style.fontSize,
        "font-weight": style.fontWeight, "font-family": style.fontFamily,
      }, match[0]);
    }
  }

  function drawBox(element, style, origin, into) {
    const box = element.getBoundingClientRect();
    const place = { x: box.left - origin.left, y: box.top - origin.top, width: box.width, height: box.height };
    const opacity = style.opacity;
    if (isVisible(style.backgroundColor)) svg(into, "rect", { ...place, fill: style.backgroundColor, opacity });
    const edge = (side, x) => {
      const width = parseFloat(style.getPropertyValue(`border-${side}-width`));
      const stroke = style.getPropertyValue(`border-${side}-color`);
      if (width > 0 && isVisible(stroke)) {
        svg(into, "path", { d: `M${x} ${place.y}V${place.y + place.height}`, stroke, "stroke-width": width });
      }
    };
    edge("left", place.x);
    edge("right", place.x + place.width);
    if (!element.classList.contains("whisker")) return;
    const middle = place.y + place.height / 2;
    svg(into, "path", { d: `M${place.x} ${middle}h${place.width}`, stroke: style.borderLeftColor, "stroke-width": 1.5 });
  }

  /** Draws an element of the page and all within it. */
  function drawElement(element, origin, into) {
    if (element.matches(NOT_SAVED) || !element.getClientRects().length) return;
    const style = getComputedStyle(element);
    if (element.namespaceURI === SVG) {
      const box = element.getBoundingClientRect();
      const copy = element.cloneNode(true);
      inlined(element, copy);
      copy.querySelectorAll(NOT_SAVED).forEach((one) => one.remove());
      const place = { x: box.left - origin.left, y: box.top - origin.top, width: box.width, height: box.height };
      for (const [name, value] of Object.entries(place)) copy.setAttribute(name, value);
      into.append(copy);
      return;
    }
    drawBox(element, style, origin, into);
    for (const child of element.childNodes) {
      if (child.nodeType === Node.TEXT_NODE) drawWords(child, style, origin, into);
      else if (child.nodeType === Node.ELEMENT_NODE) drawElement(child, origin, into);
    }
  }

  /** A figure as one drawing with its own colours, those of paper. */
  function picture(figure) {
    const root = document.documentElement;
    root.classList.add("paper");
    const origin = figure.getBoundingClientRect();
    const [width, height] = [Math.ceil(origin.width), Math.ceil(origin.height)];
    const drawing = document.createElementNS(SVG, "svg");
    for (const [name, value] of Object.entries({ width, height, viewBox: `0 0 ${width} ${height}` })) {
      drawing.setAttribute(name, value);
    }
    svg(drawing, "rect", { width, height, fill: getComputedStyle(document.body).backgroundColor });
    drawElement(figure, origin, drawing);
    root.classList.remove("paper");
    return { text: new XMLSerializer().serializeToString(drawing), width, height };
  }

  function save(blob, name) {
    const link = html("a");
    const address = URL.createObjectURL(blob);
    link.setAttribute("href", address);
    link.download = name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(address), 10000);
  }

  function savePng(figure, name) {
    const { text, width, height } = picture(figure);
    const image = new Image();
    image.addEventListener("load", () => {
      const canvas = html("canvas");
      canvas.width = PNG_SCALE * width;
      canvas.height = PNG_SCALE * height;
      canvas.getContext("2d").drawImage(image, 0, 0, canvas.width, canvas.height);
      canvas.toBlob((blob) => save(blob, name), "image/png");
    });
    image["src"] = `data:image/svg+xml;charset=utf-8,${encodeURIComponent(text)}`;
  }

  const csvText = (rows) => rows
    .map((row) => row.map((cell) => (/[",\n]/.test(cell) ? `"${String(cell).replaceAll('"', '""')}"` : cell)).join(","))
    .join("\n") + "\n";

  /** Bars: category, group, value. */
  function barsCsv(figure) {
    const groups = [...figure.querySelectorAll(".legend li")].map((entry) => entry.textContent);
    const rows = [...figure.querySelectorAll("tbody")].flatMap((body) => {
      const name = body.querySelector("th")?.textContent ?? "";
      const values = [...body.querySelectorAll("td.number")];
      return values.map((value, i) => [name, groups[i] ?? "", value.textContent.replaceAll("−", "-")]);
    });
    const axis = figure.querySelector("p.axis")?.textContent ?? "value";
    return [["", "", axis], ...rows];
  }

  const tableCsv = (figure) => [...figure.querySelectorAll("tr")]
    .map((row) => [...row.cells].map((cell) => cell.textContent.trim().replaceAll("−", "-")));

  /** The buttons below a figure. */
  function tools(figure, rows) {
    const bar = html("div", "tools");
    const caption = figure.querySelector("figcaption")?.textContent || "plot";
    const name = `${document.title} ${caption}`.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "");
    const button = (kind, title, act) => {
      const one = html("button", "", kind);
      one.type = "button";
      one.title = title;
      one.addEventListener("click", act);
      bar.append(one);
    };
    button("PNG", "save this plot as a picture", () => savePng(figure, `${name}.png`));
    button("SVG", "save this plot as a drawing", () => {
      save(new Blob([picture(figure).text], { type: "image/svg+xml" }), `${name}.svg`);
    });
    button("CSV", "save the values of this plot", () => save(new Blob([csvText(rows())], { type: "text/csv" }), `${name}.csv`));
    figure.append(bar);
  }

  // ---- the page ---------------------------------------------------------

  const figures = [...document.querySelectorAll("figure.chart")].map((one) => new Figure(one));
  document.querySelectorAll("figure.bars").forEach((one) => tools(one, () => barsCsv(one)));
  document.querySelectorAll("figure.matrix").forEach((one) => tools(one, () => tableCsv(one)));

  /** A link to a folded section opens it. */
  const unfold = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    const details = target?.querySelector(":scope > details");
    if (!details || details.open) return;
    details.open = true;
    target.scrollIntoView();
  };
  window.addEventListener("hashchange", unfold);
  unfold();

  // Paper is narrower than most windows and cannot open what is closed.
  let closed = [];
  window.addEventListener("beforeprint", () => {
    closed = [...document.querySelectorAll("details:not([open])")];
    closed.forEach((details) => { details.open = true; });
    figures.forEach((figure) => figure.drawForPrint());
  });
  window.addEventListener("afterprint", () => {
    closed.forEach((details) => { details.open = false; });
    figures.forEach((figure) => figure.draw());
  });
})();
