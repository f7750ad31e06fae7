"""What was found, in torque, curves and sentences."""
