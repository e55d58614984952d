"""The robot's description, joint branches and kinematics."""
