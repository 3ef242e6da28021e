"""
Fuzz all kinds of files in turn for a given time, and print each finding and the sizes reached.

Files with findings are kept in ``tests/fuzz/found``, from where the tests try them again.

    python -m tests.fuzz MINUTES [KIND ...]
"""

import sys
import time
from collections import Counter

from hypothesis.errors import FlakyFailure

from tests.fuzz.fuzzing import fuzz_files, fuzz_lines
from tests.fuzz.subjects import subjects

_AT_ONCE = 25


def main() -> None:
    """Fuzz until the time is over; exit with status 1 after a finding."""
    minutes, kinds = float(sys.argv[1]), sys.argv[2:]
    end, number = time.monotonic() + 60.0 * minutes, int(time.time())
    tried: Counter = Counter()
    findings = 0
    chosen = kinds or [*subjects(), "command line"]
    while time.monotonic() < end:
        for kind in chosen:
            number += 1
            try:
                if kind == "command line":
                    fuzz_lines(4 * _AT_ONCE, number, tried)
                else:
                    fuzz_files(subjects()[kind], _AT_ONCE, number, tried, keep=True)
            except (AssertionError, FlakyFailure) as error:
                findings += 1
                print(f"FINDING {error}"[:2000], flush=True)
            if time.monotonic() > end:
                break
    for kind in chosen:
        counts = {status: n for (name, status), n in tried.items() if name == kind}
        print(f"{kind:<18} {sum(counts.values()):>7} calls, by exit status {counts}")
    print(f"{sum(tried.values())} calls, {findings} findings")
    raise SystemExit(1 if findings else 0)


if __name__ == "__main__":
    main()
