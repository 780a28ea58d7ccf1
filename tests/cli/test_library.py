#!/usr/bin/env python3
"""test_library.py - `make install` into a folder of its own, and the example program compiled
against what stands there, once with the shared and once with the static library."""

import os
import shlex
import subprocess

from support import Case, main

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
BUILD = os.environ.get("BUILD", "build")
EXAMPLE = os.path.join(ROOT, "docs/examples/library.c")
SKIN = ("0.03", "0.7", "0.01")


def command(*arguments, env=None):
    return subprocess.run(arguments, cwd=ROOT, env=env, capture_output=True, text=True, check=True)


class Library(Case):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.prefix = os.path.join(cls.shared_folder, "installed")
        # Under `make test` the environment hands on with what flags the build was made.
        command("make", "--no-print-directory", f"BUILD={BUILD}", f"PREFIX={cls.prefix}", "install")
        cls.env = {**os.environ, "PKG_CONFIG_PATH": os.path.join(cls.prefix, "lib/pkgconfig")}

    def flags(self, *what):
        return shlex.split(command("pkg-config", *what, "skinspec", env=self.env).stdout)

    def expected(self):
        """The same colour by the program: reflectance and convert."""
        cm, bm, ch = SKIN
        spectrum = self.run_ok("reflectance", "--cm", cm, "--bm", bm, "--ch", ch,
                               "--bands", "400:700:10").out
        lab = self.run_ok("convert", "-", "--json", stdin=spectrum.encode()).json()[0]["Lab"]
        return "L* %.2f a* %.2f b* %.2f\n" % tuple(lab)

    def compiled(self, *link):
        program = os.path.join(self.folder(), "example")
        command("cc", "-Wall", "-Wextra", "-Werror", *sanitizer_flags(), EXAMPLE,
                *self.flags("--cflags"), *link, "-o", program)
        env = {**os.environ, "LD_LIBRARY_PATH": os.path.join(self.prefix, "lib")}
        return command(program, *SKIN, env=env).stdout

    def test_shared(self):
        self.assertEqual(self.compiled(*self.flags("--libs")), self.expected())

    def test_static(self):
        archive = os.path.join(self.prefix, "lib/libskinspec.a")
        self.assertEqual(self.compiled(archive, "-lm", "-pthread"), self.expected())

    def test_only_what_the_headers_name_is_shown(self):
        """Functions that are no business of a library's user stay inside."""
        library = os.path.join(self.prefix, "lib/libskinspec.so")
        shown = command("nm", "-D", "--defined-only", library).stdout.split()
        for name in ("dipole_total", "xyz_weights_init", "matcher_match", "status_text"):
            self.assertIn(name, shown)
        for name in ("log_error", "parallel_run", "number_parse", "utf8_is_valid"):
            self.assertNotIn(name, shown)


def sanitizer_flags():
    """What the build in question was made with: an example must be linked alike."""
    with open(os.path.join(ROOT, BUILD, "flags")) as f:
        return [x for x in shlex.split(f.read()) if x.startswith("-fsanitize") or x == "--coverage"]


if __name__ == "__main__":
    main()
