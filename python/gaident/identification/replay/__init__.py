"""Whether the logged torques follow from their controller: it is run again on the log, without a plant."""
