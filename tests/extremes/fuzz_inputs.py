"""
Give bad inputs to every command, and check for a result or a message of one line.

    python -m tests.extremes.fuzz_inputs [--cases 20000] [--processes 200] [--workers 2]
        [--bodies]

Prints the numbers of inputs that gave a result, were refused (exit status 2) or failed with a named
error (exit status 1). It also prints every fault: a traceback, a hang, a printed NaN, a message of
more than one line, an unexpected file, or a damaged file.
"""

import argparse
import multiprocessing
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Any

from tests.extremes.body_cases import body_case
from tests.extremes.cases import case
from tests.extremes.judging import HANG_SECONDS, Answer, call_as_process, call_in_process, faults

_CHUNK = 20
# Case number, whether it ran as a process, command, seconds, exit status, faults.
_Tried = tuple[int, bool, str, float, int | None, list[str]]
# Cases from this number on have masses, targets, contacts and states.
_BODIES = 1_000_000_000


def _try(job: tuple[int, bool]) -> _Tried:
    number, as_process = job
    made = case(number) if number < _BODIES else body_case(number - _BODIES)
    answer: Answer = (call_as_process if as_process else call_in_process)(made)
    command = made.arguments[0] if made.arguments else "-"
    return number, as_process, command, answer.seconds, answer.status, faults(made, answer)


def _try_all(jobs: Sequence[tuple[int, bool]]) -> list[_Tried]:
    return [_try(job) for job in jobs]


def _as_they_come(pool: Any, jobs: Sequence[tuple[int, bool]]) -> Iterator[_Tried]:
    """Yield results as they come; report a hang in compiled code, which no alarm interrupts."""
    chunks = [jobs[k : k + _CHUNK] for k in range(0, len(jobs), _CHUNK)]
    missing = set(jobs)
    results = pool.imap_unordered(_try_all, chunks)
    for _ in chunks:
        try:
            tried = results.next(2 * _CHUNK * HANG_SECONDS)
        except multiprocessing.TimeoutError:
            first = sorted(number for number, _ in missing)[: 2 * _CHUNK]
            raise SystemExit(f"hang: nothing ends any more; one of the cases {first}") from None
        missing -= {(number, as_process) for number, as_process, *_ in tried}
        yield from tried


def main() -> None:
    """Run the cases and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=20_000)
    parser.add_argument("--processes", type=int, default=200, help="as real processes")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--first", type=int, default=0, help="number of the first case")
    parser.add_argument(
        "--bodies", action="store_true", help="masses, targets, contacts and states"
    )
    options = parser.parse_args()

    first = options.first + (_BODIES if options.bodies else 0)
    numbers = range(first, first + options.cases)
    jobs = [(number, False) for number in numbers]
    jobs += [(number, True) for number in numbers[: options.processes]]
    statuses: Counter = Counter()
    bad, slowest = 0, (0.0, -1)
    with multiprocessing.get_context("spawn").Pool(options.workers, maxtasksperchild=200) as pool:
        for number, _, command, seconds, status, found in _as_they_come(pool, jobs):
            statuses[command if command in _COMMANDS else "other", status] += 1
            slowest = max(slowest, (seconds, number))
            for fault in found:
                print(f"case {number} ({command}, {seconds:.1f} s): {fault}", flush=True)
            bad += bool(found)
    print(f"\n{'command':10} {'answered':>9} {'refused':>9} {'failed by name':>15} {'other':>6}")
    for command in (*_COMMANDS, "other"):
        counts = [statuses[command, status] for status in (0, 2, 1)]
        rest = sum(n for (name, status), n in statuses.items() if name == command) - sum(counts)
        print(f"{command:10} {counts[0]:9} {counts[1]:9} {counts[2]:15} {rest:6}")
    print(f"{len(jobs)} calls, {bad} with a fault; the slowest took {slowest[0]:.1f} s", end="")
    print(f" (case {slowest[1]})")
    raise SystemExit(1 if bad else 0)


_COMMANDS = ("run", "inputs", "analyze", "validate", "sweep", "show", "store")

if __name__ == "__main__":
    main()
