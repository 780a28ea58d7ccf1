"""soak_visitor.py - one of soak.py's many clients: it comes, does this and that for a while, goes
one way or another, and comes again.  Every answer is held to the protocol's description and
to what was told before."""

import collections
import json
import random
import threading
import time
import traceback

import asking
import station_file
from client import Client, Closed, Refused

PATIENCE_S = 30
TOPICS = ["instrument", "calibration", "lease", "measurement", "store"]
REMEMBERED = 20
# Of a uuid that a client asked for and left behind, on its way out.
LEAVING = ("measurement_running", "measurement_cancelled")


def request_line(**members):
    request = {"jsonrpc": "2.0", "id": 1, "method": "status.get", **members}
    return json.dumps(request).encode("ascii") + b"\n"


# What is sent, and the reason it is refused for: docs/protocol.md, "Errors".
GARBAGE = (
    (b"{\n", "json_invalid"),
    (b'"\xff"\n', "utf8_invalid"),
    (b'{"a":1,"\\u0061":2}\n', "duplicate_member"),
    (b"[" * 17 + b"]" * 17 + b"\n", "too_deep"),
    (b"[]\n", "batch_refused"),
    (b'{"jsonrpc":"2.0","method":"status.get"}\n', "id_missing"),
    (request_line(method="skin.peel"), "method_unknown"),
    (request_line(params={"x": 1}), "params_invalid"),
    (request_line(method="record.get", params={"id": "0" * 36}), "params_invalid"),
    (request_line(method="record.get", params={"id": asking.NOBODY}), "record_unknown"),
    (request_line(method="session.open", params={"major": 1, "client": "x"}), "session_exists"),
)
TOO_LONG = b"x" * (1 << 16) + b"x"


# What visitors are told: go on; finish what was begun, all of it; the station ends now.
STAY, FINISH, END = range(3)


class Leave(Exception):
    """The end of a visit."""


class Connection(Client):
    """What a visitor needs beyond a Client.  `longest_s`: that any waited for an answer."""

    longest_s = 0.0

    def wait(self, request_id, timeout_s=None):
        begun = time.monotonic()
        try:
            return super().wait(request_id, timeout_s)
        finally:
            Connection.longest_s = max(Connection.longest_s, time.monotonic() - begun)

    def has_reply(self, request_id):
        return request_id in self._replies

    def refusal(self):
        """The reason of the next reply, whatever it is to."""
        while True:
            message = self.next_message()
            if "method" not in message:
                return message["error"]["data"]["reason"]
            self.events.append(message)


def must(good, what):
    if not good:
        raise AssertionError(what)


class Visitor(threading.Thread):
    """order() is STAY, FINISH or END; `tally` counts what was done, `fault` says what was wrong."""

    def __init__(self, path, instruments, seed, name, order):
        super().__init__(name=name, daemon=True)
        self.path, self.instruments, self.order = path, instruments, order
        self.dice = random.Random(f"{seed} {name}")
        self.ledger, self.tally, self.fault = station_file.Ledger(), collections.Counter(), None
        self.request = None  # of a record, asked for and not heard of
        self.rows = []  # the ledger's, of the last measurements
        self.persons = {}
        self.client = self.heard = self.fence = None

    def run(self):
        try:
            while self.order() == STAY:
                self.visit()
        except (Closed, Refused, ConnectionRefusedError, FileNotFoundError):
            if self.order() != END:
                self.fault = f"{self.name}: {traceback.format_exc()}"
        except BaseException:  # pylint: disable=broad-except
            self.fault = f"{self.name}: {traceback.format_exc()}"

    def visit(self):
        with Connection(self.path, timeout_s=PATIENCE_S) as self.client:
            try:
                self.client.open(self.name, operator=self.name)
                self.stay()
            except Leave:
                self.tally["left in the middle"] += 1

    def stay(self):
        subscribed = self.dice.random() < 0.25
        if subscribed:
            self.subscribe()
        for _ in range(self.dice.randint(1, 30)):
            (act,) = self.dice.choices(list(ACTS), list(ACTS.values()))
            self.tally[act.__name__] += 1
            act(self)
            self.hear(subscribed)
            if self.order() != STAY:
                return
        if self.dice.random() < 0.5:
            self.client.call("session.close")
            must(self.client.is_closed(), "it stays open after session.close")

    # ---- events ----------------------------------------------------------------------

    def subscribe(self):
        """From where it left off, if it heard any before."""
        since = {} if self.heard is None else {"since_seq": self.heard}
        told = self.client.call("events.subscribe", topics=TOPICS, **since)
        if not since:
            self.heard = told["event_seq"]
        elif not told["resumed"]:
            self.heard = self.client.lost()["next_seq"] - 1
        self.tally["resumed" if since and told["resumed"] else "not resumed"] += 1

    def hear(self, subscribed):
        """docs: events of all topics are counted together, so who hears all misses none."""
        while self.client.events:
            message = self.client.events.popleft()
            must(subscribed and message["method"] == "event", f"{message} is out of turn")
            seq = message["params"]["seq"]
            must(seq == self.heard + 1, f"event {seq} after {self.heard}")
            self.heard = seq
            self.tally["events"] += 1

    # ---- instruments -----------------------------------------------------------------

    def use_instrument(self):
        """Wait for it among all others, measure, and go with it or without."""
        instrument = self.dice.choice(self.instruments)
        taken = self.client.acquire(instrument, wait=True)
        lease, self.fence = taken["lease"], taken["fence"]
        if self.dice.random() < 0.05:
            self.patiently("instrument.configure", lease=lease, grid=self.dice.randint(0, 1),
                           aperture_mm=self.dice.choice((8, 3)))  # fmt: skip
        self.calibrate(instrument, lease)
        if self.request is not None:
            self.ask(instrument, lease)
        for _ in range(self.dice.randint(1, 4)):
            hows = (self.measure, self.measure_prompted, self.cancel, self.begin_and_leave)
            (how,) = self.dice.choices(hows, (80, 8, 8, 4))
            self.tally[how.__name__] += 1
            how(instrument, lease)
        if self.dice.random() < 0.1:
            raise Leave
        self.client.call("instrument.release", lease=lease)

    def patiently(self, method, **params):
        """What the holder before left behind may be on its way out still."""
        while True:
            try:
                return self.client.call(method, **params)
            except Refused as refused:
                if refused.reason != "measurement_running":
                    raise
            time.sleep(0.005)

    def calibrate(self, instrument, lease):
        instruments = self.client.call("instrument.list")["instruments"]
        for step in next(x for x in instruments if x["instrument"] == instrument)["calibration"]:
            if step["due"]:
                done = self.patiently("instrument.calibrate", lease=lease, step=step["step"])
                self.ledger.calibrations.add(done["calibration_id"])

    def ask(self, instrument=None, lease=None):
        """Until self.request has made a record."""
        while self.request is not None:
            try:
                self.keep(asking.ask(self.client, self.ledger, self.request, lease))
                self.request = None
            except Refused as refused:
                if refused.reason in LEAVING:
                    time.sleep(0.005)
                elif refused.reason == "calibration_due":
                    self.calibrate(instrument, lease)
                else:
                    raise

    def keep(self, row):
        if "fence" in row:  # it was measured
            self.rows = (self.rows + [row])[-REMEMBERED:]

    def measure(self, instrument, lease):
        self.request = "measure.start", asking.measurement(self.dice, list(self.persons))
        self.ask(instrument, lease)
        told = self.rows[-1]["fence"]
        must(told == self.fence, f"fence {told} under the lease of {self.fence}")

    def measure_prompted(self, _, lease):
        """Each further shot as soon as the station waits for it."""
        asked, uuid = self.begin(lease, pace="prompt", replicates=3)
        shot, until = 1, time.monotonic() + PATIENCE_S
        while shot < 3 and not self.client.has_reply(asked):
            must(time.monotonic() < until, "it does not wait for the next shot")
            try:
                shot = self.client.call("measure.next", lease=lease, uuid=uuid)["shot"]
            except Refused as refused:
                if refused.reason not in ("measurement_unknown", "measurement_not_waiting"):
                    raise
                time.sleep(0.002)
        self.finish(asked)

    def cancel(self, _, lease):
        """Before it begins, during a shot, or when it is stored already."""
        asked, uuid = self.begin(lease, replicates=3)
        time.sleep(self.dice.uniform(0, 0.02))
        try:
            told = self.client.call("measure.cancel", lease=lease, uuid=uuid)
        except Refused as refused:
            if refused.reason != "measurement_unknown":
                raise
            self.finish(asked)
            return
        must(not told["stored"], "cancelled, and stored")
        must(self.finish(asked) == "measurement_cancelled", "cancelled, and answered")
        self.ledger.cancelled.add(uuid)

    def begin(self, lease, **more):
        """Ask for a measurement without waiting: what finish() takes, and the uuid."""
        params = {**asking.measurement(self.dice), **more}
        return self.client.send("measure.start", lease=lease, **params), params["uuid"]

    def finish(self, asked):
        """Wait for its record, or for the reason why there is none; None with a record."""
        try:
            self.keep(self.ledger.record(self.client.wait(asked)))
        except Refused as refused:
            if refused.reason not in (*LEAVING, "calibration_due"):
                raise
            return refused.reason
        return None

    def begin_and_leave(self, _, lease):
        """To ask for the same uuid at the next visit."""
        self.request = "measure.start", asking.measurement(self.dice)
        self.client.send("measure.start", lease=lease, **self.request[1])
        time.sleep(self.dice.uniform(0, 0.02))
        raise Leave

    # ---- matches and subjects --------------------------------------------------------

    def match(self):
        spectrum, by = asking.spectrum(self.dice), self.dice.choice(("rgb", "de2000", "spectrum"))
        told = self.client.call("match.spectrum", spectrum=spectrum, specular="sce", store=False,
                                by=by, k=2)  # fmt: skip
        near = [row["distance"] for row in told["nearest"]]
        must(near[0] == told["distance"] <= near[1], f"nearest: {near}")

    def match_and_store(self):
        if self.request is not None:  # what waits for an instrument
            return
        self.request = "match.spectrum", asking.match(self.dice)
        if self.dice.random() < 0.05:
            self.client.send(self.request[0], **self.request[1])
            raise Leave
        self.ask()

    def add_subject(self):
        name = station_file.person_name(self.dice)
        subject = self.client.call("subject.add", label="x", person={"name": name})["id"]
        self.ledger.subjects[subject] = True
        self.persons[subject] = name

    def forget_subject(self):
        if not self.persons:
            return
        subject = self.dice.choice(list(self.persons))
        name = self.persons.pop(subject)
        self.ledger.subjects[subject] = None
        done = self.client.call("subject.forget", id=subject)
        self.ledger.subjects[subject] = False
        if done["erased"]:
            self.ledger.erased.add(name)

    # ---- reading ---------------------------------------------------------------------

    def get(self):
        if self.rows:
            row = self.dice.choice(self.rows)
            self.ledger.record(self.client.call("record.get", id=row["id"]))

    def list(self):
        if not self.rows:
            return
        row = self.dice.choice(self.rows)
        page = self.client.call("record.list", since_seq=row["seq"] - 1, limit=5)
        seqs = [record["seq"] for record in page["records"]]
        must(seqs == list(range(row["seq"], row["seq"] + len(seqs))), f"record.list: {seqs}")
        must(page["records"][0]["id"] == row["id"] and page["next_seq"] == seqs[-1], f"{page}")

    def export(self):
        if not self.rows:
            return
        row, form = self.dice.choice(self.rows), self.dice.choice(("csv", "json", "cgats"))
        page = self.client.call("record.export", format=form, since_seq=row["seq"] - 1, limit=20)
        must(page["next_seq"] >= row["seq"] and row["id"] in page["text"], f"{form}: {page}")

    def recompute(self):
        if self.rows:
            row = self.dice.choice(self.rows)
            told = self.client.call("record.recompute", id=row["id"])
            must(told["same_bits"] and told["stored"] == told["recomputed"], f"{told}")

    def look(self):
        """Many at a time; answers may come in any order."""
        asked = [self.client.send(self.dice.choice(LOOKS)) for _ in range(self.dice.randint(1, 20))]
        self.dice.shuffle(asked)
        for request_id in asked:
            self.client.wait(request_id)

    # ---- what nobody should send -----------------------------------------------------

    def garbage(self):
        line, reason = self.dice.choice(GARBAGE)
        self.client.send_raw(line)
        told = self.client.refusal()
        must(told == reason, f"{line[:80]!r}: {told}, not {reason}")

    def too_long(self):
        self.client.send_raw(TOO_LONG)
        must(self.client.refusal() == "line_too_long", "another reason")
        must(self.client.is_closed(), "it stays open after too long a line")
        raise Leave

    def half_a_line(self):
        self.client.send_raw(request_line()[: self.dice.randint(1, 40)])
        raise Leave

    def noise(self):
        """Whatever it makes of it, others do not notice."""
        self.client.send_raw(self.dice.randbytes(self.dice.randint(1, 5000)))
        raise Leave


LOOKS = ("status.get", "metrics.get", "instrument.list", "table.list", "table.info", "site.list",
         "subject.list", "rpc.describe")  # fmt: skip

# How often, and what.
ACTS = {
    Visitor.use_instrument: 25,
    Visitor.match: 8,
    Visitor.match_and_store: 15,
    Visitor.add_subject: 5,
    Visitor.forget_subject: 4,
    Visitor.get: 8,
    Visitor.list: 8,
    Visitor.export: 5,
    Visitor.recompute: 8,
    Visitor.look: 8,
    Visitor.garbage: 8,
    Visitor.too_long: 1,
    Visitor.half_a_line: 1,
    Visitor.noise: 1,
}
