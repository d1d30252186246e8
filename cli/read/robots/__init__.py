"""Robot files: URDF, SDF and MJCF as links, joints and inertias in space."""
