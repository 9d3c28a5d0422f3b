"""Validation: fifty-six stick-slips of a fault of four metres, beside the model of its rig.

The record is `data/stick_slips/events.csv`, measured by Okubo, Yamashita and Fukuyama (see the
README there). Prints every number of docs/evidence/laboratory-fault.md: first what
disagrees whatever the parameters, then what the record fixes of them, what
holds without a fit, and a prediction.

Run: ``python validation/stick_slips.py [FIGURES] [--quick]``; two to four minutes on two cores.
"""

import itertools
import sys
import warnings
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd
import scipy.stats
from scipy.optimize import brentq
from scipy.special import comb

import stiction as st
from stiction.methods.dynamics.specimens import RuptureSearch
from stiction.methods.equilibrium.patches import line_patch
from stiction.methods.equilibrium.solver import follow_to_sliding, make_search, sample_of
from stiction.plot.style import ACCENT, INK, PAGE, QUIET, paper_style

TABLE = Path(__file__).parent / "data" / "stick_slips" / "events.csv"
LENGTH, HEIGHT, THICKNESS = 4.0, 0.2, 0.1  # m, of each block
PRESSURE, RESIDUAL = 2e6, 637e3  # Pa, as measured
GABBRO = {"youngs_modulus": 96e9, "poisson_ratio": 0.246, "density": 2980.0}
EXCESS = (22e3, 24e3, 26e3, 30e3, 35e3, 45e3)  # mean strength above the residual, Pa
CENTRAL = (6.5e9, 32e3)
"""Weakening rate (Pa/m) and mean excess that give the mean peak and the share of both ends."""
CVS = (0.2, 0.5)
"""Its variation from place to place, over a correlation length of 0.2 m."""
SENSORS = 0.19 + 0.24 * np.arange(16)
"""Places of the slip sensors, m: in the authors' p03_save_eventdata.m, less the first 0.08 m."""
SHARE = 0.25
"""Share of the weaker end in the unstable patches above which a rupture is one of both ends."""
SHARES = (1.0 / 3.0, SHARE, 1.0 / 6.0)
QUICK = "--quick" in sys.argv
SAMPLES, NODES = (40, 64) if QUICK else (400, 128)
EQUILIBRIUM = st.Equilibrium(slip=True)
INERTIA = (24e3, 35e3, 45e3)
"""Mean excesses that are computed with inertia, Pa."""
FRONTS, CROSSED = (0.05, 0.001), 0.25
"""A front is where this share of the fall of strength is lost; it has a speed over so many m."""
CYCLES, FINE = (4, 64) if QUICK else (24, 256)
"""Cycles with inertia for each excess, and nodes."""


def read_table():
    """Return the events: stresses in Pa, slips in m, without the units in the headings."""
    table = pd.read_csv(TABLE)
    names = ["event", "time", "end", "speed", "before", "after", "drop", "slip", "spread"]
    table.columns = names
    table[["before", "after", "drop"]] *= 1e6
    table[["slip", "spread"]] *= 1e-3
    return table


def error_of_slope(x, y, lags=8):
    """Return the standard error of a slope with correlated residuals (Newey and West, 1987)."""
    x = x - x.mean()
    score = x * (y - np.polyval(np.polyfit(x, y, 1), x))
    total = score @ score
    for lag in range(1, lags + 1):
        total += 2.0 * (1.0 - lag / (lags + 1)) * score[lag:] @ score[:-lag]
    return np.sqrt(total) / (x @ x)


def without_trend(events, name):
    """Return a column less its straight line in time, about its mean."""
    line = np.polyval(np.polyfit(events.time, events[name], 1), events.time)
    return (events[name] - line + events[name].mean()).to_numpy()


def rig(machine, weakening_rate=5e9, length=LENGTH, start=RESIDUAL, nodes=NODES):
    """Return the rig as a problem: a reloaded interface rests at its residual strength."""
    drive = st.Pusher(height=0.5 * HEIGHT, width=HEIGHT, side="both", stiffness=machine)
    return st.Problem(
        solid=st.Solid(**GABBRO, plane="stress"),
        interface=st.Interface(length=length, nodes=int(nodes * length / LENGTH)),
        friction=st.LinearWeakening(weakening_rate=weakening_rate, residual_strength=RESIDUAL),
        specimen=st.Blocks(height=HEIGHT, thickness=THICKNESS, drive=drive),
        load=st.Load(normal_pressure=PRESSURE, initial_stress=start),
    )


def machine_of(ratio):
    """Return the stiffness of the machine, N/m, from stress drop over slip (Pa/m).

    The drop of a rigid translation is h times the slip, h = k C/(k + C)/(2 L) with the stiffness
    C of a block and k of the machine as a block sees it, both per depth (docs/guide/specimens.md).
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


def weakening_rate_of(machine, strength, excess, peak):
    """Return the weakening rate (Pa/m) with which the mean peak is the measured one."""

    def above(log_slip):
        problem = rig(machine, weakening_rate=excess / 10.0**log_slip)
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
    at_sensors = [np.interp(SENSORS, problem.interface.x, one) for one in before]
    spread = np.std(at_sensors, axis=1, ddof=1)
    return drop, whole - before.mean(axis=1), spread


def memory(table):
    """Print how often an end follows itself, beside an order without memory."""
    ends = table.end.to_numpy()
    for end in "EW":
        these = ends == end
        found, count = np.sum(these[1:] & these[:-1]), these.sum()
        expected = count * (count - 1) / ends.size
        print(f"{end} after {end}: {found} times, {expected:.1f} in random order")
    chance = comb(ends.size - count + 1, count) / comb(ends.size, count)
    print(f"chance that none of the {count} W follows another: p = {chance:.0e}")


def record(table):
    """Print what the table says by itself, and return the events after the first."""
    events = table.iloc[1:]
    peaks = without_trend(events, "before")
    print(f"{len(table)} events: " + str(table.end.value_counts().to_dict()))
    memory(table)
    first = table.before[0] / events.before.mean() - 1.0
    print(f"first event: {100 * first:.1f} % above the mean of the others,", end=" ")
    print(f"{(table.before[0] - peaks.mean()) / peaks.std(ddof=2):.0f} standard deviations")
    time, before = events.time.to_numpy(), events.before.to_numpy()
    slope, error = 0.1 * np.polyfit(time, before, 1)[0], 0.1 * error_of_slope(time, before)
    print(f"drift of the peaks: {slope:.1f} +- {error:.1f} kPa in 100 s")
    left = without_trend(events, "after")[:-1]
    kept = np.corrcoef(peaks[1:], left)[0, 1]
    print(f"peaks on the stress that the last event left: r = {kept:.2f}")
    print(f"peaks without drift: {peaks.mean() / 1e3:.1f} +- {peaks.std(ddof=2) / 1e3:.2f} kPa")
    east, west = (events[events.end == end] for end in "EW")
    for name in ("spread", "speed"):
        chance = scipy.stats.mannwhitneyu(east[name], west[name]).pvalue
        print(f"{name} from E and W: p = {chance:.0e}")
    print(f"speed from E {east.speed.mean():.0f} m/s, from W {west.speed.mean():.0f} m/s")
    line, error = drop_on_slip(events["drop"], events.slip)
    print(f"drop on slip: {line[0] / 1e9:.3f} +- {error[0] / 1e9:.3f} MPa/mm,", end=" ")
    print(f"intercept {line[1] / 1e3:.1f} +- {error[1] / 1e3:.1f} kPa")
    for name, some in (("all", events), *events.groupby("end")):
        spread = 1e6 * some.spread
        print(f"scatter of slip, {name}: {spread.mean():.2f} +- {spread.sem():.2f} um")
    return events, peaks


def share_of_both(events):
    """Return how many events are listed as from both ends, and the 95 % interval of their share."""
    measured = (events.end == "B").sum()
    return measured, *scipy.stats.binomtest(measured, len(events)).proportion_ci()


def constrain(machine, events):
    """Print what each mean excess would need and give; return one row each."""
    measured, low, high = share_of_both(events)
    print(f"from both ends: {measured} of {len(events)}, {low:.2f} to {high:.2f} (95 %)")
    rows = []
    for excess, cv in itertools.product(EXCESS, CVS):
        strength = strength_of(excess, cv, 0.2)
        weakening_rate = weakening_rate_of(machine, strength, excess, events.before.mean())
        problem = rig(machine, weakening_rate=weakening_rate)
        found, slid = onsets(problem, strength)
        weaker = share_of_weaker_end(found)
        drop, slip, spread = of_model(problem, found, slid)
        line, _ = drop_on_slip(drop, slip)
        row = {
            "excess": excess,
            "cv": cv,
            "critical_slip": excess / weakening_rate,
            "weakening_rate": weakening_rate,
            "scatter": float(found.critical_stress.std(ddof=1)),
            "arrests": 1.0 - slid.mean(),
            **{f"both{i}": np.mean(weaker > share) for i, share in enumerate(SHARES)},
            "spread": spread.mean(),
            "slope": line[0],
            "intercept": line[1],
        }
        rows.append(row)
        print(
            f"excess {excess / 1e3:.0f} kPa +- {100 * cv:.0f} %:"
            f" d_c {1e6 * row['critical_slip']:.1f} um, W {weakening_rate / 1e9:.1f} GPa/m,"
            f" scatter {row['scatter'] / 1e3:.2f} kPa, arrests {row['arrests']:.2f}, both ends"
            f" {row['both0']:.2f}/{row['both1']:.2f}/{row['both2']:.2f}, slip scatter"
            f" {1e6 * row['spread']:.2f} um, intercept {row['intercept'] / 1e3:.1f} kPa"
        )
    rows = pd.DataFrame(rows)
    for cv, (i, share) in itertools.product(CVS, enumerate(SHARES)):
        some = rows[rows.cv == cv][::-1]  # by critical slip, with which the share rises
        rising = np.maximum.accumulate(some[f"both{i}"]) + 1e-9 * np.arange(len(some))
        slips = np.interp((low, high), rising, some.critical_slip)
        weakening_rates = np.interp((low, high), rising, some.weakening_rate)
        print(
            f"measured share with {100 * cv:.0f} % and a weaker end of {share:.2f}: d_c"
            f" {1e6 * slips[0]:.1f} to {1e6 * slips[1]:.1f} um, W {weakening_rates[1] / 1e9:.1f} to"
            f" {weakening_rates[0] / 1e9:.1f} GPa/m"
        )
    return rows


def infer(machine, table, peaks, rows):
    """Print what the peaks say of parameters that one would defend beforehand.

    Weakening rates are drawn near those that give the mean peak: others would have no weight. The
    weight of a draw is the likelihood of the peaks, by a kernel density of simulated peaks.
    """
    rng = np.random.default_rng(2)
    count, samples = (20, 100) if QUICK else (400, 300)
    few, much = (rows[rows.cv == cv].set_index("excess").weakening_rate for cv in CVS)
    draws, likelihoods = [], []
    for _ in range(count):
        excess, length = rng.uniform(EXCESS[0], EXCESS[-1]), 10.0 ** rng.uniform(-1.0, 0.0)
        whole = 10.0 ** rng.uniform(3.2, 3.8)  # Pa: local scatter times sqrt(length/LENGTH)
        cv = whole / excess * np.sqrt(LENGTH / length)
        weight = (cv * np.sqrt(length / 0.2) - CVS[0]) / (CVS[1] - CVS[0])
        low, high = (np.interp(excess, some.index, some) for some in (few, much))
        weakening_rate = max(low + weight * (high - low), 1e9) * np.exp(
            rng.uniform(-0.25, 0.25)
        )
        problem = rig(machine, weakening_rate, nodes=64)
        simulated = onsets(problem, strength_of(excess, cv, length), samples)[0].critical_stress
        density = scipy.stats.gaussian_kde(simulated)
        likelihoods.append(np.log(density(peaks) + 1e-300).sum())
        draws.append((length, weakening_rate / 1e9))
    weights = np.exp(np.array(likelihoods) - max(likelihoods))
    for name, values in zip(("length (m)", "W (GPa/m)"), np.transpose(draws), strict=True):
        order = np.argsort(values)
        shares = np.cumsum(weights[order]) / weights.sum()
        after, before = (
            np.interp((0.05, 0.95), shares, values[order]),
            np.quantile(values, (0.05, 0.95)),
        )
        print(
            f"{name}: {after[0]:.2f} to {after[1]:.2f}, before {before[0]:.2f} to {before[1]:.2f}"
        )
    problem, strength = rig(machine, CENTRAL[0]), strength_of(CENTRAL[1], 0.5, 0.2)
    found, _ = onsets(problem, strength)
    for name, some in (("without drift", peaks), ("as measured", table.before)):
        agree = st.statistics.agreement(found, np.asarray(some), unit="N")
        print(f"agreement, {name}: p = {agree.p_values['cramer_von_mises']:.3f}")


def predict(machine, weakening_rate, excess, cv=0.5):
    """Print peaks of other set-ups, in which nothing is fitted any more."""
    print(f"W {weakening_rate / 1e9:.1f} GPa/m, excess {excess / 1e3:.0f} kPa +- {cv:.0%}:")
    set_ups = {"half as long": {"length": 2.0}, "from rest without stress": {"start": 0.0}}
    for name, changed in set_ups.items():
        problem = rig(machine, weakening_rate=weakening_rate, **changed)
        found, _ = onsets(problem, strength_of(excess, cv, 0.2))
        peak = found.critical_stress.to_numpy()
        weaker = share_of_weaker_end(found, problem.interface.length)
        print(
            f"  {name}: {peak.mean() / 1e3:.1f} +- {peak.std(ddof=1) / 1e3:.1f} kPa,"
            f" from both ends {np.mean(weaker > SHARE):.2f}"
        )


def last_events(problem, strength, method=None):
    """Return the event that crosses the interface in each cycle, one row each.

    With a `Rupture` as method waves run on until all is at rest; without, until equilibrium.
    `slope` is that of a line through the times at which a front arrives, s/m.
    """
    search = RuptureSearch(problem, method) if method else make_search(problem)
    x, rows = problem.interface.x, []
    for one in strength.sample(problem.interface, samples=CYCLES, seed=1):
        sample = sample_of(problem.sample(one), search.pieces, 0)
        path = follow_to_sliding(search, sample)
        before, grows = path.last.slip, path.last.direction
        slope = crossed = np.nan
        if method:
            event, moved = search.event(sample, path.last), np.inf
            while moved > 1e-4 * (event.waves.slip - before).max():
                slip = event.waves.slip.copy()
                event.take_steps(event.mesh.window, ends=False)
                moved = (event.waves.slip - slip).max()
            slip, arrival = event.waves.slip, event.waves.arrival
            came = arrival > 0.0  # elsewhere the front had come before
            crossed = came.sum() * problem.interface.spacing
            if crossed > CROSSED:
                slope = np.polyfit(x[came], arrival[came], 1)[0]
        else:  # all of it is at its residual strength
            slip = np.full_like(before, path.last.load / problem.blocks.relief)
        row = {
            "arrests": len(path.events),
            "critical_position": line_patch(grows, problem.interface).centre[0],
            "most": x[before.argmax()],
            "slip": (slip - before).mean(),
            "drop": problem.relief(slip) - problem.relief(before),
            "spread": np.interp(SENSORS, x, slip - before).std(ddof=1),
            "crossed": crossed,
            "speed": 1.0 / abs(slope),
        }
        rows.append(row)
    found = pd.DataFrame(rows)
    found["both"] = share_of_weaker_end(found) > SHARE
    return found


def inertia(machine, events, rows):
    """Print the event that crosses the interface, measured and with and without inertia."""
    for end in "EW":
        speed = events.speed[events.end == end]
        print(
            f"speed from {end}: median {speed.median():.0f} +- {error_of_median(speed):.0f} m/s,"
            f" {speed.min():.0f} to {speed.max():.0f}"
        )
    print(f"measured: slip {mean_of(1e6 * events.slip, 1)} um, drop", end=" ")
    print(f"{mean_of(events['drop'] / 1e3, 1)} kPa")
    for row in rows[(rows.cv == CVS[1]) & rows.excess.isin(INERTIA)].itertuples():
        problem = rig(machine, weakening_rate=row.weakening_rate, nodes=FINE)
        strength = strength_of(row.excess, row.cv, 0.2)
        print(f"excess {row.excess / 1e3:.0f} kPa, {CYCLES} cycles on {FINE} nodes:")
        print("  without inertia: " + described(last_events(problem, strength)))
        for front in FRONTS:
            found = last_events(problem, strength, st.Rupture(arrival=front))
            if front == FRONTS[0]:
                print("  with inertia: " + described(found))
            speed = found.speed[~found.both].dropna()
            print(
                f"  front at {100 * front:g} % lost: crosses {mean_of(found.crossed)} m, has a"
                f" speed in {speed.size}",
                end="",
            )
            if speed.size > 1:
                low, median, high = np.quantile(speed, [0.1, 0.5, 0.9])
                print(
                    f", median {median:.0f} +- {error_of_median(speed):.0f} m/s, {low:.0f} to"
                    f" {high:.0f} (10 and 90 %), least {speed.min():.0f}",
                    end="",
                )
            print(f"; c_R {problem.solid.rayleigh_wave_speed:.0f} m/s")


def described(found):
    """Return the means of some last events, with standard errors, as text."""
    most = np.abs(found.most / LENGTH - 0.5) > 0.25
    arrests = found.arrests.sum()
    return (
        f"slip {mean_of(1e6 * found.slip, 1)} um, drop {mean_of(found['drop'] / 1e3, 1)} kPa, drop"
        f" over slip {mean_of(found['drop'] / found.slip / 1e9, 3)} MPa/mm, scatter of slip"
        f" {mean_of(1e6 * found.spread)} um, from both ends {mean_of(found.both)}, most slip before"
        f" near an end {most.mean():.2f}, cycles with an arrest {mean_of(found.arrests > 0)}, share"
        f" of events that arrest {arrests / (arrests + len(found)):.2f}"
    )


def mean_of(values, digits=2):
    """Return a mean with its standard error, as text."""
    values = np.asarray(values, dtype=float)
    return f"{values.mean():.{digits}f} +- {scipy.stats.sem(values):.{digits}f}"


def error_of_median(values):
    """Return the standard error of a median, by the bootstrap."""
    found = scipy.stats.bootstrap((values,), np.median, n_resamples=1000, rng=1)
    return found.standard_error


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
        axes.set_title(f"({letter})", loc="left", weight="bold")
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
    _, low, high = share_of_both(events)
    axes[0].axhspan(low, high, color=QUIET, alpha=0.3, lw=0)
    axes[0].text(16, 0.5 * (low + high), "measured, 95 %", ha="right", va="center")
    axes[0].set(ylabel="share that begins at both ends")
    axes[1].set(ylabel="share with an arrest before")
    axes[1].legend(loc="upper right")
    for end, name in (("E", "measured, from E"), ("B", "from both"), ("W", "from W")):
        some = 1e6 * events.spread[events.end == end]
        low, high = some.mean() - some.sem(), some.mean() + some.sem()
        axes[2].axhspan(low, high, color=QUIET, alpha=0.3, lw=0)
        axes[2].text(16, some.mean(), name, ha="right", va="center")
    axes[2].set(ylabel="scatter of slip along the fault [µm]", ylim=(0, 2.6))
    for one, letter in zip(axes, "abc", strict=True):
        one.set(xlabel="critical slip [µm]", xlim=(2, 16.5))
        one.set_title(f"({letter})", loc="left", weight="bold")
    return fig


def main():
    """Print all, and draw the two figures into a folder if one is given."""
    folders = [Path(name) for name in sys.argv[1:] if name != "--quick"]
    for folder in folders:
        if not folder.is_dir():
            sys.exit(f"{folder}: no such folder; give one for the figures, --quick, or nothing")
    warnings.simplefilter("ignore")
    table = read_table()
    events, peaks = record(table)
    ratio = (events["drop"] / events.slip).mean()
    machine, blocks = machine_of(ratio)
    for _ in range(2):  # slip before the rupture makes its drop over slip less than that of all
        problem = rig(machine, weakening_rate=CENTRAL[0])
        drop, slip, _ = of_model(problem, *onsets(problem, strength_of(CENTRAL[1], 0.5, 0.2)))
        machine, _ = machine_of(problem.blocks.relief * ratio / (drop.mean() / slip.mean()))
    print(f"drop over slip: {ratio / 1e9:.3f} MPa/mm")
    print(f"stiffness: blocks {blocks:.2e}, machine {machine:.2e} N/m")
    rows = constrain(machine, events)
    model = rows[(rows.excess == 30e3) & (rows.cv == 0.5)][["slope", "intercept"]].to_numpy()[0]
    predict(machine, *CENTRAL)
    for row in rows[rows.excess.isin((30e3, 45e3))].itertuples():
        predict(machine, row.weakening_rate, row.excess, row.cv)
    inertia(machine, events, rows)
    for folder in folders:
        with paper_style():
            draw_record(table, events, model).savefig(folder / "stick_slips.png", dpi=200)
            draw_rows(rows, events).savefig(folder / "stick_slips_parameters.png", dpi=200)
    infer(machine, table, peaks, rows)


if __name__ == "__main__":
    main()
