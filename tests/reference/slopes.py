#!/usr/bin/env python3
"""Derivatives of the closed-form models by their coefficients and the thickness: the
reference of tests/optics/test_slopes.c.

The textbook solutions, not the forms of src/, in numbers of 500 digits (python3-mpmath):

    half space   R = (1-Rs) mu'/2 (1 + e^(-4/3 A s)) e^(-s),   s = sqrt(3 sigma_a/sigma_t')
    two layers   R = (1-Rs) alpha {sigma_s1' [(1 - e^(-(sigma_t1'+k1) d))/(sigma_t1'+k1)
                     + rho t^2 d E((k1-sigma_t1') d)] + sigma_s2' T t (1+rho)/(sigma_t2'+k2)}

(docs/physics.md), and their central differences, forward ones where an input is 0.  Beside
each derivative stands how far its inputs move it: the sum of |x d/dx| of it over the inputs,
so that one ulp of each of them may change it by that many ulp of 1.  Every derivative is computed with two steps and has to come out
the same to 25 digits.

    slopes.py half-space > tests/reference/slopes_half_space.csv
    slopes.py two-layer > tests/reference/slopes_two_layer.csv
    slopes.py skins > tests/reference/slopes_skins.csv

Inputs are doubles, printed so that they read back as the same doubles; derivatives have 20
digits.  `-inf` is the derivative by an absorption that is 0 where R falls as its root.
"""

import math
import random
import re
import sys

import mpmath
from mpmath import mp, mpf

mp.dps = 500
SEED = 20260101
STEP = mpf(10) ** -40


def internal_reflection(eta):
    if eta >= 1:
        F = mpf("-1.440") / eta**2 + mpf("0.710") / eta + mpf("0.668") + mpf("0.0636") * eta
    else:
        F = mpf("-0.4399") + mpf("0.7099") / eta - mpf("0.3319") / eta**2
        F += mpf("0.0636") / eta**3
    return (1 + F) / (1 - F)


def half_space(sigma_a, sigma_s, eta):
    A = internal_reflection(eta)
    s = mpmath.sqrt(3 * sigma_a / (sigma_a + sigma_s))
    mu = sigma_s / (sigma_a + sigma_s)
    both = mpmath.exp(-s) + mpmath.exp(-(1 + 4 * A / 3) * s)
    return (1 - ((eta - 1) / (eta + 1)) ** 2) * mu / 2 * both


def two_layer(sigma_a1, sigma_s1, sigma_a2, sigma_s2, d, eta):
    A = internal_reflection(eta)
    st1, st2 = sigma_a1 + sigma_s1, sigma_a2 + sigma_s2
    k1, k2 = mpmath.sqrt(3 * sigma_a1 * st1), mpmath.sqrt(3 * sigma_a2 * st2)
    u1, u2 = k1 / (3 * st1), k2 / (3 * st2)
    rho = (u1 - u2) / (u1 + u2) if u1 + u2 > 0 else mpf(0)
    T, t = mpmath.exp(-st1 * d), mpmath.exp(-k1 * d)
    z = (k1 - st1) * d
    E = (mpmath.exp(z) - 1) / z if z != 0 else mpf(1)
    direct = (1 - T * t) / (st1 + k1) + rho * t * t * d * E
    inside = sigma_s1 * direct + sigma_s2 * T * t * (1 + rho) / (st2 + k2)
    lost = 1 + 2 * A * u1 + rho * t * t * (1 - 2 * A * u1)
    if lost == 0:  # nothing absorbs in the epidermis: 0/0; a little does
        return two_layer(mpf(10) ** -200, sigma_s1, sigma_a2, sigma_s2, d, eta)
    return (1 - ((eta - 1) / (eta + 1)) ** 2) * inside / lost


def derivative(f, at, i, step=STEP):
    """Central; forward by three points where the input is 0."""

    def moved(by):
        return f(*(x + by if k == i else x for k, x in enumerate(at)))

    if at[i] == 0:
        return (4 * moved(step) - moved(2 * step) - 3 * moved(mpf(0))) / (2 * step)
    h = at[i] * step
    return (moved(h) - moved(-h)) / (2 * h)


def checked(f, at, i):
    """The derivative; 0 where that is all that is left of it but rounding."""
    first, second = derivative(f, at, i), derivative(f, at, i, STEP * 1000)
    if abs(first - second) <= mpf(10) ** -25 * abs(first):
        return first
    if abs(first * (at[i] or 1)) < mpf(10) ** -300 * f(*at):
        return mpf(0)
    raise ArithmeticError(f"{at} by input {i}: {first} against {second}")


def moved_by(f, at, i):
    """Sum of |x d/dx| of the derivative by input i: what relative errors of the inputs, all of
    them 1, would change it by."""
    slope = lambda *inputs: derivative(f, inputs, i, STEP / 1000)
    return sum(
        abs(x * derivative(slope, at, k, mpf(10) ** -25)) for k, x in enumerate(at) if x != 0
    )


def write_row(f, row, by, infinite):
    """`infinite`: the inputs among `by` of which R falls as the root where they are 0."""
    at = [mpf(x) for x in row]
    cells = [repr(x) for x in row]
    moved = []
    for i in by:
        if i in infinite and at[i] == 0:
            cells.append("-inf")
            moved.append("0")
            continue
        cells.append(mpmath.nstr(checked(f, at, i), 20, min_fixed=0, max_fixed=0))
        moved.append(mpmath.nstr(moved_by(f, at, i), 4, min_fixed=0, max_fixed=0))
    print(",".join(cells + moved))


def beside(x):
    yield x
    yield math.nextafter(x, math.inf)
    yield math.nextafter(x, 0.0)
    for step in (1e-13, 1e-9, 1e-6, 1e-3):
        yield x * (1 + step)
        yield x * (1 - step)


ABSORPTIONS = [0.0, 1e-100, 1e-30] + [float(f"1e{e}") for e in range(-12, 13, 2)]
SCATTERINGS = [float(f"1e{e}") for e in range(-6, 7, 2)]


def half_space_inputs():
    for sigma_a in ABSORPTIONS:
        for sigma_s in SCATTERINGS:
            yield sigma_a, sigma_s, 1.4
    for sigma_a in beside(1.5):
        yield sigma_a, 3.0, 1.4
    for eta in (0.27, 0.7, 1.0, 1.33, 1.5, 2.5, 3.8):
        for sigma_a in (1e-9, 0.03, 2.0, 1e4):
            yield sigma_a, 5.0, eta
    rng = random.Random(SEED)
    for _ in range(100):
        yield 10 ** rng.uniform(-12, 12), 10 ** rng.uniform(-6, 6), rng.uniform(0.3, 3.7)


def two_layer_inputs():
    for sigma_a1 in (0.03, 0.5, 3.0, 30.0):
        for sigma_a2 in (0.03, 0.3, 8.0):
            for sigma_s1 in (4.3, 14.5, 40.0):
                for d in (0.02, 0.06, 0.15):
                    yield sigma_a1, sigma_s1, sigma_a2, sigma_s1 / 2, d, 1.4
    # Reduced albedo 2/3 in the epidermis, in the dermis, in both.
    for sigma_a in beside(1.5):
        yield sigma_a, 3.0, 0.2, 1.5, 0.1, 1.4
        yield 0.2, 3.0, sigma_a, 3.0, 0.1, 1.4
        yield sigma_a, 3.0, sigma_a, 3.5, 0.1, 1.4
    for sigma_a in beside(0.375):
        yield sigma_a, 0.75, 2.0, 4.0, 3.0, 1.4
    # From no absorption at all to nothing else, in either layer.
    for sigma_a in ABSORPTIONS:
        for d in (0.0, 1e-6, 0.08, 10.0):
            yield sigma_a, 5.0, 0.1, 2.5, d, 1.4
            yield 0.1, 5.0, sigma_a, 2.5, d, 1.4
            yield sigma_a, 5.0, sigma_a, 2.5, d, 1.4
            yield sigma_a, 1e-6, 0.1, 2.5, d, 1.4
            yield sigma_a, 1e6, 0.1, 2.5, d, 1.4
            yield sigma_a, 1e6, sigma_a, 1e-6, d, 1.4
    # Thickness in mean free paths and in diffusion lengths: where a form may change.
    for y in (1e-8, 1e-4, 0.01, 0.1, 0.2499, 0.25, 0.2501, 0.5, 1.0, 4.0, 30.0):
        for x in (1e-6, 1e-3, 0.1, 0.5, 0.9999, 1.0, 1.0001, 2.0, 30.0, 1e3):
            absorbed = (y / x) ** 2 / 3
            if absorbed < 1:
                yield absorbed * x, (1 - absorbed) * x, 0.5, 2.0, 1.0, 1.4
                yield absorbed * x, (1 - absorbed) * x, 1e-5, 2.0, 1.0, 1.4
    for eta in (0.27, 0.7, 1.0, 1.33, 1.5, 2.5, 3.8):
        for sigma_a in (1e-9, 0.03, 2.0, 1e4):
            yield sigma_a, 5.0, 0.1, 2.5, 0.08, eta
    rng = random.Random(SEED)
    for _ in range(150):
        yield (
            *(10 ** rng.uniform(-8, 4), 10 ** rng.uniform(-3, 4)),
            *(10 ** rng.uniform(-8, 4), 10 ** rng.uniform(-3, 4)),
            *(10 ** rng.uniform(-4, 1), rng.uniform(0.3, 3.7)),
        )


# ---- skins: Eqs. 1-6 at a few bands ---------------------------------------------------------


def haemoglobin(nm):
    """Oxy and deoxy of whole blood, mm^-1, at a wavelength of the table in src/."""
    row = re.compile(r"\{ ([0-9.]+), ([0-9.]+) \}, /\* (\d+) nm \*/")
    with open("src/optics/haemoglobin_table.c", encoding="ascii") as f:
        for match in map(row.search, f):
            if match and int(match[3]) == nm:
                return [mpf("2.303") * mpf(x) * 150 / 64500 / 10 for x in match.groups()[:2]]
    raise LookupError(nm)


def skin(model, nm):
    """R of (Cm, Bm, Ch, gamma, d, a, b) at index 1.4; Eq. 6 where a is 0."""
    l, (oxy, deoxy) = mpf(nm), haemoglobin(nm)
    pheomelanin = mpf("2.9e14") * l ** mpf("-4.75")
    eumelanin = mpf("6.6e10") * l ** mpf("-3.33")
    base = mpf("0.0244") + mpf("8.53") * mpmath.exp(-(l - 154) / mpf("66.2"))
    eta = mpf(1.4)  # the double

    def reflectance(Cm, Bm, Ch, gamma, d, a, b):
        epidermis = Cm * (Bm * eumelanin + (1 - Bm) * pheomelanin) + (1 - Cm) * base
        dermis = Ch * (gamma * oxy + (1 - gamma) * deoxy) + (1 - Ch) * base
        s1 = s2 = a * (l / 500) ** -b
        if a == 0:
            s1 = mpf("14.74") * l ** mpf("-0.22") + mpf("2.2e11") / l**4
            s2 = s1 / 2
        if model == "half-space":
            return half_space(epidermis + dermis, s1, eta)
        return two_layer(epidermis, s1, dermis, s2, d, eta)

    return reflectance


def skin_rows():
    skins = [
        (0.005, 0.5, 0.001, 0.75, 0.08, 0.0, 0.0),
        (0.03, 0.7, 0.01, 0.75, 0.08, 0.0, 0.0),
        (0.3, 0.0, 0.1, 0.6, 0.1, 0.0, 0.0),
        (0.1, 1.0, 0.05, 0.0, 0.03, 0.0, 0.0),
        (0.02, 0.0, 0.012, 0.62, 0.08, 9.7, 1.47),
        (0.004, 0.3, 0.003, 0.9, 0.06, 20.0, 0.4),
        (0.2, 0.8, 0.02, 0.5, 0.12, 5.5, -0.3),
    ]
    for model in ("half-space", "two-layer"):
        for nm in (400, 440, 560, 700):
            for row in skins:
                yield model, nm, row


def write_skins():
    print("# Derivatives of R by a skin's parameters, made by tests/reference/slopes.py: do not edit.")
    names = ["Cm", "Bm", "Ch", "gamma", "epidermis_mm", "scattering_a", "scattering_b"]
    print(",".join(["two_layer", "nm"] + names + ["R"] + ["by_" + n for n in names]))
    for model, nm, row in skin_rows():
        f, at = skin(model, nm), [mpf(x) for x in row]
        by = [
            mpf(0) if (i > 4 and at[5] == 0) or (i == 4 and model == "half-space") else checked(f, at, i)
            for i in range(7)
        ]
        cells = [mpmath.nstr(x, 20, min_fixed=0, max_fixed=0) for x in [f(*at)] + by]
        print(",".join([str(int(model == "two-layer")), str(nm)] + [repr(x) for x in row] + cells))


def main():
    head = "made by tests/reference/slopes.py: do not edit."
    if sys.argv[1:] == ["half-space"]:
        print(f"# Derivatives of the half space's R, {head}")
        print("sigma_a,sigma_s,eta,by_sigma_a,by_sigma_s,moved_sigma_a,moved_sigma_s")
        for row in half_space_inputs():
            write_row(half_space, row, (0, 1), (0,))
    elif sys.argv[1:] == ["two-layer"]:
        print(f"# Derivatives of two-layer diffusion's R, {head}")
        names = ["sigma_a1", "sigma_s1", "sigma_a2", "sigma_s2", "d_mm"]
        by, moved = ["by_" + n for n in names], ["moved_" + n for n in names]
        print(",".join(names + ["eta"] + by + moved))
        for row in two_layer_inputs():
            write_row(two_layer, row, range(5), (2,))
    elif sys.argv[1:] == ["skins"]:
        write_skins()
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
