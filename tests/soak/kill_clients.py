"""kill_clients.py - the clients of kill.py: each has an instrument of its own, keeps asking, and
when the station dies asks the next one again for what was not answered."""

import random
import threading
import time
import traceback

import asking
import station_file
from client import Closed, Refused
from daemon import INSTRUMENTED

PATIENCE_S = 60 if INSTRUMENTED else 20
REMEMBERED = 50  # of its own requests that a client may ask again
STOPPING = ("shutting_down", "measurement_cancelled", "instrument_gone")


class Asker(threading.Thread):
    """`stage` is the method that is being asked for; `request` (method, params) waits for an
    answer, over any number of lives."""

    def __init__(self, killing, number):
        super().__init__(name=f"client {number}", daemon=True)
        self.killing, self.ledger = killing, killing.ledger
        self.dice = random.Random(f"{killing.seed} {self.name}")
        self.instrument = "simulated" if number == 0 else f"simulated-{number + 1}"
        self.stage, self.request = "away", None
        self.life = 0  # that the connection belongs to
        self.lease, self.highest_fence = None, 0
        self.answered, self.persons = [], {}

    def run(self):
        try:
            while not self.killing.ending or self.request is not None:
                try:
                    self.live()
                except (Closed, ConnectionRefusedError, FileNotFoundError):
                    self.stage = "away"
                    time.sleep(0.002)
        except BaseException:  # pylint: disable=broad-except
            self.killing.faults.append(f"{self.name}: {traceback.format_exc()}")

    def live(self):
        """One connection, to its end."""
        life, begun_at = self.killing.life, self.killing.begun_at
        with self.killing.daemon.client(
            self.name, operator=self.name, timeout_s=PATIENCE_S
        ) as client:
            if self.killing.life != life:  # it belongs to the next one
                return
            self.life = life
            if self.request is not None and self.lease is not None and self.dice.random() < 0.5:
                self.ask_with_the_old_lease(client, begun_at)
            self.take_instrument(client)
            if self.request is not None:
                row = self.ask(client)
                self.note_retry(row["taken_at"] < begun_at)
            while not self.killing.ending:
                self.act(client)
        self.stage = "away"

    def at(self, stage, function, *arguments, **params):
        """Do it while `stage` says so."""
        self.stage = stage
        try:
            return function(*arguments, **params)
        except Refused as refused:
            # The answer may be looked at when the next life has begun already.
            if self.life in self.killing.told_to_stop and refused.reason in STOPPING:
                raise Closed(refused.reason) from refused
            raise
        finally:
            self.stage = "between"

    def call(self, client, method, **params):
        return self.at(method, client.call, method, **params)

    # ---- the instrument --------------------------------------------------------------

    def take_instrument(self, client):
        """Its fence is above those of records that it made before."""
        taken = self.call(
            client, "instrument.acquire", instrument=self.instrument, ttl_ms=60000, wait=False
        )
        self.lease = taken["lease"]
        if taken["fence"] <= self.highest_fence:
            raise AssertionError(f"fence {taken['fence']} after {self.highest_fence}")
        self.calibrate(client, only_due=True)

    def opened(self, client):
        """The instrument as instrument.list has it, once it was opened."""
        while True:
            instruments = self.call(client, "instrument.list")["instruments"]
            mine = next(x for x in instruments if x["instrument"] == self.instrument)
            if mine["state"] != "opening":
                return mine
            time.sleep(0.001)

    def calibrate(self, client, only_due=False):
        for step in self.opened(client)["calibration"]:
            if step["due"] or not only_due:
                done = self.call(
                    client, "instrument.calibrate", lease=self.lease, step=step["step"]
                )
                self.ledger.calibrations.add(done["calibration_id"])

    # ---- requests that make a record -------------------------------------------------

    def measure(self, client):
        self.request = "measure.start", asking.measurement(self.dice, list(self.persons))
        self.ask(client)

    def match(self, client):
        self.request = "match.spectrum", asking.match(self.dice)
        self.ask(client)

    def ask(self, client):
        """Until it is answered it stays in `request`; the row it must have made."""
        row = self.answer_of(client, self.request)
        self.answered = (self.answered + [self.request])[-REMEMBERED:]
        self.request = None
        return row

    def answer_of(self, client, request):
        row = self.at(request[0], asking.ask, client, self.ledger, request, self.lease)
        self.highest_fence = max(self.highest_fence, row.get("fence", 0))
        return row

    def ask_with_the_old_lease(self, client, begun_at):
        """docs: the uuid is looked up first, so what was stored comes without a lease."""
        try:
            row = self.ask(client)
        except Refused as refused:
            if refused.reason != "lease_unknown":
                raise
            return
        if "fence" in row and row["taken_at"] >= begun_at:
            raise AssertionError(f"measured under a lease of another life: {row}")
        self.note_retry(row["taken_at"] < begun_at)

    def note_retry(self, stored):
        self.killing.retries["stored already" if stored else "made anew"] += 1

    def again(self, client):
        """Something that was answered, perhaps by a station long dead: the ledger compares."""
        if self.answered:
            self.answer_of(client, self.dice.choice(self.answered))

    # ---- subjects --------------------------------------------------------------------

    def add_subject(self, client):
        name = station_file.person_name(self.dice)
        subject = self.call(client, "subject.add", person={"name": name})["id"]
        self.ledger.subjects[subject] = True
        self.persons[subject] = name

    def forget_subject(self, client):
        if not self.persons or self.killing.remembering:
            return
        subject = self.dice.choice(list(self.persons))
        name = self.persons.pop(subject)
        self.ledger.subjects[subject] = None
        done = self.call(client, "subject.forget", id=subject)
        self.ledger.subjects[subject] = False
        if done["erased"]:
            self.ledger.erased.add(name)

    def act(self, client):
        acts = (self.measure, self.match, self.again, self.calibrate, self.add_subject,
                self.forget_subject)  # fmt: skip
        self.dice.choices(acts, (50, 20, 10, 6, 7, 7))[0](client)
