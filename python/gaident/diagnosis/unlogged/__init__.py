"""Another controller than the given one as a hypothesis, where no torque is logged that shows what it made."""
