"""A client that looks at pictures: inline, or as files beside the replies."""
import array
import base64
import json
import os
import socket

from harness import LENS, PATIENCE, Client, Daemon

COLOUR_SCENE = """version = 1
[camera]
width = 64
height = 48
colour = true
bits = 12
frame_rate_hz = 200
exposure_ms = 1
[lens]
model = "thin"
focal_length_mm = 25.0
f_number = [1.4, 16.0]
extension_mm = [0.0, 1.6]
steps = 8192
speed_steps_per_s = 4000
[[surface]]
kind = "wall"
distance_m = 1.2
gradient = [0.05, 0.95]
"""


class FileClient(Client):
    """A client that takes the files that come with replies."""

    def __init__(self, path, timeout=30 * PATIENCE):
        super().__init__(path, timeout)
        self.files = []

    def receive(self):
        while b"\0" not in self.buffer:
            try:
                data, files, _, _ = socket.recv_fds(self.socket, 65536, 16)
            except ConnectionResetError:
                return None
            self.files += files
            if not data:
                return None
            self.buffer += data
        message, self.buffer = self.buffer.split(b"\0", 1)
        return self.judged(json.loads(message.decode()))

    def __exit__(self, *unused):
        for file in self.files:
            os.close(file)
        super().__exit__()


def scene_daemon(folder, text):
    """lensd with one lens `a` in a scene of its own."""
    scene = os.path.join(folder, "scene.toml")
    with open(scene, "w", encoding="utf-8") as file:
        file.write(text)
    return Daemon(config=f'version = 1\n[[lens]]\nname = "a"\ndriver = "sim"\nscene = "{scene}"\n')


def view(client, **parameters):
    client.send(LENS + "View", parameters, more=True)


def next_picture(client):
    """The first reply of the next picture, and all its bytes. The view must go on: after an error nothing comes."""
    first = client.receive()
    assert first and first.get("continues"), first
    reply = first["parameters"]
    if reply.get("fd") is not None:
        file = client.files.pop(reply["fd"])
        data = os.pread(file, reply["size"] + 1, 0)
        os.close(file)
        return reply, data
    data = base64.b64decode(reply["data"], validate=True)
    while len(data) < reply["size"]:
        piece = client.receive()["parameters"]
        assert piece["offset"] == len(data), piece["offset"]
        data += base64.b64decode(piece["data"], validate=True)
    return reply, data


def snapshot(client, **parameters):
    client.send(LENS + "Snapshot", parameters, more=True)
    data, about = b"", None
    while True:
        message = client.receive()
        if "error" in message:
            return message, b""
        piece = message["parameters"]
        about = about or piece
        data += base64.b64decode(piece["data"], validate=True)
        if not message.get("continues"):
            return about, data


def words(data):
    return list(array.array("H", data))
