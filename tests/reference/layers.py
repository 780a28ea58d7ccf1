"""Layers by adding and doubling, for the tests of optics/monte_carlo: transport.py's slabs, up
to three of them, over an endless layer or with the surface below as well, and derivatives.

    layers.py --stacks > layers.csv            100 seeded stacks
    layers.py --slopes > layer_slopes.csv      24 seeded skins and their derivatives
    layers.py --check                          energy, one layer in two parts, transport.py

A stack is (R, T, R_up, T_up): for light from above, then from below.  Needs numpy.
"""

import argparse
import random
import sys

import numpy as np

import transport


def over(above, below):
    """Adding: `above` lies on `below`; same index."""
    (Ra, Ta, Ra_up, Ta_up), (Rb, Tb, Rb_up, Tb_up) = above, below
    one = np.eye(len(Ra))
    down = np.linalg.solve(one - Ra_up @ Rb, Ta)
    up = np.linalg.solve(one - Rb @ Ra_up, Tb_up)
    return (Ra + Ta_up @ Rb @ down, Tb @ down, Rb_up + Tb @ Ra_up @ up, Ta_up @ up)


def one_layer(tau, albedo, q):
    if np.isinf(tau):
        R, nothing = transport.half_space(albedo, q), np.zeros((len(q.mu),) * 2)
        return R, nothing, nothing, nothing
    R, T = transport.slab(tau, albedo, q)
    return R, T, R, T


def reflectance(layers, q, free):
    """(R, T) of layers [(tau, albedo)], per incident light along the normal, R without the
    mirror reflection; free: the surface is below as well."""
    stack = one_layer(*layers[0], q)
    for layer in layers[1:]:
        stack = over(stack, one_layer(*layer, q))
    r, one = q.inside_reflectance, np.eye(len(q.mu))
    below = np.diag(r) if free else np.zeros_like(one)
    R, T, R_up, T_up = stack
    turned = np.linalg.solve(one - R_up @ below, T)
    whole = R + T_up @ below @ turned
    normal = np.zeros(len(q.mu))
    normal[-1] = 1.0 - q.specular
    down = np.linalg.solve(one - np.diag(r) @ whole, normal)
    return np.sum((1 - r) * (whole @ down)), np.sum((1 - r) * (turned @ down)) if free else 0.0


# --- Cases --------------------------------------------------------------------

def random_layer(rng, endless):
    """(sigma_a, sigma_s, mm) of a layer: thin to thick, black to nearly clear."""
    sigma_t, tau = 10 ** rng.uniform(-1, 3), 10 ** rng.uniform(-3, 1.5)
    kind = rng.random()
    lost = rng.uniform(0.02, 0.98) if kind < 0.5 else 10 ** rng.uniform(-4, -1)
    if kind > 0.95 and not endless:
        lost = 0.0
    a = float("%.6g" % (lost * sigma_t))
    return a, float("%.6g" % (sigma_t - a)), float("inf") if endless else float("%.6g" % (tau / sigma_t))


def stacks():
    rng = random.Random(20150114)
    for _ in range(100):
        n, free = rng.randint(1, 3), rng.random() < 0.4
        eta = rng.choice((1.0, 1.0, 1.1, 1.33, 1.4, 1.4, 1.5))
        yield eta, [random_layer(rng, k + 1 == n and not free) for k in range(n)]


def optical(layer):
    a, s, mm = layer
    return (a + s) * mm, s / (a + s)


def print_stacks():
    print("# Layers of one index, scattering evenly, light along the normal: diffuse reflectance and")
    print("# transmittance per incident light, without the mirror reflection.  64 directions; error: the")
    print("# difference from 32.  An absent layer has 0; an endless one 1e300 mm.")
    print("# Made by: tests/reference/layers.py --stacks > tests/reference/layers.csv")
    print("eta," + ",".join("sigma_a%d,sigma_s%d,mm%d" % (k, k, k) for k in (1, 2, 3)) + ",R,T,error")
    for eta, layers in stacks():
        free = np.isfinite(layers[-1][2])
        R, T = reflectance([optical(x) for x in layers], transport.quadrature(eta), free)
        R32, T32 = reflectance([optical(x) for x in layers], transport.quadrature(eta, 32), free)
        cells = [x for layer in layers for x in layer] + [0.0] * (9 - 3 * len(layers))
        cells = ["%g" % eta] + [repr(1e300 if np.isinf(x) else x) for x in cells]
        print(",".join(cells + ["%.7f" % R, "%.7f" % T, "%.0e" % max(abs(R - R32), abs(T - T32))]))


def skin_reflectance(x, q):
    a1, s1, a2, s2, d = x
    return reflectance([optical((a1, s1, d)), optical((a2, s2, np.inf))], q, False)[0]


def print_slopes():
    print("# Two layers of index 1.4, scattering evenly: R and its derivatives, central differences of")
    print("# 64 directions with steps of 1e-4 of the value; with 3e-4 none changes by more than the last column,")
    print("# relative to the largest x dR/dx of the row.")
    print("# Made by: tests/reference/layers.py --slopes > tests/reference/layer_slopes.csv")
    names = ("sigma_a1", "sigma_s1", "sigma_a2", "sigma_s2", "d_mm")
    print(",".join(names + ("R",) + tuple("dR_d" + x for x in names) + ("error",)))
    rng, q = random.Random(20150115), transport.quadrature()
    for _ in range(24):
        x = [10 ** rng.uniform(-1.5, 1.3), 10 ** rng.uniform(0, 1.5), 10 ** rng.uniform(-2, 0.5),
             10 ** rng.uniform(0, 1.5), 10 ** rng.uniform(-2, 0)]
        x = [float("%.5g" % v) for v in x]
        by_step = []
        for step in (1e-4, 3e-4):
            slopes = []
            for i, v in enumerate(x):
                above, below = list(x), list(x)
                above[i], below[i] = v * (1 + step), v * (1 - step)
                slopes.append((skin_reflectance(above, q) - skin_reflectance(below, q)) / (2 * step * v))
            by_step.append(np.array(slopes))
        parts = np.abs(by_step[0] * x)
        error = np.max(np.abs((by_step[0] - by_step[1]) * x)) / parts.max()
        print(",".join([repr(v) for v in x] + ["%.7f" % skin_reflectance(x, q)]
                       + ["%.7g" % v for v in by_step[0]] + ["%.0e" % error]))


# --- Check --------------------------------------------------------------------

def check():
    q, good = transport.quadrature(), True
    R, T = reflectance([(1.0, 1.0), (7.0, 1.0), (0.01, 1.0)], q, True)
    lost = abs(1 - q.specular - R - T)
    parts = reflectance([(0.5, 0.9), (1.5, 0.9)], q, True)
    whole = reflectance([(2.0, 0.9)], q, True)
    split = max(abs(a - b) for a, b in zip(parts, whole))
    skin = transport.reflectance_two_layers((0.3, 4.0), 0.1, (0.1, 2.0), q)
    other = abs(skin - skin_reflectance((0.3, 4.0, 0.1, 2.0, 0.1), q))
    free = abs(transport.reflectance_slab(2.0, 0.9, q) - whole[0])
    print("lost where nothing absorbs %.1e; a layer in two parts %.1e; transport.py's skin %.1e, slab %.1e"
          % (lost, split, other, free))
    good = max(lost, split, other, free) < 1e-9
    print("check: %s" % ("good" if good else "FAILED"))
    return 0 if good else 1


def main():
    parser = argparse.ArgumentParser(description="layers by adding and doubling")
    task = parser.add_mutually_exclusive_group(required=True)
    for name in ("stacks", "slopes", "check"):
        task.add_argument("--" + name, action="store_true")
    options = parser.parse_args()
    if options.check:
        return check()
    return print_stacks() if options.stacks else print_slopes()


if __name__ == "__main__":
    sys.exit(main())
