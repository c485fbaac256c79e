"""The chain behind ``photos-to-dbh``: geotags -> cameras -> ground -> stems -> tree layer, in a resumable workspace."""
