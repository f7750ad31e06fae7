"""Records as a model is driven by them: their torque, their angle, and windows of long ones."""
