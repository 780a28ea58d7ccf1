#!/usr/bin/env python3
"""Linear colours of the chromophores for the paper's own mode (src/optics/paper.c).

Reads the CIE 1931 functions (cmf_1nm.csv) and haemoglobin (hemoglobin.csv) from
the folder given, default ../shared/figures, and prints the six rows of constants.
"""
import csv
import math
import sys

FOLDER = sys.argv[1] if len(sys.argv) > 1 else "../shared/figures"
BANDS = range(380, 741, 10)
M = [[3.2410, -1.5374, -0.4986], [-0.9692, 1.8760, 0.0416], [0.0556, -0.2040, 1.0570]]
S, XW, ZW = 1.01468, 0.950844, 1.08845


def table(name):
    with open(f"{FOLDER}/{name}") as f:
        return {int(r["wavelength_nm"]): r for r in csv.DictReader(f)}


cmf, blood = table("cmf_1nm.csv"), table("hemoglobin.csv")
SPECTRA = {
    "eumelanin": lambda nm: 6.6e10 * nm**-3.33,
    "pheomelanin": lambda nm: 2.9e14 * nm**-4.75,
    "base": lambda nm: 0.0244 + 8.53 * math.exp(-(nm - 154) / 66.2),
    "oxy": lambda nm: float(blood[nm]["epsilon_HbO2_cm-1_M-1"]) / 1000,
    "deoxy": lambda nm: float(blood[nm]["epsilon_Hb_cm-1_M-1"]) / 1000,
    "scattering": lambda nm: 14.74 * nm**-0.22 + 2.2e11 * nm**-4,
}


def linear(spectrum):
    """Equal-energy XYZ over the sum of ybar, white balance, matrix."""
    ybar = sum(float(cmf[nm]["ybar_2deg"]) for nm in BANDS)
    X, Y, Z = (
        sum(spectrum(nm) * float(cmf[nm][f"{axis}bar_2deg"]) for nm in BANDS) / ybar
        for axis in "xyz"
    )
    return [S * (m[0] * X * XW + m[1] * Y + m[2] * Z * ZW) for m in M]


for name, spectrum in SPECTRA.items():
    print(f"static const double {name}[3] = {{ %.11f, %.11f, %.11f }};" % tuple(linear(spectrum)))
