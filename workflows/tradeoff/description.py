"""A study in words: the cheapest settings, the error by cause, the advice."""

from chaincor.workflows.tradeoff.budget import CAUSES
from chaincor.workflows.tradeoff.front import describe, format_seconds
from chaincor.workflows.tradeoff.study import Tradeoff


def _column(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"


def describe_study(study: Tradeoff) -> str:
    """Describe a study for people: the cheapest settings, the error budgets and the advice."""
    truth, scene = study.truth, study.scene
    lines = [
        f"{scene.particles} particles, {scene.label} bonds, v0 = {scene.impact_velocity:.6g}",
        f"eta = {truth.restitution:.14g} +- {truth.restitution_error:.0e} ({truth.source})",
        "",
        "cheapest settings: the error of eta that each keeps, with a reserve; measured errors",
        "of eta, of the last contact's time, of mode energies; time of the integration",
        f"    {'kept':>5}  {'eta':>7}  {'contact':>7}  {'modes':>7}  {'time':>8}  setting",
    ]
    for engine, rows in study.cheapest.items():
        lines.append(f"  {'LAMMPS' if engine == 'lammps' else 'in-house engine'}")
        lines += [
            f"    {row.error:.0e}  {row.measured_error:7.1e}  {row.contact_time_error:7.1e}  "
            f"{row.mode_energy_error:7.1e}  {format_seconds(row.seconds):>8}  "
            f"{describe(row.setting)}"
            for row in rows
        ]
        if not rows:
            lines.append("    none was good to 1e-2")
    lines += ["", "error of eta by cause:"]
    lines.append("    " + "".join(f"{name:>12}" for name in ("", *CAUSES, "total")))
    for budget in study.budgets:
        cells = [_column(value) for value in budget.parts().values()]
        lines.append(
            "    " + "".join(f"{c:>12}" for c in (budget.name, *cells, _column(budget.total)))
        )
    lines.append(
        "    (output: if read from a default dump, six digits; with the 17 digits of chaincor's "
        f"dumps {study.budgets[0].output_exact:.0e})"
        if study.budgets
        else "    none"
    )
    if study.own_tables:
        lines += ["", "error of eta from linear tables over this scene's own bond lengths:"]
        told = (f"{p.rows} rows {p.restitution_error:.0e}" for p in study.own_tables)
        lines.append("    " + ", ".join(told))
    if study.stock:
        lines += ["", "the stock reflecting wall (median, rms, worst over phases):"]
        lines += [
            f"    H {m.setting.timestep:<8.4g} {m.median_error:.1e}  {m.rms_error:.1e}  "
            f"{m.worst_error:.1e}  {format_seconds(m.time):>8}"
            for m in study.stock
        ]
    if study.failed:
        lines += ["", f"{len(study.failed)} settings with too large a step did not run"]
    lines += ["", f"advice: {study.advice}", f"({study.seconds:.0f} s)"]
    return "\n".join(lines)
