"""A network of its own for a test that plays GigE cameras. GigE Vision has one port an address, so two tests that play a camera at
127.0.0.1 disturb each other; a network namespace has its own loopback.

usage: own_network.py               ends with 0 where this machine lets a process have a network of its own
       own_network.py COMMAND ...   becomes the command in such a network, and says so in LENSD_OWN_NETWORK; where the kernel gives
                                    none, the command runs in the machine's network, and takes its turn"""
import ctypes
import fcntl
import os
import socket
import struct
import sys

CLONE_NEWUSER, CLONE_NEWNET = 0x10000000, 0x40000000
SIOCGIFFLAGS, SIOCSIFFLAGS, IFF_UP = 0x8913, 0x8914, 1
TURN = "/tmp/lensd-test-gige.lock"


def take_own_network():
    """This process and those that it starts have a network with nothing but loopback, if the kernel allows it."""
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.unshare(CLONE_NEWNET) != 0:  # only root may
        user, group = os.getuid(), os.getgid()
        if libc.unshare(CLONE_NEWUSER | CLONE_NEWNET) != 0:
            return False
        for file, text in (("setgroups", "deny"), ("uid_map", f"{user} {user} 1"), ("gid_map", f"{group} {group} 1")):
            with open("/proc/self/" + file, "w", encoding="ascii") as opened:
                opened.write(text)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        name, flags = struct.unpack("16sh", fcntl.ioctl(any_socket, SIOCGIFFLAGS, struct.pack("16sh", b"lo", 0))[:18])
        fcntl.ioctl(any_socket, SIOCSIFFLAGS, struct.pack("16sh14x", name, flags | IFF_UP))
    return True


class Turn:
    """Where a process can have no network of its own, it waits until no other test plays a camera."""

    def __init__(self):
        self.file = None

    def take(self, own=True):
        """own: take a network of its own if possible."""
        if own and take_own_network():
            return
        self.file = open(TURN, "a", encoding="utf-8")
        fcntl.flock(self.file, fcntl.LOCK_EX)

    def give(self):
        if self.file:
            self.file.close()


if __name__ == "__main__":
    own = take_own_network()
    if len(sys.argv) == 1:
        sys.exit(0 if own else 1)
    if own:
        os.environ["LENSD_OWN_NETWORK"] = "1"
    os.execv(sys.argv[1], sys.argv[1:])
