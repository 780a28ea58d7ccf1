"""environment.py - the peers' Python: packages in an environment of their own in the build folder,
put there once and only where somebody asks for peers (`make bench-peers`)."""

import os
import subprocess
import sys

BUILD = os.environ.get("BUILD", "build")
VENV = os.path.join(BUILD, "bench-venv")
PYTHON = os.path.join(VENV, "bin", "python")


def _succeeds(*command):
    return subprocess.run(
        command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ).returncode == 0  # fmt: skip


def run(python, name, *arguments):
    """What peers/NAME prints, run on one core: small matrices are slower on several."""
    program = os.path.join(os.path.dirname(os.path.abspath(__file__)), "peers", name)
    one = {x: "1" for x in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    return subprocess.run([python, "-B", program, *arguments], check=True, stdout=subprocess.PIPE,
                          text=True, env={**os.environ, **one}).stdout  # fmt: skip


def python_with(**packages):
    """A Python that can import these modules; `module=package` as pip knows it.  None, and a message,
    where it cannot be had."""
    imports = "import " + ", ".join(packages)
    if os.path.exists(PYTHON) and _succeeds(PYTHON, "-c", imports):
        return PYTHON
    if (os.path.exists(PYTHON) or _succeeds(sys.executable, "-m", "venv", VENV)) and _succeeds(
        PYTHON, "-m", "pip", "install", *packages.values()
    ):
        return PYTHON
    print(f"bench: not beside {', '.join(packages.values())}: python3-venv is missing, or pip reaches none")
    return None
