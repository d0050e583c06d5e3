"use strict";
// Curves on a canvas: a ring of samples, drawn as one vertical stroke from least to greatest in each column of pixels, so that the
// work of a frame depends on its width and not on the rate of samples.

// Colours of the page, asked once: asking makes the browser compute styles, sixty times a second and curve.
const ink = new Map();
function colour(name) {
  let value = ink.get(name);
  if (value === undefined) { value = getComputedStyle(document.documentElement).getPropertyValue(name).trim(); ink.set(name, value); }
  return value;
}

class Ring {
  constructor(size, names) {
    this.size = size; this.length = 0; this.at = 0;
    this.columns = Object.fromEntries(names.map((n) => [n, new Float64Array(size)]));
    this.names = names;
  }
  push(batch, count) {
    for (let i = 0; i < count; i++) {
      for (const n of this.names) this.columns[n][this.at] = batch[n][i];
      this.at = (this.at + 1) % this.size;
      if (this.length < this.size) this.length++;
    }
  }
  clear() { this.length = 0; this.at = 0; }
  index(i) { return (this.at - this.length + i + this.size) % this.size; }
  get(name, i) { return this.columns[name][this.index(i)]; }
  last(name) { return this.length ? this.get(name, this.length - 1) : 0; }
  // First sample at or after a time: times rise.
  since(time) {
    let low = 0, high = this.length;
    while (low < high) { const mid = (low + high) >> 1; if (this.get("t", mid) < time) low = mid + 1; else high = mid; }
    return low;
  }
}

function ticks(low, high, room) {
  const rough = (high - low) / Math.max(2, room);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= rough) || power;
  const out = [];
  for (let v = Math.ceil(low / step) * step; v <= high + step * 1e-9; v += step) out.push(Math.abs(v) < step * 1e-6 ? 0 : v);
  return { values: out, digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)) };
}

class Axes {
  constructor(canvas) { this.canvas = canvas; this.g = canvas.getContext("2d"); }
  // Begins a picture with these ends; gives the maps from numbers to pixels.
  begin(x0, x1, y0, y1, xText = (v, d) => v.toFixed(d)) {
    const c = this.canvas, scale = window.devicePixelRatio || 1, w = c.clientWidth, h = c.clientHeight, g = this.g;
    if (c.width !== Math.round(w * scale) || c.height !== Math.round(h * scale)) { c.width = Math.round(w * scale); c.height = Math.round(h * scale); }
    g.setTransform(scale, 0, 0, scale, 0, 0);
    g.clearRect(0, 0, w, h);
    if (!(x1 > x0)) x1 = x0 + 1;
    if (!(y1 > y0)) { y0 -= 0.5; y1 = y0 + 1; }
    const pad = (y1 - y0) * 0.06; y0 -= pad; y1 += pad;
    const left = 46, right = w - 8, top = 6, bottom = h - 20;
    const X = (v) => left + ((v - x0) / (x1 - x0)) * (right - left), Y = (v) => bottom - ((v - y0) / (y1 - y0)) * (bottom - top);
    g.font = "11px system-ui, sans-serif"; g.lineWidth = 1; g.strokeStyle = colour("--grid"); g.fillStyle = colour("--quiet");
    g.textAlign = "right"; g.textBaseline = "middle";
    const ys = ticks(y0, y1, (bottom - top) / 40);
    for (const v of ys.values) { g.beginPath(); g.moveTo(left, Y(v)); g.lineTo(right, Y(v)); g.stroke(); g.fillText(v.toFixed(ys.digits), left - 5, Y(v)); }
    g.textAlign = "center"; g.textBaseline = "top";
    const xs = ticks(x0, x1, (right - left) / 80);
    for (const v of xs.values) {
      g.beginPath(); g.moveTo(X(v), top); g.lineTo(X(v), bottom); g.stroke();
      // A label at the edge stays on the picture.
      const text = xText(v, xs.digits), half = g.measureText(text).width / 2;
      g.fillText(text, Math.min(X(v), w - half - 1), bottom + 4);
    }
    g.save(); g.beginPath(); g.rect(left, top, right - left, bottom - top); g.clip();
    this.map = { X, Y, left, right };
    return this.map;
  }
  end() { this.g.restore(); }
  line(xs, ys, name, width = 1.6) {
    const { X, Y } = this.map, g = this.g; g.strokeStyle = name.startsWith("--") ? colour(name) : name; g.lineWidth = width; g.beginPath();
    for (let i = 0; i < xs.length; i++) i ? g.lineTo(X(xs[i]), Y(ys[i])) : g.moveTo(X(xs[i]), Y(ys[i]));
    g.stroke();
  }
  dots(xs, ys, name) {
    const { X, Y } = this.map, g = this.g; g.fillStyle = name.startsWith("--") ? colour(name) : name; g.globalAlpha = 0.45;
    for (let i = 0; i < xs.length; i++) g.fillRect(X(xs[i]) - 1, Y(ys[i]) - 1, 2, 2);
    g.globalAlpha = 1;
  }
}

function extent(...lists) {
  let low = Infinity, high = -Infinity;
  for (const l of lists) for (const v of l) if (Number.isFinite(v)) { if (v < low) low = v; if (v > high) high = v; }
  return low <= high ? [low, high] : [0, 1];
}

// Curves of a ring over the last seconds.
class Scope {
  constructor(canvas, ring, curves) { this.axes = new Axes(canvas); this.ring = ring; this.curves = curves; }
  draw(seconds) {
    const r = this.ring, size = r.size, end = r.last("t"), from = r.since(end - seconds), count = r.length - from, start = r.index(from);
    // Plain loops over the ring's own arrays: this runs over every sample of the window in every picture.
    let low = Infinity, high = -Infinity;
    for (const [name] of this.curves) {
      const values = r.columns[name];
      for (let k = 0, i = start; k < count; k++) { const v = values[i]; if (v < low) low = v; if (v > high) high = v; if (++i === size) i = 0; }
    }
    if (low > high) { low = 0; high = 1; }
    const x0 = Math.max(0, end - seconds), x1 = Math.max(end, seconds);
    const { Y, left, right } = this.axes.begin(x0, x1, low, high, (v, d) => v.toFixed(d) + " s");
    const g = this.axes.g, width = Math.max(1, Math.round(right - left)), scale = (right - left) / (x1 - x0), times = r.columns.t;
    for (const [name, shade] of this.curves) {
      const values = r.columns[name];
      g.strokeStyle = colour(shade); g.lineWidth = 1.5; g.beginPath();
      let column = -1, least = 0, most = 0, first = 0, last = 0, begun = false;
      const flush = () => {
        if (column < 0) return;
        const x = left + column;
        if (begun) g.lineTo(x, Y(first)); else { g.moveTo(x, Y(first)); begun = true; }
        if (most > least) { g.lineTo(x, Y(most)); g.lineTo(x, Y(least)); }
        g.lineTo(x, Y(last));
      };
      for (let k = 0, i = start; k < count; k++) {
        const v = values[i], c = Math.min(width, ((times[i] - x0) * scale) | 0);
        if (c !== column) { flush(); column = c; least = most = first = v; } else { if (v < least) least = v; if (v > most) most = v; }
        last = v;
        if (++i === size) i = 0;
      }
      flush(); g.stroke();
    }
    this.axes.end();
  }
}
