#!/usr/bin/env python3
"""test_daemon_records.py - what the station keeps and says of it: matches, subjects, sites,
exports, tables, metrics, its own description."""

import csv
import io
import json
import os
import re
import sqlite3

import shapes
from daemon import Case, main, new_uuid
from support import EXAMPLES, PAPER, TWO_LAYER, run
from test_worked_session import differences

# Some skin on the bands 400..700 by 20: docs/protocol.md, "A session".
SKIN = {
    "first_nm": 400,
    "step_nm": 20,
    "values": [0.2, 0.21, 0.23, 0.27, 0.31, 0.33, 0.34, 0.33, 0.34, 0.42, 0.52, 0.56, 0.58, 0.59, 0.6, 0.61],
}  # fmt: skip


def example_skins():
    """docs/examples/skin.csv as spectra of the protocol."""
    with open(EXAMPLES, encoding="ascii", newline="") as file:
        for row in csv.DictReader(line for line in file if not line.startswith("#")):
            nm = [int(name) for name in row if name.isdigit()]
            values = [float(row[str(x)]) for x in nm]
            yield {"first_nm": nm[0], "step_nm": nm[1] - nm[0], "values": values}


class Matching(Case):
    def match(self, c, **more):
        return c.call(
            "match.spectrum", **{"spectrum": SKIN, "specular": "sce", "store": False, **more}
        )

    def test_example_of_the_document(self):
        """expect: the reply that docs/protocol.md prints"""
        with open(os.path.join(shapes.ROOT, "docs", "protocol.md"), encoding="utf-8") as file:
            line = re.search(r'^< (\{"jsonrpc":"2.0","id":3,"result":.*)$', file.read(), re.M)
        expected = json.loads(line.group(1))["result"]
        self.assertEqual(list(differences(expected, self.match(self.client(), by="spectrum"))), [])

    def test_as_the_command_line_matches(self):
        c = self.client()
        for by in ("spectrum", "rgb", "lab", "de2000"):
            done = run("match", EXAMPLES, "--table", TWO_LAYER, "--by", by, "--k", "3", "--json")
            self.assertEqual(done.status, 0, done.err)
            for spectrum, expected in zip(example_skins(), done.json()):
                with self.subTest(by=by, id=expected.pop("id")):
                    self.assertEqual(self.match(c, spectrum=spectrum, by=by, k=3), expected)

    def test_without_store_nothing_is_kept(self):
        c = self.client()
        before = c.call("status.get")["last_seq"]
        self.assertNotIn("record", self.match(c))
        self.assertNotIn("nearest", self.match(c))
        self.assertEqual(c.call("status.get")["last_seq"], before)

    def test_with_store_it_is_a_record(self):
        c = self.client(operator="Ada")
        uuid = new_uuid()
        match = self.match(c, store=True, uuid=uuid, site="arm", aperture_mm=8, k=2)
        record = c.call("record.get", id=match["record"]["id"])
        self.assertEqual(
            (record["seq"], record["taken_at"]),
            (match["record"]["seq"], match["record"]["taken_at"]),
        )
        self.assertEqual((record["uuid"], record["site"], record["operator"]), (uuid, "arm", "Ada"))
        self.assertEqual(record["aperture_mm"], 8)
        self.assertEqual(record["spectrum"], SKIN)
        for absent in ("instrument", "serial", "calibration_id", "fence", "subject", "corrects"):
            self.assertNotIn(absent, record)
        kept = {name: value for name, value in match.items() if name not in ("record", "nearest")}
        self.assertEqual(record["match"], kept)
        retried = self.match(c, store=True, uuid=uuid, site="arm", aperture_mm=8, k=2)
        self.assertEqual(retried["record"], match["record"])
        with self.refused("uuid_reused"):
            self.match(c, store=True, uuid=uuid, site="leg", aperture_mm=8, k=2)
        with self.refused("subject_unknown"):
            self.match(c, store=True, subject=new_uuid())

    def test_sci_without_its_surface(self):
        c = self.client()
        with self.refused("surface_needed"):
            self.match(c, specular="sci")
        raised = {**SKIN, "values": [x + 0.04 for x in SKIN["values"]]}
        got, expected = self.match(c, spectrum=raised, specular="sci", surface=0.04), self.match(c)
        self.assertEqual(
            [got[x] for x in ("Cm", "Bm", "Ch")], [expected[x] for x in ("Cm", "Bm", "Ch")]
        )

    def test_table_and_way(self):
        c = self.client()
        skin = next(example_skins())
        self.assertEqual(self.match(c, spectrum=skin, table="paper")["by"], "rgb")
        self.assertNotIn("rms", self.match(c, spectrum=skin, table="paper", by="lab"))
        with self.refused("table_unsuitable"):
            self.match(c, spectrum=skin, table="paper", by="spectrum")
        with self.refused("spectrum_unsuitable"):  # bands of 20 nm give no colour
            self.match(c, by="lab")
        with self.refused("spectrum_unsuitable"):
            self.match(c, spectrum={**SKIN, "values": SKIN["values"][:9]})

    def test_recompute_gives_the_same_bits(self):
        c, lease = self.ready()
        ids = [c.measure(lease)["id"], c.measure(lease, by="de2000", table="paper")["id"]]
        ids += [
            self.match(c, store=True, spectrum=s)["record"]["id"]
            for s in (SKIN, next(example_skins()))
        ]
        for record_id in ids:
            done = c.call("record.recompute", id=record_id)
            self.assertEqual((done["same_bits"], done["difference"]), (True, 0))
            self.assertEqual(done["stored"], done["recomputed"])
            self.assertEqual(done["stored"], c.call("record.get", id=record_id)["match"])
        with self.refused("record_unknown"):
            c.call("record.recompute", id=new_uuid())


class Subjects(Case):
    PERSON = {
        "name": "Zoë Ångström",
        "birth_year": 1985,
        "notes": "left-handed\n\tallergic to nickel",
    }

    def test_add_list_forget(self):
        c, lease = self.ready()
        bare = c.call("subject.add")["id"]
        subject = c.call("subject.add", label="p-7", person=self.PERSON)["id"]
        listed = {s["id"]: s for s in c.call("subject.list")["subjects"]}
        self.assertEqual(listed[bare], {"id": bare, "forgotten": False})
        self.assertEqual(
            listed[subject],
            {"id": subject, "label": "p-7", "person": self.PERSON, "forgotten": False},
        )
        record = c.measure(lease, subject=subject)
        self.assertEqual(record["subject"], subject)
        c.measure(lease)
        self.assertEqual(c.call("record.list", subject=subject)["records"], [record])

        self.assertEqual(c.call("subject.forget", id=subject), {"id": subject, "erased": True})
        listed = {s["id"]: s for s in c.call("subject.list")["subjects"]}
        self.assertEqual(listed[subject], {"id": subject, "forgotten": True})
        for name in os.listdir(self.daemon.state):  # nor in any file of the station
            path = os.path.join(self.daemon.state, name)
            if os.path.isfile(path):
                with open(path, "rb") as file:
                    self.assertNotIn("Ångström".encode(), file.read(), name)
        self.assertEqual(c.call("record.get", id=record["id"]), record)
        with self.refused("subject_unknown"):
            c.measure(lease, subject=subject)
        with self.refused("subject_unknown"):
            c.call("subject.forget", id=new_uuid())
        self.assertTrue(c.call("store.verify")["sound"])

    def test_pages(self):
        c = self.client()
        for i in range(5):
            c.call("subject.add", label=f"page {i}")
        whole = c.call("subject.list")["subjects"]
        paged, more = [], {}
        while True:
            page = c.call("subject.list", limit=2, **more)
            paged += page["subjects"]
            if "next" not in page:
                break
            self.assertEqual(len(page["subjects"]), 2)
            more = {"after": page["next"]}
        self.assertEqual(paged, whole)
        with self.refused("subject_unknown"):
            c.call("subject.list", after=new_uuid())

    def test_text_is_kept_as_it_is(self):
        """Quotes, markup and SQL are text."""
        c, lease = self.ready()
        for text in (
            "Robert'); DROP TABLE measurement;--",
            '"<b>&amp;\\',
            "%s%n",
            "日本語 🙂",
            "null",
            "1e5",
        ):
            person = {"name": text, "notes": text + "\n" + text}
            added = c.call("subject.add", label=text, person=person)["id"]
            (subject,) = [
                s for s in c.call("subject.list", limit=1000)["subjects"] if s["id"] == added
            ]
            self.assertEqual((subject["label"], subject["person"]), (text, person))
            self.assertEqual(c.measure(lease, site=text)["site"], text)
            self.assertIn(text, c.call("site.list")["sites"])
        self.assertTrue(c.call("store.verify")["sound"])


class Exports(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        with cls.daemon.client(operator='A "quoted", one') as c:
            lease = c.acquire()["lease"]
            c.calibrate(lease)
            for site in ("arm", "cheek, left", 'the "brow"', None, "leg"):
                c.measure(lease, replicates=2, **({"site": site} if site else {}))
            c.call("match.spectrum", spectrum=SKIN, specular="sce", store=True)
            cls.records = c.call("record.list")["records"]

    def pages(self, c, form, **more):
        texts = []
        while True:
            page = c.call("record.export", format=form, **more)
            texts.append(page["text"])
            self.assertLessEqual(len(page["text"].encode()), 512 * 1024)
            more["since_seq"] = page["next_seq"]
            more["until_seq"] = page["until_seq"]
            if not page["more"]:
                self.assertEqual(page["next_seq"], self.records[-1]["seq"])
                return texts

    def test_pages_join(self):
        c = self.client()
        for form in ("csv", "json", "cgats"):
            (whole,) = self.pages(c, form)
            for limit in (1, 2, 4, 5):
                with self.subTest(form=form, limit=limit):
                    self.assertEqual("".join(self.pages(c, form, limit=limit)), whole)

    def test_json_is_the_records(self):
        (text,) = self.pages(self.client(), "json")
        self.assertEqual(json.loads(text), self.records)

    def test_csv(self):
        (text,) = self.pages(self.client(), "csv")
        rows = list(csv.DictReader(io.StringIO(text, newline="")))
        self.assertEqual([row["id"] for row in rows], [r["id"] for r in self.records])
        for row, record in zip(rows, self.records):
            nm = record["spectrum"]["first_nm"]
            for value in record["spectrum"]["values"]:
                self.assertEqual(float(row[f"{nm:g}"]), value)
                nm += record["spectrum"]["step_nm"]
            self.assertEqual(row["site"], record.get("site", ""))
            self.assertEqual(float(row["Cm"]), record["match"]["Cm"])
        done = run(
            "match", "-", "--table", TWO_LAYER, "--json", stdin=text
        )  # what we write we read
        first = done.json()[0]
        self.assertEqual(first["id"], self.records[0]["id"])
        self.assertEqual(first["Cm"], self.records[0]["match"]["Cm"])

    def test_cgats(self):
        (text,) = self.pages(self.client(), "cgats")
        lines = text.splitlines()
        self.assertEqual(lines[0], "SPECT")  # docs/data.md: as ArgyllCMS calls it
        fields = lines[lines.index("BEGIN_DATA_FORMAT") + 1].split()
        data = lines[lines.index("BEGIN_DATA") + 1 : lines.index("END_DATA")]
        measured = [r for r in self.records if r["spectrum"]["step_nm"] == 10]
        self.assertEqual(len(data), len(measured))
        self.assertIn(f"NUMBER_OF_SETS {len(measured)}", text)
        self.assertIn(f"NUMBER_OF_FIELDS {len(fields)}", text)
        for line, record in zip(data, measured):
            values = dict(zip(fields, re.findall(r'"[^"]*"|\S+', line)))
            self.assertEqual(len(values), len(fields))
            self.assertAlmostEqual(float(values["LAB_L"]), record["Lab"][0], 3)
            green = record["spectrum"]["values"][15]
            self.assertAlmostEqual(float(values["SPEC_550"]), 100 * green, 3)

    def test_list_in_pages(self):
        c, since, paged = self.client(), 0, []
        while True:
            page = c.call("record.list", since_seq=since, limit=4)
            paged += page["records"]
            since = page["next_seq"]
            if not page["more"]:
                break
        self.assertEqual(paged, self.records)
        self.assertEqual([r["seq"] for r in paged], list(range(1, len(paged) + 1)))

    def test_sites_once_each(self):
        sites = self.client().call("site.list")["sites"]
        self.assertEqual(sorted(sites), sorted({r["site"] for r in self.records if "site" in r}))

    def test_what_comes_in_between_does_not_disturb(self):
        with self.daemon.client() as c:
            for form in ("csv", "json", "cgats"):
                first = c.call(
                    "record.export", format=form, limit=2, until_seq=self.records[-1]["seq"]
                )
                c.call("match.spectrum", spectrum=SKIN, specular="sce", store=True)
                more = {"since_seq": first["next_seq"], "until_seq": first["until_seq"]}
                (whole,) = self.pages(c, form, until_seq=first["until_seq"])
                self.assertEqual(first["text"] + "".join(self.pages(c, form, **more)), whole)


class Standing(Case):
    def test_tables(self):
        """expect: what sqlite3 reads in the files"""
        c = self.client()
        listed = {t["name"]: t for t in c.call("table.list")["tables"]}
        for name, path in (("paper", PAPER), ("two-layer", TWO_LAYER)):
            file = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
            meta = dict(file.execute("SELECT key, value FROM meta"))
            (rows,) = file.execute("SELECT count(*) FROM entry").fetchone()
            file.close()
            for table in (listed[name], c.call("table.info", table=name)):
                self.assertEqual(table["table_sha256"], meta["content_sha256"])
                self.assertEqual((table["model"], table["rows"]), (name, rows))
                self.assertEqual(table["default"], name == "two-layer")
            self.assertEqual(table["code_version"], meta["code_version"])
            self.assertEqual((table["Cm"], table["illuminant"]), (meta["cm"], "D65"))
        self.assertEqual(listed["two-layer"]["state"], "ready")
        self.assertEqual(
            listed["two-layer"]["bands"], {"first_nm": 400, "step_nm": 10, "bands": 31}
        )
        self.assertNotIn("bands", listed["paper"])
        self.assertEqual(c.call("table.info")["name"], "two-layer")
        with self.refused("table_unknown"):
            c.call("table.info", table="none-such")

    def test_status(self):
        c = self.client()
        first, second = c.call("status.get"), c.call("status.get")
        self.assertEqual((first["boot"], first["server"]), (c.hello["boot"], c.hello["server"]))
        self.assertEqual(first["station_id"], c.hello["station_id"])
        self.assertGreaterEqual(second["uptime_s"], first["uptime_s"])
        self.assertEqual((first["table"], first["store"]), ("ready", "ok"))
        self.assertEqual(
            [i["instrument"] for i in first["instruments"]],
            [i["instrument"] for i in c.call("instrument.list")["instruments"]],
        )
        with self.daemon.client() as other:
            self.assertEqual(other.call("status.get")["clients"], first["clients"] + 1)

    def test_metrics(self):
        c = self.client()

        def metrics():
            return {m["name"]: m for m in c.call("metrics.get")["metrics"]}

        first = metrics()
        c.call("site.list")
        c.call("match.spectrum", spectrum=SKIN, specular="sce", store=True)
        second = metrics()
        self.assertEqual(list(first), sorted(first), "by name")
        counters = [name for name, m in first.items() if m["kind"] == "counter"]
        for name in counters:
            self.assertGreaterEqual(second[name]["value"], first[name]["value"], name)
        grown = [name for name in counters if second[name]["value"] > first[name]["value"]]
        self.assertGreaterEqual(len(grown), 2, "requests and records")

    def test_description_is_the_file(self):
        self.assertEqual(self.client().call("rpc.describe"), {"schema": shapes.DOCUMENT})

    def test_verify(self):
        c = self.client()
        before = c.call("store.verify")
        c.call("match.spectrum", spectrum=SKIN, specular="sce", store=True)
        after = c.call("store.verify")
        self.assertTrue(before["sound"] and after["sound"])
        self.assertEqual(after["records"], before["records"] + 1)
        self.assertEqual(after["last_seq"], c.call("status.get")["last_seq"])
        self.assertNotEqual(after["last_hash"], before.get("last_hash"))
        with self.refused("store_not_damaged"):
            c.call("store.begin_anew")

    def test_session_close(self):
        c, lease = self.ready()
        watcher = self.client()
        watcher.call("events.subscribe", topics=["lease"])
        self.assertTrue(lease)
        self.assertEqual(c.call("session.close"), {"closed": True})
        self.assertTrue(c.is_closed(5))
        watcher.event("lease", "freed")


class Configuring(Case):
    def test_bands_and_aperture(self):
        c, lease = self.ready()
        c.call("events.subscribe", topics=["instrument", "calibration"])
        set_to = c.call("instrument.configure", lease=lease, grid=1)
        self.assertEqual(
            set_to["grids"][set_to["grid"]], {"first_nm": 360, "step_nm": 10, "bands": 39}
        )
        c.event("instrument", "configured", grid=1)
        record = c.measure(lease)
        self.assertEqual(
            (record["spectrum"]["first_nm"], len(record["spectrum"]["values"])), (360, 39)
        )

        set_to = c.call("instrument.configure", lease=lease, aperture_mm=3)
        self.assertEqual((set_to["aperture_mm"], set_to["grid"]), (3, 1))
        self.assertTrue(all(step["due"] for step in set_to["calibration"]))
        with self.refused("calibration_due"):
            c.measure(lease)
        c.calibrate(lease)
        self.assertEqual(c.measure(lease)["aperture_mm"], 3)
        for wrong in ({"grid": 3}, {"aperture_mm": 5}):
            with self.subTest(wrong=wrong), self.refused("instrument_unsupported"):
                c.call("instrument.configure", lease=lease, **wrong)
        c.call("instrument.configure", lease=lease, grid=0, aperture_mm=8)


if __name__ == "__main__":
    main()
