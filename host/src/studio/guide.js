"use strict";
// The guide of the first set-up: calibration of the sensors, limits, the pressure regulator, and what is still missing.

const GRAVITY = 9.80665;                // m/s², standard acceleration of free fall
const GUIDE = ["sensors", "limits", "regulator", "check"];
const ADVICE = {
  pressure: { zero: "Open the muscle to the air, so that its gauge pressure is 0.", two: "Apply two pressures that a reference gauge shows, over most of the sensor's range." },
  stroke: { zero: "Bring the muscle to its rest length: the stroke is 0 there.", two: "Bring the slide to two lengths that you measure, for example with a gauge block." },
  force: { zero: "Unhook the muscle, so that the load cell carries nothing.", two: "Apply two forces that a reference load cell shows.",
    weights: "Hang known weights on the load cell, none first, then at least two more over most of its range. The force is the mass times 9.80665 m/s²." },
};
const guided = { pairs: [], sensors: [] };

function showStep(step) {
  for (const name of GUIDE) {
    $("guide-" + name).hidden = name !== step;
    $("to-" + name).setAttribute("aria-current", name === step ? "step" : "false");
  }
  if (step === "limits") limitsForm();
  if (step === "check") checkList();
}

// Sensors.
const way = () => $("cal-way").value;
const mass = () => way() === "weights";
function ways() {
  const sensor = $("cal-sensor").value, advice = ADVICE[sensor] ?? { zero: "Apply the value 0 to the sensor.", two: "Apply two values that a reference shows." };
  const labels = { zero: "its zero only", two: "two known values", weights: "known weights" };
  const before = way();
  $("cal-way").replaceChildren(...Object.keys(advice).map((w) => new Option(labels[w], w)));
  if (advice[before]) $("cal-way").value = before;
  $("cal-advice").textContent = advice[way()];
  guided.pairs = way() === "zero" ? [0] : way() === "two" ? [0, ""] : [0, "", ""];
  guided.pairs = guided.pairs.map((value) => ({ value: String(value), signal: null, error: null }));
  showPairs();
}
function unitOfSensor() {
  const known = guided.sensors.find((s) => s.sensor === $("cal-sensor").value);
  return known ? known.unit : { stroke: "mm", force: "N" }[$("cal-sensor").value] ?? "kPa";
}
const valueOf = (pair) => (pair.value.trim() === "" ? NaN : Number(pair.value)) * (mass() ? GRAVITY : 1);
const measuredPairs = () => guided.pairs.filter((p) => p.signal !== null && Number.isFinite(valueOf(p)));
function showPairs() {
  $("cal-head").textContent = mass() ? "mass, kg" : `known value, ${unitOfSensor()}`;
  $("cal-rows").replaceChildren(...guided.pairs.map((pair, number) => {
    const row = document.createElement("tr"), input = document.createElement("input"), button = document.createElement("button");
    input.type = "number"; input.step = "any"; input.value = pair.value; input.setAttribute("aria-label", `known value ${number + 1}`);
    input.addEventListener("input", () => { pair.value = input.value; judgePairs(); });
    button.type = "button"; button.textContent = pair.signal === null ? "Measure" : "Again"; button.className = "small"; button.dataset.measure = number;
    button.addEventListener("click", () => measure(pair, button));
    const cell = (...inside) => { const td = document.createElement("td"); td.append(...inside); return td; };
    const error = pair.error === null ? "" : `${pair.error < 0 ? "−" : "+"}${Math.abs(pair.error).toPrecision(3)} ${unitOfSensor()}`;
    row.append(cell(input), cell(pair.signal === null ? "–" : pair.signal.toPrecision(5)), cell(error), cell(button));
    return row;
  }));
  judgePairs();
}
function judgePairs() {
  $("cal-write").disabled = !state.connected || measuredPairs().length < guided.pairs.length;
  $("cal-more").hidden = way() === "zero";
}
const wait = (ms) => new Promise((done) => setTimeout(done, ms));
// The mean over a second: the first order begins it, the second takes it.
async function signals() {
  if (await order("signals") === null) return null;
  await wait(1000);
  const answer = await order("signals");
  if (answer) guided.sensors = answer.sensors;
  return answer;
}
async function measure(pair, button) {
  button.disabled = true; button.textContent = "Measuring …";
  const answer = await signals(), found = answer?.sensors.find((s) => s.sensor === $("cal-sensor").value);
  if (found) pair.signal = found.signal;
  else if (answer) message("The board has no signal of this sensor.");
  await judgeScale();
}
async function calibrate(keep) {
  const pairs = measuredPairs();
  return order("calibrate", { sensor: $("cal-sensor").value, pairs: pairs.map((p) => [valueOf(p), p.signal]), keep });
}
const line = ([zero, slope], unit) => `${zero.toPrecision(6)} ${unit} + ${slope.toPrecision(6)} ${unit} × signal`;
async function judgeScale() {
  for (const pair of guided.pairs) pair.error = null;
  $("cal-result").hidden = true;
  if (measuredPairs().length === guided.pairs.length) {
    const found = await calibrate(false);
    if (found) {
      measuredPairs().forEach((pair, k) => { pair.error = found.errors[k]; });
      $("cal-result").hidden = false;
      $("cal-result").textContent = `before ${line(found.before, found.unit)}\nnow    ${line(found.now, found.unit)}`;
    }
  }
  showPairs();
}
$("cal-write").addEventListener("click", async () => {
  const found = await calibrate(true);
  if (!found) return;
  message(`The ${$("cal-sensor").value} sensor is calibrated: written and read back.`);
  for (const pair of guided.pairs) pair.signal = pair.error = null;
  $("cal-result").textContent = `now    ${line(found.now, found.unit)}\nwritten and read back`;
  showPairs();
});
$("cal-more").addEventListener("click", () => { guided.pairs.push({ value: "", signal: null, error: null }); showPairs(); });
$("cal-sensor").addEventListener("change", ways);
$("cal-way").addEventListener("change", ways);

// Limits.
const LIMITS = {
  "limits.pressure_pa": "No more than the muscle's bursting pressure allows; its description has max_pressure_kPa.",
  "limits.force_n": "Above the largest force that you want, below what the load cell and the frame bear.",
  "limits.stroke_max_m": "The stroke at the largest pressure without a load, with some reserve.",
  "limits.stroke_min_m": "Negative if the muscle can be stretched beyond its rest length.",
  "limits.speed_m_per_s": "A faster stroke than the muscle can make means that something broke.",
};
async function limitsForm() {
  const answer = await order("settings", { set: [] });
  if (!answer) return;
  const stored = new Map(leaves(answer.stored));
  $("limit-rows").replaceChildren(...Object.entries(LIMITS).map(([key, advice]) => {
    const label = document.createElement("label"), input = document.createElement("input"), why = document.createElement("span");
    input.type = "number"; input.step = "any"; input.required = true; input.value = asEntered(key, stored.get(key)); input.dataset.key = key; input.dataset.stored = input.value;
    why.textContent = advice;
    const name = key.split(".")[1].replace(/_(pa|n|m|m_per_s)$/, "").replaceAll("_", " ");
    label.append(`${name}, ${unitOf(key)[0]}`, input, why);
    return label;
  }));
}
$("limits-write").addEventListener("click", async () => {
  const inputs = [...$("limit-rows").querySelectorAll("input")];
  if (!inputs.length || inputs.some((i) => !i.checkValidity())) { message("Each limit needs a number."); return; }
  const set = inputs.filter((i) => i.value !== i.dataset.stored).map((i) => `${i.dataset.key}=${rounded(Number(i.value) / unitOf(i.dataset.key)[1])}`);
  if (!set.length) { message("Nothing changed."); return; }
  const answer = await order("settings", { set });
  if (answer) { message(`${counted(set.length, "limit")} written and read back`); limitsForm(); }
});

// Regulator.
$("reg-step").addEventListener("click", async () => {
  $("reg-step").disabled = true; $("reg-write").disabled = true; $("reg-result").hidden = false;
  $("reg-result").textContent = "The pressure is stepped for some ten seconds, then the muscle is vented. Curves stop meanwhile; Escape vents.";
  const found = await order("identify", { low: Number($("reg-low").value), high: Number($("reg-high").value) });
  $("reg-step").disabled = false; $("reg-write").disabled = !found;
  if (found) $("reg-result").textContent = found.text; else $("reg-result").hidden = true;
});
$("reg-write").addEventListener("click", async () => {
  const kept = await order("keep-regulator");
  if (kept) { message("The regulator is written and read back; from now on, its lag is compensated."); $("reg-write").disabled = true; }
});

// What is still as the firmware came.
async function checkList() {
  const answer = await order("settings", { set: [] });
  if (!answer) return;
  const stored = new Map(leaves(answer.stored)), differs = (begin) => leaves(answer.defaults).some(([key, value]) => key.startsWith(begin) && stored.get(key) !== value);
  const points = [
    ["pressure sensor calibrated", differs("scales.pressure.")], ["stroke sensor calibrated", differs("scales.stroke.")], ["load cell calibrated", differs("scales.force.")],
    ["limits set for this muscle", differs("limits.")], ["pressure regulator identified", differs("regulator.")],
  ];
  $("check-rows").replaceChildren(...points.map(([text, done]) => {
    const item = document.createElement("li");
    item.textContent = `${done ? "✓" : "–"} ${text}${done ? "" : ": not yet"}`; item.className = done ? "done" : "quiet";
    return item;
  }));
}
for (const name of GUIDE) $("to-" + name).addEventListener("click", () => showStep(name));
for (const button of document.querySelectorAll("#guide [data-next]")) button.addEventListener("click", () => showStep(button.dataset.next));
$("guide").addEventListener("toggle", () => { if ($("guide").open && !guided.pairs.length) { ways(); showStep("sensors"); } });
