"""Follows a pressure for a second and prints what the controller measures.

    python3 clients/python/example.py tcp:127.0.0.1:4321 150
"""

import sys
import time

from pam_link import Controller


def main(port, kilopascals):
    with Controller(port) as controller:
        info = controller.call("info")
        print("release", ".".join(map(str, controller.release)), "with", info["muscles"], "muscles")
        controller.arm()
        # The test of the dump valve comes before some boards are armed.
        end = time.monotonic() + 3
        while controller.call("status")["state"] == "Disarmed" and time.monotonic() < end:
            controller.keep_alive()
            time.sleep(0.05)
        controller.start("Pressure")
        controller.set_point({"Pressure": kilopascals * 1e3})
        samples = list(controller.telemetry(1.0))
        if not samples:
            sys.exit("no telemetry came")
        last = samples[-1]
        print(len(samples), "samples, the last at", f"{last['sides'][0]['pressure_pa'] / 1e3:.1f} kPa,", last["state"])
        print("now", controller.call("stop")["state"])


if __name__ == "__main__":
    main(sys.argv[1], float(sys.argv[2]) if len(sys.argv) > 2 else 100.0)
