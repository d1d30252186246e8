"""Pictures of rigid bodies: their parts in two views, a shaft with the forces of its bearings, rotation in time."""
