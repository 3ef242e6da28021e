"""
Results to physics. Needs no LAMMPS.

Pure functions of arrays: ``restitution``, ``contacts``, ``modes``, ``theory``, ``pair_theory``.
From files: ``dumps`` (any dump, streamed; ASE and MDAnalysis, from and to), ``job_folder`` (a
folder, found and analysed). Results: ``results``, ``analysis_files``, ``figures``.
"""
