"""Draw series of runs at decreasing step with known errors, without the code that judges them."""

import numpy as np
from scipy.signal import lfilter

# For each kind of series, the order that the verdict must name, or None if it must name none.
ORDERS = {
    "order 1": 1.0,
    "order 2": 2.0,
    "order 4": 4.0,
    "order 1, large next term": 1.0,
    "order 2, large next term": 2.0,
    "irregular, bounded": 1.0,
    "irregular, long tails": 1.0,
    "noise": None,
    "noise of shorter runs": None,
    "order 2 in noise": 2.0,
    "order 2 in strong noise": 2.0,
    "order 2 and irregular": None,
    "irregular and noise": None,
}
# For each kind, these verdicts would be wrong, not just imprecise.
WRONG = {
    **dict.fromkeys([k for k in ORDERS if k.startswith("order")], ("noise",)),
    **dict.fromkeys([k for k in ORDERS if k.startswith("irregular")], ("regular",)),
    **dict.fromkeys([k for k in ORDERS if k.startswith("noise")], ("regular", "irregular")),
}
SPAN = 20.0


def draw(kind, rungs, columns, random):
    """Return the steps, the results and the exact limit of one series of runs."""
    steps = SPAN ** (-np.arange(rungs) / (rungs - 1))
    h = steps[:, None] * random.uniform(0.98, 1.02, (rungs, columns))
    reference_value, sign = random.normal(), random.choice([-1.0, 1.0])
    next_power, chance = random.choice([1, 2]), random.normal(size=h.shape)
    if kind in ("order 1", "order 2", "order 4"):
        bent = 1.0 + 1e-3 * random.uniform(-1.0, 1.0) * h**next_power
        tiny = 10.0 ** random.uniform(-11.0, -7.0)
        return (
            h,
            reference_value + sign * 1e-2 * h ** int(kind[6]) * bent + tiny * chance,
            reference_value,
        )
    if kind.endswith("large next term"):
        bent = 1.0 + 0.3 * random.uniform(-1.0, 1.0) * h**next_power
        tiny = 10.0 ** random.uniform(-11.0, -7.0)
        return (
            h,
            reference_value + sign * 1e-2 * h ** int(kind[6]) * bent + tiny * chance,
            reference_value,
        )
    jumps = random.uniform(-1.0, 1.0, h.shape)
    errors = {
        "irregular, bounded": 1e-3 * h * (jumps + random.uniform(-0.5, 0.5)),
        "irregular, long tails": 1e-3 * h * random.standard_t(4, h.shape),
        "noise": 1e-3 * chance,
        "noise of shorter runs": 1e-3 * h**-0.5 * chance,
        "order 2 in noise": sign * 1e-2 * h**2 + 1e-3 * chance,
        "order 2 in strong noise": sign * 1e-2 * h**2 + 5e-3 * chance,
        "order 2 and irregular": sign * 1e-2 * h**2 + 1e-3 * h * jumps,
        "irregular and noise": 1e-3 * h * jumps + 2e-4 * chance,
    }
    return h, reference_value + errors[kind], reference_value


def autoregressive(count, correlation_time, random):
    """Return a series of mean 0 and variance 1, correlated as exp(-k/correlation_time)."""
    memory = np.exp(-1.0 / correlation_time) if correlation_time else 0.0
    noise = random.normal(size=count) * np.sqrt(1.0 - memory**2)
    noise[0] /= np.sqrt(1.0 - memory**2)
    return lfilter([1.0], [1.0, -memory], noise)
