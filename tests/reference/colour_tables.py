#!/usr/bin/env python3
"""Write src/colour/cie_tables.c, and check the weights that were given.

    python3 tests/reference/colour_tables.py [FOLDER] [--check] [--out FILE]

FOLDER (default ../shared/figures, seen from the top of the tree) holds
    cmf_1nm.csv             CIE 1931 and 1964 colour-matching functions, 360..830 by 1
    illuminants_5nm.csv     relative spectral power by 5 nm, empty where not published
    weights_e2022_*.csv     ASTM E2022 weights by 10 nm, 360..780, six decimals, for
                            A, C, D50, D65, FL2 and FL11 with both observers

The procedure, found by reproducing the twelve given tables: it meets every
printed decimal (worst difference 0.0000005, half of the last one).
  1. The illuminant goes from 5 to 1 nm by straight lines.  (Cubic or Sprague
     interpolation would be off by 0.001 for A, 0.06 for D65, 1.0 for FL11.)
  2. Where it is not published (below 380 nm: FL and LED) the nearest published
     value is repeated.  (0 instead would be off by 0.002.)  This matters for the
     10 nm weights only; cie_illuminant holds 0 there.
  3. At every nm of 360..780 the reflectance is taken as the Lagrange polynomial
     through the neighbouring 10 nm bands: cubic through two on each side, in
     the first and the last interval quadratic through the three bands there.
  4. Colour-matching function x illuminant x Lagrange coefficient, summed for each
     band and scaled so that the Y weights add up to 100.
The tables that are not given (D55, D75, E, FL7, LED-B3) come from the same
procedure, in exact fractions, rounded once to the same six decimals.

Illuminant A is the exception to step 1: CIE 15 defines it by Planck's law at every
wavelength, so its tables are made from that law by 1 nm (PLANCKIAN) and not as
given; straight lines between 5 nm points cost up to 0.002 in Z of a skin.
"""
import argparse
import csv
import math
import os
import sys
from fractions import Fraction

ILLUMINANTS = ["A", "C", "D50", "D55", "D65", "D75", "E", "FL2", "FL7", "FL11", "LED-B3"]
OBSERVERS = ["2", "10"]
GIVEN = ["A", "C", "D50", "D65", "FL2", "FL11"]
PLANCKIAN = ["A"]
BANDS = range(360, 781, 10)
CMF_NM = range(360, 831)
ILLUMINANT_NM = range(360, 831, 5)
DECIMALS = 6

HEAD = """\
/* cie_tables.c - written by tests/reference/colour_tables.py; do not edit.
 *
 * cie_cmf             CIE 1931 (2 degrees) and CIE 1964 (10 degrees) standard observers,
 *                     CIE 15, as published by 1 nm.
 * cie_illuminant      CIE 15: A, C, the daylights D50 to D75, E, FL2, FL7, FL11 and
 *                     LED-B3, as published by 5 nm; 0 where nothing is published.
 * cie_weights_10nm    ASTM E2022 weights.  C, D50, D65, FL2, FL11: transcribed from
 *                     given tables of six decimals.  D55, D75, E, FL7, LED-B3: computed
 *                     here by the procedure that reproduces the given tables to
 *                     %s, half of their last decimal.  A: by the same procedure, but
 *                     from Planck's law by 1 nm, which defines it (docs/decisions).
 *                     The procedure: illuminant linear between its
 *                     5 nm points (below 380 nm FL and LED keep their value at 380),
 *                     reflectance by Lagrange polynomials, cubic inside and quadratic
 *                     in the first and last interval, 1 nm sum over 360..780, Y = 100.
 */
#include "colour/cie_tables.h"

/* Tables keep their columns. */
/* clang-format off */
"""


def rows(folder, name):
    with open(os.path.join(folder, name), newline="") as f:
        return list(csv.reader(f))


def read_cmf(folder):
    """{nm: [text] * 6}: 2 degrees x y z, 10 degrees x y z."""
    return {int(r[0]): r[1:] for r in rows(folder, "cmf_1nm.csv")[1:]}


def read_illuminants(folder):
    """{name: {nm: text}}, only the published points."""
    table = rows(folder, "illuminants_5nm.csv")
    ret = {name: {} for name in table[0][1:]}
    for r in table[1:]:
        for name, text in zip(table[0][1:], r[1:]):
            if text != "":
                ret[name][int(r[0])] = text
    return ret


def read_weights(folder, name, observer):
    table = rows(folder, f"weights_e2022_{name}_{observer}deg_10nm.csv")[1:]
    assert [int(r[0]) for r in table] == list(BANDS), name
    return {int(r[0]): r[1:] for r in table}


def illuminant_1nm(points):
    """Steps 1 and 2: {nm: Fraction} over 360..780."""
    value = {nm: Fraction(text) for nm, text in points.items()}
    first, last = min(value), max(value)
    ret = {}
    for nm in range(BANDS[0], BANDS[-1] + 1):
        at = min(max(nm, first), last)
        low = at - at % 5
        ret[nm] = value[low]
        if at != low:
            ret[nm] += (value[low + 5] - value[low]) * Fraction(at - low, 5)
    return ret


def planckian_1nm():
    """CIE 15: illuminant A, c2 = 1.435e7 nm K, 2848 K, 100 at 560 nm."""
    radiance = {nm: nm**-5 / math.expm1(1.435e7 / (2848 * nm)) for nm in range(360, 781)}
    return {nm: Fraction(100 * x / radiance[560]) for nm, x in radiance.items()}


def nodes(nm):
    """Step 3: the bands whose polynomial gives the reflectance at nm."""
    low = nm - nm % 10
    if low == nm:
        return [nm]
    if low == BANDS[0]:
        return [low, low + 10, low + 20]
    if low + 10 == BANDS[-1]:
        return [low - 10, low, low + 10]
    return [low - 10, low, low + 10, low + 20]


def lagrange(points, i, x):
    ret = Fraction(1)
    for j, p in enumerate(points):
        if j != i:
            ret *= Fraction(x - p, points[i] - p)
    return ret


def weights(cmf, power, observer):
    """Step 4: {band: [Fraction] * 3} for the power by 1 nm."""
    offset = 3 * OBSERVERS.index(observer)
    w = {band: [Fraction(0)] * 3 for band in BANDS}
    for nm, s in power.items():
        around = nodes(nm)
        for i, band in enumerate(around):
            share = s * lagrange(around, i, nm)
            for k in range(3):
                w[band][k] += share * Fraction(cmf[nm][offset + k])
    scale = 100 / sum(v[1] for v in w.values())
    return {band: [scale * x for x in v] for band, v in w.items()}


def fixed(x):
    """A Fraction at six decimals, half away from zero, never -0."""
    scaled = abs(x) * 10**DECIMALS
    digits = int(scaled + Fraction(1, 2))
    sign = "-" if x < 0 and digits else ""
    return f"{sign}{digits // 10**DECIMALS}.{digits % 10**DECIMALS:0{DECIMALS}d}"


def as_double(text):
    """The number as the source prints it, spelled as a C double."""
    return text if "." in text or "e" in text else text + ".0"


def worst(given, computed):
    """(difference, band, X Y or Z) where print and procedure differ most."""
    return max((abs(Fraction(given[b][k]) - computed[b][k]), b, "XYZ"[k])
               for b in BANDS for k in range(3))


def emit_rows(out, table, first, step, width, indent):
    for i, values in enumerate(table):
        cells = ", ".join(v.rjust(width) for v in values)
        out.append(f"{indent}{{ {cells} }}, /* {first + i * step} */")


def emit(cmf, points, tables, difference):
    out = (HEAD % f"{float(difference):.7f}").splitlines()
    out.append("const double cie_cmf[OBSERVER_COUNT][CIE_CMF_N][3] = {")
    for o, observer in enumerate(OBSERVERS):
        out.append(f"    [OBSERVER_{observer}DEG] = {{ /* x y z of {observer} degrees, nm */")
        table = [[as_double(t) for t in cmf[nm][3 * o:3 * o + 3]] for nm in CMF_NM]
        emit_rows(out, table, 360, 1, 14, "        ")
        out.append("    },")
    out += ["};", ""]

    out.append("const double cie_illuminant[CIE_ILLUMINANT_N][ILLUMINANT_COUNT] = {")
    out.append("    /* " + " ".join(n.rjust(8) for n in ILLUMINANTS) + "    nm */")
    table = [[as_double(points[n].get(nm, "0")) for n in ILLUMINANTS] for nm in ILLUMINANT_NM]
    emit_rows(out, table, 360, 5, 7, "    ")
    out += ["};", ""]

    out.append("const double cie_weights_10nm"
               "[ILLUMINANT_COUNT][OBSERVER_COUNT][CIE_WEIGHTS_N][3] = {")
    for name in ILLUMINANTS:
        how = "computed" if name not in GIVEN or name in PLANCKIAN else "as given"
        out.append(f"    [ILLUMINANT_{name.replace('-', '_')}] = {{ /* {how} */")
        for observer in OBSERVERS:
            out.append(f"        [OBSERVER_{observer}DEG] = {{")
            emit_rows(out, tables[name, observer], 360, 10, 10, "            ")
            out.append("        },")
        out.append("    },")
    out += ["};", "/* clang-format on */"]
    return "\n".join(out) + "\n"


def main():
    home = os.path.dirname(os.path.abspath(__file__))
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("folder", nargs="?", default="../shared/figures")
    p.add_argument("--check", action="store_true",
                   help="print the worst difference of each given table; write nothing")
    p.add_argument("--out", default=os.path.join(home, "../../src/colour/cie_tables.c"))
    args = p.parse_args()

    cmf, points = read_cmf(args.folder), read_illuminants(args.folder)
    assert list(cmf) == list(CMF_NM) and sorted(points) == sorted(ILLUMINANTS)
    tables, difference = {}, Fraction(0)
    for name in ILLUMINANTS:
        for observer in OBSERVERS:
            computed = weights(cmf, illuminant_1nm(points[name]), observer)
            if name not in GIVEN:
                tables[name, observer] = [[fixed(x) for x in computed[b]] for b in BANDS]
                continue
            given = read_weights(args.folder, name, observer)
            tables[name, observer] = [[fixed(Fraction(t)) for t in given[b]] for b in BANDS]
            if name in PLANCKIAN:
                exact = weights(cmf, planckian_1nm(), observer)
                tables[name, observer] = [[fixed(x) for x in exact[b]] for b in BANDS]
            d, band, axis = worst(given, computed)
            difference = max(difference, d)
            if args.check:
                print(f"{name:5} {observer:>2} deg  worst {float(d):.9f}  ({axis} at {band} nm)")
    if args.check:
        print(f"all   worst {float(difference):.9f}")
        return 0 if difference <= Fraction(1, 2 * 10**DECIMALS) else 1
    with open(args.out, "w") as f:
        f.write(emit(cmf, points, tables, difference))
    return 0


if __name__ == "__main__":
    sys.exit(main())
