"use strict";
// The settings as a form: each with its unit, the firmware's default, and a mark where the entry differs from what the controller has stored.

// Unit of a setting by the end of its name, with the factor from the stored unit.
const UNITS = [
  ["_pa_per_n_s", "kPa/(N·s)", 1e-3], ["_pa_per_n", "kPa/N", 1e-3], ["_pa_per_s", "kPa/s", 1e-3], ["_nm_per_rad_s", "N·m/(rad·s)", 1], ["_nm_per_rad", "N·m/rad", 1],
  ["_nm_s_per_rad", "N·m·s/rad", 1], ["_n_s_per_m", "N·s/m", 1], ["_n_per_m_s", "N/(m·s)", 1], ["_n_per_m", "N/m", 1], ["_m_per_s", "mm/s", 1e3],
  ["_ticks", "ticks of 1 ms", 1], ["_pa", "kPa", 1e-3], ["_nm", "N·m", 1], ["_n", "N", 1], ["_m", "mm", 1e3], ["_s", "s", 1],
];
const SENSOR_UNITS = { pressure: ["kPa", 1e-3], stroke: ["mm", 1e3], force: ["N", 1] };
const CHOICES = { feed_forward: ["Table", "Gaylord", "Off"] };

function unitOf(key) {
  const [group, name] = key.split(".");
  if (SENSOR_UNITS[group] && ["low", "high", "jump"].includes(name)) return SENSOR_UNITS[group];
  const found = UNITS.find(([end]) => key.endsWith(end));
  return found ? [found[1], found[2]] : ["", 1];
}
function leaves(value, prefix = "") {
  return Object.entries(value).flatMap(([k, v]) => (v !== null && typeof v === "object" && !Array.isArray(v) ? leaves(v, prefix + k + ".") : [[prefix + k, v]]));
}
const rounded = (v) => Number(v.toPrecision(7));
const asEntered = (key, v) => (typeof v === "number" ? String(rounded(v * unitOf(key)[1])) : String(v));

let entries = [];

// What the form has that the controller does not, as KEY=VALUE in stored units.
function changedSettings() {
  return entries.filter((e) => e.value() !== e.stored).map((e) => {
    const number = typeof e.raw === "number", v = Number(e.value()) / unitOf(e.key)[1];
    return `${e.key}=${number ? rounded(v) : e.value()}`;
  });
}
function judgeEntries() {
  let changed = 0, wrong = 0;
  for (const e of entries) {
    const differs = e.value() !== e.stored, bad = !e.input.checkValidity();
    e.row.classList.toggle("changed", differs); e.row.classList.toggle("wrong", bad);
    changed += differs; wrong += bad;
  }
  $("set").disabled = !state.connected || !changed || wrong > 0;
  $("set").textContent = changed ? `Write ${counted(changed, "change")} and read back` : "Nothing changed";
}
function settingRow(key, value, preset) {
  const row = document.createElement("tr"), name = document.createElement("th"), cell = document.createElement("td"), unit = document.createElement("td"), note = document.createElement("td");
  const input = document.createElement(CHOICES[key] ? "select" : "input"), stored = asEntered(key, value);
  name.scope = "row"; name.textContent = key.split(".").at(-1).replace(/_(pa|n|m|nm|s|ticks|per|rad)(?=_|$)/g, "").replaceAll("_", " ");
  name.title = key;
  if (CHOICES[key]) { input.replaceChildren(...CHOICES[key].map((c) => new Option(c))); input.value = stored; }
  else if (typeof value === "boolean") { input.type = "checkbox"; input.checked = value; }
  else if (typeof value === "number") {
    input.type = "number"; input.value = stored; input.required = true;
    const whole = /_ticks$|_jumps$|^hold_on$/.test(key);
    input.step = whole ? "1" : "any"; if (whole) input.min = "0";
  } else input.value = stored;
  input.setAttribute("aria-label", key);
  unit.textContent = unitOf(key)[0]; unit.className = "quiet"; note.className = "quiet";
  const normal = asEntered(key, preset);
  note.textContent = normal === stored ? "" : `default ${normal}`;
  cell.append(input); row.append(name, cell, unit, note);
  const entry = { key, raw: value, stored, input, row, value: () => (typeof value === "boolean" ? String(input.checked) : input.value) };
  input.addEventListener("input", judgeEntries);
  return entry;
}
function showSettings({ stored, defaults }) {
  const presets = new Map(leaves(defaults)), body = $("settings-rows");
  body.replaceChildren(); entries = [];
  let group = null;
  for (const [key, value] of leaves(stored)) {
    const of = key.includes(".") ? key.slice(0, key.lastIndexOf(".")) : "general";
    if (of !== group) {
      group = of;
      const row = document.createElement("tr"), head = document.createElement("th");
      head.colSpan = 4; head.textContent = of.replaceAll("_", " "); head.className = "group"; row.append(head); body.append(row);
    }
    const entry = settingRow(key, value, presets.get(key));
    entries.push(entry); body.append(entry.row);
  }
  $("settings").hidden = false;
  judgeEntries();
}
const settings = async (set) => { const r = await order("settings", { set }); if (r) { showSettings(r); if (set.length) message("written and read back"); } };
$("set").addEventListener("click", () => settings(changedSettings()));
$("show").addEventListener("click", () => settings([]));
