"""The paper: Map, CPO, PPO and their loop."""
