"""Tests of warm chains by theorems of statistical mechanics, and the speed of ensembles."""
