"""Held speeds: where a record holds one, the torque that they take, and the law of friction behind them."""
