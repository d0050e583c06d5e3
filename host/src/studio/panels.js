"use strict";
// Pictures that the user adds: any signal over time, against any other signal, or its spectrum. The choice is kept in the browser.

class Spectrum {
  constructor(canvas, ring, name) { this.axes = new Axes(canvas); this.ring = ring; this.name = name; this.peak = null; }
  show(ring) { this.ring = ring; }
  draw(from, to) {
    const r = this.ring, times = [], values = [];
    for (let k = r.since(from); k < r.length; k++) {
      const time = r.get("t", k);
      if (time > to) break;
      times.push(time); values.push(r.get(this.name, k));
    }
    const found = spectrum(times, values);
    this.peak = null;
    if (!found) { this.axes.begin(0, 1, 0, 1, (v) => v + " Hz"); this.axes.end(); return; }
    let most = 1;
    for (let k = 1; k < found.amplitudes.length; k++) if (found.amplitudes[k] > found.amplitudes[most]) most = k;
    this.peak = { frequency: found.frequencies[most], amplitude: found.amplitudes[most] };
    // Up to twenty times the largest line, so that it is not squeezed against the edge, and at least 20 Hz.
    const last = Math.min(found.frequencies.at(-1), Math.max(20, 20 * this.peak.frequency));
    const shown = found.frequencies.findIndex((f) => f > last), until = shown < 0 ? found.frequencies.length : shown;
    this.axes.begin(0, last, 0, found.amplitudes[most], (v, d) => v.toFixed(d) + " Hz");
    this.axes.line(found.frequencies.subarray(0, until), found.amplitudes.subarray(0, until), "--s0", 1.2);
    this.axes.end();
  }
}

const panels = [];
const CHOICE = "studio-pictures";

function keepPanels() { localStorage.setItem(CHOICE, JSON.stringify(panels.map((p) => [p.y.value, p.x.value]))); }

function addPanel(y = "e", x = "time") {
  const figure = document.createElement("figure"), caption = document.createElement("figcaption"), scope = document.createElement("div");
  const canvas = document.createElement("canvas"), line = document.createElement("i"), note = document.createElement("span"), away = document.createElement("button");
  const signals = () => Object.entries(SIGNALS).map(([id, s]) => new Option(s.label + (s.unit ? `, ${s.unit}` : ""), id));
  const panel = { figure, canvas, note, y: document.createElement("select"), x: document.createElement("select") };
  panel.y.replaceChildren(...signals());
  panel.x.replaceChildren(new Option("over time", "time"), new Option("spectrum", "spectrum"), ...Object.entries(SIGNALS).map(([id, s]) => new Option("against " + s.label, id)));
  panel.y.value = y; panel.x.value = x;
  panel.y.setAttribute("aria-label", "signal"); panel.x.setAttribute("aria-label", "shown as");
  scope.className = "scope"; line.className = "cursor"; line.hidden = true; note.className = "quiet";
  canvas.tabIndex = 0;
  away.type = "button"; away.textContent = "Remove"; away.className = "small";
  caption.className = "row"; caption.append(panel.y, panel.x, note, away);
  scope.append(canvas, line); figure.append(caption, scope);
  const choose = () => {
    const label = `${SIGNALS[panel.y.value].label} ${panel.x.selectedOptions[0].textContent}`;
    canvas.setAttribute("aria-label", label); canvas.setAttribute("role", "img");
    panel.scope = panel.x.value === "time" ? new Scope(canvas, shown, [[panel.y.value, "--s0"]])
      : panel.x.value === "spectrum" ? new Spectrum(canvas, shown, panel.y.value) : new Loop(canvas, shown, panel.x.value, panel.y.value, "--s0");
    panel.drawn = -Infinity;
    keepPanels(); redraw();
  };
  panel.y.addEventListener("change", choose); panel.x.addEventListener("change", choose);
  away.addEventListener("click", () => { panels.splice(panels.indexOf(panel), 1); figure.remove(); keepPanels(); });
  panels.push(panel);
  $("pictures").append(figure);
  steer(canvas);
  choose();
  return panel;
}

// Draws the pictures that were added; spectra a few times a second, since they read all samples that are seen.
function drawPanels(from, to, whole) {
  const now = performance.now();
  for (const p of panels) {
    if (p.scope instanceof Scope) p.scope.draw(view);
    else if (p.scope instanceof Loop) p.scope.drawSpan(from, to);
    else if (whole || now - p.drawn > 250) {
      p.drawn = now;
      p.scope.draw(from, to);
      const unit = SIGNALS[p.y.value].unit, peak = p.scope.peak;
      p.note.textContent = peak ? `largest ${peak.amplitude.toPrecision(3)} ${unit} at ${peak.frequency.toFixed(2)} Hz` : "needs 64 evenly spaced samples";
    }
  }
}
