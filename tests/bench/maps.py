"""maps.py - `skinspec map` beside the same fits of spectra in memory (map_rate.c), in turns."""

import glob
import os
import random
import resource
import statistics
import subprocess
import sys
import tempfile
import time

_TESTS = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
sys.path.insert(0, os.path.join(_TESTS, "cli"))

import cubes  # noqa: E402
import machine  # noqa: E402
import places  # noqa: E402
import report  # noqa: E402
from report import heading, row  # noqa: E402
from support import BUILD, SKINSPEC, run  # noqa: E402

RATE = os.path.join(BUILD, "bench", "map_rate")
SIDE, ROUNDS = 1000, 9
MAP_SHARE = 80
NM = list(range(400, 701, 10))
WHITE = 0.003
LAYOUTS = [("bip", 4, 0), ("bil", 4, 1), ("bsq", 4, 0), ("bil", 12, 0), ("bip", 12, 1), ("bsq", 12, 0)]


def _skins(model, n, rng):
    """Spectra of skins from light to dark with noise, as cameras see them."""
    spectra = []
    for _ in range(64):
        skin = ("--cm", 10 ** rng.uniform(-2, -0.7), "--bm", rng.random(), "--ch",
                10 ** rng.uniform(-2.5, -1.2))  # fmt: skip
        text = run("reflectance", "--model", model, *skin, "--bands", "400:700:10").out
        spectra.append([float(x) for x in text.splitlines()[1].split(",")[6:]])
    return [[max(x + rng.gauss(0, WHITE), 1e-3) for x in rng.choice(spectra)] for _ in range(n)]


def write(folder, model):
    """Cubes of a million pixels, one of each layout: {layout: header}.  Four lines, again and
    again: the same for the fit, and soon made."""
    rng = random.Random(1)
    lines = 4
    pixels = _skins(model, lines * SIDE, rng)
    made = {}
    for interleave, kind, order in LAYOUTS:
        name = os.path.join(folder, f"{model}-{interleave}-{kind}-{order}")
        scale = 10000 if kind == 12 else None
        with open(name + ".hdr", "w", encoding="utf-8") as file:
            file.write(cubes.header(SIDE, SIDE, NM, kind, order, interleave,
                                    reflectance_scale_factor=scale))  # fmt: skip
        with open(name + ".img", "wb") as file:
            planes = [[p[b] for p in pixels] for b in range(len(NM))]
            if interleave != "bsq":
                planes = [cubes.interleaved(pixels, SIDE, lines, interleave)]
            for plane in planes:
                counts = [int(x * scale + 0.5) for x in plane] if scale else plane
                packed = cubes.values(kind, order, counts)
                for _ in range(SIDE // lines):
                    file.write(packed)
        made[interleave, kind, order] = name + ".hdr"
    return made


def in_memory(header, model, refine, threads):
    """Seconds of wall clock, and of CPU, of the fits alone.  The cube: bip, float32."""
    done = subprocess.run(
        [RATE, header[:-4] + ".img", model, refine, str(WHITE), str(len(NM)), str(threads)],
        check=True, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    pixels, wall, cpu = done.stdout.split()
    assert int(pixels) == SIDE * SIDE
    return float(wall), float(cpu)


def mapped(header, model, refine, out, *options):
    """The same of a whole run of skinspec map, from exec to exit; what the last one made is gone."""
    for made in glob.glob(out + "*"):
        os.unlink(made)
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    began = time.perf_counter()
    subprocess.run(
        [SKINSPEC, "map", header, "--specular", "sce", "--model", model, "--refine=" + refine,
         "--noise", str(WHITE), "--out", out, *options],
        check=True, stdout=subprocess.DEVNULL,
    )  # fmt: skip
    wall = time.perf_counter() - began
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return wall, cpu


def show():
    """A cube of a million pixels to maps and pictures, beside the same fits in memory on as many
    threads: in turns, the medians of ROUNDS, of wall clock and of CPU."""
    places.program("map_rate")
    cores = len(os.sched_getaffinity(0))
    for model in ("half-space", "two-layer"):
        with tempfile.TemporaryDirectory(prefix="skinspec-bench.", dir=places.MEMORY) as folder:
            cubes = write(folder, model)
            heading(f"a cube of 1000 x 1000 x 31 to maps of Cm, Bm, Ch, {model}, {cores} threads: "
                    f"median of {ROUNDS}, seconds, and CPU seconds")  # fmt: skip
            reference = cubes["bip", 4, 0]
            bare = "bip, float32, --no-pictures"
            took = {name: [] for name in ("in memory", bare, *cubes)}
            with machine.Others() as others:
                for _ in range(ROUNDS):
                    took["in memory"].append(in_memory(reference, model, "three", cores))
                    for layout, cube in cubes.items():
                        took[layout].append(mapped(cube, model, "three", folder + "/out"))
                    took[bare].append(mapped(reference, model, "three", folder + "/out",
                                             "--no-pictures"))  # fmt: skip
            wall, cpu = (
                {name: statistics.median(x[i] for x in took[name]) for name in took} for i in (0, 1)
            )
            row("in memory", f"{wall['in memory']:.2f} {cpu['in memory']:.2f}")
            for (interleave, kind, order), _ in cubes.items():
                layout = interleave, kind, order
                name = f"{interleave}, {'float32' if kind == 4 else 'uint16'}, byte order {order}"
                row(name, f"{wall[layout]:.2f} {cpu[layout]:.2f}")
            row(bare, f"{wall[bare]:.2f} {cpu[bare]:.2f}")
            slowest = max(cubes, key=lambda layout: wall[layout])
            share = 100 * wall["in memory"] / wall[slowest]
            row("rate of the slowest, of that in memory", f"{share:.0f} %", f">= {MAP_SHARE} %",
                share >= MAP_SHARE)  # fmt: skip
            row("the same by CPU; without pictures",
                f"{100 * cpu['in memory'] / max(cpu[x] for x in cubes):.0f} %; "
                f"{100 * cpu['in memory'] / cpu[bare]:.0f} %")  # fmt: skip
            report.others(others.percent)
