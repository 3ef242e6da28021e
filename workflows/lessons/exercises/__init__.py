"""The exercises of each lesson: what is asked, the truth, and usual mistakes."""
