"""How compiled loops are kept between processes, and what these have to do with each other."""
