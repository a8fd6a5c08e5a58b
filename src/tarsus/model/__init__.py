"""What a scene is made of: laws, structures, drives; robot, ground, scene. Frozen descriptions of physical things."""
