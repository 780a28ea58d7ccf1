"""inversion.py - one spectrum to one skin, and many together, beside cminpack's lmder and scipy."""

import subprocess

import environment
import machine
import places
import report
from report import heading


def show():
    """The programs print what they find."""
    heading("one spectrum of 31 bands to one skin, beside cminpack's lmder")
    if not environment.has("cminpack"):
        print("bench: inversion not measured: the program that does has lmder in it")
        return
    program = places.program("inversion")
    with machine.Others() as others:
        subprocess.run([program], check=False)  # ends with 1 where a bar is missed, and says so
    report.others(others.percent)
    python = environment.python_with("scipy")
    if python is not None:
        heading("all together, beside scipy's bounded least squares")
        print(environment.run(python, "scipy_inversion.py"), end="")
