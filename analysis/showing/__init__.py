"""Results shown to people: digits that are known, and where they are shown."""
