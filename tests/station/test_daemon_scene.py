#!/usr/bin/env python3
"""test_daemon_scene.py - match.spectrum and measure.start with `scene`: the daemon's answers
against the command line's, what a record keeps of them, and the same bits when it is computed
again."""

import json
import os
import tempfile

from client import Refused
from daemon import FAST, Case, Daemon, main, new_uuid
from support import EXAMPLES, TWO_LAYER, run
from test_daemon_records import example_skins

# The station goes by the costs compiled in; so the command line here.
os.environ["XDG_STATE_HOME"] = os.path.join(os.sep, "nonexistent")

SCENES = (
    {"want": ["lab", "rgb"]},
    {"want": ["nearest"], "by": "lab", "k": 3},
    {"want": ["refined"], "Bm": 1, "Cm": [0.001, 0.3]},
    {"want": ["refined", "interval", "lab", "nearest"], "noise": 0.002, "k": 2},
    {"want": ["refined"], "start": "closed-form"},
    {"want": ["refined"], "fit": "skin"},
    {"want": ["coefficients"], "error": {"Cm": 0.02}},
    {"want": ["nearest"], "bands": {"first_nm": 500, "last_nm": 700, "step_nm": 10}},
)


def settled(answer):
    """Without the time, and what was expected."""
    plan = {name: one for name, one in answer["plan"].items() if name not in ("us", "estimated")}
    return {**answer, "plan": plan}


class Matching(Case):
    def match(self, c, scene, **more):
        return c.call("match.spectrum", **{"spectrum": next(iter(example_skins())), "specular": "sce",
                                           "store": False, "scene": scene, **more})  # fmt: skip

    def test_as_the_command_line(self):
        c = self.client()
        for scene in SCENES:
            with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
                json.dump(scene, file)
                file.flush()
                done = run("match", EXAMPLES, "--table", TWO_LAYER, "--scene", file.name, "--json")
            self.assertEqual(done.status, 0, done.err)
            for spectrum, expected in zip(example_skins(), done.json()):
                with self.subTest(scene, id=expected.pop("id")):
                    self.assertEqual(settled(self.match(c, scene, spectrum=spectrum)), settled(expected))

    def test_what_is_stored_comes_back(self):
        c = self.client()
        for scene in SCENES:
            uuid = new_uuid()
            if scene["want"] == ["lab", "rgb"] or scene.get("start") == "closed-form":
                with self.refused("params_invalid"):
                    self.match(c, scene, store=True, uuid=uuid)
                continue
            with self.subTest(scene):
                stored = self.match(c, scene, store=True, uuid=uuid)
                place = stored.pop("record")
                match = c.call("record.get", id=place["id"])["match"]
                self.assertNotIn("us", match["plan"])
                self.assertEqual({**settled(match), "nearest": None}, {**settled(stored), "nearest": None})
                again = c.call("record.recompute", id=place["id"])
                self.assertEqual((again["same_bits"], again["difference"]), (True, 0))
                self.assertEqual(again["stored"], match)
                retry = self.match(c, scene, store=True, uuid=uuid)
                self.assertEqual(retry.pop("record"), place)
                self.assertEqual(retry, match)
        with self.refused("uuid_reused"):
            self.match(c, {"want": ["nearest"]}, store=True, uuid=uuid)
        for format_ in ("csv", "json", "cgats"):
            c.call("record.export", format=format_)

    def test_refused(self):
        c = self.client()
        for scene in ({"want": []}, {"want": ["labb"]}, {"wnat": ["lab"]}, {"want": ["lab"], "K": 1},
                      {"want": ["interval"]}, {"want": ["refined"], "Cm": [0.3, 0.1]},
                      {"want": ["refined"], "error": {"Cm": 1e-9}}, {"want": ["refined"], "budget_us": 1e-3},
                      {"want": ["refined"], "error": {"Cm": 1}, "budget_us": 5},
                      {"want": ["nearest"], "model": "half-space"}):  # fmt: skip
            with self.subTest(scene), self.refused("params_invalid"):
                self.match(c, scene)
        for name, value in (("by", "lab"), ("refine", "three"), ("k", 2)):
            with self.refused("params_invalid"):
                self.match(c, {"want": ["lab"]}, **{name: value})
        try:
            self.match(c, {"want": ["refined"], "error": {"Cm": 1e-9}})
        except Refused as refused:
            self.assertIn("the nearest is", str(refused.error))


COSTS = """# machine: none
# costs: 2
model,rows,by,refine,interval,us,us_p95,Cm,Bm,Ch,Cm_transport,Bm_transport,Ch_transport,dE00,rms_R,bytes
two-layer,50400,lab,none,0,1,1,1e-5,0.1,0.01,1e-5,0.1,0.01,1,0.01,0
two-layer,50400,spectrum,none,0,9,9,1e-5,0.1,0.01,1e-5,0.1,0.01,1,0.01,0
"""


class Costs(Case):
    def by(self, costs):
        """How a station with this file searches where a bound leaves it the choice."""
        with tempfile.TemporaryDirectory(prefix="sk.", dir="/tmp") as state:
            with open(os.path.join(state, "costs.csv"), "w", encoding="ascii") as file:
                file.write(costs)
            with Daemon(state=state) as daemon, daemon.client() as c:
                daemon.wait_for_table()
                scene = {"want": ["nearest"], "error": {"Cm": 1e-4}, "noise": 0.003}
                answer = c.call("match.spectrum", spectrum=next(iter(example_skins())),
                                specular="sce", store=False, scene=scene)  # fmt: skip
                return answer["by"], answer["plan"]["estimated"]["us"]

    def test_of_this_machine(self):
        """By costs that say that lab takes no time and is never wrong, lab it is."""
        self.assertEqual(self.by(COSTS), ("lab", 1))

    def test_without_sense(self):
        """Those compiled in: there no row is so near."""
        with self.refused("params_invalid"):
            self.by(COSTS.replace("lab,none", "lab,maybe"))
        with self.refused("params_invalid"):
            self.by(COSTS[: COSTS.index("two-layer,50400,spectrum")])


class Measuring(Case):
    instruments = (FAST,)

    def test_records(self):
        c, lease = self.ready()
        for scene in ({"want": ["nearest"], "by": "lab"}, {"want": ["refined", "interval"]},
                      {"want": ["refined"], "Bm": 1}):  # fmt: skip
            record = c.measure(lease, replicates=3, scene=scene)
            match = record["match"]
            self.assertNotIn("us", match["plan"])
            self.assertEqual("interval" in match, "interval" in scene["want"])
            again = c.call("record.recompute", id=record["id"])
            self.assertEqual((again["same_bits"], again["difference"]), (True, 0))
            self.assertEqual(again["stored"], match)
        record = c.measure(lease, replicates=1, scene={"want": ["lab"]})
        self.assertNotIn("match", record)
        self.assertEqual(len(record["Lab"]), 3)
        for scene in ({"want": ["refined"], "start": "closed-form"}, {"want": ["interval"]},
                      {"want": ["refined"], "budget_us": 1e-3},
                      {"want": ["nearest"], "Ch": 0.0123}):  # fmt: skip
            with self.subTest(scene), self.refused("params_invalid"):
                c.measure(lease, replicates=1, scene=scene)

    def test_held_beside_the_table(self):
        """What no row has, and what no row lacks: a fit is stored all the same, and comes again."""
        c, lease = self.ready()
        for scene in ({"want": ["refined"], "dermis": False}, {"want": ["refined"], "Ch": 0.0123},
                      {"want": ["coefficients"], "dermis": False}, {"want": ["refined", "nearest"], "dermis": False},
                      {"want": ["refined"], "Cm": [0.0123, 0.0124], "Bm": [0.31, 0.32]}):  # fmt: skip
            with self.subTest(scene):
                record = c.measure(lease, replicates=2, scene=scene)
                self.assertNotIn("not_refined", record["flags"])
                again = c.call("record.recompute", id=record["id"])
                self.assertEqual((again["same_bits"], again["difference"]), (True, 0))
                self.assertEqual(again["stored"], record["match"])

    def test_a_way_that_can_be_stored(self):
        """The cheapest way takes no table; for a record the cheapest that does is taken."""
        c, lease = self.ready()
        with open(os.path.join(os.path.dirname(EXAMPLES), "want.json"), encoding="utf-8") as file:
            scene = json.load(file)
        with self.assertRaisesRegex(Refused, "a record needs a way .* the nearest is table 'two-layer'"):
            c.measure(lease, scene=scene)
        scene = {"want": ["lab", "refined"], "error": {"Cm": 0.05}}
        spectrum = next(iter(example_skins()))
        ran = c.call("match.spectrum", spectrum=spectrum, specular="sce", store=False, scene=scene)["plan"]["ran"]
        self.assertNotIn("search", ran)
        for record in (c.measure(lease, scene=scene),
                       c.call("record.get", id=c.call("match.spectrum", spectrum=spectrum, specular="sce", store=True,
                                                      uuid=new_uuid(), scene=scene)["record"]["id"])):  # fmt: skip
            self.assertIn("search", record["match"]["plan"]["ran"])
            self.assertEqual(len(record["match"]["colour"]["Lab"]), 3)
            again = c.call("record.recompute", id=record["id"])
            self.assertEqual((again["same_bits"], again["difference"]), (True, 0))

    def test_colours_of_another_light(self):
        """A record has D65 and 10 degrees: others are refused, not left out; with rows they are there."""
        c, lease = self.ready()
        bands = {"first_nm": 400, "last_nm": 700, "step_nm": 20}
        for more in ({"illuminant": "A"}, {"observer": "2"}, {"illuminant": "A", "observer": "2"}, {"bands": bands}):
            with self.subTest(more), self.refused("params_invalid"):
                c.measure(lease, scene={"want": ["lab"], **more})
        with self.refused("params_invalid"):
            c.measure(lease, scene={"want": ["lab"], "bands": {**bands, "first_nm": 500}})
        scene = {"want": ["lab", "nearest"], "illuminant": "A", "observer": "2"}
        record = c.measure(lease, scene=scene)
        colour = record["match"]["colour"]
        self.assertEqual((colour["illuminant"], colour["observer"]), ("A", "2"))
        self.assertNotEqual(colour["Lab"], record["Lab"])
        only = c.call("match.spectrum", spectrum=record["spectrum"], specular="sce", store=False, scene=scene)
        self.assertEqual(only["colour"], colour)
        self.assertEqual(len(c.measure(lease, scene={"want": ["lab"], "illuminant": "D65"})["Lab"]), 3)


class WithoutTable(Case):
    instruments = None

    def test_refused_before_the_first_shot(self):
        self.daemon = self.enterContext(Daemon("--table", "no-such-table"))
        self.daemon.wait_for_instrument()
        c, lease = self.ready()
        with self.refused("table_missing"):
            c.measure(lease, scene={"want": ["refined"]})
        self.assertNotIn("match", c.measure(lease, scene={"want": ["lab"]}))


if __name__ == "__main__":
    main()
