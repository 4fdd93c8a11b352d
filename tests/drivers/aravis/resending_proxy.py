"""A GigE Vision camera's other half for tests: stands between a host and a camera that cannot send a packet again, keeps
what it has passed on, loses some of it on purpose and sends it again when asked. Protocol: GigE Vision 1, control on UDP
port 3956, big-endian."""
import collections
import random
import select
import socket
import struct
import threading

CONTROL_PORT = 3956
DISCOVERY_ACK, RESEND = 0x0003, 0x0040
READ_REGISTER, READ_REGISTER_ACK, WRITE_REGISTER = 0x0080, 0x0081, 0x0082
READ_MEMORY_ACK, WRITE_MEMORY = 0x0085, 0x0086
CAPABILITY, STREAM_PORT, STREAM_ADDRESS = 0x0934, 0x0D00, 0x0D18
CAN_RESEND = 1 << 2
CURRENT_IP_AT = 8 + 36


class ResendingProxy:
    """At `address`; the camera at `camera`. `lose`: the part of stream packets that is not passed on at first."""

    def __init__(self, address, camera, lose=0.0, seed=1):
        self.address, self.camera, self.lose = address, camera, lose
        self.random = random.Random(seed)
        self.control = self.bound(address, CONTROL_PORT)
        self.behind = self.bound(address, 0)
        self.stream = self.bound(address, 0)
        self.host = self.target_address = self.target_port = None
        self.asked = {}  # request number: the registers it reads
        self.kept = collections.OrderedDict()  # (block, packet): bytes
        self.lost = self.resent = 0
        self.ended = False
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    @staticmethod
    def bound(address, port):
        made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        made.bind((address, port))
        return made

    def stop(self):
        self.ended = True
        self.thread.join()
        for each in (self.control, self.behind, self.stream):
            each.close()

    def run(self):
        while not self.ended:
            for ready in select.select([self.control, self.behind, self.stream], [], [], 0.1)[0]:
                data, sender = ready.recvfrom(65536)
                if ready is self.control:
                    self.from_host(data, sender)
                elif ready is self.behind:
                    self.from_camera(data)
                else:
                    self.pass_on(data)

    def from_host(self, data, sender):
        if len(data) < 8:
            return
        _, _, command, length, number = struct.unpack(">BBHHH", data[:8])
        if command == RESEND:
            self.send_again(data)
            return
        self.host = sender
        if command == READ_REGISTER:
            self.asked[number] = struct.unpack(f">{length // 4}I", data[8:8 + length])
        if command == WRITE_REGISTER or command == WRITE_MEMORY and length == 8:  # one address, one word
            data = data[:8] + self.with_own_target(data[8:8 + length])
        self.behind.sendto(data, (self.camera, CONTROL_PORT))

    def with_own_target(self, pairs):
        """The camera streams to here, and what comes here goes on to where the host wants it."""
        out = b""
        for at in range(0, len(pairs), 8):
            register, value = struct.unpack(">II", pairs[at:at + 8])
            if register == STREAM_ADDRESS:
                self.target_address = socket.inet_ntoa(struct.pack(">I", value))
                value = struct.unpack(">I", socket.inet_aton(self.address))[0]
            elif register == STREAM_PORT:
                self.target_port = value & 0xFFFF
                if self.target_port:
                    value = value & ~0xFFFF | self.stream.getsockname()[1]
            out += struct.pack(">II", register, value)
        return out

    def from_camera(self, data):
        if self.host is None or len(data) < 8:
            return
        answer, length, number = struct.unpack(">HHH", data[2:8])
        if answer == DISCOVERY_ACK:
            data = data[:CURRENT_IP_AT] + socket.inet_aton(self.address) + data[CURRENT_IP_AT + 4:]
        if answer == READ_REGISTER_ACK:
            registers = self.asked.pop(number, ())
            values = list(struct.unpack(f">{length // 4}I", data[8:8 + length]))
            for at, register in enumerate(registers[:len(values)]):
                if register == CAPABILITY:
                    values[at] |= CAN_RESEND
            data = data[:8] + struct.pack(f">{len(values)}I", *values)
        if answer == READ_MEMORY_ACK and length == 8:
            register, value = struct.unpack(">II", data[8:16])
            if register == CAPABILITY:
                data = data[:8] + struct.pack(">II", register, value | CAN_RESEND)
        self.control.sendto(data, self.host)

    def pass_on(self, data):
        if not self.target_port or self.target_address is None or len(data) < 8:
            return
        _, block, packet = struct.unpack(">HHI", data[:8])
        self.kept[block, packet & 0xFFFFFF] = data
        while len(self.kept) > 2000:
            self.kept.popitem(last=False)
        if self.random.random() < self.lose:
            self.lost += 1
        else:
            self.stream.sendto(data, (self.target_address, self.target_port))

    def send_again(self, data):
        _, block, first, last = struct.unpack(">HHII", data[8:20])
        for packet in range(first & 0xFFFFFF, min(last & 0xFFFFFF, (first & 0xFFFFFF) + 500) + 1):
            if (block, packet) in self.kept and self.target_port:
                self.stream.sendto(self.kept[block, packet], (self.target_address, self.target_port))
                self.resent += 1
