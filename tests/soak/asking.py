"""asking.py - what the clients of kill.py and soak.py ask for, by the dice of each."""

import os
import sys
import uuid

_TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path[:0] = [os.path.join(_TESTS, "station"), os.path.join(_TESTS, "cli")]

from support import NM, skin_like  # noqa: E402

NOBODY = "00000000-0000-4000-8000-000000000000"
SITES = ("forearm", "cheek", "front tête")


def new_uuid(dice):
    return str(uuid.UUID(int=dice.getrandbits(128), version=4))


def spectrum(dice):
    return {"first_nm": NM[0], "step_nm": NM[1] - NM[0], "values": skin_like(dice)}


def measurement(dice, subjects=(), most_shots=3):
    """Parameters of measure.start without the lease."""
    params = {"uuid": new_uuid(dice), "pace": "auto", "specular": "sce"}
    params["replicates"] = dice.randint(1, most_shots)
    if dice.random() < 0.2:
        params.update(specular="sci", surface=0.04)
    if dice.random() < 0.3:
        params["site"] = dice.choice(SITES)
    if subjects and dice.random() < 0.3:
        params["subject"] = dice.choice(subjects)
    return params


def match(dice):
    """Parameters of match.spectrum; with store, under a uuid."""
    params = {"uuid": new_uuid(dice), "specular": "sce", "store": True, "spectrum": spectrum(dice)}
    if dice.random() < 0.5:
        params.update(by=dice.choice(("rgb", "lab", "spectrum")), k=3)
    return params


def ask(client, ledger, request, lease):
    """Ask for the record of a request (method, params), and have the ledger compare; its row."""
    method, params = request
    if method == "match.spectrum":
        match_told = client.call(method, **params)
        return ledger.match(params["uuid"], params["spectrum"], match_told)
    record = client.call(method, lease=lease, **params)
    if record["uuid"] != params["uuid"]:
        raise AssertionError(f"asked for {params['uuid']}: {record}")
    return ledger.record(record)
