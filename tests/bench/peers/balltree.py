"""balltree.py - scikit-learn's BallTree on the spectra that search.c left in a folder.

    python3 balltree.py FOLDER BANDS QUERIES

Prints a line for each sort of queries: its name and nanoseconds of CPU time a query; the best
leaf counts.
All queries are asked in one call, which is the fastest way it has; one thread.
"""

import sys
import time

import numpy
from sklearn.neighbors import BallTree

LEAVES = (20, 40, 80)


def main():
    folder, bands, queries = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
    rows = numpy.fromfile(f"{folder}/rows.f32", numpy.float32).reshape(-1, bands)
    best = {}
    for leaf in LEAVES:
        tree = BallTree(rows, leaf_size=leaf)
        for sort in ("near", "off"):
            query = numpy.fromfile(f"{folder}/{sort}.f32", numpy.float32).reshape(-1, bands)
            start = time.process_time()
            tree.query(query[:queries], k=1)
            took = (time.process_time() - start) / queries * 1e9
            best[sort] = min(best.get(sort, took), took)
    for sort, took in best.items():
        print(sort, f"{took:.0f}")


main()
