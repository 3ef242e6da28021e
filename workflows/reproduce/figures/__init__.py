"""The figures of the paper, and those beyond it: one a module, with its claims."""
