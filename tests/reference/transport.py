"""Radiative transfer in skin by adding and doubling: the reference for the tests.

Written from the equations; shares no code with src/.

Medium: plane layers of one refractive index, scattering isotropically (the
reduced coefficients stand for the anisotropic ones, g = 0), under a smooth
surface of relative index n.  Light: collimated, along the normal.  Result:
diffuse reflectance per incident light, that is without the specular part
Rs = ((n-1)/(n+1))^2 but with its loss, 1 - Rs, at entry.

Sources
  van de Hulst, Multiple Light Scattering (1980): adding, doubling, H functions
  Chandrasekhar, Radiative Transfer (1950): H functions, the half space
  Prahl, van Gemert, Welch, Appl. Opt. 32, 559 (1993): quadrature, boundaries
  Moon, Lee, Chin, Physiological Parameters for Skin Rendering Using
      Spectrophotometer: tissue coefficients, Eqs. 1-6

Every operator is a matrix of *flux fractions*: R[i, j] is the part of the flux
entering in direction j that leaves in direction i.  Then layers follow each
other as plain matrix products, and a column sums to what is not absorbed.
Arrays carry their cases (wavelengths, tissues) in the leading axes.

    transport.py --check [FOLDER]     compare with published figures
    transport.py --convergence        change with the number of directions
    transport.py --table FILE         write transport_64.csv
    transport.py --skins FILE         write transport_skins.csv
"""

import argparse
import csv
import itertools
import os
import re
import sys
from collections import namedtuple

import numpy as np

ETA = 1.4            # skin against air
NODES = 64           # directions in one hemisphere
THIN = 1e-5          # optical thickness from which slabs are doubled
BANDS = np.arange(380.0, 741.0, 10.0)
FIGURES = "../shared/figures"

Quadrature = namedtuple("Quadrature", "n mu weight inside_reflectance specular")


# --- Directions and surface --------------------------------------------------

def gauss(count, low, high):
    """Gauss-Legendre points and weights on [low, high]."""
    x, w = np.polynomial.legendre.leggauss(count)
    half = 0.5 * (high - low)
    return low + half * (x + 1.0), half * w


def radau(count, low, high):
    """Radau points and weights on [low, high], `high` being one of them.

    With the node x = 1 given, the others are Gauss points for the weight
    (1-x), from the eigenvalues of its Jacobi matrix (Golub and Welsch):
    diagonal -1/((2k+1)(2k+3)), beside it sqrt(k(k+1))/(2k+1).  Their weights
    are divided by (1-x) again; the given node has 2/count^2.
    """
    k = np.arange(count - 1.0)
    beside = np.sqrt(k[1:] * (k[1:] + 1.0)) / (2.0 * k[1:] + 1.0)
    jacobi = np.diag(-1.0 / ((2.0 * k + 1.0) * (2.0 * k + 3.0)))
    jacobi += np.diag(beside, 1) + np.diag(beside, -1)
    x, vectors = np.linalg.eigh(jacobi)
    w = 2.0 * vectors[0] ** 2 / (1.0 - x)
    half = 0.5 * (high - low)
    return (low + half * (np.append(x, 1.0) + 1.0),
            half * np.append(w, 2.0 / count ** 2))


def fresnel_inside(mu, n):
    """Unpolarised reflectance of the surface for light coming from inside at
    cosine mu: 1 below the critical cosine.  Fresnel's equations with Snell's
    law, sin(outside) = n sin(inside)."""
    sin2_out = n * n * (1.0 - mu * mu)
    mu_out = np.sqrt(np.maximum(0.0, 1.0 - sin2_out))
    perpendicular = (n * mu - mu_out) / (n * mu + mu_out)
    parallel = (mu - n * mu_out) / (mu + n * mu_out)
    r = 0.5 * (perpendicular ** 2 + parallel ** 2)
    return np.where(sin2_out >= 1.0, 1.0, r)


def quadrature(n=ETA, count=NODES):
    """Directions for relative index n: half the points Gauss below the critical
    cosine mu_c = sqrt(1 - 1/n^2), half Radau above it, so that the kink of the
    Fresnel curve lies between the halves and the last node is the normal."""
    if n == 1.0:
        mu, weight = radau(count, 0.0, 1.0)
    else:
        mu_c = np.sqrt(1.0 - 1.0 / (n * n))
        low, high = gauss(count // 2, 0.0, mu_c), radau(count - count // 2, mu_c, 1.0)
        mu, weight = np.append(low[0], high[0]), np.append(low[1], high[1])
    specular = ((n - 1.0) / (n + 1.0)) ** 2
    return Quadrature(n, mu, weight, fresnel_inside(mu, n), specular)


# --- Layers without surface --------------------------------------------------

def half_space(albedo, q, tolerance=1e-14):
    """R of a half space of the given single-scattering albedo a.

    R[i,j] = a/2 w_i mu_i H_i H_j / (mu_i + mu_j), H from Chandrasekhar's
    1/H(mu) = sqrt(1-a) + a/2 sum_j w_j mu_j H_j / (mu + mu_j),
    iterated; the mean of two successive iterates settles fast.
    """
    a = np.asarray(albedo, float)[..., None]
    kernel = q.weight * q.mu / (q.mu[:, None] + q.mu)
    H = np.ones(a.shape[:-1] + q.mu.shape)
    for _ in range(10000):
        new = 1.0 / (np.sqrt(1.0 - a) + 0.5 * a * (H @ kernel.T))
        change = np.max(np.abs(new - H))
        H = 0.5 * (H + new)
        if change < tolerance * np.max(H):
            break
    else:
        raise ArithmeticError("the H function did not settle")
    return 0.5 * a[..., None] * kernel.T * H[..., :, None] * H[..., None, :]


def thin_slab(tau, albedo, q):
    """R and T of a slab much thinner than every cosine in use.

    Light scattered once, attenuation in and out exact:
    R[i,j] = a/2 w_i mu_i (1 - exp(-tau/mu_i - tau/mu_j)) / (mu_i + mu_j)
    T[i,j] = a/2 w_i mu_i (exp(-tau/mu_i) - exp(-tau/mu_j)) / (mu_i - mu_j)
             + what went straight through, exp(-tau/mu_j) where i = j
    T's quotient is written as exp(-tau/mu_j) tau/(mu_i mu_j) E(y) with
    E(y) = (e^y - 1)/y, y = tau/mu_j - tau/mu_i, which has no 0/0 but E(0) = 1.

    Light scattered again: in so thin a slab scattered light starts evenly from
    all depths, so a part P = sum w (1 - (mu/tau)(1 - exp(-tau/mu))) of it meets
    the medium again, of which a is scattered: once becomes 1/(1 - a P).
    Without this factor the error grows as THIN log(THIN), with it as THIN^2.
    """
    tau = np.asarray(tau, float)[..., None, None]
    a = np.asarray(albedo, float)[..., None, None]
    w_i, mu_i, mu_j = q.weight[:, None], q.mu[:, None], q.mu[None, :]
    again = np.sum(q.weight * (1.0 + mu_j / tau * np.expm1(-tau / mu_j)), axis=-1)
    scattered = 0.5 * a * w_i / (1.0 - a * again[..., None])
    straight = np.exp(-tau / mu_j)
    y = tau * (mu_i - mu_j) / (mu_i * mu_j)
    E = np.where(y == 0.0, 1.0, np.expm1(y) / np.where(y == 0.0, 1.0, y))
    R = -scattered * mu_i * np.expm1(-tau / mu_i - tau / mu_j) / (mu_i + mu_j)
    T = scattered * tau / mu_j * straight * E
    return R, T + straight * np.eye(len(q.mu))


def slab(tau, albedo, q, thin=THIN):
    """R and T of a homogeneous slab of optical thickness tau, by doubling:

    between = (1 - R R)^-1 T, what goes down between the two halves after all
    reflections there;  R <- R + T R between;  T <- T between.

    All cases are doubled equally often, from tau/2^k <= thin.
    """
    tau, albedo = np.broadcast_arrays(np.asarray(tau, float), np.asarray(albedo, float))
    times = max(0, int(np.ceil(np.log2(np.max(tau) / thin))))
    R, T = thin_slab(tau / 2.0 ** times, albedo, q)
    one = np.eye(len(q.mu))
    for _ in range(times):
        between = np.linalg.solve(one - R @ R, T)
        R, T = R + T @ (R @ between), T @ between
    return R, T


def slab_over(R_slab, T_slab, R_below):
    """R of a slab lying on something that reflects R_below, same index:
    R + T (1 - R_below R)^-1 R_below T."""
    one = np.eye(R_slab.shape[-1])
    up = np.linalg.solve(one - R_below @ R_slab, R_below @ T_slab)
    return R_slab + T_slab @ up


# --- Surface on top ----------------------------------------------------------

def diffuse_reflectance(R, q):
    """What leaves through the surface of a medium reflecting R inside, per
    incident light along the normal, without the specular part.

    Inside, just below the surface: down = (1-Rs) e_normal + r up, up = R down;
    out = sum (1 - r) up.
    """
    start = (1.0 - q.specular) * R[..., :, -1]
    up = np.linalg.solve(np.eye(len(q.mu)) - R * q.inside_reflectance, start[..., None])
    return np.sum((1.0 - q.inside_reflectance) * up[..., 0], axis=-1)


def reflectance_half_space(albedo, q):
    """Case (a): a half space under the surface."""
    return diffuse_reflectance(half_space(albedo, q), q)


def reflectance_slab(tau, albedo, q):
    """A free slab: the surface of index n on both faces."""
    below = np.diag(q.inside_reflectance)
    return diffuse_reflectance(slab_over(*slab(tau, albedo, q), below), q)


def reflectance_two_layers(epidermis, d_mm, dermis, q):
    """Case (b): an epidermis of thickness d_mm over endless dermis; each layer
    a pair (sigma_a, sigma_s') in mm^-1."""
    tau, albedo = optical(epidermis, d_mm)
    R, T = slab(tau, albedo, q)
    return diffuse_reflectance(slab_over(R, T, half_space(optical(dermis)[1], q)), q)


# --- Tissue, Eqs. 1-6 --------------------------------------------------------

def read_haemoglobin():
    """Columns wavelength nm, oxy, deoxy: molar extinction in cm^-1/M.

    The project's transcription of Prahl's table: data, shared on purpose, where
    everything that is done with them is written again."""
    row = re.compile(r"\{ (\S+), (\S+) \}, /\* (\S+) nm")
    with open(os.path.join(os.path.dirname(__file__), "../../src/optics/haemoglobin_table.c")) as f:
        found = [row.search(line) for line in f]
    return np.array([[m[3], m[1], m[2]] for m in found if m], float).T


def haemoglobin_sigma_a(nm, table):
    """Absorption of oxy- and deoxygenated whole blood, mm^-1: 150 g/l of
    64 500 g/mol, decadic to natural by 2.303, cm^-1 to mm^-1 by 10; linear
    between the table's points."""
    scale = 2.303 * 150.0 / 64500.0 / 10.0
    return (scale * np.interp(nm, table[0], table[1]),
            scale * np.interp(nm, table[0], table[2]))


def base_sigma_a(nm):
    return 0.0244 + 8.53 * np.exp(-(nm - 154.0) / 66.2)


def scattering(nm):
    """Reduced scattering of the epidermis, Eq. 6; the dermis has half of it."""
    return 14.74 * nm ** -0.22 + 2.2e11 * nm ** -4.0


def epidermis_layer(nm, Cm, Bm):
    """(sigma_a, sigma_s'): melanin fraction Cm, of it eumelanin Bm."""
    eumelanin, pheomelanin = 6.6e10 * nm ** -3.33, 2.9e14 * nm ** -4.75
    melanin = Bm * eumelanin + (1.0 - Bm) * pheomelanin
    return Cm * melanin + (1.0 - Cm) * base_sigma_a(nm), scattering(nm)


def dermis_layer(nm, Ch, table, saturation=0.75):
    """(sigma_a, sigma_s'): blood fraction Ch of the given oxygen saturation."""
    oxy, deoxy = haemoglobin_sigma_a(nm, table)
    blood = saturation * oxy + (1.0 - saturation) * deoxy
    return Ch * blood + (1.0 - Ch) * base_sigma_a(nm), 0.5 * scattering(nm)


def optical(layer, d_mm=np.inf):
    """Optical thickness and single-scattering albedo of a layer."""
    sigma_a, sigma_s = layer
    return (sigma_a + sigma_s) * d_mm, sigma_s / (sigma_a + sigma_s)


def skin(Cm, Bm, Ch, d_mm, nm, table, q):
    """Diffuse reflectance spectrum of one skin."""
    return reflectance_two_layers(epidermis_layer(nm, Cm, Bm), d_mm,
                                  dermis_layer(nm, Ch, table), q)


# --- The table of cases ------------------------------------------------------

EPIDERMIS_MM = (0.03, 0.06, 0.08, 0.1, 0.15)
BLOOD = (0.001, 0.01, 0.04, 0.1)
MELANIN = [(0.0, 0.0)] + list(itertools.product((0.001, 0.005, 0.02, 0.06, 0.15, 0.3, 0.5),
                                                (0.0, 0.5, 1.0)))


def factorial(table, q, nm=BANDS, melanin=MELANIN, blood=BLOOD, thickness=EPIDERMIS_MM):
    """{(Cm, Bm, Ch, d): spectrum} of all combinations.  A dermis serves all
    epidermises over it, an epidermis all dermises under it."""
    below = {Ch: half_space(optical(dermis_layer(nm, Ch, table))[1], q) for Ch in blood}
    spectra = {}
    for (Cm, Bm), d in itertools.product(melanin, thickness):
        R, T = slab(*optical(epidermis_layer(nm, Cm, Bm), d), q)
        for Ch in blood:
            spectra[Cm, Bm, Ch, d] = diffuse_reflectance(slab_over(R, T, below[Ch]), q)
    return spectra


def worst(spectra, others):
    return max(np.max(np.abs(spectra[key] - others[key])) for key in spectra)


def write_table(path, table):
    """transport_64.csv: the factorial with 64 directions, and what changes
    against 32."""
    spectra = factorial(table, quadrature(count=NODES))
    change = worst(spectra, factorial(table, quadrature(count=NODES // 2)))
    with open(path, "w") as f:
        f.write("# Diffuse reflectance of two-layer skin per incident light, without the specular part.\n"
                "# Epidermis over endless dermis, index %g, normal incidence, isotropic reduced scattering.\n"
                "# Made by: tests/reference/transport.py --table tests/reference/transport_64.csv\n"
                "# Adding-doubling with %d directions in the hemisphere; with %d no value differs by more than %.1e.\n"
                % (ETA, NODES, NODES // 2, change))
        f.write(",".join(["Cm", "Bm", "Ch", "epidermis_mm"] + ["%d" % nm for nm in BANDS]) + "\n")
        for key in sorted(spectra):
            f.write(",".join(["%g" % x for x in key] + ["%.6f" % x for x in spectra[key]]) + "\n")
    print("%s: %d spectra; %d -> %d directions: at most %.2e"
          % (path, len(spectra), NODES // 2, NODES, change))


def write_skins(path, table, count=60):
    """transport_skins.csv: random skins, seeded, with 64 directions.  Blood and
    thickness spread by their logarithms."""
    rng = np.random.default_rng(20140401)
    q = quadrature(count=NODES)
    with open(path, "w") as f:
        f.write("# Diffuse reflectance of random two-layer skins, as in transport_64.csv, %d directions.\n"
                "# Made by: tests/reference/transport.py --skins tests/reference/transport_skins.csv\n" % NODES)
        f.write(",".join(["Cm", "Bm", "Ch", "epidermis_mm"] + ["%d" % nm for nm in BANDS]) + "\n")
        for _ in range(count):
            Cm, Bm = 0.5 * rng.random() ** 2, rng.random()
            Ch, d_mm = 10.0 ** rng.uniform(-3.0, -1.0), 10.0 ** rng.uniform(-1.7, -0.7)
            values = [float("%.6g" % x) for x in (Cm, Bm, Ch, d_mm)]
            R = skin(*values, BANDS, table, q)
            f.write(",".join(["%.6g" % x for x in values] + ["%.8f" % x for x in R]) + "\n")


# --- Checks ------------------------------------------------------------------

def check_grid(folder):
    """Worst difference from the g = 0 rows of transport_reference_grid.csv
    (column UR1_diffuse), printed by geometry and index; True where all of it
    lies within the row's own stated error and half of its last digit, plus ours."""
    groups = {}
    with open(os.path.join(folder, "transport_reference_grid.csv")) as f:
        for row in csv.DictReader(f):
            if float(row["g"]) == 0.0:
                groups.setdefault((row["geometry"], float(row["n_rel"])), []).append(row)
    largest = 0.0
    for (geometry, n), rows in groups.items():
        column = {name: np.array([float(r[name]) for r in rows])
                  for name in ("albedo", "tau", "UR1_diffuse", "convergence_err")}
        q = quadrature(n)
        if geometry == "semi":
            R = reflectance_half_space(column["albedo"], q)
        else:
            R = reflectance_slab(column["tau"], column["albedo"], q)
        error = np.abs(R - column["UR1_diffuse"])
        largest = max(largest, error.max())
        print("%-4s n %-4g %3d rows: worst difference %.2e (their stated error up to %.1e)"
              % (geometry, n, len(rows), error.max(), column["convergence_err"].max()))
    return largest


def check_giovanelli():
    """Half space, n = 1.5, a = 0.9: 0.2600 with the specular 0.0400."""
    q = quadrature(1.5)
    R = float(reflectance_half_space(0.9, q))
    print("Giovanelli half space: %.4f, of which specular %.4f (published 0.2600, 0.0400)"
          % (R + q.specular, q.specular))
    return abs(R + q.specular - 0.26)


def check_half_space():
    """The H function against a slab doubled to thickness 80, and energy: with
    nothing absorbed all light must return."""
    q = quadrature()
    by_doubling = diffuse_reflectance(slab(80.0, 0.9, q)[0], q)
    difference = abs(float(by_doubling - reflectance_half_space(0.9, q)))
    lost = abs(1.0 - q.specular - float(reflectance_half_space(1.0, q)))
    print("half space by H function against doubling: %.1e; lost when nothing absorbs: %.1e"
          % (difference, lost))
    return max(difference, lost)


def check(folder):
    """Exit status of --check.  The grid states errors up to 1e-5 and prints six
    decimals; four decimals are published of Giovanelli's value."""
    good = check_grid(folder) < 1e-5
    good &= check_giovanelli() < 1e-4
    good &= check_half_space() < 1e-8
    print("check: %s" % ("good" if good else "FAILED"))
    return 0 if good else 1


def show_convergence(table):
    """Change with the number of directions on 444 values: six tissues, two
    thicknesses, 37 wavelengths."""
    tissues = [(0.005, 1, 0.001), (0.03, 0.7, 0.01), (0.03, 0.5, 0.1),
               (0.1, 0.3, 0.05), (0.3, 0, 0.1), (0.4, 1, 0.01)]
    spectra = {}
    for count in (128, 64, 32, 16, 8, 4):
        q = quadrature(count=count)
        spectra[count] = np.array([skin(*c, d, BANDS, table, q)
                                   for c in tissues for d in (0.06, 0.1)])
        error = spectra[count] - spectra[128]
        print("%3d directions: rms %.1e, max %.1e from 128; R %.4f .. %.4f"
              % (count, np.sqrt(np.mean(error ** 2)), np.max(np.abs(error)),
                 spectra[count].min(), spectra[count].max()), flush=True)


def main():
    parser = argparse.ArgumentParser(description="adding-doubling reference for skin")
    task = parser.add_mutually_exclusive_group(required=True)
    task.add_argument("--check", nargs="?", const=FIGURES, metavar="FOLDER",
                      help="compare with published figures (default %(const)s)")
    task.add_argument("--convergence", action="store_true",
                      help="change with the number of directions")
    task.add_argument("--table", metavar="FILE", help="write transport_64.csv")
    task.add_argument("--skins", metavar="FILE", help="write transport_skins.csv")
    options = parser.parse_args()
    if options.check:
        return check(options.check)
    table = read_haemoglobin()
    if options.convergence:
        show_convergence(table)
    elif options.skins:
        write_skins(options.skins, table)
    else:
        write_table(options.table, table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
