"""Where stems may stand: edge voting, the network's seeds."""
