"""lens-bench evidence keeps what was run and does not run it again; report draws it; what is damaged is told."""
import csv
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
