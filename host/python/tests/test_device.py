"""The device client, with a controller that `host emulate --on native` runs: PAM_HOST names the program."""

import asyncio
import os
import subprocess
import threading
import time

import numpy as np
import pamtools as pam
from test_notebook import everything, main, refused


class Emulated:
    """A controller in another process, and its port."""

    def __enter__(self):
        program = [os.environ["PAM_HOST"], "emulate", "--on", "native"]
        self.program = subprocess.Popen(program, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        return self.program.stdout.readline().strip()

    def __exit__(self, *_):
        self.program.terminate()
        self.program.wait()


def until(what, seconds=60):
    """Waits for a state, for as long as a busy machine may need."""
    end = time.monotonic() + seconds
    while not what():
        assert time.monotonic() < end, "it did not happen"
        time.sleep(0.05)


def test_connect_flash_run_record():
    muscle, campaign = everything()
    table = pam.fit(campaign, muscle).table
    with Emulated() as port, pam.connect(port) as device:
        info = device.info()
        assert info["state"] == "disarmed" and info["fault"] is None and info["tables"][0] is None
        assert device.flash(table) == device.info()["tables"][0]["crc"]
        recording = device.run("sine", force="sine mean=45 amplitude=10 frequency=1", seconds=2)
        assert recording.name == "sine" and 1900 < len(recording) <= 2001, len(recording)
        assert 1.9 < recording.time[-1] - recording.time[0] < 2.01
        assert np.ptp(recording.force) > 5 and recording.pressure.max() > 1e5
        assert device.info()["state"] == "disarmed", "vented at the end"
        quiet = device.record(seconds=0.5, rate=100)
        assert 45 <= len(quiet) <= 51, len(quiet)
        # What is measured with it is fitted as any other recording.
        assert table.predict(pam.Campaign([recording]))[0].shape == recording.force.shape
        before = device.settings()["limits"]["force_n"]
        assert device.change_settings({"limits.force_n": before / 2})["limits"]["force_n"] == before / 2
        try:
            device.change_settings({"limits.forse_n": 1.0})
        except ValueError as error:
            assert "names no setting" in str(error)
        else:
            raise AssertionError("a setting that does not exist was taken")
    assert "closed" in str(refused(device.info))


def test_samples_are_iterated_and_leaving_the_loop_vents():
    with Emulated() as port, pam.connect(port) as device:
        count = 0
        for sample in device.follow(pressure=200, rate=200):
            assert sample.state in {"running", "armed"} and sample.mode == "pressure"
            if count == 0 and abs(sample.setpoint - 200e3) > 1:
                # The run begins before its setpoint arrives: the controller holds what it has.
                continue
            assert abs(sample.setpoint - 200e3) < 1
            count += 1
            if count == 100:
                assert "in progress" in str(refused(device.info))
                break
        assert device.info()["state"] == "disarmed"
        states = [sample.state for sample in device.watch(seconds=0.2, rate=100)]
        assert states and set(states) == {"disarmed"}


def test_a_program_that_hangs_does_not_keep_the_muscle_under_pressure():
    with Emulated() as port, pam.connect(port) as device:
        samples = device.follow(pressure=200)
        next(samples)
        time.sleep(3)
        error = refused(lambda: list(samples))
        assert "took no samples" in str(error), error
        assert device.info()["state"] == "disarmed"


def test_another_thread_vents_while_a_run_goes_on():
    with Emulated() as port, pam.connect(port) as device:
        ended = []
        running = threading.Thread(target=lambda: ended.append(len(device.run(pressure=200, seconds=600))))
        running.start()
        time.sleep(1)
        device.vent()
        running.join(60)
        assert not running.is_alive() and device.info()["state"] == "disarmed"


def test_setpoints_out_of_reach_and_wrong_calls_are_refused():
    muscle, campaign = everything()
    with Emulated() as port, pam.connect(port) as device:
        device.flash(pam.fit(campaign, muscle).table)
        assert "pulls at most" in str(refused(lambda: device.run(force=5000, seconds=1)))
        assert "`seconds` is -1" in str(refused(lambda: device.run(force=40, seconds=-1)))
        assert "write a value" in refused(lambda: device.run(force="sign mean=3", seconds=1)).help
        for wrong in [{}, {"force": 1, "pressure": 2}]:
            try:
                device.follow(**wrong)
            except ValueError as error:
                assert "give one of" in str(error)
            else:
                raise AssertionError("it was taken")
        assert device.info()["state"] == "disarmed", "nothing moved"
    refused(lambda: pam.connect("tcp:127.0.0.1:1"))


def test_samples_are_awaited_and_cancelling_vents():
    async def follow(device):
        samples = []
        async for sample in device.follow_async(pressure=200, seconds=0.5, rate=200):
            samples.append(sample.pressure)
        recording = await device.run_async(pressure=150, seconds=0.3)
        task = asyncio.create_task(device.run_async(pressure=200, seconds=600))
        await asyncio.sleep(1)
        task.cancel()
        try:
            await task
        except asyncio.CancelledError:
            pass
        return samples, recording

    with Emulated() as port, pam.connect(port) as device:
        samples, recording = asyncio.run(follow(device))
        assert 90 <= len(samples) <= 101 and len(recording) > 250
        until(lambda: device.info()["state"] == "disarmed")


if __name__ == "__main__":
    main(globals())
