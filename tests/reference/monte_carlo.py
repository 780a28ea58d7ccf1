"""Monte Carlo of two-layer skin: a second, unrelated method beside transport.py.

Photons walk through the epidermis and the endless dermis; six cases must agree
with adding-doubling within three standard errors.  Only tissue coefficients are
taken from transport.py; free paths, scattering and the surface are done here.

Depth is counted in optical thickness, in which free paths are exponential
with mean 1 in either layer, so crossing from one to the other needs no case:
only the albedo depends on the depth.  Absorption lowers a photon's weight; at
the surface the part 1 - r leaves and is scored, the part r goes on; photons of
small weight are ended by Russian roulette, which keeps the mean.

    monte_carlo.py [--photons N] [--seed N]
"""

import argparse
import sys

import numpy as np

import transport

SMALL, SURVIVAL = 1e-3, 0.1     # Russian roulette below / its chance

# Cm, Bm, Ch, epidermis mm, wavelength nm: from very light to black
CASES = [(0.0, 0.0, 0.01, 0.15, 700.0), (0.005, 1.0, 0.001, 0.06, 600.0),
         (0.03, 0.7, 0.04, 0.08, 560.0), (0.1, 0.3, 0.05, 0.1, 650.0),
         (0.02, 0.5, 0.1, 0.03, 420.0), (0.5, 1.0, 0.01, 0.15, 500.0)]


def surface_reflectance(mu, n):
    """Fresnel from inside, by the angles: r = (sin^2(i-t)/sin^2(i+t)
    + tan^2(i-t)/tan^2(i+t))/2, at normal incidence ((n-1)/(n+1))^2."""
    i = np.arccos(np.minimum(mu, 1.0))
    sin_t = n * np.sin(i)
    t = np.arcsin(np.minimum(sin_t, 1.0))
    with np.errstate(invalid="ignore", divide="ignore"):
        r = 0.5 * ((np.sin(i - t) / np.sin(i + t)) ** 2
                   + (np.tan(i - t) / np.tan(i + t)) ** 2)
    r = np.where(i < 1e-6, ((n - 1.0) / (n + 1.0)) ** 2, r)
    return np.where(sin_t >= 1.0, 1.0, r)


def scored_by_photon(epidermis, d_mm, dermis, n, photons, rng):
    """Weight that each photon sends out through the surface."""
    (a1, s1), (a2, s2) = epidermis, dermis
    boundary = (a1 + s1) * d_mm
    out = np.zeros(photons)
    who = np.arange(photons)
    depth, mu = np.zeros(photons), np.ones(photons)
    weight = np.full(photons, 1.0 - ((n - 1.0) / (n + 1.0)) ** 2)
    while who.size:
        depth = depth + mu * rng.standard_exponential(who.size)
        up = np.nonzero(depth < 0.0)[0]
        r = surface_reflectance(-mu[up], n)
        out[who[up]] += weight[up] * (1.0 - r)
        weight[up] *= r
        depth[up] = -depth[up]          # the reflected part walks on, downwards
        weight *= np.where(depth < boundary, s1 / (a1 + s1), s2 / (a2 + s2))
        mu = 2.0 * rng.random(who.size) - 1.0
        small = weight < SMALL
        weight[small] /= SURVIVAL
        stay = ~small | (rng.random(who.size) < SURVIVAL)
        who, depth, mu, weight = who[stay], depth[stay], mu[stay], weight[stay]
    return out


def compare(case, photons, rng, haemoglobin, q):
    """Print one case; its difference in standard errors."""
    Cm, Bm, Ch, d_mm, nm = case
    layers = (transport.epidermis_layer(nm, Cm, Bm), d_mm,
              transport.dermis_layer(nm, Ch, haemoglobin))
    out = scored_by_photon(*layers, q.n, photons, rng)
    error = out.std(ddof=1) / np.sqrt(photons)
    expected = float(transport.reflectance_two_layers(*layers, q))
    z = (out.mean() - expected) / error
    print("Cm %-5g Bm %-3g Ch %-5g d %-4g %.0f nm: Monte Carlo %.5f +- %.5f, "
          "adding-doubling %.5f, %+.1f standard errors"
          % (*case, out.mean(), error, expected, z), flush=True)
    return z


def main():
    parser = argparse.ArgumentParser(description="Monte Carlo against adding-doubling")
    parser.add_argument("--photons", type=int, default=400000)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    haemoglobin = transport.read_haemoglobin()
    q, rng = transport.quadrature(), np.random.default_rng(options.seed)
    z = [compare(c, options.photons, rng, haemoglobin, q) for c in CASES]
    print("worst: %.1f standard errors" % np.max(np.abs(z)))
    return 0 if np.max(np.abs(z)) < 3.0 else 1


if __name__ == "__main__":
    sys.exit(main())
