#!/usr/bin/env python3
"""test_dipole.py - `skinspec dipole` against 50-digit decimal arithmetic."""

import decimal
import itertools
import random
from decimal import Decimal
from multiprocessing.pool import ThreadPool

from support import Case, main, run

# Every thread begins with the default context.
decimal.DefaultContext.prec = 50
decimal.DefaultContext.Emin = decimal.MIN_EMIN
decimal.DefaultContext.Emax = decimal.MAX_EMAX
decimal.setcontext(decimal.DefaultContext)
PI = Decimal("3.14159265358979323846264338327950288419716939937510582097")


class Exact:
    """Eqs. 7-9 of the paper with its misprints put right, for the doubles that the
    program gets; eta >= 1."""

    def __init__(self, sigma_a, sigma_s_prime, eta):
        a, s, n = Decimal(sigma_a), Decimal(sigma_s_prime), Decimal(eta)
        F_dr = Decimal("-1.440") / n**2 + Decimal("0.710") / n + Decimal("0.668")
        F_dr += Decimal("0.0636") * n
        self.A = (1 + F_dr) / (1 - F_dr)
        t = a + s
        self.mu, self.s = s / t, (3 * a / t).sqrt()
        self.sigma_tr = (3 * a * t).sqrt()
        self.z = (1 / t, (1 + 4 * self.A / 3) / t)

    def total(self):
        return self.mu / 2 * (1 + (-4 * self.A * self.s / 3).exp()) * (-self.s).exp()

    def profile(self, r_mm):
        r, total = Decimal(r_mm), Decimal(0)
        for z in self.z:
            d = (z * z + r * r).sqrt()
            x = self.sigma_tr * d
            # Far below any double; the exponential of so much would take long.
            total += z * (1 + x) * (-x).exp() / d**3 if x < 10**6 else 0
        return self.mu / (4 * PI) * total

    def cumulative(self, r_mm):
        """2 pi times the integral of r R_d(r) from 0 to r_mm."""
        r, total = Decimal(r_mm), Decimal(0)
        for z in self.z:
            d = (z * z + r * r).sqrt()
            x = self.sigma_tr * d
            rest = (-x).exp() * z / d if x < 10**6 else 0
            total += (-self.sigma_tr * z).exp() - rest if r > 0 else 0
        return self.mu / 2 * total


def dipole(sigma_a, sigma_s_prime, eta, *more):
    numbers = ("--sigma-a", repr(sigma_a), "--sigma-s-prime", repr(sigma_s_prime))
    return run("dipole", *numbers, "--eta", repr(eta), "--json", *more)


def points():
    """A grid with all corners of the range, and points spread evenly over decades."""
    spread = random.Random(7)
    grid = itertools.product(
        (0.0, 1e-12, 1e-3, 0.5, 30.0, 1e8), (1e-6, 0.1, 2.0, 1e6), (1.0, 1.4, 2.0), (0.0, 0.7, 1e6)
    )
    # Each absorption and scattering meets each index; the distance goes round.
    for i, point in enumerate(grid):
        if i % 3 == (i // 9) % 3 or point[2] == 1.4:
            yield point
    for _ in range(250):
        sigma_a = 10 ** spread.uniform(-9, 8)
        sigma_s_prime = 10 ** spread.uniform(-6, 6)
        # Distances where there is still something to compare, and any at all.
        free_path = 1 / (sigma_a + sigma_s_prime)
        r_mm = free_path * 10 ** spread.uniform(-3, 3)
        if spread.random() < 0.2:
            r_mm = 10 ** spread.uniform(-6, 6)
        yield sigma_a, sigma_s_prime, spread.uniform(1, 2), min(r_mm, 1e6)


def check_point(point):
    """What is wrong at a point, or nothing."""
    sigma_a, sigma_s_prime, eta, r_mm = point
    done = dipole(sigma_a, sigma_s_prime, eta, "--r-mm", repr(r_mm), "--cumulative")
    if done.status != 0:
        return f"{point}: exit status {done.status}: {done.err}"
    got, exact = done.json(), Exact(sigma_a, sigma_s_prime, eta)
    if set(got) != {"R_total", "R_d", "R_cumulative"}:
        return f"{point}: members {sorted(got)}"
    expected = {
        "R_total": exact.total(),
        "R_d": exact.profile(r_mm),
        "R_cumulative": exact.cumulative(r_mm),
    }
    for name, x in expected.items():
        if got[name] == 0 and abs(x) < Decimal("1e-300"):
            continue
        if abs(Decimal(got[name]) - x) > Decimal("1e-12") * abs(x):
            return f"{point}: {name} {got[name]!r}, expected {x:.17g}"
    return None


class Dipole(Case):
    def test_matches_decimals_everywhere(self):
        all_points = list(points())
        self.assertGreater(len(all_points), 300)
        with ThreadPool(2) as pool:
            wrong = [w for w in pool.imap_unordered(check_point, all_points, 8) if w is not None]
        self.assertEqual(wrong, [], f"{len(wrong)} of {len(all_points)} points")

    def test_cumulative_reaches_the_total(self):
        for sigma_a, sigma_s_prime, eta in ((0.0, 1.0, 1.0), (0.01, 1.0, 1.4), (5.0, 0.3, 1.8)):
            with self.subTest(sigma_a=sigma_a):
                done = dipole(sigma_a, sigma_s_prime, eta, "--r-mm", "1e30", "--cumulative").json()
                self.assertClose(done["R_cumulative"], done["R_total"], absolute=1e-14)

    def test_profile_integrates_to_cumulative(self):
        """Simpson's rule over Eq. 7 as printed, from one run per distance."""
        sigma_a, sigma_s_prime, eta, last, n = 0.1, 1.0, 1.4, 2.0, 200
        radii = [last * i / n for i in range(n + 1)]
        with ThreadPool(2) as pool:
            runs = pool.map(
                lambda r: dipole(sigma_a, sigma_s_prime, eta, "--r-mm", repr(r)).json(), radii, 8
            )
        integrand = [2 * float(PI) * r * x["R_d"] for r, x in zip(radii, runs)]
        odd, even = sum(integrand[1:-1:2]), sum(integrand[2:-1:2])
        integral = last / n / 3 * (integrand[0] + 4 * odd + 2 * even + integrand[-1])
        done = dipole(sigma_a, sigma_s_prime, eta, "--r-mm", repr(last), "--cumulative").json()
        self.assertClose(done["R_cumulative"], integral, relative=1e-6)

    def test_members_are_those_asked_for(self):
        self.assertEqual(set(dipole(0.1, 1.0, 1.3).json()), {"R_total"})
        self.assertEqual(set(dipole(0.1, 1.0, 1.3, "--r-mm", "1").json()), {"R_total", "R_d"})

    def test_plain_output_is_the_same_number(self):
        """Total at (0.1, 1, 1.3): 40-digit decimals give 0.31367921016462022..."""
        done = self.run_ok("dipole", "--sigma-a", "0.1", "--sigma-s-prime", "1", "--eta", "1.3")
        name, value = done.out.split()
        self.assertEqual(name, "R_total")
        self.assertClose(float(value), 0.3136792101646202, relative=1e-12)

    def test_index_default_is_that_of_skin(self):
        with_default = self.run_ok("dipole", "--sigma-a", "0.1", "--sigma-s-prime", "1", "--json")
        expected = float(Exact(0.1, 1.0, 1.4).total())
        self.assertClose(with_default.json()["R_total"], expected, relative=1e-12)

    def test_index_is_refused_where_the_fit_ends(self):
        """F_dr reaches 1 at 3.84810 and 0.25995: beyond, A would be negative.  The
        program promises what is below 3.848 and above 0.260."""
        for eta in (3.8479, 0.2601):
            self.assertEqual(dipole(0.1, 1.0, eta).status, 0)
        for eta in ("3.848", "3.8481", "4", "1e6", "0.26", "0.1", "0"):
            with self.subTest(eta=eta):
                says = ("--eta", "3.848")
                self.refused(
                    2, "dipole", "--sigma-a", "0.1", "--sigma-s-prime", "1", "--eta", eta, says=says
                )

    def test_what_is_no_number_is_refused(self):
        good = {"--sigma-a": "0.1", "--sigma-s-prime": "1", "--eta": "1.4", "--r-mm": "1"}
        bad = ("-1", "nan", "inf", "-inf", "one", "", " ", "1,5", "1mm", "0x10", "1e999")
        for option, text in itertools.product(good, bad):
            with self.subTest(option=option, text=text):
                options = [f"{name}={value}" for name, value in {**good, option: text}.items()]
                done = self.refused(2, "dipole", *options, says=(option, text))
                self.assertEqual(done.out, "")

    def test_scattering_must_be_above_zero(self):
        says = "--sigma-s-prime"
        self.refused(2, "dipole", "--sigma-a", "1", "--sigma-s-prime", "0", says=says)

    def test_what_is_missing_is_named(self):
        self.refused(2, "dipole", "--sigma-a", "1", says="--sigma-s-prime is missing")
        self.refused(2, "dipole", "--sigma-s-prime", "1", says="--sigma-a is missing")
        options = ("--sigma-a", "1", "--sigma-s-prime", "1")
        self.refused(2, "dipole", *options, "--cumulative", says="--r-mm")
        self.refused(2, "dipole", *options, "7", says="'7'")


if __name__ == "__main__":
    main()
