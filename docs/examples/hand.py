#!/usr/bin/env python3
"""hand.py - a synthetic hand as a hyperspectral cube: hand.hdr and hand.img in the folder named.

    python3 docs/examples/hand.py FOLDER && skinspec map FOLDER/hand.hdr --specular sce --noise 0.004

The skins are skinspec's own (two-layer, Bm 0.6): melanin with a tan, freckles and a mole, blood with
warm fingertips and a scratch; 300 x 300 pixels of 31 bands, uint16, and noise.  It shows what the
maps look like, not how right they are."""

import array
import math
import os
import random
import subprocess
import sys

SKINSPEC = os.environ.get("SKINSPEC", "build/skinspec")
SIDE = 300
BANDS = list(range(400, 701, 10))
CM = [0.01 * 2 ** (i / 2) for i in range(12)]
CH = [0.004 * 2 ** (i / 2) for i in range(10)]
FINGERS = [  # from, to, radius, in parts of the side
    (0.36, 0.60, 0.20, 0.22, 0.045),
    (0.45, 0.55, 0.38, 0.10, 0.048),
    (0.55, 0.55, 0.55, 0.08, 0.048),
    (0.64, 0.58, 0.71, 0.16, 0.043),
    (0.62, 0.80, 0.88, 0.48, 0.055),
]


def spectrum(Cm, Ch):
    text = subprocess.run(
        [SKINSPEC, "reflectance", "--cm", str(Cm), "--bm", "0.6", "--ch", str(Ch), "--bands",
         "400:700:10"], check=True, stdout=subprocess.PIPE, text=True,
    ).stdout  # fmt: skip
    return [float(x) for x in text.splitlines()[1].split(",")[6:]]


def place(axis, x):
    """Of a value on an axis that doubles every two steps: step, and the part of the next."""
    at = min(max(2 * math.log2(x / axis[0]), 0.0), len(axis) - 1.001)
    return int(at), at - int(at)


def between(table, Cm, Ch):
    """The spectrum between four of the table's."""
    (i, u), (j, v) = place(CM, Cm), place(CH, Ch)
    corners = ((i, j, (1 - u) * (1 - v)), (i + 1, j, u * (1 - v)), (i, j + 1, (1 - u) * v),
               (i + 1, j + 1, u * v))  # fmt: skip
    return [sum(w * table[a][b][k] for a, b, w in corners) for k in range(len(BANDS))]


def to_segment(x, y, x1, y1, x2, y2):
    """Distance to a segment, and how far along it."""
    dx, dy = x2 - x1, y2 - y1
    t = min(max(((x - x1) * dx + (y - y1) * dy) / (dx * dx + dy * dy), 0.0), 1.0)
    return math.hypot(x - x1 - t * dx, y - y1 - t * dy), t


def skin_at(x, y, freckles):
    """Cm and Ch at a place of the picture; None beside the hand."""
    tip = 0.0
    inside = ((x - 0.52) / 0.21) ** 4 + ((y - 0.76) / 0.22) ** 4 < 1 or (0.38 < x < 0.66 and y > 0.9)
    for x1, y1, x2, y2, radius in FINGERS:
        distance, along = to_segment(x, y, x1, y1, x2, y2)
        if distance < radius:
            inside, tip = True, max(tip, along**4)
    if not inside:
        return None
    tan = 0.03 * (1 + 0.8 / (1 + math.exp(-(y - 0.82) / 0.015)))  # up to where the sleeve was
    Cm, Ch = tan * (1 - 0.3 * tip), 0.012 * (1 + 1.2 * tip)
    for fx, fy, radius in freckles:
        Cm *= 1 + 0.7 * math.exp(-((x - fx) ** 2 + (y - fy) ** 2) / radius**2)
    mole = math.hypot((x - 0.45) / 0.030, (y - 0.72) / 0.024)
    Cm += 0.22 / (1 + math.exp(10 * (mole - 1)))
    scratch, _ = to_segment(x, y, 0.53, 0.66, 0.66, 0.80)
    Ch += 0.05 * math.exp(-((scratch / 0.008) ** 2))
    return Cm, Ch


def main():
    folder = sys.argv[1]
    rng = random.Random(5)
    table = [[spectrum(Cm, Ch) for Ch in CH] for Cm in CM]
    freckles = [(rng.uniform(0.35, 0.7), rng.uniform(0.55, 0.9), rng.uniform(0.004, 0.009))
                for _ in range(40)]  # fmt: skip
    values = array.array("H")
    for line in range(SIDE):
        row = [skin_at((i + 0.5) / SIDE, (line + 0.5) / SIDE, freckles) for i in range(SIDE)]
        spectra = [None if skin is None else between(table, *skin) for skin in row]
        for k in range(len(BANDS)):
            values.extend(
                0 if s is None else round(10000 * max(s[k] + rng.gauss(0, 0.004), 1e-4))
                for s in spectra
            )
    if sys.byteorder == "big":
        values.byteswap()
    with open(os.path.join(folder, "hand.img"), "wb") as file:
        values.tofile(file)
    with open(os.path.join(folder, "hand.hdr"), "w", encoding="ascii") as file:
        file.write(
            "ENVI\ndescription = {a synthetic hand, docs/examples/hand.py}\n"
            f"samples = {SIDE}\nlines = {SIDE}\nbands = {len(BANDS)}\nheader offset = 0\n"
            "file type = ENVI Standard\ndata type = 12\ninterleave = bil\nbyte order = 0\n"
            "wavelength units = Nanometers\nreflectance scale factor = 10000\n"
            f"data ignore value = 0\nwavelength = {{{', '.join(map(str, BANDS))}}}\n"
        )


if __name__ == "__main__":
    main()
