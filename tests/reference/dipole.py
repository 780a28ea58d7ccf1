#!/usr/bin/env python3
"""Dipole of Eqs. 7-9 in 60-digit decimals: the reference of tests/optics/test_dipole.c.

Written from the equations (docs/physics.md has them with the misprints put right);
shares no code with src/.

    dipole.py > tests/reference/dipole.csv     the table
    dipole.py --half-space                     rows of tests/optics/test_half_space.c
    dipole.py --check                          closed forms against quadrature, one line each

Inputs are doubles and printed so that they read back as the same doubles; what
is computed starts from their exact values.
"""

import random
import sys
from decimal import Decimal, getcontext

DIGITS = 60
getcontext().prec = DIGITS + 10  # ten guard digits
SEED = 20010812


def machin_pi():
    """pi = 16 atan(1/5) - 4 atan(1/239)."""

    def atan_of_inverse(n):
        term, total, k = Decimal(1) / n, Decimal(0), 0
        while abs(term) > Decimal(10) ** -(DIGITS + 15):
            total += term / (2 * k + 1) * (-1) ** k
            term /= n * n
            k += 1
        return total

    return 16 * atan_of_inverse(5) - 4 * atan_of_inverse(239)


PI = machin_pi()


def internal_reflection(eta):
    """Eq. 8: A from the fit of the diffuse Fresnel reflectance."""
    if eta >= 1:
        F = Decimal("-1.440") / eta**2 + Decimal("0.710") / eta + Decimal("0.668")
        F += Decimal("0.0636") * eta
    else:
        F = Decimal("-0.4399") + Decimal("0.7099") / eta - Decimal("0.3319") / eta**2
        F += Decimal("0.0636") / eta**3
    if F >= 1:
        raise ValueError(f"eta {eta} has F_dr {F}")
    return (1 + F) / (1 - F)


class Dipole:
    """Sources at z_r and z_v over a medium; all arguments exact decimals."""

    def __init__(self, sigma_a, sigma_s_prime, eta):
        self.A = internal_reflection(eta)
        self.sigma_t_prime = sigma_a + sigma_s_prime
        self.mu = sigma_s_prime / self.sigma_t_prime
        self.sigma_tr = (3 * sigma_a * self.sigma_t_prime).sqrt()
        D = 1 / (3 * self.sigma_t_prime)
        self.z_r = 1 / self.sigma_t_prime
        self.z_v = self.z_r + 4 * self.A * D
        self.s = (3 * sigma_a / self.sigma_t_prime).sqrt()

    def profile(self, r):
        """Eq. 7, its second term not divided by sigma_t'."""
        total = Decimal(0)
        for z in (self.z_r, self.z_v):
            d = (r * r + z * z).sqrt()
            total += z * (1 + self.sigma_tr * d) * (-self.sigma_tr * d).exp() / d**3
        return self.mu / (4 * PI) * total

    def cumulative(self, r):
        """2 pi times the integral of r R_d from 0 to r: each source gives
        e^(-sigma_tr z) - (z/d) e^(-sigma_tr d).

        Near r = 0 both terms agree to about 2 log10(z/r) digits, so the
        precision is raised while they are subtracted."""
        getcontext().prec += 80
        total = Decimal(0)
        for z in (self.z_r, self.z_v):
            d = (r * r + z * z).sqrt()
            total += (-self.sigma_tr * z).exp() - z / d * (-self.sigma_tr * d).exp()
        getcontext().prec -= 80
        return self.mu / 2 * total

    def total(self):
        """Eq. 9."""
        return self.mu / 2 * (1 + (-Decimal(4) / 3 * self.A * self.s).exp()) * (-self.s).exp()


def inputs():
    """(sigma_a, sigma_s_prime, eta, r_mm), every one a double."""
    powers = lambda first, last: [float(f"1e{e}") for e in range(first, last + 1)]
    distances = [0.0] + powers(-6, 6)
    # Absorption against scattering; the distance goes round its own grid.
    count = 0
    for sigma_a in [0.0] + powers(-16, 8):
        for sigma_s_prime in powers(-6, 6)[::3]:
            yield sigma_a, sigma_s_prime, 1.4, distances[count % len(distances)]
            count += 1
    # The index, in both branches of the fit and up to its ends.
    for hundredths in [*range(100, 201, 5), *range(30, 100, 5), *range(220, 381, 20), 27, 384]:
        for sigma_a in (0.0, 0.1):
            yield sigma_a, 2.0, hundredths / 100, 0.5
    for eta in (0.9999999999999999, 1.0000000000000002, 3.8475, 0.2605):
        yield 0.1, 2.0, eta, 0.5
    # The distance, from skin to glass-clear.
    for sigma_a, sigma_s_prime in ((0.3, 2.5), (1e-4, 1.0), (5.0, 0.2), (0.0, 30.0)):
        for r in distances:
            yield sigma_a, sigma_s_prime, 1.4, r
    rng = random.Random(SEED)
    for _ in range(150):
        sigma_a = 10 ** rng.uniform(-16, 8)
        sigma_s_prime = 10 ** rng.uniform(-6, 6)
        eta = rng.choice((rng.uniform(1, 2), rng.uniform(1, 2), rng.uniform(0.3, 3.8)))
        # Distances that matter: around the depth of the sources and the reach of the light.
        r = 10 ** rng.uniform(-3, 3) / (sigma_a + sigma_s_prime)
        yield sigma_a, sigma_s_prime, eta, min(max(r, 1e-6), 1e6)
    # Coefficients over all decades, and profiles that 1/d^2 lifts out of e^-700 and less.
    for _ in range(60):
        sigma_a, sigma_s_prime = 10 ** rng.uniform(-99, 99), 10 ** rng.uniform(-99, 99)
        yield sigma_a, sigma_s_prime, 1.4, 10 ** rng.uniform(-3, 3) / (sigma_a + sigma_s_prime)
    for sigma in (1e40, 1e70, 1e99):
        for lengths in (700, 740, 800, 900):
            yield sigma, sigma, 1.4, lengths / (6**0.5 * sigma)


def table():
    print("# Dipole reflectance (Eqs. 7-9), made by tests/reference/dipole.py: do not edit.")
    print("# Inputs are exact doubles; results have 20 significant digits.")
    print("sigma_a,sigma_s_prime,eta,r_mm,R_total,R_d,cumulative")
    for row in inputs():
        sigma_a, sigma_s_prime, eta, r = (Decimal(x) for x in row)
        d = Dipole(sigma_a, sigma_s_prime, eta)
        results = (d.total(), d.profile(r), d.cumulative(r))
        print(",".join([repr(x) for x in row] + [f"{x:.19e}" for x in results]))


def half_space():
    """(1-Rs) Eq. 9 with the absorption of both layers summed."""
    for row in (
        (0.0, 0.0, 5.0, 1.4),
        (0.25, 0.5, 5.0, 1.4),
        (0.5, 0.25, 5.0, 1.4),
        (3.0, 0.125, 7.5, 1.4),
        (12.0, 1.5, 4.0, 1.33),
        (0.001953125, 0.03125, 6.0, 1.0),
        (1.0, 1.0, 2.0, 0.75),
        (1e-20, 0.0, 3.0, 1.4),
    ):
        sigma_a1, sigma_a2, sigma_s_prime, eta = (Decimal(x) for x in row)
        Rs = ((eta - 1) / (eta + 1)) ** 2
        R = (1 - Rs) * Dipole(sigma_a1 + sigma_a2, sigma_s_prime, eta).total()
        print("%r, %r, %r, %r" % row, f"{R:.20f}")


def tanh_sinh(f, left, right):
    """Integral of f by the tanh-sinh rule, the step halved until it stands still."""
    middle, half = (left + right) / 2, (right - left) / 2

    def part(first, step, n):
        total = Decimal(0)
        for i in range(n):
            t = first + step * i
            growth = t.exp()
            u = PI / 2 * (growth - 1 / growth) / 2
            # 1 - tanh(u) = 2/(e^2u + 1), so that the ends are not lost.
            from_end = 2 / ((2 * u).exp() + 1)
            weight = PI / 2 * (growth + 1 / growth) / 2 * from_end * (2 - from_end)
            total += weight * (f(right - half * from_end) + f(left + half * from_end))
        return total

    reach, step = Decimal("4.2"), Decimal("0.5")
    total = PI / 2 * f(middle) + part(step, step, int(reach / step))
    last = total * step * half
    for _ in range(7):
        total += part(step / 2, step, int(reach / step))
        step /= 2
        now = total * step * half
        if abs(now - last) <= abs(now) * Decimal("1e-30"):
            return now
        last = now
    raise ArithmeticError("quadrature does not settle")


def quadrature(d, r):
    """2 pi times the integral of r R_d, in panels that double: the integrand has
    its poles at +-i z_r and +-i z_v."""
    edges, edge = [Decimal(0)], d.z_r / 2
    while edge < r:
        edges.append(edge)
        edge *= 2
    edges.append(r)
    return sum(
        tanh_sinh(lambda x: 2 * PI * x * d.profile(x), a, b) for a, b in zip(edges, edges[1:])
    )


def check():
    worst = Decimal(0)
    for row in (
        (0.3, 2.5, 1.4, 0.01),
        (0.3, 2.5, 1.4, 2.0),
        (1e-4, 1.0, 1.4, 30.0),
        (5.0, 0.2, 1.9, 0.5),
        (0.0, 30.0, 1.0, 1.0),
        (0.05, 4.0, 0.6, 0.3),
    ):
        sigma_a, sigma_s_prime, eta, r = (Decimal(x) for x in row)
        d = Dipole(sigma_a, sigma_s_prime, eta)
        closed, integral = d.cumulative(r), quadrature(d, r)
        difference = abs(integral / closed - 1)
        worst = max(worst, difference)
        print(row, f"cumulative {closed:.20f}, quadrature differs by {difference:.1e}")
    for row in ((0.3, 2.5, 1.4), (5.0, 0.2, 1.9)):
        d = Dipole(*(Decimal(x) for x in row))
        far = 70 / d.sigma_tr + d.z_v  # e^-70 is left out
        difference = abs(quadrature(d, far) / d.total() - 1)
        worst = max(worst, difference)
        print(row, f"Eq. 9 {d.total():.20f}, quadrature differs by {difference:.1e}")
    if worst > Decimal("1e-25"):
        sys.exit("the closed forms are not the integrals")


if __name__ == "__main__":
    {"--half-space": half_space, "--check": check}.get((sys.argv + [""])[1], table)()
