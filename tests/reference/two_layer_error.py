"""Two-layer diffusion, the closed form of the product, against transport_64.csv.

-D phi'' + sigma_a phi = sigma_s' exp(-tau(z)) in an epidermis of thickness d
over endless dermis, D = 1/(3 sigma_t'), phi(0) = 2 A D phi'(0), phi and D phi'
continuous at z = d; R = (1-Rs) phi(0) / (2A).  The surface constant A is that
of Jensen et al., A Practical Model for Subsurface Light Transport (2001), with
the sign and powers of the diffuse Fresnel reflectance as fitted for n >= 1.

    two_layer_error.py [TABLE]
"""

import argparse
import csv
import os

import numpy as np

import transport

BAR_RMS, BAR_MAX = 0.007, 0.02

# The twelve cases by which the models were first compared: Cm, Bm, Ch,
# each with d = 0.06 and 0.10 mm.
TWELVE = [(0.005, 1.0, 0.001), (0.03, 0.7, 0.01), (0.03, 0.5, 0.1),
          (0.1, 0.3, 0.05), (0.3, 0.0, 0.1), (0.4, 1.0, 0.01)]


def internal_reflection(eta):
    """A = (1 + F_dr)/(1 - F_dr) for eta >= 1."""
    F_dr = -1.440 / eta ** 2 + 0.710 / eta + 0.668 + 0.0636 * eta
    return (1.0 + F_dr) / (1.0 - F_dr)


def two_layer(epidermis, d, dermis, eta=transport.ETA):
    """R per incident light; layers are pairs (sigma_a, sigma_s') in mm^-1.

    k = sqrt(3 sigma_a sigma_t'), u = k/(3 sigma_t'), t = exp(-k1 d),
    T = exp(-sigma_t1' d), rho = (u1-u2)/(u1+u2), E(x) = (e^x - 1)/x,
    alpha = 1/(1 + 2 A u1 + rho t^2 (1 - 2 A u1)):
    R = (1-Rs) alpha { sigma_s1' [ (1 - T t)/(sigma_t1' + k1)
                                   + rho t^2 d E((k1 - sigma_t1') d) ]
                       + sigma_s2' T t (1 + rho)/(sigma_t2' + k2) }
    """
    (a1, s1), (a2, s2) = epidermis, dermis
    A, Rs = internal_reflection(eta), ((eta - 1.0) / (eta + 1.0)) ** 2
    t1, t2 = a1 + s1, a2 + s2
    k1, k2 = np.sqrt(3.0 * a1 * t1), np.sqrt(3.0 * a2 * t2)
    u1, u2 = k1 / (3.0 * t1), k2 / (3.0 * t2)
    t, T = np.exp(-k1 * d), np.exp(-t1 * d)
    rho = (u1 - u2) / (u1 + u2)
    alpha = 1.0 / (1.0 + 2.0 * A * u1 + rho * t * t * (1.0 - 2.0 * A * u1))
    x = (k1 - t1) * d
    E = np.where(x == 0.0, 1.0, np.expm1(x) / np.where(x == 0.0, 1.0, x))
    return (1.0 - Rs) * alpha * (
        s1 * ((1.0 - T * t) / (t1 + k1) + rho * t * t * d * E)
        + s2 * T * t * (1.0 + rho) / (t2 + k2))


def skin(Cm, Bm, Ch, d, nm, haemoglobin):
    return two_layer(transport.epidermis_layer(nm, Cm, Bm), d,
                     transport.dermis_layer(nm, Ch, haemoglobin))


def read_table(path):
    """Parameters (rows of Cm, Bm, Ch, d), wavelengths, reflectances."""
    with open(path) as f:
        rows = list(csv.reader(line for line in f if not line.startswith("#")))
    values = np.array(rows[1:], float)
    return values[:, :4], np.array(rows[0][4:], float), values[:, 4:]


def describe(name, error):
    print("%-22s rms %.5f  max %.5f  mean %+.5f  over %.2f: %5.2f %%"
          % (name, np.sqrt(np.mean(error ** 2)), np.max(np.abs(error)),
             np.mean(error), BAR_MAX, 100.0 * np.mean(np.abs(error) > BAR_MAX)))


def describe_worst(parameters, nm, R, error, count=5):
    """The worst value of each of the `count` worst spectra."""
    by_spectrum = np.max(np.abs(error), axis=1)
    for i in np.argsort(by_spectrum)[::-1][:count]:
        j = np.argmax(np.abs(error[i]))
        print("  Cm %-5g Bm %-3g Ch %-5g d %-4g %.0f nm: R %.5f, error %+.5f"
              % (*parameters[i], nm[j], R[i, j], error[i, j]))


def compare_twelve(haemoglobin):
    nm, q = transport.BANDS, transport.quadrature()
    cases = [(*c, d) for c in TWELVE for d in (0.06, 0.1)]
    R = np.array([transport.skin(*c, nm, haemoglobin, q) for c in cases])
    error = np.array([skin(*c, nm, haemoglobin) for c in cases]) - R
    describe("the twelve cases", error)
    describe_worst(np.array(cases), nm, R, error, 3)


def compare_table(path, haemoglobin):
    parameters, nm, R = read_table(path)
    error = np.array([skin(*p, nm, haemoglobin) for p in parameters]) - R
    describe("all of the table", error)
    describe_worst(parameters, nm, R, error)
    for column, name in ((3, "d"), (0, "Cm"), (1, "Bm"), (2, "Ch")):
        for value in np.unique(parameters[:, column]):
            describe("%s = %g" % (name, value), error[parameters[:, column] == value])
    for low, high in ((380, 390), (400, 440), (450, 500), (510, 590), (600, 740)):
        describe("%d..%d nm" % (low, high), error[:, (nm >= low) & (nm <= high)])
    rms, largest = np.sqrt(np.mean(error ** 2)), np.max(np.abs(error))
    print("bar rms %.3f: %s; bar max %.2f: %s"
          % (BAR_RMS, "met" if rms <= BAR_RMS else "NOT met",
             BAR_MAX, "met" if largest <= BAR_MAX else "NOT met"))


def main():
    here = os.path.dirname(os.path.abspath(__file__))
    parser = argparse.ArgumentParser(description="error of the two-layer closed form")
    parser.add_argument("table", nargs="?", default=os.path.join(here, "transport_64.csv"))
    options = parser.parse_args()
    haemoglobin = transport.read_haemoglobin()
    compare_twelve(haemoglobin)
    compare_table(options.table, haemoglobin)


if __name__ == "__main__":
    main()
