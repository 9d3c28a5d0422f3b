"""What a move of each slider of the explorer costs: seconds of processor and of the clock.

Run: python benchmarks/explorer.py; beside it a plain reference, the same sum without what is kept.
"""

import dataclasses
import time

from stiction.explorer.setting import Cached, Setting

MOVES = {
    "correlation_length": 2.0,
    "mean": 1.1,
    "spread": 0.22,
    "residual": 0.1,
    "critical_slip": 2.5,
    "pressure": 6.0,
    "length": 110.0,
    "sample": 1,
    "load": 0.9,
}


def timed(cached: Cached, setting: Setting) -> tuple[float, float]:
    clock, processor = time.perf_counter(), time.process_time()
    cached.answer(setting)
    return time.perf_counter() - clock, time.process_time() - processor


def main() -> None:
    kept = Cached()
    kept.answer(Setting())  # compiles
    print(f"{'slider':20s} {'clock (s)':>10s} {'processor (s)':>14s} {'afresh (s)':>11s}")
    for name, value in MOVES.items():
        kept.answer(Setting())
        moved = dataclasses.replace(Setting(), **{name: value})
        clock, processor = timed(kept, moved)
        _, afresh = timed(Cached(), moved)
        print(f"{name:20s} {clock:10.3f} {processor:14.3f} {afresh:11.3f}")


if __name__ == "__main__":
    main()
