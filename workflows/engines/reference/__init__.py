"""Reference engine, with four methods: fixed steps, adaptive steps, modes and hard spheres."""
