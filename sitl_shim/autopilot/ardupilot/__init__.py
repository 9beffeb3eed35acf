"""ArduCopter 4.7-dev, as far as an attitude-flying companion and ground stations meet it."""
