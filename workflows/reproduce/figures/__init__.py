"""Draw the paper's figures and further figures. Each module has one figure and its claims."""
