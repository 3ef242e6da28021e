"""The declarations of observables, by what they are about."""
