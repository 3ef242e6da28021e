"""Many chains before a hard wall, carried out in one compiled loop: a batch."""
