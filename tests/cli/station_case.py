"""station_case.py - cases whose commands talk to a real skinspecd (tests/station/daemon.py).

What the commands print is compared with what the independent client of tests/station gets from
the same daemon."""

import os
import random
import sys

sys.path.insert(
    0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "station")
)

from daemon import FAST, Daemon  # noqa: E402
from support import Case, Terminal, environment, run, skin_like, start  # noqa: E402

# 400..700 nm by 10, for match.spectrum.
SPECTRUM = {"first_nm": 400, "step_nm": 10, "values": skin_like(random.Random(1))}


class StationCase(Case):
    """A daemon for the class; `options` and `instruments` as Daemon has them."""

    instruments = (FAST,)
    options = ()

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.daemon = cls.new_daemon(*cls.options, instruments=cls.instruments)

    @classmethod
    def tearDownClass(cls):
        with cls.daemon:
            pass
        super().tearDownClass()

    @staticmethod
    def new_daemon(*options, **more):
        """Ready to measure but for the calibration."""
        daemon = Daemon(*options, **more)
        daemon.wait_for_table()
        if more.get("instruments", True):
            daemon.wait_for_instrument()
        return daemon

    def env(self, daemon=None, **more):
        return environment(SKINSPEC_SOCKET=(daemon or self.daemon).socket, **more)

    def skinspec(self, *arguments, daemon=None, **more):
        return run(*arguments, env=self.env(daemon), **more)

    def done(self, *arguments, daemon=None, **more):
        return self.run_ok(*arguments, env=self.env(daemon), **more)

    def refuses(self, status, *arguments, says=(), daemon=None, **more):
        """A run that ends with this status and a message with all these texts, be it after
        the guide's or the progress."""
        done = self.skinspec(*arguments, daemon=daemon, **more)
        self.assertEqual(done.status, status, f"{arguments}: {done.err}{done.out[:300]}")
        said = "\n".join(x for x in done.err.splitlines() if x.startswith("skinspec"))
        for text in [says] if isinstance(says, str) else says:
            self.assertIn(text, said, f"{arguments}: {done.err}")
        return done

    def start(self, *arguments, daemon=None, **more):
        return start(*arguments, env=self.env(daemon), **more)

    def terminal(self, *arguments, daemon=None, **more):
        return Terminal(*arguments, env=self.env(daemon, TERM="dumb"), **more)

    def client(self, daemon=None, **more):
        return self.enterContext((daemon or self.daemon).client(**more))

    def calibrated(self, daemon=None):
        self.done("calibrate", "--yes", daemon=daemon)

    def store(self, n, daemon=None, **more):
        """n records of a spectrum, made by the independent client; their objects, oldest first."""
        with (daemon or self.daemon).client() as c:
            first = c.call("status.get")["last_seq"]
            for _ in range(n):
                c.call("match.spectrum", spectrum=SPECTRUM, specular="sce", store=True, **more)
            return all_records(c, first)


def all_records(client, since=0):
    """The records after since, by record.list."""
    records, more = [], True
    while more:
        page = client.call("record.list", since_seq=since)
        records += page["records"]
        since, more = page["next_seq"], page["more"]
    return records
