"""``chaincor run``: one collision."""

import json
from typing import Any

import click

from chaincor.workflows.commands.scene_options import scene_from, scene_options
from chaincor.workflows.result import Collision


@click.command()
@scene_options()
@click.option(
    "--animate", metavar="FILE", help="draw the motion, followed in-house, as .gif or .mp4"
)
@click.option("--watch", "watched", is_flag=True, help="play the motion in the terminal")
@click.option(
    "--most-hours",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="H",
    help="refuse what is expected to take longer [default: 24]",
)
@click.option("--json", "as_json", is_flag=True, help="print one JSON object")
@click.pass_context
def run(
    ctx: click.Context,
    scene_file: str | None,
    animate: str | None,
    watched: bool,
    most_hours: float | None,
    as_json: bool,
    **options: Any,
) -> None:
    """
    Run one collision and print its restitution with an error bar.

    Without options: a Lennard-Jones chain of 100 particles at 0.4 v*, by LAMMPS, to 1e-6.
    """
    from chaincor.workflows.accuracy.expected_cost import expected_seconds
    from chaincor.workflows.collision import MOST_SECONDS, collide
    from chaincor.workflows.run_progress import show_elapsed

    if animate is not None and not animate.endswith((".gif", ".mp4")):
        raise click.UsageError(f"--animate is '{animate}'; expected a name in .gif or .mp4")
    scene = scene_from(scene_file, options)
    terminal = None
    if watched:
        from chaincor.workflows.pictures.watch import find_terminal

        terminal = find_terminal()
    most_seconds = MOST_SECONDS if most_hours is None else 3600.0 * most_hours
    with show_elapsed(expected_seconds(scene)):
        result = collide(scene, most_seconds=most_seconds)
    if as_json:
        click.echo(json.dumps(result.to_dict(), allow_nan=False))
    else:
        click.echo(describe(result))
    # The number is out before pictures are made, which may fail or be stopped.
    if animate is not None:
        from chaincor.workflows.pictures.recording import write_animation

        write_animation(scene, result.last_contact_time, animate)
    if terminal is not None:
        from chaincor.workflows.pictures.watch import watch

        watch(scene, result.last_contact_time, terminal)
    if result.tolerance_met is False:
        click.echo(f"chaincor: {result.reason}", err=True)
        ctx.exit(1)


_ENDINGS = {
    "proved": "energy and momentum rule out another contact",
    "argued": "another contact is unlikely, not ruled out",
    "open": "a piece still approaches the wall; contacts to come are in the error bar",
}


def _with_error(value: float, error: float | None) -> str:
    if error is None:
        return f"{value:.12g} (no error bar asked for)"
    digits = 1
    while digits < 16 and error < 2.0 * 10.0**-digits:
        digits += 1
    return f"{value:.{digits}f} +- {error:.1e}"


def describe(result: Collision) -> str:
    """Describe a result for people."""
    speed = f"v0 = {result.velocity:.6g}"
    if result.speed is not None:
        speed += f" = {result.speed:.6g} v*"
    step = "" if result.timestep is None else f", H = {result.timestep:.4g}"
    table = "" if result.table is None else f", {result.table} table of {result.table_points} rows"
    lines = [
        f"{result.particles} particles, {result.potential} bonds, {speed}",
        "",
        f"restitution (energy)   eta = {_with_error(result.restitution, result.restitution_error)}",
        f"restitution (speed)    e   = {result.kinematic_restitution:.6g}",
        f"contacts               {result.contacts}, the last at t = {result.last_contact_time:.6g}",
        f"end                    {result.ending}: {_ENDINGS[result.ending]}",
        f"bond lengths           {result.bond_min:.4g} to {result.bond_max:.4g}",
        f"energy drift           {result.energy_drift:.1e}",
        f"momentum residual      {result.momentum_residual:.1e} n v0",
    ]
    if result.fragments > 1:
        lines.append(f"fragments              {result.fragments} at the last contact: bonds broke")
    if result.crossed:
        lines.append("crossed                particles passed through each other on paper")
    lines += [
        "",
        f"run by {result.engine}: {result.wall} wall, {result.scheme}{step}{table}",
        f"time {result.seconds:.3g} s for the number, {result.seconds_total:.3g} s in all",
    ]
    return "\n".join(lines)
