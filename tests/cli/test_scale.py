"""test_scale.py - one file of spectra answered by many processes: every command of docs/scale.md as it
stands there, and what comes out beside one run over the whole file."""

import json
import os
import random
import re
import shutil
import subprocess
import sys
import unittest

from support import ROOT, SKINSPEC, Case, environment, main, run, skin_like, spectra_csv

PAGE = os.path.join(ROOT, "docs", "scale.md")
SCRIPT = os.path.join(ROOT, "docs", "examples", "match.sbatch")
ROWS = 600


def blocks(heading, kind):
    """The fenced blocks of a section."""
    with open(PAGE, encoding="utf-8") as f:
        section = f.read().split(f"\n## {heading}\n", 1)[1].split("\n## ", 1)[0]
    return re.findall(rf"^```{kind}\n(.*?)^```$", section, re.M | re.S)


class Files(Case):
    """The spectra, a small table, as each of many processes reads it, and a folder as the page has it."""

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.tables = os.path.join(cls.shared_folder, "tables")
        os.makedirs(cls.tables)
        table = os.path.join(cls.tables, "table-two-layer.db")
        made = run("table", "build", "--model", "two-layer", "--cm", "log:0.001:0.5:10",
                   "--bm", "0:1:3", "--ch", "log:0.001:0.1:9", "--out", table)  # fmt: skip
        if made.status != 0:
            raise AssertionError(made.err)
        spread = random.Random(51)
        spectra = [skin_like(spread) for _ in range(ROWS)]
        cls.csv = spectra_csv([([f"s{i}", "sce"], v) for i, v in enumerate(spectra)],
                              before=("id", "specular"))  # fmt: skip
        cls.ndjson = "".join(
            json.dumps(
                {
                    "id": f"s{i}",
                    "visit": i % 3,
                    "specular": "sce",
                    "spectrum": {"first_nm": 400, "step_nm": 10, "values": v},
                }
            )
            + "\n"
            for i, v in enumerate(spectra)
        )
        cls.answers = run("match", "-", "--tables", cls.tables, stdin=cls.csv).out
        cls.objects = run("match", "-", "--tables", cls.tables, "--ndjson", stdin=cls.ndjson).out

    def setUp(self):
        """A folder as the page has it: the spectra, the program on the path, tables where it looks."""
        self.where = self.folder()
        for name, content in (("spectra.csv", self.csv), ("spectra.ndjson", self.ndjson)):
            with open(os.path.join(self.where, name), "w", encoding="utf-8") as f:
                f.write(content)
        os.makedirs(os.path.join(self.where, "build"))
        os.symlink(self.tables, os.path.join(self.where, "build", "tables"))
        os.makedirs(os.path.join(self.where, "bin"))
        os.symlink(SKINSPEC, os.path.join(self.where, "bin", "skinspec"))
        self.env = environment(
            PATH=os.path.join(self.where, "bin") + ":" + os.environ["PATH"], HOME=self.where
        )

    def shell(self, script, **more):
        done = subprocess.run(["sh", "-e", "-c", script], cwd=self.where, env={**self.env, **more},
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=120,
                              check=False)  # fmt: skip
        self.assertEqual(done.returncode, 0, done.stdout.decode())

    def read(self, name):
        with open(os.path.join(self.where, name), encoding="utf-8") as f:
            return f.read()

    def need(self, program):
        if shutil.which(program) is None:
            raise unittest.SkipTest(f"there is no {program} here (Debian: apt install {program})")


class Page(Files):
    """Each of its blocks."""

    def test_resume(self):
        (script,) = blocks("One process", "sh")
        with open(os.path.join(self.where, "answers.csv"), "w", encoding="utf-8") as f:
            f.write(self.answers[:9999])
        self.shell(script)
        self.assertEqual(self.read("answers.csv"), self.answers)

    def test_xargs(self):
        (script,) = blocks("xargs", "sh")
        self.shell(script)
        self.assertEqual(self.read("answers.csv"), self.answers)
        self.assertGreater(len(self.read("part-5.csv").splitlines()), ROWS // 16)

    def test_parallel(self):
        self.need("parallel")
        of_parts, of_csv, of_lines = blocks("GNU parallel", "sh")
        for script, name, expected in (
            (of_parts, "answers.csv", self.answers),
            (of_csv, "answers.csv", self.answers),
            (of_lines, "answers.ndjson", self.objects),
        ):
            with self.subTest(script=script):
                self.shell(script)
                self.assertEqual(self.read(name), expected)

    def test_slurm(self):
        """The script for each task; one is stopped on its way and run again, as a requeued one."""
        with open(SCRIPT, encoding="utf-8") as f:
            array = re.search(r"^#SBATCH --array=1-(\d+)$", f.read(), re.M)
        tasks = int(array[1])
        for task in range(1, tasks + 1):
            self.shell(f"sh {SCRIPT}", SLURM_ARRAY_TASK_ID=str(task),
                       SLURM_ARRAY_TASK_COUNT=str(tasks), SLURM_CPUS_PER_TASK="2")  # fmt: skip
            if task == 3:
                path = os.path.join(self.where, "answers-3.csv")
                os.truncate(path, os.path.getsize(path) * 2 // 3)
                self.shell(f"sh {SCRIPT}", SLURM_ARRAY_TASK_ID="3",
                           SLURM_ARRAY_TASK_COUNT=str(tasks))  # fmt: skip
        (script,) = blocks("Slurm", "sh")
        self.shell(script)
        self.assertEqual(self.read("answers.csv"), self.answers)

    def test_spark_stand_in(self):
        """What RDD.pipe() of PySpark does: a process a partition, some of them empty, elements as
        lines, nothing in the environment but what it is told."""
        (script,) = blocks("Spark", "python")
        (command,) = re.findall(r'\.pipe\("(.*?)"', script)
        lines = self.ndjson.splitlines()
        columns, *rows = self.csv.splitlines()
        with open(os.path.join(self.where, "columns.csv"), "w", encoding="utf-8") as f:
            f.write(columns + "\n")
        of_csv = "skinspec match - --input csv --header columns.csv --no-header"
        for piped, elements, expected in (
            (command, lines, self.objects.splitlines()),
            (of_csv, rows, self.answers.splitlines()[1:]),
        ):
            said = []
            for partition in (elements[:100], [], elements[100:101], elements[101:]):
                done = subprocess.run(
                    ["env", "-i", f"PATH={self.env['PATH']}", *piped.split()],
                    cwd=self.where, check=True, timeout=120,
                    input="".join(line + "\n" for line in partition).encode(),
                    stdout=subprocess.PIPE,
                )  # fmt: skip
                said += done.stdout.decode().splitlines()
            self.assertEqual(said, expected)

    def test_spark(self):
        """pyspark itself: SKINSPEC_PYSPARK names a Python that has it."""
        python = os.environ.get("SKINSPEC_PYSPARK", sys.executable)
        probe = subprocess.run([python, "-c", "import pyspark"], stderr=subprocess.DEVNULL, check=False)
        if probe.returncode != 0 or shutil.which("java") is None:
            raise unittest.SkipTest("no pyspark or no Java; a stand-in for RDD.pipe() is tested")
        (script,) = blocks("Spark", "python")
        program = (
            "from pyspark.sql import SparkSession\n"
            "spark = SparkSession.builder.master('local[2]').config('spark.ui.enabled', 'false')"
            ".getOrCreate()\n" + script
        )
        subprocess.run([python, "-c", program], cwd=self.where, env=self.env, check=True, timeout=240,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)  # fmt: skip
        folder = os.path.join(self.where, "answers")
        parts = sorted(x for x in os.listdir(folder) if x.startswith("part-"))
        self.assertGreater(len(parts), 1)
        said = "".join(self.read(os.path.join("answers", part)) for part in parts)
        self.assertEqual(said, self.objects)


class Shards(Files):
    """Parts of every number, whatever stands where they are cut."""

    def parts(self, path, shards, *options):
        said = [
            run("match", path, "--tables", self.tables, "--shard", f"{i}/{shards}", *options)
            for i in range(1, shards + 1)
        ]
        return "".join(x.out for x in said), "".join(x.err for x in said), [x.status for x in said]

    def test_quotes_numbers_and_bad_rows(self):
        """No ids but the rows' numbers; line breaks in quotes; messages with lines of the whole."""
        columns, *rows = self.csv.splitlines()
        rows = [r.replace("s", '"a\n""b"",\n",s', 1) for r in rows[:120]]
        rows[50] = rows[50].replace(",sce,", ",sce,-", 1)
        text = columns.replace("id", "note,name", 1) + "\n#c\n" + "\n".join(rows) + "\n"
        path = self.file(text)
        whole = run("match", path, "--tables", self.tables)
        self.assertEqual(len(whole.rows()), 120)
        for shards in (1, 2, 3, 7, 40, 300):
            out, err, statuses = self.parts(path, shards)
            self.assertEqual((out, err), (whole.out, whole.err), shards)
            self.assertEqual(sorted(statuses), [0] * (shards - 1) + [1])

    def test_lines(self):
        path = self.file(self.ndjson, "spectra.ndjson")
        self.assertEqual(self.parts(path, 5, "--ndjson")[0], self.objects)

    def test_scene(self):
        """Parts of what a scene answers are the whole, too."""
        path = self.file(self.csv)
        for scene in ({"want": ["nearest"]}, {"want": ["refined", "interval"], "noise": 0.003}):
            options = ("--scene", self.file(json.dumps(scene), "scene.json"), "--ndjson")
            whole = self.run_ok("match", path, "--tables", self.tables, *options).out
            self.assertEqual(len(whole.splitlines()), ROWS)
            self.assertEqual(self.parts(path, 3, *options)[0], whole)

    def test_resumed(self):
        """The end of a part, not of the file, is where a part that was stopped ends."""
        path = self.file(self.csv)
        out = os.path.join(self.folder(), "part")
        options = ("match", path, "--tables", self.tables, "--shard", "2/3")
        part = self.run_ok(*options).out
        for cut in (0, 7, len(part) // 2, len(part)):
            with open(out, "w", encoding="utf-8") as f:
                f.write(part[:cut])
            self.run_ok(*options, "--out", out, "--resume")
            with open(out, encoding="utf-8") as f:
                self.assertEqual(f.read(), part)


if __name__ == "__main__":
    main()
