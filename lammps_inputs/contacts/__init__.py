"""Contact laws: how two bodies repel each other where they touch, one file for each law."""
