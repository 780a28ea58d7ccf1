"""numpy_tables.py - rows of a table by numpy, as one would tune them: ns of CPU a row.

    python3 numpy_tables.py FILE [seconds]

FILE is what tests/bench/tables.c writes with --columns: a line of JSON with the coefficients of each
band, the weights of XYZ, the white and the matrix to linear sRGB, so that no physics stands here twice.
Prints a line of JSON: the median ns of each variant, and its colour of one skin, to be compared.

Variants: f64 by chunks; f32 tuned: by chunks that stay in the L2 cache, into memory that is there already
(out=), in place, XYZ by matmul; and for two layers the same with what the epidermis and the dermis give
computed once for each (shared), which is the algorithm of ours, not only the arithmetic.
"""

import json
import statistics
import sys
import time

import numpy as np

F32, F64 = np.float32, np.float64


class Columns:
    """What the bands are, as one type."""

    def __init__(self, given, dtype):
        self.dtype = dtype
        for name in ("eumelanin", "pheomelanin", "base", "blood", "sigma_s_prime"):
            setattr(self, name, np.array(given[name], dtype))
        self.weights = np.array(given["weights"], dtype)  # [bands][3]
        self.i_white = np.array([1 / x for x in given["white"]], dtype)
        self.matrix = np.array(given["rgb_of_xyz"], dtype).T.copy()
        self.A, self.entering, self.d = (dtype(given[x]) for x in ("A", "entering", "epidermis_mm"))
        self.bands = len(given["base"])


class Colour:
    """XYZ -> Lab and linear sRGB of a chunk, without new memory."""

    def __init__(self, columns, rows):
        self.c = columns
        self.XYZ, self.t, self.line, self.rgb, self.Lab = (
            np.empty((rows, 3), columns.dtype) for _ in range(5)
        )
        self.dark = np.empty((rows, 3), bool)

    def of(self, R):
        c = self.c
        np.matmul(R, c.weights, out=self.XYZ)
        np.matmul(self.XYZ, c.matrix, out=self.rgb)
        np.multiply(self.XYZ, c.i_white, out=self.t)
        np.less_equal(self.t, c.dtype((6 / 29) ** 3), out=self.dark)
        if self.dark.any():
            np.multiply(self.t, c.dtype(841 / 108), out=self.line)
            self.line += c.dtype(4 / 29)
            np.cbrt(self.t, out=self.t)
            np.copyto(self.t, self.line, where=self.dark)
        else:
            np.cbrt(self.t, out=self.t)
        f, Lab = self.t, self.Lab
        np.multiply(f[:, 1], c.dtype(116), out=Lab[:, 0])
        Lab[:, 0] -= c.dtype(16)
        np.subtract(f[:, 0], f[:, 1], out=Lab[:, 1])
        Lab[:, 1] *= c.dtype(500)
        np.subtract(f[:, 1], f[:, 2], out=Lab[:, 2])
        Lab[:, 2] *= c.dtype(200)
        return Lab, self.rgb


class Power(Colour):
    """The same with t^(1/3) by exp and log, which numpy has by vectors and cbrt not."""

    def of(self, R):
        c = self.c
        np.matmul(R, c.weights, out=self.XYZ)
        np.matmul(self.XYZ, c.matrix, out=self.rgb)
        np.multiply(self.XYZ, c.i_white, out=self.t)
        np.less_equal(self.t, c.dtype((6 / 29) ** 3), out=self.dark)
        np.multiply(self.t, c.dtype(841 / 108), out=self.line)
        self.line += c.dtype(4 / 29)
        np.log(self.t, out=self.t)
        self.t *= c.dtype(1 / 3)
        np.exp(self.t, out=self.t)
        if self.dark.any():
            np.copyto(self.t, self.line, where=self.dark)
        f, Lab = self.t, self.Lab
        np.multiply(f[:, 1], c.dtype(116), out=Lab[:, 0])
        Lab[:, 0] -= c.dtype(16)
        np.subtract(f[:, 0], f[:, 1], out=Lab[:, 1])
        Lab[:, 1] *= c.dtype(500)
        np.subtract(f[:, 1], f[:, 2], out=Lab[:, 2])
        Lab[:, 2] *= c.dtype(200)
        return Lab, self.rgb


class HalfSpace:
    """R of a chunk of skins (Cm, Cm Bm, Ch and 1 as columns of `skins`): q by matmul."""

    def __init__(self, columns, rows):
        c = self.c = columns
        s = c.sigma_s_prime
        # q = [base + base + Cm (pheo - base) + Cm Bm (eu - pheo) + Ch (blood - base)]/sigma_s'
        self.basis = np.stack([
            (c.pheomelanin - c.base) / s, (c.eumelanin - c.pheomelanin) / s,
            (c.blood - c.base) / s, 2 * c.base / s,
        ])  # fmt: skip
        self.a, self.b, self.R = (np.empty((rows, c.bands), c.dtype) for _ in range(3))
        self.steeper = c.dtype(-(1 + 4 / 3 * float(c.A)))

    def of(self, skins):
        c, a, b, R = self.c, self.a, self.b, self.R
        np.matmul(skins, self.basis, out=a)  # q
        np.add(a, c.dtype(1), out=b)
        np.reciprocal(b, out=R)  # mu'
        a *= R
        a *= c.dtype(3)
        np.sqrt(a, out=a)  # s
        np.multiply(a, self.steeper, out=b)
        np.exp(b, out=b)
        np.negative(a, out=a)
        np.exp(a, out=a)
        a += b
        R *= a
        R *= c.dtype(0.5 * float(c.entering))
        return R


class TwoLayer:
    """R of a chunk by optics/quick.c's form, all of it for each row."""

    def __init__(self, columns, rows):
        c = self.c = columns
        self.m = [np.empty((rows, c.bands), c.dtype) for _ in range(13)]
        zero = np.zeros_like(c.base)
        self.epidermis = np.stack([c.pheomelanin - c.base, c.eumelanin - c.pheomelanin, zero, c.base])
        self.dermis = np.stack([zero, zero, c.blood - c.base, c.base])

    def of(self, skins):
        c = self.c
        one, three, A2, d = c.dtype(1), c.dtype(3), c.dtype(2) * c.A, c.d
        sa1, sa2, st1, r1, r2, x, y, T, fading, g, t, u, L = self.m
        np.matmul(skins, self.epidermis, out=sa1)
        np.matmul(skins, self.dermis, out=sa2)
        np.add(sa1, c.sigma_s_prime, out=st1)
        np.divide(sa1, st1, out=r1)
        r1 *= three
        np.sqrt(r1, out=r1)  # k1/sigma_t1'
        np.add(sa2, c.dtype(0.5) * c.sigma_s_prime, out=t)
        np.divide(sa2, t, out=r2)
        r2 *= three
        np.sqrt(r2, out=r2)
        np.multiply(st1, d, out=x)
        np.multiply(x, r1, out=y)
        np.negative(x, out=T)
        np.exp(T, out=T)
        np.negative(y, out=fading)
        np.exp(fading, out=fading)
        np.subtract(fading, T, out=g)
        np.subtract(x, y, out=t)
        g /= t  # int e^(-x s - y (1-s))
        np.multiply(fading, fading, out=t)  # e^-2y
        np.subtract(one, t, out=u)
        u /= y  # 2 p
        t += one  # left
        np.multiply(x, r2, out=L)
        sa1 *= A2 * d
        L += sa1
        L *= u
        np.multiply(r2, A2 / three, out=u)
        u += one
        u *= t
        L += u
        np.add(r1, one, out=u)  # 1 + r1
        np.divide(c.sigma_s_prime, st1, out=st1)
        st1 /= u  # m1
        np.multiply(r1, A2, out=t)
        t += three
        x *= g
        np.multiply(fading, A2, out=g)
        g /= t
        x += g  # layer
        x *= st1
        st1 /= t
        st1 *= three  # H
        np.add(r2, one, out=t)
        t *= u  # (1+r1)(1+r2)
        np.add(t, c.dtype(2), out=u)  # 3 + r1 + r2 + r1 r2
        u /= t
        u /= three
        u *= T
        x += u  # G
        r1 -= r2
        x *= r1
        x *= fading
        x *= c.dtype(2)
        x /= L
        st1 += x
        st1 *= c.entering
        return st1


class TwoLayerShared:
    """The same taken apart into layers, each computed once: rows are runs of the Ch axis."""

    def __init__(self, columns, run):
        c = self.c = columns
        self.whole = TwoLayer(columns, 1)
        self.t, self.R = (np.empty((run, c.bands), c.dtype) for _ in range(2))
        self.r2 = None

    def begin(self, Ch):
        c = self.c
        sa2 = Ch[:, None] * c.blood + (1 - Ch[:, None]) * c.base
        self.r2 = np.sqrt(c.dtype(3) * sa2 / (sa2 + c.dtype(0.5) * c.sigma_s_prime)).astype(c.dtype)
        self.u = (c.dtype(1) / (c.dtype(1) + self.r2)).astype(c.dtype)

    def of(self, Cm, Bm):
        c, t, R = self.c, self.t, self.R
        ss, d, A2 = c.sigma_s_prime, c.d, c.dtype(2) * c.A
        sa = Cm * (Bm * c.eumelanin + (1 - Bm) * c.pheomelanin) + (1 - Cm) * c.base
        st = sa + ss
        r1 = np.sqrt(3 * sa / st)
        x = st * d
        y = x * r1
        T, fading = np.exp(-x), np.exp(-y)
        g = (fading - T) / (x - y)
        left, p2 = 1 + fading * fading, (1 - fading * fading) / y
        m1, surface = ss / st / (1 + r1), 3 + A2 * r1
        w = 2 * c.entering * fading
        H = 3 * c.entering * m1 / surface
        G = w * (m1 * (A2 * fading / surface + x * g) + T / 3)
        GU = w * T * c.dtype(2 / 3) / (1 + r1)
        L, LR = left + p2 * A2 * sa * d, A2 / 3 * left + p2 * x
        np.multiply(self.r2, LR, out=t)
        t += L
        np.multiply(self.u, GU, out=R)
        R += G
        R /= t
        np.subtract(r1, self.r2, out=t)
        R *= t
        R += H
        return R


def skins_of(grid, dtype):
    """Columns Cm, Cm Bm, Ch, 1 of all rows, Ch fastest."""
    Cm, Bm, Ch = (np.array(grid[x]) for x in ("Cm", "Bm", "Ch"))
    rows = np.empty((len(Cm), len(Bm), len(Ch), 4))
    rows[..., 0], rows[..., 1] = Cm[:, None, None], Cm[:, None, None] * Bm[:, None]
    rows[..., 2], rows[..., 3] = Ch, 1
    return rows.reshape(-1, 4).astype(dtype)


def timed(work, seconds):
    """Median seconds of the processor, of runs for so long, three at least."""
    took, until = [], time.perf_counter() + seconds
    while len(took) < 3 or time.perf_counter() < until:
        begun = time.process_time()
        work()
        took.append(time.process_time() - begun)
    return statistics.median(took)


def rows_by(model, dtype, colour, chunk, given):
    """A function that computes all rows of the grid by chunks, and how many there are."""
    c = Columns(given, dtype)
    skins = skins_of(given["grid"], dtype)
    n = len(skins) // chunk * chunk
    R_of, colour_of = model(c, chunk), colour(c, chunk)
    Lab = np.empty((n, 3), dtype)
    rgb = np.empty((n, 3), dtype)

    def work():
        for at in range(0, n, chunk):
            Lab[at : at + chunk], rgb[at : at + chunk] = colour_of.of(R_of.of(skins[at : at + chunk]))
        return Lab

    return work, n


def shared_rows(dtype, colour, given):
    c = Columns(given, dtype)
    Cm, Bm, Ch = (np.array(given["grid"][x], dtype) for x in ("Cm", "Bm", "Ch"))
    R_of, colour_of = TwoLayerShared(c, len(Ch)), colour(c, len(Ch))
    Lab = np.empty((len(Cm), len(Bm), len(Ch), 3), dtype)
    rgb = np.empty_like(Lab)

    def work():
        R_of.begin(Ch)
        for i, cm in enumerate(Cm):
            for j, bm in enumerate(Bm):
                Lab[i, j], rgb[i, j] = colour_of.of(R_of.of(cm, bm))
        return Lab.reshape(-1, 3)

    return work, len(Cm) * len(Bm) * len(Ch)


def main():
    with open(sys.argv[1], encoding="ascii") as file:
        given = json.load(file)
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 1.0
    model = {"half-space": HalfSpace, "two-layer": TwoLayer}[given["model"]]
    variants = {}
    for chunk in (512, 1024, 2048, 4096):
        variants[f"f64, {chunk} rows"] = rows_by(model, F64, Colour, chunk, given)
        variants[f"f32 tuned, {chunk} rows"] = rows_by(model, F32, Colour, chunk, given)
        variants[f"f32 tuned, {chunk} rows, exp and log"] = rows_by(model, F32, Power, chunk, given)
    if model is TwoLayer:
        variants["f32 shared layers"] = shared_rows(F32, Power, given)
    ns, Lab = {}, {}
    for name, (work, n) in variants.items():
        ns[name] = 1e9 * timed(work, seconds / len(variants)) / n
        Lab[name] = work()[given["row"]].tolist()
    print(json.dumps({"numpy": np.__version__, "ns_a_row": ns, "Lab": Lab, "bands": len(given["base"])}))


if __name__ == "__main__":
    main()
