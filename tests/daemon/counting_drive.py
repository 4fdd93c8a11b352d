"""A drive on Modbus TCP that counts its steps and has no reference, with a shaft whose place this program knows. It shares no
code with lensd. Registers: 0-1 target, 2-3 position (both s32), 4 speed, 5 go, 7 stop, 10 status (moving, in position)."""
import contextlib
import socket
import struct
import threading
import time

PROFILE = """version = 1
name = "counting drive"
retarget = "direct"
homing = "not-needed"
[parameters]
speed = 1000
[speed]
parameter = "speed"
counts_per_s = 10.0
[status]
address = 10
moving = 0
in_position = 1
[position]
address = 2
type = "s32"
[[move]]
address = 0
values = ["s32 target"]
[[move]]
address = 4
values = ["u16 speed"]
[[move]]
address = 5
values = [1]
[[stop]]
address = 7
values = [1]
"""


class CountingDrive:
    def __init__(self, shaft=0):
        self.lock = threading.Lock()
        self.way = (float(shaft), float(shaft), time.monotonic())  # of the shaft: from, to, since
        self.zero = 0.0  # place of the shaft that it counts as 0
        self.registers = [0] * 16
        self.registers[4] = 1000
        self.dark = False
        self.silent_until = 0.0
        self.connections = []
        self.listener = socket.socket()
        self.listener.bind(("127.0.0.1", 0))
        self.listener.listen()
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def close(self):
        self.listener.close()
        self.lose_power()

    def place(self):
        begin, end, since = self.way
        gone = (time.monotonic() - since) * 10.0 * self.registers[4]
        return end if gone >= abs(end - begin) else begin + (gone if end > begin else -gone)

    def shaft(self):
        """Where it truly stands."""
        with self.lock:
            return round(self.place())

    def lose_power(self):
        """It stops dead, and no question is answered."""
        with self.lock:
            here = float(round(self.place()))
            self.way = (here, here, time.monotonic())
            self.dark = True
            for connection in self.connections:
                with contextlib.suppress(OSError):
                    connection.shutdown(socket.SHUT_RDWR)
            self.connections = []

    def hold_answers(self, seconds):
        """It goes on, and answers nothing for so long."""
        self.silent_until = time.monotonic() + seconds

    def get_power(self, count=0):
        """It answers again, and calls where it stands so."""
        with self.lock:
            self.zero = self.way[1] - count
            self.dark = False

    def read(self, address):
        place = self.place()
        count = round(place - self.zero) & 0xFFFFFFFF
        moving = place != self.way[1]
        return {2: count >> 16, 3: count & 0xFFFF, 10: 1 if moving else 2}.get(address, self.registers[address])

    def obey(self):
        place = self.place()
        if self.registers[7]:
            self.way = (place, float(round(place)), time.monotonic())
        elif self.registers[5]:
            target = struct.unpack(">i", struct.pack(">HH", *self.registers[0:2]))[0]
            self.way = (place, target + self.zero, time.monotonic())
        self.registers[5] = self.registers[7] = 0

    def answer(self, question):
        function = question[0]
        if function == 6:
            address, self.registers[address] = struct.unpack(">HH", question[1:5])
            self.obey()
            return question[:5]
        address, count = struct.unpack(">HH", question[1:5])
        if address + count > len(self.registers):
            return bytes([function | 0x80, 2])
        if function == 16:
            self.registers[address:address + count] = struct.unpack(f">{count}H", question[6:6 + 2 * count])
            self.obey()
            return question[:5]
        return bytes([function, 2 * count]) + b"".join(struct.pack(">H", self.read(address + i)) for i in range(count))

    def accept(self):
        with contextlib.suppress(OSError):
            while True:
                connection, _ = self.listener.accept()
                with self.lock:
                    if self.dark:
                        connection.close()
                        continue
                    self.connections.append(connection)
                threading.Thread(target=self.serve, args=(connection,), daemon=True).start()

    def serve(self, connection):
        with contextlib.suppress(OSError), connection:
            while len(head := connection.recv(6, socket.MSG_WAITALL)) == 6:
                body = connection.recv(struct.unpack(">H", head[4:])[0], socket.MSG_WAITALL)
                if time.monotonic() < self.silent_until:
                    continue
                with self.lock:
                    if self.dark:
                        return
                    reply = self.answer(body[1:])
                    connection.sendall(head[:4] + struct.pack(">H", len(reply) + 1) + body[:1] + reply)
