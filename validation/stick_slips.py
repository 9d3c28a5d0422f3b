"""Validation: fifty-six stick-slips of a fault of four metres, beside the model of its rig.

The record is `data/stick_slips/events.csv`, measured by Okubo, Yamashita and Fukuyama (see the
README there). Prints every number of docs/stick-slips.md: first what disagrees whatever the
parameters, then what the record fixes of them, what holds without a fit, and a prediction.

Run: ``python validation/stick_slips.py [FIGURES] [--quick]``; three minutes on two cores.
"""

import itertools
import sys
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import scipy.special
import scipy.stats
from scipy.optimize import brentq

import stiction as st
from stiction.plot.style import ACCENT, INK, PAGE, QUIET, panel, paper_style

TABLE = Path(__file__).parent / "data" / "stick_slips" / "events.csv"
LENGTH, HEIGHT, THICKNESS = 4.0, 0.2, 0.1  # m, of each block
PRESSURE, RESIDUAL = 2e6, 637e3  # Pa, as measured
GABBRO = {"youngs_modulus": 96e9, "poisson_ratio": 0.246, "density": 2980.0}
EXCESS = (22e3, 24e3, 26e3, 30e3, 35e3, 45e3)  # mean strength above the residual, Pa
CENTRAL = (6.5e9, 32e3)
"""Weakening rate (Pa/m) and mean excess that give the mean peak and the share of both ends."""
CVS = (0.2, 0.5)
"""Its variation from place to place, over a correlation length of 0.2 m."""
SENSORS = 16
SHARE = 0.25
"""Share of the weaker end in the unstable patches above which a rupture is one of both ends."""
SHARES = (1.0 / 3.0, SHARE, 1.0 / 6.0)
QUICK = "--quick" in sys.argv
SAMPLES, NODES = (40, 64) if QUICK else (400, 128)
EQUILIBRIUM = st.Equilibrium(slip=True)


def read_table():
    """Return the events: stresses in Pa, slips in m, without the units in the headings."""
    table = pd.read_csv(TABLE)
    names = ["event", "time", "end", "speed", "before", "after", "drop", "slip", "spread"]
    table.columns = names
    table[["before", "after", "drop"]] *= 1e6
    table[["slip", "spread"]] *= 1e-3
    return table


def without_trend(events, name):
    """Return a column less its straight line in time, about its mean."""
    line = np.polyval(np.polyfit(events.time, events[name], 1), events.time)
    return (events[name] - line + events[name].mean()).to_numpy()


def rig(
    machine, rate=5e9, *, length=LENGTH, drive=None, side="both", start=RESIDUAL, nodes=NODES
):
    """Return the rig as a problem: a reloaded interface rests at its residual strength."""
    pusher = st.Pusher(height=0.5 * HEIGHT, width=HEIGHT, side=side, stiffness=machine)
    return st.Problem(
        solid=st.Solid(**GABBRO, plane="stress"),
        interface=st.Interface(length=length, nodes=int(nodes * length / LENGTH)),
        friction=st.LinearWeakening(weakening_rate=rate, residual_strength=RESIDUAL),
        specimen=st.Blocks(height=HEIGHT, thickness=THICKNESS, drive=drive or pusher),
        load=st.Load(normal_pressure=PRESSURE, initial_stress=start),
    )


def machine_of(ratio):
    """Return the stiffness of the machine, N/m, from stress drop over slip (Pa/m).

    The drop of a rigid translation is h times the slip, h = k C/(k + C)/(2 L) with the stiffness
    C of a block and k of the machine as a block sees it, both per depth (docs/specimens.md).
    """
    block = rig(1e8).blocks.drive_stiffness
    total = 2.0 * LENGTH * ratio
    return 0.5 * THICKNESS * total * block / (block - total), 0.5 * THICKNESS * block


def strength_of(excess, cv, correlation_length):
    """Return a strength whose excess over the residual has this mean (Pa) and variation."""
    mean = RESIDUAL + excess
    marginal = st.Lognormal(mean=mean, cv=cv * excess / mean, low=RESIDUAL)
    return st.RandomField(marginal, st.ExponentialSpectrum(correlation_length))


def onsets(problem, strength, samples=None):
    """Return the onsets of samples, and which of them slid at their first instability."""
    tau_p = strength.sample(problem.interface, samples=samples or SAMPLES, seed=1)
    found = st.onset(problem, tau_p, method=EQUILIBRIUM, progress=False)
    return found, (found.arrested_events == 0).to_numpy()


def share_of_weaker_end(found, length=LENGTH):
    """Return the share of the weaker end in the unstable patch, from its position.

    The position is the centre of the growing slip; that of one end alone is the least, or most.
    """
    x = found.critical_position.to_numpy()
    end = min(x.min(), length - x.max(), 0.125 * length)
    left = np.clip((length - end - x) / (length - 2.0 * end), 0.0, 1.0)
    return np.minimum(left, 1.0 - left)


def rate_of(machine, strength, excess, peak):
    """Return the weakening rate (Pa/m) with which the mean peak is the measured one."""

    def above(log_slip):
        problem = rig(machine, rate=excess / 10.0**log_slip)
        return float(onsets(problem, strength, 40)[0].critical_stress.mean()) - peak

    return excess / 10.0 ** brentq(above, -6.3, -4.0, xtol=0.01)


def drop_on_slip(drop, slip):
    """Return slope (Pa/m) and intercept (Pa) of a straight line, and their errors."""
    line, covariance = np.polyfit(slip, drop, 1, cov=True)
    return line, np.sqrt(np.diag(covariance))


def of_model(problem, found, slid):
    """Return drop, mean slip and its scatter over the sensors for ruptures of all at once.

    All of the interface is at its residual strength before a cycle and after it. So the slip of a
    cycle is uniform, D/h, and what was slip before the rupture is missing from the rupture.
    """
    before = found.slip.to_numpy()[slid]
    whole = found.critical_load.to_numpy()[slid] / problem.blocks.relief
    drop = found.critical_stress.to_numpy()[slid] - RESIDUAL
    step = before.shape[1] // SENSORS
    spread = before[:, step // 2 :: step].std(axis=1, ddof=1)
    return drop, whole - before.mean(axis=1), spread


def memory(table):
    """Print how often W follows W, beside an order without memory."""
    ends = table.end.to_numpy()
    count, found = (ends == "W").sum(), np.sum((ends[1:] == "W") & (ends[:-1] == "W"))
    expected = count * (count - 1) / ends.size
    assert found == 0  # the chance is that of no two neighbours among all places of the W
    chance = scipy.special.comb(ends.size - count + 1, count) / scipy.special.comb(
        ends.size, count
    )
    print(f"W after W: {found} times, {expected:.1f} in random order, p = {chance:.0e}")


def record(table):
    """Print what the table says by itself, and return the events after the first."""
    events = table.iloc[1:]
    peaks = without_trend(events, "before")
    print(f"{len(table)} events: " + str(table.end.value_counts().to_dict()))
    memory(table)
    first = table.before[0] / events.before.mean() - 1.0
    print(f"first event: {100 * first:.1f} % above the mean of the others,", end=" ")
    print(f"{(table.before[0] - peaks.mean()) / peaks.std(ddof=2):.0f} standard deviations")
    slope = np.polyfit(events.time, events.before, 1, cov=True)
    error = 1e2 * slope[1][0, 0] ** 0.5
    print(
        f"drift of the peaks: {1e2 * slope[0][0] / 1e3:.1f} +- {error / 1e3:.1f} kPa in 100 s"
    )
    for name in ("before", "after", "drop"):
        free = without_trend(events, name)
        print(
            f"{name}: {free.mean() / 1e3:.1f} kPa, without drift"
            f" +- {free.std(ddof=2) / 1e3:.2f} kPa ({100 * free.std(ddof=2) / free.mean():.2f} %)"
        )
    print(f"coefficients: {events.before.mean() / PRESSURE:.3f} before,", end=" ")
    print(f"{events.after.mean() / PRESSURE:.3f} after")
    east, west = (events[events.end == end] for end in "EW")
    for name, unit, label in (("spread", 1e-6, "um"), ("speed", 1.0, "m/s")):
        chance = scipy.stats.mannwhitneyu(east[name], west[name]).pvalue
        print(
            f"{name} from E and W: {east[name].mean() / unit:.2f} +- {east[name].std() / unit:.2f}"
            f" and {west[name].mean() / unit:.2f} +- {west[name].std() / unit:.2f} {label},"
            f" p = {chance:.0e}"
        )
    line, error = drop_on_slip(events["drop"], events.slip)
    print(
        f"drop on slip: {line[0] / 1e9:.3f} +- {error[0] / 1e9:.3f} MPa/mm, intercept"
        f" {line[1] / 1e3:.1f} +- {error[1] / 1e3:.1f} kPa"
    )
    spread = events.spread * 1e6
    of_both = spread[events.end == "B"]
    print(f"scatter of slip: {spread.mean():.2f} +- {spread.sem():.2f} um,", end=" ")
    print(f"from both ends {of_both.mean():.2f} +- {of_both.std():.2f} um")
    both = scipy.stats.binomtest(len(east), len(east) + len(west)).pvalue
    print(f"from E {len(east)}, from W {len(west)}: p = {both:.2f} for equal chances;", end=" ")
    print(f"30 to 15 would be p = {scipy.stats.binomtest(30, 45).pvalue:.2f}")
    return events, peaks


def constrain(machine, events):
    """Print what each mean excess would need and give; return one row each."""
    measured = (events.end == "B").sum()
    low, high = scipy.stats.binomtest(measured, len(events)).proportion_ci()
    print(f"from both ends: {measured} of {len(events)}, {low:.2f} to {high:.2f} (95 %)")
    rows = []
    for excess, cv in itertools.product(EXCESS, CVS):
        strength = strength_of(excess, cv, 0.2)
        rate = rate_of(machine, strength, excess, events.before.mean())
        problem = rig(machine, rate=rate)
        found, slid = onsets(problem, strength)
        weaker = share_of_weaker_end(found)
        drop, slip, spread = of_model(problem, found, slid)
        line, error = drop_on_slip(drop, slip)
        row = {
            "excess": excess,
            "cv": cv,
            "critical_slip": excess / rate,
            "rate": rate,
            "scatter": float(found.critical_stress.std(ddof=1)),
            "arrests": 1.0 - slid.mean(),
            **{f"both{i}": np.mean(weaker > share) for i, share in enumerate(SHARES)},
            "spread": spread.mean(),
            "spread_error": spread.std(ddof=1),
            "slope": line[0],
            "slope_error": error[0],
            "intercept": line[1],
        }
        rows.append(row)
        print(
            f"excess {excess / 1e3:.0f} kPa +- {100 * cv:.0f} %:"
            f" d_c {1e6 * row['critical_slip']:.1f} um, W {rate / 1e9:.1f} GPa/m,"
            f" scatter {row['scatter'] / 1e3:.2f} kPa, arrests {row['arrests']:.2f}, both ends"
            f" {row['both0']:.2f}/{row['both1']:.2f}/{row['both2']:.2f}, slip scatter"
            f" {1e6 * row['spread']:.2f} um, drop on slip {row['slope'] / 1e9:.3f} +-"
            f" {row['slope_error'] / 1e9:.3f} MPa/mm, intercept {row['intercept'] / 1e3:.1f} kPa"
        )
    return pd.DataFrame(rows)


def product(machine, rate, excess):
    """Print that scatter and length of the local strength count by one product only."""
    for cv, length in ((0.5, 0.2), (0.25, 0.8), (0.7, 0.1)):
        found, _ = onsets(rig(machine, rate=rate), strength_of(excess, cv, length))
        whole = cv * excess * np.sqrt(length / LENGTH)
        print(
            f"local scatter {cv * excess / 1e3:.1f} kPa over {length:g} m, product"
            f" {whole / 1e3:.2f} kPa: peaks +- {float(found.critical_stress.std()) / 1e3:.2f} kPa"
        )


def infer(machine, peaks, rows):
    """Print what the peaks say of parameters that one would defend beforehand.

    Weakening rates are drawn near those that give the mean peak: others would have no weight.
    """
    rng = np.random.default_rng(2)
    count, samples = (20, 100) if QUICK else (400, 300)
    few, much = (rows[rows.cv == cv].set_index("excess").rate for cv in CVS)
    members = []
    for _ in range(count):
        excess, length = rng.uniform(EXCESS[0], EXCESS[-1]), 10.0 ** rng.uniform(-1.0, 0.0)
        whole = 10.0 ** rng.uniform(3.2, 3.8)  # Pa: local scatter times sqrt(length/LENGTH)
        cv = whole / excess * np.sqrt(LENGTH / length)
        weight = (cv * np.sqrt(length / 0.2) - CVS[0]) / (CVS[1] - CVS[0])
        rates = [np.interp(excess, some.index, some) for some in (few, much)]
        rate = max(rates[0] + weight * (rates[1] - rates[0]), 1e9) * np.exp(
            rng.uniform(-0.25, 0.25)
        )
        members.append(
            st.RandomInterface(
                strength=strength_of(excess, cv, length),
                weakening_rate=st.RandomField(
                    st.Lognormal(mean=rate, cv=1e-6), st.ExponentialSpectrum(1.0)
                ),
            )
        )
    found = st.infer(
        rig(machine, nodes=64), members, peaks, method=st.Equilibrium(), samples=samples
    )
    print(found)
    problem, strength = rig(machine, CENTRAL[0]), strength_of(CENTRAL[1], 0.5, 0.2)
    agree = st.statistics.agreement(onsets(problem, strength)[0], peaks)
    print(f"agreement of the central parameters: p = {agree.p_values['cramer_von_mises']:.2f}")


def predict(machine, rate, excess):
    """Print peaks of other set-ups, in which nothing is fitted any more."""
    strength = strength_of(excess, 0.5, 0.2)
    for what, changed in (
        ("the rig", {}),
        ("half as long", {"length": 0.5 * LENGTH}),
        ("pushed from the left only", {"side": "left"}),
        ("under a platen", {"drive": st.Platen(stiffness=machine)}),
        ("from rest without stress", {"start": 0.0}),
    ):
        problem = rig(machine, rate=rate, **changed)
        found, _ = onsets(problem, strength)
        peak, x = (
            found.critical_stress.to_numpy(),
            problem.interface.x / problem.interface.length,
        )
        most = x[found.slip.to_numpy().argmax(axis=1)]
        print(
            f"{what}: {peak.mean() / 1e3:.1f} +- {peak.std(ddof=1) / 1e3:.1f} kPa, most slip in the"
            f" left quarter {np.mean(most < 0.25):.2f}, in the right one {np.mean(most > 0.75):.2f}"
        )
        if "side" not in changed and "drive" not in changed:
            weaker = share_of_weaker_end(found, problem.interface.length)
            print(f"  from both ends {np.mean(weaker > SHARE):.2f}")


def draw_record(table, events, model):
    """Draw the record: stresses in time, and drop on slip beside the model's line."""
    fig, (left, right) = plt.subplots(1, 2, figsize=(PAGE, 2.6), width_ratios=(2, 1))
    for end, marker, name in (
        ("E", ">", "from E"),
        ("W", "<", "from W"),
        ("B", "D", "from both"),
    ):
        some = table[table.end == end]
        left.plot(some.time, some.before / 1e3, marker, color=ACCENT, ms=4, label=name)
        left.plot(some.time, some.after / 1e3, marker, color=QUIET, ms=3)
        right.plot(some.slip * 1e6, some["drop"] / 1e3, marker, color=ACCENT, ms=4)
    left.set(xlabel="time [s]", ylabel="mean shear stress [kPa]", ylim=(622, 692))
    left.text(150, 632, "after the event", color=QUIET)
    left.text(85, 664, "before the event", color=ACCENT)
    left.legend(loc="upper right", ncols=3)
    slips = np.linspace(25e-6, 45e-6, 2)
    line, _ = drop_on_slip(events["drop"], events.slip)
    right.plot(
        slips * 1e6, np.polyval(line, slips) / 1e3, color=ACCENT, label="fit to the record"
    )
    right.plot(slips * 1e6, np.polyval(model, slips) / 1e3, "--", color=INK, label="model")
    right.set(xlabel="slip [µm]", ylabel="stress drop [kPa]", xlim=(25, 46), ylim=(13, 30))
    right.legend(loc="upper left")
    for axes, letter in zip((left, right), "ab", strict=True):
        panel(axes, letter)
    return fig


def draw_rows(rows, events):
    """Draw what the critical slip changes, for both local scatters, beside the record."""
    fig, axes = plt.subplots(1, 3, figsize=(PAGE, 2.4), layout="constrained")
    for cv, color in zip(CVS, (INK, ACCENT), strict=True):
        some = rows[rows.cv == cv]
        x, label = 1e6 * some.critical_slip, f"model, scatter {100 * cv:.0f} %"
        axes[0].fill_between(x, some.both0, some.both2, color=color, alpha=0.15, lw=0)
        axes[0].plot(x, some.both1, "o-", color=color, ms=3)
        axes[1].plot(x, some.arrests, "o-", color=color, ms=3, label=label)
        axes[2].plot(x, 1e6 * some.spread, "o-", color=color, ms=3)
    measured = (events.end == "B").sum()
    low, high = scipy.stats.binomtest(measured, len(events)).proportion_ci()
    axes[0].axhspan(low, high, color=QUIET, alpha=0.3, lw=0)
    axes[0].set(ylabel="share that begins at both ends")
    axes[1].set(ylabel="share with an arrest before")
    axes[1].legend(loc="upper right")
    for end, at in (("E", 14.2), ("B", 14.9), ("W", 15.6)):
        some = 1e6 * events.spread[events.end == end]
        axes[2].errorbar(at, some.mean(), some.std(), fmt="s", color=QUIET, ms=4)
        axes[2].annotate(end, (at, some.mean()), xytext=(3, 3), textcoords="offset points")
    axes[2].set(ylabel="scatter of slip along the fault [µm]", ylim=(0, 2.6))
    for one, letter in zip(axes, "abc", strict=True):
        one.set(xlabel="critical slip [µm]", xlim=(2, 16.5))
        panel(one, letter)
    return fig


def main():
    """Print all, and draw the two figures into a folder if one is given."""
    warnings.simplefilter("ignore")
    table = read_table()
    events, peaks = record(table)
    ratio = (events["drop"] / events.slip).mean()
    machine, blocks = machine_of(ratio)
    for _ in range(2):  # slip before the rupture makes its drop over slip less than that of all
        problem = rig(machine, rate=CENTRAL[0])
        drop, slip, _ = of_model(problem, *onsets(problem, strength_of(CENTRAL[1], 0.5, 0.2)))
        machine, _ = machine_of(problem.blocks.relief * ratio / (drop.mean() / slip.mean()))
    print(f"drop over slip: {ratio / 1e9:.3f} MPa/mm")
    print(f"stiffness: blocks {blocks:.2e}, machine {machine:.2e} N/m")
    rows = constrain(machine, events)
    model = rows[(rows.excess == 30e3) & (rows.cv == 0.5)][["slope", "intercept"]].to_numpy()[0]
    product(machine, *CENTRAL)
    predict(machine, *CENTRAL)
    for folder in [name for name in sys.argv[1:] if not name.startswith("--")]:
        with paper_style():
            draw_record(table, events, model).savefig(Path(folder) / "stick_slips.png", dpi=200)
            draw_rows(rows, events).savefig(
                Path(folder) / "stick_slips_parameters.png", dpi=200
            )
    infer(machine, peaks, rows)


if __name__ == "__main__":
    main()
