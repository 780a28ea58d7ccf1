"""balltree.py - scikit-learn's BallTree on the spectra that search.c left in a folder.

    python3 balltree.py FOLDER BANDS QUERIES

Makes trees with leaves of several sizes and says "ready"; then for each line of its input, so that
rounds can be by turns with another program, prints one: for each sort of queries its name and the
nanoseconds of CPU time a query of each leaf size.  Doubles, as the tree has them; all queries are
asked in one call, which is the fastest way it has; one thread.
"""

import sys
import time

import numpy
from sklearn.neighbors import BallTree

LEAVES = (2, 3, 5, 10, 20)
SORTS = ("near", "off")


def main():
    folder, bands, queries = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])

    def doubles(name):
        floats = numpy.fromfile(f"{folder}/{name}.f32", numpy.float32)
        return floats.reshape(-1, bands).astype(numpy.float64)

    rows = doubles("rows")
    trees = [BallTree(rows, leaf_size=leaf) for leaf in LEAVES]
    asked = {sort: doubles(sort)[:queries] for sort in SORTS}
    print("ready", flush=True)
    for _ in sys.stdin:
        said = []
        for sort in SORTS:
            said.append(sort)
            for tree in trees:
                start = time.process_time()
                tree.query(asked[sort], k=1)
                said.append(f"{(time.process_time() - start) / queries * 1e9:.0f}")
        print(*said, flush=True)


main()
