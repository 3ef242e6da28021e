"""Run collisions, sweeps and checks, with an engine, a target accuracy and a command line."""
