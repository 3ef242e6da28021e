"""Hold the commands of ``chaincor``, one module each."""
