"""Templates of users, which extend the template of a job."""
