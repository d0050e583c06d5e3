"use strict";
// Which stretch of time the pictures show: the newest seconds, or a stretch that was zoomed or moved to. One for all pictures over time.

const view = {
  end: null, // s, of a stretch that stays; null: the newest
  get seconds() { return Number($("window").value); },
  set seconds(to) {
    const seconds = Math.min(4 * 3600, Math.max(0.05, to)), own = $("window-own");
    own.value = String(seconds); own.textContent = `${seconds < 10 ? seconds.toFixed(2) : seconds.toFixed(0)} s`; own.hidden = false;
    $("window").value = own.value;
  },
  // From and to, s.
  range() {
    const seconds = this.seconds, end = this.end ?? Math.max(shown.last("t"), seconds);
    return [Math.max(0, end - seconds), Math.max(end, seconds)];
  },
  // Whether the quick way through the newest samples serves.
  get live() { return this.end === null && this.seconds <= 30; },
  moved() { $("newest").disabled = this.end === null; redraw(); },
  newest() { this.end = null; this.moved(); },
  // Zooms about a time; the newest sample stays at the edge where that is shown.
  zoom(factor, about) {
    const [from, to] = this.range(), seconds = Math.min(4 * 3600, Math.max(0.05, (to - from) * factor));
    if (this.end !== null) this.end = about + (to - about) * seconds / (to - from);
    this.seconds = seconds; this.moved();
  },
  pan(by) {
    const [, to] = this.range(), newest = shown.last("t");
    this.end = Math.min(to + by, newest);
    if (this.end >= newest && by > 0) this.end = null;
    else this.end = Math.max(this.end, this.seconds);
    this.moved();
  },
};

// Two cursors: the pointer, and a mark that a click sets. Between them time, frequency, and differences are read.
let mark = null;
const markTime = () => (mark === null ? NaN : mark);

// The pointer on a picture over time: reads, marks by a click, moves the picture by a drag, zooms with the wheel.
function steer(canvas) {
  const part = (event) => (event.offsetX - LEFT) / (canvas.clientWidth - LEFT - RIGHT);
  const time = (event) => { const [from, to] = view.range(); return from + part(event) * (to - from); };
  let begun = null;
  canvas.addEventListener("pointerdown", (event) => { begun = { x: event.offsetX, dragged: false }; canvas.setPointerCapture(event.pointerId); point(part(event)); });
  canvas.addEventListener("pointermove", (event) => {
    if (!begun) { point(part(event)); return; }
    const by = event.offsetX - begun.x;
    if (!begun.dragged && Math.abs(by) < 5) return;
    const [from, to] = view.range();
    begun.dragged = true; begun.x = event.offsetX;
    view.pan(-by * (to - from) / (canvas.clientWidth - LEFT - RIGHT));
    point(part(event));
  });
  canvas.addEventListener("pointerup", (event) => {
    if (begun && !begun.dragged && event.button === 0) {
      // A click on the mark takes it away.
      const [from, to] = view.range(), near = 6 * (to - from) / canvas.clientWidth, at = time(event);
      mark = mark !== null && Math.abs(mark - at) < near ? null : at;
      redraw();
    }
    begun = null;
  });
  canvas.addEventListener("pointercancel", () => { begun = null; });
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); view.zoom(Math.exp(event.deltaY * 0.002), time(event)); }, { passive: false });
  canvas.addEventListener("dblclick", () => { mark = null; view.newest(); });
  for (const left of ["pointerleave", "blur"]) canvas.addEventListener(left, () => point(null));
  canvas.addEventListener("keydown", (event) => {
    const seconds = view.seconds, step = event.shiftKey ? 0.1 : 0.01;
    const acts = {
      ArrowLeft: () => point((cursor ?? 1) - step), ArrowRight: () => point((cursor ?? 1) + step),
      "+": () => view.zoom(0.5, cursorTime()), "-": () => view.zoom(2, cursorTime()),
      PageUp: () => view.pan(-0.5 * seconds), PageDown: () => view.pan(0.5 * seconds), End: () => view.newest(),
      m: () => { mark = cursor === null ? null : cursorTime(); redraw(); },
    };
    const act = acts[event.key];
    if (!act) return;
    event.preventDefault(); event.stopPropagation(); act();
  });
}

// What is seen as a table of the recording format, so that every other command reads it: each sample where the ring still has it, else the
// middle of each tenth of a second.
function seenAsCsv() {
  const names = ["F", "P", "x", "c", "a", "m", "e", "d", "r", "v", "w"].filter((n) => SIGNALS[n]);
  const order = ["P", "x", "F", ...names.filter((n) => !"PxF".includes(n))];
  const [from, to] = view.range(), lines = ["time_s," + order.map((n) => SIGNALS[n].column).join(",")];
  const cell = (v) => (Number.isFinite(v) ? String(Math.round(v * 1e6) / 1e6) : "");
  if (shown.length && from >= shown.get("t", 0)) {
    for (let k = shown.since(from); k < shown.length && shown.get("t", k) <= to; k++) {
      const i = shown.index(k);
      lines.push(shown.columns.t[i].toFixed(6) + "," + order.map((n) => cell(shown.columns[n][i])).join(","));
    }
  } else {
    for (let number = Math.max(past.oldest, Math.ceil(from / past.step)); number <= Math.min(past.newest, to / past.step); number++) {
      const slot = number % past.room;
      if (past.number[slot] !== number) continue;
      lines.push(((number + 0.5) * past.step).toFixed(3) + "," + order.map((n) => cell((past.columns[n].least[slot] + past.columns[n].most[slot]) / 2)).join(","));
    }
  }
  return lines.join("\n") + "\n";
}

// All pictures over time below each other, on the page's own ground.
function seenAsPicture() {
  const canvases = [...document.querySelectorAll(".live canvas")].filter((c) => c.width), wide = Math.max(...canvases.map((c) => c.width));
  const scale = window.devicePixelRatio || 1, title = 20 * scale;
  const all = Object.assign(document.createElement("canvas"), { width: wide, height: canvases.reduce((sum, c) => sum + c.height + title, 0) });
  const g = all.getContext("2d");
  g.fillStyle = colour("--card"); g.fillRect(0, 0, all.width, all.height);
  let y = 0;
  for (const c of canvases) {
    g.fillStyle = colour("--ink"); g.font = `${12 * scale}px system-ui, sans-serif`;
    g.fillText(c.getAttribute("aria-label"), LEFT * scale, y + 14 * scale);
    g.drawImage(c, 0, y + title); y += c.height + title;
  }
  return all;
}

function save(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
