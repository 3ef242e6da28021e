"""``chaincor analyze``: from the dump of a LAMMPS job to the physics of the collision."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.analysis.showing.numbers import eta_of_dump
from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.errors import InputError
from chaincor.lammps_inputs.scene import POTENTIAL_NAMES
from chaincor.workflows.commands.scene_options import NamedNumbers, WordChoice
from chaincor.workflows.json_output import json_text

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chaincor.analysis.dumps.view import DumpView
    from chaincor.analysis.job_folder import Job
    from chaincor.analysis.results import CollisionAnalysis
    from chaincor.analysis.two_bodies.results import TwoBodyAnalysis
    from chaincor.lammps_inputs.scene import Scene
    from chaincor.lammps_inputs.units.unit_system import UnitSystem


@click.command()
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--data", type=click.Path(path_type=Path), help="LAMMPS data file [default: found]")
@click.option(
    "--dump", type=click.Path(path_type=Path), help="dump, or trajectory [default: found]"
)
@click.option(
    "--timestep",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="H",
    help="simulated time per step, for dumps without the time [default: from log or script]",
)
@click.option(
    "--potential",
    type=WordChoice(POTENTIAL_NAMES),
    help="bond potential [default: that of scene.toml]",
)
@click.option("--toda-b", type=float, metavar="B", help="steepness b of the toda bond")
@click.option("--morse-a", type=float, metavar="A", help="inverse width a of the morse bond")
@click.option("--power-order", type=int, metavar="R", help="order of the power bond")
@click.option("--power-c", type=float, metavar="C", help="coefficient of the power bond")
@click.option("--bond-file", type=click.Path(path_type=Path), help="bond table, for table")
@click.option("--energy", metavar="TEXT", help="U as a formula of s or r, for formula")
@click.option(
    "--parameters", type=NamedNumbers(), metavar="NAME=X,...", help="its other names' values"
)
@click.option(
    "--velocity",
    type=click.FloatRange(min=0.0, min_open=True),
    metavar="V",
    help="impact speed, absolute [default: from scene.toml or the first frame]",
)
@click.option(
    "--masses",
    metavar="M,...|FILE",
    help="particle masses from the wall outwards, repeated along the chain: a list, or a file of "
    "them [default: from dump or data file]",
)
@click.option(
    "--target-particles",
    type=click.IntRange(min=1),
    metavar="M",
    help="the particles at the lowest x are a free target [default: from scene.toml, or the "
    "column mol of the dump]",
)
@click.option("--wall", type=float, metavar="X", help="where the wall is [default: 0]")
@click.option(
    "--direction",
    type=click.Choice(["-x", "+x"]),
    help="which way the chain moves before it meets the wall [default: -x]",
)
@click.option(
    "--length", metavar="L|auto", help="natural length of a bond; auto: as in the first frame"
)
@click.option("--mass", type=float, metavar="M", help="of a particle, for --units")
@click.option("--stiffness", type=float, metavar="K", help="of a bond at rest, for --units")
@click.option(
    "--units",
    type=click.Choice(["lj", "metal", "real", "si"]),
    help="of the dump; with --length, --mass and --stiffness [default: units.toml, else lj]",
)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), metavar="OUT", help="write plots and CSV"
)
@click.option(
    "--animation",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="write a moving picture (.gif; .mp4 with ffmpeg)",
)
@click.option(
    "--xyz", type=click.Path(path_type=Path), metavar="FILE", help="write extended XYZ for viewers"
)
@click.option("--json", "as_json", is_flag=True, help="print one JSON object")
def analyze(
    folder: Path,
    data: Path | None,
    dump: Path | None,
    timestep: float | None,
    velocity: float | None,
    masses: str | None,
    target_particles: int | None,
    wall: float | None,
    direction: str | None,
    length: str | None,
    mass: float | None,
    stiffness: float | None,
    units: str | None,
    output: Path | None,
    animation: Path | None,
    xyz: Path | None,
    as_json: bool,
    **bond_options: Any,
) -> None:
    """
    Turn the dump of a LAMMPS job into restitution, contacts, modes and plots.

    DIR is the folder of a job: one made by 'chaincor inputs' or your own, with a dump of at least
    'id x vx' (text, gzip or binary) and, if you like, the data file. Lengths are in units of the
    natural bond length, the wall is at x = 0. Trajectories of other formats, with velocities, are
    read through ASE (.extxyz, .xyz, .traj) or MDAnalysis (.trr, .nc, .ncdf).

    Where DIR holds, in folders of their own, jobs of the same collision at different steps, the
    finest is analysed and the others tell its error.

    Of a free target or a soft wall the velocities, energies and modes of both bodies are told;
    contacts are not.

    The exit status is 1 where the numbers contradict physics: restitution above what the energy of
    the first frame allows, which is 1 for a cold chain, or momentum that no wall explains. A note
    says so.
    """
    from chaincor.analysis.analysis_files import to_json_object, write_report
    from chaincor.analysis.dumps.other_formats import write_extended_xyz
    from chaincor.analysis.two_bodies.results import TwoBodyAnalysis
    from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS
    from chaincor.workflows.job_analysis import analyze_found

    wanted = {"length": length, "mass": mass, "stiffness": stiffness, "style": units}
    drawn: dict[str, Any] = {"output": output, "animation": animation, "xyz": xyz}
    drawn |= {"wall": wall, "direction": direction, "length": length}
    drawn |= {"mass": mass, "stiffness": stiffness, "units": units}
    see = cache(lambda job: _view(job, wanted, wall, direction))
    job, analysis = analyze_found(
        folder,
        data=data,
        dump=dump,
        bond=_bond(bond_options),
        velocity=velocity,
        timestep=timestep,
        masses=None if masses is None else _read_masses(masses),
        target_particles=target_particles,
        for_walls=[name for name, value in drawn.items() if value is not None],
        watch=_progress,
        see=see,
    )
    if isinstance(analysis, TwoBodyAnalysis):
        bodies = analysis.to_dict()
        click.echo(json_text(bodies, _scene_of(job)) if as_json else describe_bodies(analysis))
        return
    if output is not None:
        write_report(analysis, output)
    if animation is not None:
        _animate(analysis, animation)
    if xyz is not None:
        write_extended_xyz(job.dump, xyz, analysis.timestep or 1.0, analysis.masses)
    known = see(job).units
    if as_json:
        found = to_json_object(analysis)
        if known != CHAIN_UNITS:
            found["units"] = known.to_dict()
        click.echo(json_text(found, _scene_of(job)))
    else:
        click.echo(describe(analysis))
        if known != CHAIN_UNITS:
            click.echo(_in_units(analysis, known))
    if analysis.contradictions:
        click.get_current_context().exit(1)


def _view(
    job: "Job", wanted: dict[str, Any], wall: float | None, direction: str | None
) -> "DumpView":
    """Return how to see a dump: as the options say, or as the file beside it does."""
    from chaincor.analysis.dumps.other_trajectories import open_trajectory
    from chaincor.analysis.dumps.view import DumpView
    from chaincor.analysis.job_folder import view_of
    from chaincor.lammps_inputs.units.unit_system import UnitSystem

    view = view_of(job)
    given = {name: value for name, value in wanted.items() if value is not None}
    auto = given.get("length") == "auto"
    if given:
        style = given.get("style", "lj")
        missing = [name for name in ("length", "mass", "stiffness") if name not in given]
        if style != "lj" and missing:
            raise InputError(
                f"--units {style} is given without --{missing[0]}; expected --length, --mass and "
                "--stiffness beside it: the chain's own units in those of the dump"
            )
        fields: dict[str, Any] = {
            "length": 1.0,
            "mass": 1.0,
            "stiffness": 1.0,
            "style": "lj",
        } | given
        try:
            fields["length"] = 1.0 if auto else float(fields["length"])
        except ValueError:
            raise InputError(
                f"--length is {str(fields['length'])[:40]!a}; expected a number or auto"
            ) from None
        view = DumpView(UnitSystem.from_fields(fields))
    if wall is not None or direction is not None:
        if wall is not None and not math.isfinite(wall):
            raise InputError(f"--wall is {wall}; expected a finite number")
        view = replace(view, wall=wall or 0.0, upwards=direction == "+x")
    return view.with_length_of(open_trajectory(job.dump).first()) if auto else view


def _in_units(analysis: "CollisionAnalysis", units: "UnitSystem") -> str:
    """Say the main results in the user's units."""
    last = analysis.contact_statistics.last_time
    text = f"in units {units.style}: v0 = {analysis.velocity * units.speed:.6g}"
    if last is not None:
        text += f", the last contact at t = {last * units.time:.6g}"
    return f"{text}; lengths x {units.length:g}, times x {units.time:.6g}"


def describe_bodies(found: "TwoBodyAnalysis") -> str:
    """Describe two bodies for people."""
    targets, bond = found.target_masses.size, found.bond
    other = f"a free target of {targets}" if targets else "a soft wall"
    lines = [
        f"{found.masses.size} particles and {other}, {'unknown' if bond is None else bond.name} "
        f"bonds, v0 = {found.velocity:.6g}, {found.frames} frames",
        "",
        f"restitution (energy)   eta = {eta_of_dump(found.restitution, None, found.data_error)}",
        f"restitution (speed)    e   = {found.kinematic_restitution:.6g}",
        "contacts               not told",
    ]
    bodies = [("chain", found.velocity_after, found.energy)]
    if targets:
        bodies.append(("target", found.target_velocity_after, found.target_energy))
    for name, velocity, energy in bodies:
        text = f"{name:22} velocity {velocity:.6g}"
        if energy is not None:
            text += f", translation {energy.translation:.6g}, vibration {energy.vibration:.6g}"
        lines.append(text)
    if found.energy_drift is not None:
        lines.append(f"energy drift           {found.energy_drift:.1e}")
    if targets:
        lines.append(f"momentum residual      {found.momentum_residual:.1e} M v0")
    return "\n".join([*lines, "", *(f"note: {caveat}" for caveat in found.caveats)])


def describe(analysis: "CollisionAnalysis") -> str:
    """Describe the results for people, in some lines with the caveats at the end."""
    statistics = analysis.contact_statistics
    bond = analysis.bond
    speed = f"v0 = {analysis.velocity:.6g}"
    if bond is not None and bond.natural_speed is not None:
        speed += f" = {analysis.velocity / bond.natural_speed:.6g} v*"
    name = "unknown" if bond is None else bond.name
    contacts = f"at least {statistics.count}" if analysis.contacts is None else statistics.count
    eta = eta_of_dump(analysis.restitution, analysis.restitution_error, analysis.data_error)
    lines = [
        f"{analysis.particles} particles, {name} bonds, {speed}, {analysis.frames} frames",
        "",
        f"restitution (energy)   eta = {eta}",
        f"restitution (speed)    e   = {analysis.kinematic_restitution:.6g}",
        f"contacts               {contacts}, the last at t = {_number(statistics.last_time)}",
        f"f/n                    {statistics.per_particle:.4g}",
    ]
    if statistics.mean_interval is not None:
        lines += [
            f"interval               {statistics.mean_interval:.6g} on average, "
            f"median {statistics.median_interval:.6g}",
        ]
    lines += [
        f"incoming speed         {_number(statistics.mean_speed)} v0 on average",
        f"momentum residual      {analysis.momentum_residual:.1e} of that at impact",
    ]
    if analysis.energy_end is not None:
        share = 100.0 * float(analysis.energy_end.vibration / analysis.energy_end.total)
        lines += [
            f"energy drift           {analysis.energy_drift:.1e}",
            f"vibration              {share:.4g} % of the energy, "
            f"anharmonic remainder {analysis.anharmonic_remainder:.3g}",
        ]
    if analysis.particles > 1:
        if analysis.restitution_bound is None or analysis.restitution_bound > _WARM:
            lines.append(f"strongest at first     {_strongest(analysis.mode_energies_start)}")
        lines += [
            f"strongest modes        {_strongest(analysis.mode_energies)}",
            f"bond lengths           {analysis.bond_min:.4g} to {analysis.bond_max:.4g}",
        ]
    return "\n".join([*lines, "", *(f"note: {caveat}" for caveat in analysis.caveats)])


def _strongest(energies: "NDArray[np.float64]") -> str:
    """Return the three modes of most energy, with their shares of that of all."""
    strongest = sorted(enumerate(energies[1:], start=1), key=lambda e: -e[1])[:3]
    total = float(energies.sum())
    return ", ".join(f"j = {j}: {100.0 * energy / total:.3g} %" for j, energy in strongest)


# A chain whose inner motion is more than so much of its energy came warm.
_WARM = 1.0 + 1e-9


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"


def _bond(options: dict[str, Any]) -> Potential | None:
    """Return the bond the options name, checked as in a scene; None where they name none."""
    from chaincor.lammps_inputs.errors import SceneError
    from chaincor.lammps_inputs.scene import Scene

    given = {key: value for key, value in options.items() if value is not None}
    if not given:
        return None
    if "potential" not in given:
        raise SceneError(f"{', '.join(given)} given without --potential; expected its potential")
    return Scene(**given).bond


def _read_masses(text: str) -> list[float]:
    """Read ``1,2``, or the numbers in a file of that name."""
    words = text
    if Path(text).is_file():
        words = Path(text).read_text(encoding="utf-8", errors="replace")
    try:
        return [float(word) for word in words.replace(",", " ").split()]
    except ValueError:
        shown = text if len(text) <= 60 else f"{text[:57]}..."
        raise InputError(
            f"masses '{shown}' are neither numbers nor a file of numbers; expected them from the "
            "wall outwards, as --masses 1,2 or --masses FILE"
        ) from None


def _animate(analysis: "CollisionAnalysis", path: Path) -> None:
    from chaincor.analysis.analysis_files import describe as caption
    from chaincor.analysis.figures.animation import animate_collision

    history = analysis.history
    # A little beyond the last contact there is nothing more to see.
    shown = history.times <= 1.25 * (analysis.contact_statistics.last_time or history.times[-1])
    animate_collision(
        history.times[shown],
        history.displacements[shown],
        history.velocities[shown],
        path,
        impact_velocity=analysis.velocity,
        title=caption(analysis),
    )


@contextmanager
def _progress(dump: Path) -> Iterator[Callable[[int], None] | None]:
    """Show how much of the dump has been read; quiet when stderr is not a terminal."""
    from rich.console import Console
    from rich.progress import BarColumn, DownloadColumn, Progress, TextColumn, TimeRemainingColumn

    console = Console(stderr=True)
    if not console.is_terminal or not dump.exists():
        yield None
        return
    columns = (TextColumn("reading {task.description}"), BarColumn(), DownloadColumn())
    with Progress(*columns, TimeRemainingColumn(), console=console, transient=True) as bar:
        task = bar.add_task(dump.name, total=dump.stat().st_size)
        yield lambda position: bar.update(task, completed=position)


def _scene_of(job: "Job") -> "Scene | None":
    """Return the scene that lies beside a job, where it has one."""
    from chaincor.lammps_inputs.scene import Scene

    return None if job.scene is None else Scene.from_file(job.scene)
