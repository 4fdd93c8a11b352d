"""A lease keeps everybody else from moving a lens, and ends with its connection or its time."""
import json
import os
import random
import signal
import subprocess
import sys
import time
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "interface"))
from harness import BIN, HERE, LENS, PATIENCE, DaemonTest  # noqa: E402
from interface_test import Definition  # noqa: E402


def drawn(draw, definition, kind, never=()):
    """A value of a type of the interface; of what may be left out, half is, and the fields that are named always are."""
    if isinstance(kind, str):
        if kind in definition.types:
            return drawn(draw, definition, definition.types[kind])
        return {"bool": draw.random() < 0.5, "int": draw.randint(0, 5), "float": draw.uniform(0.5, 5), "object": {},
                "string": draw.choice(["x", "y"])}[kind]
    what, inner = kind
    if what == "enum":
        return draw.choice(inner)
    if what == "struct":
        return {name: drawn(draw, definition, given[1] if given[0] == "?" else given) for name, given in inner.items()
                if name not in never and (given[0] != "?" or draw.random() < 0.5)}
    if what == "?":
        return drawn(draw, definition, inner)
    values = [drawn(draw, definition, inner) for _ in range(draw.randint(0, 2))]
    return values if what == "[]" else {f"k{number}": value for number, value in enumerate(values)}


class Lease(DaemonTest):
    def move(self, client, native, **parameters):
        return client.call(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": native}, **parameters})

    def lease_of(self, lens):
        with self.daemon.client() as client:
            return client.call(LENS + "Status", {"lens": lens})["parameters"]["lenses"][0]["lease"]

    def take(self, client, **parameters):
        return client.call(LENS + "TakeLease", {"lens": "a", **parameters})["parameters"]["lease"]

    def test_others_cannot_move_and_can_stop(self):
        with self.daemon.client() as owner, self.daemon.client() as other:
            key = self.take(owner)
            self.assertEqual(self.move(other, 10)["error"], LENS + "Leased")
            for method, parameters in (("Home", {}), ("Autofocus", {}), ("AutofocusBegin", {}),
                                       ("Plan", {"request": {}, "apply": True})):
                reply = other.call(LENS + method, {"lens": "a", **parameters})
                self.assertEqual(reply.get("error"), LENS + "Leased", method)
            self.assertEqual(other.call(LENS + "Stop", {"lens": "a"}), {"parameters": {}})
            self.assertNotIn("error", other.call(LENS + "Plan", {"lens": "a", "request": {}}))
            self.assertNotIn("error", other.call(LENS + "Status", {"lens": "a"}))
            self.assertTrue(self.move(owner, 20)["parameters"]["move"]["reached"])
            self.assertTrue(self.move(other, 30, lease=key)["parameters"]["move"]["reached"])
            self.assertEqual(self.move(other, 40, lease="wrong")["error"], LENS + "Leased")
            self.assertEqual(other.call(LENS + "TakeLease", {"lens": "a"})["error"], LENS + "Leased")
            self.assertEqual(other.call(LENS + "DropLease", {"lens": "a"})["error"], LENS + "Leased")
            moved = other.call(LENS + "Move", {"lens": "b", "axis": "focus", "target": {"position": 5}})
            self.assertTrue(moved["parameters"]["move"]["reached"])  # another lens is not concerned
            self.assertEqual(owner.call(LENS + "DropLease", {"lens": "a"}), {"parameters": {}})
            self.assertTrue(self.move(other, 50)["parameters"]["move"]["reached"])

    def test_what_is_kept_of_the_lens_is_covered_too(self):
        changes = {"Calibrate": {"remove": True}, "PresetSave": {"label": "x"}, "PresetRemove": {"label": "x"},
                   "ResetFaults": {}, "SetExposure": {"exposureMs": 5}, "MeasureBacklash": {"size": 0}}
        with self.daemon.client() as owner, self.daemon.client() as other:
            key = self.take(owner)
            self.assertTrue(self.move(owner, 20)["parameters"]["move"]["reached"])  # at rest
            for method, parameters in changes.items():
                reply = other.call(LENS + method, {"lens": "a", **parameters})
                self.assertEqual(reply.get("error"), LENS + "Leased", method)
                reply = other.call(LENS + method, {"lens": "a", "lease": key, **parameters})
                self.assertNotIn("error", reply, method)
            for method, parameters in changes.items():
                self.assertNotIn("error", owner.call(LENS + method, {"lens": "a", **parameters}), method)

    def test_oneway_calls_of_its_connection_count(self):
        with self.daemon.client() as owner:
            self.take(owner)
            for native in (21, 22):
                owner.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": native}}, oneway=True)
                self.wait_for(lambda wanted=native: self.position()["position"] == wanted)

    def test_a_stop_that_holds_does_not_keep_its_owner_from_ending_it(self):
        with self.daemon.client() as owner:
            self.take(owner)
            owner.call(LENS + "Stop", {"lens": "a", "latch": True})
            self.assertEqual(self.move(owner, 10)["error"], LENS + "Cancelled")
            self.assertEqual(owner.call(LENS + "ResetFaults", {"lens": "a"}), {"parameters": {}})
            self.assertTrue(self.move(owner, 10)["parameters"]["move"]["reached"])

    def test_administrators_take_it_over(self):
        with self.daemon.client() as owner, self.daemon.client() as other:  # both of root, or of the daemon's own user
            old = self.take(owner)
            refused = other.call(LENS + "TakeLease", {"lens": "a"})
            self.assertEqual(refused["error"], LENS + "Leased")
            new = self.take(other, takeOver=True)
            self.assertNotEqual(old, new)
            self.assertTrue(self.move(other, 31)["parameters"]["move"]["reached"])
            self.assertEqual(self.move(owner, 32)["error"], LENS + "Leased")
            self.assertEqual(self.move(owner, 32, lease=old)["error"], LENS + "Leased")
            self.assertEqual(owner.call(LENS + "DropLease", {"lens": "a", "lease": old})["error"], LENS + "Leased")
        with self.daemon.client() as free:
            self.wait_for(lambda: "error" not in self.move(free, 33))
            taken = self.daemon.lensctl("lease", "take", "a", "--for", "60s", "--take-over", "--json")
            self.assertEqual(taken.returncode, 0, taken.stderr)
            key = json.loads(taken.stdout)["lease"]
            self.assertEqual(free.call(LENS + "DropLease", {"lens": "a", "lease": key}), {"parameters": {}})

    def test_under_an_autofocus_it_is_refused_or_ends_it_as_asked(self):
        with self.daemon.client() as focuser, self.daemon.client() as other:
            focuser.send(LENS + "Autofocus", {"lens": "a"}, more=True)
            self.assertNotIn("error", focuser.receive())  # it has begun
            refused = other.call(LENS + "TakeLease", {"lens": "a"})
            if refused.get("error") is None:
                self.skipTest("the autofocus was over before it could be disturbed")
            self.assertEqual((refused["error"], refused["parameters"]["activity"]), (LENS + "Busy", "autofocus"))
            self.assertIn(f"[{os.getpid()}] of user", refused["parameters"]["holder"])
            self.assertIsNone(self.lease_of("a"))
            key = self.take(other, stop=True)
            while "error" not in (last := focuser.receive()):
                self.assertTrue(last.get("continues"), "it ended well, though it was stopped")
            self.assertEqual(last["error"], LENS + "Cancelled")
            self.assertEqual(self.move(focuser, 5)["error"], LENS + "Leased")
            other.call(LENS + "DropLease", {"lens": "a", "lease": key})

    def test_an_autofocus_of_its_own_goes_on(self):
        with self.daemon.client() as owner:
            session = owner.call(LENS + "AutofocusBegin", {"lens": "a"})["parameters"]["session"]
            self.take(owner)
            self.assertNotIn("error", owner.call(LENS + "AutofocusEnd", {"session": session}))

    def test_it_ends_with_its_connection(self):
        with self.daemon.client() as other:
            with self.daemon.client() as owner:
                self.take(owner)
                self.assertEqual(self.move(other, 10)["error"], LENS + "Leased")
            self.wait_for(lambda: "error" not in self.move(other, 10))

    def test_it_ends_with_its_time_and_not_with_its_connection(self):
        with self.daemon.client() as other:
            with self.daemon.client() as owner:
                self.take(owner, forMs=1500)
            self.assertEqual(self.move(other, 10)["error"], LENS + "Leased")
            self.wait_for(lambda: "error" not in self.move(other, 10))

    def test_with_a_time_it_is_its_connection_s_as_well(self):
        with self.daemon.client() as other:
            with self.daemon.client() as owner:
                key = self.take(owner, forMs=60000)
                self.assertTrue(self.move(owner, 20)["parameters"]["move"]["reached"])
                self.assertEqual(self.take(owner, forMs=60000), key)  # renewed
                self.assertEqual(self.move(other, 30)["error"], LENS + "Leased")
                owner.call(LENS + "DropLease", {"lens": "a"})
                self.assertTrue(self.move(other, 30)["parameters"]["move"]["reached"])
                key = self.take(owner, forMs=60000)
            for _ in range(50):  # its connection has closed, and no new one is taken for it
                with self.daemon.client() as another:
                    self.assertEqual(self.move(another, 40)["error"], LENS + "Leased")
            self.assertEqual(other.call(LENS + "DropLease", {"lens": "a", "lease": key}), {"parameters": {}})

    def test_what_is_over_is_not_what_is_waited_for(self):
        with self.daemon.client() as focuser, self.daemon.client() as mover, self.daemon.client() as other:
            near = {"from": {"position": 1100}, "to": {"position": 1500}}  # its motors are slow
            self.assertNotIn("error", focuser.call(LENS + "Autofocus", {"lens": "a", "range": near}))
            time.sleep(1.0)
            began = time.monotonic()
            mover.send(LENS + "Move", {"lens": "a", "axis": "focus", "target": {"position": 4000}})
            busy = {}
            while busy.get("error") != LENS + "Busy":
                busy = other.call(LENS + "PresetSave", {"lens": "a", "label": "m"})
                self.assertLess(time.monotonic(), began + 5)
            self.assertEqual(busy["parameters"]["activity"], "moving")
            self.assertLessEqual(busy["parameters"]["sinceMs"], 1e3 * (time.monotonic() - began))
            mover.receive()

    def test_the_refused_hear_who_has_it_and_for_how_long(self):
        me = f"[{os.getpid()}] of user {os.getuid()}"
        with open("/proc/self/comm", encoding="utf-8") as file:
            me = file.read().rstrip("\n") + me
        with self.daemon.client() as owner, self.daemon.client() as other:
            self.take(owner)
            for reply in (self.move(other, 10), other.call(LENS + "TakeLease", {"lens": "a"}),
                          other.call(LENS + "DropLease", {"lens": "a"})):
                told = reply["parameters"]
                self.assertEqual((told["lens"], told["holder"], told["remainingMs"]), ("a", me, None))
                self.assertIn(me + " until it lets go", told["message"])
            for _ in range(20):
                time_ms = 10 ** random.uniform(3.5, 7.9)
                begun = time.monotonic()
                key = self.take(owner, forMs=time_ms)
                told = self.move(other, 10)["parameters"]
                passed_ms = 1e3 * (time.monotonic() - begun)
                self.assertEqual((told["lens"], told["holder"]), ("a", me))
                self.assertTrue(time_ms - passed_ms <= told["remainingMs"] <= time_ms, told)
                owner.call(LENS + "DropLease", {"lens": "a", "lease": key})

    def test_a_key_drops_it_from_anywhere(self):
        with self.daemon.client() as owner, self.daemon.client() as other:
            key = self.take(owner, forMs=60000)
            self.assertEqual(other.call(LENS + "DropLease", {"lens": "a", "lease": key}), {"parameters": {}})
            self.assertTrue(self.move(other, 60)["parameters"]["move"]["reached"])
            self.assertEqual(other.call(LENS + "DropLease", {"lens": "a"}), {"parameters": {}})  # harmless

    def test_times_that_make_no_sense(self):
        with self.daemon.client() as client:
            for time in (0, -5, 1e12):
                self.assertEqual(client.call(LENS + "TakeLease", {"lens": "a", "forMs": time})["error"],
                                 LENS + "InvalidRequest")

    def test_lensctl(self):
        taken = self.daemon.lensctl("lease", "take", "a", "--for", "60s", "--json")
        key = json.loads(taken.stdout)["lease"]
        refused = self.daemon.lensctl("focus", "a", "@70")
        self.assertEqual((refused.returncode, refused.stdout), (9, ""))
        refused = self.daemon.lensctl("focus", "a", "@70", "--json")
        self.assertEqual(refused.returncode, 9)
        told = json.loads(refused.stdout)
        self.assertEqual((told["error"], told["lens"]), ("leased", "a"))
        self.assertRegex(told["holder"], rf"^lensctl\[\d+\] of user {os.getuid()}$")
        self.assertTrue(50e3 < told["remainingMs"] <= 60e3, told)
        self.assertIn(told["holder"], refused.stderr)
        environment = {**os.environ, "LENSD_LEASE": key}
        self.assertEqual(self.daemon.lensctl("focus", "a", "@70", env=environment).returncode, 0)
        self.assertEqual(self.daemon.lensctl("lease", "drop", "a").returncode, 9)
        self.assertEqual(self.daemon.lensctl("lease", "drop", "a", env=environment).returncode, 0)
        self.assertEqual(self.daemon.lensctl("focus", "a", "@80").returncode, 0)

    def test_lensctl_holds_it_until_it_is_ended(self):
        holder = subprocess.Popen([os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "lease", "take", "a"],
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        with holder, self.daemon.client() as other:
            self.assertEqual(len(holder.stdout.readline().strip()), 16)
            self.assertEqual(self.move(other, 10)["error"], LENS + "Leased")
            holder.send_signal(signal.SIGINT)
            self.assertIn(holder.wait(timeout=60), (130, -signal.SIGINT))  # it may not wait for signals yet
            self.wait_for(lambda: "error" not in self.move(other, 10))


class KeyOfLensctl(DaemonTest):
    def test_undo_and_forget_what_was_learned_take_it(self):
        key = json.loads(self.daemon.lensctl("lease", "take", "a", "--for", "60s", "--json").stdout)["lease"]
        environment = {**os.environ, "LENSD_LEASE": key}
        for position in ("@40", "@60"):
            self.assertEqual(self.daemon.lensctl("focus", "a", position, env=environment).returncode, 0)
        for command in (("undo", "a"), ("learned", "forget", "a")):
            refused = self.daemon.lensctl(*command)
            self.assertEqual(refused.returncode, 9, refused)
            taken = self.daemon.lensctl(*command, env=environment)
            self.assertEqual(taken.returncode, 0, taken)
        self.assertEqual(self.daemon.lensctl("lease", "drop", "a", env=environment).returncode, 0)


class EveryDrivingMethod(DaemonTest):
    def test_takes_it(self):
        """Those that have a parameter `lease` in the interface file, with parameters that are drawn by their types."""
        with open(os.path.join(HERE, "..", "..", "proto", "io.lensd.Lens.varlink"), encoding="utf-8") as file:
            definition = Definition(file.read())
        driving = [name for name, (given, _) in definition.methods.items() if "lease" in given[1]]
        self.assertGreaterEqual(len(driving), 23)
        draw = random.Random(os.environ.get("LENSD_TEST_SEED", 38))
        for name in [*driving, *draw.choices(driving, k=1000 if os.environ.get("LENSD_TEST_LEVEL") == "long" else 0)]:
            parameters = {**drawn(draw, definition, definition.methods[name][0], {"lease", "takeOver"}), "lens": "a"}
            if name == "Plan":
                parameters["apply"] = True  # a plan that is not applied drives nothing
            with self.subTest(method=name, parameters=parameters), self.daemon.client() as owner:
                key = owner.call(LENS + "TakeLease", {"lens": "a", "forMs": 600000})["parameters"]["lease"]
                refused = self.lensctl_while_stopping(name, parameters, "")
                taken = self.lensctl_while_stopping(name, parameters, key)
                owner.call(LENS + "DropLease", {"lens": "a", "lease": key})
                self.assertEqual((refused.returncode, json.loads(refused.stdout)["error"]), (9, "leased"), refused)
                self.assertNotEqual(taken.returncode, 9, taken)
                self.assertNotIn("leased", taken.stdout + taken.stderr)

    def lensctl_while_stopping(self, method, parameters, key):
        """`lensctl call` with a key in its environment. What it sets going is stopped until it has ended: the answer is
        what counts, and a measurement takes long."""
        process = subprocess.Popen(
            [os.path.join(BIN, "lensctl"), "--socket", self.daemon.socket, "--json", "call", method, json.dumps(parameters)],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "LENSD_LEASE": key})
        deadline = time.monotonic() + 60 * PATIENCE
        with process, self.daemon.client() as client:
            while process.poll() is None and time.monotonic() < deadline:
                client.call(LENS + "Stop", {"lens": "a"})
                time.sleep(0.01)
            self.assertIsNotNone(process.poll(), "it never ended")
            return subprocess.CompletedProcess(process.args, process.returncode, *process.communicate())

if __name__ == "__main__":
    unittest.main()
