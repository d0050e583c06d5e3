"use strict";
const $ = (id) => document.getElementById(id);

// The token goes from the address into this page's memory, so that it is in no history and no screenshot.
const token = new URLSearchParams(location.search).get("token") || sessionStorage.getItem("token") || "";
sessionStorage.setItem("token", token);
history.replaceState(null, "", location.pathname);

let hideMessage = 0, failed = false;
function message(text) {
  $("message").textContent = text; $("message").hidden = false;
  clearTimeout(hideMessage); hideMessage = setTimeout(() => { $("message").hidden = true; }, 9000);
}

async function send(path, body) {
  let response;
  try { response = await fetch(path, { method: "POST", headers: { "x-studio-token": token }, body }); }
  catch { message("The program on this machine does not answer. Is `host studio` still running?"); return null; }
  let value = null;
  try { value = await response.json(); } catch { /* a refusal is plain text */ }
  // What went wrong before is over once something succeeds.
  if (response.ok) { if (failed) $("message").hidden = true; failed = false; return value === null ? true : value; }
  failed = true;
  message(value ? value.error + (value.at ? "\nat " + value.at : "") + (value.help ? "\n→ " + value.help : "") : "refused");
  return null;
}
const counted = (number, one) => `${number} ${one}${number === 1 ? "" : "s"}`;
const order = (what, more = {}) => send("/api/order", JSON.stringify({ do: what, ...more }));

// Live.
const ring = new Ring(40000, ["t", ...Object.keys(SIGNALS)]);
const past = new Past(Object.keys(SIGNALS));
const scopes = [
  new Scope($("p-force"), ring, [["m", "--s2"], ["a", "--s1"], ["F", "--s0"]]),
  new Scope($("p-pressure"), ring, [["c", "--s1"], ["P", "--s0"]], ["a", "c", "P"]),
  new Scope($("p-stroke"), ring, [["x", "--s0"]], ["a", "x"]),
];
const loop = new Loop($("p-loop"), ring, "x", "F", "--s0");
// What the pictures show: the ring, or what it held when they were held.
// Whether the present recording began with a run, to end with it, or by hand.
let ownRecording = false, handRecording = false;
let shown = ring, fresh = false, mode = "", samples = 0, state = {};

// How long the last pictures took to draw and how far apart they were, in ms: rings again, so that they cannot grow.
const perf = { frames: 0, draw: new Float64Array(512), gap: new Float64Array(512), last: 0 };

// Pictures are at least this far apart, ms: more than about thirty per second cannot be seen, and where the processor paints they would take
// the time that the next one needs. Less than two frames of a screen of 60 Hz, so that every second one of these is drawn.
const APART = 24;

// A picture of minutes changes slowly and is drawn from more samples; one that stays where it was moved to is drawn when it is moved.
function frame(now) {
  requestAnimationFrame(frame);
  if (!fresh || shown !== ring || view.end !== null || now - perf.last < (view.live ? APART : 10 * APART)) return;
  const begun = performance.now();
  draw();
  perf.draw[perf.frames % perf.draw.length] = performance.now() - begun;
  perf.gap[perf.frames % perf.gap.length] = now - perf.last;
  perf.frames++; perf.last = now;
}
function draw() {
  fresh = false;
  const [from, to] = view.range();
  scopes[0].curves = mode === "force" ? [["m", "--s2"], ["a", "--s1"], ["F", "--s0"]] : [["m", "--s2"], ["F", "--s0"]];
  scopes[1].curves = mode === "pressure" ? [["a", "--s2"], ["c", "--s1"], ["P", "--s0"]] : [["c", "--s1"], ["P", "--s0"]];
  scopes[2].curves = mode === "stroke" ? [["a", "--s1"], ["x", "--s0"]] : [["x", "--s0"]];
  for (const s of scopes) s.draw(view);
  scopes.forEach((s, i) => { const [text, name] = outside[i]; $(text).hidden = !s.left; if (s.left) $(text).textContent = unbelievable[name]; });
  loop.drawSpan(from, to);
  drawPanels(from, to, !view.live);
}
requestAnimationFrame(frame);

// Pictures that are drawn once are drawn again when the page's size or its colours change.
const stills = new Map();
function picture(canvas, paint) { stills.set(canvas, paint); paint(new Axes($(canvas))); }
function redraw() { ink.clear(); fresh = ring.length > 0; if (shown !== ring || view.end !== null) draw(); point(cursor); for (const [canvas, paint] of stills) paint(new Axes($(canvas))); }
addEventListener("resize", redraw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);

// Readings that a sensor cannot give, by its settings: what they were, for the picture that leaves them out.
const outside = [["out-force", "F"], ["out-pressure", "P"], ["out-stroke", "x"]], unbelievable = {};
function disbelieve(m) {
  for (const name in state.credible || {}) {
    const [low, high, unit] = state.credible[name], column = m[name];
    for (let i = 0; i < column.length; i++) {
      const v = column[i];
      if (v >= low && v <= high) continue;
      unbelievable[name] = `out of range: the sensor reads ${v} ${unit}, and can read ${low} to ${high}; not drawn`;
      column[i] = v < low ? -Infinity : Infinity;
    }
  }
}

// One message of the stream.
function take(m) {
  if (m.k === "t") {
    disbelieve(m);
    if (ring.length && m.t[0] < ring.last("t")) { ring.clear(); past.clear(); mark = null; view.end = null; }
    derive(m, ring);
    ring.push(m, m.t.length); past.push(m, m.t.length); samples += m.t.length; mode = m.mode; fresh = true;
  } else if (m.k === "s") show(m);
  else if (m.k === "c") { $("changed").textContent = m.text; $("changed").classList.toggle("alarm", m.changed); }
  else if (m.k === "e") message(m.text + (m.help ? "\n→ " + m.help : ""));
}

// Where in the pictures over time values are read, as a part of their width: where the pointer is, or by the arrow keys.
let cursor = null;
const cursorTime = () => scopes[0].from + cursor * (scopes[0].to - scopes[0].from);
// The sample that is drawn within a pixel of a time; none (-1) where nothing is drawn.
function drawnAt(time) {
  const { from, to, axes: { canvas } } = scopes[0], pixel = (to - from) / (canvas.clientWidth - LEFT - RIGHT);
  return shown.drawn(time, pixel);
}

// Behind each curve's name its value there, as often as a user can read it; the setpoint belongs to one of the pictures.
const DECIMALS = { F: 1, m: 1, P: 1, c: 1, x: 2, a: 1 };
const keys = [...document.querySelectorAll("[data-of]")].map((place) => ({ place, word: place.textContent, ...place.dataset }));
function readings() {
  // Without a cursor, the newest sample is read.
  const at = cursor === null ? shown.length - 1 : drawnAt(cursorTime()), from = markTime(), apart = cursorTime() - from;
  const marked = mark === null ? -1 : drawnAt(mark);
  $("cursor-time").textContent = cursor === null ? (mark === null ? "" : `mark at ${from.toFixed(3)} s`)
    : `at ${cursorTime().toFixed(3)} s` + (mark === null ? "" : `, ${apart.toFixed(3)} s from the mark (${(1 / Math.abs(apart)).toPrecision(3)} Hz)`);
  for (const k of keys) {
    const value = at < 0 ? NaN : shown.get(k.of, at), digits = k.mode === "stroke" ? 2 : DECIMALS[k.of];
    k.place.hidden = k.mode !== undefined && k.mode !== mode;
    const change = cursor !== null && marked >= 0 ? value - shown.get(k.of, marked) : NaN;
    k.place.textContent = !Number.isFinite(value) ? k.word
      : `${k.word} ${value.toFixed(digits).replace(/^-(0\.?0*)$/, "$1")}` + (Number.isFinite(change) ? ` (${change < 0 ? "−" : "+"}${Math.abs(change).toFixed(digits)})` : "");
  }
}
readings();
setInterval(readings, 250);

function point(to) {
  cursor = to === null || !shown.length ? null : Math.min(1, Math.max(0, to));
  readings();
  for (const { axes: { canvas } } of scopes) {
    const line = canvas.nextElementSibling, values = [...canvas.closest("figure").querySelectorAll(".key:not([hidden])")];
    line.hidden = cursor === null;
    line.style.left = `${LEFT + cursor * (canvas.clientWidth - LEFT - RIGHT)}px`;
    canvas.setAttribute("aria-valuenow", cursor === null ? 100 : Math.round(100 * cursor));
    canvas.setAttribute("aria-valuetext", [$("cursor-time").textContent, ...values.map((v) => v.textContent)].join(" "));
  }
}
for (const { axes: { canvas } } of scopes) steer(canvas);
point(null);

setInterval(() => { $("rate").textContent = state.connected ? `${samples} samples/s, ${state.lost || 0} lost` : ""; samples = 0; }, 1000);

function show(s) {
  state = s;
  // Samples from before the start may still say that it is armed.
  if (!s.connected) ownRecording = handRecording = false;
  else if (["disarmed", "fault"].includes(s.state)) endOwnRecording();
  const running = s.state === "running" ? `running, ${s.mode}` : s.state;
  $("state").textContent = s.connected ? running : "not connected";
  $("state").className = "state " + (s.connected ? s.state : "");
  $("device").textContent = s.connected ? `${s.board}${s.emulated ? ", emulated in " + s.emulated.replace("in ", "") : ""}, release ${s.release}, ${s.port}` : "";
  $("fault").hidden = !(s.connected && s.fault); $("fault-text").textContent = s.fault || "";
  const on = (id, yes) => { $(id).disabled = !yes; };
  on("disconnect", s.connected); on("arm", s.state === "disarmed"); on("follow", s.state === "armed" || s.state === "running");
  $("mishap-label").hidden = !s.emulated;
  on("record", s.connected); on("mishap", !!s.emulated); on("show", s.connected); if (!s.connected) on("set", false); on("difference", s.connected);
  if (!s.connected) on("flash", false);
  $("record").firstChild.textContent = s.recording === null || s.recording === undefined ? "Record " : `Stop (${counted(s.recording, "row")}) `;
}
show({ connected: false });

async function listen() {
  for (;;) {
    try {
      const response = await fetch("/api/stream", { headers: { "x-studio-token": token } });
      if (!response.ok) { message("The token is old: open the address that `host studio` printed."); return; }
      const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
      for (let rest = ""; ;) {
        const { value, done } = await reader.read();
        if (done) break;
        const lines = (rest + value).split("\n"); rest = lines.pop();
        for (const line of lines) take(JSON.parse(line));
      }
    } catch { /* the connection broke: try again */ }
    show({ connected: false });
    await new Promise((go) => setTimeout(go, 1000));
  }
}
listen();

// Controller.
// Vents have a port of their own, whose requests no other request of this page or of another one can hold up; where it cannot be
// reached, as through a tunnel, or does not answer immediately, they go with the others, too.
let ventPath = null;
order("vent-path").then((path) => { ventPath = path; });
async function vent() {
  if (!ventPath) return order("vent");
  const pause = new AbortController(), timer = setTimeout(() => pause.abort(), 200);
  try {
    const response = await fetch(ventPath.address, { method: "POST", body: ventPath.token, signal: pause.signal });
    if (response.ok) return true;
    const value = await response.json();
    message(value.error + (value.help ? "\n→ " + value.help : ""));
    return null;
  } catch { return order("vent"); } finally { clearTimeout(timer); }
}
const click = (id, act) => $(id).addEventListener("click", act);
click("vent", vent);
// The difference that was shown is that of another table, or to another device: what is sent must have been seen.
let compared = "";
const unseen = () => { $("flash").disabled = true; $("difference-text").hidden = true; };
click("connect", () => { unseen(); return order("connect", { port: $("port").value }); });
click("disconnect", () => order("disconnect"));
click("emulate", async () => { unseen(); message("starting …"); const r = await order("emulate", { muscle: $("bench").value }); if (r) message("connected: " + r.controller); });
$("mishap").addEventListener("change", () => order("mishap", { code: Number($("mishap").value) }));
click("arm", () => order("arm"));
click("follow", async () => {
  // Each run is recorded unless that is switched off; a recording that was begun by hand continues.
  if ($("record-runs").checked && !handRecording && typeof state.recording !== "number") ownRecording = (await order("record")) !== null;
  const followed = await order("follow", { quantity: $("quantity").value, profile: $("profile").value });
  if (followed) keepProfile($("profile").value); else endOwnRecording();
});
async function endOwnRecording() {
  if (!ownRecording) return;
  ownRecording = false;
  const r = await order("end-record");
  if (r) recordings(r);
}
click("record", async () => {
  ownRecording = false; handRecording = typeof state.recording !== "number";
  if (!handRecording) { const r = await order("end-record"); if (r) recordings(r); } else order("record");
});
click("clear", () => order("clear"));
click("hold", () => {
  shown = shown === ring ? ring.copy() : ring;
  for (const picture of [...scopes, loop, ...panels.map((p) => p.scope)]) picture.show(shown);
  $("hold").firstChild.textContent = shown === ring ? "Hold picture " : "Go on ";
  redraw();
});
$("window").addEventListener("change", () => view.moved());
click("newest", () => view.newest());
click("zoom-in", () => view.zoom(0.5, view.range()[1]));
click("zoom-out", () => view.zoom(2, view.range()[1]));
click("earlier", () => view.pan(-0.5 * view.seconds));
click("later", () => view.pan(0.5 * view.seconds));
click("add", () => addPanel());
click("save-csv", () => save(new Blob([seenAsCsv()], { type: "text/csv" }), "seen.csv"));
click("save-png", () => seenAsPicture().toBlob((blob) => save(blob, "seen.png")));
$("watch").addEventListener("change", async () => {
  const reference = $("watch").value, ordered = await order("watch", { reference });
  if (!ordered) $("watch").value = "nothing";
  $("changed").hidden = !ordered || reference === "nothing";
  $("changed").classList.remove("alarm"); $("changed").textContent = "no comparison yet: 25 s of motion under pressure are needed";
});
document.addEventListener("keydown", (event) => {
  // Escape vents wherever the cursor is; letters only where nothing is being written.
  if (event.key === "Escape") { event.preventDefault(); vent(); return; }
  if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|TEXTAREA|SELECT)$/.test(event.target.tagName)) return;
  const button = { v: "vent", a: "arm", f: "follow", r: "record", h: "hold" }[event.key.toLowerCase()];
  if (button && !$(button).disabled) $(button).click();
});

// Recordings.
function recordings(r) {
  $("list").replaceChildren(...r.recordings.map((name, number) => {
    const item = document.createElement("li"), button = document.createElement("button");
    button.type = "button"; button.textContent = name; button.addEventListener("click", () => showRecording(number)); item.append(button); return item;
  }));
  for (const id of ["a", "b"]) $(id).replaceChildren(...r.recordings.map((name, number) => new Option(name, number)));
  if (r.recordings.length > 1) $("b").value = "1";
  if (r.muscle) $("muscle").value = r.muscle;
}
async function showRecording(number) {
  const r = await order("curves", { number });
  if (!r) return;
  $("view-figure").hidden = false; $("view-title").textContent = `${r.name}: ${counted(r.rows, "row")}, ${r.F ? "force (N)" : "pressure (kPa)"} over time (s)`;
  const y = r.F || r.P;
  picture("p-view", (axes) => { axes.begin(...extent(r.t), ...extent(y)); axes.line(r.t, y, "--s0", 1.2); axes.end(); });
}
async function compare() {
  const [a, b] = [Number($("a").value), Number($("b").value)];
  const r = await order("compare", { a, b });
  if (!r) return;
  text("comparison", r.text);
  const [one, other] = [await order("curves", { number: a }), await order("curves", { number: b })];
  if (!one || !other) return;
  const both = one.F && other.F ? "F" : "P";
  $("compare-figure").hidden = false;
  $("compare-title").replaceChildren(`${both === "F" ? "Force (N)" : "Pressure (kPa)"} over time (s). Where the curves part, the recordings differ. `,
    key("s0", "A: " + one.name), " ", key("s1", "B: " + other.name));
  picture("p-compare", (axes) => {
    axes.begin(...extent(one.t, other.t), ...extent(one[both], other[both]));
    axes.line(one.t, one[both], "--s0", 1.2); axes.line(other.t, other[both], "--s1", 1.2); axes.end();
  });
}
function key(name, what) { const span = document.createElement("span"); span.className = "key " + name; span.textContent = what; return span; }
$("files").addEventListener("change", async () => {
  for (const file of $("files").files) { const r = await send("/api/recording?name=" + encodeURIComponent(file.name), file); if (r) recordings(r); }
  $("files").value = "";
});
click("example", async () => { message("recording on the virtual bench …"); const r = await order("example", { muscle: $("bench").value }); if (r) { recordings(r); message(counted(r.recordings.length, "recording") + " loaded"); } });
const text = (id, value) => { $(id).hidden = false; $(id).textContent = value; };
const report = (id, address) => { $(id).hidden = false; $(id).firstChild.href = address; };
click("compare", compare);
click("fit", async () => {
  message("fitting …");
  unseen();
  const r = await order("fit", { muscle: $("muscle").value });
  if (!r) return;
  $("message").hidden = true; text("fit-text", r.text); report("fit-report", r.report); $("lines-figure").hidden = false;
  // From blue over red to orange: yellow and green would be too pale on white.
  const n = r.lines.length, hue = (i) => (220 + 170 * i / Math.max(1, n - 1)) % 360, shade = (i) => `hsl(${hue(i)} 70% ${colour("--depth")})`;
  $("lines-key").replaceChildren(...r.lines.map((l, i) => { const k = key("", l.kPa.toFixed(0) + " kPa"); k.style.color = `hsl(${hue(i)} 70% var(--depth))`; return k; }));
  picture("p-lines", (axes) => {
    axes.begin(...extent(...r.lines.map((l) => l.x)), ...extent(...r.lines.map((l) => l.F)));
    r.lines.forEach((l, i) => axes.dots(l.x, l.F, shade(i))); r.lines.forEach((l, i) => axes.line(l.mx, l.mF, shade(i), 1.6));
    axes.end();
  });
});
click("diagnose", async () => { message("diagnosing …"); const r = await order("diagnose", { muscle: $("muscle").value }); if (r) { $("message").hidden = true; text("diagnosis", r.text); report("diagnosis-report", r.report); } });
click("difference", async () => { const r = await order("difference"); if (r) { text("difference-text", r.text); compared = r.table; $("flash").disabled = false; } });
click("flash", async () => { const r = await order("flash", { table: compared }); if (r) { $("flash").disabled = true; message(`written and read back: ${r.bytes} bytes, check sum ${r.crc}`); } });
order("recordings").then((r) => { if (r) recordings(r); });
order("ports").then((r) => { if (Array.isArray(r)) $("ports").replaceChildren(...r.map((p) => new Option(p))); });
try { for (const [y, x] of JSON.parse(localStorage.getItem(CHOICE)) || []) addPanel(y, x); } catch { /* an older page's choice */ }
