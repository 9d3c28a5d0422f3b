"""Median times and rows with ratios, for all benchmarks."""

import statistics
import time


def median_time(function, repeats=7):
    """Median wall time of `function()` over `repeats` runs after one to warm up, s."""
    function()
    times = []
    for _ in range(repeats):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return statistics.median(times)


def row(label, ours, references):
    """Print our time in us beside references and the ratios to them."""
    text = "".join(
        f"  {name}: {value * 1e6:.1f} ({value / ours:.0f}x)" for name, value in references.items()
    )
    print(f"{label:24s} {ours * 1e6:9.2f}{text}", flush=True)
