"""Peers that share no code with us: lensd against a pymodbus server, the simulated drives against mbpoll and pymodbus."""
import asyncio
import os
import re
import select
import shutil
import socket
import subprocess
import sys
import tempfile
import threading
import time
import tty
import unittest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "..", "..", "daemon")]
from daemon_test import Simulator  # noqa: E402
from harness import LENS, PATIENCE, Daemon  # noqa: E402

try:
    from pymodbus.client import ModbusTcpClient
    from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
    from pymodbus.server import StartAsyncSerialServer, StartAsyncTcpServer
    from pymodbus.transaction import ModbusRtuFramer
except ImportError:
    ModbusTcpClient = None
    ModbusSequentialDataBlock = object


class PlainDrive(ModbusSequentialDataBlock):
    """The register map of the profile `generic`: jumps where it is told."""

    def __init__(self):
        super().__init__(0, [0] * 32)
        super().setValues(10, [2])

    def setValues(self, address, values):
        super().setValues(address, values)
        if address <= 5 < address + len(values) and self.getValues(5, 1)[0] == 1:
            super().setValues(2, self.getValues(0, 2))
            super().setValues(5, [0])
        if address <= 6 < address + len(values) and self.getValues(6, 1)[0] == 1:
            super().setValues(2, [0, 0])
            super().setValues(10, [2 | 8])
            super().setValues(6, [0])


class Crossed:
    """Two terminals of which each hears the other, as a cable between two serial ports."""

    def __init__(self):
        self.masters, self.names, self.slaves = [], [], []
        for _ in range(2):
            master, slave = os.openpty()
            tty.setraw(slave)
            self.masters.append(master)
            self.slaves.append(slave)
            self.names.append(os.ttyname(slave))
        self.going = True
        self.thread = threading.Thread(target=self.carry)
        self.thread.start()

    def carry(self):
        while self.going:
            for master in select.select(self.masters, [], [], 0.05)[0]:
                os.write(self.masters[1 - self.masters.index(master)], os.read(master, 512))

    def close(self):
        self.going = False
        self.thread.join()
        for descriptor in self.masters + self.slaves:
            os.close(descriptor)


def serve(start):
    """Runs a pymodbus server on a thread that ends with the program."""
    threading.Thread(target=lambda: asyncio.run(start()), daemon=True).start()
    time.sleep(1)


@unittest.skipIf(ModbusTcpClient is None, "python3-pymodbus is not installed")
class Pymodbus(unittest.TestCase):

    def drive_a_lens(self, wire):
        daemon = Daemon(config=f"""version = 1
[[bus]]
name = "peer"
driver = "modbus"
{wire}
response_timeout_ms = 500
[[lens]]
name = "ring"
driver = "modbus"
bus = "peer"
[lens.drives.focus]
unit = 1
profile = "generic"
range = [-100000, 100000]
""")
        try:
            with daemon.client() as client:
                home = client.call(LENS + "Home", {"axis": "focus"})["parameters"]["moves"][0]
                self.assertTrue(home["reached"])
                for target in (70000, -70000, 1):
                    reply = client.call(LENS + "Move", {"axis": "focus", "target": {"position": target}})
                    self.assertTrue(reply["parameters"]["move"]["reached"], reply)
                    position = self.block.getValues(2, 2)
                    self.assertEqual(position, [target >> 16 & 0xFFFF, target & 0xFFFF])
        finally:
            daemon.stop()

    def context(self):
        self.block = PlainDrive()
        slave = ModbusSlaveContext(hr=self.block, zero_mode=True)
        return ModbusServerContext(slaves={1: slave}, single=False)

    def test_lensd_against_its_tcp_server(self):
        context = self.context()
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        serve(lambda: StartAsyncTcpServer(context=context, address=("127.0.0.1", port)))
        self.drive_a_lens(f'host = "127.0.0.1:{port}"')

    def test_lensd_against_its_rtu_server(self):
        cable = Crossed()
        self.addCleanup(cable.close)
        context = self.context()
        serve(lambda: StartAsyncSerialServer(context=context, framer=ModbusRtuFramer, port=cable.names[0],
                                             baudrate=115200))
        self.drive_a_lens(f'device = "{cable.names[1]}"')

    def test_its_client_against_the_simulated_drives(self):
        simulator = Simulator("--tcp", "0", "--unit", "1:oriental-az", "--unit", "2:moons", "--unit", "3:leadshine-rs")
        self.addCleanup(simulator.close)
        client = ModbusTcpClient("127.0.0.1", port=int(simulator.greeting.rsplit(":", 1)[1]))
        self.assertTrue(client.connect())
        self.addCleanup(client.close)
        self.assertEqual(client.read_holding_registers(0x7E, 2, slave=1).registers, [0, 0x4020])
        self.assertEqual(client.read_holding_registers(1, 1, slave=2).registers, [9])
        self.assertTrue(client.read_holding_registers(0x4000, 2, slave=1).isError())
        self.assertFalse(client.write_registers(0x18A, [0, 1], slave=1).isError())  # here is home
        move = [0, 0, 0, 1, 0, 500, 0, 50000, 0x7, 0xA120, 0x7, 0xA120, 0, 1000, 0, 1]
        self.assertFalse(client.write_registers(0x58, move, slave=1).isError())
        deadline = time.monotonic() + 5 * PATIENCE
        while simulator.tell("position 1") != "500" and time.monotonic() < deadline:
            time.sleep(0.02)
        self.assertEqual(client.read_holding_registers(0xCC, 2, slave=1).registers, [0, 500])


@unittest.skipIf(shutil.which("mbpoll") is None, "mbpoll is not installed")
class Mbpoll(unittest.TestCase):

    def poll(self, *arguments):
        done = subprocess.run(["mbpoll", "-0", "-1", "-q", "-t", "4:hex", *arguments], capture_output=True, text=True,
                              timeout=30, check=False)
        return re.findall(r"\]:\s+0x([0-9A-F]{4})", done.stdout), done.stdout + done.stderr

    def test_tcp(self):
        simulator = Simulator("--tcp", "0", "--unit", "1:oriental-az", "--unit", "2:moons")
        self.addCleanup(simulator.close)
        port = simulator.greeting.rsplit(":", 1)[1]
        read, said = self.poll("-m", "tcp", "-p", port, "-a", "1", "-r", "126", "-c", "2", "127.0.0.1")
        self.assertEqual(read, ["0000", "4020"], said)
        self.assertEqual(self.poll("-m", "tcp", "-p", port, "-a", "2", "-r", "1", "-c", "1", "127.0.0.1")[0], ["0009"])
        self.assertIn("Illegal data address",
                      self.poll("-m", "tcp", "-p", port, "-a", "1", "-r", "1", "-c", "1", "127.0.0.1")[1])

    def test_rtu(self):
        with tempfile.TemporaryDirectory() as folder:
            line = os.path.join(folder, "port")
            simulator = Simulator("--rtu", line, "--unit", "1:oriental-az", "--unit", "3:leadshine-rs")
            self.addCleanup(simulator.close)
            common = ("-m", "rtu", "-b", "115200", "-P", "none")
            read, said = self.poll(*common, "-a", "1", "-r", "126", "-c", "2", line)
            self.assertEqual(read, ["0000", "4020"], said)
            self.assertEqual(self.poll(*common, "-a", "3", "-r", "4099", "-c", "1", line)[0], ["0032"])


if __name__ == "__main__":
    unittest.main()
