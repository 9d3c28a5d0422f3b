r"""The command line: parse, call, print.

Commands import numerics late, so that help is quick. Public names are imported on first use.

Examples
--------
Commands are functions. This study has six samples, and the second of three jobs computes two.

>>> import contextlib, tempfile
>>> from unittest.mock import patch
>>> problem = st.paper.problem(nodes=576)
>>> strength = st.paper.strength(problem, correlation_ratio=2.0)
>>> sweep = [{"seed": [7, 9]}]
>>> study = st.Study(
...     problem=problem, random=strength, method=st.LocalCriterion(), samples=3, sweep=sweep,
...     title="first",
... )
>>> def show(command, *arguments, **options):
...     try:
...         command(*arguments, **options)
...     except typer.Exit as ended:
...         print("exit code", ended.exit_code)
>>> file, out = Path("study.toml"), Path("run")
>>> with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
...     study.to_toml(file)
...     with patch("signal.signal"), contextlib.redirect_stdout(io.StringIO()) as printed:
...         show(run, file, out, part="2/3")
...     printed.getvalue().splitlines()[4:]  # after a table
...     show(status, out)
...     show(export, out, Path("all.csv"), partial=True)
...     with contextlib.redirect_stderr(io.StringIO()) as printed:
...         show(report, out)
...     printed.getvalue(), sorted(path.name for path in out.glob("*.html"))
...     try:
...         example(file)
...     except InputError as error:
...         print(error)  # doctest: +ELLIPSIS
['part 2/3: 2 of 6 samples in run']
run: first
  samples     2 of 6 (33.3 %)
  chunks      ...
  computed    ... of one core
  point 0 (seed = 7): 1 of 3
  point 1 (seed = 9): 1 of 3
  undamaged   all stored chunks match their checksums
exit code 1
2 of 6 samples written to all.csv; the others are missing
report: run...report.html
exit code 1
('the report shows 2 of 6 samples\n', ['report.html'])
study.toml: already exists. Choose another name
"""

import functools
import io
import logging
import os
import signal
import sys
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, Any

import typer
from typer import Argument, Option

import stiction as st
from stiction.base.errors import InputError, RunError, collect_warnings, printable
from stiction.base.progress import Meter, duration, interrupted

MAX_SHOWN_LINES = 12
"""Number of points, failures or damaged chunks that are printed at most."""
StudyFile = Annotated[
    Path,
    Argument(metavar="STUDY.toml", help="`stiction example FILE` writes one to start from."),
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
TIMED_POINTS, TIMING_SECONDS, SLOW_SECONDS = 5, 0.2, 3.0
"""Number of sweep points that `check` times, least processor time (s) of the last batch at a
point, and estimated time of a sample (s) above which `check` does not time."""
COMPARED_SAMPLES = 1_000
"""Number of samples with which measured peaks are compared."""


# -- used by several commands ---------------------------------------------------------------------


def echo(text: Any = "", *, err: bool = False) -> None:
    r"""Print text that may come from a file. Escape characters that control a terminal.

    >>> echo("slip \x1b[2J")
    slip \x1b[2J
    """
    typer.echo(printable(str(text)), err=err)


def _show_some(texts: Sequence[Any], prefix: str, *, err: bool = False) -> None:
    """Print the first texts, and how many are left out.

    >>> _show_some(range(7, 19), "- ")
    - 7
    - 8
    - 9
    - 10
    - 11
    - 12
    - 13
    - 14
    - 15
    - 16
    - 17
    - 18
    >>> _show_some(["a"] * 14, "- ")  # doctest: +ELLIPSIS
    - a
    ...
    - a
    - and 2 more
    """
    for text in texts[:MAX_SHOWN_LINES]:
        echo(f"{prefix}{text}", err=err)
    if len(texts) > MAX_SHOWN_LINES:
        echo(f"{prefix}and {len(texts) - MAX_SHOWN_LINES} more", err=err)


# -- studies and runs ----------------------------------------------------------------------------


def _interrupt(*_: object) -> None:
    """End the run, even if the exception of this handler is lost.

    >>> try:
    ...     _interrupt(15, None)
    ... except KeyboardInterrupt:
    ...     print(interrupted.is_set())
    ... finally:
    ...     interrupted.clear()
    True
    """
    interrupted.set()
    raise KeyboardInterrupt


def _report_nothing(lost: object) -> None:
    """Replace Python's report of a lost exception after an interruption.

    An object whose construction was interrupted can fail again when Python deletes it.
    """


@contextmanager
def _resumable(out: Path) -> Iterator[None]:
    """Let an interruption end a run as Ctrl-C does, so that stored results are kept.

    >>> import tempfile
    >>> from contextlib import redirect_stderr
    >>> from unittest.mock import patch
    >>> log = io.StringIO()
    >>> with tempfile.TemporaryDirectory() as folder, redirect_stderr(log), patch("signal.signal"):
    ...     with suppress(typer.Exit), _resumable(Path(folder)):
    ...         interrupted.set()  # the exception of the signal was lost
    ...     Path(folder, "chunks").mkdir()
    ...     Path(folder, "chunks", "0.npz").touch()
    ...     with suppress(typer.Exit), _resumable(Path(folder)):
    ...         raise KeyboardInterrupt
    >>> print(log.getvalue().replace(folder, "RUN"), interrupted.is_set())
    interrupted: no sample is stored in RUN. Rerun the command to resume
    interrupted: results are in RUN. Rerun the command to resume
     False
    """
    report: Callable[[Any], Any] = sys.unraisablehook
    # Python drops an exception in a callback from C and prints it. The run ends all the same.
    sys.unraisablehook = lambda lost: interrupted.is_set() or report(lost)
    signal.signal(signal.SIGTERM, _interrupt)  # of a batch system
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored
        signal.signal(signal.SIGINT, _interrupt)
    try:
        yield
        if interrupted.is_set():
            raise KeyboardInterrupt
    except KeyboardInterrupt:
        report = _report_nothing
        stored = "results are" if any(out.glob("chunks/*.npz")) else "no sample is stored"
        echo(f"interrupted: {stored} in {out}. Rerun the command to resume", err=True)
        raise typer.Exit(130) from None
    finally:
        interrupted.clear()
        sys.unraisablehook = report


@contextmanager
def _executor(scheduler: str | None) -> Iterator[Any]:
    """Yield the executor for a Dask scheduler, or None.

    >>> from unittest.mock import patch
    >>> with _executor(None) as executor:
    ...     bool(executor)
    False
    >>> with patch.dict(sys.modules, distributed=None):  # doctest: +ELLIPSIS
    ...     _executor("tls://host").__enter__()
    Traceback (most recent call last):
        ...
    stiction.base.errors.InputError: --scheduler: tls://host cannot be reached: ...
    """
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

    The exit code is 0 if the run, or with --part the part, is complete, 1 if
    samples failed or the run could not continue, 2 if the study or the command
    has errors, and 130 after an interruption.

    \b
    Examples:
      stiction run study.toml --out run
      stiction run study.toml --out run --part 3/100
    """
    loaded = st.Study.from_toml(study)
    with _resumable(out), _executor(scheduler) as executor:
        result = loaded.run(out=out, workers=workers, executor=executor, part=part, pilot=pilot)
    from stiction.cli.pages import shown, tables_of  # matplotlib, once the samples are stored

    for title, frame in tables_of(result, loaded.axes):
        echo(f"{title}\n{frame.map(shown).to_string(index=False, max_rows=48)}")
    state, beginning = st.open_run(out).status(), f"part {part}: " if part else ""
    echo(f"{beginning}{state.done} of {state.samples} samples in {out}")
    if state.failures:
        echo(f"failed samples: {len(state.failures)}. Run the same command again:", err=True)
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
    echo(f"  {'samples':11s} {state.done} of {state.samples} ({share:.1f} %)")
    echo(f"  chunks      {state.chunks}")
    echo(f"  computed    {duration(state.seconds)} of one core")
    counts = zip(points, state.done_by_point, strict=True)
    behind = [f"{point}: {done} of {samples}" for point, done in counts if done < samples]
    _show_some(behind if len(points) > 1 else [], "  ")
    _show_some(state.damaged, "  damaged     ")
    if state.damaged:
        echo("  run the study again to repair the damage")
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
    echo(f"{state.done} of {state.samples} samples written to {out}{rest}")


def report(
    run: RunPath,
    out: Annotated[Path | None, Option(help="HTML file; RUN/report.html by default.")] = None,
) -> None:
    """Write a self-contained HTML page: figures, tables, failures, the study and versions.

    The exit code is 0 if the run is complete, and 1 if samples are missing from
    the page.

    \b
    Examples:
      stiction report run --out page.html
    """
    from stiction.cli.pages import write_report

    path, stored = out or run / "report.html", st.open_run(run)
    with Meter("writing the report"):
        write_report(stored, path)
    echo(f"report: {path}")
    state = stored.status()
    if not state.complete:
        echo(f"the report shows {state.done} of {state.samples} samples", err=True)
        raise typer.Exit(1)


# -- what a study would do -----------------------------------------------------------------------


def example(
    file: Annotated[Path, Argument(metavar="FILE", help="New file, such as study.toml.")],
) -> None:
    """Write a study file to start from.

    \b
    Examples:
      stiction example study.toml
    """
    from importlib.resources import files

    text = files("stiction.cli").joinpath("example.toml").read_bytes()
    try:
        with file.open("xb") as new:
            new.write(text)
    except FileExistsError:
        raise InputError(f"{file}: already exists. Choose another name") from None
    echo(f"study: {file}")


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
    """Return a description of a study in a few titled lines.

    >>> import numpy as np
    >>> from types import SimpleNamespace
    >>> from stiction.base.variables import Variable
    >>> methods = [SimpleNamespace(label=label) for label in ("local", "exact", "local")]
    >>> points = [SimpleNamespace(method=method) for method in methods]
    >>> mean = np.array([2.0, 3.0, 7.0]), Variable("Pa", "strength.mean", ("mean",))
    >>> nodes = np.array([64, 96, 128]), Variable("1", "nodes", ("mean",))
    >>> axes = {"mean": {"nodes": nodes, "mean": mean}, "nodes": {"nodes": nodes}}
    >>> study = SimpleNamespace(experiments=points, samples=5, seed=11, sweep=[1], axes=axes)
    >>> description(study)["samples"], description(study)["method"]
    ('5 (seed 11) at each of 3 points: 15 in total', 'local, exact')
    >>> description(study)["axis 1"]
    'nodes with strength.mean: 3 values, 2.0 to 7.0 Pa'
    >>> description(study)["axis 2"]
    'nodes: 3 values, 64 to 128'
    >>> study.sweep, study.axes = [], {}
    >>> description(study)
    {'method': 'local, exact', 'samples': '5 (seed 11)'}
    """
    points = study.experiments
    samples = f"{study.samples} (seed {study.seed})"
    if study.sweep:
        samples += f" at each of {len(points)} points: {len(points) * study.samples} in total"
    methods = ", ".join(dict.fromkeys(point.method.label for point in points))
    lines = {"method": methods, "samples": samples}
    for number, (dim, coordinates) in enumerate(study.axes.items(), start=1):
        keys = " with ".join(variable.long_name for _, variable in coordinates.values())
        values, variable = coordinates[dim]
        unit = f" {variable.units}".removesuffix(" 1")
        text = f"{keys}: {len(values)} values, {values[0]} to {values[-1]}{unit}"
        lines[f"axis {number}"] = text
    return lines


def _cost(study: Any) -> dict[str, str]:
    r"""Return the computing time for a study, from a few samples, and the size of its result.

    Of seven points, five are timed. Ratios between them are interpolated in logarithms:
    4 between 2 and 8, and 4 between 8 and 2. The sum is 29.

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> times = (0.5, 1.0, None, 4.0, 4.0, None, 1.0)
    >>> points = [SimpleNamespace(seconds=0.5, sample_bytes=3e5, time=time) for time in times]
    >>> study = SimpleNamespace(experiments=points, samples=10)
    >>> with patch("stiction.cli.commands._seconds", lambda point: point.time):
    ...     with patch("stiction.ensemble.batches.usable_cores", return_value=4):
    ...         print(*_cost(study).values(), sep="\n")
    about 2.42 min on one core, 36.2 s on 4 (500 ms to 4 s a sample, measured on a few samples)
    about 21 MB
    """
    import numpy as np

    from stiction.ensemble.batches import usable_cores

    points, samples, cores = study.experiments, study.samples, usable_cores()
    places = np.unique(np.linspace(0, len(points) - 1, TIMED_POINTS).astype(int))
    ratios = [_seconds(points[place]) / points[place].seconds for place in places]
    # Other points are as much slower than their estimates as the nearest timed points.
    factors = np.exp(np.interp(np.arange(len(points)), places, np.log(ratios)))
    costs = factors * [point.seconds for point in points]
    seconds, size = costs.sum() * samples, sum(point.sample_bytes for point in points) * samples
    ends = " to ".join(dict.fromkeys((duration(min(costs)), duration(max(costs)))))
    return {
        "time": f"about {duration(seconds)} on one core, {duration(seconds / cores)} on {cores}"
        f" ({ends} a sample, measured on a few samples)",
        "size": f"about {size / 1e6:.3g} MB",
    }


def _seconds(point: Any) -> float:
    """Return the processor time of a sample, s, or its estimate if samples are slow or fail.

    The size of batches doubles until a batch takes long enough. Each
    batch runs twice, because kernels compile in its first run.

    >>> from types import SimpleNamespace
    >>> from unittest.mock import patch
    >>> def timed(spent, estimate, batch=6):
    ...     counts, clock = [], iter([time for end in spent for time in (0.0, end)])
    ...     results = lambda first, count: counts.append(count)
    ...     with patch("time.thread_time", lambda: next(clock)):
    ...         point = SimpleNamespace(seconds=estimate, batch=batch, results=results)
    ...         return round(_seconds(point), 6), counts
    >>> timed([0.05, 0.06, 0.2], 0.001), timed([0.05, 0.06, 0.07, 0.09], 0.001)
    ((0.05, [1, 1, 2, 2, 4, 4]), (0.015, [1, 1, 2, 2, 4, 4, 6, 6]))
    >>> timed([0.05], 0.2), timed([], 3.0), timed([0.0], 0.001, 1)
    ((0.05, [1, 1]), (3.0, []), (0.0, [1, 1]))
    >>> def fail(first, count):
    ...     raise RuntimeError
    >>> _seconds(SimpleNamespace(seconds=0.25, batch=6, results=fail))
    0.25
    """
    seconds, count = point.seconds, 1
    with suppress(InputError, RuntimeError, ArithmeticError), collect_warnings():
        while point.seconds < SLOW_SECONDS:
            point.results(0, count)
            begin = time.thread_time()
            point.results(0, count)
            spent = time.thread_time() - begin
            seconds = spent / count
            if max(spent, point.seconds) >= TIMING_SECONDS or count >= point.batch:
                break
            count = min(2 * count, point.batch)
    return max(seconds, 1e-9)


# -- failure probabilities -----------------------------------------------------------------------


def reliability(
    study: StudyFile,
    page: Annotated[
        Path | None, Option(metavar="HTML", help="Write the design as a page to file.")
    ] = None,
    workers: Workers = None,
) -> None:
    """Answer the question in the table [reliability] of a study: a probability or a design.

    The table states a `force` (N), `stress` (Pa) or `friction_coefficient` to
    carry, or the `probability` of a design. The answer is a line for each point
    of the sweep. Failure means that the whole interface slides below the demand.
    `--page` writes a design as a page that prints on A4, with its characteristic
    value, partial factor, inputs, doubts and sensitivities.

    \b
    Examples:
      stiction reliability study.toml
      stiction reliability study.toml --page design.html
    """
    loaded = st.Study.from_toml(study)
    question = loaded.reliability
    if question is None:
        raise InputError(
            "reliability: the study has no table [reliability]. Add this table with force (N),"
            " stress (Pa), friction_coefficient, or the probability of a design"
        )
    for point, experiment in zip(loaded.points, loaded.experiments, strict=True):
        where = f"{point}: " if point.values else ""
        answer = question.answer(experiment, workers)
        echo(f"{where}{answer}")
        evidence: list[Any] = []
        if loaded.peaks is not None:
            predicted = st.monte_carlo(
                experiment.problem, experiment.random, method=experiment.method,
                samples=COMPARED_SAMPLES, seed=experiment.seed, workers=workers,
            )  # fmt: skip
            # The peaks name their file and column.
            evidence = [st.statistics.agreement(predicted, loaded.peaks), loaded.peaks]
            echo(f"{where}{evidence[0]}")
        if page is not None:
            path = page.with_stem(page.stem + (f"_{point.number}" if point.values else ""))
            title = loaded.title or "Design of a joint"
            answer.write_page(path, evidence=evidence, title=title)
            echo(f"page: {path}")


# -- the program ---------------------------------------------------------------------------------

app = typer.Typer(
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Statistics of static friction: when and where a rough interface begins to slide.",
)


def _print_version(wanted: bool) -> None:
    """Print the version, and end.

    >>> _print_version(False)
    >>> with suppress(typer.Exit):
    ...     _print_version(True)  # doctest: +ELLIPSIS
    stiction ...
    """
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
    """Print warnings as lines. After Ctrl-C the exit code is 130, as shells expect.

    >>> from contextlib import redirect_stderr
    >>> from unittest.mock import patch
    >>> @_command
    ... def solve(nodes):
    ...     warnings.warn(f"few nodes, {nodes}")
    ...     raise KeyboardInterrupt
    >>> log = io.StringIO()
    >>> with redirect_stderr(log), patch("warnings.showwarning"), warnings.catch_warnings():
    ...     warnings.simplefilter("always")
    ...     try:
    ...         solve(7)
    ...     except typer.Exit as ended:
    ...         print(ended.exit_code)
    130
    >>> print(log.getvalue(), end="")
    warning: few nodes, 7
    interrupted
    """

    def show(message: Warning | str, *args: Any, **kwargs: Any) -> None:
        echo(f"warning: {message}", err=True)

    @functools.wraps(function)
    def wrapped(*args: Any, **kwargs: Any) -> None:
        warnings.showwarning = show
        try:
            function(*args, **kwargs)
        except KeyboardInterrupt:
            echo("interrupted", err=True)
            raise typer.Exit(130) from None

    return wrapped


for _function in (example, check, run, status, export, report, reliability):
    app.command(short_help=(_function.__doc__ or "").partition("\n\n")[0])(_command(_function))


def main() -> None:
    r"""Run the command line. Invalid input or a full disk gives a message, not a traceback.

    The exit code is 2 for invalid input and 1 for failures of the run.

    Examples
    --------
    >>> from contextlib import redirect_stderr
    >>> from unittest.mock import patch
    >>> def ended(error):
    ...     log = io.StringIO()
    ...     with redirect_stderr(log), patch.dict(os.environ), patch("logging.basicConfig"):
    ...         with patch("stiction.cli.commands.app", side_effect=error):
    ...             try:
    ...                 main()
    ...             except SystemExit as end:
    ...                 return end.code, log.getvalue()
    >>> ended(InputError(["nodes: missing", "width: missing"]))
    (2, 'error: nodes: missing\nerror: width: missing\n')
    >>> ended(RunError("no room")), ended(MemoryError()), ended(None) is None
    ((1, 'error: no room\n'), (1, 'error: not enough memory\n'), True)
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
