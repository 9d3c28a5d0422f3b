"""The command line: parse, call, print.

Commands import numerics late, so that help is quick. Public names are imported on first use.
"""

import functools
import inspect
import io
import logging
import os
import re
import signal
import sys
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any, Literal

import typer
from typer import Argument, Option
from typer.models import OptionInfo

import stiction as st
from stiction.base.errors import InputError, RunError, collect_warnings, printable, unknown_name
from stiction.base.progress import Meter, duration, interrupted
from stiction.problem.resolution import nodes_in_nucleation_length

MAX_SHOWN_LINES = 12
"""Points, failures or damaged chunks in a list."""
RUPTURE = (
    "critical_stress", "stress_drop", "onset_time", "critical_position", "median_rupture_speed"
)  # fmt: skip
"""Printed variables of a rupture."""

StudyFile = Annotated[
    Path, Argument(metavar="STUDY.toml", help="`stiction example` writes one to start from.")
]
RunPath = Annotated[Path, Argument(metavar="RUN", help="Folder of a run.")]
Workers = Annotated[int | None, Option(help="Threads; all cores by default.", min=1)]
Scheduler = Annotated[
    str | None,
    Option(
        metavar="ADDRESS",
        help="Address of a Dask scheduler, such as tls://host:8786. Whoever controls it or its"
        " workers can run code here.",
    ),
]
Part = Annotated[
    str | None, Option(metavar="K/N", help="Compute the K-th of N parts, into one folder RUN.")
]
COMPARED_SAMPLES = 1_000
"""Samples with which measured peaks are compared."""
LOADING_RATE = 2e7
"""Loading rate of a rupture, Pa/s, if the study has another method."""


# -- what commands share -------------------------------------------------------------------------


def echo(text: Any = "", *, err: bool = False) -> None:
    """Print text that may come from a file. Escape characters that control a terminal."""
    typer.echo(printable(str(text)), err=err)


def in_options(text: str, command: Callable[..., Any]) -> str:
    """Return a message in the words of the command line: ``--gaps fill`` for ``gaps="fill"``."""
    methods = r"(?:\bmethod=)?st\.(LocalCriterion|Equilibrium|Rupture)\([^)]*\)"
    text = re.sub(methods, _method, text)
    for name, parameter in inspect.signature(command, eval_str=True).parameters.items():
        extras = getattr(parameter.annotation, "__metadata__", ())
        if any(isinstance(extra, OptionInfo) for extra in extras):
            option, argument = f"--{name.replace('_', '-')}", rf"(?<![\w.-]){name}"
            text = re.sub(rf"{argument}=(True\b|\.\.\.)", option, text)
            value = r"[\"']?([^\s\"',;)]*)[\"']?(?: to st\.\w+(?: or st\.\w+)*)?"
            text = re.sub(rf"{argument}={value}", rf"{option} \1", text)
            text = re.sub(rf"^{name}(?=:| must)", option, text)
    return text


def _method(match: re.Match[str]) -> str:
    return f"the method {re.sub('(?<!^)(?=[A-Z])', '_', match[1]).lower()}"


def _show_some(texts: Sequence[Any], prefix: str, *, err: bool = False) -> None:
    for text in texts[:MAX_SHOWN_LINES]:
        echo(f"{prefix}{text}", err=err)
    if len(texts) > MAX_SHOWN_LINES:
        echo(f"{prefix}and {len(texts) - MAX_SHOWN_LINES} more", err=err)


def _ignore_local_style() -> None:
    """Ignore a matplotlibrc in the current folder, because it may come from a stranger."""
    import matplotlib

    if Path(matplotlib.matplotlib_fname()).resolve().parent == Path.cwd():
        matplotlib.rcdefaults()
        matplotlib.use("agg")
        warnings.warn("matplotlibrc: this file in the current folder is not used", stacklevel=1)


def _save_figure(axes: Any, path: Path) -> None:
    from stiction.base.files import write_whole

    for suffix in ("png", "pdf"):
        save = functools.partial(axes.figure.savefig, format=suffix, dpi=220)
        write_whole(path.with_suffix(f".{suffix}"), save)


# -- studies and runs ----------------------------------------------------------------------------


def _interrupt(*_: object) -> None:
    interrupted.set()
    raise KeyboardInterrupt


@contextmanager
def _resumable(out: Path) -> Iterator[None]:
    """Let an interruption end a run as Ctrl-C does, so that stored results are kept."""
    signal.signal(signal.SIGTERM, _interrupt)  # of a batch system
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored
        signal.signal(signal.SIGINT, _interrupt)
    try:
        yield
        if interrupted.is_set():
            raise KeyboardInterrupt
    except KeyboardInterrupt:
        echo(f"interrupted: results are in {out}. Rerun the command to resume", err=True)
        raise typer.Exit(130) from None
    finally:
        interrupted.clear()


@contextmanager
def _executor(scheduler: str | None) -> Iterator[Any]:
    """Yield the executor for a Dask scheduler, or None."""
    if scheduler is None:
        yield None
        return
    try:
        from distributed import Client

        client = Client(scheduler)
    except (ImportError, OSError, ValueError, TypeError) as error:
        raise InputError(f"--scheduler: {scheduler} cannot be reached: {error}") from None
    with client:
        yield client.get_executor(pure=False)


def run(
    study: StudyFile,
    out: Annotated[Path, Option(metavar="RUN", help="Folder in which samples are stored.")],
    workers: Workers = None,
    scheduler: Scheduler = None,
    part: Part = None,
    pilot: Annotated[bool, Option(help="Compare some samples with the exact onset.")] = True,
) -> None:
    """Run the study in a file, or the missing part of it.

    Rerunning the command resumes an interrupted run, computes failed samples
    again, and adds samples if `samples` was raised. Results do not depend on
    workers, machines or interruptions.

    The exit code is 0 if the run is complete, 1 if samples failed or the run
    could not continue, 2 if the study or the command has errors, and 130 after an
    interruption.

    \b
    Examples:
      stiction run study.toml --out run
      stiction run study.toml --out run --part 3/100
    """
    import pandas as pd

    loaded = st.Study.from_toml(study)
    with _resumable(out), _executor(scheduler) as executor:
        result = loaded.run(out=out, workers=workers, executor=executor, part=part, pilot=pilot)
    from stiction.cli.report import Page, add_tables  # matplotlib, once the samples are stored

    page = Page("")
    add_tables(page, result, loaded.axes)
    for table in page.parts:
        rows = pd.DataFrame(table["rows"], columns=table["columns"])
        echo(f"{table['title']}\n{rows.to_string(index=False, max_rows=48)}")
    if (state := _state_of(out, part)).failures:
        echo(f"{len(state.failures)} samples failed; the same command retries:", err=True)
        _show_some(state.failures, "  ", err=True)
        raise typer.Exit(1)


def status(run: RunPath) -> None:
    """Show the completed, failed and damaged parts of a run.

    Checksums find damage, not forgery. The exit code is 0 if the run is complete,
    1 if samples are missing, failed or damaged or the run cannot be read, and 2
    if links, pipes or folders lie in place of its files.

    \b
    Examples:
      stiction status run
    """
    stored = st.open_run(run)
    state, points = stored.status(), stored.study.points
    samples = state.samples // len(points)
    echo(f"{run}: {' '.join(stored.study.title.split())}".removesuffix(": "))
    share = 100.0 * state.done / state.samples
    echo(f"  {stored.counted:11s} {state.done} of {state.samples} ({share:.1f} %)")
    echo(f"  chunks      {state.chunks}")
    echo(f"  computed    {duration(state.seconds)} of one core")
    counts = zip(points, state.done_by_point, strict=True)
    behind = [f"{point}: {done} of {samples}" for point, done in counts if done < samples]
    _show_some(behind if len(points) > 1 else [], "  ")
    _show_some(state.damaged, "  damaged     ")
    if state.damaged:
        echo("  run the study again to repair this")
    else:
        echo("  undamaged   all stored chunks match their checksums")
    if state.failures:
        echo(f"  failed      {len(state.failures)}; `stiction run` computes them again:")
        _show_some(state.failures, "    ")
    if state.damaged or not state.complete:
        raise typer.Exit(1)


def export(
    run: RunPath,
    out: Annotated[Path, Argument(metavar="RESULT", help=".nc (NetCDF) or .csv.")],
    partial: Annotated[
        bool, Option("--partial", help="Write the stored part of an incomplete run.")
    ] = False,
    events: Annotated[
        bool, Option("--events", help="Write a table (.csv) with one row for each event.")
    ] = False,
) -> None:
    """Write a run as a file over the sweep and the samples.

    A table (.csv) has a row for each sample and columns named `name (unit)`. It
    leaves out profiles along the interface and events; --events writes the events
    instead. If samples are missing, no file is written and the exit code is 1.
    With --partial, missing samples are NaN.

    \b
    Examples:
      stiction export run result.nc
      stiction export run samples.csv --partial
      stiction export run events.csv --events
    """
    stored = st.open_run(run)
    stored.export(out, partial=partial, events=events)
    state = stored.status()
    rest = "" if state.complete else "; the others are missing"
    echo(f"{state.done} of {state.samples} {stored.counted} written to {out}{rest}")


def report(
    run: RunPath,
    out: Annotated[Path | None, Option(help="HTML file; RUN/report.html by default.")] = None,
) -> None:
    """Write a self-contained HTML page: figures, tables, failures, the study and versions.

    The exit code is 0 if the run is complete. It is 1 if samples are missing from
    the page.

    \b
    Examples:
      stiction report run --out page.html
    """
    _ignore_local_style()
    from stiction.cli.report import write_report

    path, stored = out or run / "report.html", st.open_run(run)
    with Meter("writing the report"):
        write_report(stored, path)
    echo(f"report: {path}")
    state = stored.status()
    if not state.complete:
        echo(f"it shows {state.done} of {state.samples} {stored.counted}", err=True)
        raise typer.Exit(1)


# -- what a study would do -----------------------------------------------------------------------


def example() -> None:
    """Print a study to start from.

    \b
    Examples:
      stiction example > study.toml
    """
    from importlib.resources import files

    echo(files("stiction.cli").joinpath("example.toml").read_text("utf-8").rstrip("\n"))


def check(study: StudyFile) -> None:
    """Check a study file as `run` does, and estimate time and size.

    All errors appear at once, with the warnings of a run before its first sample.
    Files outside the folder of the study are listed, because their numbers go
    into the run.

    \b
    Examples:
      stiction check study.toml
    """
    from stiction.ensemble.monte_carlo import check_run
    from stiction.study.study import read_with_files

    with Meter("checking the study"):
        loaded, files = read_with_files(study)
        check_run(loaded.experiments)
        lines = description(loaded) | _cost(loaded)
    echo(f"{study}: valid" + (f", {loaded.title!r}" if loaded.title else ""))
    for name, text in lines.items():
        echo(f"  {name:20s} {text}")
    folder = study.resolve().parent
    for file in dict.fromkeys(path.resolve() for path in files):
        if not file.is_relative_to(folder):
            echo(f"  {'file outside':20s} {file}")


def description(study: Any) -> dict[str, str]:
    """Return a description of a study in a few titled lines."""
    import pandas as pd

    from stiction.ensemble.dataset import distinct

    points, ensemble = study.experiments, study.ensemble
    samples = f"{ensemble.samples} (seed {ensemble.seed})"
    if study.sweep:
        samples += f" at each of {len(points)} points: {len(points) * ensemble.samples} in all"
    different = distinct(points, "problem", "random", "method")
    methods = ", ".join(dict.fromkeys(point.method.label for point in different))
    lines = {"method": methods, "samples": samples}
    for number, (dim, coordinates) in enumerate(study.axes.items(), start=1):
        keys = " with ".join(variable.long_name for _, variable in coordinates.values())
        values, variable = coordinates[dim]
        unit = f" {variable.units}".removesuffix(" 1")
        text = f"{keys}: {len(values)} values, {values[0]} to {values[-1]}{unit}"
        lines[f"axis {number}"] = text
    pairs = [(point.problem, member) for point in different for member in point.random.members]
    for (title, unit), column in pd.DataFrame([_numbers(*pair) for pair in pairs]).items():
        ends = dict.fromkeys(f"{value:.5g}" for value in (column.min(), column.max()))
        lines[title] = f"{' to '.join(ends)} {unit}".rstrip()
    return lines


def _numbers(problem: Any, random: Any) -> dict[tuple[str, str], float]:
    """Return key numbers for a point and its random properties, with titles and units."""
    field = random.strength
    unit = "Pa" if field.of is None else "(friction coefficient)"
    numbers = {
        ("mean strength", unit): field.mean,
        ("standard deviation", unit): field.standard_deviation,
        ("correlation length", "m (to 1/e)"): field.efolding_length(),
    }
    W = problem.friction.uniform_weakening_rate
    if W is None:  # the nucleation length varies along the interface
        return numbers
    numbers["nucleation length", "m"] = problem.nucleation_length
    numbers["nodes in h_n", ""] = min(nodes_in_nucleation_length(problem, W))
    return numbers


def _cost(study: Any) -> dict[str, str]:
    """Return the approximate computing time for a study, and the size of its result."""
    from stiction.ensemble.batches import usable_cores

    points, samples, cores = study.experiments, study.ensemble.samples, usable_cores()
    costs = [point.seconds for point in points]
    seconds, size = sum(costs) * samples, sum(point.sample_bytes for point in points) * samples
    ends = " to ".join(dict.fromkeys((duration(min(costs)), duration(max(costs)))))
    return {
        "time": f"about {duration(seconds)} on one core, {duration(seconds / cores)} on the {cores}"
        f" here ({ends} a sample), to a factor of three",
        "size": f"about {size / 1e6:.3g} MB",
    }


# -- one interface -------------------------------------------------------------------------------


def onset(
    study: StudyFile,
    strength: Annotated[Path, Option(metavar="PROFILE", help="File of the peak strength.")],
    method: Annotated[list[str] | None, Option(help="Only this method (repeatable).")] = None,
    unit: Annotated[
        str | None, Option(help="Unit of the values in PROFILE, such as MPa.")
    ] = None,
    x_unit: Annotated[str | None, Option(help="Unit of x in PROFILE, such as mm.")] = None,
    value: Annotated[str | None, Option(help="Column of the values: name or number.")] = None,
    x: Annotated[str | None, Option(help="Column of x: name, or number from 0.")] = None,
    quantity: Annotated[
        Literal["strength", "friction_coefficient"],
        Option(help="Content of PROFILE. Coefficients need a normal pressure."),
    ] = "strength",
    interpolate: Annotated[bool, Option("--interpolate", help="Interpolate to nodes.")] = False,
    gaps: Annotated[Literal["refuse", "fill"], Option(help="Missing values.")] = "refuse",
    missing: Annotated[
        list[str] | None,
        Option(help="Number or word for a missing value, such as -9999 (repeatable)."),
    ] = None,
    decimal: Annotated[Literal[".", ","] | None, Option(help="Decimal mark.")] = None,
    skip: Annotated[int, Option(min=0, help="Lines above the headings.")] = 0,
    sheet: Annotated[str, Option(help="Sheet of a workbook: name, or number from 0.")] = "0",
    record: Annotated[int | None, Option(min=0, help="Number of the record, from 0.")] = None,
    offset: Annotated[
        str, Option(help="Added to x, in m; or 'centre' for the centre of the interface.")
    ] = "0",
) -> None:
    """Compute the load and position at which an interface of given strength begins to slide.

    The study file needs the problem only. PROFILE is .npy, text (.csv, .txt, ...)
    or NetCDF, with or without x. On a plane it is an .npy file of shape (nx, ny)
    or a map. Values are in Pa and m unless the file states units, such as 'x
    (mm), strength (MPa)'. Every applicable method is used. The method of the
    study keeps its options. Other methods have their defaults, and `rupture` has
    a loading rate of 2e7 Pa/s.

    \b
    Examples:
      stiction onset study.toml --strength profile.csv --unit MPa --x-unit mm
      stiction onset study.toml --strength scan.nc --method equilibrium --gaps fill
    """
    import pandas as pd

    from stiction.base.variables import ONSET_VARIABLES
    from stiction.methods.protocol import METHODS
    from stiction.study.run import table_of
    from stiction.study.study import read_setup

    setup = read_setup(study)
    problem, of_study = setup.problem, setup.method
    if unknown := [name for name in method or () if name not in METHODS]:
        raise InputError([unknown_name("--method", name, METHODS) for name in unknown])
    profile = st.read_profile(
        strength, interface=problem.interface, unit=unit, x_unit=x_unit, interpolate=interpolate,
        gaps=gaps, value=_column(value), x=_column(x), quantity=quantity, decimal=decimal,
        missing=None if missing is None else [_number(text) for text in missing], skip=skip,
        sheet=_column(sheet) or 0, record=record, offset=_number(offset),
    )  # fmt: skip
    with collect_warnings():  # each method refuses, and warns, for itself
        problem.sample(profile, accept=("overstress",))
    printed = (
        *ONSET_VARIABLES, "friction_coefficient", "critical_force", "first_instability_force"
    )  # fmt: skip
    rows: dict[str, dict[str, float]] = {}
    refused: list[str] = []
    for name in method or METHODS:
        timed = name == "rupture" and problem.specimen is None
        options = {"loading_rate": LOADING_RATE} if timed else {}
        try:
            given = of_study if of_study and of_study.type == name else None
            result = st.onset(problem, profile, method=given or METHODS[name](**options))
            table = table_of(result[[key for key in printed if key in result]])
            rows[name] = {key: v[0] for key, v in table.items() if key.startswith(printed)}
        except (InputError, TypeError) as error:  # TypeError: it has options without defaults
            refused.append(f"{name} does not apply: {error}")
    if rows:
        echo(pd.DataFrame(rows).T.to_string(na_rep="", float_format="{:.8g}".format))
    for text in refused:
        echo(text)
    if not rows:
        raise typer.Exit(1)


def _number(text: str) -> Any:
    with suppress(ValueError):
        return float(text)
    return text


def _column(text: str | None) -> int | str | None:
    return int(text) if text is not None and text.isdecimal() else text


def rupture(
    study: StudyFile,
    out: Annotated[Path, Option(help="Folder of result and figures.")] = Path(
        "stiction-rupture"
    ),
    sample: Annotated[
        int | None, Option(min=0, help="Sample of the study's strength; 0 by default.")
    ] = None,
    strength: Annotated[
        Path | None, Option(metavar="PROFILE", help="Peak strength, instead of a sample.")
    ] = None,
    film: Annotated[bool, Option("--film", help="Also write rupture.gif.")] = False,
) -> None:
    """Simulate an interface from its first slip to global sliding, or until its study stops it.

    The strength is a sample of the study (at the first point of a sweep) or your
    own profile, with or without x. The command writes `rupture.nc` (slip, slip
    rate and stress over time and x) and a figure of the slip rate in space and
    time (PNG and PDF). The loading rate comes from the method `rupture` of the
    study, else it is 2e7 Pa/s. On a specimen the command simulates the event in
    which the whole interface slides, and draws the blocks too.

    \b
    Examples:
      stiction rupture study.toml --sample 3 --film
      stiction rupture study.toml --strength profile.csv --out rupture
    """
    _ignore_local_style()
    from stiction.study.run import write_result
    from stiction.study.study import read_setup

    out.mkdir(parents=True, exist_ok=True)
    profiles: Any
    if strength is not None and sample is not None:
        raise InputError("--sample: has no effect beside --strength. Leave one of them out")
    if strength is None:
        loaded = st.Study.from_toml(study)
        point, save = loaded.experiments[0], loaded.save
        problem, method = point.problem, point.method
        profiles = point.profiles(point.draws(sample or 0, 1))
    else:
        setup = read_setup(study)
        problem, method, save = setup.problem, setup.method, setup.save
        profiles = st.read_profile(strength, interface=problem.interface)
    if not isinstance(method, st.Rupture):
        method = st.Rupture(loading_rate=None if problem.specimen else LOADING_RATE)
    result = st.simulate_rupture(problem, profiles, method=method, save=save)
    write_result(result, out / "rupture.nc")
    echo(_summary(result))
    with Meter("drawing the figures"):
        _save_figure(st.plot.rupture(result, problem=problem), out / "rupture")
        if problem.specimen is not None:
            _save_figure(st.plot.block(result, problem=problem).flat[0], out / "block")
    if film:
        echo(f"film: {st.plot.film(result, out / 'rupture.gif')}")
    echo(f"written to {out}")


def _summary(result: Any) -> str:
    """Return the numbers of a rupture, with a line for each variable that is not NaN."""
    lines = []
    for name in filter(result.__contains__, RUPTURE):
        numbers = [f"{number:.5g}" for number in result[name].values.reshape(-1)]
        if numbers != ["nan"]:
            about = result[name].attrs
            lines.append(f"{about['long_name']}: {' and '.join(numbers)} {about['units']}")
    return "\n".join([*lines, f"ended by: {result.attrs['stopped']}"])


def reliability(
    study: StudyFile,
    force: Annotated[float | None, Option(help="Shear force to carry, N.")] = None,
    stress: Annotated[float | None, Option(help="Mean shear stress to carry, Pa.")] = None,
    friction_coefficient: Annotated[
        float | None, Option(help="Shear stress over normal pressure to carry.")
    ] = None,
    probability: Annotated[float | None, Option(help="Probability of a design.")] = None,
    out: Annotated[
        Path | None,
        Option(metavar="RUN", help="Compute the curve; repetitions are stored in this folder."),
    ] = None,
    page: Annotated[
        Path | None, Option(metavar="HTML", help="Write the design as a page to file.")
    ] = None,
    smallest: Annotated[
        float | None, Option(help="Smallest probability of the curve; 1e-9 by default.")
    ] = None,
    repetitions: Annotated[
        int | None, Option(help="Independent repetitions of the curve; 8 by default.", min=1)
    ] = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    part: Part = None,
) -> None:
    """Compute the probability that an interface slides below a demand, or its design.

    The answer is a line for each point of the sweep. `--force`, `--stress` and
    `--friction-coefficient` ask for a probability, `--probability` for a design.
    Without these options, the table [reliability] of the study asks. `--page`
    writes a design as a page that prints on A4, with its characteristic value,
    partial factor, inputs, doubts and sensitivities. `--out` computes the whole
    curve, decade by decade.

    Problem, strength, method, seed and sweep come from the study file, whose
    number of samples is not used. The stress is the mean shear stress on the
    interface. Failure means that the whole interface slides below that stress.
    With a list of equally likely interfaces, the probability is their mean, and
    a band contains 90 % of them. Rerunning the command resumes an interrupted run
    and adds repetitions if `--repetitions` was raised. `stiction export` writes the
    curve as a table, and `stiction report` writes a page with its figure.

    \b
    Examples:
      stiction reliability study.toml --force 40e3
      stiction reliability study.toml --probability 1e-3
      stiction reliability study.toml --out curve --smallest 1e-6
    """
    from stiction.study.run import table_of

    loaded = st.Study.from_toml(study)
    asked = _given(
        force=force, stress=stress, friction_coefficient=friction_coefficient,
        probability=probability,
    )  # fmt: skip
    of_curve = _given(smallest=smallest, repetitions=repetitions, part=part)
    if out is None:
        if given := of_curve | _given(scheduler=scheduler):
            raise InputError(
                f"{_options_of(given)}: applies to a whole curve only. Add --out FOLDER"
            )
        _answer(loaded, asked, workers, page)
        return
    if asked := asked | _given(page=page):
        raise InputError(
            f"--out: computes a whole curve. Leave out --out or {_options_of(asked)}"
        )
    with _resumable(out), _executor(scheduler) as executor:
        curve = loaded.failure_curve(out=out, workers=workers, executor=executor, **of_curve)
    echo(table_of(curve).to_string(index=False, float_format="{:.7g}".format, max_rows=200))
    if "members" in curve:
        echo(
            f"probability: the mean over {curve.sizes['member']} equally likely interfaces, with"
            " its 95 % interval (_low, _high). band_low and band_high: 90 % of the interfaces"
        )
    _state_of(out, part)


def _state_of(out: Path, part: str | None) -> Any:
    """Print how much of a run is stored, and return its state."""
    stored = st.open_run(out)
    state = stored.status()
    beginning = f"part {part}: " if part else ""
    echo(f"{beginning}{state.done} of {state.samples} {stored.counted} in {out}")
    return state


def _given(**options: Any) -> dict[str, Any]:
    return {name: value for name, value in options.items() if value is not None}


def _options_of(names: Iterable[str]) -> str:
    """Return the options of a command for names of arguments."""
    return ", ".join(f"--{name.replace('_', '-')}" for name in names)


def _answer(
    study: Any, asked: dict[str, float], workers: int | None, page: Path | None = None
) -> None:
    """Print, for each point, the answer to the question in the command or in the study."""
    from stiction.study.study import Question

    question = study.reliability
    if asked:
        given = {} if question is None else {"target_cv": question.target_cv}
        try:
            question = Question(**given, **asked)
        except InputError as error:
            texts = (text.partition("Question")[2].lstrip(".: ") for text in error.problems)
            raise InputError(texts) from None
    if question is None:
        raise InputError(
            "pass --force, --stress, --friction-coefficient or --probability, or add a table"
            " [reliability] to the study. For a whole failure curve, pass --out FOLDER"
        )
    for point, experiment in zip(study.points, study.experiments, strict=True):
        where = f"{point}: " if point.values else ""
        answer = question.answer(experiment, workers)
        echo(f"{where}{answer}")
        evidence = []
        if study.peaks is not None:
            predicted = st.monte_carlo(
                experiment.problem, experiment.random, method=experiment.method,
                samples=COMPARED_SAMPLES, seed=experiment.seed, workers=workers,
            )  # fmt: skip
            evidence.append(st.statistics.agreement(predicted, study.peaks))
            echo(f"{where}{evidence[0]}")
        if page is not None:
            path = page.with_stem(page.stem + (f"_{point.number}" if point.values else ""))
            title = study.title or "Design of a joint"
            answer.write_page(path, problem=experiment.problem, evidence=evidence, title=title)
            echo(f"page: {path}")


# -- the program ---------------------------------------------------------------------------------

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="The statistics of static friction: at which load, and where, does an interface let go?",
)


def _print_version(wanted: bool) -> None:
    if wanted:
        echo(f"stiction {st.__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[
        bool, Option("--version", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    pass


def _command(function: Callable[..., None]) -> Callable[..., None]:
    """Word messages for the command line. After Ctrl-C the exit code is 130, as shells expect."""

    def show(message: Warning | str, *args: Any, **kwargs: Any) -> None:
        echo(f"warning: {in_options(str(message), function)}", err=True)

    @functools.wraps(function)
    def wrapped(*args: Any, **kwargs: Any) -> None:
        warnings.showwarning = show
        try:
            function(*args, **kwargs)
        except InputError as error:
            raise InputError([in_options(text, function) for text in error.problems]) from None
        except RunError as error:
            raise type(error)(in_options(str(error), function)) from None
        except KeyboardInterrupt:
            echo("interrupted", err=True)
            raise typer.Exit(130) from None

    return wrapped


for _function in (example, check, run, status, export, report, onset, rupture, reliability):
    app.command(short_help=(_function.__doc__ or "").partition("\n\n")[0])(_command(_function))


def main() -> None:
    """Run the command line. Invalid input or a full disk gives a message, not a traceback.

    The exit code is 2 for invalid input and 1 for failures of the run.
    """
    os.environ["MPLBACKEND"] = "Agg"  # figures are files, also in the shell of a notebook
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # an encoding may lack letters of a title
            stream.reconfigure(errors="replace")
    logging.basicConfig(format="%(message)s", level=logging.WARNING, stream=sys.stderr)
    try:
        try:
            app(standalone_mode=True)
        finally:
            sys.stdout.flush()
    except InputError as error:
        for text in error.problems:
            echo(f"error: {text}", err=True)
        sys.exit(2)
    except (RunError, TimeoutError, MemoryError, OSError) as error:
        echo(f"error: {str(error) or 'not enough memory'}", err=True)
        try:
            sys.stdout.flush()
        except OSError:  # to a full disk: the interpreter would try again at its end
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)
