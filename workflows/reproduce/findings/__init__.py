"""What the measurements say: the numbers that verdicts are passed on."""
