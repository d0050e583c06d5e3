"""Controls `host studio` in headless Chromium through WebDriver, with the standard library of Python only."""

import base64
import contextlib
import json
import os
import re
import signal
import subprocess
import tempfile
import time
import urllib.request


# Timeout for an expected event, s; long enough for a busy machine.
HOPELESS = 180


def ended(program):
    """Ends the program with a signal, so that it also ends its emulator."""
    program.send_signal(signal.SIGINT)
    try:
        program.wait(10)
    except subprocess.TimeoutExpired:
        program.kill()


class Program(subprocess.Popen):
    """A program that prints its address in its first line, after a given word."""

    def __init__(self, *command):
        # Errors and notes go to a file; an unread pipe would fill up and block.
        self.notes = tempfile.TemporaryFile("w+")
        super().__init__(command, stdout=subprocess.PIPE, stderr=self.notes, text=True)

    def address(self, after=""):
        line = self.stdout.readline()
        at = line.find(after) if line else -1
        if at < 0:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.wait(5)
            self.notes.seek(0)
            raise SystemExit(f"`{' '.join(self.args)}` does not say its address, but:\n{line}{self.notes.read()}")
        return line[at + len(after) :].strip()


@contextlib.contextmanager
def studio(program, on=None, muscle="mini"):
    """`host studio` with an emulated controller, and a driver of browsers: the page's address, the driver's, and the program.

    The studio's own controller runs in QEMU where that is there; `on` ("qemu", "native") has one in another process, connected to by
    its port."""
    running = [subprocess.Popen(["chromedriver", "--port=0"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)]
    with tempfile.TemporaryDirectory() as folder:
        try:
            which = ["--emulate", muscle]
            if on:
                running.append(Program(program, "emulate", muscle, "--on", on))
                which = ["--port", running[-1].address()]
            running.append(Program(program, "studio", *which, "-o", folder))
            url = running[-1].address("open ")
            # It selects a free port and prints it, then serves.
            said = (re.search(r"successfully on port (\d+)", line) for line in running[0].stdout)
            port = next((found[1] for found in said if found), None)
            if not port:
                raise SystemExit("chromedriver does not say its port")
            yield url, f"http://127.0.0.1:{port}", running[-1]
        finally:
            # A driver that ends does not end its browsers.
            for page in list(Browser.open):
                with contextlib.suppress(OSError):
                    page.close()
            for one in reversed(running):
                ended(one)


class Browser:
    """A page under WebDriver."""

    open = []

    def __init__(self, driver, url, size):
        self.driver = driver
        arguments = ["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage", "--window-size=" + size]
        arguments += ["--enable-precise-memory-info", "--js-flags=--expose-gc"]
        wanted = {"browserName": "chrome", "goog:chromeOptions": {"args": arguments}, "goog:loggingPrefs": {"browser": "ALL"}}
        wanted["timeouts"] = {"script": 1000 * HOPELESS, "pageLoad": 1000 * HOPELESS}
        self.path = "/session/" + self.ask("POST", "/session", {"capabilities": {"alwaysMatch": wanted}})["sessionId"]
        Browser.open.append(self)
        self.ask("POST", self.path + "/url", {"url": url})

    def ask(self, method, path, body=None):
        data = None if body is None else json.dumps(body).encode()
        request = urllib.request.Request(self.driver + path, data=data, method=method, headers={"Content-Type": "application/json"})
        return json.load(urllib.request.urlopen(request, timeout=HOPELESS + 10))["value"]

    def js(self, text):
        return self.ask("POST", self.path + "/execute/sync", {"script": text, "args": []})

    def click(self, name):
        self.js(f"document.getElementById('{name}').click()")

    def click_until(self, name, condition):
        """Repeats a request while it is refused, for requests that are allowed only some time after their cause."""
        end = time.time() + HOPELESS
        while not self.js(f"return !!({condition})"):
            assert time.time() < end, f"never came by {name}: {condition}; the page says: {self.text('message')}"
            self.click(name)
            time.sleep(0.5)

    def text(self, name):
        return self.js(f"return document.getElementById('{name}').textContent")

    def until(self, condition, seconds=HOPELESS):
        end = time.time() + seconds
        while time.time() < end:
            if self.js(f"return !!({condition})"):
                return
            time.sleep(0.1)
        raise AssertionError(f"never came: {condition}; the page says: {self.text('message')}")

    def state(self, wanted, seconds=HOPELESS):
        self.until(f"document.getElementById('state').textContent.startsWith('{wanted}')", seconds)

    def cdp(self, command, **parameters):
        return self.ask("POST", self.path + "/goog/cdp/execute", {"cmd": command, "params": parameters})

    def shot(self, folder, name):
        """The whole page in light and dark, wide and on a phone; nothing without a folder."""
        if not folder:
            return
        os.makedirs(folder, exist_ok=True)
        for scheme in ["light", "dark"]:
            self.cdp("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])
            for size, (width, height, phone) in {"wide": (1300, 1000, False), "phone": (390, 844, True)}.items():
                self.cdp("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1 + phone, mobile=phone)
                time.sleep(0.7)
                picture = self.cdp("Page.captureScreenshot", captureBeyondViewport=True, format="png")["data"]
                with open(os.path.join(folder, f"{name}-{scheme}-{size}.png"), "wb") as file:
                    file.write(base64.b64decode(picture))
        self.cdp("Emulation.clearDeviceMetricsOverride")
        self.cdp("Emulation.setEmulatedMedia", features=[])

    def picture(self, path, until):
        """A picture for the book: the page from the top to the end of an element, light theme, 1300 pixels wide."""
        self.cdp("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": "light"}])
        self.cdp("Emulation.setDeviceMetricsOverride", width=1300, height=900, deviceScaleFactor=1, mobile=False)
        time.sleep(1)
        self.js("document.activeElement.blur(); scrollTo(0, 0)")
        bottom = self.js(f"return document.querySelector('{until}').getBoundingClientRect().bottom") + 12
        clip = {"x": 0, "y": 0, "width": 1300, "height": bottom, "scale": 1}
        data = self.cdp("Page.captureScreenshot", captureBeyondViewport=True, format="webp", quality=80, clip=clip)["data"]
        with open(path, "wb") as file:
            file.write(base64.b64decode(data))
        self.cdp("Emulation.clearDeviceMetricsOverride")
        self.cdp("Emulation.setEmulatedMedia", features=[])

    def key(self, value):
        actions = [{"type": "keyDown", "value": value}, {"type": "keyUp", "value": value}]
        self.ask("POST", self.path + "/actions", {"actions": [{"type": "key", "id": "k", "actions": actions}]})

    def over(self, selector):
        """The pointer in the middle of an element."""
        element = self.ask("POST", self.path + "/element", {"using": "css selector", "value": selector})
        move = {"type": "pointerMove", "duration": 0, "x": 0, "y": 0, "origin": element}
        self.ask("POST", self.path + "/actions", {"actions": [{"type": "pointer", "id": "p", "actions": [move]}]})

    def mishap(self, code):
        self.js(f"let s = document.getElementById('mishap'); s.value = '{code}'; s.dispatchEvent(new Event('change'))")

    def table_on_device(self):
        """Loads the example's recordings, fits them, and sends the table to the controller."""
        self.click("example")
        self.until("document.querySelectorAll('#list li').length == 6")
        self.click("fit")
        self.until("!document.getElementById('fit-text').hidden")
        self.click("difference")
        self.until("!document.getElementById('difference-text').hidden")
        self.click("flash")
        self.until("document.getElementById('message').textContent.includes('read back')")

    def close(self):
        Browser.open.remove(self)
        self.ask("DELETE", self.path)
