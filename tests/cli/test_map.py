"""`skinspec map`: cubes to maps, whatever their layout; stopped and gone on with; and what is
refused."""

import array
import hashlib
import json
import math
import os
import random
import re
import resource
import signal
import struct
import time

import cubes
from support import (  # noqa: F401
    INSTRUMENTED,
    TIMEOUT_S,
    Case,
    Terminal,
    main,
    run,
    srgb_code,
    start,
)

NM = list(range(400, 701, 10))
SCE = ("--specular", "sce")
SKINS = [(0.02, 0.6, 0.01), (0.05, 0.3, 0.03), (0.1, 0.8, 0.005), (0.2, 0.5, 0.05)]
LINES = 1500 if INSTRUMENTED else 20000  # of a big cube: a skin fit takes AddressSanitizer 0.1 ms
BANDS = ["Cm", "Bm", "Ch", "Cm_se", "Bm_se", "Ch_se", "rms", "flags"]


def reflectance(skin, model="two-layer", nm="400:700:10", more=()):
    text = run("reflectance", "--model", model, "--cm", skin[0], "--bm", skin[1], "--ch", skin[2],
               "--bands", nm, *more).out  # fmt: skip
    return [float(x) for x in text.splitlines()[1].split(",")[6:]]


def sha(path):
    with open(path, "rb") as file:
        return hashlib.sha256(file.read()).hexdigest()


def names(folder, prefix):
    """What of a map is in a folder, the cube's own files aside."""
    return sorted(x for x in os.listdir(folder) if x.startswith(prefix))


class MapCase(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.spectra = [reflectance(skin) for skin in SKINS]

    def noisy(self, n, seed=1):
        rng = random.Random(seed)
        return [
            [max(x + rng.gauss(0, 0.002), 1e-3) for x in self.spectra[i % len(SKINS)]]
            for i in range(n)
        ]

    def map(self, cube, *options, status=0):
        """Prefix of the map of a cube."""
        prefix = os.path.join(self.folder(), "m")
        self.run_ok("map", cube, *SCE, "--out", prefix, *options)
        return prefix


class Maps(MapCase):
    def test_known_skins_come_back(self):
        """Spectra of the model itself, both models: the truth, and no residual."""
        for model in ("two-layer", "half-space"):
            spectra = [reflectance(skin, model) for skin in SKINS]
            cube = cubes.write(self.folder(), spectra * 3, 4, NM)
            got = cubes.read_map(self.map(cube, "--model", model, "--noise", "0.001"))
            self.assertEqual(list(got), BANDS)
            for i in range(12):
                for k, name in enumerate(("Cm", "Bm", "Ch")):
                    self.assertClose(got[name][i], SKINS[i % 4][k], relative=2e-3, what=(model, name))
                self.assertLess(got["rms"][i], 1e-5)
                self.assertEqual(got["flags"][i], 0)

    def test_as_match_has_it(self):
        """The same values, errors and residual as `match --refine` gives for the spectra."""
        pixels = self.noisy(8)
        got = cubes.read_map(self.map(cubes.write(self.folder(), pixels, 4, NM), "--noise", "0.002"))
        text = "id," + ",".join(map(str, NM)) + "\n"
        # What a float holds is what both are given.
        as_float = [array.array("f", p).tolist() for p in pixels]
        text += "".join(f"{i}," + ",".join(map(repr, p)) + "\n" for i, p in enumerate(as_float))
        rows = self.run_ok("match", self.file(text), *SCE, "--refine", "--noise", "0.002", "--json")
        for i, row in enumerate(rows.json()):
            for name in ("Cm", "Bm", "Ch"):
                se = row["se"][name]
                self.assertClose(got[name][i], row[name], absolute=2e-3 * se, relative=1e-6)
                self.assertClose(got[name + "_se"][i], se, relative=2e-3)
            self.assertClose(got["rms"][i], row["rms"], relative=1e-3)

    def test_layout_changes_nothing(self):
        """Interleave, type, byte order, offset, threads: the same bytes of the map, and pictures."""
        pixels = [[round(x * 50000) / 50000 for x in p] for p in self.noisy(7 * 9)]
        maps = {}
        for interleave in ("bil", "bip", "bsq"):
            for kind in (4, 12):
                for order in (0, 1):
                    cube = cubes.write(self.folder(), pixels, 7, NM, kind, order, interleave,
                                       scale=50000, offset=order * 123)  # fmt: skip
                    # What the float cube holds are the same whole numbers.
                    with open(cube, encoding="utf-8") as file:
                        self.assertIn("scale factor = 50000", file.read())
                    prefix = self.map(cube, "--threads", 1 + order)
                    with open(prefix + ".hdr", encoding="utf-8") as file:
                        header = [x for x in file if not x.startswith(";")]
                    maps[interleave, kind, order] = header + [
                        sha(prefix + x) for x in (".img", "-Cm.png", "-rms.png")
                    ]
        self.assertEqual(len(maps), 12)
        # Scaled floats are not all whole: these differ in the last bit of what is measured.
        for kind in (4, 12):
            self.assertEqual(len({tuple(v) for k, v in maps.items() if k[1] == kind}), 1)

    def test_long_lines_and_many(self):
        """Pieces of lines and of many lines give what single pixels give."""
        pixels = self.noisy(16)
        expect = cubes.read_map(self.map(cubes.write(self.folder(), pixels, 4, NM)))
        for samples, lines in ((9000, 3), (3, 4000)):
            each = [pixels[i % 16] for i in range(samples * lines)]
            for interleave in ("bil", "bip", "bsq"):
                cube = cubes.write(self.folder(), each, samples, NM, interleave=interleave)
                got = cubes.read_map(self.map(cube, "--no-pictures"))
                for name in BANDS:
                    self.assertEqual(got[name], [expect[name][i % 16] for i in range(len(each))])

    def test_scale_surface_and_epidermis(self):
        sci = [[x + 0.04 for x in p] for p in self.spectra]
        cube = cubes.write(self.folder(), sci, 2, NM)
        prefix = os.path.join(self.folder(), "m")
        self.run_ok("map", cube, "--specular", "sci", "--surface", "0.04", "--out", prefix)
        got = cubes.read_map(prefix)
        for i, skin in enumerate(SKINS):
            self.assertClose(got["Cm"][i], skin[0], relative=1e-2)
        percent = cubes.write(self.folder(), [[100 * x for x in p] for p in self.spectra], 2, NM)
        got = cubes.read_map(self.map(percent, "--scale", "100"))
        for i, skin in enumerate(SKINS):
            self.assertClose(got["Ch"][i], skin[2], relative=1e-2)
        thin = [reflectance(skin, more=("--epidermis-mm", "0.04")) for skin in SKINS]
        cube = cubes.write(self.folder(), thin, 2, NM)
        got = cubes.read_map(self.map(cube, "--epidermis-mm", "0.04"))
        other = cubes.read_map(self.map(cube))
        for i, skin in enumerate(SKINS):
            self.assertClose(got["Cm"][i], skin[0], relative=1e-2)
            self.assertLess(other["Cm"][i], 0.9 * skin[0])

    def test_held_and_skin(self):
        cube = cubes.write(self.folder(), self.spectra, 2, NM)
        got = cubes.read_map(self.map(cube, "--fix", "Bm=0.5"))
        self.assertEqual(list(got), ["Cm", "Ch", "Cm_se", "Ch_se", "rms", "flags"])
        prefix = self.map(cube, "--refine=skin")
        got = cubes.read_map(prefix)
        self.assertEqual(list(got)[:5], ["Cm", "Ch", "SO2", "scattering_a", "scattering_b"])
        self.assertTrue(os.path.exists(prefix + "-SO2.png"))

    def test_pixels_left_out(self):
        """Each reason, counted, NaN in the maps and told in the flags."""
        pixels = self.noisy(8)
        pixels[1][3] = -9999.0
        pixels[2][30] = math.nan
        pixels[3][0] = math.inf
        pixels[4][10] = 0.0
        pixels[5][10] = 1.6
        pixels[6] = [0.001] * 31
        cube = cubes.write(self.folder(), pixels, 4, NM, data_ignore_value=-9999)
        prefix = os.path.join(self.folder(), "m")
        told = self.run_ok("map", cube, *SCE, "--out", prefix, "--json").json()
        got = cubes.read_map(prefix)
        self.assertEqual([int(x) for x in got["flags"][:6]], [0, 1, 2, 2, 4, 4])
        for i in range(8):
            for name in BANDS[:-1]:
                self.assertEqual(math.isnan(got[name][i]), 1 <= i <= 5, (i, name))
        self.assertEqual(told["fitted"], 3)
        self.assertEqual(told["pixels"], 8)
        self.assertEqual((told["flags"]["ignored"], told["flags"]["not_a_number"],
                          told["flags"]["out_of_range"]), (1, 2, 2))  # fmt: skip
        # The last one is darker than skin can be.
        self.assertGreater(int(got["flags"][6]) & (32 | 64), 0)
        width, rows, palette = cubes.read_png(prefix + "-Cm.png")
        zoom = (width - 16) // 4
        self.assertEqual(palette[rows[8][8 + zoom]], (160, 160, 160))
        self.assertNotEqual(palette[rows[8][8]], (160, 160, 160))

    def test_ends_of_intervals(self):
        """1.96 standard errors to either side, and no farther than the fit may go."""
        pixels = self.noisy(9) + [[0.0] * 31, self.spectra[3]]  # one that is not fitted
        cube = cubes.write(self.folder(), pixels, 11, NM)
        bounds = {"Cm": (0.001, 0.5), "Bm": (0, 1), "Ch": (0.001, 0.1)}
        whole = self.map(cube, "--intervals")
        got, plain = cubes.read_map(whole), cubes.read_map(self.map(cube))
        for name in BANDS:
            self.assertEqual([repr(x) for x in got[name]], [repr(x) for x in plain[name]], name)
        touched = 0
        for name, (lo, hi) in bounds.items():
            for i in [*range(9), 10]:
                value, half = got[name][i], 1.959964 * got[name + "_se"][i]
                self.assertClose(got[name + "_lo"][i], max(value - half, lo), relative=1e-5,
                                 absolute=1e-7)  # fmt: skip
                self.assertClose(got[name + "_hi"][i], min(value + half, hi), relative=1e-5)
                touched += value - half < lo or value + half > hi
            self.assertTrue(math.isnan(got[name + "_lo"][9]) and math.isnan(got[name + "_hi"][9]))
            self.assertTrue(os.path.exists(f"{whole}-{name}_lo.png"))
        self.assertGreater(touched, 0)

    def test_no_pixel_at_all(self):
        cube = cubes.write(self.folder(), [[0.0] * 31] * 6, 3, NM)
        prefix = os.path.join(self.folder(), "m")
        self.refused(1, "map", cube, *SCE, "--out", prefix,
                     says=["no pixel is a spectrum of skin", "'byte order'", "--scale"])  # fmt: skip
        self.assertEqual(cubes.read_map(prefix)["flags"], [4.0] * 6)
        # Nothing but fill is what was asked for.
        empty = cubes.write(self.folder(), [[-1.0] * 31] * 6, 3, NM, data_ignore_value=-1)
        self.assertEqual(cubes.read_map(self.map(empty))["flags"], [1.0] * 6)

    def test_what_the_model_does_not_explain(self):
        """Bands in another order: reflectances all of them, and of no skin."""
        wrong = [[p[(7 * i) % 31] for i in range(31)] for p in self.noisy(12)]
        said = run("map", cubes.write(self.folder(), wrong, 4, NM), *SCE).err
        self.assertIn("warning", said)
        self.assertIn("in 100.0 % of the pixels", said)
        self.assertIn("--refine=skin", said)
        right = run("map", cubes.write(self.folder(), self.noisy(12), 4, NM), *SCE)
        self.assertEqual((right.status, right.err), (0, ""))

    def test_bands_that_stand_otherwise(self):
        """Fine bands, of which the grid is made: what smooth skin lets one expect."""
        fine = [reflectance(skin, nm="390:710:2") for skin in SKINS]
        nm = [390 + 2 * i for i in range(161)]
        cube = cubes.write(self.folder(), fine, 2, nm)
        prefix = os.path.join(self.folder(), "m")
        told = self.run_ok("map", cube, *SCE, "--out", prefix, "--json").json()
        self.assertEqual(told["bands"], {"used": 161, "as_is": False, "first_nm": 400,
                                         "step_nm": 10, "n": 31})  # fmt: skip
        got = cubes.read_map(prefix)
        for i, skin in enumerate(SKINS):
            # A triangle of 10 nm dulls haemoglobin's bands: more than nothing, not much.
            self.assertClose(got["Cm"][i], skin[0], relative=0.05)
            self.assertClose(got["Ch"][i], skin[2], relative=0.1)
        # By micrometres, and with the bad bands marked: the same, from fewer bands.
        bbl = "{" + ", ".join("0" if 40 <= i < 45 else "1" for i in range(161)) + "}"
        micro = cubes.write(self.folder(), fine, 2, nm, bbl=bbl, wavelength_units="Micrometers",
                            wavelength="{" + ", ".join(f"{x / 1000:g}" for x in nm) + "}")  # fmt: skip
        other = cubes.read_map(self.map(micro))
        self.assertNotEqual(other["Cm"], got["Cm"])
        self.assertClose(other["Cm"][0], got["Cm"][0], relative=0.02)

    def test_picture(self):
        """Ranges given: a pixel's colour is its place between them."""
        cube = cubes.write(self.folder(), self.spectra * 75, 300, NM)
        prefix = self.map(cube, "--range", "Cm=0:0.25", "--noise", "0.001")
        width, rows, palette = cubes.read_png(prefix + "-Cm.png")
        self.assertEqual(width, 316)
        self.assertEqual(len(palette), 253)
        for i, (Cm, _, _) in enumerate(SKINS):
            self.assertAlmostEqual(rows[8][8 + i], int(Cm / 0.25 * 250), delta=1)
        # The bar: from the least colour to the most, below the map.
        bar = [row for row in rows[10:] if row[8] == 0 and row[8 + 299] == 249]
        self.assertEqual(len(bar), 12)
        # Lightness rises: what sRGB's luminance is.
        grey = [0.2126 * (r / 255) ** 2.2 + 0.7152 * (g / 255) ** 2.2 + 0.0722 * (b / 255) ** 2.2
                for r, g, b in palette[:250]]  # fmt: skip
        self.assertTrue(all(b > a - 2e-3 for a, b in zip(grey, grey[1:])))
        self.assertGreater(grey[249] - grey[0], 0.7)

    def test_report(self):
        cube = cubes.write(self.folder(), self.spectra * 5, 5, NM)
        done = self.run_ok("map", cube, *SCE)
        for text in ("5 by 4 pixels", "fitted 20 of 20", "two-layer", "Cm_se", "cube-map.img"):
            self.assertIn(text, done.out)
        prefix = cube[:-4] + "-map"
        medians = cubes.read_map(prefix)
        told = self.run_ok("map", cube, *SCE, "--force", "--json").json()
        for band in told["maps"]:
            self.assertEqual(band["median"], sorted(medians[band["name"]])[9])
            self.assertTrue(os.path.exists(band["picture"]))


class Stopped(MapCase):
    def big(self, interleave="bil"):
        """Seconds of work."""
        folder = self.folder()
        pixels = self.noisy(64)
        with open(os.path.join(folder, "cube.hdr"), "w", encoding="utf-8") as file:
            file.write(cubes.header(64, LINES, NM, interleave=interleave))
        planes = [cubes.interleaved(pixels, 64, 1, interleave)]
        if interleave == "bsq":
            planes = [[pixel[b] for pixel in pixels] for b in range(len(NM))]
        with open(os.path.join(folder, "cube.img"), "wb") as file:
            for plane in planes:
                line = cubes.values(4, 0, plane)
                for _ in range(LINES):
                    file.write(line)
        return os.path.join(folder, "cube.hdr")

    def stop(self, cube, how, wait, *options):
        """Begin a map and stop it; what it said, and its status."""
        process = start("map", cube, *SCE, "--refine=skin", "--threads", "2", *options, stderr=-1,
                        stdout=-1)  # fmt: skip
        part = cube[:-4] + "-map.img.part"
        until = time.monotonic() + 60
        while not os.path.exists(part) and time.monotonic() < until:
            time.sleep(0.01)
        time.sleep(wait)
        process.send_signal(how)
        _, err = process.communicate(timeout=TIMEOUT_S)
        return process.returncode, err.decode()

    def test_resumed_is_as_uninterrupted(self):
        cube = self.big()
        prefix = cube[:-4] + "-map"
        whole = os.path.join(self.folder(), "whole")
        status, err = self.stop(cube, signal.SIGINT, 0.6)
        self.assertEqual(status, -signal.SIGINT, err)
        self.assertIn("--resume goes on from there", err)
        folder = os.path.dirname(cube)
        self.assertEqual(names(folder, "cube-map"), ["cube-map.img.part", "cube-map.img.resume"])
        with open(prefix + ".img.resume", encoding="utf-8") as file:
            first = int(file.read().rsplit("lines done: ", 1)[1])
        self.assertTrue(0 < first < LINES, first)
        # Without a word it is neither gone on with nor overwritten; nor with other options.
        self.refused(1, "map", cube, *SCE, "--refine=skin", says=["--resume", "--force"])
        self.refused(1, "map", cube, *SCE, "--resume", says=["'refine: skin'", "'refine: three'"])
        self.refused(1, "map", cube, *SCE, "--refine=skin", "--noise", "0.01", "--resume",
                     says=["noise white"])  # fmt: skip
        # Stopped once more, even at once by a signal that cannot be caught.
        status, err = self.stop_resumed(cube, signal.SIGKILL)
        self.assertEqual(status, -signal.SIGKILL)
        told = self.run_ok("map", cube, *SCE, "--refine=skin", "--resume", "--json").json()
        self.assertLess(told["lines_done"], LINES)
        self.run_ok("map", cube, *SCE, "--refine=skin", "--out", whole, "--threads", "1")
        for ending in (".img", ".hdr", "-Cm.png", "-SO2.png", "-rms.png"):
            self.assertEqual(sha(prefix + ending), sha(whole + ending), ending)
        self.assertFalse(os.path.exists(prefix + ".img.part"))
        self.assertFalse(os.path.exists(prefix + ".img.resume"))
        # Gone on with once more, as a queue may: it is whole, and stays so.
        before = os.stat(prefix + ".img")
        again = run("map", cube, *SCE, "--refine=skin", "--resume")
        self.assertEqual(again.status, 0, again.err)
        self.assertIn("cube-map.img is whole already", again.err)
        self.assertEqual(os.stat(prefix + ".img"), before)
        self.refused(1, "map", cube, *SCE, "--resume", says=["'refine: skin'", "'refine: three'"])

    def test_a_map_that_replaces_another_goes_on(self):
        """--force of a run that was stopped holds for the one that goes on; a map that came
        meanwhile is not replaced."""
        cube = self.big()
        prefix = cube[:-4] + "-map"
        with open(prefix + ".img", "wb") as file:
            file.write(b"an old map")
        self.refused(2, "map", cube, *SCE, "--resume", "--force", says="give one of them")
        status, err = self.stop(cube, signal.SIGTERM, 0.5, "--force")
        self.assertEqual(status, -signal.SIGTERM, err)
        self.assertIn("with --resume in place of --force goes on from there", err)
        with open(prefix + ".img", "rb") as file:
            self.assertEqual(file.read(), b"an old map")
        status, err = self.stop_resumed(cube, signal.SIGTERM)
        self.assertIn("with --resume goes on from there", err)
        told = self.run_ok("map", cube, *SCE, "--refine=skin", "--resume", "--json").json()
        self.assertLess(told["lines_done"], LINES)
        whole = os.path.join(self.folder(), "whole")
        self.run_ok("map", cube, *SCE, "--refine=skin", "--out", whole)
        self.assertEqual(sha(prefix + ".img"), sha(whole + ".img"))
        for name in names(os.path.dirname(cube), "cube-map"):
            os.unlink(os.path.join(os.path.dirname(cube), name))
        self.stop(cube, signal.SIGTERM, 0.5)
        with open(prefix + ".img", "wb") as file:
            file.write(b"another map")
        self.refused(1, "map", cube, *SCE, "--refine=skin", "--resume", says="exists already")
        with open(prefix + ".img", "rb") as file:
            self.assertEqual(file.read(), b"another map")

    def stop_resumed(self, cube, how):
        process = start("map", cube, *SCE, "--refine=skin", "--resume", "--threads", "2", stderr=-1,
                        stdout=-1)  # fmt: skip
        time.sleep(0.4)
        process.send_signal(how)
        _, err = process.communicate(timeout=TIMEOUT_S)
        return process.returncode, err.decode()

    def test_cube_cut_short_meanwhile(self):
        """The data's end goes while they are read: told where, and what is done is kept."""
        for interleave in ("bil", "bip", "bsq"):
            cube = self.big(interleave)
            data = cube[:-4] + ".img"
            process = start("map", cube, *SCE, "--refine=skin", "--threads", "2", stderr=-1,
                            stdout=-1)  # fmt: skip
            until = time.monotonic() + 60
            while not os.path.exists(cube[:-4] + "-map.img.part") and time.monotonic() < until:
                time.sleep(0.01)
            os.truncate(data, os.path.getsize(data) * 3 // 4)
            _, err = process.communicate(timeout=TIMEOUT_S)
            err = err.decode()
            self.assertEqual(process.returncode, 1, err)
            self.assertIn("cube.img at byte ", err)
            self.assertIn("it ends there now, it was longer before", err)
            self.assertFalse(os.path.exists(cube[:-4] + "-map.img"))
            self.refused(1, "map", cube, *SCE, "--refine=skin", "--resume", says="is cut short")

    def test_another_cube_is_not_gone_on_with(self):
        cube = self.big()
        self.stop(cube, signal.SIGTERM, 0.5)
        os.utime(cube[:-4] + ".img", ns=(1, 10**18))
        self.refused(1, "map", cube, *SCE, "--refine=skin", "--resume", says="cube data")
        with open(cube, "a", encoding="utf-8") as file:
            file.write("; changed\n")
        self.refused(1, "map", cube, *SCE, "--refine=skin", "--resume", says="cube header")
        with open(cube, encoding="utf-8") as file:
            shorter = re.sub(r"(?m)^lines = .*$", "lines = 7", file.read())
        with open(cube, "w", encoding="utf-8") as file:
            file.write(shorter)
        self.refused(1, "map", cube, *SCE, "--refine=skin", "--resume", says="cube header")
        with open(cube[:-4] + "-map.img.resume", "w", encoding="utf-8") as file:
            file.write("something else\n")
        self.refused(1, "map", cube, *SCE, "--refine=skin", "--resume", says="does not say")
        self.run_ok("map", cube, *SCE, "--force", "--no-pictures")

    def test_bar(self):
        cube = self.big()
        with Terminal("map", cube, *SCE, "--refine=skin", "--no-pictures") as terminal:
            terminal.expect("map [")
            terminal.process.send_signal(signal.SIGINT)
            status, seen = terminal.end()
        self.assertEqual(status, -signal.SIGINT)
        self.assertIn(f"{LINES} lines; the same command with --resume", seen)


class Refused(MapCase):
    def cube(self, **more):
        return cubes.write(self.folder(), self.spectra, 2, NM, **more)

    def refused_clean(self, status, cube, *options, says, **more):
        """Refused, and nothing is left behind."""
        prefix = os.path.join(self.folder(), "m")
        self.refused(status, "map", cube, *options, "--out", prefix, says=says, **more)
        self.assertEqual(names(os.path.dirname(prefix), "m"), [])

    def test_usage(self):
        cube = self.cube()
        for options, says in (
            ((), "--specular sce"),
            (("--specular", "sci"), "--surface S"),
            ((*SCE, "--surface", "0.04"), "--specular sci"),
            ((*SCE, "--specular", "maybe"), "'maybe'"),
            ((*SCE, "--model", "paper"), "cannot be fitted"),
            ((*SCE, "--nm", "700:400"), "LO:HI"),
            ((*SCE, "--nm", "100:700"), "250..1000"),
            ((*SCE, "--scale", "0"), "scale"),
            ((*SCE, "--range", "Cm"), "BAND=LO:HI"),
            ((*SCE, "--range", "Xy=0:1"), "no band 'Xy'"),
            ((*SCE, "--fix", "Cm=7"), "outside the fit's bounds"),
            ((*SCE, "--model", "half-space", "--epidermis-mm", "0.1"), "no epidermis"),
            ((*SCE, "--threads", "0"), "threads"),
            ((*SCE, "second.hdr"), "one FILE"),
        ):
            self.refused_clean(2, cube, *options, says=says)
        self.refused(2, "map", *SCE, says="CUBE.hdr")
        self.refused_clean(2, self.cube(kind=12, scale=10000, reflectance_scale_factor=None), *SCE,
                           says=["--scale 10000"])  # fmt: skip

    def test_headers(self):
        """File and line of what is wrong; the rest is tests/cube/test_envi_header.c."""
        self.refused_clean(1, self.cube(interleave="bil", data_type=5), *SCE,
                           says=["cube.hdr:6:", "float64", "4 (float32) and 12 (uint16)"])  # fmt: skip
        self.refused_clean(1, self.cube(byte_order=None), *SCE, says="'byte order' is missing")
        self.refused_clean(1, self.cube(wavelength=None), *SCE, says="'wavelength' is missing")
        self.refused_clean(1, self.file(b"\0\1\2", "x.hdr"), *SCE, says="no ENVI header")
        cube = self.cube()
        with open(cube, encoding="utf-8") as file:  # an editor's mark before it is none of its text
            marked = "\ufeff" + file.read()
        with open(cube, "w", encoding="utf-8") as file:
            file.write(marked)
        self.run_ok("map", cube, *SCE, "--out", os.path.join(self.folder(), "marked"))
        self.refused_clean(1, self.folder() + "/none.hdr", *SCE, says="No such file")

    def test_data(self):
        cube = self.cube()
        data = cube[:-4] + ".img"
        os.truncate(data, 31 * 4 * 4 - 5)
        self.refused_clean(1, cube, *SCE, says=["is cut short", "496", "491"])
        os.truncate(data, 31 * 4 * 4 + 3)
        prefix = os.path.join(self.folder(), "m")
        done = self.run_ok("map", cube, *SCE, "--out", prefix)
        self.assertIn("3 bytes more", done.err)
        os.rename(data, cube[:-4] + ".dat")
        self.map(cube)
        os.rename(cube[:-4] + ".dat", cube[:-4] + ".xyz")
        self.refused_clean(1, cube, *SCE, says="--data FILE")
        self.map(cube, "--data", cube[:-4] + ".xyz")
        for ending in (".img", ".raw"):
            with open(cube[:-4] + ending, "wb"):
                pass
        self.refused_clean(1, cube, *SCE, says=["both there", "--data"])
        self.refused_clean(1, cube, *SCE, "--data", self.folder(), says="no regular file")

    def test_bands(self):
        self.refused_clean(1, self.cube(wavelength="{" + ",".join(map(str, range(900, 931))) + "}"),
                           *SCE, says=["0 of 31 bands", "400..700"])  # fmt: skip
        self.refused_clean(1, self.cube(), *SCE, "--nm", "400:480", says="a fit needs 10")
        bbl = "{" + ",".join("0" if 10 <= i < 14 else "1" for i in range(31)) + "}"
        self.refused_clean(1, self.cube(bbl=bbl), *SCE, says="no good band between 490 and 540")

    def test_what_is_there_stays(self):
        cube = self.cube()
        prefix = self.map(cube)
        before = sha(prefix + ".img")
        self.refused(1, "map", cube, *SCE, "--model", "half-space", "--out", prefix, says="--force")
        os.unlink(prefix + ".img")
        os.unlink(prefix + ".hdr")
        self.refused(1, "map", cube, *SCE, "--out", prefix, says=["m-Cm.png", "--force"])
        self.run_ok("map", cube, *SCE, "--out", prefix, "--force")
        self.assertEqual(sha(prefix + ".img"), before)
        # The cube itself, whatever is said.
        own = sha(cube[:-4] + ".img")
        self.refused(1, "map", cube, *SCE, "--out", cube[:-4], "--force", says="the cube itself")
        self.assertEqual(sha(cube[:-4] + ".img"), own)

    def test_no_room(self):
        def limited():
            resource.setrlimit(resource.RLIMIT_FSIZE, (100, 100))

        self.refused_clean(1, self.cube(), *SCE, says="cannot make room", preexec_fn=limited)

        # Room for the map, but not for a picture: it is gone on with when there is.
        cube = cubes.write(self.folder(), self.noisy(60000), 300, NM)
        prefix = os.path.join(self.folder(), "m")
        size = 60000 * 4 * 8

        def later():
            resource.setrlimit(resource.RLIMIT_FSIZE, (size, size))

        big = ("map", cube, *SCE, "--out", prefix)
        self.run_ok(*big, "--no-pictures", preexec_fn=later)
        folder = self.folder()
        self.refused(1, "map", cube, *SCE, "--out", folder + "/none/m", says="No such file")
        if os.getuid() == 0:
            return
        os.chmod(folder, 0o500)
        self.refused(1, "map", cube, *SCE, "--out", folder + "/m", says="Permission denied")


if __name__ == "__main__":
    main()
