"""The Gaussian field: rasteriser, training, sampling with opacity reliability."""
