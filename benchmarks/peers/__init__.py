"""Compare the engines with integrators of other authors, as ratios from one run."""
