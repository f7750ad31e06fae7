"""Damaged logs and results, thousands of them, read in processes apart: nothing may crash, hang, fill the memory or fail oddly.

    python tests/fuzz/run.py                          two minutes
    python tests/fuzz/run.py --inputs 1000000         the long form
    python tests/fuzz/run.py --only 4711              one input, with the traceback of what is wrong with it

An input is one file of the corpus with a few damages, the same for the same seed and number, and the same libraries.
What must hold: every call ends with a result, or with a GaidentError or an OSError of one line; no warning comes through;
it takes at most 5 s of processor time, 10 s where a library's process starts, and less than 1 GiB of memory.
The exit code is 1 where anything does not hold, and the files that show it lie in build/fuzz; and where no input was tried.
"""

from __future__ import annotations

import argparse
import json
import os
import queue
import subprocess
import sys
import tempfile
import threading
import time
import traceback
import warnings
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from corpus import ROOT, Seed, seeds
from damage import damaged, odd_json

APART = ("HDF5", "MDF", "Parquet", "TDMS")
SECONDS, SECONDS_APART = 5.0, 10.0  # of processor time
KILLED = 90.0  # s by the clock, after which an input counts as a hang
MEBIBYTES = 1024
FLAWS = ROOT / "build" / "fuzz"


class Inputs:
    """The inputs of a seed, by their numbers."""

    def __init__(self, seed: int, forms: Sequence[str]) -> None:
        self.seed = seed
        self.corpus = seeds(forms)
        if not self.corpus:
            raise SystemExit(f"--forms {' '.join(forms)}: no such format, or its library is not installed")
        self.of_form: dict[str, list[bytes]] = defaultdict(list)
        for s in self.corpus:
            self.of_form[s.form].append(s.content)
        weights = np.array([s.weight for s in self.corpus])
        self.chances = weights / weights.sum()

    def __call__(self, number: int) -> tuple[Seed, bytes, str]:
        """(the seed, the damaged content, the ending of its name)."""
        draw = np.random.default_rng([self.seed, number])
        seed = self.corpus[int(draw.choice(len(self.corpus), p=self.chances))]
        text = seed.form in ("text", "SINUMERIK", "saved", "response", "drive")
        whole = seed.form == "saved" and draw.random() < 0.7
        content = odd_json(seed.content, draw) if whole else damaged(seed.content, draw, self.of_form[seed.form], text)
        ending = seed.ending if draw.random() < 0.9 else str(draw.choice([".csv", ".bin", ".mat", ".npz", ""]))
        return seed, content, ending


def calls_of(form: str, number: int) -> list[Callable[[str], Any]]:
    """What is done with a file."""
    import gaident as ga
    from gaident.drive.drive_file import axes_in, read_drive_file

    def shown(path: str) -> str:
        found = ga.load(path)
        return str(found.summary() if hasattr(found, "summary") else found)

    if form == "saved":
        return [shown]
    if form == "drive":
        return [read_drive_file, axes_in, lambda path: read_drive_file(path, "x")]
    if form == "response":
        return [ga.read_response]
    named: Any = {"time": None, "velocity": "velocity", "torque": "torque"}
    every: list[Callable[[str], Any]] = [
        ga.read,
        lambda path: str(ga.columns(path)),
        ga.read_columns,
        lambda path: ga.read(path, named, dt=1e-3),
        ga.read_pieces,
    ]
    # A process for each call is dear: one call for each input there.
    return [every[number % len(every)]] if form in APART else every


def tried(path: str, calls: Sequence[Callable[[str], Any]]) -> tuple[bool, list[str]]:
    """(whether any call took the file, what is wrong with how the others ended)."""
    from gaident.errors import GaidentError

    taken, wrong = False, []
    for call in calls:
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                call(path)
            taken = True
        except (GaidentError, OSError) as error:
            if "\n" in str(error) or not str(error):
                wrong.append(f"a message of several lines or none: {error!r:.200}")
        except Exception as error:
            where = traceback.extract_tb(error.__traceback__)[-1]
            wrong.append(f"{type(error).__name__}: {str(error)[:160]} ({Path(where.filename).name}:{where.lineno})")
    return taken, wrong


def used() -> tuple[float, float]:
    """(processor time [s], largest memory [MiB]) of this process and those that it waited for."""
    try:
        import resource
    except ImportError:
        return time.process_time(), 0.0
    own, others = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    return sum(r.ru_utime + r.ru_stime for r in (own, others)), max(own.ru_maxrss, others.ru_maxrss) / 1024


def worker(inputs: Inputs) -> None:
    """Take numbers from the standard input, write what became of each to the standard output."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # what is printed is no answer
    with tempfile.TemporaryDirectory() as folder:
        for line in sys.stdin:
            number = int(line)
            seed, content, ending = inputs(number)
            path = os.path.join(folder, f"log{ending}")
            Path(path).write_bytes(content)
            before, _ = used()
            taken, wrong = tried(path, calls_of(seed.form, number))
            after, memory = used()
            os.unlink(path)
            answer = {"number": number, "taken": taken, "wrong": wrong, "seconds": after - before, "memory": memory}
            answers.write(json.dumps(answer) + "\n")
            answers.flush()


class Process:
    """A worker, started anew where an input has ended it."""

    def __init__(self, arguments: Sequence[str]) -> None:
        self.arguments = arguments
        self.process: subprocess.Popen[str] | None = None

    def _lines(self, process: subprocess.Popen[str], lines: queue.SimpleQueue[str]) -> None:
        assert process.stdout is not None
        for line in process.stdout:
            lines.put(line)
        lines.put("")

    def ask(self, number: int) -> dict[str, Any]:
        """What became of an input."""
        if self.process is None:
            command = [sys.executable, __file__, "--worker", *self.arguments]
            self.process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
            self.lines: queue.SimpleQueue[str] = queue.SimpleQueue()
            threading.Thread(target=self._lines, args=(self.process, self.lines), daemon=True).start()
        assert self.process.stdin is not None
        self.process.stdin.write(f"{number}\n")
        self.process.stdin.flush()
        try:
            line = self.lines.get(timeout=KILLED)
        except queue.Empty:
            line, why = "", f"a hang: stopped after {KILLED:g} s"
        else:
            why = f"a crash: the process ended with code {self.process.wait() if not line else 0}"
        if line:
            return dict(json.loads(line))
        self.close()
        return {"number": number, "taken": False, "wrong": [why], "seconds": 0.0, "memory": 0.0}

    def close(self) -> None:
        if self.process is not None:
            self.process.kill()
            self.process.wait()
        self.process = None


def all_answers(numbers: Sequence[int], workers: int, arguments: Sequence[str], until: float) -> Iterator[dict[str, Any]]:
    """The answers of all workers, as they come, until the time is over."""
    left: queue.SimpleQueue[int] = queue.SimpleQueue()
    for number in numbers:
        left.put(number)
    answers: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()

    def feed() -> None:
        process = Process(arguments)
        try:
            while time.monotonic() < until:
                answers.put(process.ask(left.get_nowait()))
        except queue.Empty:
            pass
        finally:
            process.close()
            answers.put(None)

    for _ in range(workers):
        threading.Thread(target=feed, daemon=True).start()
    ended = 0
    while ended < workers:
        answer = answers.get()
        if answer is None:
            ended += 1
        else:
            yield answer


def flaws_of(answer: dict[str, Any], form: str) -> list[str]:
    """What is wrong with an answer."""
    found = list(answer["wrong"])
    if answer["seconds"] > (SECONDS_APART if form in APART else SECONDS):
        found.append(f"a hang: {answer['seconds']:.1f} s of processor time")
    if answer["memory"] > MEBIBYTES:
        found.append(f"memory: {answer['memory']:.0f} MiB")
    return found


def only(inputs: Inputs, number: int) -> int:
    """Show one input."""
    seed, content, ending = inputs(number)
    FLAWS.mkdir(parents=True, exist_ok=True)
    path = FLAWS / f"{inputs.seed}-{number}{ending}"
    path.write_bytes(content)
    print(f"{seed.form}: {path}")
    for call in calls_of(seed.form, number):
        try:
            print(f"  {str(call(str(path)))[:200]!r}")
        except Exception:
            traceback.print_exc()
    return 0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--inputs", type=int, help="how many (as many as there is time for)")
    parser.add_argument("--minutes", type=float, help="how long at most (2, or no limit with --inputs)")
    parser.add_argument("--seed", type=int, default=1, help="another seed makes other inputs (%(default)s)")
    parser.add_argument("--workers", type=int, default=os.cpu_count() or 1, help="processes (%(default)s)")
    parser.add_argument(
        "--forms", nargs="+", default=[], help="formats: text MAT NPZ SINUMERIK saved response drive HDF5 MDF Parquet TDMS"
    )
    parser.add_argument("--only", type=int, metavar="NUMBER", help="one input, with the traceback of what is wrong with it")
    parser.add_argument("--worker", action="store_true", help=argparse.SUPPRESS)
    given = parser.parse_args()
    inputs = Inputs(given.seed, given.forms)
    if given.worker:
        worker(inputs)
        return 0
    if given.only is not None:
        return only(inputs, given.only)
    arguments = ["--seed", str(given.seed), *(["--forms", *given.forms] if given.forms else [])]
    minutes = given.minutes if given.minutes is not None else (2.0 if given.inputs is None else np.inf)
    count = given.inputs if given.inputs is not None else 10**7
    began = time.monotonic()
    forms = {k: inputs.corpus[k].form for k in range(len(inputs.corpus))}
    done, taken, slowest, flawed = Counter[str](), Counter[str](), defaultdict[str, float](float), []
    memory = 0.0
    for answer in all_answers(range(count), given.workers, arguments, began + 60.0 * minutes):
        seed, content, ending = inputs(answer["number"])
        done[seed.form] += 1
        taken[seed.form] += answer["taken"]
        slowest[seed.form] = max(slowest[seed.form], answer["seconds"])
        memory = max(memory, answer["memory"])
        if found := flaws_of(answer, seed.form):
            FLAWS.mkdir(parents=True, exist_ok=True)
            (FLAWS / f"{given.seed}-{answer['number']}{ending}").write_bytes(content)
            flawed.append(answer["number"])
            print(f"input {answer['number']} ({seed.form}): {'; '.join(found)}", flush=True)
    print(f"{'format':10} {'inputs':>8} {'read':>8} {'refused':>8} {'slowest [s]':>12}")
    for form in dict.fromkeys(forms.values()):
        print(f"{form:10} {done[form]:8} {taken[form]:8} {done[form] - taken[form]:8} {slowest[form]:12.2f}")
    took = f"{sum(done.values())} inputs of seed {given.seed} in {(time.monotonic() - began) / 60.0:.1f} min"
    print(f"{took}, at most {memory:.0f} MiB: {len(flawed)} flawed{f' (they lie in {FLAWS})' if flawed else ''}")
    return 1 if flawed or not done else 0


if __name__ == "__main__":
    sys.exit(main())
