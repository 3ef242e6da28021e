"""Long chains on several cores, in overlapping blocks that synchronise once in many substeps."""
