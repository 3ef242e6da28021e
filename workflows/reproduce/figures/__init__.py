"""Draw the figures of the paper and figures beyond it, one module each with its claims."""
