"use strict";
// What was measured long ago, as the least and the greatest value of each tenth of a second: four hours in a fixed amount of memory. The
// ring keeps every sample of the last 40 seconds; older pictures are drawn from here.

class Past {
  constructor(names, step = 0.1, room = 4 * 3600 / step) {
    this.names = names; this.step = step; this.room = room;
    const part = () => ({ least: new Float32Array(room), most: new Float32Array(room) });
    this.columns = Object.fromEntries(names.map((n) => [n, part()]));
    this.number = new Float64Array(room);
    this.clear();
  }
  clear() { this.number.fill(-1); this.newest = -1; this.oldest = -1; }
  // Takes in a batch: arrays by name, with the times under "t".
  push(batch, count) {
    for (let i = 0; i < count; i++) {
      const number = Math.floor(batch.t[i] / this.step), slot = number % this.room;
      if (this.number[slot] !== number) {
        this.number[slot] = number; this.newest = number;
        if (this.oldest < 0) this.oldest = number;
        for (const n of this.names) { const c = this.columns[n]; c.least[slot] = Infinity; c.most[slot] = -Infinity; }
      }
      for (const n of this.names) {
        const v = batch[n][i], c = this.columns[n];
        if (!Number.isFinite(v)) continue;
        if (v < c.least[slot]) c.least[slot] = v;
        if (v > c.most[slot]) c.most[slot] = v;
      }
    }
    this.oldest = Math.max(this.oldest, this.newest - this.room + 1);
  }
  // Time of the oldest value, s.
  begin() { return this.oldest < 0 ? Infinity : this.oldest * this.step; }
}

// The columns of pixels of any stretch of time, with the interface of Stretches: from the ring where it reaches back far enough, else from
// the history.
class Span {
  constructor(ring, history, names, from, to, width) {
    this.step = (to - from) / width; this.base = Math.floor(from / this.step); this.width = width;
    this.used = new Uint8Array(width + 2);
    const parts = () => ({ least: new Float64Array(width + 2).fill(Infinity), most: new Float64Array(width + 2).fill(-Infinity),
      first: new Float64Array(width + 2), last: new Float64Array(width + 2), left: new Int8Array(width + 2) });
    this.curves = Object.fromEntries(names.map((n) => [n, parts()]));
    this.fine = ring.length > 0 && (from >= ring.get("t", 0) || !(history.begin() < ring.get("t", 0)));
    if (this.fine) this.ofRing(ring, names, from, to); else this.ofHistory(history, names, from, to);
  }
  add(name, slot, least, most) {
    const c = this.curves[name];
    if (least === Infinity && most === Infinity) { c.left[slot] = 1; return; }
    if (least === -Infinity && most === -Infinity) { c.left[slot] = -1; return; }
    if (!(least <= most)) return;
    if (c.least[slot] > c.most[slot]) c.first[slot] = least;
    if (least < c.least[slot]) c.least[slot] = least;
    if (most > c.most[slot]) c.most[slot] = most;
    c.last[slot] = most;
  }
  ofRing(ring, names, from, to) {
    for (let k = ring.since(from); k < ring.length; k++) {
      const i = ring.index(k), time = ring.columns.t[i];
      if (time > to) break;
      const slot = Math.floor(time / this.step) - this.base;
      if (slot < 0 || slot >= this.used.length) continue;
      this.used[slot] = 1;
      for (const n of names) { const v = ring.columns[n][i]; this.add(n, slot, v, v); }
    }
  }
  ofHistory(history, names, from, to) {
    const first = Math.max(history.oldest, Math.floor(from / history.step)), last = Math.min(history.newest, Math.ceil(to / history.step));
    for (let number = first; number <= last; number++) {
      const place = number % history.room;
      if (history.number[place] !== number) continue;
      const slot = Math.floor(number * history.step / this.step) - this.base;
      if (slot < 0 || slot >= this.used.length) continue;
      this.used[slot] = 1;
      for (const n of names) { const c = history.columns[n]; if (c.least[place] <= c.most[place]) this.add(n, slot, c.least[place], c.most[place]); }
    }
  }
  each(call) { for (let slot = 0; slot < this.used.length; slot++) if (this.used[slot]) call(slot, this.base + slot); }
}
