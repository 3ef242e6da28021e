"""Random scenes for studies of error bars and for judges."""
