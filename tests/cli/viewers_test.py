#!/usr/bin/env python3
"""A chart looks the same in a viewer without CSS variables as in a browser: each is drawn by rsvg-convert and by Chromium, both pictures
are made eight times as small, where fonts no longer matter, and no more than a part in MOST of their places may differ by more than
LEVELS of 255 in any colour. Charts are those of lensctl and all that are committed in docs/, which lens-bench drew."""
import base64
import glob
import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from lensctl_case import LENSCTL

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
LEVELS, MOST = 40, 0.002
LENS = ["--focal-length", "50mm"]
PLAN = ["plan", *LENS, "--f-number", "2.8..16", "--extension", "0mm..8mm"]
COMMANDS = {
    "dof": (["dof", *LENS, "--f-number", "2.8", "--focus", "2m", "--blur-limit", "8um"], "--plot"),
    "blur": (["blur", *LENS, "--f-number", "2.8", "--focus", "2m", "--at", "1m..4m"], "--plot"),
    "rays": (["blur", *LENS, "--f-number", "2.8", "--focus", "2m", "--at", "1m..4m"], "--rays"),
    "conjugate": (["conjugate", *LENS, "--point", "0mm,10mm,2m"], "--plot"),
    "plan": ([*PLAN, "--sharp", "face=1m..1.2m:30um", "--blurred", "wall=4m..inf:60um"], "--plot"),
    "stack": ([*PLAN, "--stack", "--sharp", "0.6m..2m:20um"], "--plot"),
}
# As charts of documents were before: colours and lines only in rules with variables, which rsvg-convert does not know.
WITH_VARIABLES = """<svg viewBox="0 0 720 300" xmlns="http://www.w3.org/2000/svg"><style>:root{--a:#0062a3;--b:#c24e00;--g:#59636b}
.grid{stroke:var(--g)}.s0{fill:var(--a)}.s1{fill:var(--b)}.l{fill:none;stroke:var(--b);stroke-width:6}</style>
<line x1="20" y1="150" x2="700" y2="150" class="grid"/><rect x="40" y="40" width="300" height="60" class="s0"/>
<rect x="380" y="40" width="300" height="60" class="s1"/><path d="M40 280L360 180L680 280" class="l"/></svg>"""

PAGE = """<!DOCTYPE html><body><script>
const pairs = %s, result = {};
const load = (address) => new Promise((done, failed) => {
  const image = new Image(); image.onload = () => done(image); image.onerror = failed; image.src = address; });
function drawn(image, width, height) {
  const canvas = document.createElement("canvas"); canvas.width = width; canvas.height = height;
  const context = canvas.getContext("2d", { willReadFrequently: true });
  context.fillStyle = "#fff"; context.fillRect(0, 0, width, height); context.drawImage(image, 0, 0, width, height);
  return canvas;
}
/** Halved three times, each time by means of four. */
function small(image, width, height) {
  let canvas = drawn(image, width, height);
  for (let i = 0; i < 3; ++i) canvas = drawn(canvas, width = width / 2, height = height / 2);
  return canvas.getContext("2d").getImageData(0, 0, width, height).data;
}
(async () => {
  for (const [name, svg, png] of pairs) {
    const picture = await load(png), width = picture.width & ~7, height = picture.height & ~7;
    const a = small(picture, width, height), b = small(await load(svg), width, height);
    let off = 0;
    for (let i = 0; i < a.length; i += 4)
      if (Math.max(Math.abs(a[i] - b[i]), Math.abs(a[i + 1] - b[i + 1]), Math.abs(a[i + 2] - b[i + 2])) > %d) ++off;
    result[name] = off / (a.length / 4);
  }
  document.body.textContent = "RESULT" + JSON.stringify(result) + "END";
})();
</script></body>"""


def data_url(kind, data):
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def parts_that_differ(charts):
    """For each name of an SVG (bytes) the part of its places where both pictures differ."""
    pairs = []
    for name, svg in charts.items():
        png = subprocess.run(["rsvg-convert"], input=svg, capture_output=True, check=True, timeout=60).stdout
        pairs.append([name, data_url("image/svg+xml", svg), data_url("image/png", png)])
    with tempfile.TemporaryDirectory() as folder:
        page = os.path.join(folder, "page.html")
        with open(page, "w", encoding="utf-8") as file:
            file.write(PAGE % (json.dumps(pairs), LEVELS))
        shown = subprocess.run([os.environ.get("CHROMIUM", "chromium"), "--headless", "--no-sandbox", "--disable-gpu", "--force-device-scale-factor=1",
                                f"--user-data-dir={folder}/profile", "--virtual-time-budget=60000", "--dump-dom", "file://" + page],
                               capture_output=True, text=True, check=True, timeout=120).stdout
    found = re.search("RESULT(.*)END", shown)
    assert found, shown[-2000:]
    return json.loads(found[1])


class Viewers(unittest.TestCase):
    def test_charts_look_as_in_a_browser(self):
        charts = {}
        with tempfile.TemporaryDirectory() as folder:
            for name, (words, option) in COMMANDS.items():
                path = os.path.join(folder, name + ".svg")
                subprocess.run([LENSCTL, *words, option, path], check=True, capture_output=True, timeout=60)
                with open(path, "rb") as file:
                    charts["lensctl " + name] = file.read()
        for path in sorted(glob.glob(os.path.join(ROOT, "docs", "**", "*.svg"), recursive=True)):
            with open(path, "rb") as file:
                charts[os.path.relpath(path, ROOT)] = file.read()
        self.assertGreater(len(charts), 15)
        charts["with variables"] = WITH_VARIABLES.encode()
        parts = parts_that_differ(charts)
        self.assertEqual(set(parts), set(charts))
        self.assertGreater(parts.pop("with variables"), 20 * MOST)  # this comparison sees what it has to
        print({name: round(part, 4) for name, part in parts.items()})
        for name, part in parts.items():
            with self.subTest(chart=name):
                self.assertLessEqual(part, MOST)

    def test_titles_and_colours_are_in_the_file(self):
        for path in glob.glob(os.path.join(ROOT, "docs", "**", "*.svg"), recursive=True):
            with self.subTest(chart=os.path.relpath(path, ROOT)), open(path, encoding="utf-8") as file:
                svg = file.read()
                self.assertTrue('font-weight="bold"' in svg and "prefers-color-scheme: dark" in svg)
                self.assertFalse("var(--" in svg or "class=" in svg)


if __name__ == "__main__":
    for program in ("rsvg-convert", os.environ.get("CHROMIUM", "chromium")):
        if shutil.which(program) is None:
            print(f"skipped: {program} is not installed; script/bootstrap installs it")
            sys.exit(77)
    unittest.main()
