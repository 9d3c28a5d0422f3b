"""Commands that work with study files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from stiction.cli.common import StudyFile, Workers, summary, writable
from stiction.errors import InputError


def run(
    study: StudyFile,
    out: Annotated[Path, typer.Option(help="NetCDF file for the result.")],
    workers: Workers = None,
) -> None:
    """Run the Monte Carlo study of a file and write its result.

    The result is one NetCDF file over 'sample', with units, the study and the seed in its
    attributes. The numbers do not depend on the number of workers.
    """
    from stiction.study import Study

    writable(out, "the result")
    loaded = Study.from_toml(study)
    loaded.to_dict()
    result = loaded.run(workers=workers, progress=True)
    aside = out.with_name(out.name + ".part")
    result.to_netcdf(aside)
    aside.replace(out)
    typer.echo(summary(result))
    typer.echo(f"{result.sizes['sample']} samples written to {out}")


def check(study: StudyFile) -> None:
    """Say what a study file would do, or everything that is wrong with it."""
    from stiction.study import Study

    loaded = Study.from_toml(study)
    problem, field = loaded.problem, loaded.strength
    modes = field.modes(problem.interface)
    typer.echo(f"{study}: valid" + (f", {loaded.title!r}" if loaded.title else ""))
    typer.echo(f"  method               {loaded.method.type}")
    typer.echo(f"  samples              {loaded.ensemble.samples} (seed {loaded.ensemble.seed})")
    typer.echo(f"  effective modulus    {problem.effective_modulus:.6g} Pa")
    try:
        length = problem.nucleation_length
        nodes = length / problem.interface.spacing
        ratio = problem.interface.length / length
        typer.echo(f"  nucleation length    {length:.4g} m: {nodes:.1f} nodes, L/h_n = {ratio:.1f}")
    except InputError:
        typer.echo("  nucleation length    varies along the interface")
    typer.echo(
        f"  strength             mean {field.mean:.6g} Pa, standard deviation"
        f" {field.standard_deviation:.4g} Pa, {modes.count} modes"
    )
    typer.echo(f"  correlation 1/e at   {field.efolding_length():.4g} m (of the strength)")


def schema() -> None:
    """Print the JSON schema of a study file, for editors that complete and check TOML."""
    from stiction.study import study_schema

    typer.echo(json.dumps(study_schema(), indent=2))
