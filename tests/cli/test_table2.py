#!/usr/bin/env python3
"""test_table2.py - `skinspec table2` against the paper's print, and against decimals."""

import decimal
from decimal import ROUND_HALF_UP, Decimal

from support import Case, main

decimal.getcontext().prec = 30

CM = ("0.005", "0.03", "0.1", "0.3", "0.4")

# Transcribed from the paper: (Bm, Ch) and the rows R, G, B under the five Cm.
PRINTED = {
    ("1", "0.001"): """0.3016 0.1542 0.0951 0.0605 0.0537
                       0.2319 0.1258 0.0792 0.0509 0.0452
                       0.1795 0.1092 0.0709 0.0462 0.0412""",
    ("0.7", "0.01"): """0.2566 0.1577 0.1018 0.0658 0.0585
                        0.1937 0.1250 0.0821 0.0536 0.0477
                        0.1289 0.0981 0.0693 0.0467 0.0418""",
    ("0.3", "0.05"): """0.1643 0.1387 0.1055 0.0737 0.0663
                        0.1295 0.1080 0.0813 0.0565 0.0508
                        0.0785 0.0717 0.0598 0.0449 0.0409""",
    ("0", "0.1"): """0.1276 0.1197 0.1035 0.0803 0.0737
                     0.1023 0.0933 0.0777 0.0580 0.0529
                     0.0608 0.0580 0.0520 0.0422 0.0392""",
}
MISPRINT = ("0", "0.1", "R", "0.005")

# The chromophores as linear RGB, in hundredths: each spectrum (Eqs. 1-6, haemoglobin
# 0.75 oxygenated, eps/1000), 380..740 nm by 10, through the CIE 1931 functions with
# equal weights and the paper's scaled sRGB matrix.
LINEAR = {
    "eumelanin": ("24.235773", "51.094202", "103.928141"),
    "pheomelanin": ("8.531056", "28.685740", "79.760865"),
    "base": ("0.022427", "0.046269", "0.135368"),
    "blood": ("11.309853", "25.386997", "152.942107"),
    "scattering": ("4.554205", "6.220894", "9.755952"),
}


def coded(x):
    if x <= Decimal("0.0031308"):
        return Decimal("12.92") * x
    return Decimal("1.055") * (x.ln() / Decimal("2.4")).exp() - Decimal("0.055")


def expected(Bm, Ch, channel, Cm):
    """The paper's procedure: coefficients -> colour, then Eq. 9 per channel."""
    Bm, Ch, Cm, eta = Decimal(Bm), Decimal(Ch), Decimal(Cm), Decimal("1.4")
    em, pm, base, blood, s = (Decimal(LINEAR[x]["RGB".index(channel)]) / 100 for x in LINEAR)
    a = coded(Cm * (Bm * em + (1 - Bm) * pm) + (2 - Cm - Ch) * base + Ch * blood)
    s = coded(s)
    F_dr = Decimal("-1.44") / eta**2 + Decimal("0.71") / eta
    F_dr += Decimal("0.668") + Decimal("0.0636") * eta
    A = (1 + F_dr) / (1 - F_dr)
    root = (3 * a / (a + s)).sqrt()
    return s / (a + s) / 2 * (1 + (-4 * A * root / 3).exp()) * (-root).exp()


def entries():
    for (Bm, Ch), text in PRINTED.items():
        for channel, line in zip("RGB", text.splitlines()):
            for Cm, value in zip(CM, line.split()):
                yield Bm, Ch, channel, Cm, value


class Table2(Case):
    def test_59_of_60_are_as_printed(self):
        got = self.run_ok("table2", "--json").json()
        self.assertEqual(len(got), 60)
        different = []
        for object_, (Bm, Ch, channel, Cm, printed) in zip(got, entries()):
            self.assertEqual(set(object_), {"Bm", "Ch", "channel", "Cm", "printed", "computed"})
            place = [object_[x] for x in ("Bm", "Ch", "channel", "Cm")]
            self.assertEqual(place, [float(Bm), float(Ch), channel, float(Cm)])
            self.assertEqual(object_["printed"], float(printed))
            rounded = Decimal(object_["computed"]).quantize(Decimal("0.0001"), ROUND_HALF_UP)
            if rounded != Decimal(printed):
                different.append((Bm, Ch, channel, Cm))
        self.assertEqual(different, [MISPRINT])

    def test_all_60_match_decimals(self):
        """The constants have six decimals, base the fewest digits: good to about 7e-7."""
        got = self.run_ok("table2", "--json").json()
        for object_, (*place, _) in zip(got, entries()):
            x = float(expected(*place))
            self.assertClose(object_["computed"], x, absolute=1e-6, what=str(place))

    def test_plain_output_names_the_misprint(self):
        out = self.run_ok("table2").out
        self.assertIn("59 of 60", out)
        line = [x for x in out.splitlines() if "misprint" in x]
        self.assertEqual(len(line), 1)
        for text in ("R at Bm 0, Ch 0.1, Cm 0.005", "0.1276", "0.1280", "+0.0004"):
            self.assertIn(text, line[0])
        for *_, printed in entries():
            self.assertIn(printed, out)

    def test_one_object_a_line(self):
        lines = self.run_ok("table2", "--ndjson").ndjson()
        self.assertEqual(lines, self.run_ok("table2", "--json").json())

    def test_takes_no_argument(self):
        self.refused(2, "table2", "3", says="'3'")


if __name__ == "__main__":
    main()
