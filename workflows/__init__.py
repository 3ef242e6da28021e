"""Running things: engines, accuracy, sweeps and the command line."""
