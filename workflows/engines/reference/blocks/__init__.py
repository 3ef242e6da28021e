"""Long chains on several cores: overlapping blocks, synchronised once in many substeps."""
