"""Storing and scheduling, beside the bare solver in a loop; two workers beside one; memory.

Equilibrium at n = 1024, xi_0/h_n = 0.5, chunks of about a second. The plain reference solves the
same samples 256 at a time and keeps them in memory.
Run: ``python benchmarks/store.py [samples]``
"""

import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from statistics import median

from stiction.ensemble.plan import chunks, compute
from stiction.ensemble.store_writer import StoreWriter

import stiction as st

REPEATS = 5
METHOD = {"type": "equilibrium"}
BUSY = [sys.executable, "-c", "sum(range(30_000_000))"]


def study(samples, method=METHOD):
    problem = st.paper.problem()
    return st.Study(
        problem=problem,
        random=st.paper.strength(problem, correlation_ratio=0.5),
        method=method,
        ensemble=st.Ensemble(samples=samples),
    )


def timed(function):
    """Wall time and processor time of all threads, s."""
    begin, work = time.perf_counter(), time.process_time()
    function()
    return time.perf_counter() - begin, time.process_time() - work


def main(samples):
    one = study(samples)
    plan = one.plans[0]
    compute(plan, 0, 16)

    def plain():
        return [compute(plan, *piece) for piece in chunks(samples, 256)]

    times = {name: [] for name in ("plain", "memory", "stored", "stored, 2 workers", "writing")}
    add = StoreWriter.add
    spent, offered = [], []
    StoreWriter.add = lambda *arguments: spent.append(timed(lambda: add(*arguments)))
    for _ in range(REPEATS):  # in turn, so that a busy moment falls on all alike
        offered.append(two_cores())
        times["plain"].append(timed(plain))
        times["memory"].append(timed(lambda: one.run(workers=1)))
        for name, workers in (("stored", 1), ("stored, 2 workers", 2)):
            folder = Path(tempfile.mkdtemp()) / "run"
            spent.clear()
            times[name].append(timed(lambda f=folder, w=workers: one.run(out=f, workers=w)))
            if workers == 1:
                times["writing"].append(tuple(map(sum, zip(*spent, strict=True))))
            shutil.rmtree(folder.parent)
    print(f"{samples} samples by equilibrium, n = 1024; medians of {REPEATS}")
    for name, pairs in times.items():
        wall, work = (median(pair[i] for pair in pairs) for i in (0, 1))
        ratios = [
            median(a[i] / b[i] for a, b in zip(pairs, times["plain"], strict=True)) for i in (0, 1)
        ]
        print(
            f"  {name:18s} {wall:6.2f} s, {ratios[0]:6.3f} of the plain loop;"
            f" processor {work:6.2f} s, {ratios[1]:6.3f}"
        )
    pairs = zip(times["stored"], times["stored, 2 workers"], strict=True)
    gain = median(one[0] / two[0] for one, two in pairs)
    print(f"  two workers: {gain:.2f} times one")
    print(f"  two processes that share nothing: {median(offered):.2f} times one")


def two_cores():
    """What a second core is worth now: two processes that share nothing, beside one."""
    alone, both = (
        timed(lambda n=n: [p.wait() for p in [subprocess.Popen(BUSY) for _ in range(n)]])[0]
        for n in (1, 2)
    )
    return 2.0 * alone / both


def peak(samples):
    """Peak memory of a process that stores so many samples of the local criterion, MB."""
    code = (
        "import sys; sys.path.insert(0, 'benchmarks'); import store; store.fill(int(sys.argv[1]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(samples)], capture_output=True, text=True, check=True
    )
    return float(done.stdout)


def fill(samples):
    from stiction.stored_run import run_into

    with tempfile.TemporaryDirectory() as folder:
        run_into(study(samples, {"type": "local_criterion"}), Path(folder) / "run", workers=2)
    print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4000)
    for count in (10_000, 100_000, 400_000):
        print(f"  peak memory storing {count:7d} samples: {peak(count):6.0f} MB")
