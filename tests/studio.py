#!/usr/bin/env python3
"""The page of `host studio` in a real headless Chromium, against the firmware in QEMU (or as a library, where QEMU is not).

    python3 tests/studio.py [PROGRAM] [FOLDER FOR SCREENSHOTS]

Connect, load, fit, difference, flash, arm, follow, fault, clear, vent by key, compare, close the page; and who may ask at all.
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

    def shot(self, name):
        if SHOTS:
            os.makedirs(SHOTS, exist_ok=True)
            with open(os.path.join(SHOTS, name), "wb") as file:
                file.write(base64.b64decode(self.ask("GET", self.path + "/screenshot")))

    def key(self, value):
        actions = [{"type": "keyDown", "value": value}, {"type": "keyUp", "value": value}]
        self.ask("POST", self.path + "/actions", {"actions": [{"type": "key", "id": "k", "actions": actions}]})

    def mishap(self, code):
        self.js(f"let s = document.getElementById('mishap'); s.value = '{code}'; s.dispatchEvent(new Event('change'))")

    def close(self):
        self.ask("DELETE", self.path)


def passed(what):
    print(f"test studio::{what} ... ok", flush=True)


def story(url, driver):
    page = Browser(driver, url, "1300,1000")
    page.state("disarmed", 60)
    passed("connects_to_an_emulated_controller")
    page.click("example")
    page.until("document.querySelectorAll('#list li').length == 6")
    page.click("fit")
    page.until("!document.getElementById('fit-text').hidden")
    assert "P0" in page.text("fit-text"), page.text("fit-text")
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
    page.shot("running.png")
    assert page.js("return state.lost") == 0
    passed("follows_a_course_and_records_without_loss")
    page.mishap(1)
    page.until("!document.getElementById('fault').hidden", 60)
    assert "load cell" in page.text("fault-text") and "What to do" in page.text("fault-text"), page.text("fault-text")
    page.shot("fault.png")
    page.mishap(0)
    time.sleep(1)
    page.click("clear")
    page.state("disarmed")
    passed("tells_a_fault_in_words_and_clears_it")
    page.click("record")
    page.until("document.querySelectorAll('#list li').length == 7")
    page.js("document.getElementById('a').value = '5'; document.getElementById('b').value = '6'")
    page.click("compare")
    page.until("!document.getElementById('comparison').hidden")
    passed("compares_recordings")
    page.click("arm")
    page.state("armed")
    page.click("follow")
    page.state("running")
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
    page.shot("narrow.png")
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
            story(url, f"http://127.0.0.1:{port}")
            studio.send_signal(signal.SIGINT)
            assert studio.wait(20) == 0
            print("test result: ok. 9 passed; 0 failed", flush=True)
        finally:
            studio.kill()
            driver.kill()


main()
