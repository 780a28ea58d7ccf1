"""Kubelka and Munk's two fluxes in skin, by the differential equations themselves.

Reference for src/optics/kubelka_munk; shares no code with it and holds no closed form.
v = (I, J), light going down and up, follows v' = M v in each layer,

    M = ((-(K+S), S), (-S, K+S)),   K = 2 sigma_a,  S = 3/4 sigma_s'.

In the endless dermis only the decaying eigenvector of M is left; it is carried up through
the epidermis by the matrix exponential exp(-M d), and J/I at the top goes through
Saunderson's surface.  Slopes are central differences (forward ones at zero and 1e-300), with steps of
1e-40 of the value in enough digits that 1e-25 is left.  Needs mpmath.

    kubelka_munk.py > kubelka_munk.csv
    kubelka_munk.py --check      the exponential against Runge and Kutta's steps
"""

import random
import sys

from mpmath import mp, mpf, exp, expm, log10, matrix, sqrt

NAMES = ("sigma_a1", "sigma_s1", "sigma_a2", "sigma_s2", "d_mm")
STEP = mpf(10) ** -40


def inside(K, S):
    """M of a layer."""
    return matrix([[-(K + S), S], [-S, K + S]])


def endless(K, S):
    """J/I of the eigenvector of M that decays: (M + g) (1, x) = 0, second row."""
    g = sqrt(K * K + 2 * K * S)
    return S / (K + S + g)


def surface(eta):
    """Specular reflectance outside, diffuse reflectance inside (the fit of docs/physics.md)."""
    if eta >= 1:
        F = mpf("-1.440") / eta**2 + mpf("0.710") / eta + mpf("0.668") + mpf("0.0636") * eta
    else:
        F = mpf("-0.4399") + mpf("0.7099") / eta - mpf("0.3319") / eta**2 + mpf("0.0636") / eta**3
    return ((eta - 1) / (eta + 1)) ** 2, F


def leaving(J, I, eta):
    R, (Rs, Ri) = J / I, surface(eta)
    return (1 - Rs) * (1 - Ri) * R / (1 - Ri * R)


def reflectance(skin, eta):
    a1, s1, a2, s2, d = skin
    bottom = matrix([1, endless(2 * a2, mpf(3) / 4 * s2)])
    top = expm(-d * inside(2 * a1, mpf(3) / 4 * s1), method="taylor") * bottom
    return leaving(top[1], top[0], eta)


def digits(skin):
    """Enough that 60 are left after e^(2 g d) and the differences."""
    a1, s1, d = skin[0], skin[1], skin[4]
    lost = 2 * sqrt(3 * a1 * (a1 + s1)) * d + d * (2 * a1 + s1)
    return 160 + int(lost) + int(2 * abs(log10(mpf("1e-300") + d * (a1 + s1))))


def row(skin, eta):
    """R and its five slopes."""
    mp.dps = 60
    skin, eta = [mpf(x) for x in skin], mpf(eta)
    mp.dps = digits(skin)
    R, slopes = reflectance(skin, eta), []
    for i, x in enumerate(skin):
        h = STEP * x if x > mpf("1e-100") else STEP
        above, below = list(skin), list(skin)
        above[i] = x + h
        below[i] = x - h if x > h else x
        slopes.append((reflectance(above, eta) - reflectance(below, eta)) / (above[i] - below[i]))
    return R, slopes


def cases():
    """Skin; nothing absorbed or next to nothing; layers thin and thick; where the program
    changes its form (2 g d = 1); seeded random media."""
    for d in (0.0, 1e-9, 1e-3, 0.02, 0.08, 0.15, 1.0, 10.0):
        for a1, s1 in ((0.05, 5.0), (0.3, 4.0), (20.0, 14.0)):
            for a2, s2 in ((0.03, 2.5), (5.0, 7.0)):
                yield (a1, s1, a2, s2, d), 1.4
    for tiny in (0.0, 1e-300, 1e-30, 1e-16, 1e-8):
        for d in (0.01, 1.0, 30.0):
            yield (tiny, 5.0, 0.1, 2.5, d), 1.4
            yield (0.2, 5.0, max(tiny, 1e-60), 2.5, d), 1.4
            yield (tiny, 5.0, max(tiny, 1e-60), 2.5, d), 1.4
    for factor in (0.5, 0.99, 0.999999, 1.000001, 1.01, 2.0):
        yield (0.7, 6.0, 0.2, 3.0, factor * 0.5 / (3 * 0.7 * (0.7 * 4 / 3 + 6.0)) ** 0.5), 1.4
    for ratio in (1e-8, 1e-4, 1e4, 1e8):
        for d in (1e-3, 0.3, 3.0):
            yield (1.0, ratio, 0.5, 2.0, min(d, 300 / ratio)), 1.4
            yield (0.5, 2.0, 1.0, ratio, d), 1.4
    for eta in (0.2605, 0.5, 0.9, 1.0, 1.1, 2.0, 3.0, 3.84):
        yield (0.3, 4.0, 0.1, 2.0, 0.1), eta
    rng = random.Random(19310801)
    for _ in range(150):
        a1, s1, a2, s2 = (10 ** rng.uniform(-6, 4) for _ in range(4))
        yield (a1, s1, a2, s2, min(1000.0, 10 ** rng.uniform(-4, 2) / (a1 + s1))), rng.uniform(1, 2)


def check():
    """Fourth-order steps up through an epidermis, against the exponential."""
    mp.dps = 30
    skin, eta, steps = [mpf(x) for x in (0.3, 4.0, 0.1, 2.0, 0.1)], mpf("1.4"), 2000
    a1, s1, a2, s2, d = skin
    v, M, h = matrix([1, endless(2 * a2, mpf(3) / 4 * s2)]), -inside(2 * a1, mpf(3) / 4 * s1), d / steps
    for _ in range(steps):
        k1 = M * v
        k2 = M * (v + h / 2 * k1)
        k3 = M * (v + h / 2 * k2)
        k4 = M * (v + h * k3)
        v = v + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    difference = abs(leaving(v[1], v[0], eta) - reflectance(skin, eta))
    print("exponential against %d steps of fourth order: %s" % (steps, mp.nstr(difference, 2)))
    return 0 if difference < mpf("1e-14") else 1


def main():
    if sys.argv[1:] == ["--check"]:
        return check()
    print("# Kubelka and Munk's two fluxes, epidermis over endless dermis, Saunderson's surface.")
    print("# Made by: tests/reference/kubelka_munk.py > tests/reference/kubelka_munk.csv")
    print(",".join(NAMES + ("eta", "R") + tuple("dR_d" + x for x in NAMES)))
    for skin, eta in cases():
        R, slopes = row(skin, eta)
        print(",".join([repr(x) for x in skin] + [repr(eta)] + [mp.nstr(x, 20) for x in [R] + slopes]))
    return 0


if __name__ == "__main__":
    sys.exit(main())
