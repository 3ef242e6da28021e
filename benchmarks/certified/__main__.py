"""
Prove the table of restitutions, or only the named rows.

    python -m benchmarks.certified [NAME ...] [--jobs 2]

Each row is written to ``table.json`` as soon as it is proved. The restitution for the exact initial
data of a row lies within `radius` of `middle`.
"""

import argparse
import json
import math
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict

from benchmarks.certified.collision import certify
from benchmarks.certified.flow import NotProvedError
from benchmarks.certified.table import CASES, TABLE, Case, Row, read_table


def prove(case: Case) -> Row:
    """Prove a case, and return its row of the table."""
    started = time.process_time()
    found = certify(
        case.potential,
        case.velocity,
        case.masses,
        wall_mass=case.target_mass,
        digits=case.digits,
    )
    # The middle has all proved digits, and three more for the radius.
    proved = -math.log10(float(found.restitution.rad() / found.restitution.mid()))
    middle, radius, exponent = found.restitution.mid_rad_10exp(int(proved) + 3)
    return Row(
        case=case.name,
        middle=f"{middle}e{exponent}",
        radius=f"{radius}e{exponent}",
        contacts=found.contacts,
        last_contact_time=float(found.last_contact_time.mid()),
        steps=found.steps,
        seconds=round(time.process_time() - started, 1),
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Prove the rows, and write the table."""
    parser = argparse.ArgumentParser(description="Prove the table of restitutions.")
    parser.add_argument("names", nargs="*", help="rows; all of them where none is named")
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(arguments)
    unknown = set(options.names) - {case.name for case in CASES}
    if unknown:
        parser.error(f"no row {', '.join(sorted(unknown))}; known: {[c.name for c in CASES]}")
    wanted = [case for case in CASES if not options.names or case.name in options.names]
    rows = {row.case: row for row in read_table()}
    with ProcessPoolExecutor(options.jobs) as pool:
        proofs = {pool.submit(prove, case): case for case in wanted}
        for proof in as_completed(proofs):
            name = proofs[proof].name
            try:
                row = rows[name] = proof.result()
            except NotProvedError as error:
                print(f"{name}: not proved: {error}", flush=True)
                continue
            print(
                f"{name}: {row.digits} digits, {row.contacts} contacts, {row.seconds} s", flush=True
            )
            kept = [asdict(rows[case.name]) for case in CASES if case.name in rows]
            TABLE.write_text(json.dumps(kept, indent=1) + "\n")


if __name__ == "__main__":
    main()
