"""What the photos say about a fitted stem besides its edges, and the error of its diameter."""
