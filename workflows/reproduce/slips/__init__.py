"""The paper's slips: what is printed, what is right, and a check of each."""
