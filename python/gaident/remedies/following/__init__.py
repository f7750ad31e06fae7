"""How a loop follows its command in the simulation, without and with the torque of the feedforward tables."""
