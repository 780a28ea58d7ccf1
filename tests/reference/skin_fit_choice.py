#!/usr/bin/env python3
"""How the skin fit and the noise of skin were chosen: on the even rows of 100
measured people, judged on the odd ones.

Reads nist_forearm_avg_10nm.csv and nist_forearm_repeats_vis.csv (Cooksey, Allen,
Tsai, J. Res. NIST 122:26, 2017; specular included, 0.04 is taken off) in the
folder SKINSPEC_MEASURED, else ../shared/measured; without them it says so and
ends.  Shares no code with src/: forward models of two_layer_error.py and
transport.py, a least-squares of its own.

    skin_fit_choice.py --variants     what may be free, both models       15 s
    skin_fit_choice.py --noise        how replicates of one site differ   20 s
    skin_fit_choice.py --chosen       what was chosen, against the bars   60 s
    skin_fit_choice.py --table FILE   skins of the chosen fit and their spectra, without any
                                      measured data: tests/reference/skin_fit.csv
"""

import argparse
import csv
import os
import sys

import numpy as np
from scipy.optimize import minimize
from scipy.special import gammaln

import transport
from two_layer_error import two_layer

MEASURED = os.environ.get("SKINSPEC_MEASURED", "../shared/measured")
SURFACE = 0.04
NM = np.arange(400.0, 701.0, 10.0)
NAMES = ["Cm", "Bm", "Ch", "SO2", "epidermis_mm", "a", "b"]
CM, BM, CH, SO2, D, A, B = range(7)
PAPER_LO = np.array([0.0, 0.0, 0.001, 0.0, 0.02, 0.1, -2.0])
PAPER_HI = np.array([0.5, 1.0, 0.1, 1.0, 0.15, 60.0, 5.0])
CHOSEN_HI = np.where(np.arange(7) == CH, 0.2, PAPER_HI)
CHOSEN = [CM, CH, SO2, A, B]
MISFIT = 0.005  # of the model, a band: what is left of the best fits

EVEN, ODD = np.arange(0, 100, 2), np.arange(1, 100, 2)


# --- Data --------------------------------------------------------------------

def rows_of(name, skip):
    with open(os.path.join(MEASURED, name)) as f:
        rows = list(csv.reader(f))
    return np.array(rows[0][skip:], float), np.array([r[skip:] for r in rows[1:]], float)


def measured():
    """[100][31] means and [100][3][31] repeats, surface taken off.  The repeats are
    every 3 nm; straight between, their mean is the other file's to 7e-5."""
    nm, mean = rows_of("nist_forearm_avg_10nm.csv", 1)
    mean = mean[:, np.isin(nm, NM)]
    nm, each = rows_of("nist_forearm_repeats_vis.csv", 2)
    each = np.array([np.interp(NM, nm, y) for y in each]).reshape(100, 3, len(NM))
    assert np.max(np.abs(each.mean(1) - mean)) < 1e-4
    return mean - SURFACE, each - SURFACE


# --- Colour ------------------------------------------------------------------

def weights():
    """ASTM E2022 weights, D65 and 10 degrees; those outside 400..700 go to the ends."""
    with open(os.path.join(transport.FIGURES, "weights_e2022_D65_10deg_10nm.csv")) as f:
        rows = [line.split(",") for line in f if line[:1].isdigit()]
    W = np.zeros((len(NM), 3))
    for row in rows:
        W[int(np.clip((float(row[0]) - 400) / 10, 0, len(NM) - 1))] += [float(x) for x in row[1:4]]
    return W


def lab(R, W):
    t = np.maximum(R @ W / W.sum(0), 1e-9)
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.stack([116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]),
                     200 * (f[..., 1] - f[..., 2])], -1)


def de00(one, other):
    """Sharma, Wu and Dalal (2005), hues of skin (no hue wraps around)."""
    (L1, a1, b1), (L2, a2, b2) = np.moveaxis(one, -1, 0), np.moveaxis(other, -1, 0)
    C = (np.hypot(a1, b1) + np.hypot(a2, b2)) / 2
    G = 0.5 * (1 - np.sqrt(C ** 7 / (C ** 7 + 25.0 ** 7)))
    a1, a2 = a1 * (1 + G), a2 * (1 + G)
    C1, C2 = np.hypot(a1, b1), np.hypot(a2, b2)
    h1, h2 = np.degrees(np.arctan2(b1, a1)) % 360, np.degrees(np.arctan2(b2, a2)) % 360
    turn = (h2 - h1 + 180) % 360 - 180
    dH = 2 * np.sqrt(C1 * C2) * np.sin(np.radians(turn) / 2)
    h, L, C = h1 + turn / 2, (L1 + L2) / 2, (C1 + C2) / 2
    rad = lambda k, off: np.cos(np.radians(k * h - off))
    T = 1 - 0.17 * rad(1, 30) + 0.24 * rad(2, 0) + 0.32 * rad(3, -6) - 0.2 * rad(4, 63)
    SL = 1 + 0.015 * (L - 50) ** 2 / np.sqrt(20 + (L - 50) ** 2)
    SC, SH = 1 + 0.045 * C, 1 + 0.015 * C * T
    RT = -2 * np.sqrt(C ** 7 / (C ** 7 + 25.0 ** 7)) * np.sin(
        np.radians(60 * np.exp(-((h - 275) / 25) ** 2)))
    p, q, r = (L2 - L1) / SL, (C2 - C1) / SC, dH / SH
    return np.sqrt(p * p + q * q + r * r + RT * q * r)


# --- Models ------------------------------------------------------------------

HAEMOGLOBIN = transport.read_haemoglobin()
OXY, DEOXY = transport.haemoglobin_sigma_a(NM, HAEMOGLOBIN)
BASE, EQ6 = transport.base_sigma_a(NM), transport.scattering(NM)
EU, PHEO = 6.6e10 * NM ** -3.33, 2.9e14 * NM ** -4.75


def layers(x, kind):
    """(sigma_a, sigma_s') of epidermis and dermis, and d, of skins x[..., 7].

    kind: "power" a (l/500)^-b in both layers; "paper" Eq. 6, half of it in the
    dermis; "scaled" that times a; "whole" Eq. 6 in both; "base" Eq. 6 and the base
    absorption times a."""
    Cm, Bm, Ch, S, d, a, b = (x[..., i, None] for i in range(7))
    base = BASE * a if kind == "base" else BASE
    epidermis = Cm * (Bm * EU + (1 - Bm) * PHEO) + (1 - Cm) * base
    dermis = Ch * (S * OXY + (1 - S) * DEOXY) + (1 - Ch) * base
    if kind == "power":
        upper = lower = a * (NM / 500.0) ** -b
    else:
        upper = EQ6 * (a if kind == "scaled" else 1.0 + 0 * a)
        lower = upper if kind == "whole" else 0.5 * upper
    return (epidermis, upper), d, (dermis, lower)


def diffusion(x, kind="power"):
    return two_layer(*layers(x, kind))


EIGHT = transport.quadrature(count=8)


def transport_8(x, kind="power"):
    """Doubling is begun at 3e-4 mean free paths, which moves R by less than 1e-6."""
    (a1, s1), d, (a2, s2) = layers(x, kind)
    a1, s1, d, a2, s2 = np.broadcast_arrays(a1, s1, d, a2, s2)
    R, T = transport.slab((a1 + s1) * d, s1 / (a1 + s1), EIGHT, thin=3e-4)
    below = transport.half_space(s2 / (a2 + s2), EIGHT, 1e-11)
    return transport.diffuse_reflectance(transport.slab_over(R, T, below), EIGHT)


def slopes(x, free, kind, model):
    """R[n][31] and dR[n][31][free]: by an imaginary step, or by small real ones."""
    if model is diffusion:
        dR = []
        for i in free:
            z = x.astype(complex)
            z[..., i] += 1e-20j
            dR.append(model(z, kind).imag / 1e-20)
        return model(x, kind), np.stack(dR, -1)
    many, steps = [x], []
    for i in free:
        steps.append(np.maximum(1e-4 * np.abs(x[..., i]), 1e-6))
        many.append(x.copy())
        many[-1][..., i] += steps[-1]
    R = model(np.stack(many), kind)
    return R[0], np.stack([(r - R[0]) / h[..., None] for r, h in zip(R[1:], steps)], -1)


# --- Least squares -----------------------------------------------------------

def fit(Y, start, free, kind="power", model=diffusion, prior=None, hi=PAPER_HI, steps=60):
    """Bounded Levenberg-Marquardt of all rows of Y at once, bands weighted alike.

    prior {parameter: (mean, sd)}.  Returns x, R, J and who ended on which bound."""
    k, L, H = len(free), PAPER_LO[free], hi[free]
    x = np.broadcast_to(np.array(start, float), (len(Y), 7)).copy()
    x[:, free] = np.clip(x[:, free], L + 1e-6 * (H - L), H)
    mean, weight = np.zeros(k), np.zeros(k)
    for i, (m, sd) in (prior or {}).items():
        mean[free.index(i)], weight[free.index(i)] = m, (MISFIT / sd) ** 2
    cost = lambda x, R: ((Y - R) ** 2).sum(1) + (weight * (x[:, free] - mean) ** 2).sum(1)
    damp, diagonal = np.full(len(Y), 1e-3), range(k)
    R, J = slopes(x, free, kind, model)
    now, done = cost(x, R), np.zeros(len(Y), bool)
    for _ in range(steps):
        N = np.einsum("pik,pil->pkl", J, J)
        N[:, diagonal, diagonal] += weight
        g = np.einsum("pik,pi->pk", J, Y - R) + weight * (mean - x[:, free])
        held = ((x[:, free] <= L) & (g < 0)) | ((x[:, free] >= H) & (g > 0))
        scale = np.sqrt(N[:, diagonal, diagonal])
        scale[scale == 0] = 1  # Bm where there is no melanin
        N = np.where(held[:, :, None] | held[:, None, :], 0, N / (scale[:, :, None] * scale[:, None]))
        N[:, diagonal, diagonal] = 1 + damp[:, None]
        step = np.linalg.solve(N, np.where(held, 0, g / scale)[..., None])[..., 0] / scale
        to = x.copy()
        to[:, free] = np.clip(x[:, free] + step, L, H)
        then = cost(to, model(to, kind))
        better = then <= now
        done |= better & (now - then < 1e-7 * (MISFIT ** 2 + now))
        x[better] = to[better]
        damp = np.where(better, np.maximum(0.2 * damp, 1e-9), np.minimum(6 * damp, 1e9))
        now = np.where(better, then, now)
        R, J = slopes(x, free, kind, model)
        if done.all():
            break
    edge = 1e-7 * (H - L)
    return {"x": x, "R": R, "J": J, "free": free,
            "at": (x[:, free] <= L + edge) | (x[:, free] >= H - edge)}


def start(**of):
    x = dict(Cm=0.02, Bm=0.25, Ch=0.01, SO2=0.75, epidermis_mm=0.08, a=9.0, b=1.4)
    x.update(of)
    return [x[name] for name in NAMES]


def figures(Y, found, rows, W):
    """rms and dE00: median (p95); % of people with a parameter at a bound."""
    rms = np.sqrt(((Y - found["R"]) ** 2).mean(1))[rows]
    dE = de00(lab(Y, W), lab(found["R"], W))[rows]
    return "%.4f (%.4f) %.2f (%.2f) %3.0f %%" % (
        np.median(rms), np.quantile(rms, 0.95), np.median(dE), np.quantile(dE, 0.95),
        100 * found["at"][rows].any(1).mean())


def medians(found):
    return " ".join("%s %.3g" % (NAMES[i], np.median(found["x"][:, i])) for i in found["free"])


# --- What may be free --------------------------------------------------------

def variants(Y):
    W = weights()
    print("%-46s %s | %s" % ("", "even: rms (p95) dE00 (p95) at bound", "odd"))

    def line(name, *args, **how):
        found = fit(Y, *args, **how)
        print("%-46s %s | %s | %s" % (name, figures(Y, found, EVEN, W), figures(Y, found, ODD, W),
                                      medians(found)), flush=True)
        return found

    line("the paper's constants, d .08", start(Bm=.5), [CM, BM, CH], "paper")
    line("the paper's constants, d .06", start(Bm=.5, epidermis_mm=.06), [CM, BM, CH], "paper")
    line("+ SO2, d", start(Bm=.5), [CM, BM, CH, SO2, D], "paper")
    line("Eq. 6 scaled, Bm 0", start(Bm=0, a=1.5), [CM, CH, SO2, A], "scaled")
    line("Eq. 6 not halved, Bm 0", start(Bm=0), [CM, CH, SO2], "whole")
    line("base scaled, Bm 0", start(Bm=0, a=.6), [CM, CH, SO2, A], "base")
    for Bm in (0, .25, .5, .75, 1):
        line("power law, Bm %g held" % Bm, start(Bm=Bm), CHOSEN)
    for d in (.05, .06, .1, .12):
        line("power law, Bm .25, d %g" % d, start(epidermis_mm=d), CHOSEN)
    line("power law, Bm .25, d free", start(), CHOSEN + [D])
    line("power law, Bm .25, d ~ .08 +- .02", start(), CHOSEN + [D], prior={D: (.08, .02)})
    line("power law, Bm free", start(), CHOSEN + [BM])
    for b in (.8, 1.1, 1.42):
        line("power law, Bm free, b %g held" % b, start(b=b), [CM, BM, CH, SO2, A])
    for m, sd in ((1.42, .1), (1.42, .3)):
        line("power law, Bm free, b ~ %g +- %g" % (m, sd), start(), CHOSEN + [BM], prior={B: (m, sd)})
    for m, sd in ((.25, .1), (.5, .1), (.5, .3)):
        line("power law, Bm ~ %g +- %g" % (m, sd), start(Bm=m), CHOSEN + [BM], prior={BM: (m, sd)})
    line("chosen: power law, Bm .25, Ch to .2", start(), CHOSEN, hi=CHOSEN_HI)
    for Bm in (0, .25, .5):
        near = fit(Y, start(Bm=Bm), CHOSEN, hi=CHOSEN_HI)["x"]
        line("transport-8, power law, Bm %g, Ch to .2" % Bm, near, CHOSEN, hi=CHOSEN_HI,
             model=transport_8, steps=10)


# --- How replicates differ ---------------------------------------------------

STRAIGHT = (NM - 550.0) / np.sqrt(np.mean((NM - 550.0) ** 2))


def shapes_of(found, names):
    """[names][person][band]: how a placement may move a spectrum, by size 1."""
    R, x = found["R"], found["x"]
    dR = slopes(x, list(range(7)), "power", diffusion)[1]
    shape = {"level 1": np.ones_like(R), "level R": R / 0.35, "level R^.75": (R / 0.35) ** 0.75,
             "level R^.5": np.sqrt(R / 0.35), "slope": STRAIGHT + 0 * R,
             "Ch": dR[..., CH] * x[:, [CH]], "SO2": dR[..., SO2], "Cm": dR[..., CM] * x[:, [CM]],
             "a": dR[..., A] * x[:, [A]], "b": dR[..., B]}
    return np.stack([shape[name] for name in names])


def covariance(size, shapes):
    """White size[0] and the shapes by their sizes, [person][band][band]."""
    return size[0] ** 2 * np.eye(len(NM)) + np.einsum(
        "k,kpi,kpj->pij", np.square(size[1:]), shapes, shapes)


def strangeness(C, apart):
    """Sum over a person's repeats of (y - mean)^T C^-1 (y - mean)."""
    return np.einsum("pri,pij,prj->p", apart, np.linalg.inv(C), apart)


def surprise(t, shapes, apart):
    """-2 log likelihood of a person's repeats about their mean, but for a constant; mean
    over people.  t: logarithms of the sizes, and of nu where it has one more: sites then
    differ by a factor f^2 of the covariance, nu/f^2 being chi-squared with nu degrees."""
    count = len(shapes) + 1
    C = covariance(np.exp(t[:count]), shapes)
    seen, degrees = strangeness(C, apart), 2 * len(NM)
    volume = 2 * np.linalg.slogdet(C)[1]
    if len(t) == count:
        return (volume + seen).mean()
    nu = np.exp(t[-1])
    return (volume - 2 * gammaln((nu + degrees) / 2) + 2 * gammaln(nu / 2)
            + degrees * np.log(nu / 2) + (nu + degrees) * np.log1p(seen / nu)).mean()


def own_factor(C, apart, nu):
    """What the repeats of a site say of its f^2, with what is known of all."""
    return (nu + strangeness(C, apart)) / (nu + 2 * len(NM) - 2)


def propagated(found, C):
    """Variance of each free parameter from C, through equal weights."""
    J = found["J"]
    G = np.linalg.solve(np.einsum("pik,pil->pkl", J, J), np.swapaxes(J, 1, 2))
    return np.einsum("pki,pij,pkj->pk", G, C, G)


def agreeing(each_found, V, rows):
    """% of pairs of repeats within 1.96 sqrt(2 V), of those not at a bound."""
    x = each_found["x"][:, CHOSEN].reshape(100, 3, -1)
    at = each_found["at"].reshape(100, 3, -1)
    out = []
    for k in range(len(CHOSEN)):
        good = []
        for i, j in ((0, 1), (0, 2), (1, 2)):
            use = ~(at[rows, i, k] | at[rows, j, k])
            near = np.abs(x[rows, i, k] - x[rows, j, k]) <= 1.96 * np.sqrt(2 * V[rows, k])
            good.extend(near[use])
        out.append(100 * np.mean(good))
    return " ".join("%s %.1f" % (NAMES[i], r) for i, r in zip(CHOSEN, out))


FIRST = {"level 1": .009, "level R": .01, "level R^.75": .01, "level R^.5": .01, "slope": .003,
         "Ch": .15, "SO2": .05, "Cm": .08, "a": .07, "b": .2}


def sizes_of(shapes, apart, names, factor):
    """White, sizes and, where sites differ by a factor, nu: the most likely."""
    first = [.0015] + [FIRST[n] for n in names] + ([5.0] if factor else [])
    best = minimize(surprise, np.log(first), args=(shapes, apart), method="L-BFGS-B")
    return np.exp(best.x)


def each_repeat(found, each, **how):
    return fit(each.reshape(300, -1), np.repeat(found["x"], 3, 0), CHOSEN, hi=CHOSEN_HI, **how)


def noise(Y, each):
    found = fit(Y, start(), CHOSEN, hi=CHOSEN_HI)
    singly = each_repeat(found, each)
    apart = each - each.mean(1, keepdims=True)
    part = np.linalg.eigvalsh(np.einsum("pri,prj->ij", apart, apart) / 200)[::-1]
    print("repeats: sd %.4f a band; components %s %%"
          % (np.sqrt(part.sum() / len(NM)), np.round(100 * part / part.sum(), 1)[:6]))
    left = (each.reshape(300, -1) - singly["R"]).reshape(100, 3, -1)
    left -= left.mean(1, keepdims=True)
    print("of it left once each repeat has parameters of its own: %.4f"
          % np.sqrt((left ** 2).sum((1, 2)).mean() / 2 / len(NM)))
    print("\nsizes fitted on the even half; -2 log L even, odd; pairs that agree, even | odd")
    for names in (["level 1"], ["level R"], ["level 1", "slope"], ["level R", "slope"],
                  ["level 1", "slope", "Ch", "SO2"], ["level R", "slope", "Ch", "SO2"],
                  ["level R^.75", "slope", "Ch", "SO2"], ["level R^.5", "slope", "Ch", "SO2"],
                  ["level R^.5", "slope", "Cm", "Ch", "SO2"], ["Cm", "Ch", "SO2"],
                  ["a", "b", "Ch", "SO2"], ["Cm", "Ch", "SO2", "a", "b"]):
        shapes = shapes_of(found, names)
        for factor in (False, True):
            size = sizes_of(shapes[:, EVEN], apart[EVEN], names, factor)
            C = covariance(size[:len(names) + 1], shapes)
            V, t = propagated(found, C), np.log(size)
            if factor:
                V = V * own_factor(C, apart, size[-1])[:, None]
            print("white %.4f %s%s: %.0f %.0f\n    %s | %s"
                  % (size[0], " ".join("%s %.4f" % z for z in zip(names, size[1:])),
                     " nu %.1f" % size[-1] if factor else "",
                     surprise(t, shapes[:, EVEN], apart[EVEN]),
                     surprise(t, shapes[:, ODD], apart[ODD]),
                     agreeing(singly, V, EVEN), agreeing(singly, V, ODD)), flush=True)


# --- What was chosen ---------------------------------------------------------

NOISE = ["Cm", "Ch", "SO2", "a", "b"]
SIZES = [0.0009, 0.066, 0.16, 0.046, 0.064, 0.175]
NU = 4


def chosen(Y, each):
    W = weights()
    apart = each - each.mean(1, keepdims=True)
    for name, how in (("two-layer", {}), ("transport-8", {"model": transport_8, "steps": 10})):
        found = fit(Y, start(), CHOSEN, hi=CHOSEN_HI)
        found = fit(Y, found["x"], CHOSEN, hi=CHOSEN_HI, **how)
        singly = each_repeat(found, each, **how)
        C = covariance(SIZES, shapes_of(found, NOISE))
        V = propagated(found, C) * own_factor(C, apart, NU)[:, None]
        for rows, half in ((EVEN, "even"), (ODD, "odd")):
            print("%s, %s: %s; pairs %s" % (name, half, figures(Y, found, rows, W),
                                            agreeing(singly, V, rows)), flush=True)


def other_halves(Y, each, splits=30, seed=1):
    """The sizes fitted on one half, the pairs of the other judged: even and odd rows,
    then random halves."""
    apart = each - each.mean(1, keepdims=True)
    found = fit(Y, start(), CHOSEN, hi=CHOSEN_HI)
    singly = each_repeat(found, each)
    shapes, rng, seen = shapes_of(found, NOISE), np.random.default_rng(seed), []

    def judge(one, other):
        size = sizes_of(shapes[:, one], apart[one], NOISE, True)
        C = covariance(size[:-1], shapes)
        V = propagated(found, C) * own_factor(C, apart, size[-1])[:, None]
        return size, agreeing(singly, V, other)

    for name, one, other in (("even", EVEN, ODD), ("odd", ODD, EVEN),
                             ("all", np.arange(100), np.arange(100))):
        size, pairs = judge(one, other)
        print("fitted on %s: white %.4f %s nu %.1f; pairs of the others: %s"
              % (name, size[0], " ".join("%s %.4f" % z for z in zip(NOISE, size[1:])), size[-1],
                 pairs), flush=True)
    for _ in range(splits):
        order = rng.permutation(100)
        seen.append([float(w) for w in judge(order[:50], order[50:])[1].split()[1::2]])
    print("%d random halves, pairs of the other: %s" % (splits, "; ".join(
        "%s %.0f..%.0f, median %.1f, inside 90..98 in %.0f %% of them"
        % (NAMES[i], s.min(), s.max(), np.median(s), 100 * np.mean((s >= 90) & (s <= 98)))
        for i, s in zip(CHOSEN, np.transpose(seen)))))


def write_table(path, count=24, seed=3):
    """Random skins of the skin fit and what two_layer_error.py says they reflect."""
    rng = np.random.default_rng(seed)
    decades = lambda low, high: float("%.4g" % np.exp(rng.uniform(np.log(low), np.log(high))))
    plain = lambda low, high: float("%.4g" % rng.uniform(low, high))
    with open(path, "w", encoding="ascii") as f:
        f.write("# Made by tests/reference/skin_fit_choice.py --table: do not edit.  Bm 0.25, epidermis "
                "0.08 mm, index 1.4.\n")
        f.write("Cm,Ch,SO2,a,b," + ",".join("%.0f" % nm for nm in NM) + "\n")
        for _ in range(count):
            own = {"Cm": decades(.005, .2), "Ch": decades(.005, .1), "SO2": plain(.2, .95),
                   "a": decades(5, 20), "b": plain(.3, 2.5)}
            R = diffusion(np.array(start(**own)))
            f.write(",".join(repr(x) for x in own.values()) + ","
                    + ",".join("%.17g" % x for x in R) + "\n")
    print(path)


def main():
    parser = argparse.ArgumentParser(description="the choice of the skin fit")
    for part in ("variants", "noise", "chosen"):
        parser.add_argument("--" + part, action="store_true")
    parser.add_argument("--table", metavar="FILE")
    options = parser.parse_args()
    if options.table:
        write_table(options.table)
        return 0
    if not os.path.exists(os.path.join(MEASURED, "nist_forearm_avg_10nm.csv")):
        print("no measured skin in %s: set SKINSPEC_MEASURED; nothing was done" % MEASURED)
        return 0
    Y, each = measured()
    everything = not (options.variants or options.noise or options.chosen)
    if options.variants or everything:
        variants(Y)
    if options.noise or everything:
        noise(Y, each)
    if options.chosen or everything:
        chosen(Y, each)
        other_halves(Y, each)
    return 0


if __name__ == "__main__":
    sys.exit(main())
