"""The Python library against a real lensd: errors, cancellation, deadlines, threads, both variants."""
import asyncio
import os
import signal
import subprocess
import sys
import threading
import time
import unittest

from situations import LENS, PACKAGE, PATIENCE, ROOT, SCENE, Daemon, FalseDaemon, Situations, answering

sys.path.insert(0, PACKAGE)
import lensd  # noqa: E402
from lensd import quantities  # noqa: E402
from lensd._codec import camel  # noqa: E402


def snake(name):
    return "".join("_" + letter.lower() if letter.isupper() else letter for letter in name).lstrip("_")


def told_of(error):
    fields = {camel(name): getattr(error, name) for kind in type(error).__mro__ for name in getattr(kind, "__annotations__", {})}
    return {**fields, "error": type(error).__name__, "code": error.code, "exit_status": error.exit_status, "message": str(error)}


def call_of(method, parameters):
    name = snake(method)
    make = getattr(lensd.calls, name + "_" if name == "list" else name)
    return make(**{snake(key): value for key, value in parameters.items()})


class Blocking(Situations, unittest.TestCase):
    """Every situation through lensd.Lens."""

    def refusal(self, path, method, parameters, name=None):
        with lensd.Lens(path, name) as lens:
            try:
                lens.call(call_of(method, parameters))
            except lensd.LensdError as error:
                return told_of(error)
        return None

    def test_every_error_has_its_class(self):
        with open(os.path.join(ROOT, "proto", "io.lensd.Lens.varlink"), encoding="utf-8") as file:
            names = [line.split()[1] for line in file if line.startswith("error ")]
        self.assertGreater(len(names), 15)
        for name in names:
            self.assertEqual(getattr(lensd, name).error_name, LENS + name)


class Asyncio(Situations, unittest.TestCase):
    """The same through lensd.aio.Lens."""

    def refusal(self, path, method, parameters, name=None):
        async def call():
            async with lensd.aio.Lens(path, name) as lens:
                await lens.call(call_of(method, parameters))
        try:
            asyncio.run(call())
        except lensd.LensdError as error:
            return told_of(error)
        return None


def open_files():
    return len(os.listdir("/proc/self/fd"))


class Behaviour(unittest.TestCase):
    """What a client does while others do something else."""

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(("a", "b"))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0

    def lens(self, name="a", **options):
        lens = lensd.Lens(self.daemon.socket, name, **options)
        self.addCleanup(lens.close)
        return lens

    def far(self, lens):
        return 3900 if lens.status().axes[0].position < 2000 else 100

    def until_moving(self, lens):
        deadline = time.monotonic() + 10 * PATIENCE
        while not lens.status().axes[0].moving:
            self.assertLess(time.monotonic(), deadline, "it never moved")

    def test_answers_are_dataclasses_of_the_interface(self):
        lens = self.lens()
        info = lens.list()[0]
        self.assertEqual((info.name, info.axes[0].unit, info.camera.width_px), ("a", "steps", 64))
        seen = []
        move = lens.focus("@40", progress=lambda progress: seen.append(progress.target))
        self.assertEqual((move.reached, move.position, move.axis), (True, 40.0, "focus"))
        self.assertEqual(set(seen), {40.0})
        self.assertEqual(lens.focus(relative=10).position, 50)
        self.assertAlmostEqual(lens.aperture("f/4").f_number, 4, delta=0.2)
        planned = lens.plan([lensd.sharp("1.1m..1.3m", "20um", name="wall")], apply=True)
        self.assertTrue(planned.plan.feasible and planned.applied)
        self.assertEqual(planned.plan.limits[0].name, "wall")
        self.assertIn("focus", planned.plan.conflict or ["focus"])

    def test_without_a_name_the_lens_must_be_the_only_one(self):
        with self.assertRaises(ValueError):
            self.lens(None).status()
        self.assertEqual([each.name for each in self.lens(None).statuses()], ["a", "b"])

    def test_stop_ends_the_move_of_another_thread(self):
        lens = self.lens()
        ended = []

        def move():
            try:
                lens.focus(position=self.far(lens))
            except lensd.Cancelled as error:
                ended.append(error)
        mover = threading.Thread(target=move)
        mover.start()
        self.until_moving(lens)
        lens.stop()
        mover.join(20 * PATIENCE)
        self.assertEqual([(error.lens, error.axis) for error in ended], [("a", "focus")])

    def test_two_threads_do_not_wait_for_each_other(self):
        lens = self.lens()
        mover = threading.Thread(target=lambda: lens.focus(position=self.far(lens)))
        mover.start()
        self.until_moving(lens)
        answers = [lens.status().name for _ in range(5)]
        self.assertTrue(mover.is_alive(), "status waited for the end of the move")
        lens_b = lensd.Lens(self.daemon.socket, "b")
        other = threading.Thread(target=lambda: answers.extend(lens_b.status().name for _ in range(50)))
        other.start()
        answers += [lens.status().name for _ in range(50)]
        other.join()
        lens_b.close()
        self.assertEqual((answers.count("a"), answers.count("b")), (55, 50))
        mover.join()

    def test_a_deadline_ends_the_call_and_not_the_client(self):
        lens = self.lens()
        far = self.far(lens)
        with self.assertRaises(lensd.Timeout) as caught:
            lens.focus(position=far, timeout_s=0.2)
        self.assertIsInstance(caught.exception, lensd.DeadlinePassed)
        with self.assertRaises(lensd.DeadlinePassed):  # of the whole move, though progress comes all the time
            lens.focus(position=abs(far - 30), timeout_s=0.2, progress=lambda progress: None)
        self.assertEqual(caught.exception.exit_status, 5)
        self.until_moving(lens)  # a plain move goes on
        lens.stop()
        self.assertEqual(lens.wait_idle(20 * PATIENCE).activity, "idle")

    def test_a_lease_keeps_others_out_and_ends_with_its_block(self):
        mine, other = self.lens(), self.lens()
        with mine.lease():
            with self.assertRaises(lensd.Leased) as caught:
                other.focus("@10")
            self.assertIn(f"[{os.getpid()}]", caught.exception.holder)
            self.assertTrue(mine.focus("@10").reached)
        self.assertTrue(other.focus("@20").reached)

    def test_monitor_tells_what_happens_and_close_ends_it(self):
        lens, seen = self.lens(), []
        with lens.monitor() as events:
            self.assertEqual(next(events).status.name, "a")
            lens.call(lensd.calls.preset_save(label="here"))
            for event in events:
                seen.append(event)
                if event.preset:
                    break
            self.assertEqual((seen[-1].preset.change, seen[-1].preset.label), ("saved", "here"))
            closer = threading.Timer(0.1, events.close)
            closer.start()
            self.assertEqual([event for event in events if event.preset], [])
            closer.join()

    def test_every_method_can_be_called(self):
        lens = self.lens()
        self.assertEqual(lens.call(lensd.calls.preset_save(label="one")).preset.label, "one")
        self.assertIn("one", [preset.label for preset in lens.call(lensd.calls.preset_list()).presets])
        self.assertTrue(lens.call(lensd.calls.get_exposure()).exposure.can_set_exposure)
        self.assertEqual(lens.call(lensd.calls.devices()).failed, [])
        with self.assertRaises(lensd.InvalidParameter):
            next(lens.stream(lensd.calls.list_()))

    def test_an_address_may_have_its_prefix(self):
        with lensd.Lens("unix:" + self.daemon.socket + ";mode=0666", "a") as lens:
            self.assertEqual(lens.status().name, "a")
        with self.assertRaises(ValueError):
            lensd.Lens("/x", rig="left")
        with self.assertRaisesRegex(lensd.Unavailable, "/run/lensd/no-such-rig/io.lensd.Lens"):
            lensd.Lens(rig="no-such-rig").list()

    def test_texts_are_read_as_lensctl_reads_them(self):
        for text, told in (("2m", ("distance_m", 2.0)), ("5ft7in", ("distance_m", 1.7018)), ("1.2D", ("vergence_d", 1.2)),
                           ("inf", ("vergence_d", 0.0)), ("@5", ("position", 5.0)), ("-7", ("relative", -7.0)),
                           ("far:3", ("nearer", -3.0)), ("ext:2.6mm", ("extension_mm", 2.6)), ("33in", ("distance_m", 0.8382))):
            target = quantities.focus_target(text)
            self.assertEqual(target, lensd.Target(**dict([told])), text)
        self.assertEqual(quantities.aperture_target("f/2.8"), lensd.Target(f_number=2.8))
        self.assertEqual(quantities.zoom_target("35mm"), lensd.Target(focal_length_mm=35.0))
        for wrong in ("+100mm", "5", "", "2 x", "-1m", "0m", "@", "near:x", "f/0"):
            with self.assertRaises(ValueError, msg=wrong):
                quantities.focus_target(wrong)

    def test_two_tasks_and_one_that_is_cancelled(self):
        async def tasks():
            async with lensd.aio.Lens(self.daemon.socket, "a") as lens:
                far, near = (3900, 100) if (await lens.status()).axes[0].position < 2000 else (100, 3900)
                move = asyncio.create_task(lens.focus(position=far))
                while not (await lens.status()).axes[0].moving:
                    await asyncio.sleep(0.005)
                move.cancel()
                with self.assertRaises(asyncio.CancelledError):
                    await move
                await lens.wait_idle(20 * PATIENCE)
                ended = (await lens.status()).axes[0].position
                with self.assertRaises(lensd.DeadlinePassed):
                    await lens.focus(position=near, timeout_s=0.2)
                await lens.stop()
                await lens.wait_idle(20 * PATIENCE)
                moving = asyncio.create_task(lens.focus(position=near))
                while not (await lens.status()).axes[0].moving:
                    await asyncio.sleep(0.005)
                await lens.stop()
                with self.assertRaises(lensd.Cancelled):
                    await moving
                return abs(ended - far)
        before = open_files()
        self.assertLess(asyncio.run(tasks()), 1)  # who stops waiting does not stop the lens
        self.assertEqual(open_files(), before)

    def test_what_a_newer_lensd_says_is_taken(self):
        status = {"name": "a", "connected": True, "connection": "asleep", "activity": "dreaming", "step": 0, "stepsExpected": 0,
                  "axes": [], "leftOut": [], "readAtNs": 0, "colourOfDreams": "blue"}
        with FalseDaemon(self.daemon.folder.name, answering({"parameters": {"lenses": [status]}})) as path, lensd.Lens(path) as lens:
            self.assertEqual(lens.status().activity, "dreaming")
        del status["name"]
        with FalseDaemon(self.daemon.folder.name, answering({"parameters": {"lenses": [status]}})) as path, lensd.Lens(path) as lens:
            with self.assertRaisesRegex(lensd.BrokenReply, "lenses.name is missing"):
                lens.status()


class Ends(unittest.TestCase):
    """lensd ends in the middle of calls."""

    def end_in_mid_call(self, end):
        daemon = Daemon(("a",))
        with lensd.Lens(daemon.socket, "a") as lens, lens.monitor() as events:
            raised = {}

            def catch(name, act):
                try:
                    act()
                except Exception as error:  # pylint: disable=broad-except
                    raised[name] = error
            threads = [threading.Thread(target=catch, args=("move", lambda: lens.focus("@3900"))),
                       threading.Thread(target=catch, args=("monitor", lambda: [None for _ in events]))]
            for thread in threads:
                thread.start()
            deadline = time.monotonic() + 10 * PATIENCE
            while not lens.status().axes[0].moving and time.monotonic() < deadline:
                time.sleep(0.005)
            end(daemon)
            for thread in threads:
                thread.join(30 * PATIENCE)
            catch("after", lens.status)
        return raised

    def test_killed(self):
        raised = self.end_in_mid_call(Daemon.kill)
        self.assertEqual({name: type(error) for name, error in raised.items()},
                         {"move": lensd.Unavailable, "monitor": lensd.Unavailable, "after": lensd.Unavailable})

    def test_told_to_end(self):
        def end(daemon):
            daemon.process.send_signal(signal.SIGTERM)
            daemon.stop()
        raised = self.end_in_mid_call(end)
        self.assertEqual({name: type(error) for name, error in raised.items()},
                         {"move": lensd.Cancelled, "monitor": lensd.Unavailable, "after": lensd.Unavailable})


class Page(unittest.TestCase):
    """docs/clients.md and docs/autofocus.md."""

    def test_its_python_runs_as_it_stands(self):
        blocks = []
        for page in ("clients.md", "autofocus.md"):
            with open(os.path.join(ROOT, "docs", page), encoding="utf-8") as file:
                blocks += [block.split("```")[0] for block in file.read().split("```python\n")[1:]]
        self.assertEqual(len(blocks), 5)
        daemon = Daemon(("cam",))
        os.environ["LENSD_SOCKET"] = daemon.socket
        try:
            for block in blocks:
                done = subprocess.run([sys.executable, "-W", "error", "-c", block], capture_output=True, text=True, check=False,
                                      timeout=60 * PATIENCE, env={**os.environ, "PYTHONPATH": PACKAGE}, cwd=daemon.folder.name)
                self.assertEqual((done.returncode, done.stderr), (0, ""), block)
            self.assertIn("a.png", os.listdir(daemon.folder.name))
            self.assertIn("shot-1.png", os.listdir(daemon.folder.name))
        finally:
            del os.environ["LENSD_SOCKET"]
            self.assertEqual(daemon.stop(), 0)


class Examples(unittest.TestCase):
    """Each runs as it stands."""

    @classmethod
    def setUpClass(cls):
        cls.daemon = Daemon(("a", "b"))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0

    def run_example(self, name, *arguments):
        folder = os.path.join(ROOT, "clients", "python")
        done = subprocess.run([sys.executable, "-W", "error", os.path.join(folder, "examples", name + ".py"), self.daemon.socket,
                               *arguments], env={**os.environ, "PYTHONPATH": PACKAGE}, capture_output=True, text=True,
                              timeout=60 * PATIENCE, check=False)
        return done.returncode, done.stdout, done.stderr

    def test_list_and_status(self):
        status, out, err = self.run_example("list_and_status")
        self.assertEqual((status, err), (0, ""))
        self.assertIn("a: simulated thin lens, driver sim, axes focus, iris\n", out)
        self.assertIn("b: idle, focus at ", out)

    def test_move_and_wait(self):
        status, out, err = self.run_example("move_and_wait", "a", "1.2m")
        self.assertEqual((status, err), (0, ""))
        self.assertIn("reached: focus at 1330 ", out)
        status, _, err = self.run_example("move_and_wait", "a", "0.1m")
        self.assertEqual(status, 1)
        self.assertIn("it takes 0.415625 to None m", err)
        self.assertEqual(self.run_example("move_and_wait", "nobody", "1m")[0], 68)

    def test_plan_and_apply(self):
        status, out, err = self.run_example("plan_and_apply", "a")
        self.assertEqual((status, err), (0, ""))
        self.assertRegex(out, r"wall: 1[012]\.\d um of 12 um\nbackground: \d+\.\d um of 20 um\n$")

    def test_live_view(self):
        status, out, err = self.run_example("live_view", "b", "100", "1")
        self.assertEqual((status, err), (0, ""))
        self.assertRegex(out, r"frame \d+: 64 x 48, middle \d+")
        print("live view of 64 x 48:", out.splitlines()[-1])

    def test_autofocus_own_frames(self):
        status, out, err = self.run_example("autofocus_own_frames", "a")
        self.assertEqual((status, err), (0, ""))
        self.assertRegex(out, r"at 1\.(19|20|21)\d m\n")


if __name__ == "__main__":
    assert os.path.exists(SCENE)
    unittest.main()
