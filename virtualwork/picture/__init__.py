"""Pictures of a mechanism: drawn to scale in its poses, its quantities and forces as curves over the input."""
