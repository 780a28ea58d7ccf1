"""The N-stream equations of two-layer skin solved in 220 digits: the witness of
src/optics/transport.c, with which it shares no method.

For every direction mu_i of the quadrature, down (+) and up (-), with tau as depth,

    +-mu_i dI_i/dtau = -I_i + a/2 sum over j of w_j (I_j+ + I_j-)

in an epidermis (a1, 0 .. tau1) and an endless dermis (a2).  In each layer the
solutions are J e^(-k t)/(1 -+ k mu_i) and their mirror images, k from
1 = a sum w_j/(1 - k^2 mu_j^2) (Chandrasekhar, Radiative Transfer, 1950).  Their 3 N
constants come from one dense linear system: Fresnel's reflection and the light
that enters at the top, continuity below the epidermis.  No layer operators, no
doubling, no H function.  R = what leaves upwards, per incident light, without the
mirror reflection.

Directions: half of them Gauss on [0, mu_c], half Radau on [mu_c, 1] with a node
at 1, mu_c = sqrt(1 - 1/eta^2); all of them Radau on [0, 1] where eta <= 1.

Slopes are differences over a relative step of 1e-30, one-sided at 0; where nothing
absorbs, sigma_a is 1e-120 of sigma_s'.  The slope by the dermis's sigma_a is then
-inf (R falls as its root) and the one by its sigma_s' 0.  A slope that changes R by less
than 1e-60 of itself where its coefficient changes by all of itself is written as 0.

    transport_exact.py            writes the table to standard output
    transport_exact.py --check    energy, two identical layers, half the step
"""

import argparse
import random
import sys

from mpmath import mp, mpf, exp, sqrt

mp.dps = 220
STEP = mpf(10) ** -30
NOTHING = mpf(10) ** -120
BLURRED = mpf(10) ** -60


def legendre(n, x):
    """P_n and P_(n-1) at x."""
    p, before = mpf(1), mpf(0)
    for k in range(1, n + 1):
        p, before = ((2 * k - 1) * x * p - (k - 1) * before) / k, p
    return p, before


def zeros(f, count):
    """All zeros of a polynomial inside (-1, 1), by sign changes on a grid that is
    finer at the ends, then by secants inside the bracket."""
    found, steps = [], 60 * count
    grid = [-mp.cos(mp.pi * i / steps) for i in range(1, steps)]
    for low, high in zip(grid, grid[1:]):
        if f(low) * f(high) < 0:
            found.append(mp.findroot(f, (low, high), solver="anderson", tol=mpf(10) ** -400,
                                     maxsteps=200, verify=False))
    assert len(found) == count
    return found


def gauss(n):
    x = zeros(lambda t: legendre(n, t)[0], n)
    return x, [2 * (1 - t * t) / (n * legendre(n, t)[1]) ** 2 for t in x]


def radau(n):
    """With a node at 1; the others are zeros of (P_(n-1) - P_n)/(1 - x)."""
    def f(t):
        p, before = legendre(n, t)
        return (before - p) / (1 - t)
    x = zeros(f, n - 1)
    w = [(1 + t) / (n * legendre(n, t)[1]) ** 2 for t in x]
    return x + [mpf(1)], w + [mpf(2) / n ** 2]


def directions(streams, eta):
    """mu, weights, Fresnel's reflectance from inside."""
    if eta <= 1:
        parts = [(radau(streams), mpf(0), mpf(1))]
    else:
        mu_c = sqrt(1 - 1 / eta ** 2)
        parts = [(gauss(streams // 2), mpf(0), mu_c), (radau(streams // 2), mu_c, mpf(1))]
    mu, w = [], []
    for (x, weights), low, high in parts:
        mu += [low + (high - low) * (t + 1) / 2 for t in x]
        w += [(high - low) * t / 2 for t in weights]
    mu[-1] = mpf(1)
    return mu, w, [fresnel(m, eta) for m in mu]


def fresnel(mu, eta):
    outside2 = 1 - eta ** 2 * (1 - mu ** 2)
    if outside2 <= 0:
        return mpf(1)
    outside = sqrt(outside2)
    return (((eta * mu - outside) / (eta * mu + outside)) ** 2
            + ((mu - eta * outside) / (mu + eta * outside)) ** 2) / 2


def exponents(a, mu, w):
    """The N positive k, one below each pole 1/mu^2 of k^2: Newton's method on
    distance times function inside a bracket that only shrinks."""
    poles = sorted((1 / m ** 2, v / m ** 2) for m, v in zip(mu, w))
    found = []
    for n, (pole, strength) in enumerate(poles):
        low, high = mpf(0), pole - (poles[n - 1][0] if n else 0)
        others = poles[:n] + poles[n + 1:]
        x = min(a * strength, high / 2)
        for _ in range(2000):
            terms = [(s / (p - pole + x), p - pole + x) for p, s in others]
            f = x * (1 / a - sum(t for t, _ in terms)) - strength
            slope = 1 / a - sum(t for t, _ in terms) + x * sum(t / y for t, y in terms)
            # f < 0 near the pole, > 0 near the other end of the gap
            low, high = (x, high) if f < 0 else (low, x)
            new = x - f / slope
            if not low <= new <= high:
                new = (low + high) / 2
            if abs(new - x) <= abs(x) * mpf(10) ** -215:
                break
            x = new
        else:
            raise ArithmeticError("an exponent did not settle")
        found.append(sqrt(pole - new))
    return found


def solve(A, b):
    """Gaussian elimination with row pivots."""
    n = len(b)
    for i in range(n):
        p = max(range(i, n), key=lambda r: abs(A[r][i]))
        A[i], A[p], b[i], b[p] = A[p], A[i], b[p], b[i]
        row = A[i]
        for r in range(i + 1, n):
            if A[r][i]:
                f = A[r][i] / row[i]
                other = A[r]
                for c in range(i + 1, n):
                    other[c] -= f * row[c]
                b[r] -= f * b[i]
    for i in reversed(range(n)):
        b[i] = (b[i] - sum(A[i][c] * b[c] for c in range(i + 1, n))) / A[i][i]
    return b


def reflectance(case, q, known):
    """case: sigma_a1, sigma_s1, sigma_a2, sigma_s2, d, eta.  known: exponents that
    were found before, by albedo."""
    sigma_a1, sigma_s1, sigma_a2, sigma_s2, d, eta = case
    mu, w, r = q
    n = len(mu)
    k = []
    for absorbs, scatters in ((sigma_a1, sigma_s1), (sigma_a2, sigma_s2)):
        a = scatters / (scatters + (absorbs or NOTHING * scatters))
        if a not in known:
            known[a] = exponents(a, mu, w)
        k.append(known[a])
    tau = (sigma_a1 + sigma_s1) * d
    far = [exp(-x * tau) for x in k[0]]
    forward = [[[1 / (1 - x * m) for x in layer] for m in mu] for layer in k]
    backward = [[[1 / (1 + x * m) for x in layer] for m in mu] for layer in k]
    A, b, zero = [], [], mpf(0)
    for i in range(n):  # top: down = entering + r up
        f, g = forward[0][i], backward[0][i]
        A.append([f[m] - r[i] * g[m] for m in range(n)]
                 + [far[m] * (g[m] - r[i] * f[m]) for m in range(n)] + [zero] * n)
        b.append(zero)
    specular = ((eta - 1) / (eta + 1)) ** 2
    b[n - 1] = (1 - specular) / (w[-1] * mu[-1])
    for i in range(n):  # below the epidermis: down, and up, continue
        for here, there in ((forward, backward), (backward, forward)):
            A.append([far[m] * here[0][i][m] for m in range(n)]
                     + [there[0][i][m] for m in range(n)]
                     + [-here[1][i][m] for m in range(n)])
            b.append(zero)
    x = solve(A, b)
    out = zero
    for i in range(n):
        up = sum(x[m] * backward[0][i][m] + x[n + m] * far[m] * forward[0][i][m] for m in range(n))
        out += (1 - r[i]) * w[i] * mu[i] * up
    return out


def slopes(case, q, step=STEP):
    known, found = {}, []
    for i in range(5):
        if i == 2 and case[2] == 0:
            found.append(-mp.inf)
            continue
        if i == 3 and case[2] == 0 or i < 2 and case[4] == 0:
            found.append(mpf(0))
            continue
        # At 0 from one side: the scale is that of the layer's scattering, or a mm.
        scale = case[i] or (case[1] if i == 0 else 1)
        size = scale * step if case[i] else scale * step ** 2
        shifts = (1, -1) if case[i] else (2, 1)
        R = []
        for s in shifts:
            shifted = list(case)
            shifted[i] += s * size
            R.append(reflectance(shifted, q, known))
        slope = (R[0] - R[1]) / (shifts[0] - shifts[1]) / size
        found.append(slope if abs(slope * scale) > R[0] * BLURRED else mpf(0))
    return found


TINY = 1e-16
# sigma_a1, sigma_s1, sigma_a2, sigma_s2, d, eta
PLAIN = [
    (0.05, 5.0, 0.03, 2.5, 0.08, 1.4), (20.0, 14.0, 5.0, 7.0, 0.08, 1.4), (3.0, 10.0, 1.0, 5.0, 0.03, 1.4),
    (60.0, 8.0, 0.2, 4.0, 0.15, 1.4), (0.5, 5.0, 0.5, 5.0, 0.08, 1.4), (0.5, 5.0, 0.1, 2.5, 0.08, 1.0),
    (0.5, 5.0, 0.1, 2.5, 0.08, 1.000001), (0.5, 5.0, 0.1, 2.5, 0.08, 1.33), (0.5, 5.0, 0.1, 2.5, 0.08, 2.0),
    (0.5, 5.0, 0.1, 2.5, 0.08, 3.8), (0.5, 5.0, 0.1, 2.5, 0.08, 0.99), (0.5, 5.0, 0.1, 2.5, 0.08, 0.7),
    (0.5, 5.0, 0.1, 2.5, 0.08, 0.3),
]
STIFF = [
    # nothing absorbs, hardly anything does
    (0.0, 5.0, 0.0, 2.5, 0.08, 1.4), (0.0, 1e6, 0.0, 1e6, 10.0, 1.4), (0.0, 5.0, 0.0, 2.5, 0.0, 1.4),
    (5 * TINY, 5.0, 2.5 * TINY, 2.5, 0.08, 1.4), (5 * TINY, 5.0, 2.5 * TINY, 2.5, 10.0, 1.0),
    (1e6 * TINY, 1e6, 1e6 * TINY, 1e6, 10.0, 1.4), (0.0, 5.0, 0.1, 2.5, 0.08, 1.4), (0.5, 5.0, 0.0, 2.5, 0.08, 1.4),
    (0.0, 1e6, 1.0, 2.5, 10.0, 1.4), (0.0, 1e6, 1e12, 1e-6, 10.0, 1.4), (5 * TINY, 5.0, 1e12, 1e-6, 1.0, 1.4),
    (1e-9, 5.0, 1e-12, 2.5, 3.0, 1.4), (0.0, 1e-6, 0.0, 1e6, 1e-6, 1.4), (1e-30, 5.0, 1e-30, 5.0, 0.08, 1.4),
    # black
    (1e12, 1e-6, 1e12, 1e-6, 0.08, 1.4), (1e12, 1e-6, 0.0, 5.0, 1e-12, 1.4), (1e12, 1e6, 1e12, 1e6, 10.0, 2.0),
    (1e3, 1e-6, 1e3, 1e-6, 1e-3, 1.4), (1e3, 1e-6, 1e-3, 10.0, 1e-3, 1.4), (1.0, 1e-6, 1e12, 1e-6, 1.0, 1.4),
    (1e12, 1e-6, 0.1, 2.5, 10.0, 1.4),
    # thin
    (0.5, 5.0, 0.1, 2.5, 0.0, 1.4), (0.5, 5.0, 0.1, 2.5, 1e-300, 1.4), (0.5, 5.0, 0.1, 2.5, 1e-15, 1.4),
    (0.5, 5.0, 0.1, 2.5, 1e-9, 1.4), (0.5, 5.0, 0.1, 2.5, 1e-4, 1.4), (0.5, 5.0, 1e12, 1e-6, 1e-12, 1.4),
    (0.5, 5.0, 1e12, 1e-6, 1e-4, 1.4), (0.5, 5.0, 1e12, 1e-6, 1e-2, 1.4), (0.5, 5.0, 1e12, 1e-6, 0.03, 1.4),
    (0.0, 5.0, 1e12, 1e-6, 1e-12, 1.4), (1e12, 1e6, 0.1, 2.5, 1e-15, 1.4),
    # thick
    (0.5, 5.0, 0.1, 2.5, 10.0, 1.4), (0.01, 5.0, 0.1, 2.5, 10.0, 1.4), (1e-4, 1.0, 50.0, 1.0, 10.0, 1.4),
    (50.0, 1.0, 1e-4, 1.0, 1.0, 1.4), (1e12, 1e6, 0.1, 2.5, 10.0, 1.4), (1e2, 1e6, 0.1, 2.5, 10.0, 1.4),
    (1e-6, 1e6, 1e-6, 1e-6, 10.0, 1.4),
    # alike, and one bit beside
    (0.1, 5.0, 0.1, 5.0, 1.0, 1.4), (0.1, 5.0, 0.1, 5.000000000000001, 1.0, 1.4), (0.2, 10.0, 0.1, 5.0, 0.3, 1.4),
]


def cases():
    """(streams, case): plain ones at all numbers of streams, stiff ones mostly at 4 and
    8, and seeded random ones."""
    for streams in (4, 8, 16, 32):
        for n, case in enumerate(PLAIN):
            if streams <= 8 or n in (1, 3, 4):
                yield streams, case
    for streams in (4, 8):
        for case in STIFF:
            yield streams, case
    for case in STIFF[1::6]:
        yield 16, case
    for case in STIFF[9::17]:
        yield 32, case
    rnd = random.Random(20140401)
    for n in range(120):
        decade = lambda low, high: float("%.9g" % 10 ** rnd.uniform(low, high))
        wide = n % 3 == 0
        a = (lambda: rnd.choice((0.0, decade(-20, 12), decade(-4, 3)))) if wide else (lambda: decade(-3, 2))
        s = (lambda: decade(-6, 6)) if wide else (lambda: decade(-1, 2))
        d = decade(-9, 1) if wide else decade(-3, 0)
        yield (8 if n % 2 else 4), (a(), s(), a(), s(), d, round(rnd.uniform(1.0, 2.0), 3))


def text(x):
    return "-inf" if x == -mp.inf else mp.nstr(x, 20, min_fixed=0, max_fixed=0)


def write():
    print("# Two-layer skin by the N-stream equations in %d digits: R and its derivatives." % mp.dps)
    print("# Made by: tests/reference/transport_exact.py > tests/reference/transport_exact.csv")
    print("streams,sigma_a1,sigma_s1,sigma_a2,sigma_s2,d_mm,eta,R,"
          "R_sigma_a1,R_sigma_s1,R_sigma_a2,R_sigma_s2,R_d")
    quadratures = {}
    for streams, case in cases():
        exact = [mpf(x) for x in case]
        key = streams, case[5]
        if key not in quadratures:
            quadratures[key] = directions(streams, exact[5])
        q = quadratures[key]
        row = [reflectance(exact, q, {})] + slopes(exact, q)
        print(",".join(["%d" % streams] + [repr(x) for x in case] + [text(x) for x in row]), flush=True)


def check():
    """Exit status: 0 where all three properties hold."""
    good = True
    for streams, eta in ((4, mpf("1.4")), (8, mpf(1)), (8, mpf("0.7"))):
        q = directions(streams, eta)
        specular = ((eta - 1) / (eta + 1)) ** 2
        white = [mpf(0), mpf(5), mpf(0), mpf("2.5"), mpf("0.08"), eta]
        lost = abs(1 - specular - reflectance(white, q, {}))
        alike = [mpf("0.1"), mpf(5), mpf("0.1"), mpf(5), mpf(0), eta]
        thin, thick = (reflectance(alike[:4] + [mpf(d), eta], q, {}) for d in ("1e-9", "3"))
        skin = [mpf("0.5"), mpf(5), mpf("0.1"), mpf("2.5"), mpf("0.08"), eta]
        step = max(abs(x / y - 1) for x, y in zip(slopes(skin, q), slopes(skin, q, STEP / 2)))
        print("%d streams, eta %s: nothing absorbs %s, layers alike %s, half the step %s"
              % (streams, mp.nstr(eta, 3), mp.nstr(lost, 2), mp.nstr(abs(thin / thick - 1), 2), mp.nstr(step, 2)))
        good &= bool(lost < mpf(10) ** -55 and abs(thin / thick - 1) < mpf(10) ** -150 and step < mpf(10) ** -50)
    print("check: %s" % ("good" if good else "FAILED"))
    return 0 if good else 1


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="N-stream equations of two-layer skin, exactly")
    parser.add_argument("--check", action="store_true")
    if parser.parse_args().check:
        sys.exit(check())
    write()
