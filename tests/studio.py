#!/usr/bin/env python3
"""Tests the page of `host studio` in headless Chromium, with the firmware in QEMU (or as a library, if there is no QEMU).

    python3 tests/studio.py [PROGRAM] [FOLDER FOR SCREENSHOTS]

Connect, load, fit, difference, flash, arm, follow, fault, clear, vent by key, compare, close the page; ten minutes of samples through
the page's own code, with the memory and the time for a picture bounded; and who may ask at all. With a folder, every view is
photographed in light and dark, wide and on a phone; with BOOK=overwrite the book's picture of the page is taken again. An hour of
live pictures is measured by tests/benchmarks/studio.py.
Needs chromium and chromedriver, nothing of Python beyond its own library.
"""

import json
import os
import signal
import sys
import time
import urllib.error
import urllib.request

from browser import HOPELESS, Browser, studio

PROGRAM = sys.argv[1] if len(sys.argv) > 1 else "target/debug/host"
SHOTS = sys.argv[2] if len(sys.argv) > 2 else None
BOOK_PICTURE = os.path.join(os.path.dirname(os.path.abspath(__file__)), "../docs/src/pictures/studio.webp")


COUNT = 0


def passed(what):
    global COUNT
    COUNT += 1
    print(f"test studio::{what} ... ok", flush=True)


# Ten minutes at 1 kHz, as the stream delivers them: batches of 33 samples, each parsed and stored, and drawn at intervals.
LONG = """
    const from = ring.last("t") + 1, batches = 18000, times = [], plain = [];
    // What a picture is measured by: ten times as many strokes as its curves have columns of pixels, and nothing else.
    const g = Object.assign(document.createElement("canvas"), {width: 1000, height: 200}).getContext("2d");
    const strokes = () => {
      for (let curve = 0; curve < 70; curve++) {
        g.beginPath();
        for (let x = 0; x < 1000; x++) { g.lineTo(x, 90); g.lineTo(x, 110); }
        g.stroke();
      }
      g.clearRect(0, 0, 1000, 200);
    };
    const quickest = (list) => list.sort((x, y) => x - y)[Math.floor(list.length / 10)];
    gc();
    const before = performance.memory.usedJSHeapSize;
    document.getElementById("window").value = "30";
    for (let b = 0; b < batches; b++) {
      const t = Array.from({length: 33}, (_, i) => from + (33 * b + i) * 1e-3);
      const of = (f) => t.map((x) => Math.round(1e3 * f(x)) / 1e3);
      take(JSON.parse(JSON.stringify({k: "t", t, F: of((x) => 45 + 20 * Math.sin(3 * x)), P: of((x) => 300 + 50 * Math.cos(x)),
        x: of(Math.sin), c: of(() => 300), m: of(Math.cos), a: of(() => 45), mode: "force"})));
      if (b > 1000 && b % 200 === 0) {
        const begun = performance.now();
        draw();
        const drawn = performance.now();
        strokes();
        times.push(drawn - begun); plain.push(performance.now() - drawn);
      }
    }
    document.getElementById("window").value = "10";
    gc();
    const grown = performance.memory.usedJSHeapSize - before;
    const kept = ring.length;
    ring.clear();
    return {grown, kept, picture: quickest(times), strokes: quickest(plain)};
"""


def ten_minutes(page):
    # The first pass allocates what is allocated once; the second one must not retain anything.
    page.js(LONG)
    found = page.js(LONG)
    assert found["grown"] < 1e6, f"ten minutes of samples leave {found['grown']} bytes behind"
    assert found["kept"] <= 40000, found
    # Other programs on a busy machine delay most pictures; the fastest tenth shows the cost of a picture, and of one with ten times
    # the strokes.
    ratio = found["picture"] / found["strokes"]
    assert ratio < 3, f"a picture of 30 s takes {found['picture']} ms, {ratio:.1f} times as long as ten times its strokes"
    passed(f"ten_minutes_of_samples_leave_nothing_behind ({found['grown'] / 1e3:.0f} kB, {found['picture']:.1f} ms a picture, {ratio:.2f} of ten times its strokes)")


def reads_where_one_points(page):
    value = "document.querySelector('[data-of=F]').textContent"
    # No sample arrives while the guide's own order has the controller: the picture must begin after that gap.
    page.until("""(() => { const from = ring.last("t") - Number(document.getElementById("window").value), k = ring.since(from);
      if (!k) return false;
      for (let i = k; i < ring.length; i++) if (ring.get("t", i) - ring.get("t", i - 1) > GAP) return false;
      return true; })()""", 240)
    page.click("hold")
    page.over("#p-force")
    # The middle of the picture from its geometry; the value there from a search of all samples.
    found = page.js("""const c = document.getElementById("p-force"), inner = c.clientWidth - LEFT - RIGHT, s = scopes[0];
      const time = s.from + (c.clientWidth / 2 - LEFT) / inner * (s.to - s.from), pixel = (s.to - s.from) / inner;
      const near = [...Array(shown.length).keys()].filter((i) => Math.abs(shown.get("t", i) - time) <= pixel).map((i) => "measured " + shown.get("F", i).toFixed(1));
      return {time, pixel, near, told: parseFloat(document.getElementById("cursor-time").textContent.slice(3)),
        line: getComputedStyle(c.nextElementSibling).display, text: c.getAttribute("aria-valuetext")}""")
    assert abs(found["told"] - found["time"]) <= found["pixel"] + 1e-3 and found["line"] != "none", found
    said = page.js("return " + value)
    assert said in found["near"] and said in found["text"], (said, found)
    time.sleep(0.6)
    assert page.js("return " + value) == said, "a held picture's value changes"
    # It still follows the colours of the system.
    picture = "document.getElementById('p-force').toDataURL()"
    light = page.js("return " + picture)
    page.cdp("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "dark"}])
    page.until(f"{picture} !== {json.dumps(light)}")
    page.cdp("Emulation.setEmulatedMedia", features=[])
    page.until(f"{picture} === {json.dumps(light)}")
    if SHOTS:
        page.shot(SHOTS, "cursor")
        page.over("h1")
        page.over("#p-force")
    page.js("document.getElementById('p-force').focus()")
    page.key("\ue012")
    page.until(f"parseFloat(document.getElementById('cursor-time').textContent.slice(3)) < {found['told']} - {found['pixel']}")
    page.js("document.activeElement.blur()")
    assert page.text("cursor-time") == "", page.text("cursor-time")
    # No value is shown where no curve is drawn: before the first sample, after the last one and where samples are missing.
    blank = page.js("""const read = (time) => { point((time - scopes[0].from) / (scopes[0].to - scopes[0].from)); return document.querySelector("[data-of=F]").textContent; };
      // How often a curve of this time is restarted, and whether anything is drawn there.
      const parts = () => { const g = scopes[0].axes.g, moved = g.moveTo; let n = 0; g.moveTo = function (x, y) { n++; return moved.call(this, x, y); }; scopes[0].draw(view); g.moveTo = moved; return n; };
      const end = shown.last("t"), whole = parts(), inside = read(end - 2);
      for (let k = 0; k < shown.length; k++) if (shown.get("t", k) <= end - 2) shown.columns.t[shown.index(k)] -= 1;
      scopes[0].show(shown);
      const found = {inside, gap: read(end - 2.5), edges: [read(end - 3.0), read(end - 1.99)], begins: parts() - whole};
      shown.length = 100; found.before = read(end - 4); found.last = read(end);
      scopes[0].to += 5; found.after = read(end + 4); point(null); return found""")
    assert blank["before"] == blank["after"] == blank["gap"] == "measured", blank
    assert all(v.startswith("measured ") for v in (blank["inside"], *blank["edges"], blank["last"])), blank
    # Measured, setpoint and table each restart once.
    assert blank["begins"] == 3, blank
    page.over("h1")
    page.click("hold")
    page.until(f"{value} !== {json.dumps(said)}")
    passed("reads_values_where_one_points_and_by_keys")


# Twenty minutes of samples, then what the pictures show of them. In one go, so that no sample of the controller falls between.
HISTORY = """
    const begin = ring.last("t") + 1, fed = (from, seconds, F) => {
      for (let b = 0; b < seconds * 10; b++) {
        const t = Array.from({length: 100}, (_, i) => from + (100 * b + i) * 1e-3);
        const of = (f) => t.map(f);
        take({k: "t", t, F: of(F), P: of(() => 300), x: of((x) => 2 * Math.abs(((x - begin) % 4) - 2)), c: of(() => 310), m: of(() => 40), a: of(() => 50), mode: "force"});
      }
    };
    const sine = (x) => 45 + 20 * Math.sin(2 * Math.PI * 5 * x);
    fed(begin, 1200, (x) => (x - begin < 600 ? 10 : sine(x)));
    const found = {}, end = ring.last("t");
    const least = (name) => { const s = scopes[0].lastDrawn; let low = Infinity; s.each((slot) => { low = Math.min(low, s.curves[name].least[slot]); }); return low; };
    document.getElementById("window").value = "1800"; view.moved(); draw();
    found.whole = [end - scopes[0].from, least("F")];
    view.zoom(60 / 1800, end); draw();
    found.minute = [scopes[0].to - scopes[0].from, least("F")];
    view.pan(-900); draw();
    found.earlier = [end - scopes[0].to, least("F"), document.getElementById("newest").disabled];
    const lines = seenAsCsv().trim().split("\\n");
    found.thinned = [lines.length - 1, lines[0]];
    const canvas = document.getElementById("p-force"), box = canvas.getBoundingClientRect();
    canvas.dispatchEvent(new WheelEvent("wheel", {deltaY: -300, clientX: box.left + box.width / 2, clientY: box.top + 50, bubbles: true, cancelable: true}));
    found.wheel = view.seconds;
    document.getElementById("newest").click(); document.getElementById("window").value = "10"; view.moved(); draw();
    found.newest = [end - scopes[0].to, view.live];
    mark = end - 1; cursor = 1; readings();
    found.measured = [document.getElementById("cursor-time").textContent, document.querySelector("[data-of=x]").textContent];
    mark = null; cursor = null;
    found.exact = seenAsCsv().trim().split("\\n").length - 1;
    const panel = addPanel("F", "spectrum"), speed = addPanel("v", "time"), against = addPanel("F", "x");
    draw();
    found.peak = [panel.scope.peak.frequency, panel.scope.peak.amplitude, panel.note.textContent];
    found.speed = ring.last("v"); found.error = ring.last("e"); found.gap = ring.last("r");
    found.kept = localStorage.getItem("studio-pictures");
    const picture = seenAsPicture(); found.picture = [picture.width, picture.height];
    return found;
"""


def shows_any_stretch_and_any_signal(page):
    found = page.js(HISTORY)
    # In the whole, the quiet minutes and what was before them are seen, too; in the last minute only the sine.
    assert found["whole"][0] > 1200 and found["whole"][1] < 10.01, found
    assert abs(found["minute"][0] - 60) < 0.01 and abs(found["minute"][1] - 25) < 0.5, found
    assert abs(found["earlier"][0] - 900) < 1 and abs(found["earlier"][1] - 10) < 0.01 and not found["earlier"][2], found
    assert 595 <= found["thinned"][0] <= 605 and found["thinned"][1].startswith("time_s,pressure_kPa,displacement_mm,force_N,"), found
    assert 25 < found["wheel"] < 45, found
    assert found["newest"] == [0, True] and 9990 <= found["exact"] <= 10001, found
    assert "1.000 s from the mark (1.00 Hz)" in found["measured"][0] and found["measured"][1].endswith("(+2.00)"), found
    frequency, amplitude, told = found["peak"]
    assert abs(frequency - 5) < 0.15 and abs(amplitude - 20) < 3 and "N at" in told, found
    # The stroke moves by 2 mm/s; the setpoint is 50 N, the command 10 kPa above the pressure.
    assert abs(found["speed"] - 2) < 0.01 and abs(found["gap"] - 10) < 1e-6, found
    assert found["kept"] == '[["F","spectrum"],["v","time"],["F","x"]]', found
    assert found["picture"][0] > 100 and found["picture"][1] > 700, found
    page.until("ring.length > 500")
    page.shot(SHOTS, "added")
    page.js("while (panels.length) panels[0].figure.querySelector('button').click()")
    assert page.js("return document.querySelectorAll('#pictures figure').length") == 0
    passed("shows_any_stretch_of_time_and_any_signal")


def drags(page):
    """The pointer itself: a drag moves in time, a click marks, a double click goes back."""
    page.until("ring.last('t') - ring.get('t', 0) > 12", 240)
    element = page.ask("POST", page.path + "/element", {"using": "css selector", "value": "#p-force"})

    def actions(*moves):
        page.ask("POST", page.path + "/actions", {"actions": [{"type": "pointer", "id": "p", "actions": list(moves)}]})

    at = lambda x: {"type": "pointerMove", "duration": 100, "x": x, "y": 0, "origin": element}
    down, up = {"type": "pointerDown", "button": 0}, {"type": "pointerUp", "button": 0}
    actions(at(-50), down, at(0), at(50), up)
    assert page.js("return view.end !== null && view.end < ring.last('t') && mark === null"), "a drag moves"
    actions(at(20), down, up)
    assert page.js("return mark !== null && mark > scopes[0].from && mark < scopes[0].to"), "a click marks"
    page.click("newest")
    page.js("mark = null; redraw()")
    page.over("h1")
    passed("is_moved_by_a_drag_and_marked_by_a_click")


def edits_settings_with_units(page):
    page.click("show")
    page.until("entries.length > 50")
    entry = "entries.find((e) => e.key === 'limits.pressure_pa')"
    shown = page.js(f"const e = {entry}; return [e.value(), e.row.children[2].textContent, document.getElementById('set').disabled]")
    assert shown[1] == "kPa" and 100 < float(shown[0]) < 2000 and shown[2], shown
    page.js(f"const e = {entry}; e.input.value = '555.5'; e.input.dispatchEvent(new Event('input'))")
    assert page.text("set") == "Write 1 change and read back" and page.js(f"return {entry}.row.classList.contains('changed')")
    page.js("document.getElementById('settings').closest('details').open = true")
    page.shot(SHOTS, "settings")
    page.click("set")
    page.until(f"{entry}.stored === '555.5'")
    note = page.js(f"return {entry}.row.children[3].textContent")
    assert note == f"default {shown[0]}", note
    page.js(f"const e = {entry}; e.input.value = ''; e.input.dispatchEvent(new Event('input'))")
    assert page.js("return document.getElementById('set').disabled"), "an empty entry can be written"
    page.js(f"const e = {entry}; e.input.value = '{shown[0]}'; e.input.dispatchEvent(new Event('input'))")
    page.click("set")
    page.until(f"{entry}.stored === '{shown[0]}'")
    page.js("document.getElementById('settings').closest('details').open = false")
    passed("edits_settings_with_units_and_marks_differences")


def follows_the_guide(page):
    """The first set-up: the stroke's zero, a limit, the regulator, and what is still missing."""
    page.js("const g = document.getElementById('guide'); g.open = true; g.scrollIntoView()")
    page.until("!document.getElementById('guide-sensors').hidden && guided.pairs.length === 1")
    page.js("const s = document.getElementById('cal-sensor'); s.value = 'force'; s.dispatchEvent(new Event('change'))")
    page.js("const s = document.getElementById('cal-way'); s.value = 'weights'; s.dispatchEvent(new Event('change'))")
    assert page.text("cal-head") == "mass, kg" and page.js("return guided.pairs.length") == 3
    page.shot(SHOTS, "guide-weights")
    # A second pressure at which the regulator holds the muscle would need an armed controller; the zero of the vented muscle does not.
    page.js("const s = document.getElementById('cal-sensor'); s.value = 'pressure'; s.dispatchEvent(new Event('change'))")
    page.js("const s = document.getElementById('cal-way'); s.value = 'zero'; s.dispatchEvent(new Event('change'))")
    assert page.js("return document.getElementById('cal-write').disabled"), "a scale without a measurement can be written"
    page.js("document.querySelector('[data-measure=\"0\"]').click()")
    page.until("!document.getElementById('cal-write').disabled && !document.getElementById('cal-result').hidden")
    assert "before" in page.text("cal-result") and "now" in page.text("cal-result"), page.text("cal-result")
    page.shot(SHOTS, "guide-sensors")
    page.click("cal-write")
    page.until("document.getElementById('cal-result').textContent.includes('read back')")
    page.click("to-limits")
    page.until("document.querySelectorAll('#limit-rows input').length === 5")
    page.js("const i = document.querySelector('[data-key=\"limits.pressure_pa\"]'); i.value = '640'; i.dispatchEvent(new Event('input'))")
    page.shot(SHOTS, "guide-limits")
    page.click("limits-write")
    page.until("document.querySelector('[data-key=\"limits.pressure_pa\"]')?.dataset.stored === '640'")
    page.click("to-regulator")
    page.click("reg-step")
    page.until("document.getElementById('reg-result').textContent.includes('gain')", 240)
    page.shot(SHOTS, "guide-regulator")
    page.click("reg-write")
    page.until("document.getElementById('message').textContent.includes('regulator is written')")
    page.click("to-check")
    page.until("document.querySelectorAll('#check-rows li').length === 5")
    told = page.text("check-rows")
    assert "✓ pressure sensor calibrated" in told and "✓ limits set" in told and "✓ pressure regulator" in told, told
    assert "load cell calibrated: not yet" in told, told
    page.shot(SHOTS, "guide-check")
    page.js("document.getElementById('guide').open = false")
    passed("leads_through_the_first_set_up")


def writes_profiles_by_a_form(page):
    page.js("const s = document.getElementById('shape'); s.value = 'steps'; s.dispatchEvent(new Event('change'))")
    assert page.js("return document.getElementById('profile').value") == "steps 35 45 55 hold=1"
    page.js("const i = document.querySelector('#shape-fields input[data-name=hold]'); i.value = '2.5'; i.dispatchEvent(new Event('input', {bubbles: true}))")
    assert page.js("return document.getElementById('profile').value") == "steps 35 45 55 hold=2.5"
    text = "sine mean=45 amplitude=20 frequency=0.5"
    page.js(f"const p = document.getElementById('profile'); p.value = '{text}'; p.dispatchEvent(new Event('input'))")
    found = page.js("return [document.getElementById('shape').value, formValues()]")
    assert found == ["sine", {"mean": "45", "amplitude": "20", "frequency": "0.5"}], found
    passed("writes_setpoint_profiles_by_a_form")


def report_is_read(driver, url):
    """A report, which is one file for itself: values under the pointer, layers on and off, buttons on a phone."""
    page = Browser(driver, url, "1300,1000")
    read = """const place = [...document.querySelectorAll('figure .wide rect.read')][0], box = place.getBoundingClientRect();
      const at = (x, y) => place.dispatchEvent(new PointerEvent('pointermove', {clientX: box.left + x * box.width, clientY: box.top + y * box.height, bubbles: true}));
      const reading = document.getElementById('reading'), figure = place.closest('figure'), told = [];
      for (let i = 1; i < 20; i++) for (let j = 1; j < 20; j++) { at(i / 20, j / 20); told.push(reading.textContent); }
      return {told, hidden: reading.hidden, title: [place.dataset.xTitle, place.dataset.yTitle], rows: numbers(figure), layers: [...figure.querySelectorAll('.wide g.entry')].map((g) => g.dataset.layer)}"""
    found = page.js(read)
    assert not found["hidden"] and all(title in text for title in found["title"] for text in found["told"]), found["told"][0]
    # A value that is shown with the name of a layer is one of the numbers behind the picture.
    named = [text.split("\n") for text in found["told"] if text.count("\n") == 2]
    assert len(named) > 20, "no points are found"
    for layer, x, y in named:
        x, y = (float(text.rsplit(": ", 1)[1]) for text in (x, y) if " to " not in text) if " to " not in y else (None, None)
        close = lambda a, b: a is None or (b is not None and abs(a - b) <= 1e-3 * abs(b) + 1e-12)
        assert y is None or any(r["layer"] == layer and close(x, r["x"]) and close(y, r["y"]) for r in found["rows"]), (layer, x, y)
    hide = """const entry = [...document.querySelectorAll('figure .wide g.entry[role]')][0], name = entry.dataset.layer, figure = entry.closest('figure');
      const seen = () => [...figure.querySelectorAll('g.layer')].filter((g) => g.dataset.layer === name && getComputedStyle(g).display !== 'none').length;
      const before = seen(); entry.dispatchEvent(new MouseEvent('click', {bubbles: true}));
      const during = [seen(), entry.getAttribute('aria-pressed')]; entry.dispatchEvent(new KeyboardEvent('keydown', {key: 'Enter', bubbles: true}));
      return [before, during, seen()]"""
    before, during, after = page.js(hide)
    assert before > 0 and during == [0, "false"] and after == before, (before, during, after)
    page.shot(SHOTS, "report")
    page.cdp("Emulation.setDeviceMetricsOverride", width=390, height=844, deviceScaleFactor=2, mobile=True)
    phone = page.js("""const buttons = [...document.querySelectorAll('.save button')];
      return [document.documentElement.scrollWidth <= innerWidth, buttons.length, buttons.filter((b) => b.getBoundingClientRect().width > 10 && b.getBoundingClientRect().right <= innerWidth).length]""")
    assert phone[0] and phone[1] > 0 and phone[1] == phone[2], phone
    page.close()
    passed("reads_a_report_under_the_pointer_and_hides_layers")


def glimpse(url):
    """The state of the controller, queried without a page."""
    base, token = url.split("/?token=")
    request = urllib.request.Request(base + "/api/stream", headers={"x-studio-token": token})
    with urllib.request.urlopen(request, timeout=HOPELESS) as stream:
        return next(said["state"] for said in map(json.loads, stream) if said["k"] == "s")


def story(url, driver):
    page = Browser(driver, url, "1300,1000")
    page.state("disarmed")
    passed("connects_to_an_emulated_controller")
    ten_minutes(page)
    shows_any_stretch_and_any_signal(page)
    drags(page)
    edits_settings_with_units(page)
    writes_profiles_by_a_form(page)
    follows_the_guide(page)
    page.click("example")
    page.until("document.querySelectorAll('#list li').length == 6")
    page.click("fit")
    page.until("!document.getElementById('fit-text').hidden")
    assert "P0" in page.text("fit-text"), page.text("fit-text")
    assert "<svg" in page.js("""let r = new XMLHttpRequest(); r.open("GET", document.querySelector("#fit-report a").href, false); r.send();
        return r.status === 200 ? r.responseText : String(r.status)""")
    passed("fits_recordings")
    report_is_read(driver, url.split("/?")[0] + page.js("return document.querySelector('#fit-report a').getAttribute('href')"))
    page.click("difference")
    page.until("!document.getElementById('difference-text').hidden")
    assert "no table yet" in page.text("difference-text")
    page.click("flash")
    page.until("document.getElementById('message').textContent.includes('read back')")
    page.click("difference")
    page.until("!document.getElementById('flash').disabled")
    page.js("document.getElementById('fit-text').hidden = true")
    page.click("fit")
    page.until("!document.getElementById('fit-text').hidden")
    assert page.js("return document.getElementById('flash').disabled"), "a table is sent whose difference nobody has seen"
    passed("shows_the_difference_and_flashes")
    page.click("arm")
    page.state("armed")
    page.click("record")
    page.click("follow")
    page.state("running")
    page.until("state.recording > 1000")
    # The newest values follow the names of the curves, and the setpoint is shown at the controlled quantity.
    page.until("/^measured [0-9.]+$/.test(document.querySelector('[data-of=F]').textContent)")
    asked = page.js("return keys.filter((k) => k.of === 'a' && !k.place.hidden).map((k) => k.mode)")
    assert asked == ["force"], asked
    page.shot(SHOTS, "running")
    if os.environ.get("BOOK") == "overwrite":
        page.until("state.recording > 11000", 240)
        page.picture(BOOK_PICTURE, ".live")
    assert page.js("return state.lost") == 0
    drawn = page.js("return perf.frames")
    page.until(f"perf.frames > {drawn} + 10")
    passed("follows_a_setpoint_profile_and_records_without_loss")
    reads_where_one_points(page)
    page.mishap(1)
    page.until("!document.getElementById('fault').hidden")
    assert "load cell" in page.text("fault-text") and "What to do" in page.text("fault-text"), page.text("fault-text")
    # The broken load cell reads 100 kN: reported, marked, and excluded from the axis.
    page.until("!document.getElementById('out-force').hidden")
    assert "100000 N" in page.text("out-force"), page.text("out-force")
    most = page.js("let s = scopes[0].stretches, most = 0; s.each((slot) => { most = Math.max(most, s.curves.F.most[slot]); }); return most")
    assert 0 < most < 500, f"the axis of force goes to {most} N"
    page.shot(SHOTS, "fault")
    page.mishap(0)
    # Refused until the load cell has been sampled again.
    page.click_until("clear", "document.getElementById('state').textContent === 'disarmed'")
    page.until("document.getElementById('out-force').hidden")
    passed("tells_a_fault_in_words_and_clears_it")
    page.click("record")
    page.until("document.querySelectorAll('#list li').length == 7")
    page.js("document.getElementById('a').value = '5'; document.getElementById('b').value = '6'")
    page.click("compare")
    page.until("!document.getElementById('compare-figure').hidden")
    page.click("diagnose")
    page.until("!document.getElementById('diagnosis').hidden", 600)
    page.shot(SHOTS, "recordings")
    passed("compares_recordings_and_diagnoses")
    page.js("document.activeElement.blur()")
    page.key("a")
    page.state("armed")
    page.key("f")
    page.state("running")
    page.until("state.recording > 200")
    page.key("v")
    page.state("disarmed")
    page.until("document.querySelectorAll('#list li').length == 8")
    assert page.js("return JSON.parse(localStorage.getItem('studio-profiles')).length") >= 1, "followed profiles are offered again"
    passed("is_worked_by_keys_alone_and_records_each_run")
    page.click("arm")
    page.state("armed")
    page.click("follow")
    page.state("running")
    page.js("document.getElementById('profile').focus()")
    page.key("\ue00c")
    page.state("disarmed")
    passed("vents_by_one_key_wherever_the_cursor_is")
    bad = [entry["message"] for entry in page.ask("POST", page.path + "/se/log", {"type": "browser"}) if entry["level"] == "SEVERE"]
    # The page handles a refused request; the browser logs it nevertheless.
    assert not [b for b in bad if "400" not in b], bad
    page.click("arm")
    page.state("armed")
    page.click("follow")
    page.state("running")
    page.close()
    # The page is hidden for longer than the studio allows a muscle to run unattended; each view of the page restarts that time.
    end = time.time() + HOPELESS
    while glimpse(url) != "disarmed":
        assert time.time() < end, "the controller works on unwatched"
        time.sleep(3)
    page = Browser(driver, url, "500,900")
    page.state("disarmed")
    assert page.js("return document.documentElement.scrollWidth <= innerWidth"), "the page is wider than a phone"
    assert page.js("return document.querySelector('.live').offsetTop < document.getElementById('connect').offsetTop"), "controls above the pictures"
    page.close()
    passed("closing_the_page_leaves_the_controller_safe")


def guards(url):
    base, token = url.split("/?token=")
    tries = [
        {},
        {"x-studio-token": "0" * 32},
        {"Host": "evil.example", "x-studio-token": token},
        {"Origin": "http://evil.example", "x-studio-token": token},
    ]
    for address, code in [("/?token=" + "0" * 32, 403), ("/api/stream", 403), ("/report/fit", 404), ("/report/" + token, 404)]:
        try:
            urllib.request.urlopen(base + address)
            raise AssertionError(f"{address} is served without the token")
        except urllib.error.HTTPError as error:
            assert error.code == code, (address, error.code)
    for headers in tries:
        try:
            urllib.request.urlopen(urllib.request.Request(base + "/api/order", data=b'{"do":"arm"}', headers=headers))
            raise AssertionError(f"served with {headers}")
        except urllib.error.HTTPError as error:
            assert error.code == 403, error.code
    passed("strangers_are_refused")


def main():
    with studio(PROGRAM) as (url, driver, program):
        guards(url)
        story(url, driver)
        program.send_signal(signal.SIGINT)
        assert program.wait(HOPELESS) == 0
        print(f"test result: ok. {COUNT} passed; 0 failed", flush=True)


main()
