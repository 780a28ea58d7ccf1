"""Six synthetic skins for docs/examples/skin.csv, by radiative transfer.

Two-layer skin with an epidermis of 0.08 mm (transport.py), 400..700 nm by 10,
specular part excluded.  To each comes noise as repeated readings of skin show
it: a level common to all bands, as when the probe presses harder, and a little
white noise band by band.  Single placements on one forearm differ by about 2 %
in level; 1 % is what remains in the mean of three.

    example_spectra.py [--seed N] [--out FILE]
"""

import argparse
import sys

import numpy as np

import transport

EPIDERMIS_MM = 0.08
NM = np.arange(400.0, 701.0, 10.0)
LEVEL_SD, WHITE_SD = 0.01, 0.001      # relative; absolute reflectance

# id, Cm, Bm, Ch
SKINS = [("very_light", 0.006, 0.60, 0.012),
         ("pale", 0.012, 0.50, 0.003),
         ("flushed", 0.015, 0.60, 0.060),
         ("intermediate", 0.022, 0.60, 0.015),
         ("brown", 0.070, 0.65, 0.015),
         ("dark", 0.220, 0.75, 0.020)]

COMMENTS = """\
# SYNTHETIC spectra, no measurements: six skins computed by radiative transfer (adding-doubling, two layers,
# epidermis %g mm, index %g), specular part excluded (SCE), plus noise: one level factor of sd %g per spectrum
# and white noise of sd %g per band.  *_true: the melanin fraction, eumelanin part and blood fraction put in.
# Made by: tests/reference/example_spectra.py --seed %d --out docs/examples/skin.csv
"""


def noisy(spectrum, rng):
    level = 1.0 + LEVEL_SD * rng.standard_normal()
    return level * spectrum + WHITE_SD * rng.standard_normal(spectrum.size)


def write(out, seed, haemoglobin):
    rng, q = np.random.default_rng(seed), transport.quadrature()
    out.write(COMMENTS % (EPIDERMIS_MM, transport.ETA, LEVEL_SD, WHITE_SD, seed))
    out.write("id,specular,Cm_true,Bm_true,Ch_true,"
              + ",".join("%d" % nm for nm in NM) + "\n")
    for name, Cm, Bm, Ch in SKINS:
        exact = transport.skin(Cm, Bm, Ch, EPIDERMIS_MM, NM, haemoglobin, q)
        out.write("%s,sce,%g,%g,%g," % (name, Cm, Bm, Ch)
                  + ",".join("%.5f" % R for R in noisy(exact, rng)) + "\n")


def main():
    parser = argparse.ArgumentParser(description="write docs/examples/skin.csv")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", help="file to write (default: standard output)")
    options = parser.parse_args()
    haemoglobin = transport.read_haemoglobin()
    if options.out is None:
        write(sys.stdout, options.seed, haemoglobin)
    else:
        with open(options.out, "w") as f:
            write(f, options.seed, haemoglobin)
    return 0


if __name__ == "__main__":
    sys.exit(main())
