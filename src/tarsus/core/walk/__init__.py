"""The engine of walkers: a rigid body on legs, each leg exact for itself, coupled through the body alone."""
