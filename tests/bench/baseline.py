"""baseline.py - match.spectrum as a good service in Python would do it: what the station is
measured against.

    baseline.py SOCKET STATION.DB

asyncio on uvloop, orjson, sqlite3 with prepared statements.  It speaks as much of the
protocol as the load needs and writes the same rows under the same pragmas into a file that
skinspecd has made, audit chain included, with one commit for each request; checkpoints
are a thread's.  It does not match: every answer is the same, which favours it, as does that
it hardly checks what comes.
"""

import asyncio
import hashlib
import os
import sqlite3
import struct
import sys
import threading
import time

import orjson
import uvloop

CHECKPOINT_S = 5

# As db/store_open.c has them.
PRAGMAS = """
PRAGMA foreign_keys = ON; PRAGMA secure_delete = ON; PRAGMA temp_store = MEMORY;
PRAGMA cell_size_check = ON; PRAGMA trusted_schema = OFF; PRAGMA synchronous = FULL;
PRAGMA wal_autocheckpoint = 0; PRAGMA cache_size = -8000; PRAGMA journal_size_limit = 16777216;
PRAGMA journal_mode = WAL;
"""

TABLE_SHA256 = "0" * 64
MATCH = {
    "Cm": 0.02098671630898149, "Bm": 0.95, "Ch": 0.001,
    "L": 65.8849234670618, "a": 3.806301662672873, "b": 15.650042848619794,
    "dE00": 0.7354775920592369, "rms": 0.011010572518433652, "distance": 0.011010572518433652,
    "by": "spectrum", "table": "two-layer", "table_sha256": TABLE_SHA256,
    "flags": ["Ch_at_limit"],
}  # fmt: skip
MATCH_TEXT = orjson.dumps(MATCH).decode()
COLOUR = {
    "X": 34.4513197, "Y": 35.110604290000005, "Z": 27.088979099999996,
    "L": 65.8346883135966, "a": 4.059621737617314, "b": 14.69211432323132,
    "red": 177, "green": 157, "blue": 134,
    "ITA": 47.14349744182076, "ita_scheme": "del-bino-2013", "illuminant": "D65",
    "observer": "10", "flags": "[]",
}  # fmt: skip

HELLO = {
    "jsonrpc": "2.0",
    "method": "hello",
    "params": {"protocol": {"major": 1, "minor": 0}, "server": "baseline"},
}
OPENED = {"protocol": {"major": 1, "minor": 0}, "right": "admin", "event_seq": 0}


class Refused(Exception):
    """What was asked is not as it must be."""


# ---- rows ---------------------------------------------------------------------------------


def uuid7(ms):
    """Of RFC 9562, random behind the time."""
    bits = int.from_bytes(os.urandom(10), "big")
    value = (ms << 80) | (7 << 76) | ((bits >> 64 & 0xFFF) << 64) | 2 << 62 | bits & (1 << 62) - 1
    text = f"{value:032x}"
    return f"{text[:8]}-{text[8:12]}-{text[12:16]}-{text[16:20]}-{text[20:]}"


def date_time(ms):
    return time.strftime("%Y-%m-%dT%H:%M:%S", time.gmtime(ms // 1000)) + f".{ms % 1000:03d}Z"


def dump(table, row):
    """The canonical dump of db/audit.h; None is left out."""
    out = [table, "\n"]
    for name, value in row.items():
        if value is None:
            continue
        if isinstance(value, int):
            text = str(value)
            out.append(f"{name}=i{len(text)}:{text}\n")
        elif isinstance(value, float):
            out.append(f"{name}=f16:{struct.pack('>d', value).hex()}\n")
        elif isinstance(value, bytes):  # as Latin-1 every byte is itself
            out.append(f"{name}=b{len(value)}:{value.decode('latin-1')}\n")
        else:
            value = value.encode().decode("latin-1")
            out.append(f"{name}=t{len(value)}:{value}\n")
    return "".join(out).encode("latin-1")


class Store:
    """The one connection that writes."""

    def __init__(self, path):
        self.db = sqlite3.connect(path, isolation_level=None, cached_statements=64)
        self.db.executescript(PRAGMAS)
        with open("/proc/sys/kernel/random/boot_id", encoding="ascii") as file:
            self.boot_id = file.read().strip()
        self.seq = self.db.execute("SELECT coalesce(max(seq), 0) FROM measurement").fetchone()[0]
        self.audit_id, self.hash = self.db.execute(
            "SELECT id, hash FROM audit ORDER BY id DESC LIMIT 1"
        ).fetchone()
        self.inserts = {}

    def _insert(self, table, row):
        sql = self.inserts.get(table)
        if sql is None:
            columns = ", ".join(row)
            marks = ", ".join("?" * len(row))
            sql = self.inserts[table] = f"INSERT INTO {table}({columns}) VALUES ({marks})"
        self.db.execute(sql, tuple(row.values()))

    def add(self, spectrum, specular, operator, uuid, parameters):
        """One reading, committed: its id, seq and time."""
        self.db.execute("BEGIN IMMEDIATE")
        try:
            kept = self._add(spectrum, specular, operator, uuid, parameters)
        except BaseException:
            self.db.execute("ROLLBACK")
            raise
        self.db.execute("COMMIT")
        self.seq, self.audit_id, self.hash = kept["seq"], self.audit_id + 1, kept.pop("hash")
        return kept

    def _add(self, spectrum, specular, operator, uuid, parameters):
        ms = time.time_ns() // 1000000
        seq, at, record_id = self.seq + 1, date_time(ms), uuid7(ms)
        values = spectrum["values"]
        measurement = {
            "seq": seq, "id": record_id, "taken_at": at, "boot_id": self.boot_id,
            "boottime_ms": time.clock_gettime_ns(time.CLOCK_BOOTTIME) // 1000000,
            "uuid": uuid, "parameters_sha256": parameters, "operator": operator, "fence": 0,
            "specular": specular, "first_nm": float(spectrum["first_nm"]),
            "step_nm": float(spectrum["step_nm"]), "bands": len(values),
            "spectrum": struct.pack(f"<{len(values)}d", *values), "replicates": 0,
            **COLOUR, "owner_uid": 0,
        }  # fmt: skip
        match = {
            "measurement": seq, "table_name": "two-layer", "table_sha256": TABLE_SHA256,
            "method": "spectrum", "result": MATCH_TEXT,
        }  # fmt: skip
        self._insert("measurement", measurement)
        self._insert("match", match)
        if uuid is not None:
            self._insert_uuid(uuid, parameters, seq, ms)
        rows = (dump("measurement", measurement), dump("match", match))
        audit = {
            "id": self.audit_id + 1, "at": at, "who": operator, "action": "measurement.add",
            "entity": record_id, "digests": b"".join(hashlib.sha256(r).digest() for r in rows),
        }  # fmt: skip
        audit["hash"] = hashlib.sha256(self.hash + dump("audit", audit)).digest()
        self._insert("audit", audit)
        return {"id": record_id, "seq": seq, "taken_at": at, "hash": audit["hash"]}

    def _insert_uuid(self, uuid, parameters, seq, ms):
        known = self.db.execute("SELECT 1 FROM client_uuid WHERE uuid = ?", (uuid,)).fetchone()
        if known:
            raise Refused("the uuid was used before")
        self._insert(
            "client_uuid",
            {"uuid": uuid, "parameters_sha256": parameters, "measurement": seq, "at_ms": ms},
        )


def checkpoint_for_ever(path):
    db = sqlite3.connect(path, isolation_level=None)
    db.execute("PRAGMA synchronous = FULL")
    while True:
        time.sleep(CHECKPOINT_S)
        db.execute("PRAGMA wal_checkpoint(PASSIVE)").fetchone()


# ---- the service ----------------------------------------------------------------------------


class Connection(asyncio.Protocol):
    """Lines in, lines out; nothing waits but the commit."""

    store = None

    def __init__(self):
        self.transport, self.unread, self.operator = None, b"", None

    def connection_made(self, transport):
        self.transport = transport
        transport.write(orjson.dumps(HELLO, option=orjson.OPT_APPEND_NEWLINE))

    def data_received(self, data):
        *lines, self.unread = (self.unread + data).split(b"\n")
        for line in lines:
            self.transport.write(self._answer(line))

    def _answer(self, line):
        reply = {"jsonrpc": "2.0", "id": None}
        try:
            request = orjson.loads(line)
            reply["id"] = request["id"]
            reply["result"] = self._serve(request["method"], request["params"])
        except (Refused, KeyError, TypeError, ValueError) as error:
            reply["error"] = {"code": -32602, "message": str(error)}
        return orjson.dumps(reply, option=orjson.OPT_APPEND_NEWLINE)

    def _serve(self, method, params):
        if method == "match.spectrum":
            return self._match(params)
        if method == "session.open":
            self.operator = params["operator"]
            return OPENED
        raise Refused("there is no such method")

    def _match(self, params):
        spectrum, uuid = params["spectrum"], params.get("uuid")
        if not all(0 <= value <= 2 for value in spectrum["values"]):
            raise Refused("a value is outside 0..2")
        parameters = None
        if uuid is not None:
            sorted_params = orjson.dumps(params, option=orjson.OPT_SORT_KEYS)
            parameters = hashlib.sha256(sorted_params).hexdigest()
        kept = self.store.add(spectrum, params["specular"], self.operator, uuid, parameters)
        return {**MATCH, "record": kept}


async def serve(socket_path):
    server = await asyncio.get_running_loop().create_unix_server(Connection, socket_path)
    await server.serve_forever()


def main():
    socket_path, path = sys.argv[1:]
    Connection.store = Store(path)
    threading.Thread(target=checkpoint_for_ever, args=(path,), daemon=True).start()
    uvloop.install()
    asyncio.run(serve(socket_path))


if __name__ == "__main__":
    main()
