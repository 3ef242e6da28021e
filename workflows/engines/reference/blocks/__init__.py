"""Long chains on several cores: blocks that overlap, and meet once in many substeps."""
