#!/usr/bin/env python3
"""test_table.py - `skinspec table`: what a build makes, how it ends when it cannot, and what
becomes of files that are no good."""

import os
import resource
import shutil
import signal
import sqlite3
import subprocess
import time
import unittest

from support import (
    SKINSPEC,
    TIMEOUT_S,
    Case,
    Table,
    build_table,
    environment,
    main,
    run,
    spectra_csv,
    start,
)

TINY = ("--cm", "0.1:0.3:3", "--bm", "0:1:2", "--ch", "0.01:0.1:2")
# Half a gigabyte and many seconds: there is time to stop it.
LARGE = ("--cm", "0.001:0.5:200", "--bm", "0:1:100", "--ch", "0.001:0.1:150")


class Build(Case):
    def test_every_row_of_the_grid_in_order(self):
        """Linear and log axes; ch runs fastest, then bm, then cm."""
        grid = ("--cm", "0.1:0.4:4", "--bm", "0:1:3", "--ch", "log:0.001:0.1:5")
        table = Table(build_table(self.folder(), *grid))
        expected = [
            (0.1 + 0.1 * i, 0.5 * j, 0.001 * 10 ** (0.5 * k))
            for i in range(4)
            for j in range(3)
            for k in range(5)
        ]
        self.assertEqual([r["id"] for r in table.rows], list(range(1, 61)))
        for row, values in zip(table.rows, expected):
            for name, x in zip(("Cm", "Bm", "Ch"), values):
                self.assertClose(row[name], x, relative=1e-12, what=str(row["id"]))
        self.assertEqual((table.rows[0]["Cm"], table.rows[-1]["Cm"]), (0.1, 0.4))
        self.assertEqual((table.rows[0]["Ch"], table.rows[-1]["Ch"]), (0.001, 0.1))

    def test_without_melanin_there_is_one_blend(self):
        grid = ("--cm", "0:0.4:3", "--bm", "0:1:4", "--ch", "0.01:0.1:2")
        table = Table(build_table(self.folder(), *grid))
        self.assertEqual(len(table.rows), 2 + 2 * 4 * 2)
        self.assertEqual([r["Cm"] for r in table.rows[:3]], [0, 0, 0.2])

    def test_rows_are_what_reflectance_and_convert_say(self):
        """The same skin by the other commands: spectrum to float32, colour to 1e-6."""
        settings = ("--epidermis-mm", "0.06", "--gamma", "0.6", "--eta", "1.38")
        for model in ("two-layer", "half-space"):
            bands = ("--bands", "400:700:5")
            colour = ("--illuminant", "D50", "--observer", "2")
            path = build_table(self.folder(), *TINY, *settings, *bands, *colour, model=model)
            for row in Table(path).rows[::5]:
                skin = [f"--{n.lower()}={row[n]!r}" for n in ("Cm", "Bm", "Ch")]
                done = self.run_ok(
                    "reflectance", "--model", model, *skin, *settings, *bands, "--json"
                )
                values = done.json()[0]["spectrum"]["values"]
                self.assertEqual(len(row["spectrum"]), 61)
                for x, y in zip(row["spectrum"], values):
                    self.assertClose(x, y, relative=2**-24)
                text = spectra_csv([("a", values)], list(range(400, 701, 5)))
                (x,) = self.run_ok("convert", "-", *colour, "--json", stdin=text).json()
                for got, expected in zip(row["Lab"], x["Lab"]):
                    self.assertClose(got, expected, absolute=1e-6)

    def test_every_option_is_kept(self):
        path = build_table(
            self.folder(),
            *TINY,
            "--epidermis-mm",
            "0.1",
            "--gamma",
            "0.5",
            "--eta",
            "1.45",
            "--bands",
            "380:740:10",
            "--illuminant",
            "A",
            "--observer",
            "2",
            "--rtree",
            "--threads",
            "2",
        )
        info = self.run_ok("table", "info", path, "--json").json()
        expected = {
            "name": "small",
            "model": "two-layer",
            "rows": 12,
            "epidermis_mm": 0.1,
            "gamma": 0.5,
            "eta": 1.45,
            "bands_nm": "380:740:10",
            "illuminant": "A",
            "observer_deg": 2,
            "cm": "0.1:0.3:3",
            "bm": "0:1:2",
            "ch": "0.01:0.1:2",
            "rtree": "yes",
            "bytes": os.path.getsize(path),
            "path": path,
        }
        self.assertEqual({k: info[k] for k in expected}, expected)
        self.assertRegex(info["content_sha256"], "^[0-9a-f]{64}$")
        self.assertRegex(info["pages_sha256"], "^[0-9a-f]{64}$")
        plain = self.run_ok("table", "info", path).out
        for name, value in expected.items():
            self.assertRegex(plain, rf"(?m)^{name} +{value}$")

    def test_paper_readings(self):
        """R, G, B linear or gamma-coded: the same numbers, read in two ways."""
        linear = Table(build_table(self.folder(), *TINY, model="paper"))
        coded = Table(build_table(self.folder(), *TINY, "--rgb-as", "coded", model="paper"))
        for x, y in zip(linear.rows, coded.rows):
            self.assertIsNone(x["spectrum"])
            for a, b in zip(x["rgb"], y["rgb"]):
                decoded = ((a + 0.055) / 1.055) ** 2.4 if a > 0.04045 else a / 12.92
                self.assertClose(b, decoded, relative=1e-9)

    def test_rtree_holds_every_row(self):
        path = build_table(self.folder(), *TINY, "--rtree")
        table = Table(path)
        db = sqlite3.connect(path)
        try:
            boxes = db.execute("SELECT * FROM entry_lab ORDER BY id").fetchall()
        except sqlite3.OperationalError as error:  # a Python without the module
            raise unittest.SkipTest(str(error)) from error
        finally:
            db.close()
        self.assertEqual(len(boxes), len(table.rows))
        for row, box in zip(table.rows, boxes):
            self.assertEqual(row["id"], box[0])
            for i, x in enumerate(row["Lab"]):
                self.assertTrue(box[1 + 2 * i] <= x <= box[2 + 2 * i])

    def test_same_bytes_for_any_number_of_threads(self):
        tables = [Table(build_table(self.folder(), *TINY, "--threads", n)) for n in ("1", "2", "3")]
        self.assertEqual(len({t.meta["content_sha256"] for t in tables}), 1)

    def test_verify(self):
        path = build_table(self.folder(), *TINY)
        self.assertIn("\nverified", self.run_ok("table", "verify", path).out)
        report = self.run_ok("table", "verify", path, "--json").json()
        self.assertEqual((report["verified"], report["rows"]), (True, 12))
        self.assertEqual(report["worst_difference"], 0)

    def test_names(self):
        """By path, or by name in a folder."""
        folder = self.folder()
        path = build_table(folder, *TINY, name="mine")
        by_name = self.run_ok("table", "info", "mine", "--tables", folder, "--json").json()
        self.assertEqual(by_name, self.run_ok("table", "info", path, "--json").json())
        state = self.folder()
        os.mkdir(os.path.join(state, "tables"))
        shutil.copy(path, os.path.join(state, "tables"))
        env = environment(SKINSPEC_STATE=state)
        self.run_ok("table", "info", "mine", cwd=folder, env=env)
        self.refused(1, "table", "info", "mine", cwd=state, says=("'mine'", "table build"))
        says = "skinspec table build --model two-layer"
        self.refused(1, "table", "info", "two-layer", cwd=state, says=says)

    def test_what_is_said_to_make_a_missing_table_makes_it(self):
        """The command that the message gives, in an empty folder."""
        folder = self.folder()
        done = self.refused(1, "table", "info", "paper", cwd=folder, says="make it with: ")
        command = done.err.split("make it with: ")[1].strip()
        environment_ = environment(PATH=f"{os.path.dirname(SKINSPEC)}:{os.environ['PATH']}")
        subprocess.run(
            command,
            shell=True,
            cwd=folder,
            env=environment_,
            check=True,
            stderr=subprocess.DEVNULL,
            timeout=TIMEOUT_S,
        )
        self.run_ok("table", "info", "paper", cwd=folder)

    def test_default_grid(self):
        """About 50 000 rows: 50 melanin, 21 blends, 48 bloods."""
        path = build_table(self.folder(), model="paper")
        info = self.run_ok("table", "info", path, "--json").json()
        self.assertEqual(info["rows"], 50400)
        self.assertEqual(info["cm"], "log:0.001:0.5:50")

    def test_json_describes_what_was_made(self):
        path = os.path.join(self.folder(), "one.db")
        made = self.run_ok("table", "build", "--model", "paper", "--out", path,
                           "--cm", "0.1", "--bm", "1", "--ch", "0.01", "--json").json()
        self.assertEqual(made["rows"], 1)
        self.assertEqual(made, self.run_ok("table", "info", path, "--json").json())

    def test_says_nothing_on_standard_output(self):
        done = run("table", "build", "--model", "paper", *TINY, "--out", f"{self.folder()}/t.db")
        self.assertEqual((done.status, done.out), (0, ""))
        self.assertIn("12 rows", done.err)


class Refusals(Case):
    def build(self, *options, status=2, says=(), folder=None):
        """A refused build leaves nothing behind."""
        folder = folder or self.folder()
        before = set(os.listdir(folder))
        path = os.path.join(folder, "t.db")
        done = self.refused(status, "table", "build", "--out", path, *options, says=says)
        self.assertEqual(set(os.listdir(folder)), before)
        return done

    def test_bad_grids(self):
        limits = {"cm": "0..0.5", "bm": "0..1", "ch": "0.001..0.1"}
        bad = {
            "cm": ("0.2:0.1:3", "0.1:0.2:0", "0.1:0.2:1", "0.1:0.1:2", "log:0:0.5:3", "0:0.51:3"),
            "bm": ("1:0:3", "0:1:0", "0:1:1", "log:0:1:3", "-0.1:1:3", "0:1.1:3", "2"),
            "ch": ("0.1:0.01:3", "0.01:0.1:0", "0.01:0.1:1", "0:0.1:3", "0.001:0.2:3", "0"),
        }
        text = (
            "",
            "x",
            "0.1:0.2",
            "0.1:0.2:x",
            "0.1:0.2:3:4",
            "0.1:0.2:2.5",
            "0.1:0.2:-3",
            "nan",
            "0.01:inf:3",
            "0,01:0.1:3",
            "lin:0.01:0.1:3",
            "log:",
            "log:0.05",
            "0.01:0.1:99999",
            " 0.01:0.1:3",
            "0.01:0.1:3 ",
            "1" * 200,
        )
        for name, axes in bad.items():
            for axis in (*axes, *text):
                with self.subTest(name=name, axis=axis):
                    done = self.build("--model", "two-layer", f"--{name}={axis}", says=f"--{name}:")
                    self.assertIn(axis, done.err)
                    self.assertTrue(
                        any(x in done.err for x in (limits[name], "LO:HI:N", "LO must lie")),
                        done.err,
                    )

    def test_too_many_rows(self):
        grid = ("--cm", "0:0.5:1000", "--bm", "0:1:1000", "--ch", "0.001:0.1:1000")
        self.build("--model", "two-layer", *grid, says="100000000 rows")

    def test_options_that_make_no_sense(self):
        self.build(says="--model is missing")
        self.build("--model", "magic", says=("'magic'", "paper, half-space, kubelka-munk, two-layer, monte-carlo"))
        self.build("--model", "paper", "--bands", "400:700:10", says=("'paper'", "no spectra"))
        self.build("--model", "paper", "--illuminant", "A", says="--illuminant")
        self.build("--model", "two-layer", "--rgb-as", "coded", says="'paper' only")
        self.build("--model", "paper", "--rgb-as", "hsv", says="'hsv'")
        self.build("--model", "two-layer", "--bands", "400:690:10", says="400..700")
        self.build("--model", "two-layer", "--bands", "400:700:7", says="whole number of steps")
        self.build("--model", "two-layer", "--bands", "400:700", says="LO:HI:STEP")
        self.build("--model", "two-layer", "--bands", "700:400:10", says="HI must lie above LO")
        self.build("--model", "two-layer", "--bands", "100:700:10", says="haemoglobin")
        self.build("--model", "two-layer", "--eta", "3.848", says="3.848")
        self.build("--model", "two-layer", "--epidermis-mm", "-1", says="--epidermis-mm")
        self.build("--model", "two-layer", "--gamma", "2", says="--gamma")
        self.build("--model", "two-layer", "extra", says="'extra'")
        self.refused(2, "table", "build", "--model", "paper", says="--out is missing")
        self.refused(2, "table", "info", says="which table?")
        self.refused(2, "table", "verify", "a.db", "b.db", says="one table")

    def test_what_exists_is_kept(self):
        folder = self.folder()
        path = build_table(folder, *TINY, name="t")
        os.rename(path, os.path.join(folder, "t.db"))
        path = os.path.join(folder, "t.db")
        with open(path, "rb") as f:
            before = f.read()
        says = (path, "exists", "--force")
        self.build("--model", "paper", *TINY, status=1, says=says, folder=folder)
        with open(path, "rb") as f:
            self.assertEqual(f.read(), before)
        self.run_ok("table", "build", "--model", "paper", *TINY, "--out", path, "--force")
        self.assertEqual(self.run_ok("table", "info", path, "--json").json()["model"], "paper")
        self.assertEqual(os.listdir(folder), ["t.db"])

    def test_force_that_fails_keeps_the_old(self):
        folder = self.folder()
        path = build_table(folder, *TINY)
        before = Table(path).meta["content_sha256"]
        with start(
            "table",
            "build",
            "--model",
            "two-layer",
            *LARGE,
            "--out",
            path,
            "--force",
            stderr=subprocess.PIPE,
        ) as child:
            self.stop_midway(child, folder, signal.SIGINT)
        self.assertEqual(Table(path).meta["content_sha256"], before)
        self.assertEqual(os.listdir(folder), ["table-small.db"])

    def test_a_folder_as_file(self):
        self.refused(1, "table", "build", "--model", "paper", "--out", self.folder(), "--force",
                     says=("is a folder",))

    def test_a_folder_that_cannot_be_written(self):
        grid = ("--model", "paper", *TINY)
        for path in ("/proc/t.db", os.path.join(self.folder(), "missing", "t.db")):
            says = ("cannot write", path)
            self.refused(1, "table", "build", *grid, "--out", path, says=says)
        folder = self.folder()
        self.refused(1, "table", "build", *grid, "--out", folder + "/", says=folder)
        self.refused(1, "table", "build", *grid, "--out", "", says="''")
        self.assertEqual(os.listdir(folder), [])

    def stop_midway(self, child, folder, number):
        """Signal a build once its file grows; it must end by that signal."""
        deadline = time.monotonic() + TIMEOUT_S
        before = {os.path.join(folder, x): 0 for x in os.listdir(folder) if not x.startswith(".")}
        while time.monotonic() < deadline and child.poll() is None:
            paths = [os.path.join(folder, x) for x in os.listdir(folder)]
            if any(p not in before and os.path.getsize(p) > 1 << 20 for p in paths):
                break
            time.sleep(0.01)
        self.assertIsNone(child.poll(), "it was over before it could be stopped")
        child.send_signal(number)
        err = child.communicate(timeout=TIMEOUT_S)[1].decode()
        self.assertEqual(child.returncode, -number)
        return err

    def test_stopped_builds_leave_nothing(self):
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            with self.subTest(signal=number.name):
                folder = self.folder()
                path = os.path.join(folder, "t.db")
                with start(
                    "table",
                    "build",
                    "--model",
                    "two-layer",
                    *LARGE,
                    "--out",
                    path,
                    stderr=subprocess.PIPE,
                ) as child:
                    err = self.stop_midway(child, folder, number)
                self.assertEqual(os.listdir(folder), [])
                self.assertEqual(err, "")

    def test_full_disk_by_limit(self):
        """A file may grow to 1 MiB only: writes fail as on a full disk."""

        def limit():
            signal.signal(signal.SIGXFSZ, signal.SIG_DFL)  # Python ignores it
            resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 20, 1 << 20))

        folder = self.folder()
        path = os.path.join(folder, "t.db")
        grid = ("--cm", "0.001:0.5:60", "--bm", "0:1:10", "--ch", "0.001:0.1:20")
        done = self.refused(
            1,
            "table",
            "build",
            "--model",
            "two-layer",
            *grid,
            "--out",
            path,
            says=("cannot write", path),
            preexec_fn=limit,
        )
        self.assertEqual(os.listdir(folder), [])
        self.assertRegex(done.err, "disk|full|space|I/O|large")

    def test_full_disk(self):
        """On a file system of 1 MiB, where mounting one is permitted."""
        folder = self.folder()
        script = (
            'mount -t tmpfs -o size=1m tmpfs "$1" 2>/dev/null || exit 77; '
            '"$2" table build --model two-layer --cm 0.001:0.5:60 --bm 0:1:10 --ch 0.001:0.1:20 '
            '--out "$1/t.db"; echo "status $?" >&2; ls -A "$1"'
        )
        unshare = shutil.which("unshare")
        if unshare is None:
            raise unittest.SkipTest("unshare is not here")
        done = subprocess.run(
            [unshare, "--mount", "--map-root-user", "sh", "-c", script, "sh", folder, SKINSPEC],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            env=environment(),
            timeout=TIMEOUT_S,
            check=False,
        )
        if b"status" not in done.stderr:
            raise unittest.SkipTest("mounting a file system is not permitted")
        err = done.stderr.decode()
        self.assertIn("status 1", err)
        self.assertIn("cannot write", err)
        self.assertRegex(err, "disk|full|space")
        self.assertEqual(done.stdout, b"")


class BadFiles(Case):
    """Each is refused by all that read tables, with what to do."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.good = build_table(cls.shared_folder, *TINY, name="good")
        with open(cls.good, "rb") as f:
            cls.bytes = f.read()
        cls.text = spectra_csv([(("a", "sce"), [0.3] * 31)], before=("id", "specular"))

    def refused_everywhere(self, content, *says):
        path = self.file(content, "table-bad.db")
        for command in (
            ("match", "-", "--table", path),
            ("table", "info", path),
            ("table", "verify", path),
        ):
            with self.subTest(command=command[:2]):
                done = self.refused(1, *command, stdin=self.text, says=(path, *says))
                self.assertEqual(done.out, "")
        with open(path, "rb") as f:
            self.assertEqual(f.read(), content, "the file was changed")

    def test_one_byte_changed(self):
        for place in (120, len(self.bytes) // 3, len(self.bytes) // 2, len(self.bytes) - 1):
            changed = bytearray(self.bytes)
            changed[place] ^= 0x10
            self.refused_everywhere(bytes(changed), "damaged", "table build")

    def test_truncated(self):
        for keep in (len(self.bytes) - 1, len(self.bytes) - 4096, len(self.bytes) // 2, 4096, 200):
            self.refused_everywhere(self.bytes[:keep], "table build")

    def test_longer(self):
        self.refused_everywhere(self.bytes + b"\0" * 4096, "table build")

    def test_foreign(self):
        folder = self.folder()
        path = os.path.join(folder, "other.db")
        db = sqlite3.connect(path)
        db.execute("CREATE TABLE t(x)")
        db.commit()
        db.close()
        with open(path, "rb") as f:
            foreign = f.read()
        for content in (
            foreign,
            b"",
            b"hello\n",
            bytes(1000),
            self.text.encode(),
            os.urandom(5000),
        ):
            self.refused_everywhere(content, "not a skinspec table", "table build")

    def test_other_version(self):
        """SQLite keeps user_version at byte 60."""
        for version in (0, 1, 99):
            changed = self.bytes[:60] + version.to_bytes(4, "big") + self.bytes[64:]
            self.refused_everywhere(changed, f"format {version}", "table build")

    def test_not_there_or_no_file(self):
        folder = self.folder()
        for path in (os.path.join(folder, "none.db"), folder):
            for command in (("match", "-", "--table", path), ("table", "info", path)):
                self.refused(1, *command, stdin=self.text, says=path)


class Subcommands(Case):
    def test_none_or_unknown(self):
        done = run("table")
        self.assertEqual((done.status, done.out), (2, ""))
        self.assertIn("build", done.err)
        self.refused(2, "table", "make", says=("'table make'", "verify"))


if __name__ == "__main__":
    main()
