"""The engines against other people's, as ratios from one run."""
