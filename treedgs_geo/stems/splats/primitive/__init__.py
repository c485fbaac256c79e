"""The stem primitive: a leaning, tapering cone with a texture, searched for and fitted."""
