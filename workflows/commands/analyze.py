"""Implement ``chaincor analyze``: restitution, contacts and modes from the dump of a job."""

import math
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from chaincor.lammps_inputs.bonds.potential import Potential
from chaincor.lammps_inputs.bonds.potentials import BOND_KEYS
from chaincor.lammps_inputs.errors import InputError
from chaincor.workflows.commands.options import (
    ONE_OR_MORE,
    PATH,
    POSITIVE,
    json_option,
    option,
    tell,
    tell_page,
)
from chaincor.workflows.commands.scene_options import bond_options

if TYPE_CHECKING:
    from chaincor.analysis.dumps.view import DumpView
    from chaincor.analysis.job_folder import Job


@click.command()
@click.argument("folder", metavar="DIR", type=PATH)
@option("--data", "LAMMPS data file [default: the one in DIR]", PATH)
@option("--dump", "dump or trajectory to read [default: the one in DIR]", PATH)
@option(
    "--timestep H",
    "simulated time per step, if the dump does not contain the time [default: from log or script]",
    POSITIVE,
)
@option(
    "--scene FILE",
    "scene file of the job, with bonds, speed and target [default: scene.toml in DIR]. Options of "
    "'chaincor run' such as --potential toda can also give the bonds",
    PATH,
)
@bond_options
@option(
    "--velocity V", "impact speed, absolute [default: from scene.toml or the first frame]", POSITIVE
)
@option(
    "--masses M,...|FILE",
    "particle masses from the wall outwards, as a list or a file, repeated "
    "along the chain [default: from dump, data file or scene]",
)
@option(
    "--target-particles M",
    "number of particles of a free target, which are those at the lowest x "
    "[default: from scene.toml, or the column mol of the dump]",
    ONE_OR_MORE,
)
@option("--wall X", "position of the wall [default: from log or script, or 0]", float)
@option(
    "--direction",
    "direction in which the chain moves before the impact [default: from log or script, or -x]",
    click.Choice(["-x", "+x"]),
)
@option("--length L|auto", "natural length of a bond; auto takes it from the first frame")
@option("--mass M", "mass of a particle, for --units", float)
@option("--stiffness K", "stiffness of a bond at rest, for --units", float)
@option(
    "--units",
    "LAMMPS unit style of the dump; needs --length, --mass and --stiffness "
    "[default: units.toml, or springs and masses of log or script, or lj]",
    click.Choice(["lj", "metal", "real", "si"]),
)
@option(
    "-o, --output OUT",
    "write a page (analysis.html) with figures, CSV and JSON into this folder",
    PATH,
)
@option("--animation FILE", "write an animation (.gif, or .mp4 with ffmpeg)", PATH)
@option("--xyz FILE", "write the motion as extended XYZ, for viewers", PATH)
@json_option
def analyze(
    folder: Path,
    output: Path | None,
    animation: Path | None,
    xyz: Path | None,
    as_json: bool,
    **options: Any,
) -> None:
    """
    Turn the dump of a LAMMPS job into restitution, contacts, modes and plots.

    DIR is the folder of a job that 'chaincor inputs' or you wrote. Its dump (text, gzip or binary)
    needs at least the columns 'id x vx'. A data file is optional. By default, lengths are in units
    of the natural bond length, and the wall is at x = 0. ASE reads trajectories with velocities in
    .extxyz, .xyz and .traj, and MDAnalysis reads .trr, .nc and .ncdf.

    If DIR contains several folders with the same collision at different time steps, the command
    analyses the run with the smallest step, and finds its error from the other runs.

    The command analyses a free target like the chain. It does not count contacts of soft bodies,
    because these contacts last for a finite time.

    The exit status is 1, with a note, if the results contradict physics. Examples are a restitution
    larger than the energy of the first frame allows (1 for a chain without vibrations), and a
    momentum that changes without a contact with the wall.
    """
    from chaincor.analysis.analysis_files import to_json_object, write_analysis
    from chaincor.analysis.collision_figures import animate
    from chaincor.analysis.dumps.other_formats import write_extended_xyz
    from chaincor.analysis.figures.animation import judge_animation
    from chaincor.analysis.output_paths import judge_folder, judge_output
    from chaincor.analysis.step_error import analyze_folder
    from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS
    from chaincor.workflows.campaign.progress import reading_progress
    from chaincor.workflows.engines.ending import argue_end
    from chaincor.workflows.job_analysis.description import describe_analysis, describe_in_units
    from chaincor.workflows.job_analysis.page import HOLDS, PAGE, write_analysis_page
    from chaincor.workflows.outputs import refuse_overwriting_inputs

    analysis = analyze_folder(
        folder,
        **{name: options[name] for name in ("data", "dump", "scene", "timestep")},
        bond=_bond({name: options[name] for name in ("potential", *BOND_KEYS)}),
        impact_velocity=options["velocity"],
        masses=_masses(options["masses"]),
        target_particles=options["target_particles"],
        watch=reading_progress,
        see=partial(_view, options=options),
        end_argument=argue_end,
    )
    job = analysis.job
    assert job is not None
    units = job.view.units
    read = [path for _, path in job.files]
    for option_name, path in {"--animation": animation, "--xyz": xyz}.items():
        if path is not None:
            refuse_overwriting_inputs(path, read, option_name)
            if option_name == "--xyz":
                judge_output(path, "xyz")
            else:
                judge_animation(path)
    if output is not None:
        judge_folder(output, "analysis.json", (*HOLDS, PAGE))
    found, lines = to_json_object(analysis), [describe_analysis(analysis)]
    if units != CHAIN_UNITS:
        found["units"] = units.to_dict()
        lines.append(describe_in_units(analysis, units))
    # Pictures come last, because they may fail after the results have been printed and written.
    tell(found, "\n".join(lines), as_json, job.loaded_scene)
    if xyz is not None:
        both = [body.masses for body in analysis.bodies.values()]
        write_extended_xyz(job.frames(), xyz, analysis.timestep or 1.0, *both)
    if animation is not None:
        animate(analysis, animation)
    if output is not None:
        more = {animation: "moving picture", xyz: "the motion, for viewers of atoms"}
        beside = {path: what for path, what in more.items() if path is not None}
        write_analysis(
            analysis,
            output,
            finish=lambda made: write_analysis_page(analysis, made, beside, units),
        )
        tell_page(output / PAGE, as_json)
    if analysis.contradictions:
        raise click.exceptions.Exit(1)


def _view(job: "Job", options: dict[str, Any]) -> "DumpView":
    """Return the units, wall and direction of a dump, from options or otherwise from the job."""
    from chaincor.analysis.dumps.other_trajectories import open_trajectory
    from chaincor.lammps_inputs.units.unit_system import CHAIN_UNITS, UnitSystem

    view, wall = job.view, options["wall"]
    wanted = {name: options[name] for name in ("length", "mass", "stiffness")}
    wanted["style"] = options["units"]
    given = {name: value for name, value in wanted.items() if value is not None}
    auto = given.get("length") == "auto"
    if given:
        style = given.get("style", "lj")
        missing = [name for name in ("length", "mass", "stiffness") if name not in given]
        if style != "lj" and missing:
            raise InputError(
                f"--units {style} is given without --{missing[0]}. Give --length, "
                "--mass and --stiffness, which convert the units of the chain to the "
                "units of the dump"
            )
        fields: dict[str, Any] = asdict(CHAIN_UNITS) | given
        try:
            fields["length"] = 1.0 if auto else float(fields["length"])
        except ValueError:
            raise InputError(
                f"--length is {str(fields['length'])[:40]!a}. Give a number or auto"
            ) from None
        view = replace(view, units=UnitSystem.from_fields(fields))
    if wall is not None:
        if not math.isfinite(wall):
            raise InputError(f"--wall is {wall}. Give a finite number")
        view = replace(view, wall=wall)
    if options["direction"] is not None:
        view = replace(view, upwards=options["direction"] == "+x")
    return view.with_length_of(open_trajectory(job.dump).first()) if auto else view


def _bond(options: dict[str, Any]) -> Potential | None:
    """Return the bond that options describe, checked as in a scene; None without options."""
    from chaincor.lammps_inputs.errors import SceneError
    from chaincor.lammps_inputs.scene import Scene

    given = {key: value for key, value in options.items() if value is not None}
    if not given:
        return None
    if "potential" not in given:
        raise SceneError(f"{', '.join(given)} given without --potential. Add --potential")
    return Scene(**given).bond


def _masses(text: str | None) -> list[float] | None:
    """Return masses from a list such as ``1,2``, or from a file with that name."""
    from chaincor.lammps_inputs.scene_parts.given_masses import read_masses

    try:
        return None if text is None else read_masses(text)
    except ValueError as error:
        raise InputError(f"--masses is {text!a:.60}: {error}") from None
