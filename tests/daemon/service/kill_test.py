"""lensd killed at any moment: what it remembers is always whole, and a position is unknown exactly when it should be."""
import json
import os
import random
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, LENS, Daemon  # noqa: E402

KILLS = {"fast": 4, "ci": 50, "long": 500}[os.environ.get("LENSD_TEST_LEVEL", "ci")]
FIELDS = {"position", "inMotion", "known", "slack", "travel", "doubt"}


class KillTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory(prefix="lensd-kill-")
        self.addCleanup(self.folder.cleanup)
        self.state = os.path.join(self.folder.name, "state")
        scene = os.path.join(self.folder.name, "scene.toml")
        with open(os.path.join(HERE, "small.toml"), encoding="utf-8") as small, \
                open(scene, "w", encoding="utf-8") as file:
            file.write(small.read().replace("speed_steps_per_s = 1000", "speed_steps_per_s = 4000"))
        self.config = f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n'

    def start(self, focus=""):
        return Daemon(config=self.config + focus, arguments=("--state", self.state))

    def remembered(self):
        """The focus axis in the state file, which must be there and whole."""
        with open(os.path.join(self.state, "a.position.json"), encoding="utf-8") as file:
            state = json.load(file)
        self.assertEqual(state["version"], 1)
        focus = state["axes"]["focus"]
        self.assertLessEqual(FIELDS, set(focus))
        return focus

    @staticmethod
    def focus(client):
        status = client.call(LENS + "Status", {"lens": "a"})["parameters"]["lenses"][0]
        return next(axis for axis in status["axes"] if axis["axis"] == "focus")

    @staticmethod
    def move(client, to):
        return client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": to}})

    def home_if_unknown(self, client, expected):
        """The axis is known exactly if expected; where not it takes no target before it is homed."""
        self.assertEqual(self.focus(client)["homed"], expected)
        if expected:
            return
        refused = self.move(client, 100)
        self.assertEqual(refused["error"], LENS + "NotHomed")
        self.assertEqual((refused["parameters"]["lens"], refused["parameters"]["axis"]), ("a", "focus"))
        reply = client.call(LENS + "Home", {"lens": "a", "axis": "focus"})
        self.assertTrue(reply["parameters"]["moves"][0]["reached"], reply)
        self.assertTrue(self.focus(client)["homed"])

    def kill_once(self, daemon, chance):
        """Returns what the file has to say about motion: True, False, or None where both are right; and the place."""
        with daemon.client() as client, daemon.client() as watcher:
            if chance.random() < 0.3:
                place = chance.randrange(0, 200)
                reply = self.move(client, place)
                self.assertTrue(reply["parameters"]["move"]["reached"], reply)
                time.sleep(chance.uniform(0, 0.01))
                return False, place
            # Half a second away: still under way when the axe falls.
            away = 3500 if self.focus(client)["position"] < 1500 else 0
            client.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": away}})
            time.sleep(chance.choice([0, chance.uniform(0, 0.003), chance.uniform(0, 0.1)]))
            if chance.random() < 0.5:
                return (True, None) if self.focus(watcher)["moving"] else (None, None)
            return None, None

    def test_killed_at_a_random_moment(self):
        chance = random.Random(20)
        seen = {True: 0, False: 0}
        expected = True
        for number in range(KILLS):
            daemon = self.start()
            try:
                with daemon.client() as client:
                    self.home_if_unknown(client, expected)
                in_motion, place = self.kill_once(daemon, chance)
            finally:
                daemon.kill()
            focus = self.remembered()
            with self.subTest(number=number, focus=focus):
                self.assertTrue(focus["known"])
                if in_motion is not None:
                    self.assertEqual(focus["inMotion"], in_motion)
                if place is not None:
                    self.assertEqual(focus["position"], place)
            expected = not focus["inMotion"]
            seen[focus["inMotion"]] += 1
        print(f"{KILLS} kills: {seen[True]} in motion, {seen[False]} at rest")
        self.assertGreater(seen[True], 0)
        self.assertGreater(seen[False], 0)

    def test_a_lens_that_lost_its_count_gets_it_back(self):
        focus = '[lens.focus]\nrestore = "near-zero"\n'
        daemon = self.start(focus)
        with daemon.client() as client:
            self.assertTrue(self.move(client, 700)["parameters"]["move"]["reached"])
        daemon.kill()
        daemon = self.start(focus)
        try:
            with daemon.client() as client:
                self.assertEqual(self.focus(client)["position"], 700)
        finally:
            daemon.kill()

    def test_a_damaged_file_is_told_of_and_nothing_is_known(self):
        daemon = self.start()
        daemon.kill()
        with open(os.path.join(self.state, "a.position.json"), "w", encoding="utf-8") as file:
            file.write('{"version": 1, "ax')
        daemon = self.start()
        try:
            asked = daemon.lensctl("focus", "a", "@100", "--json")
            told = json.loads(asked.stdout)
            self.assertEqual((asked.returncode, told["error"], told["lens"], told["axis"]),
                             (7, "not-homed", "a", "focus"))
            with daemon.client() as client:
                refused = client.call(LENS + "Autofocus", {"lens": "a"})  # names no axis
                self.assertEqual(refused["error"], LENS + "NotHomed")
                self.assertEqual((refused["parameters"]["lens"], refused["parameters"]["axis"]), ("a", "focus"))
                self.home_if_unknown(client, False)
            daemon.wait_log("a.position.json")
            self.assertFalse(self.remembered()["inMotion"])
        finally:
            daemon.kill()

    def test_without_a_folder_nothing_is_written(self):
        daemon = Daemon(config=self.config)
        with daemon.client() as client:
            self.assertTrue(self.move(client, 50)["parameters"]["move"]["reached"])
        daemon.kill()
        self.assertFalse(os.path.exists(self.state))


if __name__ == "__main__":
    unittest.main()
