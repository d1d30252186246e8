"""What files of robots (URDF, SDF, MJCF) share, and what `dalembert export` writes there and `dalembert import` recognizes."""

from __future__ import annotations

WORLD = "world"
# the entries of an inertia tensor, in the order in which URDF and SDF print them
ROWS = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
# of the heaviest link: the mass of a link without mass, where a format requires one
LIGHT = 1e-6
# how the massless bodies are called that slots become
BLOCK = "block "
# elements of SDF: marks on numbers that the format asks for and the mechanism does not have
MASSLESS, POINT_MASS, INERTIA_ALONE = "massless", "point_mass", "inertia_alone"
