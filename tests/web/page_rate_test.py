"""How many different pictures a second the page shows in Chromium, at rest, in motion and in a search."""
import browser_test
from speed_test import JUDGED, replay
from web_harness import temporary_folder


class RateTest:
    """Different pictures a second on the screen."""
    width, height, rate, least = 0, 0, 0, 0

    @classmethod
    def setUpClass(cls):
        cls.folder = temporary_folder()
        cls.config = replay(cls.folder.name, cls.width, cls.height, cls.rate)
        super().setUpClass()

    @classmethod
    def tearDownClass(cls):
        super().tearDownClass()
        cls.folder.cleanup()

    def test_pictures_a_second(self):
        measured = self.browse("rate")
        print(f"{self.width}x{self.height}: {measured}")
        for kind in ("rateAtRest", "rateInMotion", "rateInAutofocus"):
            self.assertGreaterEqual(measured[kind], self.least if JUDGED else 1)


class SmallRateTest(RateTest, browser_test.BrowserTest):
    width, height, rate, least = 640, 480, 60, 30


class LargeRateTest(RateTest, browser_test.BrowserTest):
    width, height, rate, least = 1920, 1080, 30, 25


if __name__ == "__main__":
    browser_test.main()
