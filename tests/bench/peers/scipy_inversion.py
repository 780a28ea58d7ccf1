"""scipy_inversion.py - scipy's bounded least squares: Cm, Bm and Ch from 31 bands.

    python3 scipy_inversion.py [SPECTRA]

least_squares() by its two methods that take bounds, with derivatives, from starts a third off, over
numpy arrays of all bands; what does not change with the skin is computed beforehand.  The quicker
method counts.  build/bench/inversion (refine_many_run(), "together") runs before and after, and
the ratio of the medians is printed beside the bar.
"""

import math
import os
import random
import statistics
import subprocess
import sys
import time

import numpy as np
import scipy
from scipy.optimize import least_squares

BUILD = os.environ.get("BUILD", "build")
BAR = 500.0
NOISE = 0.003

LO, HI = np.array([0.0, 0.0, 0.001]), np.array([0.5, 1.0, 0.1])


def coefficients(Cm, Bm, Ch):
    """Both layers' coefficients of a skin at 400..700 nm by 10, as the program has them."""
    command = [f"{BUILD}/skinspec", "coefficients", "--cm", str(Cm), "--bm", str(Bm), "--ch", str(Ch)]
    out = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60).stdout
    rows = [[float(x) for x in line.split(",")] for line in out.split("\n") if line[:1].isdigit()]
    return np.array([row for row in rows if 400.0 <= row[0] <= 700.0 and row[0] % 10 == 0])


class Skin:
    """What absorbs, and the surface."""

    def __init__(self):
        table = coefficients(1, 1, 1)
        self.eumelanin, self.blood, self.ss = table[:, 1], table[:, 2], table[:, 3]
        self.pheomelanin = coefficients(1, 0, 1)[:, 1]
        self.base = coefficients(0, 0, 0.5)[:, 1]
        F = -1.440 / 1.4**2 + 0.710 / 1.4 + 0.668 + 0.0636 * 1.4
        self.A, self.entering, self.d = (1 + F) / (1 - F), 1 - (0.4 / 2.4) ** 2, 0.08

    def absorption(self, x):
        """sigma_a of either layer, and its derivatives: by Cm, Bm and by Ch."""
        melanin = x[1] * self.eumelanin + (1 - x[1]) * self.pheomelanin
        sa1 = x[0] * melanin + (1 - x[0]) * self.base
        sa2 = x[2] * self.blood + (1 - x[2]) * self.base
        blend = self.eumelanin - self.pheomelanin
        return sa1, sa2, melanin - self.base, x[0] * blend, self.blood - self.base


def half_space(skin, x):
    """R and J, Eq. 9."""
    sa1, sa2, by_Cm, by_Bm, by_Ch = skin.absorption(x)
    sa = sa1 + sa2
    st = sa + skin.ss
    mu, s, steeper = skin.ss / st, np.sqrt(3 * sa / st), 1 + 4 / 3 * skin.A
    slow, fast = np.exp(-s), np.exp(-steeper * s)
    g, half = slow + fast, 0.5 * skin.entering
    by = half * (-skin.ss / st**2 * g - mu * (slow + steeper * fast) * 1.5 * skin.ss / st**2 / s)
    return half * mu * g, np.stack([by * by_Cm, by * by_Bm, by * by_Ch], 1)


def two_layer(skin, x):
    """R and J, the textbook form of two-layer diffusion (docs/physics.md)."""
    sa1, sa2, by_Cm, by_Bm, by_Ch = skin.absorption(x)
    A, d, ss1, ss2 = skin.A, skin.d, skin.ss, 0.5 * skin.ss
    st1, st2 = sa1 + ss1, sa2 + ss2
    k1, k2 = np.sqrt(3 * sa1 * st1), np.sqrt(3 * sa2 * st2)
    u1, u2 = k1 / (3 * st1), k2 / (3 * st2)
    rho, T, t, z = (u1 - u2) / (u1 + u2), np.exp(-st1 * d), np.exp(-k1 * d), (k1 - st1) * d
    grown = np.expm1(z)
    E = grown / z
    tt, Tt = t * t, T * t
    direct, beneath = (1 - Tt) / (st1 + k1), Tt * (1 + rho) / (st2 + k2)
    N = ss1 * (direct + rho * tt * d * E) + ss2 * beneath
    L = 1 + 2 * A * u1 + rho * tt * (1 - 2 * A * u1)
    R = N / L
    # By sigma_a of the epidermis.
    k1_ = 1.5 * (st1 + sa1) / k1
    u1_ = (k1_ / 3 - u1) / st1
    rho_ = 2 * u1_ * u2 / (u1 + u2) ** 2
    T_, t_, E_ = -d * T, -d * k1_ * t, (grown + 1 - E) / z * (k1_ - 1) * d
    direct_ = -(T_ * t + T * t_ + direct * (1 + k1_)) / (st1 + k1)
    back_ = d * (rho_ * tt * E + 2 * rho * t * t_ * E + rho * tt * E_)
    beneath_ = ((T_ * t + T * t_) * (1 + rho) + Tt * rho_) / (st2 + k2)
    L_ = 2 * A * u1_ + (rho_ * tt + 2 * rho * t * t_) * (1 - 2 * A * u1) - 2 * A * u1_ * rho * tt
    by1 = skin.entering * (ss1 * (direct_ + back_) + ss2 * beneath_ - R * L_) / L
    # And of the dermis.
    k2_ = 1.5 * (st2 + sa2) / k2
    rho_ = -2 * u1 * (k2_ / 3 - u2) / st2 / (u1 + u2) ** 2
    beneath_ = Tt * rho_ / (st2 + k2) - beneath * (1 + k2_) / (st2 + k2)
    by2 = skin.entering * (ss1 * d * rho_ * tt * E + ss2 * beneath_ - R * rho_ * tt * (1 - 2 * A * u1)) / L
    return skin.entering * R, np.stack([by1 * by_Cm, by1 * by_Bm, by2 * by_Ch], 1)


def check_derivatives(skin, model):
    """A slope that is wrong would make scipy slow: against differences."""
    x, h = np.array([0.05, 0.4, 0.02]), 1e-6
    for i in range(3):
        step = h * np.eye(3)[i]
        difference = (model(skin, x + step)[0] - model(skin, x - step)[0]) / (2 * h)
        if np.max(np.abs(difference - model(skin, x)[1][:, i])) > 1e-5 * np.max(np.abs(difference)):
            sys.exit("scipy-inversion: a derivative is wrong")


def spectra(skin, model, n):
    """As build/bench/inversion makes them: skins, noise, and starts a third off."""
    dice = random.Random(11)
    for _ in range(n):
        x = np.array([math.exp(dice.uniform(math.log(0.005), math.log(0.2))), dice.uniform(0, 1),
                      math.exp(dice.uniform(math.log(0.001), math.log(0.1)))])
        R = model(skin, x)[0] + NOISE * np.array([dice.gauss(0, 1) for _ in skin.ss])
        off = dice.uniform(0.7, 1.4), dice.uniform(-0.15, 0.15), dice.uniform(0.7, 1.4)
        start = np.array([x[0] * off[0], x[1] + off[1], x[2] * off[2]])
        yield R, np.minimum(np.maximum(start, LO + 1e-9), HI - 1e-9)


def time_method(skin, model, method, n):
    """Microseconds a spectrum, median, and the mean chi-square."""
    took, chi_square = [], []
    for R, start in spectra(skin, model, n):
        # R and J of one place are computed together and asked for one after the other.
        last = {}

        def residual(x):
            last["x"], last["J"] = x.copy(), None
            fitted, last["J"] = model(skin, x)
            return (fitted - R) / NOISE

        def jacobian(x):
            if not np.array_equal(last["x"], x):
                residual(x)
            return last["J"] / NOISE

        begin = time.thread_time()
        answer = least_squares(residual, start, jac=jacobian, bounds=(LO, HI), method=method,
                               x_scale=[0.05, 0.3, 0.02], ftol=1e-9, xtol=1e-9, gtol=None)  # fmt: skip
        took.append(1e6 * (time.thread_time() - begin))
        chi_square.append(2 * answer.cost)
    return statistics.median(took), statistics.mean(chi_square)


def ours():
    """Microseconds a spectrum, all together: half-space, two-layer."""
    command = [f"{BUILD}/bench/inversion", "1000", "7"]  # ends with 1 where a bar of its own is missed
    out = subprocess.run(command, check=False, capture_output=True, text=True, timeout=300).stdout
    lines = [line.split() for line in out.split("\n") if line.strip().startswith("together")]
    return [float(line[1]) for line in lines[:2]]


def main():
    n = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    skin, runs, figures = Skin(), [ours()], []
    for model in (half_space, two_layer):
        check_derivatives(skin, model)
        methods = ("trf", "dogbox")
        figures.append(min((*time_method(skin, model, method, n), method) for method in methods))
    runs.append(ours())
    print(f"{n} spectra, medians; scipy {scipy.__version__}, numpy {np.__version__}; bar {BAR:.0f}")
    for i, name in enumerate(("half-space: Cm, Bm, Ch", "two-layer: Cm, Bm, Ch")):
        us, chi_square, method = figures[i]
        together = statistics.mean(run[i] for run in runs)
        met = "met" if us / together >= BAR else "MISSED"
        print(f"  {name:30} {together:7.3f} us  scipy ({method}) {us:7.0f} us  {us / together:6.0f}  {met}")
        print(f"    scipy's mean chi^2 {chi_square:.1f}")


main()
