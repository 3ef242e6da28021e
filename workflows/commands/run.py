"""``chaincor run``: one collision."""

import json
from typing import TYPE_CHECKING, Any

import click

from chaincor.workflows.commands.scene_options import scene_from, scene_options
from chaincor.workflows.result import Collision

if TYPE_CHECKING:
    from chaincor.lammps_inputs.scene import Scene


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
@click.option(
    "--samples",
    type=click.IntRange(min=1),
    metavar="N",
    help="of a warm scene: so many collisions, with its seed and those that follow, and what they "
    "say together",
)
@click.option(
    "--precision",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="P",
    help="with --samples: standard error wanted of the mean eta, to say how many more samples it "
    "takes [default: 0.01]",
)
@click.option(
    "--workers",
    type=click.IntRange(min=1),
    metavar="N",
    help="with --samples: collisions at a time [default: one a core]",
)
@click.option("--json", "as_json", is_flag=True, help="print one JSON object")
@click.pass_context
def run(
    ctx: click.Context,
    scene_file: str | None,
    animate: str | None,
    watched: bool,
    most_hours: float | None,
    samples: int | None,
    precision: float | None,
    workers: int | None,
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
    most_seconds = MOST_SECONDS if most_hours is None else 3600.0 * most_hours
    alone = {"--animate": animate is not None, "--watch": watched}
    many = {"--precision": precision is not None, "--workers": workers is not None}
    for name, given in (many if samples is None else alone).items():
        if given:
            raise click.UsageError(
                f"{name} goes with --samples; drop it, or give the number of collisions"
                if samples is None
                else f"{name} shows one collision, and --samples are many; drop one of them"
            )
    if samples is not None:
        _run_samples(ctx, scene, samples, precision, workers, most_seconds, as_json)
        return
    terminal = None
    if watched:
        from chaincor.workflows.pictures.watch import find_terminal

        terminal = find_terminal()
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


def _run_samples(
    ctx: click.Context,
    scene: "Scene",
    samples: int,
    precision: float | None,
    workers: int | None,
    most_seconds: float,
    as_json: bool,
) -> None:
    """Run many collisions of a warm scene and print what they say together."""
    from chaincor.workflows.ensemble.collide_many import collide_many
    from chaincor.workflows.ensemble.description import DEFAULT_PRECISION, describe_ensemble

    result = collide_many(scene, samples, workers=workers, progress=True, most_seconds=most_seconds)
    wanted = DEFAULT_PRECISION if precision is None else precision
    if as_json:
        found = result.to_dict()
        found["precision"] = wanted
        found["samples_needed"] = result.eta.samples_needed(wanted)
        click.echo(json.dumps(found, allow_nan=False))
    else:
        click.echo(describe_ensemble(result, scene, wanted))
    missed = [*result.failures, *result.inexact]
    if missed:
        one = missed[0]
        click.echo(
            f"chaincor: {len(result.failures)} of {samples} samples have no number and "
            f"{len(result.inexact)} do not meet the tolerance; seed {one.seed}: {one.reason}",
            err=True,
        )
        ctx.exit(1)


_ENDINGS = {
    "proved": "energy and momentum rule out another contact",
    "argued": "another contact is unlikely, not ruled out",
    "open": "a piece still approaches the {}; contacts to come are in the error bar",
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
    relative = "" if result.target_particles is None else ", of the relative motion"
    other = "wall" if result.target_particles is None else "target"
    lines = [
        f"{result.particles} particles, {result.potential} bonds, {speed}",
        *_bodies_before(result),
        "",
        f"restitution (energy)   eta = {_with_error(result.restitution, result.restitution_error)}"
        + relative,
        f"restitution (speed)    e   = {result.kinematic_restitution:.6g}{relative}",
        f"contacts               {result.contacts}, the last at t = {result.last_contact_time:.6g}",
        f"end                    {result.ending}: {_ENDINGS[result.ending].format(other)}",
        *_bodies_after(result),
        f"bond lengths           {result.bond_min:.4g} to {result.bond_max:.4g}",
        f"energy drift           {result.energy_drift:.1e}",
        f"momentum residual      {result.momentum_residual:.1e} {_whole_mass(result)} v0",
    ]
    if result.fragments > 1:
        lines.append(f"fragments              {result.fragments} at the last contact: bonds broke")
    if result.crossed:
        lines.append("crossed                particles passed through each other on paper")
    lines += [
        "",
        f"run by {result.engine}: {_meeting(result)}, {result.scheme}{step}{table}",
        f"time {result.seconds:.3g} s for the number, {result.seconds_total:.3g} s in all",
    ]
    return "\n".join(lines)


# More masses than these are not all shown.
_MOST_MASSES = 6


def _list(masses: tuple[float, ...]) -> str:
    shown = ", ".join(f"{mass:.6g}" for mass in masses[:_MOST_MASSES])
    return shown if len(masses) <= _MOST_MASSES else f"{shown}, ... ({len(masses)} in all)"


def _count(particles: int) -> str:
    return "1 particle" if particles == 1 else f"{particles} particles"


def _bodies_before(result: Collision) -> list[str]:
    """Describe what the scene has more than a cold chain of unit masses and a hard wall."""
    lines = []
    if result.masses is not None:
        lines.append(f"masses {_list(result.masses)} from the contact outward")
    if result.target_particles is not None:
        masses = _list(result.target_masses or (1.0,))
        lines.append(f"onto a free target: {_count(result.target_particles)}, masses {masses}")
    if result.contact is not None:
        lines.append(
            f"soft contact: K d^q of the overlap d, K = {result.contact_stiffness:.6g}, "
            f"q = {result.contact_exponent:.6g}"
        )
    if result.initial is not None:
        lines.append(f"initial state of {result.initial}")
    if result.compression is not None:
        lines.append(f"bonds shorter by {result.compression:.6g} at first")
    if result.temperature is not None:
        lines.append(f"warm at first: T = {result.temperature:.6g}, seed {result.seed}")
    return lines


def _bodies_after(result: Collision) -> list[str]:
    """Say where momentum and energy went; nothing for a plain scene, whose eta says it."""
    if result.velocity_after is None:
        return []
    text = "{:22} velocity {:.6g}, translation {:.6g}, vibration {:.6g}"
    chain = (result.velocity_after, result.translational_energy, result.vibrational_energy)
    lines = [text.format("chain", *chain)]
    if result.target_particles is not None:
        lines.append(
            text.format(
                "target",
                result.target_velocity_after,
                result.target_translational_energy,
                result.target_vibrational_energy,
            )
        )
    return lines


def _whole_mass(result: Collision) -> str:
    return "n" if result.velocity_after is None else "M"


def _meeting(result: Collision) -> str:
    """Name what particle 1 meets: a wall only where there is one."""
    kind = "soft" if result.contact is not None else result.wall
    return f"{kind} wall" if result.target_particles is None else f"{kind} contact"
