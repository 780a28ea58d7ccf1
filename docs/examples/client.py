#!/usr/bin/env python3
"""client.py - measure once at a skinspec station: Python 3's standard library is enough.

    python3 client.py [SOCKET]

SOCKET is the station's; without it SKINSPEC_SOCKET or the usual place.  The protocol is
one JSON object per line both ways; docs/protocol.md has all of it.
"""

import json
import os
import socket
import sys
import uuid


class Station:
    """A connection.  Requests have an id, replies carry it; what has none is news."""

    def __init__(self, path):
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.connect(path)
        self.lines = self.socket.makefile("r", encoding="utf-8", newline="\n")
        self.last_id = 0
        self.hello = self.receive()  # the station speaks first

    def receive(self):
        line = self.lines.readline()
        if not line:
            sys.exit("the station closed the connection")
        message = json.loads(line)
        if message.get("id", 0) is None:  # about no request: the station is full, say
            sys.exit(message["error"]["message"])
        return message

    def call(self, method, **params):
        """Send a request, wait for its reply, give its result."""
        self.last_id += 1
        request = {"jsonrpc": "2.0", "id": self.last_id, "method": method, "params": params}
        self.socket.sendall(json.dumps(request).encode() + b"\n")
        while True:
            reply = self.receive()
            if reply.get("id") == self.last_id:
                break
        if "error" in reply:
            error = reply["error"]  # programs go by data.reason; this is for people
            sys.exit(f"{method}: {error['message']}\n{error['data']['hint']}")
        return reply["result"]


def calibrate_what_is_due(station, instrument, lease):
    """Zero, then white, each once the operator has placed what it needs."""
    for step in instrument["calibration"]:
        if step["due"]:
            print(f"{step['step']}: {step['place']}")
            if sys.stdin.isatty():
                input("Press Enter when it is in place. ")
            station.call("instrument.calibrate", lease=lease, step=step["step"])


def main():
    path = (
        sys.argv[1]
        if len(sys.argv) > 1
        else os.environ.get("SKINSPEC_SOCKET", "/run/skinspec/skinspecd.sock")
    )
    station = Station(path)
    station.call("session.open", major=1, client="client.py")

    instruments = station.call("instrument.list")["instruments"]
    for instrument in instruments:
        print(f"{instrument['instrument']}: {instrument.get('model', '?')}, {instrument['state']}")
    if not instruments:
        sys.exit("the station has no instrument; start skinspecd with --instrument")

    # The lease makes the instrument ours until we release it, go away, or do nothing for a minute.
    name = instruments[0]["instrument"]
    lease = station.call("instrument.acquire", instrument=name, ttl_ms=60000, wait=True)["lease"]
    calibrate_what_is_due(station, instruments[0], lease)

    # The uuid is ours: should the reply get lost, the same request again gives the same record.
    record = station.call(
        "measure.start",
        lease=lease,
        uuid=str(uuid.uuid4()),
        specular="sce",
        replicates=3,
        pace="auto",
    )
    station.call("instrument.release", lease=lease)

    print(f"record {record['id']}")
    if "Lab" in record:
        L, a, b = record["Lab"]
        print(f"L* {L:.2f}  a* {a:.2f}  b* {b:.2f}  ITA {record['ITA']:.1f} degrees")
    if "match" in record:
        match = record["match"]
        print(f"Cm {match['Cm']:.4f}  Bm {match['Bm']:.2f}  Ch {match['Ch']:.4f}")
    for flag in record["flags"] + record.get("match", {}).get("flags", []):
        print(f"note: {flag}")


if __name__ == "__main__":
    main()
