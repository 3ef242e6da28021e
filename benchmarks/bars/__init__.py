"""Are the error bars honest, and what are they measured by?"""
