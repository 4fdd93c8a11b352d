"""The worked session of docs/interface.md, replayed: lensd answers what the page says, byte for byte."""
import os
import re
import sys
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
from harness import HERE, DaemonTest  # noqa: E402

PAGE = os.path.join(HERE, "..", "..", "docs", "interface.md")


class Session(DaemonTest):
    lenses = ("a",)

    def test_the_session_of_the_page(self):
        with open(PAGE, encoding="utf-8") as file:
            lines = re.search(r"```session\n(.*?)```", file.read(), re.DOTALL).group(1).splitlines()
        self.assertGreater(len(lines), 10)
        with self.daemon.client() as client:
            for calls, answers in re.findall(r"((?:C: .*\n)+)((?:S: .*\n)*)", "\n".join(lines) + "\n"):
                client.send_bytes(b"".join(line[3:].encode() + b"\0" for line in calls.splitlines()))
                for line in answers.splitlines():
                    while b"\0" not in client.buffer:
                        data = client.socket.recv(65536)
                        self.assertTrue(data, "lensd closed the connection")
                        client.buffer += data
                    answer, client.buffer = client.buffer.split(b"\0", 1)
                    pattern = r"-?\d[\d.e+-]*".join(re.escape(part) for part in line[3:].split("..."))
                    self.assertRegex(answer.decode(), f"^{pattern}$")
            client.socket.settimeout(0.3)
            with self.assertRaises(TimeoutError):  # nothing more comes
                client.socket.recv(1)


if __name__ == "__main__":
    unittest.main()
