"""environment.py - the peers: which are there, and how they are had.

`make bench-peers` puts what is missing there: Python's packages into an environment of their own in the
build folder, Debian's by tools/need.  `make bench` takes those that are there.  What cannot be had is
told and left out.
"""

import os
import subprocess
import sys

from places import BUILD

VENV = os.path.join(BUILD, "bench-venv")
PYTHON = os.path.join(VENV, "bin", "python")

# As Python imports them and as pip knows them.
_PIP = {
    "numpy": "numpy",
    "scipy": "scipy",
    "sklearn": "scikit-learn",
    "iadpython": "iadpython",
    "uvloop": "uvloop",
    "orjson": "orjson",
}
# As tools/need has it.
_DEBIAN = {
    "nanoflann": ("cmd:c++=g++", "file:/usr/include/nanoflann.hpp=libnanoflann-dev"),
    "cminpack": ("lib:cminpack=libcminpack-dev",),
    "redis": ("cmd:redis-server=redis-server", "cmd:redis-benchmark=redis-tools"),
}


def _succeeds(*command):
    return subprocess.run(
        command, check=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
    ).returncode == 0  # fmt: skip


def _imports(*modules):
    return os.path.exists(PYTHON) and _succeeds(PYTHON, "-c", "import " + ", ".join(modules))


def _make_environment():
    """A Python with pip in the build folder; False, and a message, where there can be none."""
    if os.path.exists(PYTHON) and _succeeds(PYTHON, "-m", "pip", "--version"):
        return True
    pip = os.path.join(os.path.dirname(os.__file__), "ensurepip")
    needed = subprocess.run(["tools/need", f"file:{pip}=python3-venv"], check=False)
    if needed.returncode == 0 and _succeeds(sys.executable, "-m", "venv", VENV):
        return True
    print("bench: no environment for Python's packages: python3-venv is missing and cannot be had")
    return False


def fetch():
    """Each peer that is not there, if it can be had."""
    for name, needs in _DEBIAN.items():
        if subprocess.run(["tools/need", *needs], check=False).returncode != 0:
            print(f"bench: {name} cannot be had")
    if all(_imports(module) for module in _PIP) or not _make_environment():
        return
    for module, package in _PIP.items():
        if _imports(module):
            continue
        print(f"bench: installing by pip, in {VENV}: {package}", flush=True)
        if not _succeeds(PYTHON, "-m", "pip", "install", package):
            print(f"bench: {package} cannot be had: pip does not reach it")


def _told(there, names):
    if not there:
        print(f"bench: not beside {names}, not there: `make bench-peers` puts it there", flush=True)
    return there


def has(name):
    """Whether one of Debian's peers is there; a message where not."""
    return _told(_succeeds("tools/need", "--look", *_DEBIAN[name]), name)


def python_with(*modules):
    """The Python that imports these; None, and a message, where it does not."""
    return PYTHON if _told(_imports(*modules), ", ".join(_PIP[x] for x in modules)) else None


def _command(python, name, arguments):
    program = os.path.join(os.path.dirname(os.path.abspath(__file__)), "peers", name)
    return [python, "-B", program, *arguments]


def _one_core():
    one = {x: "1" for x in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")}
    return {**os.environ, **one}


def run(python, name, *arguments):
    """What peers/NAME prints, run on one core: small matrices are slower on several."""
    return subprocess.run(_command(python, name, arguments), check=True, stdout=subprocess.PIPE,
                          text=True, env=_one_core()).stdout  # fmt: skip


def start(python, name, *arguments):
    """The same, running: it answers each line of its input with one."""
    return subprocess.Popen(_command(python, name, arguments), stdin=subprocess.PIPE,
                            stdout=subprocess.PIPE, text=True, env=_one_core())  # fmt: skip
