"""What a scene is made of: its fields, their rules, its bodies, and what makes two alike."""
