"""A lens as devices of Micro-Manager, led as UniMMCore leads them. pymmcore-plus itself where it is installed, else what it
publishes (`published/`)."""
import importlib.util
import os
import sys
import tempfile
import threading
import time
import unittest

from situations import PACKAGE, PATIENCE, ROOT, SCENE, Daemon

if importlib.util.find_spec("pymmcore_plus") is None:
    sys.path.insert(0, os.path.join(ROOT, "tests", "clients", "published"))
sys.path.insert(0, PACKAGE)
import lensd  # noqa: E402
from lensd import micromanager  # noqa: E402
from viewer import scene_daemon  # noqa: E402


class Devices(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="lensd-stage-")
        with open(SCENE, encoding="utf-8") as file:
            cls.daemon = scene_daemon(cls.folder.name, file.read().replace("speed_steps_per_s = 1000", "speed_steps_per_s = 8000"))

    @classmethod
    def tearDownClass(cls):
        assert cls.daemon.stop() == 0
        cls.folder.cleanup()

    def setUp(self):
        self.lens = lensd.Lens(self.daemon.socket)
        self.addCleanup(self.lens.close)

    def test_the_stage_counts_micrometres_of_sensor_distance(self):
        stage = micromanager.FocusStage(self.lens)
        with stage:
            stage.set_position_um(200.0)
            self.assertAlmostEqual(stage.get_position_um(), 200.0, delta=0.5)
            self.assertAlmostEqual(self.lens.status().extension_mm, 0.2, delta=0.0005)
            stage.set_relative_position_um(-50.0)
            self.assertAlmostEqual(stage.get_position_um(), 150.0, delta=0.5)
            stage.set_origin()
            stage.set_position_um(10.0)
        self.assertAlmostEqual(self.lens.status().extension_mm, 0.16, delta=0.0005)
        with stage:
            stage.set_adapter_origin_um(1000.0)
            self.assertAlmostEqual(stage.get_position_um(), 1000.0, delta=0.5)
        self.assertFalse(stage.busy())
        with self.assertRaises(lensd.OutOfRange), stage:
            stage.set_position_um(1e6)

    def test_without_optics_it_counts_steps(self):
        stage = micromanager.FocusStage(self.lens, um_per_step=0.25)
        stage.set_position_um(100.0)
        self.assertEqual((stage.get_position_um(), self.lens.status().axes[0].position), (100.0, 400.0))

    def test_stop_ends_a_move_and_busy_sees_it(self):
        daemon = Daemon(("a",))  # a slow lens
        lens = lensd.Lens(daemon.socket)
        stage, raised = micromanager.FocusStage(lens), []

        def move():
            try:
                with stage:
                    stage.set_position_um(1500.0)
            except lensd.Cancelled as error:
                raised.append(error.axis)
        mover = threading.Thread(target=move)
        mover.start()
        deadline = time.monotonic() + 20 * PATIENCE
        while not stage.busy():
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.002)
        stage.stop()
        mover.join()
        lens.close()
        self.assertEqual(daemon.stop(), 0)
        self.assertEqual(raised, ["focus"])

    def test_home_says_what_lensd_says(self):
        stage = micromanager.FocusStage(self.lens)
        try:
            stage.home()
        except lensd.Unsupported as error:
            self.assertEqual(error.axis, "focus")
        else:
            self.assertTrue(self.lens.status().axes[0].homed)

    def test_autofocus_with_the_lens_own_camera_and_with_micro_managers(self):
        for method, snap in (("sweep", None), ("sweep", self.snap)):
            self.lens.focus("@200")
            device = micromanager.Autofocus(self.lens, snap=snap, pixel_um=3.45 if snap else None)
            with device:
                self.assertEqual(device.get_property_value("Reason"), "not focused yet")
                device.set_property_value("Method", method)
                device.set_property_value("Run", 1)
                self.assertGreater(device.get_property_value("Score"), 0.5)
                with self.assertRaises(ValueError):
                    device.set_property_value("Score", 1.0)
            self.assertAlmostEqual(1 / self.lens.status().vergence_d, 1.2, delta=0.03)

    def snap(self):
        with lensd.Lens(self.daemon.socket) as camera:
            return camera.snapshot(encoding="gray8").samples

    def test_a_refusal_raises_with_its_reason(self):
        device = micromanager.Autofocus(self.lens, snap=lambda: memoryview(bytes(64 * 48)).cast("B", (48, 64)), pixel_um=3.45)
        with self.assertRaisesRegex(RuntimeError, "is not focused: "):
            device.set_property_value("Run", 1)
        self.assertNotEqual(device.get_property_value("Reason"), "not focused yet")


if __name__ == "__main__":
    unittest.main()
