"""Parts of a scene: fields, rules, bodies, and the canonical form that identifies a scene."""
