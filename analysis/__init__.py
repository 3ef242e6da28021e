"""
Analysis of results, without LAMMPS.

The modules ``restitution``, ``contacts``, ``modes``, ``theory`` and ``pair_theory`` hold pure
functions of arrays. ``dumps`` streams dumps and converts them for ASE and MDAnalysis,
``job_folder`` finds the files of a job, and ``job_analysis`` analyses its dump. ``results``,
``analysis_files`` and ``figures`` hold results.
"""
