"use strict";
// The setpoint profile as a form beside its text: each writes the other. Profiles that were followed are kept in the browser.

const SHAPES = {
  constant: { fields: [["value", "value", 50]], text: (v) => `${v.value}` },
  sine: { fields: [["mean", "mean", 45], ["amplitude", "amplitude", 20], ["frequency", "frequency, Hz", 0.5]] },
  steps: { fields: [["values", "values, with blanks", "35 45 55"], ["hold", "hold each, s", 1]], text: (v) => `steps ${v.values} hold=${v.hold}` },
  trapezoid: { fields: [["low", "low", 30], ["high", "high", 60], ["ramp", "ramp, s", 1], ["hold", "hold, s", 1]] },
  chirp: { fields: [["mean", "mean", 45], ["amplitude", "amplitude", 10], ["from", "from, Hz", 0.1], ["to", "to, Hz", 3], ["duration", "duration, s", 20]] },
};
const FOLLOWED = "studio-profiles";

function profileText(shape, values) {
  const own = SHAPES[shape].text;
  return own ? own(values) : [shape, ...SHAPES[shape].fields.map(([name]) => `${name}=${values[name]}`)].join(" ");
}

// The shape and values that a text means; null where the form cannot show it.
function profileOf(text) {
  const words = text.trim().split(/\s+/);
  if (words.length === 1 && words[0] !== "" && Number.isFinite(Number(words[0]))) return { shape: "constant", values: { value: words[0] } };
  const shape = words.shift();
  if (!SHAPES[shape] || shape === "constant") return null;
  const values = {}, bare = [];
  for (const word of words) { const [name, value] = word.split("="); if (value === undefined) bare.push(name); else values[name] = value; }
  if (shape === "steps") values.values = bare.join(" ");
  return SHAPES[shape].fields.every(([name]) => values[name] !== undefined && values[name] !== "") ? { shape, values } : null;
}

function fillForm(shape, values) {
  $("shape").value = shape;
  $("shape-fields").replaceChildren(...SHAPES[shape].fields.map(([name, label, preset]) => {
    const holder = document.createElement("label"), input = document.createElement("input");
    input.dataset.name = name; input.value = values?.[name] ?? preset; input.inputMode = name === "values" ? "text" : "decimal";
    if (name !== "values") { input.type = "number"; input.step = "any"; }
    holder.append(label + " ", input); return holder;
  }));
}
function formValues() { return Object.fromEntries([...$("shape-fields").querySelectorAll("input")].map((i) => [i.dataset.name, i.value.trim()])); }

$("shape").replaceChildren(...Object.keys(SHAPES).map((s) => new Option(s)));
$("shape").addEventListener("change", () => { fillForm($("shape").value); $("profile").value = profileText($("shape").value, formValues()); });
$("shape-fields").addEventListener("input", () => { $("profile").value = profileText($("shape").value, formValues()); });
function readProfile() { const found = profileOf($("profile").value); if (found) fillForm(found.shape, found.values); }
$("profile").addEventListener("input", readProfile);
readProfile();

const followed = () => { try { return JSON.parse(localStorage.getItem(FOLLOWED)) || []; } catch { return []; } };
function offerProfiles() {
  const own = followed().map((p) => new Option(p));
  const examples = ["50", "sine mean=45 amplitude=20 frequency=0.5", "steps 35 45 55 hold=1", "trapezoid low=30 high=60 ramp=1 hold=1", "chirp mean=45 amplitude=10 from=0.1 to=3 duration=20"];
  $("profiles").replaceChildren(...own, ...examples.filter((e) => !followed().includes(e)).map((e) => new Option(e)));
}
function keepProfile(text) { localStorage.setItem(FOLLOWED, JSON.stringify([text, ...followed().filter((p) => p !== text)].slice(0, 12))); offerProfiles(); }
offerProfiles();
