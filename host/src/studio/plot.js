"use strict";
// Curves on a canvas: a ring of samples, drawn as one vertical stroke from least to greatest in each column of pixels. The
// work of a picture depends on its width and on the new samples, not on the window and the rate of samples.

// Colours of the page, asked once: asking makes the browser compute styles, sixty times a second and curve.
const ink = new Map();
function colour(name) {
  let value = ink.get(name);
  if (value === undefined) { value = getComputedStyle(document.documentElement).getPropertyValue(name).trim(); ink.set(name, value); }
  return value;
}

// Longest time between two samples of a curve, s. Where it is longer, samples are missing: another order uses the line to the controller, or
// the line lost them. Nothing is drawn or read there. The controller sends a sample per millisecond, and the history keeps 10 values per second.
const GAP = 0.15;

class Ring {
  constructor(size, names) {
    this.size = size; this.length = 0; this.at = 0; this.pushed = 0; this.cleared = 0;
    this.columns = Object.fromEntries(names.map((n) => [n, new Float64Array(size)]));
    this.names = names;
  }
  push(batch, count) {
    for (const n of this.names) {
      const column = this.columns[n], values = batch[n];
      for (let i = 0, at = this.at; i < count; i++) { column[at] = values[i] ?? NaN; if (++at === this.size) at = 0; }
    }
    this.at = (this.at + count) % this.size; this.length = Math.min(this.size, this.length + count); this.pushed += count;
  }
  // What it holds now, for a picture that is held.
  copy() {
    const other = new Ring(this.size, this.names);
    for (const n of this.names) other.columns[n].set(this.columns[n]);
    return Object.assign(other, { length: this.length, at: this.at, pushed: this.pushed });
  }
  clear() { this.length = 0; this.at = 0; this.cleared++; }
  index(i) { return (this.at - this.length + i + this.size) % this.size; }
  get(name, i) { return this.columns[name][this.index(i)]; }
  last(name) { return this.length ? this.get(name, this.length - 1) : 0; }
  // First sample at or after a time: times rise.
  since(time) {
    let low = 0, high = this.length;
    while (low < high) { const mid = (low + high) >> 1; if (this.get("t", mid) < time) low = mid + 1; else high = mid; }
    return low;
  }
  // The sample that is drawn at a time: the first from it on, or the nearest one within a reach. None (-1) where no curve is drawn: before the
  // first sample, after the last one and in a gap.
  drawn(time, reach) {
    const next = this.since(time), before = next > 0 ? time - this.get("t", next - 1) : Infinity;
    const after = next < this.length ? this.get("t", next) - time : Infinity;
    if (before + after <= GAP || (after <= reach && after <= before)) return next;
    return before <= reach ? next - 1 : -1;
  }
}

// A ring's samples drawn together in stretches of time as long as one column of pixels: of each curve the least, the greatest, the
// first and the last. Only samples that are new are examined, so that a picture costs its width, not its window times the rate.
// A sample that is infinite is a reading that its sensor cannot give: on which side it left is kept, and nothing else. One that is not a
// number is none, and leaves a gap.
class Stretches {
  constructor(ring, names) { this.ring = ring; this.names = names; this.step = 0; this.room = 0; }
  // Takes in what came since the last time; restarts where the window, the width or the recording is another.
  follow(seconds, width) {
    const r = this.ring, step = seconds / width, room = width + 2;
    if (step !== this.step || room !== this.room || r.cleared !== this.cleared) {
      this.step = step; this.room = room; this.cleared = r.cleared; this.seen = r.pushed - r.length; this.newest = -1;
      this.number = new Float64Array(room).fill(-1);
      const parts = () => ({ least: new Float64Array(room), most: new Float64Array(room), first: new Float64Array(room), last: new Float64Array(room), left: new Int8Array(room) });
      this.curves = Object.fromEntries(this.names.map((n) => [n, parts()]));
    }
    const fresh = Math.min(r.pushed - this.seen, r.length), start = r.index(r.length - fresh), size = r.size, times = r.columns.t;
    for (let k = 0, i = start; k < fresh; k++) {
      const number = Math.floor(times[i] / step), slot = number % room, begins = this.number[slot] !== number;
      this.number[slot] = number; this.newest = number;
      for (const name in this.curves) {
        const c = this.curves[name], v = r.columns[name][i];
        if (begins) { c.least[slot] = Infinity; c.most[slot] = -Infinity; c.left[slot] = 0; }
        if (!(v >= c.least[slot] && v <= c.most[slot])) {
          if (Number.isNaN(v)) continue;
          if (!Number.isFinite(v)) { c.left[slot] = v > 0 ? 1 : -1; continue; }
          if (c.least[slot] > c.most[slot]) c.first[slot] = v;
          if (v < c.least[slot]) c.least[slot] = v;
          if (v > c.most[slot]) c.most[slot] = v;
        }
        c.last[slot] = v;
      }
      if (++i === size) i = 0;
    }
    this.seen = r.pushed;
  }
  // Calls with every stretch's slot and number from the oldest that is shown.
  each(call) {
    for (let number = Math.max(0, this.newest - this.room + 2); number <= this.newest; number++) {
      const slot = number % this.room;
      if (this.number[slot] === number) call(slot, number);
    }
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
    const left = LEFT, right = w - RIGHT, top = 6, bottom = h - 20;
    const X = (v) => left + ((v - x0) / (x1 - x0)) * (right - left), Y = (v) => bottom - ((v - y0) / (y1 - y0)) * (bottom - top);
    g.font = "11px system-ui, sans-serif"; g.lineWidth = 1; g.strokeStyle = colour("--grid"); g.fillStyle = colour("--quiet");
    g.textAlign = "right"; g.textBaseline = "middle";
    const ys = ticks(y0, y1, (bottom - top) / 40);
    const xs = ticks(x0, x1, (right - left) / 80);
    g.beginPath();
    for (const v of ys.values) { g.moveTo(left, Y(v)); g.lineTo(right, Y(v)); }
    for (const v of xs.values) { g.moveTo(X(v), top); g.lineTo(X(v), bottom); }
    g.stroke();
    for (const v of ys.values) g.fillText(v.toFixed(ys.digits), left - 5, Y(v));
    g.textAlign = "center"; g.textBaseline = "top";
    for (const v of xs.values) {
      // A label at the edge stays on the picture.
      const text = xText(v, xs.digits), half = g.measureText(text).width / 2;
      g.fillText(text, Math.min(X(v), w - half - 1), bottom + 4);
    }
    g.save(); g.beginPath(); g.rect(left, top, right - left, bottom - top); g.clip();
    this.map = { X, Y, left, right, top, bottom };
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

// Where a picture's data begin and end, beside its labels.
const LEFT = 46, RIGHT = 8;

// Curves over time. Where samples are missing, the curve has a gap. Where a reading left what its sensor can give, it has a gap, too, and the
// picture's edge a mark, on the side to which it left; the axis is set by the other readings.
class Scope {
  constructor(canvas, ring, curves, names = curves.map((c) => c[0])) { this.axes = new Axes(canvas); this.curves = curves; this.names = names; this.show(ring); }
  // Another ring from now on.
  show(ring) { this.ring = ring; this.stretches = new Stretches(ring, this.names); }
  // The newest samples by the quick way, which looks at each sample once; any other stretch of time from all that is in it.
  draw(view) {
    const [x0, x1] = view.range(), width = Math.max(1, this.axes.canvas.clientWidth - LEFT - RIGHT);
    this.from = x0; this.to = x1;
    let s = this.stretches;
    if (view.live) s.follow(view.seconds, width);
    else s = new Span(this.ring, past, this.names, x0, x1, width);
    this.lastDrawn = s;
    let low = Infinity, high = -Infinity;
    for (const [name] of this.curves) {
      const { least, most } = s.curves[name];
      s.each((slot) => { if (least[slot] < low) low = least[slot]; if (most[slot] > high) high = most[slot]; });
    }
    if (low > high) { low = 0; high = 1; }
    const { X, Y, top, bottom } = this.axes.begin(x0, x1, low, high, (v, d) => v.toFixed(d) + " s"), g = this.axes.g;
    this.left = 0;
    for (const [name, shade] of this.curves) {
      const { least, most, first, last, left } = s.curves[name];
      let previous = -Infinity;
      g.strokeStyle = colour(shade); g.lineWidth = 1.5; g.beginPath();
      s.each((slot, number) => {
        const x = X(number * s.step);
        if (left[slot]) { this.left = left[slot]; g.fillStyle = colour("--alarm"); g.fillRect(x - 0.5, left[slot] > 0 ? top : bottom - 5, 1.5, 5); }
        if (least[slot] > most[slot]) { previous = -Infinity; return; }
        if ((number - previous - 1) * s.step <= GAP) g.lineTo(x, Y(first[slot])); else g.moveTo(x, Y(first[slot]));
        previous = number;
        if (most[slot] > least[slot]) { g.lineTo(x, Y(most[slot])); g.lineTo(x, Y(least[slot])); g.lineTo(x, Y(last[slot])); }
      });
      g.stroke();
    }
    if (mark !== null && mark >= x0 && mark <= x1) {
      g.strokeStyle = colour("--s1"); g.lineWidth = 1; g.setLineDash([4, 3]); g.beginPath(); g.moveTo(X(mark), top); g.lineTo(X(mark), bottom); g.stroke(); g.setLineDash([]);
    }
    this.axes.end();
  }
}

// One quantity of a ring against another over the last seconds, where both are finite. Points are picked by their number since the beginning, not since the
// window's edge: else every picture would show others, and the curve would shimmer.
class Loop {
  constructor(canvas, ring, x, y, shade) { this.axes = new Axes(canvas); this.ring = ring; this.x = x; this.y = y; this.shade = shade; this.most = 2000; }
  show(ring) { this.ring = ring; }
  drawSpan(begins, ends) {
    const r = this.ring, xs = r.columns[this.x], ys = r.columns[this.y], from = r.since(begins), until = r.since(ends + 1e-6);
    const every = Math.max(1, Math.ceil((until - from) / this.most)), oldest = r.pushed - r.length;
    const begin = Math.ceil((oldest + from) / every) * every - oldest, start = r.index(begin), times = r.columns.t;
    // Time between two points where no sample is missing, and what counts as a gap.
    const usual = until > from + 1 ? every * (r.get("t", until - 1) - r.get("t", from)) / (until - 1 - from) : 0, apart = GAP + usual;
    let x0 = Infinity, x1 = -Infinity, y0 = Infinity, y1 = -Infinity;
    for (let k = begin, i = start; k < until; k += every) {
      const x = xs[i], y = ys[i];
      if (!Number.isFinite(x + y)) { i += every; if (i >= r.size) i -= r.size; continue; }
      if (x < x0) x0 = x; if (x > x1) x1 = x; if (y < y0) y0 = y; if (y > y1) y1 = y;
      i += every; if (i >= r.size) i -= r.size;
    }
    if (x0 > x1) { x0 = y0 = 0; x1 = y1 = 1; }
    const { X, Y } = this.axes.begin(x0, x1, y0, y1), g = this.axes.g;
    g.strokeStyle = colour(this.shade); g.lineWidth = 1.2; g.beginPath();
    for (let k = begin, i = start, previous = -Infinity; k < until; k += every) {
      if (!Number.isFinite(xs[i] + ys[i])) previous = -Infinity;
      else {
        if (times[i] - previous <= apart) g.lineTo(X(xs[i]), Y(ys[i])); else g.moveTo(X(xs[i]), Y(ys[i]));
        previous = times[i];
      }
      i += every; if (i >= r.size) i -= r.size;
    }
    g.stroke(); this.axes.end();
  }
}
