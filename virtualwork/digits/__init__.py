"""The digits that hold: motions and forces computed a second time, in numbers of 32 digits."""
