"""Check the slips of the paper's section III, on nonlinear chains."""

import math
from collections.abc import Callable

import numpy as np

from chaincor.analysis.modes import mode_frequencies
from chaincor.analysis.pair_theory import pair_interval_slope
from chaincor.analysis.restitution import restitution
from chaincor.analysis.theory import PAIR_INTERVAL, basile_dumont_energies
from chaincor.lammps_inputs.bonds.potentials import LennardJones, Logarithmic, Toda
from chaincor.lammps_inputs.scene import Scene
from chaincor.workflows.engines.reference import modal
from tests.workflows.reproduce.slips.slip import Kind, Matters, Slip

# Coefficient in the paper for the shorter interval of two lj particles, eq. (15).
PAPER_ALPHA = 0.808


def nonlinear_slips() -> tuple[Slip, ...]:
    """Return the slips of section III."""
    checks: tuple[Callable[[], Slip], ...] = (
        _zero_of_energy,
        _scale_equation,
        _wall_frequency,
        _bond_argument,
        _alpha,
        _dropped_speed,
        _mode_energy_power_of_pi,
        _integrand,
        _rounded_constant,
        _toda_has_no_core,
    )
    return tuple(check() for check in checks)


def _zero_of_energy() -> Slip:
    b = 10.0

    def printed(x: float) -> tuple[float, float, float]:
        lj = (x**-12 - 2.0 * x**-6) / 72.0
        toda = math.exp(-b * (x - 1.0)) / b**2 + (x - 1.0) / b
        return lj, toda, x - math.log(x)

    lj, toda, log = printed(1.0)
    # With added constants, the printed energies are those of the package's bonds, also at other
    # lengths.
    bonds, added = (LennardJones(), Toda(b), Logarithmic()), (1.0 / 72.0, -1.0 / b**2, -1.0)
    corrected = all(
        abs(value + shift - float(bond.energy(np.array(x - 1.0)))) < 1e-14
        for x in (0.9, 1.0, 1.2)
        for value, shift, bond in zip(printed(x), added, bonds, strict=True)
    )
    return Slip(
        "section III, potentials (a)–(c)",
        "U(1) = 0, but the printed potentials are not zero there",
        "add 1/72 (lj), −a/b (toda), −1 (log)",
        f"U(1) is {lj:.5f}, {toda:g}, {log:g}",
        min(abs(lj), abs(toda), abs(log)) > 1e-3 and corrected,
    )


def _scale_equation() -> Slip:
    """Show that without the shift, the printed equation for x* has another root, or none."""
    bond = LennardJones()
    strains = np.linspace(-0.4, -1e-3, 4000)
    printed = bond.energy(strains) - 1.0 / 72.0 - strains**2
    roots = int(np.count_nonzero(np.diff(np.sign(printed))))
    place = float(strains[np.flatnonzero(np.diff(np.sign(printed)))[-1]]) if roots else math.nan
    assert bond.compressed_root is not None
    other = abs(1.0 + place - bond.compressed_root)
    return Slip(
        "section III, definition of x*",
        "½U″(1)(x* − 1)² = U(x) − ½U″(1)(x* − 1)²",
        "U(x*) on the right, and U shifted to U(1) = 0",
        f"lj: x* = {bond.compressed_root:.4f} with the shifted U, {1.0 + place:.4f} with the "
        "printed U",
        other > 1e-3,
    )


def _wall_frequency() -> Slip:
    """Show that modes are excited although the wall's frequency is above all of theirs."""
    n = 500
    outcome = modal.run(Scene(potential="harmonic", particles=n, velocity=0.1).problem)
    frequency = 2.0 * math.pi / float(np.mean(np.diff(outcome.contact_times)))
    highest = float(mode_frequencies(n)[-1])
    lost = 1.0 - float(restitution(outcome.velocities, 0.1))
    return Slip(
        "section III, before eq. (13)",
        "2π/Δt lies above all modes; hence no mode is excited",
        "the conclusion does not follow: the force of the wall is a train of pulses of one sign "
        "and finite duration, so it has a large low-frequency part",
        f"harmonic, n = {n}: 2π/Δt = {frequency:.2f}, the highest mode has {highest:.2f}, but "
        f"1 − η = {lost:.4f} of the energy ends in modes",
        frequency > highest and lost > 1e-3,
        matters=Matters.STATEMENT,
    )


def _bond_argument() -> Slip:
    value = float(LennardJones().energy(np.array(-0.999)))
    return Slip(
        "eq. (13), Hamiltonian of n = 2",
        "U_LJ(x₂ − x₁ − 1)",
        "U_LJ(x₂ − x₁): U is a function of the length, with its minimum at 1",
        f"at rest the printed argument is 0, where U is infinite (U(0.001) = {value:.0e}); "
        "the results are right",
        value > 1e30,
    )


def _alpha() -> Slip:
    bond = LennardJones()
    alpha, speed = pair_interval_slope(bond), bond.natural_speed
    assert speed is not None
    return Slip(
        "eq. (15)",
        "α = 0.808",
        f"α = {alpha:.4f}",
        "first-order perturbation in closed form, and the limit of LAMMPS at n = 2. The printed α "
        f"is {100.0 * (1.0 - PAPER_ALPHA / alpha):.1f} % too small: v* = 0.1282 instead of "
        f"{speed:.4f} would give {alpha * 0.1282 / speed:.4f}",
        abs(alpha - 0.8098) < 1e-4,
    )


def _dropped_speed() -> Slip:
    alpha, v, terms = pair_interval_slope(LennardJones()), 1e-3, np.arange(1.0, 2e6)
    series = float(np.sum(np.sin(np.pi * alpha * v * terms) ** 2 / terms**2))
    slope = 8.0 / math.pi**2 * series / v
    return Slip(
        "eqs. (16), (18)",
        "E_j without the factor v², C = 32α/π²",
        "v² = (π²/8) v₀² as in eqs. (7) and (10); then C = 4α = 3.24",
        f"(8/π²) Σ sin²(παvj)/j² at v = v₀/v* = {v:g}: {slope:.2f} v; 4α = {4.0 * alpha:.2f}",
        abs(slope - 4.0 * alpha) < 0.02,
        matters=Matters.NUMBER,
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
        f"ratio to the unexpanded formula at n = {n}, j = {j}, v = {v}: {corrected / exact:.2f} "
        f"with π⁴, {printed / exact:.1f} with π². The next line, 64/(nπ⁴), is right",
        abs(corrected / exact - 1.0) < 0.05 < abs(printed / exact - 1.0),
    )


def _integrand() -> Slip:
    from scipy.integrate import quad

    alpha = PAPER_ALPHA
    # The integral is taken up to 200, with the mean of its tail beyond.
    integral = quad(lambda y: np.sinc(y / np.pi) ** 2, 0.0, 200.0, limit=500)[0] + 0.5 / 200.0
    constant = 64.0 * alpha / math.pi**3 * integral
    literal_first = constant / math.pi
    literal_second = constant * alpha
    return Slip(
        "eq. (18)",
        "sin²(αvnx), then ∫ sin²(αx)/x² dx",
        "sin²(παvnx), then ∫ sin²(x)/x² dx = π/2",
        f"the first printed line gives C = {literal_first:.2f}, the second {literal_second:.2f}; "
        f"the corrected lines give {constant:.2f}, which is 32α/π² with α = {PAPER_ALPHA}",
        abs(constant - 32.0 * alpha / math.pi**2) < 1e-3,
        kind=Kind.FOLLOWS,
    )


def _rounded_constant() -> Slip:
    value = 32.0 * PAPER_ALPHA / math.pi**2
    return Slip(
        "eq. (18)",
        "C = 32α/π² ≃ 2.61",
        "2.62 with the paper's own α = 0.808",
        f"32 × {PAPER_ALPHA}/π² = {value:.2f}",
        round(value, 2) == 2.62,
        kind=Kind.FOLLOWS,
    )


def _toda_has_no_core() -> Slip:
    """Compare the three bonds at length zero."""
    bond = Toda(10.0)
    height = float(bond.energy(np.array(-1.0)))
    speed = bond.natural_speed
    assert speed is not None
    # Near length zero, x^(-12) and -ln x grow without bound.
    others = [
        float(other.energy(np.array(-1.0 + length)))
        for other, length in ((LennardJones(), 1e-15), (Logarithmic(), 1e-15))
    ]
    # Two particles that approach each other at v0 each have a relative energy of v0².
    crossing = math.sqrt(height) / speed
    return Slip(
        "section III, last paragraphs",
        "U_LJ, U_toda and U_log all behave like hard cores, so that η → 1 at high speed",
        "U_toda is finite at x = 0, so fast particles overlap, turn round, and have still "
        "exchanged momenta. η → 1 holds up to 10 v*; higher speeds were not computed",
        f"U_toda(0) = {height:.1f} (b = 10): two particles of speed v₀ each overlap above "
        f"{crossing:.1f} v*; U_LJ ∝ x^(−12) and U_log ∝ −ln x have no bound",
        math.isfinite(height) and height < 1e3 and others[0] > 1e100 and others[1] > 30.0,
        kind=Kind.REMARK,
    )
