"""What a person decides about measured trees: kept beside the measured values, used by every later verb."""
