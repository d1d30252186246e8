"""Robots from files (URDF, SDF, MJCF): links with their inertias, joints, what ties and drives them; checks of inertias."""
