#!/usr/bin/env python3
"""Two-layer diffusion solved as a boundary-value problem: the reference of
tests/optics/test_two_layer.c.

    -D phi'' + sigma_a phi = sigma_s' e^(-tau(z)),   tau = integral of sigma_t' from 0,
    D = 1/(3 sigma_t') in each layer;   phi(0) = 2 A D phi'(0);
    phi and D phi' continuous at z = d;   phi bounded as z grows;
    R = (1-Rs) phi(0)/(2A)

In each layer phi is a particular solution p e^(-tau) plus homogeneous ones; the
three free constants come from the 3x3 system of the three conditions.  No closed
form of the reflectance is used, and no code of src/.

p = sigma_s'/(sigma_a - sigma_t'/3) does not exist where 3 sigma_a = sigma_t'.
There sigma_a is changed by 1e-50 of itself: R moves by as much, p becomes 1e50,
and 200 digits leave enough.  Every row is solved a second time with 300 digits
and has to come out the same.

    two_layer.py > tests/reference/two_layer.csv     the table
    two_layer.py --check                             solutions put back into the equation

Inputs are doubles, printed so that they read back as the same doubles.
"""

import math
import random
import sys
from decimal import Decimal, localcontext

SEED = 20140301
NUDGE = Decimal("1e-50")


def internal_reflection(eta):
    """Eq. 8: A from the fit of the diffuse Fresnel reflectance."""
    if eta >= 1:
        F = Decimal("-1.440") / eta**2 + Decimal("0.710") / eta + Decimal("0.668")
        F += Decimal("0.0636") * eta
    else:
        F = Decimal("-0.4399") + Decimal("0.7099") / eta - Decimal("0.3319") / eta**2
        F += Decimal("0.0636") / eta**3
    return (1 + F) / (1 - F)


class Layer:
    """A layer's coefficients; p of its particular solution p e^(-sigma_t' z)."""

    def __init__(self, sigma_a, sigma_s_prime):
        sigma_t = sigma_a + sigma_s_prime
        if abs(3 * sigma_a - sigma_t) < Decimal("1e-30") * sigma_t:
            sigma_a *= 1 + NUDGE
            sigma_t = sigma_a + sigma_s_prime
        self.sigma_a, self.sigma_s, self.sigma_t = sigma_a, sigma_s_prime, sigma_t
        self.D = 1 / (3 * sigma_t)
        self.k = (3 * sigma_a * sigma_t).sqrt()
        self.p = sigma_s_prime / (sigma_a - sigma_t / 3)


def epidermis_basis(k, d):
    """Two homogeneous solutions as functions z -> (value, derivative).

    Thin: cosh kz and sinh kz / k, which become 1 and z for k = 0.  Thick: decaying
    from either face, so that both stay within 0..1."""
    if k * d > 1:
        return (
            lambda z: ((-k * z).exp(), -k * (-k * z).exp()),
            lambda z: ((-k * (d - z)).exp(), k * (-k * (d - z)).exp()),
        )

    def even(z):
        up, down = (k * z).exp(), (-k * z).exp()
        return (up + down) / 2, k * (up - down) / 2

    def odd(z):
        up, down = (k * z).exp(), (-k * z).exp()
        return ((up - down) / (2 * k) if k * z > 0 else z), (up + down) / 2

    return even, odd


def solve(matrix, right):
    """Gauss elimination, rows scaled and exchanged."""
    n = len(right)
    rows = [list(r) + [b] for r, b in zip(matrix, right)]
    for row in rows:
        scale = max(abs(x) for x in row[:n])
        row[:] = [x / scale for x in row]
    for i in range(n):
        best = max(range(i, n), key=lambda j: abs(rows[j][i]))
        rows[i], rows[best] = rows[best], rows[i]
        for j in range(i + 1, n):
            factor = rows[j][i] / rows[i][i]
            rows[j] = [x - factor * y for x, y in zip(rows[j], rows[i])]
    answer = [Decimal(0)] * n
    for i in reversed(range(n)):
        rest = sum(rows[i][j] * answer[j] for j in range(i + 1, n))
        answer[i] = (rows[i][n] - rest) / rows[i][i]
    return answer


class Solution:
    def __init__(self, sigma_a1, sigma_s1, sigma_a2, sigma_s2, d, eta):
        self.epi, self.der = epi, der = Layer(sigma_a1, sigma_s1), Layer(sigma_a2, sigma_s2)
        self.d, self.eta, self.A = d, eta, internal_reflection(eta)
        self.basis = first, second = epidermis_basis(epi.k, d)
        T = (-epi.sigma_t * d).exp()  # source left at the junction
        (f0, f0_slope), (g0, g0_slope) = first(Decimal(0)), second(Decimal(0))
        (fd, fd_slope), (gd, gd_slope) = first(d), second(d)
        lost = 2 * self.A * epi.D
        matrix = [
            [f0 - lost * f0_slope, g0 - lost * g0_slope, Decimal(0)],
            [fd, gd, Decimal(-1)],
            [epi.D * fd_slope, epi.D * gd_slope, der.D * der.k],
        ]
        right = [
            -epi.p * (1 + lost * epi.sigma_t),
            (der.p - epi.p) * T,
            (epi.D * epi.p * epi.sigma_t - der.D * der.p * der.sigma_t) * T,
        ]
        self.T = T
        self.a, self.b, self.c = solve(matrix, right)

    def epidermis(self, z):
        """phi and phi' at 0 <= z <= d."""
        (f, f_slope), (g, g_slope) = self.basis[0](z), self.basis[1](z)
        source = (-self.epi.sigma_t * z).exp()
        value = self.epi.p * source + self.a * f + self.b * g
        return value, -self.epi.sigma_t * self.epi.p * source + self.a * f_slope + self.b * g_slope

    def dermis(self, z):
        """phi and phi' at z >= d."""
        source = self.T * (-self.der.sigma_t * (z - self.d)).exp()
        fading = (-self.der.k * (z - self.d)).exp()
        value = self.der.p * source + self.c * fading
        return value, -self.der.sigma_t * self.der.p * source - self.der.k * self.c * fading

    def reflectance(self):
        Rs = ((self.eta - 1) / (self.eta + 1)) ** 2
        return (1 - Rs) * self.epidermis(Decimal(0))[0] / (2 * self.A)


def reflectance(row):
    """R to 25 digits at least; the same with more digits, or an exception."""
    answers = []
    for digits in (200, 300):
        with localcontext() as context:
            context.prec = digits
            answers.append(Solution(*(Decimal(x) for x in row)).reflectance())
    if abs(answers[0] - answers[1]) > Decimal("1e-25") * answers[1]:
        raise ArithmeticError(f"{row}: {answers[0]:.30e} against {answers[1]:.30e}")
    return answers[1]


def beside(x):
    """x, its neighbours among the doubles, and farther ones."""
    yield x
    yield math.nextafter(x, math.inf)
    yield math.nextafter(x, 0.0)
    for step in (1e-13, 1e-9, 1e-6, 1e-3):
        yield x * (1 + step)
        yield x * (1 - step)


def inputs():
    """(sigma_a1, sigma_s1, sigma_a2, sigma_s2, d_mm, eta), every one a double."""
    skin = [
        (sigma_a1, sigma_s1, sigma_a2, sigma_s1 / 2, d, 1.4)
        for sigma_a1 in (0.04, 0.5, 3.0, 30.0)
        for sigma_a2 in (0.03, 0.3, 8.0)
        for sigma_s1 in (4.3, 6.5, 14.5)
        for d in (0.02, 0.06, 0.1)
    ]
    yield from skin

    # Reduced albedo 2/3 in the epidermis, in the dermis, in both.
    for sigma_a in beside(1.5):
        yield sigma_a, 3.0, 0.2, 1.5, 0.1, 1.4
        yield 0.2, 3.0, sigma_a, 3.0, 0.1, 1.4
        yield sigma_a, 3.0, sigma_a, 3.0, 0.1, 1.4
    for sigma_a in beside(0.375):
        yield sigma_a, 0.75, 2.0, 4.0, 3.0, 1.4
    for d in (0.0, 1e-9, 1e-3, 1.0, 1e3):
        yield 1.5, 3.0, 0.75, 1.5, d, 1.4

    # From no absorption at all to nothing else, in either layer.
    absorptions = [0.0, 1e-300, 1e-200, 1e-100, 1e-50, 1e-30]
    absorptions += [float(f"1e{e}") for e in range(-20, 9, 2)]
    for sigma_a in absorptions:
        yield sigma_a, 5.0, 0.1, 2.5, 0.08, 1.4
        yield 0.1, 5.0, sigma_a, 2.5, 0.08, 1.4
        yield sigma_a, 5.0, sigma_a, 2.5, 0.08, 1.4
        yield sigma_a, 1e-6, 0.1, 2.5, 10.0, 1.4

    # Thickness, for clear, skin-like and black layers; identical layers beside them.
    for d in [0.0] + [float(f"1e{e}") for e in range(-9, 4)]:
        yield 0.5, 5.0, 0.1, 2.5, d, 1.4
        yield 0.5, 5.0, 0.5, 5.0, d, 1.4
        yield 1e-6, 0.01, 3.0, 2.0, d, 1.4
        yield 40.0, 0.5, 0.0, 2.0, d, 1.4
        yield 0.0, 5.0, 0.0, 1.0, d, 1.4

    # The index.
    for hundredths in [*range(100, 200, 10), *range(200, 381, 20), 384, 28, 50, 75, 99]:
        yield 0.5, 5.0, 0.1, 2.5, 0.08, hundredths / 100
        yield 0.0, 5.0, 0.0, 2.5, 0.08, hundredths / 100

    # Where an implementation may want to change its form: thickness in mean free
    # paths (x = sigma_t' d) about 1, in diffusion lengths (y = k d) about 1/4, and both
    # alike (reduced albedo 2/3), from thin to thick.
    for y in (1e-12, 1e-8, 1e-4, 0.01, 0.1, 0.2499, 0.25, 0.2501, 0.5, 1.0, 4.0):
        for x in (1e-6, 1e-3, 0.1, 0.5, 0.9999, 1.0, 1.0001, 2.0, 30.0):
            absorbed = (y / x) ** 2 / 3  # sigma_a/sigma_t'
            if absorbed < 1:
                yield absorbed * x, (1 - absorbed) * x, 0.5, 2.0, 1.0, 1.4
    # A clear epidermis that scatters next to nothing: the dermis seen through it.
    for sigma_a in (1e-3, 0.1, 1.0, 10.0, 50.0, 100.0):
        yield sigma_a, 1e-60, 0.05, 8.0, 1.0, 1.4

    rng = random.Random(SEED)
    for _ in range(150):
        decades = lambda a, b: 10 ** rng.uniform(a, b)
        layers = decades(-8, 4), decades(-3, 4), decades(-8, 4), decades(-3, 4)
        d = min(decades(-3, 2) / (layers[0] + layers[1]), 1e3)
        yield (*layers, d, rng.uniform(1.0, 3.8))
    for _ in range(100):
        decades = lambda a, b: 10 ** rng.uniform(a, b)
        yield (
            *(decades(-60, 60), decades(-60, 60), decades(-60, 60), decades(-60, 60)),
            *(decades(-60, 3), rng.uniform(0.3, 3.8)),
        )


def table():
    print("# Two-layer diffusion, made by tests/reference/two_layer.py: do not edit.")
    print("# Inputs are exact doubles; R has 20 significant digits.")
    print("sigma_a1,sigma_s1,sigma_a2,sigma_s2,d_mm,eta,R")
    for row in inputs():
        print(",".join([repr(x) for x in row] + [f"{reflectance(row):.19e}"]))


def check():
    """The equation itself, by central differences of the solution at several depths,
    and the three conditions."""
    worst = Decimal(0)
    with localcontext() as context:
        context.prec = 200
        h = Decimal("1e-40")
        for row in (
            (0.5, 5.0, 0.1, 2.5, 0.08, 1.4),
            (30.0, 14.5, 8.0, 7.25, 0.1, 1.4),
            (1.5, 3.0, 1.5, 3.0, 0.1, 1.4),
            (1e-6, 0.01, 3.0, 2.0, 10.0, 1.9),
            (0.0, 5.0, 0.0, 1.0, 0.3, 1.0),
        ):
            s = Solution(*(Decimal(x) for x in row))
            d = s.d
            wrong = []
            for share in ("0.1", "0.5", "0.9"):
                z = d * Decimal(share)
                middle, source = s.epidermis(z)[0], s.epi.sigma_s * (-s.epi.sigma_t * z).exp()
                bend = (s.epidermis(z + h)[0] - 2 * middle + s.epidermis(z - h)[0]) / h**2
                wrong.append((-s.epi.D * bend + s.epi.sigma_a * middle) / source - 1)
                z = d + Decimal(share) / s.der.sigma_t
                middle = s.dermis(z)[0]
                source = s.der.sigma_s * s.T * (-s.der.sigma_t * (z - d)).exp()
                bend = (s.dermis(z + h)[0] - 2 * middle + s.dermis(z - h)[0]) / h**2
                wrong.append((-s.der.D * bend + s.der.sigma_a * middle) / source - 1)
            top, over, under = s.epidermis(Decimal(0)), s.epidermis(d), s.dermis(d)
            wrong.append(2 * s.A * s.epi.D * top[1] / top[0] - 1)
            wrong.append(under[0] / over[0] - 1)
            wrong.append((s.der.D * under[1] - s.epi.D * over[1]) / over[0])
            here = max(abs(x) for x in wrong)
            worst = max(worst, here)
            print(row, f"R {s.reflectance():.20f}, equation and conditions within {here:.1e}")
    if worst > Decimal("1e-25"):
        sys.exit("not a solution")


if __name__ == "__main__":
    {"--check": check}.get((sys.argv + [""])[1], table)()
