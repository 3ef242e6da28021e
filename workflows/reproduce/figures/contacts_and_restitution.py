"""Draw contacts and restitution against speed (NH figure 7), and the limit of hard spheres."""

from fractions import Fraction

import numpy as np

from chaincor.analysis.figures.style import BLACK, BLUE, VERMILION
from chaincor.workflows.reproduce.claims import TREND, ClaimFinding, claim, exact, words
from chaincor.workflows.reproduce.curve import Curve
from chaincor.workflows.reproduce.drawing import (
    IMPACT_SPEED,
    Axes,
    Figure,
    draw_points,
    point_record,
)
from chaincor.workflows.reproduce.figures.restitution_curves import (
    FALL,
    curves,
    describe_bars,
    describe_open,
)
from chaincor.workflows.reproduce.measurements import MeasuredPoint, Measurements, NoNumber, column

_KEY = "contacts_and_restitution"
_RISE = (0.16, "0.16, the rise of f(n)/n of lj chains here")
# The paper's words "near 1" mean this range, because claims in words have a margin of 10 %.
_AROUND_SCALE = (0.9, 1.1)


def run_hard_spheres(
    particles: int, gap: Fraction = Fraction(1, 7)
) -> tuple[list[Fraction], int, int]:
    """
    Follow hard spheres from event to event in exact arithmetic, until no event follows.

    Spheres of diameter 1 - gap start with velocity -1 at distances of 1, the first sphere at the
    wall. Between events, all spheres fly freely. At an event, two neighbours exchange their
    velocities, or sphere 1 reverses its velocity. Positions, velocities and times are rational
    numbers, so nothing is rounded.

    Return the final velocities, the number of contacts with the wall, and the number of exchanges.
    """
    # The spheres are reduced to points: i diameters are subtracted from the position of sphere i.
    positions = [gap * i for i in range(particles)]
    velocities = [Fraction(-1)] * particles
    contacts = exchanges = 0
    while True:
        # Event i is a collision of spheres i - 1 and i, and event 0 is a contact with the wall.
        waits = {}
        if velocities[0] < 0:
            waits[0] = -positions[0] / velocities[0]
        for i in range(1, particles):
            closing = velocities[i - 1] - velocities[i]
            if closing > 0:
                waits[i] = (positions[i] - positions[i - 1]) / closing
        if not waits:
            return velocities, contacts, exchanges
        wait = min(waits.values())
        positions = [x + v * wait for x, v in zip(positions, velocities, strict=True)]
        for event in (i for i, due in waits.items() if due == wait):
            if event == 0:
                velocities[0] = -velocities[0]
                contacts += 1
            else:
                velocities[event - 1 : event + 1] = velocities[event - 1 : event + 1][::-1]
                exchanges += 1


def _both_of_hard_spheres(measured: Measurements) -> tuple[ClaimFinding, ClaimFinding]:
    """Return eta and the number of contacts per particle, f/n, for hard spheres."""
    n = measured.plan.curve_particles
    velocities, contacts, exchanges = run_hard_spheres(n)
    mean = sum(velocities, Fraction(0)) / n
    vibration = sum(((v - mean) ** 2 for v in velocities), Fraction(0)) / 2
    text = (
        f"exact event-driven run in rational numbers, n = {n}: {contacts} contacts, {exchanges} "
        f"exchanges, energy of vibration {vibration}"
    )
    return ClaimFinding(float(mean * mean), 0.0, text), ClaimFinding(contacts / n, 0.0, text)


@claim("section III", exact(1.0), "hard spheres lose nothing", text="hard spheres: η = 1 exactly")
def _hard_spheres(measured: Measurements) -> ClaimFinding:
    return _both_of_hard_spheres(measured)[0]


@claim(
    "section III",
    exact(1.0),
    "hard spheres have n contacts",
    text="hard spheres: n contacts (as f/n)",
    key="hard-sphere contacts",
)
def _hard_sphere_contacts(measured: Measurements) -> ClaimFinding:
    return _both_of_hard_spheres(measured)[1]


@claim(
    "figure 7",
    TREND,
    "f(n)/n and η both rise at v*",
    text="both f(n)/n and η increase at v₀/v* ≈ 1",
    figure=_KEY,
)
def _rise_of_both(measured: Measurements) -> ClaimFinding:
    points = measured.select("curves", "lj")
    below = [p for p in points if p.speed <= _AROUND_SCALE[0]]
    above = [p for p in points if p.speed >= _AROUND_SCALE[1]]
    if not below or not above:
        raise NoNumber("no points on both sides of v*")
    slow, fast = below[-1], above[0]
    share = column(points, "contacts_per_particle")
    rising = (
        fast.contacts > slow.contacts,
        fast.restitution - slow.restitution > fast.error + slow.error,
    )
    lowest, low = float(min(share)), int(np.argmin(column(points, "restitution")))
    onset = next(p.speed for p in points[::-1] if p.contacts_per_particle == lowest)
    full = [p.speed for p in points if p.contacts == p.particles]
    return ClaimFinding(
        float(all(rising)),
        0.0,
        f"lj, {slow.speed:g} to {fast.speed:g} v*: f/n from {slow.contacts_per_particle:g} "
        f"to {fast.contacts_per_particle:g}, η from {slow.restitution:.3f} to "
        f"{fast.restitution:.3f}. f/n rises from its floor, {lowest:g}, beyond {onset:.2g} v*, η "
        f"from its minimum at {points[low].speed:.2g} v*"
        + (f"; f/n is 1 from {full[0]:.3g} v* on" if full else "")
        + ". We read the claim as a comparison of values just below and just "
        "above v*",
        points,
    )


@claim("section III, figure 7", words(1.0, *_RISE), "f(n)/n → 1 at high speed", figure=_KEY)
def _contacts_at_high_speed(measured: Measurements) -> ClaimFinding:
    fastest, text = _fastest(measured)
    return ClaimFinding(min(p.contacts_per_particle for p in fastest), 0.0, text, fastest)


@claim(
    "section III",
    words(1.0, *FALL),
    "η → 1 at high speed",
    key="high-speed limit",
    figure="restitution_curves",
)
def _high_speed_limit(measured: Measurements) -> ClaimFinding:
    fastest, text = _fastest(measured)
    error = max(p.error for p in fastest)
    return ClaimFinding(min(p.restitution for p in fastest), error, text, fastest)


def _fastest(measured: Measurements) -> tuple[list[MeasuredPoint], str]:
    """Return the fastest integrated chain for each bond, and a description of these chains."""
    # Results that were set equal to those of hard spheres are no evidence that chains approach hard
    # spheres.
    integrated = [[p for p in points if not p.is_limit] for points in curves(measured).values()]
    if not all(integrated):
        raise NoNumber("no points")
    fastest = [points[-1] for points in integrated]
    described = (f"{p.speed:.3g} v* ({p.scene.label}, {p.engine_name})" for p in fastest)
    return fastest, f"lowest of three, each at the fastest speed integrated: {', '.join(described)}"


def figure(measured: Measurements) -> Figure:
    """Return the figure of f(n)/n and eta against speed for the lj chain, on a common axis."""
    points = measured.select("curves", "lj")
    full = min((p.speed for p in points if p.contacts == p.particles), default=float("nan"))

    def draw(ax: Axes) -> None:
        eta = Curve.of(points, "speed", "restitution")
        draw_points(ax, eta, color=BLUE, label=r"restitution $\eta$", line=True)
        share = Curve(points, eta.x, column(points, "contacts_per_particle"), np.zeros_like(eta.x))
        label = r"contacts per particle $f(n)/n$"
        draw_points(ax, share, color=VERMILION, marker="s", label=label)
        ax.axhline(1.0, color=BLACK, linewidth=0.6)
        ax.set(xscale="log", xlabel=IMPACT_SPEED, ylabel=r"$\eta$ and $f(n)/n$")
        ax.legend(loc="lower left")

    return Figure(
        key=_KEY,
        title="Contacts per particle and restitution against speed",
        caption=(
            f"The paper's figure 7, lj, n = {measured.plan.curve_particles}. "
            f"Filled: LAMMPS; open: reference engine.{describe_open(points)} f/n reaches 1, "
            f"the value of hard spheres, at {full:.3g} v*. η rises with f/n and "
            "goes on rising beyond this speed. Error bars of η are smaller than "
            f"the symbols{describe_bars(points)}; f is a whole number."
        ),
        alt=(
            "f/n falls from 0.87 to 0.84 and rises from 0.7 v* on to 1 at 1.8 v*; η has its "
            "minimum at 0.82 v*, rises steeply from 1.1 to 3 v*, and ends near 1."
        ),
        draw=draw,
        records=[point_record(p) for p in points],
    )
