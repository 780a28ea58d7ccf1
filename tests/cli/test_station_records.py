#!/usr/bin/env python3
"""test_station_records.py - `skinspec history`, `export` and `store` through a real skinspecd."""

import glob
import os
import resource
import signal
import sqlite3
import subprocess
import time

from station_case import StationCase, all_records
from support import INSTRUMENTED, SKINSPEC, TIMEOUT_S, main, run

RECORDS = 130  # more than a page of record.list (100)
NOBODY = "018f2c3a-5b6d-4e8f-9a0b-1c2d3e4f5a6b"


class History(StationCase):
    """RECORDS spectra of a client, then one measurement."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with cls.daemon.client(operator="Ada") as c:
            cls.subject = c.call("subject.add", label="P1")["id"]
        with cls.daemon.client() as c:
            c.calibrate(c.acquire()["lease"])
        case = cls("table_of")
        case.store(5, subject=cls.subject, site="Ellenbogen, außen und innen")
        case.store(RECORDS - 5)
        case.done("measure", "--site", "forearm", "--subject", cls.subject, "--operator", "Ada")
        with cls.daemon.client() as c:
            cls.records = all_records(c)

    def table_of(self, *options):
        """The lines of the table as seqs, its head checked."""
        lines = self.done("history", *options).out.splitlines()
        self.assertRegex(lines[0], r"^ +seq +taken \(UTC\) +instrument +site +L\* +a\* +b\* +ITA")
        return [int(line.split()[0]) for line in lines[1:]]

    def test_the_newest_come_last(self):
        last = RECORDS + 1
        self.assertEqual(len(self.records), last)
        self.assertEqual(self.table_of(), list(range(last - 19, last + 1)), "20 by itself")
        self.assertEqual(self.table_of("--limit", 3), [last - 2, last - 1, last])
        self.assertEqual(self.table_of("--limit", 125), list(range(last - 124, last + 1)))
        self.assertEqual(self.table_of("--limit", 100000), list(range(1, last + 1)))
        self.assertEqual(self.table_of("--since", 0), list(range(1, last + 1)))
        self.assertEqual(self.table_of("--since", last - 2), [last - 1, last])
        self.assertEqual(self.table_of("--since", 3, "--limit", 2), [last - 1, last])
        self.assertEqual(self.table_of("--since", last), [])
        self.assertEqual(self.table_of("--since", 2**53 - 1), [])

    def test_of_one_subject(self):
        own = [1, 2, 3, 4, 5, RECORDS + 1]
        self.assertEqual(self.table_of("--subject", self.subject), own)
        self.assertEqual(self.table_of("--subject", self.subject, "--limit", 2), own[-2:])
        self.assertEqual(self.table_of("--subject", NOBODY), [])

    def test_a_line(self):
        """Its numbers, rounded here; a long site is cut between characters."""
        out = self.done("history", "--since", 0).out
        r = self.records[-1]
        m, (L, a, b) = r["match"], r["Lab"]
        self.assertEqual(
            out.splitlines()[-1].rstrip(),
            f"{r['seq']:6}  {r['taken_at'][:19]}  {'SIM-1':12}  {'forearm':14}  {L:5.1f}{a:7.1f}"
            f"{b:7.1f}{r['ITA']:8.1f}{m['Cm']:8.4f}{m['Bm']:6.2f}{m['Ch']:8.4f}  "
            f"{' '.join(r['flags'] + m['flags'])}".rstrip(),
        )
        first = out.splitlines()[1]
        self.assertIn(f"{'':12}  Ellenbogen, au  ", first)
        self.assertEqual(first.split()[-1], " ".join(self.records[0]["match"]["flags"]).split()[-1])

    def test_without_a_colour(self):
        """Bands that give none: blank columns, not zeros."""
        with self.new_daemon(instruments=()) as daemon, daemon.client() as c:
            few = {"first_nm": 500, "step_nm": 10, "values": [0.3] * 12}
            c.call("match.spectrum", spectrum=few, specular="sce", store=True, by="spectrum")
            record = all_records(c)[0]
            line = self.done("history", daemon=daemon).out.splitlines()[1]
            page = self.done("history", record["id"], daemon=daemon).out
        self.assertNotIn("Lab", record)
        blank = " " * (2 + 12 + 2 + 14 + 2 + 5 + 7 + 7 + 8)  # instrument, site, L*, a*, b*, ITA
        self.assertIn(f"{record['taken_at'][:19]}{blank}  0.", line)
        self.assertIn("beware   no_colour: these bands give no colour", page)
        self.assertNotIn("ITA", page)

    def test_json(self):
        self.assertEqual(self.done("history", "--json", "--since", 0).json(), self.records)
        self.assertEqual(self.done("history", "--ndjson", "--limit", 2).ndjson(), self.records[-2:])
        self.assertEqual(self.done("history", "--json", "--subject", NOBODY).json(), [])

    def test_one_record(self):
        r = self.records[-1]
        self.assertEqual(self.done("history", r["id"], "--json").json(), r)
        out = self.done("history", r["id"]).out
        for text in (f"record {r['seq']}  {r['id']}", "by Ada", "forearm", "0.00 +---"):
            self.assertIn(text, out)
        out = self.done("history", self.records[0]["id"]).out
        self.assertIn("site     Ellenbogen, außen und innen\n", out)
        self.refuses(1, "history", NOBODY, says="(record_unknown) - ")

    def test_recompute(self):
        r = self.records[-1]
        out = self.done("history", r["id"], "--recompute").out
        self.assertTrue(out.startswith("computed anew: the same to the last bit\n"))
        self.assertEqual(out.count(f"skin     Cm {r['match']['Cm']:.4f}"), 2)
        again = self.done("history", r["id"], "--recompute", "--json").json()
        self.assertEqual((again["id"], again["same_bits"], again["difference"]), (r["id"], True, 0))
        self.assertEqual(again["stored"], r["match"])

    def test_usage(self):
        for options, says in (
            (("--recompute",), "which record"),
            (("abc",), "ID: 'abc' is no uuid"),
            ((NOBODY, NOBODY), "one ID"),
            ((NOBODY, "--limit", "1"), "no meaning"),
            ((NOBODY, "--since", "1"), "no meaning"),
            ((NOBODY, "--subject", NOBODY), "no meaning"),
            (("--limit", "0"), "1..100000"),
            (("--since", "-1"), "--since"),
            (("--subject", "x"), "--subject: 'x' is no uuid"),
        ):
            with self.subTest(options=options):
                self.refuses(2, "history", *options, says=says)

    def test_a_full_output(self):
        for options in (
            (),
            ("--json",),
            (self.records[0]["id"],),
            (self.records[0]["id"], "--json"),
        ):
            with open("/dev/full", "wb") as full:
                with self.start("history", *options, stdout=full, stderr=-1) as child:
                    err = child.communicate(timeout=TIMEOUT_S)[1]
            self.assertEqual(child.returncode, 1)
            self.assertIn(b"cannot write the results: No space", err)

    # ---- export, of the same records ----------------------------------------------------

    def pages(self, form, **more):
        """The file as the independent client joins it."""
        c, text = self.client(), ""
        while True:
            page = c.call("record.export", format=form, **more)
            text += page["text"]
            more.update(since_seq=page["next_seq"], until_seq=page["until_seq"])
            more.pop("head", None)
            if not page["more"]:
                return text

    def test_each_format(self):
        for form in ("csv", "json", "cgats"):
            out = self.done("export", "--format", form).out
            self.assertEqual(out, self.pages(form))
        self.assertEqual(self.done("export").out, self.pages("csv"), "csv by itself")
        self.assertEqual(self.done("export", "--json").json(), self.records)

    def test_a_part(self):
        """--since and --limit give whole files too."""
        whole = self.done("export").out.splitlines()
        part = self.done("export", "--since", 10, "--limit", 3).out.splitlines()
        self.assertEqual(part, [whole[0]] + whole[11:14])
        part = self.done("export", "--json", "--since", 10, "--limit", 3).json()
        self.assertEqual([x["seq"] for x in part], [11, 12, 13])
        self.assertEqual(self.done("export", "--json", "--limit", 2).json(), self.records[:2])
        self.assertEqual(
            self.done("export", "--json", "--since", RECORDS).json(), self.records[-1:]
        )
        self.assertEqual(self.done("export", "--json", "--since", RECORDS + 1).json(), [])
        self.assertEqual(
            self.done("export", "--json", "--since", RECORDS + 1, "--limit", 5).json(), []
        )
        cgats = self.done("export", "--format", "cgats", "--since", RECORDS).out
        self.assertEqual(cgats, self.pages("cgats", since_seq=RECORDS, head=True))
        self.assertIn("NUMBER_OF_SETS 1\n", cgats.replace("\r", ""))

    def test_to_a_file(self):
        folder = self.folder()
        path = os.path.join(folder, "records.csv")
        done = self.done("export", "--out", path)
        self.assertEqual((done.out, done.err), ("", ""))
        with open(path, encoding="utf-8", newline="") as f:
            self.assertEqual(f.read(), self.pages("csv"))
        self.refuses(1, "export", "--limit", 1, "--out", path, says=("exists already", "--force"))
        self.done("export", "--limit", 1, "--out", path, "--force")
        with open(path, encoding="utf-8") as f:
            self.assertEqual(len(f.read().splitlines()), 2)
        self.assertEqual(os.listdir(folder), ["records.csv"])

    def test_match_reads_it(self):
        path = os.path.join(self.folder(), "records.csv")
        self.done("export", "--since", RECORDS, "--out", path)
        row = self.done("match", path, "--table", "paper", "--tables", os.path.join(
            os.environ.get("BUILD", "build"), "tables")).rows()[0]  # fmt: skip
        self.assertEqual(row["id"], self.records[-1]["id"])

    def test_where_no_file_can_be(self):
        folder = self.folder()
        for path, says in (
            ("/dev/null", "no regular file"),
            (folder, "no regular file"),
            (os.path.join(folder, "no", "x"), "cannot write"),
            (os.path.join(folder, "x" * 250), "cannot write"),
        ):
            for force in ((), ("--force",)):
                self.refuses(1, "export", "--out", path, *force, says=says)
        self.assertEqual(os.listdir(folder), [])

    def test_a_disk_that_is_full(self):
        """Whatever is left of room: an error, and neither the file nor a part of it."""
        folder = self.folder()
        size = len(self.pages("csv").encode())
        for limit in (0, 4096, size - 1):
            path = os.path.join(folder, "x")

            def few(limit=limit):
                resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

            done = subprocess.run(
                [SKINSPEC, "export", "--out", path],
                env=self.env(),
                stderr=subprocess.PIPE,
                preexec_fn=None if INSTRUMENTED else few,
                timeout=TIMEOUT_S,
                check=False,
            )
            if INSTRUMENTED:
                return
            self.assertEqual(done.returncode, 1)
            self.assertIn(b"cannot write " + path.encode() + b": File too large", done.stderr)
            self.assertEqual(os.listdir(folder), [])

    def test_an_output_that_is_full(self):
        with open("/dev/full", "wb") as full:
            with self.start("export", stdout=full, stderr=-1) as child:
                err = child.communicate(timeout=TIMEOUT_S)[1]
        self.assertEqual(child.returncode, 1)
        self.assertEqual(err, b"skinspec: cannot write the results: No space left on device\n")

    def test_usage_of_export(self):
        for options, says in (
            (("--format", "xml"), "--format: 'xml'"),
            (("--force",), "--out"),
            (("--limit", "0"), "--limit"),
            (("records.csv",), "not expected"),
        ):
            self.refuses(2, "export", *options, says=says)


class Interrupted(StationCase):
    instruments = ()

    def test_ctrl_c_leaves_nothing(self):
        """A station that is stopped (SIGSTOP) in the middle; the command ends at once."""
        with self.new_daemon(instruments=()) as daemon:
            self.store(3, daemon)
            folder = self.folder()
            os.kill(daemon.process.pid, signal.SIGSTOP)
            try:
                with self.start(
                    "export", "--out", folder + "/x", daemon=daemon, stderr=-1
                ) as child:
                    time.sleep(0.3)
                    self.assertIsNone(child.poll(), "it waits")
                    child.send_signal(signal.SIGINT)
                    child.communicate(timeout=TIMEOUT_S)
                self.assertEqual(child.returncode, -signal.SIGINT)
            finally:
                os.kill(daemon.process.pid, signal.SIGCONT)
            self.assertEqual(os.listdir(folder), [])


class Store(StationCase):
    instruments = ()

    def test_verify(self):
        with self.new_daemon(instruments=()) as daemon:
            out = self.done("store", "verify", daemon=daemon).out
            self.assertRegex(out, r"^records     0\naudit rows  \d+\n(last hash .*\n)?sound\n$")
            self.store(3, daemon)
            out = self.done("store", "verify", daemon=daemon).out
            self.assertIn("records     3, seq 1 to 3\n", out)
            told = self.done("store", "verify", "--json", daemon=daemon).json()
            self.assertEqual((told["sound"], told["records"], told["last_seq"]), (True, 3, 3))
            self.assertIn(f"last hash   {told['last_hash']}\n", out)

    def test_verify_finds_what_was_changed(self):
        """A site that somebody has rewritten behind the station's back."""
        with self.new_daemon(instruments=()) as daemon:
            self.store(3, daemon, site="arm")
            daemon.stop()
            db = sqlite3.connect(os.path.join(daemon.state, "station.db"))
            triggers = [
                x[0] for x in db.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'")
            ]
            for name in triggers:
                db.execute(f"DROP TRIGGER {name}")
            table = [
                x[0] for x in db.execute("SELECT name FROM sqlite_master WHERE type = 'table'")
            ]
            self.assertIn("site", table)
            db.execute("UPDATE site SET name = 'leg'")
            db.commit()
            db.close()
            daemon.start()
            done = self.skinspec("store", "verify", daemon=daemon)
            self.assertEqual(done.status, 1)
            self.assertIn("NOT sound: ", done.out)
            told = self.skinspec("store", "verify", "--json", daemon=daemon)
            self.assertEqual((told.status, told.json()["sound"]), (1, False))
            self.assertIn("NOT sound", self.done("status", daemon=daemon).out)

    def test_begin_anew(self):
        """Refused on a sound store; after damage it asks, and a new store begins."""
        with self.new_daemon(instruments=()) as daemon:
            self.refuses(
                1, "store", "begin-anew", "--yes", says="(store_not_damaged)", daemon=daemon
            )
            self.refuses(2, "store", "begin-anew", says="--yes", daemon=daemon)
            self.store(2, daemon)
            daemon.stop()
            for path in glob.glob(os.path.join(daemon.state, "station.db-*")):
                os.unlink(path)
            with open(os.path.join(daemon.state, "station.db"), "r+b") as f:
                f.seek(4096)
                f.write(b"\xaa" * 8192)
            daemon.start()
            self.assertRegex(self.done("status", daemon=daemon).out, r"store     damaged: .+")
            with self.terminal("store", "begin-anew", daemon=daemon) as person:
                person.expect("[yes/no] ")
                person.type("no\n")
                status, shown = person.end()
            self.assertEqual(status, 1)
            self.assertIn("nothing was done", shown)
            with self.terminal("store", "begin-anew", daemon=daemon) as person:
                person.expect("[yes/no] ")
                person.type("yes\n")
                status, shown = person.end()
            self.assertEqual(status, 0, shown)
            told = self.done("status", "--json", daemon=daemon).json()
            self.assertEqual(told["store"], "ok")
            self.assertIn(f"a new store, station id {told['station_id']}", shown)

    def test_begin_anew_as_json(self):
        with self.new_daemon(instruments=()) as daemon:
            daemon.stop()
            with open(os.path.join(daemon.state, "station.db"), "r+b") as f:
                f.truncate(5000)
            daemon.start()
            told = self.done("store", "begin-anew", "--yes", "--json", daemon=daemon).json()
            self.assertEqual(list(told), ["station_id"])

    def test_subjects(self):
        with self.new_daemon(instruments=()) as daemon:
            self.assertEqual(self.done("store", "subjects", daemon=daemon).out, "")
            self.assertEqual(self.done("store", "subjects", "--json", daemon=daemon).json(), [])
            first = self.done(
                *("store", "add-subject", "--label", "P1", "--name", "Bär"),
                *("--birth-year", 1984, "--notes", "a\nb"),
                daemon=daemon,
            ).out.strip()
            second = self.done("store", "add-subject", "--json", daemon=daemon).json()["id"]
            third = self.done(
                "store", "add-subject", "--birth-year", 1990, daemon=daemon
            ).out.strip()
            self.assertEqual(
                self.done("store", "subjects", daemon=daemon).out,
                f"{first}  P1  Bär  born 1984\n{second}\n{third}  born 1990\n",
            )
            listed = self.done("store", "subjects", "--json", daemon=daemon).json()
            person = {"name": "Bär", "birth_year": 1984, "notes": "a\nb"}
            self.assertEqual(
                listed[0], {"id": first, "label": "P1", "person": person, "forgotten": False}
            )
            self.assertEqual([x["id"] for x in listed], [first, second, third])

    def test_many_subjects(self):
        """More than a page (100), in order."""
        with self.new_daemon(instruments=()) as daemon, daemon.client() as c:
            ids = [c.call("subject.add")["id"] for _ in range(103)]
            lines = self.done("store", "subjects", "--ndjson", daemon=daemon).ndjson()
            self.assertEqual([x["id"] for x in lines], ids)

    def test_forget(self):
        with self.new_daemon(instruments=()) as daemon:
            ids = [
                self.done("store", "add-subject", "--label", "Müller", daemon=daemon).out.strip()
                for _ in range(3)
            ]
            self.refuses(2, "store", "forget-subject", ids[0], says="--yes", daemon=daemon)
            with self.terminal("store", "forget-subject", ids[0], daemon=daemon) as person:
                person.expect("Erase this person for good? [yes/no] ")
                person.type("y\n")
                self.assertEqual(person.end()[0], 1, "yes is a whole word")
            self.assertIn("Müller", self.done("store", "subjects", daemon=daemon).out)
            with self.terminal("store", "forget-subject", ids[0], daemon=daemon) as person:
                person.expect("[yes/no] ")
                person.type("yes\n")
                status, shown = person.end()
            self.assertEqual(status, 0)
            self.assertIn("forgotten; the bytes are overwritten", shown)
            told = self.done(
                "store", "forget-subject", ids[1], "--yes", "--json", daemon=daemon
            ).json()
            self.assertEqual(told, {"id": ids[1], "erased": True})
            out = self.done("store", "subjects", daemon=daemon).out.splitlines()
            self.assertEqual(out[0], f"{ids[0]}  (forgotten)")
            self.assertIn("Müller", out[2])
            self.refuses(
                1,
                "store",
                "forget-subject",
                NOBODY,
                "--yes",
                says="(subject_unknown)",
                daemon=daemon,
            )

    def test_usage(self):
        for options, says in (
            (("store",), "Usage: skinspec store COMMAND"),
            (("store", "burn"), "there is no 'store burn'"),
            (("store", "add-subject", "--birth-year", "84"), "1850..2200"),
            (("store", "add-subject", "P1"), "not expected"),
            (("store", "forget-subject"), "which subject"),
            (("store", "forget-subject", "Bob"), "'Bob' is no uuid"),
            (("store", "forget-subject", NOBODY, NOBODY), "one ID"),
            (("store", "verify", "now"), "not expected"),
        ):
            with self.subTest(options=options):
                done = run(*options, env=self.env())
                self.assertEqual((done.status, done.out), (2, ""))
                self.assertIn(says, done.err)


if __name__ == "__main__":
    main()
