"""The whole of `stiction paper` on all cores, beside one core; where the processor time goes.

Kernels are compiled before. `offered` is what two busy processes get of two cores at that moment.
Run: ``python benchmarks/paper.py [samples]``
"""

import sys
import tempfile
import time

import xarray as xr
from store import two_cores

import stiction as st
from stiction.ensemble.scheduler import usable_cores
from stiction.papers.albertini2020.studies import STUDIES


def timed(samples, workers):
    """Wall time and processor time of a run into an empty folder, s, and where it is."""
    folder = tempfile.mkdtemp()
    begin, work = time.perf_counter(), time.process_time()
    st.paper.run(folder, samples=samples, workers=workers)
    return time.perf_counter() - begin, time.process_time() - work, folder


def main(samples):
    timed(64, None)
    print(f"offered: {two_cores():.2f} of two cores; wall and processor time, s")
    one, work, _ = timed(samples, 1)
    print(f"one worker   {one:6.1f} {work:6.1f}")
    both, work, folder = timed(samples, None)
    print(f"all {usable_cores():3d} cores{both:6.1f} {work:6.1f}   {one / both:.2f} times as fast")
    spent = {}
    for name in STUDIES:
        try:
            with xr.open_dataset(f"{folder}/results.nc", group=name) as study:
                spent[name] = study.attrs["seconds"]
        except OSError:  # not part of the usual report
            continue
    for name, seconds in sorted(spent.items(), key=lambda item: -item[1]):
        print(f"  {name:16s}{seconds:6.2f}")
    print(f"  figures and page{work - sum(spent.values()):6.2f}")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000)
