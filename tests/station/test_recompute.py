"""A stored match computed again: the same bits here, 1e-10 on a machine that lacks instructions."""

import json
import os
import subprocess

from daemon import Case, Daemon, main

# glibc then takes other versions of exp, log, pow and sin, as on an older processor.
OLDER = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX2,-FMA"}


def takes_effect():
    """Whether the tunable changes anything: the C library's own list of what it would use."""
    linker = "/lib64/ld-linux-x86-64.so.2"
    if not os.path.exists(linker):
        return False
    said = [
        subprocess.run([linker, "--list-diagnostics"], env=env, capture_output=True, text=True, check=False)
        for env in (dict(os.environ), {**os.environ, **OLDER})
    ]
    wanted = [[x for x in s.stdout.splitlines() if "active" in x or "usable" in x] for s in said]
    return wanted[0] != wanted[1]


class Recompute(Case):
    instruments = None

    def test_here_and_elsewhere(self):
        with Daemon() as daemon:
            daemon.wait_for_table()
            daemon.wait_for_instrument()
            with daemon.client() as c:
                lease = c.acquire()["lease"]
                c.calibrate(lease)
                ids = [c.measure(lease, replicates=3)["id"] for _ in range(10)]
                for one in ids:
                    again = c.call("record.recompute", id=one)
                    self.assertEqual((again["same_bits"], again["difference"]), (True, 0))
                    self.assertEqual(again["stored"], again["recomputed"])
            daemon.stop()
            daemon.env = OLDER
            daemon.start()
            daemon.wait_for_table()
            with daemon.client() as c:
                worst = max(c.call("record.recompute", id=one)["difference"] for one in ids)
            print(json.dumps({"difference": worst, "tunable takes effect": takes_effect()}))
            self.assertLessEqual(worst, 1e-10)


if __name__ == "__main__":
    main()
