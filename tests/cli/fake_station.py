"""fake_station.py - something that listens where a station should, and follows a script.

For what the real daemon does not do: other versions, garbage, silence, going away at a
chosen moment.  One connection; the script runs on a thread of its own."""

import json
import os
import shutil
import socket
import tempfile
import threading

HELLO = {
    "protocol": {"major": 1, "minor": 0},
    "server": "a fake",
    "capabilities": [],
    "limits": {"request_bytes": 65536, "reply_bytes": 1048576, "depth": 16, "events": 1024},
    "boot": "00000000-0000-4000-8000-000000000001",
}
SESSION = {"protocol": {"major": 1, "minor": 0}, "right": "admin", "connection": 5, "event_seq": 0}


class Peer:
    """The connection as a script sees it."""

    def __init__(self, connection):
        self.connection = connection
        self.lines = connection.makefile("rb")

    def send(self, line):
        """An object as a line, or bytes as they are; whoever left does not matter."""
        if not isinstance(line, bytes):
            line = json.dumps(line).encode() + b"\n"
        try:
            self.connection.sendall(line)
        except OSError:
            pass

    def notify(self, method, params):
        self.send({"jsonrpc": "2.0", "method": method, "params": params})

    def event(self, seq, topic, kind, /, **data):
        self.notify("event", {"seq": seq, "topic": topic, "type": kind, "data": data})

    def request(self, method):
        """The next request, which must be this one; its id and params."""
        line = json.loads(self.lines.readline())
        if line["method"] != method:
            raise AssertionError(f"asked for {line['method']}, not {method}")
        return line["id"], line["params"]

    def reply(self, number, result):
        self.send({"jsonrpc": "2.0", "id": number, "result": result})

    def refuse(self, number, reason, message="no", hint="do not", **data):
        data.update(reason=reason, hint=hint, retryable=False)
        error = {"code": -32000, "message": message, "data": data}
        self.send({"jsonrpc": "2.0", "id": number, "error": error})

    def answer(self, method, result):
        """Expect a request and give its result; the params."""
        number, params = self.request(method)
        self.reply(number, result)
        return params

    def open(self):
        """hello, and the session the client asks for."""
        self.notify("hello", HELLO)
        self.answer("session.open", SESSION)

    def until_closed(self):
        try:
            while self.lines.readline():
                pass
        except OSError:
            pass  # it left without reading all


class FakeStation:
    """A socket that runs script(peer) on its first connection; closed with the block, which
    raises what the script raised."""

    def __init__(self, script):
        self.folder = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
        self.socket = os.path.join(self.folder, "s")
        self.script, self.error = script, None
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(self.socket)
        self.listener.listen(1)
        self.listener.settimeout(30)
        self.thread = threading.Thread(target=self._run, daemon=True)
        self.thread.start()

    def _run(self):
        try:
            connection, _ = self.listener.accept()
            with connection:
                connection.settimeout(30)
                peer = Peer(connection)
                self.script(peer)
                peer.lines.close()
        except Exception as error:  # pylint: disable=broad-except
            self.error = error

    def __enter__(self):
        return self

    def __exit__(self, kind, *_):
        self.thread.join(30)
        self.listener.close()
        shutil.rmtree(self.folder, ignore_errors=True)
        if kind is None and self.error is not None:
            raise self.error
