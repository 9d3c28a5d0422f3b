"""Do the tests notice small faults? Put one fault at a time into a copy of the package.

    python .ci/mutants methods/criterion --faults 20 --seed 1

Faults are wrong signs and factors, minima for maxima, bounds off by one, terms and periods left
out, swapped arguments and missing warnings, at sampled lines of a folder or file. The nearest test
files run on each fault, without slow tests. With `--all`, all tests run on the survivors. A
survivor needs a test, unless no user sees its effect. A fault in a kernel compiles the kernel anew,
which mutmut and cosmic-ray, working inside one process, do not see to.
"""

from __future__ import annotations

import argparse
import math
import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections import Counter
from itertools import chain
from pathlib import Path

from faults import Fault, faults_of

ROOT = Path(__file__).parents[2]
PACKAGE = Path("src", "stiction")
NEAREST = 12
"""Number of test files that count as near."""


def tests_near(sources: list[Path]) -> list[str]:
    """Return the test files that share most words with the names in some files, nearest first.

    A shared word weighs -log(share of test files with it). Names are of files, functions, classes.
    """
    names = {
        word
        for path in sources
        for word in path.relative_to(ROOT / PACKAGE).with_suffix("").parts
    }
    for path in sources:
        names |= set(re.findall(r"^ *(?:def|class) _*(\w+)", path.read_text(), re.MULTILINE))
    tests = sorted(ROOT.glob("tests/*/test_*.py"))
    words = [
        names
        & set(
            re.findall(
                r"[^\W_]\w*", f"{path.stem.replace(chr(95), chr(32))} {path.read_text()}"
            )
        )
        for path in tests
    ]
    holders = Counter(chain.from_iterable(words))
    near = [sum(math.log(len(tests) / holders[word]) for word in shared) for shared in words]
    nearest = sorted(zip(near, tests, strict=True), reverse=True)[:NEAREST]
    return [str(path.relative_to(ROOT)) for _, path in nearest]


def fails(tree: Path, tests: list[str], seconds: float) -> str:
    """The first test that fails in a copy, or nothing; what hangs is noticed too."""
    options = ["-x", "-q", "-n", "0", "-p", "no:cacheprovider", "--durations=0", "--tb=no"]
    own = {"PYTHONPATH": str(tree / "src"), "TMPDIR": str(tree.parent), "MPLBACKEND": "Agg"}
    command = [sys.executable, "-m", "pytest", *options, *tests]
    try:
        done = subprocess.run(
            command,
            cwd=tree,
            env=os.environ | own,
            timeout=seconds,
            capture_output=True,
            text=True,
        )
    except subprocess.TimeoutExpired:
        return "more time than allowed"
    if done.returncode == 0:
        return ""
    failed = [line for line in done.stdout.splitlines() if line.startswith(("FAILED", "ERROR"))]
    return failed[0].split(" - ")[0] if failed else done.stdout[-200:] + done.stderr[-200:]


def sampled(files: list[Path], count: int, seed: int) -> list[tuple[Path, Fault]]:
    """Faults at different lines of some files, drawn among all lines that can have one."""
    lines: dict[tuple[Path, int], list[Fault]] = {}
    for path in files:
        for fault in faults_of(path.read_bytes()):
            lines.setdefault((path, fault.line), []).append(fault)
    draw = random.Random(seed)
    return [
        (
            path,
            draw.choice(
                [fault for fault in lines[path, line] if leaves_a_program(path, fault)]
            ),
        )
        for path, line in draw.sample(sorted(lines), min(count, len(lines)))
    ]


def leaves_a_program(path: Path, fault: Fault) -> bool:
    try:
        compile(fault.put_into(path.read_bytes()), path, "exec")
    except SyntaxError:
        return False
    return True


def main() -> None:
    parser = argparse.ArgumentParser(prog="python .ci/mutants", description=__doc__)
    parser.add_argument(
        "target", help="folder or file of src/stiction, such as random/fields.py"
    )
    parser.add_argument("--faults", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=1e9, help="begin none after so long")
    parser.add_argument(
        "--all", action="store_true", help="survivors against all default tests"
    )
    parser.add_argument(
        "--tests", nargs="+", metavar="FILE", help="instead of the nearest tests"
    )
    given = parser.parse_args()
    target = ROOT / PACKAGE / given.target
    files = sorted(target.rglob("*.py")) if target.is_dir() else [target.with_suffix(".py")]
    begin, caught, survived = time.monotonic(), 0, []
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
        for name in filter(lambda name: (ROOT / name).is_file(), listed.stdout.splitlines()):
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
        tests = given.tests or tests_near(files)
        print(given.target, *tests, sep="\n  ", flush=True)
        if failed := fails(tree, tests, 3600.0):
            sys.exit(f"without any fault: {failed}")
        print(f"without faults: passed in {time.monotonic() - begin:.0f} s", flush=True)
        allowed = 120.0 + 5.0 * (time.monotonic() - begin)
        for original, fault in sampled(files, given.faults, given.seed):
            if time.monotonic() - begin > 60.0 * given.minutes:
                break
            name = original.relative_to(ROOT)
            path, source = tree / name, original.read_bytes()
            path.write_bytes(fault.put_into(source))
            failed = fails(tree, tests, allowed)
            if not failed and given.all:
                failed = fails(tree, ["tests"], 3600.0)
            path.write_bytes(source)
            caught += bool(failed)
            text = f"{name.relative_to(PACKAGE)}:{fault.line}: {fault}"
            survived += [] if failed else [text]
            print(f"{'caught  ' if failed else 'SURVIVED'} {text}  {failed}", flush=True)
    print(
        f"\n{given.target}: {caught} of {caught + len(survived)} caught", *survived, sep="\n  "
    )


if __name__ == "__main__":
    main()
