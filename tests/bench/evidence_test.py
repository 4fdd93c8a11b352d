"""lens-bench evidence keeps what was run and does not run it again; report draws it; what is damaged is told."""
import csv
import json
import os
import subprocess
import sys
import tempfile
import unittest

BENCH = sys.argv.pop(1)


def run(*words):
    return subprocess.run([BENCH, *words], capture_output=True, text=True, timeout=120, check=False)


class EvidenceTest(unittest.TestCase):
    def test_runs_once_and_draws(self):
        with tempfile.TemporaryDirectory() as folder:
            runs, page = os.path.join(folder, "runs"), os.path.join(folder, "page")
            first = run("evidence", "--family", "move", "-o", runs)
            self.assertEqual((first.returncode, first.stderr.count("\n")), (0, 1), first.stderr)
            path = os.path.join(runs, "move", "voice-coil.csv")
            with open(path, encoding="utf-8", newline="") as file:
                rows = list(csv.DictReader(file))
            self.assertGreater(len(rows), 100)
            for column in ("settings", "commit", "machine", "compiler", "date", "n"):
                self.assertTrue(all(row[column] for row in rows), column)
            inode = os.stat(path).st_ino
            again = run("evidence", "--family", "move", "-o", runs)
            self.assertEqual((again.returncode, again.stderr), (0, ""))
            self.assertEqual(os.stat(path).st_ino, inode, "run again though it was there")
            other = run("evidence", "--family", "move", "-o", runs, "--quick")
            self.assertEqual((other.returncode, other.stderr.count("\n")), (0, 1), "other counts are another question")
            drawn = run("report", "--evidence", runs, "-o", page)
            self.assertEqual(drawn.returncode, 0, drawn.stderr)
            self.assertLessEqual({"report.html", "evidence.csv", "evidence.json", "move.svg"}, set(os.listdir(page)))
            kept = run("report", "--evidence", runs, "-o", page, "--baseline", os.path.join(page, "evidence.csv"))
            self.assertEqual(kept.returncode, 0, kept.stdout)

    def test_drivers_tell_what_their_devices_did(self):
        def rows(*words):
            done = run("drivers", "--json", *words)
            self.assertEqual(done.returncode, 0, done.stderr)
            return json.loads(done.stdout)

        speed = {(row["driver"], row["measure"]): row["p50"] for row in rows("--only", "speed", "--count", "3")}
        drivers = {driver for driver, _ in speed}
        # GenICam has one port: another test may hold it.
        self.assertLessEqual({"Modbus TCP", "Modbus RTU", "LensConnect", "UVC"}, drivers)
        for driver in drivers:
            # How they compare is for many counts on a quiet machine: medians of three, beside other tests, scatter tenfold.
            self.assertGreater(min(speed[driver, "reading"], speed[driver, "bare exchange"]), 0.0, driver)
            self.assertGreaterEqual(speed[driver, "move"], speed[driver, "travel"], driver)
            self.assertGreater(speed[driver, "travel"], speed[driver, "command"], driver)
            self.assertLessEqual(speed[driver, "error"], 1.0, driver)
        weather = rows("--only", "weather", "--moves", "2")
        self.assertEqual(len(weather), 4 * 3 * 5)
        for row in weather:
            self.assertEqual(row["within"] + row["refused"] + row["false"], row["n"], row)
            self.assertEqual(row["false"], 0, row)
            if row["value"] == 0 and row["driver"] in ("LensConnect", "UVC"):  # the others' deadlines are this machine's
                self.assertEqual(row["within"], row["n"], row)
        # The wire is spoilt: the worst values are felt.
        for sweep in {row["sweep"] for row in weather}:
            of = [row for row in weather if row["sweep"] == sweep]
            fine, worst = (sum(row["p50"] for row in of if row["value"] == value) for value in (0, max(r["value"] for r in of)))
            self.assertNotEqual(fine, worst, sweep)

    def test_planner_in_its_regimes_and_models(self):
        done = run("plan", "--json", "--regimes", "60", "--rounds", "1")
        self.assertEqual(done.returncode, 0, done.stderr)
        rows = json.loads(done.stdout)
        ours = [row for row in rows if row["method"] == "lensd"]
        self.assertEqual(len(ours), 4)
        for row in ours:
            self.assertEqual((row["problems"], row["wrong"], row["over"], row["refused"]), (60, 0, 0, 0), row)
        self.assertGreater(sum(row["wrong"] for row in rows if row["method"] == "bisection"), 0, "the regimes are easy")
        done = run("plan", "--json", "--needs", "20")
        self.assertEqual(done.returncode, 0, done.stderr)
        kinds = json.loads(done.stdout)
        self.assertEqual(sum(kind["beyond"] for kind in kinds), 0)
        chosen = " ".join(kind["models"] for kind in kinds)
        for model in ("pinhole", "thin", "diffraction", "calibrated"):
            self.assertIn(model, chosen)

    def test_says_what_is_damaged(self):
        with tempfile.TemporaryDirectory() as folder:
            os.makedirs(os.path.join(folder, "move"))
            path = os.path.join(folder, "move", "x.csv")
            with open(path, "w", encoding="utf-8") as file:
                file.write("this,is\nno,evidence\n")
            damaged = run("report", "--evidence", folder, "-o", os.path.join(folder, "page"))
            self.assertEqual(damaged.returncode, 65)
            self.assertIn(path + ":1", damaged.stderr)


if __name__ == "__main__":
    unittest.main()
