"""Many mechanisms: variants, sensitivities, tolerances, fitting."""
