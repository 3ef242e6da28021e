"""The paper's slips: what is printed, what is right, and a check computed anew each time."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from analysis.modes import mode_frequencies
from analysis.pair_theory import pair_interval_slope
from analysis.restitution import restitution
from analysis.theory import (
    HARMONIC_DISSIPATION_COEFFICIENT,
    PAIR_CONTACTS_PER_PARTICLE,
    PAIR_INTERVAL,
    PAIR_SPEED,
    basile_dumont_energies,
    contact_mode_energies,
)
from lammps_inputs.potentials import LennardJones
from lammps_inputs.scene import Scene
from workflows.engines import modal

_CHAIN = 50


@dataclass(frozen=True)
class Slip:
    """
    A slip, or an equation that was suspected and found right.

    Attributes
    ----------
    where : str
        Place in the paper.
    printed : str
        What it prints.
    correct : str
        What it should be; empty where the print is right.
    evidence : str
        The check, with its numbers.
    confirmed : bool
        Whether the check came out as said.
    """

    where: str
    printed: str
    correct: str
    evidence: str
    confirmed: bool


def all_slips() -> tuple[Slip, ...]:
    """
    Re-derive the paper's equations numerically.

    Returns
    -------
    tuple of Slip
        In the order of the paper.
    """
    checks: tuple[Callable[[], Slip], ...] = (
        _viscoelastic_exponent,
        _particle_order,
        _chain_length,
        _reduced_units,
        _frequencies,
        _mode_energies,
        _pair_estimates,
        _contacts_bracket,
        _energy_balance,
        _harmonic_law,
        _zero_of_energy,
        _scale_equation,
        _bond_argument,
        _alpha,
        _dropped_speed,
        _mode_energy_power_of_pi,
        _integrand,
        _rounded_constant,
        _dissipation_or_increase,
    )
    return tuple(check() for check in checks)


def _viscoelastic_exponent() -> Slip:
    """Integrate m x'' = -x^(3/2) - a x^(1/2) x' through a contact at two speeds."""
    from scipy.integrate import solve_ivp

    def dissipated(speed: float) -> float:
        def rates(_t, y):
            x = max(y[0], 0.0)
            return [y[1], -(x**1.5) - 1e-3 * math.sqrt(x) * y[1]]

        def leaves(_t, y):
            return y[0]

        leaves.terminal, leaves.direction = True, -1.0  # type: ignore[attr-defined]
        end = solve_ivp(
            rates, (0.0, 50.0 * speed**-0.2), [0.0, speed], events=leaves, rtol=1e-10, atol=1e-14
        )
        return 1.0 - (end.y[1, -1] / speed) ** 2

    exponent = math.log(dissipated(0.1) / dissipated(0.01)) / math.log(10.0)
    return Slip(
        "I, introduction",
        "viscoelastic spheres: 1 − η grows with the exponent 2/5",
        "1/5: the loss per collision is ∝ v^(11/5), and the energy ∝ v²",
        f"Kuwabara and Kono's contact force integrated at speeds 0.01 and 0.1: exponent "
        f"{exponent:.3f}",
        abs(exponent - 0.2) < 0.02,
    )


def _particle_order() -> Slip:
    """Compare the printed b with the force of the printed Hamiltonian at rest."""
    n = 5
    matrix = 2.0 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1)
    matrix[0, 0] = matrix[-1, -1] = 1.0
    b = np.zeros(n)
    b[0], b[-1] = -1.0, 1.0
    rising, falling = np.arange(1.0, n + 1.0), -np.arange(1.0, n + 1.0)
    residuals = [float(np.max(np.abs(matrix @ x + b))) for x in (rising, falling)]
    return Slip(
        "eqs. (2), (4), (6) and the text",
        "x_n < … < x₁ in the text and b = (−ℓ, 0, …, 0, ℓ); but x_j = ℓj and x_(j+1) − x_j − ℓ",
        "one order: x₁ < x₂ < … < x_n with the wall at x = 0, and b = (ℓ, 0, …, 0, −ℓ); in eq. (2) "
        "the sum runs over j, its terms over i",
        f"force of eq. (4) on a chain at rest: {residuals[0]:g} in the order of eq. (6), "
        f"{residuals[1]:g} in the opposite one",
        residuals[0] > 0.5 and residuals[1] == 0.0,
    )


def _chain_length() -> Slip:
    etas = {}
    for n in (19, 20):
        outcome = modal.run(Scene(potential="harmonic", particles=n, velocity=0.1))
        etas[n] = float(restitution(outcome.velocities, 0.1))
    return Slip(
        "figure 2",
        "n = 19 in the text, n = 20 in the caption",
        "undecided: both are drawn here",
        f"they differ: η = {etas[19]:.6f} (19), {etas[20]:.6f} (20)",
        abs(etas[19] - etas[20]) > 0.01,
    )


def _reduced_units() -> Slip:
    return Slip(
        "II, end of the second page",
        "c_l = τ = 1 together with ℓ = m = k = 1",
        "c_l = 1 only; τ = (n − 1)ℓ/c_l is then n − 1",
        f"for n = 20 the two settings differ by a factor of {20 - 1}",
        True,
    )


def _frequencies() -> Slip:
    matrix = 2.0 * np.eye(_CHAIN) - np.eye(_CHAIN, k=1) - np.eye(_CHAIN, k=-1)
    matrix[0, 0] = matrix[-1, -1] = 1.0
    exact = np.sqrt(np.maximum(np.linalg.eigvalsh(matrix), 0.0))
    j = np.arange(_CHAIN)
    ours = float(np.max(np.abs(exact - mode_frequencies(_CHAIN))[1:]))
    printed = float(np.max(np.abs(exact - np.sort(np.abs(np.sin(np.pi * j / _CHAIN))))))
    return Slip(
        "below eq. (7)",
        "ω_j = sin(πj/n)",
        "ω_j = 2ω sin(πj/2n), of which eq. (11) is the expansion",
        f"eigenvalues of A, n = {_CHAIN}: 2 sin(πj/2n) is right to {ours:.0e}, sin(πj/n) is off by "
        f"up to {printed:.2f}",
        ours < 1e-7 < 0.5 < printed,
    )


def _mode_energies() -> Slip:
    scene = Scene(potential="harmonic", particles=_CHAIN, velocity=0.1)
    outcome = modal.run(scene)
    total = 0.5 * _CHAIN * 0.1**2
    energies = contact_mode_energies(_CHAIN, outcome.contact_times, outcome.contact_speeds)
    lost = 1.0 - float(restitution(outcome.velocities, 0.1))
    difference = abs(float(np.sum(energies)) / total - lost)
    return Slip(
        "eq. (7)",
        "E_j = (4m/n) v² cos²(πj/2n) sin²(…)/sin²(…)",
        "",
        f"right: with the chain's own contacts instead of equal ones the sum over j is 1 − η to "
        f"{difference:.0e} (n = {_CHAIN})",
        difference < 1e-9,
    )


def _pair_estimates() -> Slip:
    outcome = modal.run(Scene(potential="harmonic", particles=2, velocity=0.1))
    interval = float(outcome.contact_times[1])
    speed = float(np.mean(outcome.contact_speeds)) / 0.1
    return Slip(
        "eqs. (8)–(10)",
        "Δt, f and v by solving the collision of n = 2",
        "only Δt = π/√2 comes from n = 2; f = 0.90 n needs f Δt = 2τ, and v = 1.11 v₀ needs the "
        "momentum 2 f v = 2 n v₀ as well",
        f"the chain of two has Δt = {interval:.4f} = π/√2, but f/n = "
        f"{len(outcome.contact_times) / 2:g} and v = {speed:.3f} v₀",
        abs(interval - PAIR_INTERVAL) < 1e-9 and abs(speed - 1.0) < 1e-9,
    )


def _contacts_bracket() -> Slip:
    outcome = modal.run(Scene(potential="harmonic", particles=500, velocity=0.1))
    count = len(outcome.contact_times)
    mean = float(outcome.contact_times[-1]) / (count - 1)
    return Slip(
        "eqs. (8), (9), numbers in brackets",
        "Δt = 2.31, f = 0.867 n at n = 500",
        f"Δt = {mean:.3f}, f = {count} = {count / 500:.3f} n",
        f"0.867 × 500 = {0.867 * 500:.1f} is no whole number; the exact propagator has {count} "
        "contacts, and the paper's three numbers fit together if one or two are missed",
        count == 435,
    )


def _energy_balance() -> Slip:
    n = 1000
    vibration = float(np.sum(basile_dumont_energies(n))) / (0.5 * n)
    final = 2.0 * PAIR_CONTACTS_PER_PARTICLE * PAIR_SPEED - 1.0
    return Slip(
        "eqs. (7)–(10) together",
        "1 − η is the vibrational energy of eq. (7)",
        "eqs. (8)–(10) already fix the momentum, which gives η = 1 exactly: the approximation does "
        "not conserve energy, and eq. (12) rests on its vibrational half",
        f"n = {n}: final velocity from the momentum {final:.6f} v₀, yet vibrational energy "
        f"{vibration:.5f} of the total",
        abs(final - 1.0) < 1e-12 and vibration > 1e-3,
    )


def _harmonic_law() -> Slip:
    without = HARMONIC_DISSIPATION_COEFFICIENT / PAIR_SPEED**2
    n = 100_000
    j = np.arange(1, n)
    phase = math.pi**3 * j**3.0 / (24.0 * float(n) ** 2)
    direct = float(np.sum(8.0 / math.pi**2 / j**2.0 * np.sin(phase) ** 2)) * n ** (2.0 / 3.0)
    return Slip(
        "eq. (12)",
        "1 − η ~ 0.652 n^(−2/3)",
        "",
        f"right, with v² = (π²/8) v0²: closed form {HARMONIC_DISSIPATION_COEFFICIENT:.4f}, the sum "
        f"over j at n = {n} {direct:.4f}; with v = v₀, as in eq. (16), it would be {without:.3f}",
        abs(direct - HARMONIC_DISSIPATION_COEFFICIENT) < 0.01,
    )


def _zero_of_energy() -> Slip:
    x, b = 1.0, 10.0
    lj = (x**-12 - 2.0 * x**-6) / 72.0
    toda = math.exp(-b * (x - 1.0)) / b**2 + (x - 1.0) / b
    log = x - math.log(x)
    return Slip(
        "III, potentials (a)–(c)",
        "U(1) = 0, but the three potentials as printed are not zero there",
        "add 1/72 (lj), −a/b (toda), −1 (log)",
        f"U(1) as printed: {lj:.5f}, {toda:g}, {log:g}",
        0.0 not in (lj, toda, log),
    )


def _scale_equation() -> Slip:
    """Without the shift the printed equation for x* has another root, or none."""
    bond = LennardJones()
    strains = np.linspace(-0.4, -1e-3, 4000)
    printed = bond.energy(strains) - 1.0 / 72.0 - strains**2
    roots = int(np.count_nonzero(np.diff(np.sign(printed))))
    place = float(strains[np.flatnonzero(np.diff(np.sign(printed)))[-1]]) if roots else math.nan
    assert bond.compressed_root is not None
    other = abs(1.0 + place - bond.compressed_root)
    return Slip(
        "III, definition of x*",
        "½U″(1)(x* − 1)² = U(x) − ½U″(1)(x* − 1)²",
        "U(x*) on the right, and U shifted to U(1) = 0",
        f"for lj the shifted equation gives x* = {bond.compressed_root:.4f}; with the printed U it "
        f"would be {1.0 + place:.4f}",
        other > 1e-3,
    )


def _bond_argument() -> Slip:
    value = float(LennardJones().energy(np.array(-0.999)))
    return Slip(
        "eq. (13), Hamiltonian of n = 2",
        "U_LJ(x₂ − x₁ − 1)",
        "U_LJ(x₂ − x₁): U is a function of the length, with its minimum at 1",
        f"at rest the printed argument is 0, where U is infinite (U(0.001) = {value:.0e})",
        value > 1e30,
    )


def _alpha() -> Slip:
    alpha = pair_interval_slope(LennardJones())
    return Slip(
        "eq. (15)",
        "α = 0.808; Δt = π/√2 …",
        f"α = {alpha:.4f}; Δt has the unit 1/ω",
        "first-order perturbation in closed form; LAMMPS at n = 2 has the same limit (see the "
        "verdicts)",
        abs(alpha - 0.8098) < 1e-4,
    )


def _dropped_speed() -> Slip:
    alpha, v, terms = pair_interval_slope(LennardJones()), 1e-3, np.arange(1.0, 2e6)
    series = float(np.sum(np.sin(np.pi * alpha * v * terms) ** 2 / terms**2))
    slope = 8.0 / math.pi**2 * series / v
    return Slip(
        "eqs. (16), (18)",
        "E_j without the factor v², C = 32α/π²",
        "v² = (π²/8) v0² as in eqs. (7) and (10); then C = 4α = 3.24",
        f"(8/π²) Σ sin²(παvj)/j² at v = {v:g}: {slope:.3f} v; 4α = {4.0 * alpha:.3f}",
        abs(slope - 4.0 * alpha) < 0.02,
    )


def _mode_energy_power_of_pi() -> Slip:
    """Compare with the unexpanded formula at small j/n."""
    alpha, v, n, j = 0.8, 0.01, 10_000, 3
    interval = PAIR_INTERVAL * (1.0 - alpha * v)
    exact = float(basile_dumont_energies(n, interval=interval, contact_speed=1.0)[j - 1])
    corrected = 32.0 / (n * math.pi**4) * (n / j) ** 2 * math.sin(math.pi * alpha * v * j) ** 2
    printed = corrected * math.pi**2
    return Slip(
        "after eq. (17)",
        "E_j ≃ 32/(nπ²) (n/j)² sin²[…]",
        "32/(nπ⁴)",
        f"against the unexpanded formula at n = {n}, j = {j}, v = {v}: π⁴ is right to a factor of "
        f"{corrected / exact:.2f}, π² off by {printed / exact:.1f}",
        abs(corrected / exact - 1.0) < 0.05 < abs(printed / exact - 1.0),
    )


def _integrand() -> Slip:
    from scipy.integrate import quad

    alpha = pair_interval_slope(LennardJones())
    # The integral to 200 and the mean of its tail.
    integral = quad(lambda y: np.sinc(y / np.pi) ** 2, 0.0, 200.0, limit=500)[0] + 0.5 / 200.0
    constant = 64.0 * alpha / math.pi**3 * integral
    literal_first = constant / math.pi
    literal_second = constant * alpha
    return Slip(
        "eq. (18)",
        "sin²(αvnx), then ∫ sin²(αx)/x² dx",
        "sin²(παvnx), then ∫ sin²(x)/x² dx = π/2",
        f"taken literally the first line gives C = {literal_first:.2f}, the second "
        f"{literal_second:.2f}; only the corrected ones give {constant:.2f}, the printed 32α/π²",
        abs(constant - 32.0 * alpha / math.pi**2) < 1e-3,
    )


def _rounded_constant() -> Slip:
    value = 32.0 * 0.808 / math.pi**2
    return Slip(
        "eq. (18)",
        "C = 32α/π² ≃ 2.61",
        "2.62 with the paper's own α = 0.808",
        f"32 × 0.808/π² = {value:.4f}",
        round(value, 2) == 2.62,
    )


def _dissipation_or_increase() -> Slip:
    n = 100
    outcome = modal.run(Scene(potential="harmonic", particles=n, velocity=0.1))
    left = 1.0 - float(restitution(outcome.velocities, 0.1))
    return Slip(
        "eqs. (18), (20)",
        "1 − η = C v, 1 − η ∝ (v/v*)^(r−2)",
        "the increase over the harmonic chain of the same length, as figure 6 plots it",
        f"at n = {n}, v → 0 there remains 1 − η = {left:.5f}",
        left > 0.01,
    )


def slips_page(slips: tuple[Slip, ...]) -> str:
    """
    Write the slips as a page of the documentation.

    Parameters
    ----------
    slips : tuple of Slip
        From :func:`all_slips`.

    Returns
    -------
    str
        Markdown, which ``docs/paper_slips.md`` holds.
    """
    parts = [
        "# Slips of the paper\n\n"
        "S. Nagahiro and Y. Hayakawa, *Collision of one-dimensional nonlinear chains*, "
        "Phys. Rev. E 67, 036609 (2003), derived again equation by equation. Equations are "
        "counted as in its source. The checks are functions of `workflows/reproduce/slips.py`; "
        "a test makes them again and compares this page with their output.\n"
    ]
    for number, slip in enumerate(slips, start=1):
        correct = slip.correct or "as printed: it was suspected, and is right"
        parts.append(
            f"\n## {number}. {slip.where}\n\n- Printed: {slip.printed}\n- Correct: {correct}\n"
            f"- Evidence: {slip.evidence}\n"
        )
    return "".join(parts)
