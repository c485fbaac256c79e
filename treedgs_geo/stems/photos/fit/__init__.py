"""One hypothesis fitted to the photos: search, sub-pixel adjustment, selection among several."""
