"""ASCOM Alpaca, asked as its standard says: every member of a focuser, the rules of HTTP, errors and discovery."""
import json
import socket
import time
import unittest
import urllib.parse

from web_harness import PATIENCE, Reader, WebTest

FOCUSER = "/api/v1/focuser/0/"


class Asks:
    """Asks the Alpaca server on the port `alpaca`."""

    def ask(self, method, path, fields=None, headers=""):
        text = urllib.parse.urlencode(fields or {})
        body = text if method == "PUT" else ""
        target = path + (f"?{text}" if method == "GET" and text else "")
        with socket.create_connection(("127.0.0.1", self.alpaca), 20 * PATIENCE) as connection:
            connection.sendall((f"{method} {target} HTTP/1.1\r\nHost: telescope:{self.alpaca}\r\n{headers}"
                                f"Content-Type: application/x-www-form-urlencoded\r\nContent-Length: {len(body)}\r\n\r\n{body}").encode())
            status, fields, data = Reader(connection).answer()
        return (status, json.loads(data)) if fields["content-type"] == "application/json" else (status, data.decode())

    def get(self, member, **fields):
        status, told = self.ask("GET", FOCUSER + member, fields)
        self.assertEqual((status, told["ErrorNumber"]), (200, 0), told)
        return told["Value"]

    def put(self, member, **fields):
        status, told = self.ask("PUT", FOCUSER + member, fields)
        self.assertEqual(status, 200, told)
        self.assertNotIn("Value", told)
        return told["ErrorNumber"]


class AlpacaTest(Asks, WebTest):
    arguments = ("--alpaca", "127.0.0.1:0")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.alpaca = cls.web.alpaca

    def setUp(self):
        self.assertEqual(self.put("connected", Connected="True"), 0)

    def test_management(self):
        self.assertEqual(self.ask("GET", "/management/apiversions")[1]["Value"], [1])
        self.assertEqual(set(self.ask("GET", "/management/v1/description")[1]["Value"]),
                         {"ServerName", "Manufacturer", "ManufacturerVersion", "Location"})
        devices = self.ask("GET", "/management/v1/configureddevices")[1]["Value"]
        self.assertEqual([(d["DeviceName"], d["DeviceType"], d["DeviceNumber"]) for d in devices], [("a", "Focuser", 0), ("b", "Focuser", 1)])
        self.assertEqual(len({d["UniqueID"] for d in devices}), 2)
        self.assertEqual(devices, self.ask("GET", "/management/v1/configureddevices")[1]["Value"], "they never change")

    def test_every_member_that_is_read(self):
        values = {name: self.get(name) for name in ("absolute", "connected", "connecting", "interfaceversion", "maxstep", "maxincrement",
                                                    "tempcomp", "tempcompavailable", "supportedactions", "name")}
        self.assertEqual(values, {"absolute": True, "connected": True, "connecting": False, "interfaceversion": 4, "maxstep": 4000,
                                  "maxincrement": 4000, "tempcomp": False, "tempcompavailable": False, "supportedactions": [], "name": "a"})
        for name in ("description", "driverinfo", "driverversion"):
            self.assertTrue(self.get(name))
        self.assertAlmostEqual(self.get("stepsize"), 1600 / 4000)
        self.assertEqual(self.get("temperature"), 20)
        self.assertEqual({state["Name"] for state in self.get("devicestate")}, {"TimeStamp", "IsMoving", "Position", "Temperature"})

    def test_a_move_answers_at_once_and_is_seen_moving(self):
        self.move_to(0)
        began = time.monotonic()
        self.assertEqual(self.put("move", Position=1500), 0)
        self.assertTrue(self.get("ismoving"))
        self.assertLess(time.monotonic() - began, 1.4 * PATIENCE, "it takes 1.5 s to get there")
        self.wait_for(lambda: not self.get("ismoving"))
        self.assertEqual(self.get("position"), 1500)

    def move_to(self, position):
        self.put("move", Position=position)
        self.wait_for(lambda: not self.get("ismoving"))
        self.assertEqual(self.get("position"), position)

    def test_halt(self):
        self.move_to(0)
        self.put("move", Position=4000)
        self.wait_for(lambda: self.get("position") > 100)
        self.assertEqual(self.put("halt"), 0)
        self.wait_for(lambda: not self.get("ismoving"))
        self.assertLess(self.get("position"), 4000)

    def test_beyond_its_ends_it_stops_there(self):
        for position, ends_at in ((4010, 4000), (-10, 0), (2**31 - 1, 4000), (-2**31, 0)):
            self.assertEqual(self.put("move", Position=position), 0)
            self.wait_for(lambda: not self.get("ismoving"))
            self.assertEqual(self.get("position"), ends_at)

    def lensd(self, method, **parameters):
        status, told = self.web.call(method, {"lens": "a", **parameters})
        self.assertEqual(status, 200, told)
        return told

    def failure(self):
        """How the move ended, as IsMoving raises it."""
        told = {}

        def ended():
            told.clear()
            told.update(self.ask("GET", FOCUSER + "ismoving")[1])
            return told.get("Value") is not True
        self.wait_for(ended)
        return told["ErrorNumber"]

    def test_a_refused_move_says_so(self):
        lease = self.lensd("TakeLease", forMs=60000)
        try:
            number, why = (self.ask("PUT", FOCUSER + "move", {"Position": 10})[1][key] for key in ("ErrorNumber", "ErrorMessage"))
            self.assertEqual(number, 0x40B)
            self.assertIn("lease", why)
        finally:
            self.lensd("DropLease", lease=lease["lease"])
        self.lensd("Stop", latch=True)
        self.assertEqual(self.put("move", Position=10), 0x40B)
        self.lensd("ResetFaults")
        self.move_to(10)

    def test_a_lens_that_is_away_says_so(self):
        self.lensd("io.lensd.Simulator.Inject", kind="disconnect")
        self.assertEqual(self.put("move", Position=20), 0x500)
        self.lensd("io.lensd.Simulator.Inject", kind="reconnect")
        self.wait_for(lambda: self.lensd("Status")["lenses"][0]["connected"])
        self.lensd("Home", axis="focus")

    def test_a_move_that_does_not_arrive_is_raised_by_ismoving(self):
        self.move_to(0)
        self.assertEqual(self.put("move", Position=4000), 0)
        self.lensd("io.lensd.Simulator.Inject", kind="stall", axis="focus")
        self.assertEqual(self.failure(), 0x502)
        self.assertEqual(self.failure(), 0x502, "until something else is asked for")
        self.lensd("io.lensd.Simulator.Inject", kind="stall", axis="focus", forMs=0.001)
        self.move_to(0)

    def test_another_client_ends_a_move(self):
        self.move_to(0)
        self.assertEqual(self.put("move", Position=4000), 0)
        self.wait_for(lambda: self.get("position") > 500)
        self.lensd("Stop")
        self.assertEqual(self.failure(), 0x40E)
        self.assertEqual(self.put("move", Position=4000), 0)  # takes seconds: the other one comes before its end
        self.lensd("Move", axis="focus", target={"position": 30})
        self.assertEqual(self.failure(), 0x40E)
        self.assertEqual(self.put("connected", Connected="True"), 0)
        self.assertFalse(self.get("ismoving"))

    def test_errors_of_the_device(self):
        self.assertEqual(self.put("tempcomp", TempComp="true"), 0x400)
        self.assertEqual(self.put("action", Action="x", Parameters="y"), 0x40C)
        self.assertEqual(self.put("commandblind", Command="x", Raw="true"), 0x400)
        self.assertEqual(self.put("disconnect"), 0)
        status, told = self.ask("GET", FOCUSER + "position")
        self.assertEqual((status, told["ErrorNumber"]), (200, 0x407))
        self.assertEqual(self.put("move", Position=1), 0x407)
        self.assertFalse(self.get("connected"))
        self.assertEqual(self.put("connect"), 0)
        self.assertTrue(self.get("connected"))

    def test_what_is_malformed(self):
        for method, path, fields in (("GET", "/api/v1/focuser/2/position", {}), ("GET", "/api/v1/focuser/x/position", {}),
                                     ("GET", "/api/v1/camera/0/name", {}), ("GET", FOCUSER + "nothing", {}), ("GET", FOCUSER + "Position", {}),
                                     ("PUT", FOCUSER + "move", {}), ("PUT", FOCUSER + "move", {"position": 5}),
                                     ("PUT", FOCUSER + "move", {"Position": "5.5"}), ("PUT", FOCUSER + "connected", {"Connected": "maybe"}),
                                     ("GET", FOCUSER + "position", {"ClientID": "x"}), ("GET", FOCUSER + "position", {"ClientTransactionID": "-1"}),
                                     ("PUT", FOCUSER + "action", {}), ("PUT", FOCUSER + "commandbool", {"Command": "x"}),
                                     ("PUT", FOCUSER + "tempcomp", {}), ("GET", FOCUSER + "move", {}), ("GET", "/api/v1/focuser/0", {}),
                                     ("GET", "/api/v1/focuser/-1/name", {}), ("GET", "/API/v1/focuser/0/name", {}), ("GET", FOCUSER + "halt", {}),
                                     ("PUT", FOCUSER + "position", {}), ("POST", FOCUSER + "move", {})):
            with self.subTest(path=path, fields=fields):
                self.assertEqual(self.ask(method, path, fields)[0], 400)

    def test_each_program_connects_for_itself(self):
        self.assertEqual(self.put("connected", Connected="true", ClientID=7), 0)
        self.assertEqual(self.put("connect", ClientID=8), 0)
        self.assertEqual(self.put("connected", Connected="False", ClientID=7), 0)
        self.assertEqual([self.get("connected", ClientID=client) for client in (7, 8)], [False, True])
        self.assertEqual(self.ask("GET", FOCUSER + "position", {"ClientID": 7})[1]["ErrorNumber"], 0x407)
        self.assertEqual(self.ask("GET", FOCUSER + "position", {"clientid": 8})[1]["ErrorNumber"], 0)
        for client in range(100, 300):  # that crash
            self.put("connect", ClientID=client)
        self.assertFalse(self.get("connected", ClientID=8))
        self.assertTrue(self.get("connected", ClientID=299))

    def test_an_error_has_no_value(self):
        self.put("disconnect")
        self.assertNotIn("Value", self.ask("GET", FOCUSER + "position")[1])
        self.assertTrue(self.ask("GET", FOCUSER + "position")[1]["ErrorMessage"])

    def test_setup_is_a_page(self):
        for path in ("/setup", "/setup/v1/focuser/0/setup"):
            status, page = self.ask("GET", path)
            self.assertEqual(status, 200)
            self.assertIn("<!doctype html>", page)

    def test_transactions_are_numbered(self):
        first = self.ask("GET", FOCUSER + "absolute", {"clienttransactionid": 77})[1]
        second = self.ask("GET", FOCUSER + "absolute", {"ClientTransactionID": 4294967295})[1]
        self.assertEqual((first["ClientTransactionID"], second["ClientTransactionID"]), (77, 4294967295))
        self.assertGreater(first["ServerTransactionID"], 0)
        self.assertEqual(second["ServerTransactionID"], first["ServerTransactionID"] + 1)
        self.assertEqual(self.ask("PUT", FOCUSER + "halt", {"ClientTransactionID": 5})[1]["ClientTransactionID"], 5)
        self.assertEqual(self.ask("PUT", FOCUSER + "halt", {"clienttransactionid": 5})[1]["ClientTransactionID"], 0)

    def test_pages_are_refused(self):
        self.assertEqual(self.ask("PUT", FOCUSER + "move", {"Position": 1}, "Origin: http://evil.example\r\n")[0], 403)
        self.assertEqual(self.ask("GET", FOCUSER + "name", {}, "Sec-Fetch-Site: cross-site\r\n")[0], 403)

    def test_discovery(self):
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as seeker:
            seeker.settimeout(5 * PATIENCE)
            seeker.sendto(b"hello", ("127.0.0.1", 32227))
            seeker.sendto(b"alpacadiscovery1", ("127.0.0.1", 32227))
            self.assertEqual(json.loads(seeker.recv(1000)), {"AlpacaPort": self.alpaca}, "and nothing for the first")
            seeker.settimeout(0.2)
            with self.assertRaises(socket.timeout):
                seeker.recv(1000)


if __name__ == "__main__":
    unittest.main()
