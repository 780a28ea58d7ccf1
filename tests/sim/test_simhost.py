#!/usr/bin/env python3
"""test_simhost.py - build/simhost: simulated instruments behind ttys, as a program sees them that knows nothing of us.

The test starts simhost under umockdev-wrapper; simhost starts this file again as a client inside the
testbed, which talks to the ttys by termios and poll, and to libudev, and takes its orders by a
socket."""
import array
import ctypes
import fcntl
import json
import os
import select
import socket
import stat
import subprocess
import sys
import termios
import time
import tty
import unittest

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../cli"))
from support import main  # noqa: E402

BUILD = os.environ.get("BUILD", "build")
IDR = "OK00,0100,104,00012345,0,400,700,10\r\n"


class Client:
    """Inside the testbed.  Public methods are orders; arguments and results are JSON."""

    def __init__(self):
        self._open = {}
        self._monitor = None
        self._udev = None

    def open(self, node):
        fd = os.open(node, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(fd)
        mode = termios.tcgetattr(fd)
        mode[4] = mode[5] = termios.B115200
        termios.tcsetattr(fd, termios.TCSANOW, mode)
        self._open[node] = fd
        return termios.tcgetattr(fd)[4] == termios.B115200

    def close(self, node):
        os.close(self._open.pop(node))

    def send(self, node, text):
        return os.write(self._open[node], text.encode("latin-1"))

    def hear(self, node, seconds):
        """What comes until a line ends, and how it ended: "line", "time" or "gone"."""
        fd, heard = self._open[node], b""
        poll = select.poll()
        poll.register(fd, select.POLLIN)
        until = time.monotonic() + seconds
        while time.monotonic() < until:
            events = poll.poll(max(1, (until - time.monotonic()) * 1000))
            if not events:
                break
            try:
                came = os.read(fd, 4096)
            except OSError:
                came = b""
            if not came:
                return heard.decode("latin-1"), "gone"
            heard += came
            if heard.endswith(b"\n"):
                return heard.decode("latin-1"), "line"
        return heard.decode("latin-1"), "time"

    def modem(self, node, request=None, bits=0):
        if request is not None:
            fcntl.ioctl(self._open[node], getattr(termios, request), array.array("i", [bits]))
        state = array.array("i", [0])
        fcntl.ioctl(self._open[node], termios.TIOCMGET, state)
        return state[0]

    def parent(self, name):
        """Attributes of the USB device above a tty."""
        at = os.path.join("/sys/class/tty", os.readlink("/sys/class/tty/" + name))
        at = os.path.normpath(at)
        while not os.path.exists(at + "/idVendor") and at != "/":
            at = os.path.dirname(at)
        result = {}
        for key in ("idVendor", "idProduct", "serial", "product"):
            if os.path.exists(at + "/" + key):
                with open(at + "/" + key, encoding="ascii") as file:
                    result[key] = file.read().strip()
        return result

    def ttys(self):
        return sorted(os.listdir("/sys/class/tty")) if os.path.exists("/sys/class/tty") else []

    def exists(self, path):
        return os.path.exists(path)

    def listen(self):
        self._udev = ctypes.CDLL("libudev.so.1")
        for name in ("udev_new", "udev_monitor_new_from_netlink", "udev_monitor_receive_device"):
            getattr(self._udev, name).restype = ctypes.c_void_p
        for name in ("udev_device_get_action", "udev_device_get_devnode"):
            getattr(self._udev, name).restype = ctypes.c_char_p
        udev = ctypes.c_void_p(self._udev.udev_new())
        self._monitor = ctypes.c_void_p(self._udev.udev_monitor_new_from_netlink(udev, b"udev"))
        self._udev.udev_monitor_filter_add_match_subsystem_devtype(self._monitor, b"tty", None)
        return self._udev.udev_monitor_enable_receiving(self._monitor)

    def uevent(self, seconds):
        fd = self._udev.udev_monitor_get_fd(self._monitor)
        if not select.select([fd], [], [], seconds)[0]:
            return None
        device = ctypes.c_void_p(self._udev.udev_monitor_receive_device(self._monitor))
        action = self._udev.udev_device_get_action(device).decode()
        node = self._udev.udev_device_get_devnode(device)
        self._udev.udev_device_unref(device)
        return [action, node.decode() if node else None]


def be_client(fd):
    orders = socket.socket(fileno=fd).makefile("rw")
    client = Client()
    for line in orders:
        name, arguments = json.loads(line)
        try:
            reply = {"result": getattr(client, name)(*arguments)}
        except OSError as error:
            reply = {"errno": error.errno}
        print(json.dumps(reply), file=orders, flush=True)


class SimhostTest(unittest.TestCase):
    def setUp(self):
        ours, theirs = socket.socketpair()
        sanitizer = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"
        self.host = subprocess.Popen(
            ["umockdev-wrapper", BUILD + "/simhost", "--", sys.executable, "-B", __file__,
             "--client", str(theirs.fileno())],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, bufsize=1,
            pass_fds=[theirs.fileno()], env=dict(os.environ, ASAN_OPTIONS=sanitizer))
        theirs.close()
        ours.settimeout(30)
        self.socket, self.orders = ours, ours.makefile("rw")

    def tearDown(self):
        self.say("quit")
        self.assertEqual(self.host.wait(20), 0)
        self.orders.close()
        self.socket.close()
        self.host.stdin.close()
        self.host.stdout.close()

    def say(self, command):
        print(command, file=self.host.stdin, flush=True)
        return self.host.stdout.readline().rstrip("\n")

    def ok(self, command):
        reply = self.say(command)
        self.assertEqual(reply.split(" ")[0], "ok", command + ": " + reply)
        return reply[3:]

    def order(self, name, *arguments):
        print(json.dumps([name, arguments]), file=self.orders, flush=True)
        reply = json.loads(self.orders.readline())
        self.assertNotIn("errno", reply, (name, arguments))
        return reply["result"]

    def refused(self, name, *arguments):
        print(json.dumps([name, arguments]), file=self.orders, flush=True)
        return json.loads(self.orders.readline()).get("errno")

    def asked(self, node, text, seconds=5):
        self.order("send", node, text)
        return self.order("hear", node, seconds)

    def test_a_program_finds_and_asks_it(self):
        self.ok("plug cm700d one ttyACM0 serial=00012345,delays=0")
        self.assertEqual(self.order("ttys"), ["ttyACM0"])
        self.assertEqual(self.order("parent", "ttyACM0"),
                         {"idVendor": "132b", "idProduct": "2107", "serial": "00012345",
                          "product": "KONICA MINOLTA CM-700d"})
        self.assertTrue(self.order("open", "/dev/ttyACM0"))
        self.assertEqual(self.asked("/dev/ttyACM0", "IDR\r\n"), [IDR, "line"])
        self.assertEqual(self.order("hear", "/dev/ttyACM0", 0.05), ["", "time"])

    def test_calibrate_and_measure(self):
        self.ok("plug cm700d one ttyACM0 delays=0,noise=0")
        self.order("open", "/dev/ttyACM0")
        for place, request, reply in (("black", "ZRC", "OK00\r\n"), ("white", "CAL", "OK00\r\n"),
                                      ("white", "MES,1", "OK00\r\n")):
            self.ok("act one place " + place)
            self.assertEqual(self.asked("/dev/ttyACM0", request + "\r\n")[0], reply)
        line, _ = self.asked("/dev/ttyACM0", "MDR,2\r\n")
        values = [int(field) for field in line.split(",")[1:]]
        self.assertEqual(len(values), 31)
        for value in values:  # a white tile without its gloss
            self.assertTrue(8000 < value < 10000, values)
        self.ok("act one expect writes 0")

    def test_what_goes_wrong_on_the_line_arrives(self):
        self.ok("plug cm700d one ttyACM0 delays=0")
        self.order("open", "/dev/ttyACM0")
        self.ok("act one fault truncated 10")
        self.assertEqual(self.asked("/dev/ttyACM0", "IDR\r\n", 0.3), [IDR[:10], "time"])
        self.ok("act one fault slow 30")
        began = time.monotonic()
        self.assertEqual(self.asked("/dev/ttyACM0", "IDR\r\n"), [IDR, "line"])
        self.assertGreater(time.monotonic() - began, 0.03 * (len(IDR) - 1) * 0.95)
        self.assertEqual(self.asked("/dev/ttyACM0", "AT\r\n"), ["ER00\r\n", "line"])

    def test_modem_lines(self):
        self.ok("plug sp62 one ttyUSB0")
        self.order("open", "/dev/ttyUSB0")
        there = termios.TIOCM_CTS | termios.TIOCM_DSR | termios.TIOCM_CAR
        rts, dtr = termios.TIOCM_RTS, termios.TIOCM_DTR
        self.assertEqual(self.order("modem", "/dev/ttyUSB0"), there)
        self.assertEqual(self.order("modem", "/dev/ttyUSB0", "TIOCMBIS", rts | dtr), there | rts | dtr)
        self.assertEqual(self.order("modem", "/dev/ttyUSB0", "TIOCMBIC", rts), there | dtr)
        self.assertEqual(self.order("modem", "/dev/ttyUSB0", "TIOCMSET", there), there)

    def test_unplugged_and_plugged_as_another_node(self):
        self.order("listen")
        self.ok("plug cm700d one ttyACM0 delays=0,serial=00012345")
        self.assertEqual(self.order("uevent", 5), ["add", "/dev/ttyACM0"])
        self.order("open", "/dev/ttyACM0")
        self.asked("/dev/ttyACM0", "CPS,2,2,00,01,01\r\n")
        self.ok("unplug one")
        self.assertEqual(self.order("hear", "/dev/ttyACM0", 1), ["", "gone"])
        self.assertIsNotNone(self.refused("send", "/dev/ttyACM0", "IDR\r\n"))
        self.refused("modem", "/dev/ttyACM0")  # answered or refused, but not for ever
        self.assertEqual(self.order("uevent", 5), ["remove", "/dev/ttyACM0"])
        self.assertEqual(self.order("ttys"), [])
        self.assertFalse(self.order("exists", "/dev/ttyACM0"))
        self.ok("plug cm700d one ttyACM7")
        self.assertEqual(self.order("uevent", 5), ["add", "/dev/ttyACM7"])
        self.order("open", "/dev/ttyACM7")
        # It is as it was left.
        self.assertEqual(self.asked("/dev/ttyACM7", "CPR\r\n"), ["OK00,2,2,00,01,01\r\n", "line"])
        self.order("close", "/dev/ttyACM0")

    def test_unplugged_in_mid_frame(self):
        self.ok("plug cm700d one ttyACM0 delays=0")
        self.order("open", "/dev/ttyACM0")
        self.ok("act one fault slow 100")
        self.order("send", "/dev/ttyACM0", "IDR\r\n")
        time.sleep(0.35)
        self.ok("unplug one")
        heard, end = self.order("hear", "/dev/ttyACM0", 2)
        self.assertEqual(end, "gone")
        self.assertTrue(IDR.startswith(heard) and len(heard) < 30, heard)

    def test_several_at_once(self):
        self.ok("plug cm700d one ttyACM0 delays=0,serial=1")
        self.ok("plug cm700d two ttyACM1 delays=0,serial=2")
        self.ok("plug cm2600d three ttyUSB0 delays=0,serial=3")
        self.ok("plug sp62 four ttyUSB1 delays=0,serial=4")
        questions = {"ttyACM0": ("IDR\r\n", "OK00,0100,104,1,0,400,700,10\r\n"),
                     "ttyACM1": ("IDR\r\n", "OK00,0100,104,2,0,400,700,10\r\n"),
                     "ttyUSB0": ("IDR\r\n", "OK00,03,104,3,0,360,740,10\r\n"),
                     "ttyUSB1": ("0108CF\r", "<00>\r\n")}
        for node, (question, _) in questions.items():
            self.order("open", "/dev/" + node)
            self.order("send", "/dev/" + node, question)
        for node, (_, answer) in questions.items():
            self.assertEqual(self.order("hear", "/dev/" + node, 5), [answer, "line"])
        self.ok("unplug two")
        self.assertEqual(self.asked("/dev/ttyACM0", "USR\r\n"), ["OK00,0\r\n", "line"])
        self.assertEqual(self.order("ttys"), ["ttyACM0", "ttyUSB0", "ttyUSB1"])

    def test_opened_again_and_again(self):
        self.ok("plug cm700d one ttyACM0 delays=0,serial=00012345")
        for _ in range(5):
            self.order("open", "/dev/ttyACM0")
            self.assertEqual(self.asked("/dev/ttyACM0", "IDR\r\n"), [IDR, "line"])
            self.order("close", "/dev/ttyACM0")

    def test_many_cycles_keep_nothing(self):
        folder = f"/proc/{self.host.pid}/fd"
        counts = []
        self.ok("plug cm700d one ttyACM0 delays=0,serial=00012345")
        for i in range(1, 21):
            self.ok("unplug one")
            counts.append(len(os.listdir(folder)))
            self.ok(f"plug cm700d one ttyACM{i % 3}")
        self.order("open", "/dev/ttyACM2")
        self.assertEqual(self.asked("/dev/ttyACM2", "IDR\r\n"), [IDR, "line"])
        # What a cycle keeps is kept nineteen times; one that is being closed, or opened once for
        # all, comes and goes.
        self.assertLess(counts[-1] - counts[0], 5, counts)

    def test_mode_of_a_node(self):
        self.ok("plug cm700d one ttyACM0")
        node = self.ok("root") + "/dev/ttyACM0"
        for mode in (0o600, 0o000, 0o660):
            self.ok(f"mode ttyACM0 {mode:04o}")
            self.assertEqual(stat.S_IMODE(os.stat(node).st_mode), mode)
        if os.geteuid() != 0:  # root may open anything
            self.ok("mode ttyACM0 0000")
            self.assertEqual(self.refused("open", "/dev/ttyACM0"), 13)

    def test_errors(self):
        self.ok("plug cm700d one ttyACM0")
        for wrong in ("plug", "plug cm700d two", "plug nosuch two ttyACM1", "plug cm700d one ttyACM1",
                      "plug cm700d two ttyACM0", "plug cm700d two ../x", "plug cm700d two ttyACM1 x=1",
                      "unplug two", "act one nosuch", "act two press", "mode ttyACM9 0600",
                      "mode ttyACM0 8", "nosuch", ""):
            self.assertEqual(self.say(wrong).split(" ")[0], "error", wrong)
        self.ok("unplug one")
        self.assertEqual(self.say("unplug one").split(" ")[0], "error")
        self.assertEqual(self.say("plug sp62 one ttyACM0").split(" ")[0], "error")
        self.ok("plug sp62 two ttyACM0")


class ProgramTest(unittest.TestCase):
    def run_host(self, *program, commands="wait\n"):
        sanitizer = os.environ.get("ASAN_OPTIONS", "") + ":verify_asan_link_order=0"
        return subprocess.run(["umockdev-wrapper", BUILD + "/simhost", *program], input=commands,
                              capture_output=True, text=True, timeout=60, check=False,
                              env=dict(os.environ, ASAN_OPTIONS=sanitizer))

    def test_program_and_its_status(self):
        done = self.run_host("--", "sh", "-c", "echo $UMOCKDEV_DIR; exit 3", commands="root\nwait\n")
        root = done.stderr.strip()
        self.assertTrue(root.startswith("/"), done.stderr)
        self.assertEqual(done.stdout, f"ok {root}\nok 3\n")
        self.assertEqual(done.returncode, 0)
        self.assertFalse(os.path.exists(root))

    def test_a_program_that_is_not_there(self):
        self.assertEqual(self.run_host("--", "/nosuch").stdout, "ok 127\n")

    def test_a_program_is_ended(self):
        began = time.monotonic()
        self.assertEqual(self.run_host("--", "sleep", "100", commands="quit\n").stdout, "ok\n")
        self.assertLess(time.monotonic() - began, 20)

    def test_usage(self):
        self.assertEqual(self.run_host("sleep").returncode, 2)
        alone = subprocess.run([BUILD + "/simhost"], capture_output=True, text=True, timeout=60,
                               input="", check=False)
        self.assertEqual(alone.returncode, 1)
        self.assertIn("umockdev-wrapper", alone.stderr)


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[1] == "--client":
        be_client(int(sys.argv[2]))
    else:
        main()
