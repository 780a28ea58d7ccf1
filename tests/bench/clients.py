"""clients.py - how the rate grows with connections; each waits for its answer before it asks again."""

import os

import machine
import queries
import services
from places import BENCH, DISK, TABLE
from rates import COLUMNS, HEADINGS, show_rate
from report import heading

CONNECTIONS = 1, 2, 4, 8, 16, 32, 48
SECONDS = 2


def show():
    heading("matched and stored on disk, by connections")
    lines = os.path.join(BENCH, "plain")
    queries.write(lines, TABLE)
    print(COLUMNS.format(*HEADINGS))
    with services.Station(os.path.join(DISK, "clients"), lines) as station:
        for connections in CONNECTIONS:
            with machine.Others() as others:
                result = station.rate(SECONDS, connections)
            show_rate(str(connections), [{**result, "others": others.percent}])
        station.check()
