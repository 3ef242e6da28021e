"""
Results to physics. Needs no LAMMPS.

Pure functions of arrays: ``restitution``, ``contacts``, ``modes``, ``theory``, ``pair_theory``.
From files: ``dumps`` (any dump, streamed), ``job`` (a folder, found and analysed), ``universe``
(MDAnalysis), ``exports`` (ASE, extended XYZ). Results: ``results``, ``report``, ``figures``.
"""
