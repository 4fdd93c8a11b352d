"""The documents are true: links lead somewhere, what is shown with a prompt runs as printed, and every key that the code reads is in
the reference of its file, with its default and choices."""
import glob
import json
import os
import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "daemon"))
from harness import BIN, Daemon  # noqa: E402

ROOT = os.path.realpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", ".."))
PAGES = sorted(path for pattern in ("*.md", "docs/*.md", "docs/*/*.md", "scenes/*.md", "*/README.md", "clients/*/*.md")
               for path in glob.glob(os.path.join(ROOT, pattern)))


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def prose(text):
    """Without blocks and spans of code."""
    return re.sub(r"`[^`\n]*`", "", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S))


def anchors(text):
    """What the headings of a page may be linked by, as GitHub makes it."""
    found = set()
    for heading in re.findall(r"^#+ (.*)$", re.sub(r"^```.*?^```", "", text, flags=re.M | re.S), re.M):
        plain = re.sub(r"[^\w\- ]", "", re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).lower()).replace(" ", "-")
        number = 0
        while (name := plain + (f"-{number}" if number else "")) in found:
            number += 1
        found.add(name)
    return found


class Links(unittest.TestCase):
    def test_every_link_leads_somewhere(self):
        count = 0
        for page in PAGES:
            for target in re.findall(r"\]\(([^)\s]+)\)", prose(read(page))):
                if re.match(r"[a-z]+:", target):
                    continue
                with self.subTest(page=os.path.relpath(page, ROOT), link=target):
                    path, _, anchor = target.partition("#")
                    full = os.path.join(os.path.dirname(page), path) if path else page
                    self.assertTrue(os.path.exists(full), "no such file")
                    if anchor:
                        self.assertIn(anchor, anchors(read(full)))
                    count += 1
        self.assertGreater(count, 60)

    def test_every_page_is_found_from_the_readme(self):
        seen, todo = set(), [os.path.join(ROOT, "README.md")]
        while todo:
            page = os.path.realpath(todo.pop())
            if page in seen or not page.endswith(".md"):
                continue
            seen.add(page)
            todo += [os.path.join(os.path.dirname(page), link.partition("#")[0])
                     for link in re.findall(r"\]\(([^)\s]+)\)", prose(read(page))) if not re.match(r"[a-z]+:|#", link)]
        for page in glob.glob(os.path.join(ROOT, "docs", "**", "*.md"), recursive=True):
            if not page.endswith("interface.head.md"):  # a part of interface.md
                self.assertIn(os.path.realpath(page), seen)


def shown_commands(page):
    """Each command behind a prompt, and the lines printed below it."""
    for block in re.findall(r"^```\w*\n(.*?)^```", read(page), re.M | re.S):
        if not block.startswith("$ "):
            continue
        for part in re.split(r"^\$ ", block, flags=re.M)[1:]:
            command, _, printed = part.replace("\\\n", " ").partition("\n")
            yield command, printed


def without_numbers(text):
    """How long a move took and the last digits of what was measured are not what a page promises."""
    return re.sub(r"[-+]?\d+(\.\d+)?", "#", re.sub(r"\d (m?s)\b", "0 s", text)).split()


class Commands(unittest.TestCase):
    """Offline commands print what the page shows, to the letter; those of a lens the same words."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-docs-")
        cls.addClassCleanup(cls.folder.cleanup)
        for name in os.listdir(os.path.join(ROOT, "scenes")):
            os.symlink(os.path.join(ROOT, "scenes", name), os.path.join(cls.folder.name, name))

    def daemon(self, config):
        daemon = Daemon(config=read(config).replace('scene = "', f'scene = "{os.path.join(ROOT, os.path.dirname(config))}/'))
        self.addCleanup(daemon.kill)
        return daemon

    def run_page(self, page, config):
        daemon = self.daemon(config)
        count = 0
        for command, printed in shown_commands(page):
            with self.subTest(command=command):
                words = shlex.split(command)
                self.assertEqual(words[0], "lensctl")
                done = subprocess.run([os.path.join(BIN, "lensctl"), *words[1:]], capture_output=True, text=True, check=False, timeout=120,
                                      cwd=self.folder.name, env={**os.environ, "LENSD_SOCKET": daemon.socket})
                self.assertIn(done.returncode, (0, 1, 6), done.stderr)  # 6: out of reach, which the tutorial shows
                told = done.stdout + done.stderr
                if printed and re.search(r"--focal-length|--aperture", command):
                    self.assertEqual(told.strip().splitlines(), printed.strip().splitlines())
                elif printed:
                    self.assertEqual(without_numbers(told), without_numbers(printed))
                count += 1
        return count

    def test_readme(self):
        self.assertGreaterEqual(self.run_page("README.md", "docs/demo/lensd.toml"), 8)

    def test_tutorial(self):
        self.assertGreaterEqual(self.run_page("docs/tutorial.md", "docs/demo/lensd.toml"), 12)

    def test_focus_at(self):
        self.assertEqual(self.run_page("docs/focus-at.md", "docs/demo/lensd.toml"), 7)

    def test_the_first_configuration_shown_is_taken(self):
        text = re.search(r"^```toml\n(.*?)^```", read("docs/configuration.md"), re.M | re.S).group(1)
        with tempfile.NamedTemporaryFile("w", suffix=".toml", encoding="utf-8") as file:
            file.write(text.replace("/usr/share/doc/lensd/examples", os.path.join(ROOT, "systemd/examples")))
            file.flush()
            done = subprocess.run([os.path.join(BIN, "lensd"), "--config", file.name, "--check-config"], capture_output=True, text=True,
                                  check=False, timeout=60)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_json_shown_is_json(self):
        for page in PAGES:
            for block in re.findall(r"^```json\n(.*?)^```", read(page), re.M | re.S):
                with self.subTest(page=page):
                    json.loads(block)


class Manuals(unittest.TestCase):
    """The pages of docs/ as manual pages."""

    @unittest.skipUnless(shutil.which("lowdown"), "lowdown is not installed")
    def test_they_read_without_a_warning(self):
        for page, name, section, heading, has in (("docs/configuration.md", "lensd.toml", "5", [], "backlash"),
                                                  ("scenes/README.md", "lens-scene", "5", ["Keys"], "breathing"),
                                                  ("docs/interface.md", "io.lensd.Lens", "7", [], "PresetRecall")):
            with self.subTest(page=page):
                made = subprocess.run([os.path.join(ROOT, "script", "manual"), os.path.join(ROOT, page), name, section, "what it is", *heading],
                                      capture_output=True, text=True, check=True)
                self.assertIn(has, made.stdout)
                self.assertNotIn("](", made.stdout)
                if shutil.which("man"):
                    read_by_man = subprocess.run(["man", "--warnings", "-l", "-"], input=made.stdout, capture_output=True, text=True,
                                                 check=False, env={**os.environ, "MANWIDTH": "80", "LC_ALL": "C.UTF-8", "MANPAGER": "cat"})
                    self.assertEqual((read_by_man.returncode, read_by_man.stderr), (0, ""))
                    self.assertIn(f"{name} - what it is", read_by_man.stdout)


# Which page has the keys that a source reads.
REFERENCES = {
    "docs/configuration.md": ["daemon/config/config.cpp", "daemon/config/lens_models.cpp", "rig/common/config.cpp", "sim/driver.cpp"],
    "docs/drivers/aravis.md": ["drivers/aravis/config.cpp"],
    "docs/drivers/uvc.md": ["drivers/uvc/config.cpp"],
    "docs/drivers/v4l2.md": ["drivers/v4l2/config.cpp"],
    "docs/drivers/lensconnect.md": ["drivers/lensconnect/driver.cpp"],
    "docs/drivers/modbus.md": ["daemon/config/references.cpp", "drivers/modbus/driver.cpp", "drivers/modbus/link.cpp"],
    "drivers/modbus/profiles/generic.toml": ["drivers/modbus/profile.cpp"],
    "docs/calibration.md": ["rig/calibration/calibration.cpp", "rig/calibration/focus_shift.cpp", "rig/calibration/focus_at_file.cpp"],
    "docs/refocus.md": ["rig/procedures/focus_drift.cpp"],
    "docs/autofocus-measured.md": ["rig/autofocus/learned_slope.cpp"],
    "scenes/README.md": ["sim/scene/scene.cpp", "sim/scene/scene_lens.cpp", "sim/scene/scene_surfaces.cpp", "sim/scene/scene_parts.h"],
}
# Read from files that lensd alone writes, or between rooms of lensd.
NOT_FOR_PEOPLE = {"profiles"}
READS = r"\b\w+\.(Number|RequiredNumber|OptionalNumber|Integer|Boolean|Text|RequiredText|OptionalText|Choice|OptionalNumbers|OptionalPath|" \
        r"Table|Tables|Any)\(\"(\w+)\"(?:,\s*\{((?:\"[\w-]+\",?\s*)+)\})?(?:,\s*([-\d.'e]+|true|false|\"[\w-]*\"))?"


def reads(source):
    """(key, how, choices, default) of each read with a literal key."""
    for how, key, choices, default in re.findall(READS, read(source)):
        yield key, how, re.findall(r"\"([\w-]+)\"", choices), default
    for how, key in re.findall(r"\b(Read\w+)\(read_?, \"(\w+)\"", read(source)):
        yield key, how, [], ""


class Keys(unittest.TestCase):
    def test_every_key_is_in_the_reference_of_its_file(self):
        count = 0
        for page, sources in REFERENCES.items():
            text = read(page)
            for source in sources:
                for key, _, choices, _ in reads(source):
                    if key in NOT_FOR_PEOPLE:
                        continue
                    with self.subTest(page=page, source=source, key=key):
                        for word in [key, *choices]:
                            self.assertTrue(re.search(rf"(?<![\w-]){re.escape(word)}(?![\w-])", text), f"{word} is missing")
                    count += 1
        self.assertGreater(count, 200)

    def test_no_reader_of_settings_is_forgotten(self):
        known = {source for sources in REFERENCES.values() for source in sources}
        for room in ("daemon", "rig", "sim", "drivers"):
            for path in glob.glob(os.path.join(ROOT, room, "**", "*"), recursive=True):
                if re.search(r"\.(cpp|h)$", path) and re.search(READS, text := read(path)) and "SettingsReader" in text:
                    self.assertIn(os.path.relpath(path, ROOT), known | {"rig/procedures/presets.cpp", "rig/calibration/direction.cpp"})

    def test_the_reference_has_no_key_that_is_not_read(self):
        known = {key for source in REFERENCES["docs/configuration.md"] for key, *_ in reads(source)}
        known |= {"focus", "iris", "zoom", "filter"}  # by the names of the axes
        for row in re.findall(r"^\| (`[^|]*) \|", read("docs/configuration.md").split("## Keys of the drivers")[0], re.M):
            for key in re.findall(r"`(\w+)`", row):
                self.assertIn(key, known)

    def test_numbers_and_choices_that_are_defaults_are_told(self):
        rows = {}
        for key_cell, default in re.findall(r"^\| (`[^|]*) \| ([^|]*) \|", read("docs/configuration.md"), re.M):
            for key in re.findall(r"`(\w+)`", key_cell):
                rows.setdefault(key, []).append(default.strip("` \""))
        for source in REFERENCES["docs/configuration.md"]:
            for key, how, choices, default in reads(source):
                with self.subTest(key=key):
                    if how == "Choice" and choices:
                        self.assertIn(choices[0], rows[key])
                    elif how in ("Number", "Integer") and default and key not in ("ring_hz", "lost_travel", "version"):
                        self.assertIn(f"{float(default):g}", rows[key])
                    elif how == "Boolean":
                        self.assertIn(default, rows[key])


if __name__ == "__main__":
    unittest.main()
