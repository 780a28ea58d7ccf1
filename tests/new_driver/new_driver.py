#!/usr/bin/env python3
"""new_driver.py - a driver is added to a copy of the tree as docs/drivers.md says, and what that touches is looked at.

The files of an invented instrument, the TOY-1, are in tests/new_driver/drivers/toy; they become drivers/toy of the
copy, and the files of LINES get a line each.  git tells what is changed; then the copy is built, and the toy's tests,
among them a station with its simulator, and those that every driver has to pass are run.  `make test-new-driver`;
the last line reads "N passed, N failed"."""

import os
import re
import shutil
import subprocess
import sys
import tempfile

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
BUILD = os.path.abspath(os.environ.get("BUILD", os.path.join(ROOT, "build")))
BUILT = ("flags", "gen", "obj", "tables", "unity", "skinspec", "skinspecd", "simhost",
         "libskinspec.a", "libskinspec.so.0")  # fmt: skip
NAME = "toy"
OWN = f"drivers/{NAME}/"

# The file, the line before which it comes, the line.  The first two are the program's, the others say that it is there.
LINES = (
    ("drivers/registry.c", "    /* the end */",
     "    DRIVER(toy)       /* TOY-1 */ \\"),
    ("systemd/60-skinspec.rules", 'ENV{SKINSPEC_INSTRUMENT}=="", GOTO="skinspec_end"',
     'ATTRS{idVendor}=="1209", ATTRS{idProduct}=="0001", ENV{SKINSPEC_INSTRUMENT}="toy"'),
    ("docs/drivers.md", "| a handheld d/8 sphere that is not there |",
     "| TOY-1 | `toy` | tty, 9600, USB 1209:0001 | d/8 | SCE | 8 mm | 400..700 by 10 | invented |"),
    ("CHANGELOG.md", "- `skinspec measure`",
     "- Driver `toy`: the TOY-1, which nobody makes."),
)  # fmt: skip

PROGRAMS = [f"build/tests/drivers/{NAME}/tests/test_{NAME}_{what}" for what in ("wire", "contract")]
SCRIPTS = [f"drivers/{NAME}/tests/test_{NAME}_station.py", "tests/drivers/test_every_driver.py"]
COUNTS = re.compile(r"^(\d+) Tests (\d+) Failures (\d+) Ignored", re.MULTILINE)
TOLD = re.compile(r":(FAIL|IGNORE)")


class Failed(Exception):
    pass


def run(*command, cwd, may_fail=False, **more):
    done = subprocess.run(command, cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          text=True, errors="replace", check=False, timeout=1200, **more)  # fmt: skip
    if done.returncode != 0 and not may_fail:
        raise Failed(f"{' '.join(command)}: status {done.returncode}\n{done.stdout[-3000:]}")
    return done.stdout


def git(tree, *arguments):
    """Whoever runs this need not be known to git, nor may the repository around it interfere."""
    env = {k: v for k, v in os.environ.items() if not k.startswith("GIT_")}
    env.update(GIT_CONFIG_GLOBAL="/dev/null", GIT_CONFIG_NOSYSTEM="1")
    return run("git", "-c", "user.name=test", "-c", "user.email=test", "-c", "safe.directory=*",
               *arguments, cwd=tree, env=env)  # fmt: skip


def copy_tree(tree):
    """What git knows, as it is now, and what is built of it: times are kept, so make does not begin anew."""
    files = git(ROOT, "ls-files", "-z", "--cached", "--others", "--exclude-standard").split("\0")
    for file in filter(None, files):
        source, to = os.path.join(ROOT, file), os.path.join(tree, file)
        if os.path.lexists(source):  # else deleted, and not yet committed
            os.makedirs(os.path.dirname(to), exist_ok=True)
            shutil.copy2(source, to, follow_symlinks=False)
    os.mkdir(os.path.join(tree, "build"))
    for name in BUILT:
        built = BUILD if name != "unity" else os.path.join(ROOT, "build")  # as the Makefile has it
        source, to = os.path.join(built, name), os.path.join(tree, "build", name)
        if os.path.isdir(source):
            shutil.copytree(source, to)
        elif os.path.exists(source):
            shutil.copy2(source, to)
    git(tree, "init", "--quiet")
    git(tree, "add", "--all")
    git(tree, "commit", "--quiet", "--message", "the tree")


def add_driver(tree):
    shutil.copytree(os.path.join(HERE, OWN), os.path.join(tree, OWN))
    for file, before, line in LINES:
        path = os.path.join(tree, file)
        with open(path, encoding="utf-8") as old:
            lines = old.read().split("\n")
        places = [i for i, text in enumerate(lines) if text.startswith(before)]
        if len(places) != 1:
            raise Failed(f"{file}: not one line that begins with '{before}', but {len(places)}")
        lines.insert(places[0], line)
        with open(path, "w", encoding="utf-8") as new:
            new.write("\n".join(lines))


def check_touched(tree):
    """By git: files of its own folder are new, those of LINES have one line more, all else is as it was."""
    git(tree, "add", "--all", "--intent-to-add")
    lines = {file: 0 for file, _, _ in LINES}
    own = []
    for row in git(tree, "diff", "--numstat", "--no-renames").splitlines():
        added, deleted, file = row.split("\t")
        if file.startswith(OWN):
            own.append((file, int(added)))
        elif file in lines and (added, deleted) == ("1", "0"):
            lines[file] += 1
        else:
            raise Failed(f"{file}: {added} lines added, {deleted} deleted, outside {OWN}")
    if not own or set(lines.values()) != {1}:
        raise Failed(f"not each file was touched once: {lines}, {len(own)} of its own")
    return own, list(lines)


def judge(name, said):
    counts = COUNTS.findall(said)
    told = [x for x in said.splitlines() if TOLD.search(x)]
    if not counts:
        told, counts = said.splitlines()[-20:], [("1", "1", "0")]
    ran, failed, skipped = map(int, counts[-1])
    print(f"  {ran - failed - skipped:3} passed {failed:3} failed {skipped:3} skipped  {name}", flush=True)
    for line in told:
        print(f"      {line}")
    return ran - failed - skipped, failed


def run_tests(tree):
    make = [os.environ.get("MAKE", "make"), "--no-print-directory", f"-j{min(2, os.cpu_count() or 1)}"]
    env = {k: v for k, v in os.environ.items() if k not in ("MAKEFLAGS", "MFLAGS", "MAKELEVEL")}
    env.update(BUILD="build", SKINSPEC="build/skinspec")
    said = run(*make, "all", "build/simhost", *PROGRAMS, cwd=tree, env=env)
    print("built anew for it:", *sorted(x.split()[1] for x in said.splitlines() if x.startswith("  CC ")))
    drivers = run("build/skinspecd", "--drivers", cwd=tree)
    if NAME not in (x.split()[0] for x in drivers.splitlines()):
        raise Failed(f"skinspecd --drivers does not name it:\n{drivers}")
    passed = failed = 0
    for command in [[x] for x in PROGRAMS] + [[sys.executable, "-B", x] for x in SCRIPTS]:
        one = judge(command[-1], run(*command, cwd=tree, env=env, may_fail=True))
        passed, failed = passed + one[0], failed + one[1]
    return passed, failed


def main():
    tree = tempfile.mkdtemp(prefix="sk.", dir="/tmp")  # short: umockdev has limits
    try:
        copy_tree(tree)
        add_driver(tree)
        own, lines = check_touched(tree)
        print(f"touched: {len(own)} files of its own, {sum(n for _, n in own)} lines:")
        for file, n in own:
            print(f"  {n:4}  {file}")
        print(f"and a line in each of {len(lines)}:")
        for file in lines:
            print(f"     1  {file}")
        passed, failed = run_tests(tree)
        if check_touched(tree) != (own, lines):
            raise Failed("building or testing changed the tree")
    except Failed as error:
        print(f"new_driver: {error}", file=sys.stderr)
        passed, failed = 0, 1
    finally:
        shutil.rmtree(tree, ignore_errors=True)
    print(f"{passed} passed, {failed} failed")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
