"""Implement ``chaincor run``: run one collision."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.workflows.commands.options import (
    ONE_OR_MORE,
    POSITIVE,
    json_option,
    option,
    say,
    tell,
)
from chaincor.workflows.commands.scene_options import SceneCommand, scene_from, scene_options
from chaincor.workflows.json_output import json_text
from chaincor.workflows.showing.text import describe_result

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene


_EXAMPLES = """
\b
Examples:
  chaincor run
  chaincor run --potential harmonic --particles 20 --velocity 0.05
  chaincor run --speed 0.8 --tolerance 1e-8 --json
  chaincor run scene.toml --particles 50
  chaincor run --wall reflect --timestep 0.01
  chaincor run --potential toda --particles 20 --sensitivity
  chaincor run --engine reference --particles 10 --temperature 1e-4 --samples 100
`chaincor explain` says what each printed word means.
"""


@click.command(cls=SceneCommand, epilog=_EXAMPLES)
@scene_options()
@option("--animate FILE", "write an animation of the motion, as .gif or .mp4")
@option("--watch", "show the motion in the terminal", name="watched")
@option("--most-hours H", "time limit in hours [default: 24]", POSITIVE)
@option(
    "--samples N",
    "run a scene with a temperature for N seeds, and print the mean of eta and its standard error",
    ONE_OR_MORE,
)
@option(
    "--precision P",
    "wanted standard error of the mean of eta, with --samples; the output says how many more "
    "samples are needed [default: 0.01]",
    POSITIVE,
)
@option(
    "--workers N",
    "number of worker processes, with --samples [default: one per core]",
    ONE_OR_MORE,
)
@option(
    "--sensitivity",
    "also print the derivatives of eta with respect to speed, masses, bonds and contact",
)
@option("--dry-run", "print the plan and the expected time without running")
@json_option
def run(
    scene_file: str | None,
    animate: str | None,
    watched: bool,
    most_hours: float | None,
    samples: int | None,
    precision: float | None,
    workers: int | None,
    sensitivity: bool,
    dry_run: bool,
    as_json: bool,
    **options: Any,
) -> None:
    """
    Run one collision and print its restitution with an error bar.

    By default, LAMMPS runs a Lennard-Jones chain of 100 particles at 0.4 v*.
    """
    from chaincor.analysis.output_paths import judge_output
    from chaincor.workflows.accuracy.plan import describe_plan, plan
    from chaincor.workflows.campaign.progress import show_elapsed
    from chaincor.workflows.collision import MOST_SECONDS, collide
    from chaincor.workflows.errors import RunError

    if animate is not None and not animate.endswith((".gif", ".mp4")):
        raise click.UsageError(f"--animate is '{animate}'. Give a name that ends in .gif or .mp4")
    scene = scene_from(scene_file, options)
    if animate is not None:
        judge_output(Path(animate), Path(animate).suffix)
    most_seconds = MOST_SECONDS if most_hours is None else 3600.0 * most_hours
    alone = {"--animate": animate is not None, "--watch": watched, "--sensitivity": sensitivity}
    alone["--dry-run"] = dry_run
    many = {"--precision": precision is not None, "--workers": workers is not None}
    for name, given in (many if samples is None else alone).items():
        if given:
            raise click.UsageError(
                f"{name} works only with --samples. Give --samples N, or leave out {name}"
                if samples is None
                else f"{name} shows one collision, and --samples runs many. Leave out {name} "
                "or --samples"
            )
    if samples is not None:
        _run_samples(scene, samples, precision, workers, most_seconds, as_json)
        return
    terminal = None
    if watched:
        from chaincor.workflows.pictures.watch import find_terminal

        terminal = find_terminal()
    planned = plan(scene)
    if dry_run:
        if planned.refusal is not None:
            raise RunError(planned.refusal)
        tell({"plan": planned.to_dict()}, describe_plan(planned), as_json, scene)
        return
    with show_elapsed(planned.seconds, at_least=planned.may_take_longer):
        result = collide(scene, most_seconds=most_seconds)
    if as_json:
        found = result.to_dict()
        if sensitivity:
            found["sensitivity"] = result.sensitivity.to_dict()
        say(json_text(found, scene))
    else:
        say(describe_result(result))
        if sensitivity:
            from chaincor.workflows.sensitivity.text import describe_sensitivity

            say(f"\n{describe_sensitivity(result.sensitivity, result.scene)}")
    # Pictures come last, because they may fail or be interrupted.
    if animate is not None:
        from chaincor.workflows.pictures.recording import write_animation

        write_animation(result, animate)
    if terminal is not None:
        from chaincor.workflows.pictures.watch import watch

        watch(result, terminal)
    if result.tolerance_met is False:
        say(f"chaincor: {result.reason}", err=True)
        raise click.exceptions.Exit(1)


def _run_samples(
    scene: "Scene",
    samples: int,
    precision: float | None,
    workers: int | None,
    most_seconds: float,
    as_json: bool,
) -> None:
    """Run a scene with a temperature for many seeds, and print their statistics."""
    from chaincor.workflows.campaign.collide_many import collide_many
    from chaincor.workflows.campaign.ensemble import DEFAULT_PRECISION, describe_ensemble

    result = collide_many(scene, samples, workers=workers, progress=True, most_seconds=most_seconds)
    wanted = DEFAULT_PRECISION if precision is None else precision
    needed = {"precision": wanted, "samples_needed": result.eta.samples_needed(wanted)}
    text = describe_ensemble(result, scene, wanted)
    tell(result.to_dict() | needed, text, as_json, scene)
    missed = [*result.failures, *result.inexact]
    if missed:
        one = missed[0]
        say(
            f"chaincor: {len(result.failures)} of {samples} samples failed and "
            f"{len(result.inexact)} missed the tolerance. Seed {one.seed}: "
            f"{one.reason}",
            err=True,
        )
        raise click.exceptions.Exit(1)
