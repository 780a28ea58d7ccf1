#!/usr/bin/env python3
"""Synthetic skins to invert, and how well anybody could: written from the equations, sharing
no code with src/ but the haemoglobin table's data.  Python's standard library only.

    inversion.py --bound 4000 > tests/reference/inversion.csv      skins and their Cramer-Rao bounds
    inversion.py --spectra MODEL N [--seed S] [--white W] [--placement P]
                 [--set NAME=X ...] [--fixed CM,BM,CH]             noisy spectra on standard output
    inversion.py --check                                           the forward models against tables

Skins: Cm log-uniform 0.005..0.2, Bm uniform, Ch log-uniform 0.001..0.1; 400..700 nm by 10.
Noise: W per band; a level of P and a slope of 0.4 P (straight in wavelength, mean square 1).
NAME for --set: SO2, epidermis_mm, dermis (scattering there, in units of Eq. 6).

Half space: Eq. 9 on the summed absorption.  Two layers: particular and homogeneous solutions of
the diffusion equation, their constants from the 3x3 system of its conditions.  Derivatives by a
complex step of 1e-30, so that they are exact to rounding.
"""

import argparse
import cmath
import csv
import math
import os
import random
import re
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
BANDS = range(400, 701, 10)
WHITE = 0.003
SLOPE_RATIO = 0.4


def read_haemoglobin():
    """nm -> (oxy, deoxy), cm^-1/M: the project's transcription of Prahl's table is data."""
    row = re.compile(r"\{ (\S+), (\S+) \}, /\* (\S+) nm")
    with open(os.path.join(HERE, "../../src/optics/haemoglobin_table.c"), encoding="utf-8") as f:
        found = [row.search(line) for line in f]
    return {float(m[3]): (float(m[1]), float(m[2])) for m in found if m}


HAEMOGLOBIN = read_haemoglobin()
ETA = 1.4
F_DR = -1.440 / ETA**2 + 0.710 / ETA + 0.668 + 0.0636 * ETA
A = (1 + F_DR) / (1 - F_DR)
ENTERING = 1 - ((ETA - 1) / (ETA + 1)) ** 2


def coefficients(nm, skin, setting):
    """sigma_a and sigma_s' of epidermis and dermis; skin is (Cm, Bm, Ch), perhaps complex."""
    Cm, Bm, Ch = skin
    blood = 2.303 * 150.0 / 64500.0 / 10.0
    oxy, deoxy = (blood * x for x in HAEMOGLOBIN[float(nm)])
    base = 0.0244 + 8.53 * math.exp(-(nm - 154.0) / 66.2)
    melanin = Bm * 6.6e10 * nm**-3.33 + (1 - Bm) * 2.9e14 * nm**-4.75
    red = setting["SO2"]
    epidermis = Cm * melanin + (1 - Cm) * base
    dermis = Ch * (red * oxy + (1 - red) * deoxy) + (1 - Ch) * base
    scattering = 14.74 * nm**-0.22 + 2.2e11 * nm**-4.0
    return epidermis, scattering, dermis, setting["dermis"] * scattering


def half_space(nm, skin, setting):
    """Eq. 9 per incident light, on the absorption of both layers together."""
    epidermis, scattering, dermis, _ = coefficients(nm, skin, setting)
    absorbed = (epidermis + dermis) / (epidermis + dermis + scattering)
    s = cmath.sqrt(3 * absorbed)
    return ENTERING * (1 - absorbed) / 2 * (1 + cmath.exp(-4 / 3 * A * s)) * cmath.exp(-s)


def determinant(a, b, c):
    """Of the matrix whose columns are a, b, c."""
    return (a[0] * (b[1] * c[2] - b[2] * c[1]) - b[0] * (a[1] * c[2] - a[2] * c[1])
            + c[0] * (a[1] * b[2] - a[2] * b[1]))  # fmt: skip


def two_layers(sigma_a1, sigma_s1, sigma_a2, sigma_s2, d):
    """phi = p e^-tau + homogeneous solutions in each layer; R = (1-Rs) phi(0)/(2A)."""
    sigma_t1, sigma_t2 = sigma_a1 + sigma_s1, sigma_a2 + sigma_s2
    D1, D2 = 1 / (3 * sigma_t1), 1 / (3 * sigma_t2)
    k1, k2 = cmath.sqrt(3 * sigma_a1 * sigma_t1), cmath.sqrt(3 * sigma_a2 * sigma_t2)
    p1, p2 = sigma_s1 / (sigma_a1 - sigma_t1 / 3), sigma_s2 / (sigma_a2 - sigma_t2 / 3)
    through, back = cmath.exp(-sigma_t1 * d), cmath.exp(-k1 * d)
    # phi1 = p1 e^(-sigma_t1 z) + a e^(-k1 z) + b e^(-k1 (d-z)); phi2 with c e^(-k2 (z-d)).
    first = (1 + 2 * A * D1 * k1, back, D1 * k1 * back)
    second = ((1 - 2 * A * D1 * k1) * back, 1, -D1 * k1)
    third = (0, -1, -D2 * k2)
    right = (-p1 * (1 + 2 * A * D1 * sigma_t1), (p2 - p1) * through, (p2 - p1) * through / 3)
    # Third row: the flux -D phi', of which p e^-tau gives p/3.
    whole = determinant(first, second, third)
    a = determinant(right, second, third) / whole
    b = determinant(first, right, third) / whole
    return ENTERING * (p1 + a + b * back) / (2 * A)


def two_layer(nm, skin, setting):
    """Epidermis over dermis."""
    return two_layers(*coefficients(nm, skin, setting), setting["epidermis_mm"])


MODELS = {"half-space": half_space, "two-layer": two_layer}
SETTING = {"SO2": 0.75, "epidermis_mm": 0.08, "dermis": 0.5}


def spectrum(model, skin, setting):
    """Reflectance at the bands."""
    return [MODELS[model](nm, skin, setting).real for nm in BANDS]


def jacobian(model, skin):
    """dR/d(Cm, Bm, Ch), one row for each band."""
    step = 1e-30
    moved = [[x + (1j * step if i == j else 0) for i, x in enumerate(skin)] for j in range(3)]
    return [[MODELS[model](nm, other, SETTING).imag / step for other in moved] for nm in BANDS]


def bound(model, skin, white=WHITE):
    """Standard deviations that no unbiased estimator goes below: the root of the diagonal of the
    inverse of J^T J / white^2."""
    J = jacobian(model, skin)
    M = [[sum(row[i] * row[j] for row in J) / white**2 for j in range(3)] for i in range(3)]
    whole = determinant(*M)
    sd = []
    for i in range(3):
        j, k = [x for x in range(3) if x != i]
        sd.append(math.sqrt((M[j][j] * M[k][k] - M[j][k] ** 2) / whole))
    return sd


def draw_skin(rng):
    """Six digits, so that the table says exactly what was computed with."""
    values = (0.005 * 40 ** rng.random(), rng.random(), 0.001 * 100 ** rng.random())
    return tuple(float(f"{x:.6g}") for x in values)


def write_bounds(count):
    """Skins and both models' bounds."""
    rng = random.Random(20261122)
    print("# Made by tests/reference/inversion.py --bound: do not edit.  White noise 0.003.")
    print("Cm,Bm,Ch," + ",".join(f"{m}_{p}" for m in MODELS for p in ("Cm", "Bm", "Ch")))
    for _ in range(count):
        skin = draw_skin(rng)
        bounds = bound("half-space", skin) + bound("two-layer", skin)
        print(",".join([f"{x:.6g}" for x in skin] + [f"{x:.5g}" for x in bounds]))


def placement(rng, size):
    """What one setting down of the probe adds to each band."""
    level, slope = rng.gauss(0.0, size), rng.gauss(0.0, SLOPE_RATIO * size)
    return [level + slope * math.sqrt(3.0) * (nm - 550.0) / 150.0 for nm in BANDS]


def write_spectra(options):
    """Noisy spectra with the truth beside them."""
    rng = random.Random(options.seed)
    setting = dict(SETTING)
    for name, _, value in (item.partition("=") for item in options.set):
        if name not in setting:
            sys.exit(f"inversion.py: --set takes {', '.join(setting)}; not '{name}'")
        setting[name] = float(value)
    skins = skins_of(options.skins) if options.skins else None
    print(f"# Made by tests/reference/inversion.py {' '.join(sys.argv[1:])}: do not edit.")
    print("Cm,Bm,Ch," + ",".join(str(nm) for nm in BANDS))
    for i in range(options.count):
        skin = skins[i % len(skins)] if skins else draw_skin(rng)
        stray = placement(rng, options.placement)
        values = [R + x + rng.gauss(0.0, options.white)
                  for R, x in zip(spectrum(options.spectra, skin, setting), stray)]  # fmt: skip
        print(",".join([f"{x:.6g}" for x in skin] + [f"{x:.{options.digits}g}" for x in values]))


def skins_of(path):
    """The first three columns of a table."""
    with open(path, encoding="utf-8") as f:
        rows = csv.DictReader(line for line in f if not line.startswith("#"))
        return [tuple(float(row[name]) for name in ("Cm", "Bm", "Ch")) for row in rows]


def check():
    """Both forward models against the tables of high precision."""
    worst = 0.0
    with open(os.path.join(HERE, "two_layer.csv"), encoding="utf-8") as f:
        for row in csv.DictReader(line for line in f if not line.startswith("#")):
            x = {name: float(value) for name, value in row.items()}
            skin_like = (0.01 < x["d_mm"] < 1 and x["eta"] == 1.4 and x["sigma_a1"] > 1e-3
                         and x["sigma_a1"] < 40 and x["sigma_a2"] > 1e-3 and x["sigma_s1"] > 1
                         and x["sigma_s1"] < 40 and x["sigma_s2"] > 1 and x["sigma_a2"] < 40
                         and abs(3 * x["sigma_a1"] / (x["sigma_a1"] + x["sigma_s1"]) - 1) > 1e-3
                         and abs(3 * x["sigma_a2"] / (x["sigma_a2"] + x["sigma_s2"]) - 1) > 1e-3)  # fmt: skip
            if skin_like:
                R = two_layers(x["sigma_a1"], x["sigma_s1"], x["sigma_a2"], x["sigma_s2"],
                               x["d_mm"]).real  # fmt: skip
                worst = max(worst, abs(R - x["R"]))
    print(f"two layers against two_layer.csv, media like skin: worst {worst:.1e}")
    skin, h = (0.03, 0.7, 0.02), 1e-6
    worst_slope = 0.0
    for model in MODELS:
        exact = jacobian(model, skin)
        for j in range(3):
            up = [x + (h * x if i == j else 0) for i, x in enumerate(skin)]
            down = [x - (h * x if i == j else 0) for i, x in enumerate(skin)]
            for row, a, b in zip(exact, spectrum(model, up, SETTING), spectrum(model, down, SETTING)):
                worst_slope = max(worst_slope, abs((a - b) / (2 * h * skin[j]) - row[j]))
    print(f"complex steps against differences: worst {worst_slope:.1e}")
    return 0 if worst < 1e-9 and worst_slope < 1e-6 else 1


def main():
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--bound", type=int, metavar="N")
    what.add_argument("--spectra", choices=sorted(MODELS))
    what.add_argument("--check", action="store_true")
    parser.add_argument("count", type=int, nargs="?", default=1000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--white", type=float, default=WHITE)
    parser.add_argument("--placement", type=float, default=0.0)
    parser.add_argument("--digits", type=int, default=7)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=X")
    parser.add_argument("--skins", metavar="CSV", help="the skins of a table, over and over")
    options = parser.parse_args()
    if options.check:
        return check()
    if options.bound is not None:
        write_bounds(options.bound)
    else:
        write_spectra(options)
    return 0


if __name__ == "__main__":
    sys.exit(main())
