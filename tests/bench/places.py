"""places.py - the programs of the bench, and the folders that they write into."""

import os
import subprocess

BUILD = os.environ.get("BUILD", "build")
BENCH = os.path.join(BUILD, "bench")
DISK = os.environ.get("BENCH_DIR", os.path.join(BENCH, "disk"))
MEMORY = "/dev/shm"
TABLE = os.path.join(BUILD, "tables", "table-two-layer.db")
ROUNDS = 3


def program(name):
    """Path of a program of tests/bench, built if it is not."""
    path = os.path.join(BENCH, name)
    subprocess.run(["make", "--no-print-directory", f"BUILD={BUILD}", path], check=True)
    return path
