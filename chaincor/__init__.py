"""
Compute the restitution of a one-dimensional chain at a wall, with an error bar.

The names that most scripts need are here: ``from chaincor import Scene, collide``. They are
imported at first use, so ``import chaincor`` costs nothing. Scenes and LAMMPS files are in
``chaincor.lammps_inputs``, the step from results to physics is in ``chaincor.analysis`` (which
needs no LAMMPS), and everything that runs is in ``chaincor.workflows``.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from chaincor.analysis.job_analysis import analyze_job as analyze_job
    from chaincor.analysis.job_folder import find_job as find_job
    from chaincor.lammps_inputs.bonds.user_bond import UserBond as UserBond
    from chaincor.lammps_inputs.scene import Scene as Scene
    from chaincor.workflows.campaign.collide_many import collide_many as collide_many
    from chaincor.workflows.campaign.ensemble import Ensemble as Ensemble
    from chaincor.workflows.campaign.sweep import sweep as sweep
    from chaincor.workflows.collision import collide as collide
    from chaincor.workflows.job import write_job as write_job
    from chaincor.workflows.job_analysis.analyze import analyze as analyze
    from chaincor.workflows.reproduce.reproduction import reproduce as reproduce
    from chaincor.workflows.result import Collision as Collision
    from chaincor.workflows.scripts.study import timestep_study as timestep_study
    from chaincor.workflows.store.export import to_pandas as to_pandas
    from chaincor.workflows.store.results_store import Store as Store
    from chaincor.workflows.tables.check import check_table as check_table
    from chaincor.workflows.tradeoff.study import tradeoff as tradeoff
    from chaincor.workflows.validation.comparison import validate as validate

_HOMES = {
    "Collision": "chaincor.workflows.result",
    "Ensemble": "chaincor.workflows.campaign.ensemble",
    "Scene": "chaincor.lammps_inputs.scene",
    "Store": "chaincor.workflows.store.results_store",
    "UserBond": "chaincor.lammps_inputs.bonds.user_bond",
    "analyze": "chaincor.workflows.job_analysis.analyze",
    "analyze_job": "chaincor.analysis.job_analysis",
    "check_table": "chaincor.workflows.tables.check",
    "collide": "chaincor.workflows.collision",
    "collide_many": "chaincor.workflows.campaign.collide_many",
    "find_job": "chaincor.analysis.job_folder",
    "reproduce": "chaincor.workflows.reproduce.reproduction",
    "sweep": "chaincor.workflows.campaign.sweep",
    "timestep_study": "chaincor.workflows.scripts.study",
    "to_pandas": "chaincor.workflows.store.export",
    "tradeoff": "chaincor.workflows.tradeoff.study",
    "validate": "chaincor.workflows.validation.comparison",
    "write_job": "chaincor.workflows.job",
}

__all__ = [
    "Collision",
    "Ensemble",
    "Scene",
    "Store",
    "UserBond",
    "analyze",
    "analyze_job",
    "check_table",
    "collide",
    "collide_many",
    "find_job",
    "reproduce",
    "sweep",
    "timestep_study",
    "to_pandas",
    "tradeoff",
    "validate",
    "write_job",
]


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    value = getattr(importlib.import_module(_HOMES[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_HOMES})
