"""lensd on a GigE Vision camera whose packets get lost, and which sends them again when asked: focus is found all the same,
and what was lost and what came again is told. On loopback; with "netem" as the first argument the kernel loses packets of every
kind on every hop (virtual machine, root), otherwise the proxy loses those of the stream.

usage: gige_loss_test.py [netem BIN_FOLDER]"""
import json
import os
import subprocess
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
NETEM = sys.argv[1:2] == ["netem"]
if NETEM:
    os.environ["LENSD_BIN"] = sys.argv[2]
    os.environ.setdefault("LENSD_TEST_PATIENCE", "10")
    del sys.argv[1:]
sys.path.insert(0, HERE)
import gige_test  # noqa: E402
from gige_test import HALF_DOF_D, PATIENCE, WALL_D, Camera, Daemon  # noqa: E402
from resending_proxy import ResendingProxy  # noqa: E402

PROXY = "127.0.0.2"


def setUpModule():
    gige_test.turn.take(own=not NETEM)
    if NETEM:
        subprocess.run(["ip", "link", "set", "lo", "up"], check=True)
        subprocess.run(["tc", "qdisc", "add", "dev", "lo", "root", "netem", "loss", "0.5%", "delay", "1ms"], check=True)


def tearDownModule():
    gige_test.tearDownModule()


class Loss(unittest.TestCase):
    def start(self, extra="", lose=0.03):
        camera = Camera()
        self.addCleanup(camera.stop)
        self.proxy = ResendingProxy(PROXY, "127.0.0.1", lose=0.0 if NETEM else lose)
        self.addCleanup(self.proxy.stop)
        config = gige_test.lens(extra).replace('serial = "TEST1"', f'address = "{PROXY}"').replace("8192", "1400")
        self.daemon = Daemon(config=config)
        self.addCleanup(self.daemon.stop)

    def ask(self, *arguments):
        done = self.daemon.lensctl("--json", *arguments)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr + self.daemon.log())
        return json.loads(done.stdout)

    def use_frames(self):
        """Focus from several places, by pictures alone. In the virtual machine, where a picture takes seconds: pictures."""
        answers = []
        if NETEM:
            for _ in range(8):
                self.daemon.lensctl("snapshot", "-o", os.path.join(self.daemon.folder.name, "picture.png"))
            return answers
        for begin in (3500, 400, 2900):
            self.ask("focus", f"@{begin}")
            answers.append(json.loads(self.daemon.lensctl("--json", "autofocus", "--method", "sweep").stdout))
        return answers

    def metrics(self):
        time.sleep(2.5 * (2 if NETEM else 1))  # packets are counted every second
        return self.ask("metrics")

    def test_what_was_lost_comes_again_and_is_counted(self):
        self.start()
        for answer in self.use_frames():
            self.assertTrue(answer.get("focused"), answer)
            self.assertAlmostEqual(answer["vergenceD"], WALL_D, delta=2 * HALF_DOF_D)
        metrics = self.metrics()
        deadline = time.monotonic() + 20 * PATIENCE
        while NETEM and (metrics["frames"] <= 20 or metrics["counters"]["packetsResent"] == 0):
            self.assertLess(time.monotonic(), deadline, metrics)
            self.use_frames()
            metrics = self.metrics()
        counters = metrics["counters"]
        print(f"proxy: {self.proxy.lost} lost, {self.proxy.resent} sent again; lensd: {metrics}", file=sys.stderr)
        self.assertGreater(counters["packetsResent"], 0)
        self.assertGreater(metrics["frames"], 20)
        if not NETEM:
            self.assertLess(counters["framesLost"], metrics["frames"] / 10)
            self.assertEqual((metrics["autofocuses"], metrics["autofocusesFocused"]), (3, 3))
            self.assertLessEqual(counters["packetsResent"], self.proxy.resent)
            self.assertGreater(counters["packetsResent"], 0.5 * self.proxy.lost)
        self.assertEqual(self.ask("status")["counters"], self.ask("metrics")["counters"])

    def test_without_resends_frames_are_lost_and_doctor_says_what_to_do(self):
        self.start("resend = false\n", lose=0.02)
        deadline = time.monotonic() + 60 * PATIENCE
        while self.ask("status")["counters"]["framesLost"] < 10:
            self.assertLess(time.monotonic(), deadline, self.ask("metrics"))
            self.use_frames()
        counters = self.metrics()["counters"]
        self.assertEqual((counters["packetsResent"], self.proxy.resent), (0, 0))
        self.assertGreater(counters["packetsLost"], 0)
        done = self.daemon.lensctl("doctor", "--json")
        told = [finding for finding in json.loads(done.stdout) if "frames lost" in finding["message"]]
        self.assertEqual([finding["status"] for finding in told], ["warning"], done.stdout)
        self.assertIn("packet_size", told[0]["remedy"])


if __name__ == "__main__":
    unittest.main(verbosity=2)
