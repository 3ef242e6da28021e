"""Build the live page, an HTML file in which a browser computes and shows collisions."""

import json
from pathlib import Path

from chaincor.analysis.figures import style
from chaincor.lammps_inputs.bonds.potentials import CHAIN_POTENTIALS, BondKeys
from chaincor.workflows.engines.schemes import STEP_SCHEMES
from chaincor.workflows.pictures.bond_script import bonds_form, bonds_script
from chaincor.workflows.versions import versions

MOST_PARTICLES = 500
_FOLDER = Path(__file__).parent / "live"
# The page and its workers share the scripts of the kernel. The other scripts are only in the page.
_KERNEL = ("bonds", "line", "ending", "warm", "modes", "film", "collide")
_PAGE = ("figures", "pictures", "graphs", "form", "words", "page", "controls")


def kernel_source() -> str:
    """Return the JavaScript of ``collide(scene)``, ``prepare(scene)`` and their helpers."""
    fractions = STEP_SCHEMES["order8"].fractions
    weights = {"KICKS": fractions.kicks.tolist(), "DRIFTS": fractions.drifts.tolist()}
    constants = [f"const {name} = {json.dumps(values)};" for name, values in weights.items()]
    return "\n".join(['"use strict";', *constants, bonds_script(), *map(_part, _KERNEL)])


def live_page(particles: int = 50) -> str:
    """Return the live page, a single file that works without server and network."""
    settings = {
        "particles": particles,
        "mostParticles": MOST_PARTICLES,
        "version": versions()["chaincor"],
    }
    colours = {
        name: getattr(style, name.upper())
        for name in ("blue", "orange", "green", "vermilion", "purple", "sky", "grey")
    }
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(_FOLDER), undefined=StrictUndefined, autoescape=False
    )
    return environment.get_template("page.html.j2").render(
        style=(_FOLDER / "page.css").read_text(encoding="utf-8"),
        colours=colours,
        settings=json.dumps(settings),
        kernel=kernel_source(),
        page="\n".join(map(_part, _PAGE)),
        most_particles=MOST_PARTICLES,
        bonds={name: cls.title for name, cls in CHAIN_POTENTIALS.items()},
        bond_numbers=bonds_form(),
        first_bond=BondKeys.model_fields["potential"].default,
    )


def _part(name: str) -> str:
    return (_FOLDER / f"{name}.js").read_text(encoding="utf-8")
