"""cubes.py - ENVI cubes made and read with Python's array and struct alone, and PNGs decoded with
zlib, for the tests and the bench of `skinspec map`."""

import array
import os
import struct
import sys
import zlib

TYPES = {4: "f", 12: "H"}


def values(kind, order, numbers):
    """Numbers as bytes of that data type and byte order."""
    packed = array.array(TYPES[kind], numbers)
    if (sys.byteorder == "big") != bool(order):
        packed.byteswap()
    return packed.tobytes()


def interleaved(pixels, samples, lines, interleave):
    """Spectra of pixels, line after line, in the order of the file."""
    bands = len(pixels[0])
    if interleave == "bip":
        return [x for pixel in pixels for x in pixel]
    if interleave == "bsq":
        return [pixel[b] for b in range(bands) for pixel in pixels]
    rows = [pixels[i * samples : (i + 1) * samples] for i in range(lines)]
    return [pixel[b] for row in rows for b in range(bands) for pixel in row]


def header(samples, lines, nm, kind=4, order=0, interleave="bil", offset=0, **more):
    """Text of a header; more: fields with '_' for blanks, None leaves one out."""
    fields = {
        "samples": samples,
        "lines": lines,
        "bands": len(nm),
        "header offset": offset,
        "data type": kind,
        "interleave": interleave,
        "byte order": order,
        "wavelength units": "Nanometers",
        "wavelength": "{" + ", ".join(f"{x:g}" for x in nm) + "}",
    }
    fields.update((name.replace("_", " "), value) for name, value in more.items())
    return "ENVI\n" + "".join(f"{k} = {v}\n" for k, v in fields.items() if v is not None)


def write(folder, pixels, samples, nm, kind=4, order=0, interleave="bil", name="cube", scale=1,
          **more):  # fmt: skip
    """A cube; the path of its header.  R times scale is what is written."""
    lines = len(pixels) // samples
    ordered = interleaved(pixels, samples, lines, interleave)
    if kind == 12:
        ordered = [min(max(int(x * scale + 0.5), 0), 65535) for x in ordered]
    elif scale != 1:
        ordered = [x * scale for x in ordered]
    if scale != 1:
        more.setdefault("reflectance_scale_factor", scale)
    path = os.path.join(folder, name + ".hdr")
    with open(path, "w", encoding="utf-8") as file:
        file.write(header(samples, lines, nm, kind, order, interleave, **more))
    with open(os.path.join(folder, name + ".img"), "wb") as file:
        file.write(b"\xa5" * int(more.get("offset", 0)))
        file.write(values(kind, order, ordered))
    return path


def read_map(prefix):
    """Bands of a map by name, each a list of floats, line after line."""
    with open(prefix + ".hdr", encoding="utf-8") as file:
        text = file.read()
    fields = dict(x.split(" = ", 1) for x in text.splitlines() if " = " in x and "{" not in x)
    names = [x.strip() for x in text.split("band names = {", 1)[1].split("}", 1)[0].split(",")]
    each = int(fields["samples"]) * int(fields["lines"])
    assert fields["interleave"] == "bsq" and fields["data type"] == "4"
    assert fields["byte order"] == str(int(sys.byteorder == "big"))
    with open(prefix + ".img", "rb") as file:
        packed = array.array("f", file.read())
    assert len(packed) == each * len(names) == each * int(fields["bands"])
    return {name: list(packed[i * each : (i + 1) * each]) for i, name in enumerate(names)}


def read_png(path):
    """Width, rows of palette indices, and the palette; every chunk's checksum looked at."""
    with open(path, "rb") as file:
        data = file.read()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, packed, palette, shape = 8, b"", None, None
    while at < len(data):
        (n,), kind = struct.unpack(">I", data[at : at + 4]), data[at + 4 : at + 8]
        body = data[at + 8 : at + 8 + n]
        (crc,) = struct.unpack(">I", data[at + 8 + n : at + 12 + n])
        assert crc == zlib.crc32(kind + body)
        if kind == b"IHDR":
            shape = struct.unpack(">IIBBBBB", body)
        elif kind == b"PLTE":
            palette = [tuple(body[i : i + 3]) for i in range(0, n, 3)]
        elif kind == b"IDAT":
            packed += body
        at += 12 + n
    width, height, depth, colour, *_ = shape
    assert (depth, colour) == (8, 3) and kind == b"IEND"
    raw = zlib.decompress(packed)
    assert len(raw) == height * (width + 1)
    rows = [raw[y * (width + 1) : (y + 1) * (width + 1)] for y in range(height)]
    assert all(row[0] == 0 for row in rows)  # no filter
    return width, [row[1:] for row in rows], palette
