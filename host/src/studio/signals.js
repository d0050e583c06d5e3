"use strict";
// Every signal that can be drawn: what the controller sends, and what is computed from it.

const SIGNALS = {
  F: { label: "force", unit: "N", digits: 1, column: "force_N" },
  P: { label: "pressure", unit: "kPa", digits: 1, column: "pressure_kPa" },
  x: { label: "stroke", unit: "mm", digits: 3, column: "displacement_mm" },
  c: { label: "pressure command", unit: "kPa", digits: 1, column: "pressure_command_kPa" },
  a: { label: "setpoint", unit: "", digits: 2, column: "setpoint" },
  m: { label: "force by the table", unit: "N", digits: 1, column: "table_N" },
  e: { label: "setpoint error", unit: "", digits: 2, column: "setpoint_error" },
  d: { label: "force minus table", unit: "N", digits: 2, column: "force_minus_table_N" },
  r: { label: "command minus pressure", unit: "kPa", digits: 1, column: "command_minus_pressure_kPa" },
  v: { label: "speed of stroke", unit: "mm/s", digits: 2, column: "speed_mm_per_s" },
  w: { label: "mechanical power", unit: "W", digits: 3, column: "power_W" },
};
const MEASURED = { force: "F", pressure: "P", stroke: "x" };

// A speed is the change of stroke over this time, s: as long as the noise of a reading matters.
const SPEED_OVER = 0.02;

// Adds the computed signals to a batch; the ring has the samples before it. A sample that is missing or out of range makes NaN.
function derive(m, ring) {
  const count = m.t.length, measured = m[MEASURED[m.mode]], number = (v) => (typeof v === "number" ? v : NaN);
  for (const name of ["e", "d", "r", "v", "w"]) m[name] = new Array(count);
  for (let i = 0, back = 0; i < count; i++) {
    m.e[i] = measured ? number(m.a[i]) - measured[i] : NaN;
    m.d[i] = m.F[i] - number(m.m[i]);
    m.r[i] = m.c[i] - m.P[i];
    while (back < i && m.t[i] - m.t[back + 1] >= SPEED_OVER) back++;
    let t0 = m.t[back], x0 = m.x[back];
    if (m.t[i] - t0 < SPEED_OVER && ring.length) {
      const k = Math.min(ring.since(m.t[i] - SPEED_OVER), ring.length - 1);
      t0 = ring.get("t", k); x0 = ring.get("x", k);
    }
    const over = m.t[i] - t0;
    m.v[i] = over > 0 && over < 10 * SPEED_OVER ? (m.x[i] - x0) / over : NaN;
    m.w[i] = m.F[i] * m.v[i] * 1e-3;
  }
}

// Amplitudes of the sines in a signal, in its unit, with a Hann window: over the newest power of two of samples. `null` where they are too
// few or not evenly spaced.
function spectrum(times, values) {
  let n = 1;
  while (2 * n <= values.length && 2 * n <= 8192) n *= 2;
  if (n < 64) return null;
  const from = values.length - n, step = (times[values.length - 1] - times[from]) / (n - 1);
  let mean = 0;
  for (let i = 0; i < n; i++) {
    if (!Number.isFinite(values[from + i])) return null;
    if (i && Math.abs(times[from + i] - times[from + i - 1] - step) > 0.5 * step) return null;
    mean += values[from + i] / n;
  }
  const re = new Float64Array(n), im = new Float64Array(n);
  for (let i = 0; i < n; i++) re[i] = (values[from + i] - mean) * (0.5 - 0.5 * Math.cos(2 * Math.PI * i / n));
  transform(re, im);
  // The mean of the window is a half, and a sine is one half in each of two frequencies.
  const amplitudes = new Float64Array(n / 2), frequencies = new Float64Array(n / 2);
  for (let k = 0; k < n / 2; k++) { amplitudes[k] = 4 * Math.hypot(re[k], im[k]) / n; frequencies[k] = k / (n * step); }
  return { amplitudes, frequencies, seconds: n * step };
}

// Fast Fourier transform in place, of a power of two of values (Cooley and Tukey, 1965).
function transform(re, im) {
  const n = re.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) { [re[i], re[j]] = [re[j], re[i]]; [im[i], im[j]] = [im[j], im[i]]; }
  }
  for (let size = 2; size <= n; size *= 2) {
    const angle = -2 * Math.PI / size;
    for (let k = 0; k < size / 2; k++) {
      const c = Math.cos(angle * k), s = Math.sin(angle * k);
      for (let i = k; i < n; i += size) {
        const j = i + size / 2, a = re[j] * c - im[j] * s, b = re[j] * s + im[j] * c;
        re[j] = re[i] - a; im[j] = im[i] - b; re[i] += a; im[i] += b;
      }
    }
  }
}
