#!/usr/bin/env python3
"""test_clock_steps.py - the clock is stepped under a running station: by an hour, to 1970, by ten years.

What the program takes for CLOCK_REALTIME is shifted by a library that is loaded before libc's; the
machine's own clock stays.

expect: docs/data.md (ids and seq rise whatever the clock does, taken_at is the clock as it was), the
calibration's age by CLOCK_BOOTTIME."""

import os
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

from daemon import INSTRUMENTED, Case, Daemon, main  # noqa: E402

SHIFTED = r"""
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

/* The seconds to add to the time of day, as the file says at this moment. */
int clock_gettime(clockid_t clock, struct timespec *ret)
{
    static int (*next)(clockid_t, struct timespec *);
    if (next == NULL)
        *(void **)&next = dlsym(RTLD_NEXT, "clock_gettime");
    int e = next(clock, ret);
    FILE *file = clock == CLOCK_REALTIME ? fopen(getenv("CLOCK_SHIFT"), "re") : NULL;
    long seconds = 0;
    if (file != NULL && fscanf(file, "%ld", &seconds) == 1)
        ret->tv_sec += seconds;
    if (file != NULL)
        fclose(file);
    return e;
}
"""
HOUR_S, TEN_YEARS_S = 3600, 3653 * 86400
STEPS = (("an hour ahead", HOUR_S), ("an hour back", -HOUR_S), ("1970", None),
         ("ten years ahead", TEN_YEARS_S), ("as it was", 0))  # fmt: skip


@unittest.skipIf(INSTRUMENTED, "a sanitizer has a clock_gettime() of its own before libc's")
class Stepped(Case):
    instruments = None

    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="sk.", dir="/tmp")
        self.addCleanup(shutil.rmtree, self.folder, ignore_errors=True)
        library, source = (os.path.join(self.folder, x) for x in ("shift.so", "shift.c"))
        with open(source, "w", encoding="ascii") as file:
            file.write(SHIFTED)
        subprocess.run(
            [os.environ.get("CC", "cc"), "-shared", "-fPIC", source, "-o", library, "-ldl"],
            check=True, timeout=60,
        )  # fmt: skip
        env = {"LD_PRELOAD": library, "CLOCK_SHIFT": self.file}
        self.step(0)
        self.daemon = self.enterContext(Daemon(env=env))

    @property
    def file(self):
        return os.path.join(self.folder, "seconds")

    def step(self, seconds):
        """None: to a minute after the epoch."""
        seconds = 60 - int(time.time()) if seconds is None else seconds
        with open(self.file + ".new", "w", encoding="ascii") as file:
            print(seconds, file=file)
        os.rename(self.file + ".new", self.file)
        return seconds

    def test_ids_ages_and_times(self):
        c, lease = self.ready()
        records = [c.measure(lease)]
        for what, by in STEPS:
            with self.subTest(what=what):
                by = self.step(by)
                before = self.daemon.cpu_ticks()
                time.sleep(1)
                self.assertLessEqual(self.daemon.cpu_ticks() - before, 10, "no timer storm")
                record = c.measure(lease)  # the calibration is as good, and the lease as long, as before
                told = time.strftime("%Y-%m-%dT%H:%M", time.gmtime(time.time() + by))
                near = time.strftime("%Y-%m-%dT%H:%M", time.gmtime(time.time() + by - 2))
                self.assertIn(record["taken_at"][:16], (told, near))
                for step in c.call("instrument.list")["instruments"][0]["calibration"]:
                    self.assertFalse(step["due"])
                    self.assertLess(step["age_s"], 60)
                self.assertEqual(c.call("record.get", id=record["id"]), record)
                records.append(record)
        self.assertEqual([x["seq"] for x in records], list(range(1, len(records) + 1)))
        ids = [x["id"] for x in records]
        self.assertEqual(sorted(set(ids)), ids, "unique, and in order")
        self.assertTrue(c.call("store.verify")["sound"])

    def test_restarted_with_an_earlier_clock(self):
        """As where a battery of the clock is empty: what is stored is there, ids go on above it."""
        c, lease = self.ready()
        first = c.measure(lease)
        self.step(None)
        self.daemon.restart()
        c, lease = self.ready()
        second = c.measure(lease)
        self.assertEqual((first["seq"], second["seq"]), (1, 2))
        self.assertLess(first["id"], second["id"])
        self.assertEqual(second["taken_at"][:4], "1970")
        self.assertEqual(c.call("record.get", id=first["id"]), first)


if __name__ == "__main__":
    main()
