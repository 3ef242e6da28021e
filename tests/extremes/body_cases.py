"""Generate bad inputs with masses, targets, contacts and states from a seed."""

import math
from itertools import pairwise
from random import Random

from tests.extremes.cases import NASTY_NUMBERS, NASTY_TEXTS, Case, mutate, toml_text

_MASSES = (
    "1,2",
    "1,,2",
    ",",
    "1;2",
    "1,2\nshell touch pwned",
    "nan,1",
    "1,inf",
    "-1",
    "0,0",
    "1e-320,1",
    "1e308,1e308",
    "1,1e13",
    "\uff11,\uff12",
    "1_0",
    "masses.txt",
    "state.csv",
    "deep",
    ".",
    "/dev/zero",
    "absent.txt",
    "1," * 3000 + "1",
    "$(v_pwned)",
    *NASTY_TEXTS,
)
_STATES = (
    "position,velocity\n0,-0.1\n1,-0.1\n2,-0.1\n",
    "strain,velocity,mass\n0,-0.1,1\n0.01,-0.1,2\n0,-0.1,1\n",
    "strain\n0\n0.01\n-0.02\n",
    "position,velocity\n0,-0.1\n1,nan\n2,-0.1\n",
    "position\n0\n1\n1e308\n",
    "position,velocity\n0,0.1\n1,0.1\n2,0.1\n",
    '"posi\ntion"\n0\n1\n2\n',
    "strain;velocity\n0;1\n",
    "position\n-1\n0\n1\n",
    "position,mass\n0,1\n1,-1\n2,1\n",
    "position,velocity\n0\n1,2,3\n",
    "shell touch pwned\n",
    "",
)
_KEYS = (
    "masses",
    "target-particles",
    "target-masses",
    "contact",
    "contact-stiffness",
    "contact-exponent",
    "initial",
    "compression",
)
_FEW = 8.0


def body_case(number: int) -> Case:
    """Return the case with this number, which is always the same and, if valid, quick."""
    random = Random(number)
    while True:
        made = random.choices((_options, _file, _sweep), weights=(6, 3, 2))[0](random)
        if _affordable(made):
            return made


def _value(random: Random, key: str) -> str:
    if key.endswith("masses"):
        return random.choice((*_MASSES, *NASTY_NUMBERS))
    if key == "contact":
        return random.choice(("hard", "power", "power", "soft", "", "POWER", "1"))
    if key == "initial":
        return random.choice(("state.csv", "state.csv", "state.csv", "deep", "/dev/zero", "\x00"))
    return random.choice(NASTY_NUMBERS)


def _materials(random: Random) -> dict[str, bytes]:
    state = random.choice(_STATES).encode()
    masses = random.choice((b"1 2", b"1,2\n", b"", b"\xff\xfe1", b"one", b"nan", b"1\x002"))
    return {
        "state.csv": mutate(random, state) if random.random() < 0.5 else state,
        "masses.txt": mutate(random, masses) if random.random() < 0.3 else masses,
        "deep/file": b"",
        "taken": b"good",
    }


def _options(random: Random) -> Case:
    bond = random.choice(("lj", "harmonic", "toda"))
    words = ["run", "--particles", "3", "--tolerance", "1e-4", "--engine", "reference"]
    words += ["--potential", bond]
    for key in random.sample(_KEYS, random.randint(1, 4)):
        words += [f"--{key}", _value(random, key).replace("\x00", "")]
    outputs = []
    if random.random() < 0.2:
        outputs = [random.choice(("out.npz", "taken"))]
        words += ["--arrays", outputs[0]]
    if random.random() < 0.7:
        words.append("--json")
    return Case(tuple(words), _materials(random), tuple(outputs))


def _pair(random: Random, key: str) -> str:
    value = _value(random, key)
    key = key.replace("-", "_")
    kind = random.randrange(3)
    if kind == 0:
        return f"{key} = {toml_text(value)}\n"
    if kind == 1:
        return f"{key} = {random.choice(NASTY_NUMBERS)}\n"
    items = ", ".join(random.choice(NASTY_NUMBERS) for _ in range(random.randint(0, 3)))
    return f"{key} = [{items}]\n"


def _pairs(random: Random) -> str:
    return "".join(_pair(random, key) for key in random.sample(_KEYS, random.randint(1, 3)))


def _file(random: Random) -> Case:
    head = 'potential = "harmonic"\nparticles = 3\nengine = "reference"\ntolerance = 1e-4\n'
    text = (head + _pairs(random)).encode()
    if random.random() < 0.2:
        text = mutate(random, text)
    files = _materials(random) | {"scene.toml": text}
    return Case(("run", "scene.toml", *random.choice(((), ("--json",)))), files)


def _sweep(random: Random) -> Case:
    text = '[scene]\npotential = "harmonic"\nparticles = 3\nengine = "reference"\n'
    text += _pairs(random) + "[axes]\n" + _pairs(random)
    return Case(("sweep", "s.toml", "--dry-run"), _materials(random) | {"s.toml": text.encode()})


def _affordable(made: Case) -> bool:
    """Return whether targets are small and masses similar, so that a valid collision is quick."""
    texts = [
        made.files.get(name, b"").decode(errors="replace") for name in ("scene.toml", "s.toml")
    ]
    pairs = [line.partition("=")[::2] for text in texts for line in text.splitlines()]
    pairs += [(a[2:], b) for a, b in pairwise(made.arguments) if a.startswith("--")]
    for key, value in pairs:
        name = key.strip().replace("_", "-")
        if name not in ("target-particles", "particles", "contact-stiffness", "contact-exponent"):
            continue
        for word in value.strip().strip("[]").split(","):
            try:
                number = float(word)
            except ValueError:
                continue
            # More than 1e12 particles are refused at once. A contact may have any stiffness.
            most = math.inf if name == "contact-stiffness" else 1e12
            if _FEW < number <= most or 0.0 < number < 0.1:
                return False
    return True
