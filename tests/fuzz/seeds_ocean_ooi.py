"""seeds_ocean_ooi.py FOLDER - inputs to begin with for fuzz_ocean_ooi: sessions that go well and go
wrong in each way at each place, tile files, addresses, replies."""

import os
import sys

SOUND, CHANGED, RAW, TIMEOUT, STALL, GONE = b"\0", b"\xb0\0\x0a\x40", b"\xe3\0abc", b"\xf0", b"\xf8", b"\xff"
CALLS = bytes([5, 1, 2, 3, 4, 3, 2, 3])  # status zero white measure averages measure white measure


def seeds():
    yield "session", b"s" + CALLS + SOUND * 600
    yield "opening", b"s\0" + SOUND * 30
    for at in (0, 3, 9, 19, 21, 24, 60, 100, 140, 160):
        for name, what in (("changed", CHANGED), ("raw", RAW), ("timeout", TIMEOUT), ("stall", STALL), ("gone", GONE)):
            yield f"{name}-{at}", b"s" + CALLS[:4] + b"\0" + SOUND * at + what + SOUND * 300
    nm = ",".join(str(x) for x in range(400, 701, 10))
    yield "tile", f"tid,specular,geometry,{nm}\nW,sce,8/d{',0.97' * 31}\n".encode()
    yield "greys", (f"t# two rows\r\nid,what,specular,{nm}\r\nG,measured,sce{',0.2' * 31}\r\n"
                    f"G,certified,sce{',0.21' * 31}").encode()
    yield "address", b"ausb:2457:101e,tile=/a/b.csv,port_mm=8,greys=c.csv,model=usb4000"
    yield "slot", b"w\x05\x01339.5167\0" + b"x" * 7
    yield "status", b"w" + bytes([0, 8, 0xA0, 0x86, 1, 0, 1, 0, 0, 9, 1, 0, 0, 0, 0x80, 0])
    yield "temperature", b"w\x08\0\x19"
    yield "frame", b"w" + b"\xdc\x05" * 2048 + b"\x69"


def main():
    folder = sys.argv[1]
    os.makedirs(folder, exist_ok=True)
    for name, data in seeds():
        with open(os.path.join(folder, name), "wb") as file:
            file.write(data)


if __name__ == "__main__":
    main()
