"""
Analysis of results, without LAMMPS.

Pure functions of arrays: ``restitution``, ``contacts``, ``modes``, ``theory``, ``pair_theory``.
From files: ``dumps`` (any dump, streamed; ASE and MDAnalysis, from and to), ``job_folder`` (which
files a job has), ``job_analysis`` (its dump, analysed). Results: ``results``, ``analysis_files``,
``figures``.
"""
