"""The logged torque against the controller: its replay, and what explains a difference."""
