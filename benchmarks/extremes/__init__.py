"""The edges of what can be asked: is every answer right, or a clear refusal?"""
