"""support.py - what the end-to-end tests of the command line share.

A test file is a program: `main()` at its end runs its `Case`s and prints what
Unity prints, `file:line:name:FAIL: message`, `...:IGNORE: message` and the
closing counts.  The environment names the program (SKINSPEC) and the build
folder (BUILD); files are made in a folder of each test's own below that.
Expected numbers are worked out here in Python or come from print, never from
the program.  Python 3's standard library only.
"""

import csv
import io
import json
import math
import os
import pty
import select
import shutil
import signal
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time
import traceback
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.path.abspath(os.environ.get("BUILD", os.path.join(ROOT, "build")))
SKINSPEC = os.path.abspath(os.environ.get("SKINSPEC", os.path.join(BUILD, "skinspec")))
TABLES = os.path.join(BUILD, "tables")
TWO_LAYER = os.path.join(TABLES, "table-two-layer.db")
PAPER = os.path.join(TABLES, "table-paper.db")
MEASURED = os.environ.get(
    "SKINSPEC_MEASURED", os.path.join(os.path.dirname(ROOT), "shared", "measured")
)
EXAMPLES = os.path.join(ROOT, "docs", "examples", "skin.csv")

# A shell starts background jobs with SIGINT ignored, and the program leaves what is ignored
# alone; the tests that stop it need the usual course.
for _signal in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    if signal.getsignal(_signal) == signal.SIG_IGN:
        signal.signal(_signal, signal.SIG_DFL)

# Sanitizers and coverage slow the program, and the first keep freed memory: limits are not
# for them.
with open(SKINSPEC, "rb") as _program:
    _bytes = _program.read()
    INSTRUMENTED = b"__asan_init" in _bytes or b"__gcov_" in _bytes

# For what hangs, not for what is slow.
TIMEOUT_S = 600 if INSTRUMENTED else 120


# ---- running the program ---------------------------------------------------------


class Result:
    """What a run left: exit status (negative: a signal), both streams as bytes."""

    def __init__(self, status, out, err):
        self.status, self.out_bytes, self.err_bytes = status, out, err

    @property
    def out(self):
        return self.out_bytes.decode("utf-8")

    @property
    def err(self):
        return self.err_bytes.decode("utf-8")

    def json(self):
        return json.loads(self.out, parse_constant=_refuse_constant)

    def ndjson(self):
        return [json.loads(x, parse_constant=_refuse_constant) for x in self.out.splitlines()]

    def rows(self):
        """Standard output as CSV: a list of dictionaries."""
        return list(csv.DictReader(io.StringIO(self.out, newline="")))


def _refuse_constant(name):
    raise ValueError(f"{name} is no JSON")


def environment(**changes):
    """The caller's environment without what would change an answer; a value of
    None takes a variable out."""
    env = dict(os.environ, LC_ALL="C.UTF-8", TERM="xterm-256color")
    for name in ("NO_COLOR", "SKINSPEC_STATE", "SKINSPEC_SOCKET", "XDG_RUNTIME_DIR"):
        env.pop(name, None)
    env.update(changes)
    return {name: value for name, value in env.items() if value is not None}


def run(*arguments, stdin=b"", cwd=None, env=None, **more):
    """Run skinspec to its end."""
    if isinstance(stdin, str):
        stdin = stdin.encode("utf-8")
    done = subprocess.run(
        [SKINSPEC, *map(str, arguments)],
        input=stdin,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        cwd=cwd,
        env=env or environment(),
        timeout=TIMEOUT_S,
        check=False,
        **more,
    )
    return Result(done.returncode, done.stdout, done.stderr)


def start(*arguments, **more):
    """Begin a run; the caller ends it."""
    more.setdefault("env", environment())
    return subprocess.Popen([SKINSPEC, *map(str, arguments)], **more)


class Terminal:
    """A run whose three streams are a terminal: what a person sees and types."""

    def __init__(self, *arguments, **more):
        self.master, slave = pty.openpty()
        self.seen = ""
        more.setdefault("env", environment(TERM="dumb"))
        self.process = subprocess.Popen(
            [SKINSPEC, *map(str, arguments)], stdin=slave, stdout=slave, stderr=slave, **more
        )
        os.close(slave)

    def expect(self, text):
        """Wait until this is shown after what was expected before; all up to it."""
        until = time.monotonic() + TIMEOUT_S
        while text not in self.seen:
            if not self._read(until):
                raise AssertionError(f"ended without {text!r}: {self.seen!r}")
        before, self.seen = self.seen.split(text, 1)
        return before + text

    def _read(self, until):
        """More of what is shown; False at its end."""
        left = until - time.monotonic()
        if left <= 0 or not select.select([self.master], [], [], left)[0]:
            raise AssertionError(f"nothing more is shown: {self.seen!r}")
        try:
            self.seen += os.read(self.master, 65536).decode("utf-8").replace("\r\n", "\n")
        except OSError:  # EIO: the other side is closed
            return False
        return True

    def type(self, text):
        os.write(self.master, text.encode())

    def end(self):
        """Wait for its end; exit status and all that was shown since."""
        until = time.monotonic() + TIMEOUT_S
        while self._read(until):
            pass
        return self.process.wait(TIMEOUT_S), self.seen

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.process.poll() is None:
            self.process.kill()
            self.process.wait(TIMEOUT_S)
        os.close(self.master)


# ---- spectrum files ----------------------------------------------------------------

NM = list(range(400, 701, 10))


def spectra_csv(rows, nm=None, before=("id",), after=()):
    """CSV of spectra: each row is (fields before, values, fields after)."""
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*before, *(f"{x:g}" for x in (nm or NM)), *after])
    for first, values, *rest in rows:
        first = first if isinstance(first, (list, tuple)) else [first]
        last = rest[0] if rest else []
        writer.writerow([*first, *(x if isinstance(x, str) else repr(x) for x in values), *last])
    return text.getvalue()


def skin_like(random, nm=None):
    """Values somewhat like skin: a rise to the red, haemoglobin's two dips."""
    level, rise = random.uniform(0.02, 0.3), random.uniform(0.0, 0.4)
    dip, place = random.uniform(0.0, 0.4), random.uniform(0.45, 0.7)
    values = []
    for x in nm or NM:
        t = (x - 400) / 300
        R = level + rise / (1 + math.exp(-12 * (t - place)))
        for centre, width in ((420, 20), (542, 12), (576, 9)):
            R *= 1 - dip * math.exp(-(((x - centre) / width) ** 2))
        values.append(round(R * random.uniform(0.99, 1.01), 6))
    return values


# ---- tables --------------------------------------------------------------------------


class Table:
    """A table file read by sqlite3 alone."""

    def __init__(self, path):
        db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
        self.path = path
        self.meta = dict(db.execute("SELECT key, value FROM meta"))
        self.rows = []
        columns = "id, cm, bm, ch, l, a, b, r, g, b_, spectrum"
        for row in db.execute(f"SELECT {columns} FROM entry ORDER BY id"):
            values = None
            if row[10] is not None:
                values = struct.unpack(f"<{len(row[10]) // 4}f", row[10])
            self.rows.append(
                {
                    "id": row[0],
                    "Cm": row[1],
                    "Bm": row[2],
                    "Ch": row[3],
                    "Lab": row[4:7],
                    "rgb": row[7:10],
                    "spectrum": values,
                }
            )
        db.close()


def build_table(folder, *options, name="small", model="two-layer"):
    """Make a table; its path."""
    path = os.path.join(folder, f"table-{name}.db")
    made = run("table", "build", "--model", model, "--out", path, *options)
    if made.status != 0:
        raise AssertionError(f"table build ended with {made.status}: {made.err}")
    return path


# ---- colour, written from the standards ------------------------------------------------


def lab(XYZ, white):
    """CIE 15: L*, a*, b*."""

    def f(t):
        return t ** (1 / 3) if t > (24 / 116) ** 3 else (841 / 108) * t + 16 / 116

    x, y, z = (f(v / w) for v, w in zip(XYZ, white))
    return (116 * y - 16, 500 * (x - y), 200 * (y - z))


def srgb_encode(x):
    """IEC 61966-2-1."""
    return 12.92 * x if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055


def srgb_code(linear):
    """8-bit codes of a linear colour, clipped."""
    return [int(math.floor(255 * srgb_encode(min(max(x, 0.0), 1.0)) + 0.5)) for x in linear]


def multiply(matrix, vector):
    return [sum(m * v for m, v in zip(row, vector)) for row in matrix]


def invert(m):
    """3 x 3, by cofactors."""
    (a, b, c), (d, e, f), (g, h, i) = m
    det = a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)
    rows = [
        [e * i - f * h, c * h - b * i, b * f - c * e],
        [f * g - d * i, a * i - c * g, c * d - a * f],
        [d * h - e * g, b * g - a * h, a * e - b * d],
    ]
    return [[x / det for x in row] for row in rows]


SRGB_WHITE = (0.3127 / 0.3290, 1.0, (1 - 0.3127 - 0.3290) / 0.3290)
BRADFORD = [[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]]


def _srgb_matrix():
    """Linear sRGB -> XYZ from the standard's primaries and white."""
    primaries = ((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
    columns = [(x / y, 1.0, (1 - x - y) / y) for x, y in primaries]
    matrix = [list(row) for row in zip(*columns)]
    scale = multiply(invert(matrix), SRGB_WHITE)
    return [[m * s for m, s in zip(row, scale)] for row in matrix]


SRGB_OF_XYZ = invert(_srgb_matrix())


def linear_srgb(XYZ, white):
    """Bradford to sRGB's white, then its matrix.  Y = 100 for white."""
    cone, source = multiply(BRADFORD, XYZ), multiply(BRADFORD, white)
    target = multiply(BRADFORD, SRGB_WHITE)
    cone = [c * t / s for c, s, t in zip(cone, source, target)]
    return multiply(SRGB_OF_XYZ, multiply(invert(BRADFORD), cone))


def ciede2000(first, second):
    """Sharma, Wu, Dalal 2005, k_L = k_C = k_H = 1."""
    (L1, a1, b1), (L2, a2, b2) = first, second
    C_bar = (math.hypot(a1, b1) + math.hypot(a2, b2)) / 2
    G = 0.5 * (1 - math.sqrt(C_bar**7 / (C_bar**7 + 25.0**7)))
    a1, a2 = (1 + G) * a1, (1 + G) * a2
    C1, C2 = math.hypot(a1, b1), math.hypot(a2, b2)
    h1, h2 = (math.degrees(math.atan2(b, a)) % 360 for a, b in ((a1, b1), (a2, b2)))
    dh = 0.0
    h_bar = h1 + h2
    if C1 * C2 != 0:
        dh = (h2 - h1 + 180) % 360 - 180
        h_bar /= 2
        if abs(h1 - h2) > 180:
            h_bar += 180 if h_bar < 180 else -180
    dL, dC = L2 - L1, C2 - C1
    dH = 2 * math.sqrt(C1 * C2) * math.sin(math.radians(dh) / 2)
    L_bar, C_bar = (L1 + L2) / 2, (C1 + C2) / 2
    T = (
        1
        - 0.17 * math.cos(math.radians(h_bar - 30))
        + 0.24 * math.cos(math.radians(2 * h_bar))
        + 0.32 * math.cos(math.radians(3 * h_bar + 6))
        - 0.20 * math.cos(math.radians(4 * h_bar - 63))
    )
    S_L = 1 + 0.015 * (L_bar - 50) ** 2 / math.sqrt(20 + (L_bar - 50) ** 2)
    S_C, S_H = 1 + 0.045 * C_bar, 1 + 0.015 * C_bar * T
    R_C = 2 * math.sqrt(C_bar**7 / (C_bar**7 + 25.0**7))
    R_T = -R_C * math.sin(math.radians(60 * math.exp(-(((h_bar - 275) / 25) ** 2))))
    dL, dC, dH = dL / S_L, dC / S_C, dH / S_H
    return math.sqrt(dL * dL + dC * dC + dH * dH + R_T * dC * dH)


# ---- cases and their report ------------------------------------------------------------


class Case(unittest.TestCase):
    maxDiff = 2000

    @classmethod
    def setUpClass(cls):
        os.makedirs(os.path.join(BUILD, "tests"), exist_ok=True)
        cls.shared_folder = tempfile.mkdtemp(prefix="cli.", dir=os.path.join(BUILD, "tests"))

    @classmethod
    def tearDownClass(cls):
        shutil.rmtree(cls.shared_folder, ignore_errors=True)

    def folder(self):
        """A fresh folder, removed with the class's own."""
        return tempfile.mkdtemp(dir=self.shared_folder)

    def file(self, content, name="spectra.csv"):
        """A file with this text or these bytes; its path."""
        path = os.path.join(self.folder(), name)
        with open(path, "wb") as f:
            f.write(content.encode("utf-8") if isinstance(content, str) else content)
        return path

    def run_ok(self, *arguments, **more):
        done = run(*arguments, **more)
        self.assertEqual(done.status, 0, f"{arguments}: {done.err}")
        return done

    def refused(self, status, *arguments, says=(), **more):
        """A run that ends with this status and a message with all these texts."""
        done = run(*arguments, **more)
        self.assertEqual(done.status, status, f"{arguments}: {done.err}{done.out[:300]}")
        self.assertTrue(done.err.startswith("skinspec"), f"{arguments}: {done.err!r}")
        for text in [says] if isinstance(says, str) else says:
            self.assertIn(text, done.err, f"{arguments}")
        return done

    def assertClose(self, got, expected, relative=0.0, absolute=0.0, what=""):
        self.assertIsInstance(got, (int, float), what)
        limit = absolute + relative * abs(expected)
        if not abs(got - expected) <= limit:
            self.fail(f"{what}: {got!r}, expected {expected!r} within {limit:.3g}")


class _Unity(unittest.TestResult):
    """Prints as Unity does; a test with several failed parts is one failure."""

    def __init__(self, file):
        super().__init__()
        self.file, self.failed, self.printed = file, set(), {}

    def _place(self, error):
        line = 0
        for frame in traceback.extract_tb(error[2]):
            if os.path.abspath(frame.filename) == os.path.abspath(self.file):
                line = frame.lineno
        return line

    def _print(self, test, line, verdict, message):
        name = test.id().rsplit(".", 1)[-1] if " " not in test.id() else test.id().split(".", 2)[-1]
        message = " | ".join(x.strip() for x in str(message).splitlines() if x.strip())
        file = os.path.relpath(self.file, ROOT)
        print(f"{file}:{line}:{name}:{verdict}: {message[:1500]}", flush=True)

    def _fail(self, test, error):
        name = getattr(test, "test_case", test).id()
        self.failed.add(name)
        self.printed[name] = self.printed.get(name, 0) + 1
        if self.printed[name] > 5:  # the first tell enough
            return
        what = error[1] if issubclass(error[0], AssertionError) else repr(error[1])
        if issubclass(error[0], OSError):  # whose repr() leaves out the file
            what = f"{error[0].__name__}: {error[1]}"
        self._print(test, self._place(error), "FAIL", what)

    def addFailure(self, test, err):
        self._fail(test, err)

    def addError(self, test, err):
        if isinstance(test, unittest.TestCase):
            self._fail(test, err)
        else:  # what a class sets up
            self.testsRun += 1
            self._fail(test, err)

    def addSubTest(self, test, subtest, err):
        if err is not None:
            self._fail(subtest, err)

    def addSkip(self, test, reason):
        super().addSkip(test, reason)
        self._print(test, 0, "IGNORE", reason)

    def addUnexpectedSuccess(self, test):
        self.failed.add(test.id())
        self._print(test, 0, "FAIL", "unexpected success")


def main():
    """Run the tests of the file that calls; the end of the program."""
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)
    module = sys.modules["__main__"]
    chosen = sys.argv[1:]
    loader = unittest.TestLoader()
    suite = (
        loader.loadTestsFromNames(chosen, module) if chosen else loader.loadTestsFromModule(module)
    )
    result = _Unity(module.__file__)
    suite.run(result)
    print("-----------------------")
    print(f"{result.testsRun} Tests {len(result.failed)} Failures {len(result.skipped)} Ignored")
    print("FAIL" if result.failed else "OK")
    sys.exit(1 if result.failed else 0)
