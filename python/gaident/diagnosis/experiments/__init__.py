"""What a record excites, and which experiment to make."""
