"""Templates of a user's own, which extend that of a job."""
