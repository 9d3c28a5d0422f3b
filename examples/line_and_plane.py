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
from line_and_plane_figures import NAMES, draw
from scipy.stats import rankdata

import stiction as st
from stiction.statistics.estimates import WithError, mean

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
TITLES = {
    "lowering": "Onset lowered, % of the local criterion",
    "far": "Of this by slip far from the critical patch",
    "single": "Samples with a single slipping patch, %",
    "slipping": "Slipping nodes, %",
    "rank": "Rank correlation of local criterion and onset",
    "arrested": "Samples with an arrested event, %",
}
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
        sides = ((length, length), (nodes, nodes)) if self.plane else (length, nodes)
        return st.Problem(SOLID, st.Interface(*sides), FRICTION)


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
    some = st.Ensemble(samples=min(few, case.kept), seed=case.seed)
    return {
        "exact": exact,
        "local": dataclasses.replace(exact, method=st.LocalCriterion()),
        "kept": dataclasses.replace(exact, ensemble=some, method=st.Equilibrium(slip=True)),
    }


def compute(folder: Path, most: int = 10**6, progress: bool = True) -> dict[str, xr.Dataset]:
    """Run what is missing; one dataset a case, with dimensions ratio and sample."""
    folder.mkdir(parents=True, exist_ok=True)
    found = {}
    for case in CASES:
        results = {}
        for which, study in studies(case, most).items():
            place = folder / f"{case.name.replace(', ', '-')}-{which}"
            results[which] = study.run(out=place, progress=progress)
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


def far_lowering(case: Case, data: xr.Dataset) -> list[WithError]:
    """Lowering by slip far from the critical patch, per cent of the local criterion.

    Of the first `NEIGHBOURS` samples, each with its onset if only nodes within `REACH` h_n of the
    centre of its critical patch can slip. The patch keeps its own shape, on a plane no ellipse.
    """
    problem = case.problem
    places, length = problem.interface.coordinates.values(), case.size * NUCLEATION_LENGTH
    found = []
    for ratio in RATIOS:
        at = data.sel(ratio=ratio).isel(sample=slice(NEIGHBOURS))
        count = at.sizes["sample"]
        tau_p = strength(ratio).sample(problem.interface, samples=count, seed=case.seed)
        centres = at.critical_position.values.reshape(count, -1)
        for row, centre in zip(tau_p, centres, strict=True):
            away = [
                (x - c + 0.5 * length) % length - 0.5 * length
                for x, c in zip(places, centre, strict=True)
            ]
            square = sum(each**2 for each in np.meshgrid(*away, indexing="ij"))
            row[square > (REACH * NUCLEATION_LENGTH) ** 2] = OUT_OF_REACH
        near = st.onset(problem, tau_p, method=st.Equilibrium(), progress=False)
        rise = near.first_instability.values - at.first_instability
        found.append(mean(100.0 * (rise / at.local).values))
    return found


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


def bootstrap(statistic, rows: np.ndarray, resampled: int = RESAMPLED) -> WithError:
    """A statistic of independent rows, with the standard error from resampling them."""
    random = np.random.default_rng(0)
    choices = (random.integers(len(rows), size=len(rows)) for _ in range(resampled))
    again = [statistic(rows[chosen]) for chosen in choices]
    return WithError(statistic(rows), float(np.std(again, ddof=1)))


def share(events: np.ndarray) -> WithError:
    """Per cent."""
    p = float(events.mean())
    return WithError(100.0 * p, 100.0 * np.sqrt(p * (1.0 - p) / events.size))


def text(estimate: WithError) -> str:
    """Value and standard error, with two digits of the error."""
    if estimate.error < 1e-9:
        return f"{estimate.value:.3g}"
    digits = max(0, 1 - int(np.floor(np.log10(estimate.error))))
    return f"{estimate.value:.{digits}f} ± {estimate.error:.{digits}f}"


def summarise(data: xr.Dataset) -> dict[str, list[WithError]]:
    """Estimates at each correlation length of one case."""
    rows: dict[str, list[WithError]] = defaultdict(list)
    for ratio in RATIOS:
        at = data.sel(ratio=ratio)
        rows["lowering"].append(mean(lowering(at).values))
        rows["slipping"].append(mean(slipping(at).values))
        pairs = np.column_stack([at.local.values, at.first_instability.values])
        rank = bootstrap(rank_correlation, pairs)
        rows["rank"].append(rank)
        rows["disorder"].append(WithError(1.0 - rank.value, rank.error))
        rows["arrested"].append(share(at.arrested_events.values > 0))
        rows["single"].append(share(at.slip_patches.values == 1))
    return rows


def size_effect(small: xr.Dataset, large: xr.Dataset) -> dict[str, list[WithError]]:
    """Mean fall of the onset, per cent, when the interface grows: seen, and of a weakest link."""
    rows: dict[str, list[WithError]] = defaultdict(list)
    for name, column in (("exact", "first_instability"), ("local", "local")):
        for before, after in zip(small[column].values, large[column].values, strict=True):
            before, after = (100.0 * each / before.mean() for each in (before, after))
            link = bootstrap(lambda v: v.mean() - weakest_link(v), before)
            rows[name].append(mean(before) - mean(after))
            rows[f"{name}, weakest of four"].append(link)
    return rows


def grid_error(coarse: xr.Dataset, fine: xr.Dataset) -> dict[str, list[WithError]]:
    """Change by half the spacing of nodes on the same samples, per cent of the onset."""
    few = fine.sizes["sample"]
    coarse = coarse.isel(sample=slice(few))
    changes = {
        "exact": 100.0 * (fine.first_instability / coarse.first_instability - 1.0),
        "lowering, points": lowering(fine) - lowering(coarse),
    }
    return {name: [mean(row) for row in change.values] for name, change in changes.items()}


def table(title: str, columns: dict[str, list[WithError]]) -> None:
    """Print a table in Markdown, with a row for each correlation length."""
    heads = [NAMES.get(name, name).replace("$", "") for name in columns]
    print(f"{title}:\n\n| xi_0/h_n | " + " | ".join(heads) + " |")
    print("|---" * (1 + len(columns)) + "|")
    for ratio, *row in zip(RATIOS, *columns.values(), strict=True):
        print(f"| {ratio:g} | " + " | ".join(map(text, row)) + " |")
    print()


def tables(found: dict[str, xr.Dataset], parts: dict, effects: dict) -> None:
    """Print everything."""
    for name, data in found.items():
        counts = data.sizes["sample"], data.sizes["kept_sample"]
        print("{}: {} samples a point, slip of {}".format(name, *counts))
    for key, title in TITLES.items():
        table(title, {name: part[key] for name, part in parts.items()})
    for kind, effect in effects.items():
        table(f"Fall of the mean onset on a {kind} four times as large, %", effect)
        error = grid_error(found[f"{kind}, small"], found[f"{kind}, small, fine"])
        table(f"Change on a {kind} by half the spacing, %", error)


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
            parts[case.name]["far"] = far_lowering(case, found[case.name])
    tables(found, parts, effects)
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
