"""How much does the interaction of slip patches lower the onset, on a line and on a plane?

Computes everything of docs/line-and-plane.md and draws its figures:
    python examples/line_and_plane.py RUNS                 (again after an interruption: it goes on)
    python examples/line_and_plane.py RUNS --samples 20    (a first look, at most 20 a point)
Runs are stored in the folder RUNS, figures go to --figures (docs/images).
"""

import argparse
import dataclasses
from collections import defaultdict
from pathlib import Path

import numpy as np
import xarray as xr
from line_and_plane_figures import draw
from scipy.stats import rankdata

import stiction as st
from stiction.equilibrium.solver import first_instabilities, make_program
from stiction.statistics.estimates import Estimate, mean, standard_deviation

RATIOS = (0.25, 0.5, 1.0, 2.0)
"""Correlation lengths xi_0 over the nucleation length h_n of a line."""
SOLID = st.Solid(shear_modulus=1e9, poisson_ratio=0.33, density=1170.0)
FRICTION = st.LinearWeakening(weakening_rate=0.5e12)
NUCLEATION_LENGTH = st.Problem(
    SOLID, st.Interface(length=0.1, nodes=512), FRICTION
).nucleation_length
RESAMPLED = 200
NEIGHBOURS = 100
REACH = 1.25
"""Radius of the neighbourhood of a critical patch, in h_n: most of them fit into it."""
OUT_OF_REACH = 5e6
"""Strength, Pa, that nothing reaches."""
HEADS = {
    "line, small": "line, 16 h_n",
    "line, large": "line, 64 h_n",
    "plane, small": "plane, 4 h_n",
    "plane, large": "plane, 8 h_n",
    "link": "weakest of four",
    "local": "local criterion",
    "local link": "weakest of four, local",
    "lowering": "lowering, points",
}
"""What cases and estimates are called in tables."""
QUARTERS = 4
"""How often a small interface fits into the large one of the same kind."""


@dataclasses.dataclass(frozen=True)
class Case:
    """One interface of the study; those of one size and kind have the same draws."""

    name: str
    size: int  # in h_n, along each direction
    nodes: int  # in h_n
    samples: int
    seed: int
    kept: int  # samples whose slip is kept

    @property
    def plane(self) -> bool:
        return self.name.startswith("plane")

    @property
    def problem(self) -> st.Problem:
        """The only difference between a line and a plane: two numbers for one."""
        length, nodes = self.size * NUCLEATION_LENGTH, self.size * self.nodes
        interface = (
            st.Interface(length=(length, length), nodes=(nodes, nodes))
            if self.plane
            else st.Interface(length=length, nodes=nodes)
        )
        return st.Problem(SOLID, interface, FRICTION)


CASES = (
    Case("line, small", 16, 32, 10_000, 1, 1000),
    Case("line, large", 64, 32, 10_000, 2, 1000),
    Case("plane, small", 4, 16, 1000, 3, 200),
    Case("plane, large", 8, 16, 500, 4, 100),
    # Every second node is a node of the cases above: what the grid costs.
    Case("line, small, fine", 16, 64, 10_000, 1, 1000),
    Case("plane, small, fine", 4, 32, 100, 3, 10),
)


def strength(ratio: float) -> st.RandomField:
    """The paper's, with the mean of the interface random: no plane is long against 2 h_n."""
    return st.RandomField(
        marginal=st.Beta(alpha=1.5, beta=3.0, low=0.66e6, high=1.66e6),
        spectrum=st.PowerLawSpectrum(correlation_length=ratio * NUCLEATION_LENGTH),
        mean_mode=True,
    )


def studies(case: Case, most: int) -> dict[str, st.Study]:
    """The same samples by equilibrium and by the local criterion, and some with their slip."""
    few = min(case.samples, most)
    lengths = [ratio * NUCLEATION_LENGTH for ratio in RATIOS]
    exact = st.Study(
        problem=case.problem,
        random=strength(RATIOS[0]),
        method=st.Equilibrium(),
        ensemble=st.Ensemble(samples=few, seed=case.seed),
        sweep=[{"random.strength.spectrum.correlation_length": lengths}],
        title=case.name,
    )
    # Sample i is the same in all of them.
    some = st.Ensemble(samples=min(few, case.kept), seed=case.seed, keep="slip")
    return {
        "exact": exact,
        "local": dataclasses.replace(exact, method=st.LocalCriterion()),
        "kept": dataclasses.replace(exact, ensemble=some),
    }


def compute(folder: Path, most: int = 10**6, progress: bool = True) -> dict[str, xr.Dataset]:
    """Run what is missing; one dataset a case, with dimensions ratio and sample."""
    folder.mkdir(parents=True, exist_ok=True)
    found = {}
    for case in CASES:
        pair = studies(case, most)
        results = {
            which: study.run(
                out=folder / f"{case.name.replace(', ', '-')}-{which}", progress=progress
            )
            for which, study in pair.items()
        }
        slip = results["kept"].slip.rename(sample="kept_sample")
        data = results["exact"].assign(local=results["local"].first_instability, slip=slip)
        data = data.assign_coords(ratio=("correlation_length", list(RATIOS)))
        found[case.name] = data.swap_dims(correlation_length="ratio")
    return found


def lowering(data: xr.Dataset) -> xr.DataArray:
    """By how much interaction lowers the onset, per cent of the local criterion."""
    return 100.0 * (1.0 - data.first_instability / data.local)


def slipping(data: xr.Dataset) -> xr.DataArray:
    """Share of the nodes that slip at the first instability, per cent; of the kept samples."""
    along = [name for name in ("x", "y") if name in data.slip.dims]
    return 100.0 * (data.slip > 0.0).mean(along)


def neighbourhood_onset(case: Case, ratio: float, data: xr.Dataset) -> np.ndarray:
    """First instability, Pa, if only nodes near the critical patch can slip.

    Of the first `NEIGHBOURS` samples; near is within `REACH` h_n of the centre. What slips
    farther away is missing, while the patch keeps its own shape, which on a plane is no ellipse.
    """
    problem = case.problem
    count = min(NEIGHBOURS, data.sizes["sample"])
    tau_p = strength(ratio).sample(problem.interface, samples=count, seed=case.seed)
    centres = data.critical_position.sel(ratio=ratio).values.reshape(-1, 2 if case.plane else 1)
    n, length = case.size * case.nodes, case.size * NUCLEATION_LENGTH
    x = np.arange(n) * length / n
    for row, centre in zip(tau_p, centres, strict=False):
        away = [(x - c + 0.5 * length) % length - 0.5 * length for c in centre]
        square = away[0] ** 2 if not case.plane else np.add.outer(away[0] ** 2, away[1] ** 2)
        row[square > (REACH * NUCLEATION_LENGTH) ** 2] = OUT_OF_REACH
    sample = problem.sample({"strength": tau_p})
    return sample.mean_stress(first_instabilities(make_program(problem), sample))


def split(case: Case, data: xr.Dataset) -> dict[str, list[Estimate]]:
    """Lowering by what is near and by what is far, per cent of the local criterion."""
    rows: dict[str, list[Estimate]] = {"near": [], "far": []}
    for ratio in RATIOS:
        at = data.sel(ratio=ratio)
        near = neighbourhood_onset(case, ratio, data)
        local, exact = (v.values[: near.size] for v in (at.local, at.first_instability))
        rows["near"].append(mean(100.0 * (1.0 - near / local)))
        rows["far"].append(mean(100.0 * (near - exact) / local))
    return rows


def weakest_link(values: np.ndarray, copies: int = QUARTERS) -> float:
    """Expected least of `copies` independent values: an average over all subsets of that size."""
    ordered, n = np.sort(values), values.size
    rank = np.arange(n)
    others = np.ones(n)  # chance that the copies - 1 others all have a higher rank
    for taken in range(copies - 1):
        others *= (n - 1 - rank - taken) / (n - 1 - taken)
    return float(copies / n * (others.clip(min=0.0) * ordered).sum())


def rank_correlation(pairs: np.ndarray) -> float:
    """Spearman's, of columns."""
    return float(np.corrcoef(rankdata(pairs[:, 0]), rankdata(pairs[:, 1]))[0, 1])


def bootstrap(statistic, rows: np.ndarray, resampled: int = RESAMPLED) -> Estimate:
    """A statistic of independent rows, with the standard error from resampling them."""
    random = np.random.default_rng(0)
    again = [
        statistic(rows[random.integers(len(rows), size=len(rows))]) for _ in range(resampled)
    ]
    return Estimate(statistic(rows), float(np.std(again, ddof=1)))


def share(events: np.ndarray) -> Estimate:
    """Per cent."""
    p = float(events.mean())
    return Estimate(100.0 * p, 100.0 * np.sqrt(p * (1.0 - p) / events.size))


def share_text(found: Estimate, samples: int) -> str:
    """Where none was seen, what 95 % confidence excludes."""
    return text(found) if found.value > 0.0 else f"< {300.0 / samples:.2g}"


def text(estimate: Estimate) -> str:
    """Value and standard error, with two digits of the error."""
    if estimate.error < 1e-9:
        return f"{estimate.value:.3g}"
    digits = max(0, 1 - int(np.floor(np.log10(estimate.error))))
    return f"{estimate.value:.{digits}f} ± {estimate.error:.{digits}f}"


def summarise(data: xr.Dataset) -> dict[str, list]:
    """Estimates at each correlation length of one case."""
    rows: dict[str, list] = defaultdict(list)
    for i in range(data.sizes["ratio"]):
        at = data.isel(ratio=i)
        lower = lowering(at).values
        stopped = at.arrested_events.values > 0
        rise = 100.0 * (at.critical_stress / at.first_instability - 1.0).values[stopped]
        onset = at.first_instability.values * 1e-6
        rows["onset"].append(mean(onset))
        rows["scatter"].append(standard_deviation(onset).scaled(100.0 / onset.mean()))
        rows["lowering"].append(mean(lower))
        rows["spread"].append(np.quantile(lower, [0.05, 0.95]))
        rows["patches"].append(mean(at.slip_patches.values.astype(float)))
        rows["slipping"].append(mean(slipping(at).values))
        pairs = np.column_stack([at.local.values, at.first_instability.values])
        rank = bootstrap(rank_correlation, pairs)
        rows["rank"].append(rank)
        rows["disorder"].append(Estimate(1.0 - rank.value, rank.error))
        rows["arrested"].append(share(stopped))
        rows["arrested, text"].append(share_text(rows["arrested"][-1], stopped.size))
        rows["rise"].append(mean(rise) if rise.size > 1 else None)
    return rows


def size_effect(small: xr.Dataset, large: xr.Dataset) -> dict[str, list[Estimate]]:
    """Mean fall of the onset, per cent, when the interface grows: seen, and of a weakest link."""
    rows: dict[str, list[Estimate]] = {"exact": [], "local": [], "link": [], "local link": []}
    for name, column in (("exact", "first_instability"), ("local", "local")):
        for i in range(small.sizes["ratio"]):
            before, after = (data[column].values[i] for data in (small, large))
            reference = float(before.mean())
            seen = mean(before) - mean(after)
            rows[name].append(seen.scaled(100.0 / reference))
            link = bootstrap(lambda v: v.mean() - weakest_link(v), before)
            rows["link" if name == "exact" else "local link"].append(
                link.scaled(100.0 / reference)
            )
    return rows


def grid_error(coarse: xr.Dataset, fine: xr.Dataset) -> dict[str, list[Estimate]]:
    """Change by half the spacing of nodes on the same samples, per cent of the onset."""
    few = fine.sizes["sample"]
    coarse = coarse.isel(sample=slice(few))
    changes = {
        "exact": 100.0 * (fine.first_instability / coarse.first_instability - 1.0),
        "lowering": lowering(fine) - lowering(coarse),
    }
    return {name: [mean(row) for row in change.values] for name, change in changes.items()}


def tables(found: dict[str, xr.Dataset], parts: dict, effects: dict) -> str:
    """Everything as tables in Markdown."""
    lines: list[str] = []

    def table(title: str, columns: dict, cell) -> None:
        heads = [HEADS.get(name, name) for name in columns]
        lines.extend([f"{title}:", "", "| xi_0/h_n | " + " | ".join(heads) + " |"])
        lines.append("|---" * (1 + len(columns)) + "|")
        for i, ratio in enumerate(RATIOS):
            cells = [cell(column, i) for column in columns.values()]
            lines.append(f"| {ratio:g} | " + " | ".join(cells) + " |")
        lines.append("")

    def lowered(part: dict, i: int) -> str:
        low, high = part["spread"][i]
        return f"{text(part['lowering'][i])} ({low:.2g} to {high:.2g})"

    def plain(key: str):
        return lambda part, i: text(part[key][i]) if part[key][i] else ""

    for name, data in found.items():
        counts = data.sizes["sample"], data.sizes["kept_sample"]
        lines.append("{}: {} samples a point, slip of {}".format(name, *counts))
    lines.append("")
    table("Onset lowered, % of the local criterion (5 to 95 % of the samples)", parts, lowered)
    for where in ("near", "far"):
        table(f"Of this by what is {where}", parts, plain(where))
    table("Mean onset, MPa", parts, plain("onset"))
    table("Its standard deviation, % of the mean", parts, plain("scatter"))
    table("Slipping patches at the first instability", parts, plain("patches"))
    table("Slipping nodes, %", parts, plain("slipping"))
    table("Rank correlation of local criterion and onset", parts, plain("rank"))
    table("Samples with an arrested event, %", parts, lambda part, i: part["arrested, text"][i])
    table("Of these, sliding load over first instability, %", parts, plain("rise"))
    for kind, effect in effects.items():
        table(
            f"Fall of the mean onset on a {kind} four times as large, %", effect, plain_estimate
        )
        error = grid_error(found[f"{kind}, small"], found[f"{kind}, small, fine"])
        table(f"Change on a {kind} by half the spacing, %", error, plain_estimate)
    return "\n".join(lines)


def plain_estimate(column: list[Estimate], i: int) -> str:
    """A cell of a table."""
    return text(column[i])


def main(arguments: list[str] | None = None) -> None:
    """Compute what is missing, print the tables, draw the figures."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("runs", type=Path, help="folder of the stored runs")
    parser.add_argument("--samples", type=int, default=10**6, help="at most so many a point")
    parser.add_argument("--figures", type=Path, default=Path("docs/images"))
    given = parser.parse_args(arguments)
    found = compute(given.runs, given.samples)
    parts = {name: summarise(data) for name, data in found.items() if "fine" not in name}
    effects = {
        kind: size_effect(found[f"{kind}, small"], found[f"{kind}, large"])
        for kind in ("line", "plane")
    }
    for case in CASES:
        if case.name in parts:
            parts[case.name] |= split(case, found[case.name])
    print(tables(found, parts, effects))
    lowered = {name: lowering(found[name]) for name in parts}
    draw(given.figures, RATIOS, lowered, parts, effects, samples_to_show(found))


def samples_to_show(found: dict[str, xr.Dataset], ratio: float = 0.5) -> dict[str, tuple]:
    """Strength, slip and sensitivity of the first large line and plane, lengths in h_n."""
    shown = {}
    for case in CASES:
        if case.name in ("line, large", "plane, large"):
            problem = case.problem
            tau_p = strength(ratio).sample(problem.interface, samples=1, seed=case.seed)[0]
            method = st.Equilibrium(slip=True, sensitivity=True)
            onset = st.onset(problem, tau_p, method=method).isel(sample=0)
            # The same sample as in the stored run.
            stored = found[case.name].first_instability.sel(ratio=ratio).values[0]
            assert abs(float(onset.first_instability) / stored - 1.0) < 1e-6
            shown[case.name] = (case, tau_p, onset)
    return shown


if __name__ == "__main__":
    main()
