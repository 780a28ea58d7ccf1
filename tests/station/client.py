"""client.py - a client of the station, written from docs/protocol.md alone.

It shares no code with the station, so that the two can disagree.  Everything has a
timeout; what is no JSON of RFC 8259, names a member twice or sends null fails at once.
Python 3's standard library only.
"""

import collections
import json
import select
import socket
import time
import uuid

TIMEOUT_S = 20


class Refused(Exception):
    """The member `error` of a reply."""

    def __init__(self, error, request=None):
        data = error["data"]
        super().__init__(f"{data['reason']}: {error['message']}")
        self.error, self.request = error, request
        self.code, self.message = error["code"], error["message"]
        self.reason, self.hint = data["reason"], data["hint"]
        self.retryable, self.path = data["retryable"], data.get("path")


class Closed(Exception):
    """The station has closed the connection."""


class Silent(Exception):
    """Nothing came in time."""


def _no_constant(name):
    raise ValueError(f"{name} is no JSON")


def _members(pairs):
    names = [name for name, _ in pairs]
    if len(set(names)) != len(names):
        raise ValueError(f"a member is named twice: {names}")
    return dict(pairs)


def read_line(line):
    """The message of a line from the station."""
    message = json.loads(
        line.decode("utf-8"), parse_constant=_no_constant, object_pairs_hook=_members
    )
    if not isinstance(message, dict) or message.get("jsonrpc") != "2.0":
        raise ValueError(f"no JSON-RPC 2.0: {line[:200]!r}")
    _refuse_null({name: value for name, value in message.items() if name != "id"})
    if "id" in message and ("result" in message) == ("error" in message):
        raise ValueError(f"a reply has a result or an error: {line[:200]!r}")
    return message


def _refuse_null(value):
    if value is None:
        raise ValueError("the station never sends null")
    for part in (
        value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    ):
        _refuse_null(part)


def new_uuid():
    return str(uuid.uuid4())


class Client:
    """One connection.  `hello` is what the station said first; `events` what came since."""

    # Called with (kind, name, value) for each result, error and notification.
    check = staticmethod(lambda kind, name, value: None)

    def __init__(self, path, timeout_s=TIMEOUT_S, hello=True):
        self.timeout_s = timeout_s
        self.socket = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self.socket.settimeout(timeout_s)
        try:
            self._connect(path)
            self._bytes = b""
            self._last_id = 0
            self.connection = None  # its number, from session.open
            self._methods, self._replies = {}, {}
            self.events = collections.deque()
            self.hello = self._first() if hello else None
        except BaseException:
            self.socket.close()
            raise

    def _connect(self, path):
        """With a queue of newcomers that is full for a moment waited for."""
        until = time.monotonic() + self.timeout_s
        while True:
            try:
                return self.socket.connect(path)
            except BlockingIOError:
                if time.monotonic() > until:
                    raise
                time.sleep(0.001)

    def _first(self):
        """The params of hello; one client too many is refused instead."""
        message = self.next_message()
        if "error" in message:
            raise Refused(message["error"])
        if message["method"] != "hello":
            raise ValueError(f"the station begins with {message['method']}")
        return message["params"]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        self.socket.close()

    # ---- lines -----------------------------------------------------------------------

    def send_raw(self, data):
        """Bytes as they are."""
        try:
            self.socket.sendall(data)
        except (BrokenPipeError, ConnectionResetError) as error:
            raise Closed(str(error)) from error

    def send_line(self, line):
        self.send_raw((line.encode("utf-8") if isinstance(line, str) else line) + b"\n")

    def next_line(self, timeout_s=None):
        """The next line from the station, without its LF."""
        until = time.monotonic() + (self.timeout_s if timeout_s is None else timeout_s)
        while b"\n" not in self._bytes:
            left = until - time.monotonic()
            if left < 0 or not select.select([self.socket], [], [], left)[0]:
                raise Silent(f"no line in time; so far {self._bytes[:200]!r}")
            try:
                data = self.socket.recv(1 << 16)
            except ConnectionResetError as error:
                raise Closed(str(error)) from error
            if not data:
                raise Closed("the station closed the connection")
            self._bytes += data
        line, self._bytes = self._bytes.split(b"\n", 1)
        return line

    def next_message(self, timeout_s=None):
        """The next message, whatever it is."""
        line = self.next_line(timeout_s)
        if len(line) >= 1 << 20:
            raise ValueError(f"a line of {len(line)} bytes")
        message = read_line(line)
        if "method" in message:
            self.check("notification", message["method"], message["params"])
        elif "error" in message:
            self.check("error", self._methods.get(message["id"]), message["error"])
        else:
            self.check("result", self._methods.get(message["id"]), message["result"])
        return message

    def _take(self, timeout_s):
        """Read one message and put it where it belongs."""
        message = self.next_message(timeout_s)
        if "method" in message:
            self.events.append(message)
        else:
            self._replies[message["id"]] = message

    def is_closed(self, timeout_s=None):
        """Whether the station closes the connection in time; what comes before is dropped."""
        try:
            while True:
                self.next_line(timeout_s)
        except Closed:
            return True
        except Silent:
            return False

    # ---- requests ----------------------------------------------------------------------

    def send(self, method, **params):
        """Send a request; its id, for wait()."""
        self._last_id += 1
        request = {"jsonrpc": "2.0", "id": self._last_id, "method": method}
        if params:
            request["params"] = params
        self._methods[self._last_id] = method
        self.send_line(json.dumps(request))
        return self._last_id

    def wait(self, request_id, timeout_s=None):
        """The result of a request; events that come meanwhile are kept."""
        until = time.monotonic() + (self.timeout_s if timeout_s is None else timeout_s)
        while request_id not in self._replies:
            self._take(max(until - time.monotonic(), 0))
        reply = self._replies.pop(request_id)
        if "error" in reply:
            raise Refused(reply["error"], self._methods[request_id])
        return reply["result"]

    def call(self, method, timeout_s=None, **params):
        return self.wait(self.send(method, **params), timeout_s)

    def open(self, name="a test", **more):
        opened = self.call("session.open", major=1, client=name, **more)
        self.connection = opened["connection"]
        return opened

    # ---- events ------------------------------------------------------------------------

    def event(self, topic, kind, timeout_s=None, **data):
        """The next event topic/kind with these data; its params.  Others before it stay."""
        return self._awaited(
            lambda m: m["method"] == "event"
            and (m["params"]["topic"], m["params"]["type"]) == (topic, kind)
            and data.items() <= m["params"]["data"].items(),
            timeout_s,
        )

    def lost(self, timeout_s=None):
        """The params of events.lost."""
        return self._awaited(lambda m: m["method"] == "events.lost", timeout_s)

    def _awaited(self, wanted, timeout_s):
        until = time.monotonic() + (self.timeout_s if timeout_s is None else timeout_s)
        while True:
            for message in self.events:
                if wanted(message):
                    self.events.remove(message)
                    return message["params"]
            self._take(max(until - time.monotonic(), 0))

    # ---- what most tests need ---------------------------------------------------------

    def acquire(self, instrument=None, ttl_ms=60000, wait=False, timeout_s=None):
        """The lease_result of an instrument; of the first where none is named."""
        if instrument is None:
            instrument = self.call("instrument.list")["instruments"][0]["instrument"]
        return self.call(
            "instrument.acquire", timeout_s, instrument=instrument, ttl_ms=ttl_ms, wait=wait
        )

    def calibrate(self, lease):
        for step in ("zero", "white"):
            self.call("instrument.calibrate", lease=lease, step=step)

    def measure(self, lease, **more):
        """measure.start with the usual parameters, or others; the record."""
        params = {
            "lease": lease,
            "uuid": new_uuid(),
            "specular": "sce",
            "replicates": 1,
            "pace": "auto",
        }
        return self.call("measure.start", **{**params, **more})
