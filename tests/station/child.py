"""child.py - a process of a test's own that does something to the station, and may be killed."""

import json
import os
import select
import signal
import sys
import traceback


class Child:
    """function(say) in a process of its own; say(value) hands a value of JSON to the parent.
    as_user: (uid, gids) to become first."""

    def __init__(self, function, as_user=None):
        self._read, write = os.pipe()
        self.pid = os.fork()
        if self.pid == 0:
            status = 1
            try:
                os.close(self._read)
                self._become(as_user)
                function(lambda value: os.write(write, json.dumps(value).encode() + b"\n"))
                status = 0
            except BaseException:  # pylint: disable=broad-except
                traceback.print_exc()
                sys.stderr.flush()
            finally:
                os._exit(status)
        os.close(write)
        self._bytes = b""

    @staticmethod
    def _become(as_user):
        if as_user is not None:
            uid, gids = as_user
            os.setgroups(gids[1:])
            os.setresgid(gids[0], gids[0], gids[0])
            os.setresuid(uid, uid, uid)

    def heard(self, timeout_s=30):
        """The next value the child says."""
        while b"\n" not in self._bytes:
            if not select.select([self._read], [], [], timeout_s)[0]:
                raise AssertionError("the child says nothing")
            data = os.read(self._read, 1 << 16)
            if not data:
                raise AssertionError("the child has ended")
            self._bytes += data
        line, self._bytes = self._bytes.split(b"\n", 1)
        return json.loads(line)

    def kill(self):
        """As when a program crashes; what ended before is waited for."""
        if self.pid:
            os.kill(self.pid, signal.SIGKILL)
            os.waitpid(self.pid, 0)
            self.pid = 0

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()
        os.close(self._read)


def forever():
    """Hold what is held until killed."""
    while True:
        signal.pause()
