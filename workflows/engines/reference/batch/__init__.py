"""Many chains before a hard wall in one compiled loop."""
