"""The commands of ``chaincor``, one module each."""
