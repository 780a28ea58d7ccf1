#!/usr/bin/env python3
"""test_input.py - spectrum files that are not as they should be: each gets a message with
file:line:column that says what was expected, and a bad row leaves the others alone."""

import os
import random

from support import NM, SKINSPEC, Case, build_table, main, run, spectra_csv

GOOD = [0.5] * 31
HEADER = "id," + ",".join(map(str, NM))


def line(first, *values):
    return ",".join([first, *map(str, values or GOOD)])


def text(*lines, end="\n"):
    return "".join(x + end for x in (HEADER, *lines))


class Whole(Case):
    """What is wrong with a file as a whole: nothing on standard output, exit status 1."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        grid = ("--cm", "0.1:0.3:3", "--bm", "0:1:2", "--ch", "0.01:0.1:2")
        cls.table = build_table(cls.shared_folder, *grid)

    def refuse(self, content, where, *says):
        """By all commands that read spectra, from a file and through a pipe."""
        path = self.file(content)
        match = ("--table", self.table, "--specular", "sce", "--by", "lab")
        for command in (("convert", path), ("convert", path, "--json"), ("match", path, *match)):
            done = self.refused(1, *command, says=(f"{path}:{where}", *says))
            self.assertEqual(done.out, "", command)
            self.assertEqual(len(done.err.splitlines()), 1, done.err)
        with open(path, "rb") as f:
            done = self.refused(1, "convert", "-", stdin=f.read(), says=(f"<stdin>:{where}", *says))
        self.assertEqual(done.out, "")

    def test_empty(self):
        for content in ("", "\n\n\n", "# only a comment\n", "\ufeff", "\r\n\r\n"):
            self.refuse(content, " empty", "400,410")

    def test_rows_that_are_blank_are_passed_over(self):
        """What spreadsheets leave below (and between) their data."""
        blank = "," * 31
        path = self.file(text(line("a"), blank, line("b"), blank, " , " + "," * 30))
        self.assertEqual([r["id"] for r in self.run_ok("convert", path).rows()], ["a", "b"])

    def test_no_wavelengths(self):
        for content in ("id,note\na,b\n", "R400,R410\n0.1,0.2\n", "id,400nm,410nm\na,0.1,0.2\n"):
            self.refuse(content, "1:1:", "no wavelengths", "400,410")
        # One row per wavelength instead of one per spectrum.
        self.refuse("wavelength,a\n400,0.1\n410,0.1\n", "1:1:", "one row per spectrum")

    def test_wavelengths_that_do_not_rise(self):
        self.refuse("id,400,400,410\na,1,1,1\n", "1:8:", "400 stands twice")
        self.refuse("id,400,410,405\na,1,1,1\n", "1:12:", "405", "rise")
        self.refuse("id,note,700,690\na,x,1,1\n", "1:13:", "690", "rise")

    def test_uneven_wavelengths(self):
        self.refuse("id,400,410,430\na,1,1,1\n", "1:12:", "430", "10 nm", "expected 420")
        self.refuse("id,400,410\na,1,1\n".replace("410", "400.0"), "1:8:", "stands twice")

    def test_other_units(self):
        self.refuse("id,0.40,0.41,0.42\na,1,1,1\n", "1:1:", "nanometres")
        self.refuse("id,4000,4010,40000\na,1,1,1\n".replace("4010", "22000"), "1:1:", "nanometres")

    def test_too_few_bands_for_colour(self):
        for nm in (
            range(400, 421, 10),
            range(410, 701, 10),
            range(400, 691, 10),
            range(500, 601, 10),
        ):
            bands = list(nm)
            content = spectra_csv([("a", [0.5] * len(bands))], bands)
            self.refuse(content, "1:4:", "too few for colour", "400..700")

    def test_wrong_step(self):
        for step in (20, 2, 3, 0.5):
            bands = [380 + i * step for i in range(int(400 / step) + 1)]
            content = spectra_csv([("a", [0.5] * len(bands))], bands)
            self.refuse(content, "1:4:", "10, 5 or 1 nm")
        bands = [x + 0.5 for x in range(380, 781, 10)]
        self.refuse(spectra_csv([("a", [0.5] * 41)], bands), "1:4:", "whole multiples")
        bands = [x + 3 for x in range(380, 781, 10)]
        self.refuse(spectra_csv([("a", [0.5] * 41)], bands), "1:4:", "whole multiples")

    def test_one_band(self):
        self.refuse("id,400\na,0.5\n", "1:1:", "only one wavelength")

    def test_too_many_bands(self):
        bands = ",".join(map(str, range(300, 1400)))
        self.refuse(f"id,{bands}\n", "1:4424:", "more than 1024")
        fields = ",".join(f"c{i}" for i in range(5000))
        self.refuse(f"{fields}\n", "1:", "4096 fields")

    def test_other_separators(self):
        for mark, name in ((";", "';'"), ("\t", "'tab'")):
            self.refuse(HEADER.replace(",", mark) + "\n", "1:1:", name, "commas")
        # As spreadsheets write where the comma is the decimal mark.
        rows = (
            HEADER.replace(",", ";")
            + "\n"
            + line("a", *["0.5"] * 31).replace(",", ";").replace(".", ",")
        )
        self.refuse(rows + "\n", "1:1:", "';'", "points as decimal marks")

    def test_binary(self):
        noise = random.Random(1)
        for content in (
            bytes(200),
            b"\x89PNG\r\n\x1a\n\0\0",
            b"PK\x03\x04" + noise.randbytes(300),
            b"\x7fELF\x02\x01\x01\0",
            noise.randbytes(5000).replace(b"#", b""),
        ):
            # Whatever the noise begins with, it is refused in the first line or so.
            done = self.refused(1, "convert", self.file(content), says=":1:")
            self.assertEqual(done.out, "")
            self.assertRegex(done.err, "not a text file|UTF-16|UTF-8")
        self.refused(1, "convert", SKINSPEC, says=("not a text file",))

    def test_utf16(self):
        for encoding in ("utf-16-le", "utf-16-be"):
            with_mark = "\ufeff" + text(line("a"))
            self.refuse(with_mark.encode(encoding), "1:1:", "UTF-16", "UTF-8")
            self.refuse(text(line("a")).encode(encoding), "1:", "not a text file")

    def test_header_that_is_not_utf8(self):
        content = HEADER.replace("id", "id,Größe").encode("latin-1") + b"\n"
        self.refuse(content, "1:4:", "not UTF-8", "save the file as UTF-8")

    def test_huge_line(self):
        self.refuse("a" * 3_000_000 + "\n", "1:1048578:", "1 MiB")
        self.refuse('"' + "a\n" * 1_000_000, "524289:2:", "1 MiB")

    def test_carriage_returns_alone(self):
        self.refuse(text(line("a"), line("b"), end="\r"), f"1:{len(HEADER) + 1}:", "LF or CRLF")

    def test_no_such_file(self):
        folder = self.folder()
        for path in (os.path.join(folder, "none.csv"), folder, "/proc/self/mem", ""):
            done = self.refused(1, "convert", path, says=f"{path}: ")
            self.assertEqual(done.out, "")


class Rows(Case):
    """What is wrong with one row: its place says so, the others are answered."""

    def bad_row(self, row, where, *says, ndjson_id="bad"):
        content = row if isinstance(row, bytes) else row.encode()
        content = text(line("first")).encode() + content + b"\n" + line("last").encode() + b"\n"
        path = self.file(content)
        done = self.refused(1, "convert", path, "--ndjson", says=(f"{path}:{where}: ", *says))
        self.assertEqual(len(done.err.splitlines()), 1, done.err)
        first, bad, last = done.ndjson()
        self.assertEqual((first["id"], last["id"]), ("first", "last"))
        self.assertEqual(bad, {"id": ndjson_id, "error": bad["error"]})
        self.assertIn(bad["error"], done.err)
        self.assertEqual(run("convert", path, "--json").json(), [first, bad, last])
        rows = run("convert", path).rows()
        self.assertEqual([r["error"] for r in rows], ["", bad["error"], ""])
        self.assertEqual((rows[1]["X"], rows[1]["clipped"]), ("", ""))
        self.assertEqual(rows[2]["L"], rows[0]["L"])
        strict = run("convert", path, "--strict", "--json")
        self.assertEqual((strict.status, strict.json()), (1, [first, bad]))

    def with_value(self, value, band=4):
        values = list(GOOD)
        values[band] = value
        return line("bad", *values)

    def test_values(self):
        for value, *says in (
            ("nan", "'nan' at 440 nm", "finite"),
            ("NaN", "'NaN' at 440 nm", "finite"),
            ("inf", "'inf'", "finite"),
            ("-inf", "'-inf'", "finite"),
            ("1e999", "'1e999'", "finite"),
            ("", "no value at 440 nm", "0..1"),
            ("  ", "no value at 440 nm"),
            ("abc", "'abc' at 440 nm is not a number", "0..1"),
            ("0x1p-1", "'0x1p-1'", "not a number"),
            ("0.5.5", "'0.5.5'", "not a number"),
            ("1e", "'1e'", "not a number"),
            ("--1", "'--1'", "not a number"),
            ("0.5 0.5", "not a number"),
            ("-0.001", "-0.001 at 440 nm is negative"),
            ("2.1", "2.1 at 440 nm is above 2", "percent", "divide by 100"),
            ("52.5", "52.5 at 440 nm is above 2", "percent", "divide by 100"),
            ("52.5%", "'52.5%' at 440 nm", "percent", "divide by 100"),
            ("1000", "1000 at 440 nm is above 2", "0..1"),
            ("x" * 1000, "xxx...", "not a number"),
            ("µ" * 1000, "µµµ...", "not a number"),
        ):
            with self.subTest(value=value[:20]):
                self.bad_row(self.with_value(value), f"3:{5 + 4 * 4}", *says)

    def test_what_is_let_through(self):
        for value in (
            "0",
            "-0",
            "2",
            "1.02",
            "+0.5",
            ".5",
            "1.",
            "5e-1",
            "5E-1",
            " 0.5 ",
            '"0.5"',
            "1e-400",
        ):
            done = self.run_ok("convert", "-", "--ndjson", stdin=text(self.with_value(value)))
            self.assertNotIn("error", done.ndjson()[0], value)

    def test_percent_throughout(self):
        self.bad_row(line("bad", *[50] * 31), "3:5", "percent", "divide by 100")

    def test_decimal_commas(self):
        self.bad_row(line("bad", *['"0,5"'] * 31), "3:5", "decimal comma", "with a point")
        # Not quoted, each number falls in two.
        self.bad_row(line("bad", *["0,5"] * 31), f"3:{5 + 2 * 31}", "decimal comma", "with a point")

    def test_ragged(self):
        self.bad_row(line("bad", *GOOD[:30]), "3:121", "31 fields where the header has 32")
        self.bad_row(line("bad", *GOOD, "0.5"), "3:129", "33 fields where the header has 32")
        self.bad_row("bad", "3:1", "1 field where the header has 32")
        self.bad_row(
            line("bad", *GOOD[:5]).replace(",", ";"),
            "3:1",
            "1 field where",
            ndjson_id="bad" + ";0.5" * 5,
        )

    def test_not_utf8(self):
        self.bad_row(line("bäd").encode("latin-1"), "3:1", "not UTF-8", ndjson_id=2)
        self.bad_row(self.with_value("?").encode().replace(b"?", b"\xff"), "3:21", "not UTF-8")
        surrogate = line("bad").encode() + b"\xed\xa0\x80"
        self.bad_row(surrogate, "3:125", "not UTF-8")

    def test_place_after_quoted_lines(self):
        """Lines are those of the file, columns count its bytes."""
        rows = ['"a\nb"' + line("")[0:], self.with_value("x")]
        path = self.file(text(*rows))
        self.refused(1, "convert", path, says=f"{path}:4:21: 'x'")
        path = self.file("# one\n# two\n\n" + text(self.with_value("x").replace("bad", "bäd")))
        self.refused(1, "convert", path, says=f"{path}:5:22: 'x'")

    def test_all_bad(self):
        done = run("convert", "-", "--json", stdin=text(*[self.with_value("x")] * 3))
        self.assertEqual(done.status, 1)
        self.assertEqual([set(x) for x in done.json()], [{"id", "error"}] * 3)


class Stops(Case):
    """What no reader can go on after: what came before is there and well formed."""

    def stops(self, tail, where, *says):
        content = text(line("first")).encode() + tail
        done = self.refused(
            1, "convert", "-", "--json", stdin=content, says=(f"<stdin>:{where}: ", *says)
        )
        self.assertEqual([x["id"] for x in done.json()], ["first"])
        self.assertEqual([r["id"] for r in run("convert", "-", stdin=content).rows()], ["first"])

    def test_quotes(self):
        self.stops(b'"never closed' + b",0.5" * 31 + b"\nx\n", "3:1", "never closed")
        self.stops(b'"a"b' + b",0.5" * 31 + b"\n", "3:4", "comma after the closing quote")

    def test_binary_in_the_middle(self):
        self.stops(b"b\0" + b",0.5" * 31 + b"\n", "3:2", "not a text file")
        self.stops(b'"b\x01"' + b",0.5" * 31 + b"\n", "3:3", "not a text file")

    def test_huge_row(self):
        self.stops(b"x" * 2_000_000 + b"\n", "3:1048578", "1 MiB")


class Good(Case):
    """Files that look unusual and are fine."""

    def same(self, content, *options):
        expected = self.run_ok("convert", "-", "--json", stdin=text(line("a"), line("b"))).json()
        self.assertEqual(self.run_ok("convert", "-", "--json", stdin=content).json(), expected)

    def test_line_ends(self):
        self.same(text(line("a"), line("b"), end="\r\n"))
        self.same(text(line("a"), line("b")).rstrip("\n"))
        self.same(text(line("a"), line("b"), end="\r\n").rstrip("\r\n"))
        self.same(text(line("a"), "", line("b"), "", "", end="\r\n"))

    def test_byte_order_mark(self):
        self.same("\ufeff" + text(line("a"), line("b")))
        self.same("\ufeff" + text(line("a"), line("b"), end="\r\n"))
        self.same("\ufeff" + text(line("a"), line("b")).replace("id,", '"id",', 1))

    def test_quotes_and_blanks(self):
        quoted = ",".join(f'"{x}"' for x in HEADER.split(","))
        self.same(
            quoted + "\n" + line("a") + "\n" + ",".join(f'"{x}"' for x in line("b").split(","))
        )
        self.same(text(line(" a "), line("b")).replace(",", " ,  "))

    def test_comments_and_columns_after(self):
        self.same("# made by hand\n" + text(line("a"), "# between", line("b")))
        moved = [",".join(map(str, [*GOOD, x])) for x in "ab"]
        self.same(",".join([*map(str, NM), "ID"]) + "\n" + "\n".join(moved) + "\n")

    def test_wavelengths_as_decimals(self):
        self.same(text(line("a"), line("b")).replace("400", "400.0").replace("500", "5e2"))


if __name__ == "__main__":
    main()
