"""transport.py - transport-8 beside its plain twin and iadpython."""

import subprocess

import environment
import places
from report import heading, row

TIMES_IADPYTHON = 100


def show():
    heading("one wavelength with 8 streams")
    program = places.program("transport")
    said = subprocess.run([program], check=True, stdout=subprocess.PIPE, text=True).stdout
    print(said, end="")
    python = environment.python_with("iadpython", "scipy")
    if python is None:
        return
    peer_us = float(environment.run(python, "transport_iadpython.py"))
    times = peer_us / float(said.split()[1])
    row("iadpython, one endless layer", f"{peer_us:.0f} us")
    row("times as fast", f"{times:.0f}", f">= {TIMES_IADPYTHON}", times >= TIMES_IADPYTHON)
