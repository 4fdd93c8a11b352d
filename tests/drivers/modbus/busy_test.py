"""Drives that answer "busy" or "acknowledge", and gateways that say "ask again", at any point: the drive is asked again, the move ends
as it should, and no lens is lost. Where a move has to be given up, its motor is told to stop as soon as the drive answers."""
import json
import os
import random
import subprocess
import sys
import time
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "daemon"))
from harness import LENS, PATIENCE, Daemon  # noqa: E402

LONG = os.environ.get("LENSD_TEST_LEVEL") == "long"
CODES = (5, 6, 10, 11)


class Drive:
    def __init__(self, code=6, count=0):
        self.process = subprocess.Popen([sys.executable, os.path.join(HERE, "busy_drive.py"), "0", str(code), str(count)],
                                        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.port = int(self.process.stdout.readline())

    def tell(self, words):
        self.process.stdin.write(words + "\n")
        self.process.stdin.flush()
        return self.process.stdout.readline().strip()

    def busy(self, code, count, kind="all", obeys=False):
        self.tell(f"busy {code} {count} {kind} {int(obeys)}")

    def where(self):
        names = ("place", "turns", "moves", "stops", "refused")
        return dict(zip(names, map(int, self.tell("where").split())))

    def close(self):
        self.process.kill()
        self.process.wait(timeout=30)
        self.process.stdin.close()
        self.process.stdout.close()


def config_of(drives, speed):
    text = "version = 1\n"
    for number, drive in enumerate(drives):
        text += (f'[[bus]]\nname = "b{number}"\ndriver = "modbus"\nhost = "127.0.0.1:{drive.port}"\nresponse_timeout_ms = 300\n'
                 f'[[lens]]\nname = "l{number}"\ndriver = "modbus"\nbus = "b{number}"\n[lens.drives.focus]\nunit = 1\n'
                 f'profile = "generic"\nrange = [-20000, 20000]\nparameters = {{ speed = {speed} }}\n')
    return text


class BusyTest(unittest.TestCase):
    def open(self, drives, speed=1000):
        self.drives = drives
        for drive in drives:
            self.addCleanup(drive.close)
        self.daemon = Daemon(config=config_of(drives, speed))
        self.addCleanup(self.daemon.stop)

    def client(self):
        client = self.daemon.client()
        self.addCleanup(client.socket.close)
        return client

    def lenses(self):
        with self.daemon.client() as client:
            return client.call(LENS + "Status")["parameters"]["lenses"]

    def assert_all_here(self):
        for lens in self.lenses():
            self.assertTrue(lens["connected"], f"{lens['name']} is {lens['connection']}: {lens.get('error')}")

    def wait_for(self, condition, seconds, what):
        deadline = time.monotonic() + seconds * PATIENCE
        while not condition():
            self.assertLess(time.monotonic(), deadline, what + ": " + self.daemon.log())
            time.sleep(0.01)

    def test_the_case_from_outside_ends_as_it_should(self):
        self.open([Drive(code, count) for code in CODES for count in (1, 3, 12)])
        clients = [self.client() for _ in self.drives]
        for number, client in enumerate(clients):
            client.send(LENS + "Move", {"lens": f"l{number}", "axis": "focus", "target": {"position": 5000 + number}})
        began = time.monotonic()
        while time.monotonic() - began < 0.4:
            self.assert_all_here()
            time.sleep(0.02)
        for number, client in enumerate(clients):
            move = client.receive()["parameters"]
            self.assertTrue(move.get("move", {}).get("reached"), move)
            self.assertEqual(self.drives[number].where()["place"], 5000 + number)
            client.__exit__()
        self.assertGreaterEqual(sum(drive.where()["refused"] for drive in self.drives), 4 * (1 + 3 + 12))

    def test_whatever_is_asked_is_asked_again(self):
        seed = int(os.environ.get("LENSD_TEST_SEED", "1"))
        draw = random.Random(seed)
        self.open([Drive() for _ in range(8)])
        for turn in range(40 if LONG else 3):
            jobs = []
            for number, drive in enumerate(self.drives):
                phase = draw.choice(("move", "target", "home", "idle"))
                job = (number, phase, draw.choice(CODES), draw.choice((1, 2, 3, 5, 20, 40)), draw.random() < 0.5,
                       draw.randrange(-3000, 3000))
                jobs.append((job, self.begin(drive, *job)))
            with self.subTest(seed=seed, turn=turn, jobs=[job for job, _ in jobs]):
                time.sleep(draw.random() * 0.1)
                self.assert_all_here()
                for job, client in jobs:
                    self.judge(*job, client)
                self.assert_all_here()

    def begin(self, drive, number, phase, code, count, obeys, target):
        """The client that waits for the end of what was begun."""
        client = self.client()
        if phase == "target":
            drive.busy(code, count, "writes", obeys)
        if phase == "home":
            drive.busy(code, count, "all", obeys)
        if phase == "idle":
            drive.busy(code, count, "reads")
            client.send(LENS + "Status")  # the lens is asked while nothing moves
            return client
        if phase == "home":
            client.send(LENS + "Home", {"lens": f"l{number}", "axis": "focus"})
        else:
            client.send(LENS + "Move", {"lens": f"l{number}", "axis": "focus", "target": {"position": target}})
        if phase == "move":
            moves = drive.where()["moves"]
            while drive.where()["moves"] == moves and abs(drive.where()["place"] - target) > 2:
                time.sleep(0.005)
            drive.busy(code, count, "reads")
        return client

    def judge(self, number, phase, code, count, obeys, target, client):
        answer = client.receive()
        client.__exit__()
        text = json.dumps(answer)
        drive = self.drives[number]
        if phase == "idle":
            return
        drive.busy(0, 0)
        moves = answer["parameters"].get("moves") or [answer["parameters"].get("move")]
        self.assertTrue(moves[0] and moves[0]["reached"], text)
        self.assertEqual(drive.where()["place"], 0 if phase == "home" else target, text)

    def test_a_motor_whose_move_is_given_up_is_stopped(self):
        """A drive that cannot be read but takes commands, and one that is mute for a while. Both need 20 s for the way."""
        failing, mute = Drive(), Drive()
        self.open([failing, mute], speed=100)
        clients = []
        for number in range(2):
            clients.append(self.client())
            clients[-1].send(LENS + "Move", {"lens": f"l{number}", "axis": "focus", "target": {"position": 20000}})
            self.wait_for(lambda drive=self.drives[number]: drive.where()["place"] > 500, 5, "it never set out")
        failing.busy(4, -1, "reads")
        mute.busy(0, -1)
        answers = [client.receive() for client in clients]
        for client in clients:
            client.__exit__()
        texts = [answer["parameters"].get("message") or answer["parameters"]["move"]["reason"] for answer in answers]
        self.assertIn("the motor was commanded to stop", texts[0])
        self.assertIn("the motor is not stopped yet: the stop will be sent as soon as the lens answers", texts[1])
        self.assertEqual(failing.where()["turns"], 0)
        self.assertLess(failing.where()["place"], 20000)
        self.assertEqual(mute.where()["stops"], 0)
        mute.busy(0, 0)
        self.wait_for(lambda: mute.where()["stops"] > 0, 10, "nobody told it to stop")
        self.assertEqual(mute.where()["turns"], 0)
        self.assertLess(mute.where()["place"], 20000)
        failing.busy(0, 0)
        self.wait_for(lambda: all(lens["connected"] for lens in self.lenses()), 10, "a lens did not come back")


if __name__ == "__main__":
    unittest.main()
