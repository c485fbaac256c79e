"""What the photos show: crops, rectified images, patches along an axis, the background, the sun, sharpness."""
