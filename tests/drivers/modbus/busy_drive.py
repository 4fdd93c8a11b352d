#!/usr/bin/env python3
"""busy_drive.py PORT CODE COUNT: a drive of the profile "generic" on loopback that answers COUNT readings with exception CODE 200 ms
after each command to move (5 acknowledged, 6 busy, 10 and 11 from a gateway). PORT 0: any, it is printed.

Registers: target s32 at 0, position s32 at 2, speed 4, start 5, home 6, stop 7, status 10. Commands on stdin, one answer a line:
  busy CODE COUNT KIND OBEYS   the next COUNT questions of KIND (reads, writes, all) are answered with CODE; OBEYS 1: writes act
                               all the same; COUNT -1: until told otherwise. CODE 0: not answered at all
  where                        place of the shaft, 1 while it turns, commands to move and to stop so far, questions answered so
"""
import socket
import struct
import sys
import threading
import time

port, code, count = int(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3])
lock = threading.Lock()
regs = [0] * 20
shaft = {"from": 0.0, "to": 0.0, "t": 0.0, "v": 1e9}
after_move = {"left": 0, "due": 0.0}
busy = {"code": 0, "left": 0, "kind": "all", "obeys": False}
seen = {"moves": 0, "stops": 0, "refused": 0}


def position():
    way = shaft["to"] - shaft["from"]
    gone = (time.monotonic() - shaft["t"]) * shaft["v"]
    return shaft["to"] if gone >= abs(way) else shaft["from"] + (gone if way > 0 else -gone)


def read(address):
    place = int(position()) & 0xFFFFFFFF
    moving = position() != shaft["to"]
    values = {2: place >> 16, 3: place & 0xFFFF, 10: moving | (not moving) << 1 | 8}
    return values.get(address, regs[address] if address < 20 else 0)


def wrote():
    if not (regs[5] or regs[6] or regs[7]):
        return
    here = position()
    goal = here if regs[7] else 0.0 if regs[6] else float(struct.unpack(">i", struct.pack(">HH", regs[0], regs[1]))[0])
    seen["stops" if regs[7] else "moves"] += 1
    shaft.update({"from": here, "to": goal, "t": time.monotonic(), "v": 10.0 * (regs[4] or 1000)})
    if regs[5]:
        after_move.update({"left": count, "due": time.monotonic() + 0.2})
    regs[5] = regs[6] = regs[7] = 0


def refusal(function):
    """The exception that this question is answered with; None: it is answered as it should be."""
    kind = "reads" if function in (3, 4) else "writes"
    if busy["left"] != 0 and busy["kind"] in (kind, "all"):
        busy["left"] -= busy["left"] > 0
        return busy["code"]
    if kind == "reads" and after_move["left"] and time.monotonic() > after_move["due"]:
        after_move["left"] -= 1
        return code
    return None


def answer(pdu):
    function = pdu[0]
    refused = refusal(function)
    if refused is not None:
        seen["refused"] += 1
        if function in (6, 16) and busy["obeys"]:
            obey(pdu)
        return bytes([function | 0x80, refused]) if refused else None
    if function in (3, 4):
        first, number = struct.unpack(">HH", pdu[1:5])
        return bytes([function, 2 * number]) + b"".join(struct.pack(">H", int(read(first + i)) & 0xFFFF) for i in range(number))
    if function in (6, 16):
        obey(pdu)
        return pdu[:5]
    return bytes([function | 0x80, 1])


def obey(pdu):
    first, number = struct.unpack(">HH", pdu[1:5])
    if pdu[0] == 6:
        regs[first] = number
    else:
        regs[first:first + number] = struct.unpack(f">{number}H", pdu[6:6 + 2 * number])
    wrote()


def serve(client):
    with client:
        while (head := client.recv(6, socket.MSG_WAITALL)) and len(head) == 6:
            body = client.recv(struct.unpack(">H", head[4:])[0], socket.MSG_WAITALL)
            with lock:
                reply = answer(body[1:])
            if reply is not None:
                client.sendall(head[:4] + struct.pack(">H", len(reply) + 1) + body[:1] + reply)


def listen(listener):
    while True:
        threading.Thread(target=serve, args=(listener.accept()[0],), daemon=True).start()


def main():
    listener = socket.socket()
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    listener.bind(("127.0.0.1", port))
    listener.listen()
    threading.Thread(target=listen, args=(listener,), daemon=True).start()
    print(listener.getsockname()[1], flush=True)
    for line in sys.stdin:
        words = line.split()
        with lock:
            if words[0] == "busy":
                busy.update({"code": int(words[1]), "left": int(words[2]), "kind": words[3], "obeys": words[4] == "1"})
                print("ok", flush=True)
            else:
                print(int(position()), int(position() != shaft["to"]), seen["moves"], seen["stops"], seen["refused"], flush=True)


if __name__ == "__main__":
    main()
