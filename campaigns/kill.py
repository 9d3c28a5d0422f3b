"""Kill -9 of runs at random moments, resumed each time: is the result the same to the last bit?

    python campaigns/kill.py --kills 100

Runs a small sweep into a folder, then into a file, again and again, each time killing the process
at a random moment until the run completes by itself, and compares the result with that of an
uninterrupted run. Chunks are written every 20 ms, so that many kills fall into a write.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import xarray as xr

STUDY = """
title = "to be killed"
[problem.solid]
shear_modulus = 1e9
poisson_ratio = 0.33
density = 1170.0
[problem.interface]
length = 0.1
nodes = 256
[problem.friction]
weakening_rate = 0.4e12
[random.strength.marginal]
type = "beta"
alpha = 1.5
beta = 3.0
low = 0.66e6
high = 1.66e6
[random.strength.spectrum]
type = "power_law"
[method]
type = "local_criterion"
[ensemble]
samples = 120_000
seed = 11
keep = ["strength"]
keep_samples = [0, 12345, 119999]
[[sweep]]
"random.strength.spectrum.correlation_length" = [2e-3, 3e-3, 4e-3, 6e-3]
"""

# The command itself, with chunks that follow each other fifty times faster.
COMMAND = """
import sys
import stiction.ensemble.resume as stored
from stiction.cli.app import main
stored.FLUSH_SECONDS = 0.02
sys.argv = ["stiction", "run", *sys.argv[1:]]
main()
"""


@dataclass
class Counts:
    """What happened.

    Attributes
    ----------
    kills, in_the_middle : int
        Kills in all, and those after which some chunks but not all were stored.
    studies, different : int
        Runs completed in spite of them, and those whose result differs.
    """

    kills: int = 0
    in_the_middle: int = 0
    studies: int = 0
    different: int = 0


def start(study: Path, out: Path) -> subprocess.Popen[bytes]:
    """The command, in a process of its own."""
    command = [sys.executable, "-c", COMMAND, str(study), "--out", str(out), "--workers", "1"]
    return subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)


def finish(process: subprocess.Popen[bytes]) -> None:
    """Wait for a process that is to end well."""
    errors = process.communicate()[1].decode()
    if process.returncode:
        raise RuntimeError(f"exit code {process.returncode}: {errors}")


def wait_for(process: subprocess.Popen[bytes], event: Callable[[], bool], seconds: float) -> None:
    """Until an event, the end of the process, or so many seconds."""
    end = time.perf_counter() + seconds
    while process.poll() is None and time.perf_counter() < end and not event():
        time.sleep(0.001)


def samples_in(out: Path) -> int:
    """Samples listed so far (chunks are joined: their number goes up and down)."""
    folder = out.with_name(out.name + ".run") if out.suffix == ".nc" else out
    try:
        lines = (folder / "chunks.jsonl").read_bytes().split(b"\n")[:-1]
    except FileNotFoundError:
        return 0
    entries = [json.loads(line.partition(b" ")[2]) for line in lines]
    return sum(span[2] for entry in entries for span in entry.get("done", ()))


def result_of(out: Path) -> xr.Dataset:
    """The finished result."""
    from stiction.stored_run import StoredRun

    return StoredRun(out).dataset()


def campaign(kills: int, folder: Path, seed: int = 0, say: bool = False) -> Counts:
    """Kill until `kills` are counted and the last run is complete."""
    chance, counts = random.Random(seed), Counts()
    study = folder / "study.toml"
    study.write_text(STUDY)
    finish(start(study, folder / "reference"))
    begin = time.perf_counter()
    finish(start(study, folder / "reference"))  # nothing to do: the time to start
    idle = time.perf_counter() - begin
    reference = result_of(folder / "reference")
    while counts.kills < kills or not counts.studies:
        ending = ".nc" if counts.studies % 2 else ""
        out = folder / f"run{counts.studies}{ending}"
        while True:
            before = samples_in(out)
            process = start(study, out)
            if counts.kills == kills:
                finish(process)
                break
            if chance.random() < 0.25:  # while it starts, reads what is there, or computes
                wait_for(process, lambda: False, chance.uniform(0.3 * idle, 1.5 * idle))
            else:  # while it computes, or when it has just finished
                wait_for(process, lambda now=before, out=out: samples_in(out) > now, 60.0)
                wait_for(process, lambda: False, chance.uniform(0.0, 0.4))
            if process.poll() is not None:
                finish(process)
                break
            process.kill()
            process.wait()
            process.stderr.close()
            counts.kills += 1
            counts.in_the_middle += samples_in(out) > before
        counts.studies += 1
        counts.different += not result_of(out).identical(reference)
        if say:
            print(
                f"{counts.kills} kills, {counts.in_the_middle} of them after new chunks;"
                f" {counts.studies} studies completed, {counts.different} differ",
                flush=True,
            )
    return counts


def main() -> None:
    """Run the campaign and say what happened."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--kills", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        counts = campaign(options.kills, Path(folder), options.seed, say=True)
    sys.exit(1 if counts.different else 0)


if __name__ == "__main__":
    main()
