"""Judge of stiffening contacts; the other judges are in `tests/judge/`."""
