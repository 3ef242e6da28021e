"""Warm chains against theorems of statistical mechanics, and how fast ensembles of them are."""
