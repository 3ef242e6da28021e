"""Lesson 1: what a coefficient of restitution is."""

from chaincor.workflows.lessons.exercise import Exercise, Mistake
from chaincor.workflows.lessons.exercises.in_house import in_house

_LINEAR = "springs are linear: all displacements double, and no ratio changes"


def _eta(particles: int = 10, velocity: float = 0.1) -> float:
    return in_house(potential="harmonic", particles=particles, velocity=velocity).restitution


def _e() -> float:
    return in_house(potential="harmonic", particles=10, velocity=0.1).kinematic_restitution


EXERCISES = {
    1: Exercise(
        "two numbers: eta of one particle, and of two joined by a spring",
        lambda: [_eta(1), _eta(2)],
        (
            Mistake(
                lambda: [0.0, 0.0],
                "the wall takes no energy: a single particle comes back as fast as it came",
            ),
            Mistake(
                lambda: [1.0, 0.5],
                "the spring does not keep half of it: follow it through half a period, at whose "
                "end it has its natural length again and both particles are equally fast",
            ),
            Mistake(
                lambda: [1.0, 0.0],
                "two particles do not stick: the wall gives momentum as long as the spring pushes",
            ),
            Mistake(
                lambda: [1.0, _eta()],
                "that is the chain of ten; work two particles out by hand",
            ),
        ),
    ),
    2: Exercise(
        "one number: the share of the translational energy that went into vibration",
        lambda: 1.0 - _eta(),
        (
            Mistake(_eta, "this is eta, the share that came back; the question is what did not"),
            Mistake(_e, "this is e, the share of the speed that came back"),
            Mistake(
                lambda: 1.0 - _e(),
                "this is the loss of speed; energy goes with the square of the speed: eta = e^2",
            ),
            Mistake(
                lambda: (1.0 - _e()) ** 2,
                "square the speed first and subtract then: 1 - e^2, not (1 - e)^2",
            ),
            Mistake(
                lambda: 1.0 - _e() ** 0.5,
                "the square, not the root: energy goes with the square of the speed",
            ),
        ),
    ),
    3: Exercise(
        "one number: the momentum that the wall gave, in units of n v0",
        lambda: 1.0 + _e(),
        (
            Mistake(
                lambda: 1.0 - _e(),
                "mind the sign: the velocity goes from -v0 to +e v0, and the difference is larger "
                "than v0",
            ),
            Mistake(
                lambda: 2.0, "that is a chain which keeps all of its energy; this one does not"
            ),
            Mistake(
                lambda: 1.0 + _eta(),
                "this adds an energy to a momentum: momentum goes with e, not with eta",
            ),
            Mistake(
                _e, "this is the momentum of the leaving chain; the wall also stopped it first"
            ),
            Mistake(
                lambda: 10.0 * (1.0 + _e()),
                "this is in units of v0: divide it by the number of particles, too",
            ),
            Mistake(lambda: 1.0, "the wall does more than stop the chain: it sends it back"),
        ),
    ),
    4: Exercise(
        "one number: eta of the same chain of springs at twice the velocity",
        lambda: _eta(velocity=0.2),
        (
            Mistake(
                lambda: 1.0 - 4.0 * (1.0 - _eta()),
                "the lost energy is four times as large, but so is the energy that came",
            ),
            Mistake(lambda: 1.0 - 2.0 * (1.0 - _eta()), _LINEAR),
            Mistake(lambda: 1.0 - 0.5 * (1.0 - _eta()), _LINEAR),
            Mistake(_e, "this is e, the ratio of speeds; asked is eta = e^2, that of energies"),
        ),
    ),
}
