"""
Analysis of results, without LAMMPS.

The modules ``restitution``, ``contacts``, ``modes``, ``theory`` and ``pair_theory`` contain pure
functions of arrays. ``dumps`` reads dumps frame by frame and converts them for ASE and MDAnalysis,
``job_folder`` finds the files of a job, and ``job_analysis`` analyses its dump. ``results`` defines
the results, ``analysis_files`` writes them, and ``figures`` draws them.
"""
