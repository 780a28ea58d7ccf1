"""transport_iadpython.py - one wavelength with 8 streams by iadpython (S. Prahl's adding-doubling): an
endless layer under a surface, which is less than the two layers of a skin.  Prints microseconds of CPU, the
median of many.  Run by tests/bench/transport.py."""

import statistics
import time

import iadpython

ALBEDOS = [0.5 + 0.5 * i / 41 for i in range(40)]


def main():
    took = []
    for _ in range(3):
        for albedo in ALBEDOS:
            sample = iadpython.Sample(a=albedo, b=float("inf"), g=0, n=1.4, quad_pts=8)
            began = time.process_time()
            ur1 = sample.rt()[0]
            took.append(1e6 * (time.process_time() - began))
            assert 0.0 < ur1 < 1.0
    print(f"{statistics.median(took):.1f}")


if __name__ == "__main__":
    main()
