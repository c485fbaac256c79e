"""The verbs that only the lab has: simulate-plot and benchmark."""
