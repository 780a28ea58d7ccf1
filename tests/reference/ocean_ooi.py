"""ocean_ooi.py - figures for the pure parts of drivers/ocean_ooi, in exact fractions.

Another way than the C code: a band's value is the integral of (piecewise straight spectrum) x
(triangle) by antiderivatives of the polynomial on every piece, over that of the triangle; no
weights are made.  Linearity and reflectance are plain fractions of integers.

    python3 tests/reference/ocean_ooi.py     0.1 s; prints the rows of tests/drivers/test_ocean_ooi_maths.c
"""

from fractions import Fraction as F


def integral(poly, low, high):
    """Of sum poly[i] x^i from low to high."""
    return sum(c * (high ** (i + 1) - low ** (i + 1)) / (i + 1) for i, c in enumerate(poly))


def product(p, q):
    out = [F(0)] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            out[i + j] += a * b
    return out


def band(nm, value, centre, width=F(10)):
    total = F(0)
    for a, b, va, vb in zip(nm, nm[1:], value, value[1:]):
        slope = (vb - va) / (b - a)
        line = [va - slope * a, slope]
        for low, high, side in ((centre - width, centre, 1), (centre, centre + width, -1)):
            u, v = max(a, low), min(b, high)
            if u < v:
                total += integral(product(line, [1 - side * centre / width, F(side) / width]), u, v)
    return total / width


def linear(raw, level, full_scale, black, n):
    x = min(F(raw) * full_scale / level, F(full_scale)) - black
    return x / sum(c * x ** i for i, c in enumerate(n))


def main():
    print("bands of R = ((nm - 380) / 400)^3 at pixels every `step` nm from `first`")
    for first, step in ((F(380), F(1, 4)), (F(381), F(7, 2)), (F(385), F(13)), (F(371), F(37))):
        nm = [first + step * i for i in range(2000) if first + step * i <= 790]
        value = [((x - 380) / 400) ** 3 for x in nm]
        row = [float(band(nm, value, F(c))) for c in (400, 410, 550, 690, 700)]
        print(f"    {{ {float(first)}, {float(step)}, {{ " + ", ".join(f"{x:.17g}" for x in row) + " } },")

    print("linearity: raw, level, linear (black level 1500 raw, n = 0.97, 1.5e-6, -2e-11, 1e-16)")
    n = [F("0.97"), F("1.5e-6"), F("-2e-11"), F("1e-16")]
    for raw, level in ((1500, 65535), (2000, 65535), (30000, 65535), (65535, 65535), (59999, 60000), (60000, 60000), (65535, 60000)):
        black = F(1500) * 65535 / level
        print(f"    {{ {raw}, {level}, {float(linear(raw, level, 65535, black, n)):.17g} }},")

    print("reflectance: sample, white, dark, rstd, R")
    for s, w, d, rstd in ((20150, 51030, 310, "0.9812"), (310, 51030, 310, "0.9812"), (51030, 51030, 310, "0.9812"), (2433, 2911, 402, "0.9421")):
        print(f"    {{ {s}, {w}, {d}, {rstd}, {float(F(s - d) / (w - d) * F(rstd)):.17g} }},")

    print("substitution: k, rstd, R, as read (from the sphere itself: light as 1 / (1 - a - f R))")
    for f, a, rstd, R in (("0.01", "0.95", "0.98", "0.05"), ("0.01", "0.95", "0.98", "0.5"), ("0.02", "0.93", "0.9", "0.2"), ("0.005", "0.97", "0.99", "0.02")):
        f, a, rstd, R = F(f), F(a), F(rstd), F(R)
        white, sample = rstd / (1 - a - f * rstd), R / (1 - a - f * R)
        print(f"    {{ {float(f / (1 - a)):.17g}, {float(rstd)}, {float(R)}, {float(sample / white * rstd):.17g} }},")


if __name__ == "__main__":
    main()
