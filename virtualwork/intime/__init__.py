"""Motion under forces: the inputs are free, and virtual work with d'Alembert's forces is their equation of motion."""
