"""Contact laws, which give the force between two touching bodies; one file per law."""
