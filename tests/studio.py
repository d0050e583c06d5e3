#!/usr/bin/env python3
"""The page of `host studio` in a real headless Chromium, against the firmware in QEMU (or as a library, where QEMU is not).

    python3 tests/studio.py [PROGRAM] [FOLDER FOR SCREENSHOTS]
    STUDIO_MINUTES=5 python3 tests/studio.py    # and so many minutes of live pictures, measured

Connect, load, fit, difference, flash, arm, follow, fault, clear, vent by key, compare, close the page; ten minutes of samples through
the page's own code, with the memory and the time for a picture bounded; and who may ask at all. With a folder, every view is
photographed in light and dark, wide and on a phone.
Needs chromium and chromedriver, nothing of Python beyond its own library.
"""

import base64
import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request

PROGRAM = sys.argv[1] if len(sys.argv) > 1 else "target/debug/host"
SHOTS = sys.argv[2] if len(sys.argv) > 2 else None


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return s.getsockname()[1]


class Browser:
    """A page under WebDriver."""

    def __init__(self, driver, url, size):
        self.driver = driver
        arguments = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=" + size]
        arguments += ["--enable-precise-memory-info", "--js-flags=--expose-gc"]
        wanted = {"browserName": "chrome", "goog:chromeOptions": {"args": arguments}, "goog:loggingPrefs": {"browser": "ALL"}}
        self.path = "/session/" + self.ask("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]
        self.ask("POST", self.path + "/url", {"url": url})

    def ask(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.driver + path, data=data, method=method, headers={"Content-Type": "application/json"})
        return json.load(urllib.request.urlopen(request, timeout=90))["value"]

    def js(self, text):
        return self.ask("POST", self.path + "/execute/sync", {"script": text, "args": []})

    def click(self, name):
        self.js(f"document.getElementById('{name}').click()")

    def text(self, name):
        return self.js(f"return document.getElementById('{name}').textContent")

    def until(self, condition, seconds=60):
        end = time.time() + seconds
        while time.time() < end:
            if self.js(f"return !!({condition})"):
                return
            time.sleep(0.1)
        raise AssertionError(f"never came: {condition}; the page says: {self.text('message')}")

    def state(self, wanted, seconds=30):
        self.until(f"document.getElementById('state').textContent.startsWith('{wanted}')", seconds)

    def cdp(self, command, **parameters):
        return self.ask("POST", self.path + "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def shot(self, name):
        """The whole page in light and dark, wide and on a phone."""
        if not SHOTS:
            return
        os.makedirs(SHOTS, exist_ok=True)
        for scheme in ["light", "dark"]:
            self.cdp("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            for size, (width, height, phone) in {"wide": (1300, 1000, False), "phone": (390, 844, True)}.items():
                self.cdp("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1 + phone, mobile=phone)
                time.sleep(0.7)
                picture = self.cdp("Page.captureScreenshot", captureBeyondViewport=True, format="png")["data"]
                with open(os.path.join(SHOTS, f"{name}-{scheme}-{size}.png"), "wb") as file:
                    file.write(base64.b64decode(picture))
        self.cdp("Emulation.clearDeviceMetricsOverride")
        self.cdp("Emulation.setEmulatedMedia", features=[])

    def key(self, value):
        actions = [{"type": "keyDown", "value": value}, {"type": "keyUp", "value": value}]
        self.ask("POST", self.path + "/actions", {"actions": [{"type": "key", "id": "k", "actions": actions}]})

    def mishap(self, code):
        self.js(f"let s = document.getElementById('mishap'); s.value = '{code}'; s.dispatchEvent(new Event('change'))")

    def close(self):
        self.ask("DELETE", self.path)


COUNT = 0


def passed(what):
    global COUNT
    COUNT += 1
    print(f"test studio::{what} ... ok", flush=True)


# Ten minutes at 1 kHz, as the stream brings them: batches of 33 samples, each parsed, kept and from time to time drawn.
LONG = """
    const from = ring.last("t") + 1, batches = 18000, times = [];
    gc();
    const before = performance.memory.usedJSHeapSize;
    document.getElementById("window").value = "30";
    for (let b = 0; b < batches; b++) {
      const t = Array.from({length: 33}, (_, i) => from + (33 * b + i) * 1e-3);
      const of = (f) => t.map((x) => Math.round(1e3 * f(x)) / 1e3);
      take(JSON.parse(JSON.stringify({k: "t", t, F: of((x) => 45 + 20 * Math.sin(3 * x)), P: of((x) => 300 + 50 * Math.cos(x)),
        x: of(Math.sin), c: of(() => 300), m: of(Math.cos), a: of(() => 45), mode: "force"})));
      if (b > 1000 && b % 200 === 0) { const begun = performance.now(); draw(); times.push(performance.now() - begun); }
    }
    document.getElementById("window").value = "10";
    gc();
    const grown = performance.memory.usedJSHeapSize - before;
    times.sort((x, y) => x - y);
    const kept = ring.length;
    ring.clear();
    return {grown, kept, median: times[times.length >> 1], undisturbed: times[Math.floor(times.length / 10)]};
"""


def ten_minutes(page):
    # The first time what is made once is made; the second time nothing may stay.
    page.js(LONG)
    found = page.js(LONG)
    assert found["grown"] < 1e6, f"ten minutes of samples leave {found['grown']} bytes behind"
    assert found["kept"] <= 40000, found
    # Other programs on a busy machine lengthen most pictures; the quickest tenth shows what a picture costs.
    assert found["undisturbed"] < 10, f"a picture of 30 s takes {found['undisturbed']} ms"
    passed(f"ten_minutes_of_samples_leave_nothing_behind ({found['grown'] / 1e3:.0f} kB, {found['median']:.1f} ms a picture)")


def live(page, minutes, program):
    """Live pictures for minutes: frames, gaps, memory of page and program, losses."""
    rows = []
    resident = lambda: int(open(f"/proc/{program}/statm").read().split()[1]) * 4 / 1024
    end = time.time() + 60 * minutes
    while time.time() < end:
        page.js("window.framesBefore = perf.frames; window.samplesBefore = ring.last('t')")
        time.sleep(20)
        row = page.js("""gc(); const n = Math.min(perf.frames, perf.gap.length), sorted = (a) => [...a.slice(0, n)].sort((x, y) => x - y);
            const g = sorted(perf.gap), d = sorted(perf.draw), at = (a, q) => a[Math.min(n - 1, Math.floor(q * n))];
            return {frames: (perf.frames - framesBefore) / 20, device: (ring.last('t') - samplesBefore) / 20, gap50: at(g, .5), gap99: at(g, .99),
                    draw50: at(d, .5), draw99: at(d, .99), heap: performance.memory.usedJSHeapSize / 1e6, lost: state.lost}""")
        row["program"] = resident()
        rows.append(row)
        print("  live: {frames:.1f} pictures/s, {device:.2f} s of device a second, gaps {gap50:.0f} ms (median) {gap99:.0f} ms (99 %), drawing "
              "{draw50:.1f} ms {draw99:.1f} ms, page {heap:.2f} MB, program {program:.1f} MB, {lost} lost".format(**row), flush=True)
    assert rows[-1]["heap"] < rows[0]["heap"] + 2 and rows[-1]["program"] < rows[0]["program"] + 20, "memory grows"
    assert min(row["frames"] for row in rows) > 5, "pictures stall"
    passed("live_pictures_go_on_and_memory_stays")


def story(url, driver, program):
    page = Browser(driver, url, "1300,1000")
    page.state("disarmed", 60)
    passed("connects_to_an_emulated_controller")
    ten_minutes(page)
    page.click("example")
    page.until("document.querySelectorAll('#list li').length == 6")
    page.click("fit")
    page.until("!document.getElementById('fit-text').hidden")
    assert "P0" in page.text("fit-text"), page.text("fit-text")
    assert "<svg" in page.js("""let r = new XMLHttpRequest(); r.open("GET", document.querySelector("#fit-report a").href, false); r.send();
        return r.status === 200 ? r.responseText : String(r.status)""")
    passed("fits_recordings")
    page.click("difference")
    page.until("!document.getElementById('difference-text').hidden")
    assert "no table yet" in page.text("difference-text")
    page.click("flash")
    page.until("document.getElementById('message').textContent.includes('read back')")
    passed("shows_the_difference_and_flashes")
    page.click("arm")
    page.state("armed")
    page.click("record")
    page.click("follow")
    page.state("running")
    page.until("state.recording > 1000", 120)
    page.shot("running")
    assert page.js("return state.lost") == 0
    drawn = page.js("return perf.frames")
    time.sleep(3)
    assert page.js("return perf.frames") > drawn + 10, "pictures stall"
    passed("follows_a_course_and_records_without_loss")
    page.mishap(1)
    page.until("!document.getElementById('fault').hidden", 60)
    assert "load cell" in page.text("fault-text") and "What to do" in page.text("fault-text"), page.text("fault-text")
    page.shot("fault")
    page.mishap(0)
    time.sleep(1)
    page.click("clear")
    page.state("disarmed")
    passed("tells_a_fault_in_words_and_clears_it")
    page.click("record")
    page.until("document.querySelectorAll('#list li').length == 7")
    page.js("document.getElementById('a').value = '5'; document.getElementById('b').value = '6'")
    page.click("compare")
    page.until("!document.getElementById('compare-figure').hidden")
    page.click("diagnose")
    page.until("!document.getElementById('diagnosis').hidden", 120)
    page.shot("recordings")
    passed("compares_recordings_and_diagnoses")
    page.js("document.activeElement.blur()")
    page.key("a")
    page.state("armed")
    page.key("f")
    page.state("running")
    page.key("v")
    page.state("disarmed", 10)
    passed("is_worked_by_keys_alone")
    page.click("arm")
    page.state("armed")
    page.click("follow")
    page.state("running")
    minutes = float(os.environ.get("STUDIO_MINUTES", "0"))
    if minutes > 0:
        live(page, minutes, program)
    page.js("document.getElementById('course').focus()")
    page.key("\ue00c")
    page.state("disarmed", 10)
    passed("vents_by_one_key_wherever_the_cursor_is")
    bad = [entry["message"] for entry in page.ask("POST", page.path + "/se/log", {"type": "browser"}) if entry["level"] == "SEVERE"]
    # A refused order is the page's business; the browser notes it all the same.
    assert not [b for b in bad if "400" not in b], bad
    page.click("arm")
    page.state("armed")
    page.click("follow")
    page.state("running")
    page.close()
    time.sleep(4)
    page = Browser(driver, url, "500,900")
    page.until("state.connected", 30)
    assert page.text("state") == "disarmed", page.text("state")
    assert page.js("return document.documentElement.scrollWidth <= innerWidth"), "the page is wider than a phone"
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
    for address in ["/", "/report/fit", "/report/fit?token=" + "0" * 32]:
        try:
            urllib.request.urlopen(base + address)
            raise AssertionError(f"{address} is served without the token")
        except urllib.error.HTTPError as error:
            assert error.code == 403, error.code
    for headers in tries:
        try:
            urllib.request.urlopen(urllib.request.Request(base + "/api/order", data=b'{"do":"arm"}', headers=headers))
            raise AssertionError(f"served with {headers}")
        except urllib.error.HTTPError as error:
            assert error.code == 403, error.code
    passed("strangers_are_refused")


def main():
    port = free_port()
    driver = subprocess.Popen(["chromedriver", f"--port={port}"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with tempfile.TemporaryDirectory() as folder:
        studio = subprocess.Popen(
            [PROGRAM, "studio", "--emulate", "mini", "-o", folder], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True
        )
        try:
            url = studio.stdout.readline().split("open ")[1].strip()
            time.sleep(2)
            guards(url)
            story(url, f"http://127.0.0.1:{port}", studio.pid)
            studio.send_signal(signal.SIGINT)
            assert studio.wait(20) == 0
            print(f"test result: ok. {COUNT} passed; 0 failed", flush=True)
        finally:
            studio.kill()
            driver.kill()


main()
