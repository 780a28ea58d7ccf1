#!/usr/bin/env python3
"""test_reflectance.py - `skinspec coefficients` and `skinspec reflectance` against decimals:
the equations written out, and a two-layer medium solved by its boundary conditions."""

import csv
import decimal
import itertools
from decimal import Decimal

from support import Case, main

decimal.getcontext().prec = 40

# Whole blood, mm^-1, at some wavelengths: oxygenated, deoxygenated; four digits.
BLOOD = {
    420: ("257.27", "218.28"),
    542: ("28.54", "25.79"),
    576: ("29.75", "21.47"),
    600: ("1.714", "7.861"),
    650: ("0.1971", "2.0085"),
    740: ("0.2389", "0.5976"),
}
COLUMNS = ["wavelength_nm", "sigma_a_epidermis", "sigma_a_dermis", "sigma_s_prime_epidermis"]
COLUMNS += ["sigma_s_prime_dermis"]
SKINS = ((0.0, 1.0, 0.001), (0.03, 0.7, 0.01), (0.1, 0.3, 0.05), (0.5, 0.0, 0.1), (0.5, 1.0, 0.001))


def power(x, exponent):
    return (Decimal(exponent) * Decimal(x).ln()).exp()


def melanin_and_base(nm):
    """Eqs. 1-3: pheomelanin, eumelanin, skin without either."""
    pheo = Decimal("2.9e14") * power(nm, "-4.75")
    eu = Decimal("6.6e10") * power(nm, "-3.33")
    base = Decimal("0.0244") + Decimal("8.53") * (-(Decimal(nm) - 154) / Decimal("66.2")).exp()
    return pheo, eu, base


def scattering(nm):
    """Eq. 6, for the epidermis; the dermis has half of it."""
    return Decimal("14.74") * power(nm, "-0.22") + Decimal("2.2e11") * power(nm, "-4")


def skin_options(Cm, Bm, Ch):
    return ("--cm", repr(Cm), "--bm", repr(Bm), "--ch", repr(Ch))


def internal_reflection(eta):
    F_dr = Decimal("-1.440") / eta**2 + Decimal("0.710") / eta
    F_dr += Decimal("0.668") + Decimal("0.0636") * eta
    return (1 + F_dr) / (1 - F_dr)


def surface(eta):
    return ((eta - 1) / (eta + 1)) ** 2


def half_space(row, eta):
    """Eq. 9 for both layers together, with the scattering of the epidermis."""
    a = row["sigma_a_epidermis"] + row["sigma_a_dermis"]
    s = row["sigma_s_prime_epidermis"]
    root, A = (3 * a / (a + s)).sqrt(), internal_reflection(eta)
    R = s / (a + s) / 2 * (1 + (-4 * A * root / 3).exp()) * (-root).exp()
    return (1 - surface(eta)) * R


def two_layer(row, eta, d):
    """Diffusion of an exponential source: the general solution of each layer and a
    particular one, joined by four conditions.  Unknown are the factors of
    e^(-k1 z), e^(k1 (z - d)) above and of e^(-k2 (z - d)) below."""
    a1, s1 = row["sigma_a_epidermis"], row["sigma_s_prime_epidermis"]
    a2, s2 = row["sigma_a_dermis"], row["sigma_s_prime_dermis"]
    A, t1, t2 = internal_reflection(eta), a1 + s1, a2 + s2
    D1, D2 = 1 / (3 * t1), 1 / (3 * t2)
    k1, k2 = (a1 / D1).sqrt(), (a2 / D2).sqrt()
    T, E = (-t1 * d).exp(), (-k1 * d).exp()
    p1 = s1 / (a1 - D1 * t1 * t1)
    p2 = s2 * T / (a2 - D2 * t2 * t2)
    # At the surface phi = 2 A D phi'; at d phi and D phi' go on.
    m = [
        [1 + 2 * A * D1 * k1, E * (1 - 2 * A * D1 * k1), Decimal(0), -p1 * (1 + 2 * A * D1 * t1)],
        [E, Decimal(1), Decimal(-1), p2 - p1 * T],
        [-D1 * k1 * E, D1 * k1, D2 * k2, D1 * t1 * p1 * T - D2 * t2 * p2],
    ]
    for i in range(3):  # Gauss and Jordan
        pivot = max(range(i, 3), key=lambda r: abs(m[r][i]))
        m[i], m[pivot] = m[pivot], m[i]
        m[i] = [x / m[i][i] for x in m[i]]
        for r in range(3):
            if r != i:
                m[r] = [x - m[r][i] * y for x, y in zip(m[r], m[i])]
    phi = m[0][3] + m[1][3] * E + p1
    return (1 - surface(eta)) * phi / (2 * A)


class Coefficients(Case):
    def test_equations(self):
        """Blood to the four digits of its figures, the rest to 1e-9."""
        for (Cm, Bm, Ch), gamma in itertools.product(SKINS, (None, 0.0, 1.0)):
            options = ["--bands", "420:740:2", "--json"] + (
                ["--gamma", gamma] if gamma is not None else []
            )
            rows = self.run_ok("coefficients", *skin_options(Cm, Bm, Ch), *options).json()
            by_nm = {x["wavelength_nm"]: x for x in rows}
            self.assertEqual(sorted(by_nm), list(range(420, 741, 2)))
            for nm, blood in BLOOD.items():
                row, what = by_nm[nm], f"{Cm} {Bm} {Ch} {nm} nm"
                self.assertEqual(list(row), COLUMNS)
                pheo, eu, base = melanin_and_base(nm)
                c, b, h = Decimal(Cm), Decimal(Bm), Decimal(Ch)
                g = Decimal("0.75") if gamma is None else Decimal(gamma)
                oxy, deoxy = map(Decimal, blood)
                epidermis = float(c * (b * eu + (1 - b) * pheo) + (1 - c) * base)
                dermis = float(h * (g * oxy + (1 - g) * deoxy) + (1 - h) * base)
                s = float(scattering(nm))
                self.assertClose(row["sigma_a_epidermis"], epidermis, relative=1e-9, what=what)
                self.assertClose(row["sigma_a_dermis"], dermis, relative=4e-4, what=what)
                self.assertClose(row["sigma_s_prime_epidermis"], s, relative=1e-9, what=what)
                self.assertClose(row["sigma_s_prime_dermis"], s / 2, relative=1e-9, what=what)

    def test_csv(self):
        options = skin_options(0.03, 0.7, 0.01)
        rows = self.run_ok("coefficients", *options).rows()
        objects = self.run_ok("coefficients", *options, "--json").json()
        self.assertEqual(self.run_ok("coefficients", *options, "--ndjson").ndjson(), objects)
        self.assertEqual([r["wavelength_nm"] for r in rows], [str(x) for x in range(380, 741, 10)])
        for row, object_ in zip(rows, objects):
            for name in COLUMNS:
                self.assertClose(float(row[name]), object_[name], relative=1e-8)


class Reflectance(Case):
    def values(self, model, skin, *options):
        options = (*skin_options(*skin), "--model", model, "--json", *options)
        (x,) = self.run_ok("reflectance", *options).json()
        self.assertEqual((x["spectrum"]["first_nm"], x["spectrum"]["step_nm"]), (380, 10))
        self.assertEqual(len(x["spectrum"]["values"]), 37)
        return x["spectrum"]["values"]

    def media(self, skin):
        """What `coefficients` says, as decimals; checked above."""
        for x in self.run_ok("coefficients", *skin_options(*skin), "--json").json():
            yield {name: Decimal(value) for name, value in x.items()}

    def test_two_layers(self):
        for skin, d, eta in itertools.product(SKINS, (0.0, 0.03, 0.08, 0.5), (1.0, 1.4)):
            options = ("--epidermis-mm", d, "--eta", eta)
            values = self.values("two-layer", skin, *options)
            for got, row in zip(values, self.media(skin)):
                expected = float(two_layer(row, Decimal(eta), Decimal(d)))
                self.assertClose(got, expected, relative=1e-9, what=f"{skin} {d} {eta}")

    def test_half_space(self):
        for skin, eta in itertools.product(SKINS, (1.0, 1.4, 2.0)):
            values = self.values("half-space", skin, "--eta", eta)
            for got, row in zip(values, self.media(skin)):
                expected = float(half_space(row, Decimal(eta)))
                self.assertClose(got, expected, relative=1e-12, what=f"{skin} {eta}")

    def test_is_a_spectrum_file(self):
        """Parameters first, 380..740 by 10, nine digits; the values of --json."""
        done = self.run_ok("reflectance", *skin_options(0.03, 0.7, 0.01))
        header = done.out.splitlines()[0].split(",")
        parameters = ["model", "Cm", "Bm", "Ch", "epidermis_mm", "specular"]
        self.assertEqual(header, parameters + [str(x) for x in range(380, 741, 10)])
        (row,) = done.rows()
        self.assertEqual(
            [row[x] for x in parameters], ["two-layer", "0.03", "0.7", "0.01", "0.08", "sce"]
        )
        for nm, x in zip(range(380, 741, 10), self.values("two-layer", (0.03, 0.7, 0.01))):
            self.assertClose(float(row[str(nm)]), x, relative=5e-9)
            self.assertLessEqual(len(row[str(nm)].lstrip("0.")), 9)

    def test_bands(self):
        done = self.run_ok(
            "reflectance", *skin_options(0.03, 0.7, 0.01), "--bands", "400.5:402.5:0.5"
        )
        header = done.out.splitlines()[0].split(",")[6:]
        self.assertEqual(header, ["400.5", "401", "401.5", "402", "402.5"])

    def test_paper_has_no_spectra(self):
        options = (*skin_options(0.03, 0.7, 0.01), "--model", "paper")
        self.refused(2, "reflectance", *options, says=("'paper'", "no spectra", "two-layer"))

    def test_monte_carlo(self):
        """Walks against the table of adding-doubling, and the error they state themselves."""
        skin = skin_options(0.02, 0.5, 0.04)
        options = (*skin, "--model", "monte-carlo", "--epidermis-mm", 0.1)
        (x,) = self.run_ok("reflectance", *options, "--json").json()
        self.assertEqual((x["photons"], x["seed"]), (10000, 1))
        self.assertEqual(len(x["standard_error"]), 37)
        with open("tests/reference/transport_64.csv", encoding="ascii") as f:
            rows = csv.DictReader(line for line in f if not line.startswith("#"))
            (row,) = [
                r
                for r in rows
                if [r[k] for k in ("Cm", "Bm", "Ch", "epidermis_mm")] == ["0.02", "0.5", "0.04", "0.1"]
            ]
        squares = 0.0
        for i, (R, error) in enumerate(zip(x["spectrum"]["values"], x["standard_error"])):
            self.assertTrue(0.0005 < error < 0.005)
            squares += ((R - float(row[str(380 + 10 * i)])) / error) ** 2
        self.assertTrue(14.0 < squares < 70.0, squares)  # 37 bands: 0.1 % on either side

        (more,) = self.run_ok("reflectance", *options, "--photons", 40000, "--json").json()
        ratio = sum(x["standard_error"]) / sum(more["standard_error"])
        self.assertTrue(1.8 < ratio < 2.2, ratio)
        (other,) = self.run_ok("reflectance", *options, "--seed", 2, "--json").json()
        self.assertNotEqual(other["spectrum"], x["spectrum"])

    def test_monte_carlo_csv(self):
        options = (*skin_options(0.03, 0.7, 0.01), "--bands", "400:420:10", "--photons", 1000)
        options += ("--model", "monte-carlo")
        (row,) = self.run_ok("reflectance", *options).rows()
        (x,) = self.run_ok("reflectance", *options, "--json").json()
        for i, nm in enumerate(("400", "410", "420")):
            self.assertClose(float(row[nm]), x["spectrum"]["values"][i], relative=5e-9)
            error = float(row["standard_error_" + nm])
            self.assertClose(error, x["standard_error"][i], relative=5e-3)

    def test_walks_are_monte_carlos(self):
        options = skin_options(0.03, 0.7, 0.01)
        for given in (("--photons", 1000), ("--seed", 2)):
            for model in ((), ("--model", "kubelka-munk")):
                says = (given[0], "monte-carlo only", model[-1] if model else "two-layer")
                self.refused(2, "reflectance", *given, *options, *model, says=says)
        options += ("--model", "monte-carlo")
        for option, text in itertools.product(("--photons", "--seed"), ("-1", "1.5", "x", "1e99", "")):
            self.refused(2, "reflectance", *options, f"{option}={text}", says=(option, text))
        for text in ("0", "1"):
            self.refused(2, "reflectance", *options, "--photons", text, says="2..1099511627776")

    def test_usage(self):
        for command in ("reflectance", "coefficients"):
            good = {"--cm": "0.03", "--bm": "0.7", "--ch": "0.01"}
            for missing in good:
                options = [f"{k}={v}" for k, v in good.items() if k != missing]
                self.refused(2, command, *options, says=f"{missing} is missing")
            for option, text in itertools.product(
                good, ("-0.1", "1.1", "nan", "x", "", "0,5", "50%")
            ):
                options = [f"{k}={v}" for k, v in {**good, option: text}.items()]
                done = self.refused(2, command, *options, says=(option, text))
                self.assertEqual(done.out, "")
            options = [f"{k}={v}" for k, v in good.items()]
            for bands in (
                "400",
                "400:700",
                "400:700:0",
                "400:700:-10",
                "700:400:10",
                "400:705:10",
                "100:700:10",
                "400:2000:10",
                "a:b:c",
                "400:700:0.01",
            ):
                self.refused(2, command, *options, f"--bands={bands}", says=("--bands", bands))
            self.refused(2, command, *options, "7", says="'7'")
        self.refused(
            2, "reflectance", "--model", "magic", says=("'magic'", "half-space, kubelka-munk, two-layer")
        )


if __name__ == "__main__":
    main()
