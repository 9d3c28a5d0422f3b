"""Do the tests notice? Small faults, one at a time, in a copy of the package.

    python .ci/mutants criterion --faults 20 --seed 1

Signs, factors, minima for maxima, bounds off by one, terms and periods left out, arguments swapped,
warnings not given, at sampled lines of a folder or file of the package. Each runs against the
tests nearest to it, without the slow ones; `--all` runs all of them on what survived. A survivor
needs a test, unless the fault changes nothing that a user sees. Kernels are compiled anew where a
fault is in them, which mutmut and cosmic-ray, working inside one process, do not see to.
"""

from __future__ import annotations

import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from faults import Fault, faults_of

ROOT = Path(__file__).parents[2]
NEAREST = {
    "base": "refusals mistakes* progress cache warnings own_method",
    "cli": "runs cli warnings",
    "criterion": "lines planes specimens criterion griffith crooked",
    "dynamics": "ruptures dynamics_* rupture_stations plane_rupture specimen_ruptures block_waves",
    "elasticity": "specimens lines planes blocks block_response dynamics_waves"
    " criterion dynamics_equilibrium equilibrium",
    "ensemble": "runs fields store ensemble study progress own_method reliability",
    "equilibrium": "lines planes specimens crooked equilibrium plane_equilibrium instability"
    " friction_laws",
    "friction": "lines ruptures mistakes* friction_laws crooked dynamics_properties",
    "inference": "inference* mistakes* pictures fit_* joined",
    "jit": "cache architecture own_method",
    "plot": "pictures runs",
    "problem": "refusals mistakes* specimens bad_input crooked criterion equilibrium profiles"
    " study",
    "profiles": "profiles mistakes* refusals crooked fit_field",
    "random": "fields refusals conditional* random_interface reliability",
    "reliability": "reliability* failure_run runs pictures",
    "statistics": "fields statistics_* criterion inference",
    "study": "runs refusals mistakes* study store planes own_method failure_run",
}
"""Names of test files; the rest of the package is tested by what uses it."""
REST = (
    "refusals mistakes* bad_input specimens crooked criterion study dynamics_input own_method"
)


def tests_near(target: str) -> list[str]:
    """The test files for a folder or file of the package, quick ones first."""
    parts = Path(target).with_suffix("").parts
    names = next((NEAREST[part] for part in reversed(parts) if part in NEAREST), REST).split()
    found = [path for name in names for path in sorted(ROOT.glob(f"tests/*/test_{name}.py"))]
    return list(dict.fromkeys(str(path.relative_to(ROOT)) for path in found))


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


def sampled(target: Path, count: int, seed: int) -> list[tuple[Path, Fault]]:
    """Faults at different lines, drawn among all lines that can have one."""
    files = sorted(target.rglob("*.py")) if target.is_dir() else [target.with_suffix(".py")]
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
    given = parser.parse_args()
    begin, caught, survived = time.monotonic(), 0, []
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
        for name in filter(lambda name: (ROOT / name).is_file(), listed.stdout.splitlines()):
            (tree / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, tree / name)
        tests = tests_near(given.target)
        print(f"{given.target}: {len(tests)} files of tests", flush=True)
        if failed := fails(tree, tests, 3600.0):
            sys.exit(f"without any fault: {failed}")
        allowed = 120.0 + 5.0 * (time.monotonic() - begin)
        package = tree / "src" / "stiction"
        for path, fault in sampled(package / given.target, given.faults, given.seed):
            if time.monotonic() - begin > 60.0 * given.minutes:
                break
            source = path.read_bytes()
            path.write_bytes(fault.put_into(source))
            failed = fails(tree, tests, allowed)
            if not failed and given.all:
                failed = fails(tree, ["tests"], 3600.0)
            path.write_bytes(source)
            caught += bool(failed)
            text = f"{path.relative_to(package)}:{fault.line}: {fault}"
            survived += [] if failed else [text]
            print(f"{'caught  ' if failed else 'SURVIVED'} {text}  {failed}", flush=True)
    print(
        f"\n{given.target}: {caught} of {caught + len(survived)} caught", *survived, sep="\n  "
    )


if __name__ == "__main__":
    main()
